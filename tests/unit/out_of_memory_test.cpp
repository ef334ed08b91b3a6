// Every GL allocation that fails leaves the viewer with what it showed before.
#include <gtest/gtest.h>

#include "support/counted_host.hpp"
#include "support/osmesa_leaks.hpp"

namespace {

using namespace cumulet::test;

/// A viewer that shows a is asked to show b while each GL allocation in turn fails.
class OutOfMemory : public testing::Test {
 protected:
  void SetUp() override {
    viewer_ = host_.viewer();
    picture_b_ = picture_of(viewer_.get(), b_.get(), host_.target);
    picture_a_ = picture_of(viewer_.get(), a_.get(), host_.target);
    ASSERT_NE(picture_a_, picture_b_);
  }

  /// Renders while the n-th allocation fails and returns the failures. refused_: whether there was an n-th allocation.
  std::vector<cumulet_status> failing(std::int64_t n, cumulet_viewer* viewer, const HostTarget& target) {
    const std::uint64_t before = host_.fake.allocations();
    host_.fake.fail_allocation(n);
    auto failures = render_all(viewer, target.frame());
    refused_ = host_.fake.allocations() > before + static_cast<std::uint64_t>(n);
    host_.fake.fail_allocation(-1);
    return failures;
  }

  Host host_;
  bool refused_ = false;
  VolumeRef a_ = make_ball(12);
  VolumeRef b_ = make_ball(16, 3.0F);
  ViewerPtr viewer_;
  Picture picture_a_;
  Picture picture_b_;
};

TEST_F(OutOfMemory, NewVolumeThatDoesNotFitKeepsTheOldOne) {
  int refusals = 0;
  for (std::int64_t n = 0;; ++n) {
    SCOPED_TRACE("allocation " + std::to_string(n));
    ASSERT_EQ(cumulet_set_volume(viewer_.get(), b_.get()), CUMULET_OK);
    const auto failures = failing(n, viewer_.get(), host_.target);
    if (!refused_) {
      EXPECT_TRUE(failures.empty());
      break;
    }
    ++refusals;
    SCOPED_TRACE(host_.fake.refused());
    ASSERT_EQ(failures, std::vector<cumulet_status>{CUMULET_ERROR_OUT_OF_MEMORY});
    // Failed transient objects prevented only one draw. The next frame draws a or b.
    cumulet_status status = CUMULET_OK;
    const Picture now = shown(host_, viewer_.get(), &status);
    ASSERT_EQ(status, CUMULET_OK);
    ASSERT_TRUE(now == picture_a_ || now == picture_b_);
    // With memory available, a changed setting triggers the retry.
    change_medium(viewer_.get(), 2.0);
    shown(host_, viewer_.get(), nullptr, 5.0);
    change_medium(viewer_.get(), 1.0);
    ASSERT_TRUE(converges(viewer_.get(), host_.target));
    ASSERT_EQ(difference(shown(host_, viewer_.get()), picture_b_), "");
    ASSERT_EQ(difference(picture_of(viewer_.get(), a_.get(), host_.target), picture_a_), "");
  }
  EXPECT_GT(refusals, 2);
}

// Previews and CUMULET_SURFACE_LIGHTING_RASTERIZED allocate textures of their own.
TEST_F(OutOfMemory, SurfacesThatDoNotFitKeepTheVolume) {
  const SurfacesRef panes = cumulet::test::make_panes(4.0F);
  for (const auto mode : {CUMULET_PREVIEW_OFF, CUMULET_PREVIEW_AUTO}) {
    preview(viewer_.get(), mode);
    for (const auto light : {CUMULET_SURFACE_LIGHTING_GLOBAL, CUMULET_SURFACE_LIGHTING_RASTERIZED}) {
      light_surfaces(viewer_.get(), light);
      ASSERT_EQ(cumulet_set_surfaces(viewer_.get(), panes.get()), CUMULET_OK);
      ASSERT_TRUE(converges(viewer_.get(), host_.target));
      const Picture with = host_.target.pixels();
      ASSERT_NE(with, picture_a_);
      int refusals = 0;
      for (std::int64_t n = 0;; ++n) {
        SCOPED_TRACE("light " + std::to_string(light) + ", allocation " + std::to_string(n));
        ASSERT_EQ(cumulet_set_surfaces(viewer_.get(), nullptr), CUMULET_OK);
        ASSERT_TRUE(converges(viewer_.get(), host_.target));
        ASSERT_EQ(difference(host_.target.pixels(), picture_a_), "");
        ASSERT_EQ(cumulet_set_surfaces(viewer_.get(), panes.get()), CUMULET_OK);
        const auto failures = failing(n, viewer_.get(), host_.target);
        if (!refused_) {
          EXPECT_TRUE(failures.empty());
          break;
        }
        ++refusals;
        SCOPED_TRACE(host_.fake.refused());
        ASSERT_FALSE(failures.empty());
        const bool shader = host_.fake.refused() == "CompileShader" || host_.fake.refused() == "LinkProgram";
        for (const cumulet_status failure : failures) {
          ASSERT_EQ(failure, shader ? CUMULET_ERROR_GL : CUMULET_ERROR_OUT_OF_MEMORY);
        }
        cumulet_status status = CUMULET_OK;
        shown(host_, viewer_.get(), &status);
        ASSERT_EQ(status, CUMULET_OK);
        // With memory available, a changed setting triggers the retry. So does another size, if only a coarser image
        // had fitted.
        change_medium(viewer_.get(), 2.0);
        cumulet_frame_desc smaller = host_.target.frame();
        smaller.viewport[2] = smaller.viewport[3] = host_side / 2;
        ASSERT_EQ(cumulet_render(viewer_.get(), &smaller, nullptr), CUMULET_OK);
        change_medium(viewer_.get(), 1.0);
        ASSERT_TRUE(converges(viewer_.get(), host_.target));
        ASSERT_EQ(difference(shown(host_, viewer_.get()), with), "");
      }
      EXPECT_GT(refusals, 2);
    }
  }
}

TEST_F(OutOfMemory, WithoutStorageTheOldVolumeStays) {
  // A voxel grid, because cells could fit into memory left by other volumes.
  auto dense = make_desc<cumulet_grid_desc>();
  dense.type = CUMULET_GRID_DENSE;
  const ViewerPtr other = host_.viewer();
  ASSERT_EQ(cumulet_set_grid(other.get(), &dense), CUMULET_OK);
  const Picture picture_dense = picture_of(other.get(), b_.get(), host_.target);
  ASSERT_NE(picture_dense, picture_a_);
  host_.fake.fail_storage(true);
  ASSERT_EQ(cumulet_set_volume(viewer_.get(), b_.get()), CUMULET_OK);
  ASSERT_EQ(cumulet_set_grid(viewer_.get(), &dense), CUMULET_OK);
  EXPECT_EQ(render_all(viewer_.get(), host_.target.frame()), std::vector<cumulet_status>{CUMULET_ERROR_OUT_OF_MEMORY});
  for (int i = 0; i < 5; ++i) {
    cumulet_status status = CUMULET_OK;
    EXPECT_EQ(difference(shown(host_, viewer_.get(), &status, 5.0), picture_a_), "");
    EXPECT_EQ(status, CUMULET_OK) << "reported again";
  }
  host_.fake.fail_storage(false);
  change_medium(viewer_.get(), 2.0);
  shown(host_, viewer_.get(), nullptr, 5.0);
  change_medium(viewer_.get(), 1.0);
  ASSERT_TRUE(converges(viewer_.get(), host_.target));
  EXPECT_EQ(difference(host_.target.pixels(), picture_dense), "");
}

TEST_F(OutOfMemory, VolumeThatFitsExistingBuffersAllocatesNothing) {
  host_.fake.fail_storage(true);
  ASSERT_EQ(cumulet_set_volume(viewer_.get(), b_.get()), CUMULET_OK);
  EXPECT_TRUE(render_all(viewer_.get(), host_.target.frame()).empty());
  EXPECT_EQ(difference(host_.target.pixels(), picture_b_), "");
}

TEST_F(OutOfMemory, ResizeThatDoesNotFitStillShowsTheImage) {
  const HostTarget larger(host_.fake.real(), 3 * host_side, 3 * host_side);
  for (const cumulet_frame_target kind : {CUMULET_TARGET_FRAMEBUFFER, CUMULET_TARGET_TEXTURE}) {
    cumulet_frame_desc small = host_.target.frame();
    cumulet_frame_desc large = larger.frame();
    small.target = large.target = kind;
    large.budget_ms = 1e4;  // begins with the finest picture; with previews, every coarser one is tried after it
    SCOPED_TRACE("target " + std::to_string(kind));
    preview(viewer_.get(), kind == CUMULET_TARGET_TEXTURE ? CUMULET_PREVIEW_AUTO : CUMULET_PREVIEW_OFF);
    converge(viewer_.get(), small);
    host_.fake.fail_storage(true);
    larger.clear(marker);
    host_.fake.real().Finish();  // llvmpipe composes in a later frame while work is queued
    EXPECT_EQ(render_all(viewer_.get(), large), std::vector<cumulet_status>{CUMULET_ERROR_OUT_OF_MEMORY});
    for (int i = 0; i < 3; ++i)
      EXPECT_EQ(cumulet_render(viewer_.get(), &large, nullptr), CUMULET_OK) << cumulet_last_error(viewer_.get());
    host_.fake.fail_storage(false);
    if (kind == CUMULET_TARGET_FRAMEBUFFER) {
      const Picture pixels = larger.pixels();
      int unseen = 0;
      for (std::size_t i = 0; i < pixels.size(); i += 4) unseen += pixels[i + 1] == 0 ? 1 : 0;
      EXPECT_EQ(unseen, 0) << "pixels that nothing was drawn to";
    }
    change_medium(viewer_.get(), 2.0);
    EXPECT_EQ(cumulet_render(viewer_.get(), &large, nullptr), CUMULET_OK);
    // Previews stay coarse until the size changes.
    EXPECT_EQ(converges(viewer_.get(), larger), kind == CUMULET_TARGET_FRAMEBUFFER);
    viewer_ = host_.viewer();
    picture_of(viewer_.get(), a_.get(), host_.target);
  }
}

TEST_F(OutOfMemory, FailsCleanlyFromTheFirstFrame) {
  int refusals = 0;
  for (std::int64_t n = 0;; ++n) {
    SCOPED_TRACE("allocation " + std::to_string(n));
    const ViewerPtr viewer = host_.viewer();
    ASSERT_EQ(cumulet_set_volume(viewer.get(), a_.get()), CUMULET_OK);
    const auto failures = failing(n, viewer.get(), host_.target);
    if (!refused_) {
      EXPECT_TRUE(failures.empty());
      break;
    }
    ++refusals;
    SCOPED_TRACE(host_.fake.refused());
    EXPECT_EQ(failures.size(), 1U);
    // A shader that does not build returns CUMULET_ERROR_GL.
    const bool shader = host_.fake.refused() == "CompileShader" || host_.fake.refused() == "LinkProgram";
    EXPECT_EQ(failures.empty() ? CUMULET_OK : failures[0], shader ? CUMULET_ERROR_GL : CUMULET_ERROR_OUT_OF_MEMORY);
    change_medium(viewer.get(), 2.0);
    shown(host_, viewer.get(), nullptr, 5.0);
    change_medium(viewer.get(), 1.0);
    host_.target.clear(marker);
    if (converges(viewer.get(), host_.target)) {
      EXPECT_EQ(difference(host_.target.pixels(), picture_a_), "");
    }
  }
  EXPECT_GT(refusals, 5);
}

TEST_F(OutOfMemory, FailedReadBackAffectsNothingElse) {
  std::vector<float> rgba(std::size_t{host_side} * host_side * 4);
  std::vector<std::uint8_t> bytes(rgba.size());
  auto pick = make_desc<cumulet_pick>();
  double noise = 0.0;
  const auto calls = {+[](cumulet_viewer* v, std::vector<float>& f, std::vector<std::uint8_t>&, cumulet_pick&,
                          double&) { return cumulet_read_linear(v, f.data(), f.size()); },
                      +[](cumulet_viewer* v, std::vector<float>&, std::vector<std::uint8_t>& b, cumulet_pick&,
                          double&) { return cumulet_read_display(v, b.data(), b.size()); },
                      +[](cumulet_viewer* v, std::vector<float>&, std::vector<std::uint8_t>&, cumulet_pick& p,
                          double&) { return cumulet_pick_at(v, 12.0, 12.0, &p); },
                      +[](cumulet_viewer* v, std::vector<float>&, std::vector<std::uint8_t>&, cumulet_pick&,
                          double& d) { return cumulet_measure_noise(v, &d); }};
  int index = 0;
  for (const auto call : calls) {
    for (std::int64_t n = 0;; ++n) {
      SCOPED_TRACE("call " + std::to_string(index) + ", allocation " + std::to_string(n));
      const std::uint64_t before = host_.fake.allocations();
      host_.fake.fail_allocation(n);
      const cumulet_status status = call(viewer_.get(), rgba, bytes, pick, noise);
      const bool refused = host_.fake.allocations() > before + static_cast<std::uint64_t>(n);
      host_.fake.fail_allocation(-1);
      SCOPED_TRACE(refused ? host_.fake.refused() : "none");
      if (!refused) {
        EXPECT_EQ(status, CUMULET_OK) << cumulet_last_error(viewer_.get());
        break;
      }
      ASSERT_NE(status, CUMULET_OK);
      ASSERT_EQ(difference(shown(host_, viewer_.get()), picture_a_), "");
      ASSERT_EQ(call(viewer_.get(), rgba, bytes, pick, noise), CUMULET_OK) << cumulet_last_error(viewer_.get());
      // The viewer may keep the objects that the call made, so start again with a new viewer.
      viewer_ = host_.viewer();
      ASSERT_EQ(difference(picture_of(viewer_.get(), a_.get(), host_.target), picture_a_), "");
    }
    ++index;
  }
}

}  // namespace
