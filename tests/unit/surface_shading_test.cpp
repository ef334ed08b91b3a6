// Shading and textures of the raster pass for surfaces, compared with radiance in closed form.

#include "render/raster/surface_raster.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "gl/state_guard.hpp"
#include "image.hpp"
#include "support/bsdf.hpp"
#include "support/gl_state.hpp"
#include "support/surface_rasters.hpp"
#include "support/surfaces.hpp"

namespace {

using cumulet::render::SurfaceLighting;
using cumulet::render::SurfaceView;
using cumulet::test::expect_color;
using cumulet::test::HandScene;
using cumulet::test::RasterPicture;
using cumulet::test::straight;
using cumulet::test::SurfaceRasters;
namespace core = cumulet::core;
namespace surface = cumulet::surface;

constexpr float pi = std::numbers::pi_v<float>;

CUMULET_ON_BACKENDS(SurfaceRasters);

TEST_P(SurfaceRasters, SunOnMatte) {
  const auto scene = std::make_shared<HandScene>();
  scene->add_matte({0.8F, 0.4F, 0.2F});
  SurfaceLighting lighting;
  lighting.sun_direction = glm::normalize(glm::vec3(1.0F, 2.0F, 2.0F));
  lighting.sun_irradiance = {3.0F, 2.0F, 1.0F};
  const RasterPicture picture = draw_wall(scene, lighting);
  expect_color(picture.centre(), glm::vec4(glm::vec3(2.4F, 0.8F, 0.2F) * (2.0F / 3.0F / pi), 1.0F));
  expect_color(picture.color(1, 30), glm::vec4(glm::vec3(2.4F, 0.8F, 0.2F) * (2.0F / 3.0F / pi), 1.0F));
  lighting.sun_direction.z = -lighting.sun_direction.z;
  expect_color(draw(straight({0, 0, 0}, 0.5), lighting).centre(), glm::vec4(0, 0, 0, 1));
}

TEST_P(SurfaceRasters, WhiteFurnaceIsInvisible) {
  const auto scene = std::make_shared<HandScene>();
  scene->add_matte(glm::vec3(1.0F));
  scene->materials.emplace_back();  // white metal
  scene->materials.back().roughness = 0.0F;
  scene->materials.emplace_back();  // white, with an interface
  scene->materials.back().metallic = 0.0F;
  scene->materials.back().roughness = 0.0F;
  scene->add_quad({-3, -3, -2}, {2, 0, 0}, {0, 6, 0}, 0);
  scene->add_quad({-1, -3, -2}, {2, 0, 0}, {0, 6, 0}, 1);
  scene->add_quad({1, -3, -2}, {2, 0, 0}, {0, 6, 0}, 2);
  set(scene);
  SurfaceLighting lighting;
  lighting.sky_radiance = {0.5F, 1.0F, 4.0F};
  const RasterPicture picture = draw(straight({0, 0, 0}, 1.2), lighting);
  expect_color(picture.color(2, 16), glm::vec4(0.5F, 1.0F, 4.0F, 1.0F), 1e-3F);
  for (const unsigned x : {12U, 16U, 28U}) {
    expect_color(picture.color(x, 16), glm::vec4(0.5F, 1.0F, 4.0F, 1.0F), 0.01F);
  }
}

TEST_P(SurfaceRasters, EmissionVertexColorsAndUnlit) {
  const auto scene = std::make_shared<HandScene>();
  scene->add_matte({0.5F, 0.5F, 0.5F}).emission = {0.0F, 7.0F, 1.0F};
  scene->add_matte({0.5F, 2.0F, 0.5F}).unlit = true;
  scene->add_quad({-3, -3, -2}, {3, 0, 0}, {0, 6, 0}, 0);
  scene->add_quad({0, -3, -2}, {3, 0, 0}, {0, 6, 0}, 1);
  for (surface::VertexAttributes& vertex : scene->attributes) vertex.color = {1.0F, 0.25F, 0.5F, 0.1F};
  set(scene);
  SurfaceLighting lighting;
  lighting.sky_radiance = glm::vec3(2.0F);
  const RasterPicture picture = draw(straight({0, 0, 0}, 0.5), lighting);
  expect_color(picture.color(4, 16), glm::vec4(1.0F, 7.25F, 1.5F, 1.0F));
  expect_color(picture.color(28, 16), glm::vec4(0.5F, 0.5F, 0.25F, 1.0F));
}

TEST_P(SurfaceRasters, PunctualLights) {
  using Kind = surface::PunctualLight::Kind;
  struct Case {
    const char* name;
    surface::PunctualLight light;
    float irradiance;
  };
  surface::PunctualLight point;
  point.intensity = glm::vec3(10.0F);
  point.position = {0.0F, 0.0F, 1.0F};
  surface::PunctualLight ranged = point;
  ranged.range = 4.0F;
  surface::PunctualLight short_range = point;
  short_range.range = 2.9F;
  surface::PunctualLight spot = point;
  spot.kind = Kind::spot;
  spot.inner_cone = 0.2F;
  spot.outer_cone = 0.6F;
  surface::PunctualLight aside = spot;
  aside.direction = glm::vec3(std::sin(0.4F), 0.0F, -std::cos(0.4F));
  surface::PunctualLight away = spot;
  away.direction = glm::vec3(std::sin(0.7F), 0.0F, -std::cos(0.7F));
  surface::PunctualLight sun = point;
  sun.kind = Kind::directional;
  sun.direction = {0.0F, 0.8F, -0.6F};
  const float share = (std::cos(0.4F) - std::cos(0.6F)) / (std::cos(0.2F) - std::cos(0.6F));
  const std::array<Case, 7> cases{{{"point", point, 10.0F / 9.0F},
                                   {"in range", ranged, 10.0F / 9.0F * (1.0F - 81.0F / 256.0F)},
                                   {"out of range", short_range, 0.0F},
                                   {"spot", spot, 10.0F / 9.0F},
                                   {"spot's penumbra", aside, 10.0F / 9.0F * share * share},
                                   {"out of the spot", away, 0.0F},
                                   {"directional", sun, 6.0F}}};
  for (const Case& c : cases) {
    SCOPED_TRACE(c.name);
    const auto scene = std::make_shared<HandScene>();
    scene->add_matte({1.0F, 0.5F, 0.0F});
    scene->posed.lights = {c.light};
    scene->add_wall(-2.0F, 3.0F, 0);
    set(scene);
    const RasterPicture picture = draw(straight({0, 0, 0}, 0.01), {});
    expect_color(picture.centre(), glm::vec4(glm::vec3(1.0F, 0.5F, 0.0F) * (c.irradiance / pi), 1.0F));
  }
  // All of them together, three times.
  const auto scene = std::make_shared<HandScene>();
  scene->add_matte(glm::vec3(1.0F));
  float sum = 0.0F;
  for (int i = 0; i < 3; ++i) {
    for (const Case& c : cases) {
      scene->posed.lights.push_back(c.light);
      sum += c.irradiance;
    }
  }
  scene->add_wall(-2.0F, 3.0F, 0);
  set(scene);
  expect_color(draw(straight({0, 0, 0}, 0.01), {}).centre(), glm::vec4(glm::vec3(sum / pi), 1.0F));
}

TEST_P(SurfaceRasters, TexturesWrapAndTransform) {
  // 2 x 2 distinct colors; the wall shows uv from -1 to 2.
  const std::vector<std::uint8_t> texels{255, 0, 0, 255, 0, 255, 0, 255, 0, 0, 255, 255, 128, 128, 128, 255};
  const float grey = std::pow((128.0F / 255.0F + 0.055F) / 1.055F, 2.4F);
  const std::array<glm::vec3, 4> colors{glm::vec3(1, 0, 0), glm::vec3(0, 1, 0), glm::vec3(0, 0, 1), glm::vec3(grey)};
  using surface::Wrap;
  const auto wrapped = [](double t, Wrap wrap) {
    if (wrap == Wrap::clamp) return std::clamp(t, 0.0, 0.999);
    const double whole = std::floor(t);
    const double part = t - whole;
    return wrap == Wrap::mirrored && (static_cast<int>(whole) & 1) != 0 ? 1.0 - part : part;
  };
  for (const Wrap s : {Wrap::repeat, Wrap::mirrored, Wrap::clamp}) {
    for (const Wrap t : {Wrap::repeat, Wrap::mirrored, Wrap::clamp}) {
      for (const std::uint32_t set_of : {0U, 1U}) {
        SCOPED_TRACE(testing::Message() << int(s) << int(t) << set_of);
        surface::Sampler sampler{s, t, surface::Filter::nearest, surface::Filter::nearest, false};
        const auto scene = std::make_shared<HandScene>();
        surface::Material& material = scene->add_matte(glm::vec3(1.0F));
        material.base_color_texture.texture = scene->add_texture(2, 2, texels, sampler);
        material.base_color_texture.uv_set = set_of;
        // uv' = (-1 + 3 u + v / 8, -1 + 3 v) for both uv sets.
        const float scale = set_of == 0 ? 1.0F : 0.5F;
        material.base_color_texture.transform =
            glm::mat3x2(3.0F * scale, 0.0F, 0.125F * scale, 3.0F * scale, -1.0F, -1.0F);
        scene->add_wall(-2.0F, 1.0F, 0);
        set(scene);
        SurfaceLighting lighting;
        lighting.sky_radiance = glm::vec3(1.0F);
        const RasterPicture picture = draw(straight({0, 0, 0}, 0.5), lighting, {24U, 24U});
        for (unsigned y = 0; y < 24; ++y) {
          for (unsigned x = 0; x < 24; ++x) {
            const double u = (x + 0.5) / 24.0;
            const double v = (y + 0.5) / 24.0;
            const double at_s = 2.0 * wrapped(-1.0 + 3.0 * u + 0.125 * v, s);
            const double at_t = 2.0 * wrapped(-1.0 + 3.0 * v, t);
            if (std::abs(at_s - std::round(at_s)) < 0.01 || std::abs(at_t - std::round(at_t)) < 0.01) continue;
            const auto texel = static_cast<std::size_t>(at_t) * 2 + static_cast<std::size_t>(at_s);
            expect_color(picture.color(x, y), glm::vec4(colors[texel], 1.0F), 5e-3F);
          }
        }
        ASSERT_FALSE(HasFailure());
      }
    }
  }
}

TEST_P(SurfaceRasters, MipmapsAverageDistantTextures) {
  // A checkerboard of black and white, much finer than a pixel; the mean is in linear light.
  std::vector<std::uint8_t> texels;
  for (int i = 0; i < 64 * 64; ++i) {
    const std::uint8_t value = ((i ^ (i >> 6)) & 1) != 0 ? 255 : 0;
    texels.insert(texels.end(), {value, value, value, 255});
  }
  const auto scene = std::make_shared<HandScene>();
  scene->add_matte(glm::vec3(1.0F)).base_color_texture.texture = scene->add_texture(64, 64, texels);
  scene->add_wall(-2.0F, 1.0F, 0);
  set(scene);
  SurfaceLighting lighting;
  lighting.sky_radiance = glm::vec3(1.0F);
  const RasterPicture picture = draw(straight({0, 0, 0}, 0.5), lighting, {8U, 8U});
  for (const glm::vec4& color : picture.colors) expect_color(color, glm::vec4(0.5F, 0.5F, 0.5F, 1.0F), 0.02F);
}

TEST_P(SurfaceRasters, MapsOfEveryKindAreReadFromTheirChannels) {
  const std::vector<std::uint8_t> texel{51, 102, 204, 153};  // 0.2, 0.4, 0.8, 0.6
  const auto sample = [](float value) {
    return value <= 0.04045F ? value / 12.92F : std::pow((value + 0.055F) / 1.055F, 2.4F);
  };
  const auto scene = std::make_shared<HandScene>();
  surface::Material material;
  material.metallic = 0.5F;
  material.roughness = 0.9F;
  material.ior = 1.8F;
  material.specular = 0.9F;
  material.clearcoat = 0.8F;
  material.clearcoat_roughness = 0.7F;
  material.occlusion_strength = 0.5F;
  material.emission = glm::vec3(2.0F);
  const std::int32_t texture = scene->add_texture(1, 1, texel);
  for (surface::TextureUse* use :
       {&material.base_color_texture, &material.metallic_roughness_texture, &material.occlusion_texture,
        &material.emission_texture, &material.specular_texture, &material.specular_color_texture,
        &material.clearcoat_texture, &material.clearcoat_roughness_texture}) {
    use->texture = texture;
  }
  scene->materials.push_back(material);
  const glm::vec3 color(sample(0.2F), sample(0.4F), sample(0.8F));
  core::CmSurface s{};
  s.base_color = color;
  s.metallic = 0.5F * 0.8F;
  s.roughness = 0.9F * 0.4F;
  s.normal = {0.0F, 0.0F, 1.0F};
  s.matte_normal = s.smooth_normal = s.normal;
  s.f0 = core::cm_dielectric_f0(1.8F, 0.9F * 0.6F, color);
  s.specular = 0.9F * 0.6F;
  s.clearcoat = 0.8F * 0.2F;
  s.clearcoat_roughness = 0.7F * 0.4F;
  SurfaceLighting lighting;
  lighting.sun_direction = glm::normalize(glm::vec3(0.3F, 0.2F, 1.0F));
  lighting.sun_irradiance = glm::vec3(5.0F);
  scene->add_wall(-2.0F, 3.0F, 0);
  set(scene);
  const SurfaceView view = straight({0, 0, 0}, 0.001);
  const glm::vec3 wo(0.0F, 0.0F, 1.0F);
  const glm::vec3 lit = core::cm_bsdf_eval(s, wo, lighting.sun_direction) * 5.0F + color * 2.0F;
  const glm::vec4 dark = draw(view, lighting).centre();
  expect_color(dark, glm::vec4(lit, 1.0F), 0.01F);
  lighting.sky_radiance = glm::vec3(10.0F);
  const glm::vec4 with_sky = draw(view, lighting).centre();
  scene->materials[0].occlusion_strength = 0.0F;
  set(scene);
  const glm::vec4 unoccluded = draw(view, lighting).centre();
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR((with_sky - dark)[c] / (unoccluded - dark)[c], 1.0F - 0.5F * 0.8F, 6e-3F);
  }
}

TEST_P(SurfaceRasters, NormalMapsWithAndWithoutTangents) {
  // The map leans by 0.48 to its right and 0.36 up. That is little enough that the mirrored view direction is above the
  // wall.
  const glm::vec3 m(0.48F, 0.36F, 0.8F);
  const auto byte = [](float value) { return static_cast<std::uint8_t>(std::lround((value + 1.0F) * 127.5F)); };
  const std::vector<std::uint8_t> texel{byte(m.x), byte(m.y), byte(m.z), 255};
  for (const bool mirrored_u : {false, true}) {
    for (const bool tangents : {false, true}) {
      for (const bool from_behind : {false, true}) {
        SCOPED_TRACE(testing::Message() << mirrored_u << tangents << from_behind);
        const auto scene = std::make_shared<HandScene>();
        surface::Material& material = scene->add_matte(glm::vec3(1.0F));
        material.double_sided = true;
        material.normal_texture.texture = scene->add_texture(1, 1, texel);
        scene->add_wall(-2.0F, 3.0F, 0);
        for (surface::VertexAttributes& vertex : scene->attributes) {
          if (mirrored_u) vertex.uv[0].x = -vertex.uv[0].x;
        }
        if (tangents) {
          for (surface::PosedVertex& vertex : scene->posed.vertices) {
            vertex.tangent = mirrored_u ? glm::vec4(-1, 0, 0, -1) : glm::vec4(1, 0, 0, 1);
          }
        }
        set(scene);
        glm::vec3 normal(mirrored_u ? -m.x : m.x, m.y, m.z);
        if (from_behind) normal = -normal;
        SurfaceView view = straight({0, 0, 0}, 0.05);
        if (from_behind) {
          view.eye.z = -4.0;
          view.forward.z = 1.0;
          view.right = -view.right;
        }
        const glm::vec3 smooth(0.0F, 0.0F, from_behind ? -1.0F : 1.0F);
        for (const glm::vec3 sun :
             {glm::vec3(0.8F, 0, 0.6F), glm::vec3(-0.8F, 0, 0.6F), glm::vec3(0, 0.96F, 0.28F),
              glm::vec3(0, -0.6F, 0.8F), glm::vec3(0.8F, 0, -0.6F), glm::vec3(-0.8F, 0, -0.6F),
              glm::vec3(0, 0.96F, -0.28F), glm::vec3(0, 0, 1), glm::vec3(0, 0, -1), glm::vec3(1, 0, 0)}) {
          SurfaceLighting lighting;
          lighting.sun_direction = sun;
          lighting.sun_irradiance = glm::vec3(pi);
          // With the soft terminator for mapped normals.
          const float cosine = std::max(0.0F, glm::dot(normal, sun));
          const float above = glm::dot(smooth, sun) / (std::max(cosine, 1e-6F) * glm::dot(normal, smooth));
          const float t = glm::clamp(above, 0.0F, 1.0F);
          const float expected = cosine * (t + t * t - t * t * t);
          EXPECT_NEAR(draw(view, lighting, {8U, 8U}).centre().x, expected, 0.01F) << sun.x << sun.y << sun.z;
        }
      }
    }
  }
}

/// Spheres with smooth normals: roughness increases along a row, metallic differs per row.
std::shared_ptr<HandScene> sphere_grid(int columns, int rows) {
  auto scene = std::make_shared<HandScene>();
  constexpr int stacks = 48;
  constexpr int slices = 96;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      surface::Material material;
      material.base_color = {0.9F, 0.45F, 0.15F, 1.0F};
      material.metallic = rows > 1 ? static_cast<float>(row) / static_cast<float>(rows - 1) : 0.0F;
      material.roughness = 0.1F + 0.9F * static_cast<float>(column) / static_cast<float>(columns - 1);
      scene->materials.push_back(material);
      const glm::vec3 centre(2.2F * (static_cast<float>(column) - 0.5F * static_cast<float>(columns - 1)),
                             2.2F * (static_cast<float>(row) - 0.5F * static_cast<float>(rows - 1)), 0.0F);
      const auto base = static_cast<std::uint32_t>(scene->attributes.size());
      const auto first = static_cast<std::uint32_t>(scene->indices.size());
      for (int i = 0; i <= stacks; ++i) {
        for (int j = 0; j <= slices; ++j) {
          const float theta = pi * static_cast<float>(i) / stacks;
          const float phi = 2.0F * pi * static_cast<float>(j) / slices;
          const glm::vec3 n(std::sin(theta) * std::sin(phi), std::cos(theta), std::sin(theta) * std::cos(phi));
          scene->posed.vertices.push_back({centre + n, n, glm::vec4(0.0F)});
          scene->attributes.emplace_back();
        }
      }
      for (std::uint32_t i = 0; i < stacks; ++i) {
        for (std::uint32_t j = 0; j < slices; ++j) {
          const std::uint32_t a = base + i * (slices + 1) + j;
          const std::uint32_t b = a + slices + 1;
          scene->indices.insert(scene->indices.end(), {a, b, b + 1, a, b + 1, a + 1});
        }
      }
      scene->draws.push_back({first, static_cast<std::uint32_t>(scene->indices.size()) - first,
                              static_cast<std::uint32_t>(scene->materials.size() - 1), 0});
      scene->posed.flipped.push_back(0);
    }
  }
  return scene;
}

TEST_P(SurfaceRasters, SphereShadingMatchesTheBsdf) {
  constexpr int columns = 7;
  constexpr int rows = 3;
  const auto scene = sphere_grid(columns, rows);
  set(scene);
  SurfaceLighting lighting;
  lighting.sun_direction = glm::normalize(glm::vec3(0.5F, 0.7F, 0.6F));
  lighting.sun_irradiance = glm::vec3(3.0F);
  const glm::uvec2 size(700U, 300U);
  const SurfaceView view = straight({0, 0, 20}, 3.45, 7.0 / 3.0, true);
  const RasterPicture picture = draw(view, lighting, size);
  int compared = 0;
  for (unsigned y = 2; y < size.y; y += 5) {
    for (unsigned x = 2; x < size.x; x += 5) {
      const glm::vec2 at((2.0F * (static_cast<float>(x) + 0.5F) / 700.0F - 1.0F) * 3.45F * 7.0F / 3.0F,
                         (1.0F - 2.0F * (static_cast<float>(y) + 0.5F) / 300.0F) * 3.45F);
      for (std::size_t i = 0; i < scene->materials.size(); ++i) {
        const auto column = static_cast<float>(i % columns);
        const std::size_t line = i / columns;
        const auto row = static_cast<float>(line);
        const glm::vec2 centre(2.2F * (column - 3.0F), 2.2F * (row - 1.0F));
        const glm::vec2 d = at - centre;
        if (glm::dot(d, d) > 0.9F) continue;
        const surface::Material& material = scene->materials[i];
        core::CmSurface s{};
        s.base_color = glm::vec3(material.base_color);
        s.metallic = material.metallic;
        s.roughness = material.roughness;
        s.normal = glm::vec3(d, std::sqrt(1.0F - glm::dot(d, d)));
        s.matte_normal = s.smooth_normal = s.normal;
        s.f0 = glm::vec3(0.04F);
        s.specular = 1.0F;
        if (s.roughness < 0.3F &&
            glm::dot(s.normal, glm::normalize(lighting.sun_direction + glm::vec3(0, 0, 1))) > 0.98F) {
          continue;  // the highlight shows the facets
        }
        const glm::vec3 expected = core::cm_bsdf_eval(s, {0, 0, 1}, lighting.sun_direction) * 3.0F;
        const glm::vec4 got = picture.color(x, y);
        for (int c = 0; c < 3; ++c) {
          ASSERT_NEAR(got[c], expected[c], 0.03F * expected[c] + 4e-3F) << x << ',' << y << " sphere " << i;
        }
        ASSERT_NEAR(picture.z(x, y), 20.0F - s.normal.z, 3e-3F);
        ++compared;
      }
    }
  }
  EXPECT_GT(compared, 2000);

  // For visual inspection: CUMULET_PICTURES=DIR.
  if (const char* folder = std::getenv("CUMULET_PICTURES")) {
    lighting.sky_radiance = {0.25F, 0.35F, 0.5F};
    const RasterPicture layered = draw(straight({0, 0, 12}, 0.31, 7.0 / 3.0), lighting, size, 8);
    cumulet::image::Image out{size.x, size.y, std::vector<float>(std::size_t{size.x} * size.y * 4)};
    for (std::size_t i = 0; i < layered.colors.size(); ++i) {
      const std::size_t pixel = i % (std::size_t{size.x} * size.y);
      for (std::size_t c = 0; c < 4; ++c) {
        out.rgba[pixel * 4 + c] += layered.colors[i][static_cast<int>(c)] / 8.0F;
      }
    }
    const char* backend = GetParam() == cumulet::headless::Backend::egl ? "egl" : "osmesa";
    cumulet::image::write_png(std::string(folder) + "/spheres_" + backend + ".png", out);
  }
}

}  // namespace
