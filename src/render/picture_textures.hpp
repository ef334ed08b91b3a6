#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>

#include "gl/api.hpp"
#include "render/region.hpp"
#include "render/row_revisions.hpp"
#include "render/surface_raster.hpp"

namespace cumulet::render {

/// What is known of pixels without noise (PixelFact), for a filter.
struct PictureGuides {
  GLuint albedo = 0;
  GLuint normal = 0;
  GLuint transmittance = 0;
  GLuint surface_z = 0;
  GLuint volume_z = 0;
  GLuint emission = 0;
  bool surfaces = true;       // they are part of the radiance
  glm::vec2 footprint{0.0F};  // of a pixel at view depth z, in the world: x + y z
};

/// From where a picture is seen, as scene::Viewpoint, and what. Eye and axes are in the world.
struct PictureView {
  glm::dvec3 eye{0.0};
  glm::dvec3 forward{0.0, 0.0, -1.0};
  glm::dvec3 right{1.0, 0.0, 0.0};
  glm::dvec3 up{0.0, 1.0, 0.0};
  bool orthographic = false;
  std::uint64_t scene = 0;  // another where more than the view is another
};

/// An accumulation as a tracer made it.
struct PictureTextures {
  GLuint sum = 0;         // rgba32f: sums of radiance in front of the background, and of alpha; row 0 is the top
  GLuint background = 0;  // rgb32f: means of the background's radiance, which alpha is already taken off; what there
                          // is to show where there are no samples
  GLuint counts = 0;      // .x is the number of samples summed
  glm::uvec2 size{0U};
  std::optional<PixelBox> box{};  // that samples are of: others are no neighbours of theirs; without, all
  bool holes = false;   // some pixels may have no sample yet: they take after those around them, else show what was
                        // there before
  GLuint volume_z = 0;  // r32f, same size, or 0: view depth z at half opacity, 0 where the volume is not so opaque
  const SurfaceLayers* beneath = nullptr;  // surfaces to draw beneath
  GLuint host_z = 0;                       // as HostDepth's, that hides those behind it; 0: none
  unsigned host_layers = 0;
  GLuint sum_before = 0;  // what was there before, of any size; 0: nothing
  GLuint background_before = 0;
  GLuint counts_before = 0;
  std::optional<std::uint64_t> revision{};  // another wherever the sums may be others; without, they always may
  const RowRevisions* rows = nullptr;       // when rows changed, where that is known
  std::uint64_t picture = 0;                // another with every picture that is begun
  std::uint64_t wish = 0;                   // the same of pictures of the same thing, however coarse
  bool may_lag = false;                   // more samples of it are on their way: those of some frames ago may be drawn
  GLuint moments = 0;                     // r32f: means of samples' squared luminance, background included
  std::optional<PictureGuides> guides{};  // without, it is not filtered
  std::optional<PictureView> view{};      // without, what pictures before it knew is neither used nor replaced
};

/// What means.glsl reads of it, to the units that it names.
void bind_sums(const gl::Functions& gl, const PictureTextures& picture);

/// What of the radiance means hold, by CM_BACKGROUND of resolve.comp.
enum class MeansBackground : std::uint8_t { left_out = 0, added = 1, apart = 2 };

}  // namespace cumulet::render
