#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

namespace cumulet::surface {

/// Directional albedo of a GGX lobe of glsl/surface/ggx.glsl: f0 x + f90 y, from the two sums of Karis, "Real Shading
/// in Unreal Engine 4", SIGGRAPH 2013. Shaders and C++ share one table, interpolated linearly.
class GgxAlbedo {
 public:
  /// Returns the table, which the first call computes. Thread-safe.
  static const GgxAlbedo& table();

  /// cosine: between the outgoing direction and the normal.
  [[nodiscard]] glm::vec2 towards(float roughness, float cosine) const;
  /// Returns the cosine-weighted mean over all directions, of the interpolated table.
  [[nodiscard]] glm::vec2 average(float roughness) const;

  /// Rows by roughness, each with `width` entries: by cosine (cm_ggx_albedo_position), then the average.
  [[nodiscard]] const std::vector<glm::vec2>& texels() const { return texels_; }
  static int width();
  static int height();

  /// Table data for texel buffers: rows of interpolation cells, each with its four corners as pairs of halves: {(i, j),
  /// (i + 1, j), (i, j + 1), (i + 1, j + 1)}.
  [[nodiscard]] std::vector<glm::uvec4> cells() const;
  /// Averages for texel buffers, in the format of cells(): {j, j + 1, 0, 0}.
  [[nodiscard]] std::vector<glm::uvec4> average_cells() const;

 private:
  GgxAlbedo();
  std::vector<glm::vec2> texels_;
};

}  // namespace cumulet::surface
