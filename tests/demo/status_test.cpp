// The status line and the messages of cumulet-demo.

#include <gtest/gtest.h>

#include <string>

#include "model.hpp"
#include "status_line.hpp"

namespace {

using namespace cumulet::demo;

Model refining() {
  Model model;
  model.scene.sampling.samples = 256;
  model.status.frame.width = 100;
  model.status.frame.height = 50;
  model.status.frame.progress = 42.5 / 256.0;
  model.status.frame.flags = CUMULET_RENDER_INCOMPLETE;
  model.status.stats.samples = 42 * 5000;
  model.status.noise = 0.0123;
  model.scene.display.denoise = CUMULET_DENOISE_OFF;
  return model;
}

TEST(StatusLine, DescribesTheDisplayedImage) {
  Model model = refining();
  EXPECT_EQ(status_text(model), "42 / 256, noise 1.23 %   100x50");
  model.seconds_left = 35.0;
  model.scene.display.denoise = CUMULET_DENOISE_FAST;
  EXPECT_EQ(status_text(model), "42 / 256, 0:35 left   100x50") << "the filter is not done";
  model.status.frame.flags |= CUMULET_RENDER_DENOISED;
  EXPECT_EQ(status_text(model), "42 / 256, 0:35 left, denoised   100x50") << "the noise is not that of the image";
  model.status.frame.flags = CUMULET_RENDER_CONVERGED | CUMULET_RENDER_DENOISED;
  EXPECT_EQ(status_text(model), "256 samples, denoised   100x50");
  model.status.frame.flags = CUMULET_RENDER_INCOMPLETE | CUMULET_RENDER_PREVIEW;
  model.seconds_left.reset();
  EXPECT_EQ(status_text(model), "Preview   100x50") << "its first samples are not denoised";
  model.status.saving = "/a/b.png";
  EXPECT_EQ(status_text(model), "Preview   saving b.png when all pixels are sampled   100x50");
  model.status.saving.clear();
  model.status.frame.flags = CUMULET_RENDER_INCOMPLETE;
  model.status.frame.progress = 0.0;
  model.status.stats.samples = 4999;
  EXPECT_EQ(status_text(model), "0 / 256   100x50") << "there is nothing to denoise";
}

TEST(StatusLine, NoiseTargetsMakeTheSamplesAMaximum) {
  Model model = refining();
  model.scene.sampling.noise_target_percent = 2.0f;
  model.status.frame.progress = 0.125;
  EXPECT_EQ(status_text(model), "42 samples (12 %), noise 1.23 %   100x50");
}

TEST(StatusLine, NoiseOfFewSamplesIsNotShown) {
  Model model = refining();
  model.status.stats.samples = 3 * 5000;
  EXPECT_FALSE(shown_noise(model.status));
  model.status.stats.samples = 4 * 5000;
  EXPECT_EQ(shown_noise(model.status), 0.0123);
}

TEST(StatusLine, NamesOtherViews) {
  Model model = refining();
  model.scene.sampling.view = CUMULET_VIEW_STEPS;
  model.scene.display.denoise = CUMULET_DENOISE_FAST;
  EXPECT_EQ(status_text(model).rfind("steps", 0), 0u) << status_text(model);
  EXPECT_EQ(status_text(model).find("denoised"), std::string::npos) << "only the shaded view is denoised";
}

TEST(StatusLine, WorkIsNotThatOfAnotherFile) {
  Model model;
  model.scene.volume = "/a/cloud.vdb";
  EXPECT_EQ(file_of_work(model), "/a/cloud.vdb");
  model.status.loading = "/a/smoke.vdb";
  EXPECT_EQ(file_of_work(model), "/a/smoke.vdb");
  model.scene.others.emplace_back().volume = "/a/smoke.vdb";
  model.status.loading.clear();
  EXPECT_EQ(file_of_work(model), "") << "the grid may be that of either volume";
}

TEST(Messages, AreLoggedAndMayHaveAButton) {
  Model model;
  show_message(model, false, "one", 0.0);
  show_message(model, true, "two\nlines", 0.0);
  show_message(model, false, "three", 1.0, MessageButton{"Go", "Goes.", {Action::frame_all}});
  ASSERT_EQ(model.messages.size(), 3u);
  EXPECT_EQ(model.messages[0].until, 5.0);
  EXPECT_EQ(model.messages[2].until, 61.0) << "there must be time to press the button";
  show_message(model, false, "four", 2.0);
  ASSERT_EQ(model.messages.size(), 3u);
  EXPECT_TRUE(model.messages[0].error) << "errors stay";
  ASSERT_EQ(model.log.size(), 4u) << "the log has all of them";
  EXPECT_EQ(model.log[0].text, "one");
  EXPECT_EQ(model.log[1].text, "two lines");
  EXPECT_TRUE(model.log[1].error);
  EXPECT_EQ(model.log[3].time.size(), 8u);
}

}  // namespace
