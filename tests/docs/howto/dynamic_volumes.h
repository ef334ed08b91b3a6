// Names of the reader's host in docs/howto/dynamic_volumes.md.
#include "host.h"

extern float density[64 * 64 * 64];
extern uint32_t texture;
