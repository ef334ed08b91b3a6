// Which lights are looked for how often; and that a new kind of light is a few lines: one that is here alone, against
// quadrature.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>

#include "gl/shader_sources.hpp"
#include "grid/cell.hpp"
#include "light/light_table.hpp"
#include "support/gl_compute.hpp"
#include "support/gl_state.hpp"
#include "support/gl_viewer.hpp"
#include "support/osmesa_leaks.hpp"
#include "support/volumes.hpp"

// Marches share one signature; each leaves some of it unused. So do kinds of light.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-parameter"

namespace cumulet::core {

/// The shaders' path tracer over voxels, as C++, with the disc among the lights.
struct CpuDisc {
  CmParameters cm{};
  const volume::ScalarVolume* volume = nullptr;
  ivec3 origin{0};
  vec3 cm_disc_to{0.0F, 1.0F, 0.0F};
  float cm_disc_cosine = 0.5F;
  vec3 cm_disc_radiance_in{1.0F};
  float cm_disc_chance = 1.0F;
  float cm_surface_z(uvec2 pixel, vec2 within, uint layer) const { return 3.0e38F; }
  float cm_voxel(ivec3 voxel) const { return test::value_at(*volume, voxel + origin) / volume->max_value; }
#define CM_MARCH 1
#define CM_MORE_LIGHTS(LIGHT) LIGHT(CM_LIGHT_OTHER, cm_disc_chance, cm_disc_sample, cm_disc_pdf, cm_disc_radiance)
#include "support/traced.inc"

#include "support/disc_light.glsl"
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

light::SceneLights scene_of(std::uint32_t lamps, std::uint32_t triangles) {
  light::SceneLights scene;
  scene.lamps = lamps;
  scene.triangles = triangles;
  scene.lamp_flux = 3.0 * lamps;
  scene.triangle_flux = 5.0 * triangles;
  scene.cross_section = 2.0;
  return scene;
}

TEST(Lights, SharesSumToOneOrThereIsNoLight) {
  for (const float sun : {0.0F, 3.0F}) {
    for (const float sky : {0.0F, 0.5F}) {
      for (const std::uint32_t lamps : {0U, 1U, 7U}) {
        for (const std::uint32_t triangles : {0U, 100U}) {
          light::DistantLights distant;
          distant.sun_irradiance = vec3(sun);
          distant.sky_radiance = vec3(sky);
          const LightTable table(distant, {}, scene_of(lamps, triangles), true);
          double sum = 0.0;
          for (const LightTable::Entry& entry : table.entries()) {
            if (entry.kind != Kind::glow) sum += entry.chance;
          }
          const bool any = sun + sky > 0.0F || lamps + triangles > 0;
          EXPECT_NEAR(sum, any ? 1.0 : 0.0, 1e-6);
          EXPECT_EQ(table.parameters().any, any ? 1U : 0U);
          EXPECT_EQ(table.chance(Kind::sun) > 0.0F, sun > 0.0F);
          EXPECT_EQ(table.chance(Kind::sky) > 0.0F, sky > 0.0F);
          EXPECT_EQ(table.chance(Kind::lamp) > 0.0F, lamps > 0);
          EXPECT_EQ(table.chance(Kind::triangle) > 0.0F, triangles > 0);
        }
      }
    }
  }
}

TEST(Lights, TheSunAndEachLampAlike) {
  light::DistantLights distant;
  distant.sun_irradiance = vec3(2.0F);
  const LightTable table(distant, {}, scene_of(4, 0), false);
  EXPECT_NEAR(table.chance(Kind::sun), 0.2, 1e-6);
  EXPECT_NEAR(table.chance(Kind::lamp), 0.8, 1e-6);
  EXPECT_EQ(table.chance(Kind::glow), 0.0F);
}

class NewLight : public test::ViewerTest {};
CUMULET_ON_BACKENDS(NewLight);

// Single scattering in a homogeneous box below the disc, by quadrature.
double single_scattering(const dvec3& size, double sigma, double g, double cosine) {
  constexpr int n = 48;
  const dvec3 eye_way(0.0, 0.0, -1.0);  // of flight
  double sum = 0.0;
  for (int i = 0; i < n; ++i) {
    const double depth = (i + 0.5) / n * size.z;
    for (int j = 0; j < n; ++j) {
      const double mu = 1.0 - (j + 0.5) / n * (1.0 - cosine);
      for (int k = 0; k < n; ++k) {
        const double angle = 2.0 * pi * (k + 0.5) / n;
        const double sine = std::sqrt(1.0 - mu * mu);
        const dvec3 w(sine * std::cos(angle), mu, sine * std::sin(angle));
        // From the middle of the box's height and width, that deep.
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

TEST_P(NewLight, ADiscOfFiniteAngleIsFoundByLooksAndByFlights) {
  const ivec3 voxels(40, 16, 24);
  const auto volume = test::make_volume(voxels, ivec3(0), [](const ivec3& /*p*/) { return 1.0F; });
  const auto viewer = make();
  viewer->set_volume(volume);
  viewer::GridSettings grid;
  grid.build.march = scene::March::dense;
  viewer->set_grid(grid);
  const double sigma = 0.08;
  viewer->set_camera(test::camera_at({19.5, 7.5, 900.0}, {19.5, 7.5, 0.0}, 0.01));
  for (const float g : {0.0F, 0.5F}) {
    viewer->set_medium({sigma, vec3(1.0F), {g}, 1});
    viewer->set_light({0.0F, 0.0F, vec3(0.0F), vec3(0.0F)});
    const test::Picture picture = test::render(*viewer, {8, 8, 1, 1, render::View::shaded});
    core::CpuDisc cpu;
    cpu.cm = viewer->viewer().trace_parameters();
    cpu.cm.dispatch.samples = 256;
    cpu.cm.lights.any = 1;
    cpu.volume = &volume;
    cpu.origin = ivec3(grid::fit_cube(volume).origin);
    cpu.cm_disc_cosine = static_cast<float>(std::cos(0.6));
    const double expected = single_scattering(dvec3(voxels), sigma, g, std::cos(0.6));
    for (const float chance : {1.0F, 0.3F, 0.0F}) {
      cpu.cm_disc_chance = chance;
      std::array<double, 64> means{};
      double mean = 0.0;
      for (std::uint32_t i = 0; i < 64; ++i) {
        means.at(i) = cpu.traced({i % 8, i / 8}).sum.x / 256.0;
        mean += means.at(i) / 64.0;
      }
      double square = 0.0;
      for (const double m : means) square += (m - mean) * (m - mean);
      const double error = std::sqrt(square) / 64.0;
      EXPECT_NEAR(mean, expected, 4.0 * error) << "g " << g << " chance " << chance;
      EXPECT_LT(error, (chance > 0.0F ? 0.02 : 0.1) * expected);
    }
  }
}

class NewLightShader : public test::GlTest {};
CUMULET_GL_ON_BACKENDS(NewLightShader);

// The same source among the shader's own.
TEST_P(NewLightShader, IsOneForDriversToo) {
  const gl::Shader* shader = gl::find_shader("trace.comp");
  ASSERT_NE(shader, nullptr);
  const std::array<std::string, 4> defines{
      "CM_MARCH 1", "CM_LINEAR 0", "CM_PAGES 1",
      "CM_MORE_LIGHTS(LIGHT) LIGHT(CM_LIGHT_OTHER, 0.5, cm_disc_sample, cm_disc_pdf, cm_disc_radiance)"};
  std::string text = shader->with(defines);
  const std::size_t place = text.find("// ---- All kinds");
  ASSERT_NE(place, std::string::npos);
  text.insert(place, R"(
const vec3 cm_disc_to = vec3(0.0, 1.0, 0.0);
const float cm_disc_cosine = 0.5;
const vec3 cm_disc_radiance_in = vec3(1.0);
)" + test::glsl_file("../tests/unit/support/disc_light.glsl"));
  EXPECT_NO_THROW(test::compute_program(gl_, text));
}

}  // namespace
