// Measures time and memory for reading and building large volumes. Run by hand; one process per file, because peaks are
// per process:
//
//     cumulet-bench-large --enlarge N IN.vdb OUT.vdb
//     cumulet-bench-large [--threshold T] [--max-cells N] [--gl] [--plots FOLDER] FILE...
//
// --enlarge: upsamples the first grid of a file by N along each axis. It interpolates, and adds detail of a few voxels,
// because the file has none at that scale. It writes halves compressed with Blosc, as productions do.
//
// Otherwise it prints one line per file, as in results/large_volumes.csv. --plots: also writes large-time.svg and
// large-memory.svg. Each file has its own process. Seconds are CPU time of all threads, with wall time in brackets,
// because other programs may use the cores. The peak is that of the process (VmHWM) after each stage.
#include <openvdb/openvdb.h>
#include <openvdb/tools/Interpolation.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "assets/volume_file.hpp"
#include "jobs/build_grid.hpp"
#include "plot.hpp"

namespace {

using namespace cumulet;

// ---- a larger file ----

using Leaf = openvdb::FloatTree::LeafNodeType;

float hashed(int x, int y, int z) {
  auto h = static_cast<std::uint32_t>(x) * 0x8da6b343U ^ static_cast<std::uint32_t>(y) * 0xd8163841U ^
           static_cast<std::uint32_t>(z) * 0xcb1ab31fU;
  h = (h ^ (h >> 15U)) * 0x2c1b3c6dU;
  h = (h ^ (h >> 12U)) * 0x297a2d39U;
  return static_cast<float>((h ^ (h >> 15U)) & 0xffffU) / 65535.0F;
}

// Noise from 0 to 1 with a random value every three voxels.
float noise(const glm::ivec3& voxel) {
  const glm::vec3 p = glm::vec3(voxel) / 3.0F;
  const glm::vec3 low = glm::floor(p);
  const glm::vec3 part = p - low;
  const glm::ivec3 l(low);
  const auto row = [&](int y, int z) {
    return glm::mix(hashed(l.x, l.y + y, l.z + z), hashed(l.x + 1, l.y + y, l.z + z), part.x);
  };
  return glm::mix(glm::mix(row(0, 0), row(1, 0), part.y), glm::mix(row(0, 1), row(1, 1), part.y), part.z);
}

std::unique_ptr<Leaf> larger_leaf(openvdb::FloatGrid::ConstAccessor& from, const openvdb::Coord& origin, int times) {
  constexpr float smallest = 0.004F;
  auto leaf = std::make_unique<Leaf>(origin, 0.0F, false);
  for (openvdb::Index i = 0; i < Leaf::SIZE; ++i) {
    const openvdb::Coord at = leaf->offsetToGlobalCoord(i);
    const openvdb::Vec3d position = (at.asVec3d() + 0.5) / times - 0.5;
    const float value = openvdb::tools::BoxSampler::sample(from, position);
    if (value <= smallest) continue;
    const float detailed = value * (0.7F + 0.6F * noise({at.x(), at.y(), at.z()}));
    if (detailed > smallest) leaf->setValueOn(i, detailed);
  }
  return leaf->isEmpty() ? nullptr : std::move(leaf);
}

void enlarge(int times, const std::string& in, const std::string& out) {
  openvdb::io::File file(in);
  file.open();
  const auto small = openvdb::gridPtrCast<openvdb::FloatGrid>(file.readGrid(file.beginName().gridName()));
  std::vector<const Leaf*> leaves;
  small->tree().getNodes(leaves);
  tbb::enumerable_thread_specific<std::vector<std::unique_ptr<Leaf>>> made;
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, leaves.size(), 16), [&](const auto& range) {
    auto accessor = small->getConstAccessor();
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      for (int child = 0; child < times * times * times; ++child) {
        const openvdb::Coord step(child % times * 8, child / times % times * 8, child / (times * times) * 8);
        const openvdb::Coord first = leaves[i]->origin();
        const openvdb::Coord origin(first.x() * times + step.x(), first.y() * times + step.y(),
                                    first.z() * times + step.z());
        if (auto leaf = larger_leaf(accessor, origin, times)) made.local().push_back(std::move(leaf));
      }
    }
  });
  const auto large = openvdb::FloatGrid::create(0.0F);
  for (auto& some : made) {
    for (auto& leaf : some) large->tree().addLeaf(leaf.release());
  }
  large->setName("density");
  large->setGridClass(openvdb::GRID_FOG_VOLUME);
  large->setSaveFloatAsHalf(true);
  large->setTransform(openvdb::math::Transform::createLinearTransform(small->voxelSize().x() / times));
  openvdb::io::File to(out);
  to.setCompression(openvdb::io::COMPRESS_ACTIVE_MASK | openvdb::io::COMPRESS_BLOSC);
  to.write({large});
  to.close();
  std::printf("%s: %llu active voxels\n", out.c_str(), static_cast<unsigned long long>(large->activeVoxelCount()));
}

// ---- reading and building ----

struct Stage {
  double processor, clock;  // seconds
  std::uint64_t peak;       // bytes, at the end of the stage
};

class Stages {
 public:
  Stage lap() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    const auto seconds = [](const timeval& t) {
      return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
    };
    const double processor = seconds(usage.ru_utime) + seconds(usage.ru_stime);
    const auto now = std::chrono::steady_clock::now();
    const Stage stage{processor - processor_, std::chrono::duration<double>(now - clock_).count(),
                      static_cast<std::uint64_t>(usage.ru_maxrss) * 1024};
    processor_ = processor;
    clock_ = now;
    return stage;
  }

 private:
  double processor_ = 0.0;
  std::chrono::steady_clock::time_point clock_ = std::chrono::steady_clock::now();
};

std::string text_of(const Stage& stage) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), "%.2f (%.1f)", stage.processor, stage.clock);
  return text.data();
}

double mebibytes(std::uint64_t bytes) { return static_cast<double>(bytes) / 1048576.0; }

struct Measured {
  Stage load, statistics, grid;
  std::uint64_t voxels, kept;
  [[nodiscard]] double processor() const { return load.processor + statistics.processor + grid.processor; }
  [[nodiscard]] double clock() const { return load.clock + statistics.clock + grid.clock; }
};

Measured measure(const std::string& file, viewer::BuildSettings settings) {
  Stages stages;
  Progress progress;
  const auto volume = viewer::VolumeFile{.path = file, .grids = {}}.read(Log(), &progress);
  const Stage load = stages.lap();
  double seconds = 0.0;
  const auto density = volume->density({}, progress, seconds);
  const Stage statistics = stages.lap();
  settings.refine.density_scale = volume->coarse().suggest_density_scale().value_or(1.0);
  const viewer::Built built = viewer::build_grid(Log(), volume, settings, progress);
  const Stage grid = stages.lap();
  const std::size_t bricks = volume->volume().brick_origins.size();
  const Measured measured{load, statistics, grid, volume->volume().active_voxels, built.bytes()};
  std::printf("| %.3g | %zu | %.0f | %s | %s | %s | %.2f (%.1f) | %.0f | %.0f | %.0f | %.0f | %llu%s |\n",
              static_cast<double>(measured.voxels), bricks, mebibytes(std::filesystem::file_size(file)),
              text_of(load).c_str(), text_of(statistics).c_str(), text_of(grid).c_str(), measured.processor(),
              measured.clock(), mebibytes(load.peak), mebibytes(statistics.peak), mebibytes(grid.peak),
              mebibytes(measured.kept), static_cast<unsigned long long>(built.cells), built.limited ? ", limited" : "");
  std::fflush(stdout);
  return measured;
}

// Measures in another process, because peaks are per process.
Measured measure_apart(const std::string& file, const viewer::BuildSettings& settings) {
  std::array<int, 2> ends{};
  if (pipe(ends.data()) != 0) throw std::runtime_error("no pipe");
  const pid_t child = fork();
  if (child < 0) throw std::runtime_error("no other process");
  if (child == 0) {
    try {
      const Measured measured = measure(file, settings);
      _exit(write(ends[1], &measured, sizeof measured) == sizeof measured ? 0 : 1);
    } catch (const std::exception& error) {
      std::fprintf(stderr, "cumulet-bench-large: %s\n", error.what());
      _exit(1);
    }
  }
  close(ends[1]);
  Measured measured{};
  const bool whole = read(ends[0], &measured, sizeof measured) == sizeof measured;
  close(ends[0]);
  waitpid(child, nullptr, 0);
  if (!whole) throw std::runtime_error(file + " was not measured");
  return measured;
}

void plot(const std::vector<Measured>& all, const std::filesystem::path& folder) {
  const auto series = [&](const char* label, int color, bool dashed, const auto& value) {
    bench::Series made{label, color, dashed, {}};
    for (const Measured& m : all) made.points.emplace_back(static_cast<double>(m.voxels), value(m));
    return made;
  };
  bench::write_file(
      folder / "large-time.svg",
      bench::line_plot("Reading and building a cloud", "active voxels", "seconds of processors",
                       {series("all", 2, false, [](const Measured& m) { return m.processor(); }),
                        series("load", 0, false, [](const Measured& m) { return m.load.processor; }),
                        series("statistics", 1, false, [](const Measured& m) { return m.statistics.processor; }),
                        series("grid", 3, false, [](const Measured& m) { return m.grid.processor; }),
                        series("all, by the clock", 2, true, [](const Measured& m) { return m.clock(); })}));
  bench::write_file(
      folder / "large-memory.svg",
      bench::line_plot("Memory of a cloud", "active voxels", "MiB",
                       {series("at the peak", 2, false, [](const Measured& m) { return mebibytes(m.grid.peak); }),
                        series("while it is read", 0, false, [](const Measured& m) { return mebibytes(m.load.peak); }),
                        series("kept", 3, false, [](const Measured& m) { return mebibytes(m.kept); })}));
}

}  // namespace

int main(int argc, char** argv) try {
  openvdb::initialize();
  const std::vector<std::string> arguments(argv + 1, argv + argc);
  if (arguments.size() == 4 && arguments[0] == "--enlarge") {
    const int times = std::atoi(arguments[1].c_str());
    if (times < 1) throw std::runtime_error("--enlarge needs a number above 0");
    enlarge(times, arguments[2], arguments[3]);
    return 0;
  }
  viewer::BuildSettings settings;
  settings.refine.criterion = grid::Criterion::transmittance;
  settings.refine.threshold = 0.15;
  std::vector<std::string> files;
  std::filesystem::path plots;
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    const bool more = i + 1 < arguments.size();
    if (arguments[i] == "--threshold" && more) {
      settings.refine.threshold = std::atof(arguments[++i].c_str());
    } else if (arguments[i] == "--max-cells" && more) {
      settings.refine.max_cells = std::strtoull(arguments[++i].c_str(), nullptr, 10);
    } else if (arguments[i] == "--plots" && more) {
      plots = arguments[++i];
    } else if (arguments[i] == "--gl") {
      settings.on = viewer::BuildOn::gpu;
    } else {
      files.push_back(arguments[i]);
    }
  }
  if (files.empty()) {
    std::fputs(
        "usage: cumulet-bench-large [--threshold T] [--max-cells N] [--gl] [--plots FOLDER] FILE...\n"
        "       cumulet-bench-large --enlarge N IN.vdb OUT.vdb\n",
        stderr);
    return 2;
  }
  std::vector<Measured> all;
  for (const std::string& file : files) all.push_back(measure_apart(file, settings));
  if (!plots.empty()) plot(all, plots);
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "cumulet-bench-large: %s\n", error.what());
  return 1;
}
