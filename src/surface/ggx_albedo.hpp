#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

namespace cumulet::surface {

/// What share of constant radiance from above a GGX lobe of glsl/ggx.glsl reflects: f0 x + f90 y, by the two sums of
/// Karis, "Real Shading in Unreal Engine 4", SIGGRAPH 2013. One table for shaders and C++, linear between its entries.
class GgxAlbedo {
 public:
  /// Made at the first call; the same ever after. Any thread.
  static const GgxAlbedo& table();

  /// Towards a direction of this cosine to the normal.
  [[nodiscard]] glm::vec2 towards(float roughness, float cosine) const;
  /// The mean over all directions, weighed by the cosine; of the table as it is interpolated.
  [[nodiscard]] glm::vec2 average(float roughness) const;

  /// Rows by roughness of `width` entries: by the cosine (cm_ggx_albedo_place), then the average.
  [[nodiscard]] const std::vector<glm::vec2>& texels() const { return texels_; }
  static int width();
  static int height();

  /// For texel buffers: rows of cells between the entries, each with its four corners as pairs of halves: {(i, j),
  /// (i + 1, j), (i, j + 1), (i + 1, j + 1)}.
  [[nodiscard]] std::vector<glm::uvec4> cells() const;
  /// The same of the averages: {j, j + 1, 0, 0}.
  [[nodiscard]] std::vector<glm::uvec4> average_cells() const;

 private:
  GgxAlbedo();
  std::vector<glm::vec2> texels_;
};

}  // namespace cumulet::surface
