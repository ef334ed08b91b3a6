#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>

#include "render/region.hpp"

namespace cumulet::render {

enum class View { shaded = 0, cells = 1, steps = 2, density = 3, wireframe = 4 };

/// How camera rays use the surface pass (rasterized surfaces).
enum class Layered {
  no,       // not at all: they hit triangles, if there are any
  within,   // they end at it and take its color
  beneath,  // they end at it; the compositor draws it beneath the picture
};

struct PictureSettings {
  View view = View::shaded;
  /// The first pass leaves the last few pixels of a tile, those with the longest paths, to the second.
  bool previews_first = false;
  Layered layered = Layered::no;
  glm::uvec2 layer_size{0U};
  unsigned layers = 1;
  /// Samples that hit the volume before any surface are also summed separately.
  bool separate_volume_aov = false;
  /// The picture is done once its noise (Totals::noise) reaches this; nullopt: once it has its samples.
  std::optional<double> noise_target;
  /// Pixels are sampled only as much as the noise target needs (Allotment); else all equally.
  bool adaptive = false;
  /// Number of light groups with separate sums; 0: none.
  std::uint32_t light_groups = 0;
  /// Render region, and a margin of pixels around it. Tiles and noise cover only these pixels.
  Region region;
  unsigned margin = 0;
};

}  // namespace cumulet::render
