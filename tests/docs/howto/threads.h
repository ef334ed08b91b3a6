// Names of the reader's host in docs/howto/threads.md.
#include "host.h"

extern cumulet_viewer* left;
extern cumulet_viewer* right;
void show_bar(cumulet_stage stage, double fraction);
