// Adaptive sampling: which pixels get more samples, compared with Neyman allocation in closed form.

#include "render/film/allotment.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>
#include <vector>

namespace {

using namespace cumulet;
using render::Allotment;
using render::SquareError;

constexpr unsigned rows = 4;  // rows of a half-block of 32 pixels

// Adaptive-sampling blocks in a row, each with its own standard deviation. Pixels have brightness 1.
class Row {
 public:
  explicit Row(std::vector<double> deviations) : deviations_(std::move(deviations)), samples_(deviations_.size(), 0.0) {
    allotment_.begin({8 * deviations_.size(), 8U});
  }
  // Samples until the noise reaches the target. Returns the total number of samples.
  double run(double target) {
    double count = 16.0;
    do {
      look(std::round(count));
      if (noise() <= target) break;
      allotment_.decide(errors(), target, static_cast<std::uint32_t>(std::round(count)));
      count *= growth_;
    } while (count < 1e6);
    double all = 0.0;
    for (const double samples : samples_) all += 64.0 * samples;
    return all;
  }
  [[nodiscard]] double noise() const {
    double sum = 0.0;
    for (std::size_t i = 0; i < samples_.size(); ++i) sum += deviations_[i] * deviations_[i] / samples_[i];
    return std::sqrt(sum / double(samples_.size()));
  }
  [[nodiscard]] const std::vector<double>& samples() const { return samples_; }
  Allotment& allotment() { return allotment_; }
  void look(double count) {
    for (unsigned i = 0; i < samples_.size(); ++i)
      if (allotment_.live({i, 0U}) != 0) samples_[i] = count;
  }
  [[nodiscard]] std::vector<SquareError> errors() const {
    std::vector<SquareError> errors;
    for (std::size_t i = 0; i < samples_.size(); ++i) {
      const double squared = 8.0 * rows * deviations_[i] * deviations_[i] / samples_[i];
      errors.push_back({{squared, squared}, 64.0, 64.0});
    }
    return errors;
  }

 private:
  static constexpr double growth_ = 1.05;  // finer than for images: nearer the closed form
  std::vector<double> deviations_;
  std::vector<double> samples_;
  Allotment allotment_;
};

TEST(AdaptiveSampleCounts, MatchNeymanAllocationInClosedForm) {
  const std::vector<double> deviations{1.0, 2.0, 1.0, 8.0, 3.0, 4.0};
  const double target = 0.1;
  Row row(deviations);
  const double all = row.run(target);
  // Each block has n = s sum(s) / V, with V of all blocks. Blocks whose n is below 16 keep their 16 samples, and the
  // others share the rest of V.
  double left = target * target * double(deviations.size());
  double sum = 0.0;
  for (const double s : deviations) sum += s;
  double best = 0.0;
  for (std::size_t i = 0; i < deviations.size(); ++i) {
    const double wanted = std::max(16.0, deviations[i] * sum / left);
    best += 64.0 * wanted;
    EXPECT_GE(row.samples()[i], 0.94 * wanted) << i;
    EXPECT_LE(row.samples()[i], 1.06 * wanted) << i;
  }
  EXPECT_LE(row.noise(), target);
  EXPECT_GE(row.noise(), 0.96 * target);
  EXPECT_NEAR(all, best, 0.05 * best);
  // Uniform sampling takes sum(s^2) / V samples per block.
  double even = 0.0;
  for (const double s : deviations) even += s * s / left;
  EXPECT_LT(all, 0.7 * 64.0 * double(deviations.size()) * even);
}

TEST(AdaptiveSampleCounts, PredictTheNumberOfSamples) {
  Row row({1.0, 2.0, 4.0, 8.0});
  EXPECT_EQ(row.allotment().expected(100.0), 4 * 64 * 100.0);
  row.look(16.0);
  row.allotment().decide(row.errors(), 0.2, 16);
  const double expected = row.allotment().expected(1e6);
  EXPECT_NEAR(row.run(0.2), expected, 0.06 * expected);
}

TEST(AdaptiveSampleCounts, HalfABlockIsDecidedByTheOtherHalf) {
  Allotment allotment;
  allotment.begin({16U, 8U});
  // The even rows of the first block are noisy, the odd rows and the second block are not.
  const std::array<SquareError, 2> errors{SquareError{{32.0, 0.0}, 64.0, 64.0}, SquareError{{0.0, 0.0}, 64.0, 64.0}};
  allotment.decide(errors, 0.4, 16);
  EXPECT_EQ(allotment.live({0U, 0U}), 2U);
  EXPECT_EQ(allotment.live({1U, 0U}), 0U);
  EXPECT_FALSE(allotment.is_live({3U, 4U}));
  EXPECT_TRUE(allotment.is_live({3U, 5U}));
}

TEST(AdaptiveSampleCounts, SamplingContinuesUntilTheTargetIsReached) {
  // The noisy half already has its allotted samples by the other half's estimate, but the target is not reached.
  Allotment allotment;
  allotment.begin({8U, 8U});
  allotment.decide(std::array{SquareError{{32.0, 0.0}, 64.0, 64.0}}, 0.5, 16);
  EXPECT_EQ(allotment.live({0U, 0U}), 2U);
  allotment.decide(std::array{SquareError{{32.0, 0.0}, 64.0, 64.0}}, 0.5, 4096);
  EXPECT_EQ(allotment.live({0U, 0U}), 1U);
}

TEST(AdaptiveSampleCounts, CountPartialBlocksAtTheEdges) {
  Allotment allotment;
  allotment.begin({9U, 11U});
  EXPECT_EQ(allotment.squares(), glm::uvec2(2U, 2U));
  EXPECT_EQ(allotment.live_pixels({0U, 0U}), 64U);
  EXPECT_EQ(allotment.live_pixels({1U, 0U}), 8U);
  EXPECT_EQ(allotment.live_pixels({0U, 1U}), 24U);
  EXPECT_EQ(allotment.live_pixels({1U, 1U}), 3U);
  // A single row is decided by its own noise.
  allotment.begin({8U, 1U});
  allotment.decide(std::array{SquareError{{32.0, 0.0}, 8.0, 8.0}}, 0.5, 16);
  EXPECT_EQ(allotment.live({0U, 0U}), 1U);
}

// A last row without a second half is decided together with the block above it.
TEST(AdaptiveSampleCounts, LastRowIsDecidedWithTheBlockAbove) {
  Allotment allotment;
  allotment.begin({8U, 9U});
  const std::array dark_row{SquareError{{32.0, 32.0}, 64.0, 64.0}, SquareError{{0.0, 0.0}, 8.0, 8.0}};
  allotment.decide(dark_row, 0.1, 16);
  EXPECT_EQ(allotment.live({0U, 1U}), 1U);
}

// Pixels are 1/p with probability p, else 0. The expected mean is 1 with and without adaptive sampling.
TEST(AdaptiveSampleCounts, RareBrightSamplesAreNotMissed) {
  constexpr unsigned squares = 32;
  constexpr double target = 0.5;
  std::mt19937_64 random(3);
  const auto probability_of = [](unsigned square) { return square < squares / 2 ? 0.002 : 0.9; };
  double sum = 0.0;
  constexpr int pictures = 60;
  for (int picture = 0; picture < pictures; ++picture) {
    Allotment allotment;
    allotment.begin({8U * squares, 8U});
    std::vector<double> total(std::size_t{64} * squares);
    std::vector<double> of_squares(total.size());
    std::vector<double> count(total.size());
    for (double samples = 16.0;; samples = std::ceil(samples * std::sqrt(2.0))) {
      std::vector<SquareError> errors(squares);
      double squared = 0.0;
      double brightness = 0.0;
      for (std::size_t i = 0; i < total.size(); ++i) {
        const auto x = static_cast<unsigned>(i % (8 * squares));
        const auto y = static_cast<unsigned>(i / (8 * squares));
        const double p = probability_of(x / 8);
        if (allotment.is_live({x, y})) {
          std::binomial_distribution<int> hits(static_cast<int>(samples - count[i]), p);
          const double found = hits(random);
          total[i] += found / p;
          of_squares[i] += found / (p * p);
          count[i] = samples;
        }
        const double mean = total[i] / count[i];
        const double variance = (of_squares[i] / count[i] - mean * mean) / (count[i] - 1.0);
        SquareError& error = errors[x / 8];
        error.squared.at(y % 2) += variance;
        error.brightness += mean;
        error.pixels += 1.0;
        squared += variance;
        brightness += mean;
      }
      const auto pixels = static_cast<double>(total.size());
      if (std::sqrt(squared / pixels) <= target * brightness / pixels || samples > 20000.0) {
        sum += brightness / pixels;
        break;
      }
      allotment.decide(errors, target, static_cast<std::uint32_t>(samples));
    }
  }
  EXPECT_NEAR(sum / pictures, 1.0, 0.02);
}

TEST(AdaptiveSampleCounts, ResumeFromASavedState) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> value(0.0, 3.0);
  std::vector<double> deviations(40);
  for (double& deviation : deviations) deviation = value(random);
  Row row(deviations);
  row.look(16.0);
  row.allotment().decide(row.errors(), 0.1, 16);
  row.look(64.0);
  row.allotment().decide(row.errors(), 0.1, 64);
  row.look(91.0);
  Allotment other;
  other.begin({8 * deviations.size(), 8U});
  const auto saved = row.allotment().saved();
  const auto samples_of = [&](glm::uvec2 pixel) { return static_cast<std::uint32_t>(row.samples()[pixel.x / 8]); };
  other.restore(std::vector<std::uint8_t>(saved.begin(), saved.end()), samples_of);
  row.allotment().decide(row.errors(), 0.1, 91);
  other.decide(row.errors(), 0.1, 91);
  for (unsigned i = 0; i < deviations.size(); ++i) EXPECT_EQ(other.live({i, 0U}), row.allotment().live({i, 0U}));
  EXPECT_EQ(other.expected(1e5), row.allotment().expected(1e5));
}

}  // namespace
