#pragma once

#include "base/library_thread.hpp"

namespace cumulet {

/// Marks its thread as being inside a callback of the host for as long as the object lives. Such a callback may not
/// call the library. The mark belongs to the thread, independent of the viewer or handle that made the callback. Calls
/// can therefore be rejected before they touch a lock that the caller of the callback may hold.
class CallbackScope {
 public:
  CallbackScope() { ++depth(); }
  ~CallbackScope() {
    --depth();
    keep_statics(StaticsOf::callback);
  }
  CallbackScope(const CallbackScope&) = delete;
  CallbackScope& operator=(const CallbackScope&) = delete;

  /// Whether the calling thread is inside a callback of the host.
  [[nodiscard]] static bool inside() { return depth() > 0; }

 private:
  static int& depth() {
    static thread_local int callbacks = 0;
    return callbacks;
  }
};

}  // namespace cumulet
