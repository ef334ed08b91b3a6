#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "base/progress.hpp"
#include "volume/volume.hpp"

namespace cumulet::volume {

/// A curve over a field's values: straight between points, level beyond the first and the last. Without points every
/// value stays as it is. 0 always does: where a field has nothing, a ramp puts nothing.
class Ramp {
 public:
  Ramp() = default;
  /// Of (value, what it becomes), at least two, values strictly ascending; all finite, what they become not negative.
  explicit Ramp(std::vector<glm::vec2> points) : points_(std::move(points)) {}

  /// Whether every value stays as it is.
  [[nodiscard]] bool empty() const { return points_.empty(); }
  [[nodiscard]] const std::vector<glm::vec2>& points() const { return points_; }
  /// value: not negative. O(log points).
  [[nodiscard]] float operator()(float value) const;
  bool operator==(const Ramp&) const = default;

 private:
  std::vector<glm::vec2> points_;
};

/// Voxel by voxel. O(voxels of bricks) time and memory. Throws Error(cancelled).
ScalarVolume apply(const Ramp& ramp, const ScalarVolume& volume, const Progress* progress = nullptr);

}  // namespace cumulet::volume
