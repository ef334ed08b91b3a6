// Names of the reader's host in docs/howto/depth.md.
#include "host.h"

extern double view[16];
extern double projection[16];
extern uint32_t depth_texture;
extern cumulet_frame_result result;
