#include <gtest/gtest.h>
#include <openvdb/tools/Count.h>
#include <tbb/global_control.h>

#include <cmath>

#include "scene.hpp"

namespace {

using namespace cumulet;

openvdb::FloatGrid::Ptr cumulus(double voxels, std::uint32_t seed = 1) {
  openvdb::initialize();
  return scene::make_cumulus({voxels, seed});
}

bool same(const openvdb::FloatGrid& a, const openvdb::FloatGrid& b) {
  if (a.activeVoxelCount() != b.activeVoxelCount()) return false;
  auto accessor = b.getConstAccessor();
  for (auto i = a.cbeginValueOn(); i; ++i) {
    if (accessor.getValue(i.getCoord()) != *i) return false;
  }
  return true;
}

TEST(Cumulus, IsTheSameWhateverTheThreads) {
  openvdb::FloatGrid::Ptr one;
  {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, 1);
    one = cumulus(60000);
  }
  const tbb::global_control control(tbb::global_control::max_allowed_parallelism, 4);
  EXPECT_TRUE(same(*one, *cumulus(60000)));
  EXPECT_FALSE(same(*one, *cumulus(60000, 2)));
}

TEST(Cumulus, HasWhatItPromises) {
  const auto grid = cumulus(100000);
  EXPECT_EQ(grid->getName(), "density");
  EXPECT_EQ(grid->getGridClass(), openvdb::GRID_FOG_VOLUME);
  const auto count = static_cast<double>(grid->activeVoxelCount());
  EXPECT_GT(count, 60000);
  EXPECT_LT(count, 180000);
  double top = 0.0;
  double bottom = 0.0;
  double mass = 0.0;
  for (auto i = grid->cbeginValueOn(); i; ++i) {
    ASSERT_TRUE(std::isfinite(*i));
    ASSERT_GT(*i, 0.0F);
    ASSERT_LE(*i, 1.0F);
    const auto p = grid->indexToWorld(i.getCoord());
    mass += *i;
    (p.y() > 25.0 ? top : bottom) += *i;
    ASSERT_GT(p.y(), -3.0);
  }
  // Wider below than above, flat at the base.
  EXPECT_GT(bottom, top);
  const double voxel = grid->voxelSize().x();
  // Metres: opaque through the middle (tens of optical depths), not a wall.
  const double mean_depth = mass * voxel * voxel * voxel / (75.0 * 45.0);
  EXPECT_GT(mean_depth, 5.0);
  EXPECT_LT(mean_depth, 80.0);
}

TEST(Cumulus, GainsDetailWithResolution) {
  // The border's area grows faster than a smooth shape's would: active voxels with an inactive neighbour.
  const auto border = [](const openvdb::FloatGrid& grid) {
    auto accessor = grid.getConstAccessor();
    double n = 0.0;
    for (auto i = grid.cbeginValueOn(); i; ++i) {
      const openvdb::Coord c = i.getCoord();
      bool edge = false;
      for (int axis = 0; axis < 3; ++axis) {
        openvdb::Coord step(0);
        step[axis] = 1;
        edge = edge || !accessor.isValueOn(c + step) || !accessor.isValueOn(c - step);
      }
      n += edge ? 1.0 : 0.0;
    }
    return n * grid.voxelSize().x() * grid.voxelSize().x();
  };
  EXPECT_GT(border(*cumulus(400000)), 1.12 * border(*cumulus(50000)));
}

TEST(Fire, HasSmokeAndTemperature) {
  openvdb::initialize();
  const auto grids = scene::make_fire({60000, 1});
  ASSERT_EQ(grids.size(), 2U);
  EXPECT_EQ(grids[0]->getName(), "density");
  EXPECT_EQ(grids[1]->getName(), "temperature");
  float hottest = 0.0F;
  for (auto i = grids[1]->cbeginValueOn(); i; ++i) hottest = std::max(hottest, *i);
  EXPECT_GT(hottest, 1500.0F);
  EXPECT_LT(hottest, 2500.0F);
  EXPECT_GT(grids[0]->activeVoxelCount(), 20000U);
}

}  // namespace
