// Light groups: they add up to the image, and each equals an image with only its lights.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "support/c_viewer.hpp"

namespace {

using namespace cumulet::test;
using cumulet::headless::Backend;
using cumulet::headless::Context;

constexpr std::uint32_t side = 16;
constexpr std::size_t count = std::size_t{side} * side;
constexpr std::uint32_t sun = 1;
constexpr std::uint32_t sky = 2;
constexpr std::uint32_t analytic_light = 3;
constexpr std::uint32_t emissive = 4;
constexpr std::uint32_t pane = 0;
constexpr std::uint32_t groups = 5;

using Rgb = std::vector<float>;

class LightGroups : public CViewerTest {
 protected:
  LightGroups() : CViewerTest(side, side) {}
  void SetUp() override {
    CViewerTest::SetUp();
    if (IsSkipped()) return;
    ASSERT_EQ(cumulet_set_volume(v_, ball_.get()), CUMULET_OK);
    auto display = make_desc<cumulet_display_desc>();
    ASSERT_EQ(cumulet_set_display(v_, &display), CUMULET_OK);
    light();
  }

  // Enables all lights, or only those of one group.
  void light(std::optional<std::uint32_t> alone = std::nullopt) {
    const auto on = [&](std::uint32_t group) { return !alone || *alone == group; };
    auto far = make_desc<cumulet_sun_sky_desc>();
    far.sun_azimuth_degrees = 200.0F;
    far.sun_elevation_degrees = 20.0F;
    far.sun_angle_degrees = sun_angle_;
    for (float& value : far.sun_irradiance) value = on(sun) ? 2.0F : 0.0F;
    for (float& value : far.sky_radiance) value = on(sky) ? 0.4F : 0.0F;
    far.sun_group = sun;
    far.sky_group = sky;
    ASSERT_EQ(cumulet_set_sun_sky(v_, &far), CUMULET_OK);
    auto near = make_desc<cumulet_light_desc>();
    near.kind = CUMULET_LIGHT_DISK;
    near.position[0] = 9.0;
    near.direction[0] = -1.0;
    near.direction[1] = 0.0;
    near.width = 3.0;
    near.power = 3000.0F;
    near.color[1] = 1.0F;
    near.group = analytic_light;
    ASSERT_EQ(cumulet_set_lights(v_, &near, on(analytic_light) ? 1 : 0), CUMULET_OK);
    medium_.emission[0] = on(emissive) ? 0.6F : 0.0F;
    medium_.emission[2] = on(emissive) ? 0.2F : 0.0F;
    medium_.group = emissive;
    ASSERT_EQ(cumulet_set_medium(v_, &medium_), CUMULET_OK);
    if (shines_ != nullptr) {
      ASSERT_EQ(cumulet_set_surfaces(v_, on(pane) ? shines_ : dark_), CUMULET_OK);
    }
  }

  void set(std::uint32_t samples, std::uint32_t seed, std::uint32_t light_groups) {
    sampling_.samples = samples;
    sampling_.seed = seed;
    sampling_.light_groups = light_groups;
    ASSERT_EQ(cumulet_set_sampling(v_, &sampling_), CUMULET_OK) << cumulet_last_error(v_);
  }
  Rgb rgb_linear() {
    const std::vector<float> rgba = linear();
    Rgb rgb;
    for (std::size_t i = 0; i < rgba.size(); ++i)
      if (i % 4 != 3) rgb.push_back(rgba[i]);
    return rgb;
  }
  Rgb group(std::uint32_t number) {
    Rgb rgb(3 * count);
    EXPECT_EQ(cumulet_read_light_group(v_, number, rgb.data(), rgb.size()), CUMULET_OK) << cumulet_last_error(v_);
    return rgb;
  }
  std::vector<Rgb> all_groups() {
    std::vector<Rgb> all;
    for (std::uint32_t i = 0; i < sampling_.light_groups; ++i) all.push_back(group(i));
    return all;
  }
  static void expect_sum(const std::vector<Rgb>& parts, const Rgb& picture) {
    for (std::size_t i = 0; i < picture.size(); ++i) {
      double sum = 0.0;
      for (const Rgb& part : parts) sum += double(part[i]);
      ASSERT_NEAR(sum, picture[i], 2e-6 * (1.0 + double(picture[i]))) << i;
    }
  }

  struct Mean {
    double value = 0.0;
    double error = 0.0;
  };
  // Mean and standard error over several seeds.
  static Mean mean_of(const std::vector<double>& seeds) {
    Mean mean;
    for (const double value : seeds) mean.value += value / double(seeds.size());
    for (const double value : seeds) mean.error += (value - mean.value) * (value - mean.value);
    mean.error = std::sqrt(mean.error / double(seeds.size() * (seeds.size() - 1)));
    return mean;
  }
  static double sum_of(const Rgb& rgb) {
    double sum = 0.0;
    for (const float value : rgb) sum += double(value) / double(rgb.size());
    return sum;
  }
  void expect_each_alone(const std::string& what) {
    constexpr std::uint32_t seeds = 12;
    constexpr std::uint32_t samples = 48;
    std::array<std::vector<double>, groups> together;
    for (std::uint32_t seed = 0; seed < seeds; ++seed) {
      set(samples, seed, groups);
      make();
      const std::vector<Rgb> parts = all_groups();
      expect_sum(parts, rgb_linear());
      for (std::uint32_t i = 0; i < groups; ++i) together.at(i).push_back(sum_of(parts[i]));
    }
    for (std::uint32_t i = 0; i < groups; ++i) {
      if (i == pane && shines_ == nullptr) {
        EXPECT_EQ(mean_of(together.at(i)).value, 0.0) << what;
        continue;
      }
      light(i);
      std::vector<double> alone;
      for (std::uint32_t seed = 0; seed < seeds; ++seed) {
        set(samples, 100 + seed, 0);
        make();
        alone.push_back(sum_of(rgb_linear()));
      }
      const Mean a = mean_of(together.at(i));
      const Mean b = mean_of(alone);
      EXPECT_NEAR(a.value, b.value, 4.0 * std::hypot(a.error, b.error) + 1e-6) << what << ", group " << i;
      EXPECT_GT(b.value, 20.0 * std::hypot(a.error, b.error)) << what << ", group " << i << ": above the noise";
    }
    light();
  }

  VolumeRef ball_ = make_ball(16, 1.0F);
  cumulet_surfaces* shines_ = nullptr;
  cumulet_surfaces* dark_ = nullptr;
  float sun_angle_ = 0.0F;
  cumulet_medium_desc medium_ = [] {
    auto desc = make_desc<cumulet_medium_desc>();
    desc.density_scale = 0.12;
    for (float& value : desc.coalbedo) value = 0.2F;
    desc.anisotropy = 0.3F;
    return desc;
  }();
  cumulet_sampling_desc sampling_ = [] {
    auto desc = make_desc<cumulet_sampling_desc>();
    desc.preview = CUMULET_PREVIEW_OFF;
    return desc;
  }();
};
CUMULET_ON_BACKENDS(LightGroups);

// A pane that emits this radiance, or 0.
SurfacesRef make_pane(float emission) {
  auto mesh = make_desc<cumulet_mesh_desc>();
  for (float& value : mesh.base_color) value = 0.6F;
  mesh.base_color[3] = 1.0F;
  mesh.emission[0] = mesh.emission[1] = emission;
  return make_quad({-9.0F, -9.0F, -9.0F, 9.0F, -9.0F, -9.0F, 9.0F, 9.0F, -9.0F, -9.0F, 9.0F, -9.0F}, mesh);
}

TEST_P(LightGroups, EachMatchesItsLightsOnlyInAVolume) { expect_each_alone("volume"); }

TEST_P(LightGroups, EachMatchesItsLightsOnlyAmongSurfaces) {
  const SurfacesRef shines = make_pane(0.7F);
  const SurfacesRef dark = make_pane(0.0F);
  shines_ = shines.get();
  dark_ = dark.get();
  sun_angle_ = 30.0F;
  light();
  expect_each_alone("surfaces");
}

TEST_P(LightGroups, DoNotChangeTheImage) {
  const SurfacesRef panes = make_panes(4.0F);
  for (const bool surfaces : {false, true}) {
    ASSERT_EQ(cumulet_set_surfaces(v_, surfaces ? panes.get() : nullptr), CUMULET_OK);
    for (const bool analytic_lights : {false, true}) {
      auto far = make_desc<cumulet_sun_sky_desc>();
      for (float& value : far.sun_irradiance) value = 2.0F;
      for (float& value : far.sky_radiance) value = 0.4F;
      ASSERT_EQ(cumulet_set_sun_sky(v_, &far), CUMULET_OK);
      if (!analytic_lights) {
        ASSERT_EQ(cumulet_set_lights(v_, nullptr, 0), CUMULET_OK);
      }
      set(8, 3, 0);
      make();
      const Rgb without = rgb_linear();
      set(8, 3, groups);
      make();
      EXPECT_EQ(rgb_linear(), without) << (surfaces ? "surfaces" : "volume") << (analytic_lights ? ", lamps" : "");
      light();
    }
  }
}

// A constant or transparent background is not light: it is in no group.
TEST_P(LightGroups, ContainTheirOwnBackground) {
  set(8, 0, groups);
  make();
  const Rgb with_sky = group(sky);
  auto display = make_desc<cumulet_display_desc>();
  display.background = CUMULET_BACKGROUND_TRANSPARENT;
  ASSERT_EQ(cumulet_set_display(v_, &display), CUMULET_OK);
  expect_sum(all_groups(), rgb_linear());
  const Rgb without_sky = group(sky);
  std::vector<float> rgba(4 * count);
  ASSERT_EQ(cumulet_read_linear(v_, rgba.data(), rgba.size()), CUMULET_OK);
  for (std::size_t i = 0; i < count; ++i)
    EXPECT_NEAR(with_sky[3 * i], without_sky[3 * i] + (1.0F - rgba[4 * i + 3]) * 0.4F, 1e-5F) << i;
  EXPECT_GT(with_sky[0], without_sky[0]);
}

TEST_P(LightGroups, SumToTheImageOnAShadowCatcher) {
  const SurfacesRef panes = make_panes(4.0F);
  auto ground = make_desc<cumulet_ground_desc>();
  ground.mode = CUMULET_GROUND_SHADOW_CATCHER_BELOW;
  ASSERT_EQ(cumulet_set_ground(v_, &ground), CUMULET_OK);
  for (const bool surfaces : {false, true}) {
    ASSERT_EQ(cumulet_set_surfaces(v_, surfaces ? panes.get() : nullptr), CUMULET_OK);
    set(16, 0, groups);
    make();
    const std::vector<Rgb> all = all_groups();
    expect_sum(all, rgb_linear());
    EXPECT_LT(*std::ranges::min_element(all[sun]), 0.0F) << "the sun's group has no shadow";
  }
}

TEST_P(LightGroups, GroupsBeyondTheLimitCountInTheFirst) {
  set(8, 0, groups);
  make();
  const std::vector<Rgb> all = all_groups();
  set(8, 0, 2);
  make();
  const std::vector<Rgb> two = all_groups();
  expect_sum(two, rgb_linear());
  EXPECT_EQ(two[1], all[1]);
  expect_sum({all[0], all[2], all[3], all[4]}, two[0]);
  Rgb rgb(3 * count);
  EXPECT_EQ(cumulet_read_light_group(v_, 2, rgb.data(), rgb.size()), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(cumulet_read_light_group(v_, 1, rgb.data(), rgb.size() - 1), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(cumulet_read_light_group(v_, 1, nullptr, rgb.size()), CUMULET_ERROR_INVALID_ARGUMENT);
}

// Emission of an instance belongs to its medium's group.
TEST_P(LightGroups, EmissionOfInstancesFollowsTheirMediumsGroup) {
  auto desc = make_desc<cumulet_instance_desc>();
  auto medium = medium_;
  medium.group = sky;
  medium.emission[1] = 0.5F;
  desc.volume = ball_.get();
  desc.medium = &medium;
  const auto transform = at(6.0, 3.0, 0.0);
  std::copy(transform.begin(), transform.end(), desc.to_world);
  const InstanceRef instance = cumulet::test::make_instance(desc);
  cumulet_instance* const made = instance.get();
  ASSERT_EQ(cumulet_add_instance(v_, made), CUMULET_OK);
  auto far = make_desc<cumulet_sun_sky_desc>();
  ASSERT_EQ(cumulet_set_sun_sky(v_, &far), CUMULET_OK);
  set(16, 0, groups);
  make();
  const std::vector<Rgb> all = all_groups();
  expect_sum(all, rgb_linear());
  double green = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    EXPECT_EQ(all[emissive][3 * i + 1], 0.0F) << "red and blue alone";
    green += double(all[sky][3 * i + 1]);
  }
  EXPECT_GT(green, 1.0);
  EXPECT_GT(sum_of(all[emissive]), 0.01);
  EXPECT_EQ(sum_of(all[sun]), 0.0);
}

// Samples added later, or by another process, give the same result as rendering all at once.
TEST_P(LightGroups, ContinueWithMoreSamplesAndFromASavedState) {
  set(9, 0, groups);
  make();
  const std::vector<Rgb> wanted = all_groups();
  set(4, 1, groups);
  set(4, 0, groups);
  make();
  std::size_t size = 0;
  ASSERT_EQ(cumulet_read_accumulation(v_, nullptr, &size), CUMULET_OK);
  EXPECT_EQ(size, 32 + count * (44 + 16 * (groups + 2)));
  std::vector<std::byte> kept(size);
  ASSERT_EQ(cumulet_read_accumulation(v_, kept.data(), &size), CUMULET_OK);
  set(9, 0, groups);
  make();
  EXPECT_EQ(all_groups(), wanted);
  auto frame = undrawn();
  frame.budget_ms = 0.01;
  set(9, 1, groups);
  ASSERT_EQ(cumulet_render(v_, &frame, nullptr), CUMULET_OK);
  set(9, 0, groups);
  ASSERT_EQ(cumulet_render(v_, &frame, nullptr), CUMULET_OK);
  ASSERT_EQ(cumulet_restore_accumulation(v_, kept.data(), size), CUMULET_OK) << cumulet_last_error(v_);
  make();
  EXPECT_EQ(all_groups(), wanted);
}

}  // namespace
