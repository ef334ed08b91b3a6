// The error estimate of an image: compared with the spread between seeds, and used as the stopping criterion.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <vector>

#include "base/error.hpp"
#include "base/luminance.hpp"
#include "support/still_cloud.hpp"

namespace {

using namespace cumulet;

constexpr std::uint32_t side = 20;
constexpr std::size_t pixels = std::size_t{side} * side;

class Noise : public test::StillCloudTest {
 protected:
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

TEST_P(Noise, EstimateMatchesTheVarianceBetweenSeeds) {
  constexpr std::uint32_t seeds = 96;
  std::vector<double> sum(pixels);
  std::vector<double> square(pixels);
  std::vector<double> estimated(pixels);  // squared error estimates
  for (std::uint32_t seed = 0; seed < seeds; ++seed) {
    const std::vector<double> bright = picture(16, seed);
    const std::vector<float> error = errors();
    double all = 0.0;
    for (std::size_t i = 0; i < pixels; ++i) {
      sum[i] += bright[i];
      square[i] += bright[i] * bright[i];
      estimated[i] += double(error[i]) * error[i] / seeds;
      all += double(error[i]) * error[i];
    }
    // The image's noise is the root mean square of its pixels' errors, relative to the mean.
    const double mean = std::accumulate(bright.begin(), bright.end(), 0.0) / double(pixels);
    EXPECT_NEAR(viewer().measure_noise().value(), std::sqrt(all / double(pixels)) / mean, 1e-5);
    EXPECT_EQ(viewer().stats().noise, viewer().measure_noise());
  }
  std::vector<double> truly(pixels);
  for (std::size_t i = 0; i < pixels; ++i) truly[i] = (square[i] - sum[i] * sum[i] / seeds) / (seeds - 1);
  // In quarters of the pixels, ordered by error: from the sky, which has none, to the brightest parts of the cloud.
  std::vector<std::size_t> order(pixels);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, {}, [&](std::size_t i) { return estimated[i]; });
  for (std::size_t quarter = 0; quarter < 4; ++quarter) {
    double estimate = 0.0;
    double truth = 0.0;
    for (std::size_t k = quarter * pixels / 4; k < (quarter + 1) * pixels / 4; ++k) {
      estimate += estimated[order[k]];
      truth += truly[order[k]];
    }
    RecordProperty("ratio" + std::to_string(quarter), std::to_string(std::sqrt(truth / estimate)));
    // The estimate is not below the true error, except for chance. It is above where samples are better distributed
    // than random ones.
    EXPECT_LT(truth, 1.08 * estimate + 1e-9) << quarter;
    EXPECT_GT(truth, 0.5 * estimate - 1e-9) << quarter;
  }
  EXPECT_GT(estimated[order.back()], 10.0 * estimated[order[pixels / 4]]) << "not all the same";
}

TEST_P(Noise, OneSampleHasNoErrorEstimate) {
  picture(1, 0);
  for (const float error : errors()) EXPECT_TRUE(std::isinf(error));
  EXPECT_FALSE(viewer().measure_noise()) << "unknown is not 0";
  EXPECT_FALSE(viewer().stats().noise);
  picture(2, 0);
  for (const float error : errors()) EXPECT_TRUE(std::isfinite(error));
  EXPECT_GT(viewer().measure_noise(), 0.0);
}

// In the dark all samples of a pixel are equal, so the error is really 0.
TEST_P(Noise, BlackImageHasNoNoise) {
  viewer().set_light({});
  picture(2, 0);
  EXPECT_EQ(viewer().measure_noise(), 0.0);
  picture(1, 0);
  EXPECT_FALSE(viewer().measure_noise());
}

// Result of a render: sample count and pixels.
struct Ended {
  double samples = 0.0;  // per pixel
  std::vector<float> pixels;
  bool operator==(const Ended&) const = default;
};

class NoiseTarget : public Noise {
 protected:
  static constexpr std::uint32_t most = 4096;

  // Without previews, so that equal settings give equal images.
  static viewer::Sampling sampling(std::optional<double> noise_target, std::uint32_t samples = most) {
    viewer::Sampling sampling;
    sampling.samples = samples;
    sampling.options.preview = false;
    sampling.noise_target = noise_target;
    return sampling;
  }
  Ended end(const viewer::Sampling& request, double budget_ms = 1e9, glm::uvec2 size = {side, side}) {
    viewer().set_sampling(request);
    viewer().wait(-1.0);
    double progress = 0.0;
    viewer::FrameResult result;
    do {
      result = viewer().render(frame(size.x, size.y, budget_ms));
      EXPECT_GE(result.progress, progress);
      progress = result.progress;
      EXPECT_EQ(result.converged, result.progress == 1.0 && !result.more);
    } while (!result.converged);
    Ended ended;
    ended.samples = double(viewer().stats().samples) / (double(size.x) * size.y);
    ended.pixels.resize(std::size_t{4} * size.x * size.y);
    viewer().read_linear(ended.pixels.data(), ended.pixels.size());
    return ended;
  }
};
CUMULET_ON_BACKENDS(NoiseTarget);

// Sample counts at which the noise is checked: 16, 23, 32, 45, 64, ...
std::vector<std::uint32_t> looks() {
  std::vector<std::uint32_t> counts;
  for (int i = 0; i < 14; ++i) counts.push_back(static_cast<std::uint32_t>(std::lround(16.0 * std::pow(2.0, 0.5 * i))));
  return counts;
}

TEST_P(NoiseTarget, StopsAtTheFirstCheckBelowTheTarget) {
  end(sampling(std::nullopt, 16));
  const double first = viewer().measure_noise().value();
  for (const double part : {1.01, 0.9, 0.3}) {
    const double target = part * first;
    const Ended stopped = end(sampling(target));
    EXPECT_LE(viewer().measure_noise().value(), target * 1.0001);
    const std::vector<std::uint32_t> counts = looks();
    const auto at = std::ranges::find(counts, static_cast<std::uint32_t>(stopped.samples));
    ASSERT_NE(at, counts.end()) << stopped.samples;
    EXPECT_EQ(stopped.samples, *at);
    EXPECT_EQ(stopped, end(sampling(std::nullopt, *at))) << "the picture of that many samples";
    if (at == counts.begin()) continue;
    end(sampling(std::nullopt, at[-1]));
    EXPECT_GT(viewer().measure_noise().value(), target);
  }
}

TEST_P(NoiseTarget, StopsAtTheSameSampleForAnyTimeBudget) {
  const Ended at_once = end(sampling(0.05));
  for (const double budget_ms : {1.0, 7.0}) {
    viewer::Sampling other = sampling(0.05);
    other.seed = 9;
    end(other, 20.0);  // forces a restart
    EXPECT_EQ(end(sampling(0.05), budget_ms), at_once) << budget_ms;
  }
}

TEST_P(NoiseTarget, StopsInImagesOfSeveralTiles) {
  const glm::uvec2 size(520, 12);
  end(sampling(std::nullopt, 16), 50.0, size);
  const double target = 0.6 * viewer().measure_noise().value();
  const Ended stopped = end(sampling(target), 50.0, size);
  EXPECT_GT(stopped.samples, 16.0);
  EXPECT_LT(stopped.samples, double(most));
  EXPECT_LE(viewer().measure_noise().value(), target * 1.0001);
  EXPECT_EQ(stopped, end(sampling(std::nullopt, static_cast<std::uint32_t>(stopped.samples)), 50.0, size));
}

TEST_P(NoiseTarget, StopsAtTheSampleLimit) {
  for (const std::uint32_t samples : {7U, 16U, 20U, 32U}) {
    const Ended all = end(sampling(1e-4, samples));
    EXPECT_EQ(all.samples, samples);
    EXPECT_EQ(all, end(sampling(std::nullopt, samples)));
  }
}

TEST_P(NoiseTarget, LowerTargetContinuesAndHigherTargetRestarts) {
  const Ended coarse = end(sampling(0.08));
  const Ended fine = end(sampling(0.03));
  EXPECT_GT(fine.samples, 2.0 * coarse.samples);
  EXPECT_EQ(end(sampling(0.08)), coarse);
  EXPECT_EQ(end(sampling(0.03, 50)).samples, 50.0);
  EXPECT_EQ(end(sampling(0.03, 60)).samples, 60.0);
  EXPECT_EQ(end(sampling(0.03)), fine);
  // Once the target is reached, a larger sample limit changes nothing.
  EXPECT_EQ(end(sampling(0.03, 2 * most)), fine);
  // The same holds if the sample limit equals the count of that noise check.
  end(sampling(std::nullopt, 3));
  EXPECT_EQ(end(sampling(0.08, static_cast<std::uint32_t>(coarse.samples))), coarse);
  EXPECT_EQ(end(sampling(0.08)), coarse);
  EXPECT_EQ(end(sampling(0.03)), fine);
  // With previews on, existing samples are kept, and they reach the target.
  viewer::Sampling kept = sampling(0.03);
  kept.options.preview = true;
  end(kept);
  kept.noise_target = 0.08;
  EXPECT_EQ(end(kept).samples, fine.samples);
}

class AdaptiveSampling : public NoiseTarget {
 protected:
  static constexpr glm::uvec2 size{36, 28};  // not a multiple of the block size

  static viewer::Sampling adaptive(double noise_target, std::uint32_t samples = most) {
    viewer::Sampling request = sampling(noise_target, samples);
    request.options.adaptive = true;
    return request;
  }
  Ended end_small(const viewer::Sampling& request, double budget_ms = 1e9) { return end(request, budget_ms, size); }
};
CUMULET_ON_BACKENDS(AdaptiveSampling);

TEST_P(AdaptiveSampling, ReachesTheTargetWithFewerSamples) {
  const double target = 0.03;
  const Ended even = end_small(sampling(target));
  const Ended ended = end_small(adaptive(target));
  EXPECT_LE(viewer().measure_noise().value(), target * 1.0001);
  EXPECT_LT(ended.samples, 0.8 * even.samples);
  // The sky has no noise and stops at the first noise check.
  EXPECT_GT(ended.samples, 16.0);
  std::vector<float> error(std::size_t{size.x} * size.y);
  viewer().read_aov(viewer::Aov::error, error.data(), error.size());
  EXPECT_EQ(error.front(), 0.0F);
}

TEST_P(AdaptiveSampling, ImageIsTheSameForAnyTimeBudget) {
  const Ended at_once = end_small(adaptive(0.03));
  for (const double budget_ms : {1.0, 7.0}) {
    end_small(adaptive(0.2), 20.0);  // forces a restart
    EXPECT_EQ(end_small(adaptive(0.03), budget_ms), at_once) << budget_ms;
  }
  EXPECT_NE(end_small(sampling(0.03)), at_once);
}

TEST_P(AdaptiveSampling, ResumesFromAnySavedState) {
  const viewer::Sampling request = adaptive(0.025);
  const Ended whole = end_small(request);
  const auto one_frame = [&](double budget_ms) { return viewer().render(frame(size.x, size.y, budget_ms)); };
  const auto begin_anew = [&] {
    viewer().set_sampling(adaptive(0.5));
    one_frame(0.01);
    viewer().set_sampling(request);
    one_frame(0.01);
  };
  begin_anew();
  std::size_t kept = 0;
  double seen = 0.0;
  // At many points of the passes: saves, restarts and restores. The result must not depend on it.
  for (viewer::FrameResult result = one_frame(0.5); !result.converged; result = one_frame(0.5)) {
    const double samples = double(viewer().stats().samples);
    if (samples < seen + 900.0) continue;
    seen = samples;
    std::vector<std::byte> bytes(viewer().accumulation_bytes());
    viewer().read_accumulation(bytes);
    begin_anew();
    viewer().restore_accumulation(bytes);
    ++kept;
  }
  EXPECT_GT(kept, 10U);
  Ended ended;
  ended.samples = double(viewer().stats().samples) / (double(size.x) * size.y);
  ended.pixels.resize(std::size_t{4} * size.x * size.y);
  viewer().read_linear(ended.pixels.data(), ended.pixels.size());
  EXPECT_EQ(ended, whole);
}

TEST_P(AdaptiveSampling, RejectsSavedStateOfAnotherImage) {
  const auto saved = [&](const viewer::Sampling& request) {
    end_small(request);
    std::vector<std::byte> bytes(viewer().accumulation_bytes());
    viewer().read_accumulation(bytes);
    return bytes;
  };
  const std::vector<std::byte> even = saved(sampling(0.1));
  std::vector<std::byte> own = saved(adaptive(0.1));
  EXPECT_THROW(viewer().restore_accumulation(even), Error);
  // A pass number beyond the image's samples.
  own[even.size() + 3] = std::byte{0xff};
  EXPECT_THROW(viewer().restore_accumulation(own), Error);
}

TEST_P(AdaptiveSampling, WorksWithSeveralTilesAndRegions) {
  const glm::uvec2 wide(520, 12);
  end(sampling(std::nullopt, 16), 50.0, wide);
  const double target = 0.4 * viewer().measure_noise().value();
  const Ended ended = end(adaptive(target), 50.0, wide);
  EXPECT_LE(viewer().measure_noise().value(), target * 1.0001);
  EXPECT_LT(ended.samples, 0.8 * end(sampling(target), 50.0, wide).samples);
  viewer::Sampling part = adaptive(target);
  part.options.region = {{0.4F, 0.1F}, {0.5F, 0.8F}};
  end(part, 50.0, wide);
  EXPECT_LE(viewer().measure_noise().value(), target * 1.0001);
}

}  // namespace
