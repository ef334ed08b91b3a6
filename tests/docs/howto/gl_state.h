// Names of the reader's host in docs/howto/gl_state.md.
#include <math.h>
#include "host.h"

void apply_view(float* rgb);
