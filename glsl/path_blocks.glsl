// The lanes of a tile in blocks, of which a dispatch has some; and the tile's pixels in squares, of which those that are
// sampled are in a list. Shared by GLSL and C++.
#ifndef CM_PATH_BLOCKS_GLSL
#define CM_PATH_BLOCKS_GLSL

#define CM_BLOCK_LANES 1024u
#define CM_MOST_BLOCKS 256u
#define CM_BEGINS 0x80000000u  // with a block's number: a tile begins
#define CM_TURN 16             // likewise, from this bit on: which of these lists it reads; it makes the next
#define CM_TURNS 3u
#define CM_SQUARE_EDGE 8u
#define CM_SQUARE_PIXELS 64u
#define CM_MOST_SQUARES 16384u  // of a tile
#define CM_BAND_ROWS 16u  // of a tile: a dispatch says of each so many rows whether it has changed them
#define CM_BANDS 64u      // of a tile at most
// A word of the list: the square's number in the tile, and from this bit on whether its even and its odd rows are sampled.
#define CM_SQUARE_ROWS 30

#endif
