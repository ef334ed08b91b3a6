// Error handling that hosts rely on: out of memory, context loss, bad files, extreme sizes and calls at any time.
#include <gtest/gtest.h>
#include <malloc.h>
#include <openvdb/tools/LevelSetSphere.h>
#include <openvdb/tools/LevelSetUtil.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <map>
#include <random>
#include <thread>

#include "support/c_host.hpp"
#include "support/fake_gl.hpp"
#include "support/folder.hpp"
#include "support/openvdb.hpp"
#include "support/osmesa_leaks.hpp"

namespace {

using cumulet::headless::Backend;
using cumulet::headless::Context;
using cumulet::test::converge;
using cumulet::test::difference;
using cumulet::test::FakeGl;
using cumulet::test::HostTarget;
using cumulet::test::make_ball;
using cumulet::test::make_desc;
using cumulet::test::make_viewer;
using cumulet::test::picture_of;
using cumulet::test::SurfacesRef;
using cumulet::test::ViewerPtr;
using cumulet::test::VolumeRef;
using Picture = std::vector<std::uint8_t>;

#if defined(__SANITIZE_ADDRESS__)
constexpr bool sanitized = true;
#else
constexpr bool sanitized = false;
#endif

constexpr int side = 24;

/// A context in which every GL call of the library is counted.
struct Host {
  Context context = Context::create(Backend::automatic);
  FakeGl fake{Context::get_proc, &context};
  HostTarget target{fake.real(), side, side};

  [[nodiscard]] ViewerPtr viewer(std::uint32_t samples = 1) {
    return make_viewer({.get_proc = FakeGl::get_proc, .user = &fake, .samples = samples});
  }
  [[nodiscard]] cumulet_status attach(cumulet_viewer* v) { return cumulet_attach(v, FakeGl::get_proc, &fake); }
};

/// A color that no image has, so that pixels that are not drawn are noticed.
constexpr std::array<float, 4> marker{1.0F, 0.0F, 1.0F, 1.0F};

/// The image that the next frame draws, whatever status it returns.
Picture shown(const Host& host, cumulet_viewer* viewer, cumulet_status* status = nullptr, double budget_ms = -1.0,
              std::uint32_t* flags = nullptr) {
  host.target.clear(marker);
  cumulet_frame_desc frame = host.target.frame();
  frame.budget_ms = budget_ms;
  auto result = make_desc<cumulet_frame_result>();
  const cumulet_status got = cumulet_render(viewer, &frame, &result);
  if (status != nullptr) *status = got;
  if (flags != nullptr) *flags = result.flags;
  return host.target.pixels();
}

void light_surfaces(cumulet_viewer* viewer, cumulet_surface_lighting light) {
  auto settings = make_desc<cumulet_surface_settings_desc>();
  settings.lighting = light;
  ASSERT_EQ(cumulet_set_surface_settings(viewer, &settings), CUMULET_OK);
}

void preview(cumulet_viewer* viewer, cumulet_preview preview) {
  auto sampling = make_desc<cumulet_sampling_desc>();
  sampling.samples = 1;
  sampling.preview = preview;
  ASSERT_EQ(cumulet_set_sampling(viewer, &sampling), CUMULET_OK);
}

void change_medium(cumulet_viewer* viewer, double density_scale) {
  auto medium = make_desc<cumulet_medium_desc>();
  medium.density_scale = density_scale;
  ASSERT_EQ(cumulet_set_medium(viewer, &medium), CUMULET_OK);
}

/// Renders until the image is converged, and some frames after a failure. Returns the failures. `frames` is the
/// maximum.
std::vector<cumulet_status> render_all(cumulet_viewer* viewer, const cumulet_frame_desc& frame, int frames = 400) {
  std::vector<cumulet_status> failures;
  auto result = make_desc<cumulet_frame_result>();
  cumulet_wait(viewer, -1.0);
  for (int i = 0; i < frames; ++i) {
    const cumulet_status status = cumulet_render(viewer, &frame, &result);
    if (status != CUMULET_OK) failures.push_back(status);
    if (status == CUMULET_ERROR_CONTEXT_LOST || status == CUMULET_ERROR_DETACHED) break;
    // After a failure, a few frames more, because it may be returned only once.
    if (!failures.empty() && i + 4 < frames) i = frames - 4;
    if (status == CUMULET_OK && failures.empty() && (result.flags & CUMULET_RENDER_CONVERGED) != 0) break;
  }
  return failures;
}

/// converge() as an assertion.
testing::AssertionResult converges(cumulet_viewer* viewer, const HostTarget& target) {
  try {
    converge(viewer, target.frame());
    return testing::AssertionSuccess();
  } catch (const std::exception& error) {
    return testing::AssertionFailure() << error.what();
  }
}

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

// ---- Out of memory ------------------------------------------------------------------------------------------------

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
        smaller.viewport[2] = smaller.viewport[3] = side / 2;
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
  const HostTarget larger(host_.fake.real(), 3 * side, 3 * side);
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
  std::vector<float> rgba(std::size_t{side} * side * 4);
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

// ---- Context lost -------------------------------------------------------------------------------------------------

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
  std::vector<float> rgba(std::size_t{side} * side * 4);
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
    std::ifstream whole(path("good.vdb"), std::ios::binary);
    std::string bytes((std::istreambuf_iterator<char>(whole)), {});
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
            frame.width = static_cast<std::uint32_t>(random() % (side + 1));
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
