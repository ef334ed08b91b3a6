// The points of the embedding contract about the compilation of programs.
#include <gtest/gtest.h>

#include <cstdlib>
#include <string>
#include <vector>

#include "cumulet/cumulet.hpp"
#include "support/c_host.hpp"
#include "support/contract.hpp"
#include "support/fake_gl.hpp"

namespace {

using cumulet::test::CameraRef;
using cumulet::test::Contract;
using cumulet::test::converge;
using cumulet::test::difference;
using cumulet::test::HostTarget;
using cumulet::test::make_desc;
using cumulet::test::ViewerPtr;

/// Calls cumulet_warm_up until it is complete. Returns the reported progress.
std::vector<double> warm_up(cumulet_viewer* viewer, const cumulet_frame_desc& frame,
                            cumulet_warm_up_scope scope = CUMULET_WARM_UP_SCENE) {
  std::vector<double> progress;
  auto result = make_desc<cumulet_warm_up_result>();
  do {
    EXPECT_EQ(cumulet_warm_up(viewer, &frame, scope, &result), CUMULET_OK) << cumulet_last_error(viewer);
    progress.push_back(result.progress);
  } while (result.incomplete != 0 && progress.size() < 10000);
  EXPECT_EQ(result.incomplete, 0);
  return progress;
}

TEST_F(Contract, Contract26NothingIsCompiledInAFrameOnceWarm) {
  const cumulet::test::SurfacesRef panes = cumulet::test::make_panes(5.0F);
  const auto compiled = [&] { return fake_.calls("CompileShader") + fake_.calls("LinkProgram"); };
  struct Case {
    cumulet_preview preview;
    bool surfaces;
    bool texture;
    cumulet_denoise denoise;
  };
  for (const auto& [preview, surfaces, texture, denoise] :
       {Case{CUMULET_PREVIEW_AUTO, false, false, CUMULET_DENOISE_OFF},
        Case{CUMULET_PREVIEW_AUTO, true, true, CUMULET_DENOISE_OFF},
        Case{CUMULET_PREVIEW_OFF, true, false, CUMULET_DENOISE_OFF},
        Case{CUMULET_PREVIEW_OFF, false, false, CUMULET_DENOISE_FAST}}) {
    SCOPED_TRACE(std::to_string(preview) + (surfaces ? " surfaces" : "") + (texture ? " texture" : "") +
                 (denoise == CUMULET_DENOISE_FAST ? " denoised" : ""));
    const ViewerPtr own = viewer();
    auto display = make_desc<cumulet_display_desc>();
    display.denoise = denoise;
    ASSERT_EQ(cumulet_set_display(own.get(), &display), CUMULET_OK);
    ASSERT_EQ(cumulet_set_volume(own.get(), volume_.get()), CUMULET_OK);
    if (surfaces) {
      ASSERT_EQ(cumulet_set_surfaces(own.get(), panes.get()), CUMULET_OK);
    }
    auto sampling = make_desc<cumulet_sampling_desc>();
    sampling.samples = 2;
    sampling.preview = preview;
    sampling.separate_volume_aov = surfaces ? 1 : 0;
    ASSERT_EQ(cumulet_set_sampling(own.get(), &sampling), CUMULET_OK);
    ASSERT_EQ(cumulet_wait(own.get(), -1.0), CUMULET_OK);
    auto frame = target_.frame();
    frame.budget_ms = 5.0;
    frame.write_depth = 1;
    if (texture) {
      frame.target = CUMULET_TARGET_TEXTURE;
      frame.framebuffer = 0;
      frame.format = GL_RGBA16F;
    }
    const Picture before = target_.pixels();
    const std::vector<double> progress = warm_up(own.get(), frame);
    EXPECT_TRUE(std::ranges::is_sorted(progress));
    EXPECT_EQ(progress.back(), 1.0);
    EXPECT_EQ(target_.pixels(), before) << "it draws nothing";
    auto stats = make_desc<cumulet_stats>();
    ASSERT_EQ(cumulet_get_stats(own.get(), &stats), CUMULET_OK);
    EXPECT_GT(stats.build_seconds_upload, 0.0);
    const auto programs = compiled();
    const auto uses = fake_.first_uses();
    converge(own.get(), frame);
    cumulet_camera* camera = nullptr;
    ASSERT_EQ(cumulet_get_camera(own.get(), &camera), CUMULET_OK);
    const cumulet::test::CameraRef owner(camera);
    ASSERT_EQ(cumulet_camera_orbit(camera, 0.1, 0.0), CUMULET_OK);
    converge(own.get(), frame);
    auto pick = make_desc<cumulet_pick>();
    ASSERT_EQ(cumulet_pick_at(own.get(), 16.0, 16.0, &pick), CUMULET_OK);
    EXPECT_EQ(compiled(), programs);
    EXPECT_EQ(fake_.first_uses(), uses);
    EXPECT_EQ(gl_.GetError(), GLenum{GL_NO_ERROR});
    // A second warm-up compiles nothing.
    warm_up(own.get(), frame);
    EXPECT_EQ(compiled(), programs);
  }
}

TEST_F(Contract, Contract26bFramesDoNotWaitForParallelCompilation) {
  const cumulet::test::SurfacesRef panes = cumulet::test::make_panes(5.0F);
  fake_.compile_in_parallel();
  const ViewerPtr own = viewer();
  const auto frame = target_.frame();
  auto result = make_desc<cumulet_frame_result>();
  // Without a warm-up, the first frame waits for programs that draw, because there is no image to show instead.
  ASSERT_EQ(cumulet_render(own.get(), &frame, &result), CUMULET_OK);
  EXPECT_EQ(result.flags & CUMULET_RENDER_INCOMPLETE, 0U);
  EXPECT_GT(fake_.waits(), 0U);
  fake_.finish_compiling(true);
  ASSERT_EQ(cumulet_set_volume(own.get(), volume_.get()), CUMULET_OK);
  ASSERT_EQ(cumulet_wait(own.get(), -1.0), CUMULET_OK);
  const auto stalls = [&](const char* what) {
    SCOPED_TRACE(what);
    fake_.finish_compiling(false);
    const auto waited = fake_.waits();
    const auto linked = fake_.calls("LinkProgram");
    for (int i = 0; i < 5; ++i) {
      ASSERT_EQ(cumulet_render(own.get(), &frame, &result), CUMULET_OK) << cumulet_last_error(own.get());
      EXPECT_NE(result.flags & CUMULET_RENDER_INCOMPLETE, 0U);
      EXPECT_EQ(result.flags & CUMULET_RENDER_CONVERGED, 0U);
    }
    EXPECT_EQ(fake_.waits(), waited);
    EXPECT_GT(fake_.calls("LinkProgram"), linked);
    fake_.finish_compiling(true);
  };
  stalls("the first picture");
  converge(own.get(), frame);
  const Picture separate_volume_aov = target_.pixels();
  ASSERT_EQ(cumulet_set_surfaces(own.get(), panes.get()), CUMULET_OK);
  ASSERT_EQ(cumulet_wait(own.get(), -1.0), CUMULET_OK);
  stalls("surfaces");
  EXPECT_EQ(difference(target_.pixels(), separate_volume_aov), "") << "the last picture shows until then";
  converge(own.get(), frame);
  EXPECT_NE(difference(target_.pixels(), separate_volume_aov), "");
  // Another tone map: meanwhile, the old program is used.
  auto display = make_desc<cumulet_display_desc>();
  display.tone_map = CUMULET_TONE_MAP_CLIP;
  ASSERT_EQ(cumulet_set_display(own.get(), &display), CUMULET_OK);
  stalls("a tone map");
  converge(own.get(), frame);
  display.denoise = CUMULET_DENOISE_FAST;
  ASSERT_EQ(cumulet_set_display(own.get(), &display), CUMULET_OK);
  stalls("the filter");
  // Another encoding is for another target: only its own program fits, and the frame waits for it.
  converge(own.get(), frame);
  target_.clear({0.2F, 0.4F, 0.6F, 1.0F});
  const Picture cleared = target_.pixels();
  auto linear = frame;
  linear.color = CUMULET_COLOR_LINEAR;
  fake_.finish_compiling(false);
  ASSERT_EQ(cumulet_render(own.get(), &linear, &result), CUMULET_OK);
  EXPECT_NE(difference(target_.pixels(), cleared), "");
  fake_.finish_compiling(true);
  // A warm-up does not wait either, and ends when the driver is done.
  auto sampling = make_desc<cumulet_sampling_desc>();
  sampling.view = CUMULET_VIEW_STEPS;
  ASSERT_EQ(cumulet_set_sampling(own.get(), &sampling), CUMULET_OK);
  fake_.finish_compiling(false);
  const auto waited = fake_.waits();
  auto warm = make_desc<cumulet_warm_up_result>();
  for (int i = 0; i < 5; ++i) {
    ASSERT_EQ(cumulet_warm_up(own.get(), &frame, CUMULET_WARM_UP_SCENE, &warm), CUMULET_OK);
    EXPECT_EQ(warm.incomplete, 1);
  }
  EXPECT_EQ(fake_.waits(), waited);
  fake_.finish_compiling(true);
  warm_up(own.get(), frame);
}

TEST_F(Contract, Contract26cReadBackWaitsForCompilation) {
  const cumulet::test::SurfacesRef panes = cumulet::test::make_panes(5.0F);
  fake_.compile_in_parallel();
  fake_.finish_compiling(true);
  const ViewerPtr own = viewer();
  auto sampling = make_desc<cumulet_sampling_desc>();
  sampling.samples = 2;
  ASSERT_EQ(cumulet_set_sampling(own.get(), &sampling), CUMULET_OK);
  ASSERT_EQ(cumulet_set_volume(own.get(), volume_.get()), CUMULET_OK);
  ASSERT_EQ(cumulet_set_surfaces(own.get(), panes.get()), CUMULET_OK);
  auto frame = target_.frame();
  converge(own.get(), frame);
  auto medium = make_desc<cumulet_medium_desc>();
  medium.density_scale = 2.0;
  ASSERT_EQ(cumulet_set_medium(own.get(), &medium), CUMULET_OK);
  frame.budget_ms = 0.01;
  auto result = make_desc<cumulet_frame_result>();
  for (int i = 0; i < 1000 && (result.flags & CUMULET_RENDER_PREVIEW) == 0; ++i) {
    ASSERT_EQ(cumulet_render(own.get(), &frame, &result), CUMULET_OK) << cumulet_last_error(own.get());
  }
  ASSERT_NE(result.flags & CUMULET_RENDER_PREVIEW, 0U) << "with surfaces beneath, which the compositor reads back";
  std::vector<float> first(std::size_t{side} * side * 4);
  std::vector<float> later(first.size());
  fake_.finish_compiling(false);
  ASSERT_EQ(cumulet_read_linear(own.get(), first.data(), first.size()), CUMULET_OK);
  fake_.finish_compiling(true);
  ASSERT_EQ(cumulet_read_linear(own.get(), later.data(), later.size()), CUMULET_OK);
  EXPECT_EQ(first, later);
}

// On GPUs, the depth query of each call is still pending when the call returns.
TEST_F(Contract, Contract26dWarmUpWithHostDepthEnds) {
  const HostTarget large(gl_, 2048, 2048);
  const ViewerPtr own = viewer();
  ASSERT_EQ(cumulet_set_volume(own.get(), volume_.get()), CUMULET_OK);
  ASSERT_EQ(cumulet_wait(own.get(), -1.0), CUMULET_OK);
  auto frame = large.frame();
  frame.target = CUMULET_TARGET_NONE;
  frame.depth_source = CUMULET_DEPTH_SOURCE_FRAMEBUFFER;
  frame.depth_name = large.framebuffer();
  auto result = make_desc<cumulet_warm_up_result>();
  result.incomplete = 1;
  for (int i = 0; i < 200 && result.incomplete != 0; ++i) {
    ASSERT_EQ(cumulet_warm_up(own.get(), &frame, CUMULET_WARM_UP_SCENE, &result), CUMULET_OK);
  }
  EXPECT_EQ(result.incomplete, 0);
}

// The scenes of the following test use only a few of the hundreds of kernels. Kernels with other features take a driver
// many minutes and gigabytes, so they are compiled only in the long tier: those of the features that
// CUMULET_WHOLE_KERNELS names, separated by commas.
std::vector<std::string> hollow_lines() {
  const char* const named = std::getenv("CUMULET_WHOLE_KERNELS");
  const std::string whole = ',' + std::string(named != nullptr ? named : "") + ',';
  std::vector<std::string> lines;
  for (const std::string macro : {"CM_CHANNELS 1", "CM_ENVIRONMENT 1", "CM_EQUIANGULAR 1", "CM_GROUPS 1",
                                  "CM_HOLDOUT 1", "CM_INSTANCES 1", "CM_CLIP 1", "CM_ANALYTIC_LIGHTS 1", "CM_MOTION 1",
                                  "CM_EXTENDED_BSDF 1", "CM_EXTENDED_BSDF 2", "CM_SECOND_LOBE 1", "CM_GROUND 0"}) {
    if (whole.find(',' + macro.substr(0, macro.find(' ')) + ',') == std::string::npos)
      lines.push_back("#define " + macro);
  }
  return lines;
}

// Checks that the warm-up proceeds under any budget, and that a program that does not build does not stop the others.
// One test, because it builds all programs: a minute and gigabytes if the driver has not cached them.
TEST_F(Contract, Contract26eWarmUpOfAllEndsAndCoversEveryScene) {
  fake_.hollow_kernels(hollow_lines());
  const cumulet::test::SurfacesRef panes = cumulet::test::make_panes(5.0F);
  const auto linked = [&] { return fake_.calls("LinkProgram"); };
  const auto compiled = [&] { return fake_.calls("CompileShader") + linked(); };
  const ViewerPtr own = viewer();
  ASSERT_EQ(cumulet_set_volume(own.get(), volume_.get()), CUMULET_OK);
  ASSERT_EQ(cumulet_wait(own.get(), -1.0), CUMULET_OK);
  auto frame = target_.frame();
  auto result = make_desc<cumulet_warm_up_result>();
  std::vector<double> progress;
  const auto step = [&](double budget_ms) {
    frame.budget_ms = budget_ms;
    const cumulet_status status = cumulet_warm_up(own.get(), &frame, CUMULET_WARM_UP_ALL, &result);
    progress.push_back(result.progress);
    return status;
  };
  const auto run = [&](double budget_ms) {
    cumulet_status status = CUMULET_OK;
    for (int i = 0; i < 10000; ++i) {
      status = step(budget_ms);
      if (status != CUMULET_OK || result.incomplete == 0) return status;
    }
    ADD_FAILURE() << "it never ends";
    return status;
  };
  ASSERT_EQ(step(1e-3), CUMULET_OK) << cumulet_last_error(own.get());
  EXPECT_EQ(result.incomplete, 1) << "piece by piece";
  EXPECT_LT(result.progress, 0.5);
  for (int i = 0; i < 10000 && result.progress < 0.2; ++i) {
    ASSERT_EQ(step(1e-3), CUMULET_OK) << cumulet_last_error(own.get());
    ASSERT_EQ(result.incomplete, 1);
  }
  ASSERT_GE(result.progress, 0.2);
  fake_.fail_linking(true);
  for (const auto begun = linked(); linked() == begun;) ASSERT_EQ(step(1e-3), CUMULET_OK);
  fake_.fail_linking(false);
  EXPECT_EQ(run(5.0), CUMULET_ERROR_GL) << "reported in the end";
  EXPECT_NE(std::string(cumulet_last_error(own.get())).find("does not build"), std::string::npos);
  EXPECT_GT(result.progress, 0.9);
  EXPECT_TRUE(std::ranges::is_sorted(progress));
  // The error is returned again without another build. A changed setting allows one.
  const auto before = linked();
  EXPECT_EQ(run(5.0), CUMULET_ERROR_GL);
  EXPECT_EQ(linked(), before);
  auto display = make_desc<cumulet_display_desc>();
  ASSERT_EQ(cumulet_set_display(own.get(), &display), CUMULET_OK);
  EXPECT_EQ(run(5.0), CUMULET_OK) << cumulet_last_error(own.get());
  EXPECT_EQ(result.progress, 1.0);
  EXPECT_EQ(linked(), before + 1);

  const auto programs = compiled();
  EXPECT_EQ(run(5.0), CUMULET_OK);
  EXPECT_EQ(compiled(), programs) << "once more has nothing to do";
  const auto expect_nothing_compiled = [&](const char* what) {
    SCOPED_TRACE(what);
    ASSERT_EQ(cumulet_wait(own.get(), -1.0), CUMULET_OK);
    converge(own.get(), frame);
    EXPECT_EQ(compiled(), programs);
  };
  expect_nothing_compiled("the volume");
  auto grid = make_desc<cumulet_grid_desc>();
  for (const cumulet_grid_type march : {CUMULET_GRID_DENSE, CUMULET_GRID_BRICKS, CUMULET_GRID_TETRAHEDRAL}) {
    grid.type = march;
    ASSERT_EQ(cumulet_set_grid(own.get(), &grid), CUMULET_OK);
    expect_nothing_compiled("another march");
  }
  ASSERT_EQ(cumulet_set_surfaces(own.get(), panes.get()), CUMULET_OK);
  expect_nothing_compiled("surfaces");
  auto sampling = make_desc<cumulet_sampling_desc>();
  sampling.samples = 2;
  for (const cumulet_view_mode view : {CUMULET_VIEW_CELLS, CUMULET_VIEW_STEPS, CUMULET_VIEW_SHADED}) {
    sampling.view = view;
    ASSERT_EQ(cumulet_set_sampling(own.get(), &sampling), CUMULET_OK);
    expect_nothing_compiled("another view");
  }
}

TEST_F(Contract, Contract26fFailedProgramIsReportedOnceAndNotRebuilt) {
  const ViewerPtr own = viewer();
  const auto frame = target_.frame();
  auto none = frame;
  none.target = CUMULET_TARGET_NONE;
  ASSERT_EQ(cumulet_set_volume(own.get(), volume_.get()), CUMULET_OK);
  converge(own.get(), none);
  fake_.fail_linking(true);
  EXPECT_EQ(cumulet_render(own.get(), &frame, nullptr), CUMULET_ERROR_GL);
  const auto linked = fake_.calls("LinkProgram");
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(cumulet_render(own.get(), &frame, nullptr), CUMULET_OK) << cumulet_last_error(own.get());
  }
  EXPECT_EQ(fake_.calls("LinkProgram"), linked);
  fake_.fail_linking(false);
  auto display = make_desc<cumulet_display_desc>();
  display.exposure_stops = 1.0F;
  ASSERT_EQ(cumulet_set_display(own.get(), &display), CUMULET_OK);
  const Picture before = target_.pixels();
  converge(own.get(), frame);
  EXPECT_NE(difference(target_.pixels(), before), "");
}

}  // namespace
