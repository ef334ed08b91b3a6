// Names of the reader's host in docs/howto/gl_state.md.
#include "host.h"
#include <math.h>

void apply_view(float* rgb);
