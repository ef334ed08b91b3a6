#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "base/progress.hpp"
#include "volume/volume.hpp"

namespace cumulet::volume {

/// A piecewise linear curve (transfer function) for a field's values, constant beyond the first and the last point.
/// Without points values are unchanged. 0 always maps to 0: a ramp adds nothing where a field is empty.
class Ramp {
 public:
  Ramp() = default;
  /// points: pairs (value, result), at least two, with strictly ascending values; all finite, results not negative.
  explicit Ramp(std::vector<glm::vec2> points) : points_(std::move(points)) {}

  /// Whether all values are unchanged.
  [[nodiscard]] bool empty() const { return points_.empty(); }
  [[nodiscard]] const std::vector<glm::vec2>& points() const { return points_; }
  /// value: >= 0. O(log points).
  [[nodiscard]] float operator()(float value) const;
  bool operator==(const Ramp&) const = default;

 private:
  std::vector<glm::vec2> points_;
};

/// A color for each value of a field, linear between its stops and constant beyond them. Without stops it is white.
class ColorRamp {
 public:
  ColorRamp() = default;
  /// stops: (value, red, green, blue), at least two, with strictly ascending values; all finite, colors not negative.
  explicit ColorRamp(std::vector<glm::vec4> stops) : stops_(std::move(stops)) {}

  /// Whether all values are white.
  [[nodiscard]] bool empty() const { return stops_.empty(); }
  [[nodiscard]] const std::vector<glm::vec4>& stops() const { return stops_; }
  /// O(log stops).
  [[nodiscard]] glm::vec3 operator()(float value) const;
  bool operator==(const ColorRamp&) const = default;

 private:
  std::vector<glm::vec4> stops_;
};

/// Applies a ramp to every voxel. O(voxels of bricks) time and memory. Throws Error(cancelled).
ScalarVolume apply(const Ramp& ramp, const ScalarVolume& volume, const Progress* progress = nullptr);

}  // namespace cumulet::volume
