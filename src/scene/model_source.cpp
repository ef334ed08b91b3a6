#include "scene/model_source.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>
#include <numeric>
#include <span>
#include <tuple>

#include "base/detached_work.hpp"
#include "base/error.hpp"
#include "base/progress_part.hpp"
#include "scene/threaded_tree.hpp"

namespace cumulet::core {
#include "surface/surface_tables.glsl"
}  // namespace cumulet::core

namespace cumulet::scene {

namespace {

using glm::dvec3;
using glm::uvec2;
using glm::uvec4;
using glm::vec2;
using glm::vec3;
using glm::vec4;
using surface::AlphaMode;
using surface::Material;
using surface::TextureUse;

constexpr std::uint32_t largest_layer = 16384;  // supported by every driver of GL 4.5

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
  // Without a thickness texture, the film has its maximum thickness: the shader's mix with a white texel gives that.
  to[core::CM_MATERIAL_SHEEN] = bits(m.sheen_color, m.sheen_roughness);
  to[core::CM_MATERIAL_FILM] = bits(vec4(m.iridescence, m.film_ior, m.film_thinnest, m.film_thickest));
  constexpr float mirror = 1e4F;  // represents an infinite index of refraction, which glTF writes as 0
  const float index = m.ior > 0.0F ? std::min(m.ior, mirror) : mirror;
  to[core::CM_MATERIAL_VOLUME] = bits(m.absorption, surface::bounds_volume(m) ? index : 0.0F);
  to[core::CM_MATERIAL_ANISOTROPY] =
      bits(vec4(m.anisotropy, std::cos(m.anisotropy_rotation), std::sin(m.anisotropy_rotation), m.dispersion));
}

std::uint32_t size_of(const std::vector<uvec4>& words) { return static_cast<std::uint32_t>(words.size()); }

// Returns the offsets of the nodes and of the records.
std::pair<std::uint32_t, std::uint32_t> pack_tree(std::vector<uvec4>& words, const surface::Bvh& bvh,
                                                  const Progress* progress) {
  const auto nodes = std::as_bytes(bvh.nodes());
  const auto records = std::as_bytes(bvh.records());
  const std::uint32_t first = size_of(words);
  const std::uint32_t second = first + static_cast<std::uint32_t>(nodes.size() / sizeof(uvec4));
  resize(words, words.size() + (nodes.size() + records.size()) / sizeof(uvec4), progress);
  std::memcpy(words.data() + first, nodes.data(), nodes.size());
  if (!records.empty()) std::memcpy(words.data() + second, records.data(), records.size());
  return {first, second};
}

// Returns the offset of the vertices.
std::uint32_t pack_vertices(std::vector<uvec4>& words, const surface::Scene& scene,
                            const std::vector<surface::PosedVertex>& vertices, const Progress* progress) {
  const std::uint32_t first = size_of(words);
  resize(words, words.size() + core::CM_VERTEX_WORDS * scene.attributes.size(), progress);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, scene.attributes.size(), 4096), [&](const auto& range) {
    check(progress);
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      const surface::PosedVertex& v = vertices[i];
      const surface::VertexAttributes& a = scene.attributes[i];
      uvec4* to = &words[first + core::CM_VERTEX_WORDS * i];
      to[core::CM_VERTEX_POSITION] = uvec4(glm::floatBitsToUint(v.position), octahedral(v.normal));
      to[core::CM_VERTEX_UV] = bits(vec4(a.uv[0], a.uv[1]));
      to[core::CM_VERTEX_REST] =
          uvec4(octahedral(vec3(v.tangent)), glm::floatBitsToUint(v.tangent.w),
                unorm16(a.color.x) | unorm16(a.color.y) << 16U, unorm16(a.color.z) | unorm16(a.color.w) << 16U);
    }
  });
  return first;
}

void find_visible_lobes(ModelSource& source) {
  const surface::Scene& scene = *source.scene;
  for (std::size_t d = 0; d < scene.draws.size(); ++d) {
    if (surface::is_hidden(source.pose, d)) continue;
    const Material& material = surface::materials_of(scene, source.pose)[surface::material_of(scene, source.pose, d)];
    source.bsdf = std::max(source.bsdf, surface::bsdf_variant(material));
    source.clear_surfaces = source.clear_surfaces || surface::may_be_clear(material);
  }
}

void pack_emitters(ModelSource& source, ModelMesh& mesh, const Progress* progress) {
  const auto number = [](const light::EmissiveTriangle& t) { return t.triangle; };
  const auto low = std::ranges::lower_bound(source.emissive, mesh.first_triangle, {}, number);
  const auto high = std::ranges::lower_bound(source.emissive, mesh.first_triangle + mesh.triangle_count, {}, number);
  const light::EmitterTable table =
      light::emitter_table({low, high}, *source.scene, source.pose, progress, mesh.first_triangle);
  mesh.emitters = size_of(source.words);
  mesh.emitter_count = size_of(table.entries);
  mesh.flux = table.flux;
  source.words.insert(source.words.end(), table.entries.begin(), table.entries.end());
}

void pack_words(ModelSource& source, const Progress* progress) {
  const surface::Scene& scene = *source.scene;
  std::vector<uvec4>& words = source.words;
  for (ModelMesh& mesh : source.meshes) std::tie(mesh.nodes, mesh.records) = pack_tree(words, mesh.bvh, progress);

  check(progress);
  const std::uint32_t triangles = size_of(words);
  resize(words, words.size() + scene.triangle_count(), progress);
  for (std::size_t d = 0; d < scene.draws.size(); ++d) {
    check(progress);
    const surface::Draw& draw = scene.draws[d];
    const std::uint32_t material = surface::material_of(scene, source.pose, d);
    for (std::uint32_t i = draw.first_index; i + 2 < draw.first_index + draw.index_count; i += 3) {
      words[triangles + i / 3] = uvec4(scene.indices[i], scene.indices[i + 1], scene.indices[i + 2], material);
    }
  }
  for (ModelMesh& mesh : source.meshes) mesh.triangles = triangles + mesh.first_triangle;
  check(progress);
  source.vertices = pack_vertices(words, scene, source.pose.vertices, progress);

  source.materials = size_of(words);
  for (const Material& material : surface::materials_of(scene, source.pose)) {
    words.resize(words.size() + core::CM_MATERIAL_WORDS);
    write_material(&words[words.size() - core::CM_MATERIAL_WORDS], material, source.pose.double_sided);
  }
  check(progress);
  for (ModelMesh& mesh : source.meshes) pack_emitters(source, mesh, progress);
  find_visible_lobes(source);
}

// The part of a per-triangle array (`each` elements per triangle) that belongs to the mesh.
template <class T>
std::span<const T> part_of(const std::vector<T>& all, const ModelMesh& mesh, std::size_t each) {
  return std::span(all).subspan(each * mesh.first_triangle, each * mesh.triangle_count);
}

void build(ModelSource& source, ModelMesh& mesh, const std::vector<std::uint32_t>& flags, const Progress* progress) {
  mesh.bvh = surface::Bvh::build(source.pose.vertices, part_of(source.scene->indices, mesh, 3), part_of(flags, mesh, 1),
                                 progress);
  mesh.built_cost = mesh.bvh.cost();
}

// Adds a mesh of the draws [first, last), which are contiguous in the indices.
void add_mesh(ModelSource& source, std::size_t first, std::size_t last, std::vector<glm::dmat4> transforms,
              std::optional<std::size_t> prototype) {
  const surface::Scene& scene = *source.scene;
  const std::size_t end = last < scene.draws.size() ? scene.draws[last].first_index : scene.indices.size();
  ModelMesh mesh;
  mesh.first_triangle = first < scene.draws.size() ? scene.draws[first].first_index / 3 : 0;
  mesh.triangle_count = static_cast<std::uint32_t>(end / 3) - mesh.first_triangle;
  mesh.transforms = std::move(transforms);
  mesh.prototype = prototype;
  if (mesh.triangle_count > 0) source.meshes.push_back(std::move(mesh));
}

void find_meshes(ModelSource& source) {
  const surface::Scene& scene = *source.scene;
  source.meshes.clear();
  if (scene.first_prototype_draw() > 0)
    add_mesh(source, 0, scene.first_prototype_draw(), {surface::from_origin(glm::dmat4(1.0), source.pose)}, {});
  for (std::size_t p = 0; p < scene.prototypes.size(); ++p) {
    const surface::Prototype& prototype = scene.prototypes[p];
    add_mesh(source, prototype.first_draw, prototype.first_draw + prototype.draw_count,
             source.pose.prototype_transforms[p], p);
  }
}

// Whether the mesh differs between shutter open and close. A mesh with a vertex too far away for the tree at either end
// counts as static.
bool deforms(const surface::Scene& scene, const ModelMesh& mesh, const surface::PoseEnds& ends) {
  bool differs = false;
  for (const std::uint32_t i : part_of(scene.indices, mesh, 3)) {
    const surface::PosedVertex& open = ends.open.vertices[i];
    const surface::PosedVertex& close = ends.close.vertices[i];
    if (!core::cm_is_within(open.position, static_cast<float>(farthest)) ||
        !core::cm_is_within(close.position, static_cast<float>(farthest)))
      return false;
    differs =
        differs || open.position != close.position || open.normal != close.normal || open.tangent != close.tangent;
  }
  return differs;
}

MeshEnds::End pack_end(ModelSource& source, MeshEnds& ends, const ModelMesh& mesh, const surface::Pose& pose,
                       const Progress* progress) {
  surface::Bvh bvh = mesh.bvh;
  bvh.refit(pose.vertices, part_of(source.scene->indices, mesh, 3), progress);
  const auto [low, high] = box_of(bvh);
  ends.low = glm::min(ends.low, low);
  ends.high = glm::max(ends.high, high);
  MeshEnds::End end;
  std::tie(end.nodes, end.records) = pack_tree(source.words, bvh, progress);
  return end;
}

void pack_ends(ModelSource& source, const surface::PoseEnds& ends, const Progress* progress) {
  bool any = false;
  for (ModelMesh& mesh : source.meshes) {
    check(progress);
    if (!deforms(*source.scene, mesh, ends)) continue;
    MeshEnds& made = mesh.ends.emplace();
    made.low = dvec3(std::numeric_limits<double>::max());
    made.high = -made.low;
    made.open = pack_end(source, made, mesh, ends.open, progress);
    made.close = pack_end(source, made, mesh, ends.close, progress);
    any = true;
  }
  if (!any) return;
  const std::uint32_t open = pack_vertices(source.words, *source.scene, ends.open.vertices, progress);
  const std::uint32_t close = pack_vertices(source.words, *source.scene, ends.close.vertices, progress);
  for (ModelMesh& mesh : source.meshes) {
    if (!mesh.ends) continue;
    mesh.ends->open.vertices = open;
    mesh.ends->close.vertices = close;
  }
}

// Returns the transforms at both ends if they change and exist at both ends; else an empty vector.
std::vector<ShutterTransforms> shutter_transforms_of(const std::vector<glm::dmat4>& now,
                                                     const std::vector<glm::dmat4>& open,
                                                     const std::vector<glm::dmat4>& close) {
  std::vector<ShutterTransforms> ends;
  if (open == close || open.size() != now.size() || close.size() != now.size()) return ends;
  for (std::size_t i = 0; i < now.size(); ++i) ends.push_back({open[i], close[i]});
  return ends;
}

void move(ModelSource& source, const std::optional<surface::PoseEnds>& ends, const Progress* progress) {
  if (!ends) return;
  pack_ends(source, *ends, progress);
  for (ModelMesh& mesh : source.meshes) {
    if (!mesh.prototype) continue;
    mesh.shutter_transforms = shutter_transforms_of(mesh.transforms, ends->open.prototype_transforms[*mesh.prototype],
                                                    ends->close.prototype_transforms[*mesh.prototype]);
  }
}

}  // namespace

std::pair<dvec3, dvec3> box_of(const surface::Bvh& bvh) {
  dvec3 low(std::numeric_limits<double>::max());
  dvec3 high(-low);
  for (const surface::Bvh::Node::Child& child : bvh.nodes().front().child) {
    if (!core::cm_is_within(child.low, static_cast<float>(farthest))) continue;  // an unused child
    low = glm::min(low, dvec3(child.low));
    high = glm::max(high, dvec3(child.high));
  }
  return {low, high};
}

ModelSourcePtr make_model_source(surface::ScenePtr scene, surface::Pose pose, Progress* progress,
                                 const std::optional<surface::PoseEnds>& ends) {
  auto source = make_deferred_delete<ModelSource>();
  source->scene = std::move(scene);
  source->pose = std::move(pose);
  find_meshes(*source);
  check(progress);
  const std::vector<std::uint32_t> flags = surface::triangle_flags(*source->scene, source->pose);
  for (ModelMesh& mesh : source->meshes) build(*source, mesh, flags, progress);
  check(progress);
  source->emissive = light::emissive_triangles(*source->scene, source->pose, progress);
  source->images = std::make_shared<const TextureImages>(texture_images(source->scene, largest_layer, progress));
  source->raster = make_raster_source(source->scene, source->pose, nullptr, progress);
  source->centres = blended_centres(*source->raster, source->pose, progress);
  check(progress);
  pack_words(*source, progress);
  move(*source, ends, progress);
  return source;
}

ModelSourcePtr make_model_source(const ModelSource& last, surface::Pose pose, Progress* progress,
                                 const std::optional<surface::PoseEnds>& ends) {
  auto source = make_deferred_delete<ModelSource>();
  source->scene = last.scene;
  source->pose = std::move(pose);
  check(progress);
  find_meshes(*source);
  // The BVH is refitted unless triangle flags have changed: a node was mirrored, a sidedness or a visibility changed.
  // It is also rebuilt if refitting has made its boxes so large that traversal is slow.
  const std::vector<std::uint32_t> flags = surface::triangle_flags(*source->scene, source->pose);
  const bool other_flags = flags != surface::triangle_flags(*last.scene, last.pose);
  for (std::size_t i = 0; i < source->meshes.size(); ++i) {
    ModelMesh& mesh = source->meshes[i];
    check(progress);
    mesh.bvh = last.meshes[i].bvh;
    mesh.built_cost = last.meshes[i].built_cost;
    check(progress);
    mesh.bvh.refit(source->pose.vertices, part_of(source->scene->indices, mesh, 3), progress);
    if (other_flags || mesh.bvh.cost() > 1.5 * mesh.built_cost) build(*source, mesh, flags, progress);
  }
  check(progress);
  source->images = last.images;
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
  move(*source, ends, progress);
  return source;
}

}  // namespace cumulet::scene
