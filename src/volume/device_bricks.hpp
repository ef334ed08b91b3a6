#pragma once

// Bricks whose values are in GL: what main memory knows of them.

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <vector>

#include "base/listeners.hpp"
#include "base/shared_code.hpp"
#include "volume/brick_values.hpp"

namespace cumulet::core {
#include "brick_summary.glsl"
}  // namespace cumulet::core

namespace cumulet::volume {

using BrickSummary = core::CmBrickSummary;
static_assert(sizeof(BrickSummary) == 4 * CM_BRICK_SUMMARY_WORDS);

/// Memory of a device's in which bricks are, 512 values each: as long as anyone holds this they stay. Who has the
/// device's context knows it by its address.
struct DeviceMemory {
  std::vector<BrickSummary> summaries;    ///< of its bricks
  bool halves = false;                    ///< half floats, else floats
  mutable std::atomic<bool> gone{false};  ///< with its context: nobody has it any more

  DeviceMemory(std::size_t bricks, bool are_halves) : summaries(bricks), halves(are_halves) {}
  [[nodiscard]] std::size_t bricks() const { return summaries.size(); }
  /// On the device.
  [[nodiscard]] static std::size_t bytes_of(std::size_t bricks, bool halves) {
    return bricks * brick_voxels * (halves ? 2 : 4);
  }
  [[nodiscard]] std::size_t bytes() const { return bytes_of(bricks(), halves); }
};
/// Voxels of a brick that were huge.
inline std::uint64_t huge_voxels_of(const BrickSummary& summary) {
  return (summary.voxels >> CM_BRICK_HUGE_SHIFT) & CM_BRICK_HUGE;
}
using DeviceMemoryPtr = std::shared_ptr<const DeviceMemory>;

/// Which of a brick's 64 blocks of 2^3 voxels this voxel is in.
constexpr unsigned block_of_voxel(unsigned v) { return ((v / 128) * 4 + (v / 16) % 4) * 4 + (v / 2) % 4; }

/// Whether somebody cannot do without the values in main memory, of all states of a volume. Any thread.
class ValuesWanted {
 public:
  void ask() {
    if (!asked_.exchange(true)) listeners_.tell();
  }
  [[nodiscard]] bool asked() const { return asked_; }
  /// Listeners::listen() to the first who asks.
  [[nodiscard]] std::shared_ptr<void> listen(std::function<void()> asked) {
    return listeners_.listen(std::move(asked));
  }

 private:
  std::atomic<bool> asked_ = false;
  Listeners listeners_;
};
using ValuesWantedPtr = std::shared_ptr<ValuesWanted>;

/// A field of such bricks, each at another place, in the order of ScalarVolume::brick_origins. Immutable where it is
/// shared.
struct DeviceBricks {
  struct Place {
    std::uint32_t memory = 0;  ///< of those below
    std::uint32_t brick = 0;   ///< in that
  };
  std::vector<DeviceMemoryPtr> memories;
  std::vector<glm::ivec3> origins;
  std::vector<Place> places;
  std::vector<glm::ivec3> emptied;  ///< of what changes another field, where nothing is any more
  std::uint64_t huge_voxels = 0;    ///< of bricks that were dropped
  ValuesWantedPtr wanted;           ///< who needs values asks there; whoever has the volume brings another state of it

  [[nodiscard]] const BrickSummary& summary(std::size_t brick) const {
    return memories[places[brick].memory]->summaries[places[brick].brick];
  }
  /// Which of them begins there; none: it has no such brick.
  [[nodiscard]] std::optional<std::uint32_t> find(const glm::ivec3& origin) const;
  /// Whether halves are what all values are.
  [[nodiscard]] bool are_halves() const;
  /// Whether any of it went with its context.
  [[nodiscard]] bool gone() const;
  /// Throws Error(unsupported) if they are gone.
  void ask_for_values() const;
  /// Whether memories hold much that is replaced by now: so much that all of it had better be copied anew.
  [[nodiscard]] bool scattered() const;
  /// Main memory.
  [[nodiscard]] std::uint64_t bytes() const;
  /// Of a brick its values, as far as they are known here: of 2^3 voxels each the mean.
  void fill_means(std::size_t brick, BrickValues::Brick& values) const;
  /// Bricks that are empty go to those that are emptied.
  void drop_empty();
  /// In the order that it is to have; without memories that no brick is in, and what was emptied.
  void tidy();
  /// The same with the other's bricks in their places, and without those that it empties. Tidy.
  [[nodiscard]] DeviceBricks with(const DeviceBricks& other) const;
};
using DeviceBricksPtr = std::shared_ptr<const DeviceBricks>;

}  // namespace cumulet::volume
