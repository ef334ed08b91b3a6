#pragma once

// A viewer whose image is denoised.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <string>
#include <vector>

#include "support/c_host.hpp"
#include "support/folder.hpp"
#include "support/gltf_model.hpp"
#include "support/tza.hpp"

namespace cumulet::test {

inline constexpr int side = 40;
inline constexpr std::size_t floats = std::size_t{side} * side * 4;

// Sum of squared color differences.
inline double distance(const std::vector<float>& a, const std::vector<float>& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < floats; ++i) sum += i % 4 == 3 ? 0.0 : std::pow(double(a[i]) - double(b[i]), 2.0);
  return sum;
}

class DenoisedImage : public testing::Test {
 protected:
  DenoisedImage() {
    auto light = make_desc<cumulet_sun_sky_desc>();
    light.sun_elevation_degrees = 40.0F;
    std::ranges::fill(light.sun_irradiance, 3.0F);
    std::ranges::fill(light.sky_radiance, 0.3F);
    EXPECT_EQ(cumulet_set_sun_sky(viewer_.get(), &light), CUMULET_OK);
    sample(4);
    write_network(cumulet::test::random_archive(cumulet::test::small_widths, 9));
  }

  void write_network(const cumulet::denoise::TensorArchive& archive) const {
    const auto bytes = cumulet::test::tza_file(archive);
    std::ofstream(file_, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  }

  void sample(std::uint32_t samples, cumulet_view_mode view = CUMULET_VIEW_SHADED,
              cumulet_preview preview = CUMULET_PREVIEW_OFF) const {
    auto sampling = make_desc<cumulet_sampling_desc>();
    sampling.samples = samples;
    sampling.view = view;
    sampling.preview = preview;
    EXPECT_EQ(cumulet_set_sampling(viewer_.get(), &sampling), CUMULET_OK);
  }

  [[nodiscard]] std::vector<float> picture() const {
    cumulet::test::picture_of(viewer_.get(), volume_.get(), target_);
    return linear();
  }

  [[nodiscard]] std::vector<float> linear() const {
    std::vector<float> rgba(floats);
    EXPECT_EQ(cumulet_read_linear(viewer_.get(), rgba.data(), rgba.size()), CUMULET_OK);
    return rgba;
  }

  // The displayed (filtered) image, with rows ordered as in the framebuffer.
  [[nodiscard]] std::vector<std::uint8_t> shown() const {
    std::vector<std::uint8_t> rgba(floats);
    EXPECT_EQ(cumulet_read_display(viewer_.get(), rgba.data(), rgba.size()), CUMULET_OK);
    return cumulet::test::upside_down(rgba, side);
  }
  static double off_by(const std::vector<std::uint8_t>& a, const std::vector<std::uint8_t>& b) {
    double off = 0.0;
    for (std::size_t i = 0; i < floats; ++i) off += std::abs(double(a[i]) - double(b[i])) / double(floats);
    return off;
  }

  cumulet_status denoise(const std::string& file, std::vector<float>& rgba) const {
    auto desc = make_desc<cumulet_denoise_desc>();
    desc.network = file.c_str();
    return cumulet_read_denoised(viewer_.get(), &desc, rgba.data(), rgba.size());
  }
  [[nodiscard]] std::string error() const { return cumulet_last_error(viewer_.get()); }

  headless::Context context_ = headless::Context::create(headless::Backend::automatic);
  GladGLContext gl_ = cumulet::test::load_gl(headless::Context::get_proc, &context_);
  HostTarget target_{gl_, side, side};
  VolumeRef volume_ = make_ball(24);
  ViewerPtr viewer_ = cumulet::test::make_viewer({.get_proc = headless::Context::get_proc, .user = &context_});
  Folder folder_;
  std::string file_ = (folder_ / "network.tza").string();
};

}  // namespace cumulet::test
