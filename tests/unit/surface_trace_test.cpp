// Surfaces and volume in one image, compared with analytic results.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "support/appendix_b.hpp"
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
using surface::Material;
using test::StillScene;

constexpr double pi = std::numbers::pi;

class SurfaceTrace : public test::ViewerTest {};
CUMULET_ON_BACKENDS(SurfaceTrace);

viewer::GridSettings march(March kind) {
  viewer::GridSettings s;
  s.build.march = kind;
  s.build.refine.threshold = -1.0;
  return s;
}

viewer::Light sun_at(float elevation_degrees, const vec3& irradiance, const vec3& sky = vec3(0.0F)) {
  viewer::Light light;
  light.sun_elevation_degrees = elevation_degrees;
  light.sun_irradiance = irradiance;
  light.sky_radiance = sky;
  return light;
}

/// A horizontal square at this height that faces up.
std::array<vec3, 4> floor_at(float y, float half = 200.0F) {
  return {{{32 - half, y, 32 + half}, {32 + half, y, 32 + half}, {32 + half, y, 32 - half}, {32 - half, y, 32 - half}}};
}

std::shared_ptr<StillScene> floor_scene(const Material& material, float y = -10.0F) {
  auto scene = std::make_shared<StillScene>();
  scene->add(material);
  scene->add_quad(floor_at(y), 0);
  return scene;
}

// Radiance of a white floor under an absorbing slab: albedo / pi * E cos * exp(-tau / cos) on the way in, exp(-tau)
// out.
TEST_P(SurfaceTrace, FloorUnderASlabIsLitAndVisibleThroughIt) {
  const auto viewer = make();
  viewer->set_volume(test::slab());
  viewer->set_camera(test::looking_down());
  for (const vec3 albedo : {vec3(1.0F), vec3(0.8F, 0.4F, 0.1F)}) {
    viewer->viewer().show_surfaces(test::source_of(floor_scene(test::diffuse(albedo))));
    for (const March kind : {March::tet, March::brick, March::dense}) {
      viewer->set_grid(march(kind));
      for (const double sigma : {1e-6, 0.05, 0.2}) {
        viewer::Medium medium;
        medium.density_scale = sigma;
        medium.albedo = vec3(0.0F);
        viewer->set_medium(medium);
        for (const float elevation : {90.0F, 70.0F}) {
          viewer->set_light(sun_at(elevation, vec3(3.0F)));
          const test::Picture picture = test::render(*viewer, {16, 16, 64, 1, render::View::shaded});
          const double cosine = std::sin(elevation * pi / 180.0);
          const double tau = 8.0 * sigma;
          const double expected = 3.0 * cosine / pi * std::exp(-tau / cosine - tau);
          const double error = 4.0 * expected * std::sqrt((std::exp(tau) + 1.0) / (256.0 * 64.0)) + 1e-5;
          EXPECT_NEAR(picture.mean().x, albedo.x * expected, error) << sigma << " " << elevation;
          EXPECT_NEAR(picture.mean().z, albedo.z * expected, error) << sigma << " " << elevation;
          EXPECT_NEAR(picture.mean().w, 1.0, 1e-6);
        }
      }
    }
  }
}

TEST_P(SurfaceTrace, SkyLitFloorEqualsItsAlbedo) {
  const auto viewer = make();
  viewer->set_volume(test::slab());
  viewer->set_camera(test::looking_down());
  viewer->viewer().show_surfaces(test::source_of(floor_scene(test::diffuse(vec3(0.5F)))));
  viewer::Medium medium;
  medium.density_scale = 1e-6;
  viewer->set_medium(medium);
  for (const float sun : {0.0F, 1.0F}) {
    viewer->set_light(sun_at(90.0F, vec3(sun), vec3(2.0F)));
    const test::Picture picture = test::render(*viewer, {16, 16, 256, 1, render::View::shaded});
    EXPECT_NEAR(picture.mean().x, 0.5 * (2.0 + sun / pi), 0.01);
  }
}

// White furnace test: without absorption, surfaces and medium are as bright as the sky.
TEST_P(SurfaceTrace, WhiteFurnaceWithSurfacesIsOne) {
  const auto viewer = make();
  viewer->set_volume(test::noise_volume({24, 20, 22}, ivec3(0), 3));
  viewer->set_light(sun_at(0.0F, vec3(0.0F), vec3(1.0F)));
  Material mirror;
  mirror.metallic = 1.0F;
  mirror.roughness = 0.0F;
  auto scene = std::make_shared<StillScene>();
  scene->add(test::diffuse(vec3(1.0F)));
  scene->add(mirror);
  scene->add_sphere({8.0F, 10.0F, 11.0F}, 4.0F, 0);
  scene->add_sphere({17.0F, 9.0F, 11.0F}, 4.0F, 1);
  scene->add_quad({{{0, -3, 24}, {24, -3, 24}, {24, -3, 0}, {0, -3, 0}}}, 0);
  viewer->viewer().show_surfaces(test::source_of(scene));
  viewer->set_camera(test::camera_at({12.0, 30.0, 60.0}, {12.0, 8.0, 11.0}, 32.0));
  for (const double density : {1e-6, 0.5}) {
    viewer::Medium medium;
    medium.density_scale = density;
    medium.phase.anisotropy = 0.4F;
    viewer->set_medium(medium);
    for (const March kind : {March::tet, March::brick}) {
      viewer->set_grid(march(kind));
      const test::Picture picture = test::render(*viewer, {24, 24, 128, 7, render::View::shaded});
      double square = 0.0;
      for (const glm::vec4& p : picture.pixels) square += (p.x - 1.0) * (p.x - 1.0);
      const double error = std::sqrt(square / 576.0 / 576.0);
      EXPECT_NEAR(picture.mean().x, 1.0, 4.0 * error + 2e-3);
      EXPECT_LT(error, 0.005);
      EXPECT_GT(picture.mean().w, 0.2);
    }
  }
}

// A sphere of few triangles is lit like the smooth sphere given by its normals, up to the terminator. Facet edges block
// no light, and no light is lost in a white furnace.
TEST_P(SurfaceTrace, ACoarseSphereHasASmoothTerminator) {
  const auto viewer = make();
  auto scene = std::make_shared<StillScene>();
  scene->add_sphere({0.0F, 0.0F, 0.0F}, 10.0F, scene->add(test::diffuse(vec3(1.0F))), 6);
  viewer->viewer().show_surfaces(test::source_of(scene));
  viewer::CameraPose camera = test::camera_at({0.0, 0.0, 100.0}, {0.0, 0.0, 0.0}, 40.0);
  camera.orthographic_height = 18.0;
  viewer->set_camera(camera);
  constexpr int side = 32;
  for (const bool raster : {false, true}) {
    viewer->viewer().set_surface_settings({{}, raster ? viewer::SurfaceLight::none : viewer::SurfaceLight::full});
    viewer->set_light(sun_at(90.0F, vec3(static_cast<float>(pi))));
    const test::Picture lit = test::render(*viewer, {side, side, 16, 1, render::View::shaded});
    int counted = 0;
    for (int y = 0; y < side; ++y) {
      for (int x = 0; x < side; ++x) {
        const double px = (x + 0.5 - 0.5 * side) * 18.0 / side / 10.0;
        const double py = (0.5 * side - y - 0.5) * 18.0 / side / 10.0;
        if (px * px + py * py > 0.5 || std::abs(py) > 0.6) continue;
        const double got = lit.pixels[static_cast<std::size_t>(y * side + x)].x;
        EXPECT_NEAR(got, std::max(0.0, py), 0.08) << raster << ' ' << x << ',' << y;
        ++counted;
      }
    }
    EXPECT_GT(counted, 400);
  }
  viewer->viewer().set_surface_settings({});
  viewer->set_light(sun_at(0.0F, vec3(0.0F), vec3(1.0F)));
  const test::Picture furnace = test::render(*viewer, {side, side, 64, 1, render::View::shaded});
  EXPECT_NEAR(furnace.mean().x, 1.0, 2e-3);
}

// One tile per texel: base color, metallic, roughness and clearcoat from textures, lit only by the sun.
TEST_P(SurfaceTrace, TexturedMaterialMatchesGltfAppendixB) {
  constexpr std::uint32_t tiles = 4;
  constexpr int side = 64;
  const auto viewer = make();
  auto scene = std::make_shared<StillScene>();
  std::mt19937 random(11);
  std::uniform_int_distribution<int> byte(70, 255);
  std::array<std::vector<std::uint8_t>, 3> texels;
  for (auto& t : texels) {
    for (std::uint32_t i = 0; i < 4 * tiles * tiles; ++i) t.push_back(static_cast<std::uint8_t>(byte(random)));
  }
  const surface::Sampler nearest{surface::Wrap::clamp, surface::Wrap::clamp, surface::Filter::nearest,
                                 surface::Filter::nearest, false};
  Material material;
  material.base_color_texture.texture = scene->add_texture(tiles, tiles, texels[0], nearest);
  material.metallic_roughness_texture.texture = scene->add_texture(tiles, tiles, texels[1], nearest);
  material.clearcoat = 1.0F;
  material.clearcoat_texture.texture = scene->add_texture(tiles, tiles, texels[2], nearest);
  material.clearcoat_roughness = 0.8F;
  material.clearcoat_roughness_texture = material.clearcoat_texture;
  const float half = 10.0F;
  scene->add_quad({{{-half, -half, 0}, {half, -half, 0}, {half, half, 0}, {-half, half, 0}}}, scene->add(material));
  viewer->viewer().show_surfaces(test::source_of(scene));
  viewer::Light light = sun_at(40.0F, vec3(static_cast<float>(pi)));
  light.sun_azimuth_degrees = -35.0F;
  viewer->set_light(light);
  const double elevation = 40.0 * pi / 180.0;
  const double azimuth = -35.0 * pi / 180.0;
  const dvec3 i(std::sin(azimuth) * std::cos(elevation), std::sin(elevation), std::cos(azimuth) * std::cos(elevation));
  const auto part = [](std::uint8_t value) { return value / 255.0; };
  for (const double turn : {0.3, 1.0}) {
    const dvec3 o(std::sin(turn), 0.0, std::cos(turn));
    viewer::CameraPose camera = test::camera_at(50.0 * o, {0.0, 0.0, 0.0}, 40.0);
    camera.orthographic_height = 24.0;
    viewer->set_camera(camera);
    const test::Picture picture = test::render(*viewer, {side, side, 4, 1, render::View::shaded});
    for (std::uint32_t k = 0; k < tiles * tiles; ++k) {
      const std::uint8_t* color = &texels[0][4 * std::size_t{k}];
      const std::uint8_t* rough = &texels[1][4 * std::size_t{k}];
      const std::uint8_t* coat = &texels[2][4 * std::size_t{k}];
      test::AppendixB reference;
      for (int c = 0; c < 3; ++c) reference.base[c] = std::pow((part(color[c]) + 0.055) / 1.055, 2.4);
      reference.dielectric.roughness = part(rough[1]);
      reference.metallic = part(rough[2]);
      reference.clearcoat = part(coat[0]);
      reference.coat.roughness = double{0.8F} * part(coat[1]);
      const auto below = [&](const test::RoughInterface& interface, double weight) {
        return test::Below{1.0 - weight * interface.albedo(o.z), 1.0 - weight * interface.albedo(i.z),
                           average_below(interface, weight)};
      };
      const dvec3 expected =
          pi * reference(o, i, below(reference.dielectric, 1.0), below(reference.coat, reference.clearcoat));
      // The center of the tile; the texture's first row is at the quad's bottom.
      const double x = (2.0 * (k % tiles + 0.5) / tiles - 1.0) * double{half} * o.z;
      const double y = (2.0 * (k / tiles + 0.5) / tiles - 1.0) * double{half};
      const auto column = static_cast<int>((x / 24.0 + 0.5) * side);
      const auto row = static_cast<int>((0.5 - y / 24.0) * side);
      const glm::vec4 got = picture.pixels[static_cast<std::size_t>(row * side + column)];
      for (int c = 0; c < 3; ++c) EXPECT_NEAR(got[c], expected[c], 0.01 * expected[c]) << turn << ' ' << k << ' ' << c;
    }
  }
}

viewer::SurfaceSettings indirect_roughness(float roughness) {
  viewer::SurfaceSettings s;
  s.indirect_roughness = roughness;
  return s;
}

Material metal(float roughness) {
  Material m;
  m.metallic = 1.0F;
  m.roughness = roughness;
  return m;
}

// The sun reflected by a ball causes fireflies on a floor. Path regularization keeps the mean and reduces the noise.
TEST_P(SurfaceTrace, IndirectRoughnessKeepsEnergyAndRemovesFireflies) {
  const auto viewer = make();
  viewer->set_volume(test::slab());
  viewer::Medium medium;
  medium.density_scale = 1e-6;
  viewer->set_medium(medium);
  viewer->set_light(sun_at(60.0F, vec3(3.0F)));
  auto scene = floor_scene(test::diffuse(vec3(0.5F)));
  scene->add_sphere({32.0F, 0.0F, 32.0F}, 8.0F, scene->add(metal(0.1F)), 48);
  viewer->viewer().show_surfaces(test::source_of(scene));
  viewer->set_camera(test::camera_at({60.0, 60.0, 90.0}, {32.0, -10.0, 44.0}, 8.0));
  // The mean of two images, and the noise of a pixel.
  const auto measure = [&] {
    const test::Picture a = test::render(*viewer, {32, 32, 64, 1, render::View::shaded});
    const test::Picture b = test::render(*viewer, {32, 32, 64, 2, render::View::shaded});
    double square = 0.0;
    for (std::size_t i = 0; i < a.pixels.size(); ++i) square += std::pow(a.pixels[i].x - b.pixels[i].x, 2.0);
    return std::pair(0.5 * (a.mean().x + b.mean().x), std::sqrt(0.5 * square / double(a.pixels.size())));
  };
  const auto [mean, noise] = measure();
  viewer->viewer().set_surface_settings(indirect_roughness(0.4F));
  const auto [soft_mean, soft_noise] = measure();
  const double error = 4.0 * noise / std::sqrt(2.0 * 32.0 * 32.0);
  EXPECT_NEAR(soft_mean, mean, error);
  EXPECT_LT(error, 0.1 * mean);
  EXPECT_LT(soft_noise, 0.25 * noise);
}

// A card seen through a periscope; its edge is in the image's center.
TEST_P(SurfaceTrace, IndirectRoughnessKeepsMirrorImages) {
  const auto viewer = make();
  Material card = test::diffuse(vec3(0.0F));
  card.emission = vec3(1.0F);
  auto scene = std::make_shared<StillScene>();
  const std::uint32_t mirror = scene->add(metal(0.0F));
  for (const float y : {100.0F, 120.0F}) {
    const float up = y == 100.0F ? 4.0F : -4.0F;  // direction of its normal
    scene->add_quad({{{32 - up, y - 4, 36}, {32 + up, y - 4, 36}, {32 + up, y + 4, 28}, {32 - up, y + 4, 28}}}, mirror);
  }
  scene->add_quad({{{32, 110, 0}, {52, 110, 0}, {52, 130, 0}, {32, 130, 0}}}, scene->add(card));
  viewer->viewer().show_surfaces(test::source_of(scene));
  viewer->set_camera(test::camera_at({32.0, 100.0, 80.0}, {32.0, 100.0, 32.0}, 6.0));
  const test::Picture as_it_is = test::render(*viewer, {24, 24, 16, 1, render::View::shaded});
  EXPECT_LT(as_it_is.pixels[12 * 24 + 4].x, 0.01F);
  EXPECT_GT(as_it_is.pixels[12 * 24 + 20].x, 0.99F);
  viewer->viewer().set_surface_settings(indirect_roughness(1.0F));
  const test::Picture soft = test::render(*viewer, {24, 24, 16, 1, render::View::shaded});
  double difference = 0.0;
  for (std::size_t i = 0; i < soft.pixels.size(); ++i) {
    difference += std::abs(double(soft.pixels[i].x) - double(as_it_is.pixels[i].x)) / 576.0;
  }
  EXPECT_LT(difference, 1e-3);
}

// A floor below an opaque emissive slab without scattering: albedo / pi times S cos^2 / r^2, integrated over its
// underside.
TEST_P(SurfaceTrace, FireLightsTheFloor) {
  const auto viewer = make();
  viewer->set_volume(test::slab());
  viewer->set_light({});
  viewer->set_medium({4.0, vec3(0.0F), {0.0F}, 0, {3.0F, 1.0F, 0.0F}});
  viewer->viewer().show_surfaces(test::source_of(floor_scene(test::diffuse(vec3(0.8F)))));
  // Under the slab's edge.
  viewer->set_camera(test::camera_at({131.5, 0.0, 31.5}, {31.5, -10.0, 31.5}, 0.05));
  double irradiance = 0.0;
  constexpr int n = 256;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      const dvec3 p(64.0 * (i + 0.5) / n - 32.0, 9.5, 64.0 * (j + 0.5) / n - 32.0);
      const double square = glm::dot(p, p);
      irradiance += (64.0 / n) * (64.0 / n) * p.y * p.y / (square * square);
    }
  }
  for (const March kind : {March::tet, March::brick}) {
    viewer->set_grid(march(kind));
    viewer->viewer().set_surface_settings({});
    const test::Picture picture = test::render(*viewer, {16, 16, 256, 1, render::View::shaded});
    const double expected = 3.0 * 0.8 / pi * irradiance;
    EXPECT_NEAR(picture.mean().x / expected, 1.0, 0.01);
    EXPECT_NEAR(picture.mean().y / expected, 1.0 / 3.0, 0.01);
    EXPECT_EQ(picture.mean().z, 0.0);
    viewer->viewer().set_surface_settings({{}, viewer::SurfaceLight::shadows});
    EXPECT_EQ(test::render(*viewer, {16, 16, 16, 1, render::View::shaded}).mean().x, 0.0);
  }
}

// A black floor in the middle of an emissive slab: S (1 - e^-tau) of the part above, by triangles and by the raster
// pass.
TEST_P(SurfaceTrace, EmissionEndsAtASurface) {
  const auto viewer = make();
  viewer->set_volume(test::slab());
  viewer->set_light({});
  viewer->set_camera(test::looking_down(0.5));
  viewer->viewer().show_surfaces(test::source_of(floor_scene(test::diffuse(vec3(0.0F)), 3.7F)));
  for (const March kind : {March::tet, March::dense}) {
    viewer->set_grid(march(kind));
    for (const auto light : {viewer::SurfaceLight::full, viewer::SurfaceLight::none}) {
      viewer->viewer().set_surface_settings({{}, light});
      for (const double sigma : {0.02, 0.5}) {
        viewer->set_medium({sigma, vec3(0.0F), {0.0F}, 0, vec3(2.0F)});
        const test::Picture picture = test::render(*viewer, {16, 16, 256, 1, render::View::shaded});
        const double opacity = 1.0 - std::exp(-sigma * 3.8);
        EXPECT_NEAR(picture.mean().x, 2.0 * opacity, 8.0 * std::sqrt(opacity * (1.0 - opacity)) / 256.0)
            << sigma << " " << int(light);
        EXPECT_NEAR(picture.mean().w, 1.0, 1e-6);
      }
    }
  }
}

TEST_P(SurfaceTrace, LightsFollowTheInverseSquareLaw) {
  const auto viewer = make();
  viewer->set_volume(test::slab());
  viewer->set_camera(test::looking_down(0.1));
  viewer->set_light({});
  viewer::Medium medium;
  medium.albedo = vec3(0.0F);
  viewer->set_medium(medium);
  for (const double sigma : {1e-6, 0.1}) {
    medium.density_scale = sigma;
    viewer->set_medium(medium);
    // Above the slab, inside it, and below.
    for (const float height : {40.0F, 3.5F, -4.0F}) {
      auto scene = floor_scene(test::diffuse(vec3(1.0F)));
      surface::PunctualLight analytic_light;
      analytic_light.intensity = vec3(1000.0F);
      analytic_light.position = {32.0F, height, 32.0F};
      scene->rest.lights = {analytic_light};
      viewer->viewer().show_surfaces(test::source_of(scene));
      const test::Picture picture = test::render(*viewer, {16, 16, 64, 1, render::View::shaded});
      const double through = height > 10.0F ? 8.0 : (height > 0.0F ? 4.0 : 0.0);
      const double distance = height + 10.0;
      const double expected = 1000.0 / (distance * distance) / pi * std::exp(-sigma * (through + 8.0));
      EXPECT_NEAR(picture.mean().x / expected, 1.0, 0.01) << sigma << " " << height;
    }
  }
}

TEST_P(SurfaceTrace, CoverageIsAFractionOfTheRays) {
  const auto viewer = make();
  viewer->set_volume(test::slab());
  viewer->set_camera(test::looking_down());
  viewer->set_light({});
  viewer::Medium medium;
  medium.density_scale = 1e-6;
  viewer->set_medium(medium);
  Material below;
  below.unlit = true;
  Material veil = below;
  veil.base_color = {0.5F, 0.0F, 0.0F, 0.25F};
  for (const auto mode : {surface::AlphaMode::opaque, surface::AlphaMode::blend, surface::AlphaMode::mask}) {
    veil.alpha_mode = mode;
    auto scene = floor_scene(below);
    scene->add(veil);
    scene->add_quad(floor_at(20.0F), 1);
    scene->add_quad(floor_at(-5.0F), 1);
    viewer->viewer().show_surfaces(test::source_of(scene));
    const test::Picture picture = test::render(*viewer, {16, 16, 256, 1, render::View::shaded});
    const double seen = mode == surface::AlphaMode::opaque ? 1.0 : (mode == surface::AlphaMode::mask ? 0.0 : 0.4375);
    EXPECT_NEAR(picture.mean().x, 0.5 * seen + (1.0 - seen), 0.01);
    EXPECT_NEAR(picture.mean().y, 1.0 - seen, 0.01);
  }
}

// Budgets and tiles do not affect the image: no path is lost or run twice between kernels, rounds and dispatches.
TEST_P(SurfaceTrace, ImageDependsOnlyOnSeedAndSamples) {
  auto scene = std::make_shared<StillScene>();
  scene->add(test::diffuse(vec3(0.8F)));
  Material lit = test::diffuse(vec3(0.5F));
  lit.emission = vec3(3.0F);
  scene->add(lit);
  scene->add_sphere({8.0F, 10.0F, 11.0F}, 4.0F, 0);
  scene->add_sphere({17.0F, 9.0F, 11.0F}, 3.0F, 1);
  const auto make_one = [&] {
    auto viewer = make();
    viewer->set_volume(test::noise_volume({24, 20, 22}, ivec3(0), 3));
    viewer->set_light(sun_at(40.0F, vec3(2.0F), vec3(0.5F)));
    viewer->viewer().show_surfaces(test::source_of(scene));
    return viewer;
  };
  const test::Image image{600, 10, 3, 9, render::View::shaded};  // two tiles, the second of odd width
  const test::Picture one = test::render(*make_one(), image);
  EXPECT_GT(one.mean().x, 0.1F);
  EXPECT_EQ(one.pixels, test::render(*make_one(), image, 0.5).pixels);
}

TEST_P(SurfaceTrace, SurfacesNeedNoVolume) {
  const auto viewer = make();
  viewer->set_light(sun_at(90.0F, vec3(1.0F), vec3(1.0F)));
  viewer->set_camera(test::looking_down());
  viewer->viewer().show_surfaces(test::source_of(floor_scene(test::diffuse(vec3(0.5F)))));
  const test::Picture picture = test::render(*viewer, {16, 16, 64, 1, render::View::shaded});
  EXPECT_NEAR(picture.mean().x, 0.5 * (1.0 + 1.0 / pi), 0.01);
  // A volume that is set later is displayed too.
  viewer->set_volume(test::slab());
  viewer::Medium medium;
  medium.density_scale = 100.0;
  medium.albedo = vec3(0.0F);
  viewer->set_medium(medium);
  EXPECT_NEAR(test::render(*viewer, {16, 16, 16, 1, render::View::shaded}).mean().x, 0.0, 1e-3);
}

TEST_P(SurfaceTrace, BackFacesAreInvisibleToCamerasButBlockLight) {
  const auto viewer = make();
  viewer->set_volume(test::slab());
  viewer->set_camera(test::looking_down());
  viewer->set_light(sun_at(90.0F, vec3(1.0F)));
  viewer::Medium medium;
  medium.density_scale = 1e-6;
  viewer->set_medium(medium);
  auto scene = floor_scene(test::diffuse(vec3(1.0F)));
  std::array<vec3, 4> ceiling = floor_at(20.0F);
  std::swap(ceiling[1], ceiling[3]);
  scene->add_quad(ceiling, 0);
  viewer->viewer().show_surfaces(test::source_of(scene));
  // The ceiling's back faces the camera: the floor is visible in the ceiling's shadow.
  const test::Picture shadowed = test::render(*viewer, {16, 16, 16, 1, render::View::shaded});
  EXPECT_NEAR(shadowed.mean().x, 0.0, 1e-6);
  EXPECT_NEAR(shadowed.mean().w, 1.0, 1e-6);
  scene->materials[0].double_sided = true;
  viewer->viewer().show_surfaces(test::source_of(scene));
  const test::Picture lit = test::render(*viewer, {16, 16, 16, 1, render::View::shaded});
  EXPECT_NEAR(lit.mean().x, 1.0 / pi, 1e-3);
}

}  // namespace
