// State shared by the kernels that build a grid and by the CPU. Shared by GLSL and C++.
#ifndef CM_GRID_STATE_GLSL
#define CM_GRID_STATE_GLSL

#define CM_ROOTS 24u
#define CM_SPLIT_LEVELS 52u    // for the largest possible cube
#define CM_PRIORITIES 65536u

struct CmGridState {
  uint cut;       // cells of this priority and above split
  uint cells;     // number of cells of the grid
  uint limited;   // 1: the budget, not the threshold, ended the refinement
  uint low[3];    // bounds of the cells with density, in voxels
  uint high[3];
  uint added[CM_SPLIT_LEVELS];   // number of cells that the splits of a level add
  uint split;                    // number of cells found to split; leaves: found to be leaves
  uint leaves;
  uint glowing;                  // number of emissive cells
};

#endif
