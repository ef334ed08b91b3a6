#pragma once

// Bricks whose values are in GL: what main memory knows of them.

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <vector>

#include "base/shared_code.hpp"

namespace cumulet::core {
#include "brick_summary.glsl"
}  // namespace cumulet::core

namespace cumulet::volume {

using BrickSummary = core::CmBrickSummary;
static_assert(sizeof(BrickSummary) == 4 * CM_BRICK_SUMMARY_WORDS);

/// Memory of a device's in which bricks are, 512 values each: as long as anyone holds this they stay. Who has the
/// device's context knows it by its address.
struct DeviceMemory {
  std::size_t bricks = 0;
  bool halves = false;                    ///< half floats, else floats
  mutable std::atomic<bool> gone{false};  ///< with its context: nobody has it any more
  DeviceMemory(std::size_t count, bool are_halves) : bricks(count), halves(are_halves) {}
};
using DeviceMemoryPtr = std::shared_ptr<const DeviceMemory>;

/// Whether somebody cannot do without the values in main memory, of all states of a volume.
class ValuesWanted {
 public:
  void ask() { asked_ = true; }
  [[nodiscard]] bool asked() const { return asked_; }

 private:
  std::atomic<bool> asked_ = false;
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
  std::vector<BrickSummary> summaries;
  ValuesWantedPtr wanted;  ///< who needs values asks there; whoever has the volume brings another state of it

  /// Whether halves are what all values are.
  [[nodiscard]] bool are_halves() const;
  /// Whether any of it went with its context.
  [[nodiscard]] bool gone() const;
  /// Whether memories hold much that is replaced by now: so much that all of it had better be copied anew.
  [[nodiscard]] bool scattered() const;
  /// Main memory.
  [[nodiscard]] std::uint64_t bytes() const {
    return origins.size() * (sizeof(glm::ivec3) + sizeof(Place) + sizeof(BrickSummary));
  }
  /// Of a brick its values, as far as they are known here: of 2^3 voxels each the mean.
  void fill_means(std::size_t brick, std::array<float, 512>& values) const;
  /// In the order that it is to have; without bricks that are empty, and memories that none is in.
  void tidy();
  /// The same but for what stands in the other's places: there are the other's bricks, the empty ones among them.
  [[nodiscard]] DeviceBricks with(const DeviceBricks& other) const;
};
using DeviceBricksPtr = std::shared_ptr<const DeviceBricks>;

}  // namespace cumulet::volume
