#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <map>
#include <random>
#include <set>

#include "base/error.hpp"
#include "grid/cell.hpp"
#include "grid/grid_builder.hpp"
#include "grid/refine.hpp"
#include "grid/statistics.hpp"
#include "grid/transmittance.hpp"
#include "support/conforming_grid.hpp"
#include "support/volumes.hpp"
#include "support/wide_volumes.hpp"

namespace {

using namespace cumulet;
using cumulet::test::build;
using cumulet::test::Built;
using cumulet::test::expect_conforming;
using cumulet::test::vertices_of;
using cumulet::test::volume_of;
using cumulet::test::voxel_by_voxel;
using glm::ivec3;
using glm::vec3;

// Records hold every cell that bisection can reach in cubes of all sizes, from the roots down to sixths of voxels.
TEST(WideRecords, RoundTripEveryCell) {
  test::Random random(5);
  for (const int log2_size : {15, 16, 17, 18}) {
    const bool wide = log2_size > 15;
    std::set<std::uint32_t> shapes;
    for (int i = 0; i < 4000; ++i) {
      vec3 v0;
      std::uint32_t shape = 0;
      core::cm_root_cell(random() % 24, static_cast<std::uint32_t>(log2_size - 1), v0, shape);
      while (true) {
        const glm::uvec2 v0_shape = core::cm_pack_v0_shape(v0, shape, wide);
        const glm::uvec4 data(v0_shape.x, v0_shape.y | (random() % 2 == 0 ? CM_RECORD_EMITS : 0U), random(), random());
        ASSERT_EQ(v0_shape.y & CM_RECORD_EMITS, 0U);
        ASSERT_EQ(core::cm_record_v0(data, wide), v0) << log2_size << ' ' << shape;
        ASSERT_EQ(core::cm_record_shape(data, wide), shape) << log2_size;
        shapes.insert(shape);
        if (core::cm_shape_class(shape) == 1 && core::cm_shape_exponent(shape) == 0) break;
        const std::uint32_t side = random() % 2;
        if (side == 1) v0 = core::cm_cell_vertex(v0, shape, 1);
        shape = core::cm_child_shape(shape, side);
      }
    }
    EXPECT_GT(shapes.size(), 48U * static_cast<std::size_t>(3 * log2_size - 3)) << "but for the roots' exponent all";
  }
}

// A cloud far away in a wide box has the same cells, voxel by voxel, as without the rest.
TEST(Grid, DistantCloudsHaveTheSameCellsAsNearOnes) {
  const auto cloud = test::noise_volume({30, 28, 25}, ivec3(0), 1);
  const grid::RefineSettings settings = voxel_by_voxel();
  const Built near = build(cloud, settings);
  for (const ivec3& by : {ivec3(32768, 0, 32768), ivec3(65536, 65536, 65536), ivec3(196608, 131072, 0)}) {
    SCOPED_TRACE(by.x);
    const Built far = build(test::clouds_apart(cloud, by), settings);
    const bool wide = far.grid.cube.wide();
    ASSERT_TRUE(wide);
    expect_conforming(far.grid);
    EXPECT_EQ(far.grid.content_max, near.grid.content_max + vec3(by));
    EXPECT_LT(far.statistics->bytes(), 3 * near.statistics->bytes()) << "as there are voxels, not as the box is";
    test::Random random(9);
    std::size_t dense = 0;
    for (int i = 0; i < 20000; ++i) {
      const vec3 p = vec3(random() % 30, random() % 28, random() % 25) + vec3(0.3F, 0.45F, 0.62F);
      const glm::uvec4& a = near.grid.cells[grid::locate(near.grid, p)].data;
      for (const vec3& shift : {vec3(0.0F), vec3(by)}) {
        const glm::uvec4& b = far.grid.cells[grid::locate(far.grid, p + shift)].data;
        ASSERT_EQ(glm::unpackHalf2x16(b.z).x, glm::unpackHalf2x16(a.z).x);
        if (a.z == 0) continue;
        ++dense;
        ASSERT_EQ(core::cm_record_v0(b, wide), core::cm_record_v0(a) + shift);
        ASSERT_EQ(core::cm_record_shape(b, wide), core::cm_record_shape(a));
      }
    }
    EXPECT_GT(dense, 10000U);
  }
}

// Rays that start far from the origin hit the same cells as rays near it, because differences of large coordinates are
// exact.
TEST(Traversal, RaysFarFromTheOriginHitTheSameCells) {
  const auto cloud = test::noise_volume({30, 28, 25}, ivec3(0), 1);
  const grid::RefineSettings settings = voxel_by_voxel();
  const Built near = build(cloud, settings);
  const ivec3 by(229376, 196608, 131072);
  const Built far = build(test::clouds_apart(cloud, by), settings);
  const auto depth_of = [](const grid::TetGrid& grid, const vec3& o, const vec3& d) {
    const bool wide = grid.cube.wide();
    double depth = 0.0;
    float t = 0.0F;
    for (std::uint32_t cell = grid::locate(grid, o), steps = 0; cell != CM_NONE && steps < 4000; ++steps) {
      const glm::uvec4& data = grid.cells[cell].data;
      const std::uint32_t shape = core::cm_record_shape(data, wide);
      const glm::vec4 faces =
          core::cm_face_distances(core::cm_cell_frame(core::cm_record_v0(data, wide), shape, o, d), shape);
      const float t_exit = core::cm_nearest_face(faces);
      const float t_next = std::max(t, t_exit);
      depth += double(t_next - t) * glm::unpackHalf2x16(data.z).x;
      t = t_next;
      cell = core::cm_link_at(grid.cells[cell].links, faces, t_exit);
    }
    return depth;
  };
  test::Random random(4);
  std::uniform_real_distribution<float> uniform(-1.0F, 1.0F);
  double sum = 0.0;
  for (int i = 0; i < 20000; ++i) {
    // Coordinates that are exact floats far away, and not on a face of a cell.
    const vec3 o = vec3(random() % 30, random() % 28, random() % 25) + vec3(21.0F, 29.0F, 39.0F) / 64.0F;
    const vec3 d(uniform(random), uniform(random), uniform(random));
    const double depth = depth_of(near.grid, o, d);
    ASSERT_NEAR(depth_of(far.grid, o + vec3(by), d), depth, 1e-5 * (1.0 + depth));
    sum += depth;
  }
  EXPECT_GT(sum, 20000.0);
}

TEST(Grid, ConformsForEveryCriterionAndBudget) {
  const auto volume = test::noise_volume({60, 45, 50}, ivec3(-20, 0, 9), 1);
  for (const auto criterion :
       {grid::Criterion::deviation, grid::Criterion::range_mean, grid::Criterion::transmittance}) {
    for (const auto cells : {grid::CellKind::linear, grid::CellKind::constant}) {
      for (const double threshold : {-1.0, 0.02, 0.2, 1.5}) {
        for (const std::uint64_t max_cells : {24ULL, 1000ULL, 20000ULL, 10000000ULL}) {
          grid::RefineSettings settings;
          settings.criterion = criterion;
          settings.cells = cells;
          settings.threshold = threshold;
          settings.max_cells = max_cells;
          const Built built = build(volume, settings);
          EXPECT_LE(built.grid.cells.size(), max_cells);
          expect_conforming(built.grid);
        }
      }
    }
  }
}

TEST(Grid, TransmittanceCriterionUsesSixAxisDirections) {
  auto volume = test::noise_volume({40, 24, 32}, ivec3(-8, 0, 16), 3);
  volume.index_to_world = glm::dmat4(glm::dmat3(2.0, 0, 0, 0, 1.0, 0, 0, 0, 0.5));
  const double extinction = 0.3;
  const grid::Cube cube = grid::fit_cube(volume);
  const grid::Statistics statistics(volume, cube);
  const grid::Transmittance transmittance(statistics, extinction);
  double worst = 0.0;
  float most_of_all = 0.0F;
  for (const std::uint32_t n : statistics.nodes_of_size(3)) {
    const ivec3 corner = statistics.nodes()[n].corner;
    const float* blocks = transmittance.blocks(corner);
    ASSERT_NE(blocks, nullptr);
    for (int b = 0; b < 64; ++b) {
      most_of_all = std::max(most_of_all, blocks[b]);
      const ivec3 low = cube.origin + corner + 2 * ivec3(b / 16, (b / 4) % 4, b % 4);
      double sum = 0.0;
      for (int axis = 0; axis < 3; ++axis) {
        std::array<double, 2> depth{};
        for (int p = cube.origin[axis]; p < cube.origin[axis] + cube.size(); ++p) {
          if (p >= low[axis] && p < low[axis] + 2) continue;
          for (int i = 0; i < 4; ++i) {
            ivec3 at = low;
            at[axis] = p;
            at[(axis + 1) % 3] += i % 2;
            at[(axis + 2) % 3] += i / 2;
            depth[p < low[axis] ? 0 : 1] +=
                0.25 * extinction * glm::length(volume.index_to_world[axis]) * double{test::value_at(volume, at)};
          }
        }
        sum += 1.0 / (1.0 + depth[0]) + 1.0 / (1.0 + depth[1]);
      }
      worst = std::max(worst, std::abs(std::min(sum / 3.0, 1.0) - double{blocks[b]}));
    }
  }
  EXPECT_LT(worst, 1e-4);
  EXPECT_EQ(transmittance.most(ivec3(0), cube.log2_size), most_of_all);
  EXPECT_EQ(transmittance.blocks(ivec3(cube.size() - 8)), nullptr);
}

// A ball of noise, transparent and opaque.
TEST(Grid, TransmittanceLeavesOpaqueCoresCoarse) {
  const auto noise = test::noise_volume({64, 64, 64}, ivec3(0), 4);
  const auto ball = test::make_volume({64, 64, 64}, ivec3(0), [&](const ivec3& p) {
    return glm::length(vec3(p) - 31.5F) < 31.0F ? 0.2F + test::value_at(noise, p) : 0.0F;
  });
  const auto cells_of = [&](grid::Criterion criterion, double scale, double threshold, float radius) {
    grid::RefineSettings settings;
    settings.criterion = criterion;
    settings.density_scale = scale;
    settings.threshold = threshold;
    const grid::TetGrid made = build(ball, settings).grid;
    return std::ranges::count_if(made.cells, [&](const grid::CellRecord& cell) {
      return glm::length(core::cm_record_v0(cell.data) - 31.5F) < radius;
    });
  };
  using enum grid::Criterion;
  // For a thin medium, the criterion equals the deviation.
  EXPECT_EQ(cells_of(transmittance, 1e-9, 0.03, 1e9F), cells_of(deviation, 1.0, 0.03, 1e9F));
  // The dark core of a dense medium is coarser, although the grid as a whole is not.
  const auto all = cells_of(transmittance, 2.0, 0.3, 1e9F);
  const auto core = cells_of(transmittance, 2.0, 0.3, 16.0F);
  EXPECT_GE(all, cells_of(deviation, 2.0, 0.03, 1e9F));
  EXPECT_LT(2 * core, cells_of(deviation, 2.0, 0.03, 16.0F));
}

TEST(Grid, ConformsForASingleVoxelAnywhere) {
  test::Random random(11);
  for (int trial = 0; trial < 12; ++trial) {
    auto volume = test::noise_volume({60, 60, 60}, ivec3(0), 5);
    std::vector<float>& values = volume.brick_values.as_floats();
    std::ranges::fill(values, 0.0F);
    const std::size_t hot = random() % values.size();
    const ivec3 p = volume.brick_origins[hot / 512] + ivec3((hot % 512) / 64, (hot / 8) % 8, hot % 8);
    if (p.x >= 60 || p.y >= 60 || p.z >= 60) continue;
    values[hot] = 1.0F;
    volume.max_value = 1.0F;
    const Built built = build(volume, voxel_by_voxel());
    expect_conforming(built.grid);
    // The voxel itself is resolved exactly.
    const std::uint32_t cell = grid::locate(built.grid, vec3(p) + vec3(0.4F, 0.5F, 0.6F));
    EXPECT_EQ(glm::unpackHalf2x16(built.grid.cells[cell].data.z).x, 1.0F);
    EXPECT_LT(built.grid.cells.size(), 4000U);
  }
}

TEST(Grid, FullyRefinedConstantCellsAreTheVoxels) {
  const auto volume = test::noise_volume({20, 30, 25}, ivec3(4, -9, 0), 2);
  grid::RefineSettings settings = voxel_by_voxel();
  settings.max_cells = 100'000'000;
  const Built built = build(volume, settings);
  test::Random random(5);
  std::uniform_real_distribution<float> uniform(0.0F, static_cast<float>(built.grid.cube.size()));
  for (int i = 0; i < 20000; ++i) {
    const vec3 p(uniform(random), uniform(random), uniform(random));
    const std::uint32_t cell = grid::locate(built.grid, p);
    ASSERT_NE(cell, CM_NONE);
    const float got = glm::unpackHalf2x16(built.grid.cells[cell].data.z).x * built.grid.density_unit;
    EXPECT_NEAR(got, test::value_at(volume, ivec3(p) + built.grid.cube.origin), 1e-3F);
  }
}

// The error is weighted by luminance: equal noise is more visible in the green channel of a red fire than in the red
// channel of a green one.
TEST(Grid, RefinementWeightsEmissionByLuminance) {
  const ivec3 size(32);
  const auto even = test::make_volume(size, ivec3(0), [](const ivec3& /*p*/) { return 1.0F; });
  const auto black = test::make_volume(size, ivec3(0), [](const ivec3& /*p*/) { return 0.0F; });
  const auto noise = test::noise_volume(size, ivec3(0), 3);
  const grid::Cube cube = grid::fit_cube(even);
  const grid::Statistics density(even, cube);
  const auto cells = [&](const volume::ScalarVolume& red, const volume::ScalarVolume& green) {
    grid::Channels channels;
    channels.emission = std::make_shared<grid::RgbField>(grid::RgbField::Components{red, green, black}, cube);
    grid::RefineSettings settings;
    settings.criterion = grid::Criterion::transmittance;
    settings.density_scale = 1e-6;
    settings.threshold = 0.1;
    return grid::DiamondSet(density, channels, settings).cell_count();
  };
  EXPECT_GT(static_cast<double>(cells(even, noise)), 1.1 * static_cast<double>(cells(noise, even)));
}

TEST(Grid, ConservesMassAndIsNeverNegative) {
  const auto volume = test::noise_volume({60, 45, 50}, ivec3(-20, 0, 9), 1);
  double mass = 0.0;
  for (std::size_t i = 0; i < volume.brick_values.size(); ++i) mass += double{volume.brick_values[i]};
  for (const auto cells : {grid::CellKind::linear, grid::CellKind::constant}) {
    grid::RefineSettings settings;
    settings.cells = cells;
    settings.threshold = 0.05;
    const Built built = build(volume, settings);
    double sum = 0.0;
    for (const grid::CellRecord& cell : built.grid.cells) {
      const glm::vec4 fit = core::cm_record_fit(cell.data);
      sum += double(fit.x) * volume_of(vertices_of(cell)) * built.grid.density_unit;
      const std::uint32_t cell_class = core::cm_shape_class(core::cm_record_shape(cell.data));
      for (unsigned i = 0; i < 4; ++i) {
        const vec3 offset = core::cm_frame_vertex(cell_class, i) - core::cm_frame_centroid(cell_class);
        EXPECT_GE(fit.x + glm::dot(vec3(fit.y, fit.z, fit.w), offset), -2e-3F);
      }
    }
    EXPECT_NEAR(sum, mass, 1e-3 * mass);
  }
}

TEST(Grid, LinearCellsReproduceALinearField) {
  const auto volume = test::make_volume({64, 64, 64}, ivec3(0), [](const ivec3& p) {
    return 1.0F + 0.02F * static_cast<float>(p.x) + 0.01F * static_cast<float>(p.y) + 0.03F * static_cast<float>(p.z);
  });
  grid::RefineSettings settings;
  settings.threshold = 0.0005;
  const Built built = build(volume, settings);
  // Voxels are constant steps around the linear field, so cells of many voxels fit it and a few large cells suffice.
  EXPECT_LT(built.grid.cells.size(), 20000U);
  test::Random random(4);
  std::uniform_real_distribution<float> uniform(4.0F, 60.0F);
  for (int i = 0; i < 2000; ++i) {
    const vec3 p(uniform(random), uniform(random), uniform(random));
    const auto& data = built.grid.cells[grid::locate(built.grid, p)].data;
    const std::uint32_t shape = core::cm_record_shape(data);
    const core::CmFrame frame = core::cm_cell_frame(core::cm_record_v0(data), shape, p, vec3(1.0F, 0.0F, 0.0F));
    const float got = core::cm_cell_density(data, frame, shape).x * built.grid.density_unit;
    const vec3 q = p - 0.5F;
    EXPECT_NEAR(got, 1.0F + 0.02F * q.x + 0.01F * q.y + 0.03F * q.z, 0.06F);
  }
}

TEST(Grid, IsIdenticalForAnyThreadCount) {
  const auto volume = test::noise_volume({90, 70, 80}, ivec3(0), 4);
  grid::RefineSettings settings;
  settings.threshold = 0.01;
  settings.max_cells = 50000;
  const auto run = [&](std::size_t threads) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    return build(volume, settings).grid;
  };
  const grid::TetGrid one = run(1);
  const grid::TetGrid two = run(2);
  ASSERT_EQ(one.cells.size(), two.cells.size());
  EXPECT_EQ(std::memcmp(one.cells.data(), two.cells.data(), one.cells.size() * sizeof(grid::CellRecord)), 0);
  EXPECT_EQ(one.tree, two.tree);
}

TEST(Grid, LocatesPointsInsideAndOnFacesEdgesAndVertices) {
  const auto volume = test::noise_volume({60, 45, 50}, ivec3(0), 1);
  grid::RefineSettings settings;
  settings.threshold = 0.02;
  const Built built = build(volume, settings);
  const auto& cells = built.grid.cells;
  const auto contains = [&](std::uint32_t c, const vec3& p) {
    const auto v = vertices_of(cells[c]);
    double sum = 0.0;
    for (unsigned i = 0; i < 4; ++i) {
      auto w = v;
      w[i] = p;
      sum += volume_of(w);
    }
    return sum <= volume_of(v) * (1.0 + 1e-5);
  };
  test::Random random(9);
  for (int trial = 0; trial < 20000; ++trial) {
    const std::uint32_t c = random() % static_cast<std::uint32_t>(cells.size());
    const auto v = vertices_of(cells[c]);
    const unsigned kind = random() % 4;  // vertex, edge, face, inside
    std::array<float, 4> weight{};
    for (unsigned i = 0; i <= kind; ++i) weight[i] = kind == 0 ? 1.0F : static_cast<float>(1 + random() % 3);
    const float total = weight[0] + weight[1] + weight[2] + weight[3];
    vec3 p(0.0F);
    for (unsigned i = 0; i < 4; ++i) p += weight[i] / total * v[(i + trial) % 4];
    const std::uint32_t found = grid::locate(built.grid, p);
    ASSERT_NE(found, CM_NONE);
    EXPECT_TRUE(contains(found, p));
    if (kind == 3) {
      EXPECT_EQ(found, c);
    }
  }
  EXPECT_EQ(grid::locate(built.grid, vec3(-1.0F, 3.0F, 3.0F)), CM_NONE);
}

TEST(Grid, CameraStopsSplitsOutsideTheFrustumAndUnderAPixel) {
  const auto volume = test::noise_volume({120, 120, 120}, ivec3(0), 1);
  grid::RefineSettings settings;
  settings.threshold = 0.01;
  const std::size_t everywhere = build(volume, settings).grid.cells.size();
  grid::RefineCamera camera;
  camera.eye = {60.0, 60.0, 400.0};
  camera.tan_half_x = camera.tan_half_y = 0.05;  // sees only the middle
  camera.pixels_per_radian = 100000.0;
  settings.camera = camera;
  const Built narrow = build(volume, settings);
  expect_conforming(narrow.grid);
  EXPECT_LT(narrow.grid.cells.size(), everywhere / 3);
  const auto finest_at = [&](const grid::TetGrid& g, const vec3& p) {
    return core::cm_shape_exponent(core::cm_record_shape(g.cells[grid::locate(g, p)].data));
  };
  EXPECT_LE(finest_at(narrow.grid, {60.3F, 60.4F, 60.1F}), 1U);
  EXPECT_GE(finest_at(narrow.grid, {4.3F, 4.1F, 100.2F}), 3U);
  settings.camera->tan_half_x = settings.camera->tan_half_y = 1.0;
  settings.camera->pixels_per_radian = 20.0;  // a pixel is about 15 voxels there
  const Built far = build(volume, settings);
  expect_conforming(far.grid);
  EXPECT_LT(far.grid.cells.size(), everywhere / 20);
}

// A million rays: parallel to axes, in faces, along edges, through vertices. None gets stuck, and all depths are right.
TEST(Traversal, AdversarialRaysReachTheOtherSideWithTheRightOpticalDepth) {
  const auto volume = test::noise_volume({60, 45, 50}, ivec3(0), 1);
  grid::RefineSettings settings;
  settings.threshold = 0.05;
  settings.cells = grid::CellKind::constant;
  const Built built = build(volume, settings);
  const auto& cells = built.grid.cells;
  const auto size = static_cast<float>(built.grid.cube.size());
  test::Random random(21);
  const auto pick_vertex = [&] {
    const auto v = vertices_of(cells[random() % static_cast<std::uint32_t>(cells.size())]);
    return v;
  };
  std::uniform_real_distribution<float> uniform(-1.0F, 1.0F);
  constexpr std::array<std::array<int, 3>, 13> lattice{{{1, 0, 0},
                                                        {0, 1, 0},
                                                        {0, 0, 1},
                                                        {1, 1, 0},
                                                        {1, -1, 0},
                                                        {1, 0, 1},
                                                        {1, 0, -1},
                                                        {0, 1, 1},
                                                        {0, 1, -1},
                                                        {1, 1, 1},
                                                        {1, 1, -1},
                                                        {1, -1, 1},
                                                        {-1, 1, 1}}};
  std::size_t stuck = 0;
  std::size_t wrong = 0;
  const int rays = 1'000'000;
  for (int ray = 0; ray < rays; ++ray) {
    const auto v = pick_vertex();
    vec3 o = v[0];
    vec3 d;
    const unsigned kind = ray % 6;
    if (kind == 0) o = v[random() % 4];
    if (kind == 1) o = 0.5F * (v[0] + v[1]);
    if (kind == 2) o = (v[0] + v[1] + v[2]) / 3.0F;
    if (kind == 3) o = 0.25F * (v[0] + v[1] + v[2] + v[3]);
    const auto& l = lattice[random() % lattice.size()];
    d = vec3(l[0], l[1], l[2]) * ((random() & 1U) != 0 ? 1.0F : -1.0F);
    if (kind == 4) d = pick_vertex()[random() % 4] - o;  // from vertex to vertex
    if (kind == 5) d = vec3(uniform(random), uniform(random), uniform(random));
    if (glm::dot(d, d) == 0.0F) d = vec3(1.0F, 0.0F, 0.0F);
    std::uint32_t cell = grid::locate(built.grid, o);
    float t = 0.0F;
    unsigned steps = 0;
    double depth = 0.0;
    bool tracked = true;
    const unsigned limit = 4000;
    while (cell != CM_NONE && steps < limit) {
      const auto& data = cells[cell].data;
      const std::uint32_t shape = core::cm_record_shape(data);
      const glm::vec4 faces =
          core::cm_face_distances(core::cm_cell_frame(core::cm_record_v0(data), shape, o, d), shape);
      const float t_exit = core::cm_nearest_face(faces);
      const float t_next = std::max(t, t_exit);
      // The middle of every segment is inside its cell.
      if (ray % 97 == 0 && t_next - t > 1e-3F * std::abs(t_next)) {
        const vec3 middle = o + 0.5F * (t + t_next) * d;
        const auto w = vertices_of(cells[cell]);
        double sum = 0.0;
        for (unsigned i = 0; i < 4; ++i) {
          auto u = w;
          u[i] = middle;
          sum += volume_of(u);
        }
        tracked = tracked && sum <= volume_of(w) * 1.001 + 1e-3;
      }
      depth += double(t_next - t) * glm::unpackHalf2x16(data.z).x;
      t = t_next;
      cell = core::cm_link_at(cells[cell].links, faces, t_exit);
      ++steps;
    }
    if (steps >= limit) ++stuck;
    // The traversal ends where the ray leaves the cube.
    float t_cube = 3.0e38F;
    for (int axis = 0; axis < 3; ++axis) {
      if (d[axis] > 0.0F) t_cube = std::min(t_cube, (size - o[axis]) / d[axis]);
      if (d[axis] < 0.0F) t_cube = std::min(t_cube, -o[axis] / d[axis]);
    }
    if (!tracked || std::abs(t - t_cube) > 1e-4F * std::max(1.0F, t_cube) || !(depth >= 0.0)) ++wrong;
  }
  EXPECT_EQ(stuck, 0U);
  EXPECT_EQ(wrong, 0U);
}

}  // namespace
