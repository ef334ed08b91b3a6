#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "base/progress.hpp"
#include "base/shared_code.hpp"
#include "surface/scene.hpp"

namespace cumulet::core {
#include "surface_parameters.glsl"
}  // namespace cumulet::core

namespace cumulet::scene {

/// The textures that SurfaceRaster needs of a scene, in main memory. Of all its poses the same.
struct RasterPictures {
  /// An image as colour or as data: one that serves as both is there twice.
  struct Texture {
    std::uint32_t image = 0;
    bool srgb = false;
    std::vector<std::vector<std::uint8_t>> smaller;  ///< levels 1 and on, where a sampler asks for any
  };
  struct Map {
    std::size_t texture = 0;
    std::size_t sampler = 0;
  };
  using Maps = std::array<std::optional<Map>, core::CM_MAPS>;

  surface::ScenePtr scene;
  std::vector<Texture> textures;
  std::vector<surface::Sampler> samplers;
  std::vector<Maps> maps;  ///< a material
};

/// What SurfaceRaster needs of a scene, in main memory, so that a frame only copies it. Shared by poses that differ in
/// vertices alone. No GL.
struct RasterSource {
  /// A range of indices with one state.
  struct Batch {
    std::uint32_t first = 0;
    std::uint32_t count = 0;
    std::uint32_t draw = 0;
  };
  struct Material {
    RasterPictures::Maps maps;
    surface::AlphaMode pass = surface::AlphaMode::opaque;  ///< what transmits is drawn as what blends
    bool double_sided = false;
    bool coated = false;
    [[nodiscard]] std::uint32_t used() const;  ///< a bit a map
  };
  /// Between the blocks of materials: what any driver of GL 4.5 can bind at.
  static constexpr std::size_t material_stride = 512;
  static_assert(sizeof(core::CmMaterial) <= material_stride && material_stride % 256 == 0);

  surface::ScenePtr scene;
  std::shared_ptr<const RasterPictures> pictures;
  std::vector<Material> materials;
  std::vector<std::byte> material_blocks;
  std::vector<Batch> solid;    ///< OPAQUE, then MASK
  std::vector<Batch> blended;  ///< a triangle each
};

/// Of a pose; `pictures`: of another pose of the scene, if there is one. O(texels + blended triangles), on TBB's
/// threads. Throws Error(cancelled).
std::shared_ptr<const RasterSource> make_raster_source(surface::ScenePtr scene, const surface::Pose& pose,
                                                       std::shared_ptr<const RasterPictures> pictures = nullptr,
                                                       const Progress* progress = nullptr);

/// Of the blended triangles in a pose of the scene: what they are sorted by.
std::vector<glm::vec3> blended_centres(const RasterSource& source, const surface::Pose& pose,
                                       const Progress* progress = nullptr);

/// The half of a level of a texture: each texel as if the level were looked at in its middle, bilinearly. Colours
/// (srgb) are averaged as light is.
std::vector<std::uint8_t> half_of(const std::vector<std::uint8_t>& rgba, glm::uvec2 size, bool srgb,
                                  const Progress* progress = nullptr);

}  // namespace cumulet::scene
