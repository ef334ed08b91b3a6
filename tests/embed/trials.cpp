// Demanding hosts: volumes and surfaces that change faster than they are built, and calls without a context.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <set>
#include <thread>
#include <vector>

#include "support/c_host.hpp"
#include "support/egl_context.hpp"
#include "support/slow_builds.hpp"

namespace {

using namespace std::chrono_literals;
using cumulet::test::converge;
using cumulet::test::EglContext;
using cumulet::test::HostTarget;
using cumulet::test::make_ball;
using cumulet::test::make_cloth;
using cumulet::test::make_desc;
using cumulet::test::make_viewer;
using cumulet::test::patience;
using cumulet::test::picture_of;
using cumulet::test::slow_grid;
using cumulet::test::SurfacesRef;
using cumulet::test::ViewerPtr;
using cumulet::test::VolumeRef;
using Clock = std::chrono::steady_clock;

constexpr int side = 16;

class RapidChanges : public testing::Test {
 protected:
  RapidChanges() : gl_((context_.make_current(), cumulet::test::load_gl(EglContext::get_proc, nullptr))) {}

  [[nodiscard]] cumulet_stats stats() const {
    auto stats = make_desc<cumulet_stats>();
    EXPECT_EQ(cumulet_get_stats(v_, &stats), CUMULET_OK) << cumulet_last_error(v_);
    return stats;
  }
  void render(double budget_ms = 10.0) const {
    auto frame = target_.frame();
    frame.budget_ms = budget_ms;
    ASSERT_EQ(cumulet_render(v_, &frame, nullptr), CUMULET_OK) << cumulet_last_error(v_);
  }
  /// Makes a request every few milliseconds until this number of different answers was seen. Returns the number.
  template <class Request, class Answer>
  std::size_t stream(std::chrono::milliseconds pause, std::size_t enough, Request&& request, Answer&& answer) const {
    std::set<double> seen;
    const auto until = Clock::now() + patience;
    for (int i = 0; seen.size() < enough && Clock::now() < until; ++i) {
      request(i);
      render();
      if (const double value = answer(); value != 0.0) seen.insert(value);
      std::this_thread::sleep_for(pause);
    }
    return seen.size();
  }

  EglContext context_;
  GladGLContext gl_;
  HostTarget target_{gl_, side, side};
  ViewerPtr viewer_ = make_viewer({.get_proc = EglContext::get_proc, .samples = 1});
  cumulet_viewer* v_ = viewer_.get();
};

// ---- streams ----

TEST_F(RapidChanges, VolumesChangedFasterThanBuildsAreShown) {
  const cumulet_grid_desc grid = slow_grid();
  ASSERT_EQ(cumulet_set_grid(v_, &grid), CUMULET_OK);
  std::vector<VolumeRef> volumes;
  for (int i = 0; i < 8; ++i) volumes.push_back(make_ball(32 + 2 * i));
  // The GL memory identifies the displayed volume.
  EXPECT_GE(stream(
                10ms, 3,
                [&](int i) {
                  ASSERT_EQ(cumulet_set_volume(v_, volumes[static_cast<std::size_t>(i) % volumes.size()].get()),
                            CUMULET_OK);
                },
                [&] { return static_cast<double>(stats().cell_bytes); }),
            3U);
  // The newest volume is displayed in the end.
  ASSERT_EQ(cumulet_set_volume(v_, volumes[1].get()), CUMULET_OK);
  converge(v_, target_.frame());
  const std::uint64_t last = stats().cell_bytes;
  picture_of(v_, volumes[1].get(), target_);
  EXPECT_EQ(stats().cell_bytes, last);
}

TEST_F(RapidChanges, ThresholdChangedFasterThanBuildsIsShown) {
  const VolumeRef volume = make_ball(40);
  ASSERT_EQ(cumulet_set_volume(v_, volume.get()), CUMULET_OK);
  EXPECT_GE(stream(
                10ms, 3,
                [&](int i) {
                  cumulet_grid_desc grid = slow_grid();
                  grid.max_cells = 50000 + 4000 * static_cast<std::uint64_t>(i % 16);
                  ASSERT_EQ(cumulet_set_grid(v_, &grid), CUMULET_OK);
                },
                [&] { return static_cast<double>(stats().cell_bytes); }),
            3U);
}

// A grid that is built within one frame, but takes many frames to upload.
TEST_F(RapidChanges, VolumesChangedFasterThanUploadsAreShown) {
  const cumulet_grid_desc grid = slow_grid();
  ASSERT_EQ(cumulet_set_grid(v_, &grid), CUMULET_OK);
  const std::vector<VolumeRef> volumes = [] {
    std::vector<VolumeRef> made;
    for (int i = 0; i < 2; ++i) made.push_back(make_ball(56 + 2 * i));
    return made;
  }();
  std::uint64_t frames = 0;
  for (; frames < 60 && stats().cell_bytes == 0; ++frames) {
    ASSERT_EQ(cumulet_set_volume(v_, volumes[frames % 2].get()), CUMULET_OK);
    ASSERT_EQ(cumulet_wait(v_, -1.0), CUMULET_OK);
    render(0.0001);
  }
  EXPECT_GT(frames, 3U) << "an upload of one frame proves nothing";
  EXPECT_GT(stats().cell_bytes, 0U);
}

TEST_F(RapidChanges, SurfacesChangedFasterThanPosesAreShown) {
  std::vector<SurfacesRef> cloths;
  for (int i = 0; i < 8; ++i) cloths.push_back(make_cloth(120, 1.0F + static_cast<float>(i)));
  const auto width = [&] {
    std::array<double, 3> low{}, high{};
    return cumulet_get_bounds(v_, low.data(), high.data()) == CUMULET_OK ? std::round(high[0] - low[0]) : 0.0;
  };
  EXPECT_GE(stream(
                2ms, 3,
                [&](int i) {
                  cumulet_surfaces* cloth = cloths[static_cast<std::size_t>(i) % cloths.size()].get();
                  ASSERT_EQ(cumulet_set_surfaces(v_, cloth), CUMULET_OK);
                  // The surfaces set last, even if others are still displayed.
                  cumulet_surfaces* out = nullptr;
                  ASSERT_EQ(cumulet_get_surfaces(v_, &out), CUMULET_OK);
                  EXPECT_EQ(out, cloth);
                  cumulet_surfaces_release(out);
                },
                width),
            3U);
}

// ---- without a context ----

class NoContext : public RapidChanges {
 protected:
  NoContext() { first_ = picture_of(v_, volume_.get(), target_); }

  /// Each [GL] call fails, each time.
  void expect_refused() {
    auto frame = target_.frame();
    frame.target = CUMULET_TARGET_NONE;
    auto pick = make_desc<cumulet_pick>();
    const auto map_desc = make_desc<cumulet_transmittance_map_desc>();
    auto map = make_desc<cumulet_transmittance_map>();
    std::vector<float> rgba(std::size_t{side} * side * 4);
    std::vector<std::uint8_t> bytes(rgba.size());
    double noise = 0.0;
    auto denoise = make_desc<cumulet_denoise_desc>();
    denoise.network = "none.tza";
    const auto object_name = [](void*, cumulet_object_kind, std::uint64_t, std::uint32_t) { return "object"; };
    for (int round = 0; round < 2; ++round) {
      for (const auto& call : std::vector<std::function<cumulet_status()>>{
               [&] { return cumulet_render(v_, &frame, nullptr); },
               [&] { return cumulet_pick_at(v_, 1.0, 1.0, &pick); },
               [&] { return cumulet_update_transmittance_map(v_, &map_desc, &map); },
               [&] { return cumulet_destroy_transmittance_map(v_, 0); },
               [&] { return cumulet_read_linear(v_, rgba.data(), rgba.size()); },
               [&] { return cumulet_read_display(v_, bytes.data(), bytes.size()); },
               [&] { return cumulet_read_aov(v_, CUMULET_AOV_NORMAL, rgba.data(), rgba.size()); },
               [&] { return cumulet_read_cryptomatte(v_, object_name, nullptr, 1, rgba.data(), rgba.size()); },
               [&] { return cumulet_read_denoised(v_, &denoise, rgba.data(), rgba.size()); },
               [&] { return cumulet_measure_noise(v_, &noise); },
               [&] {
                 std::size_t room = bytes.size();
                 return cumulet_read_accumulation(v_, bytes.data(), &room);
               },
               [&] { return cumulet_restore_accumulation(v_, bytes.data(), bytes.size()); },
               [&] { return cumulet_detach(v_); }}) {
        EXPECT_EQ(call(), CUMULET_ERROR_GL);
        const std::string line = cumulet_last_error(v_);
        EXPECT_NE(line.find("no OpenGL context is current"), std::string::npos) << line;
      }
    }
  }
  void expect_healed() {
    target_.clear({});
    converge(v_, target_.frame());
    EXPECT_EQ(cumulet::test::difference(target_.pixels(), first_), "");
    EXPECT_EQ(cumulet::test::difference(picture_of(v_, volume_.get(), target_), first_), "");
    EXPECT_EQ(gl_.GetError(), GLenum{GL_NO_ERROR});
  }

  VolumeRef volume_ = make_ball(16);
  std::vector<std::uint8_t> first_;
};

TEST_F(NoContext, EachCallFailsAndRecoversWithTheContext) {
  for (int i = 0; i < 2; ++i) {
    context_.release();
    expect_refused();
    context_.make_current();
    expect_healed();
  }
}

TEST_F(NoContext, FirstFrameMayLackTheContext) {
  const ViewerPtr viewer = make_viewer({.get_proc = EglContext::get_proc});
  ASSERT_EQ(cumulet_set_volume(viewer.get(), volume_.get()), CUMULET_OK);
  ASSERT_EQ(cumulet_wait(viewer.get(), -1.0), CUMULET_OK);
  const auto frame = target_.frame();
  context_.release();
  EXPECT_EQ(cumulet_render(viewer.get(), &frame, nullptr), CUMULET_ERROR_GL);
  context_.make_current();
  target_.clear({});
  converge(viewer.get(), frame);
  EXPECT_GT(std::ranges::max(target_.pixels()), 100);
}

TEST_F(NoContext, UnrelatedContextIsRejected) {
  const EglContext stranger;
  stranger.make_current();
  // Objects of the other context with the same names as the viewer's.
  std::vector<GLuint> textures(64), buffers(64);
  gl_.CreateTextures(GL_TEXTURE_2D, 64, textures.data());
  gl_.CreateBuffers(64, buffers.data());
  expect_refused();
  for (const GLuint texture : textures) EXPECT_EQ(gl_.IsTexture(texture), GL_TRUE) << texture;
  for (const GLuint buffer : buffers) EXPECT_EQ(gl_.IsBuffer(buffer), GL_TRUE) << buffer;
  context_.make_current();
  expect_healed();
  // Destroying the viewer in the wrong context deletes nothing there.
  stranger.make_current();
  viewer_.reset();
  for (const GLuint texture : textures) EXPECT_EQ(gl_.IsTexture(texture), GL_TRUE) << texture;
  for (const GLuint buffer : buffers) EXPECT_EQ(gl_.IsBuffer(buffer), GL_TRUE) << buffer;
  EXPECT_EQ(gl_.GetError(), GLenum{GL_NO_ERROR});
  context_.make_current();
}

// ---- callbacks ----

}  // namespace
