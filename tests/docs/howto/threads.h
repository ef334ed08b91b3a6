// Names of the reader's host in docs/howto/threads.md.
#include "host.h"

extern cumulet_viewer* left;
extern cumulet_viewer* right;
extern cumulet_event event;
extern int32_t handled;
extern cumulet_medium_desc medium;
extern cumulet_frame_desc frame;
extern cumulet_frame_result result;
extern float* values;
extern size_t count;
void encode_on_a_worker(const float* values, uint32_t width, uint32_t height);
void show_bar(cumulet_stage stage, double fraction);
