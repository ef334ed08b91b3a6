// The tile's pixels in blocks, of which a dispatch has some, and blocks in squares, of which each half (its even and its
// odd rows) is sampled or is not. Shared by GLSL and C++.
#ifndef CM_PATH_BLOCKS_GLSL
#define CM_PATH_BLOCKS_GLSL

#define CM_BLOCK_WIDTH 128u
#define CM_BLOCK_HEIGHT 8u
#define CM_SQUARE_EDGE 8u
#define CM_MOST_BLOCKS 256u    // of a tile
#define CM_BEGINS 0x80000000u  // with a block's number: a pass begins

#endif
