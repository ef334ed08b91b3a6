// The error that a picture tells of itself: against what pictures of other seeds show, and as what it stops at.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "base/luminance.hpp"
#include "support/gl_viewer.hpp"
#include "support/volumes.hpp"

namespace {

using namespace cumulet;
using glm::ivec3;
using glm::vec3;

constexpr std::uint32_t side = 20;
constexpr std::size_t pixels = std::size_t{side} * side;

class Noise : public test::StillTest {
 protected:
  void SetUp() override {
    StillTest::SetUp();
    if (IsSkipped()) return;
    still_->set_volume(test::noise_volume({24, 20, 22}, ivec3(-3, 2, 5), 3));
    viewer().set_medium({0.3, vec3(0.95F), {0.4F}, 0});
    still_->set_camera(test::camera_at({8.0, 12.0, 90.0}, {8.0, 12.0, 15.0}, 24.0));
  }
  [[nodiscard]] std::vector<float> errors() const {
    std::vector<float> errors(pixels);
    viewer().read_aov(viewer::Aov::error, errors.data(), errors.size());
    return errors;
  }
  // Luminances, with the sky.
  std::vector<double> picture(std::uint32_t samples, std::uint32_t seed) {
    const test::Picture made = test::render(*still_, {side, side, samples, seed, render::View::shaded});
    std::vector<double> bright;
    for (const glm::vec4& pixel : made.pixels) bright.push_back(luminance(glm::dvec3(pixel)));
    return bright;
  }
};
CUMULET_ON_BACKENDS(Noise);

TEST_P(Noise, ErrorIsTheSpreadBetweenSeedsPixelByPixel) {
  constexpr std::uint32_t seeds = 96;
  std::vector<double> sum(pixels);
  std::vector<double> square(pixels);
  std::vector<double> told(pixels);  // squared
  for (std::uint32_t seed = 0; seed < seeds; ++seed) {
    const std::vector<double> bright = picture(16, seed);
    const std::vector<float> error = errors();
    double all = 0.0;
    for (std::size_t i = 0; i < pixels; ++i) {
      sum[i] += bright[i];
      square[i] += bright[i] * bright[i];
      told[i] += double(error[i]) * error[i] / seeds;
      all += double(error[i]) * error[i];
    }
    // The picture's noise is that of its pixels.
    const double mean = std::accumulate(bright.begin(), bright.end(), 0.0) / double(pixels);
    EXPECT_NEAR(viewer().measure_noise(), std::sqrt(all / double(pixels)) / mean, 1e-5);
    EXPECT_EQ(viewer().stats().noise, viewer().measure_noise());
  }
  std::vector<double> truly(pixels);
  for (std::size_t i = 0; i < pixels; ++i) truly[i] = (square[i] - sum[i] * sum[i] / seeds) / (seeds - 1);
  // By quarters of the pixels, from those with the least error on: of sky, where it is none, to the cloud's brightest.
  std::vector<std::size_t> order(pixels);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, {}, [&](std::size_t i) { return told[i]; });
  for (std::size_t quarter = 0; quarter < 4; ++quarter) {
    double estimate = 0.0;
    double truth = 0.0;
    for (std::size_t k = quarter * pixels / 4; k < (quarter + 1) * pixels / 4; ++k) {
      estimate += told[order[k]];
      truth += truly[order[k]];
    }
    RecordProperty("ratio" + std::to_string(quarter), std::to_string(std::sqrt(truth / estimate)));
    // Never less than it is, but for chance; more where samples are spread better than by chance.
    EXPECT_LT(truth, 1.08 * estimate + 1e-9) << quarter;
    EXPECT_GT(truth, 0.5 * estimate - 1e-9) << quarter;
  }
  EXPECT_GT(told[order.back()], 10.0 * told[order[pixels / 4]]) << "not all the same";
}

TEST_P(Noise, OneSampleTellsNothingOfItsError) {
  picture(1, 0);
  for (const float error : errors()) EXPECT_TRUE(std::isinf(error));
  EXPECT_EQ(viewer().measure_noise(), 0.0);
  picture(2, 0);
  for (const float error : errors()) EXPECT_TRUE(std::isfinite(error));
  EXPECT_GT(viewer().measure_noise(), 0.0);
}

}  // namespace
