#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "mesh.hpp"

namespace cumulet::scene {

/// The ground under the cumulus, in metres: ridges that rise into the cloud, a valley with a lake, cut by running
/// water. Deterministic.
class Terrain {
 public:
  explicit Terrain(std::uint32_t seed);

  /// Inside the terrain's square, clamped to it.
  [[nodiscard]] float height(float x, float z) const;
  [[nodiscard]] glm::vec3 normal(float x, float z) const;

  /// Makes level ground at `height` around (x, z), with a slope down to what is there between the two radii.
  void level(const glm::vec2& centre, float height, float inner, float outer);

  /// Snow, rock, scree and grass as vertex colours; uv in tiles of the detail texture.
  [[nodiscard]] Mesh ground() const;
  /// Conifers where they would grow.
  [[nodiscard]] Mesh forest() const;

  static constexpr float lake_level = -27.5F;
  static constexpr float spacing = 1.5F;
  static constexpr int side = 400;  ///< vertices an edge
  static constexpr glm::vec2 low{-300.0F, -370.0F};

 private:
  void raise();
  void erode();
  void crumble();
  [[nodiscard]] float& at(int i, int j) { return heights_[std::size_t(i) + std::size_t(side) * std::size_t(j)]; }
  [[nodiscard]] float at(int i, int j) const { return heights_[std::size_t(i) + std::size_t(side) * std::size_t(j)]; }

  std::uint32_t seed_;
  std::vector<float> heights_;
};

/// A tile of rock and scree: a factor of the colour (sRGB) and a normal map, RGB, `size` pixels an edge.
struct Detail {
  int size = 0;
  std::vector<std::uint8_t> color;
  std::vector<std::uint8_t> normal;
};
Detail make_detail(std::uint32_t seed);

}  // namespace cumulet::scene
