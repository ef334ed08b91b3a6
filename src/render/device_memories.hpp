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

/// Bricks in GL that volumes of any thread hold, of one share group. All calls but those that tell need a context of
/// the group current, one thread at a time; those that tell come from any.
class DeviceMemories {
 public:
  /// gl: for itself: viewers come and go. programs: of the group. most_bytes: of one: what a storage block may have.
  DeviceMemories(gl::FunctionsPtr gl, gl::ProgramsPtr programs, std::uint64_t most_bytes)
      : gl_(std::move(gl)), programs_(std::move(programs)), most_bytes_(most_bytes) {}
  DeviceMemories(const DeviceMemories&) = delete;
  DeviceMemories& operator=(const DeviceMemories&) = delete;
  /// Who holds any is told that it is gone. Without a context of the group buffers stay behind.
  ~DeviceMemories();
  /// The contexts are gone, and with them the bricks.
  void abandon() const { gl_->abandoned = true; }

  /// Throws what GL's allocations throw.
  [[nodiscard]] std::shared_ptr<volume::DeviceMemory> make(std::size_t bricks, bool halves);
  /// Null: it is of another group. It stays where it is as long as the memory is held. What the current context does
  /// from now on comes after what another has written there.
  [[nodiscard]] const gl::Object* find(const volume::DeviceMemory& memory) const;
  [[nodiscard]] bool has(const volume::DeviceBricks& bricks) const;
  /// The same in one memory, copied, all being here; null: that would be too large, or the driver still compiles.
  /// Throws what GL's allocations throw, and Error(gl).
  [[nodiscard]] volume::DeviceBricksPtr gather(const gl::FunctionsPtr& gl, const volume::DeviceBricks& bricks);
  /// Those go that nobody holds any more.
  void collect();
  [[nodiscard]] std::uint64_t bytes() const;
  /// Of one of them.
  [[nodiscard]] std::uint64_t most_bytes() const { return most_bytes_; }

 private:
  struct Kept {
    std::weak_ptr<const volume::DeviceMemory> held;
    const volume::DeviceMemory* address = nullptr;
    gl::Object buffer;
    std::uint64_t bytes = 0;
    gl::Fence written;  // by one of the group's contexts, for the others
  };
  [[nodiscard]] const Kept* kept(const volume::DeviceMemory& memory) const;

  gl::FunctionsPtr gl_;
  gl::ProgramsPtr programs_;
  std::uint64_t most_bytes_;
  mutable std::mutex mutex_;  // of what tells
  std::list<Kept> kept_;
};
using DeviceMemoriesPtr = std::shared_ptr<DeviceMemories>;

}  // namespace cumulet::render
