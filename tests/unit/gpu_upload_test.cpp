// Large data is uploaded in pieces: at most one per frame if the budget is used up, and a partly uploaded pose is never
// displayed.

#include "render/pacing/upload.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "base/error.hpp"
#include "base/milliseconds.hpp"
#include "gl/state_guard.hpp"
#include "headless.hpp"
#include "support/fake_gl.hpp"
#include "support/gl_state.hpp"
#include "support/gl_viewer.hpp"
#include "support/surfaces.hpp"

namespace {

using namespace cumulet;
using render::Deadline;
using render::Upload;

class Uploads : public test::GlTest {};
CUMULET_ON_BACKENDS(Uploads);

TEST_P(Uploads, PiecesAreWholeUnitsAndComplete) {
  Upload upload(gl_, "uploading");
  const std::size_t unit = 3000;
  std::vector<std::pair<std::size_t, std::size_t>> pieces;
  upload.add_pieces(
      1000 * unit, [&](std::size_t first, std::size_t count) { pieces.emplace_back(first, count); }, unit);
  EXPECT_TRUE(upload.advance(Deadline::max()));
  std::size_t next = 0;
  for (const auto& [first, count] : pieces) {
    EXPECT_EQ(first, next);
    EXPECT_EQ(count % unit, 0U);
    EXPECT_LE(count, Upload::piece_bytes);
    next = first + count;
  }
  EXPECT_EQ(next, 1000 * unit);
  EXPECT_EQ(pieces.size(), 2U);
}

TEST_P(Uploads, PastDeadlinesRunOneStepAtATime) {
  Upload upload(gl_, "uploading");
  int done = 0;
  for (int i = 0; i < 3; ++i) upload.add([&] { ++done; });
  for (int i = 1; i <= 3; ++i) {
    EXPECT_EQ(upload.advance(Deadline::min()), i == 3);
    EXPECT_EQ(done, i);
    EXPECT_DOUBLE_EQ(upload.progress(), i / 3.0);
  }
  EXPECT_TRUE(upload.advance(Deadline::min()));
  EXPECT_EQ(done, 3);
}

TEST_P(Uploads, ImagesAndBuffersAreCompletelyUploaded) {
  const gl::StateGuard guard(*gl_);
  const std::uint32_t width = 1100;
  const std::uint32_t height = 1000;  // three pieces
  std::vector<std::uint8_t> rgba(std::size_t{4} * width * height);
  for (std::size_t i = 0; i < rgba.size(); ++i) rgba[i] = static_cast<std::uint8_t>(i * 7 + i / 4096);
  const gl::Object flat = gl::make_texture_2d(gl_, GL_RGBA8, width, height, "flat");
  const gl::Object layers = gl::make_texture_2d_array(gl_, GL_RGBA8, width + 9, height + 5, 2, "layers");
  const gl::Object buffer = gl::make_buffer(gl_, rgba.size() + 16, nullptr, GL_DYNAMIC_STORAGE_BIT, "buffer");
  Upload upload(gl_, "uploading");
  upload.add_image([&] { return flat.name(); }, {glm::uvec2(0U), {width, height}, 0, std::nullopt}, rgba.data());
  upload.add_image([&] { return layers.name(); }, {{9U, 5U}, {width, height}, 0, 1}, rgba.data());
  upload.add_bytes([&] { return Upload::Location{buffer.name(), 16}; }, rgba.data(), rgba.size());
  int advances = 1;
  while (!upload.advance(Deadline::min())) ++advances;
  EXPECT_EQ(advances, 9);
  std::vector<std::uint8_t> back(rgba.size());
  const auto bytes = static_cast<GLsizei>(back.size());
  gl_->GetTextureImage(flat.name(), 0, GL_RGBA, GL_UNSIGNED_BYTE, bytes, back.data());
  EXPECT_TRUE(back == rgba);
  std::ranges::fill(back, std::uint8_t{0});
  gl_->GetTextureSubImage(layers.name(), 0, 9, 5, 1, width, height, 1, GL_RGBA, GL_UNSIGNED_BYTE, bytes, back.data());
  EXPECT_TRUE(back == rgba);
  std::ranges::fill(back, std::uint8_t{0});
  gl_->GetNamedBufferSubData(buffer.name(), 16, bytes, back.data());
  EXPECT_TRUE(back == rgba);
}

/// Hills of 200,000 triangles with an image; they rise with time.
class RisingScene : public test::StillScene {
 public:
  RisingScene() {
    const std::uint32_t material = add(test::diffuse(glm::vec3(0.5F)));
    materials[material].base_color_texture.texture =
        add_texture(1024, 1024, std::vector<std::uint8_t>(std::size_t{4} << 20U, 200));
    add_mesh(test::terrain(316), material);
  }
  [[nodiscard]] surface::Pose pose(double time, std::size_t animation, const Progress* progress) const override {
    surface::Pose posed = StillScene::pose(time, animation, progress);
    for (surface::PosedVertex& vertex : posed.vertices) vertex.position.y += static_cast<float>(time);
    posed.low.y += time;
    posed.high.y += time;
    return posed;
  }
};

class SurfaceUploads : public testing::Test {
 protected:
  static constexpr std::uint32_t side = 24;

  SurfaceUploads() {
    context_.emplace(headless::Context::create(headless::Backend::egl));
    fake_.emplace(headless::Context::get_proc, &*context_);
    viewer_.emplace(Log(), nullptr, true);
    viewer_->attach(test::FakeGl::get_proc, &*fake_);
    viewer().set_light({30.0F, 60.0F, glm::vec3(3.0F), glm::vec3(0.3F)});
    viewer().camera()->set(test::camera_at({0.5, 3.0, 3.0}, {0.5, 0.5, 0.5}));
    viewer::Sampling sampling;
    sampling.samples = 4;
    viewer().set_sampling(sampling);
    viewer().set_surfaces(std::make_shared<const viewer::SurfaceAsset>(scene_, "hills"));
    viewer().wait(-1.0);
  }
  [[nodiscard]] viewer::Viewer& viewer() { return *viewer_; }
  void pose(double time) {
    viewer::SurfaceSettings settings;
    settings.choice.time = time;
    viewer().set_surface_settings(settings);
    viewer().wait(-1.0);
  }
  viewer::FrameResult render(double budget_ms) {
    viewer::Frame frame;
    frame.target = viewer::Target::none;
    frame.size = {side, side};
    frame.viewport = {0, 0, side, side};
    frame.budget_ms = budget_ms;
    return viewer().render(frame);
  }
  void converge() {
    while (!render(100.0).converged) {
    }
  }
  std::vector<float> picture() {
    std::vector<float> rgba(std::size_t{4} * side * side);
    viewer().read_linear(rgba.data(), rgba.size());
    return rgba;
  }
  /// Height of the pose that paths currently intersect.
  double risen() { return viewer().trace_parameters().surfaces.low.y - scene_->rest.low.y; }

  std::shared_ptr<const RisingScene> scene_ = std::make_shared<RisingScene>();
  std::optional<headless::Context> context_;
  std::optional<test::FakeGl> fake_;
  std::optional<viewer::Viewer> viewer_;
};

// A frame without a budget uploads one piece of surfaces, one of volumes, and the parameters of its passes; 40 MB in
// total.
TEST_F(SurfaceUploads, CopiesPerFrameStayWithinTheTimeBudget) {
  constexpr std::uint64_t small = 64U << 10U;
  for (const double time : {0.0, 1.0, 2.0}) {
    if (time > 0.0) pose(time);
    const std::uint64_t before = fake_->uploaded();
    std::uint64_t most = 0;
    int frames = 0;
    double longest_ms = 0.0;
    double sum_ms = 0.0;
    for (bool loading = true; loading && frames < 200; ++frames) {
      const std::uint64_t begun = fake_->uploaded();
      const auto since = std::chrono::steady_clock::now();
      loading = render(1e-6).loading;
      const double ms = milliseconds(std::chrono::steady_clock::now() - since);
      // The last frame traces as well.
      if (loading) longest_ms = std::max(longest_ms, ms);
      if (loading) sum_ms += ms;
      most = std::max(most, fake_->uploaded() - begun);
    }
    // For tests/bench/results/single_values.csv.
    std::printf("%s: %.1f MB in %d frames, all but the last %.1f ms, the longest %.1f ms\n",
                time > 0.0 ? "a pose" : "a model", static_cast<double>(fake_->uploaded() - before) / 1048576.0, frames,
                sum_ms, longest_ms);
    EXPECT_LE(most, 2 * Upload::piece_bytes + small);
    EXPECT_LT(frames, 60);
    const std::uint64_t all = fake_->uploaded() - before;
    EXPECT_GT(all, 20U << 20U) << "what there was to copy";
    if (time > 0.0) {
      EXPECT_LT(all, 40U << 20U) << "images and what else does not move stay";
    }
    converge();
    EXPECT_NEAR(risen(), time, 0.01);
  }
}

TEST_F(SurfaceUploads, PreviousPoseIsShownUntilTheNextIsComplete) {
  converge();
  const std::vector<float> first = picture();
  pose(0.5);
  int frames = 0;
  while (render(1e-6).loading && ++frames < 200) {
    EXPECT_NEAR(risen(), 0.0, 0.01);
    ASSERT_EQ(picture(), first) << frames;
  }
  EXPECT_GT(frames, 5);
  converge();
  EXPECT_NEAR(risen(), 0.5, 0.01);
  EXPECT_NE(picture(), first);
}

TEST_F(SurfaceUploads, OnePosePerFrameIsShownAsOftenAsPossible) {
  converge();
  std::vector<double> shown{0.0};
  for (int i = 1; i <= 70; ++i) {
    pose(0.01 * i);
    render(1e-6);
    const double now = risen();
    if (std::abs(now - shown.back()) > 0.005) {
      EXPECT_GT(now, shown.back());
      shown.push_back(now);
    }
  }
  EXPECT_GE(shown.size(), 3U);
}

TEST_F(SurfaceUploads, FailureIsReportedOnceAndKeepsTheLastPose) {
  converge();
  const std::vector<float> first = picture();
  pose(0.5);
  fake_->fail_storage(true);
  int failures = 0;
  for (int i = 0; i < 20; ++i) {
    try {
      render(1e-6);
    } catch (const Error& error) {
      ++failures;
      EXPECT_EQ(error.code(), ErrorCode::out_of_memory);
    }
  }
  EXPECT_EQ(failures, 1);
  fake_->fail_storage(false);
  converge();
  EXPECT_NEAR(risen(), 0.0, 0.01);
  EXPECT_EQ(picture(), first);
  pose(0.6);
  converge();
  EXPECT_NEAR(risen(), 0.6, 0.01);
}

}  // namespace
