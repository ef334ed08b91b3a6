#pragma once

// For programs that make contexts of Mesa. OSMesa of Mesa 22 never frees its internal framebuffers; libgallium is the
// driver of later versions. LeakSanitizer, if built in, calls this function. Include it once per program.
extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() { return "leak:libOSMesa.so\nleak:libgallium\nleak:swrast_dri\n"; }
