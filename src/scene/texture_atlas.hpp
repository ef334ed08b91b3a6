#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "surface/scene.hpp"

namespace cumulet::scene {

/// Images packed into layers of one size, each placed once: glsl/surface.glsl wraps and filters by itself.
struct TextureAtlas {
  struct Place {
    glm::uvec2 corner{0U};
    glm::uvec2 size{0U};
    std::uint32_t layer = 0;
  };
  std::uint32_t edge = 1;  // of a layer
  std::uint32_t layers = 0;
  std::vector<Place> places;  // of each image
  /// Of each image, what is put there where that is not the image itself.
  std::vector<std::vector<std::uint8_t>> smaller;
};

/// Shelves of falling height. largest: the widest layer the driver takes; images beyond it are halved until they fit.
TextureAtlas pack_atlas(const std::vector<surface::Image>& images, std::uint32_t largest);

}  // namespace cumulet::scene
