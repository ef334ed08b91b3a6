// Viewers of one share group hold one copy of a grid in GL memory.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "support/counted_host.hpp"
#include "support/osmesa_leaks.hpp"

namespace {

using namespace cumulet::test;

class SharedMarches : public testing::Test {
 protected:
  SharedMarches() {
    const auto desc = make_desc<cumulet_shader_cache_desc>();
    programs_ = made_by<ProgramsRef>(cumulet_shader_cache_create, desc);
  }
  void TearDown() override {
    EXPECT_EQ(host_.fake.wrong_deletes(), 0U);
    EXPECT_EQ(FakeGl::strays(), 0U);
  }
  // own: with shader programs of its own, so that it shares nothing.
  [[nodiscard]] ViewerPtr viewer(bool own = false) {
    ViewerPtr made = make_viewer(
        {.get_proc = FakeGl::get_proc, .user = &host_.fake, .samples = 1, .programs = own ? nullptr : programs_.get()});
    EXPECT_EQ(cumulet_set_volume(made.get(), volume_.get()), CUMULET_OK);
    set_threshold(made, 0.001);
    return made;
  }
  static void set_threshold(const ViewerPtr& of, double threshold, cumulet_grid_type type = CUMULET_GRID_TETRAHEDRAL,
                            cumulet_build_device build = CUMULET_BUILD_CPU) {
    auto grid = make_desc<cumulet_grid_desc>();
    grid.type = type;
    grid.threshold = threshold;
    grid.build_device = build;
    ASSERT_EQ(cumulet_set_grid(of.get(), &grid), CUMULET_OK);
  }
  static void limit(const ViewerPtr& of, std::uint64_t gl_bytes) {
    auto limits = make_desc<cumulet_limits_desc>();
    limits.gl_bytes = gl_bytes;
    ASSERT_EQ(cumulet_set_limits(of.get(), &limits), CUMULET_OK);
  }
  static void wait_for(const ViewerPtr& of) { ASSERT_EQ(cumulet_wait(of.get(), -1.0), CUMULET_OK); }
  [[nodiscard]] Picture picture(const ViewerPtr& of) { return drawn_once(of.get(), host_.target); }
  [[nodiscard]] static cumulet_stats stats(const ViewerPtr& of) {
    auto stats = make_desc<cumulet_stats>();
    EXPECT_EQ(cumulet_get_stats(of.get(), &stats), CUMULET_OK);
    return stats;
  }
  // One step of an upload.
  void step(const ViewerPtr& of) {
    auto frame = host_.target.frame();
    frame.target = CUMULET_TARGET_NONE;
    frame.budget_ms = 1e-6;
    ASSERT_EQ(cumulet_render(of.get(), &frame, nullptr), CUMULET_OK) << cumulet_last_error(of.get());
  }
  // Bytes that `work` uploads.
  template <class Work>
  [[nodiscard]] std::uint64_t uploaded_by(Work&& work) {
    const std::uint64_t before = host_.fake.uploaded();
    work();
    return host_.fake.uploaded() - before;
  }

  Host host_;
  ProgramsRef programs_;
  VolumeRef volume_ = make_ball(40);
};

TEST_F(SharedMarches, FourViewersHaveOneCopy) {
  const Picture alone = picture(viewer(true));
  for (const cumulet_grid_type type : {CUMULET_GRID_TETRAHEDRAL, CUMULET_GRID_BRICKS, CUMULET_GRID_DENSE}) {
    SCOPED_TRACE(type);
    std::array<ViewerPtr, 4> viewers;
    std::vector<Picture> pictures;
    std::vector<std::uint64_t> uploaded;
    std::vector<std::uint64_t> buffers;
    for (ViewerPtr& one : viewers) {
      one = viewer();
      set_threshold(one, 0.001, type);
      uploaded.push_back(uploaded_by([&] { pictures.push_back(picture(one)); }));
      buffers.push_back(host_.fake.buffer_bytes());
    }
    const cumulet_stats first = stats(viewers[0]);
    EXPECT_GE(uploaded[0], first.cell_bytes);
    // These are its films and parameters.
    const std::uint64_t buffers_of_one = buffers[0] - first.cell_bytes;
    for (std::size_t i = 1; i < viewers.size(); ++i) {
      const cumulet_stats other = stats(viewers[i]);
      EXPECT_EQ(difference(pictures[i], pictures[0]), "") << i;
      EXPECT_LT(uploaded[i], uploaded[0] - first.cell_bytes + 100'000) << i;
      EXPECT_EQ(other.cell_viewers, 4U);
      // Each viewer counts what it uses.
      EXPECT_EQ(other.cell_bytes, first.cell_bytes);
      EXPECT_EQ(other.cells, first.cells);
      EXPECT_GE(other.gl_bytes, first.cell_bytes);
      if (type != CUMULET_GRID_TETRAHEDRAL) continue;
      EXPECT_LE(buffers[i] - buffers[i - 1], buffers_of_one) << i;
    }
    if (type == CUMULET_GRID_TETRAHEDRAL) {
      EXPECT_GT(first.cell_bytes, 2'000'000U);
      EXPECT_EQ(difference(pictures[0], alone), "");
    }
  }
}

// A grid that one viewer built on the GPU.
TEST_F(SharedMarches, GridsBuiltOnTheGpuAreShared) {
  const ViewerPtr first = viewer();
  const ViewerPtr second = viewer();
  set_threshold(first, 0.001, CUMULET_GRID_TETRAHEDRAL, CUMULET_BUILD_GPU);
  set_threshold(second, 0.001, CUMULET_GRID_TETRAHEDRAL, CUMULET_BUILD_GPU);
  const Picture expected = picture(first);
  const std::uint64_t bytes = stats(first).cell_bytes;
  const std::uint64_t before = host_.fake.buffer_bytes();
  EXPECT_EQ(difference(picture(second), expected), "");
  EXPECT_LT(host_.fake.buffer_bytes() - before, bytes);
  EXPECT_EQ(stats(second).cell_viewers, 2U);
  EXPECT_EQ(stats(second).cells, stats(first).cells);
  EXPECT_EQ(stats(second).levels, stats(first).levels);
}

// Viewers end in each order and in each way, among others that draw.
TEST_F(SharedMarches, OutliveTheViewerThatUploadedThem) {
  const Picture expected = picture(viewer(true));
  std::array<std::size_t, 3> order{0, 1, 2};
  int way = 0;
  bool lost = false;
  do {
    SCOPED_TRACE(std::to_string(order[0]) + std::to_string(order[1]) + std::to_string(order[2]));
    std::array<ViewerPtr, 3> viewers{viewer(), viewer(), viewer()};
    for (const ViewerPtr& one : viewers) ASSERT_EQ(difference(picture(one), expected), "");
    for (std::size_t left = 3; left > 0; --left, ++way) {
      ViewerPtr& ends = viewers.at(order.at(3 - left));
      EXPECT_EQ(stats(ends).cell_viewers, left);
      if (way % 3 == 1) {
        ASSERT_EQ(cumulet_detach(ends.get()), CUMULET_OK);
      } else if (way % 3 == 2 && left > 1) {
        ASSERT_EQ(cumulet_context_lost(ends.get()), CUMULET_OK);
        lost = true;
      }
      ends.reset();
      for (std::size_t i = 4 - left; i < 3; ++i) {
        ViewerPtr& draws = viewers.at(order.at(i));
        change_medium(draws.get(), 0.5);
        static_cast<void>(picture(draws));
        change_medium(draws.get(), 1.0);  // another image of the same grid
        EXPECT_EQ(difference(picture(draws), expected), "");
      }
      if (left == 1) break;
      const ViewerPtr late = viewer();
      const std::uint64_t uploaded = uploaded_by([&] { EXPECT_EQ(difference(picture(late), expected), ""); });
      EXPECT_LT(uploaded, stats(late).cell_bytes);
    }
  } while (std::ranges::next_permutation(order).found);
  ASSERT_TRUE(lost);
}

TEST_F(SharedMarches, LastViewerDeletesThem) {
  {
    ViewerPtr first = viewer();
    const ViewerPtr second = viewer();
    const Picture expected = picture(first);
    EXPECT_EQ(difference(picture(second), expected), "");
    first.reset();
    const std::uint64_t bytes = host_.fake.buffer_bytes();
    EXPECT_GT(bytes, stats(second).cell_bytes);
    set_threshold(second, 0.5);
    static_cast<void>(picture(second));
    EXPECT_LT(host_.fake.buffer_bytes(), bytes - stats(second).cell_bytes);
  }
  EXPECT_TRUE(host_.fake.alive().empty()) << host_.fake.alive().begin()->first;
}

// All contexts are lost: nothing is deleted, also if the uploading viewer has been detached before.
TEST_F(SharedMarches, LossOfTheLastContextDeletesNothing) {
  const ViewerPtr first = viewer();
  const ViewerPtr second = viewer();
  const Picture expected = picture(first);
  EXPECT_EQ(difference(picture(second), expected), "");
  ASSERT_EQ(cumulet_detach(first.get()), CUMULET_OK);
  const std::uint64_t calls = host_.fake.calls();
  ASSERT_EQ(cumulet_context_lost(second.get()), CUMULET_OK);
  EXPECT_EQ(host_.fake.calls(), calls);
  {
    Host other;
    ASSERT_EQ(other.attach(second.get()), CUMULET_OK);
    EXPECT_EQ(difference(drawn_once(second.get(), other.target), expected), "");
    ASSERT_EQ(cumulet_detach(second.get()), CUMULET_OK);
    EXPECT_TRUE(other.fake.alive().empty());
  }
  host_.context.make_current();
  host_.fake.make_current();
}

// A viewer with other settings gets another grid. The shared one stays until its last viewer leaves it.
TEST_F(SharedMarches, OtherSettingsMakeAnotherGrid) {
  const ViewerPtr first = viewer();
  const ViewerPtr second = viewer();
  const Picture fine = picture(first);
  EXPECT_EQ(difference(picture(second), fine), "");
  set_threshold(second, 0.5);
  const Picture coarse = picture(second);
  EXPECT_NE(difference(coarse, fine), "");
  EXPECT_LT(stats(second).cells, stats(first).cells);
  EXPECT_EQ(stats(first).cell_viewers, 1U);
  EXPECT_EQ(stats(second).cell_viewers, 1U);
  change_medium(first.get(), 0.5);
  static_cast<void>(picture(first));
  change_medium(first.get(), 1.0);
  EXPECT_EQ(difference(picture(first), fine), "");
  set_threshold(first, 0.5);
  EXPECT_EQ(difference(picture(first), coarse), "");
  EXPECT_EQ(stats(first).cell_viewers, 2U);
  set_threshold(first, 0.001);
  EXPECT_EQ(difference(picture(first), fine), "");
  EXPECT_EQ(difference(picture(second), coarse), "");
}

// While one viewer uploads in steps, the other waits. If the first one renders no more frames, the other uploads.
TEST_F(SharedMarches, OneViewerUploads) {
  const ViewerPtr first = viewer();
  const ViewerPtr second = viewer();
  const Picture expected = picture(viewer(true));
  wait_for(first);
  wait_for(second);
  std::uint64_t by_second = 0;
  for (int i = 0; i < 4; ++i) {
    step(first);
    by_second += uploaded_by([&] { step(second); });
    EXPECT_EQ(stats(first).cell_bytes, 0U) << "the upload has too few steps for this test";
    EXPECT_EQ(stats(second).cell_bytes, 0U);
  }
  EXPECT_EQ(difference(picture(second), expected), "");
  const std::uint64_t by_first = uploaded_by([&] { EXPECT_EQ(difference(picture(first), expected), ""); });
  const ViewerPtr late = viewer();
  const std::uint64_t beside_cells = uploaded_by([&] { EXPECT_EQ(difference(picture(late), expected), ""); }) + 100'000;
  EXPECT_LT(by_second, beside_cells);
  EXPECT_LT(by_first, beside_cells);
  EXPECT_LT(beside_cells, stats(first).cell_bytes / 2);
  EXPECT_EQ(stats(first).cell_viewers, 3U);
}

TEST_F(SharedMarches, ViewerThatUploadsMayEnd) {
  const Picture expected = picture(viewer(true));
  for (const int way : {0, 1, 2}) {
    SCOPED_TRACE(way);
    ViewerPtr first = viewer();
    const ViewerPtr second = viewer();
    wait_for(first);
    wait_for(second);
    for (int i = 0; i < 3; ++i) {
      step(first);
      step(second);
    }
    if (way == 0) {
      ASSERT_EQ(cumulet_context_lost(first.get()), CUMULET_OK);
    } else if (way == 1) {
      ASSERT_EQ(cumulet_set_volume(first.get(), nullptr), CUMULET_OK);
      step(first);
    } else {
      first.reset();
    }
    // It does not wait.
    const auto three_steps = [&] {
      for (int i = 0; i < 3; ++i) step(second);
    };
    EXPECT_GT(uploaded_by(three_steps), 100'000U);
    EXPECT_EQ(difference(picture(second), expected), "");
  }
}

// A shared grid counts in full for each viewer, so that no result depends on other viewers.
TEST_F(SharedMarches, LimitsDoNotDependOnOthers) {
  const auto limited = [&](const ViewerPtr& of, std::uint64_t bytes) {
    limit(of, bytes);
    return picture(of);
  };
  const ViewerPtr first = viewer();
  static_cast<void>(picture(first));
  const std::uint64_t room = stats(first).gl_bytes - stats(first).cell_bytes / 2;
  const ViewerPtr alone = viewer(true);
  const Picture expected = limited(alone, room);
  const ViewerPtr second = viewer();
  EXPECT_EQ(difference(limited(second, room), expected), "");
  EXPECT_EQ(stats(second).cells, stats(alone).cells);
  EXPECT_LT(stats(second).cells, stats(first).cells);
  EXPECT_LE(stats(second).gl_bytes, room);
  // Voxels are refused, although they are there.
  set_threshold(first, 0.0, CUMULET_GRID_DENSE);
  static_cast<void>(picture(first));
  limit(second, stats(first).gl_bytes - stats(first).cell_bytes / 2);
  set_threshold(second, 0.0, CUMULET_GRID_DENSE);
  wait_for(second);
  const auto frame = host_.target.frame();
  EXPECT_EQ(cumulet_render(second.get(), &frame, nullptr), CUMULET_ERROR_OUT_OF_MEMORY);
  EXPECT_EQ(stats(first).cell_viewers, 1U);
}

// Lists of grids are shared as a whole.
TEST_F(SharedMarches, ScenesOfSeveralVolumesAreShared) {
  const VolumeRef other = make_ball(16, 1.0F);
  auto desc = make_desc<cumulet_instance_desc>();
  desc.volume = other.get();
  std::ranges::copy(at(9.0, 0.0, 0.0), desc.to_world);
  const InstanceRef instance = make_instance(desc);
  const ViewerPtr first = viewer();
  const ViewerPtr second = viewer();
  ASSERT_EQ(cumulet_add_instance(first.get(), instance.get()), CUMULET_OK);
  const Picture with = picture(first);
  EXPECT_NE(difference(picture(second), with), "");
  EXPECT_EQ(stats(second).cell_viewers, 1U);
  ASSERT_EQ(cumulet_add_instance(second.get(), instance.get()), CUMULET_OK);
  EXPECT_EQ(difference(picture(second), with), "");
  EXPECT_EQ(stats(second).cell_viewers, 2U);
  ASSERT_EQ(cumulet_remove_instance(first.get(), instance.get()), CUMULET_OK);
  static_cast<void>(picture(first));
  change_medium(second.get(), 0.5);
  static_cast<void>(picture(second));
  change_medium(second.get(), 1.0);
  EXPECT_EQ(difference(picture(second), with), "");
}

TEST_F(SharedMarches, ViewersWithoutACacheShareNothing) {
  const ViewerPtr first = viewer(true);
  const ViewerPtr second = viewer(true);
  EXPECT_EQ(difference(picture(second), picture(first)), "");
  EXPECT_EQ(stats(first).cell_viewers, 1U);
  EXPECT_EQ(stats(second).cell_viewers, 1U);
}

// An allocation that fails in one viewer leaves the shared grid whole.
TEST_F(SharedMarches, FailedUploadConcernsOneViewer) {
  const ViewerPtr first = viewer();
  const ViewerPtr second = viewer();
  const Picture expected = picture(viewer(true));
  wait_for(first);
  wait_for(second);
  host_.fake.fail_storage(true);
  const auto failures = render_all(first.get(), host_.target.frame(), 8);
  EXPECT_FALSE(failures.empty());
  host_.fake.fail_storage(false);
  EXPECT_EQ(difference(picture(second), expected), "");
  change_medium(first.get(), 0.5);  // tries again
  static_cast<void>(picture(first));
  change_medium(first.get(), 1.0);
  EXPECT_EQ(difference(picture(first), expected), "");
  EXPECT_EQ(stats(first).cell_viewers, 2U);
}

}  // namespace
