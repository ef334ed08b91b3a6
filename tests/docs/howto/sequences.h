// Names of the reader's host in docs/howto/sequences.md.
#include "host.h"

extern double seconds;
