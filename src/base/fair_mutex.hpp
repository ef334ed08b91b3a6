#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <thread>

namespace cumulet {

/// A mutex that threads get in the order in which they ask. With std::mutex, a thread that locks in a loop may keep
/// others waiting for a long time.
class FairMutex {
 public:
  void lock() {
    std::unique_lock lock(mutex_);
    const std::uint64_t ticket = next_++;
    turn_.wait(lock, [&] { return served_ == ticket; });
    owner_ = std::this_thread::get_id();
  }
  void unlock() {
    {
      const std::scoped_lock lock(mutex_);
      owner_ = std::thread::id();
      ++served_;
    }
    turn_.notify_all();
  }
  /// True if the calling thread holds it.
  [[nodiscard]] bool is_mine() const { return owner_ == std::this_thread::get_id(); }

 private:
  std::mutex mutex_;
  std::condition_variable turn_;
  std::uint64_t next_ = 0;
  std::uint64_t served_ = 0;
  std::atomic<std::thread::id> owner_;
};

}  // namespace cumulet
