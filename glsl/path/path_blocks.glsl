// Blocks of a tile's lanes, of which a dispatch runs some; and 8x8-pixel adaptive-sampling blocks ("squares") of the
// tile's pixels. A list names the squares that are sampled. Shared by GLSL and C++.
#ifndef CM_PATH_BLOCKS_GLSL
#define CM_PATH_BLOCKS_GLSL

#define CM_BLOCK_LANES 1024u
#define CM_MAX_BLOCKS 256u
#define CM_BEGINS 0x80000000u  // flag beside a block's number: a tile begins
#define CM_LIST_BIT 16         // bit offset beside a block's number: its list to read (compaction); the next is written
#define CM_LISTS 3u
#define CM_HEADER_WORDS 2u  // of the counters, in uvec4: cm_total and cm_running
#define CM_SQUARE_EDGE 8u
#define CM_SQUARE_PIXELS 64u
#define CM_MAX_SQUARES 16384u  // per tile
#define CM_BAND_ROWS 16u  // rows per band of a tile: a dispatch reports which bands it changed
#define CM_BANDS 64u      // maximum per tile
// A word of the list: the number of the square in the tile; from this bit on, flags that its even and odd rows are
// sampled.
#define CM_SQUARE_ROWS 30

#endif
