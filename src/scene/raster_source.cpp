#include "scene/raster_source.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <tuple>

#include "base/progress_part.hpp"
#include "base/srgb.hpp"

namespace cumulet::core {
#include "display/display.glsl"
}  // namespace cumulet::core

namespace cumulet::scene {

namespace {

using core::CmMaterial;
using surface::AlphaMode;

std::array<const surface::TextureUse*, core::CM_MAPS> uses_of(const surface::Material& m) {
  return {&m.base_color_texture,     &m.metallic_roughness_texture, &m.normal_texture,
          &m.occlusion_texture,      &m.emission_texture,           &m.specular_texture,
          &m.specular_color_texture, &m.clearcoat_texture,          &m.clearcoat_roughness_texture,
          &m.transmission_texture};
}

bool is_color(std::size_t map) {
  return map == core::CM_MAP_BASE_COLOR || map == core::CM_MAP_EMISSION || map == core::CM_MAP_SPECULAR_COLOR;
}

// Returns the roughness of an isotropic lobe with the mean width of the anisotropic lobe.
float mean_roughness(const surface::Material& m) {
  const float across = m.roughness * m.roughness;
  const float along = glm::mix(across, 1.0F, m.anisotropy * m.anisotropy);
  return std::sqrt(std::sqrt(across * along));
}

// Returns the transmitted tint for the material's thickness.
glm::vec3 tint_of(const surface::Material& m) {
  if (!surface::bounds_volume(m)) return glm::vec3(1.0F);
  return glm::mix(glm::vec3(1.0F), glm::exp(-m.absorption * m.thickness), m.transmission);
}

CmMaterial block_of(const surface::Material& m) {
  CmMaterial block{};
  block.base_color = m.base_color * glm::vec4(tint_of(m), 1.0F);
  block.emission = glm::vec4(m.emission, m.alpha_cutoff);
  block.reflection = glm::vec4(m.metallic, mean_roughness(m), m.normal_scale, m.occlusion_strength);
  const float r = m.ior > 0.0F ? (m.ior - 1.0F) / (m.ior + 1.0F) : 1.0F;
  block.specular = glm::vec4(m.specular_color * (r * r), m.specular);
  block.coat = glm::vec4(m.clearcoat, m.clearcoat_roughness, m.transmission, 0.0F);
  block.flags.z = m.unlit ? 1U : 0U;
  const auto uses = uses_of(m);
  for (std::size_t map = 0; map < uses.size(); ++map) {
    const surface::TextureUse& use = *uses[map];
    if (use.uv_set == 1) block.flags.y |= 1U << map;
    for (int row = 0; row < 2; ++row) {
      block.uv_rows[2 * map + static_cast<std::size_t>(row)] =
          glm::vec4(use.transform[0][row], use.transform[1][row], use.transform[2][row], 0.0F);
    }
  }
  return block;
}

// Returns the index of a key, in order of first use.
template <class Key>
std::size_t number_of(std::map<Key, std::size_t>& numbers, const Key& key) {
  return numbers.try_emplace(key, numbers.size()).first->second;
}

void add_maps(RasterPictures& pictures) {
  const surface::Scene& scene = *pictures.scene;
  std::map<std::pair<std::uint32_t, bool>, std::size_t> textures;
  using Ways = std::tuple<surface::Wrap, surface::Wrap, surface::Filter, surface::Filter, bool, surface::Filter>;
  std::map<Ways, std::size_t> samplers;
  for (const surface::Material& material : scene.materials) {
    RasterPictures::Maps& maps = pictures.maps.emplace_back();
    const auto uses = uses_of(material);
    for (std::size_t map = 0; map < uses.size(); ++map) {
      if (uses[map]->texture < 0) continue;
      const surface::Texture& texture = scene.textures.at(static_cast<std::size_t>(uses[map]->texture));
      const surface::Sampler& s = texture.sampler;
      const std::size_t image = number_of(textures, {texture.image, is_color(map)});
      if (image == pictures.textures.size()) pictures.textures.push_back({texture.image, is_color(map), {}});
      const std::size_t sampler =
          number_of(samplers, {s.wrap_s, s.wrap_t, s.magnify, s.minify, s.mipmaps, s.between_mipmaps});
      if (sampler == pictures.samplers.size()) pictures.samplers.push_back(s);
      maps[map] = RasterPictures::Map{image, sampler};
    }
  }
}

void add_materials(RasterSource& source, const surface::Pose& pose) {
  const std::vector<surface::Material>& materials = surface::materials_of(*source.scene, pose);
  source.material_blocks.resize(RasterSource::material_stride * materials.size());
  for (std::size_t i = 0; i < materials.size(); ++i) {
    const surface::Material& material = materials[i];
    const CmMaterial block = block_of(material);
    std::memcpy(&source.material_blocks[i * RasterSource::material_stride], &block, sizeof(block));
    RasterSource::Material& result = source.materials.emplace_back();
    result.pass = material.transmission > 0.0F && !material.unlit ? AlphaMode::blend : material.alpha_mode;
    result.double_sided = material.double_sided;
    result.coated = material.clearcoat > 0.0F;
    result.maps = source.pictures->maps[i];
  }
}

void add_levels(RasterPictures& pictures, const Progress* progress) {
  for (const RasterPictures::Maps& maps : pictures.maps) {
    for (const auto& map : maps) {
      if (!map || !pictures.samplers[map->sampler].mipmaps) continue;
      RasterPictures::Texture& texture = pictures.textures[map->texture];
      if (!texture.smaller.empty()) continue;
      const surface::Image& image = pictures.scene->images.at(texture.image);
      glm::uvec2 size(image.width, image.height);
      while (size != glm::uvec2(1U)) {
        const auto& larger = texture.smaller.empty() ? image.rgba : texture.smaller.back();
        texture.smaller.push_back(half_of(larger, size, texture.srgb, progress));
        size = glm::max(size / 2U, glm::uvec2(1U));
      }
    }
  }
}

void add_draws(RasterSource& source, const surface::Pose& pose, const Progress* progress) {
  const std::vector<surface::Draw>& draws = source.scene->draws;
  for (std::uint32_t i = 0; i < draws.size(); ++i) {
    const surface::Draw& draw = draws[i];
    if (draw.index_count == 0 || surface::is_hidden(pose, i)) continue;
    if (source.materials.at(surface::material_of(*source.scene, pose, i)).pass != AlphaMode::blend) {
      source.solid.push_back({draw.first_index, draw.index_count, i});
      continue;
    }
    check(progress);
    for (std::uint32_t t = 0; t < draw.index_count; t += 3) source.blended.push_back({draw.first_index + t, 3, i});
  }
  std::ranges::stable_sort(source.solid, {}, [&](const RasterSource::Batch& batch) {
    const std::uint32_t material = surface::material_of(*source.scene, pose, batch.draw);
    return std::pair(source.materials[material].pass, material);
  });
}

// Position of a texel's center in the larger level: the two nearest texels, and the interpolation weight of the second.
struct Between {
  std::uint32_t first, second;
  float part;
};

std::vector<Between> between(std::uint32_t larger, std::uint32_t smaller) {
  std::vector<Between> weights(smaller);
  for (std::uint32_t i = 0; i < smaller; ++i) {
    const double at = (i + 0.5) * larger / smaller - 0.5;
    const auto first = static_cast<std::uint32_t>(at);
    weights[i] = {first, std::min(first + 1, larger - 1), static_cast<float>(at - first)};
  }
  return weights;
}

}  // namespace

std::uint32_t RasterSource::Material::used() const {
  std::uint32_t bits = 0;
  for (std::size_t map = 0; map < maps.size(); ++map) bits |= maps[map] ? 1U << map : 0U;
  return bits;
}

std::vector<std::uint8_t> half_of(const std::vector<std::uint8_t>& rgba, glm::uvec2 size, bool srgb,
                                  const Progress* progress) {
  const std::array<float, 256> linear = srgb_decoding();
  const glm::uvec2 half = glm::max(size / 2U, glm::uvec2(1U));
  const std::vector<Between> columns = between(size.x, half.x);
  const std::vector<Between> rows = between(size.y, half.y);
  std::vector<std::uint8_t> out(std::size_t{half.x} * half.y * 4);
  tbb::parallel_for(tbb::blocked_range<std::uint32_t>(0, half.y, 16), [&](const auto& range) {
    check(progress);
    for (std::uint32_t y = range.begin(); y != range.end(); ++y) {
      for (std::uint32_t x = 0; x < half.x; ++x) {
        for (std::size_t c = 0; c < 4; ++c) {
          const bool curved = srgb && c < 3;
          const auto value = [&](std::uint32_t column, std::uint32_t row) {
            const std::uint8_t v = rgba[(std::size_t{row} * size.x + column) * 4 + c];
            return curved ? linear[v] : static_cast<float>(v) / 255.0F;
          };
          const auto& [left, right, across] = columns[x];
          const auto& [top, bottom, down] = rows[y];
          const float mean = glm::mix(glm::mix(value(left, top), value(right, top), across),
                                      glm::mix(value(left, bottom), value(right, bottom), across), down);
          out[(std::size_t{y} * half.x + x) * 4 + c] =
              static_cast<std::uint8_t>(std::lround(255.0F * (curved ? core::cm_srgb_encode(mean) : mean)));
        }
      }
    }
  });
  return out;
}

std::shared_ptr<const RasterSource> make_raster_source(surface::ScenePtr scene, const surface::Pose& pose,
                                                       std::shared_ptr<const RasterPictures> pictures,
                                                       const Progress* progress) {
  if (!pictures) {
    auto made = std::make_shared<RasterPictures>();
    made->scene = scene;
    add_maps(*made);
    add_levels(*made, progress);
    pictures = std::move(made);
  }
  auto source = std::make_shared<RasterSource>();
  source->scene = std::move(scene);
  source->pictures = std::move(pictures);
  add_materials(*source, pose);
  add_draws(*source, pose, progress);
  return source;
}

std::vector<glm::vec3> blended_centres(const RasterSource& source, const surface::Pose& pose,
                                       const Progress* progress) {
  std::vector<glm::vec3> centres;
  resize(centres, source.blended.size(), progress);
  for (std::size_t t = 0; t < centres.size(); ++t) {
    for (std::uint32_t i = 0; i < 3; ++i) {
      centres[t] += pose.vertices[source.scene->indices[source.blended[t].first + i]].position * (1.0F / 3.0F);
    }
  }
  return centres;
}

}  // namespace cumulet::scene
