// Names of a reader's host that several how-to pages use.
#include <cumulet/cumulet.h>
#include <stddef.h>
#include <stdint.h>

extern cumulet_viewer* viewer;
extern void* user;
extern uint32_t framebuffer;
extern uint32_t width;
extern uint32_t height;

void* get_proc(void* user, const char* name);
void fail(const char* cause);
void show_line(const char* line);
