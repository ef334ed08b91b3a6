// Names of the reader's host in docs/howto/loading.md.
#include "host.h"

void show_bar(cumulet_stage stage, double fraction);
