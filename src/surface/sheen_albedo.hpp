#pragma once

#include <glm/glm.hpp>
#include <vector>

namespace cumulet::surface {

/// Which share of constant radiance white sheen reflects (glsl/sheen.glsl), by its roughness, where GgxAlbedo has its
/// own. Immutable.
class SheenAlbedo {
 public:
  static const SheenAlbedo& table();

  /// Towards a cosine, and on average over all of them, weighed by the cosine.
  [[nodiscard]] float towards(float roughness, float cosine) const;
  [[nodiscard]] float average(float roughness) const;

  /// As glsl/surface.glsl reads it: the four corners of each cell, row by row; then both ends of each row's average.
  [[nodiscard]] std::vector<glm::uvec4> words() const;

 private:
  SheenAlbedo();
  [[nodiscard]] float at(int column, int row) const;

  std::vector<float> towards_;
  std::vector<float> averages_;
};

}  // namespace cumulet::surface
