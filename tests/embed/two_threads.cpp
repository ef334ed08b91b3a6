// Several viewers: in two threads, two contexts, one context, and share groups. Their images must be bit-identical to
// those of a single viewer.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <thread>
#include <vector>

#include "support/c_host.hpp"
#include "support/egl_context.hpp"

namespace {

using cumulet::test::converge;
using cumulet::test::EglContext;
using cumulet::test::HostTarget;
using cumulet::test::make_ball;
using cumulet::test::make_viewer;
using cumulet::test::picture_of;
using cumulet::test::ProgramsRef;
using cumulet::test::ViewerPtr;
using cumulet::test::VolumeRef;
using Picture = std::vector<std::uint8_t>;

constexpr int side = 48;

ViewerPtr viewer_here(cumulet_shader_cache* programs = nullptr) {
  return make_viewer({.get_proc = EglContext::get_proc, .programs = programs});
}
ProgramsRef make_programs() {
  return cumulet::test::made_by<ProgramsRef>(cumulet_shader_cache_create,
                                             cumulet::test::make_desc<cumulet_shader_cache_desc>());
}
std::uint64_t cell_viewers(const ViewerPtr& viewer) {
  auto stats = cumulet::test::make_desc<cumulet_stats>();
  EXPECT_EQ(cumulet_get_stats(viewer.get(), &stats), CUMULET_OK);
  return stats.cell_viewers;
}
GladGLContext gl_here() { return cumulet::test::load_gl(EglContext::get_proc, nullptr); }

/// Creates, uses and destroys a viewer on this thread, in a context of its own.
Picture alone(cumulet_volume* volume) {
  const EglContext context;
  context.make_current();
  const GladGLContext gl = gl_here();
  const HostTarget target(gl, side, side);
  const ViewerPtr viewer = viewer_here();
  return picture_of(viewer.get(), volume, target);
}

class MultipleViewers : public testing::Test {
 protected:
  void SetUp() override {
    // A black image would equal any image that fails to draw.
    ASSERT_GT(std::ranges::max(lone_), 100);
    ASSERT_NE(lone_, lone_other_);
  }
  VolumeRef volume_ = make_ball(24);
  VolumeRef other_ = make_ball(16, 2.0F);
  Picture lone_ = alone(volume_.get());
  Picture lone_other_ = alone(other_.get());
};

TEST_F(MultipleViewers, TwoThreadsShareOneVolume) {
  for (int round = 0; round < 3; ++round) {
    std::vector<Picture> pictures(4);
    std::vector<std::thread> threads;
    for (std::size_t i = 0; i < pictures.size(); ++i)
      threads.emplace_back([&, i] { pictures[i] = alone(i % 2 == 0 ? volume_.get() : other_.get()); });
    for (std::thread& thread : threads) thread.join();
    for (std::size_t i = 0; i < pictures.size(); ++i) EXPECT_EQ(pictures[i], i % 2 == 0 ? lone_ : lone_other_) << i;
  }
}

TEST_F(MultipleViewers, TwoViewersInOneContextTakeTurns) {
  const EglContext context;
  context.make_current();
  const GladGLContext gl = gl_here();
  const HostTarget first(gl, side, side);
  const HostTarget second(gl, side, side);
  const ViewerPtr a = viewer_here();
  const ViewerPtr b = viewer_here();
  ASSERT_EQ(cumulet_set_volume(a.get(), volume_.get()), CUMULET_OK);
  ASSERT_EQ(cumulet_set_volume(b.get(), other_.get()), CUMULET_OK);
  ASSERT_EQ(cumulet_wait(a.get(), -1.0), CUMULET_OK);
  ASSERT_EQ(cumulet_wait(b.get(), -1.0), CUMULET_OK);
  cumulet_frame_desc to_first = first.frame();
  cumulet_frame_desc to_second = second.frame();
  to_first.budget_ms = to_second.budget_ms = 0.5;  // many small turns
  auto result = cumulet::test::make_desc<cumulet_frame_result>();
  for (unsigned flags = 0, frame = 0; (flags & CUMULET_RENDER_CONVERGED) == 0; ++frame) {
    ASSERT_LT(frame, 20000U);
    ASSERT_EQ(cumulet_render(a.get(), &to_first, &result), CUMULET_OK);
    flags = result.flags;
    ASSERT_EQ(cumulet_render(b.get(), &to_second, &result), CUMULET_OK);
    flags &= result.flags;
  }
  first.clear({});
  second.clear({});
  converge(a.get(), to_first);
  converge(b.get(), to_second);
  EXPECT_EQ(first.pixels(), lone_);
  EXPECT_EQ(second.pixels(), lone_other_);
}

TEST_F(MultipleViewers, MadeOnOneThreadRenderedOnAnother) {
  const EglContext context;
  ViewerPtr viewer;
  std::thread([&] {
    context.make_current();
    viewer = viewer_here();
    EXPECT_EQ(cumulet_set_volume(viewer.get(), volume_.get()), CUMULET_OK);
    context.release();
  }).join();
  Picture picture;
  std::thread([&] {
    context.make_current();
    const GladGLContext gl = gl_here();
    const HostTarget target(gl, side, side);
    converge(viewer.get(), target.frame());
    picture = target.pixels();
    context.release();
  }).join();
  EXPECT_EQ(picture, lone_);
  context.make_current();
  viewer.reset();
}

// Objects that are not shared between contexts (framebuffers, vertex arrays) must not outlive a call.
TEST_F(MultipleViewers, AttachedInOneContextRenderedInAnotherThatShares) {
  const EglContext a;
  const EglContext b(&a);
  a.make_current();
  const GladGLContext gl = gl_here();
  const ViewerPtr viewer = viewer_here();
  {
    const HostTarget target(gl, side, side);
    EXPECT_EQ(picture_of(viewer.get(), volume_.get(), target), lone_);
  }
  gl.Finish();  // makes changes in a visible in b
  b.make_current();
  {
    const HostTarget target(gl, side, side);
    converge(viewer.get(), target.frame());
    EXPECT_EQ(target.pixels(), lone_);
    // Renders again, so that everything is used in b.
    EXPECT_EQ(picture_of(viewer.get(), other_.get(), target), lone_other_);
  }
  gl.Finish();
  a.make_current();
  {
    const HostTarget target(gl, side, side);
    converge(viewer.get(), target.frame());
    EXPECT_EQ(target.pixels(), lone_other_);
    EXPECT_EQ(gl.GetError(), GLenum{GL_NO_ERROR});
  }
}

// With one shader cache, viewers in contexts that share objects have one copy of a grid in GL memory.
TEST_F(MultipleViewers, ContextsThatShareHaveOneCopyOfAGrid) {
  const ProgramsRef programs = make_programs();
  for (const bool lost : {false, true}) {
    SCOPED_TRACE(lost);
    const EglContext a;
    const EglContext b(&a);
    const EglContext apart;
    const auto draw = [&](const EglContext& context, const ViewerPtr& viewer) {
      context.make_current();
      const GladGLContext gl = gl_here();
      const HostTarget target(gl, side, side);
      Picture drawn = picture_of(viewer.get(), volume_.get(), target);
      EXPECT_EQ(gl.GetError(), GLenum{GL_NO_ERROR});
      return drawn;
    };
    const auto viewer_in = [&](const EglContext& context) {
      context.make_current();
      return viewer_here(programs.get());
    };
    ViewerPtr first = viewer_in(a);
    ViewerPtr second = viewer_in(b);
    ViewerPtr third = viewer_in(apart);
    EXPECT_EQ(draw(a, first), lone_);
    EXPECT_EQ(draw(b, second), lone_);
    EXPECT_EQ(draw(apart, third), lone_);
    EXPECT_EQ(cell_viewers(first), 2U);
    EXPECT_EQ(cell_viewers(second), 2U);
    EXPECT_EQ(cell_viewers(third), 1U);
    // The grid outlives the viewer that uploaded it.
    if (lost) {
      ASSERT_EQ(cumulet_context_lost(first.get()), CUMULET_OK);
    } else {
      a.make_current();
    }
    first.reset();
    EXPECT_EQ(cell_viewers(second), 1U);
    b.make_current();
    ASSERT_EQ(cumulet_set_volume(second.get(), other_.get()), CUMULET_OK);
    const ViewerPtr fourth = viewer_in(b);
    EXPECT_EQ(draw(b, second), lone_);
    EXPECT_EQ(draw(b, fourth), lone_);
    EXPECT_EQ(cell_viewers(second), 2U);
    second.reset();
    EXPECT_EQ(draw(b, fourth), lone_);
    EXPECT_EQ(draw(apart, third), lone_);
    apart.make_current();
    third.reset();
    b.make_current();
  }
}

// Viewers on several threads, each in its own context of the share group, take grids from each other and end at any
// time.
TEST_F(MultipleViewers, ThreadsOfOneShareGroupShareGrids) {
  const ProgramsRef programs = make_programs();
  const EglContext base;
  constexpr std::size_t threads = 3;
  std::vector<std::unique_ptr<EglContext>> contexts;
  for (std::size_t i = 0; i < threads; ++i) contexts.push_back(std::make_unique<EglContext>(&base));
  std::atomic<int> shared = 0;
  const auto work = [&](std::size_t index) {
    contexts[index]->make_current();
    {
      const GladGLContext gl = gl_here();
      const HostTarget target(gl, side, side);
      ViewerPtr viewer = viewer_here(programs.get());
      for (std::size_t round = 0; round < 12; ++round) {
        const bool plain = (round + index) % 3 != 0;
        const Picture drawn = picture_of(viewer.get(), plain ? volume_.get() : other_.get(), target);
        EXPECT_EQ(drawn, plain ? lone_ : lone_other_) << index << ' ' << round;
        if (cell_viewers(viewer) > 1) ++shared;
        if (round % 4 == 3) {
          if (round % 8 == 3) {
            EXPECT_EQ(cumulet_context_lost(viewer.get()), CUMULET_OK);
          }
          viewer.reset();
          viewer = viewer_here(programs.get());
        }
      }
      EXPECT_EQ(gl.GetError(), GLenum{GL_NO_ERROR});
    }
    contexts[index]->release();
  };
  std::vector<std::thread> running;
  for (std::size_t i = 0; i < threads; ++i) running.emplace_back(work, i);
  for (std::thread& thread : running) thread.join();
  EXPECT_GT(shared, 0);
}

TEST_F(MultipleViewers, OneCameraControlsTwoViewers) {
  const EglContext context;
  context.make_current();
  const GladGLContext gl = gl_here();
  const HostTarget first(gl, side, side);
  const HostTarget second(gl, side, side);
  const ViewerPtr a = viewer_here();
  const ViewerPtr b = viewer_here();
  cumulet_camera* out = nullptr;
  ASSERT_EQ(cumulet_get_camera(a.get(), &out), CUMULET_OK);
  const cumulet::test::CameraRef camera(out);
  ASSERT_EQ(cumulet_set_camera(b.get(), camera.get()), CUMULET_OK);
  EXPECT_EQ(picture_of(a.get(), volume_.get(), first), picture_of(b.get(), volume_.get(), second));
  ASSERT_EQ(cumulet_camera_orbit(camera.get(), 1.0, 0.3), CUMULET_OK);
  first.clear({});
  second.clear({});
  converge(a.get(), first.frame());
  converge(b.get(), second.frame());
  EXPECT_EQ(first.pixels(), second.pixels());
  EXPECT_NE(first.pixels(), lone_);
}

}  // namespace
