// Measures the time for building grids on the CPU and on the GPU: from a volume's statistics, and again for another
// view. Run by hand:
//
//     cumulet-bench-grid [--threshold T] [--max-cells N] [--density-scale D] [--blackbody B] [--once] [--block-bytes N]
//     FILE...
//
// --once: builds only a grid without a camera, and only once, for grids of many cells. --block-bytes: assumed storage
// block size instead of the driver's; llvmpipe's real limit is above the 128 MiB that it reports.
//
// All channels are included. The views are those of --camera-adaptive, on a circle about the volume from far away to
// inside, 1280 x 720. Refits are for as many small steps on the circle, in calls with a budget; the longest call is
// printed. GPU seconds are until a fence after all passes; with Mesa's llvmpipe they run on the same cores. Bytes are
// the minimum that passes read and write: each word once per pass that needs it.

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <headless.hpp>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "assets/volume_asset.hpp"
#include "base/milliseconds.hpp"
#include "gl/state_guard.hpp"
#include "grid/grid_builder.hpp"
#include "render/grid/grid_build.hpp"
#include "volume/frame_import.hpp"

namespace {

using namespace cumulet;
using Clock = std::chrono::steady_clock;
using render::Deadline;

constexpr int repeats = 5;
constexpr int refits = 40;
constexpr double budget_ms = 4.0;

double since(Clock::time_point start) { return milliseconds(Clock::now() - start); }

grid::RefineCamera camera_about(const grid::Statistics& statistics, const volume::ScalarVolume& volume, double turn) {
  const glm::dmat4& to_world = statistics.cube().to_world;
  const glm::dvec3 low(volume.bounds_min - statistics.cube().origin);
  const glm::dvec3 high(volume.bounds_max + 1 - statistics.cube().origin);
  const glm::dvec3 centre(to_world * glm::dvec4(0.5 * (low + high), 1.0));
  const double radius = 0.5 * glm::length(glm::dmat3(to_world) * (high - low));
  grid::RefineCamera camera;
  const double distance = radius * (0.4 + 2.1 * std::abs(std::cos(turn)));
  camera.eye = centre + distance * glm::dvec3(std::sin(2.0 * turn), 0.2, std::cos(2.0 * turn));
  camera.forward = glm::normalize(centre - camera.eye);
  camera.right = glm::normalize(glm::cross(camera.forward, glm::dvec3(0.0, 1.0, 0.0)));
  camera.up = glm::cross(camera.right, camera.forward);
  camera.tan_half_y = 0.3;
  camera.tan_half_x = camera.tan_half_y * 1280.0 / 720.0;
  camera.pixels_per_radian = 720.0 / (2.0 * camera.tan_half_y);
  return camera;
}

struct Times {
  double splits = 0.0, cells = 0.0, records = 0.0;
  std::size_t count = 0;
  [[nodiscard]] double all() const { return splits + cells + records; }
};

struct OnCpu {
  Times times;
  grid::TetGrid grid;
};
OnCpu build_on_cpu(const viewer::VolumeAsset::Density& density, const grid::Channels& channels,
                   const grid::RefineSettings& settings) {
  const grid::Statistics& statistics = *density.statistics;
  OnCpu made;
  Times& times = made.times;
  auto start = Clock::now();
  const grid::DiamondSet diamonds(statistics, channels, settings);
  times.splits = since(start);
  start = Clock::now();
  grid::GridBuilder builder(statistics, diamonds);
  builder.bisect();
  times.cells = since(start);
  start = Clock::now();
  made.grid = builder.records(settings.cells, density.voxels->max_value, channels);
  times.records = since(start);
  times.count = made.grid.cells.size();
  return made;
}

class Gpu {
 public:
  explicit Gpu(std::int64_t block_bytes)
      : context_(headless::Context::create(headless::Backend::automatic)),
        gl_(gl::load_functions(headless::Context::get_proc, &context_)),
        programs_(std::make_shared<gl::Programs>(*gl_, nullptr)),
        limits_(gl::query_limits(*gl_)) {
    if (block_bytes != 0) limits_.storage_block_bytes = block_bytes;
    const gl::StateGuard guard(*gl_);
    gl::find_out_dispatches(gl_, *programs_);
    for (const gl::ProgramKey& key : gl::all_programs()) {
      if (key.name.starts_with("grid_")) programs_->get(key);
    }
    std::printf("driver: %s\n", gl::string_of(*gl_, GL_RENDERER).c_str());
  }

  double upload(const grid::LatticePtr& lattice, const std::shared_ptr<const grid::Statistics>& statistics,
                const grid::Channels& channels) {
    const gl::StateGuard guard(*gl_);
    const auto start = Clock::now();
    render::LatticeUpload work(gl_, programs_, limits_, lattice, statistics, channels);
    while (!work.advance(Deadline::max())) {
    }
    gl::Fence(gl_).wait();
    data_ = work.take();
    return since(start);
  }

  struct Built {
    double levels_ms = 0.0, ms = 0.0;
    render::BuiltGrid grid;
    [[nodiscard]] std::size_t count() const { return grid.count; }
  };
  Built build(const grid::RefineSettings& settings) {
    const gl::StateGuard guard(*gl_);
    Built built;
    auto start = Clock::now();
    const grid::Lattice& lattice = data_->lattice();
    auto levels = lattice.own.levels(grid::ViewLevels(lattice.cube, settings));
    built.levels_ms = since(start);
    start = Clock::now();
    render::GridBuild work(gl_, programs_, limits_, data_, std::move(levels), settings.max_cells);
    while (!work.advance(Deadline::max())) {
    }
    built.grid = work.take();
    gl::Fence(gl_).wait();
    built.ms = since(start);
    return built;
  }
  // Cells whose links or positions differ from the CPU's, and the largest coefficient difference relative to the
  // largest density.
  struct Differences {
    std::size_t cells = 0;
    double coefficients = 0.0;
  };
  [[nodiscard]] Differences compare(const render::BuiltGrid& built, const grid::TetGrid& with) const {
    Differences found;
    std::vector<grid::CellRecord> cells;
    for (std::size_t first = 0; first < with.cells.size(); first += cells.size()) {
      cells.resize(std::min<std::size_t>(with.cells.size() - first, std::size_t{1} << 20U));
      gl_->GetNamedBufferSubData(built.cells.name(), static_cast<GLintptr>(first * sizeof cells[0]),
                                 static_cast<GLsizeiptr>(cells.size() * sizeof cells[0]), cells.data());
      for (std::size_t i = 0; i < cells.size(); ++i) {
        const grid::CellRecord& other = with.cells[first + i];
        if (cells[i].links != other.links || glm::uvec2(cells[i].data) != glm::uvec2(other.data)) ++found.cells;
        const glm::vec4 by = glm::abs(core::cm_record_fit(cells[i].data) - core::cm_record_fit(other.data));
        found.coefficients = std::max<double>({found.coefficients, by.x, by.y, by.z, by.w});
      }
    }
    return found;
  }
  // Timing of calls with a budget, as in frames.
  struct Refit {
    double ms = 0.0, longest_ms = 0.0;
  };
  Refit refit(const grid::RefineSettings& settings) {
    const gl::StateGuard guard(*gl_);
    const grid::Lattice& lattice = data_->lattice();
    const auto start = Clock::now();
    render::GridBuild work(gl_, programs_, limits_, data_, lattice.own.levels(grid::ViewLevels(lattice.cube, settings)),
                           settings.max_cells, std::numeric_limits<std::uint64_t>::max(), pace_);
    Refit refit;
    for (bool done = false; !done;) {
      const auto call = Clock::now();
      done = work.advance(call + std::chrono::microseconds(static_cast<int>(1000.0 * budget_ms)));
      refit.longest_ms = std::max(refit.longest_ms, since(call));
    }
    gl::Fence(gl_).wait();
    refit.ms = since(start);
    return refit;
  }
  [[nodiscard]] const render::LatticeData& data() const { return *data_; }

 private:
  headless::Context context_;
  gl::FunctionsPtr gl_;
  gl::ProgramsPtr programs_;
  gl::Limits limits_;
  render::LatticeDataPtr data_;
  render::GridPacePtr pace_ = std::make_shared<render::GridPace>();
};

void print_refits(std::vector<Gpu::Refit> all) {
  const auto middle = all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2);
  const auto late = all.begin() + static_cast<std::ptrdiff_t>(all.size() * 19 / 20);
  std::ranges::nth_element(all, middle, {}, &Gpu::Refit::ms);
  const double ms = middle->ms;
  std::ranges::nth_element(all, late, {}, &Gpu::Refit::longest_ms);
  std::printf("  %zu refits in calls of %.0f ms: %.0f ms each (median); the longest call %.1f ms (of 19 in 20)\n",
              all.size(), budget_ms, ms, late->longest_ms);
}

// Prints the bytes that passes read and write, for the lattice and per cell.
void print_bytes(const grid::Lattice& lattice, std::size_t cells) {
  // Per point: cleared, raised (reads its own priorities), closed (read once, with its parents), counted twice.
  const double points = static_cast<double>(lattice.blocks.size()) * CM_BLOCK_POINTS * 4.0;
  const double splits = 4.0 * points + static_cast<double>(lattice.own.bytes());
  // Per node of the tree (two per cell): marking reads 8 and the priority, and writes 4 and its position in the list; a
  // leaf writes 4 more. Per parent (one per cell): children read the list, 8 + 16, 12 of two neighbors and 8 of two
  // others, and write 24 per child. Leaves read the list and 8, and write 4. Order reads the list and 12, and writes 4
  // and 8 per child. The record reads the list, 16 + 16 and four neighbors' 12, and writes 32. Clear cones read half of
  // a record twice, and write 4.
  const double cell = 2.0 * (8.0 + 4.0 + 4.0 + 4.0) + 4.0 + (4.0 + 24.0 + 24.0 + 16.0 + 48.0) + (4.0 + 8.0 + 4.0) +
                      (4.0 + 12.0 + 4.0 + 16.0) + (4.0 + 32.0 + 48.0 + 32.0) + 36.0;
  std::printf("  bytes moved: %.1f MB to decide, %.0f a cell; of a cell %.0f in all\n", splits * 1e-6, cell,
              splits / static_cast<double>(std::max<std::size_t>(cells, 1)) + cell);
}

void measure(Gpu& gpu, const std::string& file, grid::RefineSettings settings, const scene::Emission& emission,
             bool once) {
  const viewer::VolumeAsset asset(volume::import_frame(file, {}, Log()));
  Progress progress;
  double seconds = 0.0;
  const viewer::VolumeAsset::Density density = asset.density({}, progress, seconds);
  const grid::Channels channels = asset.channels({}, emission, true, progress);
  const auto& volume = density.voxels;
  const auto& statistics = density.statistics;
  std::printf("%s: %.2fM active voxels, %zu bricks\n", std::filesystem::path(file).filename().c_str(),
              static_cast<double>(volume->active_voxels) * 1e-6, statistics->nodes_of_size(3).size());
  const auto start = Clock::now();
  const auto lattice = std::make_shared<const grid::Lattice>(*statistics, channels, settings, volume->max_value);
  const double lattice_ms = since(start);
  const double upload_ms = gpu.upload(lattice, statistics, channels);
  std::printf("  lattice: %.0f ms, %.1f MB in main memory, %zu blocks; uploaded in %.0f ms, %.1f MB of GL's\n",
              lattice_ms, static_cast<double>(lattice->bytes()) * 1e-6, lattice->blocks.size(), upload_ms,
              static_cast<double>(gpu.data().bytes()) * 1e-6);
  const auto compare = [&](const char* what) {
    // CPU and GPU in turn. The fastest run of each counts, because other programs may use the cores.
    const OnCpu on_cpu = build_on_cpu(density, channels, settings);
    Times cpu = on_cpu.times;
    Gpu::Built built = gpu.build(settings);
    for (int i = 1; i < (once ? 1 : repeats); ++i) {
      const Times again = build_on_cpu(density, channels, settings).times;
      if (again.all() < cpu.all()) cpu = again;
      Gpu::Built anew = gpu.build(settings);
      if (anew.ms < built.ms) built = std::move(anew);
    }
    std::printf(
        "  %-12s %8zu cells: CPU %7.0f ms (splits %.0f, cells %.0f, records %.0f); GL %7.0f ms and %.1f for the "
        "levels, %.0f ns a cell, %.0f MB kept\n",
        what, cpu.count, cpu.all(), cpu.splits, cpu.cells, cpu.records, built.ms, built.levels_ms,
        1e6 * built.ms / static_cast<double>(built.count()), static_cast<double>(built.grid.bytes()) * 1e-6);
    if (built.count() != cpu.count) throw std::runtime_error(std::to_string(built.count()) + " cells by GL");
    const Gpu::Differences differences = gpu.compare(built.grid, on_cpu.grid);
    if (differences.cells != 0) throw std::runtime_error("other cells by GL: " + std::to_string(differences.cells));
    std::printf("               links and places are the same, coefficients within %.1g of the largest density\n",
                differences.coefficients);
    std::fflush(stdout);
    return built.count();
  };
  print_bytes(*lattice, compare("everywhere"));
  if (once) return;
  for (int i = 0; i < 5; ++i) {
    settings.camera = camera_about(*statistics, *volume, 0.35 * i);
    compare(("view " + std::to_string(i)).c_str());
  }
  std::vector<Gpu::Refit> all;
  for (int i = 0; i < refits; ++i) {
    settings.camera = camera_about(*statistics, *volume, 0.01 * i);
    all.push_back(gpu.refit(settings));
  }
  print_refits(std::move(all));
}

}  // namespace

int main(int argc, char** argv) try {
  grid::RefineSettings settings;
  settings.criterion = grid::Criterion::transmittance;
  settings.threshold = 0.15;
  scene::Emission emission;
  std::vector<std::string> files;
  std::int64_t block_bytes = 0;
  bool once = false;
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    const bool more = i + 1 < argc;
    if (argument == "--threshold" && more) {
      settings.threshold = std::atof(argv[++i]);
    } else if (argument == "--max-cells" && more) {
      settings.max_cells = std::strtoull(argv[++i], nullptr, 10);
    } else if (argument == "--density-scale" && more) {
      settings.density_scale = std::atof(argv[++i]);
    } else if (argument == "--blackbody" && more) {
      emission.blackbody = std::atof(argv[++i]);
    } else if (argument == "--once") {
      once = true;
    } else if (argument == "--block-bytes" && more) {
      block_bytes = std::atoll(argv[++i]);
    } else {
      files.push_back(argument);
    }
  }
  if (files.empty()) {
    std::fputs(
        "usage: cumulet-bench-grid [--threshold T] [--max-cells N] [--density-scale D] [--blackbody B] [--once]\n"
        "                          [--block-bytes N] FILE...\n",
        stderr);
    return 2;
  }
  Gpu gpu(block_bytes);
  for (const std::string& file : files) measure(gpu, file, settings, emission, once);
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "cumulet-bench-grid: %s\n", error.what());
  return 1;
}
