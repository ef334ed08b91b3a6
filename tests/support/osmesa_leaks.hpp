#pragma once

// For programs that make OSMesa contexts. OSMesa of Mesa 22 never frees its internal framebuffers. LeakSanitizer, if
// built in, calls this function. Include it once per program.
extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() { return "leak:libOSMesa.so\n"; }
