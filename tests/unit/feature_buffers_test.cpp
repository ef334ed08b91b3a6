// Feature buffers (AOVs without noise): exact for any ray length, and independent of which pass requests them first.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "support/c_viewer.hpp"

namespace {

using namespace cumulet::test;
using cumulet::headless::Backend;
using cumulet::headless::Context;

constexpr std::uint32_t side = 8;
constexpr std::size_t count = std::size_t{side} * side;

// Voxels of 0.5 and 1.5 in turn along z, down from z = 0.
VolumeRef make_column(int length) {
  constexpr int width = 8;
  std::vector<float> values;
  for (int z = 0; z < length; ++z) values.insert(values.end(), std::size_t{width} * width, z % 2 == 0 ? 0.5F : 1.5F);
  auto desc = make_desc<cumulet_dense_desc>();
  desc.values = values.data();
  desc.value_count = values.size();
  desc.size[0] = desc.size[1] = width;
  desc.size[2] = length;
  for (int i = 0; i < 4; ++i) desc.index_to_world[i * 5] = 1.0;
  desc.index_to_world[12] = desc.index_to_world[13] = 0.5 - 0.5 * width;
  desc.index_to_world[14] = 0.5 - length;
  return make_dense(desc);
}

// Looks down z at the origin, one pixel per unit.
class FeatureBuffers : public CViewerTest {
 protected:
  FeatureBuffers() : CViewerTest(side, side) {}
  void SetUp() override {
    CViewerTest::SetUp();
    if (IsSkipped()) return;
    auto stand = make_desc<cumulet_camera_desc>();
    stand.eye[2] = 5.0;
    stand.orthographic_height = side;
    look(v_, stand);
  }
};
CUMULET_ON_BACKENDS(FeatureBuffers);

// llvmpipe silently ends the loops of a shader after 65,535 iterations in total.
TEST_P(FeatureBuffers, RaysThroughThousandsOfVoxelsAreComplete) {
  constexpr int length = 1024;
  constexpr double depth = 1.5;
  const VolumeRef column = make_column(length);
  ASSERT_EQ(cumulet_set_volume(v_, column.get()), CUMULET_OK);
  auto medium = make_desc<cumulet_medium_desc>();
  medium.density_scale = depth / length;
  ASSERT_EQ(cumulet_set_medium(v_, &medium), CUMULET_OK);
  auto light = make_desc<cumulet_sun_sky_desc>();
  light.sun_elevation_degrees = -1.0F;
  light.sun_azimuth_degrees = 0.0F;
  ASSERT_EQ(cumulet_set_sun_sky(v_, &light), CUMULET_OK);
  for (const cumulet_grid_type march : {CUMULET_GRID_DENSE, CUMULET_GRID_BRICKS, CUMULET_GRID_TETRAHEDRAL}) {
    SCOPED_TRACE(march);
    auto grid = make_desc<cumulet_grid_desc>();
    grid.type = march;
    grid.threshold = 1e-6F;
    grid.interpolation = CUMULET_INTERPOLATION_NEAREST;
    ASSERT_EQ(cumulet_set_grid(v_, &grid), CUMULET_OK);
    make();
    for (const float transmittance : aov(CUMULET_AOV_TRANSMITTANCE, 1))
      ASSERT_NEAR(transmittance, std::exp(-depth), 1e-4);
    std::vector<float> mattes(count * 2);
    const auto name = [](void*, cumulet_object_kind, std::uint64_t, std::uint32_t) -> const char* { return "column"; };
    ASSERT_EQ(cumulet_read_cryptomatte(v_, name, nullptr, 1, mattes.data(), mattes.size()), CUMULET_OK);
    for (std::size_t i = 0; i < count; ++i) ASSERT_NEAR(mattes[2 * i + 1], 1.0 - std::exp(-depth), 1e-4);
  }
}

// The velocity AOV is computed once. The denoiser requests more feature rays before and after.
TEST_P(FeatureBuffers, MotionIsTheSameWithDenoiserFeatures) {
  const VolumeRef ball = make_ball(8);
  ASSERT_EQ(cumulet_set_volume(v_, ball.get()), CUMULET_OK);
  auto sampling = make_desc<cumulet_sampling_desc>();
  sampling.samples = 40;
  sampling.preview = CUMULET_PREVIEW_OFF;
  ASSERT_EQ(cumulet_set_sampling(v_, &sampling), CUMULET_OK);
  make();
  const std::vector<float> first = aov(CUMULET_AOV_VELOCITY, 3);
  const std::vector<float> seen = aov(CUMULET_AOV_TRANSMITTANCE, 1);
  const auto denoise = make_desc<cumulet_denoise_desc>();
  std::vector<float> rgba(count * 4);
  for (const bool viewport : {false, true}) {
    SCOPED_TRACE(viewport);
    auto display = make_desc<cumulet_display_desc>();
    display.denoise = viewport ? CUMULET_DENOISE_FAST : CUMULET_DENOISE_OFF;
    ASSERT_EQ(cumulet_set_display(v_, &display), CUMULET_OK);
    sampling.seed = viewport ? 1 : 0;
    sampling.samples = 2;
    ASSERT_EQ(cumulet_set_sampling(v_, &sampling), CUMULET_OK);
    make();
    EXPECT_EQ(aov(CUMULET_AOV_VELOCITY, 3), first);
    sampling.samples = 40;
    ASSERT_EQ(cumulet_set_sampling(v_, &sampling), CUMULET_OK);
    make();
    ASSERT_EQ(cumulet_read_denoised(v_, &denoise, rgba.data(), rgba.size()), CUMULET_OK) << cumulet_last_error(v_);
    EXPECT_EQ(aov(CUMULET_AOV_VELOCITY, 3), first);
    const std::vector<float> since = aov(CUMULET_AOV_TRANSMITTANCE, 1);
    for (std::size_t i = 0; i < count; ++i) EXPECT_NEAR(since[i], seen[i], 0.05F) << i;
  }
}

// The filter takes few feature rays for an image of few samples. An AOV that is read afterwards has all its rays.
TEST_P(FeatureBuffers, AnAovIsTheSameAfterDenoisingFewSamples) {
  const VolumeRef ball = make_ball(8);
  ASSERT_EQ(cumulet_set_volume(v_, ball.get()), CUMULET_OK);
  auto sampling = make_desc<cumulet_sampling_desc>();
  sampling.samples = 1;
  sampling.preview = CUMULET_PREVIEW_OFF;
  const auto start_image = [&](std::uint32_t seed) {
    sampling.seed = seed;
    ASSERT_EQ(cumulet_set_sampling(v_, &sampling), CUMULET_OK);
    make();
  };
  start_image(0);
  const std::vector<float> first = aov(CUMULET_AOV_TRANSMITTANCE, 1);
  start_image(1);
  start_image(0);
  const auto denoise = make_desc<cumulet_denoise_desc>();
  std::vector<float> rgba(count * 4);
  ASSERT_EQ(cumulet_read_denoised(v_, &denoise, rgba.data(), rgba.size()), CUMULET_OK) << cumulet_last_error(v_);
  EXPECT_EQ(aov(CUMULET_AOV_TRANSMITTANCE, 1), first);
}

}  // namespace
