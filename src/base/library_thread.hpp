#pragma once

#include <functional>
#include <memory>

namespace cumulet {

// The end of the process. exit(), a return from main() and dlclose() destroy static objects: of this library, of
// OpenVDB, of TBB, of the host. A thread that still works then reads what is destroyed. So the threads of the library
// are stopped and joined first, by a handler of std::atexit that is registered before the first of them starts.
// Handlers and destructors of statics run in reverse order of their registration: see keep_statics().
//
// This needs the one list of threads that the process has, the only mutable object outside of viewers and handles. It
// is local to library_thread.cpp, is never destroyed, and no result depends on it.

/// True once the process exits or unloads the library: no callback of the host is called any more, and no thread
/// starts. Any thread.
[[nodiscard]] bool process_is_ending();

/// Where statics may have been created, which others use.
enum class StaticsOf { thread, job, callback };
/// Statics that exist now are destroyed only after the threads of the library have ended. Called where others may have
/// been created: a thread starts, a job has ended, a callback of the host has returned. Registers few handlers, however
/// often it is called.
void keep_statics(StaticsOf of) noexcept;

/// A thread of the library, which is joined before statics are destroyed.
class LibraryThread {
 public:
  /// request_stop makes work return soon. It is called when the process ends, on any thread, while the LibraryThread
  /// lives. Without one the end of the process waits until work returns, however long that takes; with one it waits for
  /// seconds at most, because the work may be in a callback that waits for the thread that exits.
  /// Throws std::system_error where no thread can be had, and Error(cancelled) when the process ends.
  explicit LibraryThread(std::function<void()> work, std::function<void()> request_stop = nullptr);
  LibraryThread(const LibraryThread&) = delete;
  LibraryThread& operator=(const LibraryThread&) = delete;
  /// Waits until work has returned. In a forked child, which does not have the thread, it does not.
  ~LibraryThread();

  /// Whether work has returned.
  [[nodiscard]] bool ended() const;

  struct Entry;

 private:
  std::shared_ptr<Entry> entry_;
};

/// A call of the host into the library, for as long as it lives. When another thread ends the process, that waits a few
/// seconds for calls under way, and refuses others.
class HostCall {
 public:
  HostCall();
  ~HostCall();
  HostCall(const HostCall&) = delete;
  HostCall& operator=(const HostCall&) = delete;

  /// Whether another thread ends the process.
  [[nodiscard]] bool refused() const { return refused_; }

 private:
  bool refused_ = false;
};

}  // namespace cumulet
