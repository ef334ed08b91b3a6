#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <mutex>
#include <string>

namespace cumulet::viewer {

/// Resource limits of a viewer: threads, main memory and GPU memory. All calls are thread-safe.
class ResourceLimits {
 public:
  static constexpr std::uint64_t no_limit = std::numeric_limits<std::uint64_t>::max();

  /// Applies to work started after this call. threads: maximum number of threads working at a time, in all run() calls
  /// together; 0: all cores.
  void set(unsigned threads, std::uint64_t memory_bytes);
  /// Limit in bytes for volumes and grids in main memory.
  [[nodiscard]] std::uint64_t memory_bytes() const { return memory_bytes_; }
  /// Sets the GPU memory limit for volumes, in bytes. Grids are coarsened to fit. Applies to work started after this
  /// call.
  void set_gl(std::uint64_t bytes) { gl_bytes_ = bytes; }
  [[nodiscard]] std::uint64_t gl_bytes() const { return gl_bytes_; }
  /// Throws Error(out_of_memory) if `bytes` exceeds the main memory limit. what: the object that needs them; begins the
  /// message.
  void require(std::uint64_t bytes, const std::string& what) const;
  /// Runs `work` on this thread, or on a worker thread that acts for it. Waits until a thread is available.
  void run(const std::function<void()>& work) const;

 private:
  struct Arena;
  mutable std::mutex mutex_;
  unsigned threads_ = 0;
  std::shared_ptr<Arena> arena_;  // null: no limit
  std::atomic<std::uint64_t> memory_bytes_ = no_limit;
  std::atomic<std::uint64_t> gl_bytes_ = no_limit;
};
using ResourceLimitsPtr = std::shared_ptr<const ResourceLimits>;

}  // namespace cumulet::viewer
