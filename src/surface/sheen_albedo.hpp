#pragma once

#include <glm/glm.hpp>
#include <vector>

namespace cumulet::surface {

/// Directional albedo of white sheen (glsl/surface/sheen.glsl) by roughness, for sheen as GgxAlbedo for GGX. Immutable.
class SheenAlbedo {
 public:
  static const SheenAlbedo& table();

  /// towards(): for one cosine. average(): the cosine-weighted mean over all cosines.
  [[nodiscard]] float towards(float roughness, float cosine) const;
  [[nodiscard]] float average(float roughness) const;

  /// Data in the layout of glsl/surface/surface.glsl: the four corners of each cell, row by row; then both ends of each
  /// row's average.
  [[nodiscard]] std::vector<glm::uvec4> words() const;

 private:
  SheenAlbedo();
  [[nodiscard]] float at(int column, int row) const;

  std::vector<float> towards_;
  std::vector<float> averages_;
};

}  // namespace cumulet::surface
