#include "jobs/resource_limits.hpp"

#include <tbb/info.h>
#include <tbb/task_arena.h>

#include <algorithm>

#include "base/error.hpp"
#include "base/one_line.hpp"

namespace cumulet::viewer {

struct ResourceLimits::Arena {
  explicit Arena(int count) : threads(count), arena(count) {}
  int threads;
  tbb::task_arena arena;
  std::mutex alone;  // used with one thread: a second job's thread would be additional
};

void ResourceLimits::set(unsigned threads, std::uint64_t memory_bytes) {
  std::shared_ptr<Arena> arena;  // the previous one is destroyed after the lock is released
  // TBB would print a warning for more threads than cores.
  if (threads > 0)
    arena = std::make_shared<Arena>(std::min(static_cast<int>(threads), tbb::info::default_concurrency()));
  memory_bytes_ = memory_bytes;
  const std::scoped_lock lock(mutex_);
  if (threads == threads_) return;
  threads_ = threads;
  std::swap(arena_, arena);
}

void ResourceLimits::require(std::uint64_t bytes, const std::string& what) const {
  const std::uint64_t most = memory_bytes_;
  if (bytes <= most) return;
  throw Error(ErrorCode::out_of_memory, one_line(what + " takes " + std::to_string(bytes) + " bytes of memory; " +
                                                 std::to_string(most) + " are allowed"));
}

void ResourceLimits::run(const std::function<void()>& work) const {
  std::shared_ptr<Arena> arena;
  {
    const std::scoped_lock lock(mutex_);
    arena = arena_;
  }
  if (!arena) {
    work();
    return;
  }
  std::unique_lock alone(arena->alone, std::defer_lock);
  if (arena->threads == 1) alone.lock();
  // Isolated: a thread that waits inside `work` must not execute other work, which may wait for a lock that this thread
  // holds.
  arena->arena.execute([&] { tbb::this_task_arena::isolate(work); });
}

}  // namespace cumulet::viewer
