// Models and volumes as holdouts.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "support/c_viewer.hpp"

namespace {

using namespace cumulet::test;
using cumulet::headless::Backend;
using cumulet::headless::Context;

constexpr std::uint32_t side = 16;
constexpr std::size_t count = std::size_t{side} * side;

class Holdout : public CViewerTest {
 protected:
  Holdout() : CViewerTest(side, side) {}
  void SetUp() override {
    CViewerTest::SetUp();
    if (IsSkipped()) return;
    ASSERT_EQ(cumulet_set_volume(v_, ball_.get()), CUMULET_OK);
  }

  void samples(std::uint32_t number, std::uint32_t light_groups = 0, bool separate_volume_aov = true) {
    auto sampling = make_desc<cumulet_sampling_desc>();
    sampling.samples = number;
    sampling.preview = CUMULET_PREVIEW_OFF;
    sampling.separate_volume_aov = separate_volume_aov ? 1 : 0;
    sampling.light_groups = light_groups;
    ASSERT_EQ(cumulet_set_sampling(v_, &sampling), CUMULET_OK);
  }
  void hold_out_surfaces(bool holdout) {
    auto settings = make_desc<cumulet_surface_settings_desc>();
    settings.holdout = holdout ? 1 : 0;
    ASSERT_EQ(cumulet_set_surface_settings(v_, &settings), CUMULET_OK);
  }
  void set_medium(double density_scale, bool holdout, float emission = 0.0F) {
    auto medium = make_desc<cumulet_medium_desc>();
    medium.density_scale = density_scale;
    medium.holdout = holdout ? 1 : 0;
    for (float& value : medium.emission) value = emission;
    ASSERT_EQ(cumulet_set_medium(v_, &medium), CUMULET_OK);
  }

  VolumeRef ball_ = make_ball(16, 1.0F);
};
CUMULET_ON_BACKENDS(Holdout);

// A wall across z = 0, through the ball and larger than the view.
SurfacesRef make_wall(float emission) {
  constexpr float far = 400.0F;
  const std::array<float, 18> corners{-far, -far, 0, far, -far, 0, far,  far, 0,
                                      -far, -far, 0, far, far,  0, -far, far, 0};
  auto mesh = make_desc<cumulet_mesh_desc>();
  mesh.positions = corners.data();
  mesh.vertex_count = 6;
  mesh.double_sided = 1;
  mesh.emission[0] = emission;
  return make_surfaces({&mesh, 1});
}

// A holdout wall leaves the part of the volume in front of it, equal sample by sample.
TEST_P(Holdout, WallShowsOnlyTheVolumeInFrontOfIt) {
  const SurfacesRef wall = make_wall(3.0F);
  ASSERT_EQ(cumulet_set_surfaces(v_, wall.get()), CUMULET_OK);
  set_medium(0.2, false);
  samples(16);
  make();
  const std::vector<float> alone = aov(CUMULET_AOV_VOLUME, 4);
  const std::vector<float> whole = linear();
  hold_out_surfaces(true);
  make();
  EXPECT_EQ(aov(CUMULET_AOV_BEAUTY, 4), alone);
  EXPECT_EQ(linear(), alone) << "no background behind it";
  double red = 0.0;
  double alpha = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    red += double(alone[4 * i]);
    alpha += double(alone[4 * i + 3]) / double(count);
    EXPECT_EQ(whole[4 * i + 3], 1.0F);
  }
  EXPECT_GT(red, 1.0) << "it is lit by the wall still";
  EXPECT_GT(alpha, 0.1);
  EXPECT_LT(alpha, 0.9);
  // As a model the result is the same.
  ASSERT_EQ(cumulet_set_surfaces(v_, nullptr), CUMULET_OK);
  auto desc = make_desc<cumulet_model_desc>();
  desc.surfaces = wall.get();
  desc.holdout = 1;
  cumulet_model* made = nullptr;
  ASSERT_EQ(cumulet_model_create(&desc, &made, nullptr, 0), CUMULET_OK);
  const ModelRef model(made);
  ASSERT_EQ(cumulet_add_model(v_, made), CUMULET_OK);
  make();
  EXPECT_EQ(linear(), alone);
  desc.holdout = 2;
  EXPECT_EQ(cumulet_model_set(made, &desc), CUMULET_ERROR_INVALID_ARGUMENT);
}

// In a thin medium, lights also use equiangular sampling. It must not add the sky behind the holdout.
TEST_P(Holdout, WallHidesSkyAndLights) {
  const SurfacesRef wall = make_wall(0.0F);
  ASSERT_EQ(cumulet_set_surfaces(v_, wall.get()), CUMULET_OK);
  hold_out_surfaces(true);
  set_medium(0.005, false);
  auto light = make_desc<cumulet_sun_sky_desc>();
  for (float& value : light.sky_radiance) value = 1000.0F;
  ASSERT_EQ(cumulet_set_sun_sky(v_, &light), CUMULET_OK);
  samples(64, 0, false);
  const auto mean = [&] {
    make();
    const std::vector<float> rgba = linear();
    double sum = 0.0;
    for (std::size_t i = 0; i < count; ++i) sum += double(rgba[4 * i]) / double(count);
    return sum;
  };
  const double without = mean();
  auto analytic_light = make_desc<cumulet_light_desc>();
  analytic_light.kind = CUMULET_LIGHT_POINT;
  analytic_light.position[2] = 4.0;
  analytic_light.power = 1e-3F;
  ASSERT_EQ(cumulet_set_lights(v_, &analytic_light, 1), CUMULET_OK);
  EXPECT_GT(without, 1.0) << "the medium before it is lit by the sky";
  EXPECT_NEAR(mean() / without, 1.0, 0.2);
}

// The noise-free light that a denoiser subtracts and adds again has no emission of a holdout volume.
TEST_P(Holdout, AnEmissiveVolumeIsDenoisedToBlack) {
  auto light = make_desc<cumulet_sun_sky_desc>();
  for (float& value : light.sun_irradiance) value = 1e-20F;
  for (float& value : light.sky_radiance) value = 0.0F;
  light.sky = CUMULET_SKY_CONSTANT;
  ASSERT_EQ(cumulet_set_sun_sky(v_, &light), CUMULET_OK);
  set_medium(0.2, true, 5.0F);
  samples(8, 0, false);
  make();
  std::vector<float> rgba(count * 4);
  const auto denoise = make_desc<cumulet_denoise_desc>();
  ASSERT_EQ(cumulet_read_denoised(v_, &denoise, rgba.data(), rgba.size()), CUMULET_OK) << cumulet_last_error(v_);
  for (std::size_t i = 0; i < count; ++i) EXPECT_LT(rgba[4 * i], 1e-6F) << i;
}

// Pixels beside the holdout keep its shadow, bit by bit.
TEST_P(Holdout, CastsShadows) {
  const SurfacesRef panes = make_panes(4.0F);
  ASSERT_EQ(cumulet_set_surfaces(v_, panes.get()), CUMULET_OK);
  set_medium(0.3, false);
  samples(8);
  make();
  const std::vector<float> with = linear();
  hold_out_surfaces(true);
  make();
  const std::vector<float> cut = linear();
  std::vector<float> normal(3 * count);
  ASSERT_EQ(cumulet_read_aov(v_, CUMULET_AOV_NORMAL, normal.data(), normal.size()), CUMULET_OK);
  ASSERT_EQ(cumulet_set_surfaces(v_, nullptr), CUMULET_OK);
  make();
  const std::vector<float> without = linear();
  int aside = 0;
  int shaded = 0;
  for (std::size_t i = 0; i < count; ++i) {
    // None of the 16 feature rays hits the panes here. Except for slivers at silhouettes, no sample does either.
    bool near = false;
    for (std::size_t j = 0; j < count; ++j) {
      const bool is_hit = normal[3 * j] != 0.0F || normal[3 * j + 1] != 0.0F || normal[3 * j + 2] != 0.0F;
      const auto apart = [](std::size_t a, std::size_t b) { return a > b ? a - b : b - a; };
      near = near || (is_hit && apart(i % side, j % side) <= 1 && apart(i / side, j / side) <= 1);
    }
    if (near) continue;
    ++aside;
    for (std::size_t c = 0; c < 4; ++c) EXPECT_EQ(cut[4 * i + c], with[4 * i + c]) << i;
    if (cut[4 * i] != without[4 * i]) ++shaded;
  }
  EXPECT_GT(aside, 20);
  EXPECT_GT(shaded, 2) << "they do shade it";
}

// Only the background remains, attenuated by the medium.
TEST_P(Holdout, VolumeAttenuatesTheBackground) {
  std::vector<float> clear(count);
  auto light = make_desc<cumulet_sun_sky_desc>();
  for (float& value : light.sky_radiance) value = 1.0F;
  ASSERT_EQ(cumulet_set_sun_sky(v_, &light), CUMULET_OK);
  for (const float emission : {0.0F, 2.0F}) {
    set_medium(0.15, true, emission);
    samples(512);
    make();
    const std::vector<float> made = linear();
    ASSERT_EQ(cumulet_read_aov(v_, CUMULET_AOV_TRANSMITTANCE, clear.data(), clear.size()), CUMULET_OK);
    for (std::size_t i = 0; i < count; ++i) {
      EXPECT_EQ(made[4 * i + 3], 0.0F) << i;
      const double t = double(clear[i]);
      EXPECT_NEAR(double(made[4 * i]), t, 5.0 * std::sqrt(t * (1.0 - t) / 512.0) + 0.01) << i;
    }
  }
}

// A holdout volume keeps the volume in front of it and hides the one behind it.
TEST_P(Holdout, WorksForOneVolumeAmongOthers) {
  auto medium = make_desc<cumulet_medium_desc>();
  medium.density_scale = 0.2;
  auto desc = make_desc<cumulet_instance_desc>();
  desc.volume = ball_.get();
  desc.medium = &medium;
  const InstanceRef other = cumulet::test::make_instance(desc);
  cumulet_instance* const made = other.get();
  ASSERT_EQ(cumulet_add_instance(v_, made), CUMULET_OK);
  samples(8);
  const auto put = [&](double z) {
    const auto transform = at(0.0, 0.0, z);
    ASSERT_EQ(cumulet_instance_set_to_world(made, transform.data()), CUMULET_OK);
  };
  // If opaque, it hides the volume behind it completely. Light from that volume reaches nothing visible.
  set_medium(1e4, true);
  put(-40.0);
  make();
  const std::vector<float> behind = linear();
  put(18.0);
  make();
  const std::vector<float> before = linear();
  std::vector<float> clear(count);
  ASSERT_EQ(cumulet_read_aov(v_, CUMULET_AOV_TRANSMITTANCE, clear.data(), clear.size()), CUMULET_OK);
  const std::size_t middle = count / 2 + side / 2;
  for (int c = 0; c < 4; ++c) EXPECT_EQ(behind[4 * middle + static_cast<std::size_t>(c)], 0.0F);
  EXPECT_LT(clear[middle], 1e-10F);
  EXPECT_GT(before[4 * middle + 3], 0.3F);
  EXPECT_LT(before[4 * middle + 3], 1.0F);
  EXPECT_GT(before[4 * middle], 0.05F);
}

TEST_P(Holdout, HasNoRadianceInAnyLightGroup) {
  const SurfacesRef panes = make_panes(4.0F);
  ASSERT_EQ(cumulet_set_surfaces(v_, panes.get()), CUMULET_OK);
  hold_out_surfaces(true);
  set_medium(0.2, true);
  samples(8, 2);
  make();
  const std::vector<float> made = linear();
  std::array<std::vector<float>, 2> groups;
  for (std::uint32_t i = 0; i < 2; ++i) {
    groups.at(i).resize(3 * count);
    ASSERT_EQ(cumulet_read_light_group(v_, i, groups.at(i).data(), 3 * count), CUMULET_OK);
  }
  for (std::size_t i = 0; i < 3 * count; ++i)
    ASSERT_NEAR(groups[0][i] + groups[1][i], made[i / 3 * 4 + i % 3], 1e-5F) << i;
}

}  // namespace
