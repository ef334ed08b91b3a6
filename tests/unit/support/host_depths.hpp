#pragma once

// Scenes in a host's depth buffer, in every depth convention.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "gl/state_guard.hpp"
#include "render/raster/host_depth.hpp"
#include "support/gl_state.hpp"

namespace cumulet::test {

inline constexpr float infinite = std::numeric_limits<float>::infinity();

/// A host's camera at the origin, looking along -z: eye z = -z. All projections have the same field of view or size.
struct Camera {
  const char* name;
  bool reversed;
  bool far_plane;
  bool orthographic;
  GLenum clip = GL_NEGATIVE_ONE_TO_ONE;

  static constexpr double near = 0.5, far = 40.0, tangent = 0.6, half_height = 3.0, aspect = 1.5;

  [[nodiscard]] double a() const {
    const double standard = orthographic ? -near / (far - near) : (far_plane ? far / (far - near) : 1.0);
    return reversed ? 1.0 - standard : standard;
  }
  [[nodiscard]] double b() const {
    const double standard = orthographic ? 1.0 / (far - near) : (far_plane ? -far * near / (far - near) : -near);
    return reversed ? -standard : standard;
  }
  [[nodiscard]] glm::mat4 projection() const {
    // Clip-space depth is d w, or (2 d - 1) w; w = z, or 1 if orthographic; z = -eye z.
    const double scale = clip == GL_ZERO_TO_ONE ? 1.0 : 2.0;
    const double shift = clip == GL_ZERO_TO_ONE ? 0.0 : -1.0;
    glm::dmat4 m(0.0);
    if (orthographic) {
      m[0][0] = 1.0 / (half_height * aspect);
      m[1][1] = 1.0 / half_height;
      m[2][2] = -scale * b();
      m[3][2] = scale * a() + shift;
      m[3][3] = 1.0;
    } else {
      m[0][0] = 1.0 / (tangent * aspect);
      m[1][1] = 1.0 / tangent;
      m[2][2] = -(scale * a() + shift);
      m[2][3] = -1.0;
      m[3][2] = scale * b();
    }
    return {m};
  }
};

inline const std::array<Camera, 8> cameras{{{"standard", false, true, false},
                                            {"infinite", false, false, false},
                                            {"reversed", true, true, false, GL_ZERO_TO_ONE},
                                            {"reversed infinite", true, false, false, GL_ZERO_TO_ONE},
                                            {"standard, clip zero to one", false, true, false, GL_ZERO_TO_ONE},
                                            {"reversed, clip minus one to one", true, true, false},
                                            {"orthographic", false, true, true},
                                            {"orthographic reversed", true, true, true, GL_ZERO_TO_ONE}}};

// The scene: a slanted wall (z = 6 + 0.5 x + 0.25 y) over the left part of the image, a box's face (z = 3) in front of
// it, nothing on the right.
inline constexpr double wall_end = 0.55;  // in normalised device x
inline constexpr double box_x[2] = {-0.5, 0.1};
inline constexpr double box_y[2] = {-0.4, 0.3};

/// The view depth z at a point of the image, x and y from -1 to 1, y up.
inline double scene_z(const Camera& camera, double x, double y) {
  if (x > box_x[0] && x < box_x[1] && y > box_y[0] && y < box_y[1]) return 3.0;
  if (x > wall_end) return infinite;
  // z = 6 + 0.5 X + 0.25 Y, where X and Y are eye coordinates.
  if (camera.orthographic) {
    return 6.0 + 0.5 * x * Camera::half_height * Camera::aspect + 0.25 * y * Camera::half_height;
  }
  return 6.0 / (1.0 - 0.5 * x * Camera::tangent * Camera::aspect - 0.25 * y * Camera::tangent);
}

/// The scene in one context, and the depth read from it.
class DepthScene {
 public:
  static constexpr glm::ivec2 size{48, 32};

  DepthScene(gl::FunctionsPtr gl, gl::ProgramsPtr programs)
      : functions_(std::move(gl)), depth_(std::in_place, functions_, std::move(programs)) {
    const char* vertex =
        "#version 450\nlayout(location = 0) uniform mat4 projection;\nlayout(location = 1) uniform vec4 corners[6];\n"
        "void main() { gl_Position = projection * corners[gl_VertexID]; }\n";
    const char* fragment = "#version 450\nvoid main() {}\n";
    program_ = gl::Object(functions_, gl::Object::Kind::program, functions_->CreateProgram());
    for (const auto& [type, source] : {std::pair{GL_VERTEX_SHADER, vertex}, std::pair{GL_FRAGMENT_SHADER, fragment}}) {
      const gl::Object shader(functions_, gl::Object::Kind::shader,
                              functions_->CreateShader(static_cast<GLenum>(type)));
      functions_->ShaderSource(shader.name(), 1, &source, nullptr);
      functions_->CompileShader(shader.name());
      functions_->AttachShader(program_.name(), shader.name());
    }
    functions_->LinkProgram(program_.name());
    vertex_array_ = gl::make_vertex_array(functions_);
  }

  void draw_quad(const Camera& camera, const double x[2], const double y[2], bool wall) const {
    std::array<glm::vec4, 6> corners{};
    for (std::size_t i = 0; i < 6; ++i) {
      const double cx = x[i == 1 || i == 3 || i == 4 ? 1 : 0];
      const double cy = y[i == 2 || i == 4 || i == 5 ? 1 : 0];
      const double z = wall ? scene_z(camera, cx, cy) : 3.0;
      const double reach = camera.orthographic ? Camera::half_height : z * Camera::tangent;
      corners[i] = glm::vec4(cx * reach * Camera::aspect, cy * reach, -z, 1.0);
    }
    functions_->ProgramUniform4fv(program_.name(), 1, 6, &corners[0].x);
    functions_->DrawArrays(GL_TRIANGLES, 0, 6);
  }

  /// Draws the scene into a framebuffer's viewport.
  void draw_scene(const Camera& camera, GLuint framebuffer, glm::ivec4 viewport) const {
    const gl::StateGuard guard(*functions_);
    functions_->BindFramebuffer(GL_DRAW_FRAMEBUFFER, framebuffer);
    functions_->BindVertexArray(vertex_array_.name());
    functions_->UseProgram(program_.name());
    const glm::mat4 projection = camera.projection();
    functions_->ProgramUniformMatrix4fv(program_.name(), 0, 1, GL_FALSE, &projection[0].x);
    functions_->ClipControl(GL_LOWER_LEFT, camera.clip);
    functions_->ClearDepth(camera.reversed ? 0.0 : 1.0);
    functions_->Clear(GL_DEPTH_BUFFER_BIT);
    functions_->ClearDepth(1.0);
    functions_->ViewportIndexedf(0, float(viewport.x), float(viewport.y), float(viewport.z), float(viewport.w));
    functions_->Enable(GL_DEPTH_TEST);
    functions_->DepthFunc(camera.reversed ? GL_GREATER : GL_LESS);
    const double wall_x[2] = {-1.0, wall_end};
    const double wall_y[2] = {-1.0, 1.0};
    draw_quad(camera, wall_x, wall_y, true);
    draw_quad(camera, box_x, box_y, false);
  }

  struct Host {
    gl::Object depth, framebuffer;
    GLuint renderbuffer = 0;
    gl::FunctionsPtr functions;

    Host() = default;
    Host(Host&& other) noexcept
        : depth(std::move(other.depth)),
          framebuffer(std::move(other.framebuffer)),
          renderbuffer(std::exchange(other.renderbuffer, 0U)),
          functions(other.functions) {}
    Host(const Host&) = delete;
    Host& operator=(const Host&) = delete;
    Host& operator=(Host&&) = delete;
    ~Host() {
      if (renderbuffer != 0) functions->DeleteRenderbuffers(1, &renderbuffer);
    }
  };
  static bool has_stencil(GLenum format) { return format == GL_DEPTH24_STENCIL8 || format == GL_DEPTH32F_STENCIL8; }
  [[nodiscard]] Host make_host(GLenum format, int samples, bool renderbuffer, glm::ivec2 extent = size) const {
    Host host;
    host.functions = functions_;
    host.framebuffer = gl::make_framebuffer(functions_);
    const GLenum point = has_stencil(format) ? GL_DEPTH_STENCIL_ATTACHMENT : GL_DEPTH_ATTACHMENT;
    if (renderbuffer) {
      functions_->CreateRenderbuffers(1, &host.renderbuffer);
      functions_->NamedRenderbufferStorageMultisample(host.renderbuffer, samples, format, extent.x, extent.y);
      functions_->NamedFramebufferRenderbuffer(host.framebuffer.name(), point, GL_RENDERBUFFER, host.renderbuffer);
    } else {
      host.depth = samples > 0
                       ? gl::make_texture_2d_multisample(functions_, format, samples, extent.x, extent.y, "depth")
                       : gl::make_texture_2d(functions_, format, extent.x, extent.y, "depth");
      functions_->NamedFramebufferTexture(host.framebuffer.name(), point, host.depth.name(), 0);
    }
    functions_->NamedFramebufferDrawBuffer(host.framebuffer.name(), GL_NONE);
    functions_->NamedFramebufferReadBuffer(host.framebuffer.name(), GL_NONE);
    return host;
  }

  static render::HostDepthInput input_of(const Camera& camera, render::DepthSource source, GLuint name,
                                         glm::ivec4 viewport) {
    render::HostDepthInput input;
    input.source = source;
    input.name = name;
    input.viewport = viewport;
    input.target_size = glm::uvec2(size);
    input.orthographic = camera.orthographic;
    input.depth_a = camera.a();
    input.depth_b = camera.b();
    return input;
  }
  bool update(const render::HostDepthInput& input) {
    const gl::StateGuard guard(*functions_);
    const bool changed = depth_->update(input);
    functions_->Finish();  // a device answers later
    render::HostDepthInput again = input;
    again.unchanged = true;
    return depth_->update(again) || changed;
  }
  [[nodiscard]] std::vector<float> read() const {
    const gl::StateGuard guard(*functions_);
    std::vector<float> z(std::size_t{depth_->size().x} * depth_->size().y * depth_->layers());
    functions_->GetTextureImage(depth_->texture(), 0, GL_RED, GL_FLOAT, static_cast<GLsizei>(z.size() * 4), z.data());
    return z;
  }

  /// Compares every z with the scene's, except within a pixel of its edges. step: resolution of the depth format.
  void expect_scene(const Camera& camera, glm::ivec4 viewport, bool flip, unsigned layers, double step) {
    ASSERT_EQ(depth_->size(), glm::uvec2(viewport.z, viewport.w));
    ASSERT_EQ(depth_->layers(), layers);
    std::vector<glm::vec2> positions(layers, glm::vec2(0.5F));
    if (layers > 1) {
      const Host multisampled = make_host(GL_DEPTH_COMPONENT32F, static_cast<int>(layers), false);
      functions_->BindFramebuffer(GL_DRAW_FRAMEBUFFER, multisampled.framebuffer.name());
      for (unsigned s = 0; s < layers; ++s) functions_->GetMultisamplefv(GL_SAMPLE_POSITION, s, &positions[s].x);
    }
    const std::vector<float> z = read();
    int surfaces = 0;
    int empty = 0;
    for (unsigned layer = 0; layer < layers; ++layer) {
      for (int row = 0; row < viewport.w; ++row) {
        for (int column = 0; column < viewport.z; ++column) {
          const int up = flip ? row : viewport.w - 1 - row;
          const double x = 2.0 * (column + double(positions[layer].x)) / viewport.z - 1.0;
          const double y = 2.0 * (up + double(positions[layer].y)) / viewport.w - 1.0;
          const double dx = 2.0 / viewport.z;
          const double dy = 2.0 / viewport.w;
          const auto near_edge = [&](double cx, double cy) { return std::abs(cx) < dx || std::abs(cy) < dy; };
          if (std::abs(x - wall_end) < dx || near_edge(x - box_x[0], 9.0) || near_edge(x - box_x[1], 9.0) ||
              near_edge(9.0, y - box_y[0]) || near_edge(9.0, y - box_y[1])) {
            continue;
          }
          const float got = z[(layer * static_cast<std::size_t>(viewport.w) + static_cast<std::size_t>(row)) *
                                  static_cast<std::size_t>(viewport.z) +
                              static_cast<std::size_t>(column)];
          double expected = scene_z(camera, x, y);
          if (std::isinf(expected)) {
            ++empty;
            ASSERT_EQ(got, infinite) << column << ',' << row;
            continue;
          }
          ++surfaces;
          // The tolerance is one step of the format in z, plus the single precision of the host's transform.
          const double slope =
              camera.orthographic ? 1.0 / std::abs(camera.b()) : expected * expected / std::abs(camera.b());
          ASSERT_NEAR(got, expected, 1.25 * (step * slope + 2e-5 * expected))
              << column << ',' << row << " layer " << layer;
        }
      }
    }
    EXPECT_GT(surfaces, 100);
    EXPECT_GT(empty, 20);
  }

 private:
  gl::FunctionsPtr functions_;

 public:
  std::optional<render::HostDepth> depth_;

 private:
  gl::Object program_;
  gl::Object vertex_array_;
};

class HostDepths : public cumulet::test::GlTest {
 protected:
  static constexpr glm::ivec2 size = DepthScene::size;
  void SetUp() override {
    GlTest::SetUp();
    if (gl_) scene_.emplace(gl_, programs_);
  }
  std::optional<DepthScene> scene_;
};

}  // namespace cumulet::test
