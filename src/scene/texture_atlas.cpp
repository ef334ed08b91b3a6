#include "scene/texture_atlas.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "base/shared_code.hpp"
#include "scene/raster_source.hpp"

namespace cumulet::core {
#include "surface/surface_tables.glsl"
}  // namespace cumulet::core

namespace cumulet::scene {

namespace {

using glm::uvec2;

constexpr std::uint32_t usual_edge = 2048;

uvec2 halved_to_fit(uvec2 size, std::uint32_t largest) {
  while (std::max(size.x, size.y) > largest) size = glm::max(size / 2U, uvec2(1U));
  return size;
}

std::uint32_t wrap_bits(surface::Wrap wrap) {
  switch (wrap) {
    case surface::Wrap::mirrored:
      return core::CM_WRAP_MIRRORED;
    case surface::Wrap::clamp:
      return core::CM_WRAP_CLAMP;
    default:
      return core::CM_WRAP_REPEAT;
  }
}

}  // namespace

TextureImages texture_images(surface::ScenePtr scene, std::uint32_t largest, const Progress* progress) {
  TextureImages to;
  to.smaller.resize(scene->images.size());
  for (std::size_t i = 0; i < scene->images.size(); ++i) {
    const surface::Image& image = scene->images[i];
    to.sizes.push_back(halved_to_fit({image.width, image.height}, largest));
    std::vector<std::uint8_t>& smaller = to.smaller[i];
    for (uvec2 size(image.width, image.height); size != to.sizes[i]; size = glm::max(size / 2U, 1U)) {
      smaller = half_of(smaller.empty() ? image.rgba : smaller, size, false, progress);
    }
  }
  to.scene = std::move(scene);
  return to;
}

TextureAtlas pack_atlas(std::span<const TextureImagesPtr> scenes) {
  TextureAtlas atlas;
  std::vector<TextureAtlas::Region*> order;
  std::uint32_t widest = 1;
  std::uint64_t texels = 0;
  atlas.regions.resize(scenes.size());
  for (std::size_t i = 0; i < scenes.size(); ++i) {
    atlas.regions[i].resize(scenes[i]->sizes.size());
    for (std::size_t j = 0; j < atlas.regions[i].size(); ++j) {
      const uvec2 size = scenes[i]->sizes[j];
      atlas.regions[i][j].size = size;
      order.push_back(&atlas.regions[i][j]);
      widest = std::max({widest, size.x, size.y});
      texels += std::uint64_t{size.x} * size.y;
    }
  }
  if (order.empty()) return atlas;
  const auto square = std::bit_ceil(static_cast<std::uint32_t>(std::ceil(std::sqrt(double(texels)))));
  atlas.edge = std::max(widest, std::min(square, usual_edge));
  std::ranges::stable_sort(order, [](const auto* a, const auto* b) { return a->size.y > b->size.y; });
  uvec2 at(0U);
  std::uint32_t cache = 0;
  for (TextureAtlas::Region* const region : order) {
    if (at.x + region->size.x > atlas.edge) {
      at = {0U, at.y + cache};
      cache = 0;
    }
    if (at.y + region->size.y > atlas.edge) {
      at = uvec2(0U);
      cache = 0;
      ++atlas.layers;
    }
    region->corner = at;
    region->layer = atlas.layers;
    at.x += region->size.x;
    cache = std::max(cache, region->size.y);
  }
  ++atlas.layers;
  return atlas;
}

glm::uvec4 texture_word(const surface::Texture& texture, const TextureAtlas::Region& region) {
  return {region.corner.x | region.corner.y << 16U, region.size.x | region.size.y << 16U, region.layer,
          wrap_bits(texture.sampler.wrap_s) | wrap_bits(texture.sampler.wrap_t) << core::CM_WRAP_T_SHIFT |
              (texture.sampler.magnify == surface::Filter::nearest ? core::CM_TEXTURE_NEAREST : 0U)};
}

}  // namespace cumulet::scene
