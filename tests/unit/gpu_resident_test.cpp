// GPU-resident volumes: their statistics, the grids built from them, and their updates.

#include <gtest/gtest.h>

#include <chrono>
#include <optional>

#include "gl/state_guard.hpp"
#include "grid/tet_grid.hpp"
#include "grid/transmittance.hpp"
#include "render/dynamic/voxel_transfers.hpp"
#include "render/grid/grid_build.hpp"
#include "support/gl_state.hpp"
#include "support/gpu_resident_states.hpp"
#include "support/grid_reference.hpp"
#include "support/simulated.hpp"
#include "support/view_cameras.hpp"
#include "volume/optical_depth.hpp"

namespace {

using namespace cumulet;
using render::Deadline;
using test::as_halves;
using test::Cells;
using test::expect_near;
using test::expect_same_cells;
using test::GpuResidentStates;
using test::GridReference;
using test::odd;
using test::simulated;
using test::transform;

CUMULET_ON_BACKENDS(GpuResidentStates);

// Statistics computed on the GPU equal those computed in main memory.
TEST_P(GpuResidentStates, StatisticsMatchTheVoxels) {
  for (const bool halves : {false, true}) {
    auto values = simulated(CUMULET_CHANNEL_DENSITY, odd, 1);
    if (halves) values = as_halves(values);
    const GridReference known = field_of(bring(values, odd, transform(), halves), transform());
    const GridReference reference = in_memory(values, odd, transform(), known);
    EXPECT_EQ(known.volume->brick_origins, reference.volume->brick_origins);
    EXPECT_EQ(known.volume->active_voxels, reference.volume->active_voxels);
    EXPECT_EQ(known.volume->bounds_min, reference.volume->bounds_min);
    EXPECT_EQ(known.volume->bounds_max, reference.volume->bounds_max);
    EXPECT_EQ(known.volume->max_value, reference.volume->max_value);
    EXPECT_EQ(known.statistics->values_are_halves(), halves);
    const double depth = reference.statistics->mean_optical_depth();
    EXPECT_NEAR(known.statistics->mean_optical_depth(), depth, 1e-6 * depth);
    ASSERT_EQ(known.statistics->cube().log2_size, reference.statistics->cube().log2_size);
    ASSERT_EQ(known.statistics->nodes().size(), reference.statistics->nodes().size());
    for (std::size_t i = 0; i < known.statistics->nodes().size(); ++i) {
      const auto& a = known.statistics->nodes()[i];
      const auto& b = reference.statistics->nodes()[i];
      ASSERT_EQ(a.corner, b.corner);
      ASSERT_EQ(a.is_uniform(), b.is_uniform());
      if (a.is_uniform()) continue;
      for (std::uint32_t permutation = 0; permutation < 6; ++permutation) {
        const grid::Moments& x = known.statistics->kuhn(a, permutation);
        const grid::Moments& y = reference.statistics->kuhn(b, permutation);
        EXPECT_EQ(x.min, y.min);
        EXPECT_EQ(x.max, y.max);
        const double whole = y.volume * y.max;
        expect_near(x.mass, y.mass, whole);
        expect_near(x.square, y.square, whole);
        for (int axis = 0; axis < 3; ++axis) expect_near(x.first[axis], y.first[axis], whole);
      }
    }
    const grid::Transmittance ours(*known.statistics, 0.7);
    const grid::Transmittance theirs(*reference.statistics, 0.7);
    for (const std::uint32_t n : known.statistics->nodes_of_size(3)) {
      const glm::ivec3 corner = known.statistics->nodes()[n].corner;
      for (int i = 0; i < grid::Transmittance::blocks_per_brick; ++i)
        ASSERT_NEAR(ours.blocks(corner)[i], theirs.blocks(corner)[i], 1e-6);
    }
    const auto scale = volume::CoarseVolume(*known.volume).suggest_density_scale();
    const auto expected = volume::CoarseVolume(*reference.volume).suggest_density_scale();
    ASSERT_TRUE(scale && expected);
    EXPECT_NEAR(*scale, *expected, 0.05 * *expected);
  }
}

TEST_P(GpuResidentStates, GridsMatchTheVoxels) {
  test::Cameras cameras(3);
  std::size_t brick_cells = 0;
  for (const bool halves : {false, true}) {
    auto values = simulated(CUMULET_CHANNEL_DENSITY, odd, 2);
    if (halves) values = as_halves(values);
    const GridReference known = field_of(bring(values, odd, transform(), halves), transform());
    const GridReference reference = in_memory(values, odd, transform(), known);
    for (const auto criterion :
         {grid::Criterion::transmittance, grid::Criterion::deviation, grid::Criterion::range_mean}) {
      for (const auto cells : {grid::CellKind::linear, grid::CellKind::constant}) {
        SCOPED_TRACE(testing::Message() << halves << " " << static_cast<int>(criterion) << " "
                                        << static_cast<int>(cells));
        grid::RefineSettings settings;
        settings.criterion = criterion;
        settings.cells = cells;
        settings.density_scale = 3.0;
        settings.threshold = criterion == grid::Criterion::range_mean ? 0.8 : 0.02;
        expect_same_cells(build(known, settings), reference.grid(settings));
        settings.camera = cameras.about(reference.statistics->cube());
        expect_same_cells(build(known, settings), reference.grid(settings));
        settings.camera.reset();
        for (const std::uint64_t most : {1000U, 3000U, 7000U}) {
          settings.max_cells = most;
          const Cells limited = build(known, settings);
          EXPECT_TRUE(limited.limited);
          expect_same_cells(limited, reference.grid(settings));
        }
        brick_cells += known.lattice(settings)->own.to_rate.fields[0].nodes.size();
      }
    }
  }
  EXPECT_GT(brick_cells, 100U);
}

// Other states are transferred and freed during the upload.
TEST_P(GpuResidentStates, AnUploadTakesManyFrames) {
  const auto values = simulated(CUMULET_CHANNEL_DENSITY, odd, 1);
  const auto others = simulated(CUMULET_CHANNEL_DENSITY, odd, 2);
  std::optional<volume::DeviceBricks> before = bring(others, odd, transform());
  const GridReference known = field_of(bring(values, odd, transform()), transform());
  grid::RefineSettings settings;
  settings.threshold = 0.05;
  int steps = 0;
  const Cells found = build(known, settings, [&] {
    ++steps;
    before = bring(others, odd, transform());
  });
  EXPECT_GT(steps, 10);
  expect_same_cells(found, in_memory(values, odd, transform(), known).grid(settings));
  const std::uint64_t bytes = memories_->bytes();
  before.reset();
  transfers_->follow(Deadline::max());
  EXPECT_LT(memories_->bytes(), bytes);
}

// Bricks in several buffers are gathered into one. The grid is the same.
TEST_P(GpuResidentStates, ScatteredBricksAreCompacted) {
  const auto old = simulated(CUMULET_CHANNEL_DENSITY, odd, 1);
  auto values = as_halves(old);
  volume::DeviceBricks all = bring(values, odd, transform(), true);
  all.tidy();
  for (int step = 2; step < 6; ++step) {
    const auto next = simulated(CUMULET_CHANNEL_DENSITY, odd, step);
    const render::VoxelBox box{{8 * step, 0, 0}, {8 * step + 7, odd[1], odd[2]}};
    for (int z = 0; z < odd[2]; ++z) {
      for (int y = 0; y < odd[1]; ++y) {
        for (int x = box.min.x; x <= box.max.x; ++x)
          values[test::State::at({x, y, z}, odd)] = next[test::State::at({x, y, z}, odd)];
      }
    }
    all = all.with(bring(values, odd, transform(), false, std::vector{box}));
  }
  EXPECT_EQ(all.memories.size(), 5U);
  EXPECT_FALSE(all.are_halves());
  const gl::StateGuard guard(*gl_);
  volume::DeviceBricksPtr gathered;
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (gathered == nullptr && std::chrono::steady_clock::now() < until) gathered = memories_->gather(gl_, all);
  ASSERT_NE(gathered, nullptr);
  EXPECT_EQ(gathered->memories.size(), 1U);
  EXPECT_EQ(gathered->origins, all.origins);
  grid::RefineSettings settings;
  settings.threshold = 0.05;
  const GridReference known = field_of(*gathered, transform());
  const grid::TetGrid expected = in_memory(values, odd, transform(), known).grid(settings);
  expect_same_cells(build(known, settings), expected);
  expect_same_cells(build(field_of(all, transform()), settings), expected);
  render::DeviceMemories small(gl_, programs_, 1000);
  EXPECT_EQ(small.gather(gl_, all), nullptr) << "larger than a storage block";
}

}  // namespace
