#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <vector>

#include "gl/objects.hpp"
#include "gl/programs.hpp"
#include "volume/device_bricks.hpp"

namespace cumulet::render {

/// Buffers of GPU-resident bricks, shared by the contexts of a share group and held by volumes of any thread. Calls
/// that only query may come from any thread. All others need a current context of the group and must not run
/// concurrently.
class DeviceMemories {
 public:
  /// gl: an instance of its own, because viewers may be destroyed earlier. programs: of the share group. max_bytes:
  /// maximum size of one memory, the limit of a storage block.
  DeviceMemories(gl::FunctionsPtr gl, gl::ProgramsPtr programs, std::uint64_t max_bytes)
      : gl_(std::move(gl)), programs_(std::move(programs)), max_bytes_(max_bytes) {}
  DeviceMemories(const DeviceMemories&) = delete;
  DeviceMemories& operator=(const DeviceMemories&) = delete;
  /// Marks all memories that are still held as gone. Without a current context of the group the buffers leak.
  ~DeviceMemories();
  /// Call it if the contexts are gone, and the bricks with them.
  void abandon() const { gl_->abandoned = true; }

  /// Allocates a memory. Throws the errors of GL allocations.
  [[nodiscard]] std::shared_ptr<volume::DeviceMemory> make(std::size_t bricks, bool halves);
  /// Returns the buffer of a memory; null if it belongs to another share group. The address is valid as long as the
  /// memory is held. Later commands of the current context run after the writes of other contexts to the buffer.
  [[nodiscard]] const gl::Object* find(const volume::DeviceMemory& memory) const;
  [[nodiscard]] bool has(const volume::DeviceBricks& bricks) const;
  /// Copies all bricks, which must be in this group, into one memory. Returns null if that would be too large, or if
  /// the driver is still compiling the program. Throws the errors of GL allocations, and Error(gl).
  [[nodiscard]] volume::DeviceBricksPtr gather(const gl::FunctionsPtr& gl, const volume::DeviceBricks& bricks);
  /// Frees the buffers of memories that are not held any more.
  void collect();
  [[nodiscard]] std::uint64_t bytes() const;
  /// Maximum size of one memory.
  [[nodiscard]] std::uint64_t max_bytes() const { return max_bytes_; }

 private:
  struct Kept {
    std::weak_ptr<const volume::DeviceMemory> held;
    const volume::DeviceMemory* address = nullptr;
    gl::Object buffer;
    std::uint64_t bytes = 0;
    gl::Fence written;  // signaled when another context of the group has written it
  };
  [[nodiscard]] const Kept* kept(const volume::DeviceMemory& memory) const;

  gl::FunctionsPtr gl_;
  gl::ProgramsPtr programs_;
  std::uint64_t max_bytes_;
  mutable std::mutex mutex_;  // guards kept_ against calls that query
  std::list<Kept> kept_;
};
using DeviceMemoriesPtr = std::shared_ptr<DeviceMemories>;

}  // namespace cumulet::render
