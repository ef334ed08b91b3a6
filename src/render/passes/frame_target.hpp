#pragma once

#include <glm/glm.hpp>

#include "gl/api.hpp"
#include "render/pacing/region.hpp"

namespace cumulet::render {

/// When drawing waits for the driver's shader compiler.
enum class Wait {
  never,    ///< draws nothing while a program is missing
  to_show,  ///< waits if there is nothing older to show
  always,   ///< waits; for images that are read back and must be current
};

struct FrameTarget {
  GLuint framebuffer = 0;
  glm::uvec2 size{0U};  // lower bound of the attachments' size
  bool needs_depth = false;
  glm::ivec4 viewport{0};  // as glViewport
  Region region;           // part of the viewport to draw; the rest is unchanged
  bool flip_y = false;     // true: the picture's top row is at y = 0
  bool blend_over = true;
  bool is_hidden = false;  // nothing is written; used to warm up programs
  Wait wait = Wait::to_show;
  double filter_ms = 0.0;  // time of this frame for denoising
  // Depth to write if the picture has volume_z: a + b / z, or a + b z if orthographic.
  bool write_depth = false;
  bool reversed = false;
  bool orthographic = false;
  double depth_a = 0.0;
  double depth_b = 0.0;
};

}  // namespace cumulet::render
