// The lattice, which caches the view-independent data of a grid: priorities that give the same splits as evaluating the
// criterion, and coefficients that equal the cell data.

#include "grid/lattice.hpp"

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <set>

#include "grid/evaluation.hpp"
#include "grid/grid_builder.hpp"
#include "support/view_cameras.hpp"
#include "support/volumes.hpp"

namespace {

using namespace cumulet;
using glm::dvec3;
using glm::ivec3;
using glm::vec3;

grid::TetGrid grid_of(const grid::Statistics& statistics, const grid::DiamondSet& diamonds) {
  grid::GridBuilder builder(statistics, diamonds);
  builder.bisect();
  return builder.records(grid::CellKind::linear, 1.0F);
}

TEST(ViewLevels, LevelIsChosenByTheLongestEdgeInPixels) {
  // Edge lengths computed by hand: a sheared and stretched lattice, seen from far away.
  volume::ScalarVolume volume = test::noise_volume({60, 45, 50}, ivec3(0), 1);
  volume.index_to_world = glm::dmat4(1.0);
  volume.index_to_world[0] = {0.5, 0.0, 0.0, 0.0};
  volume.index_to_world[1] = {0.3, 1.0, 0.0, 0.0};
  volume.index_to_world[2] = {0.0, 0.2, 2.0, 0.0};
  const grid::Cube cube = grid::fit_cube(volume);
  ASSERT_EQ(cube.log2_size, 6);
  grid::RefineSettings settings;
  EXPECT_EQ(grid::ViewLevels(cube, settings).in(ivec3(0), 3), 16U) << "no camera";
  grid::RefineCamera camera;
  camera.eye = {16.0, 24.0, 5000.0};
  camera.tan_half_x = camera.tan_half_y = 1.0;
  for (const double pixel_length : {0.1, 0.5, 1.0, 1.9, 2.7, 3.9, 4.2, 9.0, 17.0, 35.0, 1000.0}) {
    // At a distance of about 5000, minus the radius of the brick's bounding sphere.
    camera.pixels_per_radian = 1.0;
    settings.pixel_size = pixel_length / 5000.0;
    settings.camera = camera;
    const ivec3 corner(24, 16, 16);
    const dvec3 centre(cube.to_world * glm::dvec4(dvec3(corner) + 4.0, 1.0));
    double radius = 0.0;
    for (int i = 0; i < 4; ++i) {
      const dvec3 diagonal(4.0, (i & 1) != 0 ? -4.0 : 4.0, (i & 2) != 0 ? -4.0 : 4.0);
      radius = std::max(radius, glm::length(glm::dmat3(cube.to_world) * diagonal));
    }
    const double shortest = settings.pixel_size * (glm::distance(centre, camera.eye) - radius);
    // The longest edge of each level: along axes (A), diagonals of cubes (B), of faces (C).
    const glm::dmat3 m(cube.to_world);
    const auto longest = [&](int level) {
      const double unit = std::exp2(5 - level / 3);
      double most = 0.0;
      for (int a = -1; a <= 1; ++a) {
        for (int b = -1; b <= 1; ++b) {
          for (int c = -1; c <= 1; ++c) {
            const int kind = std::abs(a) + std::abs(b) + std::abs(c);
            if (kind != std::array{1, 3, 2}[level % 3]) continue;
            most = std::max(most, (level % 3 == 0 ? 2.0 : 1.0) * unit * glm::length(m * dvec3(a, b, c)));
          }
        }
      }
      return most;
    };
    unsigned expected = 0;
    for (int level = 0; level < 16; ++level) {
      if (longest(level) >= shortest) expected = static_cast<unsigned>(level) + 1;
    }
    EXPECT_EQ(grid::ViewLevels(cube, settings).in(corner, 3), expected) << pixel_length;
  }
  settings.camera->forward = {0.0, 0.0, 1.0};
  EXPECT_EQ(grid::ViewLevels(cube, settings).in(ivec3(24, 16, 16), 3), 0U) << "behind the eye";
}

TEST(RefinementPriorities, StoredPrioritiesGiveTheSameSplitsAsReevaluation) {
  test::Cameras cameras(3);
  for (const test::SmallVolume& small : test::small_volumes()) {
    const grid::Statistics statistics(small.volume, grid::fit_cube(small.volume));
    grid::RefineSettings settings = small.settings;
    const grid::OwnPriorities own(statistics, {}, settings);
    for (int i = 0; i < 12; ++i) {
      settings.camera.reset();
      if (i % 4 != 0) settings.camera = cameras.about(statistics.cube());
      settings.max_cells = i % 3 == 2 ? 300 * (i + 1) : 5'400'000;
      const grid::DiamondSet anew(statistics, settings);
      const grid::DiamondSet kept(own, own.levels(grid::ViewLevels(statistics.cube(), settings)), settings.max_cells);
      EXPECT_EQ(kept.cell_count(), anew.cell_count()) << small.name << i;
      EXPECT_EQ(kept.limited(), anew.limited()) << small.name << i;
      const grid::TetGrid a = grid_of(statistics, kept);
      const grid::TetGrid b = grid_of(statistics, anew);
      ASSERT_EQ(a.cells.size(), b.cells.size()) << small.name << i;
      EXPECT_EQ(std::memcmp(a.cells.data(), b.cells.data(), a.cells.size() * sizeof(grid::CellRecord)), 0)
          << small.name << i;
    }
  }
}

// A shaking camera changes many cells if each view is refined separately, and few if hysteresis keeps existing cells.
TEST(RefinementPriorities, HysteresisKeepsCellsWhileTheCameraMoves) {
  const auto volume = test::noise_volume({120, 100, 110}, ivec3(0), 1);
  const grid::Statistics statistics(volume, grid::fit_cube(volume));
  grid::RefineSettings settings;
  const grid::OwnPriorities own(statistics, {}, settings);
  grid::RefineCamera camera;
  camera.tan_half_x = camera.tan_half_y = 0.2;
  camera.pixels_per_radian = 100.0;
  std::vector<std::uint8_t> kept;
  std::vector<std::uint8_t> before;
  std::size_t others = 0;
  std::size_t kept_others = 0;
  for (int i = 0; i < 40; ++i) {
    camera.eye = {60.0 + 2.0 * std::sin(2.1 * i), 50.0 + 2.0 * std::cos(3.7 * i), 300.0 + 3.0 * std::sin(1.3 * i)};
    settings.camera = camera;
    const auto wanted = own.levels(grid::ViewLevels(statistics.cube(), settings));
    const auto most = own.levels(grid::ViewLevels(statistics.cube(), grid::with_slack(settings)));
    const auto next = i == 0 ? most : own.levels(statistics.cube(), settings, kept);
    for (std::size_t n = 0; n < next.size(); ++n) {
      ASSERT_GE(next[n], wanted[n]) << "no coarser than the view wants";
      ASSERT_LE(next[n], most[n]) << "and not much finer";
      if (i > 0 && next[n] != kept[n]) ++kept_others;
      if (i > 0 && wanted[n] != before[n]) ++others;
    }
    kept = next;
    before = wanted;
  }
  EXPECT_GT(others, 200U);
  EXPECT_LT(kept_others, others / 10);
}

// Each of the 42 coefficient entries belongs to one cell and equals that cell's record.
TEST(Lattice, EachRecordBelongsToOneCoarseCell) {
  for (const test::SmallVolume& small : test::small_volumes()) {
    const grid::Statistics statistics(small.volume, grid::fit_cube(small.volume));
    const grid::Lattice lattice(statistics, {}, small.settings, 1.0F);
    std::size_t found = 0;
    const auto look_up = [&](const grid::CellRecord& cell) {
      const std::uint32_t shape = core::cm_record_shape(cell.data);
      const vec3 v0 = core::cm_record_v0(cell.data);
      const int size = static_cast<int>(core::cm_shape_cube_size(shape));
      if (size <= 3) return;
      vec3 middle(0.0F);
      for (std::uint32_t i = 0; i < 4; ++i) middle += 0.25F * core::cm_cell_vertex(v0, shape, i);
      const ivec3 corner = (ivec3(middle) >> size) << size;
      const grid::Statistics::Node& node = statistics.node_at(corner, size);
      if (node.is_uniform()) return;
      ASSERT_EQ(node.log2_size, size);
      // Descends from the top, as kernels do.
      const ivec3 centre = corner + (1 << (size - 1));
      const auto scale = static_cast<std::uint32_t>((size - 1) / 3);
      std::uint32_t block = CM_TOP_BLOCK;
      for (std::uint32_t s = lattice.top_scale(); s > scale; --s)
        block = lattice.entries[block * CM_BLOCK_POINTS + core::cm_in_block(centre >> static_cast<int>(3 * s))].block;
      const auto entry =
          lattice.entries[block * CM_BLOCK_POINTS + core::cm_in_block(centre >> static_cast<int>(3 * scale))];
      ASSERT_NE(entry.coarse, 0U);
      const std::uint32_t index = core::cm_coarse_cell(v0, shape, vec3(corner));
      const glm::uvec2 coefficients = lattice.coarse[entry.coarse].coefficients[index];
      EXPECT_EQ(coefficients.x, cell.data.z);
      if (cell.data.z != 0) {
        EXPECT_EQ(coefficients.y, cell.data.w);
      }
      ++found;
    };
    for (const double threshold : {1e9, 1.0, 0.3, 0.1}) {
      grid::RefineSettings settings = small.settings;
      settings.threshold = threshold;
      const grid::TetGrid grid = grid_of(statistics, grid::DiamondSet(statistics, settings));
      for (const grid::CellRecord& cell : grid.cells) look_up(cell);
    }
    if (small.volume.max_value == 0.0F) continue;
    EXPECT_GT(found, 20U) << small.name;
  }
  // All entries of a cube, each once.
  std::set<std::uint32_t> indices;
  for (std::uint32_t permutation = 0; permutation < 6; ++permutation) {
    const ivec3 corner(16, 48, 32);
    const std::uint32_t shape = grid::kuhn_frame(corner, 16, permutation) | (1U << 9U) | (4U << 11U);
    vec3 v0(corner);
    for (int axis = 0; axis < 3; ++axis) v0[axis] += static_cast<float>(corner[axis] & 16);
    indices.insert(core::cm_coarse_cell(v0, shape, vec3(corner)));
    for (unsigned a = 0; a < 2; ++a) {
      const vec3 half_v0 = a == 0 ? v0 : core::cm_cell_vertex(v0, shape, 1);
      const std::uint32_t half = core::cm_child_shape(shape, a);
      indices.insert(core::cm_coarse_cell(half_v0, half, vec3(corner)));
      for (unsigned b = 0; b < 2; ++b) {
        indices.insert(core::cm_coarse_cell(b == 0 ? half_v0 : core::cm_cell_vertex(half_v0, half, 1),
                                            core::cm_child_shape(half, b), vec3(corner)));
      }
    }
  }
  EXPECT_EQ(indices.size(), std::size_t{CM_COARSE_CELLS});
  EXPECT_EQ(*indices.rbegin(), CM_COARSE_CELLS - 1);
}

TEST(Lattice, BrickEdgeLengthsCoverAllTheirCells) {
  glm::dmat4 sheared(1.0);
  sheared[0] = {0.5, 0.0, 0.0, 0.0};
  sheared[1] = {0.3, 1.0, 0.1, 0.0};
  sheared[2] = {0.0, 0.2, 2.0, 0.0};
  const std::array<float, CM_BRICK_EDGES> edges = grid::brick_edges(sheared);
  const grid::EdgeLengths length(sheared);
  for (int octant = 0; octant < 8; ++octant) {
    const ivec3 corner = 8 * ivec3(octant & 1, (octant >> 1) & 1, octant >> 2);
    for (std::uint32_t permutation = 0; permutation < 6; ++permutation) {
      const grid::BrickTree& tree = grid::brick_tree(grid::kuhn_frame(corner, 8, permutation));
      for (unsigned heap = 1; heap < 512; ++heap) {
        const auto level = static_cast<unsigned>(std::bit_width(heap)) - 1U;
        const vec3 along = core::cm_cell_vertex(vec3(0.0F), tree.shape[heap], 1);
        const double edge = length(tree.shape[heap]);
        ASSERT_EQ(edges[CM_LEVEL_EDGES * level + core::cm_edge_of(along)], static_cast<float>(edge * edge)) << heap;
      }
    }
  }
}

TEST(Lattice, SubcellVolumesSumToTheCell) {
  // In sixths of voxels, each shape has half of the previous one. The parts' centers balance about the centroid.
  for (const auto interpolation : {grid::Interpolation::nearest, grid::Interpolation::linear}) {
    const grid::CellParts& parts = grid::cell_parts(interpolation);
    for (unsigned level = 0; level <= grid::brick_levels; ++level) {
      unsigned weight = 0;
      vec3 moment(0.0F);
      for (unsigned i = parts.first[level]; i < parts.first[level + 1]; ++i) {
        const unsigned count = parts.parts[i].packed >> 12U;
        EXPECT_GE(count, 1U);
        EXPECT_LE(count, 6U * parts.sixth);
        weight += count;
        moment += static_cast<float>(count) * parts.parts[i].from_centroid;
      }
      EXPECT_EQ(weight, parts.sixth * (512U >> level));
      EXPECT_LT(glm::length(moment), 1e-4F * static_cast<float>(parts.sixth)) << level;
    }
  }
}

TEST(Lattice, ShadersHaveTheRangesOfParts) {
  using First = std::array<unsigned, grid::brick_levels + 2>;
  EXPECT_EQ(grid::cell_parts(grid::Interpolation::nearest).first, (First{CM_PARTS_OF_LEVELS}));
  EXPECT_EQ(grid::cell_parts(grid::Interpolation::nearest).size(), CM_CELL_PARTS);
  EXPECT_EQ(grid::cell_parts(grid::Interpolation::linear).first, (First{CM_PARTS_OF_LEVELS_BETWEEN}));
  EXPECT_EQ(grid::cell_parts(grid::Interpolation::linear).size(), CM_CELL_PARTS_BETWEEN);
}

// The parts of a cell give the same mean and covariance as the sums over its sixths.
TEST(Lattice, PartsBetweenVoxelsMatchTheSumsOfBricks) {
  test::Random random(4);
  grid::BrickCorners corners{};
  for (float& value : corners) value = static_cast<float>(random()) * 0x1p-32F;
  const grid::CellParts& parts = grid::cell_parts(grid::Interpolation::linear);
  const grid::BrickTree& tree = grid::brick_tree(grid::kuhn_frame(ivec3(0), 8, 0));
  const auto sums = std::make_unique<grid::BrickSums>();
  sums->compute_between(corners, 0.5F, tree);
  for (unsigned level = 0; level < grid::brick_levels; ++level) {
    const unsigned heap = 1U << level;  // the cell at vertex 0
    const std::uint32_t shape = tree.shape[heap];
    double mean = 0.0;
    glm::dvec3 moment(0.0);
    for (unsigned i = parts.first[level]; i < parts.first[level + 1]; ++i) {
      const std::uint32_t word = parts.parts[i].packed;
      const ivec3 p(core::cm_from_frame(vec3(word & 15U, (word >> 4U) & 15U, (word >> 8U) & 15U), shape));
      const double weighted = double{corners[static_cast<std::size_t>((p.x * 9 + p.y) * 9 + p.z)]} * (word >> 12U) /
                              (40.0 * (512U >> level));
      mean += weighted;
      moment += weighted * glm::dvec3(parts.parts[i].from_centroid);
    }
    const grid::Moments expected = sums->moments(heap, ivec3(0), tree);
    EXPECT_NEAR(mean, expected.mean(), 1e-5) << level;
    const glm::dvec3 centroid(tree.node_centroid[heap]);
    EXPECT_LT(glm::distance(vec3(moment), grid::frame_covariance(expected, shape, centroid)), 1e-5F) << level;
  }
}

}  // namespace
