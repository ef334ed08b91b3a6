// Names of the reader's host in docs/howto/shader_cache.md.
#include "host.h"

extern cumulet_frame_desc frame;
void show_bar(double fraction);
