#include <algorithm>
#include <cmath>
#include <cstring>
#include <glm/gtc/quaternion.hpp>
#include <limits>
#include <map>
#include <new>
#include <optional>
#include <set>

#include "base/detached_work.hpp"
#include "base/progress_part.hpp"
#include "surface/accessors.hpp"
#include "surface/gltf_file.hpp"
#include "surface/gltf_import.hpp"
#include "surface/materials.hpp"
#include "surface/posable_scene.hpp"
#include "surface/precision.hpp"
#include "surface/winding.hpp"

namespace cumulet::surface {

namespace detail {

namespace {

/// Fraction of the area of closed shapes. Modelers produce inward faces only by mistake; shapes within others are
/// ignored.
constexpr double max_inward = 0.25;

/// Builds the scene from meshes, nodes and all other contents.
class Assembler {
 public:
  Assembler(const GltfFile& file, const Log& log, const std::string& name, Budget& budget, Progress* progress)
      : file_(file), log_(log), name_(name), budget_(budget), progress_(progress) {}

  ScenePtr assemble() {
    std::vector<MovableMaterial> movable = import_materials(file_, log_, name_, budget_, progress_, *scene_);
    scene_->rig = import_rig(file_, log_, name_, budget_, progress_, *scene_);
    const auto moves_material = [](const Channel& channel) { return channel.property == Property::material; };
    const bool any = std::ranges::any_of(
        scene_->rig.tracks, [&](const Track& track) { return std::ranges::any_of(track.channels, moves_material); });
    if (any) scene_->movable = std::move(movable);
    plan();
    instances();
    variants();
    meshes();
    look_at_winding();
    add_draws();
    lights_and_cameras();
    count();
    remark();
    scene_->finish();
    look_at_precision();
    return scene_;
  }

 private:
  /// Finds the meshes of displayed nodes. Permanently hidden nodes are skipped.
  void plan() {
    used_.resize(file_.model.meshes.size(), false);
    std::vector<bool> displayed(scene_->rig.nodes.size(), false);
    for (const std::uint32_t node : scene_->rig.displayed) displayed[node] = true;
    for (const std::uint32_t node : scene_->rig.displayed) {
      const tinygltf::Node& from = file_.model.nodes[node];
      if (from.mesh >= 0 && !scene_->rig.hidden[node]) used_[static_cast<std::size_t>(from.mesh)] = true;
      if (from.skin >= 0 && static_cast<std::size_t>(from.skin) >= scene_->rig.skins.size()) {
        malformed(numbered("node", node) + ": there is no skin " + std::to_string(from.skin));
      }
      if (from.skin < 0) continue;
      const auto& joints = scene_->rig.skins[static_cast<std::size_t>(from.skin)].joints;
      if (std::ranges::any_of(joints, [&](std::uint32_t joint) { return !displayed[joint]; })) ++absent_joints_;
    }
  }

  /// Reads the instance transforms (EXT_mesh_gpu_instancing) of displayed nodes.
  void instances() {
    const Accessors accessors(file_, budget_);
    for (const std::uint32_t node : scene_->rig.displayed) {
      const tinygltf::Node& from = file_.model.nodes[node];
      const auto extension = from.extensions.find("EXT_mesh_gpu_instancing");
      if (extension == from.extensions.end() || !extension->second.Has("attributes")) continue;
      if (from.mesh < 0 || scene_->rig.hidden[node]) continue;
      if (from.skin >= 0) {
        ++skinned_instances_;
        continue;
      }
      const tinygltf::Value& attributes = extension->second.Get("attributes");
      const auto without_elements = [&](const std::string& name) {
        return file_.without_elements(attributes.Get(name).GetNumberAsInt());
      };
      if (std::ranges::any_of(attributes.Keys(), without_elements)) {
        scene_->rig.hidden[node] = true;
        ++without_instances_;
        continue;
      }
      if (!attributes.Keys().empty()) instance_transforms_[node] = instance_transforms(accessors, node, attributes);
    }
  }

  /// Returns one matrix per instance.
  std::vector<glm::dmat4> instance_transforms(const Accessors& accessors, std::uint32_t node,
                                              const tinygltf::Value& attributes) {
    const std::string what = numbered("node", node) + ", instances' ";
    std::optional<std::size_t> count;
    for (const std::string& name : attributes.Keys()) {
      const std::size_t here = accessors.count(attributes.Get(name).GetNumberAsInt(), what + one_line(name));
      if (count && *count != here) {
        malformed(what + one_line(name) + " has " + std::to_string(here) + " elements, another attribute " +
                  std::to_string(*count));
      }
      count = here;
      if (name != "TRANSLATION" && name != "ROTATION" && name != "SCALE") own_attributes_.insert(one_line(name));
    }
    // Copies: here, in a pose, and in the tables and trees for rendering.
    budget_.take(*count, 4 * sizeof(glm::dmat4), what + "transforms");
    const auto read = [&]<int N>(const char* name, const glm::vec<N, float>& otherwise) {
      if (!attributes.Has(name)) return std::vector<glm::vec<N, float>>(*count, otherwise);
      const int accessor = attributes.Get(name).GetNumberAsInt();
      // vectors() would accept a VEC3 for a VEC4.
      if (accessors.type(accessor, what + name) != N) malformed(what + name + " has the wrong type of element");
      auto values = accessors.vectors<N>(accessor, what + name);
      for (const glm::vec<N, float>& value : values) {
        for (int c = 0; c < N; ++c) {
          if (!(std::abs(value[c]) < 1e18F)) malformed(what + name + " is not finite, or too large");
        }
      }
      return values;
    };
    const auto translations = read("TRANSLATION", glm::vec3(0.0F));
    const auto rotations = read("ROTATION", glm::vec4(0.0F, 0.0F, 0.0F, 1.0F));
    const auto scales = read("SCALE", glm::vec3(1.0F));
    std::vector<glm::dmat4> to(*count);
    for (std::size_t i = 0; i < to.size(); ++i) {
      budget_.check(i);
      const glm::dvec4 r(rotations[i]);
      const double length = glm::length(r);
      const glm::dquat rotation =
          length > 0.0 ? glm::dquat(r.w, r.x, r.y, r.z) / length : glm::dquat(1.0, 0.0, 0.0, 0.0);
      to[i] = glm::mat4_cast(rotation);
      for (int c = 0; c < 3; ++c) to[i][c] *= double{scales[i][c]};
      to[i][3] = glm::dvec4(glm::dvec3(translations[i]), 1.0);
    }
    return to;
  }

  void variants() {
    const auto extension = file_.model.extensions.find("KHR_materials_variants");
    if (extension == file_.model.extensions.end() || !extension->second.Has("variants")) return;
    const tinygltf::Value& from = extension->second.Get("variants");
    for (std::size_t v = 0; v < from.ArrayLen(); ++v) {
      const tinygltf::Value& variant = from.Get(static_cast<int>(v));
      scene_->variants.push_back({variant.Has("name") ? one_line(variant.Get("name").Get<std::string>()) : "", {}});
    }
  }

  void meshes() {
    parts_of_.resize(used_.size());
    for (std::size_t m = 0; m < used_.size(); ++m) {
      if (!used_[m]) continue;
      check(progress_);
      if (progress_ != nullptr) progress_->at(0.5 + 0.5 * static_cast<double>(m) / static_cast<double>(used_.size()));
      for (MeshPart& part : import_mesh(file_, m, scene_->materials, scene_->variants.size(), budget_, remarks_)) {
        parts_of_[m].push_back(scene_->parts.size());
        scene_->parts.push_back(std::move(part));
      }
    }
  }

  /// Adds a draw for every part under every node.
  void add_draws() {
    std::uint64_t vertices = 0;
    std::uint64_t indices = 0;
    std::uint64_t draws = 0;
    const auto count = [&](std::uint32_t, const MeshPart& part, std::size_t) {
      ++draws;
      vertices += part.positions.size();
      indices += part.indices.size();
    };
    for_each_part(count);
    budget_.take(vertices, sizeof(VertexAttributes) + sizeof(PosedVertex), "all vertices");
    budget_.take(indices, sizeof(std::uint32_t), "all indices");
    // If all parts are single triangles, there are as many draws as triangles.
    budget_.take(draws, sizeof(Instance) + sizeof(Draw), "all instances");
    scene_->instances.reserve(draws);
    scene_->draws.reserve(draws);
    scene_->attributes.reserve(vertices);
    scene_->indices.reserve(indices);
    // Prototypes come last, each of one node.
    for_each_part([&](std::uint32_t node, const MeshPart& part, std::size_t part_index) {
      if (!instance_transforms_.contains(node)) add_part(node, part, part_index);
    });
    for (auto& [node, in_node] : instance_transforms_) {
      const auto first = static_cast<std::uint32_t>(scene_->draws.size());
      for (const std::size_t part_index : parts_of_[static_cast<std::size_t>(file_.model.nodes[node].mesh)]) {
        add_part(node, scene_->parts[part_index], part_index);
        scene_->instances.back().in_prototype = true;
      }
      const auto parts = static_cast<std::uint32_t>(scene_->draws.size()) - first;
      if (parts == 0) continue;
      scene_->prototypes.push_back({first, parts, static_cast<std::uint32_t>(in_node.size())});
      scene_->prototype_instances.push_back({node, std::move(in_node)});
    }
  }

  void add_part(std::uint32_t node, const MeshPart& part, std::size_t part_index) {
    check(progress_);
    int skin = file_.model.nodes[node].skin;
    if (skin >= 0 && part.influences == 0) {
      ++remarks_.unbound;
      skin = -1;
    }
    if (skin >= 0) {
      const std::size_t joints = scene_->rig.skins[static_cast<std::size_t>(skin)].joints.size();
      if (part.joint_count > joints) {
        malformed(numbered("node", node) + ": a vertex is bound to joint " + std::to_string(part.joint_count - 1) +
                  " of " + std::to_string(joints) + " in " + numbered("skin", static_cast<std::size_t>(skin)));
      }
    }
    scene_->add_instance(part_index, node, skin, progress_);
    budget_.take(part.variants.size(), sizeof(std::uint32_t), "all variants");
    for (std::size_t v = 0; v < part.variants.size(); ++v) {
      scene_->variants[v].materials.push_back(part.variants[v]);
    }
  }

  template <class Visit>
  void for_each_part(const Visit& visit) const {
    for (const std::uint32_t node : scene_->rig.displayed) {
      const int mesh = file_.model.nodes[node].mesh;
      if (mesh < 0 || scene_->rig.hidden[node]) continue;
      for (const std::size_t part_index : parts_of_[static_cast<std::size_t>(mesh)]) {
        visit(node, scene_->parts[part_index], part_index);
      }
    }
  }

  void lights_and_cameras() {
    const tinygltf::Model& model = file_.model;
    for (const std::uint32_t node : scene_->rig.displayed) {
      const tinygltf::Node& from = model.nodes[node];
      if (from.camera >= 0) {
        const auto camera = static_cast<std::size_t>(from.camera);
        if (camera >= model.cameras.size()) {
          malformed(numbered("node", node) + ": there is no camera " + std::to_string(camera));
        }
        SceneCamera to = import_camera(model.cameras[camera], numbered("camera", camera));
        if (to.name.empty()) to.name = one_line(from.name);
        scene_->cameras.emplace_back(node, std::move(to));
      }
      const auto extension = from.extensions.find("KHR_lights_punctual");
      if (extension == from.extensions.end() || !extension->second.Has("light") || scene_->rig.hidden[node]) continue;
      const auto light = static_cast<std::size_t>(extension->second.Get("light").GetNumberAsInt());
      if (light >= model.lights.size()) {
        malformed(numbered("node", node) + ": there is no light " + std::to_string(light));
      }
      scene_->lights.push_back(
          {node, static_cast<std::uint32_t>(light), import_light(model.lights[light], numbered("light", light))});
    }
  }

  /// Logs closed shapes whose triangles face inward.
  void look_at_winding() {
    std::string some;
    std::size_t count = 0;
    for (std::size_t m = 0; m < parts_of_.size(); ++m) {
      std::vector<glm::vec3> positions;
      std::vector<std::uint32_t> indices;
      for (const std::size_t part_index : parts_of_[m]) {
        const MeshPart& part = scene_->parts[part_index];
        if (scene_->materials[part.material].double_sided) continue;
        budget_.take(part.indices.size(), 120, "the tables of a mesh");
        const auto first = static_cast<std::uint32_t>(positions.size());
        positions.insert(positions.end(), part.positions.begin(), part.positions.end());
        for (const std::uint32_t index : part.indices) indices.push_back(first + index);
      }
      const Progress* const progress = budget_.progress_for(sizeof(std::uint32_t) * indices.size());
      const Winding winding = run_cancellable(
          progress,
          [positions = std::move(positions), indices = std::move(indices)] { return winding_of(positions, indices); });
      if (!(winding.inward > max_inward * winding.area)) continue;
      if (++count > 3) continue;
      const std::string called = one_line(file_.model.meshes[m].name);
      some += (some.empty() ? "" : ", ") + numbered("mesh", m) + (called.empty() ? "" : " (" + called + ")");
    }
    if (count == 0) return;
    if (count > 3) some += " and " + std::to_string(count - 3) + " more";
    log_.warning(
        name_ + ": triangles of " + some +
        " appear to be wound inside out and are invisible from outside; use double_sided of the surface settings");
  }

  /// Checks the float precision of mesh positions, of instance transforms, and of animated translations.
  void look_at_precision() {
    PrecisionRemark remark;
    double largest = 0.0;
    for (const MeshPart& part : scene_->parts)
      largest = std::max(largest, glm::distance(glm::dvec3(part.low), glm::dvec3(part.high)));
    for (const PrototypeInstances& of : scene_->prototype_instances) {
      double farthest = 0.0;
      for (const glm::dmat4& in_node : of.in_node) farthest = std::max(farthest, farthest_coordinate(in_node[3]));
      remark.add(numbered("node", of.node) + "'s instances", farthest, largest);
    }
    for (std::size_t i = 0; i < scene_->rig.tracks.size(); ++i) {
      double farthest = 0.0;
      for (const Channel& channel : scene_->rig.tracks[i].channels) {
        if (channel.property != Property::translation) continue;
        for (const float value : channel.values) farthest = std::max(farthest, double{std::abs(value)});
      }
      remark.add(numbered("animation", i), farthest, largest);
    }
    for (std::size_t m = 0; m < parts_of_.size(); ++m) {
      const std::string called = one_line(file_.model.meshes[m].name);
      const std::string what = numbered("mesh", m) + (called.empty() ? "" : " (" + called + ")");
      for (const std::size_t part_index : parts_of_[m])
        remark.add(what, scene_->parts[part_index].low, scene_->parts[part_index].high);
    }
    scene_->precision_remark = remark.text(name_);
  }

  static double farthest_coordinate(const glm::dvec4& p) {
    return std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)});
  }

  void count() {
    const tinygltf::Model& model = file_.model;
    std::size_t primitives = 0;
    for (const tinygltf::Mesh& mesh : model.meshes) primitives += mesh.primitives.size();
    scene_->counts = {static_cast<std::uint32_t>(model.meshes.size()), static_cast<std::uint32_t>(primitives),
                      static_cast<std::uint32_t>(model.materials.size()),
                      static_cast<std::uint32_t>(model.textures.size())};
  }

  void remark() const {
    if (remarks_.not_triangles > 0) {
      log_.info(name_ + ": " + std::to_string(remarks_.not_triangles) +
                " primitives with points or lines, or without positions, are ignored");
    }
    if (remarks_.incomplete > 0) {
      log_.warning(name_ + ": " + std::to_string(remarks_.incomplete) + " primitives have an incomplete last triangle");
    }
    if (remarks_.not_finite > 0) {
      log_.warning(name_ + ": " + std::to_string(remarks_.not_finite) +
                   " primitives have non-finite numbers, which are read as 0");
    }
    if (remarks_.without_data > 0) {
      log_.warning(name_ + ": " + std::to_string(remarks_.without_data) +
                   " primitives are ignored: their buffer has no data");
    }
    if (remarks_.without_elements > 0) {
      log_.warning(name_ + ": " + std::to_string(remarks_.without_elements) +
                   " primitives are ignored: an accessor has a count of 0");
    }
    if (remarks_.unbound > 0) {
      log_.warning(name_ + ": " + std::to_string(remarks_.unbound) +
                   " primitives have a skin but no joints, and are not animated");
    }
    if (absent_joints_ > 0) {
      log_.warning(name_ + ": " + std::to_string(absent_joints_) +
                   " nodes have a skin with joints that are in no scene");
    }
    if (skinned_instances_ > 0) {
      log_.warning(name_ + ": " + std::to_string(skinned_instances_) +
                   " nodes have instances and a skin; only one instance is rendered");
    }
    if (without_instances_ > 0) {
      log_.warning(name_ + ": " + std::to_string(without_instances_) +
                   " nodes are ignored: an accessor of their instances has a count of 0");
    }
    if (!own_attributes_.empty()) {
      std::string list;
      for (const std::string& attribute : own_attributes_) list += (list.empty() ? "" : ", ") + attribute;
      log_.warning(name_ + ": instances are rendered without " + one_line(list));
    }
    if (scene_->indices.empty()) log_.warning(name_ + ": has no triangles");
  }

  const GltfFile& file_;
  const Log& log_;
  const std::string& name_;
  Budget& budget_;
  Progress* progress_;
  std::shared_ptr<PosableScene> scene_ = make_deferred_delete<PosableScene>();
  std::vector<bool> used_;
  std::vector<std::vector<std::size_t>> parts_of_;
  MeshRemarks remarks_;
  std::size_t absent_joints_ = 0;
  std::map<std::uint32_t, std::vector<glm::dmat4>> instance_transforms_;  ///< by node, from EXT_mesh_gpu_instancing
  std::size_t skinned_instances_ = 0;
  std::size_t without_instances_ = 0;
  std::set<std::string> own_attributes_;  ///< instance attributes other than transforms
};

}  // namespace

}  // namespace detail

ScenePtr import_gltf(std::vector<std::uint8_t> bytes, const std::string& label,
                     const std::optional<std::filesystem::path>& folder, const Log& log, Progress* progress,
                     const GltfLimits& limits) {
  const std::string name = cumulet::one_line(label, 4096);  // the length limit of paths
  try {
    detail::Budget budget(limits, progress);
    const detail::GltfFile file = detail::parse_gltf(std::move(bytes), folder, log, name, budget, progress);
    return detail::Assembler(file, log, name, budget, progress).assemble();
  } catch (const Error& error) {
    if (error.code() != ErrorCode::file && error.code() != ErrorCode::unsupported) throw;
    throw Error(error.code(), name + ": " + error.what());
  } catch (const std::bad_alloc&) {
    throw Error(ErrorCode::out_of_memory, name + ": not enough memory");
  } catch (const std::exception& error) {
    throw Error(ErrorCode::file, name + ": " + detail::one_line(error.what()));
  }
}

ScenePtr import_gltf(const FilePath& path, const Log& log, Progress* progress) {
  const std::filesystem::path file = path.absolute();
  std::vector<std::uint8_t> bytes;
  try {
    GltfLimits limits;
    detail::Budget budget(limits, progress);
    bytes = detail::read_file(file, budget);
  } catch (const Error& error) {
    throw Error(error.code(), path.given() + ": " + error.what());
  } catch (const std::bad_alloc&) {
    throw Error(ErrorCode::out_of_memory, path.given() + ": not enough memory");
  }
  return import_gltf(std::move(bytes), path.given(), file.parent_path(), log, progress);
}

}  // namespace cumulet::surface
