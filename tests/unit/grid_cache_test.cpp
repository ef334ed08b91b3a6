// The grid cache of several volumes: grids are built one after another and kept while they are requested.

#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <thread>

#include "jobs/grid_cache.hpp"
#include "support/volumes.hpp"

namespace {

namespace viewer = cumulet::viewer;

class GridCacheTest : public testing::Test {
 protected:
  static viewer::VolumeAssetPtr asset(int side, unsigned seed) {
    return std::make_shared<const viewer::VolumeAsset>(
        cumulet::test::noise_volume(glm::ivec3(side), glm::ivec3(0), static_cast<int>(seed)));
  }
  std::atomic<int> told_ = 0;
  viewer::GridCache cache_{viewer::JobContext{{}, [this] { ++told_; }}};
};

TEST_F(GridCacheTest, KeepsRequestedGrids) {
  const viewer::GridCache::Request a{asset(16, 1), {}};
  const viewer::GridCache::Request b{asset(16, 2), {}};
  cache_.request({a, a});
  ASSERT_TRUE(cache_.wait(std::nullopt));
  ASSERT_TRUE(cache_.built(a));
  const auto made = cache_.built(a)->source;
  EXPECT_EQ(cache_.revision(), 1U);
  cache_.request({b, a});
  ASSERT_TRUE(cache_.wait(std::nullopt));
  EXPECT_EQ(cache_.built(a)->source, made);
  ASSERT_TRUE(cache_.built(b));
  EXPECT_EQ(cache_.revision(), 2U);
  cache_.request({b});
  EXPECT_FALSE(cache_.built(a));
  EXPECT_TRUE(cache_.built(b));
  EXPECT_TRUE(cache_.take_changes());
  EXPECT_FALSE(cache_.busy());
  EXPECT_GE(told_, 2);
}

// A build in progress is finished and delivered, even if requests change meanwhile.
TEST_F(GridCacheTest, FinishesBuildsInProgress) {
  const viewer::GridCache::Request slow{asset(96, 1), {}};
  const viewer::GridCache::Request next{asset(16, 2), {}};
  cache_.request({slow});
  while (!cache_.is_under_way(slow) && !cache_.built(slow)) std::this_thread::yield();
  cache_.request({next});
  const bool under_way = cache_.is_under_way(slow);  // else it was already built
  ASSERT_TRUE(cache_.wait(std::nullopt));
  EXPECT_EQ(cache_.built(slow).has_value(), under_way);
  EXPECT_TRUE(cache_.built(next));
  cache_.request({next});
  EXPECT_FALSE(cache_.built(slow));
}

TEST_F(GridCacheTest, RequestsMayChangeDuringABuild) {
  const viewer::GridCache::Request large{asset(96, 1), {}};
  const viewer::GridCache::Request small{asset(16, 2), {}};
  for (int i = 0; i < 4; ++i) {
    cache_.request({large});
    cache_.request({small});
    cache_.request({});
    cache_.request({small, large});
    ASSERT_TRUE(cache_.wait(std::nullopt));
    EXPECT_TRUE(cache_.built(small));
    EXPECT_TRUE(cache_.built(large));
    cache_.request({});
  }
  cache_.request({large});
  cache_.cancel();
  ASSERT_TRUE(cache_.wait(std::nullopt));
}

}  // namespace
