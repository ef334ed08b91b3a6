// Names of the reader's host in docs/howto/loading.md.
#include "host.h"

void show_bar(cumulet_stage stage, double fraction);

extern int entry;
extern uint64_t entry_size;
uint64_t read_entry(void* user, uint64_t position, void* bytes, uint64_t size);
