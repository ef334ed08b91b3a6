#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <mutex>
#include <string>

namespace cumulet::viewer {

/// What a viewer's work may take of the machine. All calls are safe from any thread.
class Allowance {
 public:
  static constexpr std::uint64_t no_limit = std::numeric_limits<std::uint64_t>::max();

  /// threads: that work at a time, of all that run() here; 0: as many as there are. Of what is begun from now on.
  void set(unsigned threads, std::uint64_t memory_bytes);
  /// Of volumes and grids, in main memory.
  [[nodiscard]] std::uint64_t memory_bytes() const { return memory_bytes_; }
  /// Of GL memory, what there is for volumes: as many cells as fit are built. Of what is begun from now on.
  void set_gl(std::uint64_t bytes) { gl_bytes_ = bytes; }
  [[nodiscard]] std::uint64_t gl_bytes() const { return gl_bytes_; }
  /// Throws Error(out_of_memory) where that is less; what: takes it, begins the line.
  void require(std::uint64_t bytes, const std::string& what) const;
  /// Does it on this thread, or one that works for it; waits until there is room.
  void run(const std::function<void()>& work) const;

 private:
  struct Arena;
  mutable std::mutex mutex_;
  unsigned threads_ = 0;
  std::shared_ptr<Arena> arena_;  // null: no limit
  std::atomic<std::uint64_t> memory_bytes_ = no_limit;
  std::atomic<std::uint64_t> gl_bytes_ = no_limit;
};
using AllowancePtr = std::shared_ptr<const Allowance>;

}  // namespace cumulet::viewer
