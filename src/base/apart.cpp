#include "base/apart.hpp"

#include <atomic>
#include <exception>
#include <list>
#include <mutex>
#include <thread>

namespace cumulet {

namespace {

/// The process' threads of what was left. They are joined, not detached: code must not be unloaded under them.
class Threads {
 public:
  /// gone: set when this is no more.
  explicit Threads(std::atomic<bool>& gone) : gone_(gone) {}
  ~Threads() {
    gone_ = true;
    std::list<One> rest;
    {
      // What ends meanwhile may leave something in its turn: that is done on the spot.
      const std::scoped_lock lock(mutex_);
      closed_ = true;
      rest.swap(all_);
    }
    for (One& one : rest) one.thread.join();
  }
  Threads(const Threads&) = delete;
  Threads& operator=(const Threads&) = delete;

  /// False if there is none to be had.
  bool run(const std::function<void()>& work) {
    const std::scoped_lock lock(mutex_);
    if (closed_) return false;
    all_.remove_if([](One& one) {
      if (!one.ended) return false;
      one.thread.join();
      return true;
    });
    if (all_.size() >= most) return false;
    std::list<One> added;
    try {
      One& one = added.emplace_back();
      one.thread = std::thread([&one, work = std::function<void()>(work)]() mutable {
        work();
        work = {};  // what it owns may take long to free
        one.ended = true;
      });
    } catch (const std::exception&) {  // no memory, no thread
      return false;
    }
    all_.splice(all_.end(), added);
    return true;
  }

 private:
  struct One {
    std::thread thread;
    std::atomic<bool> ended = false;
  };
  static constexpr std::size_t most = 16;

  std::atomic<bool>& gone_;
  std::mutex mutex_;
  bool closed_ = false;
  std::list<One> all_;
};

/// Null when the process ends.
Threads* threads() {
  static std::atomic<bool> gone = false;
  static Threads all(gone);
  return gone ? nullptr : &all;
}

}  // namespace

void leave(const std::function<void()>& work) {
  Threads* const all = threads();
  if (all == nullptr || !all->run(work)) work();
}

}  // namespace cumulet
