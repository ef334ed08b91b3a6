// The ground plane, compared with closed forms and with triangles.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <memory>
#include <numbers>

#include "support/gl_viewer.hpp"
#include "support/osmesa_leaks.hpp"
#include "support/surfaces.hpp"
#include "support/volumes.hpp"

namespace {

using namespace cumulet;
using glm::dvec3;
using glm::ivec3;
using glm::vec3;
using test::StillScene;
using viewer::GroundMode;

constexpr double pi = std::numbers::pi;

class Ground : public test::ViewerTest {};
CUMULET_ON_BACKENDS(Ground);

viewer::GridSettings brick() {
  viewer::GridSettings s;
  s.build.march = scene::March::brick;
  return s;
}

viewer::Light sun_at(float elevation_degrees, float irradiance, float sky) {
  viewer::Light light;
  light.sun_elevation_degrees = elevation_degrees;
  light.sun_irradiance = vec3(irradiance);
  light.sky_radiance = vec3(sky);
  return light;
}

// Same expectation as FloorUnderASlabIsLitAndVisibleThroughIt (surface_trace_test): albedo / pi * E cos * exp(-tau /
// cos) on the way in, exp(-tau) out. The plane is below the slab, or halfway up in it.
TEST_P(Ground, UnderASlabIsLitAndVisibleThroughIt) {
  const auto still = make();
  still->set_volume(test::slab());
  still->set_camera(test::looking_down());
  const vec3 albedo(0.8F, 0.4F, 0.1F);
  for (const auto march : {scene::March::tet, scene::March::brick}) {
    viewer::GridSettings grid;
    grid.build.march = march;
    grid.build.refine.threshold = -1.0;
    still->set_grid(grid);
    for (const double height : {-10.0, 3.5}) {
      still->viewer().set_ground({GroundMode::at_height, height, albedo});
      for (const double sigma : {1e-6, 0.1}) {
        still->set_medium({sigma, vec3(0.0F), {}, 0});
        for (const float elevation : {90.0F, 70.0F}) {
          still->set_light(sun_at(elevation, 3.0F, 0.0F));
          const test::Picture picture = test::render(*still, {16, 16, 64, 1, render::View::shaded});
          const double cosine = std::sin(elevation * pi / 180.0);
          const double tau = sigma * (height < 0.0 ? 8.0 : 4.0);
          const double expected = 3.0 * cosine / pi * std::exp(-tau / cosine - tau);
          EXPECT_NEAR(picture.mean().x, albedo.x * expected, 0.04 * expected) << height << " " << sigma;
          EXPECT_NEAR(picture.mean().z, albedo.z * expected, 0.01 * expected) << height << " " << sigma;
          EXPECT_NEAR(picture.mean().w, 1.0, 1e-6);
        }
      }
    }
  }
}

// The volume of a sequence before the smoke begins: albedo / pi * E cos.
TEST_P(Ground, ExistsAtAGivenHeightWithoutAVolume) {
  const auto still = make();
  still->set_volume(test::make_volume({8, 8, 8}, ivec3(0), [](const ivec3&) { return 0.0F; }));
  still->set_camera(test::looking_down());
  still->set_light(sun_at(30.0F, 3.0F, 0.0F));
  for (const auto march : {scene::March::tet, scene::March::brick}) {
    viewer::GridSettings grid;
    grid.build.march = march;
    still->set_grid(grid);
    still->viewer().set_ground({GroundMode::at_height, -2.0, vec3(0.8F)});
    const test::Picture picture = test::render(*still, {16, 16, 16, 1, render::View::shaded});
    EXPECT_NEAR(picture.mean().x, 0.8 * 3.0 * 0.5 / pi, 1e-4);
    EXPECT_NEAR(picture.mean().w, 1.0, 1e-6);
  }
}

// White furnace test: without absorption everything is as bright as the sky.
TEST_P(Ground, WhiteFurnaceIsOne) {
  const auto still = make();
  still->set_volume(test::noise_volume({24, 20, 22}, ivec3(0), 3));
  still->set_light(sun_at(0.0F, 0.0F, 1.0F));
  still->viewer().set_ground({GroundMode::below, 0.0, vec3(1.0F)});
  still->set_medium({0.5, vec3(1.0F), {0.4F}, 0});
  still->set_camera(test::camera_at({12.0, 30.0, 60.0}, {12.0, 8.0, 11.0}, 32.0));
  const test::Picture picture = test::render(*still, {24, 24, 128, 7, render::View::shaded});
  EXPECT_NEAR(picture.mean().x, 1.0, 0.01);
}

// With and without a model, under sky and lights, the plane equals two triangles of the same albedo.
TEST_P(Ground, MatchesTwoTriangles) {
  const auto cloud = test::make_volume({24, 16, 24}, ivec3(0), [](const ivec3& p) {
    return glm::length(vec3(p) - vec3(12.0F, 8.0F, 12.0F)) < 8.0F ? 1.0F : 0.0F;
  });
  const vec3 albedo(0.7F, 0.5F, 0.3F);
  constexpr float height = -4.0F;
  for (const bool model : {false, true}) {
    const auto scene = [&](bool floor) {
      auto made = std::make_shared<StillScene>();
      made->add(test::diffuse(vec3(0.8F)));
      made->add(test::diffuse(albedo));
      if (model) made->add_sphere({30.0F, 2.0F, 8.0F}, 5.0F, 0);
      constexpr float half = 3000.0F;
      if (floor) {
        made->add_quad({{{-half, height, half}, {half, height, half}, {half, height, -half}, {-half, height, -half}}},
                       1);
      }
      return made;
    };
    const auto picture = [&](bool floor) {
      const auto still = make();
      still->set_volume(cloud);
      still->set_grid(brick());
      still->set_medium({0.3, vec3(1.0F, 0.9F, 0.8F), {0.3F}, 0});
      viewer::Light light = sun_at(50.0F, 3.0F, 0.4F);
      light.sun_azimuth_degrees = 70.0F;
      light.sun_angle_degrees = 8.0F;
      still->set_light(light);
      light::AnalyticLight point;
      point.position = {26.0, 14.0, 20.0};
      point.power = vec3(2000.0F, 1000.0F, 500.0F);
      light::AnalyticLight disc = point;
      disc.kind = light::AnalyticLight::Kind::disc;
      disc.position = {4.0, 20.0, 24.0};
      disc.width = 6.0;
      still->viewer().set_lights({point, disc});
      still->set_camera(test::camera_at({12.0, 40.0, 70.0}, {14.0, 0.0, 10.0}, 40.0));
      if (model || floor) still->viewer().show_surfaces(test::source_of(scene(floor)));
      if (!floor) still->viewer().set_ground({GroundMode::at_height, height, albedo});
      return test::render(*still, {32, 32, 256, 5, render::View::shaded});
    };
    const test::Picture ground = picture(false);
    const test::Picture triangles = picture(true);
    for (int c = 0; c < 3; ++c) {
      EXPECT_NEAR(ground.mean()[c], triangles.mean()[c], 0.01 * triangles.mean()[c]) << model;
    }
    constexpr std::size_t side = 8;
    for (std::size_t block = 0; block < 16; ++block) {
      double a = 0.0;
      double b = 0.0;
      for (std::size_t i = 0; i < side * side; ++i) {
        const std::size_t at = (block / 4 * side + i / side) * 32 + block % 4 * side + i % side;
        a += ground.pixels[at].y;
        b += triangles.pixels[at].y;
      }
      EXPECT_NEAR(a, b, 0.03 * b) << "block " << block << " model " << model;
    }
  }
}

TEST_P(Ground, IsHitOnlyFromAbove) {
  const auto still = make();
  still->set_volume(test::slab());
  still->set_light(sun_at(90.0F, 3.0F, 0.0F));
  still->set_medium({1e-6, vec3(0.0F), {}, 0});
  still->viewer().set_ground({GroundMode::at_height, -50.0, vec3(0.5F)});
  still->set_camera(test::camera_at({32.0, -90.0, 300.0}, {32.0, 0.0, 32.0}, 1.0));
  EXPECT_NEAR(test::render(*still, {8, 8, 4, 1, render::View::shaded}).mean().w, 0.0, 1e-3);
  still->set_camera(test::camera_at({32.0, -10.0, 300.0}, {32.0, -40.0, 32.0}, 1.0));
  EXPECT_EQ(test::render(*still, {8, 8, 4, 1, render::View::shaded}).mean().w, 1.0);
}

}  // namespace
