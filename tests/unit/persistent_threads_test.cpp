// Persistent threads: the image does not depend on which lane traces a pixel or how a path is split over dispatches.
// There are more pixels than lanes, and lanes that are done fetch new pixels.

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

#include "support/c_viewer.hpp"

namespace {

using namespace cumulet::test;

constexpr std::uint32_t width = 261;
constexpr std::uint32_t height = 139;

class PersistentThreads : public CViewerTest {
 protected:
  PersistentThreads() : CViewerTest(width, height) {}

  /// Renders with this budget per frame. frames: receives the number of frames.
  std::vector<float> picture(double budget_ms, bool surfaces, int& frames) {
    viewer_ = make_viewer({.get_proc = cumulet::headless::Context::get_proc, .user = context_.get(), .samples = 3});
    v_ = viewer_.get();
    auto frame = undrawn();
    frame.budget_ms = budget_ms;
    EXPECT_EQ(cumulet_set_volume(v_, ball_.get()), CUMULET_OK);
    EXPECT_EQ(cumulet_set_surfaces(v_, surfaces ? panes_.get() : nullptr), CUMULET_OK);
    EXPECT_EQ(cumulet_wait(v_, -1.0), CUMULET_OK);
    auto result = make_desc<cumulet_frame_result>();
    for (frames = 0; (result.flags & CUMULET_RENDER_CONVERGED) == 0; ++frames) {
      EXPECT_EQ(cumulet_render(v_, &frame, &result), CUMULET_OK) << cumulet_last_error(v_);
      if (HasFailure()) break;
    }
    return linear();
  }

  VolumeRef ball_ = make_ball(16, 3.0F);
  SurfacesRef panes_ = make_panes(3.0F);
};
CUMULET_ON_BACKENDS(PersistentThreads);

TEST_P(PersistentThreads, ImageDoesNotDependOnDispatchLength) {
  for (const bool surfaces : {false, true}) {
    int few = 0;
    int many = 0;
    const std::vector<float> at_once = picture(1000.0, surfaces, few);
    const std::vector<float> in_steps = picture(0.1, surfaces, many);
    EXPECT_GT(many, 4 * few) << "steps that are hardly any";
    EXPECT_TRUE(in_steps == at_once);
  }
}

// With previews there are other passes and dispatches, and the kernel has code for a ground and a sun disk.
TEST_P(PersistentThreads, ImageDoesNotDependOnPreviews) {
  std::vector<std::vector<float>> images;
  for (const cumulet_preview preview : {CUMULET_PREVIEW_OFF, CUMULET_PREVIEW_AUTO}) {
    viewer_ = make_viewer({.get_proc = cumulet::headless::Context::get_proc, .user = context_.get()});
    v_ = viewer_.get();
    auto sampling = make_desc<cumulet_sampling_desc>();
    sampling.samples = 5;
    sampling.preview = preview;
    EXPECT_EQ(cumulet_set_sampling(v_, &sampling), CUMULET_OK);
    EXPECT_EQ(cumulet_set_volume(v_, ball_.get()), CUMULET_OK);
    make();
    images.push_back(linear());
  }
  EXPECT_TRUE(images[0] == images[1]);
}

}  // namespace
