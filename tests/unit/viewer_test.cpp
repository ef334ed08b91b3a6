// The viewer's reaction to settings and frames: which changes restart sampling, previews, cameras, surfaces, picking.

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>
#include <glm/gtc/matrix_transform.hpp>
#include <thread>

#include "base/error.hpp"
#include "light/environment_file.hpp"
#include "support/folder.hpp"
#include "support/gl_viewer.hpp"
#include "support/osmesa_leaks.hpp"
#include "support/radiance.hpp"
#include "support/surfaces.hpp"
#include "support/volumes.hpp"

namespace {

using namespace cumulet;
using glm::dvec3;
using glm::ivec2;
using glm::ivec3;
using glm::vec3;

class ViewerFrames : public test::StillTest {
 protected:
  void SetUp() override {
    StillTest::SetUp();
    if (!IsSkipped()) still_->set_medium({0.4, vec3(1.0F), {0.3F}, 0});
  }
  void show_noise() const {
    still_->set_volume(test::noise_volume({30, 30, 30}, ivec3(0), 2));
    still_->build();
  }
  viewer::FrameResult converge(const viewer::Frame& f) const {
    viewer::FrameResult result;
    for (int i = 0; i < 20000; ++i) {
      result = viewer().render(f);
      if (result.converged) return result;
      wait_a_little();
    }
    ADD_FAILURE() << "does not converge";
    return result;
  }
  // Waits as hosts do between frames, so that the GPU can proceed.
  static void wait_a_little() { std::this_thread::sleep_for(std::chrono::microseconds(100)); }
  [[nodiscard]] std::vector<float> read(glm::uvec2 size) const {
    std::vector<float> rgba(std::size_t{size.x} * size.y * 4);
    viewer().read_linear(rgba.data(), rgba.size());
    return rgba;
  }
  static double mean_alpha(const std::vector<float>& rgba) {
    double sum = 0.0;
    for (std::size_t i = 3; i < rgba.size(); i += 4) sum += rgba[i];
    return 4.0 * sum / static_cast<double>(rgba.size());
  }
};

TEST_P(ViewerFrames, PreviewsConvergeToTheImageWithoutPreviews) {
  show_noise();
  // One tile, and several.
  for (const glm::uvec2 size : {glm::uvec2(60, 44), glm::uvec2(600, 20)}) {
    viewer().set_sampling({5, 3, {render::View::shaded, false}});
    converge(frame(size.x, size.y));
    const auto off = read(size);
    viewer().set_sampling({5, 3, {render::View::shaded, true}});
    bool preview = false;
    viewer::FrameResult result;
    while (!result.converged) {
      result = viewer().render(frame(size.x, size.y, 0.01));
      preview = preview || result.preview;
    }
    EXPECT_TRUE(preview);
    EXPECT_FALSE(result.preview || result.more || result.loading || result.failed);
    EXPECT_EQ(result.progress, 1.0);
    EXPECT_EQ(off, read(size));
  }
}

// A preview does not wait for second samples of pixels that finish early.
TEST_P(ViewerFrames, PreviewIsShownWithItsFirstSamples) {
  show_noise();
  viewer().set_sampling({1000, 3, {render::View::shaded, true}});
  viewer::FrameResult result;
  for (int i = 0; i < 20000 && !result.preview; ++i) result = viewer().render(frame(320, 320, 0.01));
  ASSERT_TRUE(result.preview);
  EXPECT_LT(viewer().stats().samples, 3U * result.size.x * result.size.y);
}

TEST_P(ViewerFrames, ImagesAppearDuringContinuousCameraMotion) {
  show_noise();
  viewer().render(frame(256, 256, 0.01));
  int pictures = 0;
  float last = 0.0F;
  for (int i = 0; i < 2000 && pictures < 5; ++i) {
    viewer().camera()->orbit(0.01, 0.0);
    const viewer::FrameResult result = viewer().render(frame(256, 256, 0.01));
    EXPECT_FALSE(result.converged);
    wait_a_little();
    if (result.size.x == 0) continue;
    const float now = read(result.size)[std::size_t{4} * (result.size.x / 2 + result.size.x * (result.size.y / 2))];
    pictures += now != last ? 1 : 0;
    last = now;
  }
  EXPECT_EQ(pictures, 5);
}

TEST_P(ViewerFrames, RaisingTheSampleLimitContinues) {
  show_noise();
  for (const glm::uvec2 size : {glm::uvec2(40, 30), glm::uvec2(600, 10)}) {
    viewer().set_sampling({9, 3, {render::View::shaded, false}});
    converge(frame(size.x, size.y));
    const auto nine = read(size);
    viewer().set_sampling({2, 3, {render::View::shaded, false}});
    converge(frame(size.x, size.y));
    EXPECT_NE(nine, read(size));
    const std::uint64_t before = viewer().stats().samples;
    viewer().set_sampling({9, 3, {render::View::shaded, false}});
    viewer().render(frame(size.x, size.y, 0.001));
    EXPECT_GE(viewer().stats().samples, before);
    converge(frame(size.x, size.y));
    EXPECT_EQ(nine, read(size));
  }
}

TEST_P(ViewerFrames, ChangesRestartOnlyWhatDependsOnThem) {
  show_noise();
  viewer().set_sampling({3, 0, {render::View::shaded, true}});
  const viewer::Frame f = frame(48, 48);
  converge(f);
  const std::uint64_t cells = viewer().stats().cells;
  const auto still_converged = [&] {
    return viewer().render(frame(48, 48, -1.0)).converged && viewer().render(f).converged;
  };
  EXPECT_TRUE(still_converged());
  viewer().set_display({2.0F, render::ToneMap::filmic, true});
  EXPECT_TRUE(still_converged());
  viewer().set_medium({0.4, vec3(1.0F), {0.3F}, 0});  // unchanged
  viewer().set_light({30.0F, 30.0F, vec3(3.0F), vec3(0.3F)});
  EXPECT_TRUE(still_converged());
  viewer().set_medium({0.8, vec3(1.0F), {0.3F}, 0});
  const viewer::FrameResult result = viewer().render(frame(48, 48, 0.001));
  EXPECT_FALSE(result.converged);
  EXPECT_FALSE(result.loading);  // the cells are kept
  converge(f);
  EXPECT_EQ(viewer().stats().cells, cells);
  viewer::GridSettings grid;
  grid.build.refine.threshold = 0.2;
  viewer().set_grid(grid);
  viewer().wait(-1.0);
  converge(f);
  EXPECT_LT(viewer().stats().cells, cells);
}

TEST_P(ViewerFrames, TransmittanceCriterionRebuildsWithTheMedium) {
  viewer::GridSettings grid;
  grid.build.refine.criterion = grid::Criterion::transmittance;
  grid.build.refine.threshold = 0.1;
  viewer().set_grid(grid);
  show_noise();
  const auto cells_at = [&](double scale, float anisotropy) {
    viewer().set_medium({scale, vec3(1.0F), {anisotropy}, 0});
    still_->build();
    return viewer().stats().cells;
  };
  const std::uint64_t before = viewer().stats().cells;
  EXPECT_EQ(cells_at(0.79, 0.3F), before);
  EXPECT_EQ(cells_at(0.21, 0.3F), before);
  EXPECT_EQ(cells_at(0.4, 0.6F), before);
  const std::uint64_t denser = cells_at(0.81, 0.3F);
  EXPECT_NE(denser, before);
  EXPECT_EQ(cells_at(0.41, 0.3F), denser);
  EXPECT_NE(cells_at(0.41, 0.9F), denser);
  // A rebuild uses the current medium, even if the change is small.
  cells_at(0.81, 0.3F);
  viewer().set_medium({0.5, vec3(1.0F), {0.3F}, 0});
  viewer().rebuild();
  still_->build();
  EXPECT_NE(viewer().stats().cells, denser);
  // Other criteria do not depend on the medium.
  viewer().set_grid({});
  still_->build();
  const std::uint64_t deviation = viewer().stats().cells;
  EXPECT_EQ(cells_at(30.0, 0.0F), deviation);
}

TEST_P(ViewerFrames, EnvironmentsAndSkiesLoadAsynchronously) {
  const test::Folder folder;
  std::vector<std::string> files;
  for (const std::uint32_t width : {16U, 128U}) {
    files.push_back((folder / (std::to_string(width) + ".hdr")).string());
    std::ofstream(files.back(), std::ios::binary) << test::radiance_file(width, width / 2);
  }
  const auto daylight = [](float elevation) {
    viewer::Light light{40.0F, elevation};
    light.sky = light::SkyModel{};
    return light;
  };
  show_noise();
  viewer().set_sampling({4, 3, {render::View::shaded, false}});
  for (int i = 0; i < 24; ++i) {
    viewer().set_light(daylight(10.0F + static_cast<float>(i)));
    if (i % 3 == 0) viewer().load_environment(files.at(static_cast<std::size_t>(i) % 2));
    if (i % 8 == 5) viewer().set_environment(nullptr);
    viewer().set_ground({i % 4 == 0 ? viewer::GroundMode::none : viewer::GroundMode::below});
    EXPECT_FALSE(viewer().render(frame(24, 24, 1.0)).failed);
  }
  viewer().load_environment(files[1]);
  viewer().wait(-1.0);
  ASSERT_NE(viewer().environment(), nullptr);
  EXPECT_EQ(viewer().environment()->name, files[1]);
  converge(frame(24, 24));
  const std::vector<float> surrounded = read({24, 24});
  viewer().set_environment(nullptr);
  converge(frame(24, 24));
  const std::vector<float> by_day = read({24, 24});
  EXPECT_NE(by_day, surrounded);

  // A new viewer gives the same image.
  still_ = make();
  viewer().set_medium({0.4, vec3(1.0F), {0.3F}, 0});
  show_noise();
  viewer().set_sampling({4, 3, {render::View::shaded, false}});
  viewer().set_ground({viewer::GroundMode::below});
  viewer().set_light(daylight(33.0F));
  viewer().wait(-1.0);
  converge(frame(24, 24));
  EXPECT_EQ(read({24, 24}), by_day);
  viewer().set_environment(light::open_environment(files[1]));
  converge(frame(24, 24));
  EXPECT_EQ(read({24, 24}), surrounded);
}

TEST_P(ViewerFrames, RemovingTheVolumeShowsTheBackground) {
  show_noise();
  converge(frame(16, 16));
  viewer().set_volume(nullptr);
  const viewer::FrameResult result = viewer().render(frame(16, 16));
  EXPECT_EQ(result.size, glm::uvec2(0U));
  EXPECT_FALSE(result.converged || result.more || result.loading);
  EXPECT_EQ(viewer().volume(), nullptr);
  EXPECT_THROW(read({16, 16}), Error);
}

/// The bounding box of opaque pixels; `high` is exclusive.
struct Silhouette {
  ivec2 low{1 << 20};
  ivec2 high{0};
};

TEST_P(ViewerFrames, CameraFitIgnoresHaze) {
  // A ball of radius 10, away from the center of a box that is nearly empty.
  const auto ball = [](const ivec3& p) { return glm::distance(vec3(p), vec3(50, 24, 30)) < 10.0F ? 1.0F : 1e-5F; };
  still_->set_volume(test::make_volume({80, 60, 70}, ivec3(0), ball));
  viewer().set_medium({3.0, vec3(1.0F), {0.0F}, 1});
  viewer().set_light({0.0F, 90.0F, vec3(1.0F), vec3(0.0F)});
  viewer::DisplaySettings display;
  display.transparent = true;
  viewer().set_display(display);
  viewer().set_sampling({16, 1, {render::View::shaded, false}});
  still_->build();
  const auto expect_fitted = [&](glm::uvec2 size) {
    converge(frame(size.x, size.y));
    const std::vector<float> rgba = read(size);
    Silhouette seen;
    for (int y = 0; y < static_cast<int>(size.y); ++y) {
      for (int x = 0; x < static_cast<int>(size.x); ++x) {
        if (rgba[4 * static_cast<std::size_t>(y * static_cast<int>(size.x) + x) + 3] < 0.25F) continue;
        seen.low = glm::min(seen.low, ivec2(x, y));
        seen.high = glm::max(seen.high, ivec2(x, y) + 1);
      }
    }
    const ivec2 wide = seen.high - seen.low;
    const double share = double(std::min(wide.x, wide.y)) / std::min(size.x, size.y);
    EXPECT_GT(share, 0.84);
    EXPECT_LT(share, 0.95);
    const ivec2 off = glm::abs(seen.low + seen.high - ivec2(size));
    EXPECT_LE(std::max(off.x, off.y), 4) << "not in the middle";
  };
  expect_fitted({120, 90});  // a camera that waited for bounds
  for (const dvec3& back : {dvec3(1, 0, 0), dvec3(-1, 2, 0.5), dvec3(0.3, -1, -1)}) {
    for (const double height : {0.0, 7.0}) {
      viewer::CameraPose pose;
      pose.eye = 100.0 * back;
      pose.orthographic_height = height;
      viewer().camera()->set(pose);
      converge(frame(90, 100));  // passes the image size
      viewer().frame_all();
      expect_fitted({90, 100});
    }
  }

  // If nothing is visible, the camera fits the bounds.
  viewer().set_medium({1e-6, vec3(1.0F), {0.0F}, 1});
  viewer().frame_all();
  viewer::Camera plain(viewer().camera()->pose());
  plain.fit(viewer().bounds(), 0.9);
  EXPECT_LT(glm::distance(viewer().camera()->pose().eye, plain.pose().eye), 1e-6);

  // Surfaces, with the ball and without it.
  auto scene = std::make_shared<test::StillScene>();
  scene->add_sphere(vec3(20, 24, 30), 10.0F, scene->add(test::diffuse(vec3(0.5F))));
  viewer().show_surfaces(test::source_of(scene));
  converge(frame(90, 100));
  viewer().camera()->set(test::camera_at({50, 24, 400}, {50, 24, 0}));
  viewer().frame_all();
  EXPECT_NEAR(viewer().camera()->pose().target.x, 20.0, 0.5);
  viewer().set_medium({3.0, vec3(1.0F), {0.0F}, 1});
  viewer().frame_all();
  EXPECT_NEAR(viewer().camera()->pose().target.x, 35.0, 0.5);
}

// Views of a slab of 16 voxels, from z = -0.5 to 15.5.
class ViewerSlab : public ViewerFrames {
 protected:
  void SetUp() override {
    ViewerFrames::SetUp();
    if (IsSkipped()) return;
    still_->set_volume(test::make_volume({64, 64, 16}, ivec3(0), [](const ivec3& /*p*/) { return 1.0F; }));
    viewer().set_medium({0.1, vec3(0.0F), {0.0F}, 0});
    viewer().set_sampling({64, 1, {render::View::shaded, false}});
    viewer::CameraPose pose;
    pose.eye = {31.5, 31.5, 215.5};
    pose.target = {31.5, 31.5, 15.5};
    pose.fovy_degrees = 4.0;
    viewer().camera()->set(pose);
    still_->build();
  }
};

TEST_P(ViewerSlab, OrthographicAndOffAxisCamerasFollowBeerLambert) {
  const double expected = 1.0 - std::exp(-1.6);
  viewer::CameraPose pose = viewer().camera()->pose();
  pose.orthographic_height = 20.0;
  viewer().camera()->set(pose);
  converge(frame(32, 32));
  EXPECT_NEAR(mean_alpha(read({32, 32})), expected, 0.01);
  // An off-axis projection: the eye is straight above the slab's center, and the image shows its edge.
  const glm::dmat4 view = glm::lookAt(dvec3(31.5, 31.5, 215.5), dvec3(31.5, 31.5, 0.0), dvec3(0, 1, 0));
  const glm::dmat4 projection = glm::frustum(0.0 * 1.0, 0.01, -0.005, 0.005, 0.1, 1000.0);
  viewer().camera()->set_matrices(view, projection, viewer::ClipDepth::negative_one_to_one);
  converge(frame(32, 32));
  EXPECT_NEAR(mean_alpha(read({32, 32})), expected, 0.01);
  // A view of which half misses the slab.
  const glm::dmat4 half = glm::frustum(0.0, 0.1 * 2.0 * 32.0 / 200.0, -0.005, 0.005, 0.1, 1000.0);
  viewer().camera()->set_matrices(view, half, viewer::ClipDepth::negative_one_to_one);
  converge(frame(32, 32));
  EXPECT_NEAR(mean_alpha(read({32, 32})), 0.5 * expected, 0.02);
}

TEST_P(ViewerSlab, BackgroundColorIsVisibleOnlyBehindEverything) {
  viewer().set_light({0.0F, 90.0F, vec3(0.0F), vec3(0.5F, 0.25F, 1.0F)});
  auto scene = std::make_shared<test::StillScene>();
  surface::Material mirror = test::diffuse(vec3(1.0F));
  mirror.metallic = 1.0F;
  mirror.roughness = 0.0F;
  scene->add_sphere(vec3(31.5F, 31.5F, 20.0F), 2.0F, scene->add(mirror));
  viewer().show_surfaces(test::source_of(scene));
  const glm::uvec2 size(32, 32);
  converge(frame(size.x, size.y));
  const std::vector<float> sky = read(size);
  viewer::DisplaySettings display;
  display.transparent = true;
  viewer().set_display(display);
  const std::vector<float> transparent = read(size);
  display.transparent = false;
  display.backdrop = vec3(3.0F, 0.5F, 0.125F);
  viewer().set_display(display);
  EXPECT_TRUE(viewer().render(frame(size.x, size.y, -1.0)).converged);
  const std::vector<float> color = read(size);
  std::size_t mirrored = 0;
  for (std::size_t i = 0; i < color.size(); ++i) {
    const float alpha = transparent[i - i % 4 + 3];
    const float behind = i % 4 == 3 ? 0.0F : (1.0F - alpha) * (*display.backdrop)[static_cast<int>(i % 4)];
    ASSERT_NEAR(color[i], transparent[i] + behind, 1e-6F);
    if (alpha < 1.0F) continue;
    EXPECT_EQ(color[i], sky[i]);
    if (i % 4 == 2 && sky[i] > 0.1F) ++mirrored;
  }
  EXPECT_GT(mirrored, 20U);
}

TEST_P(ViewerSlab, OrthographicRaysStartAtTheNearPlane) {
  viewer::CameraPose pose = viewer().camera()->pose();
  pose.orthographic_height = 20.0;
  pose.near_plane = 200.0 + 8.0;  // in the slab's center plane
  pose.far_plane = 1000.0;
  viewer().camera()->set(pose);
  converge(frame(32, 32));
  EXPECT_NEAR(mean_alpha(read({32, 32})), 1.0 - std::exp(-0.8), 0.01);
}

TEST_P(ViewerSlab, HostDepthEndsCameraRays) {
  auto functions = gl::load_functions(headless::Context::get_proc, context_.get());
  gl::Object depth = gl::make_texture_2d(functions, GL_R32F, 32, 32, "depth");
  const viewer::ViewFrame view = viewer().camera()->view(1.0, std::nullopt);
  viewer::Frame f = frame(32, 32);
  f.depth_source = render::DepthSource::texture;
  f.depth_name = depth.name();
  for (const double part : {0.25, 0.75, 2.0}) {
    // Half of the rows have no surface in front.
    std::vector<float> values(std::size_t{32} * 32, static_cast<float>(view.depth_a));
    for (std::size_t i = 0; i < values.size() / 2; ++i)
      values[i] = static_cast<float>(view.depth_a + view.depth_b / (200.0 + 16.0 * part));
    functions->TextureSubImage2D(depth.name(), 0, 0, 0, 32, 32, GL_RED, GL_FLOAT, values.data());
    converge(f);
    const auto rgba = read({32, 32});
    const std::vector<float> top(rgba.begin(), rgba.begin() + static_cast<std::ptrdiff_t>(rgba.size() / 2));
    const std::vector<float> bottom(rgba.begin() + static_cast<std::ptrdiff_t>(rgba.size() / 2), rgba.end());
    EXPECT_NEAR(mean_alpha(top), 1.0 - std::exp(-1.6), 0.012);
    EXPECT_NEAR(mean_alpha(bottom), 1.0 - std::exp(-1.6 * std::min(part, 1.0)), 0.012) << part;
  }
  // The same depth again does not restart sampling.
  EXPECT_TRUE(viewer().render(f).converged);
  f.depth_source = render::DepthSource::none;
  EXPECT_FALSE(viewer().render(frame(32, 32, 0.001)).converged);
}

TEST_P(ViewerSlab, PickingFindsHalfOpacity) {
  converge(frame(32, 32));
  const viewer::Pick pick = viewer().pick(16.2, 15.9);
  ASSERT_TRUE(pick.hit);
  const double depth = std::log(2.0) / 0.1;
  EXPECT_NEAR(pick.position.z, 15.5 - depth, 0.02);
  EXPECT_NEAR(pick.position.x, 31.5, 0.5);
  EXPECT_NEAR(pick.distance, 200.0 + depth, 0.05);
  EXPECT_FALSE(viewer().pick(-1.0, 3.0).hit);
  EXPECT_FALSE(viewer().pick(std::nan(""), 3.0).hit);
  viewer().set_medium({0.01, vec3(0.0F), {0.0F}, 0});  // opacity never reaches one half
  converge(frame(32, 32));
  EXPECT_FALSE(viewer().pick(16.0, 16.0).hit);
}

TEST_P(ViewerSlab, WritesDepthForTheHost) {
  viewer::Frame f = frame(24, 24);
  f.target = viewer::Target::texture;
  f.write_depth = true;
  for (const auto convention : {viewer::DepthConvention::standard, viewer::DepthConvention::reversed}) {
    viewer::CameraPose pose = viewer().camera()->pose();
    pose.depth = convention;
    pose.near_plane = 1.0;
    pose.far_plane = 1000.0;
    viewer().camera()->set(pose);
    const viewer::FrameResult result = converge(f);
    ASSERT_NE(result.depth_texture, 0U);
    ASSERT_NE(result.texture, 0U);
    const auto functions = gl::load_functions(headless::Context::get_proc, context_.get());
    std::vector<float> depth(std::size_t{24} * 24);
    functions->GetTextureImage(result.depth_texture, 0, GL_DEPTH_COMPONENT, GL_FLOAT,
                               static_cast<GLsizei>(depth.size() * 4), depth.data());
    const double z = 200.0 + std::log(2.0) / 0.1;
    const double standard = 1000.0 * (z - 1.0) / (z * 999.0);
    const double expected = convention == viewer::DepthConvention::standard ? standard : 1.0 - standard;
    for (const float d : depth) EXPECT_NEAR(d, expected, 1e-5);
  }
}

TEST_P(ViewerSlab, NoiseEstimateMatchesTheVarianceBetweenSeeds) {
  viewer().set_medium({0.1, vec3(0.9F), {0.0F}, 0});
  std::vector<std::vector<float>> pictures;
  double estimate = 0.0;
  for (std::uint32_t seed = 0; seed < 12; ++seed) {
    viewer().set_sampling({32, seed, {render::View::shaded, false}});
    converge(frame(24, 24));
    pictures.push_back(read({24, 24}));
    estimate += viewer().measure_noise().value() / 12.0;
  }
  double variance = 0.0;
  double mean = 0.0;
  const std::size_t pixels = std::size_t{24} * 24;
  const auto luminance = [](const std::vector<float>& p, std::size_t i) {
    return 0.2126 * p[4 * i] + 0.7152 * p[4 * i + 1] + 0.0722 * p[4 * i + 2];
  };
  for (std::size_t i = 0; i < pixels; ++i) {
    double sum = 0.0;
    double square = 0.0;
    for (const auto& picture : pictures) {
      const double y = luminance(picture, i);
      sum += y;
      square += y * y;
    }
    variance += (square - sum * sum / 12.0) / 11.0 / double(pixels);
    mean += sum / 12.0 / double(pixels);
  }
  const double seen = std::sqrt(variance) / mean;
  // Stratified samples have a slightly lower error than estimated from their variance.
  EXPECT_LT(seen, 1.1 * estimate);
  EXPECT_GT(seen, 0.6 * estimate);
}

CUMULET_ON_BACKENDS(ViewerFrames);
CUMULET_ON_BACKENDS(ViewerSlab);

}  // namespace
