// Color ramps of grid values: the ramp, the channels that follow from it, and images compared with closed forms.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <vector>

#include "base/luminance.hpp"
#include "light/black_body.hpp"
#include "support/fields.hpp"
#include "support/gl_viewer.hpp"
#include "support/marches.hpp"
#include "support/osmesa_leaks.hpp"
#include "support/volumes.hpp"
#include "volume/ramp.hpp"

namespace {

using namespace cumulet;
using cumulet::test::colors;
using cumulet::test::field;
using glm::dvec3;
using glm::ivec3;
using glm::vec3;
using glm::vec4;
using volume::ColorRamp;
using volume::Ramp;
using volume::ScalarVolume;
using volume::VolumeFrame;

// ---- The ramp

TEST(ColorRamp, IsLinearBetweenStopsAndConstantBeyond) {
  const ColorRamp ramp({{0.5F, 1.0F, 0.0F, 0.25F}, {1.5F, 0.0F, 1.0F, 0.75F}, {4.0F, 8.0F, 4.0F, 0.0F}});
  EXPECT_EQ(ramp(0.0F), vec3(1.0F, 0.0F, 0.25F));
  EXPECT_EQ(ramp(0.5F), vec3(1.0F, 0.0F, 0.25F));
  EXPECT_EQ(ramp(0.75F), vec3(0.75F, 0.25F, 0.375F));
  EXPECT_EQ(ramp(1.5F), vec3(0.0F, 1.0F, 0.75F));
  EXPECT_EQ(ramp(2.75F), vec3(4.0F, 2.5F, 0.375F));
  EXPECT_EQ(ramp(1e30F), vec3(8.0F, 4.0F, 0.0F));
  EXPECT_FLOAT_EQ(ColorRamp({{-1e30F, vec3(0.0F)}, {1e30F, vec3(1e30F)}})(1.0F).y, 0.5e30F);
  EXPECT_EQ(ColorRamp()(0.7F), vec3(1.0F)) << "white without stops";
}

// ---- Channels

vec3 value_at(const grid::RgbField::Components& of, const ivec3& p) {
  return {test::value_at(of[0], p), test::value_at(of[1], p), test::value_at(of[2], p)};
}

// Densities of 0, 1, 2 and 3 in layers along x.
VolumeFrame layers() {
  return {.density =
              test::make_volume(ivec3(16, 8, 8), ivec3(0), [](const ivec3& p) { return static_cast<float>(p.x / 4); })};
}

const ColorRamp by_density({{1.0F, 1.0F, 0.5F, 0.0F}, {3.0F, 0.0F, 0.25F, 1.0F}});

TEST(ColorRamp, OfDensityIsAFactorOfTheScattering) {
  VolumeFrame frame = layers();
  for (const bool colored : {false, true}) {
    if (colored)
      frame.color = colors(ivec3(16, 8, 8), ivec3(0), [](const ivec3& /*p*/) { return vec3(0.5F, 2.0F, 1.0F); });
    const auto scattering = scene::scattering_of(frame, {{}, by_density});
    ASSERT_TRUE(scattering);
    const vec3 color = colored ? vec3(0.5F, 1.0F, 1.0F) : vec3(1.0F);
    EXPECT_EQ(value_at(*scattering, {1, 2, 3}), vec3(0.0F)) << "no density scatters nothing";
    EXPECT_EQ(value_at(*scattering, {5, 2, 3}), color * vec3(1.0F, 0.5F, 0.0F));
    EXPECT_EQ(value_at(*scattering, {9, 2, 3}), 2.0F * color * vec3(0.5F, 0.375F, 0.5F));
    EXPECT_EQ(value_at(*scattering, {13, 2, 3}), 3.0F * color * vec3(0.0F, 0.25F, 1.0F));
  }
}

// A value keeps its color when the ramp of the density changes.
TEST(ColorRamp, OfDensityMapsTheGridsOwnValues) {
  const VolumeFrame frame = layers();
  const auto scattering = scene::scattering_of(frame, {Ramp({{1.0F, 3.0F}, {2.0F, 0.5F}, {3.0F, 0.0F}}), by_density});
  ASSERT_TRUE(scattering);
  EXPECT_EQ(value_at(*scattering, {5, 2, 3}), 3.0F * vec3(1.0F, 0.5F, 0.0F));
  EXPECT_EQ(value_at(*scattering, {9, 2, 3}), 0.5F * vec3(0.5F, 0.375F, 0.5F));
  EXPECT_EQ(value_at(*scattering, {13, 2, 3}), vec3(0.0F));
}

TEST(ColorRamp, OfDensityWeightsTheAnisotropy) {
  VolumeFrame frame = layers();
  frame.anisotropy = test::anisotropy(ivec3(16, 8, 8), ivec3(0), [](const ivec3& /*p*/) { return 0.5F; });
  const auto forward = scene::forward_of(frame, {{}, by_density});
  ASSERT_TRUE(forward);
  EXPECT_FLOAT_EQ(test::value_at(*forward, {9, 2, 3}), 0.75F * luminance(2.0F * vec3(0.5F, 0.375F, 0.5F)));
}

// Densities far from 1 are stored in another unit. Their colors are those of the grid's values.
TEST(ColorRamp, OfDensityMapsExtremeValues) {
  for (const float unit : {0x1p-80F, 1.0F, 0x1p80F}) {
    const viewer::VolumeAsset asset(field(ivec3(8), ivec3(0), 2.0F * unit));
    std::vector<vec4> stops = by_density.stops();
    for (vec4& stop : stops) stop.x *= unit;
    Progress progress;
    for (const Ramp& ramp : {Ramp(), Ramp({{0.0F, 0.0F}, {3.0F * unit, 1.5F * unit}})}) {
      double seconds = 0.0;
      const double depth = asset.density(ramp, progress, seconds).statistics->mean_optical_depth();
      const grid::Channels channels = asset.channels({ramp, ColorRamp(stops)}, {}, false, progress);
      ASSERT_TRUE(channels.scattering);
      const dvec3 albedo = channels.scattering->mean_depth() / depth;
      EXPECT_LT(glm::length(albedo - dvec3(0.5, 0.375, 0.5)), 1e-6) << unit;
    }
  }
}

TEST(ColorRamp, ChangesOnlyItsOwnChannel) {
  VolumeFrame frame = layers();
  frame.flame = field(ivec3(16, 8, 8), ivec3(0), 1.0F);
  const viewer::VolumeAsset asset(std::move(frame));
  Progress progress;
  const grid::Channels plain = asset.channels({}, {}, false, progress);
  EXPECT_FALSE(plain.scattering);
  const grid::Channels colored = asset.channels({{}, by_density}, {}, false, progress);
  EXPECT_TRUE(colored.scattering);
  EXPECT_EQ(colored.emission, plain.emission);
  scene::Emission emission;
  emission.flame_colors = by_density;
  const grid::Channels both = asset.channels({{}, by_density}, emission, false, progress);
  EXPECT_EQ(both.scattering, colored.scattering) << "not computed again";
  EXPECT_NE(both.emission, plain.emission);
}

TEST(ColorRamp, OfTemperatureReplacesTheColorOfBlackBodies) {
  VolumeFrame frame{.density = field(ivec3(8), ivec3(0), 0.0F)};
  frame.temperature = test::make_volume(ivec3(8), ivec3(0), [](const ivec3& p) { return p.x < 4 ? 0.5F : 1.0F; });
  scene::Emission emission{.temperature_scale = 1500.0, .blackbody = 0.75, .blackbody_tint = {1.0F, 0.5F, 2.0F}};
  emission.temperature_ramp = Ramp({{0.5F, 1.0F}, {1.0F, 1.5F}});
  emission.temperature_colors = ColorRamp({{0.5F, 0.2F, 0.4F, 5.0F}, {1.5F, 0.0F, 0.8F, 1.0F}});
  const auto radiance = scene::emission_of(frame, emission);
  ASSERT_TRUE(radiance);
  const dvec3 tint(1.0, 0.5, 2.0);
  const dvec3 cool = light::black_body_radiance(1500.0, 0.75) * tint * dvec3(0.2, 0.4, 5.0);
  const dvec3 hot = light::black_body_radiance(2250.0, 0.75) * tint * dvec3(0.1, 0.6, 3.0);
  EXPECT_LT(glm::length(dvec3(value_at(*radiance, {1, 2, 3})) - cool), 1e-6 * glm::length(cool));
  EXPECT_LT(glm::length(dvec3(value_at(*radiance, {6, 2, 3})) - hot), 1e-6 * glm::length(hot));
  emission.blackbody = 0.0;
  EXPECT_FALSE(scene::emission_of(frame, emission)) << "the black body is off";
  emission.blackbody = 1.0;
  emission.temperature_scale = 80.0;
  emission.temperature_ramp = {};
  EXPECT_FALSE(scene::emission_of(frame, emission)) << "dark below 100 K";
}

// A color of luminance 1 is as bright as the black body.
TEST(ColorRamp, OfTemperatureKeepsTheBrightness) {
  VolumeFrame frame{.density = field(ivec3(8), ivec3(0), 0.0F)};
  frame.temperature = field(ivec3(8), ivec3(0), 1.0F);
  scene::Emission emission{.blackbody = 1.0};
  const auto brightness = [&] { return luminance(value_at(*scene::emission_of(frame, emission), {1, 2, 3})); };
  const float of_body = brightness();
  emission.temperature_colors = ColorRamp({{0.0F, vec3(1.0F)}, {2.0F, vec3(1.0F)}});
  EXPECT_NEAR(brightness(), of_body, 1e-4F * of_body);
}

TEST(ColorRamp, OfFlameReplacesTheFlameColor) {
  VolumeFrame frame{.density = field(ivec3(8), ivec3(0), 0.0F)};
  frame.flame = test::make_volume(ivec3(8), ivec3(0), [](const ivec3& p) { return p.x < 4 ? 0.0F : 2.0F; });
  scene::Emission emission{.flame_strength = 3.0, .flame_color = {1.0F, 0.5F, 0.25F}};
  emission.flame_ramp = Ramp({{0.0F, 1.0F}, {4.0F, 2.0F}});
  emission.flame_colors = ColorRamp({{0.0F, vec3(7.0F)}, {1.0F, 0.0F, 0.0F, 0.0F}, {3.0F, 1.0F, 2.0F, 4.0F}});
  const auto radiance = scene::emission_of(frame, emission);
  ASSERT_TRUE(radiance);
  EXPECT_EQ(value_at(*radiance, {5, 2, 3}), 1.5F * 3.0F * vec3(0.5F, 1.0F, 2.0F));
  EXPECT_EQ(value_at(*radiance, {1, 2, 3}), vec3(0.0F)) << "no flame emits nothing";
}

// ---- Images

class ColorRampRendering : public test::ViewerTest {
 protected:
  static test::Picture look(test::Still& viewer, const dvec3& at, std::uint32_t samples, double fovy = 0.5) {
    viewer.set_camera(test::camera_at(at + dvec3(0.0, 0.0, 500.0), at, fovy));
    return test::render(viewer, {8, 8, samples, 1, render::View::shaded});
  }
};
CUMULET_ON_BACKENDS(ColorRampRendering);

// A dense medium with a density per side; single scattering in a half-space of albedo a reflects a (1 - ln 2) / 2.
TEST_P(ColorRampRendering, DensityColorsAreAlbedos) {
  const auto viewer = make();
  viewer->set_light({0.0F, 0.0F, vec3(0.0F), vec3(1.0F)});
  viewer->set_volume(VolumeFrame{
      .density = test::make_volume(ivec3(32), ivec3(0), [](const ivec3& p) { return p.x < 16 ? 1.0F : 2.0F; })});
  viewer::Medium medium;
  medium.density_scale = 10.0;
  medium.albedo = vec3(1.0F, 0.5F, 1.0F);
  medium.max_bounces = 1;
  viewer->set_medium(medium);
  // The ramp of densities swaps the opacities, but not the colors.
  viewer::Ramps ramps{.density = Ramp({{1.0F, 2.0F}, {2.0F, 1.0F}})};
  ramps.density_colors = ColorRamp({{0.0F, 0.0F, 0.0F, 0.0F}, {1.0F, 1.0F, 0.5F, 0.0F}, {3.0F, 0.0F, 1.0F, 1.0F}});
  viewer->viewer().set_ramps(ramps);
  const double half_space = 0.5 * (1.0 - std::log(2.0));
  for (const test::MarchKind& kind : test::march_kinds) {
    viewer->set_grid(test::settings_of(kind));
    for (const double x : {7.5, 23.5}) {
      const glm::dvec4 mean = look(*viewer, {x, 15.5, 0.0}, 256).mean();
      const dvec3 albedo = (x < 16.0 ? dvec3(1.0, 0.5, 0.0) : dvec3(0.5, 0.75, 0.5)) * dvec3(1.0, 0.5, 1.0);
      // A path returns at most 1: the standard error of 64 x 256 paths is below 0.004.
      for (int i = 0; i < 3; ++i) EXPECT_NEAR(mean[i], albedo[i] * half_space, 0.012) << i << " at " << x;
    }
  }
}

// In a furnace a medium is invisible in colors that it scatters, and follows Beer-Lambert in colors that it absorbs.
TEST_P(ColorRampRendering, DensityColorsPassTheFurnaceTest) {
  const auto viewer = make();
  viewer->set_light({0.0F, 0.0F, vec3(0.0F), vec3(1.0F)});
  viewer->set_volume(VolumeFrame{
      .density = test::make_volume({64, 64, 8}, ivec3(0), [](const ivec3& p) { return p.z < 4 ? 0.25F : 1.0F; })});
  viewer::Medium medium;
  medium.density_scale = 0.2;
  viewer->set_medium(medium);
  viewer->viewer().set_ramps({.density_colors = ColorRamp({{0.25F, 1.0F, 0.0F, 1.0F}, {1.0F, 1.0F, 0.0F, 0.0F}})});
  const double through = std::exp(-0.2 * 4.0 * 1.25);
  for (const test::MarchKind& kind : test::march_kinds) {
    viewer->set_grid(test::settings_of(kind));
    const glm::dvec4 mean = look(*viewer, {31.5, 31.5, 3.5}, 256).mean();
    EXPECT_NEAR(mean.x, 1.0, 2e-3);
    EXPECT_NEAR(mean.y, through, 4.0 * std::sqrt(through * (1.0 - through) / (64.0 * 256.0)));
    EXPECT_GT(mean.z, through + 0.05);
    EXPECT_LT(mean.z, 0.95);
  }
}

// The image of a color ramp is that of a color grid with the same colors, in every grid type, also interpolated.
TEST_P(ColorRampRendering, DensityColorsEqualThoseOfAColorGrid) {
  const ScalarVolume density = test::noise_volume(ivec3(24), ivec3(0), 5);
  const ColorRamp ramp({{0.0F, 0.9F, 0.2F, 0.1F}, {0.5F, 0.3F, 0.9F, 0.5F}, {1.0F, 0.1F, 0.5F, 1.0F}});
  VolumeFrame colored{.density = density};
  for (int i = 0; i < 3; ++i) {
    (colored.color ? *colored.color : colored.color.emplace())[static_cast<std::size_t>(i)] =
        test::make_volume(ivec3(24), ivec3(0), [&](const ivec3& p) { return ramp(test::value_at(density, p))[i]; });
  }
  for (const grid::Interpolation interpolation : {grid::Interpolation::nearest, grid::Interpolation::linear}) {
    for (const test::MarchKind& kind : test::march_kinds) {
      const auto picture_of = [&](const VolumeFrame& frame, const ColorRamp& density_colors) {
        const auto viewer = make();
        viewer->set_light({30.0F, 40.0F, vec3(2.0F), vec3(0.5F)});
        viewer::Medium medium;
        medium.density_scale = 0.5;
        viewer->set_medium(medium);
        viewer->set_volume(VolumeFrame(frame));
        viewer->viewer().set_ramps({.density_colors = density_colors});
        viewer::GridSettings settings = test::settings_of(kind, 0.1);
        settings.build.interpolation = interpolation;
        viewer->set_grid(settings);
        return look(*viewer, dvec3(11.5), 4, 4.0);
      };
      const test::Picture of_grid = picture_of(colored, {});
      EXPECT_EQ(picture_of({.density = density}, ramp).pixels, of_grid.pixels);
      EXPECT_GT(std::abs(of_grid.mean().x - of_grid.mean().z), 0.01) << "it has a hue";
    }
  }
}

TEST_P(ColorRampRendering, TemperatureAndFlameColorsAreExact) {
  const auto viewer = make();
  VolumeFrame frame{.density = test::nothing()};
  frame.temperature = test::make_volume({64, 64, 8}, ivec3(0), [](const ivec3& p) { return p.z < 4 ? 0.5F : 1.0F; });
  frame.flame = field({64, 64, 8}, ivec3(0), 2.0F);
  viewer->set_volume(std::move(frame));
  viewer->set_light({});
  viewer::Medium medium;
  medium.field_emission.blackbody = 1.0;
  medium.field_emission.flame_strength = 0.01;
  medium.field_emission.flame_color = {1.0F, 0.0F, 0.5F};
  viewer->set_medium(medium);
  viewer::Ramps ramps;
  ramps.temperature_colors = ColorRamp({{0.5F, 0.0F, 0.0F, 4.0F}, {1.0F, 2.0F, 1.0F, 0.0F}});
  ramps.flame_colors = ColorRamp({{0.0F, vec3(0.0F)}, {4.0F, 0.0F, 1.0F, 0.0F}});
  viewer->viewer().set_ramps(ramps);
  const double cool = 4.0 * light::black_body_radiance(750.0, 1.0);
  const double hot = 4.0 * light::black_body_radiance(1500.0, 1.0);
  const dvec3 expected(2.0 * hot, hot + 8.0 * 2.0 * 0.01 * 0.5, 4.0 * cool);
  for (const test::MarchKind& kind : test::march_kinds) {
    viewer->set_grid(test::settings_of(kind));
    const glm::dvec4 mean = look(*viewer, {31.5, 31.5, 3.5}, 4).mean();
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(mean[i], expected[i], 2e-3 * expected[i]) << i;
  }
}

// Only color ramps that affect the grid cause a rebuild.
TEST_P(ColorRampRendering, OnlyColorRampsOfGridsThatExistRebuild) {
  const auto viewer = make();
  viewer->set_volume(std::make_shared<const viewer::VolumeAsset>(test::noise_volume(ivec3(16), ivec3(0), 5)));
  viewer->build();
  const auto busy = [&] { return viewer->viewer().status().stage != Progress::Stage::idle; };
  viewer->viewer().set_ramps({.temperature_colors = by_density, .flame_colors = by_density});
  EXPECT_FALSE(busy()) << "there is no temperature and no flame";
  viewer->viewer().set_ramps({.density_colors = by_density});
  EXPECT_TRUE(busy());
}

}  // namespace
