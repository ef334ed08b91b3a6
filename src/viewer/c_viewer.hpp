#pragma once

// The viewer handle of the C ABI, and the guard for calls on it.

#include <unistd.h>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "viewer/c_handles.hpp"
#include "viewer/c_support.hpp"
#include "viewer/viewer.hpp"

namespace cumulet::c_abi {

/// Each thread's last error. All calls are safe from any thread.
class LastErrors {
 public:
  void set(std::string line) {
    const std::scoped_lock lock(mutex_);
    if (line.empty()) {  // most threads have no error, so that the map stays small
      of_thread_.erase(this_thread());
      return;
    }
    const bool is_new = of_thread_.insert_or_assign(this_thread(), std::move(line)).second;
    if (is_new && of_thread_.size() > max_threads) of_thread_.erase(of_thread_.begin());  // of the oldest thread
  }
  /// Valid until the calling thread's next set(), unless thousands of later threads have an error.
  [[nodiscard]] const char* get() const {
    const std::scoped_lock lock(mutex_);
    const auto found = of_thread_.find(this_thread());
    return found == of_thread_.end() ? "" : found->second.c_str();
  }

 private:
  static constexpr std::size_t max_threads = 4096;
  // Unlike std::thread::id, no later thread has the same.
  static std::uint64_t this_thread() {
    static std::atomic<std::uint64_t> last = 0;
    thread_local const std::uint64_t number = ++last;
    return number;
  }

  mutable std::mutex mutex_;
  std::map<std::uint64_t, std::string> of_thread_;
};

}  // namespace cumulet::c_abi

struct cumulet_viewer {
  std::unique_ptr<cumulet::viewer::Viewer> viewer;
  cumulet::c_abi::LastErrors last_errors;
  pid_t process = getpid();  // a forked child has neither the viewer's threads nor its context
  cumulet::c_abi::KeptHandle<cumulet_volume> volume;
  cumulet::c_abi::KeptHandle<cumulet_surfaces> surfaces;
  cumulet::c_abi::KeptHandle<cumulet_environment> environment;
};

namespace cumulet::c_abi {

/// Runs a call on a viewer, with the checks of the other overloads. The message of an exception becomes the last error.
template <class Call>
cumulet_status guarded(cumulet_viewer* viewer, Call&& call) noexcept {
  // Inside a callback the last error stays that of the call which runs the callback.
  if (CallbackScope::inside()) return CUMULET_ERROR_INVALID_ARGUMENT;
  if (viewer == nullptr) {
    set_thread_line("viewer is NULL");
    return CUMULET_ERROR_INVALID_ARGUMENT;
  }
  const HostCall host_call;
  std::string message;
  const cumulet_status status = guarded(message, [&] {
    if (host_call.refused()) throw Error(ErrorCode::cancelled, process_exits);
    if (viewer->process != getpid()) refuse("the viewer belongs to the process that forked this one");
    call(*viewer->viewer);
  });
  try {
    viewer->last_errors.set(std::move(message));
  } catch (...) {  // no memory for this thread's first line
  }
  return status;
}

/// As above, for a call that needs the viewer's state lock.
template <class Call>
cumulet_status with_state(cumulet_viewer* viewer, Call&& call) noexcept {
  return guarded(viewer, [&](viewer::Viewer& v) {
    const viewer::StateLock::Held held = v.hold_state();
    call(v);
  });
}

}  // namespace cumulet::c_abi
