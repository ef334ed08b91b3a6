// Grids built on the GPU equal those built on the CPU: cells, links, order and tree bit by bit, coefficients except for
// rounding. Tested with all kinds of volumes and cameras.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <map>
#include <string>
#include <thread>
#include <vector>

#include "base/error.hpp"
#include "gl/state_guard.hpp"
#include "grid/grid_builder.hpp"
#include "render/grid/grid_build.hpp"
#include "render/grid/grid_builds.hpp"
#include "support/fake_gl.hpp"
#include "support/gl_state.hpp"
#include "support/gpu_grid_builds.hpp"
#include "support/grid_reference.hpp"
#include "support/view_cameras.hpp"
#include "support/volumes.hpp"
#include "support/wide_volumes.hpp"

namespace {

using namespace cumulet;
using render::Deadline;
using test::Carrying;
using test::expect_same;
using test::GpuGridBuilds;
using test::GridReference;
using test::ReadGrid;
using test::Rounding;
using test::ulp_of;

CUMULET_ON_BACKENDS(GpuGridBuilds);

TEST_P(GpuGridBuilds, MatchTheCpuForEveryVolumeAndTwoHundredCameras) {
  const gl::StateGuard guard(*gl_);
  test::Cameras cameras(7);
  Rounding rounding;
  std::size_t seen = 0;
  std::size_t limited = 0;
  const std::vector<test::SmallVolume> volumes = test::small_volumes();
  for (const test::SmallVolume& small : volumes) {
    const GridReference reference(small.volume);
    const auto data = upload(reference.lattice(small.settings), reference.statistics);
    for (std::size_t i = 0; i <= 200 / volumes.size() + 1; ++i) {
      grid::RefineSettings settings = small.settings;
      if (i > 0) settings.camera = cameras.about(reference.statistics->cube());
      if (i % 4 == 1) settings.max_cells = 24 + 350 * i;
      const grid::TetGrid expected = reference.grid(settings);
      const render::BuiltGrid built = build(data, settings);
      ASSERT_NO_FATAL_FAILURE(expect_same(expected, built, read(built), rounding)) << small.name << ", camera " << i;
      if (settings.camera) ++seen;
      if (expected.limited) ++limited;
    }
  }
  EXPECT_GE(seen, 200U);
  EXPECT_GE(limited, 10U) << "budgets that end the refinement";
  // Both round the same number, mostly to the same value. For gradients near 0, the float error exceeds a unit in the
  // last place.
  EXPECT_LT(static_cast<double>(rounding.others), 0.03 * static_cast<double>(rounding.coefficients));
  RecordProperty("rounded_otherwise", std::to_string(rounding.others));
  RecordProperty("coefficients", std::to_string(rounding.coefficients));
}

// In cubes so wide that cells use another record layout, too.
TEST_P(GpuGridBuilds, MatchTheCpuForLargeVolumes) {
  const gl::StateGuard guard(*gl_);
  test::Cameras cameras(3);
  Rounding rounding;
  const auto cloud = test::noise_volume({40, 36, 33}, glm::ivec3(0), 6);
  for (const glm::ivec3& by : {glm::ivec3(60'000, 800, 0), glm::ivec3(72, 262'000, 100'000)}) {
    const GridReference reference(test::clouds_apart(cloud, by));
    grid::RefineSettings settings;
    settings.threshold = 0.05;
    const auto data = upload(reference.lattice(settings), reference.statistics);
    for (int i = 0; i < 4; ++i) {
      if (i == 1) settings.max_cells = 5000;
      if (i > 1) settings.camera = cameras.about(reference.statistics->cube());
      const grid::TetGrid expected = reference.grid(settings);
      ASSERT_TRUE(expected.cube.wide());
      const render::BuiltGrid built = build(data, settings);
      ASSERT_NO_FATAL_FAILURE(expect_same(expected, built, read(built), rounding)) << by.x << ", camera " << i;
      if (i == 0) {
        EXPECT_GT(built.count, 20'000U);
      }
    }
  }
  EXPECT_LT(static_cast<double>(rounding.others), 0.03 * static_cast<double>(rounding.coefficients));
}

// The CPU's sums are relative to a brick's mean and lose small values, so thin cells are not compared.
TEST_P(GpuGridBuilds, InterpolatedVolumesMatchTheCpu) {
  const gl::StateGuard guard(*gl_);
  const Carrying of(true, grid::Interpolation::linear);
  grid::RefineSettings settings;
  const auto data = upload(of.lattice(settings), of.statistics, of.channels);
  test::Cameras cameras(6);
  Rounding rounding;
  std::size_t compared = 0;
  for (int i = 0; i < 2; ++i) {
    if (i > 0) settings.camera = cameras.about(of.statistics->cube());
    const grid::TetGrid expected = of.grid(settings);
    const render::BuiltGrid built = build(data, settings);
    const ReadGrid read = this->read(built);
    ASSERT_NO_FATAL_FAILURE(expect_same(expected, built, read, rounding)) << i;
    const auto emission = records<grid::EmissionRecord>(built, grid::Channel::emission);
    const auto color = records<std::uint32_t>(built, grid::Channel::color);
    const auto anisotropy = records<std::int16_t>(built, grid::Channel::anisotropy);
    const auto velocity = records<glm::uvec2>(built, grid::Channel::velocity);
    for (std::size_t c = 0; c < built.count; ++c) {
      for (int k = 0; k < 3; ++k)
        ASSERT_NEAR(emission[c].mean[k], expected.channels.emission[c].mean[k], 1e-5F * emission[c].mean[k] + 2e-4F)
            << c;
      if (core::cm_record_fit(read.cells[c].data).x < 0.05F) continue;
      const glm::vec3 colors = core::cm_cell_color(color[c]) - core::cm_cell_color(expected.channels.color[c]);
      ASSERT_LT(glm::length(colors), 2.0F / 1023.0F) << c;
      ASSERT_NEAR(anisotropy[c], expected.channels.anisotropy[c], 8) << c;
      const glm::vec3 speed = core::cm_cell_velocity(velocity[c]);
      const glm::vec3 wanted = core::cm_cell_velocity(expected.channels.velocity[c]);
      for (int k = 0; k < 3; ++k) ASSERT_NEAR(speed[k], wanted[k], ulp_of(wanted[k]) + 4e-6F * Carrying::fastest) << c;
      ++compared;
    }
  }
  EXPECT_GT(compared, 1000U);
}

// A fire without any density emits light too.
TEST_P(GpuGridBuilds, FireWithoutDensityEmits) {
  const gl::StateGuard guard(*gl_);
  const Carrying of(false);
  const grid::RefineSettings settings;
  const auto data = upload(of.lattice(settings), of.statistics, of.channels);
  const grid::TetGrid expected = of.grid(settings);
  const render::BuiltGrid built = build(data, settings);
  Rounding rounding;
  expect_same(expected, built, read(built), rounding);
  EXPECT_GT(built.count, 1000U);
  EXPECT_EQ(built.emissive.cells.size(), expected.cells.size() - static_cast<std::size_t>(std::ranges::count_if(
                                                                     expected.channels.emission, [](const auto& e) {
                                                                       return e.mean == glm::vec3(0.0F);
                                                                     })));
  EXPECT_FALSE(built.channels[static_cast<std::size_t>(grid::Channel::color)]);
}

// A frame may stop after any dispatch. Another build may begin on the same lattice after an unfinished one.
TEST_P(GpuGridBuilds, CanBeStoppedAfterEveryStepAndRestarted) {
  const gl::StateGuard guard(*gl_);
  const GridReference reference(test::noise_volume({60, 45, 50}, glm::ivec3(0), 1));
  grid::RefineSettings settings;
  const auto data = upload(reference.lattice(settings), reference.statistics);
  test::Cameras cameras(11);
  settings.camera = cameras.about(reference.statistics->cube());
  settings.camera->tan_half_x = settings.camera->tan_half_y = 2.0;
  settings.camera->pixels_per_radian = 1000.0;
  const grid::TetGrid expected = reference.grid(settings);
  std::size_t steps = 0;
  Rounding rounding;
  const render::BuiltGrid slow = build(data, settings, [&] { ++steps; });
  ASSERT_NO_FATAL_FAILURE(expect_same(expected, slow, read(slow), rounding));
  EXPECT_GT(steps, 60U);
  const grid::RefineSettings other;
  for (std::size_t stop = 0; stop < steps; ++stop) {
    {
      render::GridBuild left(gl_, programs_, limits_, data,
                             data->lattice().own.levels(grid::ViewLevels(data->lattice().cube, other)), 1000);
      for (std::size_t i = 0; i < stop && !left.advance(Deadline::min()); ++i) {
      }
    }
    if (stop % 7 != 0) continue;
    const render::BuiltGrid anew = build(data, settings);
    ASSERT_NO_FATAL_FAILURE(expect_same(expected, anew, read(anew), rounding)) << stop;
  }
}

// A planned source for these settings, as viewers make it.
scene::MarchSourcePtr planned(const GridReference& reference, const grid::LatticePtr& lattice,
                              const grid::RefineSettings& settings) {
  scene::GridPlan plan{lattice, lattice->own.levels(grid::ViewLevels(lattice->cube, settings)), settings.max_cells};
  return std::make_shared<const scene::MarchSource>(
      scene::make_planned_source(std::move(plan), reference.volume, reference.statistics, {}));
}

// A volume's plan, and the grid that the CPU builds.
struct Planned {
  explicit Planned(volume::ScalarVolume v) : reference(std::move(v)) {}
  GridReference reference;
  grid::RefineSettings settings;
  grid::LatticePtr lattice = reference.lattice(settings);
  scene::MarchSourcePtr source = planned(reference, lattice, settings);
  grid::TetGrid expected = reference.grid(settings);
};

constexpr std::uint64_t no_limit = std::numeric_limits<std::uint64_t>::max();

void wait_for(render::GridBuilds& builds, const scene::MarchSourcePtr& source, std::uint64_t max_bytes = no_limit) {
  while (!builds.advance({source}, {source}, max_bytes, Deadline::max()))
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

void expect_of_the_cpu(const render::BuiltGrid& built, const grid::TetGrid& expected, const std::string& why) {
  ASSERT_TRUE(built.grid) << why;
  EXPECT_NE(built.why_not.find(why), std::string::npos) << built.why_not;
  ASSERT_EQ(built.grid->cells.size(), expected.cells.size());
  EXPECT_EQ(
      std::memcmp(built.grid->cells.data(), expected.cells.data(), expected.cells.size() * sizeof(grid::CellRecord)),
      0);
  EXPECT_EQ(built.bytes(), 0U) << "none of GL's";
}

TEST_P(GpuGridBuilds, CpuBuildsGridsThatDoNotFitGpuMemory) {
  const gl::StateGuard guard(*gl_);
  const Planned plan(test::noise_volume({60, 45, 50}, glm::ivec3(0), 1));
  const std::uint64_t held = upload(plan.lattice, plan.reference.statistics)->bytes();
  struct Case {
    std::int64_t block;
    std::uint64_t most;
    const char* why;
  };
  const auto cells = static_cast<std::int64_t>(plan.expected.cells.size());
  const std::array<Case, 4> cases{
      {{4096, no_limit, "GL_MAX_SHADER_STORAGE_BLOCK_SIZE is 4096"},
       {24 * cells, no_limit, "GL_MAX_SHADER_STORAGE_BLOCK_SIZE"},
       {limits_.storage_block_bytes, held / 2, "the lattice needs"},
       {limits_.storage_block_bytes, held + 40 * plan.expected.cells.size(), "building the grid needs"}}};
  for (const Case& c : cases) {
    SCOPED_TRACE(c.why);
    gl::Limits limits = limits_;
    limits.storage_block_bytes = c.block;
    render::GridBuilds builds(gl_, programs_, limits, nullptr);
    wait_for(builds, plan.source, c.most);
    ASSERT_NO_FATAL_FAILURE(expect_of_the_cpu(builds.built().at(plan.source), plan.expected, c.why));
    EXPECT_LE(builds.bytes(), held) << "nothing but a lattice is left";
    // A build that is cleared before it is done ends without waiting.
    builds.clear();
    builds.advance({plan.source}, {plan.source}, c.most, Deadline::max());
  }
  render::GridBuilds builds(gl_, programs_, limits_, nullptr);
  wait_for(builds, plan.source);
  EXPECT_FALSE(builds.built().at(plan.source).grid);
}

// After any failed allocation, all objects are freed and the CPU builds the grid.
TEST_P(GpuGridBuilds, FailedAllocationsAreHandledInEveryPass) {
  const gl::StateGuard guard(*gl_);
  const Planned plan(test::noise_volume({16, 16, 12}, glm::ivec3(0), 1));
  test::FakeGl fake(headless::Context::get_proc, context_.get());
  const gl::FunctionsPtr functions = gl::load_functions(test::FakeGl::get_proc, &fake);
  const auto before = fake.alive();
  std::int64_t failed = 0;
  for (std::int64_t n = 0; n < 1000; ++n) {
    SCOPED_TRACE(n);
    {
      render::GridBuilds builds(functions, programs_, limits_, nullptr);
      fake.fail_allocation(n);
      wait_for(builds, plan.source);
      fake.fail_allocation(-1);
      const render::BuiltGrid& built = builds.built().at(plan.source);
      if (!built.grid) break;
      ++failed;
      ASSERT_NO_FATAL_FAILURE(expect_of_the_cpu(built, plan.expected, ""));
      // The next build runs on the GPU again.
      builds.clear();
      wait_for(builds, plan.source);
      ASSERT_FALSE(builds.built().at(plan.source).grid);
    }
    ASSERT_EQ(fake.alive(), before);
  }
  EXPECT_GT(failed, 20) << "buffers, and storage for each";
}

// Refits for a moving camera: each grid frees its memory. CUMULET_REFITS: number of refits (default: 100).
TEST_P(GpuGridBuilds, RefitsDoNotGrow) {
  const gl::StateGuard guard(*gl_);
  const GridReference reference(test::noise_volume({40, 35, 30}, glm::ivec3(0), 1));
  grid::RefineSettings settings;
  const grid::LatticePtr lattice = reference.lattice(settings);
  test::FakeGl fake(headless::Context::get_proc, context_.get());
  const gl::FunctionsPtr functions = gl::load_functions(test::FakeGl::get_proc, &fake);
  const char* wanted = std::getenv("CUMULET_REFITS");
  const int refits = wanted == nullptr ? 100 : std::atoi(wanted);
  test::Cameras cameras(17);
  render::GridBuilds builds(functions, programs_, limits_, nullptr);
  std::map<std::string, std::size_t> alive;
  std::uint64_t bytes = 0;
  for (int i = 0; i < refits; ++i) {
    settings.camera = cameras.about(lattice->cube);
    const scene::MarchSourcePtr source = planned(reference, lattice, settings);
    wait_for(builds, source);
    const std::uint64_t built = builds.built().at(source).bytes();
    ASSERT_GT(built, 0U) << i;
    if (i == 0) bytes = builds.bytes() - built;
    ASSERT_EQ(builds.bytes(), bytes + built) << i;
    builds.clear_built();
    if (i == 0) alive = fake.alive();
    ASSERT_EQ(fake.alive(), alive) << i;
  }
}

TEST_P(GpuGridBuilds, ErrorsNameTheExceededLimit) {
  const gl::StateGuard guard(*gl_);
  const GridReference reference(test::noise_volume({60, 45, 50}, glm::ivec3(0), 1));
  const grid::RefineSettings settings;
  const grid::LatticePtr lattice = reference.lattice(settings);
  gl::Limits small = limits_;
  small.storage_block_bytes = 4096;
  try {
    const render::LatticeUpload work(gl_, programs_, small, lattice, reference.statistics);
    FAIL() << "uploaded";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::unsupported);
    EXPECT_NE(std::string(error.what()).find("GL_MAX_SHADER_STORAGE_BLOCK_SIZE is 4096"), std::string::npos)
        << error.what();
  }
}

}  // namespace
