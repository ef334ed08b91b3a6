// Names of the reader's host in docs/howto/screenshots.md.
#include "host.h"

extern uint8_t rgba[4 * 320 * 180];
