// Conversion of the host's depth buffer to view depth: a known scene, drawn with plain GL, compared with its analytic
// depth.

#include "render/host_depth.hpp"

#include <dlfcn.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/error.hpp"
#include "gl/state_guard.hpp"
#include "support/gl_state.hpp"

namespace {

using cumulet::Error;
using cumulet::ErrorCode;
using cumulet::gl::Object;
using cumulet::gl::StateGuard;
using cumulet::render::DepthSource;
using cumulet::render::HostDepth;
using cumulet::render::HostDepthInput;
namespace gl = cumulet::gl;

constexpr float infinite = std::numeric_limits<float>::infinity();

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

const std::array<Camera, 8> cameras{{{"standard", false, true, false},
                                     {"infinite", false, false, false},
                                     {"reversed", true, true, false, GL_ZERO_TO_ONE},
                                     {"reversed infinite", true, false, false, GL_ZERO_TO_ONE},
                                     {"standard, clip zero to one", false, true, false, GL_ZERO_TO_ONE},
                                     {"reversed, clip minus one to one", true, true, false},
                                     {"orthographic", false, true, true},
                                     {"orthographic reversed", true, true, true, GL_ZERO_TO_ONE}}};

// The scene: a slanted wall (z = 6 + 0.5 x + 0.25 y) over the left part of the image, a box's face (z = 3) in front of
// it, nothing on the right.
constexpr double wall_end = 0.55;  // in normalised device x
constexpr double box_x[2] = {-0.5, 0.1};
constexpr double box_y[2] = {-0.4, 0.3};

/// The view depth z at a point of the image, x and y from -1 to 1, y up.
double scene_z(const Camera& camera, double x, double y) {
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
    program_ = Object(functions_, Object::Kind::program, functions_->CreateProgram());
    for (const auto& [type, source] : {std::pair{GL_VERTEX_SHADER, vertex}, std::pair{GL_FRAGMENT_SHADER, fragment}}) {
      const Object shader(functions_, Object::Kind::shader, functions_->CreateShader(static_cast<GLenum>(type)));
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
    const StateGuard guard(*functions_);
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
    Object depth, framebuffer;
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

  static HostDepthInput input_of(const Camera& camera, DepthSource source, GLuint name, glm::ivec4 viewport) {
    HostDepthInput input;
    input.source = source;
    input.name = name;
    input.viewport = viewport;
    input.target_size = glm::uvec2(size);
    input.orthographic = camera.orthographic;
    input.depth_a = camera.a();
    input.depth_b = camera.b();
    return input;
  }
  bool update(const HostDepthInput& input) {
    const StateGuard guard(*functions_);
    const bool changed = depth_->update(input);
    functions_->Finish();  // a device answers later
    HostDepthInput again = input;
    again.unchanged = true;
    return depth_->update(again) || changed;
  }
  [[nodiscard]] std::vector<float> read() const {
    const StateGuard guard(*functions_);
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
  std::optional<HostDepth> depth_;

 private:
  Object program_;
  Object vertex_array_;
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
CUMULET_ON_BACKENDS(HostDepths);

double step_of(GLenum format) {
  if (format == GL_DEPTH_COMPONENT16) return 1.0 / 65535.0;
  if (format == GL_DEPTH_COMPONENT32F || format == GL_DEPTH32F_STENCIL8) return 1.2e-7;
  return 2.5e-7;
}

TEST_P(HostDepths, EveryConventionFromTextures) {
  for (const Camera& camera : cameras) {
    for (const int samples : {0, 4}) {
      for (const bool flip : {false, true}) {
        SCOPED_TRACE(testing::Message() << camera.name << ", samples " << samples << ", flip " << flip);
        const DepthScene::Host host = scene_->make_host(GL_DEPTH_COMPONENT32F, samples, false);
        const glm::ivec4 viewport(0, 0, size);
        scene_->draw_scene(camera, host.framebuffer.name(), viewport);
        HostDepthInput input = DepthScene::input_of(
            camera, samples > 0 ? DepthSource::texture_multisample : DepthSource::texture, host.depth.name(), viewport);
        input.flip_y = flip;
        scene_->update(input);
        scene_->expect_scene(camera, viewport, flip, samples > 0 ? 4 : 1, step_of(GL_DEPTH_COMPONENT32F));
        ASSERT_FALSE(HasFatalFailure());
      }
    }
  }
}

TEST_P(HostDepths, EveryFormatFromFramebuffers) {
  for (const GLenum format : {GL_DEPTH_COMPONENT16, GL_DEPTH_COMPONENT24, GL_DEPTH_COMPONENT32, GL_DEPTH_COMPONENT32F,
                              GL_DEPTH24_STENCIL8, GL_DEPTH32F_STENCIL8}) {
    for (const bool renderbuffer : {false, true}) {
      for (const int samples : {0, 4}) {
        for (const Camera* camera : {&cameras[0], &cameras[2]}) {
          SCOPED_TRACE(testing::Message() << "format " << format << ", renderbuffer " << renderbuffer << ", samples "
                                          << samples << ", " << camera->name);
          const DepthScene::Host host = scene_->make_host(format, samples, renderbuffer);
          const glm::ivec4 viewport(0, 0, size);
          scene_->draw_scene(*camera, host.framebuffer.name(), viewport);
          scene_->update(DepthScene::input_of(*camera, DepthSource::framebuffer, host.framebuffer.name(), viewport));
          scene_->expect_scene(*camera, viewport, false, samples > 0 ? 4 : 1, step_of(format));
          if (!renderbuffer) {
            scene_->update(DepthScene::input_of(*camera,
                                                samples > 0 ? DepthSource::texture_multisample : DepthSource::texture,
                                                host.depth.name(), viewport));
            scene_->expect_scene(*camera, viewport, false, samples > 0 ? 4 : 1, step_of(format));
          }
          ASSERT_FALSE(HasFatalFailure());
        }
      }
    }
  }
}

TEST_P(HostDepths, SubRectangles) {
  const Camera& camera = cameras[2];
  const glm::ivec4 viewport(9, 4, 33, 24);
  for (const int samples : {0, 4}) {
    const DepthScene::Host host = scene_->make_host(GL_DEPTH_COMPONENT32F, samples, false);
    scene_->draw_scene(camera, host.framebuffer.name(), viewport);
    const DepthSource texture = samples > 0 ? DepthSource::texture_multisample : DepthSource::texture;
    for (const bool flip : {false, true}) {
      for (const DepthSource source : {texture, DepthSource::framebuffer}) {
        SCOPED_TRACE(testing::Message() << "samples " << samples << ", source " << int(source) << ", flip " << flip);
        HostDepthInput input = DepthScene::input_of(
            camera, source, source == texture ? host.depth.name() : host.framebuffer.name(), viewport);
        input.flip_y = flip;
        scene_->update(input);
        scene_->expect_scene(camera, viewport, flip, samples > 0 ? 4 : 1, 1.2e-7);
      }
    }
  }
  // A depth texture of the viewport's size starts at the viewport's corner.
  const DepthScene::Host own = scene_->make_host(GL_DEPTH_COMPONENT32F, 0, false, {33, 24});
  scene_->draw_scene(camera, own.framebuffer.name(), {0, 0, 33, 24});
  scene_->update(DepthScene::input_of(camera, DepthSource::texture, own.depth.name(), viewport));
  scene_->expect_scene(camera, viewport, false, 1, 1.2e-7);
  scene_->update(DepthScene::input_of(camera, DepthSource::framebuffer, own.framebuffer.name(), viewport));
  scene_->expect_scene(camera, viewport, false, 1, 1.2e-7);
}

TEST_P(HostDepths, TextureParametersAreIgnoredAndKept) {
  const Camera& camera = cameras[0];
  const glm::ivec4 viewport(0, 0, size);
  const DepthScene::Host host = scene_->make_host(GL_DEPTH24_STENCIL8, 0, false);
  const GLuint name = host.depth.name();
  scene_->draw_scene(camera, host.framebuffer.name(), viewport);
  const HostDepthInput input = DepthScene::input_of(camera, DepthSource::texture, name, viewport);
  const auto set = [&](GLenum parameter, GLenum value) {
    gl_->TextureParameteri(name, parameter, static_cast<GLint>(value));
  };
  const auto expect = [&](const char* what) {
    SCOPED_TRACE(what);
    const StateGuard guard(*gl_);
    scene_->depth_.emplace(gl_, programs_);
    scene_->update(input);
    scene_->expect_scene(camera, viewport, false, 1, 2.5e-7);
  };
  set(GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
  set(GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  expect("a shadow map");
  set(GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
  set(GL_TEXTURE_MAX_LEVEL, 5);
  expect("filters that need mipmaps");
  set(GL_DEPTH_STENCIL_TEXTURE_MODE, GL_STENCIL_INDEX);
  expect("stencil sampling");
  set(GL_DEPTH_STENCIL_TEXTURE_MODE, GL_DEPTH_COMPONENT);
  set(GL_TEXTURE_SWIZZLE_R, GL_ZERO);
  expect("swizzled");
}

TEST_P(HostDepths, MutableTextures) {
  const Camera& camera = cameras[0];
  GLuint name = 0;
  gl_->GenTextures(1, &name);
  const Object texture(gl_, Object::Kind::texture, name);
  gl_->BindTexture(GL_TEXTURE_2D, name);  // incomplete: its filters need mipmaps, and the depth format is unsized
  gl_->TexImage2D(GL_TEXTURE_2D, 0, GL_DEPTH_COMPONENT, size.x, size.y, 0, GL_DEPTH_COMPONENT, GL_UNSIGNED_INT,
                  nullptr);
  gl_->BindTexture(GL_TEXTURE_2D, 0);
  const Object framebuffer = gl::make_framebuffer(gl_);
  gl_->NamedFramebufferTexture(framebuffer.name(), GL_DEPTH_ATTACHMENT, name, 0);
  gl_->NamedFramebufferDrawBuffer(framebuffer.name(), GL_NONE);
  const glm::ivec4 viewport(0, 0, size);
  scene_->draw_scene(camera, framebuffer.name(), viewport);
  for (const bool by_texture : {true, false}) {
    scene_->update(DepthScene::input_of(camera, by_texture ? DepthSource::texture : DepthSource::framebuffer,
                                        by_texture ? name : framebuffer.name(), viewport));
    scene_->expect_scene(camera, viewport, false, 1, 2.5e-7);
  }
}

TEST_P(HostDepths, R32FValues) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<float> depths{0.0F, 0.5F, 0.999F, 1.0F, 1.5F, nan, infinite, -infinite};
  const Object texture = gl::make_texture_2d(gl_, GL_R32F, 8, 1, "depth");
  gl_->TextureSubImage2D(texture.name(), 0, 0, 0, 8, 1, GL_RED, GL_FLOAT, depths.data());
  HostDepthInput input;
  input.source = DepthSource::texture;
  input.name = texture.name();
  input.viewport = {0, 0, 8, 1};
  input.target_size = {8U, 1U};
  input.depth_a = 1.0;  // standard, infinite far plane: z = 0.5 / (1 - d)
  input.depth_b = -0.5;
  EXPECT_TRUE(scene_->update(input));
  std::vector<float> z = scene_->read();
  EXPECT_FLOAT_EQ(z[0], 0.5F);
  EXPECT_FLOAT_EQ(z[1], 1.0F);
  EXPECT_NEAR(z[2], 500.0F, 0.05F);
  for (std::size_t i = 3; i < 7; ++i) EXPECT_EQ(z[i], infinite) << i;
  EXPECT_FALSE(scene_->update(input));  // the converted values compare equal, even where the input is NaN
  input.depth_a = 0.0;                  // reversed: z = 0.5 / d
  input.depth_b = 0.5;
  EXPECT_TRUE(scene_->update(input));
  z = scene_->read();
  EXPECT_EQ(z[0], infinite);
  EXPECT_FLOAT_EQ(z[1], 1.0F);
  EXPECT_FLOAT_EQ(z[3], 0.5F);
  EXPECT_EQ(z[5], infinite);
  EXPECT_EQ(z[7], infinite);
}

TEST_P(HostDepths, FarSurfacesKeepTheirPrecision) {
  // Depths within a few roundings of `a`: the error of `a` as a float would be a large part of z.
  const std::vector<float> depths{1.0F - 0x1p-24F, 1.0F - 0x1p-22F, 1.0F - 0x1p-20F, 0.999F};
  const Object texture = gl::make_texture_2d(gl_, GL_R32F, 4, 1, "depth");
  gl_->TextureSubImage2D(texture.name(), 0, 0, 0, 4, 1, GL_RED, GL_FLOAT, depths.data());
  HostDepthInput input;
  input.source = DepthSource::texture;
  input.name = texture.name();
  input.viewport = {0, 0, 4, 1};
  input.target_size = {4U, 1U};
  const double near = 0.1;
  const double far = 123456.0;
  input.depth_a = far / (far - near);
  input.depth_b = -far * near / (far - near);
  scene_->update(input);
  const std::vector<float> z = scene_->read();
  for (std::size_t i = 0; i < 4; ++i) {
    const double expected = input.depth_b / (double(depths[i]) - input.depth_a);
    EXPECT_NEAR(z[i], expected, 1e-6 * expected);
  }
}

TEST_P(HostDepths, ChangesAreDetected) {
  const Camera& camera = cameras[0];
  const glm::ivec4 viewport(0, 0, size);
  const DepthScene::Host host = scene_->make_host(GL_DEPTH_COMPONENT32F, 4, false);
  scene_->draw_scene(camera, host.framebuffer.name(), viewport);
  HostDepthInput input = DepthScene::input_of(camera, DepthSource::texture_multisample, host.depth.name(), viewport);
  EXPECT_TRUE(scene_->update(input));
  EXPECT_FALSE(scene_->update(input));
  scene_->draw_scene(camera, host.framebuffer.name(), viewport);
  EXPECT_FALSE(scene_->update(input));  // unchanged
  // Changes one pixel.
  gl_->BindFramebuffer(GL_DRAW_FRAMEBUFFER, host.framebuffer.name());
  gl_->Enable(GL_SCISSOR_TEST);
  gl_->Scissor(17, 11, 1, 1);
  gl_->ClearDepth(0.25);
  gl_->Clear(GL_DEPTH_BUFFER_BIT);
  gl_->Disable(GL_SCISSOR_TEST);
  gl_->BindFramebuffer(GL_DRAW_FRAMEBUFFER, 0);
  input.unchanged = true;  // the host declares it unchanged
  EXPECT_FALSE(scene_->update(input));
  input.unchanged = false;
  EXPECT_TRUE(scene_->update(input));
  EXPECT_FALSE(scene_->update(input));
  // A change of the depth convention or of the source is a change, whatever `unchanged` says.
  input.unchanged = true;
  input.depth_b *= 2.0;
  EXPECT_TRUE(scene_->update(input));
  input.flip_y = true;
  EXPECT_TRUE(scene_->update(input));
  input.viewport.z -= 1;
  EXPECT_TRUE(scene_->update(input));
  EXPECT_EQ(scene_->depth_->size(), glm::uvec2(size.x - 1, size.y));
  EXPECT_FALSE(scene_->update(input));
  input.source = DepthSource::none;
  EXPECT_TRUE(scene_->update(input));
  EXPECT_EQ(scene_->depth_->texture(), 0U);
  EXPECT_EQ(scene_->depth_->layers(), 0U);
  EXPECT_FALSE(scene_->update(input));
  input.source = DepthSource::texture_multisample;
  input.viewport.z = 0;  // an empty viewport
  EXPECT_FALSE(scene_->update(input));
}

TEST_P(HostDepths, InvalidNamesAreReportedAndKeepTheImage) {
  const Camera& camera = cameras[0];
  const glm::ivec4 viewport(0, 0, size);
  const DepthScene::Host host = scene_->make_host(GL_DEPTH_COMPONENT24, 0, false);
  scene_->draw_scene(camera, host.framebuffer.name(), viewport);
  const HostDepthInput good = DepthScene::input_of(camera, DepthSource::texture, host.depth.name(), viewport);
  scene_->update(good);
  const auto cause = [&](DepthSource source, GLuint name, glm::ivec4 rectangle) -> std::string {
    try {
      scene_->update(DepthScene::input_of(camera, source, name, rectangle));
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::invalid_argument);
      EXPECT_EQ(gl_->GetError(), GLenum{GL_NO_ERROR});
      return error.what();
    }
    return "";
  };
  const auto text = [](const char* kind, GLuint name, const std::string& rest) {
    return "host depth, " + std::string(kind) + " " + std::to_string(name) + ", " + rest;
  };
  const Object color = gl::make_texture_2d(gl_, GL_RGBA8, size.x, size.y, "colour");
  const Object array = gl::make_texture_2d_array(gl_, GL_DEPTH_COMPONENT24, 4, 4, 4, "array");
  const Object multisample = gl::make_texture_2d_multisample(gl_, GL_RGBA8, 4, size.x, size.y, "colour");
  const Object empty = gl::make_framebuffer(gl_);
  const Object no_depth = gl::make_framebuffer(gl_);
  gl_->NamedFramebufferTexture(no_depth.name(), GL_COLOR_ATTACHMENT0, color.name(), 0);
  const GLuint name = host.depth.name();
  const GLuint framebuffer = host.framebuffer.name();
  for (const GLuint unknown : {0U, 4711U}) {
    EXPECT_EQ(cause(DepthSource::texture, unknown, viewport), text("texture", unknown, "is not a GL_TEXTURE_2D"));
  }
  EXPECT_EQ(cause(DepthSource::texture, array.name(), viewport),
            text("texture", array.name(), "is not a GL_TEXTURE_2D"));
  EXPECT_EQ(cause(DepthSource::texture_multisample, name, viewport),
            text("texture", name, "is not a GL_TEXTURE_2D_MULTISAMPLE"));
  EXPECT_EQ(cause(DepthSource::texture, color.name(), viewport),
            text("texture", color.name(), "has neither a depth format nor GL_R32F"));
  EXPECT_EQ(cause(DepthSource::texture_multisample, multisample.name(), viewport),
            text("texture", multisample.name(), "does not have a depth format"));
  EXPECT_EQ(cause(DepthSource::framebuffer, 4711, viewport),
            text("framebuffer", 4711, "does not exist in the current context"));
  EXPECT_EQ(cause(DepthSource::framebuffer, empty.name(), viewport),
            text("framebuffer", empty.name(), "is not complete"));
  EXPECT_EQ(cause(DepthSource::framebuffer, no_depth.name(), viewport),
            text("framebuffer", no_depth.name(), "has no depth buffer"));
  const std::string small = "is 48x32 and does not contain the viewport, 48x33 at 0,0";
  EXPECT_EQ(cause(DepthSource::texture, name, {0, 0, 48, 33}), text("texture", name, small));
  EXPECT_EQ(cause(DepthSource::framebuffer, framebuffer, {0, 0, 48, 33}), text("framebuffer", framebuffer, small));
  EXPECT_NE(cause(DepthSource::texture, name, {-1, 0, 20, 20}), "");
  EXPECT_FALSE(scene_->update(good));  // the previous depth is kept
  scene_->expect_scene(camera, viewport, false, 1, 2.5e-7);
}

TEST_P(HostDepths, DoesNotModifyTheHostsFramebuffer) {
  const DepthScene::Host host = scene_->make_host(GL_DEPTH_COMPONENT32F, 0, true);
  const glm::ivec4 viewport(0, 0, size);
  scene_->draw_scene(cameras[0], host.framebuffer.name(), viewport);
  scene_->update(DepthScene::input_of(cameras[0], DepthSource::framebuffer, host.framebuffer.name(), viewport));
  HostDepth again(gl_, programs_);
  const std::vector<float> first = scene_->read();
  const StateGuard guard(*gl_);
  EXPECT_TRUE(
      again.update(DepthScene::input_of(cameras[0], DepthSource::framebuffer, host.framebuffer.name(), viewport)));
  EXPECT_FALSE(scene_->depth_->update(
      DepthScene::input_of(cameras[0], DepthSource::framebuffer, host.framebuffer.name(), viewport)));
  EXPECT_EQ(scene_->read(), first);
}

/// A context of OSMesa in main memory whose default framebuffer has a size and depth. The library stays loaded, so that
/// leak reports contain its name.
struct DefaultFramebuffer {
  void* library = dlopen("libOSMesa.so.8", RTLD_NOW);
  void* context = nullptr;
  std::vector<std::uint32_t> pixels;

  template <class Function>
  Function get(const char* name) const {
    return reinterpret_cast<Function>(dlsym(library, name));
  }
  DefaultFramebuffer(glm::ivec2 size, int depth_bits, int stencil_bits)
      : pixels(static_cast<std::size_t>(size.x * size.y)) {
    if (library == nullptr) return;
    // RGBA, depth, stencil, core profile, 4.5
    const std::array<int, 13> attributes{0x22, 0x1908, 0x30, depth_bits, 0x31, stencil_bits, 0x33, 0x34,
                                         0x36, 4,      0x37, 5,          0};
    context = get<void* (*)(const int*, void*)>("OSMesaCreateContextAttribs")(attributes.data(), nullptr);
    if (context == nullptr) return;
    get<unsigned char (*)(void*, void*, unsigned, int, int)>("OSMesaMakeCurrent")(context, pixels.data(), 0x1401,
                                                                                  size.x, size.y);
  }
  DefaultFramebuffer(const DefaultFramebuffer&) = delete;
  DefaultFramebuffer& operator=(const DefaultFramebuffer&) = delete;
  ~DefaultFramebuffer() {
    if (context != nullptr) get<void (*)(void*)>("OSMesaDestroyContext")(context);
  }
  static void* get_proc(void* user, const char* name) {
    return static_cast<DefaultFramebuffer*>(user)->get<void* (*)(const char*)>("OSMesaGetProcAddress")(name);
  }
};

TEST(DefaultFramebufferDepth, IsReadLikeAnyFramebuffer) {
  for (const auto& [depth_bits, stencil_bits] : {std::pair{24, 8}, std::pair{16, 0}, std::pair{32, 0}}) {
    SCOPED_TRACE(depth_bits);
    DefaultFramebuffer screen(DepthScene::size, depth_bits, stencil_bits);
    if (screen.context == nullptr) GTEST_SKIP() << "no such OSMesa context";
    const gl::FunctionsPtr functions = gl::load_functions(DefaultFramebuffer::get_proc, &screen);
    DepthScene scene(functions, std::make_shared<gl::Programs>(*functions, nullptr));
    const glm::ivec4 viewport(5, 3, 40, 27);
    scene.draw_scene(cameras[0], 0, viewport);
    scene.update(DepthScene::input_of(cameras[0], DepthSource::framebuffer, 0, viewport));
    scene.expect_scene(cameras[0], viewport, false, 1, depth_bits == 16 ? 1.0 / 65535.0 : 2.5e-7);
    EXPECT_EQ(functions->GetError(), GLenum{GL_NO_ERROR});
  }
}

}  // namespace
