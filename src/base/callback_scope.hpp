#pragma once

#include "base/library_thread.hpp"

namespace cumulet {

/// While one lives, its thread is inside a callback of the host's, which may not call the library. A property of the
/// thread, whichever viewer or handle the callback is of: so calls are refused before they touch a lock that the caller
/// of the callback may hold.
class CallbackScope {
 public:
  CallbackScope() { ++depth(); }
  ~CallbackScope() {
    --depth();
    keep_statics(StaticsOf::callback);
  }
  CallbackScope(const CallbackScope&) = delete;
  CallbackScope& operator=(const CallbackScope&) = delete;

  /// Whether the calling thread is inside one.
  [[nodiscard]] static bool inside() { return depth() > 0; }

 private:
  static int& depth() {
    static thread_local int callbacks = 0;
    return callbacks;
  }
};

}  // namespace cumulet
