// Images of glass and other extended materials, compared with closed forms.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "support/gl_viewer.hpp"
#include "support/osmesa_leaks.hpp"
#include "support/surfaces.hpp"
#include "support/volumes.hpp"

namespace {

using namespace cumulet;
using glm::dvec3;
using glm::vec3;
using surface::Material;
using test::StillScene;

constexpr double pi = std::numbers::pi;

class Glass : public test::ViewerTest {};
CUMULET_ON_BACKENDS(Glass);

Material glass(float ior = 1.5F, float roughness = 0.0F) {
  Material m;
  m.metallic = 0.0F;
  m.roughness = roughness;
  m.transmission = 1.0F;
  m.thickness = 1.0F;
  m.ior = ior;
  return m;
}

Material thin_wall(const vec3& color) {
  Material m = glass();
  m.thickness = 0.0F;
  m.base_color = glm::vec4(color, 1.0F);
  return m;
}

/// A closed box whose faces point outwards.
void add_box(StillScene& scene, const vec3& a, const vec3& b, std::uint32_t material) {
  const auto at = [&](int corner) {
    return vec3((corner & 1) != 0 ? b.x : a.x, (corner & 2) != 0 ? b.y : a.y, (corner & 4) != 0 ? b.z : a.z);
  };
  for (const auto& face : {std::array{0, 4, 6, 2}, std::array{1, 3, 7, 5}, std::array{0, 1, 5, 4},
                           std::array{2, 6, 7, 3}, std::array{0, 2, 3, 1}, std::array{4, 5, 7, 6}}) {
    scene.add_quad({at(face[0]), at(face[1]), at(face[2]), at(face[3])}, material);
  }
}

viewer::Light sky(float radiance) {
  viewer::Light light;
  light.sun_irradiance = vec3(0.0F);
  light.sky_radiance = vec3(radiance);
  return light;
}

double schlick(double f0, double cosine) { return f0 + (1.0 - f0) * std::pow(1.0 - cosine, 5.0); }

// A slab seen from above under a uniform sky: the outer reflection, and the light transmitted after any number of
// internal reflections. Each pass adds one path length of absorption.
TEST_P(Glass, SlabAbsorptionFollowsBeerLambertOnEveryPath) {
  const auto viewer = make();
  viewer->set_camera(test::looking_down());
  viewer->set_light(sky(1.0F));
  for (const float ior : {1.5F, 2.0F}) {
    auto scene = std::make_shared<StillScene>();
    Material m = glass(ior);
    m.absorption = vec3(0.0F, 0.02F, 0.1F);
    add_box(*scene, {-200.0F, 0.0F, -200.0F}, {264.0F, 10.0F, 264.0F}, scene->add(m));
    viewer->viewer().show_surfaces(test::source_of(scene));
    const test::Picture picture = test::render(*viewer, {16, 16, 64, 1, render::View::shaded});
    const double f = std::pow((ior - 1.0) / (ior + 1.0), 2.0);
    for (int c = 0; c < 3; ++c) {
      const double a = std::exp(-10.0 * double{m.absorption[c]});
      EXPECT_NEAR(picture.mean()[c], f + (1.0 - f) * (1.0 - f) * a / (1.0 - f * a), 6e-3) << ior << ' ' << c;
    }
  }
}

// A camera inside the glass sees the same absorption on the way out.
TEST_P(Glass, CameraMayBeInside) {
  const auto viewer = make();
  viewer->set_light(sky(1.0F));
  auto scene = std::make_shared<StillScene>();
  Material m = glass(1.5F);
  m.absorption = vec3(0.0F, 0.05F, 0.2F);
  add_box(*scene, {-200.0F, 0.0F, -200.0F}, {200.0F, 10.0F, 200.0F}, scene->add(m));
  viewer->viewer().show_surfaces(test::source_of(scene));
  viewer->set_camera(test::camera_at({0.0, 6.0, 0.0}, {0.0, 100.0, 0.001}, 1.0));
  const test::Picture picture = test::render(*viewer, {8, 8, 64, 1, render::View::shaded});
  for (int c = 0; c < 3; ++c) {
    const double s = m.absorption[c];
    // Up 4 and out, or down 10 and up 10 for each internal reflection.
    const double expected = 0.96 * std::exp(-4.0 * s) / (1.0 - 0.04 * std::exp(-10.0 * s));
    EXPECT_NEAR(picture.mean()[c], expected, 8e-3) << c;
  }
}

// White furnace test without absorption: glass balls, dispersive glass, nested balls, thin walls and smoke around them
// are as bright as the sky.
TEST_P(Glass, WhiteFurnaceIsOne) {
  const auto viewer = make();
  viewer->set_volume(test::noise_volume({24, 20, 22}, glm::ivec3(0), 3));
  viewer->set_light(sky(1.0F));
  auto scene = std::make_shared<StillScene>();
  const std::uint32_t clear = scene->add(glass(1.5F));
  const std::uint32_t water = scene->add(glass(1.33F));
  Material gem = glass(2.0F);
  gem.dispersion = 2.0F;
  scene->add_sphere({6.0F, 10.0F, 11.0F}, 4.0F, clear);
  scene->add_sphere({6.0F, 10.0F, 11.0F}, 2.5F, water);
  scene->add_sphere({15.0F, 9.0F, 11.0F}, 4.0F, scene->add(gem));
  scene->add_sphere({11.0F, 3.0F, 15.0F}, 2.5F, scene->add(thin_wall(vec3(1.0F))));
  viewer->viewer().show_surfaces(test::source_of(scene));
  viewer->set_camera(test::camera_at({12.0, 30.0, 60.0}, {12.0, 8.0, 11.0}, 20.0));
  for (const double density : {1e-6, 0.3}) {
    viewer::Medium medium;
    medium.density_scale = density;
    medium.albedo = vec3(1.0F);
    viewer->set_medium(medium);
    const test::Picture picture = test::render(*viewer, {24, 24, 128, 7, render::View::shaded});
    for (int c = 0; c < 3; ++c) {
      double square = 0.0;
      for (const glm::vec4& p : picture.pixels) square += (p[c] - 1.0) * (p[c] - 1.0);
      const double error = std::sqrt(square / 576.0 / 576.0);
      EXPECT_NEAR(picture.mean()[c], 1.0, 4.0 * error + 4e-3) << density << ' ' << c;
      EXPECT_LT(error, 0.01);
    }
  }
}

// A clear thin wall reflects and transmits by Fresnel and its color. Light passes straight through it to surfaces
// below.
TEST_P(Glass, ThinWallTintsTheBackgroundAndSunlight) {
  const auto viewer = make();
  const vec3 color(1.0F, 0.5F, 0.25F);
  const auto wall = [&](StillScene& scene, float y) {
    const std::uint32_t material = scene.add(thin_wall(color));
    scene.materials.back().double_sided = true;
    scene.add_quad({{{-168, y, 232}, {232, y, 232}, {232, y, -168}, {-168, y, -168}}}, material);
  };
  viewer->set_camera(test::looking_down());
  auto alone = std::make_shared<StillScene>();
  wall(*alone, 0.0F);
  viewer->viewer().show_surfaces(test::source_of(alone));
  viewer->set_light(sky(1.0F));
  const test::Picture seen = test::render(*viewer, {16, 16, 64, 1, render::View::shaded});
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(seen.mean()[c], 0.04 + 0.96 * double{color[c]}, 8e-3) << c;

  auto floored = std::make_shared<StillScene>();
  wall(*floored, 0.0F);
  const std::uint32_t matte = floored->add(test::diffuse(vec3(0.5F)));
  floored->add_quad({{{-168, -20, 232}, {232, -20, 232}, {232, -20, -168}, {-168, -20, -168}}}, matte);
  viewer->viewer().show_surfaces(test::source_of(floored));
  viewer::Light sun;
  sun.sun_elevation_degrees = 60.0F;
  sun.sun_irradiance = vec3(3.0F);
  sun.sky_radiance = vec3(0.0F);
  viewer->set_light(sun);
  const test::Picture lit = test::render(*viewer, {16, 16, 256, 1, render::View::shaded});
  const double cosine = std::sin(60.0 * pi / 180.0);
  for (int c = 0; c < 3; ++c) {
    const double tint = double{color[c]};
    const double in = tint * (1.0 - schlick(0.04, cosine));
    // Light that the wall reflects back to the floor arrives again: the hemispherical albedo of the wall.
    const double first = 0.5 * 3.0 * cosine / pi * in * 0.96 * tint;
    EXPECT_GT(lit.mean()[c], first * 0.98) << c;
    EXPECT_LT(lit.mean()[c], first * (1.0 + 0.5 * 0.13)) << c;
  }
}

// A prism refracts each wavelength by Snell's law. A bright wall begins where 549 nm arrives. All of red (refracted
// less) hits it, none of blue, and half of green.
TEST_P(Glass, PrismDispersionFollowsCauchy) {
  const auto viewer = make();
  constexpr double bend = 30.0 * pi / 180.0;
  constexpr float way = 100.0F;
  auto scene = std::make_shared<StillScene>();
  Material m = glass(1.5F);
  m.dispersion = 5.0F;
  const std::uint32_t prism = scene->add(m);
  // The camera looks along -z through the face z = 0. The other face is rotated about y and is at z = -20 for x = 0.
  const float s = static_cast<float>(std::tan(bend));
  const auto back = [&](float x, float y) { return vec3(x, y, -20.0F + s * x); };
  scene->add_quad({{{-10, -10, 0}, {10, -10, 0}, {10, 10, 0}, {-10, 10, 0}}}, prism);
  scene->add_quad({{back(10, -10), back(-10, -10), back(-10, 10), back(10, 10)}}, prism);
  scene->add_quad({{vec3(-10, -10, 0), vec3(-10, 10, 0), back(-10, 10), back(-10, -10)}}, prism);
  scene->add_quad({{vec3(10, -10, 0), back(10, -10), back(10, 10), vec3(10, 10, 0)}}, prism);
  scene->add_quad({{vec3(-10, 10, 0), vec3(10, 10, 0), back(10, 10), back(-10, 10)}}, prism);
  scene->add_quad({{vec3(-10, -10, 0), back(-10, -10), back(10, -10), vec3(10, -10, 0)}}, prism);
  // The outward normal of that face is (sin, 0, -cos). A ray along -z leaves at the angle asin(n sin) to it, deflected
  // towards -x.
  const double n = 1.5 + 0.5 * 5.0 / 20.0 * (523655.0 / (549.0 * 549.0) - 1.5168);
  const double turned = std::asin(n * std::sin(bend)) - bend;
  const auto edge = static_cast<float>(-way * std::tan(turned));
  Material bright = test::diffuse(vec3(0.0F));
  bright.emission = vec3(1.0F);
  const float z = -20.0F - way;
  scene->add_quad({{{edge, -80, z}, {edge + 200.0F, -80, z}, {edge + 200.0F, 80, z}, {edge, 80, z}}},
                  scene->add(bright));
  viewer->viewer().show_surfaces(test::source_of(scene));
  viewer->set_light(sky(0.0F));
  viewer->set_camera(test::camera_at({0.0, 0.0, 100.0}, {0.0, 0.0, 0.0}, 0.02));
  const test::Picture picture = test::render(*viewer, {8, 8, 256, 1, render::View::shaded});
  const auto through = [&](double wavelength) {
    const double index = 1.5 + 0.125 * (523655.0 / (wavelength * wavelength) - 1.5168);
    const double f0 = std::pow((index - 1.0) / (index + 1.0), 2.0);
    return (1.0 - 0.04) * (1.0 - schlick(f0, std::sqrt(1.0 - std::pow(index * std::sin(bend), 2.0))));
  };
  EXPECT_NEAR(picture.mean().x, through(611.0), 0.03);
  EXPECT_NEAR(picture.mean().y, 0.5 * through(549.0), 0.03);
  EXPECT_LT(picture.mean().z, 0.02);
}

// Textures give the same result as equal factors.
TEST_P(Glass, TexturesMatchEqualFactors) {
  const auto viewer = make();
  viewer::Light light = sky(0.5F);
  light.sun_elevation_degrees = 50.0F;
  light.sun_irradiance = vec3(3.0F);
  viewer->set_light(light);
  viewer->set_camera(test::camera_at({3.0, 6.0, 9.0}, {0.0, 0.0, 0.0}, 12.0));
  // Two uv sets and a transform that all select the second texel.
  const auto shown = [&](bool textured) {
    auto scene = std::make_shared<StillScene>();
    Material m;
    m.metallic = 0.3F;
    m.roughness = 0.3F;
    m.base_color = glm::vec4(0.8F, 0.6F, 0.4F, 1.0F);
    m.sheen_color = vec3(1.0F);
    m.sheen_roughness = 1.0F;
    m.anisotropy = 1.0F;
    m.iridescence = 1.0F;
    m.film_ior = 1.7F;
    m.film_thinnest = 100.0F;
    m.film_thickest = 500.0F;
    m.transmission = 1.0F;
    constexpr std::uint8_t quarter = 64;
    constexpr float a_quarter = quarter / 255.0F;
    const float a_color = std::pow((a_quarter + 0.055F) / 1.055F, 2.4F);
    if (textured) {
      // Left: a texel that would be noticed. Right: 0.25 everywhere, or the direction (-1, 1), rotated by 135 degrees.
      const auto even = scene->add_texture(2, 1, {255, 255, 255, 255, quarter, quarter, quarter, quarter});
      const auto turned = scene->add_texture(2, 1, {255, 128, 255, 255, 0, 255, quarter, 255});
      const auto use = [](std::int32_t texture, bool second) {
        surface::TextureUse u;
        u.texture = texture;
        u.uv_set = second ? 1 : 0;
        if (!second) u.transform = glm::mat3x2(0.0F, 0.0F, 0.0F, 0.0F, 0.75F, 0.5F);
        return u;
      };
      m.sheen_color_texture = use(even, false);
      m.sheen_roughness_texture = use(even, true);
      m.anisotropy_texture = use(turned, false);
      m.iridescence_texture = use(even, true);
      m.film_thickness_texture = use(even, false);
      m.transmission_texture = use(even, true);
    } else {
      m.sheen_color = vec3(a_color);
      m.sheen_roughness = a_quarter;
      m.anisotropy = a_quarter;
      m.anisotropy_rotation = static_cast<float>(0.75 * pi);
      m.iridescence = a_quarter;
      m.film_thickest = 100.0F + 400.0F * a_quarter;
      m.transmission = a_quarter;
    }
    const std::uint32_t number = scene->add(m);
    scene->add_quad({{{-1, 0, 1}, {1, 0, 1}, {1, 0, -1}, {-1, 0, -1}}}, number);
    for (surface::PosedVertex& v : scene->rest.vertices) v.tangent = glm::vec4(1.0F, 0.0F, 0.0F, 1.0F);
    for (surface::VertexAttributes& a : scene->attributes) a.uv[1] = glm::vec2(0.75F, 0.5F);
    viewer->viewer().show_surfaces(test::source_of(scene));
    return test::render(*viewer, {12, 12, 16, 5, render::View::shaded});
  };
  const test::Picture by_factors = shown(false);
  const test::Picture by_textures = shown(true);
  double lit = 0.0;
  for (std::size_t i = 0; i < by_factors.pixels.size(); ++i) {
    for (int c = 0; c < 3; ++c) {
      EXPECT_NEAR(by_textures.pixels[i][c], by_factors.pixels[i][c], 0.01F + 0.02F * by_factors.pixels[i][c]) << i;
    }
    lit = std::max(lit, double{by_factors.pixels[i].x});
  }
  EXPECT_GT(lit, 0.5);
}

// Brushed metal shows the sun as a streak along its tangent.
TEST_P(Glass, BrushedMetalHighlightsFollowTheTangent) {
  const auto viewer = make();
  viewer::Light light = sky(0.0F);
  light.sun_elevation_degrees = 90.0F;
  light.sun_irradiance = vec3(1.0F);
  viewer->set_light(light);
  viewer->set_camera(test::looking_down(2.0));
  const auto seen = [&](float turn) {
    auto scene = std::make_shared<StillScene>();
    Material m;
    m.metallic = 1.0F;
    m.roughness = 0.2F;
    m.anisotropy = 0.8F;
    m.anisotropy_rotation = turn;
    scene->add_sphere({32.0F, 0.0F, 32.0F}, 5.0F, scene->add(m), 48);
    for (surface::PosedVertex& v : scene->rest.vertices) {
      // Along x at the top.
      v.tangent = glm::vec4(glm::normalize(glm::cross(vec3(0, 0, -1), v.normal) + vec3(1e-6F, 0, 0)), 1.0F);
    }
    viewer->viewer().show_surfaces(test::source_of(scene));
    const test::Picture picture = test::render(*viewer, {32, 32, 16, 1, render::View::shaded});
    dvec3 moments(0.0);
    for (int y = 0; y < 32; ++y) {
      for (int x = 0; x < 32; ++x) {
        const double value = picture.pixels[static_cast<std::size_t>(32 * y + x)].x;
        moments += value * dvec3((x - 15.5) * (x - 15.5), (y - 15.5) * (y - 15.5), 1.0);
      }
    }
    return std::pair(moments.x / moments.z, moments.y / moments.z);
  };
  const auto [along, across] = seen(0.0F);
  EXPECT_GT(along, 2.0 * across);
  const auto [turned_along, turned_across] = seen(static_cast<float>(pi / 2.0));
  EXPECT_GT(turned_across, 2.0 * turned_along);
}

}  // namespace
