#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>

#include "render/pacing/region.hpp"

namespace cumulet::render {

enum class View { shaded = 0, cells = 1, steps = 2, density = 3, wireframe = 4 };

/// How camera rays use the surface pass (rasterized surfaces).
enum class Layered {
  no,       // not at all: they hit triangles, if there are any
  within,   // they end at it and take its color
  beneath,  // they end at it; the compositor draws it beneath the picture
};

/// Settings of the host for samples. They are passed on as a whole, from the C API to PathFeatures.
struct PictureOptions {
  View view = View::shaded;
  /// Coarse pictures come first. The first pass of a picture leaves the last few pixels of a tile, those with the
  /// longest paths, to the second.
  bool preview = true;
  /// Samples that hit the volume before any surface are also summed separately, at full resolution.
  bool separate_volume_aov = false;
  /// Number of light groups with separate sums, at full resolution; 0: none.
  std::uint32_t light_groups = 0;
  /// If there is a noise target, pixels are sampled only as much as it needs (Allotment); else all equally.
  bool adaptive = false;
  /// Render region. Tiles and noise cover only its pixels.
  Region region{};
  bool operator==(const PictureOptions&) const = default;
};

struct PictureSettings {
  PictureOptions options;
  Layered layered = Layered::no;
  glm::uvec2 layer_size{0U};
  unsigned layers = 1;
  /// The picture is done once its noise (Totals::noise) reaches this; nullopt: once it has its samples.
  std::optional<double> noise_target;
  /// Margin of pixels around the render region, which are sampled as well.
  unsigned margin = 0;
};

}  // namespace cumulet::render
