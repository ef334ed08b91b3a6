// Measures how long a host waits that destroys a loading viewer. Each file's load is cancelled at many times, spread
// evenly over its duration, as cumulet_destroy does. Prints the delays and the time of the longest. Run by hand:
//
//     cumulet-bench-cancel [--moments N] FILE...
//
// Generated files of size N: fog:N, N^3 voxels; picture:N, N^2 pixels of a PNG; mesh:N, draco:N, meshopt:N, 2 N^2
// triangles.
#include <openvdb/io/File.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "base/milliseconds.hpp"
#include "jobs/builder.hpp"
#include "jobs/surface_builder.hpp"
#include "support/folder.hpp"
#include "support/gltf_seeds.hpp"
#include "support/openvdb.hpp"

namespace {

using namespace cumulet;
using Clock = std::chrono::steady_clock;

/// One load with a worker thread of its own.
class Load {
 public:
  explicit Load(const std::string& file) {
    if (file.ends_with(".vdb") || file.ends_with(".nvdb")) {
      volume_.emplace(viewer::JobContext{{}, [] {}});
      volume_->load({file, {}, glm::dmat4(1.0)}, viewer::BuildSettings{});
    } else {
      surfaces_.emplace(viewer::JobContext{{}, [] {}});
      surfaces_->load(file, {});
    }
  }
  /// Returns the error, if any.
  std::string wait() {
    if (volume_) volume_->wait({});
    if (surfaces_) surfaces_->wait({});
    const auto failure = status().failure;
    return failure ? failure->what() : "";
  }
  [[nodiscard]] viewer::Worker::Status status() const { return volume_ ? volume_->status() : surfaces_->status(); }

 private:
  std::optional<viewer::Builder> volume_;
  std::optional<viewer::SurfaceBuilder> surfaces_;
};

void write_fog(const std::string& file, int size) {
  const auto grid = openvdb::FloatGrid::create(0.0F);
  grid->setName("density");
  grid->setGridClass(openvdb::GRID_FOG_VOLUME);
  grid->tree().denseFill(openvdb::CoordBBox(openvdb::Coord(0), openvdb::Coord(size - 1)), 1.0F, true);
  for (auto leaf = grid->tree().beginLeaf(); leaf; ++leaf) {
    for (auto it = leaf->beginValueOn(); it; ++it) {
      const openvdb::Coord c = it.getCoord();
      it.setValue(0.1F + 0.01F * static_cast<float>((c.x() * 7 + c.y() * 13 + c.z() * 29) % 17));
    }
  }
  openvdb::io::File out(file);
  out.setCompression(openvdb::io::COMPRESS_NONE);
  out.write({grid});
}

/// Generates a file for a KIND:SIZE argument and returns its path. Other arguments are paths.
std::string made(const std::string& argument, const test::Folder& folder) {
  const std::size_t colon = argument.find(':');
  if (colon == std::string::npos) return argument;
  const std::string kind = argument.substr(0, colon);
  const int size = std::max(1, std::atoi(argument.c_str() + colon + 1));
  const auto n = static_cast<std::uint32_t>(size);
  if (kind == "fog") {
    std::string file = (folder / "fog.vdb").string();
    write_fog(file, size);
    return file;
  }
  std::optional<test::GltfModel> model;
  if (kind == "picture") model = test::seed_picture(n);
  if (kind == "mesh") model = test::seed_tangents(n);
  if (kind == "draco") model = test::seed_draco(n);
  if (kind == "meshopt") model = test::seed_meshopt(n);
  if (!model) throw std::runtime_error(argument + ": is of no kind that is known");
  std::string file = (folder / (kind + ".glb")).string();
  const std::vector<std::uint8_t> bytes = model->glb();
  std::ofstream(file, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  return file;
}

/// Waits until detached work has ended, so that it does not affect the next measurement.
void settle() {
  for (;;) {
    const std::clock_t before = std::clock();
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    if (std::clock() - before < CLOCKS_PER_SEC / 500) return;
  }
}

void measure(const std::string& name, const std::string& file, int moments) {
  const auto start = Clock::now();
  double whole = 0.0;
  {
    Load load(file);
    const std::string error = load.wait();
    if (!error.empty()) throw std::runtime_error(error);
    whole = milliseconds(Clock::now() - start);
  }
  struct Wait {
    double ms;
    double at;
    viewer::Worker::Status status;
  };
  std::vector<Wait> waits;
  for (int i = 0; i < moments; ++i) {
    const double at = whole * i / moments;
    settle();
    std::optional<Load> load(file);
    std::this_thread::sleep_for(std::chrono::duration<double, std::milli>(at));
    const auto status = load->status();
    const auto asked = Clock::now();
    load.reset();
    waits.push_back({milliseconds(Clock::now() - asked), at, status});
  }
  std::ranges::sort(waits, {}, &Wait::ms);
  const Wait& most = waits.back();
  std::printf("%-40s %8.0f ms to load; waits: median %6.1f, p95 %6.1f, most %6.1f ms, at %.0f ms (stage %d, %.2f)\n",
              name.c_str(), whole, waits[waits.size() / 2].ms, waits[waits.size() * 95 / 100].ms, most.ms, most.at,
              static_cast<int>(most.status.stage), most.status.fraction);
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) try {
  openvdb::initialize();
  int moments = 60;
  const test::Folder folder;
  std::vector<std::string> arguments(argv + 1, argv + argc);
  if (arguments.size() > 1 && arguments[0] == "--moments") {
    moments = std::max(1, std::atoi(arguments[1].c_str()));
    arguments.erase(arguments.begin(), arguments.begin() + 2);
  }
  if (arguments.empty()) {
    std::fputs("usage: cumulet-bench-cancel [--moments N] FILE|KIND:SIZE...\n", stderr);
    return 2;
  }
  for (const std::string& argument : arguments) {
    measure(std::filesystem::path(argument).filename().string(), made(argument, folder), moments);
  }
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "cumulet-bench-cancel: %s\n", error.what());
  return 1;
}
