#pragma once

#include <glm/glm.hpp>
#include <optional>

#include "grid/statistics.hpp"

namespace cumulet::grid {

/// The voxels that the cells of a brick use: 8^3, or with interpolation the 9^3 at its lattice points.
class BrickVoxels {
 public:
  /// Looks up the brick of a field at this corner (cube space).
  void look_up(const Statistics& field, const glm::ivec3& corner) {
    const Statistics::Node& node = field.node_at(corner);
    side_ = field.interpolates() ? brick_corners : volume::brick_size;
    uniform_ = node.is_uniform() ? std::optional(node.uniform) : std::nullopt;
    if (uniform_) return;
    if (field.interpolates()) {
      field.read_corners(node, corners_);
      values_ = corners_.data();
    } else {
      values_ = field.values(node, room_);
    }
  }
  /// Set if all are equal.
  [[nodiscard]] const std::optional<float>& uniform() const { return uniform_; }
  /// The voxels in order, z fastest.
  [[nodiscard]] float operator[](int i) const { return uniform_ ? *uniform_ : values_[i]; }
  [[nodiscard]] float at(int x, int y, int z) const { return (*this)[(x * side_ + y) * side_ + z]; }

 private:
  int side_ = volume::brick_size;
  std::optional<float> uniform_ = 0.0F;
  const float* values_ = nullptr;
  volume::BrickValues::Brick room_{};
  BrickCorners corners_{};
};

}  // namespace cumulet::grid
