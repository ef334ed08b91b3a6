#pragma once

#include <glm/glm.hpp>
#include <map>
#include <string>
#include <vector>

#include "gl/objects.hpp"
#include "render/display.hpp"
#include "render/surface_raster.hpp"

namespace cumulet::render {

/// An accumulation as a tracer made it.
struct PictureTextures {
  GLuint sum = 0;     // rgba32f: sums of radiance (without any background) and alpha; row 0 is the top
  GLuint counts = 0;  // rgba32ui: .x is the number of samples summed; a pixel with none is transparent black
  glm::uvec2 size{0U};
  bool holes = false;   // some pixels may have no sample yet: they take after those around them
  GLuint volume_z = 0;  // r32f, same size, or 0: view depth z at half opacity, 0 where the volume is not so opaque
  const SurfaceLayers* beneath = nullptr;  // surfaces to draw beneath
  GLuint host_z = 0;                       // as HostDepth's, that hides those behind it; 0: none
  unsigned host_layers = 0;
};

struct FrameTarget {
  GLuint framebuffer = 0;
  glm::ivec4 viewport{0};  // as glViewport
  bool flip_y = false;     // true: the picture's top row at y = 0
  bool blend_over = true;
  // Depth to write, where the picture has volume_z: a + b / z, or a + b z where orthographic.
  bool write_depth = false;
  bool reversed = false;
  bool orthographic = false;
  double depth_a = 0.0;
  double depth_b = 0.0;
};

/// Draws an accumulation over a rectangle of a framebuffer: one triangle, bilinear where sizes differ.
/// Needs the context current and a StateGuard around; leaves any state it likes.
/// Vertex arrays and framebuffers belong to one context of a share group: those it needs live for one call.
class Compositor {
 public:
  explicit Compositor(gl::FunctionsPtr gl) : gl_(std::move(gl)) {}
  /// Draws nothing without a picture or into a rectangle of size 0. Writes colour to draw buffer 0 alone, whatever the
  /// depth there; alpha is premultiplied after exposure, tone map and encoding. Throws Error(invalid_argument) for a
  /// name that is no framebuffer, or one that is not complete.
  void draw(const PictureTextures& picture, const Display& display, const FrameTarget& target);

 private:
  // Whether there is memory for it.
  bool resolve(const PictureTextures& picture);

  gl::FunctionsPtr gl_;
  std::map<std::vector<std::string>, gl::Object> colours_;  // by their macros: made when first needed
  gl::Object resolve_;
  gl::Object mean_;
  glm::uvec2 mean_size_{0U};
  gl::Object depth_;
};

}  // namespace cumulet::render
