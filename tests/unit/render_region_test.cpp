// Render regions (crop windows): pixels inside are bit-identical to those of the whole image, and nothing else is
// rendered.

#include "render/pacing/region.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <optional>
#include <vector>

#include "support/c_viewer.hpp"

namespace {

using namespace cumulet::test;
using cumulet::headless::Backend;
using cumulet::headless::Context;
using cumulet::render::PixelBox;
using cumulet::render::Region;

constexpr std::array<float, 4> whole{};

PixelBox pixels_of(const std::array<float, 4>& region, std::uint32_t width, std::uint32_t height) {
  std::array<std::uint32_t, 4> pixels{};
  EXPECT_EQ(cumulet_region_pixels(region.data(), width, height, pixels.data()), CUMULET_OK);
  return {{pixels[0], pixels[1]}, {pixels[2], pixels[3]}};
}

TEST(RegionPixels, ContainPixelsByTheirCenters) {
  EXPECT_EQ(pixels_of(whole, 1920, 1080), (PixelBox{{0, 0}, {1920, 1080}}));
  EXPECT_EQ(pixels_of({0.5F, 0.25F, 0.25F, 0.5F}, 8, 8), (PixelBox{{4, 2}, {2, 4}}));
  EXPECT_EQ(pixels_of({0.5F, 0.25F, 0.0F, 0.0F}, 8, 8), (PixelBox{{4, 2}, {4, 6}})) << "to the end";
  EXPECT_EQ(pixels_of({0.5F, 0.5F, 1.0F, 1.0F}, 8, 8), (PixelBox{{4, 4}, {4, 4}})) << "no farther than there are any";
  EXPECT_EQ(pixels_of({1.0F, 1.0F, 0.0F, 0.0F}, 8, 8), (PixelBox{{7, 7}, {1, 1}})) << "one at least";
  EXPECT_EQ(pixels_of({0.40F, 0.40F, 0.01F, 0.01F}, 8, 8), (PixelBox{{3, 3}, {1, 1}}));
  EXPECT_EQ(pixels_of({0.0F, 0.0F, 1e-6F, 1e-6F}, 1, 1), (PixelBox{{0, 0}, {1, 1}}));
  // A region given in pixels selects exactly those.
  for (const std::uint32_t size : {7U, 100U, 1921U, 16384U}) {
    for (std::uint32_t first = 0; first < size; first += 1 + size / 13) {
      for (const std::uint32_t count : {1U, 2U, size / 3, size - first}) {
        if (count == 0 || first + count > size) continue;
        const auto part = [&](std::uint32_t n) { return static_cast<float>(double(n) / size); };
        const std::array<float, 4> region{part(first), part(first), part(count), part(count)};
        EXPECT_EQ(pixels_of(region, size, size), (PixelBox{{first, first}, {count, count}})) << size;
      }
    }
  }
}

TEST(RegionPixels, AdjacentRegionsDoNotOverlap) {
  constexpr std::uint32_t size = 1000;
  constexpr int parts = 7;
  for (float shift : {0.0F, 0.0123F, 0.0005F}) {
    std::uint32_t next = pixels_of({shift, 0.0F, 0.1F, 0.0F}, size, 1).first.x;
    for (int i = 0; i < parts; ++i) {
      const float low = shift + static_cast<float>(i) / parts * 0.9F;
      const float high = shift + static_cast<float>(i + 1) / parts * 0.9F;
      const PixelBox box = pixels_of({low, 0.0F, high - low, 0.0F}, size, 1);
      EXPECT_EQ(box.first.x, next);
      next = box.first.x + box.size.x;
    }
  }
}

// 0.1 + 0.6 and 0.7 differ as floats, and the center of pixel 787 is between them.
TEST(RegionPixels, AdjacentRegionsWithRoundingDoNotOverlap) {
  const PixelBox first = pixels_of({0.1F, 0.0F, 0.6F, 0.0F}, 1125, 1);
  const PixelBox second = pixels_of({0.7F, 0.0F, 0.0F, 0.0F}, 1125, 1);
  EXPECT_EQ(first.first.x + first.size.x, second.first.x);
}

TEST(RegionPixels, MarginIsClampedToTheImage) {
  const Region region{{0.25F, 0.0F}, {0.5F, 0.25F}};
  EXPECT_EQ(region.pixels({8, 8}, 1), (PixelBox{{1, 0}, {6, 3}}));
  EXPECT_EQ(Region{}.pixels({8, 8}, 3), (PixelBox{{0, 0}, {8, 8}}));
}

TEST(RegionPixels, InvalidRegionsAreRejected) {
  std::array<std::uint32_t, 4> pixels{1, 2, 3, 4};
  constexpr auto refused = CUMULET_ERROR_INVALID_ARGUMENT;
  EXPECT_EQ(cumulet_region_pixels(nullptr, 8, 8, pixels.data()), refused);
  EXPECT_EQ(cumulet_region_pixels(whole.data(), 8, 8, nullptr), refused);
  EXPECT_EQ(cumulet_region_pixels(whole.data(), 0, 8, pixels.data()), refused);
  EXPECT_EQ(cumulet_region_pixels(whole.data(), 8, 16385, pixels.data()), refused);
  for (const float bad : {-0.1F, 1.1F, NAN, INFINITY}) {
    const std::array<float, 4> region{0.0F, bad, 0.0F, 0.0F};
    EXPECT_EQ(cumulet_region_pixels(region.data(), 8, 8, pixels.data()), refused);
  }
  EXPECT_EQ(pixels, (std::array<std::uint32_t, 4>{1, 2, 3, 4}));
}

constexpr std::uint32_t side = 40;
constexpr std::size_t count = std::size_t{side} * side;
constexpr std::array<float, 4> part{0.3F, 0.2F, 0.4F, 0.55F};

class RenderRegion : public CViewerTest {
 protected:
  RenderRegion() : CViewerTest(side, side) {}
  void SetUp() override {
    CViewerTest::SetUp();
    if (IsSkipped()) return;
    gl_ = load_gl(Context::get_proc, context_.get());
    target_.emplace(gl_, side, side);
    ASSERT_EQ(cumulet_set_volume(viewer_.get(), ball_.get()), CUMULET_OK);
  }

  void set(const std::array<float, 4>& region) {
    std::copy(region.begin(), region.end(), sampling_.region);
    ASSERT_EQ(cumulet_set_sampling(viewer_.get(), &sampling_), CUMULET_OK) << cumulet_last_error(viewer_.get());
  }
  // Compares with another image inside the region and with a constant outside.
  template <class Value>
  static void expect_part(const std::vector<Value>& made, const std::vector<Value>& of, Value elsewhere,
                          const std::array<float, 4>& region = part) {
    ASSERT_EQ(made.size(), of.size());
    const PixelBox box = pixels_of(region, side, side);
    const std::size_t channels = made.size() / count;
    for (std::size_t i = 0; i < made.size(); ++i) {
      const glm::uvec2 pixel(i / channels % side, i / channels / side);
      const Value wanted = box.holds(pixel) ? of[i] : elsewhere;
      ASSERT_EQ(std::memcmp(&made[i], &wanted, sizeof wanted), 0)
          << pixel.x << ", " << pixel.y << ": " << +made[i] << ", not " << +wanted;
    }
  }

  GladGLContext gl_{};
  std::optional<HostTarget> target_;
  VolumeRef ball_ = make_ball(16, 2.0F);
  cumulet_sampling_desc sampling_ = [] {
    auto desc = make_desc<cumulet_sampling_desc>();
    desc.samples = 6;
    desc.preview = CUMULET_PREVIEW_OFF;
    desc.separate_volume_aov = 1;
    return desc;
  }();
};
CUMULET_ON_BACKENDS(RenderRegion);

TEST_P(RenderRegion, IsBitIdenticalToTheFullImage) {
  const SurfacesRef panes = make_panes(3.0F);
  for (const bool surfaces : {false, true}) {
    ASSERT_EQ(cumulet_set_surfaces(viewer_.get(), surfaces ? panes.get() : nullptr), CUMULET_OK);
    set(whole);
    make();
    const std::vector<float> all = linear();
    const std::vector<float> alone = aov(CUMULET_AOV_VOLUME, 4);
    const std::vector<float> normal = aov(CUMULET_AOV_NORMAL, 3);
    const std::vector<float> depth = aov(CUMULET_AOV_VOLUME_DEPTH, 1);
    const std::vector<float> clear = aov(CUMULET_AOV_TRANSMITTANCE, 1);
    const std::vector<float> error = aov(CUMULET_AOV_ERROR, 1);
    set(part);
    make();
    expect_part(linear(), all, 0.0F);
    expect_part(aov(CUMULET_AOV_VOLUME, 4), alone, 0.0F);
    expect_part(aov(CUMULET_AOV_NORMAL, 3), normal, 0.0F);
    expect_part(aov(CUMULET_AOV_VOLUME_DEPTH, 1), depth, 0.0F);
    expect_part(aov(CUMULET_AOV_TRANSMITTANCE, 1), clear, 0.0F);
    expect_part(aov(CUMULET_AOV_ERROR, 1), error, INFINITY);
  }
}

TEST_P(RenderRegion, TracesOnlyItsOwnPixels) {
  set(part);
  const auto result = make();
  EXPECT_EQ(result.width, side);
  EXPECT_EQ(result.progress, 1.0);
  auto stats = make_desc<cumulet_stats>();
  ASSERT_EQ(cumulet_get_stats(viewer_.get(), &stats), CUMULET_OK);
  EXPECT_EQ(stats.samples, pixels_of(part, side, side).area() * sampling_.samples);
  // In small steps, the progress reaches 1 as well.
  auto frame = target_->frame();
  frame.target = CUMULET_TARGET_NONE;
  frame.budget_ms = 0.1;
  sampling_.seed = 1;
  set(part);
  double before = 0.0;
  auto step = make_desc<cumulet_frame_result>();
  do {
    ASSERT_EQ(cumulet_render(viewer_.get(), &frame, &step), CUMULET_OK);
    EXPECT_GE(step.progress, before);
    EXPECT_LE(step.progress, 1.0);
    before = step.progress;
  } while ((step.flags & CUMULET_RENDER_CONVERGED) == 0);
  EXPECT_EQ(before, 1.0);
}

// Several tiles, and a region of fewer pixels than lanes in an image of more.
TEST_P(RenderRegion, LargeImageIsBitIdenticalToTheFullImage) {
  constexpr std::uint32_t width = 1200;
  constexpr std::uint32_t height = 40;
  constexpr std::array<float, 4> across{0.05F, 0.25F, 0.9F, 0.5F};
  sampling_.samples = 2;
  auto frame = target_->frame();
  frame.target = CUMULET_TARGET_NONE;
  frame.width = width;
  frame.height = height;
  std::vector<float> all(std::size_t{4} * width * height);
  std::vector<float> made(all.size());
  set(whole);
  converge(viewer_.get(), frame);
  ASSERT_EQ(cumulet_read_linear(viewer_.get(), all.data(), all.size()), CUMULET_OK);
  set(across);
  converge(viewer_.get(), frame);
  ASSERT_EQ(cumulet_read_linear(viewer_.get(), made.data(), made.size()), CUMULET_OK);
  const PixelBox box = pixels_of(across, width, height);
  EXPECT_GT(box.size.x, 1024U) << "of two tiles";
  for (std::size_t i = 0; i < made.size(); ++i) {
    const glm::uvec2 pixel(i / 4 % width, i / 4 / width);
    ASSERT_EQ(made[i], box.holds(pixel) ? all[i] : 0.0F) << pixel.x << ", " << pixel.y;
  }
}

TEST_P(RenderRegion, StopsByItsOwnNoise) {
  sampling_.samples = 4096;
  sampling_.noise_target_percent = 8.0F;
  set(part);
  make();
  double noise = 0.0;
  ASSERT_EQ(cumulet_measure_noise(viewer_.get(), &noise), CUMULET_OK);
  EXPECT_LE(noise, 0.08 * 1.0001);
  EXPECT_GT(noise, 0.0);
  auto stats = make_desc<cumulet_stats>();
  ASSERT_EQ(cumulet_get_stats(viewer_.get(), &stats), CUMULET_OK);
  EXPECT_LT(stats.samples, pixels_of(part, side, side).area() * 4096);
}

TEST_P(RenderRegion, ResumesFromASavedState) {
  set(part);
  make();
  const std::vector<float> wanted = linear();
  std::size_t size = 0;
  ASSERT_EQ(cumulet_read_accumulation(viewer_.get(), nullptr, &size), CUMULET_OK);
  std::vector<std::byte> kept(size);
  sampling_.samples = 3;
  set(whole);
  set(part);
  make();
  ASSERT_EQ(cumulet_read_accumulation(viewer_.get(), kept.data(), &size), CUMULET_OK);
  sampling_.samples = 6;
  auto frame = target_->frame();
  frame.target = CUMULET_TARGET_NONE;
  frame.budget_ms = 0.01;
  sampling_.seed = 9;
  set(part);
  ASSERT_EQ(cumulet_render(viewer_.get(), &frame, nullptr), CUMULET_OK);
  sampling_.seed = 0;
  set(part);
  ASSERT_EQ(cumulet_render(viewer_.get(), &frame, nullptr), CUMULET_OK);
  ASSERT_EQ(cumulet_restore_accumulation(viewer_.get(), kept.data(), size), CUMULET_OK)
      << cumulet_last_error(viewer_.get());
  make();
  EXPECT_EQ(linear(), wanted);
  // An accumulation of another region is rejected.
  set(whole);
  ASSERT_EQ(cumulet_render(viewer_.get(), &frame, nullptr), CUMULET_OK);
  EXPECT_EQ(cumulet_restore_accumulation(viewer_.get(), kept.data(), size), CUMULET_ERROR_INVALID_ARGUMENT);
}

TEST_P(RenderRegion, KeepsTheRestOfTheTarget) {
  const std::array<float, 4> before{0.2F, 0.4F, 0.6F, 0.8F};
  for (const int flip : {0, 1}) {
    const auto draw = [&](const std::array<float, 4>& region) {
      set(region);
      make();
      target_->clear(before);
      auto frame = target_->frame();
      frame.flip_y = flip;
      EXPECT_EQ(cumulet_render(viewer_.get(), &frame, nullptr), CUMULET_OK);
      return target_->pixels();
    };
    const std::vector<std::uint8_t> all = draw(whole);
    const std::vector<std::uint8_t> made = draw(part);
    const PixelBox box = pixels_of(part, side, side);
    const std::array<int, 4> left{51, 102, 153, 204};
    for (std::size_t i = 0; i < made.size(); ++i) {
      const auto row = static_cast<std::uint32_t>(i / 4 / side);
      const glm::uvec2 pixel(i / 4 % side, flip != 0 ? row : side - 1 - row);
      ASSERT_EQ(made[i], box.holds(pixel) ? all[i] : left.at(i % 4)) << pixel.x << ", " << pixel.y;
    }
  }
}

TEST_P(RenderRegion, DisplayReadBackIsTransparentOutside) {
  set(whole);
  make();
  std::vector<std::uint8_t> all(4 * count);
  ASSERT_EQ(cumulet_read_display(viewer_.get(), all.data(), all.size()), CUMULET_OK);
  set(part);
  make();
  std::vector<std::uint8_t> made(4 * count);
  ASSERT_EQ(cumulet_read_display(viewer_.get(), made.data(), made.size()), CUMULET_OK);
  expect_part(made, all, std::uint8_t{0});
}

// Pixels beyond the region are not filter inputs: a region of one color stays constant up to its edges.
TEST_P(RenderRegion, IsDenoisedSeparately) {
  auto display = make_desc<cumulet_display_desc>();
  ASSERT_EQ(cumulet_set_display(viewer_.get(), &display), CUMULET_OK);
  ASSERT_EQ(cumulet_set_volume(viewer_.get(), ball_.get()), CUMULET_OK);
  auto medium = make_desc<cumulet_medium_desc>();
  medium.density_scale = 1e-6;
  ASSERT_EQ(cumulet_set_medium(viewer_.get(), &medium), CUMULET_OK);
  set(part);
  make();
  auto denoise = make_desc<cumulet_denoise_desc>();
  std::vector<float> made(4 * count);
  ASSERT_EQ(cumulet_read_denoised(viewer_.get(), &denoise, made.data(), made.size()), CUMULET_OK)
      << cumulet_last_error(viewer_.get());
  const std::vector<float> raw = linear();
  const PixelBox box = pixels_of(part, side, side);
  for (std::size_t i = 0; i < made.size(); ++i) {
    const bool inside = box.holds({i / 4 % side, i / 4 / side});
    ASSERT_NEAR(made[i], inside ? raw[i] : 0.0F, 1e-4F) << i;
  }
}

// A coarse preview covers the region completely, so that no pixel inside shows unrendered values.
TEST_P(RenderRegion, PreviewCoversTheRegionToItsEdges) {
  sampling_.preview = CUMULET_PREVIEW_AUTO;
  sampling_.samples = 4;
  sampling_.separate_volume_aov = 0;
  set(part);
  auto light = make_desc<cumulet_sun_sky_desc>();
  for (float& value : light.sky_radiance) value = 1.0F;
  ASSERT_EQ(cumulet_set_sun_sky(viewer_.get(), &light), CUMULET_OK);
  auto medium = make_desc<cumulet_medium_desc>();
  medium.density_scale = 1e-6;
  ASSERT_EQ(cumulet_set_medium(viewer_.get(), &medium), CUMULET_OK);
  ASSERT_EQ(cumulet_wait(viewer_.get(), -1.0), CUMULET_OK);
  auto display = make_desc<cumulet_display_desc>();
  display.tone_map = CUMULET_TONE_MAP_CLIP;
  ASSERT_EQ(cumulet_set_display(viewer_.get(), &display), CUMULET_OK);
  auto frame = target_->frame();
  frame.budget_ms = 0.01;
  auto result = make_desc<cumulet_frame_result>();
  const PixelBox box = pixels_of(part, side, side);
  int coarse = 0;
  for (int i = 0; i < 2000 && (result.flags & CUMULET_RENDER_CONVERGED) == 0; ++i) {
    target_->clear({0.0F, 0.0F, 0.0F, 0.0F});
    ASSERT_EQ(cumulet_render(viewer_.get(), &frame, &result), CUMULET_OK) << cumulet_last_error(viewer_.get());
    if (result.width == 0) continue;
    if (result.width < side) ++coarse;
    const std::vector<std::uint8_t> made = target_->pixels();
    for (std::size_t at = 0; at < made.size(); at += 4) {
      const glm::uvec2 pixel(at / 4 % side, side - 1 - at / 4 / side);
      // The whole image is sky.
      if (box.holds(pixel)) {
        ASSERT_GT(made[at], 200) << pixel.x << ", " << pixel.y << " of " << result.width;
      } else {
        ASSERT_EQ(made[at + 3], 0) << pixel.x << ", " << pixel.y << " of " << result.width;
      }
    }
  }
  EXPECT_GT(coarse, 0);
}

}  // namespace
