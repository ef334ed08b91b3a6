// Denoised frames of a horizon under a camera that moves. Pixels at the horizon are partly ground and partly sky.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

#include "support/c_host.hpp"

namespace {

using cumulet::headless::Backend;
using cumulet::headless::Context;
using cumulet::test::HostTarget;
using cumulet::test::make_ball;
using cumulet::test::make_desc;
using cumulet::test::ViewerPtr;
using cumulet::test::VolumeRef;

constexpr int width = 64;
constexpr int height = 40;

class DenoisedHorizon : public testing::Test {
 protected:
  DenoisedHorizon() {
    auto light = make_desc<cumulet_sun_sky_desc>();
    light.sun_elevation_degrees = 40.0F;
    std::ranges::fill(light.sun_irradiance, 4.0F);
    std::ranges::fill(light.sky_radiance, 0.3F);
    EXPECT_EQ(cumulet_set_sun_sky(viewer_.get(), &light), CUMULET_OK);
    auto ground = make_desc<cumulet_ground_desc>();
    ground.mode = CUMULET_GROUND_AT_HEIGHT;
    ground.height = -12.0;
    std::ranges::fill(ground.albedo, 0.3F);
    EXPECT_EQ(cumulet_set_ground(viewer_.get(), &ground), CUMULET_OK);
    EXPECT_EQ(cumulet_set_volume(viewer_.get(), volume_.get()), CUMULET_OK);
    auto sampling = make_desc<cumulet_sampling_desc>();
    sampling.samples = 1;
    EXPECT_EQ(cumulet_set_sampling(viewer_.get(), &sampling), CUMULET_OK);
    auto display = make_desc<cumulet_display_desc>();
    display.denoise = CUMULET_DENOISE_FAST;
    EXPECT_EQ(cumulet_set_display(viewer_.get(), &display), CUMULET_OK);
  }

  // Away from the volume. pitch: of the view, in pixels.
  void look(double pitch) const {
    auto stand = make_desc<cumulet_camera_desc>();
    stand.eye[1] = 6.0;
    stand.eye[2] = 34.0;
    stand.target[2] = 134.0;
    stand.fovy_degrees = 40.0;
    const double pixel = 2.0 * std::tan(20.0 * std::numbers::pi / 180.0) / height;
    stand.target[1] = stand.eye[1] + 100.0 * pixel * pitch;
    cumulet_camera* camera = nullptr;
    ASSERT_EQ(cumulet_get_camera(viewer_.get(), &camera), CUMULET_OK);
    const cumulet::test::CameraRef owner(camera);
    ASSERT_EQ(cumulet_camera_set(camera, &stand), CUMULET_OK);
  }
  [[nodiscard]] std::vector<float> frame() const {
    auto desc = hdr_.frame();
    desc.color = CUMULET_COLOR_HDR;
    desc.budget_ms = 1000.0;  // enough for all samples at once, none of them at reduced resolution
    cumulet::test::converge(viewer_.get(), desc);
    return hdr_.floats();
  }

  Context context_ = Context::create(Backend::automatic);
  GladGLContext gl_ = cumulet::test::load_gl(Context::get_proc, &context_);
  HostTarget hdr_{gl_, width, height, GL_RGBA32F};
  VolumeRef volume_ = make_ball(12);
  ViewerPtr viewer_ = cumulet::test::make_viewer({.get_proc = Context::get_proc, .user = &context_});
};

// The sky's radiance is 0.3, and the ground's is 0.29 to 0.34. When radiance was limited without coverage, the horizon
// had 80 pixels of down to 0.13 here.
TEST_F(DenoisedHorizon, HasNoSpots) {
  int spots = 0;
  const auto look_for_spots = [&](double pitch) {
    look(pitch);
    const std::vector<float> pixels = frame();
    for (std::size_t i = 1; i < pixels.size(); i += 4) {
      spots += pixels[i] > 0.24F && pixels[i] < 0.4F ? 0 : 1;
      EXPECT_GT(pixels[i], 0.17F) << pitch << ", pixel " << i / 4;
      EXPECT_LT(pixels[i], 0.5F) << pitch << ", pixel " << i / 4;
    }
  };
  // A steady motion until only the last row has ground, and jumps.
  for (int i = 40; i <= 54; ++i) look_for_spots(0.37 * i);
  for (int i = 1; i <= 12; ++i) look_for_spots(8.0 * std::fmod(0.618034 * i, 1.0));
  EXPECT_LE(spots, 20);
}

}  // namespace
