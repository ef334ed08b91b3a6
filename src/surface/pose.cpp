#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "base/corners.hpp"
#include "base/progress_part.hpp"
#include "surface/posable_scene.hpp"

namespace cumulet::surface::detail {

namespace {

constexpr std::size_t most_bounded = std::size_t{1} << 22U;  // vertices of copies that are looked at one by one

/// Of the inverse transpose but for its length: det(M) * M^-T, which is finite for every M.
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

/// Unit; `otherwise` if it has no direction.
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

// A moment of an animation, which begins anew past its end.
double looped(double time, double duration) {
  if (!std::isfinite(time)) return 0.0;
  if (time >= 0.0 && time <= duration) return time;
  const double within = duration > 0.0 ? std::fmod(time, duration) : 0.0;
  return within < 0.0 ? within + duration : within;
}

// Whether all is in the same place, as far as a picture would show.
bool alike(const Pose& a, const Pose& b) {
  const auto most = static_cast<float>(1e-4 * glm::length(a.high - a.low));
  for (std::size_t i = 0; i < a.vertices.size(); ++i) {
    if (!(glm::distance(a.vertices[i].position, b.vertices[i].position) <= most)) return false;
  }
  for (std::size_t p = 0; p < a.placings.size(); ++p) {
    if (a.placings[p].size() != b.placings[p].size()) return false;
    for (std::size_t i = 0; i < a.placings[p].size(); ++i) {
      for (int c = 0; c < 4; ++c) {
        const double bound = c == 3 ? double{most} : 1e-4 * glm::length(a.placings[p][i][c]);
        if (!(glm::distance(a.placings[p][i][c], b.placings[p][i][c]) <= bound)) return false;
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
  // What the vertices hold now is the scene's; the parts keep what moves.
  for (MeshPart& part : parts) part.attributes = {};
  // Transforms may be of any size, each of them, and too large together.
  const Stance rest = stance(rig, nullptr, 0.0);
  for (std::size_t i = 0; i < rest.to_world.size(); ++i) {
    for (int n = 0; n < 16; ++n) {
      if (!(std::abs(rest.to_world[i][n / 4][n % 4]) < 1e18)) {
        malformed(numbered("node", i) + ": its transform is too large");
      }
    }
  }
  for (const MeshPart& part : parts) {
    for (const glm::vec3& p : part.positions) {
      if (!(std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) < 1e18F)) malformed("a position is too large");
    }
  }
}

bool PosableScene::place(const Instance& instance, const Stance& now, double drift, Pose& pose,
                         const Progress* progress) const {
  const MeshPart& part = parts[instance.part];
  const std::vector<float>& weights = now.weights[instance.node];
  const glm::dmat4 to_world = instance.in_prototype ? glm::dmat4(1.0) : now.to_world[instance.node];
  std::vector<glm::mat4> joints;
  bool flipped = false;
  if (instance.skin >= 0) {
    const Skin& skin = rig.skins[static_cast<std::size_t>(instance.skin)];
    std::size_t mirrored = 0;
    for (std::size_t j = 0; j < skin.joints.size(); ++j) {
      const glm::dmat4 matrix = now.to_world[skin.joints[j]] * glm::dmat4(skin.inverse_bind[j]);
      if (mirrors(matrix)) ++mirrored;
      joints.emplace_back(matrix);
    }
    flipped = 2 * mirrored > joints.size();
  } else {
    flipped = mirrors(to_world);
  }
  const float side = flipped ? -1.0F : 1.0F;
  const glm::mat4 rigid(to_world);
  const glm::mat3 rigid_normals = cofactors(glm::mat3(rigid));

  PosedVertex* const vertices = &pose.vertices[instance.first_vertex];
  const auto at = [&](std::size_t v) {
    const Shape shape = morph(part, weights, static_cast<float>(drift), v);
    glm::mat4 matrix = rigid;
    glm::mat3 for_normals = rigid_normals;
    if (instance.skin >= 0) {
      matrix = glm::mat4(0.0F);
      for (std::size_t i = v * part.influences; i < (v + 1) * part.influences; ++i) {
        if (part.weights[i] != 0.0F) matrix += part.weights[i] * joints[part.joints[i]];
      }
      for_normals = cofactors(glm::mat3(matrix));
    }
    PosedVertex& to = vertices[v];
    to.position = glm::vec3(matrix * glm::vec4(shape.position, 1.0F));
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

void PosableScene::move(const Track& track, double time, Pose& pose, std::vector<PlacedLight>& lights_now) const {
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
    for (PlacedLight& light : lights_now) {
      if (light.light == channel.target) channel.of_light.set(light.at_rest, values);
    }
  }
  for (const MovableMaterial& material : moved) pose.materials.push_back(material.now);
}

std::vector<std::vector<glm::dmat4>> PosableScene::place_prototypes(const Stance& now) const {
  std::vector<std::vector<glm::dmat4>> all;
  for (const Placings& of : placings) {
    std::vector<glm::dmat4>& placed = all.emplace_back();
    if (!now.visible[of.node]) continue;
    for (const glm::dmat4& in_node : of.in_node) {
      const glm::dmat4 to_world = now.to_world[of.node] * in_node;
      const double volume = glm::determinant(glm::dmat3(to_world));
      if (finite(to_world) && std::isnormal(volume)) placed.push_back(to_world);
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
    // Of many copies the corners of a box, of few each vertex.
    const auto prototype = std::ranges::upper_bound(prototypes, i, {}, &Prototype::first_draw) - prototypes.begin() - 1;
    const std::vector<glm::dmat4>& placed = pose.placings[static_cast<std::size_t>(prototype)];
    std::vector<glm::vec3> points;
    if (placed.size() * count <= most_bounded) {
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
    for (const glm::dmat4& to_world : placed) {
      for (const glm::vec3& p : points) add(glm::vec3(to_world * glm::dvec4(p, 1.0)));
    }
  }
  if (!any) return;
  pose.low = low;
  pose.high = high;
}

Pose PosableScene::pose(double time, std::size_t animation, const Progress* progress) const {
  return pose(time, animation, 0.0, progress);
}

Pose PosableScene::pose(double time, std::size_t animation, double drift, const Progress* progress) const {
  const Track* track = animation < rig.tracks.size() ? &rig.tracks[animation] : nullptr;
  if (track != nullptr) time = looped(time, track->duration);
  const Stance now = stance(rig, track, time);
  Pose result;
  result.time = time;
  resize(result.vertices, attributes.size(), progress);
  for (const Instance& instance : instances) {
    check(progress);
    result.flipped.push_back(place(instance, now, drift, result, progress) ? 1 : 0);
    result.hidden.push_back(now.visible[instance.node] ? 0 : 1);
  }
  check(progress);
  result.placings = place_prototypes(now);
  bound(result);
  std::vector<PlacedLight> lights_now = lights;
  if (track != nullptr) move(*track, time, result, lights_now);
  for (const PlacedLight& light : lights_now) {
    if (!now.visible[light.node]) continue;
    const glm::dmat4& to_world = now.to_world[light.node];
    result.lights.push_back(light.at_rest.now);
    result.lights.back().inner_cone = std::min(result.lights.back().inner_cone, result.lights.back().outer_cone);
    result.lights.back().position = glm::vec3(to_world[3]);
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
  if (animation < rig.tracks.size()) {
    const double duration = rig.tracks[animation].duration;
    const double moment = looped(time, duration);
    open = moment - half;
    close = moment + half;
    const bool leaves = open < 0.0 || close > duration;
    if (leaves && !(seconds < duration && alike(pose(0.0, animation, progress), pose(duration, animation, progress)))) {
      open = std::max(open, 0.0);
      close = std::min(close, duration);
    }
  }
  return PoseEnds{pose(open, animation, -half, progress), pose(close, animation, half, progress)};
}

}  // namespace cumulet::surface::detail
