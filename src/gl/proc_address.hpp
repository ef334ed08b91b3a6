#pragma once

#include <cstdint>

namespace cumulet::gl {

/// The host's callback: returns the address of a function of OpenGL or of the window system.
using GetProc = void* (*)(void* user, const char* name);

/// Asks the host for a function. Returns null if the host lacks it. For such functions, wglGetProcAddress may return 1,
/// 2, 3 or -1.
template <class Function>
Function proc_address(GetProc get_proc, void* user, const char* name) {
  void* address = get_proc(user, name);
  const auto number = reinterpret_cast<std::intptr_t>(address);
  return number >= -1 && number <= 3 ? nullptr : reinterpret_cast<Function>(address);
}

}  // namespace cumulet::gl
