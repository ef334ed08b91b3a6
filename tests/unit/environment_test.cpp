// Environments: reading, sampling, and images compared with equivalent lights.

#include "light/environment.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "base/error.hpp"
#include "light/environment_file.hpp"
#include "light/light_table.hpp"
#include "scene/raster_source.hpp"
#include "support/environments.hpp"
#include "support/folder.hpp"
#include "support/gl_viewer.hpp"
#include "support/refusal.hpp"
#include "support/surfaces.hpp"
#include "support/volumes.hpp"

// Traversals of all grid types share one signature, so each leaves some parameters unused. Kinds of light do too.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-parameter"

namespace cumulet::core {
#include "light/prefiltered.glsl"
#include "surface/ggx.glsl"

/// The shaders' path tracer over voxels with an environment, compiled as C++.
struct CpuEnvironment {
  CmParameters cm{};
  const volume::ScalarVolume* volume = nullptr;
  const light::Environment* environment = nullptr;
  ivec3 origin{0};
  float cm_surface_z(uvec2 pixel, vec2 within, uint layer) const { return 3.0e38F; }
  float cm_voxel(ivec3 voxel) const { return test::value_at(*volume, voxel + origin) / volume->max_value; }
  uvec4 cm_environment_word(uint i) const { return environment->words.at(i); }
#define CM_MARCH 1
#undef CM_ENVIRONMENT
#define CM_ENVIRONMENT 1
#include "support/traced.inc"
#undef CM_MARCH
};

}  // namespace cumulet::core

#pragma GCC diagnostic pop

namespace {

using namespace cumulet;
using glm::dvec3;
using glm::ivec3;
using glm::vec3;
using test::direction;
using test::environment_of;
using test::pi;

core::CpuEnvironment twin(const light::Environment& environment, float degrees = 0.0F) {
  core::CpuEnvironment cpu;
  cpu.environment = &environment;
  cpu.cm.environment = {{environment.width, environment.height}, 0, environment.density};
  cpu.cm.lights.environment_strength = 1.0F;
  cpu.cm.lights.environment_turn = {std::cos(glm::radians(degrees)), std::sin(glm::radians(degrees))};
  return cpu;
}

TEST(Environment, CenterMapsToZLeftToXAndRotationGoesFromZToX) {
  const auto environment = environment_of(64, 32, [](std::uint32_t x, std::uint32_t y) {
    return vec3(x == 16 ? 1.0F : 0.0F, y < 8 ? 1.0F : 0.0F, x == 32 ? 1.0F : 0.0F);
  });
  const auto at = [&](const vec3& w, float degrees) {
    return twin(*environment, degrees).cm_environment_radiance(glm::normalize(w));
  };
  EXPECT_GT(at({0.0F, 0.0F, 1.0F}, 0.0F).z, 0.4F);
  EXPECT_GT(at({1.0F, 0.0F, 0.0F}, 0.0F).x, 0.4F);
  EXPECT_EQ(at({-1.0F, 0.0F, 0.0F}, 0.0F).x, 0.0F);
  EXPECT_EQ(at({0.0F, 1.0F, 0.0F}, 0.0F).y, 1.0F);
  EXPECT_EQ(at({0.0F, -1.0F, 0.0F}, 0.0F).y, 0.0F);
  EXPECT_GT(at({1.0F, 0.0F, 0.0F}, 90.0F).z, 0.4F);
  EXPECT_GT(at({0.0F, 0.0F, -1.0F}, 90.0F).x, 0.4F);
}

// Random texels, a few of them very bright.
light::EnvironmentPtr uneven() {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> unit(0.0F, 1.0F);
  return environment_of(48, 24, [&](std::uint32_t, std::uint32_t) {
    const float u = unit(random);
    return u < 0.3F ? vec3(0.0F) : vec3(u, u * u, unit(random)) * (u > 0.99F ? 3000.0F : 1.0F);
  });
}

TEST(Environment, SamplingPdfIntegratesToOneAndMatchesSamples) {
  const auto environment = uneven();
  core::CpuEnvironment cpu = twin(*environment, 70.0F);
  constexpr std::size_t columns = 12;
  constexpr std::size_t rows = 6;
  std::vector<double> expected(columns * rows);
  constexpr int fine = 96;  // points along each side of a bin
  double sum = 0.0;
  for (std::size_t bin = 0; bin < expected.size(); ++bin) {
    for (int i = 0; i < fine * fine; ++i) {
      const double column = double(bin % columns) + (i % fine + 0.5) / fine;
      const double row = double(bin / columns) + (std::floor(double(i) / fine) + 0.5) / fine;
      const double azimuth = 2.0 * pi * column / columns;
      const double down = pi * row / rows;
      const double area = 2.0 * pi * pi / (columns * rows) / (fine * fine) * std::sin(down);
      expected[bin] += area * cpu.cm_surrounding(direction(azimuth, down)).density;
    }
    sum += expected[bin];
  }
  EXPECT_NEAR(sum, 1.0, 2e-3);
  constexpr int draws = 400000;
  std::vector<double> drawn(expected.size());
  core::CpuEnvironment::CmPath p{};
  p.random = 1;
  p.stream = 3;
  double mean = 0.0;
  for (int i = 0; i < draws; ++i) {
    const float u_0 = cpu.cm_random(p.random, p.stream);
    const float u_1 = cpu.cm_random(p.random, p.stream);
    const auto sample = cpu.cm_environment_sample(p, vec3(0.0F), vec3(u_0, u_1, 0.5F));
    EXPECT_NEAR(glm::length(sample.direction), 1.0F, 1e-4F);
    double azimuth = std::atan2(double(sample.direction.x), double(sample.direction.z)) / (2.0 * pi);
    if (azimuth < 0.0) azimuth += 1.0;
    const double down = std::acos(std::clamp(double(sample.direction.y), -1.0, 1.0)) / pi;
    const auto column = std::min(columns - 1, static_cast<std::size_t>(azimuth * columns));
    const auto row = std::min(rows - 1, static_cast<std::size_t>(down * rows));
    drawn[row * columns + column] += 1.0;
    mean += sample.radiance.y / sample.pdf / draws;
  }
  for (std::size_t bin = 0; bin < expected.size(); ++bin) {
    const double count = expected[bin] * draws;
    EXPECT_NEAR(drawn[bin], count, 4.5 * std::sqrt(count) + 0.004 * count + 2.0) << bin;
  }
  EXPECT_NEAR(mean, 4.0 * pi * environment->mean.y, 0.02 * mean);
}

core::CmHarmonics block_of(const light::Harmonics& h) {
  const auto at = [&](std::size_t i) { return glm::vec4(h[i], 0.0F); };
  return {at(0), at(1), at(2), at(3), at(4), at(5), at(6), at(7)};
}

// Compares irradiance / pi from spherical harmonics and from quadrature, for normals in all directions.
void expect_irradiance(const light::Environment& environment, double share) {
  core::CpuEnvironment cpu = twin(environment);
  const core::CmHarmonics harmonics = block_of(environment.harmonics);
  constexpr int columns = 128;
  constexpr int rows = 64;
  for (int k = 0; k < 40; ++k) {
    const vec3 normal = direction(2.4 * k, std::acos(1.0 - 2.0 * (k + 0.5) / 40.0));
    dvec3 expected(0.0);
    for (int i = 0; i < columns * rows; ++i) {
      const double down = pi * (std::floor(double(i) / columns) + 0.5) / rows;
      const vec3 w = direction(2.0 * pi * (i % columns + 0.5) / columns, down);
      const double area = 2.0 * pi * pi / (columns * rows) * std::sin(down);
      expected += dvec3(cpu.cm_environment_radiance(w)) * (area / pi * std::max(0.0F, glm::dot(normal, w)));
    }
    const dvec3 got = environment.mean + dvec3(core::cm_harmonics(harmonics, normal, core::CM_MATTE_ORDERS));
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(got[c], expected[c], share * environment.mean[c]) << k << ' ' << c;
  }
}

// Warm above, cold below, and the left half twice as bright as the right.
vec3 two_colors(std::uint32_t x, std::uint32_t y) {
  return (y < 32 ? vec3(1.0F, 0.6F, 0.2F) : vec3(0.1F, 0.3F, 0.9F)) * (x < 64 ? 1.0F : 0.5F);
}

TEST(Environment, SphericalHarmonicsMatchIrradiance) {
  expect_irradiance(*environment_of(128, 64, [](auto, auto) { return vec3(0.3F, 2.0F, 7.0F); }), 1e-3);
  expect_irradiance(*environment_of(128, 64, two_colors), 0.01);
  // A smooth function of all orders up to the second: exact except for the texels.
  const auto smooth = environment_of(128, 64, [](std::uint32_t x, std::uint32_t y) {
    const vec3 w = direction(2.0 * pi * (0.5 - (x + 0.5) / 128.0), pi * (y + 0.5) / 64.0);
    return vec3(2.0F + w.x - 0.5F * w.y, 1.5F + w.x * w.z + w.z, 2.0F + w.y * w.y - w.x * w.x + w.y * w.z + w.x * w.y);
  });
  expect_irradiance(*smooth, 2e-3);
  // The worst case: light from a single direction. At its peak the irradiance is 4 times its mean.
  expect_irradiance(*environment_of(128, 64, [](auto x, auto y) { return vec3(x == 20 && y == 25 ? 5000.0F : 0.0F); }),
                    0.35);
}

TEST(Environment, NonFinitePixelsCountAsZeroAndAreReported) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const auto environment = environment_of(2, 2, [&](std::uint32_t x, std::uint32_t y) {
    if (y == 0) return x == 0 ? vec3(nan, 1.0F, 1.0F) : vec3(1.0F, -1.0F, 1.0F);
    return x == 0 ? vec3(std::numeric_limits<float>::infinity()) : vec3(1.0F);
  });
  EXPECT_EQ(environment->replaced, 3U);
  EXPECT_NEAR(environment->mean.x, 0.5, 1e-6);
  EXPECT_NEAR(environment->mean.y, 0.5, 1e-6);
  const auto dark = environment_of(4, 2, [](std::uint32_t, std::uint32_t) { return vec3(0.0F); });
  EXPECT_EQ(dark->density, 0.0F);
  EXPECT_EQ(light::LightTable({}, {dark}, {}, {}).parameters().any, 0U);
}

TEST(Environment, PreservesRadianceOfAnyMagnitude) {
  for (const float value : {1e30F, 72704.0F, 1.0F, 0.3F, 1e-12F, 1e-38F}) {
    const auto environment =
        environment_of(1, 1, [&](std::uint32_t, std::uint32_t) { return vec3(value, 0.5F * value, 0.0F); });
    core::CpuEnvironment cpu = twin(*environment);
    const vec3 kept = cpu.cm_environment_texel(0);
    EXPECT_NEAR(kept.x / value, 1.0F, 6e-4F) << value;
    EXPECT_NEAR(kept.y / value, 0.5F, 6e-4F) << value;
    EXPECT_EQ(kept.z, 0.0F);
  }
}

TEST(Environment, DownsampledPixelsAreMeans) {
  const auto environment =
      environment_of(8, 4, [](std::uint32_t x, std::uint32_t y) { return vec3(float(x), float(y), 1.0F); });
  const std::vector<vec3> half = light::pixels_of(*environment, 4, 2);
  ASSERT_EQ(half.size(), 8U);
  for (std::uint32_t i = 0; i < 8; ++i) {
    EXPECT_EQ(half[i], vec3(2.0F * float(i % 4) + 0.5F, 2.0F * float(i / 4) + 0.5F, 1.0F)) << i;
  }
  const std::vector<vec3> one = light::pixels_of(*environment, 1, 1);
  EXPECT_EQ(one.at(0), vec3(3.5F, 1.5F, 1.0F));
  const std::vector<vec3> larger = light::pixels_of(*environment, 16, 5);
  EXPECT_EQ(larger.at(0), vec3(0.0F, 0.0F, 1.0F));
  EXPECT_EQ(larger.at(16 * 5 - 1), vec3(7.0F, 3.0F, 1.0F));
}

std::string refusal_of(const light::EnvironmentPixels& pixels) {
  return test::refusal([&] { light::make_environment(pixels, "host"); });
}

TEST(Environment, InvalidSizesGiveOneLineErrors) {
  EXPECT_EQ(refusal_of({0, 4, {}}), "host: the environment has 0x4 pixels");
  EXPECT_EQ(refusal_of({32768, 1, {}}), "host: the environment has 32768x1 pixels; the limit is 16384 per side");
  EXPECT_EQ(refusal_of({2, 2, {vec3(1.0F)}}), "host: the environment size is 2x2 pixels, but it has 1 values");
  EXPECT_EQ(test::refusal([] {
              light::make_environment({0, 4, {}}, "two\nlines");
            }),
            "two lines: the environment has 0x4 pixels");
  EXPECT_EQ(test::refusal([] { light::read_environment("two\nlines.hdr"); }),
            "two lines.hdr: No such file or directory");
}

std::string radiance_file(const std::string& resolution, const std::string& body) {
  return "#?RADIANCE\n# a comment\nFORMAT=32-bit_rle_rgbe\n\n" + resolution + "\n" + body;
}

TEST(EnvironmentFile, FolderIsRejected) {
  const test::Folder folder;
  const std::string path = (folder / "").string();
  try {
    light::read_environment(path);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::file);
    EXPECT_EQ(std::string(error.what()).find(path), 0U) << error.what();
  }
}

TEST(EnvironmentFile, RadianceHdrIsReadFlatAndRunLengthEncoded) {
  const test::Folder folder;
  const std::string path = (folder / "a.hdr").string();
  const auto read = [&](const std::string& text) {
    std::ofstream(path, std::ios::binary) << text;
    return light::read_environment(path);
  };
  const std::string flat("\x80\x40\x20\x81\x80\x80\x80\x82", 8);
  const light::EnvironmentPixels two = read(radiance_file("-Y 1 +X 2", flat));
  EXPECT_EQ(two.values.at(0), vec3(1.0F, 0.5F, 0.25F));
  EXPECT_EQ(two.values.at(1), vec3(2.0F));
  std::string runs("\x02\x02\x00\x08", 4);
  for (const char* channel : {"\x88\x80", "\x88\x40", "\x08\x20\x20\x20\x20\x20\x20\x20\x10", "\x88\x81"})
    runs += channel;
  const light::EnvironmentPixels eight = read(radiance_file("-Y 1 +X 8", runs));
  EXPECT_EQ(eight.values.at(0), vec3(1.0F, 0.5F, 0.25F));
  EXPECT_EQ(eight.values.at(7), vec3(1.0F, 0.5F, 0.125F));
  const auto why = [&](const std::string& text) { return test::refusal([&] { read(text); }); };
  EXPECT_EQ(why(""), path + ": truncated Radiance file");
  EXPECT_EQ(why("no picture\n"), path + ": neither a Radiance (.hdr) nor an OpenEXR file");
  EXPECT_EQ(why(radiance_file("-Y 1 +X 8", runs.substr(0, 8))), path + ": truncated Radiance file");
  EXPECT_EQ(why(radiance_file("-Y 9999 +X 9999", runs)), path + ": truncated Radiance file");
  EXPECT_EQ(why(radiance_file("-Y 16 +X 32000", runs)),
            path + ": the environment has 32000x16 pixels; the limit is 16384 per side");
  EXPECT_EQ(why(radiance_file("+X 8 -Z 1", runs)),
            path + ": has the resolution '+X 8 -Z 1', which is not of a form such as '-Y HEIGHT +X WIDTH'");
  runs[4] = '\xff';
  EXPECT_EQ(why(radiance_file("-Y 1 +X 8", runs)), path + ": a run exceeds its row");
  EXPECT_EQ(test::refusal([&] { light::read_environment((folder / "none.hdr").string()); }),
            (folder / "none.hdr").string() + ": No such file or directory");
  EXPECT_NE(why(std::string("\x76\x2f\x31\x01nonsense", 12)).find(path + ": not a readable OpenEXR file: "),
            std::string::npos);
}

class EnvironmentLighting : public test::ViewerTest {
 protected:
  struct Seen {
    dvec3 mean{0.0};
    dvec3 error{0.0};  // of the mean
  };
  // Renders two seeds, to estimate the error of the mean.
  static Seen see(test::Still& still, std::uint32_t samples) {
    Seen seen;
    std::vector<test::Picture> pictures;
    for (const std::uint32_t seed : {1U, 2U}) pictures.push_back(test::render(still, {24, 24, samples, seed}));
    for (const test::Picture& picture : pictures) seen.mean += 0.5 * dvec3(picture.mean());
    dvec3 squares(0.0);
    const std::size_t count = pictures[0].pixels.size();
    for (std::size_t i = 0; i < count; ++i) {
      const dvec3 difference = dvec3(pictures[0].pixels[i]) - dvec3(pictures[1].pixels[i]);
      squares += difference * difference;
    }
    seen.error = 0.5 * glm::sqrt(squares) / double(count);
    return seen;
  }
  static void expect_same(const Seen& a, const Seen& b, double share) {
    for (int c = 0; c < 3; ++c) {
      EXPECT_NEAR(a.mean[c], b.mean[c], 4.0 * std::hypot(a.error[c], b.error[c]) + share * b.mean[c]) << c;
    }
  }
  std::unique_ptr<test::Still> ball(float g, vec3 albedo) {
    auto still = make();
    still->set_volume(test::make_volume(
        ivec3(20), ivec3(0), [](const ivec3& p) { return glm::length(glm::vec3(p) - 9.5F) < 9.0F ? 1.0F : 0.0F; }));
    still->set_camera(test::camera_at({9.5, 9.5, 60.0}, {9.5, 9.5, 9.5}, 25.0));
    still->set_medium({0.15, albedo, {g}, 0});
    return still;
  }
};

CUMULET_ON_BACKENDS(EnvironmentLighting);

TEST_P(EnvironmentLighting, UniformEnvironmentEqualsUniformSky) {
  const vec3 color(0.25F, 0.5F, 1.0F);
  const auto still = ball(0.6F, vec3(0.9F, 0.8F, 1.0F));
  still->set_light({30.0F, 20.0F, vec3(0.5F), color});
  const Seen sky = see(*still, 32);
  still->set_light({30.0F, 20.0F, vec3(0.5F), vec3(7.0F)});  // hidden by the environment
  still->viewer().set_environment(environment_of(16, 8, [&](std::uint32_t, std::uint32_t) { return 0.5F * color; }));
  still->viewer().set_environment_settings({40.0F, 2.0F});
  expect_same(see(*still, 32), sky, 1e-3);
  still->viewer().set_environment(nullptr);
  still->set_light({30.0F, 20.0F, vec3(0.5F), color});
  expect_same(see(*still, 32), sky, 0.0);
}

TEST_P(EnvironmentLighting, WhiteFurnaceHasOneColor) {
  const auto still = ball(0.0F, vec3(1.0F));
  still->set_light({});
  still->viewer().set_environment(environment_of(8, 4, [](std::uint32_t, std::uint32_t) { return vec3(1.0F); }));
  const Seen seen = see(*still, 64);
  EXPECT_NEAR(seen.mean.x, 1.0, 4.0 * seen.error.x + 1e-4);
  EXPECT_LT(seen.error.x, 2e-3);
}

// Shading without shadows is exact for convex objects.
TEST_P(EnvironmentLighting, RasterizedSpheresMatchPathTracedOnes) {
  const auto still = make();
  still->set_volume(test::make_volume(ivec3(4), ivec3(-2, -2, -20), [](const ivec3&) { return 1.0F; }));
  still->set_medium({1e-6, vec3(1.0F), {0.0F}, 0});
  viewer::CameraPose camera = test::camera_at({0, 0, 30}, {0, 0, 0});
  camera.orthographic_height = 10.0;
  still->set_camera(camera);
  still->set_light({});
  still->viewer().set_environment(environment_of(128, 64, two_colors));
  still->viewer().set_environment_settings({30.0F, 1.5F});
  struct Kind {
    surface::Material material;
    double most;  // largest difference, relative to the brightest
  };
  surface::Material plastic = test::diffuse(vec3(0.5F));
  plastic.specular = 1.0F;
  plastic.roughness = 0.5F;
  const auto metal = [](float roughness) {
    surface::Material material;
    material.roughness = roughness;
    return material;
  };
  for (const auto& [material, most] :
       {Kind{test::diffuse(vec3(1.0F)), 0.03}, Kind{plastic, 0.03}, Kind{metal(0.6F), 0.06}, Kind{metal(0.4F), 0.1},
        Kind{metal(0.2F), 0.06}, Kind{metal(0.0F), 0.02}}) {
    auto scene = std::make_shared<test::StillScene>();
    scene->add_sphere(vec3(0.0F), 4.9F, scene->add(material), 64);
    still->viewer().show_surfaces(test::source_of(scene));
    std::vector<test::Picture> pictures;
    for (const auto light : {viewer::SurfaceLight::none, viewer::SurfaceLight::full}) {
      still->viewer().set_surface_settings({{}, light});
      pictures.push_back(test::render(*still, {40, 40, 48, 1}));
    }
    double worst = 0.0;
    for (std::uint32_t block = 0; block < 25; ++block) {
      dvec3 difference(0.0);
      int inside = 0;
      for (std::uint32_t i = 0; i < 64; ++i) {
        const std::uint32_t x = block % 5 * 8 + i % 8;
        const std::uint32_t y = block / 5 * 8 + i / 8;
        if (std::hypot(x - 19.5, y - 19.5) > 18.0) continue;
        difference += dvec3(pictures[0].pixels[y * 40 + x] - pictures[1].pixels[y * 40 + x]);
        ++inside;
      }
      if (inside < 20) continue;
      for (int c = 0; c < 3; ++c) worst = std::max(worst, std::abs(difference[c] / inside));
    }
    EXPECT_LT(worst / 1.5, most) << material.roughness;
  }
}

// Rasterized glossy surfaces show the current environment, independent of the previous one.
TEST_P(EnvironmentLighting, RasterizedReflectionsUseTheCurrentEnvironment) {
  const auto glossy = [&] {
    auto still = make();
    still->set_volume(test::make_volume(ivec3(4), ivec3(-2, -2, -20), [](const ivec3&) { return 1.0F; }));
    still->set_medium({1e-6, vec3(1.0F), {0.0F}, 0});
    still->set_camera(test::camera_at({0, 0, 30}, {0, 0, 0}));
    still->set_light({0.0F, 0.0F, vec3(0.0F), vec3(0.2F, 0.3F, 0.4F)});
    auto scene = std::make_shared<test::StillScene>();
    surface::Material metal;
    metal.roughness = 0.2F;
    scene->add_sphere(vec3(0.0F), 4.9F, scene->add(metal), 32);
    still->viewer().show_surfaces(test::source_of(scene));
    still->viewer().set_surface_settings({{}, viewer::SurfaceLight::none});
    return still;
  };
  const auto shown = [](test::Still& still, const light::EnvironmentPtr& environment) {
    still.viewer().set_environment(environment);
    return test::render(still, {24, 24, 4, 1});
  };
  const light::EnvironmentPtr halves = environment_of(128, 64, two_colors);
  const light::EnvironmentPtr turned =
      environment_of(128, 64, [](auto x, auto y) { return two_colors(127 - x, 63 - y); });
  const light::EnvironmentPtr even = environment_of(8, 4, [](auto, auto) { return vec3(0.5F); });
  const auto still = glossy();
  std::vector<test::Picture> pictures;
  for (const light::EnvironmentPtr& environment :
       {turned, halves, even, halves, light::EnvironmentPtr(), turned, light::EnvironmentPtr()}) {
    pictures.push_back(shown(*still, environment));
    const test::Picture expected = shown(*glossy(), environment);
    double worst = 0.0;
    for (std::size_t i = 0; i < expected.pixels.size(); ++i)
      worst = std::max(worst, double(glm::length(pictures.back().pixels[i] - expected.pixels[i])));
    EXPECT_LT(worst, 1e-4) << pictures.size();
  }
  for (std::size_t i = 1; i < pictures.size(); ++i) EXPECT_NE(pictures[i].pixels, pictures[i - 1].pixels) << i;
}

TEST_P(EnvironmentLighting, BrightTexelLightsLikeASun) {
  const auto still = ball(0.3F, vec3(0.9F));
  constexpr std::uint32_t width = 512;
  constexpr std::uint32_t height = 256;
  constexpr std::uint32_t column = 150;
  constexpr std::uint32_t row = 90;
  const double down = pi * (row + 0.5) / height;
  const double azimuth = 2.0 * pi * (0.5 - (column + 0.5) / width);
  const double solid_angle = std::sin(down) * (2.0 * pi / width) * (pi / height);
  still->set_light({static_cast<float>(glm::degrees(azimuth)), static_cast<float>(90.0 - glm::degrees(down)),
                    vec3(3.0F), vec3(0.0F)});
  const Seen sun = see(*still, 64);
  still->set_light({});
  still->viewer().set_environment(environment_of(width, height, [&](std::uint32_t x, std::uint32_t y) {
    return x == column && y == row ? vec3(static_cast<float>(3.0 / solid_angle)) : vec3(0.0F);
  }));
  const Seen texel = see(*still, 64);
  expect_same(texel, sun, 5e-3);
  EXPECT_LT(texel.error.x, 3.0 * sun.error.x);  // no fireflies
}

// A patch as bright as a low sun behind haze, beside a sky. Scattered rays hit it often enough to matter.
vec3 patch(std::uint32_t x, std::uint32_t y) {
  if (x >= 40 && x < 46 && y >= 14 && y < 18) return {60.0F, 50.0F, 30.0F};
  return y < 32 ? vec3(0.4F, 0.6F, 1.0F) : vec3(0.2F, 0.15F, 0.1F);
}

// Compares NEE with MIS, NEE with lower probability, and scattered rays only. Media with one and with many scattering
// events, and a matte ground plane.
TEST_P(EnvironmentLighting, NextEventEstimationAgreesWithScatteredRaysOnly) {
  const light::EnvironmentPtr environment = environment_of(128, 64, patch);
  const volume::ScalarVolume volume = test::make_volume(ivec3(20), ivec3(0), [](const ivec3&) { return 1.0F; });
  struct Case {
    const char* name;
    float g;
    std::uint32_t bounces;  // 0: no limit
    bool ground;
  };
  for (const Case& of : {Case{"one event", 0.0F, 1, false}, Case{"one event, forward", 0.6F, 1, false},
                         Case{"many", 0.6F, 0, false}, Case{"a matte ground below", 0.3F, 0, true}}) {
    SCOPED_TRACE(of.name);
    const auto still = make();
    still->set_volume(volume);
    viewer::GridSettings grid;
    grid.build.march = scene::March::dense;
    still->set_grid(grid);
    still->set_medium({of.ground ? 0.05 : 0.15, vec3(0.9F), {of.g}, of.bounces});
    still->viewer().set_ground({of.ground ? viewer::GroundMode::at_height : viewer::GroundMode::none, -2.0});
    // All pixels see one point: the box's center, or the ground in front of it.
    still->set_camera(of.ground ? test::camera_at({9.5, 30.0, 60.0}, {9.5, -2.0, 24.0}, 0.01)
                                : test::camera_at({9.5, 9.5, 60.0}, {9.5, 9.5, 9.5}, 0.01));
    still->set_light({});
    still->viewer().set_environment(environment);
    still->viewer().set_environment_settings({30.0F, 1.0F});
    const test::Picture picture = test::render(*still, {16, 16, 256, 1, render::View::shaded});
    core::CpuEnvironment cpu = twin(*environment);
    cpu.cm = still->viewer().trace_parameters();
    constexpr std::uint32_t samples = 128;
    cpu.cm.dispatch.samples = samples;
    cpu.volume = &volume;
    cpu.origin = ivec3(grid::fit_cube(volume).origin);
    const auto of_pixels = [](const auto& pixel) {
      Seen seen;
      dvec3 squares(0.0);
      for (std::uint32_t i = 0; i < 256; ++i) {
        const dvec3 value(pixel(i));
        seen.mean += value / 256.0;
        squares += value * value / 256.0;
      }
      seen.error = glm::sqrt(glm::max(squares - seen.mean * seen.mean, dvec3(0.0)) / 256.0);
      return seen;
    };
    const Seen kernels = of_pixels([&](std::uint32_t i) { return picture.pixels[i]; });
    std::array<Seen, 3> seen;
    constexpr std::array probabilities = {1.0F, 0.0F, 0.5F};
    // The middle probability is tested in one case only, because paths on the CPU are slow.
    for (std::size_t k = 0; k < (of.ground ? 3 : 2); ++k) {
      cpu.cm.lights.environment_probability = probabilities.at(k);
      seen.at(k) = of_pixels([&](std::uint32_t i) {
        const auto pixel = cpu.traced({i % 16, i / 16});
        return vec3(pixel.sum) / float(samples) + pixel.background;
      });
      expect_same(seen.at(k), kernels, 1e-3);
      EXPECT_LT(seen.at(k).error.x, 0.07 * kernels.mean.x) << probabilities.at(k);
    }
    expect_same(seen[1], seen[0], 1e-3);
    EXPECT_GT(seen[1].error.x, 1.3 * seen[0].error.x) << "looks are of use";
  }
}

// A sun as in spiaggia_di_mondello_1k.hdr: 72,704 in one or two texels of a sky of 0.5. A pixel's differences between
// seeds must be in the range of its neighbors' noise, without single outliers.
TEST_P(EnvironmentLighting, SunInAnEnvironmentMapGivesNoFireflies) {
  const light::EnvironmentPtr environment = environment_of(1024, 512, [](std::uint32_t x, std::uint32_t y) {
    if (x == 300 && (y == 120 || y == 121)) return vec3(72704.0F, 68000.0F, 60000.0F);
    return y < 256 ? vec3(0.4F, 0.5F, 0.7F) : vec3(0.2F, 0.18F, 0.15F);
  });
  struct Case {
    const char* name;
    bool cloud;
    bool floor;
  };
  for (const Case& of : {Case{"a cloud", true, false}, Case{"a matte floor", false, true},
                         Case{"a cloud and what it does to a floor", true, true}}) {
    SCOPED_TRACE(of.name);
    const auto still = ball(0.5F, vec3(1.0F));
    if (!of.cloud) still->set_medium({1e-6, vec3(1.0F), {0.5F}, 0});
    if (of.floor) {
      auto scene = std::make_shared<test::StillScene>();
      scene->add_quad({{{-90, -1, 90}, {90, -1, 90}, {90, -1, -90}, {-90, -1, -90}}},
                      scene->add(test::diffuse(vec3(0.7F))));
      still->viewer().show_surfaces(test::source_of(scene));
    }
    still->set_camera(of.floor ? test::camera_at({9.5, 60.0, 50.0}, {9.5, -1.0, 9.5}, 25.0)
                               : test::camera_at({9.5, 9.5, 60.0}, {9.5, 9.5, 9.5}, 10.0));
    still->set_light({});
    still->viewer().set_environment(environment);
    constexpr std::uint32_t side = 48;
    constexpr std::uint32_t seeds = 6;
    std::vector<test::Picture> pictures;
    for (std::uint32_t seed = 0; seed < seeds; ++seed) pictures.push_back(test::render(*still, {side, side, 4, seed}));
    double worst = 0.0;
    for (std::uint32_t block = 0; block < side * side / 64; ++block) {
      std::vector<double> strays;
      for (std::uint32_t i = 0; i < 64; ++i) {
        const std::uint32_t at = (block / (side / 8) * 8 + i / 8) * side + block % (side / 8) * 8 + i % 8;
        double mean = 0.0;
        for (const test::Picture& picture : pictures) mean += picture.pixels[at].y / seeds;
        for (const test::Picture& picture : pictures) strays.push_back(std::abs(picture.pixels[at].y - mean));
      }
      std::ranges::sort(strays);
      // In a normal distribution, the median absolute deviation is 0.674 standard deviations.
      const double deviation = strays[strays.size() / 2] / 0.674;
      if (deviation > 0.0) worst = std::max(worst, strays.back() / deviation);
    }
    RecordProperty(of.name, std::to_string(worst));
    EXPECT_LT(worst, 40.0);  // 1e5 without NEE
    EXPECT_GT(worst, 2.0) << "there is noise";
  }
}

}  // namespace
