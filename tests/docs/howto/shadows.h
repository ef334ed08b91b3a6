// Names of the reader's host in docs/howto/shadows.md.
#include "host.h"
