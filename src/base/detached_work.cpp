#include "base/detached_work.hpp"

#include <exception>
#include <list>
#include <mutex>

#include "base/library_thread.hpp"
#include "base/never_destroyed.hpp"

namespace cumulet {

namespace {

/// The background threads of run_detached(). They are joined, not detached: code must not be unloaded while they run.
class Threads {
 public:
  /// Returns false if no thread is available, for example because the process is ending.
  bool run(const std::function<void()>& work) {
    const std::scoped_lock lock(mutex_);
    all_.remove_if([](const LibraryThread& one) { return one.ended(); });
    if (all_.size() >= max_threads) return false;
    try {
      all_.emplace_back(work);
    } catch (const std::exception&) {  // out of memory or of threads
      return false;
    }
    return true;
  }

 private:
  static constexpr std::size_t max_threads = 16;

  std::mutex mutex_;
  std::list<LibraryThread> all_;
};

Threads& threads() {
  static const NeverDestroyed<Threads> only;
  return only.get();
}

}  // namespace

void run_detached(const std::function<void()>& work) {
  if (!threads().run(work)) work();
}

}  // namespace cumulet
