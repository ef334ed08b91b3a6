#pragma once

#include <array>
#include <deque>
#include <glm/glm.hpp>

#include "gl/programs.hpp"

namespace cumulet::render {

enum class DepthSource { none = 0, texture = 1, texture_multisample = 2, framebuffer = 3 };

/// The host's depth of one frame, and what its numbers mean: d = a + b / z, or a + b z where orthographic.
struct HostDepthInput {
  DepthSource source = DepthSource::none;
  GLuint name = 0;
  glm::ivec4 viewport{0};  // of the frame, as glViewport
  glm::uvec2 target_size{0U};
  bool flip_y = false;
  bool orthographic = false;
  double depth_a = 0.0;
  double depth_b = 0.0;
  bool unchanged = false;  // the host says so: nothing is read if all else (but the name) is as before
};

/// Keeps the host's depth as view depth z, a layer a sample (at most 8), row 0 the picture's top; infinity where there
/// is no surface (the far value, or beyond). Needs the context current and a StateGuard around; leaves any state it
/// likes.
class HostDepth {
 public:
  HostDepth(gl::FunctionsPtr gl, gl::ProgramsPtr programs) : gl_(std::move(gl)), programs_(std::move(programs)) {}
  /// Reads the input. Returns whether it is known by now that z differs from before anywhere (or size or layers do): of
  /// this call or an earlier one, for the device is not waited for (but Mesa's llvmpipe waits for the host's drawing of
  /// it). Throws
  /// Error(invalid_argument) for a name that is no such texture or framebuffer, does not hold depth, or is smaller than
  /// the viewport; z is then what it was. O(pixels).
  bool update(const HostDepthInput& input);
  /// Whether it is still to be told if z differs: a later update will.
  [[nodiscard]] bool pending() const { return waits_ || !asked_.empty(); }
  /// Whether the last update could not read, the driver being at its program still.
  [[nodiscard]] bool waits_for_program() const { return waits_; }
  /// GL_TEXTURE_2D_ARRAY, r32f; 0 without input.
  [[nodiscard]] GLuint texture() const { return z_.name(); }
  [[nodiscard]] glm::uvec2 size() const { return size_; }
  [[nodiscard]] unsigned layers() const { return layers_; }

 private:
  /// A texture to read, and from where.
  struct Source {
    GLuint texture = 0;
    int samples = 0;  // 0: a GL_TEXTURE_2D
    glm::ivec2 origin{0};
  };
  Source open_texture(const HostDepthInput& input);
  Source open_framebuffer(const HostDepthInput& input);
  // Whether any of those answered says that z differs.
  bool answered();
  Source copy(GLuint framebuffer, GLenum format, int samples, glm::ivec4 rectangle);

  gl::FunctionsPtr gl_;
  gl::ProgramsPtr programs_;
  HostDepthInput last_;
  gl::Object z_;
  glm::uvec2 size_{0U};
  unsigned layers_ = 0;
  gl::Object copy_;  // of what cannot be read in place
  glm::ivec2 copy_size_{0};
  GLenum copy_format_ = 0;
  int copy_samples_ = 0;
  gl::Object sampler_;
  gl::Object changed_;
  static constexpr std::size_t most_asked = 8;
  gl::ReadBack answers_;  // what changed_ was, one place each
  struct Asked {
    std::size_t place = 0;
    gl::Fence fence;
  };
  std::deque<Asked> asked_;
  bool waits_ = false;
  std::size_t next_place_ = 0;
};

}  // namespace cumulet::render
