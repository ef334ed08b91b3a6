// Denoised images of a viewer, through the C API.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <string>
#include <vector>

#include "support/c_host.hpp"
#include "support/denoised_images.hpp"
#include "support/folder.hpp"
#include "support/gltf_model.hpp"
#include "support/tza.hpp"

namespace {

using cumulet::test::DenoisedImage;
using cumulet::test::distance;
using cumulet::test::floats;
using cumulet::test::make_desc;
using cumulet::test::side;

TEST_F(DenoisedImage, IsDeterministicAndKeepsTheRawImage) {
  const std::vector<float> raw = picture();
  std::vector<float> first(floats);
  ASSERT_EQ(denoise(file_, first), CUMULET_OK) << error();
  std::vector<float> second(floats);
  ASSERT_EQ(denoise(file_, second), CUMULET_OK) << error();
  EXPECT_EQ(first, second);
  EXPECT_EQ(linear(), raw);
  EXPECT_NE(first, raw);
  for (std::size_t i = 0; i < floats; ++i) {
    EXPECT_TRUE(std::isfinite(first[i]) && first[i] >= 0.0F) << i;
    EXPECT_TRUE(i % 4 != 3 || first[i] == raw[i]) << i;
  }
  EXPECT_EQ(gl_.GetError(), GLenum{GL_NO_ERROR});
}

TEST_F(DenoisedImage, InvalidRequestsGiveAOneLineError) {
  std::vector<float> rgba(floats);
  EXPECT_EQ(denoise(file_, rgba), CUMULET_ERROR_INVALID_ARGUMENT);  // nothing was rendered yet
  static_cast<void>(picture());
  const std::string missing = (folder_ / "none.tza").string();
  EXPECT_EQ(denoise(missing, rgba), CUMULET_ERROR_FILE);
  EXPECT_EQ(error(), missing + ": No such file or directory");
  EXPECT_EQ(denoise("", rgba), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(cumulet_read_denoised(viewer_.get(), nullptr, rgba.data(), rgba.size()), CUMULET_ERROR_INVALID_ARGUMENT);
  std::vector<float> short_one(floats - 1);
  EXPECT_EQ(denoise(file_, short_one), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(error(), "the image needs 6400 floats");
  std::ofstream(file_, std::ios::binary) << "none";
  const std::string other = (folder_ / "other.tza").string();
  std::filesystem::rename(file_, other);
  EXPECT_EQ(denoise(other, rgba), CUMULET_ERROR_FILE);
  EXPECT_EQ(error(), other + ": is not a tensor archive (.tza) of Open Image Denoise");
}

// Measured: the error of the noisy image is 14 times that of the filtered one, relative to 1024 samples.
TEST_F(DenoisedImage, FilterNeedsNoNetwork) {
  const std::vector<float> few = picture();
  const auto desc = make_desc<cumulet_denoise_desc>();
  std::vector<float> filtered(floats);
  ASSERT_EQ(cumulet_read_denoised(viewer_.get(), &desc, filtered.data(), filtered.size()), CUMULET_OK) << error();
  EXPECT_EQ(linear(), few);
  sample(1024);
  const std::vector<float> many = picture();
  EXPECT_LT(distance(filtered, many), 0.2 * distance(few, many));
  EXPECT_EQ(gl_.GetError(), GLenum{GL_NO_ERROR});
}

TEST_F(DenoisedImage, DisplayIsFilteredAndRawReadBackIsNot) {
  const std::vector<std::uint8_t> raw = cumulet::test::picture_of(viewer_.get(), volume_.get(), target_);
  const std::vector<float> values = linear();
  auto display = make_desc<cumulet_display_desc>();
  display.denoise = CUMULET_DENOISE_FAST;
  ASSERT_EQ(cumulet_set_display(viewer_.get(), &display), CUMULET_OK);
  auto frame = target_.frame();
  const auto is_denoised = [&] {
    return (cumulet::test::converge(viewer_.get(), frame).flags & CUMULET_RENDER_DENOISED) != 0;
  };
  EXPECT_TRUE(is_denoised());
  const std::vector<std::uint8_t> filtered = target_.pixels();
  EXPECT_NE(filtered, raw);
  EXPECT_EQ(linear(), values);
  // Equal to the image read back, except for the number of feature rays.
  EXPECT_LT(off_by(shown(), filtered), 4.0);
  display.denoise = CUMULET_DENOISE_OFF;
  ASSERT_EQ(cumulet_set_display(viewer_.get(), &display), CUMULET_OK);
  EXPECT_FALSE(is_denoised());
  EXPECT_EQ(target_.pixels(), raw);
}

// With more samples, the displayed image uses as many feature rays as the one read back.
TEST_F(DenoisedImage, DisplayMatchesReadBackWithManySamples) {
  auto display = make_desc<cumulet_display_desc>();
  display.denoise = CUMULET_DENOISE_FAST;
  ASSERT_EQ(cumulet_set_display(viewer_.get(), &display), CUMULET_OK);
  sample(64);
  const std::vector<std::uint8_t> drawn = cumulet::test::picture_of(viewer_.get(), volume_.get(), target_);
  EXPECT_EQ(off_by(drawn, shown()), 0.0);
}

// Hosts may filter in frames with CUMULET_TARGET_NONE and draw the result in frames without a budget.
TEST_F(DenoisedImage, FramesWithoutATargetFilterToo) {
  const std::vector<std::uint8_t> raw = cumulet::test::picture_of(viewer_.get(), volume_.get(), target_);
  auto display = make_desc<cumulet_display_desc>();
  display.denoise = CUMULET_DENOISE_FAST;
  ASSERT_EQ(cumulet_set_display(viewer_.get(), &display), CUMULET_OK);
  auto undrawn = target_.frame();
  undrawn.target = CUMULET_TARGET_NONE;
  const auto is_news = [&] {
    auto result = make_desc<cumulet_frame_result>();
    EXPECT_EQ(cumulet_render(viewer_.get(), &undrawn, &result), CUMULET_OK) << error();
    return (result.flags & CUMULET_RENDER_NEW_IMAGE) != 0;
  };
  cumulet::test::converge(viewer_.get(), undrawn);
  EXPECT_TRUE(is_news());
  auto drawn = target_.frame();
  drawn.budget_ms = -1.0;
  auto result = make_desc<cumulet_frame_result>();
  ASSERT_EQ(cumulet_render(viewer_.get(), &drawn, &result), CUMULET_OK) << error();
  EXPECT_NE(result.flags & CUMULET_RENDER_DENOISED, 0U);
  const std::vector<std::uint8_t> filtered = target_.pixels();
  EXPECT_NE(filtered, raw);
  EXPECT_FALSE(is_news());
  auto frame = target_.frame();
  cumulet::test::converge(viewer_.get(), frame);
  EXPECT_EQ(target_.pixels(), filtered);
}

// Filtering that began in frames with CUMULET_TARGET_NONE is abandoned there when it is switched off.
TEST_F(DenoisedImage, SwitchingOffWithoutATargetLeavesNoPendingWork) {
  cumulet::test::picture_of(viewer_.get(), volume_.get(), target_);
  const auto bytes = [&] {
    auto stats = make_desc<cumulet_stats>();
    EXPECT_EQ(cumulet_get_stats(viewer_.get(), &stats), CUMULET_OK);
    return stats.gl_bytes;
  };
  const auto without = bytes();
  auto display = make_desc<cumulet_display_desc>();
  display.denoise = CUMULET_DENOISE_FAST;
  ASSERT_EQ(cumulet_set_display(viewer_.get(), &display), CUMULET_OK);
  auto frame = target_.frame();
  frame.target = CUMULET_TARGET_NONE;
  frame.budget_ms = 1.0;
  for (int i = 0; i < 1000 && bytes() < without + 112U * side * side; ++i) {
    ASSERT_EQ(cumulet_render(viewer_.get(), &frame, nullptr), CUMULET_OK) << error();
  }
  EXPECT_GE(bytes(), without + 112U * side * side);
  display.denoise = CUMULET_DENOISE_OFF;
  ASSERT_EQ(cumulet_set_display(viewer_.get(), &display), CUMULET_OK);
  auto result = make_desc<cumulet_frame_result>();
  ASSERT_EQ(cumulet_render(viewer_.get(), &frame, &result), CUMULET_OK) << error();
  EXPECT_NE(result.flags & CUMULET_RENDER_CONVERGED, 0U);
  EXPECT_EQ(result.flags & CUMULET_RENDER_INCOMPLETE, 0U);
  EXPECT_LT(bytes(), without + 112U * side * side);
}

TEST_F(DenoisedImage, DebugViewsAreNotDenoised) {
  sample(1, CUMULET_VIEW_CELLS);
  auto display = make_desc<cumulet_display_desc>();
  ASSERT_EQ(cumulet_set_display(viewer_.get(), &display), CUMULET_OK);
  const auto plain = cumulet::test::picture_of(viewer_.get(), volume_.get(), target_);
  display.denoise = CUMULET_DENOISE_FAST;
  ASSERT_EQ(cumulet_set_display(viewer_.get(), &display), CUMULET_OK);
  EXPECT_EQ(cumulet::test::picture_of(viewer_.get(), volume_.get(), target_), plain);
  std::vector<float> rgba(floats);
  EXPECT_EQ(denoise(file_, rgba), CUMULET_ERROR_UNSUPPORTED);
}

// Filtering does not reduce the alpha of the ground plane.
TEST_F(DenoisedImage, GroundKeepsItsAlpha) {
  auto ground = make_desc<cumulet_ground_desc>();
  ground.mode = CUMULET_GROUND_AT_HEIGHT;
  ground.height = -14.0;
  std::ranges::fill(ground.albedo, 0.3F);
  ASSERT_EQ(cumulet_set_ground(viewer_.get(), &ground), CUMULET_OK);
  auto display = make_desc<cumulet_display_desc>();
  display.background = CUMULET_BACKGROUND_TRANSPARENT;
  ASSERT_EQ(cumulet_set_display(viewer_.get(), &display), CUMULET_OK);
  sample(1);
  const std::vector<float> raw = picture();
  const auto desc = make_desc<cumulet_denoise_desc>();
  std::vector<float> filtered(floats);
  ASSERT_EQ(cumulet_read_denoised(viewer_.get(), &desc, filtered.data(), filtered.size()), CUMULET_OK) << error();
  for (std::size_t i = floats - std::size_t{4} * side * 4; i < floats; i += 4) {
    ASSERT_EQ(raw[i + 3], 1.0F) << i;
    EXPECT_NEAR(filtered[i + 3], 1.0F, 1e-4F) << i;
  }
}

// The sun at the zenith above a floor, and a lath between whose shadow is three pixels wide.
class NoiseFreeLight : public DenoisedImage {
 protected:
  static cumulet::test::SurfacesRef level(float half, float y) {
    auto card = make_desc<cumulet_mesh_desc>();
    std::fill_n(card.base_color, 4, 1.0F);
    std::fill_n(card.base_color, 3, 0.5F);
    return cumulet::test::make_quad({-half, y, -40.0F, -half, y, 40.0F, half, y, 40.0F, half, y, -40.0F}, card);
  }

  void shine(float sky) const {
    auto light = make_desc<cumulet_sun_sky_desc>();
    light.sun_elevation_degrees = 90.0F;
    std::ranges::fill(light.sun_irradiance, 3.0F);
    std::ranges::fill(light.sky_radiance, sky);
    ASSERT_EQ(cumulet_set_sun_sky(viewer_.get(), &light), CUMULET_OK);
  }

  // Renders one sample per pixel. floor, lath: settings of the two.
  void render(cumulet_surface_settings_desc floor = make_desc<cumulet_surface_settings_desc>(),
              cumulet_model_desc lath = make_desc<cumulet_model_desc>()) const {
    ASSERT_NO_FATAL_FAILURE(shine(0.3F));
    const cumulet::test::SurfacesRef ground = level(40.0F, 0.0F);
    ASSERT_EQ(cumulet_set_surfaces(viewer_.get(), ground.get()), CUMULET_OK);
    ASSERT_EQ(cumulet_set_surface_settings(viewer_.get(), &floor), CUMULET_OK);
    const cumulet::test::SurfacesRef above = level(0.4F, 8.0F);
    if (lath.surfaces == nullptr) lath.surfaces = above.get();
    cumulet_model* model = nullptr;
    ASSERT_EQ(cumulet_model_create(&lath, &model, nullptr, 0), CUMULET_OK);
    EXPECT_EQ(cumulet_add_model(viewer_.get(), model), CUMULET_OK);
    cumulet_model_release(model);
    cumulet_camera* camera = nullptr;
    ASSERT_EQ(cumulet_get_camera(viewer_.get(), &camera), CUMULET_OK);
    const cumulet::test::CameraRef owner(camera);
    auto stand = make_desc<cumulet_camera_desc>();
    stand.eye[1] = height;
    stand.eye[2] = away;
    stand.fovy_degrees = fovy;
    ASSERT_EQ(cumulet_camera_set(camera, &stand), CUMULET_OK);
    sample(1);
    auto frame = target_.frame();
    frame.budget_ms = 1000.0;
    cumulet::test::converge(viewer_.get(), frame);
  }

  // The noise-free component: a network that outputs 0 leaves only that.
  [[nodiscard]] std::vector<float> known() const {
    write_network(cumulet::test::dark_archive(cumulet::test::small_widths, 9));
    std::vector<float> rgba(floats);
    EXPECT_EQ(denoise(file_, rgba), CUMULET_OK) << error();
    return rgba;
  }

  // Radiance of the floor lit by the sun: irradiance 3, albedo 0.5. The specular part (at least 0.04) is not in the
  // noise-free component.
  static constexpr double sunlit = 0.96 * 3.0 * 0.5 / std::numbers::pi;
  static void expect_known(const std::vector<float>& rgba, double lit) {
    int wrong = 0;
    const int near_edge = for_each_near_shadow(
        rgba, [&](float value, bool shadowed) { wrong += std::abs(value - (shadowed ? 0.0 : lit)) > 0.015 ? 1 : 0; });
    EXPECT_GT(near_edge, 100);
    EXPECT_LT(wrong, near_edge / 50);
  }

  // Calls visit(red, shadowed) for floor pixels near the shadow, except at its edges. Returns their number.
  template <class Visit>
  static int for_each_near_shadow(const std::vector<float>& picture, Visit&& visit) {
    const double length = std::hypot(height, away);
    const double half = std::tan(fovy * std::numbers::pi / 360.0);
    int count = 0;
    for (int row = 0; row < side; ++row) {
      for (int column = 0; column < side; ++column) {
        const double right = half * (2.0 * (column + 0.5) / side - 1.0);
        const double up = half * (1.0 - 2.0 * (row + 0.5) / side);
        const double down = (height - up * away) / length;
        if (down <= 0.1) continue;
        const double inside = 0.4 - std::abs(height / down * right);
        if (std::abs(inside) < 0.2 || inside < -1.2) continue;
        visit(picture[4 * static_cast<std::size_t>(row * side + column)], inside > 0.0);
        ++count;
      }
    }
    return count;
  }

  static constexpr double height = 6.0;  // of the eye; `away` is its horizontal distance from the center
  static constexpr double away = 14.0;
  static constexpr double fovy = 40.0;
};

TEST_F(NoiseFreeLight, SunShadowsStaySharp) {
  ASSERT_NO_FATAL_FAILURE(render());
  const auto desc = make_desc<cumulet_denoise_desc>();
  std::vector<float> filtered(floats);
  ASSERT_EQ(cumulet_read_denoised(viewer_.get(), &desc, filtered.data(), filtered.size()), CUMULET_OK) << error();
  int wrong = 0;
  // The sun's part is 0.48, the sky's at most 0.15.
  const int near_edge =
      for_each_near_shadow(filtered, [&](float value, bool shadowed) { wrong += (value > 0.3F) == shadowed ? 1 : 0; });
  EXPECT_GT(near_edge, 100);
  EXPECT_LT(wrong, near_edge / 50);
}

TEST_F(NoiseFreeLight, ZeroNetworkKeepsTheNoiseFreeLight) {
  ASSERT_NO_FATAL_FAILURE(render());
  expect_known(known(), sunlit);
}

TEST_F(NoiseFreeLight, ShadowOnlyModelsCastNoiseFreeShadows) {
  auto lath = make_desc<cumulet_model_desc>();
  lath.shadow_only = 1;
  ASSERT_NO_FATAL_FAILURE(render(make_desc<cumulet_surface_settings_desc>(), lath));
  expect_known(known(), sunlit);
}

TEST_F(NoiseFreeLight, HoldoutsHaveNoNoiseFreeLight) {
  auto floor = make_desc<cumulet_surface_settings_desc>();
  floor.holdout = 1;
  ASSERT_NO_FATAL_FAILURE(render(floor));
  expect_known(known(), 0.0);
}

// Sunlight may pass through glass on refracted paths.
TEST_F(NoiseFreeLight, NoNoiseFreeSunlightWithGlass) {
  cumulet::test::GltfModel model;
  model.root["extensionsUsed"] = {"KHR_materials_transmission"};
  model.add("materials", {{"extensions", {{"KHR_materials_transmission", {{"transmissionFactor", 1.0}}}}}});
  const int corners = model.vec3({-0.4F, 8.0F, -40.0F, -0.4F, 8.0F, 40.0F, 0.4F, 8.0F, 40.0F});
  model.show({{"attributes", {{"POSITION", corners}}}, {"material", 0}});
  const cumulet::test::SurfacesRef glass = cumulet::test::read_surfaces(model.gltf());
  auto lath = make_desc<cumulet_model_desc>();
  lath.surfaces = glass.get();
  ASSERT_NO_FATAL_FAILURE(render(make_desc<cumulet_surface_settings_desc>(), lath));
  expect_known(known(), 0.0);
}

// At edges, samples are brighter or darker than the noise-free component.
TEST_F(NoiseFreeLight, IdentityNetworkKeepsTheImage) {
  ASSERT_NO_FATAL_FAILURE(render());
  write_network(cumulet::test::clear_archive(cumulet::test::small_widths, 9));
  const std::vector<float> raw = linear();
  std::vector<float> denoised(floats);
  ASSERT_EQ(denoise(file_, denoised), CUMULET_OK) << error();
  for (std::size_t i = 0; i < floats; ++i) EXPECT_NEAR(denoised[i], raw[i], 0.01 * raw[i] + 1e-3) << i;
}

// A shadow across a medium of large penetration depth. Measured: 0.19, and 0.27 if each ray tests the sun only at its
// mean scattering position.
TEST_F(NoiseFreeLight, MediumSoftensShadows) {
  ASSERT_NO_FATAL_FAILURE(shine(1e-3F));
  const cumulet::test::SurfacesRef roof = level(3.0F, 40.0F);
  ASSERT_EQ(cumulet_set_surfaces(viewer_.get(), roof.get()), CUMULET_OK);
  auto medium = make_desc<cumulet_medium_desc>();
  medium.density_scale = 0.6;
  ASSERT_EQ(cumulet_set_medium(viewer_.get(), &medium), CUMULET_OK);
  sample(1);
  static_cast<void>(picture());
  const auto desc = make_desc<cumulet_denoise_desc>();
  std::vector<float> filtered(floats);
  ASSERT_EQ(cumulet_read_denoised(viewer_.get(), &desc, filtered.data(), filtered.size()), CUMULET_OK) << error();
  sample(1024);
  const std::vector<float> many = picture();
  double square = 0.0;
  double all = 0.0;
  for (std::size_t i = 0; i < floats; i += 4) {
    square += std::pow(double(filtered[i]) - double(many[i]), 2.0);
    all += std::pow(double(many[i]), 2.0);
  }
  EXPECT_LT(std::sqrt(square / all), 0.23);
}

// ---- Frames of a camera that moves ----

TEST_F(DenoisedImage, LinearValuesUseTheDisplayEncoding) {
  const std::vector<float> raw = picture();
  std::vector<std::uint8_t> displayed(floats);
  std::vector<std::uint8_t> encoded(floats);
  EXPECT_EQ(cumulet_read_display(viewer_.get(), displayed.data(), displayed.size()), CUMULET_OK);
  EXPECT_EQ(cumulet_encode_display(viewer_.get(), raw.data(), encoded.data(), encoded.size()), CUMULET_OK);
  EXPECT_EQ(encoded, displayed);
  EXPECT_EQ(cumulet_encode_display(viewer_.get(), raw.data(), encoded.data(), 6), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(cumulet_encode_display(viewer_.get(), nullptr, encoded.data(), 4), CUMULET_ERROR_INVALID_ARGUMENT);
}

TEST_F(DenoisedImage, PublishedNetworkReducesTheError) {
  const std::string published = CUMULET_SHARED_DATA "/oidn_weights/rt_hdr_calb_cnrm.tza";
  if (!std::filesystem::exists(published)) GTEST_SKIP() << "no " << published;
  const std::vector<float> few = picture();
  std::vector<float> denoised(floats);
  ASSERT_EQ(denoise(published, denoised), CUMULET_OK) << error();
  sample(256);
  const std::vector<float> many = picture();
  EXPECT_LT(distance(denoised, many), 0.25 * distance(few, many));
}

}  // namespace
