#pragma once

// The fixture of tests that import volumes, and comparisons with OpenVDB.

#include <gtest/gtest.h>
#include <openvdb/openvdb.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <random>
#include <set>
#include <string>
#include <tuple>

#include "support/folder.hpp"
#include "support/vdb_files.hpp"
#include "volume/volume.hpp"

namespace cumulet::test {

/// Point queries on a volume, as volume.hpp defines them.
class Lookup {
 public:
  explicit Lookup(const volume::ScalarVolume& volume) : volume_(volume) {
    for (std::size_t i = 0; i < volume.brick_origins.size(); ++i) bricks_[key(volume.brick_origins[i])] = i;
  }
  [[nodiscard]] bool inside(glm::ivec3 p) const {
    return glm::all(glm::greaterThanEqual(p, volume_.bounds_min)) &&
           glm::all(glm::lessThanEqual(p, volume_.bounds_max));
  }
  [[nodiscard]] float value(glm::ivec3 p) const {
    if (!inside(p)) return 0.0F;
    if (const auto it = bricks_.find(key(p & ~7)); it != bricks_.end()) {
      const auto i = static_cast<std::size_t>(((p.x & 7) * 8 + (p.y & 7)) * 8 + (p.z & 7));
      return volume_.brick_values[it->second * 512 + i];
    }
    for (const volume::Tile& t : volume_.tiles) {
      if (glm::all(glm::greaterThanEqual(p, t.min)) && glm::all(glm::lessThanEqual(p, t.max))) return t.value;
    }
    return volume_.background;
  }

 private:
  using Key = std::array<int, 3>;
  static Key key(glm::ivec3 p) { return {p.x, p.y, p.z}; }
  const volume::ScalarVolume& volume_;
  std::map<Key, std::size_t> bricks_;
};

inline void expect_contract(const volume::ScalarVolume& v) {
  ASSERT_EQ(v.brick_values.size(), v.brick_origins.size() * 512);
  const auto tuple = [](glm::ivec3 p) { return std::make_tuple(p.x, p.y, p.z); };
  const auto overlap = [](const volume::Tile& a, const volume::Tile& b) {
    return glm::all(glm::lessThanEqual(glm::max(a.min, b.min), glm::min(a.max, b.max)));
  };
  const volume::Tile bounds{v.bounds_min, v.bounds_max, 0.0F};
  for (std::size_t i = 0; i < v.brick_origins.size(); ++i) {
    const glm::ivec3 o = v.brick_origins[i];
    EXPECT_EQ(o & 7, glm::ivec3(0));
    if (i > 0) {
      EXPECT_LT(tuple(v.brick_origins[i - 1]), tuple(o));
    }
    const volume::Tile box{o, o + 7, 0.0F};
    EXPECT_TRUE(overlap(box, bounds));
    std::set<float> values;
    for (int n = 0; n < 512; ++n) {
      const glm::ivec3 p = o + glm::ivec3(n >> 6, (n >> 3) & 7, n & 7);
      const float value = v.brick_values[i * 512 + static_cast<std::size_t>(n)];
      EXPECT_TRUE(std::isfinite(value) && value >= 0.0F && !std::signbit(value));
      if (overlap({p, p, 0.0F}, bounds)) {
        values.insert(value);
      } else {
        EXPECT_EQ(value, 0.0F);
      }
    }
    EXPECT_GT(values.size(), 1U) << "a constant brick is a tile or background";
  }
  for (std::size_t i = 0; i < v.tiles.size(); ++i) {
    const volume::Tile& t = v.tiles[i];
    EXPECT_TRUE(glm::all(glm::lessThanEqual(t.min, t.max)));
    EXPECT_TRUE(glm::all(glm::greaterThanEqual(t.min, v.bounds_min)) &&
                glm::all(glm::lessThanEqual(t.max, v.bounds_max)));
    EXPECT_NE(t.value, v.background);
    if (v.tiles.size() + v.brick_origins.size() > 3000) continue;
    for (std::size_t j = 0; j < i; ++j) EXPECT_FALSE(overlap(t, v.tiles[j]));
    for (const glm::ivec3 o : v.brick_origins) EXPECT_FALSE(overlap(t, {o, o + 7, 0.0F}));
  }
}

/// Checks every rule of volume.hpp, and values at random voxels inside and outside the bounds.
template <typename GridT>
void expect_same(const GridT& grid, const volume::ScalarVolume& v, double tolerance = 0.0) {
  expect_contract(v);
  const openvdb::CoordBBox bounds = grid.evalActiveVoxelBoundingBox();
  ASSERT_EQ(v.bounds_min, glm::ivec3(bounds.min().x(), bounds.min().y(), bounds.min().z()));
  ASSERT_EQ(v.bounds_max, glm::ivec3(bounds.max().x(), bounds.max().y(), bounds.max().z()));
  EXPECT_EQ(v.active_voxels, grid.activeVoxelCount());
  EXPECT_EQ(v.background, std::max(0.0F, static_cast<float>(grid.background())));

  const Lookup lookup(v);
  const auto accessor = grid.getConstAccessor();
  std::mt19937 random(7);
  const auto compare = [&](openvdb::Coord c) {
    const float got = lookup.value({c.x(), c.y(), c.z()});
    const float truth = bounds.isInside(c) ? std::max(0.0F, static_cast<float>(accessor.getValue(c))) : 0.0F;
    ASSERT_NEAR(got, truth, tolerance) << c;
    ASSERT_LE(got, v.max_value);
  };
  const auto pick = [&](int lo, int hi) { return std::uniform_int_distribution<int>(lo, hi)(random); };
  for (int i = 0; i < 20000; ++i) {
    compare({pick(bounds.min().x() - 12, bounds.max().x() + 12), pick(bounds.min().y() - 12, bounds.max().y() + 12),
             pick(bounds.min().z() - 12, bounds.max().z() + 12)});
  }
  // Random positions miss small features; the neighborhood of active voxels does not.
  int n = 0;
  for (auto it = grid.cbeginValueOn(); it && n < 20000; ++it, ++n) {
    compare(it.getCoord());
    compare(it.getCoord().offsetBy(pick(-2, 2), pick(-2, 2), pick(-2, 2)));
  }
}

class VolumeImport : public ::testing::Test {
 protected:
  void SetUp() override { openvdb::initialize(); }

  std::filesystem::path path(const std::string& name) const { return folder_ / name; }
  std::filesystem::path write(const openvdb::GridPtrVec& grids, const std::string& name = "test.vdb") const {
    openvdb::io::File(path(name).string()).write(grids);
    return path(name);
  }
  std::filesystem::path write_bytes(const std::string& bytes, const std::string& name) const {
    std::ofstream(path(name), std::ios::binary) << bytes;
    return path(name);
  }

  static std::string refusal(const std::filesystem::path& file, const std::string& grid = {}) {
    return test::refusal(file, [&] { (void)volume::import_volume(file, grid, {}); });
  }

  Folder folder_;
};

inline openvdb::FloatGrid::Ptr reference(const std::filesystem::path& file, const std::string& name) {
  openvdb::io::File in(file.string());
  in.open(false);
  return openvdb::gridPtrCast<openvdb::FloatGrid>(in.readGrid(name));
}

/// Bricks with active and inactive voxels, active and inactive tiles of three levels.
inline openvdb::FloatGrid::Ptr rich(float background) {
  auto grid = fog("density", background);
  auto& tree = grid->tree();
  std::mt19937 random(3);
  std::uniform_real_distribution<float> value(0.0F, 2.0F);
  for (int i = 0; i < 3000; ++i) {
    const openvdb::Coord c(static_cast<int>(random() % 60) - 23, static_cast<int>(random() % 50) - 19,
                           static_cast<int>(random() % 40) + 5);
    tree.setValue(c, value(random));
    if (i % 4 == 0) tree.setValueOff(c.offsetBy(1, 0, 0), value(random));
  }
  tree.addTile(1, openvdb::Coord(64, 0, 0), 0.75F, true);
  tree.addTile(1, openvdb::Coord(64, 8, 0), 0.5F, false);
  tree.addTile(1, openvdb::Coord(64, 16, 0), background, true);
  tree.addTile(2, openvdb::Coord(128, 0, 0), 1.25F, true);
  tree.addTile(2, openvdb::Coord(0, 128, 0), 0.375F, false);  // inactive, partly inside the bounds
  tree.setValue(openvdb::Coord(30, 140, 3), 3.5F);
  // Inactive, outside of the active bounds: not a part of the field.
  tree.setValueOff(openvdb::Coord(-200, 0, 0), 9.0F);
  tree.addTile(1, openvdb::Coord(600, 0, 0), 9.0F, false);
  // Half inside the bounds.
  tree.addTile(2, openvdb::Coord(-128, -128, 0), 0.625F, false);
  tree.setValue(openvdb::Coord(-30, -130, 7), 0.25F);
  return grid;
}

}  // namespace cumulet::test
