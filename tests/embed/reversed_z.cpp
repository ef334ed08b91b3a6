// A host with its own depth: reversed-Z with an infinite far plane (glClipControl) and a multisampled framebuffer,
// compared with the same scene with OpenGL's defaults. One opaque cube is half inside the cloud, one behind it, one
// beside it.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "image.hpp"
#include "support/c_host.hpp"

namespace {

using cumulet::test::make_desc;
using Matrix = std::array<double, 16>;
using Bytes = std::vector<std::uint8_t>;

constexpr int side = 96;
constexpr double near_plane = 0.1;
constexpr double eye_z = 40.0;
const double focal = 1.0 / std::tan(20.0 * 3.14159265358979323846 / 180.0);

constexpr const char* vertex_source = R"(#version 450 core
uniform mat4 to_clip;
uniform vec3 centre;
uniform float radius;
void main() {
  int face = gl_VertexID / 6, axis = face >> 1;
  vec2 corner = vec2[](vec2(0, 0), vec2(1, 0), vec2(1, 1), vec2(0, 0), vec2(1, 1), vec2(0, 1))[gl_VertexID % 6];
  vec3 p = vec3(0);
  p[axis] = float(face & 1);
  p[(axis + 1) % 3] = corner.x;
  p[(axis + 2) % 3] = corner.y;
  gl_Position = to_clip * vec4(centre + radius * (2 * p - 1), 1);
})";
constexpr const char* fragment_source = R"(#version 450 core
uniform vec3 colour;
out vec4 result;
void main() { result = vec4(colour, 1); })";

struct Cube {
  std::array<float, 3> centre;
  float radius;
  std::array<float, 3> color;
};
// The ball has radius 12 about the origin; the eye is on +Z.
constexpr Cube half_inside{{3.0F, 3.0F, 12.0F}, 3.0F, {0.2F, 0.4F, 1.0F}};
constexpr Cube behind{{-4.0F, -4.0F, -9.0F}, 3.0F, {1.0F, 0.0F, 0.0F}};
constexpr Cube beside{{11.5F, -11.5F, 0.0F}, 1.5F, {0.0F, 0.8F, 0.2F}};

struct Convention {
  bool reversed = false;
  int multisamples = 1;
  cumulet_depth_source source = CUMULET_DEPTH_SOURCE_TEXTURE;
};

class HostScene {
 public:
  explicit HostScene(const Convention& convention)
      : convention_(convention),
        context_(cumulet::headless::Context::create(cumulet::headless::Backend::automatic)),
        gl_(cumulet::test::load_gl(cumulet::headless::Context::get_proc, &context_)) {
    const bool many = convention.multisamples > 1;
    const GLenum target = many ? GL_TEXTURE_2D_MULTISAMPLE : GL_TEXTURE_2D;
    const auto texture = [&](GLuint& name, GLenum format) {
      gl_.CreateTextures(target, 1, &name);
      if (many) {
        gl_.TextureStorage2DMultisample(name, convention.multisamples, format, side, side, GL_TRUE);
      } else {
        gl_.TextureStorage2D(name, 1, format, side, side);
      }
    };
    texture(color_, GL_RGBA8);
    texture(depth_, GL_DEPTH_COMPONENT32F);
    gl_.CreateFramebuffers(1, &framebuffer_);
    gl_.NamedFramebufferTexture(framebuffer_, GL_COLOR_ATTACHMENT0, color_, 0);
    gl_.NamedFramebufferTexture(framebuffer_, GL_DEPTH_ATTACHMENT, depth_, 0);

    program_ = gl_.CreateProgram();
    for (const auto& [type, source] :
         {std::pair(GL_VERTEX_SHADER, vertex_source), {GL_FRAGMENT_SHADER, fragment_source}}) {
      const GLuint shader = gl_.CreateShader(static_cast<GLenum>(type));
      gl_.ShaderSource(shader, 1, &source, nullptr);
      gl_.CompileShader(shader);
      gl_.AttachShader(program_, shader);
      gl_.DeleteShader(shader);
    }
    gl_.LinkProgram(program_);
    gl_.CreateVertexArrays(1, &vertex_array_);

    viewer_ = cumulet::test::make_viewer(
        {.get_proc = cumulet::headless::Context::get_proc, .user = &context_, .samples = 48});
    auto display = make_desc<cumulet_display_desc>();
    display.background = CUMULET_BACKGROUND_TRANSPARENT;
    EXPECT_EQ(cumulet_set_display(viewer_.get(), &display), CUMULET_OK);
    cumulet_camera* camera = nullptr;
    EXPECT_EQ(cumulet_get_camera(viewer_.get(), &camera), CUMULET_OK);
    const cumulet::test::CameraRef owner(camera);
    EXPECT_EQ(
        cumulet_camera_set_matrices(camera, view().data(), projection().data(),
                                    convention.reversed ? CUMULET_CLIP_ZERO_TO_ONE : CUMULET_CLIP_NEGATIVE_ONE_TO_ONE),
        CUMULET_OK);
    EXPECT_EQ(cumulet_set_volume(viewer_.get(), cumulet::test::make_ball(24, 2.0F).get()), CUMULET_OK);
  }
  HostScene(const HostScene&) = delete;
  HostScene& operator=(const HostScene&) = delete;
  ~HostScene() {
    gl_.DeleteVertexArrays(1, &vertex_array_);
    gl_.DeleteProgram(program_);
    gl_.DeleteFramebuffers(1, &framebuffer_);
    gl_.DeleteTextures(1, &color_);
    gl_.DeleteTextures(1, &depth_);
  }

  /// The scene with these cubes, with or without the cloud over it. Resolved, bottom row first.
  Bytes draw(const std::vector<Cube>& cubes, bool cloud, bool write_depth = false) {
    draw_cubes(cubes);
    if (cloud) {
      auto frame = make_desc<cumulet_frame_desc>();
      frame.budget_ms = 100.0;
      frame.framebuffer = framebuffer_;
      frame.width = frame.height = side;
      frame.depth_source = convention_.source;
      frame.depth_name = convention_.source == CUMULET_DEPTH_SOURCE_FRAMEBUFFER ? framebuffer_ : depth_;
      // Renders all samples first, because a cloud drawn twice would be twice as dense.
      frame.target = CUMULET_TARGET_NONE;
      frame.write_depth = write_depth ? 1 : 0;
      cumulet::test::converge(viewer_.get(), frame);
      frame.target = CUMULET_TARGET_FRAMEBUFFER;
      auto result = make_desc<cumulet_frame_result>();
      EXPECT_EQ(cumulet_render(viewer_.get(), &frame, &result), CUMULET_OK) << cumulet_last_error(viewer_.get());
      EXPECT_NE(result.flags & CUMULET_RENDER_CONVERGED, 0U);
      EXPECT_EQ(result.width, unsigned{side});
    }
    return resolved();
  }
  void draw_cubes(const std::vector<Cube>& cubes) {
    gl_.BindFramebuffer(GL_FRAMEBUFFER, framebuffer_);
    gl_.Viewport(0, 0, side, side);
    gl_.ClipControl(GL_LOWER_LEFT, convention_.reversed ? GL_ZERO_TO_ONE : GL_NEGATIVE_ONE_TO_ONE);
    gl_.Enable(GL_DEPTH_TEST);
    gl_.DepthFunc(convention_.reversed ? GL_GREATER : GL_LESS);
    if (!cleared_ || !keep_) {
      const std::array<float, 4> grey{0.25F, 0.25F, 0.25F, 1.0F};
      const float far_depth = convention_.reversed ? 0.0F : 1.0F;
      gl_.ClearBufferfv(GL_COLOR, 0, grey.data());
      gl_.ClearBufferfv(GL_DEPTH, 0, &far_depth);
      cleared_ = true;
    }
    gl_.UseProgram(program_);
    gl_.BindVertexArray(vertex_array_);
    std::array<float, 16> matrix{};
    const Matrix p = projection();
    const Matrix v = view();
    for (std::size_t c = 0; c < 4; ++c)
      for (std::size_t r = 0; r < 4; ++r)
        for (std::size_t k = 0; k < 4; ++k) matrix[c * 4 + r] += static_cast<float>(p[k * 4 + r] * v[c * 4 + k]);
    gl_.UniformMatrix4fv(gl_.GetUniformLocation(program_, "to_clip"), 1, GL_FALSE, matrix.data());
    for (const Cube& cube : cubes) {
      gl_.Uniform3fv(gl_.GetUniformLocation(program_, "centre"), 1, cube.centre.data());
      gl_.Uniform1f(gl_.GetUniformLocation(program_, "radius"), cube.radius);
      gl_.Uniform3fv(gl_.GetUniformLocation(program_, "colour"), 1, cube.color.data());
      gl_.DrawArrays(GL_TRIANGLES, 0, 36);
    }
    EXPECT_EQ(gl_.GetError(), GLenum{GL_NO_ERROR});
  }
  /// Later draws do not clear the target.
  void keep() { keep_ = true; }

  [[nodiscard]] Bytes resolved() const {
    GLuint texture = 0;
    GLuint framebuffer = 0;
    gl_.CreateTextures(GL_TEXTURE_2D, 1, &texture);
    gl_.TextureStorage2D(texture, 1, GL_RGBA8, side, side);
    gl_.CreateFramebuffers(1, &framebuffer);
    gl_.NamedFramebufferTexture(framebuffer, GL_COLOR_ATTACHMENT0, texture, 0);
    gl_.BlitNamedFramebuffer(framebuffer_, framebuffer, 0, 0, side, side, 0, 0, side, side, GL_COLOR_BUFFER_BIT,
                             GL_NEAREST);
    Bytes bytes(std::size_t{side} * side * 4);
    gl_.GetTextureImage(texture, 0, GL_RGBA, GL_UNSIGNED_BYTE, static_cast<GLsizei>(bytes.size()), bytes.data());
    gl_.DeleteFramebuffers(1, &framebuffer);
    gl_.DeleteTextures(1, &texture);
    return bytes;
  }

 private:
  static Matrix view() { return {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, -eye_z, 1}; }
  [[nodiscard]] Matrix projection() const {
    if (convention_.reversed) return {focal, 0, 0, 0, 0, focal, 0, 0, 0, 0, 0, -1, 0, 0, near_plane, 0};
    return {focal, 0, 0, 0, 0, focal, 0, 0, 0, 0, -1, -1, 0, 0, -2 * near_plane, 0};
  }

  Convention convention_;
  cumulet::headless::Context context_;
  GladGLContext gl_;
  GLuint color_ = 0;
  GLuint depth_ = 0;
  GLuint framebuffer_ = 0;
  GLuint program_ = 0;
  GLuint vertex_array_ = 0;
  bool cleared_ = false;
  bool keep_ = false;
  cumulet::test::ViewerPtr viewer_;
};

void write(const std::string& name, const Bytes& bytes) {
  cumulet::image::Image image{.width = side, .height = side, .rgba = {}};
  for (int y = side; y-- > 0;)
    for (int i = 0; i < side * 4; ++i)
      image.rgba.push_back(
          cumulet::image::srgb_decode(static_cast<float>(bytes[static_cast<std::size_t>(y * side * 4 + i)]) / 255.0F));
  cumulet::image::write_png(name, image, {.tone_mapping = cumulet::image::ToneMapping::none});
}

/// Pixels well inside the cube's front face.
struct Square {
  int x0, y0, x1, y1;
};
Square front_face(const Cube& cube) {
  const double scale = focal / (eye_z - cube.centre[2] - cube.radius) * 0.5 * side;
  const auto at = [scale](double v) { return static_cast<int>(std::lround(0.5 * side + v * scale)); };
  return {at(cube.centre[0] - cube.radius) + 2, at(cube.centre[1] - cube.radius) + 2,
          at(cube.centre[0] + cube.radius) - 2, at(cube.centre[1] + cube.radius) - 2};
}
std::array<double, 3> mean(const Bytes& bytes, const Square& s) {
  std::array<double, 3> sum{};
  for (int y = s.y0; y < s.y1; ++y)
    for (int x = s.x0; x < s.x1; ++x)
      for (std::size_t c = 0; c < 3; ++c) sum[c] += bytes[static_cast<std::size_t>(y * side + x) * 4 + c];
  for (double& value : sum) value /= double(s.x1 - s.x0) * (s.y1 - s.y0);
  return sum;
}
void expect_untouched(const Bytes& before, const Bytes& after, const Square& s) {
  ASSERT_LT(s.x0, s.x1);
  int touched = 0;
  for (int y = s.y0; y < s.y1; ++y)
    for (int x = s.x0; x < s.x1; ++x)
      for (int c = 0; c < 4; ++c) {
        const auto i = static_cast<std::size_t>(y * side + x) * 4 + static_cast<std::size_t>(c);
        if (before[i] != after[i] && ++touched == 1)
          ADD_FAILURE() << "at " << x << ", " << y << ": " << int{before[i]} << " became " << int{after[i]};
      }
}

const std::vector<Cube> cubes{half_inside, behind, beside};

void check_scene(const Bytes& plain, const Bytes& bare_cloud, const Bytes& scene) {
  // In front of the cloud and beside it, the host's pixels are unchanged.
  expect_untouched(plain, scene, front_face(half_inside));
  expect_untouched(plain, scene, front_face(beside));
  // Behind the cloud, the cube is hidden. The cube is pure red, the cloud is white.
  const Square hidden = front_face(behind);
  const auto red = mean(plain, hidden);
  EXPECT_GT(red[0], 200.0);
  EXPECT_LT(red[1], 60.0);
  const auto shown = mean(scene, hidden);
  const auto cloud = mean(bare_cloud, hidden);
  for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(shown[c], cloud[c], 4.0);
  EXPECT_GT(shown[1], 100.0);
}

Bytes check_convention(const Convention& convention, const std::string& name) {
  HostScene host(convention);
  const Bytes plain = host.draw(cubes, false);
  const Bytes bare_cloud = host.draw({}, true);
  Bytes scene = host.draw(cubes, true);
  write("reversed_z_" + name + ".png", scene);
  check_scene(plain, bare_cloud, scene);
  return scene;
}

/// Blocks of 8 x 8 pixels agree, except where a cube's edge crosses them.
void expect_same_but_edges(const Bytes& a, const Bytes& b, const Bytes& plain) {
  constexpr int block = 8;
  int compared = 0;
  for (int y = 0; y < side; y += block) {
    for (int x = 0; x < side; x += block) {
      const Square s{x, y, x + block, y + block};
      bool edge = false;
      for (int v = std::max(y - 1, 0); v < std::min(y + block + 1, side); ++v)
        for (int u = std::max(x - 1, 0); u < std::min(x + block + 1, side); ++u)
          for (std::size_t c = 0; c < 3; ++c)
            edge = edge || plain[static_cast<std::size_t>(v * side + u) * 4 + c] !=
                               plain[static_cast<std::size_t>(y * side + x) * 4 + c];
      if (edge) continue;
      ++compared;
      const auto mean_a = mean(a, s);
      const auto mean_b = mean(b, s);
      for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(mean_a[c], mean_b[c], 5.0) << "block " << x << ", " << y;
    }
  }
  EXPECT_GT(compared, 60);
}

TEST(ReversedZ, MultisampledReversedHostMatchesAPlainOne) {
  const Bytes standard = check_convention({}, "standard");
  const Bytes reversed = check_convention({.reversed = true}, "reversed");
  const Bytes multisampled = check_convention(
      {.reversed = true, .multisamples = 4, .source = CUMULET_DEPTH_SOURCE_TEXTURE_MULTISAMPLE}, "multisampled");
  const Bytes plain = HostScene({}).draw(cubes, false);
  expect_same_but_edges(standard, reversed, plain);
  expect_same_but_edges(standard, multisampled, plain);
}

TEST(ReversedZ, DepthMayComeFromTheTargetFramebufferItself) {
  const Bytes standard = check_convention({.source = CUMULET_DEPTH_SOURCE_FRAMEBUFFER}, "standard_framebuffer");
  const Bytes multisampled = check_convention(
      {.reversed = true, .multisamples = 4, .source = CUMULET_DEPTH_SOURCE_FRAMEBUFFER}, "multisampled_framebuffer");
  const Bytes plain = HostScene({}).draw(cubes, false);
  expect_same_but_edges(standard, multisampled, plain);
}

// The reverse: the viewer writes depth, and later host geometry is hidden by the cloud.
TEST(ReversedZ, HostGeometryDrawnAfterwardsIsHiddenByWrittenDepth) {
  for (const Convention& convention :
       {Convention{}, Convention{.reversed = true},
        Convention{.reversed = true, .multisamples = 4, .source = CUMULET_DEPTH_SOURCE_TEXTURE_MULTISAMPLE}}) {
    HostScene host(convention);
    const Bytes plain = host.draw(cubes, false);
    const Bytes bare_cloud = host.draw({}, true, true);
    host.keep();
    host.draw_cubes(cubes);
    const Bytes scene = host.resolved();
    write(std::string("reversed_z_after_") + (convention.reversed ? "reversed" : "standard") +
              std::to_string(convention.multisamples) + ".png",
          scene);
    check_scene(plain, bare_cloud, scene);
  }
}

}  // namespace
