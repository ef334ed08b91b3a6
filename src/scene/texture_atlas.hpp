#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <span>
#include <vector>

#include "base/progress.hpp"
#include "surface/scene.hpp"

namespace cumulet::scene {

/// A scene's images as they go into an atlas.
struct TextureImages {
  surface::ScenePtr scene;
  std::vector<glm::uvec2> sizes;
  /// Of each, what is put there where that is not the image itself: encoded as it is, and smaller.
  std::vector<std::vector<std::uint8_t>> smaller;

  [[nodiscard]] const std::vector<std::uint8_t>& rgba(std::size_t image) const {
    return smaller[image].empty() ? scene->images[image].rgba : smaller[image];
  }
};
using TextureImagesPtr = std::shared_ptr<const TextureImages>;

/// largest: the widest layer that any driver takes; images beyond it are halved until they fit. Throws
/// Error(cancelled).
TextureImages texture_images(surface::ScenePtr scene, std::uint32_t largest, const Progress* progress = nullptr);

/// Images packed into layers of one size, each placed once: glsl/surface.glsl wraps and filters by itself.
struct TextureAtlas {
  struct Place {
    glm::uvec2 corner{0U};
    glm::uvec2 size{0U};
    std::uint32_t layer = 0;
  };
  std::uint32_t edge = 1;  // of a layer
  std::uint32_t layers = 0;
  std::vector<std::vector<Place>> places;  // of each scene's images
};

/// Shelves of falling height. The edge is that of the largest image at least. O(n log n).
TextureAtlas pack_atlas(std::span<const TextureImagesPtr> scenes);

/// A word of glsl/surface.glsl's table of textures: where its image is, and how it is looked up.
glm::uvec4 texture_word(const surface::Texture& texture, const TextureAtlas::Place& place);

}  // namespace cumulet::scene
