// Several viewers: in two threads, two contexts, one context, and share groups. Their images must be bit-identical to
// those of a single viewer.
#include <gtest/gtest.h>

#include <algorithm>
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
using cumulet::test::ViewerPtr;
using cumulet::test::VolumeRef;
using Picture = std::vector<std::uint8_t>;

constexpr int side = 48;

ViewerPtr viewer_here() { return make_viewer({.get_proc = EglContext::get_proc}); }
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
