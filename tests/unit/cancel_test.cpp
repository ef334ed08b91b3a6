// Progress and cancellation of all work that a worker thread does with a volume before its upload.

#define NANOVDB_USE_ZIP
#define NANOVDB_USE_BLOSC

#include <gtest/gtest.h>
#include <nanovdb/util/IO.h>
#include <nanovdb/util/OpenToNanoVDB.h>
#include <openvdb/io/Stream.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <functional>
#include <image.hpp>
#include <limits>
#include <thread>

#include "assets/volume_asset.hpp"
#include "base/progress.hpp"
#include "grid/grid_builder.hpp"
#include "light/environment_file.hpp"
#include "render/scene/model_data.hpp"
#include "support/c_host.hpp"
#include "support/folder.hpp"
#include "support/gltf_seeds.hpp"
#include "support/openvdb.hpp"
#include "support/radiance.hpp"
#include "support/volumes.hpp"
#include "surface/gltf_import.hpp"
#include "volume/memory.hpp"

namespace {

namespace fs = std::filesystem;
using namespace cumulet;
using Work = std::function<void(Progress&)>;

/// Progress fractions that another thread observed.
std::vector<double> fractions_of(const Work& work) {
  Progress progress;
  std::atomic<bool> done = false;
  std::vector<double> seen;
  std::thread watcher([&] {
    while (!done) {
      seen.push_back(progress.fraction());
      std::this_thread::yield();
    }
    seen.push_back(progress.fraction());
  });
  work(progress);
  done = true;
  watcher.join();
  return seen;
}

/// Expects that the fraction never decreases, stays within [0, 1], reaches 1, and takes at least `min_values` values.
void expect_steady_progress(const Work& work, std::size_t min_values = 5) {
  std::vector<double> all;
  // On a busy machine the watching thread may miss most values.
  for (int attempt = 0; attempt < 20 && all.size() < min_values; ++attempt) {
    const std::vector<double> seen = fractions_of(work);
    EXPECT_TRUE(std::is_sorted(seen.begin(), seen.end()));
    EXPECT_GE(seen.front(), 0.0);
    EXPECT_DOUBLE_EQ(seen.back(), 1.0);
    all.insert(all.end(), seen.begin(), seen.end());
    std::sort(all.begin(), all.end());
    all.erase(std::unique(all.begin(), all.end()), all.end());
  }
  EXPECT_GE(all.size(), min_values);
}

double processor_milliseconds() { return 1e3 * static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

/// Expects that the median delay from cancel to stop is short and that none exceeds `most`. Milliseconds.
void expect_soon(std::vector<double> delays, double most) {
  ASSERT_FALSE(delays.empty());
  std::sort(delays.begin(), delays.end());
  std::string list;
  for (const double delay : delays) list += std::to_string(delay).substr(0, 5) + " ";
  testing::Test::RecordProperty("milliseconds_to_stop", list);
#if !defined(__SANITIZE_ADDRESS__)
  // Measured in CPU time of all threads, which depends little on the load of the machine.
  EXPECT_LT(delays[delays.size() / 2], 30.0) << list;
  EXPECT_LT(delays.back(), most) << list;
#else
  static_cast<void>(most);
#endif
}

/// Cancels at many fractions and between them. Expects that the work stops soon with Error(cancelled) only.
void expect_cancels(const Work& work) {
  constexpr int moments = 16;
  std::vector<double> delays;
  int cancelled = 0;
  test::Random random(5);
  for (int i = 0; i < moments; ++i) {
    Progress progress;
    std::atomic<bool> done = false;
    double asked = 0.0;
    const auto extra = std::chrono::microseconds(random() % 3000);
    std::thread canceller([&] {
      while (!done && progress.fraction() < 0.99 * i / moments) std::this_thread::yield();
      if (i > 0) std::this_thread::sleep_for(extra);
      asked = processor_milliseconds();
      progress.cancel();
    });
    bool threw = false;
    try {
      work(progress);
    } catch (const Error& e) {
      threw = true;
      EXPECT_EQ(e.code(), ErrorCode::cancelled) << e.what();
      EXPECT_STREQ(e.what(), "cancelled");
    }
    const double stopped = processor_milliseconds();
    done = true;
    canceller.join();
    if (!threw) continue;
    ++cancelled;
    delays.push_back(stopped - asked);
  }
  EXPECT_GE(cancelled, moments / 3);
  expect_soon(delays, 250.0);
}

/// Cancels at many times, spread evenly over the duration of the work, for work whose fraction changes rarely.
void expect_stops(const Work& work) {
  constexpr int moments = 20;
  using Clock = std::chrono::steady_clock;
  const auto start = Clock::now();
  Progress uncancelled;
  work(uncancelled);
  const auto whole = Clock::now() - start;
  std::vector<double> delays;
  for (int i = 0; i < moments; ++i) {
    Progress progress;
    std::atomic<double> asked = 0.0;
    std::thread canceller([&] {
      std::this_thread::sleep_for(whole * i / moments);
      asked = processor_milliseconds();
      progress.cancel();
    });
    try {
      work(progress);
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ErrorCode::cancelled) << e.what();
      delays.push_back(processor_milliseconds() - asked);
    }
    canceller.join();
  }
  ASSERT_GE(delays.size(), moments / 4U);
  expect_soon(delays, 100.0);
}

void expect_both(const Work& work, std::size_t min_values = 5) {
  expect_steady_progress(work, min_values);
  expect_cancels(work);
}

/// About 7 million voxels, no two bricks equal.
float density(const glm::ivec3& p) {
  const glm::vec3 x = glm::vec3(p) / 40.0F;
  return std::max(0.0F, std::sin(x.x) * std::sin(1.3F * x.y) * std::sin(0.7F * x.z) +
                            0.01F * static_cast<float>((p.x * 7 + p.y * 13 + p.z * 29) % 17));
}
constexpr glm::ivec3 size{208, 192, 176};

const volume::ScalarVolume& large_volume() {
  static const volume::ScalarVolume volume = test::make_volume(size, {-30, -20, 5}, density);
  return volume;
}

struct Built {
  grid::Statistics statistics{large_volume(), grid::fit_cube(large_volume())};
  grid::RefineSettings settings = [] {
    grid::RefineSettings s;
    s.threshold = 0.001;
    s.max_cells = 1'000'000;
    return s;
  }();
  grid::DiamondSet diamonds{statistics, settings};
};
const Built& built() {
  static const Built all;
  return all;
}

TEST(Cancel, Statistics) {
  expect_both([](Progress& progress) {
    const grid::Statistics statistics(large_volume(), grid::fit_cube(large_volume()), &progress);
  });
}

TEST(Cancel, DiamondsAndBisection) {
  for (const double threshold : {0.001, 0.05}) {  // limited by max_cells, and not limited
    grid::RefineSettings settings = built().settings;
    settings.threshold = threshold;
    expect_both([&](Progress& progress) {
      progress.begin(Progress::Stage::refining);
      const grid::DiamondSet diamonds(built().statistics, settings, &progress);
      grid::GridBuilder builder(built().statistics, diamonds);
      builder.bisect(&progress);
    });
  }
}

TEST(Cancel, Records) {
  grid::GridBuilder builder(built().statistics, built().diamonds);
  builder.bisect();
  grid::TetGrid last;
  // A cancelled call leaves the builder unchanged: the next one succeeds.
  expect_both([&](Progress& progress) {
    progress.begin(Progress::Stage::records);
    last = builder.records(grid::CellKind::linear, large_volume().max_value, &progress);
  });
  const grid::TetGrid whole = builder.records(grid::CellKind::linear, large_volume().max_value);
  ASSERT_EQ(last.cells.size(), whole.cells.size());
  EXPECT_EQ(last.tree, whole.tree);
  EXPECT_TRUE(std::equal(last.cells.begin(), last.cells.end(), whole.cells.begin(),
                         [](const auto& a, const auto& b) { return a.links == b.links && a.data == b.data; }));
}

TEST(Cancel, DenseVoxels) {
  const glm::ivec3 dense_size(300, 290, 280);
  std::vector<float> values;
  values.reserve(static_cast<std::size_t>(dense_size.x) * 290 * 280);
  for (int z = 0; z < dense_size.z; ++z) {
    for (int y = 0; y < dense_size.y; ++y) {
      for (int x = 0; x < dense_size.x; ++x) values.push_back(static_cast<float>((x * 7 + y * 13 + z * 29) % 17));
    }
  }
  const volume::DenseVoxels voxels{.values = values, .size = dense_size, .index_to_world = glm::dmat4(1.0)};
  expect_both([&](Progress& progress) { (void)volume::import_dense(voxels, "dense", {}, &progress); });
}

TEST(Cancel, SparseVoxels) {
  const volume::ScalarVolume& large = large_volume();
  std::vector<std::int32_t> origins;
  for (const glm::ivec3& o : large.brick_origins) origins.insert(origins.end(), {o.x, o.y, o.z});
  volume::BrickValues values = large.brick_values;
  volume::SparseVoxels voxels{.brick_origins = origins,
                              .brick_values = values.as_floats(),
                              .brick_active = {},
                              .tiles = {},
                              .background = 0.0F,
                              .index_to_world = glm::dmat4(1.0)};
  // Tiles in addition to the bricks, enough to take some time.
  for (int i = 0; i < 20000; ++i) {
    const glm::ivec3 low(1000 + 9 * (i % 100), 9 * (i / 100 % 100), 9 * (i / 10000));
    voxels.tiles.push_back({{low, low + 7, 1.0F}, true});
  }
  // Most of the time goes into the tiles, which are processed without progress steps.
  expect_both([&](Progress& progress) { (void)volume::import_sparse(voxels, "sparse", {}, &progress); }, 3);
}

class CancelImport : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    openvdb::initialize();
    grid_ = make(0.0F);
  }
  static void TearDownTestSuite() { grid_.reset(); }

  static openvdb::FloatGrid::Ptr make(float background) {
    auto grid = openvdb::FloatGrid::create(background);
    grid->setName("density");
    grid->tree().denseFill(openvdb::CoordBBox(openvdb::Coord(0), openvdb::Coord(size.x, size.y, size.z)), 1.0F, true);
    for (auto leaf = grid->tree().beginLeaf(); leaf; ++leaf) {
      for (auto it = leaf->beginValueOn(); it; ++it) {
        const openvdb::Coord c = it.getCoord();
        it.setValue(density({c.x(), c.y(), c.z()}));
      }
    }
    return grid;
  }
  [[nodiscard]] fs::path write(std::uint32_t compression, const openvdb::GridCPtrVec& grids) const {
    fs::path file = folder_ / "test.vdb";
    openvdb::io::File out(file.string());
    out.setCompression(compression);
    out.write(grids);
    return file;
  }
  static void expect_import(const fs::path& file) {
    expect_both([&](Progress& progress) { (void)volume::import_volume(file, "density", {}, &progress); });
  }

  test::Folder folder_;
  static inline openvdb::FloatGrid::Ptr grid_;
};

TEST_F(CancelImport, VdbOfEveryCompression) {
  for (const int flags : {int{openvdb::io::COMPRESS_NONE}, int{openvdb::io::COMPRESS_ZIP},
                          openvdb::io::COMPRESS_BLOSC | openvdb::io::COMPRESS_ACTIVE_MASK}) {
    expect_import(write(static_cast<std::uint32_t>(flags), {grid_}));
  }
}

TEST_F(CancelImport, VdbWithABackground) {
  // Nodes of such a file cannot be freed when they are read only in part.
  expect_import(write(openvdb::io::COMPRESS_NONE, {make(0.25F)}));
}

TEST_F(CancelImport, VdbWithoutOffsets) {
  const fs::path file = folder_ / "pipe.vdb";
  const auto vectors = openvdb::Vec3SGrid::create();
  vectors->setName("vel");
  vectors->tree().denseFill(openvdb::CoordBBox(openvdb::Coord(0), openvdb::Coord(90)), openvdb::Vec3s(1, 2, 3), true);
  {
    std::ofstream out(file, std::ios::binary);
    openvdb::io::Stream(out).write(openvdb::GridCPtrVec{vectors, grid_});
  }
  expect_import(file);
}

TEST_F(CancelImport, NanoVdbOfEveryCodec) {
  const auto nano = nanovdb::openToNanoVDB(*grid_);
  const fs::path file = folder_ / "test.nvdb";
  for (const auto codec : {nanovdb::io::Codec::NONE, nanovdb::io::Codec::ZIP, nanovdb::io::Codec::BLOSC}) {
    nanovdb::io::writeGrid(file.string(), nano, codec);
    expect_import(file);
  }
}

TEST_F(CancelImport, ADestroyedViewerCancelsItsLoadQuickly) {
  // Measured in CPU time of all threads and compared with a whole load of the same run, so that a busy machine does not
  // matter.
  const std::string file = write(openvdb::io::COMPRESS_ZIP, {grid_}).string();
  const auto loading = [&] {
    test::ViewerPtr viewer = test::make_viewer({});
    EXPECT_EQ(cumulet_load_volume(viewer.get(), file.c_str(), "density"), CUMULET_OK);
    return viewer;
  };
  const auto begun = std::chrono::steady_clock::now();
  const double before = processor_milliseconds();
  EXPECT_EQ(cumulet_wait(loading().get(), -1.0), CUMULET_OK);
  const double whole = processor_milliseconds() - before;
  const auto time = std::chrono::steady_clock::now() - begun;
  constexpr int moments = 12;
  std::vector<double> delays;
  for (int i = 0; i < moments; ++i) {
    test::ViewerPtr viewer = loading();
    std::this_thread::sleep_for(time * i / moments);
    auto work = test::make_desc<cumulet_progress>();
    cumulet_get_progress(viewer.get(), &work);
    const double asked = processor_milliseconds();
    viewer.reset();
    if (work.stage != CUMULET_STAGE_IDLE) delays.push_back(processor_milliseconds() - asked);
  }
  ASSERT_GE(delays.size(), moments / 4U);
  std::ranges::sort(delays);
  RecordProperty("milliseconds_of_a_load", std::to_string(whole));
  RecordProperty("longest_to_destroy", std::to_string(delays.back()));
#if !defined(__SANITIZE_ADDRESS__)  // AddressSanitizer slows deallocation more than reading
  EXPECT_LT(delays[delays.size() / 2], 0.1 * whole);
  EXPECT_LT(delays.back(), 0.25 * whole);
#endif
}

TEST(Cancel, Environments) {
  const test::Folder folder;
  const auto opens = [](const std::string& path) {
    return [path](Progress& progress) {
      progress.begin(Progress::Stage::loading);
      (void)light::open_environment(path, &progress);
    };
  };
  constexpr std::uint32_t width = 2048;
  const std::string radiance = (folder / "large.hdr").string();
  std::ofstream(radiance, std::ios::binary) << test::radiance_file(width, width / 2);
  expect_steady_progress(opens(radiance));
  expect_stops(opens(radiance));
  const std::string exr = (folder / "large.exr").string();
  image::Image picture{width, width / 2, {}};
  test::Random random(3);
  picture.rgba.reserve(std::size_t{width} * width * 2);
  for (std::size_t i = 0; i < std::size_t{width} * width * 2; ++i)
    picture.rgba.push_back(static_cast<float>(random() % 1000));
  image::write_exr(exr, picture);
  expect_steady_progress(opens(exr));
  expect_stops(opens(exr));
}

TEST(Cancel, Surfaces) {
  const std::vector<std::uint8_t> file = test::seed_tangents(320).glb();
  expect_cancels([&](Progress& progress) {
    progress.begin(Progress::Stage::loading);
    const auto scene = surface::import_gltf(file, "large", {}, {}, &progress);
    progress.at(0.99);
    const auto source =
        scene::make_model_source(scene, scene->pose(0.0, std::numeric_limits<std::size_t>::max()), &progress);
    progress.at(1.0);
  });
}

TEST(Cancel, Pictures) {
  const std::vector<std::uint8_t> file = test::seed_picture(2400).glb();
  expect_stops([&](Progress& progress) {
    const auto scene = surface::import_gltf(file, "picture", {}, {}, &progress);
    (void)scene::make_model_source(scene, scene->pose(0.0, 0, &progress), &progress);
  });
}

TEST(Cancel, DracoMeshes) {
  const std::vector<std::uint8_t> file = test::seed_draco(320).glb();
  expect_stops([&](Progress& progress) { (void)surface::import_gltf(file, "draco", {}, {}, &progress); });
}

TEST(Cancel, Poses) {
  const auto scene = surface::import_gltf(test::seed_tangents(100).glb(), "large", {}, {});
  Progress progress;
  EXPECT_EQ(scene->pose(0.0, 0, &progress).vertices.size(), scene->attributes.size());
  progress.cancel();
  EXPECT_THROW((void)scene->pose(0.0, 0, &progress), Error);
}

TEST(VolumeAsset, CallersThatAreNotCancelledGetTheStatistics) {
  const viewer::VolumeAsset asset(large_volume());
  double seconds = 0.0;
  expect_cancels([&](Progress& progress) {
    // A new asset for each run, because an asset caches its statistics.
    const viewer::VolumeAsset other(test::make_volume({64, 64, 64}, {0, 0, 0}, density));
    double s = 0.0;
    (void)other.density({}, progress, s).statistics;
    progress.begin(Progress::Stage::statistics);
    const grid::Statistics statistics(asset.volume(), grid::fit_cube(asset.volume()), &progress);
  });
  Progress cancelled;
  std::thread canceller([&] {
    while (cancelled.fraction() < 0.2) std::this_thread::yield();
    cancelled.cancel();
  });
  EXPECT_THROW((void)asset.density({}, cancelled, seconds).statistics, Error);
  canceller.join();
  EXPECT_EQ(seconds, 0.0);

  Progress next;
  const auto statistics = asset.density({}, next, seconds).statistics;
  EXPECT_GT(seconds, 0.0);
  EXPECT_DOUBLE_EQ(next.fraction(), 1.0);
  EXPECT_EQ(statistics->mean_optical_depth(), built().statistics.mean_optical_depth());
  EXPECT_EQ(asset.density({}, next, seconds).statistics, statistics);
  EXPECT_EQ(seconds, 0.0);
}

TEST(VolumeAsset, CallersWaitForEachOtherUnlessCancelled) {
  const viewer::VolumeAsset asset(large_volume());
  Progress first;
  std::thread computing([&] {
    double seconds = 0.0;
    (void)asset.density({}, first, seconds).statistics;
  });
  while (first.fraction() < 0.1) std::this_thread::yield();
  Progress second;
  second.cancel();
  double seconds = 0.0;
  EXPECT_THROW((void)asset.density({}, second, seconds).statistics, Error);
  EXPECT_LT(first.fraction(), 1.0);  // returned without waiting for the first
  Progress third;
  const auto statistics = asset.density({}, third, seconds).statistics;
  EXPECT_EQ(seconds, 0.0);  // waited for the first, computed nothing itself
  EXPECT_NE(statistics, nullptr);
  computing.join();
}

TEST(VolumeAsset, SecondCallerComputesIfTheFirstIsCancelled) {
  const viewer::VolumeAsset asset(large_volume());
  Progress first;
  std::thread computing([&] {
    double seconds = 0.0;
    EXPECT_THROW((void)asset.density({}, first, seconds).statistics, Error);
  });
  while (first.fraction() < 0.1) std::this_thread::yield();
  std::thread canceller([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    first.cancel();
  });
  Progress second;
  double seconds = 0.0;
  EXPECT_NE(asset.density({}, second, seconds).statistics, nullptr);
  canceller.join();
  computing.join();
}

}  // namespace
