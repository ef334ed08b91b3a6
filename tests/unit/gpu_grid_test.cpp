// Viewers whose grids are built on the GPU show the same images as viewers whose grids are built on the CPU.

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <string>
#include <thread>
#include <vector>

#include "jobs/build_grid.hpp"
#include "support/gl_viewer.hpp"
#include "support/volumes.hpp"

namespace {

using namespace cumulet;
using viewer::BuildOn;

viewer::GridSettings settings_on(BuildOn on, bool adaptive = false) {
  viewer::GridSettings settings;
  settings.build.on = on;
  settings.build.refine.threshold = 0.01;
  settings.build.refine.pixel_size = 2.0;
  settings.camera_adaptive = adaptive;
  return settings;
}

class GpuGrid : public test::StillTest {
 protected:
  void SetUp() override {
    StillTest::SetUp();
    if (IsSkipped()) return;
    show(*still_);
  }
  static void show(test::Still& still) {
    still.set_light({30.0F, 30.0F, glm::vec3(3.0F), glm::vec3(0.3F)});
    still.set_volume(test::noise_volume({60, 45, 50}, glm::ivec3(-3, 2, 5), 3));
    still.viewer().set_medium({0.3, glm::vec3(0.95F), {0.4F}, 0});
    look(still, 0.0);
  }
  static void look(test::Still& still, double turn) {
    const glm::dvec3 centre(27.0, 24.0, 30.0);
    still.set_camera(
        test::camera_at(centre + (90.0 + 60.0 * turn) * glm::dvec3(std::sin(turn), 0.1, std::cos(turn)), centre, 40.0));
  }
};
CUMULET_ON_BACKENDS(GpuGrid);

// Root mean square of the differences, relative to the mean.
double difference(const test::Picture& a, const test::Picture& b) {
  double square = 0.0;
  double mean = 0.0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i) {
    for (int c = 0; c < 3; ++c) {
      square += std::pow(double(a.pixels[i][c]) - double(b.pixels[i][c]), 2.0);
      mean += double(b.pixels[i][c]);
    }
  }
  const double values = 3.0 * static_cast<double>(a.pixels.size());
  return std::sqrt(square / values) / (mean / values);
}

// Expects the same cells, and nearly the same paths: rounding may change a few. a, b: images of `gl` and `cpu` with
// these image settings.
void expect_same_paths(test::Still& gl, const test::Picture& a, test::Still& cpu, const test::Picture& b,
                       test::Image image) {
  EXPECT_EQ(gl.viewer().stats().cells, cpu.viewer().stats().cells);
  EXPECT_GT(gl.viewer().stats().cells, 1000U);
  EXPECT_EQ(gl.viewer().stats().cell_bytes, cpu.viewer().stats().cell_bytes);
  image.seed = 77;
  const double other_paths = difference(test::render(cpu, image), b);
  EXPECT_LT(difference(a, b), 0.3 * other_paths);
}

TEST_P(GpuGrid, ImagesMatchCpuBuiltGrids) {
  const test::Image image{40, 30, 32, 5, render::View::shaded};
  const auto other = make();
  show(*other);
  for (const bool adaptive : {false, true}) {
    for (const double turn : {0.0, 1.0, 2.5}) {
      if (!adaptive && turn > 0.0) continue;
      SCOPED_TRACE(testing::Message() << adaptive << turn);
      look(*still_, turn);
      look(*other, turn);
      still_->set_grid(settings_on(BuildOn::gpu, adaptive));
      other->set_grid(settings_on(BuildOn::cpu, adaptive));
      const test::Picture a = test::render(*still_, image);
      const test::Picture b = test::render(*other, image);
      EXPECT_EQ(viewer().stats().levels, other->viewer().stats().levels);
      expect_same_paths(*still_, a, *other, b, image);
      EXPECT_LT(std::abs(a.mean().y / b.mean().y - 1.0), 0.002);
    }
  }
}

TEST_P(GpuGrid, RefinementStopsAtTheCellBudget) {
  viewer::GridSettings settings = settings_on(BuildOn::gpu);
  settings.build.refine.max_cells = 2000;
  still_->set_grid(settings);
  test::render(*still_, {8, 8, 1, 0, render::View::shaded});
  EXPECT_TRUE(viewer().stats().limited);
  EXPECT_LE(viewer().stats().cells, 2000U);
  EXPECT_GT(viewer().stats().cells, 1500U);
}

// While a camera moves, there is always an image: the old grid's until the next grid is complete.
TEST_P(GpuGrid, PreviousGridIsShownUntilTheNextIsComplete) {
  still_->set_grid(settings_on(BuildOn::gpu, true));
  test::render(*still_, {40, 30, 1, 0, render::View::shaded});
  std::uint64_t before = viewer().stats().cells;
  std::size_t kept = 0;
  std::size_t others = 0;
  for (int i = 1; i <= 4; ++i) {
    look(*still_, 0.6 * i);
    for (int f = 0; f < 4000; ++f) {
      const viewer::FrameResult result = viewer().render(frame(40, 30, 0.5));
      ASSERT_GT(viewer().stats().cell_bytes, 0U);
      if (viewer().stats().cells == before) ++kept;
      if (result.converged) break;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));  // gives the worker thread time
    }
    if (viewer().stats().cells != before) ++others;
    before = viewer().stats().cells;
  }
  EXPECT_GT(kept, 4U);
  EXPECT_GE(others, 3U) << "each view has its own";
}

volume::VolumeFrame fire() {
  volume::VolumeFrame frame;
  frame.density = test::noise_volume({30, 40, 30}, glm::ivec3(0), 1);
  frame.density.name = "smoke";
  frame.flame = test::noise_volume({30, 30, 30}, glm::ivec3(0), 2);
  const auto color = [](int seed) { return test::noise_volume({30, 40, 30}, glm::ivec3(0), seed); };
  frame.color = {color(3), color(4), color(5)};
  return frame;
}

// A fire with colors: the same paths, and the same emissive cells for NEE.
TEST_P(GpuGrid, FiresMatchCpuBuiltGrids) {
  const test::Image image{32, 32, 32, 5, render::View::shaded};
  const auto other = make();
  const auto look_at = [](test::Still& still, BuildOn on) {
    still.set_volume(fire());
    viewer::Medium medium;
    medium.density_scale = 0.3;
    medium.field_emission.flame_strength = 2.0;
    medium.field_emission.flame_color = {1.0F, 0.4F, 0.1F};
    still.set_medium(medium);
    still.set_camera(test::camera_at({15.0, 20.0, 110.0}, {15.0, 20.0, 15.0}, 30.0));
    still.set_light({30.0F, 30.0F, glm::vec3(0.2F), glm::vec3(0.02F)});
    still.set_grid(settings_on(on));
  };
  look_at(*still_, BuildOn::gpu);
  look_at(*other, BuildOn::cpu);
  const test::Picture a = test::render(*still_, image);
  const test::Picture b = test::render(*other, image);
  expect_same_paths(*still_, a, *other, b, image);
  EXPECT_LT(std::abs(a.mean().x / b.mean().x - 1.0), 0.003);
  EXPECT_GT(b.mean().x, 3.0 * b.mean().z) << "it burns";
}

TEST(GpuGridBuild, FireBuildIsPlanned) {
  const auto asset = std::make_shared<const viewer::VolumeAsset>(fire());
  std::vector<std::string> lines;
  const Log log([&](LogLevel /*level*/, const char* line) { lines.emplace_back(line); });
  Progress progress;
  viewer::BuildSettings settings;
  settings.on = BuildOn::gpu;
  const viewer::Built built = viewer::build_grid(log, asset, settings, progress);
  EXPECT_FALSE(built.source->grid);
  ASSERT_TRUE(built.source->plan);
  EXPECT_EQ(built.source->plan->lattice->channels.size(), 2U);
  EXPECT_TRUE(built.source->emits());
  EXPECT_TRUE(built.source->colored());
  EXPECT_TRUE(lines.empty());
  // Different emission needs a different lattice.
  settings.emission.flame_strength = 3.0;
  EXPECT_NE(viewer::build_grid(log, asset, settings, progress).source->plan->lattice, built.source->plan->lattice);
}

// Density scale and anisotropy of the medium affect the lattice only with the transmittance criterion.
TEST(GpuGridBuild, MediaShareALatticeUnlessTheCriterionDependsOnThem) {
  const auto asset = std::make_shared<const viewer::VolumeAsset>(test::noise_volume({30, 30, 30}, glm::ivec3(0), 1));
  Progress progress;
  viewer::BuildSettings settings;
  settings.on = BuildOn::gpu;
  for (const auto criterion : {grid::Criterion::deviation, grid::Criterion::transmittance}) {
    settings.refine.criterion = criterion;
    settings.refine.density_scale = 1.0;
    const auto one = viewer::build_grid(Log(), asset, settings, progress).source->plan->lattice;
    settings.refine.density_scale = 1.5;
    settings.refine.anisotropy = 0.3;
    const auto other = viewer::build_grid(Log(), asset, settings, progress).source->plan->lattice;
    EXPECT_EQ(one == other, criterion == grid::Criterion::deviation);
  }
}

// bytes() does not block while a lattice is being made.
TEST(GpuGridBuild, MemoryQueryDoesNotBlockDuringABuild) {
  const auto asset = std::make_shared<const viewer::VolumeAsset>(test::noise_volume({120, 110, 100}, glm::ivec3(0), 1));
  int failures = 0;
  for (int i = 0; i < 10 && failures == 0; ++i) {
    Progress progress;
    viewer::BuildSettings settings;
    settings.on = BuildOn::gpu;
    settings.refine.threshold = 0.01 + 0.001 * i;  // another lattice
    double seconds = 0.0;
    static_cast<void>(asset->density({}, progress, seconds));
    std::atomic<bool> made = false;
    std::thread maker([&] {
      static_cast<void>(asset->lattice({}, {}, settings.refine, progress));
      made = true;
    });
    while (progress.stage() != Progress::Stage::refining || (progress.fraction() == 0.0 && !made))
      std::this_thread::yield();
    EXPECT_GT(asset->bytes(), 1'000'000U);
    if (!made) ++failures;
    maker.join();
  }
  EXPECT_GT(failures, 0);
}

// Data that does not depend on the view is computed once.
TEST(GpuGridBuild, ViewsShareALattice) {
  const auto asset = std::make_shared<const viewer::VolumeAsset>(test::noise_volume({30, 30, 30}, glm::ivec3(0), 1));
  Progress progress;
  viewer::BuildSettings settings;
  settings.on = BuildOn::gpu;
  const viewer::Built everywhere = viewer::build_grid(Log(), asset, settings, progress);
  settings.refine.camera = grid::RefineCamera{};
  settings.refine.pixel_size = 3.0;
  settings.refine.max_cells = 1000;
  const viewer::Built seen = viewer::build_grid(Log(), asset, settings, progress);
  EXPECT_EQ(seen.source->plan->lattice, everywhere.source->plan->lattice);
  EXPECT_NE(seen.source->plan->levels, everywhere.source->plan->levels);
  settings.refine.threshold *= 2.0;
  EXPECT_NE(viewer::build_grid(Log(), asset, settings, progress).source->plan->lattice,
            everywhere.source->plan->lattice);
}

}  // namespace
