// Volumes of the C API from dense and sparse voxels in memory. Volumes from OpenVDB: openvdb_volume_test.cpp.

#include <cumulet/cumulet.h>
#include <gtest/gtest.h>
#include <cumulet/cumulet_openvdb.hpp>

#include <cmath>
#include <limits>
#include <random>
#include <thread>

#include "support/c_volumes.hpp"
#include "support/openvdb.hpp"
#include "support/volumes.hpp"

namespace {

using cumulet::test::expect_identical;
using cumulet::test::inside;
using cumulet::test::made;
using cumulet::test::refused;
using cumulet::test::value_at;
using cumulet::test::Volume;
using cumulet::volume::ScalarVolume;
using openvdb::Coord;

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

}  // namespace
