#pragma once

// For programs that make OSMesa contexts: Mesa 22's OSMesa never frees the framebuffers it makes for itself. Asked for
// by LeakSanitizer, where it is built in. Once a program.
extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() { return "leak:libOSMesa.so\n"; }
