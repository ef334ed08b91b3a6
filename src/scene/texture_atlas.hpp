#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <span>
#include <vector>

#include "base/progress.hpp"
#include "surface/scene.hpp"

namespace cumulet::scene {

/// A scene's images, prepared for an atlas.
struct TextureImages {
  surface::ScenePtr scene;
  std::vector<glm::uvec2> sizes;
  /// For each image, a reduced version with the same encoding; empty if the image itself is used.
  std::vector<std::vector<std::uint8_t>> smaller;

  [[nodiscard]] const std::vector<std::uint8_t>& rgba(std::size_t image) const {
    return smaller[image].empty() ? scene->images[image].rgba : smaller[image];
  }
};
using TextureImagesPtr = std::shared_ptr<const TextureImages>;

/// Prepares a scene's images. largest: layer size that every driver supports; larger images are halved until they fit.
/// Throws Error(cancelled).
TextureImages texture_images(surface::ScenePtr scene, std::uint32_t largest, const Progress* progress = nullptr);

/// Images packed into layers of one size, each stored once: glsl/surface/surface.glsl does the wrapping and filtering.
struct TextureAtlas {
  struct Region {
    glm::uvec2 corner{0U};
    glm::uvec2 size{0U};
    std::uint32_t layer = 0;
  };
  std::uint32_t edge = 1;  // width and height of a layer
  std::uint32_t layers = 0;
  std::vector<std::vector<Region>> regions;  // for each image of each scene
};

/// Packs images in rows of decreasing height (shelf packing). The layer edge is at least that of the largest image. O(n
/// log n).
TextureAtlas pack_atlas(std::span<const TextureImagesPtr> scenes);

/// Returns a word of glsl/surface/surface.glsl's texture table: the image's position in the atlas, and its wrapping and
/// filtering.
glm::uvec4 texture_word(const surface::Texture& texture, const TextureAtlas::Region& region);

}  // namespace cumulet::scene
