// Limits of a viewer for threads, main memory and GL memory, and the behavior if they do not suffice.

#include <gtest/gtest.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "jobs/resource_limits.hpp"
#include "jobs/worker.hpp"
#include "support/c_host.hpp"
#include "support/simulated.hpp"

namespace {

using cumulet::Progress;
using cumulet::headless::Backend;
using cumulet::headless::Context;
using cumulet::test::converge;
using cumulet::test::difference;
using cumulet::test::HostTarget;
using cumulet::test::InstanceRef;
using cumulet::test::load_gl;
using cumulet::test::make_ball;
using cumulet::test::make_desc;
using cumulet::test::make_instance;
using cumulet::test::make_viewer;
using cumulet::test::picture_of;
using cumulet::test::ViewerPtr;
using cumulet::test::VolumeRef;
using cumulet::viewer::ResourceLimits;
using cumulet::viewer::Worker;

// Counts the maximum number of threads that are inside at the same time.
class Crowd {
 public:
  void visit() {
    const int now = ++inside_;
    int most = most_;
    while (now > most && !most_.compare_exchange_weak(most, now)) {
    }
    std::this_thread::sleep_for(std::chrono::microseconds(200));
    --inside_;
  }
  [[nodiscard]] int most() const { return most_; }

 private:
  std::atomic<int> inside_ = 0;
  std::atomic<int> most_ = 0;
};

// The limit applies to all workers of a viewer together, including the tasks of their jobs.
TEST(WorkerThreadLimit, LimitIsSharedByAllWorkers) {
  for (const unsigned threads : {1U, 2U, 3U}) {
    const auto resource_limits = std::make_shared<ResourceLimits>();
    resource_limits->set(threads, ResourceLimits::no_limit);
    Crowd crowd;
    std::atomic<int> visits = 0;
    std::vector<std::unique_ptr<Worker>> workers;
    for (int i = 0; i < 4; ++i) {
      workers.push_back(std::make_unique<Worker>([] {}, cumulet::Trace(), resource_limits));
      workers.back()->post({"crowding", Progress::Stage::refining, [&](Progress&) {
                              tbb::parallel_for(0, 40, [&](int) {
                                crowd.visit();
                                ++visits;
                              });
                            }});
    }
    for (const auto& worker : workers) EXPECT_TRUE(worker->wait(std::nullopt));
    EXPECT_EQ(visits, 160);
    EXPECT_LE(crowd.most(), static_cast<int>(threads));
  }
}

// A thread of a job that waits for its other tasks does not run another job, which might need a lock that it holds.
TEST(WorkerThreadLimit, JobsDoNotNest) {
  const auto resource_limits = std::make_shared<ResourceLimits>();
  resource_limits->set(1, ResourceLimits::no_limit);
  std::mutex mutex;
  std::vector<std::unique_ptr<Worker>> workers;
  for (int i = 0; i < 4; ++i) {
    workers.push_back(std::make_unique<Worker>([] {}, cumulet::Trace(), resource_limits));
    workers.back()->post({"holding", Progress::Stage::refining, [&](Progress&) {
                            const std::scoped_lock lock(mutex);
                            tbb::parallel_for(
                                0, 40, [&](int) { std::this_thread::sleep_for(std::chrono::microseconds(100)); });
                          }});
  }
  for (const auto& worker : workers)
    EXPECT_TRUE(worker->wait(std::chrono::steady_clock::now() + std::chrono::seconds(60)));
}

// The exception of a job is reported.
TEST(WorkerThreadLimit, ExceptionsReachTheJob) {
  const auto resource_limits = std::make_shared<ResourceLimits>();
  resource_limits->set(2, ResourceLimits::no_limit);
  Worker worker([] {}, cumulet::Trace(), resource_limits);
  worker.post({"failing", Progress::Stage::refining,
               [](Progress&) { throw cumulet::Error(cumulet::ErrorCode::file, "a.vdb: is empty"); }});
  EXPECT_TRUE(worker.wait(std::nullopt));
  ASSERT_TRUE(worker.status().failure);
  EXPECT_STREQ(worker.status().failure->what(), "a.vdb: is empty");
}

class Limits : public testing::Test {
 protected:
  [[nodiscard]] ViewerPtr make() {
    return make_viewer({.get_proc = Context::get_proc, .user = &context_, .samples = 2});
  }
  static void limit(const ViewerPtr& viewer, std::uint64_t memory, std::uint64_t gl = 0, std::uint32_t threads = 0) {
    auto desc = make_desc<cumulet_limits_desc>();
    desc.threads = threads;
    desc.memory_bytes = memory;
    desc.gl_bytes = gl;
    ASSERT_EQ(cumulet_set_limits(viewer.get(), &desc), CUMULET_OK);
  }
  static cumulet_stats stats_of(const ViewerPtr& viewer) {
    auto stats = make_desc<cumulet_stats>();
    EXPECT_EQ(cumulet_get_stats(viewer.get(), &stats), CUMULET_OK);
    return stats;
  }
  // Renders frames until nothing is in progress, and expects no error.
  cumulet_stats settle(const ViewerPtr& viewer) {
    auto whole = target_.frame();
    whole.target = CUMULET_TARGET_NONE;
    for (int i = 0; i < 4; ++i) {
      converge(viewer.get(), whole);
      EXPECT_EQ(cumulet_wait(viewer.get(), -1.0), CUMULET_OK);
    }
    return stats_of(viewer);
  }
  // Sets a limit that is too small by an eighth of the cells. Expects that the grid is rebuilt once and keeps more than
  // 1 / part of the cells. Returns the limit.
  std::uint64_t expect_cut(const ViewerPtr& viewer, const cumulet_stats& all, std::uint64_t part) {
    const std::uint64_t room = all.gl_bytes - all.cell_bytes / 8;
    limit(viewer, 0, room);
    const cumulet_stats cut = settle(viewer);
    EXPECT_LE(cut.gl_bytes, room);
    EXPECT_LT(cut.cells, all.cells);
    EXPECT_GT(cut.cells, all.cells / part);
    EXPECT_EQ(cut.limited, 1);
    EXPECT_EQ(settle(viewer).cells, cut.cells) << "once";
    return room;
  }

  Context context_ = Context::create(Backend::automatic);
  GladGLContext gl_ = load_gl(Context::get_proc, &context_);
  HostTarget target_{gl_, 32, 32};
};

TEST_F(Limits, InvalidLimitsGiveAOneLineError) {
  const ViewerPtr viewer = make();
  auto desc = make_desc<cumulet_limits_desc>();
  desc.threads = 1025;
  EXPECT_EQ(cumulet_set_limits(viewer.get(), &desc), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_STREQ(cumulet_last_error(viewer.get()), "cumulet_limits_desc.threads is above 1024");
  EXPECT_EQ(cumulet_set_limits(viewer.get(), nullptr), CUMULET_ERROR_INVALID_ARGUMENT);
}

// The image does not depend on the number of threads.
TEST_F(Limits, ThreadLimitDoesNotChangeTheImage) {
  const VolumeRef ball = make_ball(40);
  const ViewerPtr free = make();
  const auto wanted = picture_of(free.get(), ball.get(), target_);
  for (const std::uint32_t threads : {1U, 2U}) {
    const ViewerPtr viewer = make();
    limit(viewer, 0, 0, threads);
    EXPECT_EQ(difference(picture_of(viewer.get(), ball.get(), target_), wanted), "") << threads;
  }
}

// Grids are coarsened to fit. Volumes that do not fit at all are rejected, and the previous image stays.
TEST_F(Limits, MemoryLimitHolds) {
  const VolumeRef ball = make_ball(40);
  const ViewerPtr viewer = make();
  picture_of(viewer.get(), ball.get(), target_);
  const cumulet_stats all = stats_of(viewer);
  ASSERT_GT(all.cells, 2000U);
  ASSERT_EQ(all.limited, 0);
  ASSERT_GT(all.memory_bytes, all.cells * 32);

  const std::uint64_t some = all.memory_bytes - all.cells * 18;
  limit(viewer, some);
  EXPECT_EQ(stats_of(viewer).cells, all.cells);  // an existing grid is kept
  const auto coarse = picture_of(viewer.get(), ball.get(), target_);
  const cumulet_stats fewer = stats_of(viewer);
  EXPECT_LE(fewer.memory_bytes, some);
  EXPECT_GT(fewer.memory_bytes, some - some / 5);
  EXPECT_LT(fewer.cells, all.cells);
  EXPECT_EQ(fewer.limited, 1);

  const VolumeRef larger = make_ball(80);
  ASSERT_EQ(cumulet_set_volume(viewer.get(), larger.get()), CUMULET_OK);
  EXPECT_EQ(cumulet_wait(viewer.get(), -1.0), CUMULET_ERROR_OUT_OF_MEMORY);
  const std::string line = cumulet_last_error(viewer.get());
  EXPECT_EQ(line.rfind("ball takes ", 0), 0U) << line;
  EXPECT_NE(line.find(" bytes of memory; " + std::to_string(some) + " are allowed"), std::string::npos) << line;
  auto result = make_desc<cumulet_frame_result>();
  const auto frame = target_.frame();
  target_.clear({0.0F, 0.0F, 0.0F, 0.0F});
  ASSERT_EQ(cumulet_render(viewer.get(), &frame, &result), CUMULET_OK);
  EXPECT_NE(result.flags & CUMULET_RENDER_FAILED, 0U);
  EXPECT_EQ(difference(target_.pixels(), coarse), "");
  // With a larger limit, it is displayed.
  limit(viewer, 0);
  picture_of(viewer.get(), larger.get(), target_);
  EXPECT_EQ(stats_of(viewer).limited, 0);
}

// Voxel grid types cannot be coarsened.
TEST_F(Limits, MemoryLimitHoldsForVoxelGrids) {
  const VolumeRef ball = make_ball(40);
  for (const cumulet_interpolation interpolation : {CUMULET_INTERPOLATION_NEAREST, CUMULET_INTERPOLATION_LINEAR}) {
    const ViewerPtr viewer = make();
    auto grid = make_desc<cumulet_grid_desc>();
    grid.type = CUMULET_GRID_BRICKS;
    grid.interpolation = interpolation;
    ASSERT_EQ(cumulet_set_grid(viewer.get(), &grid), CUMULET_OK);
    picture_of(viewer.get(), ball.get(), target_);
    const std::uint64_t all = stats_of(viewer).memory_bytes;
    limit(viewer, all);
    ASSERT_EQ(cumulet_rebuild(viewer.get()), CUMULET_OK);
    EXPECT_EQ(cumulet_wait(viewer.get(), -1.0), CUMULET_OK);
    limit(viewer, all - 1);
    ASSERT_EQ(cumulet_rebuild(viewer.get()), CUMULET_OK);
    EXPECT_EQ(cumulet_wait(viewer.get(), -1.0), CUMULET_ERROR_OUT_OF_MEMORY);
  }
}

// Refines to the voxels: so many cells that a page of the heap is small in comparison.
void split_to_the_voxel(const ViewerPtr& viewer, cumulet_build_device build,
                        cumulet_cell_density cells = CUMULET_CELLS_LINEAR) {
  auto grid = make_desc<cumulet_grid_desc>();
  grid.cells = cells;
  if (cells == CUMULET_CELLS_TRILINEAR) grid.interpolation = CUMULET_INTERPOLATION_LINEAR;
  grid.threshold = -1.0;
  grid.build_device = build;
  ASSERT_EQ(cumulet_set_grid(viewer.get(), &grid), CUMULET_OK);
}

TEST_F(Limits, GpuMemoryLimitCoarsensCells) {
  std::vector<std::string> lines;
  const auto keep = [](void* user, cumulet_log_level /*level*/, const char* line) {
    static_cast<std::vector<std::string>*>(user)->emplace_back(line);
  };
  for (const cumulet_build_device build : {CUMULET_BUILD_CPU, CUMULET_BUILD_GPU}) {
    SCOPED_TRACE(build == CUMULET_BUILD_GPU ? "by GL" : "by the CPU");
    const ViewerPtr viewer =
        make_viewer({.get_proc = Context::get_proc, .user = &context_, .log = keep, .log_user = &lines, .samples = 1});
    split_to_the_voxel(viewer, build);
    const VolumeRef large = make_ball(56);
    picture_of(viewer.get(), large.get(), target_);
    const cumulet_stats all = stats_of(viewer);
    ASSERT_EQ(all.limited, 0);
    picture_of(viewer.get(), make_ball(8).get(), target_);
    const cumulet_stats before = stats_of(viewer);
    // The GPU build needs more memory than the cells.
    const std::uint64_t cells_bytes = build == CUMULET_BUILD_GPU ? 3 * all.cell_bytes : all.cell_bytes * 5 / 4;
    const std::uint64_t room = before.gl_bytes - before.cell_bytes + cells_bytes;
    limit(viewer, 0, room);
    picture_of(viewer.get(), large.get(), target_);
    const cumulet_stats cut = stats_of(viewer);
    EXPECT_EQ(cut.limited, 1);
    EXPECT_LE(cut.cell_bytes, all.cell_bytes * 3 / 4);
    EXPECT_GT(cut.cell_bytes, all.cell_bytes / 4);
    auto whole = target_.frame();
    whole.target = CUMULET_TARGET_NONE;
    for (int i = 0; i < 3; ++i) {
      ASSERT_EQ(cumulet_rebuild(viewer.get()), CUMULET_OK);
      EXPECT_EQ(cumulet_wait(viewer.get(), -1.0), CUMULET_OK);
      converge(viewer.get(), whole);
      EXPECT_EQ(stats_of(viewer).cells, cut.cells) << "however often";
      EXPECT_LE(stats_of(viewer).gl_bytes, room);
    }
    // With a larger limit, all cells are there.
    limit(viewer, 0, 0);
    picture_of(viewer.get(), large.get(), target_);
    EXPECT_EQ(stats_of(viewer).cells, all.cells);
  }
  for (const std::string& line : lines) EXPECT_EQ(line.find("on the CPU"), std::string::npos) << line;
}

// A smaller limit rebuilds existing grids automatically and without an error. A larger one refines them again.
TEST_F(Limits, CellCountFollowsTheGpuMemoryLimit) {
  const VolumeRef ball = make_ball(56);
  for (const cumulet_build_device build : {CUMULET_BUILD_CPU, CUMULET_BUILD_GPU}) {
    SCOPED_TRACE(build == CUMULET_BUILD_GPU ? "by GL" : "by the CPU");
    const ViewerPtr viewer = make_viewer({.get_proc = Context::get_proc, .user = &context_, .samples = 1});
    for (const cumulet_cell_density cells : {CUMULET_CELLS_LINEAR, CUMULET_CELLS_TRILINEAR}) {
      split_to_the_voxel(viewer, build, cells);
      picture_of(viewer.get(), ball.get(), target_);
      const cumulet_stats all = stats_of(viewer);
      ASSERT_EQ(all.limited, 0);
      const std::uint64_t bytes_per_cell = cells == CUMULET_CELLS_TRILINEAR ? 52 : 36;
      EXPECT_NEAR(static_cast<double>(all.cell_bytes), static_cast<double>(bytes_per_cell * all.cells), 512.0);
      expect_cut(viewer, all, 10);
      limit(viewer, 0, 0);
      EXPECT_EQ(settle(viewer).cells, all.cells);
    }
  }
}

// Each volume's grid gets its part of the limit, including volumes added later, and refines again.
TEST_F(Limits, InstancesShareTheGpuMemoryLimit) {
  const std::vector<VolumeRef> balls = [] {
    std::vector<VolumeRef> made;
    for (const int size : {24, 56, 48, 40}) made.push_back(make_ball(size));
    return made;
  }();
  for (const cumulet_build_device build : {CUMULET_BUILD_CPU, CUMULET_BUILD_GPU}) {
    SCOPED_TRACE(build == CUMULET_BUILD_GPU ? "by GL" : "by the CPU");
    const ViewerPtr viewer = make_viewer({.get_proc = Context::get_proc, .user = &context_, .samples = 1});
    split_to_the_voxel(viewer, build);
    std::vector<InstanceRef> instances;
    const auto add = [&](std::size_t ball) {
      auto desc = make_desc<cumulet_instance_desc>();
      desc.volume = balls[ball].get();
      instances.push_back(make_instance(desc));
      ASSERT_EQ(cumulet_add_instance(viewer.get(), instances.back().get()), CUMULET_OK);
    };
    picture_of(viewer.get(), balls[0].get(), target_);
    const cumulet_stats own = stats_of(viewer);
    add(1);
    add(2);
    const cumulet_stats all = settle(viewer);
    ASSERT_EQ(all.limited, 0);
    ASSERT_GT(all.cells, own.cells);
    // Existing grids shrink and make room for another volume.
    const std::uint64_t room = expect_cut(viewer, all, 12);
    add(3);
    const cumulet_stats more = settle(viewer);
    EXPECT_LE(more.gl_bytes, room);
    EXPECT_EQ(more.limited, 1);
    EXPECT_GE(more.cell_bytes, 32 * more.cells) << "all are in GL";
    // All volumes are displayed: without a limit each has its full grid.
    limit(viewer, 0, 0);
    const cumulet_stats free = settle(viewer);
    EXPECT_EQ(free.limited, 0);
    EXPECT_GT(free.cells, all.cells);
    for (const InstanceRef& instance : instances) cumulet_remove_instance(viewer.get(), instance.get());
    EXPECT_EQ(settle(viewer).cells, own.cells);
  }
}

// A limit also applies to the first grid if its build started before.
TEST_F(Limits, BuildInProgressFollowsTheGpuMemoryLimit) {
  const VolumeRef ball = make_ball(56);
  auto frame = target_.frame();
  frame.target = CUMULET_TARGET_NONE;
  const auto begin = [&] {
    ViewerPtr viewer = make_viewer({.get_proc = Context::get_proc, .user = &context_, .samples = 1});
    split_to_the_voxel(viewer, CUMULET_BUILD_CPU);
    EXPECT_EQ(cumulet_set_volume(viewer.get(), ball.get()), CUMULET_OK);
    return viewer;
  };
  const ViewerPtr free = begin();
  converge(free.get(), frame);
  const cumulet_stats all = stats_of(free);
  const std::uint64_t room = all.gl_bytes - all.cell_bytes / 8;
  const ViewerPtr viewer = begin();
  limit(viewer, 0, room);
  auto result = make_desc<cumulet_frame_result>();
  int refused = 0;  // the grid built before the limit may arrive first
  for (int i = 0; i < 100000 && (result.flags & CUMULET_RENDER_CONVERGED) == 0; ++i) {
    cumulet_wait(viewer.get(), 1.0);  // frames that draw nothing take almost no time
    if (cumulet_render(viewer.get(), &frame, &result) == CUMULET_ERROR_OUT_OF_MEMORY) ++refused;
    ASSERT_LE(refused, 1) << cumulet_last_error(viewer.get());
  }
  const cumulet_stats cut = stats_of(viewer);
  EXPECT_LE(cut.gl_bytes, room);
  EXPECT_LT(cut.cells, all.cells);
  EXPECT_GT(cut.cells, all.cells / 10);
}

// If the lattice of a GPU build would leave little memory for cells, the CPU builds the grid, which needs no lattice.
TEST_F(Limits, CpuBuildsWhenALatticeLeavesNoMemoryForCells) {
  const VolumeRef ball = make_ball(56);
  std::vector<std::string> lines;
  const auto keep = [](void* user, cumulet_log_level /*level*/, const char* line) {
    static_cast<std::vector<std::string>*>(user)->emplace_back(line);
  };
  const auto cells_under = [&](cumulet_build_device build, std::uint64_t room) {
    const ViewerPtr viewer =
        make_viewer({.get_proc = Context::get_proc, .user = &context_, .log = keep, .log_user = &lines, .samples = 1});
    split_to_the_voxel(viewer, build);
    limit(viewer, 0, room);
    picture_of(viewer.get(), ball.get(), target_);
    return stats_of(viewer);
  };
  const cumulet_stats all = cells_under(CUMULET_BUILD_CPU, 0);
  lines.clear();
  for (const std::uint64_t part : {2, 8, 32}) {
    SCOPED_TRACE(part);
    const std::uint64_t room = all.gl_bytes - all.cell_bytes + all.cell_bytes / part;
    const std::uint64_t by_cpu = cells_under(CUMULET_BUILD_CPU, room).cells;
    EXPECT_GT(by_cpu, 24U);
    EXPECT_GE(cells_under(CUMULET_BUILD_GPU, room).cells, by_cpu / 5);
  }
  EXPECT_TRUE(std::ranges::any_of(
      lines, [](const std::string& line) { return line.find("its grid is built on the CPU") != std::string::npos; }));
}

// Cells survive a limit that is lowered and raised again before a rebuild, and a limit in which no cells fit.
TEST_F(Limits, CellsSurviveATemporaryLimit) {
  const VolumeRef ball = make_ball(56);
  const ViewerPtr viewer = make_viewer({.get_proc = Context::get_proc, .user = &context_, .samples = 1});
  split_to_the_voxel(viewer, CUMULET_BUILD_CPU);
  picture_of(viewer.get(), ball.get(), target_);
  const cumulet_stats all = stats_of(viewer);
  auto whole = target_.frame();
  whole.target = CUMULET_TARGET_NONE;
  for (const double seconds : {0.0, 0.001, 0.01, -1.0}) {
    limit(viewer, 0, all.gl_bytes - all.cell_bytes / 8);
    cumulet_wait(viewer.get(), seconds);
    limit(viewer, 0, 0);
    converge(viewer.get(), whole);
    EXPECT_EQ(stats_of(viewer).cells, all.cells) << "raised after " << seconds << " s";
  }
  limit(viewer, 0, 1);
  converge(viewer.get(), whole);
  EXPECT_EQ(stats_of(viewer).cells, all.cells);
}

TEST_F(Limits, GpuMemoryLimitHolds) {
  const VolumeRef small = make_ball(12);
  const VolumeRef large = make_ball(96);
  const ViewerPtr viewer = make();
  auto grid = make_desc<cumulet_grid_desc>();
  grid.type = CUMULET_GRID_DENSE;  // memory in proportion to the voxels
  ASSERT_EQ(cumulet_set_grid(viewer.get(), &grid), CUMULET_OK);
  const auto before = picture_of(viewer.get(), small.get(), target_);
  const std::uint64_t room = stats_of(viewer).gl_bytes + 100'000;
  limit(viewer, 0, room);
  ASSERT_EQ(cumulet_set_volume(viewer.get(), large.get()), CUMULET_OK);
  ASSERT_EQ(cumulet_wait(viewer.get(), -1.0), CUMULET_OK);
  const auto frame = target_.frame();
  target_.clear({0.0F, 0.0F, 0.0F, 0.0F});
  EXPECT_EQ(cumulet_render(viewer.get(), &frame, nullptr), CUMULET_ERROR_OUT_OF_MEMORY);
  const std::string line = cumulet_last_error(viewer.get());
  EXPECT_EQ(line.rfind("uploading the volume needs ", 0), 0U) << line;
  // The error is returned once, and the previous image stays.
  target_.clear({0.0F, 0.0F, 0.0F, 0.0F});
  EXPECT_EQ(cumulet_render(viewer.get(), &frame, nullptr), CUMULET_OK);
  EXPECT_EQ(difference(target_.pixels(), before), "");
  EXPECT_LE(stats_of(viewer).gl_bytes, room);
  // With a larger limit, it is displayed.
  limit(viewer, 0, 0);
  auto whole = target_.frame();
  whole.target = CUMULET_TARGET_NONE;
  converge(viewer.get(), whole);
  EXPECT_GT(stats_of(viewer).gl_bytes, room);
}

}  // namespace
