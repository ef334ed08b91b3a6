// Error metrics of the denoiser benchmark.
#include "bench/judging.hpp"

#include <gtest/gtest.h>

#include <random>

namespace {

using namespace cumulet::bench;

TEST(ErrorMetrics, ReferenceNoiseIsSubtractedFromTheError) {
  std::mt19937 engine(1);
  std::normal_distribution<float> noise(0.0F, 0.3F);
  constexpr std::size_t floats = 4 * 40000;
  std::vector<float> off(floats, 1.2F);  // 0.2 too bright
  std::array<std::vector<float>, 2> halves{std::vector<float>(floats), std::vector<float>(floats)};
  for (std::vector<float>& half : halves) {
    for (float& value : half) value = 1.0F + noise(engine);
  }
  EXPECT_NEAR(relative_square_error(off, {off, off}, 1.0).most, 0.0, 1e-12);
  const std::vector<float> truth(floats, 1.0F);
  EXPECT_NEAR(relative_square_error(off, {truth, truth}, 1.0).most, 0.04 / 1.01, 1e-4);
  EXPECT_NEAR(relative_square_error(off, {truth, truth}, 2.0).most, 0.16 / 4.01, 1e-4);
  std::vector<double> x(40000, 1.2);
  std::array<std::vector<double>, 2> y{std::vector<double>(40000), std::vector<double>(40000)};
  for (std::size_t i = 0; i < 40000; ++i) {
    for (std::size_t half = 0; half < 2; ++half) y.at(half)[i] = halves.at(half)[4 * i];
  }
  EXPECT_NEAR(root_error(x, y[0], y[1]), 0.2, 0.01);
}

TEST(ErrorMetrics, FirefliesAreCountedSeparately) {
  constexpr std::size_t pixels = 1000;
  const std::vector<float> truth(4 * pixels, 1.0F);
  std::vector<float> picture = truth;
  picture[40] = 11.0F;
  const RelativeSquareError error = relative_square_error(picture, {truth, truth}, 1.0);
  EXPECT_EQ(error.most, 0.0);
  EXPECT_EQ(error.specks, 1.0);
}

TEST(ErrorMetrics, SampleCountsAreInterpolatedLogLog) {
  const std::vector<std::pair<double, double>> curve{{1, 1.0}, {4, 0.25}, {16, 0.125}};
  EXPECT_NEAR(count_as_good(curve, 0.5).value(), 2.0, 1e-12);
  EXPECT_NEAR(count_as_good(curve, 0.25).value(), 4.0, 1e-12);
  EXPECT_NEAR(count_as_good(curve, 0.25 / std::sqrt(2.0)).value(), 8.0, 1e-12);
  EXPECT_EQ(count_as_good(curve, 2.0).value(), 1.0);
  EXPECT_FALSE(count_as_good(curve, 0.1));
}

TEST(ErrorMetrics, EstimatesHaveAStandardError) {
  const Estimate estimate = estimate_of({1.0, 3.0});
  EXPECT_EQ(estimate.mean, 2.0);
  EXPECT_NEAR(estimate.standard_error, 1.0, 1e-12);
  EXPECT_EQ(estimate_of({5.0}).standard_error, 0.0);
}

}  // namespace
