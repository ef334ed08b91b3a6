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
#include "surface/surface_parameters.glsl"
}  // namespace cumulet::core

namespace cumulet::scene {

/// Textures that SurfaceRaster needs of a scene, in main memory. Shared by all poses.
struct RasterPictures {
  /// An image, as color or as data. An image used both ways is stored twice.
  struct Texture {
    std::uint32_t image = 0;
    bool srgb = false;
    std::vector<std::vector<std::uint8_t>> smaller;  ///< levels 1 and up, if a sampler uses mipmaps
  };
  struct Map {
    std::size_t texture = 0;
    std::size_t sampler = 0;
  };
  using Maps = std::array<std::optional<Map>, core::CM_MAPS>;

  surface::ScenePtr scene;
  std::vector<Texture> textures;
  std::vector<surface::Sampler> samplers;
  std::vector<Maps> maps;  ///< per material
};

/// Data that SurfaceRaster needs of a scene, in main memory, prepared so that a frame only copies it. Shared by poses
/// that differ only in vertices. No GL.
struct RasterSource {
  /// A range of indices with the same state.
  struct Batch {
    std::uint32_t first = 0;
    std::uint32_t count = 0;
    std::uint32_t draw = 0;
  };
  struct Material {
    RasterPictures::Maps maps;
    surface::AlphaMode pass = surface::AlphaMode::opaque;  ///< transmissive materials are drawn as blended
    bool double_sided = false;
    bool coated = false;
    [[nodiscard]] std::uint32_t used() const;  ///< a bit per map
  };
  /// Stride of the material blocks: meets the binding alignment of every driver of GL 4.5.
  static constexpr std::size_t material_stride = 512;
  static_assert(sizeof(core::CmMaterial) <= material_stride && material_stride % 256 == 0);

  surface::ScenePtr scene;
  std::shared_ptr<const RasterPictures> pictures;
  std::vector<Material> materials;
  std::vector<std::byte> material_blocks;
  std::vector<Batch> solid;    ///< OPAQUE, then MASK
  std::vector<Batch> blended;  ///< one batch per triangle
};

/// Builds the data for a pose. pictures: those of another pose of the scene, if there is one. O(texels + blended
/// triangles), on TBB threads. Throws Error(cancelled).
std::shared_ptr<const RasterSource> make_raster_source(surface::ScenePtr scene, const surface::Pose& pose,
                                                       std::shared_ptr<const RasterPictures> pictures = nullptr,
                                                       const Progress* progress = nullptr);

/// Returns the centers of the blended triangles in a pose of the scene, by which they are sorted.
std::vector<glm::vec3> blended_centres(const RasterSource& source, const surface::Pose& pose,
                                       const Progress* progress = nullptr);

/// Halves a mipmap level: each texel is the level sampled bilinearly at the texel's center. Colors (srgb) are averaged
/// in linear light.
std::vector<std::uint8_t> half_of(const std::vector<std::uint8_t>& rgba, glm::uvec2 size, bool srgb,
                                  const Progress* progress = nullptr);

}  // namespace cumulet::scene
