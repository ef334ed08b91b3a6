#pragma once

#include <array>
#include <deque>
#include <glm/glm.hpp>

#include "gl/programs.hpp"

namespace cumulet::render {

enum class DepthSource { none = 0, texture = 1, texture_multisample = 2, framebuffer = 3 };

/// The host's depth buffer of one frame, and its encoding: d = a + b / z, or a + b z if orthographic.
struct HostDepthInput {
  DepthSource source = DepthSource::none;
  GLuint name = 0;
  glm::ivec4 viewport{0};  // of the frame, as glViewport
  glm::uvec2 target_size{0U};
  bool flip_y = false;
  bool orthographic = false;
  double depth_a = 0.0;
  double depth_b = 0.0;
  bool unchanged = false;  // the host says so: nothing is read if all other fields except the name are as before
};

/// Converts the host's depth buffer to view depth z, with one layer per sample (at most 8) and row 0 at the picture's
/// top. Pixels at or beyond the far value have no surface and get infinity. Needs a current context and an active
/// StateGuard; changes GL state freely.
class HostDepth {
 public:
  HostDepth(gl::FunctionsPtr gl, gl::ProgramsPtr programs) : gl_(std::move(gl)), programs_(std::move(programs)) {}
  /// Reads the input. Returns whether z is known to differ anywhere from before (or its size or layer count does). The
  /// result may be that of an earlier call, because update() does not wait for the device. Exception: Mesa's llvmpipe
  /// waits for the host's drawing to the depth buffer. Throws Error(invalid_argument) if the name is not such a texture
  /// or framebuffer, has no depth, or is smaller than the viewport. In that case z is unchanged. O(pixels).
  bool update(const HostDepthInput& input);
  /// True if the result of a comparison is not known yet; a later update() returns it.
  [[nodiscard]] bool pending() const { return waits_ || !asked_.empty(); }
  /// True if the last update() could not read because its program was still compiling.
  [[nodiscard]] bool waits_for_program() const { return waits_; }
  /// GL_TEXTURE_2D_ARRAY, r32f; 0 without input.
  [[nodiscard]] GLuint texture() const { return z_.name(); }
  [[nodiscard]] glm::uvec2 size() const { return size_; }
  [[nodiscard]] unsigned layers() const { return layers_; }

 private:
  /// A texture to read, and the offset in it.
  struct Source {
    GLuint texture = 0;
    int samples = 0;  // 0: a GL_TEXTURE_2D
    glm::ivec2 origin{0};
  };
  Source open_texture(const HostDepthInput& input);
  Source open_framebuffer(const HostDepthInput& input);
  // Takes the results that have arrived; returns whether any says that z differs.
  bool answered();
  Source copy(GLuint framebuffer, GLenum format, int samples, glm::ivec4 rectangle);

  gl::FunctionsPtr gl_;
  gl::ProgramsPtr programs_;
  HostDepthInput last_;
  gl::Object z_;
  glm::uvec2 size_{0U};
  unsigned layers_ = 0;
  gl::Object copy_;  // copy of a depth buffer that cannot be read in place
  glm::ivec2 copy_size_{0};
  GLenum copy_format_ = 0;
  int copy_samples_ = 0;
  gl::Object sampler_;
  gl::Object changed_;
  static constexpr std::size_t max_asked = 8;
  gl::ReadBack answers_;  // read-back of changed_, one slot per request
  struct Asked {
    std::size_t slot = 0;
    gl::Fence fence;
  };
  std::deque<Asked> asked_;
  bool waits_ = false;
  std::size_t next_slot_ = 0;
};

}  // namespace cumulet::render
