// Selection probabilities of lights. A new kind of light takes a few lines: a kind that exists only here is compared
// with quadrature.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <utility>

#include "gl/shader_sources.hpp"
#include "grid/cell.hpp"
#include "light/alias_table.hpp"
#include "light/analytic_lights.hpp"
#include "light/light_table.hpp"
#include "support/gl_compute.hpp"
#include "support/gl_state.hpp"
#include "support/gl_viewer.hpp"
#include "support/osmesa_leaks.hpp"
#include "support/surfaces.hpp"
#include "support/volumes.hpp"

// Traversals of all grid types share one signature, so each leaves some parameters unused. Kinds of light do too.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-parameter"

namespace cumulet::core {

/// The shaders' path tracer over voxels, compiled as C++, with the disc light added.
struct CpuDisc {
  CmParameters cm{};
  const volume::ScalarVolume* volume = nullptr;
  ivec3 origin{0};
  vec3 cm_disc_to{0.0F, 1.0F, 0.0F};
  float cm_disc_cosine = 0.5F;
  vec3 cm_disc_radiance_in{1.0F};
  float cm_disc_probability = 1.0F;
  float cm_surface_z(uvec2 pixel, vec2 within, uint layer) const { return 3.0e38F; }
  float cm_voxel(ivec3 voxel) const { return test::value_at(*volume, voxel + origin) / volume->max_value; }
#define CM_MARCH 1
#define CM_MORE_LIGHTS(LIGHT) LIGHT(CM_LIGHT_OTHER, cm_disc_probability, cm_disc_sample, cm_disc_pdf, cm_disc_radiance)
#include "support/traced.inc"

#include "support/disc_light.glsl"
#undef CM_MARCH
#undef CM_MORE_LIGHTS
};

/// A tracer with so many lights that a float has few bits below their index. Of each pair, the even one has probability
/// 0.3.
struct CpuManyAnalyticLights {
  static constexpr uint pairs = 1U << 21U;
  CmParameters cm{};
  float cm_surface_z(uvec2 pixel, vec2 within, uint layer) const { return 3.0e38F; }
  float cm_voxel(ivec3 voxel) const { return 0.0F; }
  CmAnalyticLight cm_analytic_light(uint i) const {
    const bool even = i % 2 == 0;
    CmAnalyticLight analytic_light{};
    analytic_light.kind = CM_ANALYTIC_LIGHT_DISTANT;
    analytic_light.intensity = vec3(even ? 1.0F : 0.0F, static_cast<float>(i) / (2.0F * pairs), 0.0F);
    analytic_light.probability = (even ? 0.3F : 0.7F) / pairs;
    analytic_light.stays = even ? static_cast<uint>(0.6 * light::Alias::certain) : light::Alias::certain;
    analytic_light.other = i + 1;
    return analytic_light;
  }
#define CM_MARCH 1
#undef CM_ANALYTIC_LIGHTS
#define CM_ANALYTIC_LIGHTS 1
#include "support/traced.inc"
#undef CM_ANALYTIC_LIGHTS
#define CM_ANALYTIC_LIGHTS CM_SURFACES
#undef CM_MARCH
};

}  // namespace cumulet::core

#pragma GCC diagnostic pop

namespace {

using namespace cumulet;
using glm::dvec3;
using glm::ivec3;
using glm::vec3;
using light::Kind;
using light::LightTable;

constexpr double pi = std::numbers::pi;

light::SceneLights scene_of(std::uint32_t analytic_lights, std::uint32_t triangles) {
  light::SceneLights scene;
  scene.analytic_lights = analytic_lights;
  scene.triangles = triangles;
  scene.analytic_light_flux = 3.0 * analytic_lights;
  scene.triangle_flux = 5.0 * triangles;
  scene.cross_section = 2.0;
  return scene;
}

TEST(LightSelection, ProbabilitiesSumToOneOrZeroWithoutLight) {
  for (const float sun : {0.0F, 3.0F}) {
    for (const float sky : {0.0F, 0.5F}) {
      for (const std::uint32_t analytic_lights : {0U, 1U, 7U}) {
        for (const std::uint32_t triangles : {0U, 100U}) {
          light::DistantLights distant;
          distant.sun_irradiance = vec3(sun);
          distant.sky_radiance = vec3(sky);
          for (const double power : {0.0, 2.0}) {
            const light::MediumLight fire{.aimed = true, .power = power, .length = 0.1, .radius = 3.0};
            const LightTable table(distant, {}, scene_of(analytic_lights, triangles), fire);
            double sum = 0.0;
            for (const LightTable::Entry& entry : table.entries()) {
              if (entry.kind != Kind::emissive) sum += entry.probability;
            }
            const bool any = sun + sky > 0.0F || analytic_lights + triangles > 0 || power > 0.0;
            EXPECT_NEAR(sum, any ? 1.0 : 0.0, 1e-6);
            EXPECT_EQ(table.parameters().any, any ? 1U : 0U);
            EXPECT_EQ(table.probability(Kind::sun) > 0.0F, sun > 0.0F);
            EXPECT_EQ(table.probability(Kind::sky) > 0.0F, sky > 0.0F);
            EXPECT_EQ(table.probability(Kind::analytic_light) > 0.0F, analytic_lights > 0);
            EXPECT_EQ(table.probability(Kind::triangle) > 0.0F, triangles > 0);
            EXPECT_EQ(table.probability(Kind::cell) > 0.0F, power > 0.0);
          }
        }
      }
    }
  }
}

TEST(LightSelection, SunAndLightsAreSelectedByIncidentFlux) {
  light::DistantLights distant;
  distant.sun_irradiance = vec3(2.0F);
  light::SceneLights analytic_lights = scene_of(4, 0);
  const auto sun = [&](double arrives) {
    analytic_lights.analytic_lights_arrive = arrives;
    const LightTable table(distant, {}, analytic_lights, {});
    EXPECT_NEAR(table.probability(Kind::analytic_light), 1.0F - table.probability(Kind::sun), 1e-6);
    EXPECT_EQ(table.probability(Kind::emissive), 0.0F);
    return table.probability(Kind::sun);
  };
  EXPECT_NEAR(sun(3.0), 0.4, 1e-6);
  EXPECT_NEAR(sun(0.0), 0.8, 1e-6);
  EXPECT_NEAR(sun(1e30), 0.2, 1e-6);
}

core::CmAnalyticLight point_analytic_light(const glm::dvec3& at, float power) {
  light::AnalyticLight analytic_light;
  analytic_light.position = at;
  analytic_light.power = vec3(power);
  return light::analytic_light_record(analytic_light, glm::dvec3(0.0));
}

// Compares each light's stored probability, and the probability that its alias table entries give.
void expect_probabilities(const std::vector<core::CmAnalyticLight>& records, const std::vector<double>& expected) {
  std::vector<double> drawn(records.size(), 0.0);
  for (std::size_t i = 0; i < records.size(); ++i) {
    const double part = 1.0 / static_cast<double>(records.size());
    const double stays = static_cast<double>(records[i].stays) / light::Alias::certain;
    drawn[i] += part * stays;
    drawn.at(records[i].other) += part * (1.0 - stays);
  }
  for (std::size_t i = 0; i < records.size(); ++i) {
    EXPECT_NEAR(records[i].probability, expected[i], 1e-6) << i;
    EXPECT_NEAR(drawn[i], expected[i], 1e-6) << i;
  }
}

TEST(AnalyticLightSelection, LightsAreSelectedByIncidentFlux) {
  const std::vector<light::Lit> ball{{glm::dvec3(0.0), 1.0}};
  // A light at twice the distance with four times the power has the same probability. For lights inside the ball, the
  // distance is clamped to its radius.
  std::vector<core::CmAnalyticLight> records{
      point_analytic_light({10, 0, 0}, 1.0F), point_analytic_light({0, 20, 0}, 4.0F),
      point_analytic_light({0, 0, 5}, 0.5F), point_analytic_light({0, 0.1, 0}, 0.01F)};
  const double arrives = light::share_looks(records, ball);
  EXPECT_NEAR(arrives, 0.05 / (4.0 * std::numbers::pi), 1e-6);
  expect_probabilities(records, {0.05 + 0.8 * 0.2, 0.05 + 0.8 * 0.2, 0.05 + 0.8 * 0.4, 0.05 + 0.8 * 0.2});

  // With two lit balls, the mean of both: near the second ball only the first light counts.
  records.resize(2);
  light::share_looks(records, std::vector<light::Lit>{ball[0], {glm::dvec3(10, 0, 0), 1e-3}});
  expect_probabilities(records, {0.1 + 0.8 * 0.75, 0.1 + 0.8 * 0.25});

  // A light whose range ends before the ball keeps a small probability, because points outside of the ball may need it.
  records[0].range = 3.0F;
  light::share_looks(records, ball);
  expect_probabilities(records, {0.1, 0.9});
}

TEST(AnalyticLightSelection, SamplesMatchProbabilitiesForAnyCount) {
  core::CpuManyAnalyticLights tracer;
  tracer.cm.analytic_lights.count = 2 * core::CpuManyAnalyticLights::pairs;
  constexpr int n = 200'000;
  glm::dvec3 sum(0.0);
  for (int i = 0; i < n; ++i) {
    core::CpuManyAnalyticLights::CmPath path{};
    path.random = tracer.cm_hash3(glm::uvec3(i, 0, 7)).x;
    path.stream = 1;
    const float u = tracer.cm_random(path.random, path.stream);
    sum += glm::dvec3(tracer.cm_analytic_light_sample(path, vec3(0.0F), vec3(0.5F, 0.5F, u)).radiance);
  }
  EXPECT_NEAR(sum.x / n, 0.3, 5.0 * std::sqrt(0.3 * 0.7 / n));
  EXPECT_NEAR(sum.y / n, 0.5, 5.0 * std::sqrt(1.0 / 12.0 / n)) << "all along the table";
}

TEST(AnalyticLightSelection, IsUniformWithoutPowerOrReceivers) {
  std::vector<core::CmAnalyticLight> records{point_analytic_light({10, 0, 0}, 1.0F),
                                             point_analytic_light({0, 2, 0}, 4.0F)};
  EXPECT_EQ(light::share_looks(records, std::vector<light::Lit>{{glm::dvec3(0.0), 0.0}}), 0.0);
  expect_probabilities(records, {0.5, 0.5});
  std::vector<core::CmAnalyticLight> dark{point_analytic_light({10, 0, 0}, 0.0F),
                                          point_analytic_light({0, 2, 0}, 0.0F)};
  EXPECT_EQ(light::share_looks(dark, std::vector<light::Lit>{{glm::dvec3(0.0), 1.0}}), 0.0);
  expect_probabilities(dark, {0.5, 0.5});
  EXPECT_EQ(light::share_looks({}, {}), 0.0);
}

// A fire that fills its bounds is left to scattered rays.
TEST(LightSelection, SmallFiresShareSamplesWithDistantLights) {
  light::SceneLights sun;
  sun.analytic_lights = 1;  // no flux: there is no surface
  const light::MediumLight fire{.aimed = false, .power = 1.0, .length = 0.01, .radius = 1.0};
  const LightTable table({}, {}, sun, fire);
  EXPECT_EQ(table.probability(Kind::analytic_light), 0.5F);
  EXPECT_EQ(table.probability(Kind::cell), 0.5F);
}

TEST(LightSelection, OnlySmallFiresAreSampled) {
  const auto probability = [](double length) {
    const light::MediumLight fire{.aimed = false, .power = 1.0, .length = length, .radius = 1.0};
    return LightTable({}, {}, {}, fire).probability(Kind::cell);
  };
  EXPECT_EQ(probability(0.01), 1.0F);
  EXPECT_EQ(probability(0.5), 0.0F);
}

class AddedLightType : public test::ViewerTest {};
CUMULET_ON_BACKENDS(AddedLightType);

// A box of equal voxels (dense grid), seen from its front at its center.
struct BoxOfVoxels {
  static constexpr double sigma = 0.08;
  ivec3 voxels = {40, 16, 24};
  volume::ScalarVolume volume = test::make_volume(voxels, ivec3(0), [](const ivec3& /*p*/) { return 1.0F; });

  void show(test::Still& still) const {
    still.set_volume(volume);
    viewer::GridSettings grid;
    grid.build.march = scene::March::dense;
    still.set_grid(grid);
    still.set_camera(test::camera_at({19.5, 7.5, 900.0}, {19.5, 7.5, 0.0}, 0.01));
  }
};

// Single scattering in a homogeneous box below the disc, by quadrature.
double single_scattering(const dvec3& size, double sigma, double g, double cosine) {
  constexpr int n = 48;
  const dvec3 eye_way(0.0, 0.0, -1.0);  // direction of the scattered ray
  double sum = 0.0;
  for (int i = 0; i < n; ++i) {
    const double depth = (i + 0.5) / n * size.z;
    for (int j = 0; j < n; ++j) {
      const double mu = 1.0 - (j + 0.5) / n * (1.0 - cosine);
      for (int k = 0; k < n; ++k) {
        const double angle = 2.0 * pi * (k + 0.5) / n;
        const double sine = std::sqrt(1.0 - mu * mu);
        const dvec3 w(sine * std::cos(angle), mu, sine * std::sin(angle));
        // At the center of the box's height and width, at this depth.
        const dvec3 at(0.5 * size.x, 0.5 * size.y, size.z - depth);
        double out = 1e30;
        for (int axis = 0; axis < 3; ++axis) {
          if (w[axis] != 0.0) out = std::min(out, ((w[axis] > 0.0 ? size[axis] : 0.0) - at[axis]) / w[axis]);
        }
        const double phase = (1.0 - g * g) / (4.0 * pi * std::pow(1.0 + g * g - 2.0 * g * glm::dot(eye_way, w), 1.5));
        sum += sigma * std::exp(-sigma * (depth + out)) * phase;
      }
    }
  }
  return sum * (size.z / n) * 2.0 * pi * (1.0 - cosine) / (double(n) * n);
}

TEST_P(AddedLightType, DiskIsSampledByNextEventEstimationAndHitByRays) {
  const BoxOfVoxels box;
  const auto viewer = make();
  box.show(*viewer);
  for (const float g : {0.0F, 0.5F}) {
    viewer->set_medium({BoxOfVoxels::sigma, vec3(1.0F), {g}, 1});
    viewer->set_light({0.0F, 0.0F, vec3(0.0F), vec3(0.0F)});
    const test::Picture picture = test::render(*viewer, {8, 8, 1, 1, render::View::shaded});
    core::CpuDisc cpu;
    cpu.cm = viewer->viewer().trace_parameters();
    cpu.cm.dispatch.samples = 256;
    cpu.cm.lights.any = 1;
    cpu.volume = &box.volume;
    cpu.origin = ivec3(grid::fit_cube(box.volume).origin);
    cpu.cm_disc_cosine = static_cast<float>(std::cos(0.6));
    const double expected = single_scattering(dvec3(box.voxels), BoxOfVoxels::sigma, g, std::cos(0.6));
    for (const float probability : {1.0F, 0.3F, 0.0F}) {
      cpu.cm_disc_probability = probability;
      std::array<double, 64> means{};
      double mean = 0.0;
      for (std::uint32_t i = 0; i < 64; ++i) {
        means.at(i) = cpu.traced({i % 8, i / 8}).sum.x / 256.0;
        mean += means.at(i) / 64.0;
      }
      double square = 0.0;
      for (const double m : means) square += (m - mean) * (m - mean);
      const double error = std::sqrt(square) / 64.0;
      EXPECT_NEAR(mean, expected, 4.0 * error) << "g " << g << " chance " << probability;
      EXPECT_LT(error, (probability > 0.0F ? 0.02 : 0.1) * expected);
    }
  }
}

// A sun of radiance 1 overhead, with this angular diameter.
viewer::Light overhead(double angle) {
  viewer::Light light;
  light.sun_elevation_degrees = 90.0F;
  light.sun_irradiance = vec3(static_cast<float>(pi * std::pow(std::sin(0.5 * angle), 2.0)));
  light.sun_angle_degrees = static_cast<float>(angle * 180.0 / pi);
  return light;
}

class Sun : public test::ViewerTest {};
CUMULET_ON_BACKENDS(Sun);

TEST_P(Sun, SunWithAngleMatchesQuadratureForEverySamplingMethod) {
  const BoxOfVoxels box;
  const auto viewer = make();
  box.show(*viewer);
  viewer->set_light(overhead(1.2));
  for (const float g : {0.0F, 0.5F}) {
    viewer->set_medium({BoxOfVoxels::sigma, vec3(1.0F), {g}, 1});
    const double expected = single_scattering(dvec3(box.voxels), BoxOfVoxels::sigma, g, std::cos(0.6));
    const test::Picture picture = test::render(*viewer, {8, 8, 256, 1, render::View::shaded});
    EXPECT_NEAR(picture.mean().x, expected, 0.02 * expected) << g;
    // The sun is sampled with the probability that a dark disc leaves to it: from NEE only to scattered rays only.
    core::CpuDisc cpu;
    cpu.cm = viewer->viewer().trace_parameters();
    cpu.cm.dispatch.samples = 256;
    cpu.volume = &box.volume;
    cpu.origin = ivec3(grid::fit_cube(box.volume).origin);
    cpu.cm_disc_radiance_in = vec3(0.0F);
    for (const float probability : {0.0F, 0.5F, 1.0F}) {
      cpu.cm_disc_probability = probability;
      double mean = 0.0;
      for (std::uint32_t i = 0; i < 64; ++i) mean += cpu.traced({i % 8, i / 8}).sum.x / 256.0 / 64.0;
      EXPECT_NEAR(mean, expected, (probability < 1.0F ? 0.03 : 0.1) * expected) << g << " " << probability;
    }
  }
}

// A naive path tracer for this box: NEE for a sun of angle 0, otherwise escaping rays hit sky or sun. No MIS and no
// Russian roulette. Returns mean and standard error.
std::pair<double, double> plainly_traced(const dvec3& size, double sigma, double g, double albedo,
                                         const viewer::Light& light) {
  constexpr int paths = 400'000;
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> number(0.0, 1.0);
  const double elevation = light.sun_elevation_degrees * pi / 180.0;
  const dvec3 to_sun(0.0, std::sin(elevation), std::cos(elevation));
  const double half = light.sun_angle_degrees * pi / 360.0;
  const double sun_radiance = half > 0.0 ? light.sun_irradiance.x / (pi * std::pow(std::sin(half), 2.0)) : 0.0;
  double sum = 0.0;
  double squares = 0.0;
  for (int i = 0; i < paths; ++i) {
    dvec3 at(0.5 * size.x, 0.5 * size.y, size.z);
    dvec3 w(0.0, 0.0, -1.0);
    const auto way_out = [&](const dvec3& along) {
      double out = 1e30;
      for (int axis = 0; axis < 3; ++axis) {
        if (along[axis] != 0.0) out = std::min(out, ((along[axis] > 0.0 ? size[axis] : 0.0) - at[axis]) / along[axis]);
      }
      return out;
    };
    double brought = 0.0;
    double throughput = 1.0;
    for (;;) {
      const double way = -std::log(1.0 - number(random)) / sigma;
      if (way >= way_out(w)) {
        brought += throughput * light.sky_radiance.x;
        if (half > 0.0 && glm::dot(w, to_sun) > std::cos(half)) brought += throughput * sun_radiance;
        break;
      }
      at += way * w;
      throughput *= albedo;
      if (!(half > 0.0)) {
        const double phase = (1.0 - g * g) / (4.0 * pi * std::pow(1.0 + g * g - 2.0 * g * glm::dot(w, to_sun), 1.5));
        brought += throughput * phase * std::exp(-sigma * way_out(to_sun)) * light.sun_irradiance.x;
      }
      const double s = (1.0 - g * g) / (1.0 - g + 2.0 * g * number(random));
      const double cosine = g != 0.0 ? (1.0 + g * g - s * s) / (2.0 * g) : 1.0 - 2.0 * number(random);
      const dvec3 across = glm::normalize(glm::cross(w, std::abs(w.y) < 0.9 ? dvec3(0, 1, 0) : dvec3(1, 0, 0)));
      const double angle = 2.0 * pi * number(random);
      w = glm::normalize(cosine * w + std::sqrt(std::max(0.0, 1.0 - cosine * cosine)) *
                                          (std::cos(angle) * across + std::sin(angle) * glm::cross(w, across)));
    }
    sum += brought / paths;
    squares += brought * brought / paths;
  }
  return {sum, std::sqrt(std::max(0.0, squares - sum * sum) / paths)};
}

// Multiple scattering, where Russian roulette skips shadow rays of low contribution: for a uniform sky, at late events,
// and for directions with little scattering. (trace_test has the white furnace.)
TEST_P(Sun, MultipleScatteringMatchesPlainPathTracing) {
  const BoxOfVoxels box;
  const double sigma = 0.3;
  struct Case {
    const char* name;
    float g;
    float albedo;
    float sky;
    float sun;
    float degrees;
  };
  for (const Case& of :
       {Case{"sky", 0.3F, 0.9F, 1.0F, 0.0F, 0.0F}, Case{"sun, white", 0.0F, 1.0F, 0.0F, 5.0F, 0.0F},
        Case{"sun", 0.7F, 0.95F, 0.0F, 5.0F, 0.0F}, Case{"wide sun", 0.7F, 0.95F, 0.0F, 5.0F, 60.0F},
        Case{"wide sun, white", -0.4F, 1.0F, 0.0F, 5.0F, 60.0F}, Case{"both", 0.6F, 0.97F, 0.5F, 3.0F, 40.0F}}) {
    SCOPED_TRACE(of.name);
    viewer::Light light;
    light.sun_azimuth_degrees = 0.0F;
    light.sun_elevation_degrees = 50.0F;
    light.sun_irradiance = vec3(of.sun);
    light.sun_angle_degrees = of.degrees;
    light.sky_radiance = vec3(of.sky);
    const auto viewer = make();
    box.show(*viewer);
    viewer->set_light(light);
    viewer->set_medium({sigma, vec3(of.albedo), {of.g}, 0});
    const test::Picture picture = test::render(*viewer, {16, 16, 512, 1, render::View::shaded});
    const double mean = picture.mean().x;
    double square = 0.0;
    for (const glm::vec4& pixel : picture.pixels) square += std::pow(pixel.x - mean, 2.0) / 256.0;
    const auto [expected, error] = plainly_traced(dvec3(box.voxels), sigma, of.g, of.albedo, light);
    const double errors = std::sqrt(square / 256.0 + error * error);
    EXPECT_NEAR(mean, expected, 4.0 * errors);
    EXPECT_LT(errors, 0.01 * expected) << "else the comparison proves nothing";
  }
}

TEST_P(Sun, DiskIsVisibleDirectlyAndInMirrors) {
  const auto viewer = make();
  surface::Material mirror;
  mirror.metallic = 1.0F;
  mirror.roughness = 0.0F;
  auto scene = std::make_shared<test::StillScene>();
  scene->add(mirror);
  scene->add_quad({{{-9, 0, 9}, {9, 0, 9}, {9, 0, -9}, {-9, 0, -9}}}, 0);
  viewer->viewer().show_surfaces(test::source_of(scene));
  const auto mean = [&](const dvec3& eye, const dvec3& target) {
    viewer::CameraPose camera = test::camera_at(eye, target, 1.0);
    camera.up = {0.0, 0.0, 1.0};
    viewer->set_camera(camera);
    const test::Picture picture = test::render(*viewer, {8, 8, 64, 1, render::View::shaded});
    return picture.mean().x;
  };
  for (const double angle : {0.2, 0.0}) {
    viewer->set_light(overhead(angle));
    const float radiance = angle > 0.0 ? 1.0F : 0.0F;
    EXPECT_EQ(mean({0.0, 5.0, 0.0}, {0.0, 9.0, 0.0}), radiance);
    EXPECT_EQ(mean({0.0, 5.0, 0.0}, {0.9, 9.0, 0.0}), 0.0F) << "beside it";
    EXPECT_NEAR(mean({0.0, 5.0, 0.0}, {0.0, 0.0, 0.0}), radiance, 0.01F) << "in a mirror";
  }
}

TEST_P(Sun, IrradianceDoesNotDependOnItsAngle) {
  const auto viewer = make();
  auto scene = std::make_shared<test::StillScene>();
  scene->add(test::diffuse(vec3(0.5F)));
  scene->add_quad({{{-50, 0, 50}, {50, 0, 50}, {50, 0, -50}, {-50, 0, -50}}}, 0);
  // A roof over all x below 0.
  scene->add_quad({{{-400, 10, 400}, {0, 10, 400}, {0, 10, -400}, {-400, 10, -400}}}, 0);
  viewer->viewer().show_surfaces(test::source_of(scene));
  for (const float degrees : {0.0F, 0.53F, 40.0F}) {
    viewer::Light light;
    light.sun_elevation_degrees = 90.0F;
    light.sun_irradiance = vec3(3.0F);
    light.sun_angle_degrees = degrees;
    viewer->set_light(light);
    viewer->set_medium({1.0, vec3(1.0F), {}, 1});
    const double half = degrees * pi / 360.0;
    for (const double share : {-1.2, -0.5, 0.3, 0.7, 1.2}) {
      // The edge of the roof cuts the sun's disc, which projects uniformly on the floor.
      const double x = 10.0 * std::tan(half) * share;
      if (degrees < 1.0F && std::abs(share) < 1.0) continue;
      const double at = degrees > 0.0F ? x : (share > 0.0 ? 1.0 : -1.0);
      viewer->set_camera(test::camera_at({at + 30.0, 5.0, 0.0}, {at, 0.0, 0.0}, 0.01));
      const test::Picture picture = test::render(*viewer, {8, 8, 256, 1, render::View::shaded});
      double sum = 0.0;
      constexpr int n = 400;
      for (int i = 0; i < n * n; ++i) {
        const double mu_2 =
            1.0 - std::pow(std::sin(half), 2.0) * (std::floor(double(i) / n) + 0.5) / n;  // uniform in projection
        const double turn = 2.0 * pi * (i % n + 0.5) / n;
        const double across = std::sqrt(1.0 - mu_2) * std::cos(turn) / std::sqrt(mu_2);
        if (degrees > 0.0F ? at + 10.0 * across > 0.0 : at > 0.0) sum += 1.0 / (n * n);
      }
      EXPECT_NEAR(picture.mean().x, 0.5 / pi * 3.0 * sum, 0.008) << degrees << " degrees, at " << at;
    }
  }
}

class AddedLightTypeShader : public test::GlTest {};
CUMULET_ON_BACKENDS(AddedLightTypeShader);

// The same light source code, added to the library's shader.
TEST_P(AddedLightTypeShader, CompilesInTheDriver) {
  const gl::Shader* shader = gl::find_shader("trace.comp");
  ASSERT_NE(shader, nullptr);
  const std::array<std::string, 4> defines{
      "CM_MARCH 1", "CM_LINEAR 0", "CM_PAGES 1",
      "CM_MORE_LIGHTS(LIGHT) LIGHT(CM_LIGHT_OTHER, 0.5, cm_disc_sample, cm_disc_pdf, cm_disc_radiance)"};
  std::string text = shader->with(defines);
  const std::size_t offset = text.find("// ---- All kinds");
  ASSERT_NE(offset, std::string::npos);
  text.insert(offset, R"(
const vec3 cm_disc_to = vec3(0.0, 1.0, 0.0);
const float cm_disc_cosine = 0.5;
const vec3 cm_disc_radiance_in = vec3(1.0);
)" + test::glsl_file("../tests/unit/support/disc_light.glsl"));
  EXPECT_NO_THROW(test::compute_program(gl_, text));
}

}  // namespace
