// Parts of a picture, each of some of its samples, are together the whole.

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "support/gl_viewer.hpp"
#include "support/surfaces.hpp"
#include "support/volumes.hpp"

namespace {

using namespace cumulet;
using glm::ivec3;
using glm::vec3;

constexpr std::uint32_t side = 12;

class Parts : public test::StillTest {
 protected:
  void SetUp() override {
    StillTest::SetUp();
    if (IsSkipped()) return;
    still_->set_volume(test::noise_volume({24, 20, 22}, ivec3(-3, 2, 5), 3));
    viewer().set_medium({0.3, vec3(0.95F), {0.4F}, 0});
    still_->set_camera(test::camera_at({8.0, 12.0, 90.0}, {8.0, 12.0, 15.0}, 24.0));
  }
  std::vector<float> picture(std::uint32_t first, std::uint32_t samples) {
    viewer::Sampling sampling;
    sampling.samples = samples;
    sampling.first_sample = first;
    sampling.preview = false;
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
    // The same samples again: no other picture, and not another's.
    EXPECT_EQ(picture(0, 40), whole);
    EXPECT_NE(picture(40, 40), whole);
  }
};
CUMULET_ON_BACKENDS(Parts);

TEST_P(Parts, OfAVolumeAreTheWhole) { expect_parts_are_the_whole(); }

TEST_P(Parts, OfSurfacesInItAreTheWhole) {
  auto scene = std::make_shared<test::StillScene>();
  scene->add(test::diffuse(vec3(0.8F)));
  scene->add_sphere({6.0F, 10.0F, 20.0F}, 6.0F, 0);
  viewer().show_surfaces(test::source_of(scene));
  expect_parts_are_the_whole();
}

TEST_P(Parts, BeginAnewWithAnotherFirstSample) {
  const std::vector<float> whole = picture(0, 16);
  const std::vector<float> later = picture(16, 16);
  EXPECT_NE(later, whole);
  EXPECT_EQ(double(viewer().stats().samples), 16.0 * side * side);
}

// What a kernel numbers goes around where numbers end.
TEST_P(Parts, BeginAgainAtZeroBeyondTheLastNumber) {
  const std::vector<float> around = picture(0xffffffffU, 2);
  const std::vector<float> last = picture(0xffffffffU, 1);
  const std::vector<float> zero = picture(0, 1);
  for (std::size_t i = 0; i < around.size(); ++i)
    EXPECT_NEAR(around[i], 0.5 * (double(last[i]) + double(zero[i])), 1e-5);
}

}  // namespace
