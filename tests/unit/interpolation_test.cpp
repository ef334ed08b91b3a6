// Linear interpolation between voxels, compared with quadrature: statistics, the tetrahedral grid, and the traversal of
// voxels, whose source is compiled as C++.

#include "support/cpu_tracer.hpp"
#include "support/grid_reference.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/gtc/packing.hpp>
#include <random>

#include "assets/volume_asset.hpp"
#include "scene/march_source.hpp"
#include "support/interpolated.hpp"
#include "support/volumes.hpp"

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-parameter"

namespace cumulet::core {

#define CM_MARCH 1
#define CM_LINEAR 1
struct CpuDenseBetween : CpuDenseData {
#include "support/traced.inc"
};
#undef CM_MARCH
#define CM_MARCH 2
struct CpuBricksBetween {
  CmParameters cm{};
  const scene::MarchSource* source = nullptr;
  float cm_surface_z(uvec2 pixel, vec2 within, uint layer) const { return 3.0e38F; }
  uint cm_brick_slot(ivec3 brick) const {
    const ivec3 at = brick - (source->box_low >> 3);
    const ivec3& count = source->brick_count;
    return source->brick_slots.at(static_cast<std::size_t>((at.z * count.y + at.y) * count.x + at.x));
  }
  float cm_brick_voxel(uint slot, uint index) const {
    return glm::unpackHalf1x16(source->brick_values.at(std::size_t{slot} * 729 + index));
  }
#include "support/traced.inc"
};
#undef CM_MARCH
#undef CM_LINEAR
#define CM_MARCH 0
#define CM_LINEAR 2
struct CpuTetBetween : CpuTetData {
  uvec4 cm_corners_record(uint cell) const { return grid->corners.at(cell); }
#include "support/traced.inc"
};
#undef CM_MARCH
#undef CM_LINEAR

}  // namespace cumulet::core

#pragma GCC diagnostic pop

namespace {

using namespace cumulet;
using glm::dvec3;
using glm::ivec3;
using glm::vec3;

constexpr grid::Interpolation linear = grid::Interpolation::linear;

/// Five points of Gauss's quadrature on [0, 1]: exact for polynomials of degree 9.
constexpr std::array<std::array<double, 2>, 5> gauss{{{0.0469100770306680, 0.1184634425280945},
                                                      {0.2307653449471585, 0.2393143352496832},
                                                      {0.5, 0.2844444444444444},
                                                      {0.7692346550528415, 0.2393143352496832},
                                                      {0.9530899229693320, 0.1184634425280945}}};

/// The moments of the interpolated field over a sixth of a cell, whose function is a polynomial there.
grid::Moments quadrature(const volume::ScalarVolume& volume, const grid::Cube& cube, const vec3& v0,
                         std::uint32_t shape) {
  const auto vertex = [&](unsigned i) { return dvec3(core::cm_cell_vertex(v0, shape, i)); };
  // Vertex 3 is (1, 0, 0) in the frame, vertex 2 is (1, 1, 0), and vertex 1 is (1, 1, 1).
  const dvec3 u = vertex(3) - vertex(0);
  const dvec3 v = vertex(2) - vertex(3);
  const dvec3 w = vertex(1) - vertex(2);
  grid::Moments moments;
  for (const auto& [a, weight_a] : gauss) {
    for (const auto& [b, weight_b] : gauss) {
      for (const auto& [c, weight_c] : gauss) {
        const dvec3 p = vertex(0) + a * u + a * b * v + a * b * c * w;
        const double weight = weight_a * weight_b * weight_c * a * a * b;
        const double value = test::value_between(volume, p + dvec3(cube.origin));
        moments.volume += weight;
        moments.mass += weight * value;
        moments.square += weight * value * value;
        moments.first += weight * value * p;
      }
    }
  }
  return moments;
}

void expect_moments(const grid::Moments& a, const grid::Moments& b) {
  EXPECT_NEAR(a.volume, b.volume, 1e-9);
  EXPECT_NEAR(a.mass, b.mass, 1e-6 + 1e-5 * b.mass);
  EXPECT_NEAR(a.square, b.square, 1e-6 + 1e-4 * b.square);
  for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(a.first[axis], b.first[axis], 1e-4 + 1e-5 * b.first[axis]);
}

TEST(InterpolatedStatistics, OfSixthsOfCellsMatchQuadrature) {
  const auto volume = test::noise_volume({20, 18, 22}, ivec3(-3, 2, 5), 3);
  const grid::Cube cube = grid::fit_cube(volume, linear);
  const grid::Statistics statistics(volume, cube);
  test::Random random(1);
  int sixths = 0;
  for (const std::uint32_t n : statistics.nodes_of_size(3)) {
    const grid::Statistics::Node& node = statistics.nodes()[n];
    grid::BrickField field;
    field.read(statistics, node);
    for (std::uint32_t permutation = 0; permutation < 6; ++permutation) {
      const std::uint32_t frame = grid::kuhn_frame(node.corner, 8, permutation);
      const grid::BrickTree& tree = grid::brick_tree(frame);
      grid::BrickSums sums;
      field.sum(tree, sums);
      for (int trial = 0; trial < 16; ++trial) {
        vec3 v0(node.corner);
        for (int axis = 0; axis < 3; ++axis) v0[axis] += ((node.corner[axis] / 8) & 1) != 0 ? 8.0F : 0.0F;
        std::uint32_t shape = frame | (1U << 9U) | (3U << 11U);
        unsigned heap = 1;
        while (heap < 512) {
          const unsigned child = random() & 1U;
          if (child == 1) v0 = core::cm_cell_vertex(v0, shape, 1);
          shape = core::cm_child_shape(shape, child);
          heap = 2 * heap + child;
        }
        const grid::Moments moments = sums.moments(heap, node.corner, tree);
        expect_moments(moments, quadrature(volume, cube, v0, shape));
        EXPECT_LE(moments.min, moments.mean() + 1e-5);
        EXPECT_GE(moments.max, moments.mean() - 1e-5);
        ++sixths;
      }
    }
  }
  EXPECT_GT(sixths, 1000);
}

/// A ball in two bricks, beside tiles that end inside bricks, on a background.
volume::ScalarVolume mixed_volume() {
  volume::ScalarVolume volume = test::make_volume({16, 8, 8}, ivec3(0), [](const ivec3& p) {
    return std::max(0.0F, 5.0F - glm::distance(vec3(p), vec3(7.5F, 3.5F, 3.5F)));
  });
  volume.bounds_min = ivec3(-5, -9, 0);
  volume.bounds_max = ivec3(30, 12, 40);
  volume.tiles = {{{16, 0, 0}, {30, 7, 7}, 2.0F}, {{-5, -9, 16}, {10, 12, 40}, 3.0F}};
  return volume;
}

TEST(InterpolatedStatistics, KeepTheIntegralAndTheVoxels) {
  for (const float background : {0.0F, 0.25F}) {
    volume::ScalarVolume volume = mixed_volume();
    volume.background = background;
    const grid::Cube cube = grid::fit_cube(volume, linear);
    const grid::Statistics statistics(volume, cube);
    double mass = 0.0;
    for (unsigned root = 0; root < 24; ++root) {
      vec3 v0;
      std::uint32_t shape = 0;
      core::cm_root_cell(root, static_cast<std::uint32_t>(cube.log2_size - 1), v0, shape);
      mass += statistics.moments(v0, shape).mass;
    }
    const double sum = test::sum_of_voxels(volume);
    EXPECT_NEAR(mass, sum, 1e-5 * sum);
    int bricks = 0;
    for (const std::uint32_t n : statistics.nodes_of_size(3)) {
      const grid::Statistics::Node& node = statistics.nodes()[n];
      grid::BrickCorners corners;
      statistics.read_corners(node, corners);
      for (int i = 0; i < 729; ++i) {
        const ivec3 p = node.corner + cube.origin + ivec3(i / 81, i / 9 % 9, i % 9);
        ASSERT_EQ(corners[static_cast<std::size_t>(i)], test::value_at(volume, p));
      }
      ++bricks;
    }
    EXPECT_GT(bricks, 4);
    for (int i = 0; i < cube.size() * cube.size() * cube.size(); i += 7) {
      const ivec3 p(i / (cube.size() * cube.size()), i / cube.size() % cube.size(), i % cube.size());
      const grid::Statistics::Node& node = statistics.node_at(p);
      if (!node.is_uniform()) continue;
      for (int corner = 0; corner < 8; ++corner) {
        const ivec3 offset(corner & 1, (corner >> 1) & 1, corner >> 2);
        ASSERT_EQ(node.uniform, test::value_at(volume, p + offset + cube.origin));
      }
    }
  }
}

TEST(InterpolatedStatistics, ALinearRampIsExactInACell) {
  const auto ramp = [](const ivec3& p) { return 1.0F + glm::dot(vec3(p), vec3(0.05F, 0.02F, 0.01F)); };
  const auto volume = test::make_volume({40, 40, 40}, ivec3(0), ramp);
  const grid::Statistics statistics(volume, grid::fit_cube(volume, linear));
  const ivec3& origin = statistics.cube().origin;
  int cells = 0;
  for (const std::uint32_t n : statistics.nodes_of_size(3)) {
    const grid::Statistics::Node& node = statistics.nodes()[n];
    const ivec3 low = node.corner + origin;
    if (glm::any(glm::lessThan(low, ivec3(0))) || glm::any(glm::greaterThan(low + 8, ivec3(39)))) continue;
    for (std::uint32_t permutation = 0; permutation < 6; ++permutation) {
      const std::uint32_t shape = grid::kuhn_frame(node.corner, 8, permutation) | (1U << 9U) | (3U << 11U);
      const grid::Moments& moments = statistics.kuhn(node, permutation);
      vec3 v0(node.corner);
      for (int axis = 0; axis < 3; ++axis) v0[axis] += ((node.corner[axis] / 8) & 1) != 0 ? 8.0F : 0.0F;
      const dvec3 centroid =
          dvec3(v0 + core::cm_from_frame(8.0F * core::cm_frame_centroid(core::cm_shape_class(shape)), shape));
      const auto fit =
          grid::fit_linear(1, grid::frame_covariance(moments, shape, centroid), static_cast<float>(moments.mean()));
      EXPECT_NEAR(fit.explained, moments.variance(), 1e-3 * moments.variance());
      EXPECT_GT(moments.variance(), 1e-3);
      EXPECT_NEAR(moments.mean(), ramp(ivec3(0)) + glm::dot(vec3(centroid) + vec3(origin), vec3(0.05F, 0.02F, 0.01F)),
                  1e-5);
      ++cells;
    }
  }
  EXPECT_GT(cells, 100);
}

/// A ray in cube space through a random point of a box.
struct Ray {
  vec3 o;
  vec3 d;
};
Ray random_ray(test::Random& random, const vec3& low, const vec3& high) {
  const auto uniform = [&] { return static_cast<float>(random()) * 0x1p-32F; };
  const vec3 through = glm::mix(low, high, vec3(uniform(), uniform(), uniform()));
  vec3 d = glm::normalize(vec3(uniform(), uniform(), uniform()) - 0.5F);
  if (random() % 4 == 0) d = glm::normalize(d * vec3(1.0F, 0.0F, 1.0F));  // along a plane of the lattice
  return {through - 100.0F * d, d};
}

/// The integral of the interpolated field along a ray in cube space.
double depth_along(const volume::ScalarVolume& volume, const grid::Cube& cube, const Ray& ray, double from, double to,
                   int steps = 5000) {
  double sum = 0.0;
  for (int i = 0; i < steps; ++i) {
    const double t = from + (i + 0.5) / steps * (to - from);
    sum += test::value_between(volume, dvec3(ray.o) + t * dvec3(ray.d) + dvec3(cube.origin));
  }
  return sum * (to - from) / steps;
}

/// Sets the data that the traversal of a box reads.
template <class Tracer>
void show_box(Tracer& tracer, const vec3& low, const vec3& high, const grid::Cube& cube) {
  tracer.cm.grid.box_min = tracer.cm.space.box_min = low;
  tracer.cm.grid.box_max = tracer.cm.space.box_max = high;
  tracer.cm.grid.root_exponent = static_cast<std::uint32_t>(cube.log2_size - 1);
  tracer.cm.medium.extinction = 1.0F;
}

/// Traverses a ray. Segment: type of the control points of a segment. visit(t, t_1, r) for each segment. Returns the
/// integral of the density, which is relative to the volume's maximum.
template <class Segment, class Tracer, class Visit>
double traverse(Tracer& tracer, const Ray& ray, const Visit& visit) {
  const glm::vec2 range = tracer.cm_box_range(ray.o, ray.d);
  if (range.x >= range.y) return 0.0;
  const typename Tracer::CmMarchRay march = tracer.cm_march_ray(ray.o, ray.d);
  glm::uvec3 cell = tracer.cm_march_enter_at(ray.o, ray.d, range.x);
  float t = range.x;
  double depth = 0.0;
  for (int i = 0; i < 10000 && cell.x != CM_NONE; ++i) {
    float t_1 = 0.0F;
    Segment r(0.0F);
    glm::uvec3 next(0U);
    tracer.cm_march_step(cell, march, t, t_1, r, next);
    depth += double{tracer.cm_segment_mean(r)} * (t_1 - t);
    visit(t, t_1, r);
    t = t_1;
    cell = next;
  }
  return depth;
}

/// Compares a traversal of voxels with quadrature: the depth of rays, the values along segments, and the distances at
/// which depths are used up. Values are relative to the maximum, as half floats.
template <class Tracer>
void expect_exact(Tracer& tracer, const volume::ScalarVolume& volume, const grid::Cube& cube, unsigned seed) {
  test::Random random(seed);
  const double most = volume.max_value;
  int segments = 0;
  for (int i = 0; i < 40; ++i) {
    const Ray ray = random_ray(random, tracer.cm.grid.box_min, tracer.cm.grid.box_max);
    double depth_before = 0.0;
    const glm::vec2 range = tracer.cm_box_range(ray.o, ray.d);
    const double depth = traverse<glm::vec4>(tracer, ray, [&](float t, float t_1, const glm::vec4& r) {
      const float span = t_1 - t;
      const double here = most * double{tracer.cm_segment_mean(r)} * span;
      if (span > 0.01F && here > 0.0 && random() % 8 == 0) {
        for (const double s : {0.0, 0.3, 0.8, 1.0}) {
          const dvec3 p = dvec3(ray.o) + (t + s * span) * dvec3(ray.d) + dvec3(cube.origin);
          EXPECT_NEAR(most * double{tracer.cm_segment_at(r, static_cast<float>(s))}, test::value_between(volume, p),
                      2e-3 * most);
        }
        for (const double part : {0.001, 0.2, 0.7, 0.999}) {
          const double way = tracer.cm_depth_distance(r, span, static_cast<float>(part * here / most));
          EXPECT_NEAR(depth_along(volume, cube, ray, t, t + way, 300), part * here, 1e-3 * here + 1e-4 * most) << part;
        }
        ++segments;
      }
      depth_before += here;
    });
    const double expected = range.x < range.y ? depth_along(volume, cube, ray, range.x, range.y) : 0.0;
    EXPECT_NEAR(most * depth, expected, 1e-3 * most + 1e-3 * expected);
    EXPECT_NEAR(depth_before, most * depth, 1e-6 + 1e-6 * expected);
  }
  EXPECT_GT(segments, 20);
}

struct Source {
  std::shared_ptr<const volume::ScalarVolume> voxels;
  scene::MarchSource of;
};
Source source_of(const volume::ScalarVolume& volume, scene::March march) {
  auto voxels = std::make_shared<const volume::ScalarVolume>(volume);
  auto statistics = std::make_shared<const grid::Statistics>(*voxels, grid::fit_cube(*voxels, linear));
  return {voxels, scene::make_voxel_source(march, voxels, statistics)};
}

TEST(InterpolatedVoxels, TraversalMatchesQuadrature) {
  unsigned seed = 1;
  volume::ScalarVolume mixed = mixed_volume();
  mixed.max_value = 5.0F;
  mixed.active_voxels = 1;
  for (const volume::ScalarVolume& volume : {test::noise_volume({20, 18, 22}, ivec3(-3, 2, 5), 3), mixed}) {
    const Source dense = source_of(volume, scene::March::dense);
    const grid::Cube& cube = dense.of.cube;
    const vec3 low(dense.of.box_low);
    const vec3 high(dense.of.box_low + dense.of.box_size);
    core::CpuDenseBetween voxels;
    show_box(voxels, low, high, cube);
    voxels.volume = &volume;
    voxels.origin = cube.origin;
    expect_exact(voxels, volume, cube, seed++);
    const Source packed = source_of(volume, scene::March::brick);
    core::CpuBricksBetween bricks;
    show_box(bricks, low, high, cube);
    bricks.source = &packed.of;
    expect_exact(bricks, volume, cube, seed++);
  }
}

TEST(InterpolatedVoxels, CellsHoldTheFieldBesideTheBounds) {
  const auto volume =
      test::make_volume({3, 1, 1}, ivec3(8, 8, 8), [](const ivec3& p) { return p.x == 9 ? 4.0F : 2.0F; });
  const Source dense = source_of(volume, scene::March::dense);
  EXPECT_EQ(dense.of.box_low + dense.of.cube.origin, ivec3(7));
  EXPECT_EQ(dense.of.box_size, ivec3(4, 2, 2));
  EXPECT_EQ(dense.of.voxel_count(), ivec3(5, 3, 3));
  const Source packed = source_of(volume, scene::March::brick);
  EXPECT_EQ(packed.of.brick_side(), 9);
  EXPECT_EQ(packed.of.brick_count, ivec3(2));
  EXPECT_EQ(std::ranges::count(packed.of.brick_slots, 0xfffffffeU), 0) << "all eight bricks hold a part";
  EXPECT_EQ(packed.of.brick_values.size(), 8U * 729U);
}

TEST(InterpolatedTetrahedra, MatchQuadratureOfASmoothField) {
  const auto volume = test::make_volume({28, 26, 30}, ivec3(-3, 2, 5), [](const ivec3& p) {
    const float x = glm::distance(vec3(p), vec3(10.5F, 14.5F, 19.5F)) / 12.0F;
    return std::exp(-4.0F * x * x);
  });
  const test::GridReference reference(volume, grid::fit_cube(volume, linear));
  grid::RefineSettings settings;
  settings.threshold = -1.0;
  const grid::TetGrid grid = reference.grid(settings);
  core::CpuTet tracer;
  show_box(tracer, grid.content_min, grid.content_max, grid.cube);
  tracer.grid = &grid;
  test::Random random(5);
  double worst = 0.0;
  for (int i = 0; i < 60; ++i) {
    const Ray ray = random_ray(random, grid.content_min, grid.content_max);
    const glm::vec2 range = tracer.cm_box_range(ray.o, ray.d);
    if (range.x >= range.y) continue;
    const double depth = traverse<glm::vec2>(tracer, ray, [](float, float, const glm::vec2&) {});
    const double expected = depth_along(volume, grid.cube, ray, range.x, range.y);
    worst = std::max(worst, std::abs(double{volume.max_value} * depth - expected) / (expected + 0.1));
  }
  EXPECT_LT(worst, 5e-3);
}

/// A grid that is refined down to sixths of cells.
grid::TetGrid full_grid(const volume::ScalarVolume& volume, grid::Interpolation interpolation, grid::CellKind cells) {
  grid::RefineSettings settings;
  settings.threshold = -1.0;
  settings.cells = cells;
  return test::GridReference(volume, grid::fit_cube(volume, interpolation)).grid(settings);
}

TEST(InterpolatedTetrahedra, TrilinearCellsMatchQuadrature) {
  unsigned seed = 20;
  volume::ScalarVolume mixed = mixed_volume();
  mixed.max_value = 5.0F;
  mixed.active_voxels = 1;
  for (const volume::ScalarVolume& volume : {test::noise_volume({20, 18, 22}, ivec3(-3, 2, 5), 3), mixed}) {
    const grid::TetGrid grid = full_grid(volume, linear, grid::CellKind::trilinear);
    core::CpuTetBetween tracer;
    show_box(tracer, grid.content_min, grid.content_max, grid.cube);
    tracer.grid = &grid;
    expect_exact(tracer, volume, grid.cube, seed++);
  }
}

TEST(InterpolatedTetrahedra, OnlyTrilinearCellsBetweenVoxelsHaveCorners) {
  const auto volume = test::noise_volume({20, 18, 22}, ivec3(-3, 2, 5), 3);
  const grid::TetGrid linear_fits = full_grid(volume, linear, grid::CellKind::linear);
  const grid::TetGrid trilinear = full_grid(volume, linear, grid::CellKind::trilinear);
  EXPECT_TRUE(linear_fits.corners.empty());
  EXPECT_TRUE(full_grid(volume, grid::Interpolation::nearest, grid::CellKind::trilinear).corners.empty());
  ASSERT_EQ(trilinear.corners.size(), trilinear.cells.size());
  EXPECT_EQ(trilinear.bytes(), linear_fits.bytes() + 16 * trilinear.cells.size());
  std::size_t sixths = 0;
  for (std::size_t i = 0; i < trilinear.cells.size(); ++i) {
    ASSERT_EQ(trilinear.cells[i].data, linear_fits.cells[i].data) << "the fits stay";
    const std::uint32_t shape = core::cm_record_shape(trilinear.cells[i].data);
    if (core::cm_shape_class(shape) == 1 && core::cm_shape_exponent(shape) == 0) {
      ++sixths;
    } else {
      ASSERT_EQ(trilinear.corners[i], glm::uvec4(0U));
    }
  }
  EXPECT_GT(sixths, 10000U);
}

TEST(InterpolatedVolume, IsMadeOnceAndSharesTheVoxels) {
  const auto asset = std::make_shared<const viewer::VolumeAsset>(test::noise_volume({20, 18, 22}, ivec3(0), 3));
  const auto between = asset->interpolated();
  EXPECT_EQ(asset->interpolated(), between);
  EXPECT_EQ(&asset->volume(), &between->volume());
  Progress progress;
  double seconds = 0.0;
  const std::uint64_t before = asset->bytes();
  const auto density = between->density({}, progress, seconds);
  EXPECT_TRUE(density.statistics->interpolates());
  EXPECT_EQ(asset->bytes(), before + density.statistics->bytes());
  EXPECT_FALSE(asset->density({}, progress, seconds).statistics->interpolates());
}

}  // namespace
