// Accumulation: tiles, passes and the noise target, without GL.

#include "render/film/accumulation.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace {

using namespace cumulet;
using render::Accumulation;
using render::AccumulationSettings;

constexpr glm::uvec2 small(20U, 12U);   // one tile, in which each pixel has a lane
constexpr glm::uvec2 wide(1100U, 64U);  // two tiles, the first with more pixels than lanes
constexpr std::uint64_t small_area = 240;

AccumulationSettings settings(glm::uvec2 size, std::uint32_t samples) {
  return {.box = {glm::uvec2(0U), size}, .target_samples = samples, .max_lanes = Accumulation::min_lanes};
}

// Finishes the samples of the tile, as dispatches do.
void finish_tile(Accumulation& accumulation, std::uint64_t samples = 0) {
  for (render::Block& block : *accumulation.blocks()) block.unfinished = block.empty = 0;
  accumulation.count()->finished += samples;
  accumulation.end_tile();
}

// Measures the error of the tile of a small picture with mean luminance 1.
void measure(Accumulation& accumulation, double noise) {
  ASSERT_TRUE(accumulation.awaits_error());
  const auto errors = accumulation.expect_error();
  EXPECT_FALSE(accumulation.awaits_error());
  accumulation.end_tile();
  EXPECT_FALSE(accumulation.done()) << "the error is not known yet";
  const double pixels = double(small_area) / 6.0;
  const double squared = noise * noise * pixels;
  errors->assign(6, {{0.5 * squared, 0.5 * squared}, pixels, pixels});
  accumulation.end_tile();
}

TEST(Accumulation, HasOnePassIfEachPixelHasALane) {
  Accumulation accumulation(settings(small, 4));
  EXPECT_EQ(accumulation.pass_target(), 4U);
  EXPECT_EQ(accumulation.squares().size(), 6U);
  ASSERT_EQ(accumulation.blocks()->size(), 1U);
  EXPECT_EQ(accumulation.blocks()->front().unfinished, small_area);
  EXPECT_TRUE(accumulation.has_holes());
  accumulation.blocks()->front().unfinished = 5;
  accumulation.blocks()->front().empty = 0;
  accumulation.count()->finished = 2 * small_area;
  accumulation.end_tile();
  EXPECT_TRUE(accumulation.complete());
  EXPECT_FALSE(accumulation.has_holes());
  EXPECT_FALSE(accumulation.done());
  EXPECT_DOUBLE_EQ(accumulation.progress(), 0.5);
  finish_tile(accumulation, 2 * small_area);
  EXPECT_TRUE(accumulation.done());
  EXPECT_DOUBLE_EQ(accumulation.progress(), 1.0);
}

TEST(Accumulation, EachPassEndsInEveryTile) {
  Accumulation accumulation(settings(wide, 4));
  std::vector<std::uint32_t> targets;
  std::vector<std::uint32_t> corners;
  while (!accumulation.done() && targets.size() < 10) {
    targets.push_back(accumulation.pass_target());
    corners.push_back(accumulation.tile_corner().x);
    EXPECT_EQ(accumulation.complete(), targets.size() > 2);
    finish_tile(accumulation);
  }
  EXPECT_EQ(targets, (std::vector<std::uint32_t>{1, 1, 2, 2, 4, 4}));
  EXPECT_EQ(corners, (std::vector<std::uint32_t>{0, 1024, 0, 1024, 0, 1024}));
}

TEST(Accumulation, LaterPassesHaveAsManyLanesAsTheDeviceRuns) {
  AccumulationSettings many = settings(wide, 4);
  many.max_lanes = 48 * CM_BLOCK_LANES;
  Accumulation accumulation(many);
  ASSERT_EQ(accumulation.lanes(), 48 * CM_BLOCK_LANES);
  accumulation.limit_lanes(40 * CM_BLOCK_LANES + 64);
  EXPECT_EQ(accumulation.lanes(), 48 * CM_BLOCK_LANES) << "the lanes of the tile have paths";
  finish_tile(accumulation);
  EXPECT_EQ(accumulation.lanes(), 40 * CM_BLOCK_LANES);
  accumulation.limit_lanes(1000);
  finish_tile(accumulation);
  EXPECT_EQ(accumulation.lanes(), Accumulation::min_lanes);
  Accumulation has_a_lane_for_each_pixel(settings(small, 4));
  has_a_lane_for_each_pixel.limit_lanes(64);
  has_a_lane_for_each_pixel.begin_tile();
  EXPECT_EQ(has_a_lane_for_each_pixel.lanes(), 384U);
}

TEST(Accumulation, HasASlotForEachPixelOfATile) {
  EXPECT_EQ(Accumulation(settings(small, 1)).slots(), 24U * 16U) << "whole blocks of 8x8 pixels";
  EXPECT_EQ(Accumulation(settings(wide, 1)).slots(), 1024U * 64U);
}

TEST(Accumulation, ShortPicturesHaveTwoPasses) {
  const auto passes = [](std::uint32_t samples) {
    AccumulationSettings quick = settings(wide, samples);
    quick.short_picture = 32;
    Accumulation accumulation(quick);
    std::vector<std::uint32_t> targets;
    while (!accumulation.done() && targets.size() < 20) {
      EXPECT_EQ(accumulation.complete(), !targets.empty());
      targets.push_back(accumulation.pass_target());
      finish_tile(accumulation);
      finish_tile(accumulation);  // the other tile
    }
    return targets;
  };
  EXPECT_EQ(passes(32), (std::vector<std::uint32_t>{1, 32}));
  // A host may stop a longer picture, whose pixels then have similar numbers of samples.
  EXPECT_EQ(passes(33), (std::vector<std::uint32_t>{1, 2, 4, 8, 16, 32, 33}));
}

TEST(Accumulation, MeasuresAfterTwoPassesIfThePictureIsShort) {
  AccumulationSettings quick = settings(wide, 64);
  quick.short_picture = 64;
  quick.noise_target = 0.1;
  Accumulation accumulation(quick);
  EXPECT_EQ(accumulation.pass_target(), 1U);
  finish_tile(accumulation);
  finish_tile(accumulation);
  EXPECT_EQ(accumulation.pass_target(), Accumulation::first_measured);
}

TEST(Accumulation, MoreSamplesContinueADoneOne) {
  Accumulation accumulation(settings(small, 4));
  finish_tile(accumulation, 4 * small_area);
  accumulation.extend(4, {});
  EXPECT_TRUE(accumulation.done());
  accumulation.extend(9, {});
  EXPECT_FALSE(accumulation.done());
  EXPECT_TRUE(accumulation.complete());
  EXPECT_EQ(accumulation.pass_target(), 9U);
  EXPECT_EQ(accumulation.samples(), 4 * small_area);
  finish_tile(accumulation, 5 * small_area);
  EXPECT_TRUE(accumulation.done());
}

TEST(Accumulation, EndsAtTheNoiseTarget) {
  AccumulationSettings with_target = settings(small, 64);
  with_target.noise_target = 0.1;
  Accumulation accumulation(with_target);
  EXPECT_EQ(accumulation.pass_target(), Accumulation::first_measured);
  finish_tile(accumulation);
  measure(accumulation, 0.2);
  EXPECT_FALSE(accumulation.done());
  EXPECT_EQ(accumulation.pass_target(), 23U) << "1.41 times as many samples";
  finish_tile(accumulation);
  measure(accumulation, 0.05);
  EXPECT_TRUE(accumulation.done());
}

TEST(Accumulation, ContinuesFromRestoredSamples) {
  Accumulation accumulation(settings(small, 8));
  accumulation.go_on_from({.least = 0, .most = 8, .all = 900}, {});
  EXPECT_FALSE(accumulation.complete());
  accumulation.go_on_from({.least = 4, .most = 8, .all = 1000}, {});
  EXPECT_TRUE(accumulation.complete());
  EXPECT_FALSE(accumulation.done());
  EXPECT_EQ(accumulation.pass_target(), 8U);
  EXPECT_EQ(accumulation.samples(), 1000U);
}

TEST(Accumulation, DebugViewsHaveOneValuePerPixel) {
  Accumulation accumulation(settings(small, 1));
  accumulation.set_known_pixels(small_area / 2);
  EXPECT_FALSE(accumulation.complete());
  EXPECT_TRUE(accumulation.has_holes());
  EXPECT_DOUBLE_EQ(accumulation.progress(), 0.5);
  accumulation.set_known_pixels(small_area);
  EXPECT_TRUE(accumulation.done());
  EXPECT_FALSE(accumulation.has_holes());
}

}  // namespace
