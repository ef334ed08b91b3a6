// The raster pass for surfaces: scenes built in code, compared with analytic depth and radiance.

#include "render/surface_raster.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <glm/gtc/matrix_transform.hpp>
#include <limits>
#include <memory>
#include <numbers>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "base/error.hpp"
#include "base/shared_code.hpp"
#include "gl/state_guard.hpp"
#include "image.hpp"
#include "render/progressive.hpp"
#include "support/gl_state.hpp"
#include "support/surfaces.hpp"
#include "surface/ggx_albedo.hpp"

namespace cumulet::core {
inline vec2 cm_ggx_albedo(float roughness, float cosine) {
  return surface::GgxAlbedo::table().towards(roughness, cosine);
}
inline vec2 cm_ggx_albedo_average(float roughness) { return surface::GgxAlbedo::table().average(roughness); }
#include "bsdf.glsl"
}  // namespace cumulet::core

namespace {

using cumulet::Error;
using cumulet::ErrorCode;
using cumulet::gl::StateGuard;
using RasterContentPtr = std::shared_ptr<const cumulet::render::RasterContent>;
using cumulet::render::surface_jitter;
using cumulet::render::SurfaceLayers;
using cumulet::render::SurfaceLighting;
using cumulet::render::SurfaceRaster;
using cumulet::render::SurfaceView;
namespace core = cumulet::core;
namespace render = cumulet::render;
namespace surface = cumulet::surface;

constexpr float infinite = std::numeric_limits<float>::infinity();
constexpr float pi = std::numbers::pi_v<float>;

/// A scene with a fixed pose.
class HandScene : public cumulet::test::TexturedScene {
 public:
  [[nodiscard]] surface::Pose pose(double /*time*/, std::size_t /*animation*/,
                                   const cumulet::Progress* /*progress*/ = nullptr) const override {
    surface::Pose result = posed;
    result.low = glm::dvec3(infinite);
    result.high = glm::dvec3(-infinite);
    for (const surface::PosedVertex& vertex : result.vertices) {
      result.low = glm::min(result.low, glm::dvec3(vertex.position));
      result.high = glm::max(result.high, glm::dvec3(vertex.position));
    }
    return result;
  }

  /// A parallelogram, counter-clockwise seen from the direction right x up. uv (0, 0) is the corner at `right` 0 and
  /// `up` 1, as in an image.
  void add_quad(glm::vec3 corner, glm::vec3 right, glm::vec3 up, std::uint32_t material, bool flipped = false) {
    const auto base = static_cast<std::uint32_t>(attributes.size());
    const glm::vec3 normal = glm::normalize(glm::cross(right, up));
    for (int i = 0; i < 4; ++i) {
      const auto x = static_cast<float>(i & 1);
      const auto y = static_cast<float>(i >> 1);
      posed.vertices.push_back({corner + right * x + up * y, normal, glm::vec4(0.0F)});
      surface::VertexAttributes attribute;
      attribute.uv[0] = {x, 1.0F - y};
      attribute.uv[1] = {2.0F * x, 2.0F - 2.0F * y};
      attributes.push_back(attribute);
    }
    const auto draw_first = static_cast<std::uint32_t>(indices.size());
    const std::array<std::uint32_t, 6> ccw{0, 1, 2, 2, 1, 3};
    const std::array<std::uint32_t, 6> cw{0, 2, 1, 2, 3, 1};
    for (const std::uint32_t i : flipped ? cw : ccw) indices.push_back(base + i);
    draws.push_back({draw_first, 6, material, 0});
    posed.flipped.push_back(flipped ? 1 : 0);
  }
  /// A quad at z that faces +z and is 2 half wide and high, centered on the z axis.
  void add_wall(float z, float half, std::uint32_t material) {
    add_quad({-half, -half, z}, {2.0F * half, 0.0F, 0.0F}, {0.0F, 2.0F * half, 0.0F}, material);
  }
  /// A material without an interface: Lambertian.
  surface::Material& add_matte(glm::vec3 color) {
    surface::Material& material = materials.emplace_back();
    material.base_color = glm::vec4(color, 1.0F);
    material.metallic = 0.0F;
    material.specular = 0.0F;
    return material;
  }

  surface::Pose posed;
};

SurfaceView straight(glm::dvec3 eye, double tangent, double aspect = 1.0, bool orthographic = false) {
  SurfaceView view;
  view.eye = eye;
  view.right = glm::dvec3(tangent * aspect, 0.0, 0.0);
  view.up = glm::dvec3(0.0, tangent, 0.0);
  view.orthographic = orthographic;
  return view;
}

struct Picture {
  glm::uvec2 size{0U};
  std::vector<glm::vec4> colors;
  std::vector<float> depths;
  std::vector<float> blended_depths;  // of the same pixels
  [[nodiscard]] std::size_t index(unsigned x, unsigned y, unsigned layer) const {
    return (std::size_t{layer} * size.y + y) * size.x + x;
  }
  [[nodiscard]] glm::vec4 color(unsigned x, unsigned y, unsigned layer = 0) const { return colors[index(x, y, layer)]; }
  [[nodiscard]] float z(unsigned x, unsigned y, unsigned layer = 0) const { return depths[index(x, y, layer)]; }
  [[nodiscard]] glm::vec4 centre() const { return color(size.x / 2, size.y / 2); }
  [[nodiscard]] float centre_z() const { return z(size.x / 2, size.y / 2); }
};

class SurfaceRasters : public cumulet::test::GlTest {
 protected:
  void SetUp() override {
    GlTest::SetUp();
    if (gl_) raster_ = std::make_unique<SurfaceRaster>(gl_);
  }
  void TearDown() override {
    raster_.reset();
    layers_ = {};
    GlTest::TearDown();
  }

  void set(const std::shared_ptr<HandScene>& scene) {
    const StateGuard guard(*gl_);
    raster_->show({{content_of(scene, scene->pose(0.0, 0))}});
  }
  /// Uploads the scene to GL.
  RasterContentPtr content_of(const std::shared_ptr<HandScene>& scene, surface::Pose pose) {
    return content_of(scene, std::move(pose), cumulet::gl::query_limits(*gl_));
  }
  RasterContentPtr content_of(const std::shared_ptr<HandScene>& scene, surface::Pose pose,
                              const cumulet::gl::Limits& limits) {
    auto source = cumulet::scene::make_raster_source(scene, pose);
    auto centres = std::make_shared<const std::vector<glm::vec3>>(cumulet::scene::blended_centres(*source, pose));
    render::Upload upload(gl_, "uploading");
    auto content = render::RasterContent::plan(
        gl_, programs_, limits, upload,
        {std::move(source), std::make_shared<const surface::Pose>(std::move(pose)), std::move(centres)}, nullptr);
    EXPECT_TRUE(upload.advance(render::Deadline::max()));
    return content;
  }
  Picture draw(const SurfaceView& view, const SurfaceLighting& lighting, glm::uvec2 size = {32U, 32U},
               unsigned layers = 1) {
    const StateGuard guard(*gl_);
    raster_->draw(view, lighting, size, layers, layers_);
    EXPECT_EQ(layers_.size, size);
    EXPECT_EQ(layers_.layers, layers);
    Picture picture;
    picture.size = size;
    const std::size_t count = std::size_t{size.x} * size.y * layers;
    const std::size_t all = layers_.blended ? 2 * count : count;
    picture.colors.resize(all);
    picture.depths.resize(all);
    gl_->GetTextureImage(layers_.color.name(), 0, GL_RGBA, GL_FLOAT, static_cast<GLsizei>(all * 16),
                         picture.colors.data());
    gl_->GetTextureImage(layers_.z.name(), 0, GL_RED, GL_FLOAT, static_cast<GLsizei>(all * 4), picture.depths.data());
    // Blended surfaces over the opaque ones.
    for (std::size_t i = 0; i < all - count; ++i) {
      const glm::vec4 over = picture.colors[count + i];
      picture.colors[i] = over + (1.0F - over.a) * picture.colors[i];
    }
    picture.blended_depths.assign(picture.depths.begin() + static_cast<std::ptrdiff_t>(count), picture.depths.end());
    picture.colors.resize(count);
    picture.depths.resize(count);
    return picture;
  }
  /// Draws one wall at z = -2, seen from the origin.
  Picture draw_wall(const std::shared_ptr<HandScene>& scene, const SurfaceLighting& lighting) {
    scene->add_wall(-2.0F, 3.0F, 0);
    set(scene);
    return draw(straight(glm::dvec3(0.0), 0.5), lighting);
  }

  std::unique_ptr<SurfaceRaster> raster_;
  SurfaceLayers layers_;
};
CUMULET_ON_BACKENDS(SurfaceRasters);

void expect_color(glm::vec4 got, glm::vec4 expected, float relative = 2e-3F) {
  for (int c = 0; c < 4; ++c) EXPECT_NEAR(got[c], expected[c], relative * std::abs(expected[c]) + 1e-4F) << c;
}

TEST(SurfaceJitter, EveryRowAndColumnHasOneLayer) {
  for (unsigned layers = 1; layers <= 8; ++layers) {
    std::set<int> columns;
    std::set<int> rows;
    for (unsigned layer = 0; layer < layers; ++layer) {
      const glm::vec2 position = surface_jitter(layer, layers);
      const glm::vec2 cell = position * static_cast<float>(layers) - 0.5F;
      columns.insert(static_cast<int>(std::lround(cell.x)));
      rows.insert(static_cast<int>(std::lround(cell.y)));
      EXPECT_NEAR(cell.x, std::round(cell.x), 1e-5F);
      EXPECT_NEAR(cell.y, std::round(cell.y), 1e-5F);
      EXPECT_TRUE(position.x > 0.0F && position.x < 1.0F && position.y > 0.0F && position.y < 1.0F);
    }
    EXPECT_EQ(columns.size(), layers);
    EXPECT_EQ(rows.size(), layers);
  }
  EXPECT_EQ(surface_jitter(0, 1), glm::vec2(0.5F));
}

TEST_P(SurfaceRasters, EmptyPixelsAreTransparentWithInfiniteDepth) {
  Picture picture = draw(straight({0, 0, 0}, 1.0), {}, {5U, 3U}, 3);
  for (const float z : picture.depths) EXPECT_EQ(z, infinite);
  for (const glm::vec4& color : picture.colors) EXPECT_EQ(color, glm::vec4(0.0F));
  const auto scene = std::make_shared<HandScene>();
  scene->add_matte(glm::vec3(1.0F));
  set(scene);  // without a triangle
  picture = draw(straight({0, 0, 0}, 1.0), {}, {4U, 4U});
  EXPECT_EQ(picture.centre_z(), infinite);
  scene->add_wall(-2.0F, 1.0F, 0);
  set(scene);
  EXPECT_NEAR(draw(straight({0, 0, 0}, 1.0), {}).centre_z(), 2.0F, 1e-6F);
  {
    const StateGuard guard(*gl_);
    raster_->show({});
  }
  EXPECT_EQ(draw(straight({0, 0, 0}, 1.0), {}).centre_z(), infinite);
}

TEST_P(SurfaceRasters, DepthIsTheAnalyticOne) {
  // Hardware rounds vertices to 1/256 of a pixel. llvmpipe interpolates from the exact vertices.
  const std::string driver = reinterpret_cast<const char*>(gl_->GetString(GL_RENDERER));
  const double slack = driver.find("llvmpipe") != std::string::npos ? 4e-6 : 1e-3;
  // A wall z = -6 + 0.5 x - 0.25 y that leaves the right of the image empty, and a box's face at z = -3 in front of it.
  const auto scene = std::make_shared<HandScene>();
  scene->add_matte(glm::vec3(1.0F)).double_sided = true;
  const auto plane = [](float x, float y) { return glm::vec3(x, y, -6.0F + 0.5F * x - 0.25F * y); };
  scene->add_quad(plane(-30, -30), plane(1, -30) - plane(-30, -30), plane(-30, 30) - plane(-30, -30), 0);
  scene->add_quad({-0.7F, -0.6F, -3.0F}, {0.9F, 0.0F, 0.0F}, {0.0F, 1.1F, 0.0F}, 0);
  set(scene);
  const glm::uvec2 size(48U, 32U);
  SurfaceView off_axis = straight({0.25, 0.5, 1.0}, 0.7, 1.5);
  off_axis.forward += off_axis.right * 0.3 - off_axis.up * 0.2;
  for (const SurfaceView& view :
       {straight({0, 0, 0}, 0.7, 1.5), off_axis, straight({0.5, 0.25, 2.0}, 2.0, 1.5, true)}) {
    const Picture picture = draw(view, {}, size, 2);
    int counted = 0;
    for (unsigned layer = 0; layer < 2; ++layer) {
      for (unsigned y = 0; y < size.y; ++y) {
        for (unsigned x = 0; x < size.x; ++x) {
          const glm::dvec2 position = glm::dvec2(x, y) + glm::dvec2(surface_jitter(layer, 2));
          const double px = 2.0 * position.x / size.x - 1.0;
          const double py = 1.0 - 2.0 * position.y / size.y;
          const glm::dvec3 shift = view.right * px + view.up * py;
          const glm::dvec3 o = view.orthographic ? view.eye + shift : view.eye;
          const glm::dvec3 d = view.orthographic ? view.forward : view.forward + shift;
          // o + t d on z - 0.5 x + 0.25 y + 6 = 0.
          const glm::dvec3 normal(-0.5, 0.25, 1.0);
          const double wall = -(glm::dot(normal, o) + 6.0) / glm::dot(normal, d);
          const double face = (-3.0 - o.z) / d.z;
          const glm::dvec3 on_wall = o + d * wall;
          const glm::dvec3 on_face = o + d * face;
          const double inside = std::min({on_face.x + 0.7, 0.2 - on_face.x, on_face.y + 0.6, 0.5 - on_face.y});
          if (std::abs(inside) < 1e-5 || std::abs(on_wall.x - 1.0) < 1e-5) continue;
          const bool hit = wall > 0.0 && on_wall.x < 1.0;
          const double expected = inside > 0.0 ? face : hit ? wall : double(infinite);
          const float z = picture.z(x, y, layer);
          ++counted;
          if (std::isinf(expected)) {
            ASSERT_EQ(z, infinite) << x << ',' << y;
          } else {
            ASSERT_NEAR(z, expected, slack * expected) << x << ',' << y << " layer " << layer;
            ASSERT_EQ(picture.color(x, y, layer).a, 1.0F);
          }
        }
      }
    }
    EXPECT_GT(counted, 3000);
  }
}

TEST_P(SurfaceRasters, FarFromTheOriginNothingJitters) {
  // A wall with integer coordinates, which floats represent exactly, and an eye at fractions of them.
  for (const double offset : {0.0, 1048576.0, -4194304.0}) {
    const auto scene = std::make_shared<HandScene>();
    scene->add_matte(glm::vec3(1.0F));
    const glm::vec3 corner(offset - 4.0, 8.0 - offset, offset - 8.0);
    scene->add_quad(corner, {8, 0, 0}, {0, 8, 0}, 0);
    set(scene);
    const SurfaceView view = straight(glm::dvec3(corner) + glm::dvec3(4.3, 4.1, 3.123456), 0.5);
    const Picture picture = draw(view, {}, {16U, 16U}, 4);
    for (const float z : picture.depths) ASSERT_NEAR(z, 3.123456F, 1e-6F) << offset;
  }
}

TEST_P(SurfaceRasters, NearAndFarSurfacesAreNotClipped) {
  // One surface is close, inside huge bounds, and one is far from all others.
  const auto scene = std::make_shared<HandScene>();
  scene->add_matte(glm::vec3(1.0F)).double_sided = true;
  scene->add_wall(-0.5F, 0.1F, 0);
  scene->add_wall(-20000.0F, 20000.0F, 0);
  scene->add_wall(10.0F, 1.0F, 0);
  set(scene);
  const Picture inside = draw(straight({0, 0, 0}, 0.5), {});
  EXPECT_NEAR(inside.centre_z(), 0.5F, 1e-6F);
  EXPECT_NEAR(inside.z(0, 0), 20000.0F, 0.1F);
  const Picture outside = draw(straight({0, 0, 1e7}, 0.001), {});
  EXPECT_NEAR(outside.z(0, 0), 1.002e7F, 4.0F);
}

TEST_P(SurfaceRasters, SunOnMatte) {
  const auto scene = std::make_shared<HandScene>();
  scene->add_matte({0.8F, 0.4F, 0.2F});
  SurfaceLighting lighting;
  lighting.sun_direction = glm::normalize(glm::vec3(1.0F, 2.0F, 2.0F));
  lighting.sun_irradiance = {3.0F, 2.0F, 1.0F};
  const Picture picture = draw_wall(scene, lighting);
  expect_color(picture.centre(), glm::vec4(glm::vec3(2.4F, 0.8F, 0.2F) * (2.0F / 3.0F / pi), 1.0F));
  expect_color(picture.color(1, 30), glm::vec4(glm::vec3(2.4F, 0.8F, 0.2F) * (2.0F / 3.0F / pi), 1.0F));
  lighting.sun_direction.z = -lighting.sun_direction.z;
  expect_color(draw(straight({0, 0, 0}, 0.5), lighting).centre(), glm::vec4(0, 0, 0, 1));
}

TEST_P(SurfaceRasters, WhiteFurnaceIsInvisible) {
  const auto scene = std::make_shared<HandScene>();
  scene->add_matte(glm::vec3(1.0F));
  scene->materials.emplace_back();  // white metal
  scene->materials.back().roughness = 0.0F;
  scene->materials.emplace_back();  // white, with an interface
  scene->materials.back().metallic = 0.0F;
  scene->materials.back().roughness = 0.0F;
  scene->add_quad({-3, -3, -2}, {2, 0, 0}, {0, 6, 0}, 0);
  scene->add_quad({-1, -3, -2}, {2, 0, 0}, {0, 6, 0}, 1);
  scene->add_quad({1, -3, -2}, {2, 0, 0}, {0, 6, 0}, 2);
  set(scene);
  SurfaceLighting lighting;
  lighting.sky_radiance = {0.5F, 1.0F, 4.0F};
  const Picture picture = draw(straight({0, 0, 0}, 1.2), lighting);
  expect_color(picture.color(2, 16), glm::vec4(0.5F, 1.0F, 4.0F, 1.0F), 1e-3F);
  for (const unsigned x : {12U, 16U, 28U}) {
    expect_color(picture.color(x, 16), glm::vec4(0.5F, 1.0F, 4.0F, 1.0F), 0.01F);
  }
}

TEST_P(SurfaceRasters, EmissionVertexColorsAndUnlit) {
  const auto scene = std::make_shared<HandScene>();
  scene->add_matte({0.5F, 0.5F, 0.5F}).emission = {0.0F, 7.0F, 1.0F};
  scene->add_matte({0.5F, 2.0F, 0.5F}).unlit = true;
  scene->add_quad({-3, -3, -2}, {3, 0, 0}, {0, 6, 0}, 0);
  scene->add_quad({0, -3, -2}, {3, 0, 0}, {0, 6, 0}, 1);
  for (surface::VertexAttributes& vertex : scene->attributes) vertex.color = {1.0F, 0.25F, 0.5F, 0.1F};
  set(scene);
  SurfaceLighting lighting;
  lighting.sky_radiance = glm::vec3(2.0F);
  const Picture picture = draw(straight({0, 0, 0}, 0.5), lighting);
  expect_color(picture.color(4, 16), glm::vec4(1.0F, 7.25F, 1.5F, 1.0F));
  expect_color(picture.color(28, 16), glm::vec4(0.5F, 0.5F, 0.25F, 1.0F));
}

TEST_P(SurfaceRasters, PunctualLights) {
  using Kind = surface::PunctualLight::Kind;
  struct Case {
    const char* name;
    surface::PunctualLight light;
    float irradiance;
  };
  surface::PunctualLight point;
  point.intensity = glm::vec3(10.0F);
  point.position = {0.0F, 0.0F, 1.0F};
  surface::PunctualLight ranged = point;
  ranged.range = 4.0F;
  surface::PunctualLight short_range = point;
  short_range.range = 2.9F;
  surface::PunctualLight spot = point;
  spot.kind = Kind::spot;
  spot.inner_cone = 0.2F;
  spot.outer_cone = 0.6F;
  surface::PunctualLight aside = spot;
  aside.direction = glm::vec3(std::sin(0.4F), 0.0F, -std::cos(0.4F));
  surface::PunctualLight away = spot;
  away.direction = glm::vec3(std::sin(0.7F), 0.0F, -std::cos(0.7F));
  surface::PunctualLight sun = point;
  sun.kind = Kind::directional;
  sun.direction = {0.0F, 0.8F, -0.6F};
  const float share = (std::cos(0.4F) - std::cos(0.6F)) / (std::cos(0.2F) - std::cos(0.6F));
  const std::array<Case, 7> cases{{{"point", point, 10.0F / 9.0F},
                                   {"in range", ranged, 10.0F / 9.0F * (1.0F - 81.0F / 256.0F)},
                                   {"out of range", short_range, 0.0F},
                                   {"spot", spot, 10.0F / 9.0F},
                                   {"spot's penumbra", aside, 10.0F / 9.0F * share * share},
                                   {"out of the spot", away, 0.0F},
                                   {"directional", sun, 6.0F}}};
  for (const Case& c : cases) {
    SCOPED_TRACE(c.name);
    const auto scene = std::make_shared<HandScene>();
    scene->add_matte({1.0F, 0.5F, 0.0F});
    scene->posed.lights = {c.light};
    scene->add_wall(-2.0F, 3.0F, 0);
    set(scene);
    const Picture picture = draw(straight({0, 0, 0}, 0.01), {});
    expect_color(picture.centre(), glm::vec4(glm::vec3(1.0F, 0.5F, 0.0F) * (c.irradiance / pi), 1.0F));
  }
  // All of them together, three times.
  const auto scene = std::make_shared<HandScene>();
  scene->add_matte(glm::vec3(1.0F));
  float sum = 0.0F;
  for (int i = 0; i < 3; ++i) {
    for (const Case& c : cases) {
      scene->posed.lights.push_back(c.light);
      sum += c.irradiance;
    }
  }
  scene->add_wall(-2.0F, 3.0F, 0);
  set(scene);
  expect_color(draw(straight({0, 0, 0}, 0.01), {}).centre(), glm::vec4(glm::vec3(sum / pi), 1.0F));
}

TEST_P(SurfaceRasters, AlphaMasksCutOut) {
  surface::Sampler nearest;
  nearest.magnify = surface::Filter::nearest;
  nearest.minify = surface::Filter::nearest;
  nearest.mipmaps = false;
  const auto scene = std::make_shared<HandScene>();
  surface::Material& material = scene->add_matte(glm::vec3(1.0F));
  material.alpha_mode = surface::AlphaMode::mask;
  material.alpha_cutoff = 0.5F;
  material.base_color_texture.texture = scene->add_texture(2, 1, {255, 255, 255, 120, 255, 255, 255, 130}, nearest);
  SurfaceLighting lighting;
  lighting.sky_radiance = glm::vec3(1.0F);
  const Picture picture = draw_wall(scene, lighting);
  EXPECT_EQ(picture.color(8, 16), glm::vec4(0.0F));
  EXPECT_EQ(picture.z(8, 16), infinite);
  expect_color(picture.color(24, 16), glm::vec4(1.0F));
  EXPECT_NEAR(picture.z(24, 16), 2.0F, 1e-6F);
}

TEST_P(SurfaceRasters, BlendedTrianglesAreSortedAndKeepTheNearestDepth) {
  const auto scene = std::make_shared<HandScene>();
  const auto emissive = [&](glm::vec3 color, float alpha) {
    surface::Material& material = scene->add_matte(glm::vec3(0.0F));
    material.base_color.a = alpha;
    material.emission = color;
    material.alpha_mode = alpha < 1.0F ? surface::AlphaMode::blend : surface::AlphaMode::opaque;
  };
  emissive({8, 0, 0}, 0.5F);
  emissive({0, 8, 0}, 0.25F);
  emissive({0, 0, 8}, 1.0F);
  scene->add_wall(-2.0F, 5.0F, 0);  // the nearer one is first in the file
  scene->add_wall(-3.0F, 5.0F, 1);
  scene->add_wall(-4.0F, 5.0F, 2);
  scene->add_wall(-5.0F, 5.0F, 0);  // hidden
  set(scene);
  const Picture front = draw(straight({0, 0, 0}, 0.5), {}, {16U, 16U}, 2);
  EXPECT_NEAR(front.z(3, 3, 1), 4.0F, 1e-5F);
  EXPECT_NEAR(front.blended_depths.at(front.index(3, 3, 1)), 2.0F, 1e-5F);
  expect_color(front.color(3, 3, 1), {4.0F, 0.5F * 2.0F, 0.5F * 0.75F * 8.0F, 1.0F});
  // From behind, single-sided surfaces are invisible. From the front without the wall, alphas combine, and there is no
  // depth.
  EXPECT_EQ(draw(straight({0, 0, -20}, 0.1), {}).centre(), glm::vec4(0.0F));
  const auto thin = std::make_shared<HandScene>();
  thin->materials = scene->materials;
  for (surface::Material& material : thin->materials) material.double_sided = true;
  thin->add_wall(-2.0F, 5.0F, 0);
  thin->add_wall(-3.0F, 5.0F, 1);
  set(thin);
  const Picture alone = draw(straight({0, 0, 0}, 0.5), {});
  EXPECT_EQ(alone.centre_z(), infinite);
  expect_color(alone.centre(), {4.0F, 1.0F, 0.0F, 0.625F});
  SurfaceView back = straight({0, 0, -6}, 0.5);
  back.forward = {0, 0, 1};
  back.right = -back.right;
  expect_color(draw(back, {}).centre(), {4.0F * 0.75F, 2.0F, 0.0F, 0.625F});
}

TEST_P(SurfaceRasters, TransmissionLetsTheBackgroundThrough) {
  const auto scene = std::make_shared<HandScene>();
  scene->add_matte(glm::vec3(1.0F)).transmission = 0.75F;
  SurfaceLighting lighting;
  lighting.sky_radiance = glm::vec3(1.0F);
  const Picture picture = draw_wall(scene, lighting);
  expect_color(picture.centre(), glm::vec4(0.25F));
  EXPECT_EQ(picture.centre_z(), infinite);
}

TEST_P(SurfaceRasters, SidesAndMirroring) {
  SurfaceLighting lighting;
  lighting.sun_direction = {0.0F, 0.0F, -1.0F};  // on the back
  lighting.sun_irradiance = glm::vec3(pi);
  SurfaceView back = straight({0, 0, -6}, 0.2);
  back.forward = {0, 0, 1};
  back.right = -back.right;
  SurfaceView mirrored_back = back;
  mirrored_back.right = -back.right;
  const SurfaceView front = straight({0, 0, 0}, 0.2);
  SurfaceView mirrored_front = front;
  mirrored_front.up = -front.up;
  for (const bool flipped : {false, true}) {
    for (const bool double_sided : {false, true}) {
      SCOPED_TRACE(testing::Message() << flipped << double_sided);
      const auto scene = std::make_shared<HandScene>();
      scene->add_matte(glm::vec3(0.5F)).double_sided = double_sided;
      scene->add_quad({-3, -3, -2}, {6, 0, 0}, {0, 6, 0}, 0, flipped);
      set(scene);
      for (const SurfaceView& view : {front, mirrored_front}) {
        const Picture picture = draw(view, lighting);
        EXPECT_NEAR(picture.centre_z(), 2.0F, 1e-6F);
        expect_color(picture.centre(), glm::vec4(0, 0, 0, 1));
      }
      for (const SurfaceView& view : {back, mirrored_back}) {
        const Picture picture = draw(view, lighting);
        if (double_sided) {
          EXPECT_NEAR(picture.centre_z(), 4.0F, 1e-6F);
          expect_color(picture.centre(), glm::vec4(0.5F, 0.5F, 0.5F, 1.0F));
        } else {
          EXPECT_EQ(picture.centre_z(), infinite);
        }
      }
    }
  }
}

TEST_P(SurfaceRasters, LayersUseTheirSubpixelPositions) {
  // An edge in each direction at every eighth of a pixel: a layer is covered if its sample position is.
  for (unsigned layers = 1; layers <= 8; ++layers) {
    for (int eighth = 0; eighth < 8; ++eighth) {
      const float edge = 5.0F + (static_cast<float>(eighth) + 0.07F) / 8.0F;  // pixels, from the left and the top
      const auto scene = std::make_shared<HandScene>();
      scene->add_matte(glm::vec3(1.0F));
      // 16 pixels are 16 units wide.
      scene->add_quad({-20.0F, 8.0F - edge, -2.0F}, {12.0F + edge, 0, 0}, {0, 30, 0}, 0);
      set(scene);
      const Picture picture = draw(straight({0, 0, 0}, 8.0, 1.0, true), {}, {16U, 16U}, layers);
      unsigned columns = 0;
      unsigned rows = 0;
      for (unsigned layer = 0; layer < layers; ++layer) {
        const glm::vec2 position = surface_jitter(layer, layers);
        EXPECT_EQ(std::isfinite(picture.z(5, 1, layer)), position.x < edge - 5.0F) << layers << ' ' << layer;
        EXPECT_EQ(std::isfinite(picture.z(1, 5, layer)), position.y < edge - 5.0F) << layers << ' ' << layer;
        EXPECT_TRUE(std::isfinite(picture.z(4, 4, layer)));
        EXPECT_FALSE(std::isfinite(picture.z(6, 1, layer)));
        EXPECT_FALSE(std::isfinite(picture.z(1, 6, layer)));
        columns += std::isfinite(picture.z(5, 1, layer)) ? 1 : 0;
        rows += std::isfinite(picture.z(1, 5, layer)) ? 1 : 0;
      }
      const float share = (edge - 5.0F) * static_cast<float>(layers);
      EXPECT_LE(std::abs(static_cast<float>(columns) - share), 0.51F);
      EXPECT_EQ(columns, rows);
    }
  }
}

TEST_P(SurfaceRasters, TexturesWrapAndTransform) {
  // 2 x 2 distinct colors; the wall shows uv from -1 to 2.
  const std::vector<std::uint8_t> texels{255, 0, 0, 255, 0, 255, 0, 255, 0, 0, 255, 255, 128, 128, 128, 255};
  const float grey = std::pow((128.0F / 255.0F + 0.055F) / 1.055F, 2.4F);
  const std::array<glm::vec3, 4> colors{glm::vec3(1, 0, 0), glm::vec3(0, 1, 0), glm::vec3(0, 0, 1), glm::vec3(grey)};
  using surface::Wrap;
  const auto wrapped = [](double t, Wrap wrap) {
    if (wrap == Wrap::clamp) return std::clamp(t, 0.0, 0.999);
    const double whole = std::floor(t);
    const double part = t - whole;
    return wrap == Wrap::mirrored && (static_cast<int>(whole) & 1) != 0 ? 1.0 - part : part;
  };
  for (const Wrap s : {Wrap::repeat, Wrap::mirrored, Wrap::clamp}) {
    for (const Wrap t : {Wrap::repeat, Wrap::mirrored, Wrap::clamp}) {
      for (const std::uint32_t set_of : {0U, 1U}) {
        SCOPED_TRACE(testing::Message() << int(s) << int(t) << set_of);
        surface::Sampler sampler{s, t, surface::Filter::nearest, surface::Filter::nearest, false};
        const auto scene = std::make_shared<HandScene>();
        surface::Material& material = scene->add_matte(glm::vec3(1.0F));
        material.base_color_texture.texture = scene->add_texture(2, 2, texels, sampler);
        material.base_color_texture.uv_set = set_of;
        // uv' = (-1 + 3 u + v / 8, -1 + 3 v) for both uv sets.
        const float scale = set_of == 0 ? 1.0F : 0.5F;
        material.base_color_texture.transform =
            glm::mat3x2(3.0F * scale, 0.0F, 0.125F * scale, 3.0F * scale, -1.0F, -1.0F);
        scene->add_wall(-2.0F, 1.0F, 0);
        set(scene);
        SurfaceLighting lighting;
        lighting.sky_radiance = glm::vec3(1.0F);
        const Picture picture = draw(straight({0, 0, 0}, 0.5), lighting, {24U, 24U});
        for (unsigned y = 0; y < 24; ++y) {
          for (unsigned x = 0; x < 24; ++x) {
            const double u = (x + 0.5) / 24.0;
            const double v = (y + 0.5) / 24.0;
            const double at_s = 2.0 * wrapped(-1.0 + 3.0 * u + 0.125 * v, s);
            const double at_t = 2.0 * wrapped(-1.0 + 3.0 * v, t);
            if (std::abs(at_s - std::round(at_s)) < 0.01 || std::abs(at_t - std::round(at_t)) < 0.01) continue;
            const auto texel = static_cast<std::size_t>(at_t) * 2 + static_cast<std::size_t>(at_s);
            expect_color(picture.color(x, y), glm::vec4(colors[texel], 1.0F), 5e-3F);
          }
        }
        ASSERT_FALSE(HasFailure());
      }
    }
  }
}

TEST_P(SurfaceRasters, MipmapsAverageDistantTextures) {
  // A checkerboard of black and white, much finer than a pixel; the mean is in linear light.
  std::vector<std::uint8_t> texels;
  for (int i = 0; i < 64 * 64; ++i) {
    const std::uint8_t value = ((i ^ (i >> 6)) & 1) != 0 ? 255 : 0;
    texels.insert(texels.end(), {value, value, value, 255});
  }
  const auto scene = std::make_shared<HandScene>();
  scene->add_matte(glm::vec3(1.0F)).base_color_texture.texture = scene->add_texture(64, 64, texels);
  scene->add_wall(-2.0F, 1.0F, 0);
  set(scene);
  SurfaceLighting lighting;
  lighting.sky_radiance = glm::vec3(1.0F);
  const Picture picture = draw(straight({0, 0, 0}, 0.5), lighting, {8U, 8U});
  for (const glm::vec4& color : picture.colors) expect_color(color, glm::vec4(0.5F, 0.5F, 0.5F, 1.0F), 0.02F);
}

TEST_P(SurfaceRasters, MapsOfEveryKindAreReadFromTheirChannels) {
  const std::vector<std::uint8_t> texel{51, 102, 204, 153};  // 0.2, 0.4, 0.8, 0.6
  const auto sample = [](float value) {
    return value <= 0.04045F ? value / 12.92F : std::pow((value + 0.055F) / 1.055F, 2.4F);
  };
  const auto scene = std::make_shared<HandScene>();
  surface::Material material;
  material.metallic = 0.5F;
  material.roughness = 0.9F;
  material.ior = 1.8F;
  material.specular = 0.9F;
  material.clearcoat = 0.8F;
  material.clearcoat_roughness = 0.7F;
  material.occlusion_strength = 0.5F;
  material.emission = glm::vec3(2.0F);
  const std::int32_t texture = scene->add_texture(1, 1, texel);
  for (surface::TextureUse* use :
       {&material.base_color_texture, &material.metallic_roughness_texture, &material.occlusion_texture,
        &material.emission_texture, &material.specular_texture, &material.specular_color_texture,
        &material.clearcoat_texture, &material.clearcoat_roughness_texture}) {
    use->texture = texture;
  }
  scene->materials.push_back(material);
  const glm::vec3 color(sample(0.2F), sample(0.4F), sample(0.8F));
  core::CmSurface s{};
  s.base_color = color;
  s.metallic = 0.5F * 0.8F;
  s.roughness = 0.9F * 0.4F;
  s.normal = {0.0F, 0.0F, 1.0F};
  s.matte_normal = s.smooth_normal = s.normal;
  s.f0 = core::cm_dielectric_f0(1.8F, 0.9F * 0.6F, color);
  s.specular = 0.9F * 0.6F;
  s.clearcoat = 0.8F * 0.2F;
  s.clearcoat_roughness = 0.7F * 0.4F;
  SurfaceLighting lighting;
  lighting.sun_direction = glm::normalize(glm::vec3(0.3F, 0.2F, 1.0F));
  lighting.sun_irradiance = glm::vec3(5.0F);
  scene->add_wall(-2.0F, 3.0F, 0);
  set(scene);
  const SurfaceView view = straight({0, 0, 0}, 0.001);
  const glm::vec3 wo(0.0F, 0.0F, 1.0F);
  const glm::vec3 lit = core::cm_bsdf_eval(s, wo, lighting.sun_direction) * 5.0F + color * 2.0F;
  const glm::vec4 dark = draw(view, lighting).centre();
  expect_color(dark, glm::vec4(lit, 1.0F), 0.01F);
  lighting.sky_radiance = glm::vec3(10.0F);
  const glm::vec4 with_sky = draw(view, lighting).centre();
  scene->materials[0].occlusion_strength = 0.0F;
  set(scene);
  const glm::vec4 unoccluded = draw(view, lighting).centre();
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR((with_sky - dark)[c] / (unoccluded - dark)[c], 1.0F - 0.5F * 0.8F, 6e-3F);
  }
}

TEST_P(SurfaceRasters, NormalMapsWithAndWithoutTangents) {
  // The map leans by 0.48 to its right and 0.36 up. That is little enough that the mirrored view direction is above the
  // wall.
  const glm::vec3 m(0.48F, 0.36F, 0.8F);
  const auto byte = [](float value) { return static_cast<std::uint8_t>(std::lround((value + 1.0F) * 127.5F)); };
  const std::vector<std::uint8_t> texel{byte(m.x), byte(m.y), byte(m.z), 255};
  for (const bool mirrored_u : {false, true}) {
    for (const bool tangents : {false, true}) {
      for (const bool from_behind : {false, true}) {
        SCOPED_TRACE(testing::Message() << mirrored_u << tangents << from_behind);
        const auto scene = std::make_shared<HandScene>();
        surface::Material& material = scene->add_matte(glm::vec3(1.0F));
        material.double_sided = true;
        material.normal_texture.texture = scene->add_texture(1, 1, texel);
        scene->add_wall(-2.0F, 3.0F, 0);
        for (surface::VertexAttributes& vertex : scene->attributes) {
          if (mirrored_u) vertex.uv[0].x = -vertex.uv[0].x;
        }
        if (tangents) {
          for (surface::PosedVertex& vertex : scene->posed.vertices) {
            vertex.tangent = mirrored_u ? glm::vec4(-1, 0, 0, -1) : glm::vec4(1, 0, 0, 1);
          }
        }
        set(scene);
        glm::vec3 normal(mirrored_u ? -m.x : m.x, m.y, m.z);
        if (from_behind) normal = -normal;
        SurfaceView view = straight({0, 0, 0}, 0.05);
        if (from_behind) {
          view.eye.z = -4.0;
          view.forward.z = 1.0;
          view.right = -view.right;
        }
        const glm::vec3 smooth(0.0F, 0.0F, from_behind ? -1.0F : 1.0F);
        for (const glm::vec3 sun :
             {glm::vec3(0.8F, 0, 0.6F), glm::vec3(-0.8F, 0, 0.6F), glm::vec3(0, 0.96F, 0.28F),
              glm::vec3(0, -0.6F, 0.8F), glm::vec3(0.8F, 0, -0.6F), glm::vec3(-0.8F, 0, -0.6F),
              glm::vec3(0, 0.96F, -0.28F), glm::vec3(0, 0, 1), glm::vec3(0, 0, -1), glm::vec3(1, 0, 0)}) {
          SurfaceLighting lighting;
          lighting.sun_direction = sun;
          lighting.sun_irradiance = glm::vec3(pi);
          // With the soft terminator for mapped normals.
          const float cosine = std::max(0.0F, glm::dot(normal, sun));
          const float above = glm::dot(smooth, sun) / (std::max(cosine, 1e-6F) * glm::dot(normal, smooth));
          const float t = glm::clamp(above, 0.0F, 1.0F);
          const float expected = cosine * (t + t * t - t * t * t);
          EXPECT_NEAR(draw(view, lighting, {8U, 8U}).centre().x, expected, 0.01F) << sun.x << sun.y << sun.z;
        }
      }
    }
  }
}

/// Spheres with smooth normals: roughness increases along a row, metallic differs per row.
std::shared_ptr<HandScene> sphere_grid(int columns, int rows) {
  auto scene = std::make_shared<HandScene>();
  constexpr int stacks = 48;
  constexpr int slices = 96;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      surface::Material material;
      material.base_color = {0.9F, 0.45F, 0.15F, 1.0F};
      material.metallic = rows > 1 ? static_cast<float>(row) / static_cast<float>(rows - 1) : 0.0F;
      material.roughness = 0.1F + 0.9F * static_cast<float>(column) / static_cast<float>(columns - 1);
      scene->materials.push_back(material);
      const glm::vec3 centre(2.2F * (static_cast<float>(column) - 0.5F * static_cast<float>(columns - 1)),
                             2.2F * (static_cast<float>(row) - 0.5F * static_cast<float>(rows - 1)), 0.0F);
      const auto base = static_cast<std::uint32_t>(scene->attributes.size());
      const auto first = static_cast<std::uint32_t>(scene->indices.size());
      for (int i = 0; i <= stacks; ++i) {
        for (int j = 0; j <= slices; ++j) {
          const float theta = pi * static_cast<float>(i) / stacks;
          const float phi = 2.0F * pi * static_cast<float>(j) / slices;
          const glm::vec3 n(std::sin(theta) * std::sin(phi), std::cos(theta), std::sin(theta) * std::cos(phi));
          scene->posed.vertices.push_back({centre + n, n, glm::vec4(0.0F)});
          scene->attributes.emplace_back();
        }
      }
      for (std::uint32_t i = 0; i < stacks; ++i) {
        for (std::uint32_t j = 0; j < slices; ++j) {
          const std::uint32_t a = base + i * (slices + 1) + j;
          const std::uint32_t b = a + slices + 1;
          scene->indices.insert(scene->indices.end(), {a, b, b + 1, a, b + 1, a + 1});
        }
      }
      scene->draws.push_back({first, static_cast<std::uint32_t>(scene->indices.size()) - first,
                              static_cast<std::uint32_t>(scene->materials.size() - 1), 0});
      scene->posed.flipped.push_back(0);
    }
  }
  return scene;
}

TEST_P(SurfaceRasters, SphereShadingMatchesTheBsdf) {
  constexpr int columns = 7;
  constexpr int rows = 3;
  const auto scene = sphere_grid(columns, rows);
  set(scene);
  SurfaceLighting lighting;
  lighting.sun_direction = glm::normalize(glm::vec3(0.5F, 0.7F, 0.6F));
  lighting.sun_irradiance = glm::vec3(3.0F);
  const glm::uvec2 size(700U, 300U);
  const SurfaceView view = straight({0, 0, 20}, 3.45, 7.0 / 3.0, true);
  const Picture picture = draw(view, lighting, size);
  int compared = 0;
  for (unsigned y = 2; y < size.y; y += 5) {
    for (unsigned x = 2; x < size.x; x += 5) {
      const glm::vec2 at((2.0F * (static_cast<float>(x) + 0.5F) / 700.0F - 1.0F) * 3.45F * 7.0F / 3.0F,
                         (1.0F - 2.0F * (static_cast<float>(y) + 0.5F) / 300.0F) * 3.45F);
      for (std::size_t i = 0; i < scene->materials.size(); ++i) {
        const auto column = static_cast<float>(i % columns);
        const std::size_t line = i / columns;
        const auto row = static_cast<float>(line);
        const glm::vec2 centre(2.2F * (column - 3.0F), 2.2F * (row - 1.0F));
        const glm::vec2 d = at - centre;
        if (glm::dot(d, d) > 0.9F) continue;
        const surface::Material& material = scene->materials[i];
        core::CmSurface s{};
        s.base_color = glm::vec3(material.base_color);
        s.metallic = material.metallic;
        s.roughness = material.roughness;
        s.normal = glm::vec3(d, std::sqrt(1.0F - glm::dot(d, d)));
        s.matte_normal = s.smooth_normal = s.normal;
        s.f0 = glm::vec3(0.04F);
        s.specular = 1.0F;
        if (s.roughness < 0.3F &&
            glm::dot(s.normal, glm::normalize(lighting.sun_direction + glm::vec3(0, 0, 1))) > 0.98F) {
          continue;  // the highlight shows the facets
        }
        const glm::vec3 expected = core::cm_bsdf_eval(s, {0, 0, 1}, lighting.sun_direction) * 3.0F;
        const glm::vec4 got = picture.color(x, y);
        for (int c = 0; c < 3; ++c) {
          ASSERT_NEAR(got[c], expected[c], 0.03F * expected[c] + 4e-3F) << x << ',' << y << " sphere " << i;
        }
        ASSERT_NEAR(picture.z(x, y), 20.0F - s.normal.z, 3e-3F);
        ++compared;
      }
    }
  }
  EXPECT_GT(compared, 2000);

  // For visual inspection: CUMULET_PICTURES=DIR.
  if (const char* folder = std::getenv("CUMULET_PICTURES")) {
    lighting.sky_radiance = {0.25F, 0.35F, 0.5F};
    const Picture layered = draw(straight({0, 0, 12}, 0.31, 7.0 / 3.0), lighting, size, 8);
    cumulet::image::Image out{size.x, size.y, std::vector<float>(std::size_t{size.x} * size.y * 4)};
    for (std::size_t i = 0; i < layered.colors.size(); ++i) {
      const std::size_t pixel = i % (std::size_t{size.x} * size.y);
      for (std::size_t c = 0; c < 4; ++c) {
        out.rgba[pixel * 4 + c] += layered.colors[i][static_cast<int>(c)] / 8.0F;
      }
    }
    const char* backend = GetParam() == cumulet::headless::Backend::egl ? "egl" : "osmesa";
    cumulet::image::write_png(std::string(folder) + "/spheres_" + backend + ".png", out);
  }
}

// For any speed of the driver and any vertex cost: a drag shows at least half of the resolution, and at rest all of it.
// Images of one view share one raster pass.
TEST_P(SurfaceRasters, PreviewsAreSharp) {
  using namespace cumulet::render;
  Tracer tracer(gl_, programs_);
  const glm::uvec2 size(1068U, 901U);
  for (const double budget : {1e-9, 0.1, 16.0, 1e9}) {
    const glm::uvec2 dragged = Progressive::quick_layers(tracer, size, budget, false).layer_size;
    EXPECT_GE(dragged.x, size.x / 2) << budget;
    EXPECT_GE(dragged.y, size.y / 2) << budget;
    EXPECT_EQ(Progressive::quick_layers(tracer, size, budget, true).layer_size, size) << budget;
  }
  const auto scene = std::make_shared<HandScene>();
  scene->add_matte(glm::vec3(0.5F));
  scene->add_wall(-2.0F, 3.0F, 0);
  set(scene);
  const StateGuard guard(*gl_);
  TraceInputs surfaces;
  surfaces.raster = raster_.get();
  surfaces.view = straight({0, 0, 0}, 0.5);
  PictureSettings settings;
  settings.layered = Layered::beneath;
  settings.layer_size = {32U, 16U};
  cumulet::render::Picture coarse;
  cumulet::render::Picture fine;
  tracer.draw_layers(coarse, surfaces, settings);
  tracer.draw_layers(fine, surfaces, settings);
  EXPECT_EQ(&coarse.layers(), &fine.layers());
  const std::uint64_t bytes = tracer.bytes();
  surfaces.view.eye.x = 0.5;
  tracer.draw_layers(fine, surfaces, settings);
  EXPECT_NE(&coarse.layers(), &fine.layers()) << "another view";
  tracer.draw_layers(coarse, surfaces, settings);
  EXPECT_EQ(&coarse.layers(), &fine.layers());
  raster_->show({{content_of(scene, scene->pose(0.0, 0))}});
  tracer.draw_layers(fine, surfaces, settings);
  EXPECT_NE(&coarse.layers(), &fine.layers()) << "another pose";
  EXPECT_LE(tracer.bytes(), 2 * bytes) << "what no picture shows is used again";
}

// After a drag ends, no image is finished over a coarse raster pass, and all coarse images share one pass of full size.
TEST_P(SurfaceRasters, ImageIsSharpWhenTheCameraStops) {
  using namespace cumulet::render;
  const auto scene = std::make_shared<HandScene>();
  scene->add_matte(glm::vec3(0.5F));
  scene->add_wall(-2.0F, 3.0F, 0);
  set(scene);
  const StateGuard guard(*gl_);
  const glm::uvec2 size(1068U, 901U);
  TraceInputs surfaces;
  surfaces.raster = raster_.get();
  surfaces.view = straight({0, 0, 0}, 0.5);
  PictureRequest request;
  request.content.size = request.parameters.view.size = size;
  request.samples = 4;
  request.held = true;
  Progressive progressive(gl_, programs_);
  const MarchData nothing;
  const auto step = [&](bool moves) {
    if (moves) {
      surfaces.view.eye.x += 0.01;
      request.content.viewpoint.set(surfaces.view);
    }
    progressive.advance(request, nothing, surfaces, std::chrono::steady_clock::now(), 0.1);
  };
  for (int i = 0; i < 200; ++i) {  // two calls per frame, as some hosts do
    step(i % 2 == 0);
    std::this_thread::sleep_for(std::chrono::microseconds(200));
  }
  ASSERT_NE(progressive.shown(), nullptr);
  EXPECT_EQ(progressive.shown()->layers().size, (size + 1U) / 2U);
  request.held = false;
  const SurfaceLayers* sharp = nullptr;
  const auto* last = progressive.shown();
  int shown = 0;
  for (int i = 0; i < 5000 && shown < 3; ++i) {
    step(false);
    if (progressive.shown() == last) continue;
    last = progressive.shown();
    ++shown;
    ASSERT_EQ(last->layered(), Layered::beneath);
    EXPECT_EQ(last->layers().size, size) << "the " << shown << ". picture";
    if (sharp == nullptr) sharp = &last->layers();
    EXPECT_EQ(&last->layers(), sharp);
  }
  EXPECT_EQ(shown, 3);
}

TEST_P(SurfaceRasters, ReportsItsMemory) {
  EXPECT_EQ(raster_->bytes(), 0U);
  draw(straight({0, 0, 0}, 1.0), {}, {5U, 3U});
  const std::uint64_t empty = raster_->bytes();
  EXPECT_GT(empty, 5U * 3U * 4U);
  const auto scene = std::make_shared<HandScene>();
  scene->add_matte(glm::vec3(1.0F));
  scene->add_wall(-2.0F, 1.0F, 0);
  set(scene);
  draw(straight({0, 0, 0}, 1.0), {}, {5U, 3U});
  constexpr std::uint64_t more =
      64U * 32U * 6U * 16U + 15U * 4U;  // the prefiltered environment of glossy surfaces, and one instance transform
  EXPECT_EQ(raster_->bytes(), empty + more);
  draw(straight({0, 0, 0}, 1.0), {}, {32U, 16U});
  EXPECT_EQ(raster_->bytes(), empty + more + (32U * 16U - 5U * 3U) * 4U);
}

TEST_P(SurfaceRasters, GlStateIsRestoredAndNotRead) {
  const auto scene = std::make_shared<HandScene>();
  scene->add_matte(glm::vec3(0.5F)).base_color_texture.texture =
      scene->add_texture(2, 2, {255, 0, 0, 255, 0, 255, 0, 255, 0, 0, 255, 255, 99, 99, 99, 255});
  surface::Material& blend = scene->add_matte(glm::vec3(0.5F));
  blend.alpha_mode = surface::AlphaMode::blend;
  blend.base_color.a = 0.5F;
  surface::Material& mask = scene->add_matte(glm::vec3(0.5F));
  mask.alpha_mode = surface::AlphaMode::mask;
  mask.double_sided = true;
  scene->add_wall(-3.0F, 1.0F, 0);
  scene->add_wall(-2.0F, 0.5F, 1);
  scene->add_wall(-4.0F, 1.8F, 2);
  scene->posed.lights.emplace_back();
  SurfaceLighting lighting;
  lighting.sky_radiance = glm::vec3(1.0F);
  set(scene);
  const Picture expected = draw(straight({0, 0, 0}, 0.5), lighting, {16U, 16U}, 2);
  cumulet::test::ScramblingHost host(gl_);
  for (std::uint32_t seed = 0; seed < 12; ++seed) {
    host.scramble(seed);
    const cumulet::test::GlState before = cumulet::test::read_gl_state(*gl_);
    {
      // Uploads everything again in this state.
      const StateGuard guard(*gl_);
      raster_ = std::make_unique<SurfaceRaster>(gl_);
    }
    set(scene);
    const Picture picture = draw(straight({0, 0, 0}, 0.5), lighting, {16U, 16U}, 2);
    ASSERT_EQ(cumulet::test::state_differences(before, cumulet::test::read_gl_state(*gl_)), "") << seed;
    ASSERT_EQ(picture.colors, expected.colors) << seed;
    ASSERT_EQ(picture.depths, expected.depths) << seed;
  }
}

TEST_P(SurfaceRasters, RejectsTooLargeScenes) {
  const auto scene = std::make_shared<HandScene>();
  scene->add_matte(glm::vec3(1.0F));
  scene->add_wall(-2.0F, 1.0F, 0);
  set(scene);
  const auto code_of = [this](auto&& call) {
    const StateGuard guard(*gl_);
    try {
      call();
    } catch (const Error& error) {
      return error.code();
    }
    ADD_FAILURE() << "no error";
    return ErrorCode::gl;
  };
  surface::Pose pose = scene->pose(0.0, 0);
  pose.vertices.pop_back();
  EXPECT_EQ(code_of([&] { content_of(scene, pose); }), ErrorCode::internal);
  const auto huge = std::make_shared<HandScene>();
  huge->add_matte(glm::vec3(1.0F)).base_color_texture.texture =
      huge->add_texture(1U << 20U, 1, std::vector<std::uint8_t>(std::size_t{4} << 20U));
  EXPECT_EQ(code_of([&] { content_of(huge, huge->pose(0.0, 0)); }), ErrorCode::unsupported);
  surface::Pose lit = scene->pose(0.0, 0);
  lit.lights.resize(3);
  cumulet::gl::Limits few = cumulet::gl::query_limits(*gl_);
  few.storage_block_bytes = 64;
  EXPECT_EQ(code_of([&] { content_of(scene, lit, few); }), ErrorCode::unsupported);
  try {
    cumulet::gl::make_texture_2d(gl_, GL_R32F, few.texture_size_2d + 1, 1, "creating a picture");
    ADD_FAILURE() << "no error";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::unsupported);
    EXPECT_NE(std::string(error.what()).find("GL_MAX_TEXTURE_SIZE"), std::string::npos) << error.what();
  }
  SurfaceView flat = straight({0, 0, 0}, 0.5);
  flat.up = flat.right;
  EXPECT_EQ(code_of([&] { raster_->draw(flat, {}, {4U, 4U}, 1, layers_); }), ErrorCode::internal);
  // The previous content is kept.
  EXPECT_NEAR(draw(straight({0, 0, 0}, 0.1), {}).centre_z(), 2.0F, 1e-6F);
}

}  // namespace
