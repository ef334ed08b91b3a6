// Emissive triangles as lights: the sampling table, and images compared with quadrature and with equal emitters that
// only scattered rays hit.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>
#include <numbers>

#include "light/emitters.hpp"
#include "support/gl_viewer.hpp"
#include "support/osmesa_leaks.hpp"
#include "support/surfaces.hpp"
#include "support/volumes.hpp"

namespace {

using namespace cumulet;
using glm::dvec2;
using glm::dvec3;
using glm::ivec3;
using glm::vec2;
using glm::vec3;
using light::EmissiveTriangle;
using light::EmitterTable;
using render::March;
using surface::Material;
using test::camera_at;
using test::Picture;
using test::StillScene;
using viewer::SurfaceLight;

constexpr double pi = std::numbers::pi;

Material emitter(const vec3& radiance, const vec3& albedo = vec3(0.0F)) {
  Material m = test::diffuse(albedo);
  m.emission = radiance;
  return m;
}

/// Looks the same, but is not in the light table: only scattered rays hit it.
Material unlit(const vec3& radiance) {
  Material m;
  m.base_color = glm::vec4(radiance, 1.0F);
  m.unlit = true;
  return m;
}

/// A horizontal square centered on (32, y, 32) that faces down or up.
std::array<vec3, 4> square(float y, float half, bool down) {
  std::array<vec3, 4> c{
      {{32 - half, y, 32 + half}, {32 + half, y, 32 + half}, {32 + half, y, 32 - half}, {32 - half, y, 32 - half}}};
  if (down) std::swap(c[1], c[3]);
  return c;
}

constexpr float floor_y = -10.0F;
constexpr float patch_y = 20.0F;
constexpr float patch_half = 10.0F;
// Bounds of the slab of voxels.
constexpr double slab_low = -0.5;
constexpr double slab_high = 7.5;

viewer::Medium medium(double density, float albedo, float anisotropy = 0.0F, std::uint32_t max_bounces = 0) {
  viewer::Medium m;
  m.density_scale = density;
  m.albedo = vec3(albedo);
  m.phase.anisotropy = anisotropy;
  m.max_bounces = max_bounces;
  return m;
}

viewer::SurfaceSettings surface_light(SurfaceLight light) {
  viewer::SurfaceSettings s;
  s.light = light;
  return s;
}

/// The sum over the patch's points p of f(p) dA, at the centers of a fine grid.
double over_patch(double half, const std::function<double(const dvec3&)>& f) {
  constexpr int n = 112;
  double sum = 0.0;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      const double x = (2.0 * (i + 0.5) / n - 1.0) * half;
      const double z = (2.0 * (j + 0.5) / n - 1.0) * half;
      sum += f({32.0 + x, patch_y, 32.0 + z});
    }
  }
  return sum * (2.0 * half / n) * (2.0 * half / n);
}

/// Irradiance at the floor's center below a patch that emits radiance(p), through the slab.
double irradiance(double sigma, double half, const std::function<double(const dvec3&)>& radiance) {
  return over_patch(half, [&](const dvec3& p) {
    const dvec3 way = p - dvec3(32.0, floor_y, 32.0);
    const double d = glm::length(way);
    const double cosine = way.y / d;
    return radiance(p) * cosine * cosine / (d * d) * std::exp(-sigma * (slab_high - slab_low) / cosine);
  });
}

/// The mean of pixels that all estimate the same value, and four standard errors of it.
struct Estimate {
  dvec3 mean{0.0};
  double error = 0.0;  // of the first channel
};

Estimate estimate(const Picture& picture) {
  Estimate e;
  e.mean = picture.mean();
  double square = 0.0;
  for (const glm::vec4& p : picture.pixels) square += (p.x - e.mean.x) * (p.x - e.mean.x);
  e.error = 4.0 * std::sqrt(square) / static_cast<double>(picture.pixels.size());
  return e;
}

void expect_mean(const Picture& picture, double expected, double precision, const std::string& what) {
  const Estimate e = estimate(picture);
  EXPECT_NEAR(e.mean.x, expected, e.error + 1e-3 * expected) << what;
  EXPECT_LT(e.error, precision * expected) << what;
}

std::shared_ptr<StillScene> patch_over_floor(const Material& patch, bool down = true, float albedo = 0.5F) {
  auto scene = std::make_shared<StillScene>();
  scene->add(test::diffuse(vec3(albedo)));
  scene->add(patch);
  scene->add_quad(square(floor_y, 200.0F, false), 0);
  scene->add_quad(square(patch_y, patch_half, down), 1);
  return scene;
}

surface::Image stripes() {
  surface::Image image;
  image.width = 2;
  image.height = 1;
  image.rgba = {188, 188, 188, 255, 0, 0, 0, 0};
  return image;
}

// ---- the table ----

/// The probability of each triangle, as the shader samples them.
std::map<std::uint32_t, double> probabilities(const EmitterTable& table) {
  std::map<std::uint32_t, double> probability;
  const double n = static_cast<double>(table.entries.size());
  for (const glm::uvec4& entry : table.entries) {
    const double stays = (static_cast<double>(entry.y) + 1.0) / 4294967296.0;
    probability[entry.x] += stays / n;
    if (stays < 1.0) probability[table.entries.at(entry.z).x] += (1.0 - stays) / n;
  }
  return probability;
}

double area_of(const StillScene& scene, std::uint32_t triangle) {
  std::array<dvec3, 3> p;
  for (std::size_t i = 0; i < 3; ++i) p[i] = scene.rest.vertices[scene.indices[3 * triangle + i]].position;
  return 0.5 * glm::length(glm::cross(p[1] - p[0], p[2] - p[0]));
}

TEST(Emitters, SelectionFollowsPower) {
  auto scene = std::make_shared<StillScene>();
  scene->add(test::diffuse(vec3(1.0F)));
  scene->add(emitter(vec3(1.0F)));
  scene->add(emitter(vec3(0.0F, 7.0F, 0.0F)));
  scene->materials[2].double_sided = true;
  scene->add(unlit(vec3(5.0F)));
  for (std::uint32_t i = 0; i < 40; ++i) {
    scene->add_quad(square(static_cast<float>(i), 0.1F * static_cast<float>(i * i), i % 3 == 0), i % 4);
  }
  scene->rest.flipped[5] = 1;
  const std::vector<EmissiveTriangle> emissive = light::emissive_triangles(*scene, scene->rest);
  ASSERT_EQ(emissive.size(), 40U);
  const EmitterTable table = light::emitter_table(emissive, *scene, scene->rest);
  double sum = 0.0;
  double flux = 0.0;
  const std::map<std::uint32_t, double> probability = probabilities(table);
  ASSERT_EQ(probability.size(), table.entries.size());
  for (std::size_t i = 0; i < table.entries.size(); ++i) {
    const glm::uvec4& entry = table.entries[i];
    EXPECT_LT(i > 0 ? table.entries[i - 1].x : 0U, entry.x);
    const std::uint32_t quad = entry.x / 2;
    EXPECT_TRUE(quad % 4 == 1 || quad % 4 == 2);
    const float density = glm::uintBitsToFloat(entry.w);
    EXPECT_EQ(density < 0.0F, quad == 5);
    const double area = area_of(*scene, entry.x);
    const double power = area * (quad % 4 == 1 ? 1.0 : 2.0 * 7.0 * 0.7152);
    EXPECT_NEAR(probability.at(entry.x) * table.flux / pi / power, 1.0, 2e-3);
    EXPECT_NEAR(std::abs(density) * area / probability.at(entry.x), 1.0, 1e-5);
    sum += probability.at(entry.x);
    flux += pi * power;
  }
  EXPECT_NEAR(sum, 1.0, 1e-9);
  EXPECT_NEAR(table.flux / flux, 1.0, 1e-6);
  // One-sided triangles emit twice the flux if the pose is double-sided.
  double one_sided = 0.0;
  for (const glm::uvec4& entry : table.entries) one_sided += entry.x / 2 % 4 == 1 ? area_of(*scene, entry.x) : 0.0;
  scene->rest.double_sided = true;
  EXPECT_NEAR(light::emitter_table(emissive, *scene, scene->rest).flux / (flux + pi * one_sided), 1.0, 1e-6);
}

TEST(Emitters, ZeroAreaOrPowerIsExcluded) {
  auto scene = std::make_shared<StillScene>();
  scene->add(emitter(vec3(1.0F)));
  scene->add(emitter(vec3(1.0F)));
  surface::Image black;
  black.width = black.height = 1;
  black.rgba = {0, 0, 0, 255};
  scene->images.push_back(black);
  scene->textures.push_back({});
  scene->materials[1].emission_texture.texture = 0;
  scene->add_quad(square(0.0F, 0.0F, true), 0);
  scene->add_quad(square(0.0F, 1.0F, true), 1);
  const std::vector<EmissiveTriangle> emissive = light::emissive_triangles(*scene, scene->rest);
  EXPECT_EQ(emissive.size(), 2U);
  const EmitterTable table = light::emitter_table(emissive, *scene, scene->rest);
  EXPECT_TRUE(table.entries.empty());
  EXPECT_EQ(table.flux, 0.0);
}

TEST(Emitters, EmissiveTexturesSelectTriangles) {
  auto scene = std::make_shared<StillScene>();
  scene->add(emitter(vec3(1.0F)));
  scene->images.push_back(stripes());
  scene->textures.push_back({});
  scene->materials[0].emission_texture.texture = 0;
  for (const float middle : {0.25F, 0.75F}) {
    scene->add_quad(square(0.0F, 1.0F, true), 0);
    for (std::size_t i = scene->attributes.size() - 4; i < scene->attributes.size(); ++i) {
      scene->attributes[i].uv[0] = vec2(middle, 0.5F) + 0.2F * (scene->attributes[i].uv[0] - 0.5F);
    }
  }
  const std::vector<EmissiveTriangle> emissive = light::emissive_triangles(*scene, scene->rest);
  ASSERT_EQ(emissive.size(), 4U);
  EXPECT_NEAR(emissive[0].luminance, 0.503, 0.001);
  EXPECT_NEAR(emissive[1].luminance, 0.503, 0.001);
  EXPECT_GT(emissive[2].luminance, 0.0F);  // a point sampled by NEE may miss the bright texels
  EXPECT_LT(emissive[2].luminance, 0.05F);
  EXPECT_EQ(emissive[2].luminance, emissive[3].luminance);
}

TEST(Emitters, EachPoseHasItsOwnTable) {
  const auto scene = patch_over_floor(emitter(vec3(2.0F)));
  const auto first = test::source_of(scene);
  surface::Pose pose = scene->rest;
  for (std::size_t i = 4; i < 8; ++i)
    pose.vertices[i].position.x = 32.0F + 3.0F * (pose.vertices[i].position.x - 32.0F);
  const auto second = scene::make_model_source(*first, pose, nullptr);
  EXPECT_NEAR(first->meshes.at(0).flux, pi * 400.0 * 2.0, 1e-2);
  EXPECT_NEAR(second->meshes.at(0).flux, pi * 1200.0 * 2.0, 1e-2);
  const float density = glm::uintBitsToFloat(second->words.at(second->meshes.at(0).emitters).w);
  EXPECT_NEAR(density * 1200.0, 1.0, 1e-5);
}

// ---- images ----

class EmitterRendering : public test::ViewerTest {
 protected:
  std::unique_ptr<test::Still> dark(std::shared_ptr<const StillScene> scene) const {
    auto viewer = make();
    viewer->set_volume(test::slab());
    viewer->set_light({});
    viewer->set_medium(medium(1e-6, 0.0F));
    viewer->set_camera(test::looking_down(0.05));
    viewer->viewer().show_surfaces(test::source_of(std::move(scene)));
    return viewer;
  }
};
CUMULET_ON_BACKENDS(EmitterRendering);

const auto constant = [](const dvec3& /*p*/) { return 3.0; };

TEST_P(EmitterRendering, PatchLightsAFloorThroughASlab) {
  const auto viewer = dark(patch_over_floor(emitter(vec3(3.0F))));
  for (const SurfaceLight mode : {SurfaceLight::full, SurfaceLight::shadows}) {
    viewer->viewer().set_surface_settings(surface_light(mode));
    for (const March kind : {March::tet, March::brick}) {
      viewer::GridSettings grid;
      grid.build.march = kind;
      viewer->set_grid(grid);
      for (const double sigma : {1e-6, 0.1}) {
        viewer->set_medium(medium(sigma, 0.0F));
        const Picture picture = test::render(*viewer, {16, 16, 64, 1, render::View::shaded});
        const double expected = 0.5 / pi * irradiance(sigma, patch_half, constant) * std::exp(-8.0 * sigma);
        expect_mean(picture, expected, 0.05, std::to_string(sigma));
        EXPECT_NEAR(picture.mean().w, 1.0, 1e-6);
      }
    }
  }
}

// The floor is lit only if the patch's front faces it. A mirrored node flips the front.
TEST_P(EmitterRendering, OneSidedTrianglesEmitFromTheirFront) {
  for (const SurfaceLight mode : {SurfaceLight::full, SurfaceLight::shadows}) {
    for (const bool down : {false, true}) {
      for (const bool flipped : {false, true}) {
        for (const bool double_sided : {false, true}) {
          Material patch = emitter(vec3(3.0F));
          patch.double_sided = double_sided;
          auto scene = patch_over_floor(patch, down);
          scene->rest.flipped[1] = flipped ? 1 : 0;
          const auto viewer = dark(scene);
          viewer->viewer().set_surface_settings(surface_light(mode));
          // The camera is below the patch, so that the patch does not hide the floor.
          viewer->set_camera(camera_at({32.0, 5.0, 72.0}, {32.0, floor_y, 32.0}, 0.05));
          const Picture picture = test::render(*viewer, {8, 8, 64, 1, render::View::shaded});
          if (double_sided || down != flipped) {
            expect_mean(picture, 0.5 / pi * irradiance(0.0, patch_half, constant), 0.1, "front");
          } else {
            EXPECT_EQ(picture.mean().x, 0.0);
          }
        }
      }
    }
  }
}

TEST_P(EmitterRendering, EmissiveTextureEmitsWhereBright) {
  Material patch = emitter(vec3(3.0F));
  patch.emission_texture.texture = 0;
  auto scene = patch_over_floor(patch);
  scene->images.push_back(stripes());
  scene->textures.push_back({0, {}});
  scene->textures[0].sampler.magnify = surface::Filter::nearest;
  // The transform maps uv 0.5 to 1 of the square to twice the image: a quarter emits.
  scene->materials[1].emission_texture.transform = glm::mat3x2(2.0F, 0.0F, 0.0F, 1.0F, 0.25F, 0.0F);
  const auto viewer = dark(scene);
  // Along z: u decreases with z on the lower side.
  const double expected = 0.5 / pi * irradiance(0.0, patch_half, [](const dvec3& p) {
                            const double u = 0.5 + (32.0 - p.z) / (2.0 * patch_half);
                            return 2.0 * u + 0.25 - std::floor(2.0 * u + 0.25) < 0.5 ? 3.0 * 0.5029 : 0.0;
                          });
  const Picture picture = test::render(*viewer, {16, 16, 64, 1, render::View::shaded});
  expect_mean(picture, expected, 0.05, "texture");
}

// Single scattering: the sum along the camera's ray over the patch.
TEST_P(EmitterRendering, PatchLightsAVolume) {
  auto scene = std::make_shared<StillScene>();
  scene->add(emitter(vec3(3.0F)));
  scene->add_quad(square(patch_y, patch_half, true), 0);
  const auto viewer = dark(scene);
  for (const SurfaceLight mode : {SurfaceLight::full, SurfaceLight::shadows}) {
    viewer->viewer().set_surface_settings(surface_light(mode));
    for (const double sigma : {0.02, 0.3}) {
      for (const double g : {0.0, -0.6}) {
        viewer->set_medium(medium(sigma, 0.8F, static_cast<float>(g), 1));
        double expected = 0.0;
        constexpr int steps = 64;
        for (int i = 0; i < steps; ++i) {
          const double deep = (slab_high - slab_low) * (i + 0.5) / steps;
          const dvec3 here(32.0, slab_high - deep, 32.0);
          const double in_scattered = over_patch(patch_half, [&](const dvec3& p) {
            const dvec3 way = p - here;
            const double d = glm::length(way);
            const double cosine = way.y / d;
            const double phase = (1.0 - g * g) / (4.0 * pi * std::pow(1.0 + g * g + 2.0 * g * cosine, 1.5));
            return 3.0 * phase * cosine / (d * d) * std::exp(-sigma * deep / cosine);
          });
          expected += 0.8 * sigma * std::exp(-sigma * deep) * in_scattered * (slab_high - slab_low) / steps;
        }
        const Picture picture = test::render(*viewer, {16, 16, 64, 1, render::View::shaded});
        expect_mean(picture, expected, 0.1, std::to_string(sigma) + " " + std::to_string(g));
      }
    }
  }
}

// Walls that emit E and reflect the fraction a: radiance E / (1 - a) everywhere, for any scattering medium. With direct
// light only: E + a E.
TEST_P(EmitterRendering, EmissiveBoxIsInThermalBalance) {
  auto scene = std::make_shared<StillScene>();
  scene->add(emitter(vec3(1.0F), vec3(0.5F)));
  const std::array<vec3, 8> c{
      {{-8, -8, -8}, {72, -8, -8}, {-8, 16, -8}, {72, 16, -8}, {-8, -8, 72}, {72, -8, 72}, {-8, 16, 72}, {72, 16, 72}}};
  for (const std::array<std::size_t, 4>& q :
       {std::array<std::size_t, 4>{0, 4, 5, 1}, {2, 3, 7, 6}, {0, 1, 3, 2}, {4, 6, 7, 5}, {0, 2, 6, 4}, {1, 5, 7, 3}}) {
    scene->add_quad({c[q[0]], c[q[1]], c[q[2]], c[q[3]]}, 0);
  }
  const auto viewer = dark(scene);
  viewer->set_camera(camera_at({10.0, 12.0, 20.0}, {50.0, 2.0, 40.0}, 60.0));
  for (const double sigma : {1e-6, 0.1}) {
    viewer->set_medium(medium(sigma, 1.0F, 0.3F));
    viewer->viewer().set_surface_settings(surface_light(SurfaceLight::full));
    expect_mean(test::render(*viewer, {16, 16, 64, 1, render::View::shaded}), 2.0, 0.03, "full");
  }
  viewer->set_medium(medium(1e-6, 1.0F));
  viewer->viewer().set_surface_settings(surface_light(SurfaceLight::shadows));
  expect_mean(test::render(*viewer, {16, 16, 64, 1, render::View::shaded}), 1.5, 0.03, "shadows");
}

// Reference without NEE: an unlit surface looks like an emissive one and is not in the light table.
struct Kind {
  const char* name;
  surface::AlphaMode alpha;
  bool textured;
  bool other_lights;
  SurfaceLight light;
};

std::shared_ptr<StillScene> gallery(const Kind& kind, bool without_nee) {
  auto scene = std::make_shared<StillScene>();
  Material shine = without_nee ? unlit(vec3(4.0F, 2.0F, 1.0F)) : emitter(vec3(4.0F, 2.0F, 1.0F));
  shine.base_color.a = kind.alpha == surface::AlphaMode::opaque ? 1.0F : 0.6F;
  shine.alpha_mode = kind.alpha;
  shine.double_sided = true;
  if (kind.textured) {
    scene->images.push_back(stripes());
    scene->images.push_back(stripes());
    scene->images[1].rgba = {255, 255, 255, 255, 255, 255, 255, 0};
    scene->textures.resize(2);
    scene->textures[1].image = 1;
    shine.base_color_texture.texture = without_nee ? 0 : 1;
    shine.emission_texture.texture = without_nee ? -1 : 0;
    // The image is transparent where it is dark.
  }
  Material metal;
  metal.base_color = glm::vec4(0.9F, 0.7F, 0.5F, 1.0F);
  metal.roughness = 0.3F;
  Material veil = test::diffuse(vec3(0.8F));
  veil.base_color.a = 0.3F;
  veil.alpha_mode = surface::AlphaMode::blend;
  veil.double_sided = true;
  scene->add(test::diffuse(vec3(0.6F)));
  scene->add(shine);
  scene->add(metal);
  scene->add(veil);
  scene->add_quad(square(floor_y, 60.0F, false), 0);
  scene->add_quad(square(patch_y, 14.0F, true), 1);
  scene->add_quad({{{10, -10, 20}, {10, 14, 20}, {24, 14, 10}, {24, -10, 10}}}, 1);
  scene->add_sphere({40.0F, -2.0F, 34.0F}, 6.0F, 2, 12);
  scene->add_quad({{{20, -9, 40}, {46, -9, 40}, {46, 12, 44}, {20, 12, 44}}}, 3);
  if (kind.other_lights) {
    surface::PunctualLight analytic_light;
    analytic_light.intensity = vec3(200.0F);
    analytic_light.position = {50.0F, 5.0F, 20.0F};
    scene->rest.lights = {analytic_light};
  }
  return scene;
}

TEST_P(EmitterRendering, MatchesScatteredRaysOnly) {
  using surface::AlphaMode;
  for (const Kind& kind : {Kind{"opaque", AlphaMode::opaque, false, false, SurfaceLight::full},
                           Kind{"blend, with sun, sky and lamp", AlphaMode::blend, false, true, SurfaceLight::full},
                           Kind{"masked texture", AlphaMode::mask, true, false, SurfaceLight::full},
                           Kind{"blended texture", AlphaMode::blend, true, false, SurfaceLight::shadows},
                           Kind{"shadows", AlphaMode::opaque, false, true, SurfaceLight::shadows}}) {
    std::array<Picture, 2> pictures;
    std::array<double, 2> noise{};
    for (const bool without_nee : {false, true}) {
      const auto viewer = dark(gallery(kind, without_nee));
      viewer->viewer().set_surface_settings(surface_light(kind.light));
      viewer->set_camera(camera_at({32.0, 10.0, 110.0}, {32.0, 0.0, 32.0}, 30.0));
      viewer->set_medium(medium(0.04, 0.9F, 0.5F));
      if (kind.other_lights) {
        viewer::Light light;
        light.sun_elevation_degrees = 50.0F;
        light.sun_irradiance = vec3(1.0F);
        light.sky_radiance = vec3(0.2F);
        viewer->set_light(light);
      }
      pictures[without_nee ? 1 : 0] =
          test::render(*viewer, {24, 16, without_nee ? 512U : 256U, 3, render::View::shaded});
      noise[without_nee ? 1 : 0] = viewer->viewer().measure_noise().value();
    }
    const double mean = pictures[1].mean().x;
    Picture difference = pictures[0];
    for (std::size_t i = 0; i < difference.pixels.size(); ++i) difference.pixels[i] -= pictures[1].pixels[i];
    const Estimate e = estimate(difference);
    EXPECT_NEAR(e.mean.x, 0.0, e.error) << kind.name << " of " << mean;
    EXPECT_LT(e.error, 0.07 * mean) << kind.name;
    RecordProperty(kind.name, std::to_string(noise[0] * std::sqrt(0.5) / noise[1]));
  }
}

// 100,000 triangles, of which few emit most of the light.
TEST_P(EmitterRendering, ManyEmittersMatchOne) {
  auto scene = std::make_shared<StillScene>();
  scene->add(test::diffuse(vec3(0.5F)));
  scene->add(emitter(vec3(0.1F)));
  scene->add(emitter(vec3(20.0F)));
  scene->add_quad(square(floor_y, 200.0F, false), 0);
  constexpr int n = 224;
  const auto bright = [](int i, int j) { return (i / 16 + j / 16) % 8 == 0; };
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      const float step = 2.0F * patch_half / n;
      const vec3 at(32 - patch_half + step * static_cast<float>(i), patch_y,
                    32 - patch_half + step * static_cast<float>(j));
      scene->add_quad({{at, at + vec3(step, 0, 0), at + vec3(step, 0, step), at + vec3(0, 0, step)}},
                      bright(i, j) ? 2U : 1U);
    }
  }
  const double expected = 0.5 / pi * irradiance(0.0, patch_half, [&](const dvec3& p) {
                            const dvec2 at = (dvec2(p.x, p.z) - 32.0 + double{patch_half}) * (n / (2.0 * patch_half));
                            return bright(static_cast<int>(at.x), static_cast<int>(at.y)) ? 20.0 : 0.1;
                          });
  const auto viewer = dark(scene);
  const Picture picture = test::render(*viewer, {16, 16, 64, 1, render::View::shaded});
  expect_mean(picture, expected, 0.05, "many");
}

// A small emissive square in a room: noise with and without NEE.
TEST_P(EmitterRendering, NextEventEstimationReducesNoise) {
  for (const double sigma : {1e-6, 0.02}) {
    std::array<double, 2> noise{};
    for (const bool without_nee : {false, true}) {
      auto scene = std::make_shared<StillScene>();
      scene->add(test::diffuse(vec3(0.5F)));
      Material analytic_light = without_nee ? unlit(vec3(40.0F)) : emitter(vec3(40.0F));
      analytic_light.double_sided = true;
      scene->add(analytic_light);
      scene->add_quad(square(floor_y, 30.0F, false), 0);
      scene->add_quad(square(50.0F, 30.0F, true), 0);
      scene->add_quad(square(49.0F, 5.0F, true), 1);
      scene->add_quad({{{2, floor_y, 2}, {62, floor_y, 2}, {62, 50, 2}, {2, 50, 2}}}, 0);
      scene->add_quad({{{2, floor_y, 62}, {2, floor_y, 2}, {2, 50, 2}, {2, 50, 62}}}, 0);
      scene->add_quad({{{62, floor_y, 2}, {62, floor_y, 62}, {62, 50, 62}, {62, 50, 2}}}, 0);
      const auto viewer = dark(scene);
      viewer->set_medium(medium(sigma, 0.9F));
      // The emitter is outside of the image, because its edges are equally noisy in both cases.
      viewer->set_camera(camera_at({32.0, 20.0, 140.0}, {32.0, 8.0, 32.0}, 18.0));
      test::render(*viewer, {32, 32, 64, 3, render::View::shaded});
      noise[without_nee ? 1 : 0] = viewer->viewer().measure_noise().value();
    }
    RecordProperty(sigma < 1e-3 ? "vacuum" : "fog", std::to_string(noise[1] / noise[0]));
    EXPECT_LT(noise[0], noise[1] / 3.0) << sigma;  // a ninth of the samples
  }
}

}  // namespace
