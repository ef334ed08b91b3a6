// Error handling that hosts rely on: leaks, bad files, extreme sizes and calls at any time. Out of memory and context
// loss: out_of_memory_test.cpp, context_loss_test.cpp.
#include <gtest/gtest.h>
#include <malloc.h>
#include <openvdb/tools/LevelSetSphere.h>
#include <openvdb/tools/LevelSetUtil.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <random>
#include <thread>

#include "support/counted_host.hpp"
#include "support/file_bytes.hpp"
#include "support/folder.hpp"
#include "support/openvdb.hpp"
#include "support/osmesa_leaks.hpp"

namespace {

using namespace cumulet::test;

std::size_t heap_bytes() { return mallinfo2().uordblks + mallinfo2().hblkhd; }

// ---- A thousand viewers -------------------------------------------------------------------------------------------

TEST(ResourceLeaks, ThousandViewersLeakNothing) {
  Host host;
  const int lives = sanitized ? 30 : 1000;
  const int stretch = lives / 10;
  std::vector<double> heap;  // after each group of viewers except the first
  Picture first;
  for (int life = 0; life < lives; ++life) {
    const VolumeRef volume = make_ball(12);
    {
      const ViewerPtr viewer = host.viewer();
      const Picture picture = picture_of(viewer.get(), volume.get(), host.target);
      if (life == 0) first = picture;
      ASSERT_EQ(difference(picture, first), "") << "life " << life;
    }
    ASSERT_TRUE(host.fake.alive().empty()) << host.fake.alive().begin()->first << " in life " << life;
    if (life > stretch && life % stretch == 0) heap.push_back(static_cast<double>(heap_bytes()));
  }
  EXPECT_GT(std::ranges::max(first), 60);
  EXPECT_EQ(host.fake.wrong_deletes(), 0U);
  EXPECT_EQ(FakeGl::strays(), 0U);
  if (!sanitized) {
    // A leak grows the heap in every group. Mesa's tables grow only in some groups, more on a busy machine. So the
    // lower quartile counts.
    std::vector<double> growth;
    for (std::size_t i = 1; i < heap.size(); ++i) growth.push_back((heap[i] - heap[i - 1]) / stretch);
    const std::size_t quarter = growth.size() / 4;
    std::ranges::nth_element(growth, growth.begin() + quarter);
    RecordProperty("heap_bytes_a_life", static_cast<int>(growth[quarter]));
    EXPECT_LT(growth[quarter], 512.0) << "bytes a life";
  }
}

TEST(ResourceLeaks, ChangingVolumesSizesAndSettingsLeaksNoObjects) {
  Host host;
  const VolumeRef a = make_ball(12);
  const VolumeRef b = make_ball(16);
  const ViewerPtr viewer = host.viewer();
  const auto round = [&](int i) {
    picture_of(viewer.get(), i % 2 == 0 ? a.get() : b.get(), host.target);
    auto grid = make_desc<cumulet_grid_desc>();
    grid.type = i % 3 == 0 ? CUMULET_GRID_TETRAHEDRAL : i % 3 == 1 ? CUMULET_GRID_DENSE : CUMULET_GRID_BRICKS;
    ASSERT_EQ(cumulet_set_grid(viewer.get(), &grid), CUMULET_OK);
    cumulet_frame_desc frame = host.target.frame();
    frame.width = static_cast<std::uint32_t>(8 + i % 5);
    frame.viewport[2] = frame.viewport[3] = 8;
    converge(viewer.get(), frame);
  };
  for (int i = 0; i < 30; ++i) round(i);
  const auto alive = host.fake.alive();
  for (int i = 30; i < (sanitized ? 60 : 180); ++i) round(i);
  EXPECT_EQ(host.fake.alive(), alive);
}

TEST(ResourceLeaks, SurfacesLeakNothing) {
  Host host;
  const SurfacesRef panes = cumulet::test::make_panes(4.0F);
  Picture first;
  for (int life = 0; life < (sanitized ? 4 : 24); ++life) {
    {
      const ViewerPtr viewer = host.viewer();
      preview(viewer.get(), life % 2 == 0 ? CUMULET_PREVIEW_AUTO : CUMULET_PREVIEW_OFF);
      const VolumeRef volume = make_ball(12);
      const Picture without = picture_of(viewer.get(), volume.get(), host.target);
      ASSERT_EQ(cumulet_set_surfaces(viewer.get(), panes.get()), CUMULET_OK);
      for (const auto light : {CUMULET_SURFACE_LIGHTING_RASTERIZED, CUMULET_SURFACE_LIGHTING_GLOBAL}) {
        light_surfaces(viewer.get(), light);
        ASSERT_TRUE(converges(viewer.get(), host.target));
      }
      const Picture with = host.target.pixels();
      ASSERT_NE(with, without);
      if (life == 0) first = with;
      ASSERT_EQ(difference(with, first), "") << "life " << life;
      ASSERT_EQ(cumulet_set_surfaces(viewer.get(), nullptr), CUMULET_OK);
      ASSERT_TRUE(converges(viewer.get(), host.target));
      ASSERT_EQ(difference(host.target.pixels(), without), "");
    }
    ASSERT_TRUE(host.fake.alive().empty()) << host.fake.alive().begin()->first << " in life " << life;
  }
  EXPECT_EQ(host.fake.wrong_deletes(), 0U);
}

// ---- Sizes --------------------------------------------------------------------------------------------------------

TEST(FrameSizes, AnySizeFrom0To16384PerFrame) {
  Host host;
  const ViewerPtr viewer = host.viewer();
  const VolumeRef volume = make_ball(12);
  const Picture picture = picture_of(viewer.get(), volume.get(), host.target);
  constexpr std::array<std::array<int, 2>, 10> sizes{
      {{48, 32}, {0, 48}, {48, 0}, {0, 0}, {1, 1}, {16384, 1}, {1, 16384}, {16384, 32}, {3, 5}, {700, 500}}};
  for (const cumulet_preview preview : {CUMULET_PREVIEW_OFF, CUMULET_PREVIEW_AUTO}) {
    auto sampling = make_desc<cumulet_sampling_desc>();
    sampling.samples = 1;
    sampling.preview = preview;
    ASSERT_EQ(cumulet_set_sampling(viewer.get(), &sampling), CUMULET_OK);
    for (const auto& [width, height] : sizes) {
      SCOPED_TRACE(std::to_string(width) + " x " + std::to_string(height));
      const HostTarget target(host.fake.real(), std::max(width, 1), std::max(height, 1));
      for (const cumulet_frame_target kind :
           {CUMULET_TARGET_FRAMEBUFFER, CUMULET_TARGET_TEXTURE, CUMULET_TARGET_NONE}) {
        cumulet_frame_desc frame = target.frame();
        frame.width = static_cast<std::uint32_t>(width);
        frame.height = static_cast<std::uint32_t>(height);
        frame.target = kind;
        frame.budget_ms = 1.0;
        auto result = make_desc<cumulet_frame_result>();
        ASSERT_EQ(cumulet_render(viewer.get(), &frame, &result), CUMULET_OK) << cumulet_last_error(viewer.get());
        if (width * height == 0) {
          EXPECT_EQ(result.texture, 0U);
        }
      }
    }
  }
  cumulet_frame_desc frame = host.target.frame();
  frame.width = 16385;
  EXPECT_EQ(cumulet_render(viewer.get(), &frame, nullptr), CUMULET_ERROR_INVALID_ARGUMENT);
  converge(viewer.get(), host.target.frame());
  preview(viewer.get(), CUMULET_PREVIEW_OFF);
  converge(viewer.get(), host.target.frame());
  EXPECT_EQ(difference(host.target.pixels(), picture), "");
}

// ---- Any time -----------------------------------------------------------------------------------------------------

class FileErrors : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    openvdb::initialize();
    folder_.emplace();
    auto grid = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(20.0F, openvdb::Vec3f(0.0F), 1.0F);
    openvdb::tools::sdfToFogVolume(*grid);
    grid->setName("density");
    openvdb::io::File file(path("good.vdb"));
    file.write({grid});
    file.close();
    const std::string bytes = cumulet::test::bytes_of(path("good.vdb"));
    std::ofstream(path("cut.vdb"), std::ios::binary) << bytes.substr(0, bytes.size() / 2);
    std::ofstream(path("empty.vdb"), std::ios::binary) << "";
    std::ofstream(path("noise.nvdb"), std::ios::binary) << std::string(5000, 'x');
  }
  static void TearDownTestSuite() { folder_.reset(); }
  static std::string path(const std::string& name) { return (*folder_ / name).string(); }

  static inline std::optional<cumulet::test::Folder> folder_;
};

TEST_F(FileErrors, InvalidFilesKeepTheDisplayedVolume) {
  Host host;
  const ViewerPtr viewer = host.viewer();
  const VolumeRef volume = make_ball(12);
  const Picture picture = picture_of(viewer.get(), volume.get(), host.target);
  for (const char* name : {"missing.vdb", "cut.vdb", "empty.vdb", "noise.nvdb"}) {
    SCOPED_TRACE(name);
    ASSERT_EQ(cumulet_load_volume(viewer.get(), path(name).c_str(), nullptr), CUMULET_OK);
    EXPECT_EQ(difference(shown(host, viewer.get()), picture), "");  // while it loads
    EXPECT_EQ(cumulet_wait(viewer.get(), -1.0), CUMULET_ERROR_FILE);
    EXPECT_NE(std::string(cumulet_last_error(viewer.get())).find(name), std::string::npos);
    std::uint32_t flags = 0;
    cumulet_status status = CUMULET_OK;
    EXPECT_EQ(difference(shown(host, viewer.get(), &status, 5.0, &flags), picture), "");
    EXPECT_EQ(status, CUMULET_OK);
    EXPECT_NE(flags & CUMULET_RENDER_FAILED, 0U);
    auto progress = make_desc<cumulet_progress>();
    EXPECT_EQ(cumulet_get_progress(viewer.get(), &progress), CUMULET_OK);
    EXPECT_EQ(progress.status, CUMULET_ERROR_FILE);
    EXPECT_EQ(std::string(progress.message).find('\n'), std::string::npos);
    std::array<double, 3> low{}, high{};
    EXPECT_EQ(cumulet_get_bounds(viewer.get(), low.data(), high.data()), CUMULET_OK);
    EXPECT_NEAR(high[0], 6.0, 1.0);
  }
  // A successful load clears the failure.
  ASSERT_EQ(cumulet_load_volume(viewer.get(), path("good.vdb").c_str(), nullptr), CUMULET_OK);
  EXPECT_EQ(converge(viewer.get(), host.target.frame()).flags & CUMULET_RENDER_FAILED, 0U);
  EXPECT_NE(host.target.pixels(), picture);
}

// Loads, sets, cancels, renders, resizes and destroys in a random order, while another thread queries and cancels.
TEST_F(FileErrors, RandomCallsFromTwoThreads) {
  const VolumeRef a = make_ball(12);
  const VolumeRef b = make_ball(40, 1.0F);
  Picture picture;
  {
    Host host;
    picture = picture_of(host.viewer().get(), a.get(), host.target);
  }
  for (std::uint32_t seed = 1; seed <= (sanitized ? 3U : 12U); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    Host host;
    for (int lives = 0; lives < 3; ++lives) {
      const ViewerPtr viewer = host.viewer();
      std::atomic<bool> over = false;
      std::thread bystander([&, bystander_seed = random()] {
        std::mt19937 its_random(static_cast<std::uint32_t>(bystander_seed));
        auto progress = make_desc<cumulet_progress>();
        while (!over) {
          if (its_random() % 4 == 0) cumulet_cancel(viewer.get());
          if (cumulet_get_progress(viewer.get(), &progress) != CUMULET_OK) std::abort();
          std::this_thread::sleep_for(std::chrono::microseconds(its_random() % 3000));
        }
      });
      for (int step = 0; step < 60; ++step) {
        cumulet_status status = CUMULET_OK;
        const unsigned action = static_cast<unsigned>(random() % 12);
        auto grid = make_desc<cumulet_grid_desc>();
        cumulet_frame_desc frame = host.target.frame();
        switch (action) {
          case 0:
            status = cumulet_load_volume(viewer.get(), path("good.vdb").c_str(), nullptr);
            break;
          case 1:
            status = cumulet_load_volume(viewer.get(), path(random() % 2 == 0 ? "cut.vdb" : "none.vdb").c_str(), "");
            break;
          case 2:
            status = cumulet_set_volume(viewer.get(), random() % 2 == 0 ? a.get() : b.get());
            break;
          case 3:
            status = cumulet_set_volume(viewer.get(), nullptr);
            break;
          case 4:
            cumulet_cancel(viewer.get());
            break;
          case 5:
            grid.threshold = 0.001 + 0.1 * double(random() % 10);
            grid.type = static_cast<cumulet_grid_type>(random() % 3);
            status = cumulet_set_grid(viewer.get(), &grid);
            break;
          case 6:
            (void)cumulet_wait(viewer.get(), double(random() % 5));
            break;
          case 7:
            (void)cumulet_rebuild(viewer.get());
            break;
          default:
            frame.budget_ms = double(random() % 4) - 1.0;
            frame.width = static_cast<std::uint32_t>(random() % (host_side + 1));
            status = cumulet_render(viewer.get(), &frame, nullptr);
        }
        ASSERT_EQ(status, CUMULET_OK) << "action " << action << ": " << cumulet_last_error(viewer.get());
      }
      over = true;
      bystander.join();
      if (lives < 2) continue;  // destroyed in any state
      auto grid = make_desc<cumulet_grid_desc>();
      ASSERT_EQ(cumulet_set_grid(viewer.get(), &grid), CUMULET_OK);
      ASSERT_EQ(cumulet_set_volume(viewer.get(), a.get()), CUMULET_OK);
      converge(viewer.get(), host.target.frame());
      EXPECT_EQ(difference(host.target.pixels(), picture), "");
    }
    EXPECT_TRUE(host.fake.alive().empty());
  }
  EXPECT_EQ(FakeGl::strays(), 0U);
}

// ---- Update callback ----------------------------------------------------------------------------------------------

struct Updates {
  std::atomic<int> count = 0;
  std::atomic<cumulet_viewer*> viewer = nullptr;
  std::atomic<int> refused = 0;
  std::atomic<int> accepted = 0;

  static void on_update(void* user) {
    auto* self = static_cast<Updates*>(user);
    ++self->count;
    cumulet_viewer* viewer = self->viewer;
    if (viewer == nullptr) return;
    auto medium = make_desc<cumulet_medium_desc>();
    auto frame = make_desc<cumulet_frame_desc>();
    for (const cumulet_status status :
         {cumulet_set_medium(viewer, &medium), cumulet_render(viewer, &frame, nullptr), cumulet_wait(viewer, 0.0),
          cumulet_set_volume(viewer, nullptr), cumulet_detach(viewer)}) {
      ++(status == CUMULET_ERROR_INVALID_ARGUMENT ? self->refused : self->accepted);
    }
  }
};

TEST(UpdateCallback, IsCoalescedAndNotReentrant) {
  Host host;
  const VolumeRef volume = make_ball(12);
  Updates updates;
  const ViewerPtr viewer = make_viewer({.get_proc = FakeGl::get_proc,
                                        .user = &host.fake,
                                        .update = Updates::on_update,
                                        .update_user = &updates,
                                        .samples = 1});
  picture_of(viewer.get(), volume.get(), host.target);
  const auto settle = [&] {
    converge(viewer.get(), host.target.frame());
    updates.count = 0;
  };
  settle();
  converge(viewer.get(), host.target.frame());
  EXPECT_EQ(updates.count, 0) << "nothing is new";

  updates.viewer = viewer.get();
  for (int i = 0; i < 5; ++i) change_medium(viewer.get(), 1.0 + 0.1 * i);
  EXPECT_EQ(updates.count, 1) << "one until the next frame";
  settle();
  EXPECT_EQ(updates.refused, 5);
  EXPECT_EQ(updates.accepted, 0);

  const auto light = make_desc<cumulet_sun_sky_desc>();
  const auto display = make_desc<cumulet_display_desc>();
  auto grid = make_desc<cumulet_grid_desc>();
  grid.threshold = 0.5;
  cumulet_camera* out = nullptr;
  ASSERT_EQ(cumulet_get_camera(viewer.get(), &out), CUMULET_OK);
  const cumulet::test::CameraRef camera(out);
  settle();
  EXPECT_EQ(cumulet_set_sun_sky(viewer.get(), &light), CUMULET_OK);
  EXPECT_EQ(updates.count, 1) << "light";
  settle();
  auto exposed = display;
  exposed.exposure_stops = 1.0F;
  EXPECT_EQ(cumulet_set_display(viewer.get(), &exposed), CUMULET_OK);
  EXPECT_EQ(updates.count, 1) << "display";
  settle();
  EXPECT_EQ(cumulet_camera_orbit(camera.get(), 0.1, 0.0), CUMULET_OK);
  EXPECT_EQ(updates.count, 1) << "camera";
  settle();
  // Called by the worker thread when the grid is ready. Calls from that callback are rejected too.
  updates.refused = 0;
  EXPECT_EQ(cumulet_set_grid(viewer.get(), &grid), CUMULET_OK);
  EXPECT_EQ(cumulet_wait(viewer.get(), -1.0), CUMULET_OK);
  EXPECT_GE(updates.count, 1);
  EXPECT_EQ(updates.accepted, 0);
  EXPECT_GE(updates.refused, 5);
  settle();
  // The volume is unchanged: none of those calls had an effect.
  cumulet_volume* shown_volume = nullptr;
  EXPECT_EQ(cumulet_get_volume(viewer.get(), &shown_volume), CUMULET_OK);
  EXPECT_NE(shown_volume, nullptr);
  cumulet_volume_release(shown_volume);
  updates.viewer = nullptr;
}

}  // namespace
