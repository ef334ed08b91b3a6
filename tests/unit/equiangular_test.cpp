// Equiangular sampling of lights along rays (glsl/path/equiangular.glsl): the same mean as without it, together with
// all other lights, and less noise. analytic_lights_test has closed forms.
//
// Kernels use it depending on the lights and the medium's optical depth. If the only light is outside of a medium that
// is not thin, they use it once another light is inside. Here that light is so faint that it changes nothing else.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <glm/gtc/matrix_transform.hpp>
#include <memory>

#include "support/gl_viewer.hpp"
#include "support/osmesa_leaks.hpp"
#include "support/surfaces.hpp"
#include "support/volumes.hpp"

namespace {

using namespace cumulet;
using glm::dvec3;
using glm::ivec3;
using glm::vec3;
using render::March;

core::CmAnalyticLight record(std::uint32_t kind, const vec3& position) {
  core::CmAnalyticLight analytic_light{};
  analytic_light.kind = kind;
  analytic_light.position = position;
  return analytic_light;
}

TEST(NearestLight, IgnoresDistantLights) {
  const light::Lit ball{dvec3(1.0, 0.0, 0.0), 2.0};
  EXPECT_FALSE(light::nearest_analytic_light({}, ball));
  std::vector<core::CmAnalyticLight> analytic_lights{record(core::CM_ANALYTIC_LIGHT_DISTANT, vec3(1.0F, 0.0F, 0.0F))};
  EXPECT_FALSE(light::nearest_analytic_light(analytic_lights, ball)) << "a sun stands nowhere";
  analytic_lights.push_back(record(core::CM_ANALYTIC_LIGHT_DISC, vec3(9.0F, 0.0F, 0.0F)));
  EXPECT_DOUBLE_EQ(light::nearest_analytic_light(analytic_lights, ball).value(), 4.0);
  analytic_lights.push_back(record(core::CM_ANALYTIC_LIGHT_POINT, vec3(1.0F, 3.0F, 0.0F)));
  EXPECT_DOUBLE_EQ(light::nearest_analytic_light(analytic_lights, ball).value(), 1.5);
  EXPECT_FALSE(light::nearest_analytic_light(analytic_lights, light::Lit{})) << "no medium";
}

TEST(NearestLight, EnablesEquiangularSamplingInThinMediaOnly) {
  EXPECT_TRUE(light::suits_equiangular(0.5, 1.0));
  EXPECT_FALSE(light::suits_equiangular(0.5, 10.0)) << "collisions find it";
  EXPECT_FALSE(light::suits_equiangular(2.0, 1.0)) << "its light is even";
  EXPECT_TRUE(light::suits_equiangular(2.0, 0.1));
  EXPECT_FALSE(light::suits_equiangular(std::nullopt, 0.0));
  EXPECT_FALSE(light::suits_equiangular(0.5, NAN));
}

light::AnalyticLight analytic_light_at(const dvec3& position, float power) {
  light::AnalyticLight analytic_light;
  analytic_light.position = position;
  analytic_light.power = vec3(power);
  return analytic_light;
}

constexpr ivec3 size(32, 24, 32);
const dvec3 outside(40.0, 40.0, 30.0);
const dvec3 inside(12.0, 10.0, 15.0);

class Equiangular : public test::ViewerTest {
 protected:
  struct Seen {
    dvec3 mean{0.0};
    dvec3 error{0.0};       // of the mean
    double variance = 0.0;  // of a pixel's first component
  };

  void SetUp() override {
    ViewerTest::SetUp();
    if (IsSkipped()) return;
    still_ = make();
    still_->set_light({});
    still_->set_camera(test::camera_at({20.0, 30.0, 90.0}, {16.0, 12.0, 16.0}, 26.0));
    still_->set_volume(std::make_shared<const viewer::VolumeAsset>(frame()));
    set_medium(0.06);
  }

  // A frame with varying density, color and anisotropy.
  static volume::VolumeFrame frame() {
    volume::VolumeFrame made{.density = test::make_volume(size, ivec3(0), [](const ivec3& p) {
                               return 0.25F + float((p.x / 8 + p.y / 8 + p.z / 8) % 2);
                             })};
    const auto component = [](float low, float high) {
      return test::make_volume(size, ivec3(0), [=](const ivec3& p) { return p.y < 12 ? low : high; });
    };
    made.color = {component(1.0F, 0.5F), component(0.5F, 1.0F), component(0.75F, 0.75F)};
    made.anisotropy = {component(0.5F, 0.0F), component(0.0F, 0.25F)};
    return made;
  }
  void set_medium(double scale, std::uint32_t max_bounces = 0) {
    viewer::Medium medium;
    medium.density_scale = scale;
    medium.albedo = vec3(0.9F);
    medium.max_bounces = max_bounces;
    still_->set_medium(medium);
  }
  void set_march(March march, grid::CellKind cells = grid::CellKind::linear) {
    viewer::GridSettings grid;
    grid.build.march = march;
    grid.build.refine.threshold = -1.0;
    grid.build.refine.cells = cells;
    still_->set_grid(grid);
  }

  // extra: lights in addition to the one outside.
  Seen see(const light::AnalyticLights& extra, std::uint32_t samples = 128) {
    light::AnalyticLights analytic_lights{analytic_light_at(outside, 1e5F)};
    analytic_lights.insert(analytic_lights.end(), extra.begin(), extra.end());
    still_->viewer().set_lights(analytic_lights);
    Seen seen;
    const test::Picture a = test::render(*still_, {32, 32, samples, 1, render::View::shaded});
    const test::Picture b = test::render(*still_, {32, 32, samples, 2, render::View::shaded});
    seen.mean = 0.5 * (dvec3(a.mean()) + dvec3(b.mean()));
    dvec3 variance(0.0);
    for (std::size_t i = 0; i < a.pixels.size(); ++i) {
      const dvec3 apart = dvec3(a.pixels[i]) - dvec3(b.pixels[i]);
      variance += 0.5 * apart * apart / double(a.pixels.size());
    }
    seen.variance = variance.x;
    seen.error = glm::sqrt(0.5 * variance / double(a.pixels.size()));
    return seen;
  }
  // Expects the same mean with equiangular sampling and without.
  void expect_the_same(const char* what) {
    const Seen without = see({});
    const Seen with = see({analytic_light_at(inside, 1e-4F)});
    for (int i = 0; i < 3; ++i) {
      const double error = std::hypot(without.error[i], with.error[i]);
      ASSERT_GT(without.mean[i], 20.0 * error) << what << ": too much noise to compare";
      EXPECT_NEAR(with.mean[i], without.mean[i], 4.0 * error) << what << " " << i;
    }
    EXPECT_NE(with.variance, without.variance) << what;
  }

  std::unique_ptr<test::Still> still_;
};
CUMULET_ON_BACKENDS(Equiangular);

TEST_P(Equiangular, AgreesWithDistanceSamplingForEveryGridType) {
  for (const grid::CellKind cells : {grid::CellKind::linear, grid::CellKind::constant}) {
    set_march(March::tet, cells);
    expect_the_same("tet");
  }
  set_march(March::dense);
  expect_the_same("dense");
  set_march(March::brick);
  expect_the_same("brick");
}

TEST_P(Equiangular, RespectsTheBounceLimit) {
  for (const std::uint32_t bounces : {1U, 2U, 3U}) {
    set_medium(0.06, bounces);
    expect_the_same(("bounces: " + std::to_string(bounces)).c_str());
  }
}

TEST_P(Equiangular, AgreesWithDistanceSamplingUnderSunSkyAndGround) {
  still_->set_light({30.0F, 40.0F, vec3(1.0F), vec3(0.2F, 0.3F, 0.4F)});
  expect_the_same("sun and sky");
  still_->viewer().set_ground({viewer::GroundMode::at_height, -2.0, vec3(0.6F)});
  expect_the_same("ground below");
  still_->viewer().set_ground({viewer::GroundMode::at_height, 8.0, vec3(0.6F)});
  expect_the_same("ground within");
}

TEST_P(Equiangular, AgreesWithDistanceSamplingAmongSurfaces) {
  auto scene = std::make_shared<test::StillScene>();
  scene->add(test::diffuse(vec3(0.7F)));
  scene->add_quad({{{-20, 6, 50}, {50, 6, 50}, {50, 6, -20}, {-20, 6, -20}}}, 0);  // through the medium
  scene->add_quad({{{22, 0, 34}, {22, 24, 34}, {22, 24, 10}, {22, 0, 10}}}, 0);    // between the light and the medium
  still_->viewer().show_surfaces(test::source_of(scene));
  set_march(March::tet);
  expect_the_same("surfaces");
  still_->set_light({30.0F, 40.0F, vec3(1.0F), vec3(0.2F, 0.3F, 0.4F)});
  expect_the_same("surfaces in daylight");
  viewer::SurfaceSettings shadows;
  shadows.light = viewer::SurfaceLight::shadows;
  still_->viewer().set_surface_settings(shadows);
  expect_the_same("shadows");
}

TEST_P(Equiangular, AgreesWithDistanceSamplingInOverlappingVolumes) {
  const glm::dmat4 aside = glm::translate(glm::dmat4(1.0), dvec3(10.0, 4.0, -6.0));
  still_->viewer().set_transforms({{glm::dmat4(1.0)}, {aside}});
  set_medium(0.03);
  set_march(March::tet);
  expect_the_same("two places");
  auto scene = std::make_shared<test::StillScene>();
  scene->add(test::diffuse(vec3(0.7F)));
  scene->add_quad({{{-20, 6, 50}, {50, 6, 50}, {50, 6, -20}, {-20, 6, -20}}}, 0);
  still_->viewer().show_surfaces(test::source_of(scene));
  expect_the_same("two places and surfaces");
}

TEST_P(Equiangular, ReducesNoiseInThinSmoke) {
  set_march(March::tet);
  // Thin enough that a light outside enables equiangular sampling, and slightly too dense for it.
  set_medium(0.006);
  const Seen with = see({});
  set_medium(0.015);
  const Seen without = see({});
  const double noise_with = with.variance / (with.mean.x * with.mean.x);
  const double noise_without = without.variance / (without.mean.x * without.mean.x);
  EXPECT_LT(2.0 * noise_with, noise_without);
}

}  // namespace
