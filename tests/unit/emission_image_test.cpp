// Images of emission, and of the color and the anisotropy of scattering, compared with closed forms.

#include <gtest/gtest.h>

#include <cmath>

#include "light/black_body.hpp"
#include "support/fields.hpp"
#include "support/gl_viewer.hpp"
#include "support/marches.hpp"
#include "support/osmesa_leaks.hpp"
#include "support/surfaces.hpp"
#include "support/volumes.hpp"

namespace {

using namespace cumulet;
using cumulet::test::anisotropy;
using cumulet::test::colors;
using cumulet::test::field;
using cumulet::test::nothing;
using glm::ivec3;
using glm::vec3;
using scene::March;
using volume::ScalarVolume;
using volume::VolumeFrame;

class EmissionRendering : public test::ViewerTest {
 protected:
  static void show(test::Still& viewer, VolumeFrame frame) { viewer.set_volume(std::move(frame)); }
  // Looks down -z at the middle of a slab of 64 x 64 voxels.
  static test::Picture look(test::Still& viewer, double from = 500.0, std::uint32_t samples = 64) {
    viewer.set_camera(test::camera_at({31.5, 31.5, from}, {31.5, 31.5, from - 1.0}, 0.5));
    return test::render(viewer, {16, 16, samples, 1, render::View::shaded});
  }
};
CUMULET_ON_BACKENDS(EmissionRendering);

TEST_P(EmissionRendering, AFlameWithoutDensityIsExact) {
  const auto viewer = make();
  VolumeFrame frame{.density = nothing()};
  frame.flame = field({64, 64, 8}, ivec3(0), 2.0F);
  show(*viewer, std::move(frame));
  viewer::Medium medium;
  medium.field_emission.flame_strength = 0.25;
  medium.field_emission.flame_color = {1.0F, 0.5F, 0.0F};
  viewer->set_medium(medium);
  viewer->set_light({0.0F, 0.0F, vec3(0.0F), vec3(0.125F)});
  for (const test::MarchKind& kind : test::march_kinds) {
    viewer->set_grid(test::settings_of(kind));
    for (const double from : {500.0, 3.5}) {
      const test::Picture picture = look(*viewer, from, 4);
      const float length = from > 100.0 ? 8.0F : 4.0F;
      for (const glm::vec4& pixel : picture.pixels) {
        EXPECT_NEAR(pixel.x, 0.125F + 0.5F * length, 2e-3F);
        EXPECT_NEAR(pixel.y, 0.125F + 0.25F * length, 2e-3F);
        EXPECT_NEAR(pixel.z, 0.125F, 1e-6F);
        EXPECT_EQ(pixel.w, 0.0F) << "it covers nothing";
      }
    }
  }
}

// frame_all() shows a whole tall flame, with thin smoke and without density.
TEST_P(EmissionRendering, FlameIsInTheFittedView) {
  const auto viewer = make();
  for (const bool smoke : {false, true}) {
    VolumeFrame frame{.density = smoke ? field(ivec3(8), ivec3(0), 1e-3F) : nothing()};
    frame.flame = field({8, 64, 8}, ivec3(0), 1.0F);
    show(*viewer, std::move(frame));
    viewer->set_light({});
    viewer->set_grid(test::settings_of(test::march_kinds[0]));
    viewer->set_camera(test::camera_at({4.0, 32.0, 50.0}, {4.0, 32.0, 0.0}, 30.0));
    test::render(*viewer, {64, 64, 1, 1, render::View::shaded});
    viewer->viewer().frame_all();
    const test::Picture picture = test::render(*viewer, {64, 64, 1, 1, render::View::shaded});
    int rows = 0;
    for (std::size_t y = 0; y < 64; ++y) rows += picture.pixels[y * 64 + 32].x > 1.0F ? 1 : 0;
    EXPECT_GT(rows, 40);
    EXPECT_EQ(picture.pixels[32].x, 0.0F);
    EXPECT_EQ(picture.pixels[63 * 64 + 32].x, 0.0F);
  }
}

// A file with only a temperature emits light too.
TEST_P(EmissionRendering, TemperatureWithoutDensityEmits) {
  const auto viewer = make();
  viewer->set_light({});
  for (const bool smoke : {false, true}) {
    VolumeFrame frame{.density = smoke ? field({64, 64, 8}, ivec3(0), 1e-3F) : nothing()};
    frame.temperature = field({64, 64, 8}, ivec3(0), 1.0F);
    show(*viewer, std::move(frame));
    const double luminance = light::black_body_radiance(1500.0, 1.0) * 8.0;
    const glm::dvec4 mean = look(*viewer, 500.0, 4).mean();
    EXPECT_NEAR(0.2126 * mean.x + 0.7152 * mean.y + 0.0722 * mean.z, smoke ? 0.0 : luminance, 1e-2 * luminance);
  }
}

TEST_P(EmissionRendering, AbsorbingSlabMatchesTheClosedForm) {
  const auto viewer = make();
  VolumeFrame frame{.density = field({64, 64, 8}, ivec3(0), 1.0F)};
  frame.flame = field({64, 64, 8}, ivec3(0), 1.0F);
  show(*viewer, std::move(frame));
  viewer->set_light({});
  for (const test::MarchKind& kind : test::march_kinds) {
    viewer->set_grid(test::settings_of(kind));
    for (const double sigma : {0.05, 0.4}) {
      viewer::Medium medium;
      medium.density_scale = sigma;
      medium.albedo = vec3(0.0F);
      viewer->set_medium(medium);
      const test::Picture picture = look(*viewer);
      const double through = 8.0 * sigma;
      const double mean = (1.0 - std::exp(-through)) / sigma;
      // The mean square of min(free path, 8).
      const double square = 2.0 / (sigma * sigma) * (1.0 - std::exp(-through) * (1.0 + through));
      const double error = std::sqrt((square - mean * mean) / (256.0 * 64.0));
      EXPECT_NEAR(picture.mean().x, mean, 4.0 * error) << sigma;
    }
  }
}

// The fraction of a voxel that is inside a sphere.
float share_within(const ivec3& p, const glm::dvec3& middle, double radius) {
  constexpr int n = 6;
  int within = 0;
  for (int i = 0; i < n * n * n; ++i) {
    const glm::dvec3 at(i / (n * n), i / n % n, i % n);
    within += glm::length(glm::dvec3(p) + (at + 0.5) / double(n) - 0.5 - middle) < radius ? 1 : 0;
  }
  return static_cast<float>(within) / (n * n * n);
}

// The total emission of a sphere in one direction, and the radiance along its chords.
TEST_P(EmissionRendering, AbsorbingSphereMatchesTheClosedForm) {
  constexpr double radius = 27.0;
  constexpr double strength = 0.5;
  const auto viewer = make();
  const ScalarVolume sphere =
      test::make_volume(ivec3(64), ivec3(0), [](const ivec3& p) { return share_within(p, glm::dvec3(31.5), radius); });
  VolumeFrame frame{.density = sphere};
  frame.flame = sphere;
  show(*viewer, std::move(frame));
  viewer->set_light({});
  viewer::CameraPose camera = test::camera_at({31.5, 31.5, 200.0}, {31.5, 31.5, 31.5});
  camera.orthographic_height = 64.0;
  viewer->set_camera(camera);
  for (const test::MarchKind& kind : test::march_kinds) {
    viewer->set_grid(test::settings_of(kind));
    // The sphere's rim is a voxel wide. Its error matters more, the more opaque the sphere is.
    for (const auto& [sigma, rim] : {std::pair(0.01, 2e-3), std::pair(0.1, 5e-3), std::pair(0.5, 2e-2)}) {
      SCOPED_TRACE(testing::Message() << "march " << static_cast<int>(kind.march) << ", extinction " << sigma);
      viewer::Medium medium;
      medium.density_scale = sigma;
      medium.albedo = vec3(0.0F);
      medium.field_emission.flame_strength = strength;
      viewer->set_medium(medium);
      const test::Picture one = test::render(*viewer, {32, 32, 64, 1, render::View::shaded});
      const test::Picture two = test::render(*viewer, {32, 32, 64, 2, render::View::shaded});
      // Sums over pixels of 2 x 2 units: the whole image, and rings of chords within 0.9 of the radius.
      constexpr int rings = 3;
      std::array<double, rings + 1> sum{};
      std::array<double, rings + 1> square{};  // of the error
      std::array<double, rings + 1> expected{};
      for (int i = 0; i < 1024; ++i) {
        const glm::dvec2 middle = 2.0 * (glm::dvec2(i % 32, i / 32) - 15.5);
        const double difference = one.pixels[static_cast<std::size_t>(i)].x - two.pixels[static_cast<std::size_t>(i)].x;
        const double mean =
            0.5 * (one.pixels[static_cast<std::size_t>(i)].x + two.pixels[static_cast<std::size_t>(i)].x);
        const auto add = [&](std::size_t to) {
          sum.at(to) += 4.0 * mean;
          square.at(to) += 4.0 * difference * difference;
        };
        add(rings);
        const auto ring = static_cast<std::size_t>(glm::length(middle) / radius * rings / 0.9);
        if (ring >= rings) continue;
        add(ring);
        constexpr int n = 8;
        for (int j = 0; j < n * n; ++j) {
          const glm::dvec2 at = middle + 2.0 * ((glm::dvec2(j % n, j / n) + 0.5) / double(n) - 0.5);
          const double chord = 2.0 * std::sqrt(radius * radius - glm::dot(at, at));
          expected.at(ring) += 4.0 / (n * n) * strength * (1.0 - std::exp(-sigma * chord)) / sigma;
        }
      }
      // The integral of strength / sigma (1 - exp(-sigma chord)) over the disc.
      const double through = 2.0 * sigma * radius;
      expected[rings] = M_PI * radius * radius * strength / sigma *
                        (1.0 - 2.0 / (through * through) * (1.0 - (1.0 + through) * std::exp(-through)));
      for (std::size_t ring = 0; ring <= rings; ++ring) {
        const double allowed = ring < rings ? 1e-3 : rim;
        EXPECT_NEAR(sum.at(ring), expected.at(ring), 4.0 * std::sqrt(square.at(ring)) + allowed * expected.at(ring))
            << ring;
        EXPECT_LT(std::sqrt(square.at(ring)), 4e-3 * expected.at(ring)) << ring;
      }
    }
  }
}

// A medium that emits as much as it absorbs from a sky of radiance 1 is invisible.
TEST_P(EmissionRendering, MediumInThermalBalanceWithTheSkyIsInvisible) {
  const auto viewer = make();
  const ScalarVolume noise = test::noise_volume({24, 20, 22}, ivec3(-3, 2, 5), 3);
  VolumeFrame frame{.density = noise};
  frame.flame = noise;
  show(*viewer, std::move(frame));
  viewer->set_light({0.0F, 0.0F, vec3(0.0F), vec3(1.0F)});
  viewer::Medium medium;
  medium.density_scale = 0.5;
  medium.albedo = vec3(0.75F);
  medium.phase.anisotropy = 0.4F;
  medium.field_emission.flame_strength = 0.5 * 0.25;
  viewer->set_medium(medium);
  for (const test::MarchKind& kind : test::march_kinds) {
    // Averaging in cells keeps the ratio of density and emission.
    viewer->set_grid(test::settings_of(kind, kind.march == March::tet ? 0.05 : -1.0));
    const test::Picture picture = test::render(*viewer, {24, 24, 128, 7, render::View::shaded});
    double square = 0.0;
    for (const glm::vec4& p : picture.pixels) square += (p.x - 1.0) * (p.x - 1.0);
    EXPECT_NEAR(picture.mean().x, 1.0, 4.0 * std::sqrt(square) / 576.0 + 1e-4);
  }
}

// A hot thin front in homogeneous smoke: emission causes refinement.
TEST_P(EmissionRendering, CellsAreRefinedForEmission) {
  const auto viewer = make();
  VolumeFrame frame{.density = field(ivec3(64), ivec3(0), 1.0F)};
  frame.flame = test::make_volume(ivec3(64), ivec3(0), [](const ivec3& p) {
    return std::exp(-0.5F * static_cast<float>((p.x - 20) * (p.x - 20))) * (p.y > 32 ? 1.0F : 0.0F);
  });
  show(*viewer, std::move(frame));
  viewer->set_light({});
  viewer::Medium medium;
  medium.density_scale = 0.01;
  medium.albedo = vec3(0.0F);
  viewer->set_medium(medium);
  std::vector<test::Picture> pictures;
  for (const test::MarchKind& kind : {test::march_kinds[0], test::march_kinds[2]}) {
    viewer->set_grid(test::settings_of(kind, 0.02));
    viewer->set_camera(test::camera_at({31.5, 31.5, 200.0}, {31.5, 31.5, 31.5}, 22.0));
    pictures.push_back(test::render(*viewer, {32, 32, 64, 1, render::View::shaded}));
    if (kind.march == March::tet) {
      EXPECT_GT(viewer->viewer().stats().cells, 5000U);
    }
  }
  double square = 0.0;
  double all = 0.0;
  for (std::size_t i = 0; i < pictures[0].pixels.size(); ++i) {
    const double difference = pictures[0].pixels[i].x - pictures[1].pixels[i].x;
    square += difference * difference;
    all += pictures[1].pixels[i].x * pictures[1].pixels[i].x;
  }
  EXPECT_LT(std::sqrt(square / all), 0.03);
}

// Rays end at triangles before the emission behind them is added, in any arrangement.
TEST_P(EmissionRendering, EmissionEndsAtSurfaces) {
  const auto viewer = make();
  VolumeFrame frame{.density = nothing()};
  frame.flame = field({64, 64, 8}, ivec3(0), 1.0F);
  show(*viewer, std::move(frame));
  viewer->set_light({});
  test::StillScene wall;
  wall.add_quad({vec3(-100, -100, 5.25), vec3(100, -100, 5.25), vec3(100, 100, 5.25), vec3(-100, 100, 5.25)},
                wall.add(test::diffuse(vec3(0.0F))));
  viewer->viewer().show_surfaces(test::source_of(std::make_shared<test::StillScene>(wall)));
  for (const test::MarchKind& kind : test::march_kinds) {
    viewer->set_grid(test::settings_of(kind));
    const test::Picture picture = look(*viewer, 500.0, 16);
    for (const glm::vec4& pixel : picture.pixels) EXPECT_NEAR(pixel.x, 7.5F - 5.25F, 2e-3F);
  }
}

TEST_P(EmissionRendering, ColorFieldIsAnAlbedo) {
  const auto viewer = make();
  viewer->set_light({0.0F, 0.0F, vec3(0.0F), vec3(1.0F)});
  viewer::Medium medium;
  medium.density_scale = 0.3;
  for (const test::MarchKind& kind : test::march_kinds) {
    viewer->set_grid(test::settings_of(kind));
    VolumeFrame frame{.density = field({64, 64, 8}, ivec3(0), 2.0F)};
    medium.albedo = vec3(0.5F, 0.25F, 0.75F);
    viewer->set_medium(medium);
    show(*viewer, VolumeFrame{.density = frame.density});
    const glm::dvec4 albedo = look(*viewer, 500.0, 256).mean();
    medium.albedo = vec3(1.0F, 0.5F, 1.0F);
    viewer->set_medium(medium);
    frame.color = colors({64, 64, 8}, ivec3(0), [](const ivec3& /*p*/) { return vec3(0.5F, 0.5F, 0.75F); });
    show(*viewer, std::move(frame));
    const glm::dvec4 color = look(*viewer, 500.0, 256).mean();
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(color[i], albedo[i], 2e-3) << i;
  }
}

// The medium is red on one side and green on the other. Only single scattering.
TEST_P(EmissionRendering, ColorVariesInSpace) {
  const auto viewer = make();
  viewer->set_light({0.0F, 0.0F, vec3(0.0F), vec3(1.0F)});
  VolumeFrame frame{.density = field(ivec3(32), ivec3(0), 1.0F)};
  frame.color = colors(ivec3(32), ivec3(0), [](const ivec3& p) { return p.x < 16 ? vec3(1, 0, 0) : vec3(0, 1, 0); });
  show(*viewer, std::move(frame));
  viewer::Medium medium;
  medium.density_scale = 10.0;
  medium.max_bounces = 1;
  viewer->set_medium(medium);
  for (const test::MarchKind& kind : test::march_kinds) {
    viewer->set_grid(test::settings_of(kind));
    for (const double x : {7.5, 23.5}) {
      viewer->set_camera(test::camera_at({x, 15.5, 500.0}, {x, 15.5, 0.0}, 0.5));
      const glm::dvec4 mean = test::render(*viewer, {8, 8, 16, 1, render::View::shaded}).mean();
      // Single scattering in a half-space: (1 - ln 2) / 2.
      EXPECT_NEAR(x < 16.0 ? mean.x : mean.y, 0.1534, 0.02);
      EXPECT_EQ(x < 16.0 ? mean.y : mean.x, 0.0);
    }
  }
}

TEST_P(EmissionRendering, ConstantAnisotropyFieldMatchesTheMediums) {
  const auto viewer = make();
  viewer->set_light({0.0F, 40.0F, vec3(2.0F), vec3(0.25F)});
  viewer::Medium medium;
  medium.density_scale = 0.3;
  medium.albedo = vec3(0.75F);
  const VolumeFrame frame{.density = field({64, 64, 8}, ivec3(0), 2.0F)};
  for (const float second_weight : {0.0F, 0.25F}) {
    for (const test::MarchKind& kind : test::march_kinds) {
      viewer->set_grid(test::settings_of(kind));
      medium.phase = {.anisotropy = 0.75F, .second_anisotropy = -0.5F, .second_weight = second_weight};
      viewer->set_medium(medium);
      show(*viewer, VolumeFrame{.density = frame.density});
      const glm::dvec4 setting = look(*viewer, 500.0, 256).mean();
      VolumeFrame varied{.density = frame.density};
      varied.anisotropy = anisotropy({64, 64, 8}, ivec3(0), [](const ivec3& /*p*/) { return 0.75F; });
      show(*viewer, std::move(varied));
      medium.phase.anisotropy = -0.9F;
      viewer->set_medium(medium);
      const glm::dvec4 grid = look(*viewer, 500.0, 256).mean();
      EXPECT_NEAR(grid.x, setting.x, 2e-3 * setting.x);
    }
  }
}

// Two slabs side by side; single scattering is compared with the closed form.
TEST_P(EmissionRendering, AnisotropyVariesInSpace) {
  const auto viewer = make();
  const double height = std::asin(0.6);
  viewer->set_light({0.0F, static_cast<float>(glm::degrees(height)), vec3(4.0F), vec3(0.0F)});
  VolumeFrame frame{.density = field({64, 64, 8}, ivec3(0), 1.0F)};
  frame.anisotropy = anisotropy({64, 64, 8}, ivec3(0), [](const ivec3& p) { return p.x < 32 ? 0.5F : -0.25F; });
  show(*viewer, std::move(frame));
  viewer::Medium medium;
  medium.density_scale = 0.1;
  medium.max_bounces = 1;
  viewer->set_medium(medium);
  for (const test::MarchKind& kind : test::march_kinds) {
    viewer->set_grid(test::settings_of(kind));
    for (const double x : {15.5, 47.5}) {
      const double g = x < 32.0 ? 0.5 : -0.25;
      const double cosine = -std::cos(height);
      const double phase = (1.0 - g * g) / (4.0 * M_PI * std::pow(1.0 + g * g - 2.0 * g * cosine, 1.5));
      const double ways = 1.0 + 1.0 / std::cos(height);
      const double light = 4.0 * phase * (1.0 - std::exp(-0.1 * 8.0 * ways)) / ways;
      viewer->set_camera(test::camera_at({x, 31.5, 500.0}, {x, 31.5, 0.0}, 0.5));
      const test::Picture picture = test::render(*viewer, {16, 16, 256, 1, render::View::shaded});
      EXPECT_NEAR(picture.mean().x, light, 6e-3 * light) << x;
    }
  }
}

// Triangles use other kernels. The medium must scatter equally in them.
TEST_P(EmissionRendering, AnisotropyFieldWorksWithSurfaces) {
  const auto viewer = make();
  viewer->set_light({0.0F, 40.0F, vec3(2.0F), vec3(0.25F)});
  viewer::Medium medium;
  medium.density_scale = 0.1;
  test::StillScene wall;
  wall.add_quad({vec3(-100, -100, -5), vec3(100, -100, -5), vec3(100, 100, -5), vec3(-100, 100, -5)},
                wall.add(test::diffuse(vec3(0.5F))));
  std::array<double, 2> means{};
  for (const bool varied : {false, true}) {
    VolumeFrame frame{.density = field({64, 64, 8}, ivec3(0), 1.0F)};
    if (varied) frame.anisotropy = anisotropy({64, 64, 8}, ivec3(0), [](const ivec3& /*p*/) { return 0.75F; });
    medium.phase.anisotropy = varied ? 0.0F : 0.75F;
    viewer->set_medium(medium);
    show(*viewer, std::move(frame));
    viewer->viewer().show_surfaces(test::source_of(std::make_shared<test::StillScene>(wall)));
    means[varied ? 1 : 0] = look(*viewer, 500.0, 256).mean().x;
  }
  EXPECT_NEAR(means[1], means[0], 6e-3 * means[0]);
}

TEST_P(EmissionRendering, MieKeepsItsOwnAnisotropy) {
  const auto viewer = make();
  viewer->set_light({0.0F, 40.0F, vec3(2.0F), vec3(0.25F)});
  viewer::Medium medium;
  medium.density_scale = 0.3;
  medium.phase = scene::mie_phase(10.0F);
  viewer->set_medium(medium);
  VolumeFrame frame{.density = field({64, 64, 8}, ivec3(0), 1.0F)};
  show(*viewer, VolumeFrame{.density = frame.density});
  const test::Picture without = look(*viewer, 500.0, 4);
  const viewer::Stats plain = viewer->viewer().stats();
  frame.anisotropy = anisotropy({64, 64, 8}, ivec3(0), [](const ivec3& p) { return p.x < 21 ? -0.5F : 0.5F; });
  show(*viewer, std::move(frame));
  EXPECT_EQ(look(*viewer, 500.0, 4).pixels, without.pixels);
  // A field that is not displayed takes no cells and no bytes; it does when it is displayed again.
  EXPECT_EQ(viewer->viewer().stats().cells, plain.cells);
  EXPECT_EQ(viewer->viewer().stats().cell_bytes, plain.cell_bytes);
  viewer::Medium varied = medium;
  varied.phase = {};
  viewer->set_medium(varied);
  EXPECT_NE(look(*viewer, 500.0, 4).pixels, without.pixels);
  EXPECT_GT(viewer->viewer().stats().cells, plain.cells);
  viewer->set_medium(medium);
  EXPECT_EQ(look(*viewer, 500.0, 4).pixels, without.pixels);
  EXPECT_EQ(viewer->viewer().stats().cells, plain.cells);
}

// A small fire in thick smoke that is seen by the light it scatters. Scattered rays reach it rarely, NEE reaches it
// always.
TEST_P(EmissionRendering, NextEventEstimationReachesAHotCore) {
  const auto viewer = make();
  VolumeFrame frame{.density = field(ivec3(48), ivec3(0), 1.0F)};
  frame.flame = test::make_volume(
      ivec3(48), ivec3(0), [](const ivec3& p) { return glm::distance(vec3(p), vec3(23.5F)) < 3.0F ? 1.0F : 0.0F; });
  show(*viewer, std::move(frame));
  viewer::Medium medium;
  medium.density_scale = 0.06;
  medium.albedo = vec3(0.9F);
  medium.phase.anisotropy = 0.3F;
  viewer->set_medium(medium);
  viewer->set_camera(test::camera_at({23.5, 23.5, 200.0}, {23.5, 23.5, 0.0}, 10.0));
  test::StillScene floor;
  floor.add_quad({vec3(-50, -50, -9), vec3(100, -50, -9), vec3(100, 100, -9), vec3(-50, 100, -9)},
                 floor.add(test::diffuse(vec3(0.7F))));
  struct Case {
    const char* name;
    float quieter;  // largest ratio of the variances
    float daylight = 0.0F;
    bool ground = false;
    float analytic_light = 0.0F;  // watts
    bool floor = false;
    viewer::SurfaceLight among = viewer::SurfaceLight::full;
  };
  light::AnalyticLight analytic_light;
  analytic_light.position = {23.5, 80.0, 60.0};
  for (const Case& of :
       {Case{"alone", 0.3F}, Case{"in daylight", 0.3F, 0.01F},
        Case{.name = "beside a lamp", .quieter = 0.5F, .analytic_light = 2000.0F},
        Case{.name = "over the ground", .quieter = 0.6F, .ground = true},
        Case{.name = "over the ground beside a lamp", .quieter = 0.8F, .ground = true, .analytic_light = 2000.0F},
        Case{.name = "over a floor", .quieter = 0.6F, .floor = true},
        Case{.name = "over a floor beside a lamp", .quieter = 0.8F, .analytic_light = 2000.0F, .floor = true},
        Case{.name = "over a floor that sends nothing back",
        .quieter = 0.8F,
        .floor = true,
        .among = viewer::SurfaceLight::shadows}}) {
    SCOPED_TRACE(of.name);
    viewer->viewer().set_ground({of.ground ? viewer::GroundMode::at_height : viewer::GroundMode::none, -6.0});
    if (of.ground) viewer->set_camera(test::camera_at({23.5, 130.0, 165.0}, {23.5, 23.5, 23.5}, 16.0));
    if (of.floor) viewer->set_camera(test::camera_at({23.5, 23.5, 200.0}, {23.5, 23.5, 0.0}, 10.0));
    analytic_light.power = vec3(of.analytic_light);
    viewer->viewer().set_lights(of.analytic_light > 0.0F ? light::AnalyticLights{analytic_light}
                                                         : light::AnalyticLights{});
    viewer::SurfaceSettings among;
    among.light = of.among;
    viewer->viewer().set_surface_settings(among);
    viewer->set_light({0.3F, 0.5F, vec3(2.0F * of.daylight), vec3(of.daylight)});
    if (of.floor) viewer->viewer().show_surfaces(test::source_of(std::make_shared<test::StillScene>(floor)));
    std::array<double, 2> mean{};
    std::array<double, 2> square{};  // of a pixel's noise
    for (const std::size_t k : {0U, 1U}) {
      viewer->set_grid(test::settings_of(test::march_kinds[2 * k], 0.02));
      const test::Picture one = test::render(*viewer, {32, 32, 64, 1, render::View::shaded});
      const test::Picture two = test::render(*viewer, {32, 32, 64, 2, render::View::shaded});
      for (std::size_t i = 0; i < one.pixels.size(); ++i) {
        const glm::dvec2 from_middle(static_cast<double>(i % 32) - 15.5, static_cast<double>(i / 32) - 15.5);
        if (glm::length(from_middle) < 6.0) continue;  // where cameras see the fire itself
        mean[k] += 0.5 * (double{one.pixels[i].x} + double{two.pixels[i].x});
        square[k] += 0.5 * (double{one.pixels[i].x} - two.pixels[i].x) * (double{one.pixels[i].x} - two.pixels[i].x);
      }
    }
    const double error = std::sqrt(0.5 * (square[0] + square[1]));
    EXPECT_NEAR(mean[0], mean[1], 4.0 * error + 5e-3 * mean[1]);
    EXPECT_LT(error, 0.05 * mean[1]);
    EXPECT_LT(square[0], of.quieter * square[1]);
  }
}

// A floor just below a wide emissive slab. Radiance from each direction is the path length in the slab: 8 / cosine, as
// far as the slab extends.
// Light of a flame with an emission of 1, 64 x 64 x 8 voxels, on a plane of albedo 0.5 a quarter below its large face:
// the half-space integral of 0.5 / pi x cosine x length.
double light_below_a_flame() {
  double light = 0.0;
  constexpr int steps = 400;
  for (int i = 0; i < steps; ++i) {
    for (int j = 0; j < steps; ++j) {
      const double r = std::sqrt((i + 0.5) / steps);
      const double phi = 2.0 * M_PI * (j + 0.5) / steps;
      const double x = r * std::cos(phi);
      const double y = r * std::sin(phi);
      const double z = std::sqrt(1.0 - r * r);
      const double enter = 0.25 / z;
      double leave = 8.25 / z;
      if (x != 0.0) leave = std::min(leave, 32.0 / std::abs(x));
      if (y != 0.0) leave = std::min(leave, 32.0 / std::abs(y));
      light += std::max(0.0, leave - enter);
    }
  }
  return light * 0.5 / (steps * steps);
}

void expect_light_below_a_flame(const test::Picture& picture) {
  const double light = light_below_a_flame();
  double mean = 0.0;
  double square = 0.0;
  for (const glm::vec4& pixel : picture.pixels) {
    mean += pixel.x / 256.0;
    square += pixel.x * pixel.x / 256.0;
  }
  const double error = std::sqrt((square - mean * mean) / 256.0);
  EXPECT_NEAR(mean, light, 4.0 * error + 1e-3 * light);
  EXPECT_LT(error, 0.02 * light);
}

TEST_P(EmissionRendering, FireLightsAFloor) {
  const auto viewer = make();
  VolumeFrame frame{.density = nothing()};
  frame.flame = field({64, 64, 8}, ivec3(0), 1.0F);
  show(*viewer, std::move(frame));
  viewer->set_light({});
  test::StillScene floor;
  floor.add_quad({vec3(31, 31, -0.75), vec3(32, 31, -0.75), vec3(32, 32, -0.75), vec3(31, 32, -0.75)},
                 floor.add(test::diffuse(vec3(0.5F))));
  viewer->viewer().show_surfaces(test::source_of(std::make_shared<test::StillScene>(floor)));
  for (const test::MarchKind& kind : {test::march_kinds[0], test::march_kinds[2]}) {
    viewer->set_grid(test::settings_of(kind));
    viewer->set_camera(test::camera_at({31.5, 31.5, -0.6}, {31.5, 31.5, -1.0}, 30.0));
    expect_light_below_a_flame(test::render(*viewer, {16, 16, 256, 1, render::View::shaded}));
  }
}

// The camera is between the flame and the ground.
TEST_P(EmissionRendering, FireLightsTheGround) {
  const auto viewer = make();
  VolumeFrame frame{.density = nothing()};
  frame.flame = field({64, 8, 64}, ivec3(0), 1.0F);
  show(*viewer, std::move(frame));
  viewer->set_light({});
  viewer->viewer().set_ground({viewer::GroundMode::at_height, -0.75, vec3(0.5F)});
  for (const test::MarchKind& kind : {test::march_kinds[0], test::march_kinds[2]}) {
    viewer->set_grid(test::settings_of(kind));
    viewer::CameraPose down = test::camera_at({31.5, -0.6, 31.5}, {31.5, -1.0, 31.5}, 30.0);
    down.up = {0.0, 0.0, -1.0};
    viewer->set_camera(down);
    expect_light_below_a_flame(test::render(*viewer, {16, 16, 256, 1, render::View::shaded}));
  }
}

// Frames of a sequence share one warning.
TEST(AnisotropyField, UnsupportedFieldIsReportedOnce) {
  std::vector<std::string> warnings;
  viewer::Viewer viewer(Log([&](LogLevel, const char* message) { warnings.emplace_back(message); }), nullptr, true);
  const auto show = [&] {
    VolumeFrame frame{.density = field(ivec3(8), ivec3(0), 1.0F)};
    frame.anisotropy = anisotropy(ivec3(8), ivec3(0), [](const ivec3& /*p*/) { return 0.5F; });
    viewer.set_volume(std::make_shared<const viewer::VolumeAsset>(std::move(frame)));
  };
  viewer::Medium mie;
  mie.phase = scene::mie_phase(10.0F);
  show();
  EXPECT_TRUE(warnings.empty());
  for (int i = 0; i < 3; ++i) {
    viewer.set_medium(mie);
    show();
  }
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_NE(warnings[0].find("is ignored: the Mie phase function"), std::string::npos);
  viewer.set_medium({});
  viewer.set_medium(mie);
  EXPECT_EQ(warnings.size(), 2U);
}

}  // namespace
