// Streaming of values from a file leaf by leaf, compared with OpenVDB's own trees. The files have more leaves than are
// read in one run.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "support/folder.hpp"
#include "support/vdb_files.hpp"
#include "volume/bricks.hpp"
#include "volume/inspection.hpp"
#include "volume/volume.hpp"

namespace {

using namespace cumulet;

constexpr int leaves = 700;

/// Disjoint leaves of values that are exact halves, with inactive voxels of two values of their own.
template <class GridT>
typename GridT::Ptr scattered(float background) {
  auto grid = GridT::create(background);
  grid->setName("density");
  grid->setGridClass(openvdb::GRID_FOG_VOLUME);
  std::mt19937 random(7);
  auto accessor = grid->getAccessor();
  for (int leaf = 0; leaf < leaves; ++leaf) {
    const openvdb::Coord origin(leaf % 9 * 40, leaf / 9 % 9 * 24, leaf / 81 * 136);
    for (int i = 0; i < 512; ++i) {
      const openvdb::Coord voxel = origin.offsetBy(i / 64, i / 8 % 8, i % 8);
      const std::uint32_t kind = random() % 8;
      const auto value = static_cast<float>(random() % 2048) / 1024.0F;
      if (kind < 5) accessor.setValueOn(voxel, value);
      if (kind == 5) accessor.setValueOff(voxel, 0.25F);
      if (kind == 6 && leaf % 3 == 0) accessor.setValueOff(voxel, 4.0F);
    }
  }
  return grid;
}

class VdbStream : public testing::Test {
 protected:
  volume::ScalarVolume through_file(const openvdb::GridBase::Ptr& grid, std::uint32_t compression, bool half,
                                    Progress* progress = nullptr) {
    grid->setSaveFloatAsHalf(half);
    openvdb::io::File out(file().string());
    out.setCompression(compression);
    out.write({grid});
    out.close();
    return volume::import_volume(file(), "", Log(), progress);
  }
  [[nodiscard]] std::filesystem::path file() const { return folder_.path() / "streamed.vdb"; }

  /// Compares the number of bricks and every voxel.
  template <class GridT>
  static void expect_same(const GridT& grid, const volume::ScalarVolume& found) {
    ASSERT_EQ(found.brick_origins.size(), std::size_t{leaves});
    ASSERT_EQ(found.active_voxels, grid.activeVoxelCount());
    auto accessor = grid.getConstAccessor();
    volume::BrickValues::Brick room;
    for (std::size_t brick = 0; brick < found.brick_origins.size(); ++brick) {
      const float* values = found.brick_values.brick(brick, room);
      for (int i = 0; i < volume::brick_voxels; ++i) {
        const glm::ivec3 voxel = found.brick_origins[brick] + glm::ivec3(i / 64, i / 8 % 8, i % 8);
        const bool inside = glm::all(glm::greaterThanEqual(voxel, found.bounds_min)) &&
                            glm::all(glm::lessThanEqual(voxel, found.bounds_max));
        const auto value = static_cast<float>(accessor.getValue({voxel.x, voxel.y, voxel.z}));
        const float wanted = inside && std::isfinite(value) && value > 0.0F ? value : 0.0F;
        ASSERT_EQ(values[i], wanted) << brick << " " << i;
      }
    }
  }

 private:
  test::Folder folder_;
};

TEST_F(VdbStream, EveryCompressionMatchesTheTreeImport) {
  using namespace openvdb::io;
  for (const float background : {0.0F, 0.5F}) {
    const auto grid = scattered<openvdb::FloatGrid>(background);
    for (const std::uint32_t packed : {0U, std::uint32_t{COMPRESS_ZIP}, std::uint32_t{COMPRESS_BLOSC}}) {
      for (const std::uint32_t masked : {0U, std::uint32_t{COMPRESS_ACTIVE_MASK}}) {
        for (const bool half : {false, true}) {
          SCOPED_TRACE(testing::Message() << background << " " << packed << " " << masked << " " << half);
          const volume::ScalarVolume found = through_file(grid, packed | masked, half);
          EXPECT_TRUE(found.brick_values.are_halves());
          expect_same(*grid, found);
        }
      }
    }
  }
  const auto doubles = scattered<openvdb::DoubleGrid>(0.0F);
  expect_same(*doubles, through_file(doubles, COMPRESS_BLOSC | COMPRESS_ACTIVE_MASK, false));
  expect_same(*doubles, through_file(doubles, COMPRESS_ZIP, true));
}

// A value that is not a half in the last leaf; all values before were kept as halves.
TEST_F(VdbStream, RestartsAsFloatsIfHalfFloatsDoNotFit) {
  const auto grid = scattered<openvdb::FloatGrid>(0.0F);
  std::vector<openvdb::FloatTree::LeafNodeType*> nodes;
  grid->tree().getNodes(nodes);
  nodes.back()->setValueOn(3, 0.1F);
  Progress progress;
  const volume::ScalarVolume found = through_file(grid, openvdb::io::COMPRESS_BLOSC, false, &progress);
  EXPECT_FALSE(found.brick_values.are_halves());
  expect_same(*grid, found);
  EXPECT_DOUBLE_EQ(progress.fraction(), 1.0);
}

TEST_F(VdbStream, InvalidValuesAreCountedOnce) {
  const auto grid = scattered<openvdb::FloatGrid>(0.0F);
  std::vector<openvdb::FloatTree::LeafNodeType*> nodes;
  grid->tree().getNodes(nodes);
  for (const std::size_t leaf : {std::size_t{0}, nodes.size() - 1}) {
    nodes[leaf]->setValueOn(10, -0.5F);
    nodes[leaf]->setValueOn(11, std::numeric_limits<float>::quiet_NaN());
    nodes[leaf]->setValueOn(12, -std::numeric_limits<float>::infinity());
    nodes[leaf]->setValueOn(13, -0.0F);
    nodes[leaf]->setValueOn(14, 6e-8F);  // not a half, but near the smallest one
  }
  const volume::ScalarVolume found = through_file(grid, openvdb::io::COMPRESS_ZIP, false);
  EXPECT_EQ(found.negative_voxels, 2U);
  EXPECT_EQ(found.non_finite_voxels, 4U);
  EXPECT_FALSE(found.brick_values.are_halves());
  expect_same(*grid, found);
}

// Constant bricks become tiles, and the remaining bricks are compacted.
TEST_F(VdbStream, ConstantLeavesBecomeTilesAndBricksAreCompacted) {
  const auto grid = scattered<openvdb::FloatGrid>(0.0F);
  std::vector<openvdb::FloatTree::LeafNodeType*> nodes;
  grid->tree().getNodes(nodes);
  std::size_t made = 0;
  for (std::size_t i = 5; i < nodes.size(); i += 3, ++made) nodes[i]->fill(0.75F, true);
  for (const bool half : {true, false}) {
    if (!half) nodes[0]->setValueOn(3, 0.1F);
    const volume::ScalarVolume found = through_file(grid, openvdb::io::COMPRESS_BLOSC, half);
    ASSERT_EQ(found.brick_origins.size(), nodes.size() - made);
    EXPECT_EQ(found.brick_values.size(), found.brick_origins.size() * 512);
    EXPECT_EQ(found.tiles.size(), made);
    volume::BrickValues::Brick room;
    for (const auto* node : nodes) {
      const openvdb::Coord at = node->origin();
      const float* values = volume::find_brick(found, {at.x(), at.y(), at.z()}, room);
      ASSERT_EQ(values == nullptr, node->buffer()[0] == 0.75F && node->buffer()[511] == 0.75F) << at;
      if (values != nullptr) {
        EXPECT_EQ(values[100], half ? float{openvdb::math::half(node->buffer()[100])} : node->buffer()[100]);
      }
    }
  }
}

// The inspection's numbers equal those computed voxel by voxel.
TEST_F(VdbStream, InspectionSeesEveryLeaf) {
  const auto grid = scattered<openvdb::FloatGrid>(0.0F);
  through_file(grid, openvdb::io::COMPRESS_BLOSC | openvdb::io::COMPRESS_ACTIVE_MASK, true);
  volume::Inspection inspection(file());
  const volume::GridStatistics& statistics = inspection.statistics(0);
  ASSERT_TRUE(statistics.values);
  double sum = 0.0;
  for (auto voxel = grid->cbeginValueOn(); voxel; ++voxel) sum += double{*voxel};
  const auto count = static_cast<double>(grid->activeVoxelCount());
  EXPECT_NEAR(statistics.values->mean, sum / count, 1e-12);
  std::uint64_t counted = 0;
  for (const std::uint64_t bin : statistics.values->histogram) counted += bin;
  EXPECT_EQ(counted, grid->activeVoxelCount());
}

}  // namespace
