#include "scene/texture_atlas.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>

namespace cumulet::scene {

namespace {

using glm::uvec2;

constexpr std::uint32_t usual_edge = 2048;

uvec2 halved_to_fit(uvec2 size, std::uint32_t largest) {
  while (std::max(size.x, size.y) > largest) size = glm::max(size / 2U, uvec2(1U));
  return size;
}

}  // namespace

TextureAtlas pack_atlas(const std::vector<surface::Image>& images, std::uint32_t largest) {
  TextureAtlas atlas;
  atlas.places.resize(images.size());
  if (images.empty()) return atlas;
  std::uint32_t widest = 1;
  std::uint64_t texels = 0;
  for (std::size_t i = 0; i < images.size(); ++i) {
    const uvec2 size = halved_to_fit({images[i].width, images[i].height}, largest);
    atlas.places[i].size = size;
    widest = std::max({widest, size.x, size.y});
    texels += std::uint64_t{size.x} * size.y;
  }
  const auto square = std::bit_ceil(static_cast<std::uint32_t>(std::ceil(std::sqrt(double(texels)))));
  atlas.edge = std::min(largest, std::max(widest, std::min(square, usual_edge)));
  std::vector<std::size_t> order(images.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(
      order, [&](std::size_t a, std::size_t b) { return atlas.places[a].size.y > atlas.places[b].size.y; });
  uvec2 at(0U);
  std::uint32_t shelf = 0;
  for (const std::size_t i : order) {
    TextureAtlas::Place& place = atlas.places[i];
    if (at.x + place.size.x > atlas.edge) {
      at = {0U, at.y + shelf};
      shelf = 0;
    }
    if (at.y + place.size.y > atlas.edge) {
      at = uvec2(0U);
      shelf = 0;
      ++atlas.layers;
    }
    place.corner = at;
    place.layer = atlas.layers;
    at.x += place.size.x;
    shelf = std::max(shelf, place.size.y);
  }
  ++atlas.layers;
  return atlas;
}

}  // namespace cumulet::scene
