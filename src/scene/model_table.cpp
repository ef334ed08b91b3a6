#include "scene/model_table.hpp"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <numbers>
#include <string>

#include "base/error.hpp"
#include "light/alias_table.hpp"
#include "scene/space.hpp"

namespace cumulet::scene {

namespace {

using core::CmModel;
using glm::dmat4;
using glm::dvec3;
using glm::vec3;

constexpr float largest = 1e15F;  // products of such values stay finite in shaders

bool is_sound(const CmModel& m) {
  const auto sound = [](const vec3& v) { return core::cm_is_within(v, largest); };
  return sound(m.to_own_x) && sound(m.to_own_y) && sound(m.to_own_z) && sound(m.to_world_x) && sound(m.to_world_y) &&
         sound(m.to_world_z) && sound(m.origin) && m.own_volume > 0.0F && m.own_volume < 1e30F;
}

void set_transform(CmModel& record, const dmat4& to_world) {
  const glm::dmat3 linear(to_world);
  const glm::dmat3 inverse = glm::inverse(linear);
  record.to_world_x = vec3(linear[0]);
  record.to_world_y = vec3(linear[1]);
  record.to_world_z = vec3(linear[2]);
  record.to_own_x = vec3(inverse[0]);
  record.to_own_y = vec3(inverse[1]);
  record.to_own_z = vec3(inverse[2]);
  record.origin = vec3(to_world[3]);
  const double volume = glm::determinant(linear);
  record.own_volume = static_cast<float>(1.0 / std::abs(volume));
  if (volume < 0.0) record.flags |= core::CM_MODEL_MIRRORS;
}

// Sets the probability with which next-event estimation samples the emissive triangles of each record.
void share_looks(ModelTable& table, const std::vector<double>& power) {
  double sum = 0.0;
  for (const double of : power) sum += of;
  if (!(sum > 0.0) || !std::isfinite(sum)) {
    for (CmModel& record : table.records) record.emitter_count = 0;
    return;
  }
  table.lights.triangle_flux = sum;
  const std::vector<light::Alias> aliases = light::alias_table(power, sum);
  // Computed from the quantized alias words, as shaders use them.
  std::vector<double> probability(power.size(), 0.0);
  for (std::size_t i = 0; i < power.size(); ++i) {
    table.records[i].alias = aliases[i].stays;
    table.records[i].alias_other = aliases[i].other;
    const double stays =
        table.records[i].emitter_count > 0 ? (static_cast<double>(aliases[i].stays) + 1.0) / 4294967296.0 : 0.0;
    probability[i] += stays;
    probability[aliases[i].other] += 1.0 - stays;
  }
  for (std::size_t i = 0; i < power.size(); ++i) {
    table.records[i].emitter_probability = static_cast<float>(probability[i] / static_cast<double>(power.size()));
    table.lights.triangles = std::max(table.lights.triangles, table.records[i].emitter_count);
  }
}

}  // namespace

surface::PunctualLight transformed(surface::PunctualLight light, const dmat4& to_world) {
  light.position = vec3(to_world * glm::dvec4(light.position, 1.0));
  const dvec3 direction = glm::dmat3(to_world) * dvec3(light.direction);
  light.direction = vec3(glm::normalize(direction));
  return light;
}

std::size_t ModelTable::record_of(std::uint32_t triangle) const {
  const auto after = std::ranges::upper_bound(records, triangle, {}, &CmModel::first);
  return static_cast<std::size_t>(after - records.begin()) - 1;
}

ModelBounds bounds_of(const ModelSource& source, const dmat4& to_world) {
  ModelBounds all;
  const auto add = [&](const dvec3& low, const dvec3& high) {
    all.low = all.any ? glm::min(all.low, low) : low;
    all.high = all.any ? glm::max(all.high, high) : high;
    all.any = true;
  };
  for (const ModelMesh& mesh : source.meshes) {
    const auto [low, high] = box_of(mesh.bvh);
    if (!(low.x <= high.x)) continue;
    for (const dmat4& transform : mesh.transforms) {
      const Block block = block_of(to_world * transform, low, high);
      const dvec3 reach = reach_of(block);
      add(block.middle - reach, block.middle + reach);
    }
  }
  return all;
}

bool can_stand(const dmat4& to_world) {
  CmModel whole{};
  set_transform(whole, to_world);
  return is_sound(whole);
}

namespace {

// Fills all fields except the transform and the first triangle.
CmModel record_of(const Model& model, const ModelMesh& mesh, const ModelWords& at) {
  CmModel record{};
  record.flags = (model.shadow_only ? 0U : core::CM_MODEL_SEEN) | (model.holdout ? core::CM_MODEL_HOLDOUT : 0U) |
                 (model.ends || !mesh.shutter_transforms.empty() ? core::CM_MODEL_MOVES : 0U) |
                 (mesh.ends ? core::CM_MODEL_DEFORMS : 0U);
  record.nodes = at.first + mesh.nodes;
  record.records = at.first + mesh.records;
  record.triangles = at.first + mesh.triangles;
  record.vertices = at.first + model.source->vertices;
  record.materials = at.first + model.source->materials;
  record.emitters = at.first + mesh.emitters;
  record.emitter_count = mesh.emitter_count;
  record.textures = at.textures;
  record.group = model.group;
  return record;
}

// Returns the shutter transforms of one instance of a mesh within the model.
ShutterTransforms ends_of(const Model& model, const ModelMesh& mesh, std::size_t instance) {
  const ShutterTransforms of_model = model.ends.value_or(ShutterTransforms{model.to_world, model.to_world});
  const dmat4& still = mesh.transforms[instance];
  const ShutterTransforms within =
      mesh.shutter_transforms.empty() ? ShutterTransforms{still, still} : mesh.shutter_transforms[instance];
  const ShutterTransforms ends{of_model.open * within.open, of_model.close * within.close};
  // An animation that rotates too fast to interpolate is not an error: the mesh is then static.
  if (can_stand(ends.open) && can_stand(ends.close) && stays_solid(ends.open, ends.close)) return ends;
  return {model.to_world * still, model.to_world * still};
}

// Returns the record of a mesh at one shutter end: its transform, and its tables if it deforms.
CmModel record_of_end(const dmat4& to_world, const ModelMesh& mesh, MeshEnds::End MeshEnds::*end, std::uint32_t first) {
  CmModel record{};
  set_transform(record, to_world);
  if (!mesh.ends) return record;
  const MeshEnds::End& at = (*mesh.ends).*end;
  record.nodes = first + at.nodes;
  record.records = first + at.records;
  record.vertices = first + at.vertices;
  return record;
}

// Returns the bounds of the mesh in its own space, including both shutter ends.
std::pair<dvec3, dvec3> own_box(const ModelMesh& mesh) {
  auto [low, high] = box_of(mesh.bvh);
  if (!mesh.ends) return {low, high};
  return {glm::min(low, mesh.ends->low), glm::max(high, mesh.ends->high)};
}

bool moves(const Model& model) {
  const auto of_itself = [](const ModelMesh& mesh) { return mesh.ends || !mesh.shutter_transforms.empty(); };
  return model.ends || std::ranges::any_of(model.source->meshes, of_itself);
}

// World bounds of a box under these transforms and the linear motion between them. size: largest absolute coordinate.
struct Way {
  dvec3 low{std::numeric_limits<double>::max()};
  dvec3 high{-low};
  double size = 0.0;
};

Way way_of(std::initializer_list<dmat4> transforms, const dvec3& low, const dvec3& high) {
  Way way;
  for (const dmat4& transform : transforms) {
    const Block block = block_of(transform, low, high);
    way.low = glm::min(way.low, block.middle - reach_of(block));
    way.high = glm::max(way.high, block.middle + reach_of(block));
  }
  const dvec3 most = glm::max(glm::abs(way.low), glm::abs(way.high));
  way.size = std::max({most.x, most.y, most.z});
  return way;
}

}  // namespace

ModelTable make_model_table(std::span<const Model> models, const std::function<ModelWords(const ModelSource&)>& words) {
  ModelTable table;
  std::vector<TreeBox> boxes;
  std::vector<double> power;
  std::uint64_t triangles = 0;
  const bool any_moves = std::ranges::any_of(models, moves);
  std::vector<CmModel> opens;
  std::vector<CmModel> closes;
  dvec3 low(std::numeric_limits<double>::max());
  dvec3 high(-low);
  for (std::size_t m = 0; m < models.size(); ++m) {
    const Model& model = models[m];
    const auto refuse = [&](ErrorCode code, const char* cause) {
      throw Error(code, "model " + std::to_string(m) + ": " + cause);
    };
    if (!can_stand(model.to_world))
      refuse(ErrorCode::invalid_argument, "its transform is not finite, is singular, or is too large");
    const ModelSource& source = *model.source;
    const ModelWords at = words(source);
    for (std::size_t i = 0; i < source.meshes.size(); ++i) {
      const ModelMesh& mesh = source.meshes[i];
      const auto [own_low, own_high] = own_box(mesh);
      for (std::size_t k = 0; k < mesh.transforms.size(); ++k) {
        const dmat4 to_world = model.to_world * mesh.transforms[k];
        const double stretch = std::cbrt(std::abs(glm::determinant(glm::dmat3(to_world))));
        CmModel record = record_of(model, mesh, at);
        set_transform(record, to_world);
        // A mesh that a file scales to zero is left out.
        if (!is_sound(record)) continue;
        record.first = static_cast<std::uint32_t>(triangles);
        triangles += mesh.triangle_count;
        if (triangles >= std::numeric_limits<std::uint32_t>::max())
          refuse(ErrorCode::unsupported, "the total exceeds 2^32 triangles, counted per instance");
        const ShutterTransforms ends = ends_of(model, mesh, k);
        if (any_moves) {
          opens.push_back(record_of_end(ends.open, mesh, &MeshEnds::open, at.first));
          closes.push_back(record_of_end(ends.close, mesh, &MeshEnds::close, at.first));
        }
        const bool solid = own_low.x <= own_high.x;
        TreeBox box{vec3(0.0F), vec3(0.0F), solid};
        if (solid) {
          const Way way = way_of({to_world, ends.open, ends.close}, own_low, own_high);
          if (!(way.size < farthest)) refuse(ErrorCode::unsupported, "it extends 1e12 or more from the world origin");
          // Enlarged for rounding, so that it holds every hit in the mesh's own space.
          box.low = vec3(way.low - 2e-6 * way.size);
          box.high = vec3(way.high + 2e-6 * way.size);
          low = glm::min(low, way.low);
          high = glm::max(high, way.high);
        }
        boxes.push_back(box);
        power.push_back(mesh.flux * stretch * stretch);
        table.records.push_back(record);
        table.parts.push_back(
            {static_cast<std::uint32_t>(m), static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(k)});
      }
    }
    for (const surface::PunctualLight& light : source.pose.lights) {
      table.analytic_lights.push_back(transformed(light, surface::from_origin(model.to_world, source.pose)));
      table.analytic_light_groups.push_back(model.group);
    }
  }
  if (low.x <= high.x) {
    table.low = low;
    table.high = high;
  }
  table.lights = light::scene_lights(table.analytic_lights, 0.5 * glm::length(table.high - table.low));
  share_looks(table, power);
  table.nodes = threaded_tree(boxes);
  table.ends = std::move(opens);
  table.ends.insert(table.ends.end(), closes.begin(), closes.end());
  if (table.records.empty()) table.records.emplace_back();
  return table;
}

}  // namespace cumulet::scene
