// Temporal denoising: displayed images use earlier ones, images that are read back do not.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "support/c_host.hpp"
#include "support/denoised_images.hpp"
#include "support/gltf_model.hpp"
#include "support/tza.hpp"

namespace {

using cumulet::test::DenoisedImage;
using cumulet::test::floats;
using cumulet::test::HostTarget;
using cumulet::test::make_desc;
using cumulet::test::side;

// Relative squared error of colors.
double relative_error(const std::vector<float>& values, const std::vector<float>& truth) {
  double sum = 0.0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double r = truth[i];
    if (i % 4 != 3) sum += std::pow(values[i] - r, 2.0) / (r * r + 0.01);
  }
  return sum / (0.75 * static_cast<double>(values.size()));
}

std::vector<float> apart(const std::vector<float>& a, const std::vector<float>& b) {
  std::vector<float> difference;
  for (std::size_t i = 0; i < a.size(); ++i) difference.push_back(a[i] - b[i]);
  return difference;
}

class TemporalDenoising : public DenoisedImage {
 protected:
  TemporalDenoising() {
    // A card that is partly inside the cloud.
    surfaces_ =
        cumulet::test::make_quad({-4.0F, -9.0F, 3.0F, 13.0F, -9.0F, 3.0F, 13.0F, 2.0F, 6.0F, -4.0F, 2.0F, 6.0F});
    EXPECT_EQ(cumulet_set_volume(viewer_.get(), volume_.get()), CUMULET_OK);
    EXPECT_EQ(cumulet_set_surfaces(viewer_.get(), surfaces_.get()), CUMULET_OK);
  }

  // Temporal history needs previews.
  void sample(std::uint32_t samples) const {
    DenoisedImage::sample(samples, CUMULET_VIEW_SHADED, CUMULET_PREVIEW_AUTO);
  }
  void look_from(int step) const {
    const double angle = 0.03 * step;
    auto stand = make_desc<cumulet_camera_desc>();
    stand.eye[0] = 34.0 * std::sin(angle);
    stand.eye[1] = 6.0;
    stand.eye[2] = 34.0 * std::cos(angle);
    cumulet_camera* camera = nullptr;
    ASSERT_EQ(cumulet_get_camera(viewer_.get(), &camera), CUMULET_OK);
    const cumulet::test::CameraRef owner(camera);
    ASSERT_EQ(cumulet_camera_set(camera, &stand), CUMULET_OK);
  }
  void filter(bool on) const {
    auto display = make_desc<cumulet_display_desc>();
    display.denoise = on ? CUMULET_DENOISE_FAST : CUMULET_DENOISE_OFF;
    ASSERT_EQ(cumulet_set_display(viewer_.get(), &display), CUMULET_OK);
  }
  // The displayed image once it has all its samples.
  [[nodiscard]] std::vector<float> frame() const {
    auto desc = hdr_.frame();
    desc.color = CUMULET_COLOR_HDR;
    desc.budget_ms = 1000.0;  // enough for all samples at once, none of them at reduced resolution
    cumulet::test::converge(viewer_.get(), desc);
    return hdr_.floats();
  }
  // Discards the temporal history.
  void forget() const {
    filter(false);
    auto desc = hdr_.frame();
    desc.budget_ms = -1.0;
    ASSERT_EQ(cumulet_render(viewer_.get(), &desc, nullptr), CUMULET_OK);
    filter(true);
  }
  void turn_sun(float azimuth) const {
    auto light = make_desc<cumulet_sun_sky_desc>();
    light.sun_elevation_degrees = 40.0F;
    light.sun_azimuth_degrees = azimuth;
    std::ranges::fill(light.sun_irradiance, 3.0F);
    std::ranges::fill(light.sky_radiance, 0.3F);
    ASSERT_EQ(cumulet_set_sun_sky(viewer_.get(), &light), CUMULET_OK);
  }

  HostTarget hdr_{gl_, side, side, GL_RGBA32F};
  cumulet::test::SurfacesRef surfaces_;
};

// Measured: error with history 0.0075, without 0.0174; flicker 0.205 and 0.498.
TEST_F(TemporalDenoising, HistoryReducesErrorAndFlicker) {
  constexpr int frames = 8;
  std::vector<std::vector<float>> truth;
  sample(192);
  for (int i = 0; i < frames; ++i) {
    look_from(i);
    truth.push_back(frame());
  }
  sample(1);
  std::array<double, 2> error{};
  std::array<double, 2> flicker{};
  const std::vector<float> none(truth[0].size());
  for (const bool follows : {false, true}) {
    filter(true);
    std::vector<float> last;
    for (int i = 0; i < frames; ++i) {
      if (!follows || i == 0) forget();
      look_from(i);
      const std::vector<float> now = frame();
      const std::vector<float> off = apart(now, truth[static_cast<std::size_t>(i)]);
      if (i >= frames / 2) {
        error.at(follows ? 1 : 0) += relative_error(now, truth[static_cast<std::size_t>(i)]);
        flicker.at(follows ? 1 : 0) += relative_error(apart(off, last), none);
      }
      last = off;
    }
  }
  RecordProperty("error_alone", std::to_string(error[0]));
  RecordProperty("error_followed", std::to_string(error[1]));
  RecordProperty("flicker_alone", std::to_string(flicker[0]));
  RecordProperty("flicker_followed", std::to_string(flicker[1]));
  EXPECT_LT(error[1], 0.8 * error[0]);
  EXPECT_LT(flicker[1], 0.8 * flicker[0]);
}

TEST_F(TemporalDenoising, ChangedLightResetsTheHistory) {
  sample(2);
  filter(true);
  for (int i = 0; i < 4; ++i) {
    look_from(i);
    static_cast<void>(frame());
  }
  const std::vector<float> before = frame();
  turn_sun(150.0F);
  const std::vector<float> after = frame();
  EXPECT_NE(after, before);
  forget();
  EXPECT_EQ(frame(), after);
}

TEST_F(TemporalDenoising, ReadBackDoesNotDependOnTheHistory) {
  sample(2);
  filter(true);
  const auto read = [this] {
    const auto desc = make_desc<cumulet_denoise_desc>();
    std::vector<float> denoised(floats);
    EXPECT_EQ(cumulet_read_denoised(viewer_.get(), &desc, denoised.data(), denoised.size()), CUMULET_OK) << error();
    return std::pair(linear(), denoised);
  };
  for (int i = 0; i < 4; ++i) {
    look_from(i);
    static_cast<void>(frame());
  }
  const std::vector<float> shown = frame();
  const auto moved = read();
  look_from(1);
  static_cast<void>(frame());
  forget();
  look_from(3);
  EXPECT_NE(frame(), shown);
  EXPECT_EQ(read(), moved);
}

// With enough samples, the history has no weight.
TEST_F(TemporalDenoising, ImageAtRestDoesNotDependOnTheHistory) {
  filter(true);
  sample(1);
  for (int i = 0; i < 4; ++i) {
    look_from(i);
    static_cast<void>(frame());
  }
  sample(64);
  const std::vector<float> rested = frame();
  forget();
  EXPECT_EQ(frame(), rested);
}

}  // namespace
