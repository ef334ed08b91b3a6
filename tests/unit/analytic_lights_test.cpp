// Lights of the host, compared with closed forms and quadrature.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "support/gl_viewer.hpp"
#include "support/osmesa_leaks.hpp"
#include "support/surfaces.hpp"
#include "support/volumes.hpp"
#include "viewer/c_lights.hpp"

namespace {

using namespace cumulet;
using glm::dvec3;
using glm::ivec3;
using glm::vec3;
using glm::vec4;
using render::March;
using test::StillScene;

constexpr double pi = std::numbers::pi;
constexpr double floor_y = -10.0;

cumulet_light_desc analytic_light(cumulet_light_kind kind, const dvec3& position, float power) {
  cumulet_light_desc d{};
  d.struct_size = sizeof d;
  d.kind = kind;
  for (int i = 0; i < 3; ++i) d.position[i] = position[i];
  d.power = power;
  return d;
}

light::AnalyticLights analytic_lights_of(const std::vector<cumulet_light_desc>& descs) {
  return c_abi::analytic_lights_of(descs.data(), descs.size());
}

class AnalyticLights : public test::ViewerTest {
 protected:
  void SetUp() override {
    ViewerTest::SetUp();
    if (IsSkipped()) return;
    still_ = make();
    still_->set_light({});
  }
  // A model with a light and a quad far from it.
  void show_model_with_analytic_light(const vec3& position, float intensity) {
    surface::PunctualLight of_model;
    of_model.intensity = vec3(intensity);
    of_model.position = position;
    auto scene = std::make_shared<StillScene>();
    scene->add(test::diffuse(vec3(1.0F)));
    scene->add_quad({{{-200, -200, -200}, {-100, -200, -200}, {-100, -100, -200}, {-200, -100, -200}}}, 0);
    scene->rest.lights = {of_model};
    still_->viewer().show_surfaces(test::source_of(scene));
  }
  void set_lights(const std::vector<cumulet_light_desc>& descs) {
    still_->viewer().set_lights(analytic_lights_of(descs));
  }
  void set_medium(double sigma, float albedo, std::uint32_t max_bounces = 0) {
    viewer::Medium medium;
    medium.density_scale = sigma;
    medium.albedo = vec3(albedo);
    medium.max_bounces = max_bounces;
    still_->set_medium(medium);
  }
  void set_march(March march) {
    viewer::GridSettings grid;
    grid.build.march = march;
    grid.build.refine.threshold = -1.0;
    still_->set_grid(grid);
  }
  // Looks straight down at a white floor below a slab of nearly no density.
  void set_floor(const std::vector<surface::PunctualLight>& lights = {}) {
    still_->set_volume(test::slab());
    set_medium(1e-6, 0.0F);
    viewer::CameraPose c;
    c.eye = {32.0, 300.0, 32.0};
    c.target = {32.0, 0.0, 32.0};
    c.up = {0.0, 0.0, -1.0};
    c.fovy_degrees = 0.05;
    still_->set_camera(c);
    auto scene = std::make_shared<StillScene>();
    scene->add(test::diffuse(vec3(1.0F)));
    const float y = floor_y;
    scene->add_quad({{{-200, y, 200}, {200, y, 200}, {200, y, -200}, {-200, y, -200}}}, 0);
    scene->rest.lights = lights;
    still_->viewer().show_surfaces(test::source_of(scene));
  }
  // Irradiance at the floor's center.
  double irradiance(std::uint32_t samples = 256) {
    const test::Picture picture = test::render(*still_, {16, 16, samples, 1, render::View::shaded});
    return picture.mean().x * pi;
  }

  std::unique_ptr<test::Still> still_;
};
CUMULET_ON_BACKENDS(AnalyticLights);

constexpr double above = 20.0;  // of the floor
const dvec3 position(32.0, floor_y + above, 32.0);

// Irradiance below a corner of a horizontal rectangle of radiance 1, with sides a and b, at height h.
double quarter(double a, double b, double h) {
  const double x = std::hypot(a, h);
  const double y = std::hypot(b, h);
  return 0.5 * (a / x * std::atan(b / x) + b / y * std::atan(a / y));
}

TEST_P(AnalyticLights, FloorIrradianceMatchesFormFactors) {
  set_floor();
  const auto expect = [&](const cumulet_light_desc& d, double expected, const char* what) {
    set_lights({d});
    EXPECT_NEAR(irradiance(), expected, 0.01 * expected + 1e-9) << what;
  };
  const double point = 1000.0 / (4.0 * pi) / (above * above);
  expect(analytic_light(CUMULET_LIGHT_POINT, position, 1000.0F), point, "point");

  auto spot = analytic_light(CUMULET_LIGHT_SPOT, position, 1000.0F);
  expect(spot, point, "spot");
  spot.direction[0] = std::tan(20.0 * pi / 180.0);
  spot.direction[1] = -1.0;
  expect(spot, point, "inside of the default cone");
  spot.direction[0] = std::tan(25.0 * pi / 180.0);
  expect(spot, 0.0, "outside");
  spot.angle_degrees = 60.0;
  expect(spot, point, "inside of a wider cone");
  spot.blend = 1.0;
  const double edge = std::cos(30.0 * pi / 180.0);
  const double share = (std::cos(25.0 * pi / 180.0) - edge) / (1.0 - edge);
  expect(spot, point * share * share, "blended");
  auto narrow = analytic_light(CUMULET_LIGHT_SPOT, position, 1000.0F);
  narrow.angle_degrees = 4.0;
  expect(narrow, point, "narrow");

  auto disc = analytic_light(CUMULET_LIGHT_DISK, position, 1000.0F);
  disc.width = 30.0;
  expect(disc, 0.25 * 1000.0 / (above * above + 225.0), "disc");
  disc.direction[1] = 1.0;
  expect(disc, 0.0, "a disc's back");

  auto rectangle = analytic_light(CUMULET_LIGHT_RECT, position, 1000.0F);
  rectangle.width = 30.0;
  rectangle.height = 8.0;
  const double radiance = 1000.0 / (4.0 * 240.0);
  expect(rectangle, 4.0 * radiance * quarter(15.0, 4.0, above), "rectangle");
  // The point is below the rectangle's edge: half of it is above, to one side.
  rectangle.position[2] += 15.0;
  rectangle.tangent[2] = -3.0;
  rectangle.tangent[1] = 100.0;
  expect(rectangle, 2.0 * radiance * quarter(30.0, 4.0, above), "rectangle beside");
  // Upright, its lower edge level with the floor.
  rectangle = analytic_light(CUMULET_LIGHT_RECT, {32.0, floor_y + 4.0, 32.0 + above}, 1000.0F);
  rectangle.direction[2] = -1.0;
  rectangle.width = 30.0;
  rectangle.height = 8.0;
  const double near = std::atan(15.0 / above);
  const double slant = above / std::hypot(above, 8.0) * std::atan(15.0 / std::hypot(above, 8.0));
  expect(rectangle, radiance * (near - slant), "upright");

  for (const double angle : {0.0, 1.0, 60.0}) {
    auto sun = analytic_light(CUMULET_LIGHT_DISTANT, dvec3(0.0), 3.0F);
    sun.angle_degrees = angle;
    expect(sun, 3.0, "sun");
    sun.direction[0] = 1.0;
    sun.direction[1] = -1.0;
    expect(sun, 3.0 * std::sqrt(0.5), "a slanted sun");
  }
}

// Lights are sampled by their contribution, and weak ones are still unbiased.
TEST_P(AnalyticLights, DimLightsNextToBrightOnesCount) {
  set_floor();
  std::vector<cumulet_light_desc> analytic_lights{analytic_light(CUMULET_LIGHT_POINT, position, 1.0F)};
  auto away = analytic_light(CUMULET_LIGHT_SPOT, position, 1e6F);  // faces up
  away.direction[1] = 1.0;
  analytic_lights.push_back(away);
  set_lights(analytic_lights);
  const double dim = 1.0 / (4.0 * pi) / (above * above);
  EXPECT_NEAR(irradiance(1024), dim, 0.03 * dim);
  for (const float power : {10.0F, 3.0F, 100.0F})
    analytic_lights.push_back(analytic_light(CUMULET_LIGHT_POINT, position, power));
  analytic_lights.erase(analytic_lights.begin() + 1);
  set_lights(analytic_lights);
  EXPECT_NEAR(irradiance(256), 114.0 * dim, 0.01 * 114.0 * dim);
}

TEST_P(AnalyticLights, CombineWithModelLightsAndHaveColors) {
  surface::PunctualLight of_scene;
  of_scene.intensity = vec3(100.0F);
  of_scene.position = vec3(position);
  set_floor({of_scene});
  auto d = analytic_light(CUMULET_LIGHT_POINT, position, 1000.0F);
  d.color[0] = 0.5F;
  d.color[1] = 0.25F;
  set_lights({d, analytic_light(CUMULET_LIGHT_DISTANT, dvec3(0.0), 0.1F),
              analytic_light(CUMULET_LIGHT_POINT, position, 0.0F)});
  const test::Picture picture = test::render(*still_, {16, 16, 1024, 1, render::View::shaded});
  const double each = 1000.0 / (4.0 * pi) / (above * above);
  EXPECT_NEAR(picture.mean().x * pi, 100.0 / (above * above) + 0.5 * each + 0.1, 0.005);
  EXPECT_NEAR(picture.mean().y * pi, 100.0 / (above * above) + 0.25 * each + 0.1, 0.005);
  EXPECT_NEAR(picture.mean().z * pi, 100.0 / (above * above) + 0.1, 0.005);
  set_lights({});
  EXPECT_NEAR(irradiance(), 100.0 / (above * above), 1e-3);
}

TEST_P(AnalyticLights, LightRasterizedSurfaces) {
  set_floor();
  viewer::SurfaceSettings none;
  none.light = viewer::SurfaceLight::none;
  still_->viewer().set_surface_settings(none);
  set_lights({analytic_light(CUMULET_LIGHT_POINT, position, 1000.0F)});
  EXPECT_NEAR(irradiance(4) * (4.0 * pi) * above * above / 1000.0, 1.0, 0.01);
  auto disc = analytic_light(CUMULET_LIGHT_DISK, position, 1000.0F);
  disc.width = 0.1;
  set_lights({disc});
  EXPECT_NEAR(irradiance(4) * 4.0 * above * above / 1000.0, 1.0, 0.01);
  auto sun = analytic_light(CUMULET_LIGHT_DISTANT, dvec3(0.0), 3.0F);
  sun.angle_degrees = 60.0;
  set_lights({sun});
  EXPECT_NEAR(irradiance(4), 3.0, 0.01) << "as bright as it says, however wide";
}

// If the model is only rasterized, its lights are not sampled, and the host's lights are unaffected.
TEST_P(AnalyticLights, LightsOfRasterizedOnlyModelsAreNotSampled) {
  still_->set_volume(test::make_volume({64, 64, 8}, ivec3(0), [](const ivec3& /*p*/) { return 1.0F; }));
  set_medium(0.1, 1.0F, 1);
  viewer::SurfaceSettings none;
  none.light = viewer::SurfaceLight::none;
  still_->viewer().set_surface_settings(none);
  set_lights({analytic_light(CUMULET_LIGHT_POINT, {32.0, 32.0, 60.0}, 4e5F)});
  const auto mean = [&] {
    still_->set_camera(test::camera_at({32.0, 32.0, 300.0}, {32.0, 32.0, 0.0}, 2.0));
    return test::render(*still_, {16, 16, 256, 1, render::View::shaded}).mean().x;
  };
  const double alone = mean();
  ASSERT_GT(alone, 0.01);
  show_model_with_analytic_light({10.0F, 50.0F, 40.0F}, 3e4F);
  EXPECT_NEAR(mean(), alone, 0.01 * alone);
}

// A model's lights light the volume in previews as in the final image, with and without lights of the host.
TEST_P(AnalyticLights, ModelLightsLightTheVolumeInPreviews) {
  still_->set_volume(test::make_volume({64, 64, 8}, ivec3(0), [](const ivec3& /*p*/) { return 1.0F; }));
  set_medium(0.1, 1.0F, 1);
  still_->set_camera(test::camera_at({32.0, 32.0, 300.0}, {32.0, 32.0, 0.0}, 2.0));
  show_model_with_analytic_light({32.0F, 32.0F, 40.0F}, 1000.0F);
  viewer::Light faint;
  faint.sky_radiance = vec3(1e-6F);
  still_->set_light(faint);
  still_->build();
  still_->viewer().set_sampling({256, 1, {render::View::shaded, true}});
  viewer::Frame frame;
  frame.target = viewer::Target::none;
  frame.size = {160, 160};
  frame.viewport = {0, 0, 160, 160};
  frame.budget_ms = 5.0;
  viewer::FrameResult result;
  for (int i = 0; i < 1000 && !result.preview; ++i) result = still_->viewer().render(frame);
  ASSERT_TRUE(result.preview);
  test::Picture preview;
  preview.pixels.resize(std::size_t{result.size.x} * result.size.y);
  still_->viewer().read_linear(&preview.pixels[0].x, preview.pixels.size() * 4);
  const double final = test::render(*still_, {16, 16, 256, 1, render::View::shaded}).mean().x;
  EXPECT_NEAR(preview.mean().x, final, 0.5 * final);
}

TEST_P(AnalyticLights, ExtremePowerGivesFiniteValues) {
  still_->set_volume(test::make_volume({16, 16, 16}, ivec3(0), [](const ivec3& /*p*/) { return 1.0F; }));
  set_medium(2.0, 1.0F);
  still_->set_camera(test::camera_at({8.0, 8.0, 60.0}, {8.0, 8.0, 8.0}, 20.0));
  // Lights of size 0 inside the medium, so that paths scatter close to them.
  auto spot = analytic_light(CUMULET_LIGHT_SPOT, {8.0, 8.0, 8.0}, 9e29F);
  auto disc = analytic_light(CUMULET_LIGHT_DISK, {8.0, 8.0, 12.0}, 9e29F);
  auto sun = analytic_light(CUMULET_LIGHT_DISTANT, dvec3(0.0), 9e29F);
  disc.width = 1e-3;
  sun.angle_degrees = 90.0;
  set_lights({spot, disc, sun, analytic_light(CUMULET_LIGHT_POINT, {7.0, 7.0, 9.0}, 9e29F)});
  for (const vec4& pixel : test::render(*still_, {16, 16, 64, 1, render::View::shaded}).pixels) {
    ASSERT_TRUE(std::isfinite(pixel.x)) << pixel.x;
  }
}

// ---- in a medium ----

constexpr ivec3 box_size(24, 16, 24);

// Length of the part of the segment from a to b that is inside the box of voxels.
double inside(const dvec3& a, const dvec3& b) {
  double t_0 = 0.0;
  double t_1 = 1.0;
  for (int axis = 0; axis < 3; ++axis) {
    const double way = b[axis] - a[axis];
    if (std::abs(way) < 1e-12) continue;
    const double low = (-0.5 - a[axis]) / way;
    const double high = (box_size[axis] - 0.5 - a[axis]) / way;
    t_0 = std::max(t_0, std::min(low, high));
    t_1 = std::min(t_1, std::max(low, high));
  }
  return std::max(0.0, t_1 - t_0) * glm::length(b - a);
}

// Single isotropic scattering into the ray through the box's center along -z. The light emits intensity(vector from the
// point) at sample points; the result is the mean over them.
double scattered(double sigma, const std::vector<dvec3>& points, const std::function<double(const dvec3&)>& intensity) {
  constexpr int n = 2000;
  const double step = double(box_size.z) / n;
  double sum = 0.0;
  for (int i = 0; i < n; ++i) {
    const double depth = (i + 0.5) * step;
    const dvec3 here(0.5 * (box_size.x - 1), 0.5 * (box_size.y - 1), box_size.z - 0.5 - depth);
    for (const dvec3& point : points) {
      const dvec3 way = here - point;
      const double d = glm::length(way);
      sum += sigma * std::exp(-sigma * (depth + inside(here, point))) * intensity(way / d) / (d * d);
    }
  }
  return sum * step / (4.0 * pi) / double(points.size());
}

TEST_P(AnalyticLights, SingleScatteringMatchesQuadrature) {
  still_->set_volume(test::make_volume(box_size, ivec3(0), [](const ivec3& /*p*/) { return 1.0F; }));
  const dvec3 middle(0.5 * (box_size.x - 1), 0.5 * (box_size.y - 1), 0.5 * (box_size.z - 1));
  still_->set_camera(test::camera_at({middle.x, middle.y, 900.0}, middle, 0.01));
  const dvec3 within = middle + dvec3(4.0, 3.0, 1.0);
  const dvec3 beyond = middle + dvec3(-5.0, 30.0, 2.0);
  const double power = 1000.0;
  const auto point = [&](const dvec3&) { return power / (4.0 * pi); };
  const auto area = [&](const dvec3& w) { return 0.25 * power * std::max(0.0, -w.y); };
  std::vector<dvec3> disc;
  std::vector<dvec3> rectangle;
  for (int i = 0; i < 40; ++i) {
    for (int j = 0; j < 40; ++j) {
      const double u = (i + 0.5) / 40.0;
      const double v = (j + 0.5) / 40.0;
      const double r = 6.0 * std::sqrt(u);
      disc.push_back(within + dvec3(r * std::cos(2.0 * pi * v), 0.0, r * std::sin(2.0 * pi * v)));
      rectangle.push_back(beyond + dvec3(40.0 * (u - 0.5), 0.0, 10.0 * (v - 0.5)));
    }
  }
  auto round = analytic_light(CUMULET_LIGHT_DISK, within, float(power));
  round.width = 12.0;
  auto wide = analytic_light(CUMULET_LIGHT_RECT, beyond, float(power));
  wide.width = 40.0;
  wide.height = 10.0;
  // In the thin medium, equiangular sampling is used for all lights; in the other one, only for lights inside.
  for (const double sigma : {0.08, 0.004}) {
    set_medium(sigma, 1.0F, 1);
    for (const March march : {March::tet, March::dense, March::brick}) {
      set_march(march);
      const auto expect = [&](const cumulet_light_desc& d, double expected, const char* what) {
        set_lights({d});
        const std::uint32_t samples = sigma < 0.01 ? 64 : 256;
        const test::Picture picture = test::render(*still_, {48, 48, samples, 1, render::View::shaded});
        EXPECT_NEAR(picture.mean().x / expected, 1.0, 0.01) << what << " " << int(march) << " " << sigma;
      };
      expect(analytic_light(CUMULET_LIGHT_POINT, within, float(power)), scattered(sigma, {within}, point),
             "point inside");
      expect(analytic_light(CUMULET_LIGHT_POINT, beyond, float(power)), scattered(sigma, {beyond}, point),
             "point outside");
      expect(round, scattered(sigma, disc, area), "disc inside");
      expect(wide, scattered(sigma, rectangle, area), "rectangle outside");
    }
  }
}

// ---- the C API ----

std::string refusal(const std::vector<cumulet_light_desc>& descs) {
  try {
    analytic_lights_of(descs);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(LightDescriptors, InvalidValuesAreRejectedByName) {
  const auto good = analytic_light(CUMULET_LIGHT_POINT, dvec3(0.0), 1.0F);
  EXPECT_EQ(refusal({good, good}), "");
  const auto bad = [&](const std::function<void(cumulet_light_desc&)>& spoil) {
    auto d = good;
    spoil(d);
    return refusal({good, d});
  };
  const std::string field = "light 1: cumulet_light_desc.";
  EXPECT_EQ(bad([](auto& d) { d.kind = static_cast<cumulet_light_kind>(5); }), field + "kind is unknown");
  EXPECT_EQ(bad([](auto& d) { d.power = -1.0F; }), field + "power is not from 0 to 1e30");
  EXPECT_EQ(bad([](auto& d) { d.position[2] = NAN; }), field + "position is not finite");
  EXPECT_EQ(bad([](auto& d) { d.position[2] = 1e300; }), field + "position exceeds 1e30");
  EXPECT_EQ(bad([](auto& d) { d.direction[0] = INFINITY; }), field + "direction is not finite");
  EXPECT_EQ(bad([](auto& d) { d.color[0] = -1.0F; }), field + "color is negative or not finite");
  EXPECT_EQ(bad([](auto& d) { d.power = 1e29F, d.color[1] = 1e29F; }), field + "power times color exceeds 1e30");
  EXPECT_EQ(bad([](auto& d) { d.power = 1e29F, d.color[1] = 20.0F; }), field + "power times color exceeds 1e30");
  EXPECT_EQ(bad([](auto& d) { d.width = -1.0; }), field + "width is not from 0 to 1e30");
  EXPECT_EQ(bad([](auto& d) { d.angle_degrees = 181.0; }), field + "angle_degrees is not from 0 to 180");
  EXPECT_EQ(bad([](auto& d) { d.kind = CUMULET_LIGHT_DISTANT, d.angle_degrees = 91.0; }),
            field + "angle_degrees is above 90, the maximum for a distant light");
  EXPECT_EQ(bad([](auto& d) { d.blend = 1.5; }), field + "blend is not from 0 to 1");
  EXPECT_EQ(bad([](auto& d) { d.struct_size -= 8; }),
            "light 1: cumulet_light_desc.struct_size differs from that of the first element");
  EXPECT_THROW(c_abi::analytic_lights_of(nullptr, 1), Error);
  EXPECT_THROW(c_abi::analytic_lights_of(&good, 4097), Error);
  EXPECT_TRUE(c_abi::analytic_lights_of(nullptr, 0).empty());
}

TEST(LightDescriptors, ZeroMeansTheDefault) {
  auto d = analytic_light(CUMULET_LIGHT_RECT, dvec3(0.0), 2.0F);
  light::AnalyticLight made = analytic_lights_of({d}).at(0);
  EXPECT_EQ(made.direction, dvec3(0.0, -1.0, 0.0));
  EXPECT_EQ(made.across, dvec3(1.0, 0.0, 0.0));
  EXPECT_EQ(made.power, vec3(2.0F));
  EXPECT_EQ(made.width, 1.0);
  EXPECT_EQ(made.height, 1.0);
  // A direction of any length, and a tangent that is not perpendicular to it.
  d.direction[2] = -1e-200;
  d.tangent[0] = 1.0;
  d.tangent[2] = 5.0;
  made = analytic_lights_of({d}).at(0);
  EXPECT_EQ(made.direction, dvec3(0.0, 0.0, -1.0));
  EXPECT_EQ(made.across, dvec3(1.0, 0.0, 0.0));
  d.tangent[0] = 0.0;  // along the direction
  EXPECT_NEAR(glm::length(analytic_lights_of({d}).at(0).across - dvec3(-1.0, 0.0, 0.0)), 0.0, 1e-12);
}

}  // namespace
