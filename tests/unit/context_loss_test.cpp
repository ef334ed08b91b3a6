// A context that is lost at any call is reported, and the image is restored in a new one.
#include <gtest/gtest.h>

#include "support/counted_host.hpp"
#include "support/osmesa_leaks.hpp"

namespace {

using namespace cumulet::test;

class ContextLossAt : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_EQ(cumulet_set_volume(viewer_.get(), volume_.get()), CUMULET_OK);
    measure();
  }
  void measure() {
    Host host;
    ASSERT_EQ(host.attach(viewer_.get()), CUMULET_OK);
    attach_calls_ = host.fake.calls();
    converge(viewer_.get(), host.target.frame());
    picture_ = host.target.pixels();
    calls_ = host.fake.calls();
    ASSERT_EQ(cumulet_detach(viewer_.get()), CUMULET_OK);
    ASSERT_TRUE(host.fake.alive().empty());
  }

  /// Loses the context at the n-th call. The image must then be restored in a new context.
  void lose(std::uint64_t n) {
    SCOPED_TRACE("lost at call " + std::to_string(n) + " of " + std::to_string(calls_));
    {
      Host host;
      host.fake.lose_context(static_cast<std::int64_t>(n));
      const cumulet_status attached = host.attach(viewer_.get());
      if (attached == CUMULET_OK) {
        auto failures = render_all(viewer_.get(), host.target.frame());
        // If the loss is in the last calls of a frame, the next frame returns it. The number of calls per image depends
        // on timing, so a later frame may be the one that loses it.
        for (int i = 0; i < 20 && failures.empty(); ++i) failures = render_all(viewer_.get(), host.target.frame());
        EXPECT_EQ(failures, std::vector<cumulet_status>{CUMULET_ERROR_CONTEXT_LOST});
        ASSERT_FALSE(failures.empty());
        ASSERT_EQ(failures.back(), CUMULET_ERROR_CONTEXT_LOST);
        EXPECT_NE(std::string(cumulet_last_error(viewer_.get())), "");
      } else {
        // A lost context may not report its version.
        ASSERT_TRUE(attached == CUMULET_ERROR_CONTEXT_LOST || attached == CUMULET_ERROR_UNSUPPORTED) << attached;
      }
      ASSERT_TRUE(host.fake.lost());
      // Detached: no GL calls any more.
      const std::uint64_t before = host.fake.calls();
      const cumulet_frame_desc frame = host.target.frame();
      ASSERT_EQ(cumulet_render(viewer_.get(), &frame, nullptr), CUMULET_ERROR_DETACHED);
      ASSERT_EQ(cumulet_detach(viewer_.get()), CUMULET_OK);
      ASSERT_EQ(host.fake.calls(), before);
    }
    Host host;
    ASSERT_EQ(host.attach(viewer_.get()), CUMULET_OK) << cumulet_last_error(viewer_.get());
    ASSERT_TRUE(converges(viewer_.get(), host.target));
    ASSERT_EQ(difference(host.target.pixels(), picture_), "");
    ASSERT_EQ(cumulet_detach(viewer_.get()), CUMULET_OK);
    ASSERT_TRUE(host.fake.alive().empty()) << host.fake.alive().begin()->first;
  }

  VolumeRef volume_ = make_ball(12);
  ViewerPtr viewer_ = make_viewer({.samples = 1});
  Picture picture_;
  std::uint64_t attach_calls_ = 0;
  std::uint64_t calls_ = 0;
};

TEST_F(ContextLossAt, AnyCallWhileRendering) {
  RecordProperty("calls", static_cast<int>(calls_));
  const std::uint64_t step = sanitized ? std::max<std::uint64_t>(1, calls_ / 25) : 1;
  for (std::uint64_t n = attach_calls_; n < calls_ && !HasFatalFailure(); n += step) lose(n);
}

TEST_F(ContextLossAt, AnyCallWithSurfaces) {
  const SurfacesRef panes = cumulet::test::make_panes(4.0F);
  ASSERT_EQ(cumulet_set_surfaces(viewer_.get(), panes.get()), CUMULET_OK);
  light_surfaces(viewer_.get(), CUMULET_SURFACE_LIGHTING_RASTERIZED);
  measure();
  const std::uint64_t step = std::max<std::uint64_t>(1, calls_ / (sanitized ? 10 : 100));
  for (std::uint64_t n = attach_calls_; n < calls_ && !HasFatalFailure(); n += step) lose(n);
}

TEST_F(ContextLossAt, AnyCallWhileAttaching) {
  const std::uint64_t step = std::max<std::uint64_t>(1, attach_calls_ / 40);
  for (std::uint64_t n = 0; n < attach_calls_ && !HasFatalFailure(); n += n < 10 ? 1 : step) lose(n);
}

TEST(ContextLoss, IsReportedByOtherCallsToo) {
  const VolumeRef volume = make_ball(12);
  std::vector<float> rgba(std::size_t{host_side} * host_side * 4);
  for (int which = 0; which < 4; ++which) {
    SCOPED_TRACE(which);
    Host host;
    const ViewerPtr viewer = host.viewer();
    const Picture picture = picture_of(viewer.get(), volume.get(), host.target);
    host.fake.lose_context(0);
    auto pick = make_desc<cumulet_pick>();
    double noise = 0.0;
    cumulet_status status = CUMULET_OK;
    if (which == 0) status = cumulet_read_linear(viewer.get(), rgba.data(), rgba.size());
    if (which == 1) status = cumulet_pick_at(viewer.get(), 5.0, 5.0, &pick);
    if (which == 2) status = cumulet_measure_noise(viewer.get(), &noise);
    if (which == 3) {
      EXPECT_EQ(cumulet_detach(viewer.get()), CUMULET_OK);  // already detached
    } else {
      EXPECT_EQ(status, CUMULET_ERROR_CONTEXT_LOST);
    }
    Host fresh;
    ASSERT_EQ(fresh.attach(viewer.get()), CUMULET_OK) << cumulet_last_error(viewer.get());
    converge(viewer.get(), fresh.target.frame());
    EXPECT_EQ(difference(fresh.target.pixels(), picture), "");
    EXPECT_EQ(cumulet_detach(viewer.get()), CUMULET_OK);
  }
}

TEST(ContextLoss, DestroyingWithoutAContextMakesNoGlCalls) {
  const VolumeRef volume = make_ball(12);
  for (const bool lost : {true, false}) {
    Host host;
    ViewerPtr viewer = host.viewer();
    picture_of(viewer.get(), volume.get(), host.target);
    EXPECT_FALSE(host.fake.alive().empty());
    ASSERT_EQ(lost ? cumulet_context_lost(viewer.get()) : cumulet_detach(viewer.get()), CUMULET_OK);
    EXPECT_EQ(host.fake.alive().empty(), !lost);
    const std::uint64_t calls = host.fake.calls();
    viewer.reset();
    EXPECT_EQ(host.fake.calls(), calls);
  }
  // Never attached.
  ViewerPtr viewer = make_viewer({});
  ASSERT_EQ(cumulet_set_volume(viewer.get(), volume.get()), CUMULET_OK);
  viewer.reset();
  EXPECT_EQ(FakeGl::strays(), 0U);
}

}  // namespace
