#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>

#include "gl/api.hpp"
#include "render/pacing/region.hpp"
#include "render/pacing/row_revisions.hpp"
#include "render/raster/surface_raster.hpp"

namespace cumulet::render {

/// Noise-free feature buffers (FeatureBuffer) that guide the denoiser.
struct PictureGuides {
  GLuint albedo = 0;
  GLuint normal = 0;
  GLuint transmittance = 0;
  GLuint surface_z = 0;
  GLuint volume_z = 0;
  GLuint emission = 0;
  bool surfaces = true;       // the radiance includes surfaces
  glm::vec2 footprint{0.0F};  // world size of a pixel at view depth z: x + y z
};

/// Camera of a picture, as scene::Viewpoint, and a number of the scene. Eye and axes are in world space.
struct PictureView {
  glm::dvec3 eye{0.0};
  glm::dvec3 forward{0.0, 0.0, -1.0};
  glm::dvec3 right{1.0, 0.0, 0.0};
  glm::dvec3 up{0.0, 1.0, 0.0};
  bool orthographic = false;
  std::uint64_t scene = 0;  // changes when anything but the view changes
};

/// Textures of an accumulated picture, as a tracer made them.
struct PictureTextures {
  GLuint sum = 0;  // rgba32f: sums of radiance in front of the background, and of alpha; row 0 is the top
  // rgb32f: means of the background's radiance, already multiplied by 1 - alpha; shown by pixels without samples
  GLuint background = 0;
  GLuint counts = 0;  // .x is the number of samples summed
  glm::uvec2 size{0U};
  std::optional<PixelBox> box{};  // pixels that are sampled: others are not used as neighbors; nullopt: all
  bool holes = false;  // pixels may be unsampled: they take the mean of sampled neighbors, else the previous picture
  // r32f of the same size, or 0: view depth z at half opacity, 0 if the volume does not reach that opacity
  GLuint volume_z = 0;
  const SurfaceLayers* beneath = nullptr;  // rasterized surfaces to draw beneath
  GLuint host_z = 0;                       // as HostDepth::texture(), hides the surfaces behind it; 0: none
  unsigned host_layers = 0;
  GLuint sum_before = 0;  // sums of the previous picture, of any size; 0: none
  GLuint background_before = 0;
  GLuint counts_before = 0;
  // changes whenever the sums may have changed; nullopt: they may change at any time
  std::optional<std::uint64_t> revision{};
  const RowRevisions* rows = nullptr;     // when rows changed; null: unknown
  std::uint64_t picture = 0;              // changes with every picture that is started
  std::uint64_t request = 0;              // request number: equal for pictures of the same content at any resolution
  bool may_lag = false;                   // more samples are on their way, so an image of some frames ago may be drawn
  GLuint moments = 0;                     // r32f: means of samples' squared luminance, background included
  std::optional<PictureGuides> guides{};  // nullopt: the picture is not denoised
  std::optional<PictureView> view{};      // nullopt: the temporal history is neither used nor replaced
};

/// Binds the textures that means.glsl reads, to the units that it names.
void bind_sums(const gl::Functions& gl, const PictureTextures& picture);

/// How means treat the background's radiance, as CM_BACKGROUND of resolve.comp.
enum class MeansBackground : std::uint8_t { left_out = 0, added = 1, apart = 2 };

}  // namespace cumulet::render
