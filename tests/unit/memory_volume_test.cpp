// Volumes of the C API: files, dense and sparse voxels in memory, and grids of the host's own OpenVDB.

#include <cumulet/cumulet.h>
#include <gtest/gtest.h>
#include <openvdb/tools/LevelSetSphere.h>
#include <cumulet/cumulet_openvdb.hpp>

#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>
#include <thread>

#include "support/folder.hpp"
#include "support/openvdb.hpp"
#include "support/volumes.hpp"
#include "viewer/c_handles.hpp"

namespace {

namespace fs = std::filesystem;
using cumulet::test::value_at;
using cumulet::volume::ScalarVolume;
using openvdb::Coord;

struct Release {
  void operator()(cumulet_volume* volume) const { cumulet_volume_release(volume); }
};
using Volume = std::unique_ptr<cumulet_volume, Release>;

const ScalarVolume& inside(const Volume& volume) { return volume->asset->volume(); }

/// Runs a call that must succeed.
template <class Call>
Volume made(Call&& call) {
  cumulet_volume* volume = nullptr;
  char error[256] = "not touched";
  EXPECT_EQ(call(&volume, error, sizeof error), CUMULET_OK) << error;
  EXPECT_STREQ(error, "");
  EXPECT_NE(volume, nullptr);
  return Volume(volume);
}

/// Runs a call that must fail with this status and a one-line message, which it returns.
template <class Call>
std::string refused(cumulet_status status, Call&& call) {
  int dummy = 0;
  auto* volume = reinterpret_cast<cumulet_volume*>(&dummy);
  char error[256] = "";
  EXPECT_EQ(call(&volume, error, sizeof error), status) << error;
  EXPECT_EQ(volume, nullptr) << error;
  const std::string line = error;
  EXPECT_FALSE(line.empty());
  EXPECT_EQ(line.find_first_of("\n\r\t"), std::string::npos) << line;
  volume = reinterpret_cast<cumulet_volume*>(&dummy);
  EXPECT_EQ(call(&volume, nullptr, 0), status);  // without a buffer
  EXPECT_EQ(volume, nullptr);
  return line;
}

#define EXPECT_HAS(text, part) EXPECT_NE((text).find(part), std::string::npos) << (text)

using cumulet::test::expect_identical;

struct Dense {
  std::vector<float> values;
  cumulet_dense_desc desc{};

  Dense(int x, int y, int z) : values(static_cast<std::size_t>(x * y * z)) {
    desc.struct_size = sizeof desc;
    desc.size[0] = x;
    desc.size[1] = y;
    desc.size[2] = z;
    desc.value_count = values.size();
    desc.values = values.data();
    desc.name = "noise";
  }
  float& at(int x, int y, int z) { return values[static_cast<std::size_t>((z * desc.size[1] + y) * desc.size[0] + x)]; }
  auto call() const {
    return [this](cumulet_volume** out, char* error, size_t size) {
      return cumulet_volume_from_dense(&desc, out, error, size);
    };
  }
};

struct Sparse {
  std::vector<int32_t> origins;
  std::vector<float> values;
  std::vector<uint64_t> active;
  std::vector<cumulet_tile> tiles;
  cumulet_sparse_desc desc{};

  Sparse() { desc.struct_size = sizeof desc; }
  void brick(int x, int y, int z, float value = 1.0F) {
    origins.insert(origins.end(), {x, y, z});
    values.insert(values.end(), 512, value);
    values.back() = 2.0F;  // not constant
  }
  void tile(Coord min, Coord max, float value = 0.5F, int active_flag = 1) {
    tiles.push_back({{min.x(), min.y(), min.z()}, {max.x(), max.y(), max.z()}, value, active_flag});
  }
  auto call() {
    return [this](cumulet_volume** out, char* error, size_t size) {
      desc.brick_origins = origins.data();
      desc.brick_values = values.data();
      desc.brick_active = active.empty() ? nullptr : active.data();
      desc.brick_count = origins.size() / 3;
      desc.tiles = tiles.data();
      desc.tile_count = tiles.size();
      return cumulet_volume_from_sparse(&desc, out, error, size);
    };
  }
};

TEST(DenseVolume, EveryVoxelIsAtItsPosition) {
  for (const glm::ivec3 size : {glm::ivec3(1), glm::ivec3(8, 16, 24), glm::ivec3(37, 5, 61), glm::ivec3(7, 130, 9)}) {
    Dense dense(size.x, size.y, size.z);
    std::mt19937 random(4);
    std::uint64_t active = 0;
    for (float& value : dense.values) {
      value = random() % 3 == 0 ? 0.0F : static_cast<float>(random() % 1000) / 100.0F;
      active += value != 0.0F ? 1 : 0;
    }
    dense.at(0, 0, 0) = 4.0F;
    dense.at(size.x - 1, size.y - 1, size.z - 1) = 5.0F;
    active = static_cast<std::uint64_t>(
        std::count_if(dense.values.begin(), dense.values.end(), [](float v) { return v != 0.0F; }));
    const Volume volume = made(dense.call());
    EXPECT_EQ(inside(volume).bounds_min, glm::ivec3(0));
    EXPECT_EQ(inside(volume).bounds_max, size - 1);
    EXPECT_EQ(inside(volume).active_voxels, active);
    EXPECT_EQ(inside(volume).index_to_world, glm::dmat4(1.0));
    for (int z = 0; z < size.z; ++z) {
      for (int y = 0; y < size.y; ++y) {
        for (int x = 0; x < size.x; ++x) ASSERT_EQ(value_at(inside(volume), {x, y, z}), dense.at(x, y, z));
      }
    }
  }
}

TEST(DenseVolume, EqualsTheSameGridInOpenVdb) {
  Dense dense(45, 70, 33);
  auto grid = openvdb::FloatGrid::create();
  grid->setName("noise");
  std::mt19937 random(9);
  for (int i = 0; i < 4000; ++i) {
    const Coord c(static_cast<int>(random() % 20) + 3, static_cast<int>(random() % 70),
                  static_cast<int>(random() % 30) + 1);
    const float value = static_cast<float>(random() % 100) / 10.0F - 1.0F;  // some negative, some zero
    dense.at(c.x(), c.y(), c.z()) = value;
  }
  for (int z = 0; z < 33; ++z) {
    for (int y = 0; y < 70; ++y) {
      for (int x = 0; x < 45; ++x) {
        if (dense.at(x, y, z) != 0.0F) grid->tree().setValue(Coord(x, y, z), dense.at(x, y, z));
      }
    }
  }
  const double matrix[16] = {0.5, 0, 0.1, 0, 0, 0.25, 0, 0, 0.2, 0, 2, 0, 10, -20, 30, 1};
  std::copy(std::begin(matrix), std::end(matrix), std::begin(dense.desc.index_to_world));
  grid->setTransform(openvdb::math::Transform::createLinearTransform(openvdb::Mat4d(matrix)));
  const Volume a = made(dense.call());
  const Volume b = made([&](auto... arguments) { return cumulet::volume_from_openvdb(grid, arguments...); });
  expect_identical(inside(a), inside(b));
  EXPECT_EQ(inside(a).index_to_world[3][1], -20.0);
}

TEST(DenseVolume, SkipsEmptyBricks) {
  Dense dense(400, 400, 100);
  dense.at(17, 300, 50) = 1.0F;
  dense.at(20, 300, 50) = 3.0F;
  dense.at(300, 10, 99) = 2.0F;
  const Volume volume = made(dense.call());
  EXPECT_EQ(inside(volume).bounds_min, glm::ivec3(17, 10, 50));
  EXPECT_EQ(inside(volume).bounds_max, glm::ivec3(300, 300, 99));
  EXPECT_EQ(inside(volume).active_voxels, 3U);
  EXPECT_LE(inside(volume).brick_origins.size(), 2U);
}

TEST(DenseVolume, ReportsItsInfo) {
  Dense dense(4, 4, 4);
  dense.at(1, 0, 0) = 7.0F;
  dense.at(3, 2, 1) = 1.0F;
  const Volume volume = made(dense.call());
  cumulet_volume_info info{};
  info.struct_size = sizeof info;
  ASSERT_EQ(cumulet_volume_get_info(volume.get(), &info), CUMULET_OK);
  EXPECT_STREQ(info.name, "noise");
  EXPECT_EQ(info.active_voxels, 2U);
  EXPECT_EQ(info.max_value, 7.0F);
  const std::array<double, 3> low{0.5, -0.5, -0.5};
  const std::array<double, 3> high{3.5, 2.5, 1.5};
  EXPECT_TRUE(std::equal(low.begin(), low.end(), info.bounds_min));
  EXPECT_TRUE(std::equal(high.begin(), high.end(), info.bounds_max));
  // A host of an older header has only the first members.
  cumulet_volume_info shorter{};
  shorter.struct_size = offsetof(cumulet_volume_info, bounds_min);
  ASSERT_EQ(cumulet_volume_get_info(volume.get(), &shorter), CUMULET_OK);
  EXPECT_EQ(shorter.active_voxels, 2U);
  EXPECT_EQ(shorter.bounds_max[0], 0.0);
}

TEST(DenseVolume, RejectsInvalidInput) {
  const auto wrong = [](cumulet_status status, auto&& change) {
    Dense dense(9, 10, 11);
    dense.at(0, 0, 0) = 1.0F;
    dense.at(8, 9, 10) = 1.0F;
    change(dense);
    const std::string line = refused(status, dense.call());
    EXPECT_EQ(line.rfind("noise: ", 0), 0U) << line;
    return line;
  };
  constexpr auto argument = CUMULET_ERROR_INVALID_ARGUMENT;
  constexpr auto content = CUMULET_ERROR_FILE;
  EXPECT_HAS(wrong(argument, [](Dense& d) { d.desc.values = nullptr; }), "values are NULL");
  EXPECT_HAS(wrong(argument, [](Dense& d) { d.desc.value_count = 0; }), "0 values for a size of (9, 10, 11)");
  EXPECT_HAS(wrong(argument, [](Dense& d) { --d.desc.value_count; }), "989 values");
  EXPECT_HAS(wrong(argument, [](Dense& d) { d.desc.value_count = ~std::uint64_t{0}; }), "exceed the address space");
  EXPECT_HAS(wrong(argument, [](Dense& d) { d.desc.size[1] = 0; }), "size is (9, 0, 11)");
  EXPECT_HAS(wrong(argument, [](Dense& d) { d.desc.size[2] = -11; }), "size is");
  // 2^30 x 2^30 x 2^4 overflows to 0 in 64 bits.
  EXPECT_HAS(wrong(argument,
                   [](Dense& d) {
                     d.desc.size[0] = d.desc.size[1] = 1 << 30;
                     d.desc.size[2] = 16;
                     d.desc.value_count = 0;
                   }),
             "0 values");
  const auto matrix = [&](int element, double value) {
    return wrong(content, [=](Dense& d) {
      for (int i = 0; i < 4; ++i) d.desc.index_to_world[5 * i] = 1.0;
      d.desc.index_to_world[element] = value;
    });
  };
  EXPECT_HAS(matrix(3, 0.1), "not affine");
  EXPECT_HAS(matrix(15, 2.0), "not affine");
  EXPECT_HAS(matrix(15, 0.0), "not affine");
  EXPECT_HAS(matrix(5, 0.0), "singular");
  EXPECT_HAS(matrix(12, std::numeric_limits<double>::quiet_NaN()), "not finite");
  // Longer than a control cube.
  Dense bar(300000, 1, 1);
  bar.at(0, 0, 0) = bar.at(299999, 0, 0) = 1.0F;
  EXPECT_HAS(refused(CUMULET_ERROR_UNSUPPORTED, bar.call()), "300000 voxels wide; the limit is 262144");
}

TEST(DenseVolume, HasDefaults) {
  Dense dense(2, 2, 2);
  dense.at(1, 1, 1) = -3.0F;  // clamped without a message, because there is no log
  dense.at(0, 1, 1) = 1.0F;
  dense.desc.name = nullptr;
  const Volume volume = made(dense.call());
  EXPECT_EQ(inside(volume).name, "dense");
  EXPECT_EQ(value_at(inside(volume), {1, 1, 1}), 0.0F);
  EXPECT_EQ(inside(volume).active_voxels, 2U);
  dense.desc.name = "a\nb";
  dense.desc.index_to_world[0] = INFINITY;
  EXPECT_HAS(refused(CUMULET_ERROR_FILE, dense.call()), "a b: ");
}

TEST(DenseVolume, CountsInvalidValuesAsZero) {
  Dense dense(3, 3, 3);
  dense.at(0, 0, 0) = INFINITY;
  dense.at(1, 0, 0) = NAN;
  dense.at(2, 0, 0) = -1.0F;
  dense.at(2, 2, 2) = 2.0F;
  const Volume volume = made(dense.call());
  cumulet_volume_info info{};
  info.struct_size = sizeof info;
  ASSERT_EQ(cumulet_volume_get_info(volume.get(), &info), CUMULET_OK);
  EXPECT_EQ(info.active_voxels, 4U);
  EXPECT_EQ(info.non_finite_voxels, 2U);
  EXPECT_EQ(info.negative_voxels, 1U);
  EXPECT_EQ(info.max_value, 2.0F);
  EXPECT_EQ(value_at(inside(volume), {0, 0, 0}), 0.0F);

  // An empty volume is valid.
  const Volume nothing = made(Dense(2, 2, 2).call());
  ASSERT_EQ(cumulet_volume_get_info(nothing.get(), &info), CUMULET_OK);
  EXPECT_EQ(info.active_voxels, 0U);
  double scale = 5.0;
  EXPECT_EQ(cumulet_volume_suggest_density_scale(nothing.get(), &scale), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(scale, 5.0);
  ASSERT_EQ(cumulet_volume_suggest_density_scale(volume.get(), &scale), CUMULET_OK);
  EXPECT_GT(scale, 1.0);
  EXPECT_EQ(cumulet_volume_suggest_density_scale(volume.get(), nullptr), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(cumulet_volume_suggest_density_scale(nullptr, &scale), CUMULET_ERROR_INVALID_ARGUMENT);
}

TEST(SparseVolume, HoldsBricksTilesAndBackground) {
  Sparse sparse;
  std::mt19937 random(2);
  sparse.brick(8, -16, 0);
  sparse.brick(-8, 0, 24);
  for (float& value : sparse.values) value = static_cast<float>(random() % 100) / 50.0F;
  sparse.active.assign(16, 0);
  sparse.active[0] = 1;                              // voxel (8, -16, 0)
  sparse.active[8 + 7] = std::uint64_t{1} << 63U;    // voxel (-1, 7, 31)
  sparse.tile({16, 0, 0}, {18, 40, 3}, 1.5F);        // not a power of two, not aligned
  sparse.tile({16, 41, 0}, {90, 49, 30}, 0.75F, 0);  // inactive, partly outside
  sparse.desc.background = 0.25F;
  sparse.desc.name = "tree";
  const Volume volume = made(sparse.call());
  const ScalarVolume& v = inside(volume);
  EXPECT_EQ(v.name, "tree");
  EXPECT_EQ(v.bounds_min, glm::ivec3(-1, -16, 0));
  EXPECT_EQ(v.bounds_max, glm::ivec3(18, 40, 31));
  EXPECT_EQ(v.active_voxels, 2U + 3 * 41 * 4);
  const auto in_brick = [&](std::size_t brick, int x, int y, int z) {
    return sparse.values[512 * brick + static_cast<std::size_t>(64 * x + 8 * y + z)];
  };
  EXPECT_EQ(value_at(v, {8, -16, 0}), in_brick(0, 0, 0, 0));
  EXPECT_EQ(value_at(v, {13, -14, 7}), in_brick(0, 5, 2, 7));  // inactive voxels count inside the bounds
  EXPECT_EQ(value_at(v, {-1, 3, 26}), in_brick(1, 7, 3, 2));
  EXPECT_EQ(value_at(v, {-2, 3, 26}), 0.0F);  // outside
  EXPECT_EQ(value_at(v, {17, 40, 3}), 1.5F);
  EXPECT_EQ(value_at(v, {17, 40, 4}), 0.25F);
  EXPECT_EQ(value_at(v, {18, 41, 4}), 0.0F);
}

TEST(SparseVolume, AllVoxelsAreActiveWithoutMasks) {
  Sparse sparse;
  sparse.brick(0, 0, 0);
  sparse.brick(1024, 0, 8);
  EXPECT_EQ(inside(made(sparse.call())).active_voxels, 1024U);
  Sparse tiles;
  tiles.tile({0, 0, 0}, {4095, 4095, 4095});
  EXPECT_EQ(inside(made(tiles.call())).active_voxels, std::uint64_t{1} << 36U);
}

TEST(SparseVolume, RejectsInvalidInput) {
  const auto wrong = [](cumulet_status status, auto&& change) {
    Sparse sparse;
    sparse.brick(0, 0, 0);
    sparse.brick(8, 0, 0);
    sparse.tile({16, 0, 0}, {23, 7, 7});
    sparse.desc.name = "tree";
    change(sparse);
    const std::string line = refused(status, sparse.call());
    EXPECT_EQ(line.rfind("tree: ", 0), 0U) << line;
    return line;
  };
  constexpr auto argument = CUMULET_ERROR_INVALID_ARGUMENT;
  constexpr auto content = CUMULET_ERROR_FILE;
  EXPECT_HAS(wrong(content, [](Sparse& s) { s.origins[4] = 4; }), "brick origin (8, 4, 0) is not a multiple of 8");
  EXPECT_HAS(wrong(content, [](Sparse& s) { s.origins[3] = 0; }), "two bricks at (0, 0, 0)");
  EXPECT_HAS(wrong(content, [](Sparse& s) { s.tiles[0].min[0] = 15; }), "overlaps the brick at (8, 0, 0)");
  EXPECT_HAS(wrong(content, [](Sparse& s) { s.tile({23, 7, 7}, {30, 9, 9}); }), "overlap");
  EXPECT_HAS(wrong(content, [](Sparse& s) { s.tile({30, 0, 0}, {29, 9, 9}); }), "has its end before its beginning");
  EXPECT_HAS(wrong(argument, [](Sparse& s) { s.tile({30, 0, 0}, {30, 9, 9}, 1.0F, 2); }), "active is 2");
  EXPECT_HAS(wrong(content, [](Sparse& s) { s.desc.index_to_world[0] = 1.0; }), "not affine");
  EXPECT_HAS(wrong(content, [](Sparse& s) { s.brick(1 << 21, 0, 0); }), "span 2097160 x 8 x 8 voxels");
  // Limits of the integer type.
  EXPECT_HAS(wrong(content,
                   [](Sparse& s) {
                     const int least = std::numeric_limits<int>::min();
                     const int most = std::numeric_limits<int>::max();
                     s.brick(least, least, least);
                     s.brick(most - 7, most - 7, most - 7);
                   }),
             "span 4294967296 x");

  const auto null = [](auto&& change) {
    Sparse sparse;
    sparse.brick(0, 0, 0);
    sparse.tile({16, 0, 0}, {23, 7, 7});
    return refused(argument, [&](cumulet_volume** out, char* error, size_t size) {
      (void)sparse.call()(out, error, size);
      if (*out != nullptr) cumulet_volume_release(*out);
      change(sparse.desc);
      return cumulet_volume_from_sparse(&sparse.desc, out, error, size);
    });
  };
  EXPECT_HAS(null([](auto& desc) { desc.brick_origins = nullptr; }), "sparse: brick_origins are NULL");
  EXPECT_HAS(null([](auto& desc) { desc.brick_values = nullptr; }), "brick_values are NULL");
  EXPECT_HAS(null([](auto& desc) { desc.tiles = nullptr; }), "tiles are NULL");
  EXPECT_HAS(null([](auto& desc) { desc.brick_count = std::uint64_t{1} << 62U; }), "exceed the address space");
  EXPECT_HAS(null([](auto& desc) { desc.tile_count = std::uint64_t{1} << 62U; }), "exceed the address space");
  EXPECT_HAS(null([](auto& desc) { desc.struct_size = 3; }), "struct_size is 3");
  EXPECT_HAS(null([](auto& desc) { ++desc.struct_size; }), "struct_size");
}

// Compares the overlap check with a test of all pairs, on tiles of many shapes. For disjoint tiles it must find none.
TEST(SparseVolume, DetectsExactlyTheOverlaps) {
  std::mt19937 random(12);
  const auto pick = [&](int below) { return static_cast<int>(random() % static_cast<unsigned>(below)); };
  int overlapping = 0;
  for (int round = 0; round < 400; ++round) {
    Sparse sparse;
    const int count = 3 + pick(60);
    const int longest = 1 + pick(40);
    for (int i = 0; i < count; ++i) {
      Coord low(pick(120), pick(120), pick(120));
      Coord high = low.offsetBy(pick(4), pick(4), pick(4));
      high[pick(3)] += pick(longest);  // bars
      if (round % 5 == 0) {
        low = Coord(9 * i, 0, 0);  // plates side by side
        high = Coord(9 * i + 8 + (pick(4 * count) == 0 ? 1 : 0), 500, 500);
      }
      sparse.tile(low, high);
    }
    for (int i = pick(6); i > 0; --i) {
      const Coord origin(8 * pick(15) - 8 * (round % 5 == 0 ? 100 : 0), 8 * pick(15), 8 * pick(15));
      bool twice = false;
      for (std::size_t b = 0; b < sparse.origins.size(); b += 3) {
        twice = twice || Coord(sparse.origins.data() + b) == origin;
      }
      if (!twice) sparse.brick(origin.x(), origin.y(), origin.z());
    }
    const auto box = [](const cumulet_tile& t) { return openvdb::CoordBBox(Coord(t.min), Coord(t.max)); };
    bool expected = false;
    for (std::size_t i = 0; i < sparse.tiles.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j) expected = expected || box(sparse.tiles[i]).hasOverlap(box(sparse.tiles[j]));
      for (std::size_t b = 0; b < sparse.origins.size(); b += 3) {
        const Coord origin(sparse.origins.data() + b);
        expected = expected || box(sparse.tiles[i]).hasOverlap(openvdb::CoordBBox(origin, origin.offsetBy(7)));
      }
    }
    cumulet_volume* volume = nullptr;
    char error[256];
    const cumulet_status status = sparse.call()(&volume, error, sizeof error);
    ASSERT_EQ(status, expected ? CUMULET_ERROR_FILE : CUMULET_OK) << error;
    cumulet_volume_release(volume);
    overlapping += expected ? 1 : 0;
  }
  EXPECT_GT(overlapping, 50);
  EXPECT_LT(overlapping, 350);
}

class OpenVdbVolume : public ::testing::Test {
 protected:
  void SetUp() override { openvdb::initialize(); }
  std::string write(const openvdb::GridCPtrVec& grids) const {
    const std::string file = (folder_ / "test.vdb").string();
    openvdb::io::File(file).write(grids);
    return file;
  }
  static Volume open(const std::string& file, const char* grid = nullptr) {
    return made([&](auto... arguments) { return cumulet_volume_open(file.c_str(), grid, arguments...); });
  }
  static Volume copy(const openvdb::GridBase::ConstPtr& grid) {
    return made([&](auto... arguments) { return cumulet::volume_from_openvdb(grid, arguments...); });
  }
  static std::string refusal(const openvdb::GridBase::ConstPtr& grid, cumulet_status status = CUMULET_ERROR_FILE) {
    return refused(status, [&](auto... arguments) { return cumulet::volume_from_openvdb(grid, arguments...); });
  }

  template <class GridT = openvdb::FloatGrid>
  static typename GridT::Ptr rich(float background) {
    using ValueT = typename GridT::ValueType;
    auto grid = GridT::create(ValueT(background));
    grid->setName("density");
    auto& tree = grid->tree();
    std::mt19937 random(3);
    for (int i = 0; i < 3000; ++i) {
      const Coord c(static_cast<int>(random() % 60) - 23, static_cast<int>(random() % 50) - 19,
                    static_cast<int>(random() % 40) + 5);
      tree.setValue(c, ValueT(static_cast<float>(random() % 64) / 32.0F));
      if (i % 4 == 0) tree.setValueOff(c.offsetBy(1, 0, 0), ValueT(static_cast<float>(random() % 64) / 32.0F));
    }
    tree.addTile(1, Coord(64, 0, 0), ValueT(0.75F), true);
    tree.addTile(1, Coord(64, 8, 0), ValueT(0.5F), false);
    tree.addTile(1, Coord(64, 16, 0), ValueT(background), true);
    tree.addTile(2, Coord(128, 0, 0), ValueT(1.25F), true);
    tree.addTile(2, Coord(0, 128, 0), ValueT(0.375F), false);
    tree.addTile(3, Coord(4096, 0, 0), ValueT(0.25F), true);
    tree.setValueOff(Coord(-200, 0, 0), ValueT(9.0F));
    tree.setValue(Coord(-30, -130, 7), ValueT(-0.25F));
    openvdb::Mat4d m = openvdb::Mat4d::identity();
    m.preScale(openvdb::Vec3d(0.5, 2.0, 1e-3));
    m.postRotate(openvdb::math::Y_AXIS, 0.7);
    m.postTranslate(openvdb::Vec3d(10, -20, 30));
    grid->setTransform(openvdb::math::Transform::createLinearTransform(m));
    return grid;
  }

  cumulet::test::Folder folder_;
};

TEST_F(OpenVdbVolume, MatchesTheFileImport) {
  for (const float background : {0.0F, 0.125F}) {
    const auto grid = rich(background);
    const Volume file = open(write({grid}));
    const Volume memory = copy(grid);
    EXPECT_GT(inside(memory).brick_origins.size(), 20U);
    EXPECT_GE(inside(memory).tiles.size(), 4U);
    expect_identical(inside(memory), inside(file));
  }
  const auto wide = rich<openvdb::DoubleGrid>(0.0F);
  expect_identical(inside(copy(wide)), inside(open(write({wide}))));
  // Values that are exact halves: stored as half in the file, or half in memory.
  const auto narrow = rich(0.0F);
  narrow->setSaveFloatAsHalf(true);
  const Volume file = open(write({narrow}));
  expect_identical(inside(copy(narrow)), inside(file));
  using HalfGrid = openvdb::Grid<openvdb::tree::Tree4<openvdb::math::half, 5, 4, 3>::Type>;
  expect_identical(inside(copy(rich<HalfGrid>(0.0F))), inside(file));
}

TEST_F(OpenVdbVolume, ReadsDelayLoadedLeaves) {
  const auto grid = rich(0.125F);
  const std::string file = write({grid});
  openvdb::io::File lazy(file);
  lazy.setCopyMaxBytes(0);
  lazy.open(true);
  const auto delayed = openvdb::gridPtrCast<openvdb::FloatGrid>(lazy.readGrid("density"));
  ASSERT_TRUE(delayed->tree().cbeginLeaf()->buffer().isOutOfCore());
  expect_identical(inside(copy(delayed)), inside(open(file)));
}

TEST_F(OpenVdbVolume, RejectsTheSameGridsAsFiles) {
  EXPECT_HAS(refusal(nullptr, CUMULET_ERROR_INVALID_ARGUMENT), "grid is NULL");
  const auto sphere = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(5.0F, openvdb::Vec3f(0), 1.0F);
  sphere->setName("surface");
  EXPECT_EQ(refusal(sphere), "surface: is a level set, not a fog volume");
  const auto vec = openvdb::Vec3SGrid::create();
  vec->setName("vel\nocity");
  vec->tree().setValue(Coord(0), openvdb::Vec3s(1));
  EXPECT_EQ(refusal(vec), "vel ocity: has type vec3s, not a float or half scalar");
  const auto number = openvdb::Int32Grid::create();
  number->tree().setValue(Coord(0), 1);
  EXPECT_EQ(refusal(number), "openvdb: has type int32, not a float or half scalar");
  const auto frustum = openvdb::FloatGrid::create();
  frustum->tree().setValue(Coord(0), 1.0F);
  frustum->setTransform(openvdb::math::Transform::createFrustumTransform(
      openvdb::BBoxd(openvdb::Vec3d(0), openvdb::Vec3d(10)), 0.5, 2.0));
  EXPECT_HAS(refusal(frustum), "frustum");
  EXPECT_TRUE(inside(copy(openvdb::FloatGrid::create())).empty());
  const auto bad = openvdb::FloatGrid::create();
  bad->tree().setValue(Coord(1, 2, 3), NAN);
  EXPECT_EQ(inside(copy(bad)).non_finite_voxels, 1U);
  EXPECT_EQ(cumulet::volume_from_openvdb(rich(0.0F), nullptr), CUMULET_ERROR_INVALID_ARGUMENT);
}

TEST_F(OpenVdbVolume, FilesUseTheHostsTransform) {
  const auto grid = rich(0.0F);
  const std::string file = write({grid});
  cumulet_volume_file_desc desc{};
  desc.struct_size = sizeof desc;
  desc.path = file.c_str();
  const auto call = [&](cumulet_volume** out, char* error, size_t size) {
    return cumulet_volume_open_file(&desc, out, error, size);
  };
  expect_identical(inside(made(call)), inside(open(file)));
  // Z up to Y up: (x, y, z) to (x, z, -y).
  const double upright[16] = {1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1};
  std::ranges::copy(upright, desc.to_world);
  const Volume turned = made(call);
  const glm::dmat4 before = inside(open(file)).index_to_world;
  const glm::dmat4& after = inside(turned).index_to_world;
  for (int column = 0; column < 4; ++column)
    EXPECT_EQ(after[column], glm::dvec4(before[column].x, before[column].z, -before[column].y, before[column].w));
  desc.to_world[3] = 0.5;
  EXPECT_HAS(refused(CUMULET_ERROR_INVALID_ARGUMENT, call), "not affine");
  desc.to_world[3] = NAN;
  EXPECT_HAS(refused(CUMULET_ERROR_INVALID_ARGUMENT, call), "not finite");
  std::fill_n(desc.to_world, 15, 0.0);
  desc.to_world[15] = 1.0;
  EXPECT_HAS(refused(CUMULET_ERROR_INVALID_ARGUMENT, call), "is singular");
}

TEST_F(OpenVdbVolume, CanBeInspected) {
  const auto grid = rich(0.0F);
  grid->insertMeta("author", openvdb::StringMetadata("me"));
  const auto sphere = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(5.0F, openvdb::Vec3f(0), 1.0F);
  sphere->setName("surface");
  const std::string file = write({sphere, grid});
  cumulet_inspection* inspection = nullptr;
  char error[256] = "x";
  ASSERT_EQ(cumulet_inspect_volume_file(file.c_str(), &inspection, error, sizeof error), CUMULET_OK) << error;
  cumulet_volume_file_info info{};
  info.struct_size = sizeof info;
  ASSERT_EQ(cumulet_inspection_get_file(inspection, &info), CUMULET_OK);
  EXPECT_EQ(info.grid_count, 2U);
  EXPECT_EQ(info.default_grid, 1);
  EXPECT_STREQ(info.format, "OpenVDB 224");
  cumulet_grid_info found{};
  found.struct_size = sizeof found;
  ASSERT_EQ(cumulet_inspection_get_grid(inspection, 1, &found), CUMULET_OK);
  EXPECT_STREQ(found.name, "density");
  EXPECT_STREQ(found.type, "float");
  EXPECT_STREQ(found.unsupported_reason, "");
  EXPECT_EQ(found.values, CUMULET_GRID_VALUES_SCALARS);
  const Volume volume = open(file);
  EXPECT_EQ(found.active_voxels, inside(volume).active_voxels);
  EXPECT_EQ(found.max_value, inside(volume).max_value);
  std::uint64_t counted = 0;
  for (const std::uint64_t bin : found.histogram) counted += bin;
  EXPECT_EQ(counted, found.active_voxels);
  cumulet_volume_info shown{};
  shown.struct_size = sizeof shown;
  ASSERT_EQ(cumulet_volume_get_info(volume.get(), &shown), CUMULET_OK);
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_EQ(found.bounds_min[axis], shown.bounds_min[axis]);
    EXPECT_EQ(found.bounds_max[axis], shown.bounds_max[axis]);
  }
  bool author = false;
  cumulet_metadata entry{};
  entry.struct_size = sizeof entry;
  for (std::uint32_t i = 0; i < found.metadata_count; ++i) {
    ASSERT_EQ(cumulet_inspection_get_metadata(inspection, 1, i, &entry), CUMULET_OK);
    author = author || (std::string(entry.name) == "author" && std::string(entry.value) == "me");
  }
  EXPECT_TRUE(author);
  ASSERT_EQ(cumulet_inspection_get_grid(inspection, 0, &found), CUMULET_OK);
  EXPECT_STREQ(found.unsupported_reason, "is a level set, not a fog volume");
  EXPECT_EQ(cumulet_inspection_get_grid(inspection, 2, &found), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(cumulet_inspection_get_grid(inspection, 0, nullptr), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(cumulet_inspection_get_metadata(inspection, 1, 1000, &entry), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(cumulet_inspection_get_metadata(inspection, 2, 0, &entry), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(cumulet_inspection_get_metadata(inspection, -2, 0, &entry), CUMULET_ERROR_INVALID_ARGUMENT);
  cumulet_inspection_release(inspection);
  cumulet_inspection_release(nullptr);
  EXPECT_EQ(cumulet_inspect_volume_file("/nowhere/x.vdb", &inspection, error, sizeof error), CUMULET_ERROR_FILE);
  EXPECT_EQ(inspection, nullptr);
  EXPECT_STREQ(error, "/nowhere/x.vdb: no such file");
  EXPECT_EQ(cumulet_inspect_volume_file(nullptr, &inspection, error, sizeof error), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(cumulet_inspection_get_file(nullptr, &info), CUMULET_ERROR_INVALID_ARGUMENT);
}

TEST_F(OpenVdbVolume, FilesOpenAndFail) {
  const auto grid = rich(0.0F);
  const auto other = openvdb::FloatGrid::create();
  other->setName("density");
  other->tree().setValue(Coord(3), 8.0F);
  const std::string file = write({grid, other});
  EXPECT_EQ(inside(open(file, "density[1]")).max_value, 8.0F);
  const auto opening = [](const char* path, const char* name) {
    return [=](auto... arguments) { return cumulet_volume_open(path, name, arguments...); };
  };
  const std::string several = refused(CUMULET_ERROR_FILE, opening(file.c_str(), "density"));
  EXPECT_EQ(several.rfind(file + ": ", 0), 0U) << several;
  EXPECT_HAS(refused(CUMULET_ERROR_FILE, opening(file.c_str(), "dust")), "has no grid \"dust\"");
  EXPECT_HAS(refused(CUMULET_ERROR_FILE, opening("/nowhere/x.vdb", nullptr)), "/nowhere/x.vdb: no such file");
  EXPECT_HAS(refused(CUMULET_ERROR_INVALID_ARGUMENT, opening(nullptr, nullptr)), "path is NULL");
  EXPECT_EQ(cumulet_volume_open(file.c_str(), "density[1]", nullptr, nullptr, 0), CUMULET_ERROR_INVALID_ARGUMENT);
  // A control cube cannot hold it; the message still names the file.
  other->tree().setValue(Coord(500000, 0, 0), 1.0F);
  const std::string wide = write({other});
  const std::string line = refused(CUMULET_ERROR_UNSUPPORTED, opening(wide.c_str(), nullptr));
  EXPECT_EQ(line.rfind(wide + ": ", 0), 0U) << line;
  // A message longer than its buffer is truncated and terminated.
  std::array<char, 12> buffer{};
  buffer.fill('x');
  cumulet_volume* volume = nullptr;
  EXPECT_EQ(cumulet_volume_open("/nowhere/x.vdb", nullptr, &volume, buffer.data(), buffer.size()), CUMULET_ERROR_FILE);
  EXPECT_STREQ(buffer.data(), "/nowhere/x.");
}

TEST_F(OpenVdbVolume, ListsGrids) {
  const auto grid = rich(0.0F);
  const auto sphere = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(5.0F, openvdb::Vec3f(0), 1.0F);
  sphere->setName("surface");
  const std::string file = write({grid, sphere, grid->deepCopy()});
  std::vector<std::array<std::string, 3>> listed;
  const auto list = [](void* user, const char* name, const char* type, const char* refusal) {
    static_cast<decltype(listed)*>(user)->push_back({name, type, refusal});
  };
  char error[256] = "x";
  ASSERT_EQ(cumulet_list_grids(file.c_str(), list, &listed, error, sizeof error), CUMULET_OK) << error;
  EXPECT_STREQ(error, "");
  ASSERT_EQ(listed.size(), 3U);
  EXPECT_EQ(listed[0], (std::array<std::string, 3>{"density[0]", "float", ""}));
  EXPECT_EQ(listed[1], (std::array<std::string, 3>{"surface", "float", "is a level set, not a fog volume"}));
  EXPECT_EQ(listed[2][0], "density[1]");
  // Every listed name can be opened.
  expect_identical(inside(open(file, "density[0]")), inside(open(file, "density[1]")));

  EXPECT_EQ(cumulet_list_grids("/nowhere/x.vdb", list, &listed, error, sizeof error), CUMULET_ERROR_FILE);
  EXPECT_STREQ(error, "/nowhere/x.vdb: no such file");
  EXPECT_EQ(cumulet_list_grids(nullptr, list, &listed, error, sizeof error), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(cumulet_list_grids(file.c_str(), nullptr, nullptr, error, sizeof error), CUMULET_ERROR_INVALID_ARGUMENT);
  // An exception of a host's callback does not leave the call.
  const auto throwing = [](void*, const char*, const char*, const char*) { throw std::runtime_error("host's own"); };
  EXPECT_EQ(cumulet_list_grids(file.c_str(), throwing, nullptr, error, sizeof error), CUMULET_ERROR_INTERNAL);
  // A callback may not open files, and gets NULL instead.
  const auto nested = [](void* user, const char*, const char*, const char*) {
    auto* inspection = static_cast<cumulet_inspection*>(user);
    EXPECT_EQ(cumulet_inspect_volume_file("/nowhere/x.vdb", &inspection, nullptr, 0), CUMULET_ERROR_INVALID_ARGUMENT);
    EXPECT_EQ(inspection, nullptr);
  };
  EXPECT_EQ(cumulet_list_grids(file.c_str(), nested, &listed, error, sizeof error), CUMULET_OK);
}

TEST(VolumeHandle, NullIsHarmless) {
  EXPECT_EQ(cumulet_volume_retain(nullptr), nullptr);
  cumulet_volume_release(nullptr);
  cumulet_volume_info info{};
  info.struct_size = sizeof info;
  EXPECT_EQ(cumulet_volume_get_info(nullptr, &info), CUMULET_ERROR_INVALID_ARGUMENT);
  cumulet_volume* volume = nullptr;
  EXPECT_EQ(cumulet_volume_from_dense(nullptr, &volume, nullptr, 0), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(cumulet_volume_from_sparse(nullptr, &volume, nullptr, 0), CUMULET_ERROR_INVALID_ARGUMENT);
  Dense dense(1, 1, 1);
  dense.at(0, 0, 0) = 1.0F;
  EXPECT_EQ(cumulet_volume_from_dense(&dense.desc, nullptr, nullptr, 0), CUMULET_ERROR_INVALID_ARGUMENT);
  const Volume made_volume = made(dense.call());
  EXPECT_EQ(cumulet_volume_get_info(made_volume.get(), nullptr), CUMULET_ERROR_INVALID_ARGUMENT);
  info.struct_size = 1;
  EXPECT_EQ(cumulet_volume_get_info(made_volume.get(), &info), CUMULET_ERROR_INVALID_ARGUMENT);
}

TEST(VolumeHandle, IsCountedByManyThreads) {
  Dense dense(1, 1, 1);
  dense.at(0, 0, 0) = 1.0F;
  Volume volume = made(dense.call());
  const std::weak_ptr<const cumulet::viewer::VolumeAsset> asset = volume->asset;
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([mine = cumulet_volume_retain(volume.get())] {
      for (int i = 0; i < 20000; ++i) cumulet_volume_release(cumulet_volume_retain(mine));
      cumulet_volume_release(mine);
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(volume->references, 1);
  EXPECT_FALSE(asset.expired());
  volume.reset();
  EXPECT_TRUE(asset.expired());
}

// Grids of a host's own OpenVDB as a state of a dynamic volume. The density equals that of a volume made from it.
TEST(LiveOpenVdb, LiveStateMatchesTheVolume) {
  const auto density = openvdb::FloatGrid::create();
  const auto heat = openvdb::DoubleGrid::create();
  for (int i = 0; i < 600; ++i) {
    density->tree().setValue(Coord(i % 13, i / 13 % 17, i / 200), 0.1F + 0.01F * static_cast<float>(i));
    heat->tree().setValue(Coord(i % 11, i / 11 % 15, i / 170), 1.0 + 0.002 * i);
  }
  density->fill(openvdb::CoordBBox(Coord(32), Coord(47)), 0.5F);
  density->setName("smoke");
  const auto desc = cumulet_dynamic_volume_desc{
      .struct_size = sizeof(cumulet_dynamic_volume_desc), .bounds_min = {}, .bounds_max = {}, .gpu_resident = 0};
  cumulet_dynamic_volume* live = nullptr;
  ASSERT_EQ(cumulet_dynamic_volume_create(&desc, &live, nullptr, 0), CUMULET_OK);
  const std::unique_ptr<cumulet_dynamic_volume, decltype(&cumulet_dynamic_volume_release)> owner(
      live, cumulet_dynamic_volume_release);
  char error[256] = "";
  ASSERT_EQ(
      cumulet::dynamic_volume_set_openvdb(
          live, {{CUMULET_CHANNEL_TEMPERATURE, heat}, {CUMULET_CHANNEL_DENSITY, density}}, "fire", error, sizeof error),
      CUMULET_OK)
      << error;
  const Volume state = made([&](auto** out, char* line, std::size_t size) {
    return cumulet_dynamic_volume_get_volume(live, out, line, size);
  });
  const Volume alone = made(
      [&](auto** out, char* line, std::size_t size) { return cumulet::volume_from_openvdb(density, out, line, size); });
  ScalarVolume wanted = inside(alone);
  wanted.name = "density";
  cumulet::test::expect_same_voxels(inside(state), wanted);
  ASSERT_TRUE(state->asset->frame().temperature);
  EXPECT_EQ(value_at(*state->asset->frame().temperature, {3, 1, 0}), static_cast<float>(1.0 + 0.002 * 14));
  const auto level_set = openvdb::FloatGrid::create();
  level_set->setGridClass(openvdb::GRID_LEVEL_SET);
  level_set->setName("surface");
  EXPECT_EQ(
      cumulet::dynamic_volume_set_openvdb(live, {{CUMULET_CHANNEL_DENSITY, level_set}}, "fire", error, sizeof error),
      CUMULET_ERROR_FILE);
  EXPECT_STREQ(error, "fire: surface: is a level set, not a fog volume");
}

}  // namespace
