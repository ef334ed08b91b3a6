#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <random>
#include <set>

#include "base/error.hpp"
#include "grid/cell.hpp"
#include "grid/refine.hpp"
#include "grid/statistics.hpp"
#include "support/conforming_grid.hpp"
#include "support/volumes.hpp"

namespace {

using namespace cumulet;
using cumulet::test::build;
using cumulet::test::Built;
using cumulet::test::expect_conforming;
using cumulet::test::voxel_by_voxel;
using glm::dvec3;
using glm::ivec3;
using glm::vec3;

// Sums the voxel sixths inside a cell by recursive bisection: slow, independent of bricks and octrees.
grid::Moments brute_moments(const volume::ScalarVolume& volume, const grid::Cube& cube, const vec3& v0,
                            std::uint32_t shape) {
  grid::Moments m;
  if (core::cm_shape_class(shape) == 1 && core::cm_shape_exponent(shape) == 0) {
    const vec3 centroid = v0 + core::cm_from_frame(core::cm_frame_centroid(1), shape);
    const float f = test::value_at(volume, ivec3(centroid) + cube.origin);
    m.volume = 1.0 / 6.0;
    m.mass = f / 6.0;
    m.square = double(f) * f / 6.0;
    m.first = dvec3(centroid) * m.mass;
    m.min = m.max = f;
    return m;
  }
  m = brute_moments(volume, cube, v0, core::cm_child_shape(shape, 0));
  m += brute_moments(volume, cube, core::cm_cell_vertex(v0, shape, 1), core::cm_child_shape(shape, 1));
  return m;
}

TEST(Shapes, TetrahedronShapesAreClosedUnderBisection) {
  std::set<std::uint32_t> seen;
  std::vector<std::pair<vec3, std::uint32_t>> todo;
  for (unsigned root = 0; root < 24; ++root) {
    vec3 v0;
    std::uint32_t shape = 0;
    core::cm_root_cell(root, 8, v0, shape);
    todo.emplace_back(v0, shape);
  }
  for (int level = 0; level < 12; ++level) {
    std::vector<std::pair<vec3, std::uint32_t>> next;
    for (const auto& [v0, shape] : todo) {
      seen.insert(shape & 0x7ffU);
      std::array<vec3, 4> v;
      for (unsigned i = 0; i < 4; ++i) v[i] = core::cm_cell_vertex(v0, shape, i);
      // v0 v1 is the longest edge.
      for (unsigned i = 0; i < 4; ++i) {
        for (unsigned j = i + 1; j < 4; ++j) EXPECT_LE(glm::distance(v[i], v[j]), glm::distance(v[0], v[1]) * 1.00001F);
      }
      for (unsigned child = 0; child < 2; ++child) {
        const vec3 child_v0 = child == 0 ? v[0] : v[1];
        const std::uint32_t child_shape = core::cm_child_shape(shape, child);
        std::multiset<std::array<float, 3>> expected;
        std::multiset<std::array<float, 3>> got;
        const vec3 middle = 0.5F * (v[0] + v[1]);
        for (const vec3& p : {child_v0, v[2], v[3], middle}) expected.insert({p.x, p.y, p.z});
        for (unsigned i = 0; i < 4; ++i) {
          const vec3 p = core::cm_cell_vertex(child_v0, child_shape, i);
          got.insert({p.x, p.y, p.z});
        }
        EXPECT_EQ(expected, got);
        if (next.size() < 2000) next.emplace_back(child_v0, child_shape);
      }
    }
    todo = std::move(next);
  }
  EXPECT_EQ(seen.size(), 144U);
}

TEST(Statistics, MatchBruteForceOnEveryCellAboveAndInsideBricks) {
  const auto volume = test::noise_volume({21, 13, 60}, ivec3(-5, 3, 17), 7);
  const grid::Cube cube = grid::fit_cube(volume);
  ASSERT_EQ(cube.size(), 64);
  const grid::Statistics statistics(volume, cube);
  test::Random random(3);
  int brick_level = 0;
  for (int trial = 0; trial < 400; ++trial) {
    vec3 v0;
    std::uint32_t shape = 0;
    core::cm_root_cell(random() % 24, static_cast<std::uint32_t>(cube.log2_size - 1), v0, shape);
    const int depth = static_cast<int>(random() % 8);
    for (int i = 0; i < depth; ++i) {
      if (random() % 2 != 0) {
        const vec3 v1 = core::cm_cell_vertex(v0, shape, 1);
        shape = core::cm_child_shape(shape, 1);
        v0 = v1;
      } else {
        shape = core::cm_child_shape(shape, 0);
      }
    }
    const grid::Moments a = statistics.moments(v0, shape);
    const grid::Moments b = brute_moments(volume, cube, v0, shape);
    EXPECT_NEAR(a.volume, b.volume, 1e-9);
    EXPECT_NEAR(a.mass, b.mass, 1e-4 + 1e-5 * b.mass);
    EXPECT_NEAR(a.square, b.square, 1e-4 + 1e-5 * b.square);
    for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(a.first[axis], b.first[axis], 1e-2 + 1e-5 * b.first[axis]);
    EXPECT_EQ(a.min, b.min);
    EXPECT_EQ(a.max, b.max);
    brick_level += core::cm_shape_class(shape) == 1 && core::cm_shape_exponent(shape) == 3 ? 1 : 0;
  }
  EXPECT_GT(brick_level, 0);
  for (unsigned frame_trial = 0; frame_trial < 6; ++frame_trial) {
    const auto& node = statistics.nodes()[statistics.nodes_of_size(3)[frame_trial]];
    const std::uint32_t frame = grid::kuhn_frame(node.corner, 8, frame_trial);
    grid::BrickSums sums;
    volume::BrickValues::Brick room;
    const grid::BrickTree& tree = grid::brick_tree(frame);
    const float* values = statistics.values(node, room);
    sums.compute(values, grid::BrickSums::reference_of(values), tree);
    vec3 v0(node.corner);
    for (int axis = 0; axis < 3; ++axis) v0[axis] += ((node.corner[axis] / 8) & 1) != 0 ? 8.0F : 0.0F;
    std::uint32_t shape = frame | (1U << 9U) | (3U << 11U);
    unsigned heap = 1;
    for (int i = 0; i < 9; ++i) {
      const grid::Moments a = sums.moments(heap, node.corner, tree);
      const grid::Moments b = brute_moments(volume, cube, v0, shape);
      EXPECT_NEAR(a.mass, b.mass, 1e-4 + 1e-5 * b.mass);
      EXPECT_NEAR(a.square, b.square, 1e-4 + 1e-5 * b.square);
      for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(a.first[axis], b.first[axis], 1e-3 + 1e-5 * b.first[axis]);
      const unsigned side = random() % 2;
      const vec3 v1 = core::cm_cell_vertex(v0, shape, 1);
      shape = core::cm_child_shape(shape, side);
      if (side == 1) v0 = v1;
      heap = 2 * heap + side;
    }
  }
}

TEST(Statistics, TilesAndBackgroundAreWeightedLikeVoxels) {
  volume::ScalarVolume volume;
  volume.name = "density";
  volume.bounds_min = {3, 0, 0};
  volume.bounds_max = {60, 40, 50};
  volume.background = 0.25F;
  volume.max_value = 2.0F;
  volume.tiles.push_back({{16, 8, 8}, {40, 31, 31}, 2.0F});
  volume.active_voxels = 1;
  const grid::Cube cube = grid::fit_cube(volume);
  const grid::Statistics statistics(volume, cube);
  grid::Moments sum;
  double brute = 0.0;
  for (unsigned root = 0; root < 24; ++root) {
    vec3 v0;
    std::uint32_t shape = 0;
    core::cm_root_cell(root, static_cast<std::uint32_t>(cube.log2_size - 1), v0, shape);
    sum += statistics.moments(v0, shape);
  }
  for (int x = 0; x < 64; ++x) {
    for (int y = 0; y < 64; ++y) {
      for (int z = 0; z < 64; ++z) brute += test::value_at(volume, {x, y, z});
    }
  }
  EXPECT_NEAR(sum.mass, brute, 1e-6 * brute);
  EXPECT_EQ(sum.max, 2.0F);
  EXPECT_EQ(sum.min, 0.0F);
}

TEST(Statistics, MemoryGrowsWithActiveNodesNotWithTheBoundingBox) {
  volume::ScalarVolume volume;
  volume.name = "density";
  volume.bounds_min = {0, 0, 0};
  volume.bounds_max = {30007, 30007, 30007};
  volume.max_value = 1.0F;
  volume.brick_origins = {{0, 0, 0}, {30000, 30000, 30000}};
  std::vector<float> values(1024, 0.0F);
  values[0] = values[1023] = 1.0F;
  volume.brick_values = std::move(values);
  const grid::Cube cube = grid::fit_cube(volume);
  ASSERT_EQ(cube.log2_size, 15);
  const grid::Statistics statistics(volume, cube);
  EXPECT_LT(statistics.nodes().size(), 2U * 8U * 13U);
  const Built built = build(volume, voxel_by_voxel());
  expect_conforming(built.grid);
  EXPECT_LT(built.grid.cells.size(), 8000U);
  EXPECT_EQ(
      glm::unpackHalf2x16(built.grid.cells[grid::locate(built.grid, vec3(30007.3F, 30007.4F, 30007.6F))].data.z).x,
      1.0F);
}

TEST(Statistics, LargeTilesAreSummedCompletely) {
  volume::ScalarVolume tile;
  tile.name = "density";
  tile.bounds_max = {(1 << 17) - 1, (1 << 18) - 1, (1 << 16) - 1};
  tile.tiles.push_back({tile.bounds_min, tile.bounds_max, 0.5F});
  tile.max_value = 0.5F;
  const grid::Statistics statistics(tile, grid::fit_cube(tile));
  EXPECT_DOUBLE_EQ(statistics.mean_optical_depth(), 0.5 * ((1 << 17) + (1 << 18) + (1 << 16)) / 3.0);
  EXPECT_LT(statistics.bytes(), 100'000U);
}

TEST(Cube, TooLargeVolumesGiveAOneLineError) {
  volume::ScalarVolume bar;
  bar.name = "bar";
  bar.bounds_min = {1'000'000, -1'000'000, 64};
  bar.bounds_max = bar.bounds_min + ivec3((1 << 18) - 1, 0, 0);
  EXPECT_EQ(grid::fit_cube(bar).log2_size, 18);
  ++bar.bounds_max.x;
  try {
    grid::fit_cube(bar);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::unsupported);
    EXPECT_STREQ(error.what(), "grid 'bar' is 262145 voxels wide; the limit is 262144");
  }
}

TEST(LinearFit, RecoversALinearFieldAndStaysNonNegative) {
  for (std::uint32_t cell_class = 0; cell_class < 3; ++cell_class) {
    // f = 3 + g.(x - c): covariance = C g with C the tetrahedron's covariance, integrated here by its vertices.
    const dvec3 g(0.3, -0.2, 0.5);
    const dvec3 centroid = core::cm_frame_centroid(cell_class);
    dvec3 covariance(0.0);
    for (std::uint32_t i = 0; i < 4; ++i) {
      const dvec3 v = dvec3(core::cm_frame_vertex(cell_class, i)) - centroid;
      covariance += v * glm::dot(v, g) / 20.0;
    }
    const grid::LinearFit fit = grid::fit_linear(cell_class, vec3(covariance), 3.0F);
    for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(fit.gradient[axis], g[axis], 1e-5);
    EXPECT_NEAR(fit.explained, glm::dot(g, covariance), 1e-5);
    const grid::LinearFit clamped = grid::fit_linear(cell_class, vec3(covariance), 0.1F);
    double lowest = 1e9;
    for (std::uint32_t i = 0; i < 4; ++i) {
      lowest = std::min(
          lowest, 0.1 + glm::dot(dvec3(clamped.gradient), dvec3(core::cm_frame_vertex(cell_class, i)) - centroid));
    }
    EXPECT_NEAR(lowest, 0.0, 1e-5);
  }
}

}  // namespace
