// The estimated time of the dispatches that build a grid.

#include "render/pacing/grid_pace.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace {

using namespace cumulet;

// A host with 60 frames per second and GPU work of its own. It notices the end of a batch only at the next frame.
TEST(GpuGridBuildPace, BusyHostDoesNotStarveTheBuild) {
  using render::GridPace;
  const gl::ProgramKey key{"grid_cells.comp", {"CM_STAGE 1"}};
  for (const double guess : {1.0, 0.2, 5.0}) {  // relative to the true cost
    for (const double other_ms : {0.0, 17.0}) {
      SCOPED_TRACE(testing::Message() << guess << " " << other_ms);
      GridPace pace;
      constexpr double truth = 7.5e-6;
      constexpr double all = 2e7;
      double done = 0.0;
      int frames = 0;
      double longest = 0.0;
      while (done < all && frames < 10000) {
        ++frames;
        std::vector<GridPace::Sent> sent;
        double thought = 0.0;
        double took = 0.0;
        while (thought < 8.0 && done < all) {
          const double ms = pace.ms(key, guess * truth);
          const double items = std::clamp(1.0 / ms, 64.0, 65535.0 * 64.0);
          sent.push_back({key, guess * truth, items});
          thought += ms * items;
          took += truth * items;
          longest = std::max(longest, truth * items);
          done += items;
        }
        const double seen = 16.7 * std::ceil((took + other_ms) / 16.7);
        pace.learn(sent, seen, GridPace::Measured::at_most);
      }
      EXPECT_LT(frames, 700);
      EXPECT_LT(longest, 6.0);
    }
  }
  // With exact measurements, the estimate converges to the true cost and stays there.
  GridPace pace;
  for (int i = 0; i < 40; ++i) {
    const GridPace::Sent sent{key, 1e-6, 1e5};
    pace.learn({sent, sent, sent}, 3.0 * 1e5 * 2e-5, GridPace::Measured::exactly);
  }
  EXPECT_NEAR(pace.ms(key, 1e-6), 2e-5, 1e-7);
}

}  // namespace
