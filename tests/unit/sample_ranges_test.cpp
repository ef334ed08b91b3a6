// Partial renders with disjoint sample ranges add up to the whole image.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "support/still_cloud.hpp"
#include "support/surfaces.hpp"

namespace {

using namespace cumulet;
using glm::vec3;

constexpr std::uint32_t side = 12;

class SampleRanges : public test::StillCloudTest {
 protected:
  std::vector<float> picture(std::uint32_t first, std::uint32_t samples) {
    viewer::Sampling sampling;
    sampling.samples = samples;
    sampling.first_sample = first;
    sampling.options.preview = false;
    viewer().set_sampling(sampling);
    viewer().wait(-1.0);
    while (!viewer().render(frame(side, side, 1e9)).converged) {
    }
    std::vector<float> pixels(std::size_t{4} * side * side);
    viewer().read_linear(pixels.data(), pixels.size());
    return pixels;
  }
  void expect_parts_are_the_whole() {
    const std::vector<float> whole = picture(0, 40);
    std::vector<double> sum(whole.size());
    std::uint32_t first = 0;
    for (const std::uint32_t samples : {1U, 13U, 2U, 24U}) {
      const std::vector<float> part = picture(first, samples);
      for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += double(samples) * double(part[i]) / 40.0;
      first += samples;
    }
    for (std::size_t i = 0; i < sum.size(); ++i) EXPECT_NEAR(sum[i], whole[i], 2e-6 * (1.0 + sum[i])) << i;
    // The same range gives the same image, another range another image.
    EXPECT_EQ(picture(0, 40), whole);
    EXPECT_NE(picture(40, 40), whole);
  }
};
CUMULET_ON_BACKENDS(SampleRanges);

TEST_P(SampleRanges, VolumeRangesSumToTheFullImage) { expect_parts_are_the_whole(); }

TEST_P(SampleRanges, SurfaceRangesSumToTheFullImage) {
  auto scene = std::make_shared<test::StillScene>();
  scene->add(test::diffuse(vec3(0.8F)));
  scene->add_sphere({6.0F, 10.0F, 20.0F}, 6.0F, 0);
  viewer().show_surfaces(test::source_of(scene));
  expect_parts_are_the_whole();
}

TEST_P(SampleRanges, ChangedFirstSampleRestarts) {
  const std::vector<float> whole = picture(0, 16);
  const std::vector<float> later = picture(16, 16);
  EXPECT_NE(later, whole);
  EXPECT_EQ(double(viewer().stats().samples), 16.0 * side * side);
}

// A render that continues in another viewer from its saved samples.
class ResumedRendering : public SampleRanges {
 protected:
  static viewer::Sampling sampling(std::uint32_t samples, std::optional<double> noise_target = std::nullopt) {
    viewer::Sampling sampling;
    sampling.samples = samples;
    sampling.seed = 3;
    sampling.options.preview = false;
    sampling.options.separate_volume_aov = true;
    sampling.noise_target = noise_target;
    return sampling;
  }
  struct Ended {
    double samples = 0.0;
    std::uint64_t steps = 0;
    std::vector<float> pixels;
    std::vector<float> volume;
    std::vector<float> errors;
    bool operator==(const Ended&) const = default;
  };
  Ended end(glm::uvec2 size) {
    while (!viewer().render(frame(size.x, size.y, 50.0)).converged) {
    }
    Ended ended;
    const std::size_t count = std::size_t{size.x} * size.y;
    ended.pixels.resize(4 * count);
    ended.volume.resize(4 * count);
    ended.errors.resize(count);
    viewer().read_linear(ended.pixels.data(), ended.pixels.size());
    viewer().read_aov(viewer::Aov::volume, ended.volume.data(), ended.volume.size());
    viewer().read_aov(viewer::Aov::error, ended.errors.data(), ended.errors.size());
    ended.samples = double(viewer().stats().samples) / double(count);
    ended.steps = viewer().stats().steps;
    return ended;
  }
  // Restarts, so that nothing of the other process remains.
  void begin(const viewer::Sampling& request) {
    viewer::Sampling other = request;
    other.seed = 99;
    viewer().set_sampling(other);
    viewer().render(frame(3, 2, 50.0));
    viewer().set_sampling(request);
    viewer().wait(-1.0);
  }
  std::vector<std::byte> saved() {
    std::vector<std::byte> bytes(viewer().accumulation_bytes());
    viewer().read_accumulation(bytes);
    return bytes;
  }
  // Stops after various numbers of frames of a millisecond or so, each time in another state.
  void expect_resumed_as_whole(const viewer::Sampling& request, glm::uvec2 size) {
    begin(request);
    const Ended whole = end(size);
    int resumed = 0;
    for (const int frames : {1, 2, 5, 9, 17, 40, 120}) {
      begin(request);
      bool done = false;
      for (int i = 0; i < frames && !done; ++i) done = viewer().render(frame(size.x, size.y, 2.0)).converged;
      const std::vector<std::byte> bytes = saved();
      begin(request);
      viewer().render(frame(size.x, size.y, 1.0));
      viewer().restore_accumulation(bytes);
      if (!done) ++resumed;
      EXPECT_EQ(end(size), whole) << frames;
    }
    EXPECT_GE(resumed, 1);
  }
};
CUMULET_ON_BACKENDS(ResumedRendering);

TEST_P(ResumedRendering, MatchesAnUninterruptedRendering) { expect_resumed_as_whole(sampling(200), {side, side}); }

TEST_P(ResumedRendering, MatchesAnUninterruptedRenderingInSeveralTiles) {
  expect_resumed_as_whole(sampling(24), {600, 9});
}

TEST_P(ResumedRendering, MatchesAnUninterruptedRenderingWithSurfaces) {
  auto scene = std::make_shared<test::StillScene>();
  scene->add(test::diffuse(vec3(0.8F)));
  scene->add_sphere({6.0F, 10.0F, 20.0F}, 6.0F, 0);
  viewer().show_surfaces(test::source_of(scene));
  expect_resumed_as_whole(sampling(100), {side, side});
}

TEST_P(ResumedRendering, StopsAtTheSameNoiseCheck) {
  expect_resumed_as_whole(sampling(5000, 0.04), {side, side});
  expect_resumed_as_whole(sampling(5000, 0.2), {600, 9});
}

TEST_P(ResumedRendering, FinishedStateNeedsNoMoreSamples) {
  begin(sampling(8));
  const Ended whole = end({side, side});
  const std::vector<std::byte> bytes = saved();
  begin(sampling(8));
  viewer().render(frame(side, side, 1.0));
  viewer().restore_accumulation(bytes);
  EXPECT_EQ(end({side, side}), whole);
  // Continues with more samples.
  begin(sampling(20));
  const Ended longer = end({side, side});
  begin(sampling(20));
  viewer().render(frame(side, side, 1.0));
  viewer().restore_accumulation(bytes);
  EXPECT_EQ(end({side, side}), longer);
}

TEST_P(ResumedRendering, StateOfAnotherImageIsRejected) {
  begin(sampling(8));
  end({side, side});
  std::vector<std::byte> bytes = saved();
  EXPECT_EQ(bytes.size(), 32U + 60U * side * side);
  EXPECT_THROW(viewer().read_accumulation(std::span(bytes).first(bytes.size() - 1)), Error);
  begin(sampling(7));
  viewer().render(frame(side, side, 1.0));
  EXPECT_THROW(viewer().restore_accumulation(bytes), Error) << "more than it shall have";
  begin(sampling(8));
  viewer().render(frame(side, side + 1, 1.0));
  EXPECT_THROW(viewer().restore_accumulation(bytes), Error) << "another size";
  begin(sampling(8));
  viewer().render(frame(side, side, 1.0));
  EXPECT_THROW(viewer().restore_accumulation(std::span(bytes).first(bytes.size() - 1)), Error) << "torn";
  EXPECT_THROW(viewer().restore_accumulation({}), Error);
  bytes[0] = std::byte{0};
  EXPECT_THROW(viewer().restore_accumulation(bytes), Error) << "no accumulation";
  // The image is unaffected.
  begin(sampling(8));
  const Ended whole = end({side, side});
  EXPECT_EQ(whole.samples, 8.0);
  viewer::Sampling previews = sampling(8);
  previews.options.preview = true;
  viewer().set_sampling(previews);
  end({side, side});
  EXPECT_THROW(static_cast<void>(viewer().accumulation_bytes()), Error);
}

// Sample numbers wrap around at 2^32.
TEST_P(SampleRanges, SampleIndexWrapsAt32Bits) {
  const std::vector<float> around = picture(0xffffffffU, 2);
  const std::vector<float> last = picture(0xffffffffU, 1);
  const std::vector<float> zero = picture(0, 1);
  for (std::size_t i = 0; i < around.size(); ++i)
    EXPECT_NEAR(around[i], 0.5 * (double(last[i]) + double(zero[i])), 1e-5);
}

}  // namespace
