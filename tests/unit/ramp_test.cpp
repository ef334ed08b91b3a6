// Ramps (transfer functions) of grid values: the curve, the resulting cells, and images compared with closed forms.

#include "volume/ramp.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "grid/cell.hpp"
#include "grid/grid_builder.hpp"
#include "grid/refine.hpp"
#include "light/black_body.hpp"
#include "support/gl_viewer.hpp"
#include "support/marches.hpp"
#include "support/osmesa_leaks.hpp"
#include "support/volumes.hpp"
#include "volume/inspection.hpp"

namespace {

using namespace cumulet;
using glm::ivec3;
using glm::vec3;
using scene::March;
using volume::Ramp;
using volume::ScalarVolume;
using volume::VolumeFrame;

// ---- The curve

TEST(Ramp, IsLinearBetweenPointsAndConstantBeyond) {
  const Ramp ramp({{0.5F, 2.0F}, {1.0F, 4.0F}, {3.0F, 0.0F}, {4.0F, 1.0F}});
  EXPECT_EQ(ramp(0.25F), 2.0F);
  EXPECT_EQ(ramp(0.5F), 2.0F);
  EXPECT_EQ(ramp(0.75F), 3.0F);
  EXPECT_EQ(ramp(1.0F), 4.0F);
  EXPECT_EQ(ramp(2.0F), 2.0F);
  EXPECT_EQ(ramp(3.0F), 0.0F);
  EXPECT_EQ(ramp(3.5F), 0.5F);
  EXPECT_EQ(ramp(1e30F), 1.0F);
  const Ramp steep({{-1e30F, 0.0F}, {1e30F, 1e30F}});
  EXPECT_FLOAT_EQ(steep(1.0F), 0.5e30F);
}

TEST(Ramp, WithoutPointsChangesNothing) {
  EXPECT_TRUE(Ramp().empty());
  for (const float value : {0.0F, 1e-30F, 0.7F, 1e30F}) EXPECT_EQ(Ramp()(value), value);
}

TEST(Ramp, MapsEmptySpaceToZero) {
  const Ramp ramp({{0.0F, 5.0F}, {1.0F, 1.0F}});
  EXPECT_EQ(ramp(0.0F), 0.0F);
  EXPECT_NEAR(ramp(1e-6F), 5.0F, 1e-4F);
}

TEST(Ramp, AppliesToBricksTilesAndBackgrounds) {
  ScalarVolume v = test::make_volume({8, 8, 8}, ivec3(0), [](const ivec3& p) { return static_cast<float>(p.x); });
  v.bounds_max = {39, 7, 7};
  v.tiles.push_back({{16, 0, 0}, {23, 7, 7}, 20.0F});
  v.tiles.push_back({{24, 0, 0}, {27, 7, 7}, 0.0F});
  const Ramp ramp({{0.0F, 3.0F}, {10.0F, 13.0F}, {20.0F, 0.5F}});
  for (const float background : {0.0F, 5.0F}) {
    v.background = background;
    const ScalarVolume out = apply(ramp, v);
    for (int x = -1; x <= 40; ++x) {
      for (const int y : {0, 7, 8}) {
        const ivec3 p(x, y, 3);
        EXPECT_EQ(test::value_at(out, p), ramp(test::value_at(v, p))) << x;
      }
    }
    EXPECT_EQ(test::value_at(out, {30, 3, 3}), background == 0.0F ? 0.0F : 8.0F) << "nothing stays nothing";
    EXPECT_EQ(out.max_value, 10.0F);
    EXPECT_EQ(out.active_voxels, v.active_voxels);
    EXPECT_EQ(out.bounds_max, v.bounds_max);
  }
  // A background that no voxel has does not count.
  v.tiles = {{{8, 0, 0}, {39, 7, 7}, 2.0F}};
  v.background = 8.0F;
  EXPECT_EQ(apply(Ramp({{7.5F, 1.0F}, {8.0F, 50.0F}}), v).max_value, 1.0F);
}

TEST(Histogram, CountsWhatIsAboveZero) {
  ScalarVolume v =
      test::make_volume({8, 8, 8}, ivec3(0), [](const ivec3& p) { return static_cast<float>(p.x) / 8.0F; });
  v.bounds_max = {39, 7, 7};
  v.tiles.push_back({{16, 0, 0}, {23, 7, 7}, 1.0F});
  v.tiles.push_back({{24, 0, 0}, {27, 7, 7}, 0.0F});
  v.background = 0.5F;
  v.max_value = 1.0F;
  const auto counts = volume::histogram(v);
  for (std::size_t i = 0; i < counts.size(); ++i) {
    std::uint64_t expected = i % 8 == 0 && i > 0 ? 64 : 0;
    if (i == 32) expected += 20 * 64;
    if (i == 63) expected = 8 * 64;
    EXPECT_EQ(counts.at(i), expected) << i;
  }
}

// ---- Cells

// Cells hold means of ramped values, not the ramp of means.
TEST(Ramp, CellValueIsTheMeanOfItsVoxels) {
  const Ramp ramp({{0.3F, 0.0F}, {0.4F, 2.0F}, {0.6F, 0.25F}});
  const viewer::VolumeAsset asset(test::noise_volume(ivec3(16), ivec3(0), 5));
  Progress progress;
  double seconds = 0.0;
  const auto density = asset.density(ramp, progress, seconds);
  double mean = 0.0;
  for (int i = 0; i < 4096; ++i) mean += ramp(test::value_at(asset.volume(), {i / 256, i / 16 % 16, i % 16})) / 4096.0;
  grid::RefineSettings coarse;
  coarse.threshold = 1e9;
  const grid::DiamondSet few(*density.statistics, coarse);
  grid::GridBuilder builder(*density.statistics, few);
  builder.bisect();
  const grid::TetGrid grid = builder.records(grid::CellKind::constant, 1.0F);
  ASSERT_EQ(grid.cells.size(), 24U);
  double of_cells = 0.0;
  for (const auto& cell : grid.cells) of_cells += glm::unpackHalf2x16(cell.data.z).x / 24.0;
  EXPECT_NEAR(of_cells, mean, 1e-3 * mean);
  // Cached until another ramp is requested. Without a ramp it is the volume itself.
  EXPECT_EQ(asset.density(ramp, progress, seconds).statistics, density.statistics);
  EXPECT_EQ(seconds, 0.0);
  EXPECT_EQ(asset.density({}, progress, seconds).voxels.get(), &asset.volume());
  EXPECT_EQ(asset.density(ramp, progress, seconds).statistics, density.statistics);
}

// Refinement follows the ramped values: where the ramp removes detail there is none, and where it adds detail there is
// more.
TEST(Ramp, CellsAreRefinedForMappedValues) {
  const viewer::VolumeAsset asset(test::make_volume(ivec3(64), ivec3(0), [](const ivec3& p) {
    return (p.x < 32 ? 0.1F : 1.0F) + 0.01F * static_cast<float>(p.y & 1);
  }));
  Progress progress;
  const auto cells = [&](const Ramp& ramp) {
    double seconds = 0.0;
    grid::RefineSettings settings;
    settings.threshold = 0.05;
    const grid::DiamondSet diamonds(*asset.density(ramp, progress, seconds).statistics, settings);
    grid::GridBuilder builder(*asset.density(ramp, progress, seconds).statistics, diamonds);
    builder.bisect();
    return builder.records(grid::CellKind::constant, 1.0F).cells.size();
  };
  const std::size_t plain = cells({});
  EXPECT_GT(plain, 24U);
  EXPECT_EQ(cells(Ramp({{0.2F, 1.0F}, {2.0F, 1.0F}})), 24U) << "all the same";
  EXPECT_GT(cells(Ramp({{0.105F, 0.0F}, {0.106F, 1.0F}, {1.001F, 0.0F}, {1.009F, 1.0F}})), 10 * plain);
}

// A density ramp is applied before colors. Temperature and flame ramps are applied before the conversion to radiance.
TEST(Ramp, AppliesBeforeColorsAndEmission) {
  const auto field = [](float value) {
    return test::make_volume(ivec3(8), ivec3(0), [=](const ivec3& p) { return p.x < 4 ? value : 0.0F; });
  };
  VolumeFrame frame{.density = field(3.0F)};
  frame.color = {field(0.5F), field(0.25F), field(1.0F)};
  frame.temperature = field(1.0F);
  frame.flame = field(2.0F);
  const auto scattering = scene::scattering_of(frame, Ramp({{0.0F, 9.0F}, {4.0F, 1.0F}}));
  ASSERT_TRUE(scattering);
  EXPECT_EQ(test::value_at((*scattering)[0], {1, 1, 1}), 1.5F);
  EXPECT_EQ(test::value_at((*scattering)[1], {1, 1, 1}), 0.75F);
  EXPECT_EQ(test::value_at((*scattering)[0], {5, 1, 1}), 0.0F);
  scene::Emission emission{.blackbody = 1.0};
  emission.temperature_ramp = Ramp({{0.0F, 2.0F}, {2.0F, 1.0F}});
  emission.flame_ramp = Ramp({{0.0F, 1.0F}, {4.0F, 0.0F}});
  const auto radiance = scene::emission_of(frame, emission);
  ASSERT_TRUE(radiance);
  const vec3 hot(light::black_body_color(2250.0) * light::black_body_radiance(2250.0, 1.0));
  for (std::size_t i = 0; i < 3; ++i) {
    const float expected = 0.5F + hot[static_cast<int>(i)];
    EXPECT_NEAR(test::value_at((*radiance)[i], {1, 1, 1}), expected, 2e-3F * expected);
    EXPECT_EQ(test::value_at((*radiance)[i], {5, 1, 1}), 0.0F) << "dark where neither is";
  }
  // Values that a ramp maps to 0 emit nothing, whatever the temperature offset.
  emission = {.temperature_offset = 2000.0, .blackbody = 1.0};
  emission.temperature_ramp = Ramp({{1.0F, 0.0F}, {2.0F, 1.0F}});
  emission.flame_ramp = Ramp({{5.0F, 0.0F}, {6.0F, 1.0F}});
  EXPECT_FALSE(scene::emission_of(frame, emission));
}

// ---- Images

class RampRendering : public test::ViewerTest {
 protected:
  // Looks down -z at the middle of a slab of 64 x 64 voxels.
  static test::Picture look(test::Still& viewer, std::uint32_t samples) {
    viewer.build();
    viewer.set_camera(test::camera_at({31.5, 31.5, 500.0}, {31.5, 31.5, 0.0}, 0.5));
    return test::render(viewer, {16, 16, samples, 1, render::View::shaded});
  }
};
CUMULET_ON_BACKENDS(RampRendering);

// Layers of 0, 1, 2 and 3 in front of a sky of 1. The ramp maps them to 2, 0.5 and 0, and does not affect the outside.
TEST_P(RampRendering, DensityRampFollowsBeerLambert) {
  const auto viewer = make();
  viewer->set_volume(std::make_shared<const viewer::VolumeAsset>(
      test::make_volume({64, 64, 16}, ivec3(0), [](const ivec3& p) { return static_cast<float>(p.z / 4); })));
  viewer->set_light({0.0F, 0.0F, vec3(0.0F), vec3(1.0F)});
  viewer::Medium medium;
  medium.density_scale = 0.05;
  medium.albedo = vec3(0.0F);
  viewer->set_medium(medium);
  for (const test::MarchKind& kind : test::march_kinds) {
    viewer->set_grid(test::settings_of(kind));
    viewer->viewer().set_ramps({});
    const double plain = std::exp(-0.05 * 4.0 * (1.0 + 2.0 + 3.0));
    EXPECT_NEAR(look(*viewer, 64).mean().x, plain, 4.0 * std::sqrt(plain * (1.0 - plain) / (256.0 * 64.0)));
    viewer->viewer().set_ramps({.density = Ramp({{0.0F, 3.0F}, {1.0F, 2.0F}, {3.0F, 0.0F}, {4.0F, 7.0F}})});
    const double ramped = std::exp(-0.05 * 4.0 * (2.0 + 1.0 + 0.0));
    EXPECT_NEAR(look(*viewer, 64).mean().x, ramped, 4.0 * std::sqrt(ramped * (1.0 - ramped) / (256.0 * 64.0)));
  }
}

TEST_P(RampRendering, TemperatureRampFollowsTheBlackBody) {
  const auto viewer = make();
  VolumeFrame frame{.density = test::make_volume({64, 64, 8}, ivec3(0), [](const ivec3& /*p*/) { return 1e-6F; })};
  frame.temperature = test::make_volume({64, 64, 8}, ivec3(0), [](const ivec3& p) { return p.z < 4 ? 0.5F : 1.0F; });
  viewer->set_volume(std::move(frame));
  viewer->set_light({});
  viewer::Medium medium;
  medium.field_emission.blackbody = 1.0;
  viewer->set_medium(medium);
  for (const test::MarchKind& kind : test::march_kinds) {
    viewer->set_grid(test::settings_of(kind));
    viewer->viewer().set_ramps({.temperature = Ramp({{0.5F, 0.0F}, {1.0F, 1.5F}})});
    // Smoke below is dark, flames above are hotter.
    const glm::dvec4 mean = look(*viewer, 4).mean();
    const double luminance = 4.0 * light::black_body_radiance(2250.0, 1.0);
    EXPECT_NEAR(0.2126 * mean.x + 0.7152 * mean.y + 0.0722 * mean.z, luminance, 1e-2 * luminance);
    viewer->viewer().set_ramps({});
    const glm::dvec4 plain = look(*viewer, 4).mean();
    const double before = 4.0 * (light::black_body_radiance(750.0, 1.0) + light::black_body_radiance(1500.0, 1.0));
    EXPECT_NEAR(0.2126 * plain.x + 0.7152 * plain.y + 0.0722 * plain.z, before, 1e-2 * before);
  }
}

// Only ramps that affect the grid cause a rebuild.
TEST_P(RampRendering, OnlyRampsThatAffectTheGridRebuildIt) {
  const auto viewer = make();
  viewer->set_volume(std::make_shared<const viewer::VolumeAsset>(test::noise_volume(ivec3(16), ivec3(0), 5)));
  viewer->build();
  const auto busy = [&] { return viewer->viewer().status().stage != Progress::Stage::idle; };
  viewer->viewer().set_ramps({.temperature = Ramp({{0.0F, 0.0F}, {1.0F, 2.0F}})});
  EXPECT_FALSE(busy()) << "there is no temperature";
  const std::uint64_t cells = viewer->viewer().stats().cells;
  viewer->viewer().set_ramps({.density = Ramp({{0.0F, 1.0F}, {1.0F, 1.0F}})});
  viewer->build();
  EXPECT_LT(viewer->viewer().stats().cells, cells) << "of one value";
}

}  // namespace
