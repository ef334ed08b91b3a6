// What the kernels that build a grid tell each other, and the CPU. Shared by GLSL and C++.
#ifndef CM_GRID_STATE_GLSL
#define CM_GRID_STATE_GLSL

#define CM_ROOTS 24u
#define CM_SPLIT_LEVELS 52u    // of the largest cube that there can be
#define CM_PRIORITIES 65536u

struct CmGridState {
  uint cut;       // what has this priority splits, and what has more
  uint cells;     // of the grid
  uint limited;   // 1: the budget, not the threshold, ended the refinement
  uint low[3];    // box of the cells that have density, in voxels
  uint high[3];
  uint added[CM_SPLIT_LEVELS];   // cells that the splits of a level add
  uint split;                    // cells that have been found to split, and to be leaves
  uint leaves;
  uint glowing;                  // cells that give off light
};

#endif
