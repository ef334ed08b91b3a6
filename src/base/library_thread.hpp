#pragma once

#include <functional>
#include <memory>

namespace cumulet {

// Threads at process exit. exit(), a return from main() and dlclose() destroy static objects of this library, of
// OpenVDB, of TBB and of the host. A thread that still runs would then read destroyed objects. The threads of the
// library are therefore stopped and joined first, by a std::atexit handler that is registered before the first thread
// starts. Handlers and destructors of statics run in reverse order of their registration: see keep_statics().
//
// This needs a process-wide list of threads, the only mutable object outside of viewers and handles. It is local to
// library_thread.cpp and is never destroyed, and no result depends on it.

/// True once the process exits or the library is unloaded. From then on no callback of the host is called and no thread
/// starts. Any thread.
[[nodiscard]] bool process_is_ending();

/// The code that may just have created statics which other threads use.
enum class StaticsOf { thread, job, callback };
/// Ensures that the statics that exist now are destroyed only after the threads of the library have ended. Call it
/// after code that may have created statics: when a thread starts, a job has ended or a callback of the host has
/// returned. Registers few atexit handlers, however often it is called.
void keep_statics(StaticsOf of) noexcept;

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

/// A thread of the library, which is joined before statics are destroyed.
class LibraryThread {
 public:
  /// request_stop: makes `work` return soon. It is called on any thread when the process ends, while the LibraryThread
  /// lives. Without it, process exit waits until `work` returns, however long that takes. With it, process exit waits a
  /// few seconds at most, because `work` may be in a callback that waits for the exiting thread. Throws
  /// std::system_error if no thread can be created, and Error(cancelled) if the process is ending.
  explicit LibraryThread(std::function<void()> work, std::function<void()> request_stop = nullptr);
  LibraryThread(const LibraryThread&) = delete;
  LibraryThread& operator=(const LibraryThread&) = delete;
  /// Waits until `work` has returned. In a forked child, which does not have the thread, it does not wait.
  ~LibraryThread();

  /// Whether `work` has returned.
  [[nodiscard]] bool ended() const;

  struct Entry;

 private:
  std::shared_ptr<Entry> entry_;
};

/// Marks a call of the host into the library, for as long as the object lives. If another thread ends the process, that
/// thread waits a few seconds for calls under way, and new calls are rejected.
class HostCall {
 public:
  HostCall();
  ~HostCall();
  HostCall(const HostCall&) = delete;
  HostCall& operator=(const HostCall&) = delete;

  /// True if another thread is ending the process; the call must then return at once.
  [[nodiscard]] bool refused() const { return refused_; }

 private:
  bool refused_ = false;
};

}  // namespace cumulet
