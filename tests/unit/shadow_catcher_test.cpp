// Shadow catchers, compared with the background, with closed forms and with diffuse grounds.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "light/light_table.hpp"
#include "support/environments.hpp"
#include "support/gl_viewer.hpp"
#include "support/surfaces.hpp"
#include "support/volumes.hpp"

namespace {

using namespace cumulet;
using glm::ivec3;
using glm::vec3;
using test::pi;
using test::StillScene;
using viewer::GroundMode;

class ShadowCatcher : public test::ViewerTest {};
CUMULET_ON_BACKENDS(ShadowCatcher);

viewer::GroundSettings catcher_at(double height) { return {GroundMode::at_height, height, vec3(0.3F), true}; }

viewer::Light sun_at(float elevation_degrees, float irradiance, float angle_degrees = 0.0F) {
  viewer::Light light;
  light.sun_azimuth_degrees = 70.0F;
  light.sun_elevation_degrees = elevation_degrees;
  light.sun_irradiance = vec3(irradiance, 0.9F * irradiance, 0.7F * irradiance);
  light.sun_angle_degrees = angle_degrees;
  return light;
}

volume::ScalarVolume ball() {
  return test::make_volume({24, 16, 24}, ivec3(0), [](const ivec3& p) {
    return glm::length(vec3(p) - vec3(12.0F, 8.0F, 12.0F)) < 8.0F ? 1.0F : 0.0F;
  });
}

/// Colors of all directions; one color below the horizon.
light::EnvironmentPtr landscape() {
  return test::environment_of(32, 16, [](std::uint32_t x, std::uint32_t y) {
    if (y >= 8) return vec3(0.5F, 0.4F, 0.3F);
    const vec3 sky(0.3F, 0.5F, 0.4F + 0.01F * static_cast<float>(x));
    return x > 20 && x < 24 && y > 3 && y < 6 ? vec3(8.0F, 6.0F, 4.0F) : sky;
  });
}

double mean_of(const test::Picture& picture, std::size_t block, int channel) {
  constexpr std::size_t side = 8;
  double sum = 0.0;
  for (std::size_t i = 0; i < side * side; ++i) {
    const std::size_t at = (block / 4 * side + i / side) * picture.width + block % 4 * side + i % side;
    sum += static_cast<double>(picture.pixels[at][channel]);
  }
  return sum / (side * side);
}

TEST(LevelIrradiance, MatchesClosedForms) {
  const auto of = [](const light::EnvironmentPtr& environment, const light::DistantLights& distant, float strength) {
    return light::level_irradiance(distant, {environment, 20.0F, strength});
  };
  light::DistantLights lights;
  lights.to_sun = glm::dvec3(0.6, 0.8, 0.0);
  lights.sun_irradiance = vec3(2.0F);
  lights.sky_radiance = vec3(0.1F, 0.2F, 0.3F);
  EXPECT_NEAR(of(nullptr, lights, 1.0F).y, 0.2 * pi + 1.6, 1e-5);
  const auto cosine = test::environment_of(64, 512, [](std::uint32_t, std::uint32_t y) {
    return vec3(static_cast<float>(std::max(0.0, std::cos(pi * (y + 0.5) / 512.0))));
  });
  EXPECT_NEAR(of(cosine, {}, 3.0F).x, 3.0 * 2.0 * pi / 3.0, 1e-3);
  EXPECT_NEAR(of(cosine, lights, 1.0F).x, 2.0 * pi / 3.0 + 1.6, 1e-3) << "it replaces the sky, but not the sun";
  const auto below =
      test::environment_of(8, 4, [](std::uint32_t, std::uint32_t y) { return vec3(y > 1 ? 5.0F : 0.0F); });
  lights.to_sun.y = -0.8;
  EXPECT_EQ(of(below, lights, 1.0F), vec3(0.0F));
}

// A single sample already equals the background, so there is no noise.
TEST_P(ShadowCatcher, IsTheBackgroundWhereNothingShadesIt) {
  const auto still = make();
  still->set_volume(ball());
  still->set_medium({1e-7, vec3(1.0F), {}, 0});
  still->set_camera(test::camera_at({12.0, 30.0, 80.0}, {12.0, 0.0, 12.0}, 60.0));
  for (const float angle : {0.0F, 6.0F}) {
    for (const bool mapped : {false, true}) {
      viewer::Light light = sun_at(40.0F, 3.0F, angle);
      light.sky_radiance = vec3(0.2F, 0.3F, 0.5F);
      still->set_light(light);
      still->viewer().set_environment(mapped ? landscape() : nullptr);
      still->viewer().set_environment_settings({30.0F, 1.5F});
      still->viewer().set_ground({});
      const test::Picture without = test::render(*still, {32, 32, 1, 7});
      still->viewer().set_ground(catcher_at(-2.0));
      const test::Picture with = test::render(*still, {32, 32, 1, 7});
      ASSERT_GT(with.mean().w, 0.5) << "the ground is not there";
      for (std::size_t i = 0; i < with.pixels.size(); ++i) {
        for (int c = 0; c < 3; ++c)
          ASSERT_NEAR(with.pixels[i][c], without.pixels[i][c], 1e-4F) << i << " " << angle << " " << mapped;
      }
    }
  }
}

// The slab transmits exp(-tau / cos) of the sunlight, which is nearly all light, and exp(-tau) of the view.
TEST_P(ShadowCatcher, IsDarkerByTheTransmittanceOfASlab) {
  const auto still = make();
  still->set_volume(test::slab());
  still->set_camera(test::looking_down());
  still->viewer().set_ground(catcher_at(-10.0));
  constexpr float sky = 2e-3F;
  for (const auto march : {scene::March::tet, scene::March::brick}) {
    viewer::GridSettings grid;
    grid.build.march = march;
    grid.build.refine.threshold = -1.0;
    still->set_grid(grid);
    for (const double sigma : {0.02, 0.1}) {
      still->set_medium({sigma, vec3(0.0F), {}, 0});
      for (const float angle : {0.0F, 2.0F}) {
        viewer::Light light = sun_at(70.0F, 3.0F, angle);
        light.sky_radiance = vec3(sky);
        still->set_light(light);
        const test::Picture picture = test::render(*still, {16, 16, 256, 1});
        const double tau = 8.0 * sigma;
        const double expected = sky * std::exp(-tau / std::sin(70.0 * pi / 180.0) - tau);
        EXPECT_NEAR(picture.mean().x, expected, 0.02 * expected) << sigma << " " << angle;
        EXPECT_NEAR(picture.mean().w, 1.0, 1e-6);
      }
    }
  }
}

// The catcher's light is the background's, times the ratio of a diffuse ground with and without objects. Objects are
// black, because a diffuse ground lights them and a catcher does not.
TEST_P(ShadowCatcher, MatchesTheRatioOfDiffuseGrounds) {
  for (const bool model : {false, true}) {
    const auto still = make();
    still->set_volume(ball());
    still->set_camera(test::camera_at({12.0, 60.0, 50.0}, {14.0, 0.0, 12.0}, 40.0));
    still->set_light(sun_at(50.0F, 2.0F, 8.0F));
    still->viewer().set_environment(landscape());
    still->viewer().set_environment_settings({50.0F, 1.2F});
    const viewer::GroundSettings diffuse{GroundMode::at_height, -4.0, vec3(0.8F)};
    still->viewer().set_ground(diffuse);
    still->set_medium({1e-7, vec3(0.0F), {}, 0});
    const glm::dvec4 open = test::render(*still, {32, 32, 256, 3}).mean();
    still->set_medium({0.3, vec3(0.0F), {}, 0});
    light::AnalyticLight lamp;
    lamp.position = {30.0, 14.0, 20.0};
    lamp.power = vec3(3000.0F, 2000.0F, 1000.0F);
    still->viewer().set_lights({lamp});
    if (model) {
      const auto scene = std::make_shared<StillScene>();
      scene->add(test::diffuse(vec3(0.0F)));
      scene->add_sphere({24.0F, 4.0F, 4.0F}, 5.0F, 0);
      still->viewer().show_surfaces(test::source_of(scene));
    }
    const test::Image image{32, 32, 400, 5};
    const test::Picture lit = test::render(*still, image);
    still->viewer().set_ground(catcher_at(-4.0));
    const test::Picture caught = test::render(*still, image);
    const vec3 background = 1.2F * vec3(0.5F, 0.4F, 0.3F);
    double darkest = 1.0;
    for (std::size_t block = 0; block < 16; ++block) {
      for (int c = 0; c < 3; ++c) {
        const double expected = static_cast<double>(background[c]) * mean_of(lit, block, c) / open[c];
        EXPECT_NEAR(mean_of(caught, block, c), expected, 0.02 * static_cast<double>(background[c]))
            << "block " << block << " channel " << c << " model " << model;
        darkest = std::min(darkest, expected / static_cast<double>(background[c]));
      }
    }
    EXPECT_LT(darkest, 0.8) << "there is no shadow";
  }
}

TEST_P(ShadowCatcher, DoesNotLightObjects) {
  const auto still = make();
  still->set_volume(ball());
  still->set_medium({0.3, vec3(0.9F), {}, 0});
  still->set_light(sun_at(30.0F, 3.0F));
  still->viewer().set_environment(landscape());
  still->set_camera(test::camera_at({12.0, 4.0, 80.0}, {12.0, 20.0, 12.0}, 20.0));
  const test::Picture without = test::render(*still, {24, 24, 4, 2});
  still->viewer().set_ground(catcher_at(-2.0));
  const test::Picture with = test::render(*still, {24, 24, 4, 2});
  EXPECT_EQ(with.pixels, without.pixels);
  still->viewer().set_ground({GroundMode::at_height, -2.0, vec3(0.8F)});
  EXPECT_NE(test::render(*still, {24, 24, 4, 2}).pixels, without.pixels) << "a diffuse ground lights it";
}

TEST_P(ShadowCatcher, NeedsTheSkyAsBackground) {
  const auto still = make();
  still->set_volume(ball());
  still->set_light(sun_at(30.0F, 3.0F));
  still->viewer().set_environment(landscape());
  still->viewer().set_ground(catcher_at(-2.0));
  still->set_camera(test::camera_at({12.0, 60.0, 50.0}, {14.0, 0.0, 12.0}, 40.0));
  EXPECT_EQ(test::render(*still, {16, 16, 2, 1}).mean().w, 1.0);
  viewer::DisplaySettings display;
  display.transparent = true;
  still->viewer().set_display(display);
  EXPECT_LT(test::render(*still, {16, 16, 2, 1}).mean().w, 0.9);
  display = {};
  display.backdrop = vec3(0.1F);
  still->viewer().set_display(display);
  EXPECT_LT(test::render(*still, {16, 16, 2, 1}).mean().w, 0.9);
  still->viewer().set_display({});
  EXPECT_EQ(test::render(*still, {16, 16, 2, 1}).mean().w, 1.0);
}

}  // namespace
