// Temporal history: valid samples of earlier images are reused, and others are not.

#include <gtest/gtest.h>

#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "base/error.hpp"
#include "render/passes/wavelet.hpp"
#include "support/fake_gl.hpp"
#include "support/film_samples.hpp"
#include "support/gl_state.hpp"

namespace {

using cumulet::render::MeansBackground;
using cumulet::render::PictureView;
using cumulet::render::Wavelet;
using cumulet::test::error_of;
using cumulet::test::infinite;
using cumulet::test::moments_of;
using cumulet::test::Pixel;
using cumulet::test::pixel_at_1;
using cumulet::test::Samples;
using cumulet::test::Scene;
using cumulet::test::view_at;
namespace gl = cumulet::gl;

// Detail that only samples show: a random value for each position of a wall at depth 5, where a pixel is 0.05 wide.
float painted(int x, int y) {
  const auto hash = static_cast<unsigned>((x + 1000) * 7919 + (y + 1000) * 104729);
  return 0.3F + 0.1F * static_cast<float>((hash ^ (hash >> 7U)) % 14U);
}
constexpr double wall_z = 5.0;
constexpr double wall_pixel = wall_z * pixel_at_1;

// The wall seen from an eye that is moved to the right by this number of its pixels.
Scene wall_from(int moved) {
  return [moved](int x, int y) {
    return Pixel{.front = glm::vec3(painted(x + moved, y)),
                 .normal = {0.0F, 0.0F, 1.0F},
                 .albedo = glm::vec3(0.5F),
                 .z = static_cast<float>(wall_z)};
  };
}

class DenoiserHistory : public cumulet::test::GlTest {
 protected:
  void SetUp() override {
    GlTest::SetUp();
    if (gl_) wavelet_ = std::make_unique<Wavelet>(gl_, programs_);
  }
  void TearDown() override {
    wavelet_.reset();
    GlTest::TearDown();
  }
  // Filters images of a wall of one sample per pixel, moving the eye by a step each time. Returns the last.
  std::vector<glm::vec4> after(int pictures, int step, std::vector<glm::vec4>* truth = nullptr) {
    std::vector<glm::vec4> last;
    for (int i = 0; i < pictures; ++i) {
      const Samples samples(gl_, size_, 1, wall_from(step * i), static_cast<unsigned>(i + 1));
      last = samples.filtered_by(*wavelet_, view_at(step * i * wall_pixel, size_));
      if (truth != nullptr) *truth = samples.truth();
    }
    return last;
  }

  glm::ivec2 size_{48, 40};
  std::unique_ptr<Wavelet> wavelet_;
};

TEST_P(DenoiserHistory, SameViewAccumulates) {
  std::vector<glm::vec4> truth;
  const double one = error_of(after(1, 0, &truth), truth);
  const double many = error_of(after(12, 0, &truth), truth);
  EXPECT_LT(many, 0.5 * one);
}

TEST_P(DenoiserHistory, MovingObjectsAreReprojected) {
  std::vector<glm::vec4> truth;
  const double one = error_of(after(1, 0, &truth), truth);
  for (const int step : {2, -3}) EXPECT_LT(error_of(after(12, step, &truth), truth), 0.65 * one) << step;
}

TEST_P(DenoiserHistory, MediumIsReprojectedByItsMeanDepth) {
  const auto scene = [](int moved) {
    return [moved](int x, int y) { return Pixel{.front = glm::vec3(painted(x + moved, y)), .z = float(wall_z)}; };
  };
  double one = 0.0;
  double many = 0.0;
  for (int i = 0; i < 12; ++i) {
    const Samples samples(gl_, size_, 1, scene(3 * i), static_cast<unsigned>(i + 1));
    many = error_of(samples.filtered_by(*wavelet_, view_at(3 * i * wall_pixel, size_)), samples.truth());
    if (i == 0) one = many;
  }
  EXPECT_LT(many, 0.65 * one);
}

TEST_P(DenoiserHistory, OrthographicAndRotatedViewsAreReprojected) {
  double one = 0.0;
  double many = 0.0;
  for (int i = 0; i < 12; ++i) {
    const Samples samples(gl_, size_, 1, wall_from(2 * i), static_cast<unsigned>(i + 1));
    PictureView view = view_at(2 * i * wall_pixel, size_);
    view.orthographic = true;
    view.right *= wall_z;  // so that pixels have the same size as with perspective
    view.up *= wall_z;
    // A rotated view; the eye moves by the same distance along its own axis.
    const glm::dmat3 turn(0.0, 0.0, -1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0);
    view = {
        turn * view.eye + glm::dvec3(7.0, 8.0, 9.0), turn * view.forward, turn * view.right, turn * view.up, true, 0};
    many = error_of(samples.filtered_by(*wavelet_, view), samples.truth());
    if (i == 0) one = many;
  }
  EXPECT_LT(many, 0.65 * one);
}

// A card at depth 2 in front of a slightly darker wall, with a difference below the noise. As the eye moves, more of
// the wall becomes visible.
TEST_P(DenoiserHistory, DisocclusionsLeaveNoGhosting) {
  constexpr int first = 30;
  constexpr int step = 5;  // pixels of the card, which are two of the wall
  constexpr int views = 5;
  const auto scene = [](int i) {
    return [i](int x, int) {
      const bool card = x < first - step * i;
      return Pixel{.front = glm::vec3(card ? 0.13F : 0.1F),
                   .spread = 0.9F,
                   .normal = {0.0F, 0.0F, 1.0F},
                   .albedo = glm::vec3(0.5F),
                   .z = card ? 2.0F : float(wall_z)};
    };
  };
  std::vector<glm::vec4> last;
  for (int i = 0; i < views; ++i) {
    const Samples samples(gl_, size_, 2, scene(i), static_cast<unsigned>(i + 1));
    last = samples.filtered_by(*wavelet_, view_at(2 * i * wall_pixel, size_));
  }
  // The area that the last step uncovered was covered in all earlier views.
  double mean = 0.0;
  for (int y = 0; y < size_.y; ++y) {
    for (int x = first - step * (views - 1); x < first - step * (views - 2); ++x) {
      mean += last[static_cast<std::size_t>(y * size_.x + x)].x / double(step * size_.y);
    }
  }
  EXPECT_NEAR(mean, 0.1, 0.008);
}

// The light changed without a reset of the history.
TEST_P(DenoiserHistory, OutdatedHistoryFadesOut) {
  const auto lit = [](float light) {
    return [light](int, int) { return Pixel{.front = glm::vec3(light), .z = 5.0F}; };
  };
  const PictureView view = view_at(0.0, size_);
  for (const unsigned count : {1U, 4U, 64U}) {
    wavelet_->free();
    for (unsigned i = 0; i < 8; ++i) {
      static_cast<void>(Samples(gl_, size_, 4, lit(4.0F), i + 1).filtered_by(*wavelet_, view));
    }
    const Samples now(gl_, size_, count, lit(1.0F), 9);
    const auto with = now.filtered_by(*wavelet_, view);
    EXPECT_NEAR(moments_of(with).mean, 1.0, count == 1 ? 0.3 : 0.1) << count;
    if (count == 64) {
      EXPECT_EQ(with, now.filtered(programs_));
    }
  }
}

TEST_P(DenoiserHistory, OtherScenesAndViewersHaveSeparateHistory) {
  static_cast<void>(after(8, 0));
  PictureView other = view_at(0.0, size_);
  other.scene = 7;
  const Samples samples(gl_, size_, 1, wall_from(0), 20);
  const auto alone = samples.filtered(programs_);
  EXPECT_EQ(samples.filtered_by(*wavelet_, other), alone);
  static_cast<void>(after(8, 0));
  EXPECT_NE(samples.filtered_by(*wavelet_, view_at(0.0, size_)), alone);
  // Without a view, the history is neither used nor kept.
  EXPECT_EQ(samples.filtered_by(*wavelet_, std::nullopt), alone);
  wavelet_->free();
  EXPECT_EQ(samples.filtered_by(*wavelet_, view_at(0.0, size_)), alone);
  EXPECT_EQ(wavelet_->bytes(), (112U + 16U + 32U) * static_cast<unsigned>(size_.x * size_.y));
}

// Filtering the same image again, as samples arrive, does not count them twice.
TEST_P(DenoiserHistory, ImageIsNotItsOwnHistory) {
  const Samples samples(gl_, size_, 1, wall_from(0), 3);
  const auto alone = samples.filtered(programs_);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(samples.filtered_by(*wavelet_, view_at(0.0, size_)), alone) << i;
}

TEST_P(DenoiserHistory, NonFiniteHistoryIsDiscarded) {
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), infinite, -infinite}) {
    wavelet_->free();
    Samples before(gl_, size_, 2, wall_from(0), 1);
    for (std::size_t i = 0; i < before.sums().size(); i += 3) before.sums()[i].y = bad;
    static_cast<void>(before.filtered_by(*wavelet_, view_at(0.0, size_)));
    const Samples now(gl_, size_, 2, wall_from(1), 2);
    const auto clean = now.filtered_by(*wavelet_, view_at(wall_pixel, size_));
    for (std::size_t i = 0; i < clean.size(); ++i) ASSERT_NEAR(clean[i].y, now.truth()[i].y, 2.0) << i;
  }
}

TEST_P(DenoiserHistory, SizeMayChange) {
  unsigned seed = 1;
  for (const glm::ivec2 size : {glm::ivec2(1, 1), {40, 1}, {65, 33}, {7, 9}, {1, 40}, {64, 64}, {2, 3}, {1, 1}}) {
    const Samples samples(
        gl_, size, 4, [](int, int) { return Pixel{.z = 5.0F}; }, ++seed);
    const auto clean = samples.filtered_by(*wavelet_, view_at(0.02 * seed, size));
    for (const glm::vec4& v : clean) EXPECT_NEAR(v.x, 1.0, 0.5) << size.x << " x " << size.y;
  }
}

// A coarse preview may be history for a finer image, but does not replace a finer history.
TEST_P(DenoiserHistory, CoarseImagesDoNotReplaceFineHistory) {
  std::vector<glm::vec4> truth;
  const double one = error_of(after(1, 0, &truth), truth);
  static_cast<void>(after(12, 0));
  const glm::ivec2 coarse(size_ / 4);
  const Samples rough(gl_, coarse, 1, [](int, int) {
    return Pixel{
        .front = glm::vec3(0.95F), .normal = {0.0F, 0.0F, 1.0F}, .albedo = glm::vec3(0.5F), .z = float(wall_z)};
  });
  PictureView wide = view_at(0.0, size_);
  static_cast<void>(rough.filtered_by(*wavelet_, wide));
  const Samples fine(gl_, size_, 1, wall_from(0), 30);
  EXPECT_LT(error_of(fine.filtered_by(*wavelet_, wide), truth), 0.5 * one);
}

TEST_P(DenoiserHistory, WithoutMemoryImagesAreFilteredWithoutHistory) {
  const Samples samples(gl_, size_, 1, wall_from(0), 20);
  const auto alone = samples.filtered(programs_);
  cumulet::test::FakeGl fake(cumulet::headless::Context::get_proc, context_.get());
  const gl::FunctionsPtr functions = gl::load_functions(cumulet::test::FakeGl::get_proc, &fake);
  // Numbers of textures; each takes two calls.
  constexpr std::int64_t filter = 2 * 7;
  constexpr std::int64_t history = 2 * 3;
  for (std::int64_t n = 0; n < filter + history; ++n) {
    Wavelet wavelet(functions, programs_);
    std::optional<cumulet::Error> error;
    fake.fail_allocation(n);
    if (n < filter) {
      EXPECT_THROW(samples.filtered_by(wavelet, view_at(0.0, size_)), cumulet::Error) << n;
      continue;
    }
    EXPECT_EQ(samples.filtered_by(wavelet, view_at(0.0, size_), MeansBackground::left_out, &error), alone) << n;
    fake.fail_allocation(-1);
    ASSERT_TRUE(error) << n;
    EXPECT_EQ(error->code(), cumulet::ErrorCode::out_of_memory);
    EXPECT_EQ(wavelet.bytes(), 112U * static_cast<unsigned>(size_.x * size_.y));
    // The error is returned once.
    EXPECT_EQ(samples.filtered_by(wavelet, view_at(0.0, size_), MeansBackground::left_out, &error), alone) << n;
    EXPECT_FALSE(error) << n;
  }
}

CUMULET_ON_BACKENDS(DenoiserHistory);

}  // namespace
