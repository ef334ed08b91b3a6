#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "mesh.hpp"

namespace cumulet::scene {

/// The ground below the cumulus in meters: ridges that rise into the cloud and a valley with a lake, shaped by erosion.
/// Deterministic.
class Terrain {
 public:
  explicit Terrain(std::uint32_t seed);

  /// Returns the height; coordinates outside the terrain's square are clamped.
  [[nodiscard]] float height(float x, float z) const;
  [[nodiscard]] glm::vec3 normal(float x, float z) const;

  /// Flattens the ground at `height` around (x, z) up to the radius `inner`, with a transition to the terrain at
  /// `outer`.
  void level(const glm::vec2& centre, float height, float inner, float outer);

  /// Returns the ground with snow, rock, scree and grass as vertex colors. uv: in tiles of the detail texture.
  [[nodiscard]] Mesh ground() const;
  /// Returns conifers at suitable positions.
  [[nodiscard]] Mesh forest() const;

  static constexpr float lake_level = -27.5F;
  static constexpr float spacing = 1.5F;
  static constexpr int side = 400;  ///< vertices per edge
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

/// A tile of rock and scree, `size` x `size` pixels RGB: a color factor (sRGB) and a normal map.
struct Detail {
  int size = 0;
  std::vector<std::uint8_t> color;
  std::vector<std::uint8_t> normal;
};
Detail make_detail(std::uint32_t seed);

}  // namespace cumulet::scene
