// The grid cache of several volumes: grids are built one after another and kept while they are requested.

#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <thread>

#include "support/volumes.hpp"
#include "viewer/grid_shelf.hpp"

namespace {

namespace viewer = cumulet::viewer;

class GridCacheTest : public testing::Test {
 protected:
  static viewer::VolumeAssetPtr asset(int side, unsigned seed) {
    return std::make_shared<const viewer::VolumeAsset>(
        cumulet::test::noise_volume(glm::ivec3(side), glm::ivec3(0), static_cast<int>(seed)));
  }
  std::atomic<int> told_ = 0;
  viewer::GridShelf shelf_{{}, [this] { ++told_; }};
};

TEST_F(GridCacheTest, KeepsRequestedGrids) {
  const viewer::GridShelf::Wish a{asset(16, 1), {}};
  const viewer::GridShelf::Wish b{asset(16, 2), {}};
  shelf_.wish({a, a});
  ASSERT_TRUE(shelf_.wait(std::nullopt));
  ASSERT_TRUE(shelf_.built(a));
  const auto made = shelf_.built(a)->source;
  EXPECT_EQ(shelf_.revision(), 1U);
  shelf_.wish({b, a});
  ASSERT_TRUE(shelf_.wait(std::nullopt));
  EXPECT_EQ(shelf_.built(a)->source, made);
  ASSERT_TRUE(shelf_.built(b));
  EXPECT_EQ(shelf_.revision(), 2U);
  shelf_.wish({b});
  EXPECT_FALSE(shelf_.built(a));
  EXPECT_TRUE(shelf_.built(b));
  EXPECT_FALSE(shelf_.busy());
  EXPECT_GE(told_, 2);
}

// A build in progress is finished and delivered, even if requests change meanwhile.
TEST_F(GridCacheTest, FinishesBuildsInProgress) {
  const viewer::GridShelf::Wish slow{asset(96, 1), {}};
  const viewer::GridShelf::Wish next{asset(16, 2), {}};
  shelf_.wish({slow});
  while (!shelf_.is_under_way(slow) && !shelf_.built(slow)) std::this_thread::yield();
  shelf_.wish({next});
  const bool under_way = shelf_.is_under_way(slow);  // else it was already built
  ASSERT_TRUE(shelf_.wait(std::nullopt));
  EXPECT_EQ(shelf_.built(slow).has_value(), under_way);
  EXPECT_TRUE(shelf_.built(next));
  shelf_.wish({next});
  EXPECT_FALSE(shelf_.built(slow));
}

TEST_F(GridCacheTest, RequestsMayChangeDuringABuild) {
  const viewer::GridShelf::Wish large{asset(96, 1), {}};
  const viewer::GridShelf::Wish small{asset(16, 2), {}};
  for (int i = 0; i < 4; ++i) {
    shelf_.wish({large});
    shelf_.wish({small});
    shelf_.wish({});
    shelf_.wish({small, large});
    ASSERT_TRUE(shelf_.wait(std::nullopt));
    EXPECT_TRUE(shelf_.built(small));
    EXPECT_TRUE(shelf_.built(large));
    shelf_.wish({});
  }
  shelf_.wish({large});
  shelf_.cancel();
  ASSERT_TRUE(shelf_.wait(std::nullopt));
}

}  // namespace
