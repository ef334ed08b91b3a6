#include "scene/model_source.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <glm/ext/vector_ulp.hpp>
#include <numbers>
#include <numeric>
#include <span>

#include "base/apart.hpp"
#include "base/error.hpp"
#include "base/progress_part.hpp"
#include "surface/ggx_albedo.hpp"
#include "surface/sheen_albedo.hpp"

namespace cumulet::core {
#include "surface_tables.glsl"
}  // namespace cumulet::core

namespace cumulet::scene {

namespace {

using glm::uvec2;
using glm::uvec4;
using glm::vec2;
using glm::vec3;
using glm::vec4;
using surface::AlphaMode;
using surface::Material;
using surface::TextureUse;

constexpr std::uint32_t largest_layer = 16384;  // what any driver of GL 4.5 takes

uvec4 bits(const vec4& v) { return glm::floatBitsToUint(v); }
uvec4 bits(const vec3& v, float w) { return glm::floatBitsToUint(vec4(v, w)); }

std::uint32_t snorm16(float v) {
  return static_cast<std::uint16_t>(static_cast<std::int16_t>(std::lround(std::clamp(v, -1.0F, 1.0F) * 32767.0F)));
}

std::uint32_t octahedral(const vec3& v) {
  const float sum = std::abs(v.x) + std::abs(v.y) + std::abs(v.z);
  if (!(sum > 0.0F)) return 0;
  vec2 e = vec2(v) / sum;
  if (v.z < 0.0F) {
    e = (1.0F - glm::abs(vec2(e.y, e.x))) * vec2(e.x >= 0.0F ? 1.0F : -1.0F, e.y >= 0.0F ? 1.0F : -1.0F);
  }
  return snorm16(e.x) | snorm16(e.y) << 16U;
}

std::uint32_t unorm16(float v) { return static_cast<std::uint32_t>(std::lround(std::clamp(v, 0.0F, 1.0F) * 65535.0F)); }

void write_use(uvec4* to, const TextureUse& use) {
  const glm::mat3x2& m = use.transform;
  const std::uint32_t head =
      use.texture < 0 ? 0U
                      : static_cast<std::uint32_t>(use.texture + 1) | (use.uv_set == 1 ? core::CM_USE_SECOND_UV : 0U);
  to[0] = uvec4(head, glm::floatBitsToUint(m[0][0]), glm::floatBitsToUint(m[0][1]), glm::floatBitsToUint(m[1][0]));
  to[1] = bits(vec4(m[1][1], m[2][0], m[2][1], 0.0F));
}

void write_material(uvec4* to, const Material& m, bool double_sided) {
  const float f0 = (m.ior - 1.0F) / (m.ior + 1.0F);
  to[core::CM_MATERIAL_BASE_COLOR] = bits(m.base_color);
  to[core::CM_MATERIAL_EMISSION] = bits(m.emission, m.alpha_cutoff);
  to[core::CM_MATERIAL_REFLECTION] = bits(vec4(m.metallic, m.roughness, f0 * f0, m.specular));
  to[core::CM_MATERIAL_SPECULAR_COLOR] = bits(m.specular_color, m.clearcoat);
  to[core::CM_MATERIAL_COAT] = bits(vec4(m.clearcoat_roughness, m.transmission, m.normal_scale, 0.0F));
  to[core::CM_MATERIAL_FLAGS].x = (m.alpha_mode == AlphaMode::mask ? core::CM_ALPHA_MASK : 0U) |
                                  (m.alpha_mode == AlphaMode::blend ? core::CM_ALPHA_BLEND : 0U) |
                                  (m.unlit ? core::CM_UNLIT : 0U) |
                                  (m.double_sided || double_sided ? 0U : core::CM_ONE_SIDED);
  write_use(to + core::CM_USE_BASE_COLOR, m.base_color_texture);
  write_use(to + core::CM_USE_METALLIC_ROUGHNESS, m.metallic_roughness_texture);
  write_use(to + core::CM_USE_NORMAL, m.normal_texture);
  write_use(to + core::CM_USE_EMISSION, m.emission_texture);
  write_use(to + core::CM_USE_SPECULAR, m.specular_texture);
  write_use(to + core::CM_USE_SPECULAR_COLOR, m.specular_color_texture);
  write_use(to + core::CM_USE_CLEARCOAT, m.clearcoat_texture);
  write_use(to + core::CM_USE_CLEARCOAT_ROUGHNESS, m.clearcoat_roughness_texture);
  write_use(to + core::CM_USE_TRANSMISSION, m.transmission_texture);
  write_use(to + core::CM_USE_SHEEN_COLOR, m.sheen_color_texture);
  write_use(to + core::CM_USE_SHEEN_ROUGHNESS, m.sheen_roughness_texture);
  write_use(to + core::CM_USE_ANISOTROPY, m.anisotropy_texture);
  write_use(to + core::CM_USE_IRIDESCENCE, m.iridescence_texture);
  write_use(to + core::CM_USE_FILM_THICKNESS, m.film_thickness_texture);
  // Without a texture it is as thick as can be: by that mix, white is.
  to[core::CM_MATERIAL_SHEEN] = bits(m.sheen_color, m.sheen_roughness);
  to[core::CM_MATERIAL_FILM] = bits(vec4(m.iridescence, m.film_ior, m.film_thinnest, m.film_thickest));
  constexpr float mirror = 1e4F;  // for the index that is infinite, which glTF writes as 0
  const float index = m.ior > 0.0F ? std::min(m.ior, mirror) : mirror;
  to[core::CM_MATERIAL_VOLUME] = bits(m.absorption, surface::bounds_volume(m) ? index : 0.0F);
  to[core::CM_MATERIAL_ANISOTROPY] =
      bits(vec4(m.anisotropy, std::cos(m.anisotropy_rotation), std::sin(m.anisotropy_rotation), m.dispersion));
}

std::uint32_t wrap_bits(surface::Wrap wrap) {
  switch (wrap) {
    case surface::Wrap::mirrored:
      return core::CM_WRAP_MIRRORED;
    case surface::Wrap::clamp:
      return core::CM_WRAP_CLAMP;
    default:
      return core::CM_WRAP_REPEAT;
  }
}

bool draws_rich(const surface::Scene& scene, const surface::Pose& pose) {
  for (std::size_t d = 0; d < scene.draws.size(); ++d) {
    if (surface::is_hidden(pose, d)) continue;
    if (surface::is_rich(surface::materials_of(scene, pose)[surface::material_of(scene, pose, d)])) return true;
  }
  return false;
}

std::uint32_t size_of(const std::vector<uvec4>& words) { return static_cast<std::uint32_t>(words.size()); }

void pack_words(ModelSource& source, const Progress* progress) {
  const surface::Scene& scene = *source.scene;
  std::vector<uvec4>& words = source.words;
  const auto nodes = std::as_bytes(source.bvh.nodes());
  const auto records = std::as_bytes(source.bvh.records());
  source.tables.records = static_cast<std::uint32_t>(nodes.size() / sizeof(uvec4));
  resize(words, (nodes.size() + records.size()) / sizeof(uvec4), progress);
  std::memcpy(words.data(), nodes.data(), nodes.size());
  if (!records.empty()) std::memcpy(words.data() + source.tables.records, records.data(), records.size());

  check(progress);
  source.tables.triangles = size_of(words);
  resize(words, words.size() + scene.triangle_count(), progress);
  for (std::size_t d = 0; d < scene.draws.size(); ++d) {
    check(progress);
    const surface::Draw& draw = scene.draws[d];
    const std::uint32_t material = surface::material_of(scene, source.pose, d);
    for (std::uint32_t i = draw.first_index; i + 2 < draw.first_index + draw.index_count; i += 3) {
      words[source.tables.triangles + i / 3] =
          uvec4(scene.indices[i], scene.indices[i + 1], scene.indices[i + 2], material);
    }
  }
  check(progress);
  source.tables.vertices = size_of(words);
  resize(words, words.size() + core::CM_VERTEX_WORDS * scene.attributes.size(), progress);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, scene.attributes.size(), 4096), [&](const auto& range) {
    check(progress);
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      const surface::PosedVertex& v = source.pose.vertices[i];
      const surface::VertexAttributes& a = scene.attributes[i];
      uvec4* to = &words[source.tables.vertices + core::CM_VERTEX_WORDS * i];
      to[core::CM_VERTEX_PLACE] = uvec4(glm::floatBitsToUint(v.position), octahedral(v.normal));
      to[core::CM_VERTEX_UV] = bits(vec4(a.uv[0], a.uv[1]));
      to[core::CM_VERTEX_REST] =
          uvec4(octahedral(vec3(v.tangent)), glm::floatBitsToUint(v.tangent.w),
                unorm16(a.color.x) | unorm16(a.color.y) << 16U, unorm16(a.color.z) | unorm16(a.color.w) << 16U);
    }
  });

  source.tables.materials = size_of(words);
  for (const Material& material : surface::materials_of(scene, source.pose)) {
    words.resize(words.size() + core::CM_MATERIAL_WORDS);
    write_material(&words[words.size() - core::CM_MATERIAL_WORDS], material, source.pose.double_sided);
  }
  source.tables.textures = size_of(words);
  for (const surface::Texture& texture : scene.textures) {
    const TextureAtlas::Place& place = source.atlas->places[texture.image];
    words.emplace_back(place.corner.x | place.corner.y << 16U, place.size.x | place.size.y << 16U, place.layer,
                       wrap_bits(texture.sampler.wrap_s) | wrap_bits(texture.sampler.wrap_t) << core::CM_WRAP_T_SHIFT |
                           (texture.sampler.magnify == surface::Filter::nearest ? core::CM_TEXTURE_NEAREST : 0U));
  }
  check(progress);
  const light::EmitterTable table = light::emitter_table(source.emissive, scene, source.pose, progress);
  source.tables.emitters = size_of(words);
  source.tables.emitter_count = size_of(table.entries);
  words.insert(words.end(), table.entries.begin(), table.entries.end());
  const surface::GgxAlbedo& albedo = surface::GgxAlbedo::table();
  const std::vector<uvec4> cells = albedo.cells();
  const std::vector<uvec4> averages = albedo.average_cells();
  source.tables.rich = draws_rich(scene, source.pose) ? 1U : 0U;
  source.tables.ggx_albedo = size_of(words);
  words.insert(words.end(), cells.begin(), cells.end());
  source.tables.ggx_albedo_averages = size_of(words);
  words.insert(words.end(), averages.begin(), averages.end());
  source.tables.sheen_albedo = size_of(words);
  if (source.tables.rich != 0U) {
    const std::vector<uvec4> sheen = surface::SheenAlbedo::table().words();
    words.insert(words.end(), sheen.begin(), sheen.end());
  }
  source.lights = light::scene_lights(source.pose, table);
  source.tables.low = glm::prevFloat(vec3(source.pose.low));
  source.tables.high = glm::nextFloat(vec3(source.pose.high));
}

void build(ModelSource& source, const Progress* progress) {
  check(progress);
  const std::vector<std::uint32_t> flags = surface::triangle_flags(*source.scene, source.pose);
  check(progress);
  source.bvh = surface::Bvh::build(source.pose.vertices, source.scene->indices, flags, progress);
  source.built_cost = source.bvh.cost();
}

// What is put into the atlas for images that are larger than their places, as they are encoded.
void shrink_images(TextureAtlas& atlas, const std::vector<surface::Image>& images, const Progress* progress) {
  atlas.smaller.resize(images.size());
  for (std::size_t i = 0; i < images.size(); ++i) {
    std::vector<std::uint8_t>& smaller = atlas.smaller[i];
    for (uvec2 size(images[i].width, images[i].height); size != atlas.places[i].size; size = glm::max(size / 2U, 1U)) {
      smaller = half_of(smaller.empty() ? images[i].rgba : smaller, size, false, progress);
    }
  }
}

}  // namespace

ModelSourcePtr make_model_source(surface::ScenePtr scene, surface::Pose pose, Progress* progress) {
  auto source = make_left<ModelSource>();
  source->scene = std::move(scene);
  source->pose = std::move(pose);
  build(*source, progress);
  check(progress);
  source->emissive = light::emissive_triangles(*source->scene, source->pose, progress);
  TextureAtlas atlas = pack_atlas(source->scene->images, largest_layer);
  shrink_images(atlas, source->scene->images, progress);
  source->atlas = std::make_shared<const TextureAtlas>(std::move(atlas));
  source->raster = make_raster_source(source->scene, source->pose, nullptr, progress);
  source->centres = blended_centres(*source->raster, source->pose, progress);
  check(progress);
  pack_words(*source, progress);
  return source;
}

ModelSourcePtr make_model_source(const ModelSource& last, surface::Pose pose, Progress* progress) {
  auto source = make_left<ModelSource>();
  source->scene = last.scene;
  source->pose = std::move(pose);
  check(progress);
  source->bvh = last.bvh;
  check(progress);
  source->built_cost = last.built_cost;
  source->bvh.refit(source->pose.vertices, source->scene->indices, progress);
  // A node that turned inside out has other flags, as have other sides; what shows up or goes is another tree, as is
  // one whose boxes have grown apart, which is slow.
  const bool other_flags =
      surface::triangle_flags(*source->scene, source->pose) != surface::triangle_flags(*last.scene, last.pose);
  if (other_flags || source->bvh.cost() > 1.5 * source->built_cost) build(*source, progress);
  check(progress);
  source->atlas = last.atlas;
  if (source->pose.hidden == last.pose.hidden && source->pose.materials == last.pose.materials &&
      source->pose.chosen == last.pose.chosen) {
    source->emissive = last.emissive;
    source->raster = last.raster;
  } else {
    source->emissive = light::emissive_triangles(*source->scene, source->pose, progress);
    source->raster = make_raster_source(source->scene, source->pose, last.raster->pictures, progress);
  }
  source->centres = blended_centres(*source->raster, source->pose, progress);
  pack_words(*source, progress);
  return source;
}

}  // namespace cumulet::scene
