// The end of camera rays at surfaces: the raster pass compared with traced triangles and analytic results, also at
// edges. Previews and AOVs.

#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <cmath>
#include <numbers>

#include "support/gl_viewer.hpp"
#include "support/osmesa_leaks.hpp"
#include "support/surfaces.hpp"
#include "support/volumes.hpp"

namespace {

using namespace cumulet;
using glm::dvec3;
using glm::dvec4;
using glm::ivec3;
using glm::vec3;
using surface::Material;
using test::StillScene;
using viewer::Aov;
using viewer::SurfaceLight;

constexpr std::uint32_t side = 48;
constexpr double left = 3.5;   // left edge of the image in the world; its top is 27.5, and a pixel is half a unit
constexpr double scale = 0.5;  // world units per pixel
constexpr double sigma = 0.06;
constexpr double box_high = 31.5;
constexpr float infinite = std::numeric_limits<float>::infinity();

/// A homogeneous cube of 32 voxels seen along z by an orthographic camera, with unlit surfaces in front of it, inside
/// and behind. Each straight edge is at a multiple of an eighth of a pixel, which the layers of the raster pass
/// represent exactly.
class SurfacesInVolumes : public test::ViewerTest {
 protected:
  static constexpr float front_edge = 8.1875F;   // in front of the cube, left of it: 2 0 0
  static constexpr float inside_low = 12.3125F;  // inside, at z = 15.5: 0 1.5 0
  static constexpr float inside_high = 18.9375F;
  static constexpr float behind_edge = 9.125F;  // behind, below it: 1 1 1

  void SetUp() override {
    ViewerTest::SetUp();
    if (!context_) return;
    viewer_ = make();
    viewer_->set_volume(test::make_volume({32, 32, 32}, ivec3(0), [](const ivec3& /*p*/) { return 1.0F; }));
    viewer::CameraPose camera;
    camera.eye = {15.5, 15.5, 200.0};
    camera.target = {15.5, 15.5, 0.0};
    camera.orthographic_height = side * scale;
    viewer_->set_camera(camera);
    viewer::Medium medium;
    medium.density_scale = sigma;
    medium.albedo = vec3(0.0F);
    viewer_->set_medium(medium);
  }

  static std::shared_ptr<StillScene> scene(float brightness = 1.0F) {
    auto made = std::make_shared<StillScene>();
    for (const vec3 color : {vec3(2, 0, 0), vec3(0, 1.5F, 0), vec3(1), vec3(0, 0, 1)}) {
      Material material;
      material.unlit = true;
      material.base_color = glm::vec4(brightness * color, 1.0F);
      made->add(material);
    }
    const auto wall = [&](float x_0, float x_1, float y_0, float y_1, float z, std::uint32_t material) {
      made->add_quad({{{x_0, y_0, z}, {x_1, y_0, z}, {x_1, y_1, z}, {x_0, y_1, z}}}, material);
    };
    wall(-50, front_edge, -50, 80, 40, 0);
    wall(inside_low, inside_high, -50, 80, 15.5F, 1);
    wall(-50, 80, -50, behind_edge, -10, 2);
    made->add_sphere({23.0F, 18.0F, 15.0F}, 3.0F, 3, 48);
    return made;
  }
  void show(const std::shared_ptr<StillScene>& scene, SurfaceLight light) const {
    viewer_->viewer().set_surface_settings({{}, light});
    viewer_->viewer().show_surfaces(test::source_of(scene));
  }
  [[nodiscard]] test::Picture render(std::uint32_t seed, std::uint32_t samples = 256) const {
    return test::render(*viewer_, {side, side, samples, seed, render::View::shaded});
  }
  /// As render(), with the volume accumulated separately for its AOV.
  void trace_for_aovs(std::uint32_t samples) const {
    viewer_->set_image({side, side, samples, 1, render::View::shaded});
    viewer_->viewer().set_sampling({samples, 1, {render::View::shaded, false, true}});
    viewer_->build();
    while (!viewer_->render(1e9)) {
    }
  }
  [[nodiscard]] std::vector<float> read(Aov aov, std::size_t channels) const {
    std::vector<float> values(channels * side * side);
    viewer_->viewer().read_aov(aov, values.data(), values.size());
    return values;
  }
  static double to_sphere_edge(std::uint32_t x, std::uint32_t y) {
    return std::abs(std::hypot(left + (x + 0.5) * scale - 23.0, 27.5 - (y + 0.5) * scale - 18.0) - 3.0) / scale;
  }
  /// Distance from a pixel's center to the nearest edge of any surface, in pixels.
  static double to_edge(std::uint32_t x, std::uint32_t y) {
    const double wx = left + (x + 0.5) * scale;
    const double wy = 27.5 - (y + 0.5) * scale;
    double nearest = std::abs(wy - behind_edge);
    for (const double edge : {front_edge, inside_low, inside_high}) nearest = std::min(nearest, std::abs(wx - edge));
    return std::min(nearest / scale, to_sphere_edge(x, y));
  }
  /// Compares two modes for the same image: the mean squared difference relative to the expected noise, and the mean
  /// difference. Pixels within three pixels of an edge and the others are compared separately.
  void expect_same(SurfaceLight a, SurfaceLight b, const std::shared_ptr<StillScene>& scene) const {
    show(scene, a);
    const std::array<test::Picture, 2> first{render(1), render(2)};
    show(scene, b);
    const std::array<test::Picture, 2> second{render(3), render(4)};
    for (const bool strip : {true, false}) {
      for (int c = 0; c < 4; ++c) {
        double noise = 0.0;
        double all_noise = 0.0;
        double difference = 0.0;
        double sum = 0.0;
        int pixels = 0;
        for (std::uint32_t y = 0; y < side; ++y) {
          for (std::uint32_t x = 0; x < side; ++x) {
            if ((to_edge(x, y) < 3.0) != strip) continue;
            const std::size_t i = std::size_t{y} * side + x;
            const auto at = [&](const test::Picture& p) { return double(p.pixels[i][c]); };
            // Each has half the variance of a difference between seeds; so has the difference of both means.
            const double own =
                0.25 * (std::pow(at(first[0]) - at(first[1]), 2) + std::pow(at(second[0]) - at(second[1]), 2));
            const double d = 0.5 * (at(first[0]) + at(first[1]) - at(second[0]) - at(second[1]));
            all_noise += own;
            sum += d;
            ++pixels;
            // The raster pass resolves a slanted edge only in eighths.
            if (to_sphere_edge(x, y) < 1.0) continue;
            noise += own;
            difference += 0.5 * d * d;
          }
        }
        const double each = std::sqrt(all_noise / pixels);
        EXPECT_GT(pixels, 300);
        EXPECT_LT(difference, noise * 1.35 + 1e-9) << (strip ? "strip " : "interior ") << c;
        EXPECT_LT(std::abs(sum / pixels), 4.0 * each / std::sqrt(pixels) + 1e-6)
            << (strip ? "strip " : "interior ") << c;
      }
    }
  }

  std::unique_ptr<test::Still> viewer_;
};
CUMULET_ON_BACKENDS(SurfacesInVolumes);

TEST_P(SurfacesInVolumes, RasterizedSurfacesEndRaysLikeTriangles) {
  expect_same(SurfaceLight::none, SurfaceLight::full, scene());
}

// In-scattered light ends at the surfaces too. Black surfaces send no light to the volume, and a sun behind the camera
// casts no visible shadow.
TEST_P(SurfacesInVolumes, InscatteringEndsAtTriangles) {
  viewer::Medium medium;
  medium.density_scale = sigma;
  medium.albedo = vec3(0.9F, 0.6F, 0.3F);
  medium.max_bounces = 1;
  viewer_->set_medium(medium);
  viewer::Light light;
  light.sun_irradiance = vec3(8.0F);
  viewer_->set_light(light);
  expect_same(SurfaceLight::none, SurfaceLight::full, scene(0.0F));
}

// Columns at the front wall's edge and beside it: no bright or dark rim.
TEST_P(SurfacesInVolumes, SilhouettesHaveNoHalo) {
  for (const SurfaceLight mode : {SurfaceLight::none, SurfaceLight::full, SurfaceLight::shadows}) {
    show(scene(), mode);
    const test::Picture picture = render(5, 512);
    const double through = std::exp(-sigma * 32.0);
    const double to_inside = std::exp(-sigma * (box_high - 15.5));
    for (const auto& [edge, color, share] :
         {std::tuple(double(front_edge), 0, 1.0), std::tuple(double(inside_low), 1, to_inside)}) {
      const bool front = color == 0;
      const int middle = static_cast<int>((edge - left) / scale);
      for (int x = middle - 3; x <= middle + 3; ++x) {
        // Rows above the wall behind.
        double radiance = 0.0;
        double alpha = 0.0;
        const int rows = 30;
        for (int y = 0; y < rows; ++y) {
          const glm::vec4& p = picture.pixels[static_cast<std::size_t>(y) * side + static_cast<std::size_t>(x)];
          radiance += p[color] / rows;
          alpha += p.w / rows;
        }
        const double before = std::clamp((edge - left) / scale - x, 0.0, 1.0);  // part of the pixel left of the edge
        const double covered = front ? before : 1.0 - before;
        const double opaque = covered + (1.0 - covered) * (1.0 - through);
        const double brightness = front ? 2.0 : 1.5;
        const double error = 4.0 * brightness * 0.5 / std::sqrt(rows * 512.0);
        EXPECT_NEAR(radiance, covered * share * brightness, error) << "column " << x << " of " << middle;
        EXPECT_NEAR(alpha, opaque, 4.0 * 0.5 / std::sqrt(rows * 512.0)) << "column " << x << " of " << middle;
      }
    }
  }
}

TEST_P(SurfacesInVolumes, CameraMayBeInsideTheCloud) {
  viewer::CameraPose camera;
  camera.eye = {15.6, 15.4, 28.0};  // in the cube
  camera.target = {15.6, 15.4, 0.0};
  camera.fovy_degrees = 2.0;
  viewer_->set_camera(camera);
  for (const SurfaceLight mode : {SurfaceLight::none, SurfaceLight::full}) {
    show(scene(), mode);
    const dvec4 mean = render(6).mean();
    EXPECT_NEAR(mean.y, 1.5 * std::exp(-sigma * (28.0 - 15.5)), 0.01);
    EXPECT_NEAR(mean.w, 1.0, 1e-6);
  }
}

// The image does not depend on the camera's depth convention, bit by bit. Tested with and without host surfaces (whose
// depth both conventions represent exactly).
TEST_P(SurfacesInVolumes, StandardAndReversedDepthAreBitEqual) {
  auto functions = gl::load_functions(headless::Context::get_proc, context_.get());
  const gl::Object depth = gl::make_texture_2d(functions, GL_R32F, side, side, "depth");
  for (const SurfaceLight mode : {SurfaceLight::none, SurfaceLight::full}) {
    show(scene(), mode);
    viewer_->set_image({side, side, 16, 1, render::View::shaded});
    viewer_->build();
    for (const bool host : {false, true}) {
      std::array<std::vector<float>, 2> pictures;
      for (const bool reversed : {false, true}) {
        viewer::CameraPose camera;
        camera.eye = {15.5, 15.5, 220.0};
        camera.target = {15.5, 15.5, 0.0};
        camera.fovy_degrees = 6.0;
        camera.near_plane = 100.0;
        camera.far_plane = 300.0;
        camera.depth = reversed ? viewer::DepthConvention::reversed : viewer::DepthConvention::standard;
        viewer_->set_camera(camera);
        viewer::Frame frame;
        frame.target = viewer::Target::none;
        frame.size = {side, side};
        frame.viewport = {0, 0, side, side};
        frame.budget_ms = 1e9;
        if (host) {
          // A wall at depth 200 in front of the upper half.
          std::vector<float> values(std::size_t{side} * side, reversed ? 0.0F : 1.0F);
          for (std::size_t i = values.size() / 2; i < values.size(); ++i) values[i] = reversed ? 0.25F : 0.75F;
          functions->TextureSubImage2D(depth.name(), 0, 0, 0, side, side, GL_RED, GL_FLOAT, values.data());
          frame.depth_source = render::DepthSource::texture;
          frame.depth_name = depth.name();
        }
        while (!viewer_->viewer().render(frame).converged) {
        }
        std::vector<float>& rgba = pictures.at(reversed ? 1 : 0);
        rgba.resize(std::size_t{4} * side * side);
        viewer_->viewer().read_linear(rgba.data(), rgba.size());
      }
      EXPECT_TRUE(pictures[0] == pictures[1]) << "host " << host;
      double green = 0.0;
      for (std::size_t i = 1; i < pictures[0].size() / 2; i += 4) green += pictures[0][i];
      // The inner wall is behind the host's: z = 204.5.
      if (host) {
        EXPECT_EQ(green, 0.0);
      } else {
        EXPECT_GT(green, 10.0);
      }
    }
  }
}

// BLEND materials in front of the volume, inside and behind: a fraction of the rays passes through.
TEST_P(SurfacesInVolumes, BlendedSurfacesAreSortedAgainstTheVolume) {
  for (const SurfaceLight mode : {SurfaceLight::none, SurfaceLight::full}) {
    for (const float z : {40.0F, 15.5F, -10.0F}) {
      auto made = std::make_shared<StillScene>();
      Material veil;
      veil.unlit = true;
      veil.double_sided = true;
      veil.alpha_mode = surface::AlphaMode::blend;
      veil.base_color = {2.0F, 0.0F, 0.0F, 0.25F};
      made->add(veil);
      Material back;
      back.unlit = true;
      back.base_color = {0.0F, 0.0F, 1.0F, 1.0F};
      made->add(back);
      made->add_quad({{{-50, -50, z}, {80, -50, z}, {80, 80, z}, {-50, 80, z}}}, 0);
      made->add_quad({{{-50, -50, -20}, {80, -50, -20}, {80, 80, -20}, {-50, 80, -20}}}, 1);
      show(made, mode);
      const dvec4 mean = render(8, 64).mean();
      const double depth = z > 30.0F ? 0.0 : (z > 0.0F ? 16.0 : 32.0);
      EXPECT_NEAR(mean.x, 2.0 * 0.25 * std::exp(-sigma * depth), 0.015) << z;
      EXPECT_NEAR(mean.z, 0.75 * std::exp(-sigma * 32.0), 0.01) << z;
      EXPECT_NEAR(mean.w, 1.0, 1e-6);
    }
  }
}

TEST_P(SurfacesInVolumes, AovsMatchAnalyticValues) {
  for (const SurfaceLight mode : {SurfaceLight::none, SurfaceLight::full}) {
    show(scene(), mode);
    trace_for_aovs(128);
    const auto beauty = read(Aov::beauty, 4);
    const auto volume = read(Aov::volume, 4);
    const auto transmittance = read(Aov::transmittance, 1);
    const auto surface_z = read(Aov::surface_depth, 1);
    const auto volume_z = read(Aov::volume_depth, 1);
    const auto normal = read(Aov::normal, 3);
    const auto albedo = read(Aov::albedo, 3);
    const auto pixel_at = [](double x, double y) {
      return static_cast<std::size_t>((27.5 - y) / scale) * side + static_cast<std::size_t>((x - left) / scale);
    };
    struct Expected {
      double x, y, depth, z;
      vec3 albedo;
    };
    for (const auto& [x, y, depth, z, color] :
         {Expected{6.0, 20.0, 0.0, 160.0, {2, 0, 0}}, Expected{15.0, 20.0, 16.0, 184.5, {0, 1.5F, 0}},
          Expected{10.0, 6.0, 32.0, 210.0, {1, 1, 1}}, Expected{23.1, 18.1, 13.5, 182.0, {0, 0, 1}},
          Expected{10.0, 20.0, 32.0, infinite, {0, 0, 0}}}) {
      const std::size_t i = pixel_at(x, y);
      EXPECT_NEAR(transmittance[i], std::exp(-sigma * depth), 0.003) << x << " " << y;
      if (std::isinf(z)) {
        EXPECT_EQ(surface_z[i], infinite);
      } else {
        EXPECT_NEAR(surface_z[i], z, 0.05) << x << " " << y;
      }
      const double half = std::log(2.0) / sigma;
      if (half < depth) {
        EXPECT_NEAR(volume_z[i], 200.0 - box_high + half, 0.01);
      } else {
        EXPECT_EQ(volume_z[i], infinite) << x << " " << y;
      }
      for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(albedo[3 * i + c], color[static_cast<int>(c)], 1e-3);
      EXPECT_NEAR(normal[3 * i + 2], std::isinf(z) ? 0.0 : 1.0, 0.02) << x << " " << y;
      EXPECT_NEAR(volume[4 * i + 3], 1.0 - std::exp(-sigma * depth), 0.2);
    }
    // In the whole image: the dark volume has no radiance, and its alpha is 1 - transmittance.
    double alpha = 0.0;
    for (std::size_t i = 0; i < std::size_t{side} * side; ++i) {
      alpha += (volume[4 * i + 3] - (1.0 - transmittance[i])) / (side * side);
      EXPECT_EQ(volume[4 * i], 0.0F);
      EXPECT_LE(volume[4 * i + 3], beauty[4 * i + 3] + 1e-6F);
    }
    EXPECT_NEAR(alpha, 0.0, 0.004);
  }
}

TEST_P(SurfacesInVolumes, EmissionIsOnlyInTheVolumeAov) {
  for (const SurfaceLight mode : {SurfaceLight::none, SurfaceLight::full}) {
    show(scene(), mode);
    viewer_->set_medium({sigma, vec3(0.0F), {0.0F}, 0, vec3(2.0F)});
    trace_for_aovs(64);
    const std::vector<float> volume = read(Aov::volume, 4);
    const std::vector<float> transmittance = read(Aov::transmittance, 1);
    double difference = 0.0;
    for (std::size_t i = 0; i < transmittance.size(); ++i) {
      difference += volume[4 * i] - 2.0 * (1.0 - transmittance[i]);
    }
    EXPECT_NEAR(difference / (side * side), 0.0, 0.01) << int(mode);
  }
}

TEST_P(SurfacesInVolumes, UnavailableAovsGiveAOneLineError) {
  show(scene(), SurfaceLight::full);
  (void)render(1, 4);
  std::vector<float> values(std::size_t{4} * side * side);
  const auto message = [&](Aov aov, std::size_t count) {
    try {
      viewer_->viewer().read_aov(aov, values.data(), count);
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(message(Aov::normal, values.size()), "");
  EXPECT_NE(message(Aov::volume, values.size()).find("separate_volume_aov"), std::string::npos);
  EXPECT_NE(message(Aov::normal, 7).find("6912 floats"), std::string::npos);
}

TEST_P(SurfacesInVolumes, SurfacesAreShownBeforeTheVolumeIsLoaded) {
  viewer_->set_volume(test::noise_volume({160, 160, 160}, ivec3(0), 3));
  show(scene(), SurfaceLight::full);
  viewer_->viewer().set_display({0.0F, render::ToneMap::clip, true});
  auto functions = gl::load_functions(headless::Context::get_proc, context_.get());
  viewer::Frame frame;
  frame.target = viewer::Target::texture;
  frame.format = GL_RGBA32F;
  frame.encoding = render::ColorEncoding::hdr;
  frame.size = {side, side};
  frame.viewport = {0, 0, side, side};
  frame.flip_y = true;
  frame.budget_ms = 0.5;
  const auto red = [&] {
    const viewer::FrameResult result = viewer_->viewer().render(frame);
    std::vector<glm::vec4> pixels(std::size_t{side} * side);
    functions->GetTextureImage(result.texture, 0, GL_RGBA, GL_FLOAT, static_cast<GLsizei>(pixels.size() * 16),
                               pixels.data());
    return pixels[std::size_t{side} * 12 + 2].x;
  };
  // Each frame does at least one step of the upload, and there are fewer than 60.
  float seen = red();
  for (int frames = 1; frames < 60 && seen == 0.0F; ++frames) seen = red();
  EXPECT_NEAR(seen, 2.0F, 0.01F);
  // They disappear when the surfaces are removed.
  viewer_->viewer().set_surfaces(nullptr);
  viewer_->set_volume(viewer::VolumeAssetPtr());
  EXPECT_EQ(red(), 0.0F);
}

// While the volume's preview is coarse, surfaces have full resolution, in front of it and behind. They are also in the
// image that is read back.
TEST_P(SurfacesInVolumes, PreviewsShowSurfacesAtFullResolution) {
  show(scene(), SurfaceLight::full);
  viewer::Sampling sampling;
  sampling.samples = 16;
  viewer_->viewer().set_sampling(sampling);
  viewer_->viewer().set_display({0.0F, render::ToneMap::clip, true});
  viewer_->build();
  auto functions = gl::load_functions(headless::Context::get_proc, context_.get());
  constexpr std::uint32_t fine = 4 * side;
  viewer::Frame frame;
  frame.target = viewer::Target::texture;
  frame.format = GL_RGBA32F;
  frame.encoding = render::ColorEncoding::hdr;
  frame.size = {fine, fine};
  frame.viewport = {0, 0, fine, fine};
  frame.flip_y = true;
  frame.budget_ms = 0.5;
  viewer::FrameResult result;
  // On a busy machine a frame this short may do no work.
  const auto end = std::chrono::steady_clock::now() + std::chrono::minutes(1);
  while (result.size == glm::uvec2(0U) && std::chrono::steady_clock::now() < end)
    result = viewer_->viewer().render(frame);
  ASSERT_GT(result.size.x, 0U);
  ASSERT_LT(result.size.x, fine);
  std::vector<glm::vec4> pixels(std::size_t{fine} * fine);
  functions->GetTextureImage(result.texture, 0, GL_RGBA, GL_FLOAT, static_cast<GLsizei>(pixels.size() * 16),
                             pixels.data());
  // The front wall's edge in the middle row: full color on its side, none beyond it.
  const auto edge = static_cast<std::size_t>((front_edge - left) / scale * 4.0);
  const std::size_t row = std::size_t{fine} / 4 * fine;
  double inside = 0.0;
  for (std::size_t x = 0; x < edge - 8; ++x) inside += pixels[row + x].x / double(edge - 8);
  EXPECT_NEAR(inside, 2.0, 0.02);
  EXPECT_GT(pixels[row + edge - 3].x, 0.9F);
  EXPECT_LT(pixels[row + edge + 3].x, 1e-3F);
  // The inner wall is attenuated by the coarse volume.
  double dimmed = 0.0;
  int count = 0;
  for (std::size_t y = 0; y < fine * 5 / 8; ++y) {
    for (std::size_t x = 84; x < 108; ++x) {  // 14 to 17 in the world
      dimmed += pixels[y * fine + x].y;
      ++count;
    }
  }
  EXPECT_NEAR(dimmed / count, 1.5 * std::exp(-sigma * 16.0), 0.12);
  // The image that is read back is coarse but complete.
  std::vector<glm::vec4> coarse(std::size_t{result.size.x} * result.size.y);
  viewer_->viewer().read_linear(&coarse[0].x, coarse.size() * 4);
  EXPECT_NEAR(coarse[std::size_t{result.size.x} * (result.size.y / 4) + 1].x, 2.0, 0.05);
  // At rest the path traced image replaces it.
  frame.budget_ms = 1e9;
  while (!(result = viewer_->viewer().render(frame)).converged) {
  }
  EXPECT_EQ(result.size.x, fine);
}

}  // namespace
