#pragma once

// Bricks whose values are GPU-resident, with the data about them in main memory.

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
#include "grid/brick_summary.glsl"
}  // namespace cumulet::core

namespace cumulet::volume {

using BrickSummary = core::CmBrickSummary;
static_assert(sizeof(BrickSummary) == 4 * CM_BRICK_SUMMARY_WORDS);

/// GPU memory for bricks, 512 values each, which lives as long as this object. The owner of the GL context identifies
/// it by its address.
struct DeviceMemory {
  std::vector<BrickSummary> summaries;    ///< one per brick
  bool halves = false;                    ///< half floats or floats
  mutable std::atomic<bool> gone{false};  ///< set when its context is lost

  DeviceMemory(std::size_t bricks, bool are_halves) : summaries(bricks), halves(are_halves) {}
  [[nodiscard]] std::size_t bricks() const { return summaries.size(); }
  /// Bytes of GPU memory.
  [[nodiscard]] static std::size_t bytes_of(std::size_t bricks, bool halves) {
    return bricks * brick_voxels * (halves ? 2 : 4);
  }
  [[nodiscard]] std::size_t bytes() const { return bytes_of(bricks(), halves); }
};
/// Returns the number of voxels of a brick beyond largest_value.
inline std::uint64_t huge_voxels_of(const BrickSummary& summary) {
  return (summary.voxels >> CM_BRICK_HUGE_SHIFT) & CM_BRICK_HUGE;
}
using DeviceMemoryPtr = std::shared_ptr<const DeviceMemory>;

/// Returns which of a brick's 64 blocks of 2^3 voxels contains the voxel.
constexpr unsigned block_of_voxel(unsigned v) { return ((v / 128) * 4 + (v / 16) % 4) * 4 + (v / 2) % 4; }

/// A request for a volume's values in main memory, shared by all states of the volume. Any thread.
class ValuesWanted {
 public:
  void ask() {
    if (!asked_.exchange(true)) listeners_.notify();
  }
  [[nodiscard]] bool asked() const { return asked_; }
  /// Listens for the first request: see Listeners::listen().
  [[nodiscard]] std::shared_ptr<void> listen(std::function<void()> asked) {
    return listeners_.listen(std::move(asked));
  }

 private:
  std::atomic<bool> asked_ = false;
  Listeners listeners_;
};
using ValuesWantedPtr = std::shared_ptr<ValuesWanted>;

/// A field of GPU-resident bricks at distinct origins, in the order of ScalarVolume::brick_origins. Immutable when
/// shared.
struct DeviceBricks {
  struct Location {
    std::uint32_t memory = 0;  ///< index into `memories`
    std::uint32_t brick = 0;   ///< index in that memory
  };
  std::vector<DeviceMemoryPtr> memories;
  std::vector<glm::ivec3> origins;
  std::vector<Location> locations;
  std::vector<glm::ivec3> emptied;  ///< in an update of another field: origins of bricks that became empty
  std::uint64_t huge_voxels = 0;    ///< in bricks that were dropped
  ValuesWantedPtr wanted;  ///< requests for values in main memory; the owner then provides another state of the volume

  [[nodiscard]] const BrickSummary& summary(std::size_t brick) const {
    return memories[locations[brick].memory]->summaries[locations[brick].brick];
  }
  /// Returns the index of the brick at this origin, or nullopt if there is none.
  [[nodiscard]] std::optional<std::uint32_t> find(const glm::ivec3& origin) const;
  /// Whether all values are halves.
  [[nodiscard]] bool are_halves() const;
  /// Whether any memory was lost with its context.
  [[nodiscard]] bool gone() const;
  /// Requests the values in main memory. Throws Error(unsupported) if they are lost.
  void ask_for_values() const;
  /// Whether the memories hold so many outdated bricks that all bricks should be copied to new memory.
  [[nodiscard]] bool scattered() const;
  /// Bytes of main memory.
  [[nodiscard]] std::uint64_t bytes() const;
  /// Fills a brick's values with the available approximation: the mean of each block of 2^3 voxels.
  void fill_means(std::size_t brick, BrickValues::Brick& values) const;
  /// Moves the origins of empty bricks to `emptied`.
  void drop_empty();
  /// Sorts the bricks, and drops unused memories and `emptied`.
  void tidy();
  /// Returns the field with the bricks of an update replaced or added and those that it emptied removed. The result is
  /// tidy.
  [[nodiscard]] DeviceBricks with(const DeviceBricks& other) const;
};
using DeviceBricksPtr = std::shared_ptr<const DeviceBricks>;

}  // namespace cumulet::volume
