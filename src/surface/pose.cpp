#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <limits>
#include <span>
#include <utility>

#include "base/corners.hpp"
#include "base/origin.hpp"
#include "base/progress_part.hpp"
#include "surface/posable_scene.hpp"

namespace cumulet::surface::detail {

namespace {

constexpr std::size_t max_bounded = std::size_t{1} << 22U;  // instanced vertices for which bounds are computed exactly

/// The inverse transpose scaled by the determinant: det(M) * M^-T, which is finite for every M.
glm::mat3 cofactors(const glm::mat3& m) {
  return {glm::cross(m[1], m[2]), glm::cross(m[2], m[0]), glm::cross(m[0], m[1])};
}

bool finite(const glm::dmat4& m) {
  for (int n = 0; n < 16; ++n) {
    if (!std::isfinite(m[n / 4][n % 4])) return false;
  }
  return true;
}

bool mirrors(const glm::dmat4& m) { return glm::determinant(glm::dmat3(m)) < 0.0; }

/// Normalizes; returns `otherwise` if the vector has no direction.
glm::vec3 direction(const glm::vec3& v, const glm::vec3& otherwise) {
  if (!detail::finite(v) || v == glm::vec3(0.0F)) return otherwise;
  const float largest = std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
  return glm::normalize(v / largest);
}

/// A vertex before its node or skin moves it.
struct Shape {
  glm::vec3 position;
  glm::vec3 normal;
  glm::vec4 tangent;
};

Shape morph(const MeshPart& part, const std::vector<float>& weights, float drift, std::size_t v) {
  Shape shape{part.positions[v], part.flat ? glm::vec3(0, 1, 0) : part.normals[v],
              part.tangents.empty() ? glm::vec4(0.0F) : part.tangents[v]};
  for (std::size_t t = 0; t < std::min(part.targets.size(), weights.size()); ++t) {
    const float weight = weights[t];
    if (weight == 0.0F) continue;
    const MorphTarget& target = part.targets[t];
    if (!target.positions.empty()) shape.position += weight * target.positions[v];
    if (!target.normals.empty()) shape.normal += weight * target.normals[v];
    if (!target.tangents.empty()) shape.tangent += glm::vec4(weight * target.tangents[v], 0.0F);
  }
  if (!part.velocities.empty()) shape.position += drift * part.velocities[v];
  return shape;
}

// Wraps a time into an animation.
double looped(double time, double duration) {
  if (!std::isfinite(time)) return 0.0;
  if (time >= 0.0 && time <= duration) return time;
  const double within = duration > 0.0 ? std::fmod(time, duration) : 0.0;
  return within < 0.0 ? within + duration : within;
}

// World bounds of all points that are added.
class Box {
 public:
  void add(const glm::dvec3& p) {
    if (!(std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) < std::numeric_limits<double>::max())) return;
    low_ = glm::min(low_, p);
    high_ = glm::max(high_, p);
  }
  void add(const MeshPart& part, const glm::dmat4& to_world) {
    if (part.positions.empty()) return;
    for (const glm::dvec3& corner : corners_of(part.low, part.high))
      add(glm::dvec3(to_world * glm::dvec4(corner, 1.0)));
  }
  [[nodiscard]] bool is_empty() const { return !(low_.x <= high_.x); }
  /// Returns an origin near the middle, for float precision; 0 if empty. size: minimum size of the contents.
  [[nodiscard]] glm::dvec3 origin(double size = 0.0) const {
    if (is_empty()) return glm::dvec3(0.0);
    size = std::max(size, glm::distance(low_, high_));
    return size > 0.0 ? far_origin(low_, high_, size) : glm::dvec3(0.0);
  }

 private:
  glm::dvec3 low_{std::numeric_limits<double>::infinity()};
  glm::dvec3 high_{-std::numeric_limits<double>::infinity()};
};

// Returns true if both poses show the scene in the same position, within visible precision. Both must have the same
// origin.
bool alike(const Pose& a, const Pose& b) {
  const auto most = static_cast<float>(1e-4 * glm::length(a.high - a.low));
  for (std::size_t i = 0; i < a.vertices.size(); ++i) {
    if (!(glm::distance(a.vertices[i].position, b.vertices[i].position) <= most)) return false;
  }
  for (std::size_t p = 0; p < a.prototype_transforms.size(); ++p) {
    if (a.prototype_transforms[p].size() != b.prototype_transforms[p].size()) return false;
    for (std::size_t i = 0; i < a.prototype_transforms[p].size(); ++i) {
      for (int c = 0; c < 4; ++c) {
        const double bound = c == 3 ? double{most} : 1e-4 * glm::length(a.prototype_transforms[p][i][c]);
        if (!(glm::distance(a.prototype_transforms[p][i][c], b.prototype_transforms[p][i][c]) <= bound)) return false;
      }
    }
  }
  return true;
}

}  // namespace

void PosableScene::add_instance(std::size_t part, std::uint32_t node, std::int32_t skin, const Progress* progress) {
  const MeshPart& from = parts[part];
  constexpr std::uint64_t most = std::numeric_limits<std::uint32_t>::max();
  if (attributes.size() + from.positions.size() > most || indices.size() + from.indices.size() > most) {
    malformed("has more than 2^32 vertices or indices");
  }
  const auto first_vertex = static_cast<std::uint32_t>(attributes.size());
  instances.push_back({part, node, first_vertex, skin});
  draws.push_back({static_cast<std::uint32_t>(indices.size()), static_cast<std::uint32_t>(from.indices.size()),
                   from.material, node});
  constexpr std::size_t piece = 65536;
  for (std::size_t i = 0; i < from.attributes.size(); ++i) {
    if (i % piece == 0) check(progress);
    attributes.push_back(from.attributes[i]);
  }
  for (std::size_t i = 0; i < from.indices.size(); ++i) {
    if (i % piece == 0) check(progress);
    indices.push_back(first_vertex + from.indices[i]);
  }
}

void PosableScene::finish() {
  // The scene has the vertex attributes now; the parts keep the moving data.
  for (MeshPart& part : parts) part.attributes = {};
  // The product of transforms may be too large even if each factor is valid.
  const Stance rest = stance(rig, nullptr, 0.0);
  for (std::size_t i = 0; i < rest.to_world.size(); ++i) {
    for (int n = 0; n < 16; ++n) {
      if (!(std::abs(rest.to_world[i][n / 4][n % 4]) < 1e18)) {
        malformed(numbered("node", i) + ": its transform is too large");
      }
    }
  }
  for (MeshPart& part : parts) {
    for (const glm::vec3& p : part.positions) {
      if (!(std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) < 1e18F)) malformed("a position is too large");
    }
    if (part.positions.empty()) continue;
    part.low = part.high = part.positions.front();
    for (const glm::vec3& p : part.positions) {
      part.low = glm::min(part.low, p);
      part.high = glm::max(part.high, p);
    }
  }
  find_origins_of_prototypes();
}

void PosableScene::find_origins_of_prototypes() {
  for (std::size_t p = 0; p < prototype_instances.size(); ++p) {
    Box box;
    const std::size_t first = prototypes[p].first_draw;
    const std::size_t last = first + prototypes[p].draw_count;
    for (std::size_t i = first; i < last; ++i) box.add(parts[instances[i].part], glm::dmat4(1.0));
    prototype_instances[p].origin = box.origin();
    for (std::size_t i = first; i < last; ++i) instances[i].origin = prototype_instances[p].origin;
  }
}

glm::dvec3 PosableScene::origin_of(const Stance& now) const {
  Box box;
  for (const Instance& instance : instances) {
    if (instance.in_prototype || !now.visible[instance.node]) continue;
    const MeshPart& part = parts[instance.part];
    if (instance.skin < 0) {
      box.add(part, now.to_world[instance.node]);
      continue;
    }
    const Skin& skin = rig.skins[static_cast<std::size_t>(instance.skin)];
    for (std::size_t j = 0; j < skin.joints.size(); ++j)
      box.add(part, now.to_world[skin.joints[j]] * glm::dmat4(skin.inverse_bind[j]));
  }
  if (!box.is_empty()) return box.origin();
  // Then only lights and bounds are relative to the origin.
  for (const LightInstance& light : lights) box.add(glm::dvec3(now.to_world[light.node][3]));
  for (const PrototypeInstances& of : prototype_instances) {
    for (const glm::dmat4& in_node : of.in_node) box.add(glm::dvec3((now.to_world[of.node] * in_node)[3]));
  }
  return box.origin(1.0);
}

template <class Matrix>
void PosableScene::pose_vertices(const Instance& instance, const Stance& now, double drift, float side, Pose& pose,
                                 const Progress* progress) const {
  using Number = typename Matrix::value_type;
  const MeshPart& part = parts[instance.part];
  const std::vector<float>& weights = now.weights[instance.node];
  std::vector<Matrix> joints;
  if (instance.skin >= 0) {
    const Skin& skin = rig.skins[static_cast<std::size_t>(instance.skin)];
    for (std::size_t j = 0; j < skin.joints.size(); ++j)
      joints.emplace_back(counted_from(now.to_world[skin.joints[j]] * glm::dmat4(skin.inverse_bind[j]), pose.origin));
  }
  const Matrix rigid(instance.in_prototype ? counted_from(glm::dmat4(1.0), instance.origin)
                                           : counted_from(now.to_world[instance.node], pose.origin));
  const glm::mat3 rigid_normals = cofactors(glm::mat3(rigid));
  PosedVertex* const vertices = &pose.vertices[instance.first_vertex];
  const auto at = [&](std::size_t v) {
    const Shape shape = morph(part, weights, static_cast<float>(drift), v);
    Matrix matrix = rigid;
    glm::mat3 for_normals = rigid_normals;
    if (instance.skin >= 0) {
      matrix = Matrix(0);
      for (std::size_t i = v * part.influences; i < (v + 1) * part.influences; ++i) {
        if (part.weights[i] != 0.0F) matrix += Number{part.weights[i]} * joints[part.joints[i]];
      }
      for_normals = cofactors(glm::mat3(matrix));
    }
    PosedVertex& to = vertices[v];
    to.position = glm::vec3(matrix * glm::vec<4, Number>(shape.position, 1));
    if (!detail::finite(to.position)) to.position = glm::vec3(0.0F);
    const glm::vec3 upright = direction(shape.normal, glm::vec3(0, 1, 0));
    to.normal = direction(side * (for_normals * upright), upright);
    if (part.tangents.empty()) return;
    to.tangent = glm::vec4(glm::mat3(matrix) * glm::vec3(shape.tangent), side * shape.tangent.w);
  };
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, part.positions.size(), 4096), [&](const auto& range) {
    check(progress);
    for (std::size_t v = range.begin(); v != range.end(); ++v) at(v);
  });
}

bool PosableScene::pose_instance(const Instance& instance, const Stance& now, double drift, Pose& pose,
                                 const Progress* progress) const {
  const MeshPart& part = parts[instance.part];
  bool flipped = false;
  if (instance.skin >= 0) {
    const Skin& skin = rig.skins[static_cast<std::size_t>(instance.skin)];
    std::size_t mirrored = 0;
    for (std::size_t j = 0; j < skin.joints.size(); ++j) {
      if (mirrors(now.to_world[skin.joints[j]] * glm::dmat4(skin.inverse_bind[j]))) ++mirrored;
    }
    flipped = 2 * mirrored > skin.joints.size();
  } else {
    flipped = mirrors(instance.in_prototype ? glm::dmat4(1.0) : now.to_world[instance.node]);
  }
  const float side = flipped ? -1.0F : 1.0F;
  const glm::dvec3& origin = instance.in_prototype ? instance.origin : pose.origin;
  if (origin == glm::dvec3(0.0)) {
    pose_vertices<glm::mat4>(instance, now, drift, side, pose, progress);
  } else {
    pose_vertices<glm::dmat4>(instance, now, drift, side, pose, progress);
  }

  PosedVertex* const vertices = &pose.vertices[instance.first_vertex];
  check(progress);
  if (part.flat) {
    for (std::size_t i = 0; i + 3 <= part.indices.size(); i += 3) {
      const std::uint32_t* v = &part.indices[i];
      const glm::vec3 area = glm::cross(vertices[v[1]].position - vertices[v[0]].position,
                                        vertices[v[2]].position - vertices[v[0]].position);
      const glm::vec3 normal = direction(side * area, vertices[v[0]].normal);
      for (int k = 0; k < 3; ++k) vertices[v[k]].normal = normal;
    }
  }
  check(progress);
  if (!part.tangents.empty()) {
    for (std::size_t v = 0; v < part.positions.size(); ++v) {
      const glm::vec3 normal = vertices[v].normal;
      const glm::vec3 tangent = direction(glm::vec3(vertices[v].tangent), glm::vec3(0.0F));
      vertices[v].tangent =
          glm::vec4(direction(tangent - normal * glm::dot(normal, tangent), any_perpendicular(normal)),
                    vertices[v].tangent.w < 0.0F ? -1.0F : 1.0F);
    }
  }
  return flipped;
}

void PosableScene::move(const Track& track, double time, Pose& pose, std::vector<LightInstance>& lights_now) const {
  std::vector<MovableMaterial> moved = movable;
  std::vector<float> values;
  for (const Channel& channel : track.channels) {
    if (channel.property != Property::material && channel.property != Property::light) continue;
    values.resize(channel.width);
    sample(channel, time, values);
    if (channel.property == Property::material) {
      channel.of_material.set(moved[channel.target], values);
      continue;
    }
    for (LightInstance& light : lights_now) {
      if (light.light == channel.target) channel.of_light.set(light.at_rest, values);
    }
  }
  for (const MovableMaterial& material : moved) pose.materials.push_back(material.now);
}

std::vector<std::vector<glm::dmat4>> PosableScene::find_prototype_transforms(const Stance& now) const {
  std::vector<std::vector<glm::dmat4>> all;
  for (const PrototypeInstances& of : prototype_instances) {
    std::vector<glm::dmat4>& transforms = all.emplace_back();
    if (!now.visible[of.node]) continue;
    for (const glm::dmat4& in_node : of.in_node) {
      const glm::dmat4 to_world = glm::translate(now.to_world[of.node] * in_node, of.origin);
      const double volume = glm::determinant(glm::dmat3(to_world));
      if (finite(to_world) && std::isnormal(volume)) transforms.push_back(to_world);
    }
  }
  return all;
}

void PosableScene::bound(Pose& pose) const {
  glm::vec3 low(std::numeric_limits<float>::max());
  glm::vec3 high(std::numeric_limits<float>::lowest());
  bool any = false;
  const auto add = [&](const glm::vec3& p) {
    low = glm::min(low, p);
    high = glm::max(high, p);
    any = true;
  };
  for (std::size_t i = 0; i < instances.size(); ++i) {
    if (is_hidden(pose, i)) continue;
    const std::size_t count = parts[instances[i].part].positions.size();
    const std::span<const PosedVertex> vertices(&pose.vertices[instances[i].first_vertex], count);
    if (!instances[i].in_prototype) {
      for (const PosedVertex& vertex : vertices) add(vertex.position);
      continue;
    }
    // For many instances the corners of a box are used, for few each vertex.
    const auto prototype = std::ranges::upper_bound(prototypes, i, {}, &Prototype::first_draw) - prototypes.begin() - 1;
    const std::vector<glm::dmat4>& transforms = pose.prototype_transforms[static_cast<std::size_t>(prototype)];
    std::vector<glm::vec3> points;
    if (transforms.size() * count <= max_bounded) {
      for (const PosedVertex& vertex : vertices) points.push_back(vertex.position);
    } else {
      glm::vec3 own_low(std::numeric_limits<float>::max());
      glm::vec3 own_high(std::numeric_limits<float>::lowest());
      for (const PosedVertex& vertex : vertices) {
        own_low = glm::min(own_low, vertex.position);
        own_high = glm::max(own_high, vertex.position);
      }
      for (const glm::dvec3& corner : corners_of(own_low, own_high)) points.emplace_back(corner);
    }
    for (const glm::dmat4& to_world : transforms) {
      const glm::dmat4 from_origin = counted_from(to_world, pose.origin);
      for (const glm::vec3& p : points) add(glm::vec3(from_origin * glm::dvec4(p, 1.0)));
    }
  }
  if (!any) return;
  pose.low = pose.origin + glm::dvec3(low);
  pose.high = pose.origin + glm::dvec3(high);
}

Pose PosableScene::pose(double time, std::size_t animation, const Progress* progress) const {
  return pose(time, animation, 0.0, std::nullopt, progress);
}

std::pair<double, const Track*> PosableScene::moment(double time, std::size_t animation) const {
  if (animation >= rig.tracks.size()) return {time, nullptr};
  const Track& track = rig.tracks[animation];
  return {looped(time, track.duration), &track};
}

Pose PosableScene::pose(double time, std::size_t animation, double drift, const std::optional<glm::dvec3>& origin,
                        const Progress* progress) const {
  const auto [at, track] = moment(time, animation);
  const Stance now = stance(rig, track, at);
  Pose result;
  result.time = at;
  result.origin = origin.value_or(origin_of(now));
  resize(result.vertices, attributes.size(), progress);
  for (const Instance& instance : instances) {
    check(progress);
    result.flipped.push_back(pose_instance(instance, now, drift, result, progress) ? 1 : 0);
    result.hidden.push_back(now.visible[instance.node] ? 0 : 1);
  }
  check(progress);
  result.prototype_transforms = find_prototype_transforms(now);
  bound(result);
  std::vector<LightInstance> lights_now = lights;
  if (track != nullptr) move(*track, at, result, lights_now);
  for (const LightInstance& light : lights_now) {
    if (!now.visible[light.node]) continue;
    const glm::dmat4& to_world = now.to_world[light.node];
    result.lights.push_back(light.at_rest.now);
    result.lights.back().inner_cone = std::min(result.lights.back().inner_cone, result.lights.back().outer_cone);
    result.lights.back().position = glm::vec3(glm::dvec3(to_world[3]) - result.origin);
    if (!detail::finite(result.lights.back().position)) result.lights.back().position = glm::vec3(0.0F);
    result.lights.back().direction = direction(-glm::vec3(to_world[2]), glm::vec3(0, 0, -1));
  }
  for (const auto& [node, camera] : cameras) {
    result.cameras.push_back(camera);
    if (finite(now.to_world[node])) result.cameras.back().to_world = now.to_world[node];
  }
  return result;
}

bool PosableScene::may_move(std::size_t animation) const {
  return animation < rig.tracks.size() ||
         std::ranges::any_of(parts, [](const MeshPart& part) { return !part.velocities.empty(); });
}

std::optional<PoseEnds> PosableScene::pose_ends(double time, std::size_t animation, double seconds,
                                                const Progress* progress) const {
  if (!may_move(animation)) return std::nullopt;
  const double half = 0.5 * seconds;
  double open = time - half;
  double close = time + half;
  const auto [at, track] = moment(time, animation);
  const glm::dvec3 origin = origin_of(stance(rig, track, at));
  if (animation < rig.tracks.size()) {
    const double duration = rig.tracks[animation].duration;
    open = at - half;
    close = at + half;
    const bool leaves = open < 0.0 || close > duration;
    if (leaves && !(seconds < duration && alike(pose(0.0, animation, 0.0, origin, progress),
                                                pose(duration, animation, 0.0, origin, progress)))) {
      open = std::max(open, 0.0);
      close = std::min(close, duration);
    }
  }
  return PoseEnds{pose(open, animation, -half, origin, progress), pose(close, animation, half, origin, progress)};
}

}  // namespace cumulet::surface::detail
