// The raster pass for surfaces: scenes built in code, compared with analytic depth and radiance.

#include "render/raster/surface_raster.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <memory>
#include <numbers>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "base/error.hpp"
#include "gl/state_guard.hpp"
#include "render/frame/progressive.hpp"
#include "support/gl_state.hpp"
#include "support/scrambling_host.hpp"
#include "support/surface_rasters.hpp"
#include "support/surfaces.hpp"

namespace {

using cumulet::Error;
using cumulet::ErrorCode;
using cumulet::gl::StateGuard;
using cumulet::render::surface_jitter;
using cumulet::render::SurfaceLayers;
using cumulet::render::SurfaceLighting;
using cumulet::render::SurfaceRaster;
using cumulet::render::SurfaceView;
using cumulet::test::expect_color;
using cumulet::test::HandScene;
using cumulet::test::RasterPicture;
using cumulet::test::straight;
using cumulet::test::SurfaceRasters;
namespace render = cumulet::render;
namespace surface = cumulet::surface;

constexpr float infinite = std::numeric_limits<float>::infinity();
constexpr float pi = std::numbers::pi_v<float>;

CUMULET_ON_BACKENDS(SurfaceRasters);

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
  RasterPicture picture = draw(straight({0, 0, 0}, 1.0), {}, {5U, 3U}, 3);
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
    const RasterPicture picture = draw(view, {}, size, 2);
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
    const RasterPicture picture = draw(view, {}, {16U, 16U}, 4);
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
  const RasterPicture inside = draw(straight({0, 0, 0}, 0.5), {});
  EXPECT_NEAR(inside.centre_z(), 0.5F, 1e-6F);
  EXPECT_NEAR(inside.z(0, 0), 20000.0F, 0.1F);
  const RasterPicture outside = draw(straight({0, 0, 1e7}, 0.001), {});
  EXPECT_NEAR(outside.z(0, 0), 1.002e7F, 4.0F);
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
  const RasterPicture picture = draw_wall(scene, lighting);
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
  const RasterPicture front = draw(straight({0, 0, 0}, 0.5), {}, {16U, 16U}, 2);
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
  const RasterPicture alone = draw(straight({0, 0, 0}, 0.5), {});
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
  const RasterPicture picture = draw_wall(scene, lighting);
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
        const RasterPicture picture = draw(view, lighting);
        EXPECT_NEAR(picture.centre_z(), 2.0F, 1e-6F);
        expect_color(picture.centre(), glm::vec4(0, 0, 0, 1));
      }
      for (const SurfaceView& view : {back, mirrored_back}) {
        const RasterPicture picture = draw(view, lighting);
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
      const RasterPicture picture = draw(straight({0, 0, 0}, 8.0, 1.0, true), {}, {16U, 16U}, layers);
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
  const RasterPicture expected = draw(straight({0, 0, 0}, 0.5), lighting, {16U, 16U}, 2);
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
    const RasterPicture picture = draw(straight({0, 0, 0}, 0.5), lighting, {16U, 16U}, 2);
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
