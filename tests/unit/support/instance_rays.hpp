#pragma once

// Volume instances anywhere, rays at them, and the traversal of glsl/traversal/instance.glsl in C++.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <glm/gtc/matrix_transform.hpp>
#include <memory>
#include <random>
#include <span>
#include <stdexcept>
#include <utility>
#include <vector>

#include "scene/instances.hpp"

namespace cumulet::core {

/// glsl/traversal/instance.glsl over a table in memory.
struct InstanceRays {
  std::span<const CmInstance> cm_instances;
  std::span<const CmInstanceNode> cm_instance_nodes;
#include "traversal/instance.glsl"
};

}  // namespace cumulet::core

namespace cumulet::test::instances {

using core::CM_INSTANCE_NONE;
using core::CmInstance;
using core::CmInstanceNode;
using glm::dmat4;
using glm::dvec3;
using glm::vec3;
using scene::Instance;
using scene::InstanceTable;

inline const dvec3 origin(1.0e3, -2.0e3, 3.0e3);  // of the scene's frame

struct Ray {
  vec3 o;
  float t_end = 3e38F;
  vec3 d;
  std::uint32_t flags = 0;
};
struct Visit {
  float entry = 0.0F;
  std::uint32_t instance = 0;
  bool operator==(const Visit&) const = default;
};
using Visits = std::vector<Visit>;

class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  double operator()(double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine_); }
  dvec3 in_box(double low, double high) { return {(*this)(low, high), (*this)(low, high), (*this)(low, high)}; }
  dvec3 unit() {
    for (;;) {
      const dvec3 v = in_box(-1.0, 1.0);
      const double length = glm::length(v);
      if (length > 0.1 && length < 1.0) return v / length;
    }
  }
  int below(int n) { return std::uniform_int_distribution<int>(0, n - 1)(engine_); }

 private:
  std::mt19937 engine_;
};

inline Instance instance_of(const dmat4& transform, const vec3& low = vec3(0.0F), const vec3& high = vec3(16.0F)) {
  auto source = std::make_shared<scene::MarchSource>();
  source->cube.to_world = glm::scale(glm::translate(dmat4(1.0), origin), dvec3(0.5));
  Instance instance;
  instance.source = std::move(source);
  // The transform applies about the scene's origin, not the world's.
  instance.transform = glm::translate(dmat4(1.0), origin) * transform * glm::translate(dmat4(1.0), -origin);
  instance.grid.box_min = low;
  instance.grid.box_max = high;
  return instance;
}

inline dmat4 any_transform(Random& random, double wide) {
  dmat4 transform = glm::translate(dmat4(1.0), random.in_box(-wide, wide));
  transform = glm::rotate(transform, random(0.0, 6.0), random.unit());
  transform = glm::scale(transform, random.in_box(1.0, 5.0));
  transform[1] += random(-0.5, 0.5) * transform[0];  // sheared
  if (random.below(4) == 0) transform[2] = -transform[2];
  return transform;
}

// Random instances: rotated, sheared, mirrored, with boxes anywhere in their cubes.
inline std::vector<Instance> any_instances(std::size_t count, unsigned seed, double wide = 25.0) {
  Random random(seed);
  std::vector<Instance> instances;
  for (std::size_t i = 0; i < count; ++i) {
    const dvec3 low = random.in_box(0.0, 6.0);
    instances.push_back(instance_of(any_transform(random, wide), vec3(low), vec3(low + random.in_box(4.0, 10.0))));
    instances.back().hidden_from_camera = random.below(3) == 0;
    instances.back().medium.emits = random.below(2) == 0 ? 1U : 0U;
  }
  return instances;
}

// Axis-aligned cubes of 8 that fill one of 32 without gaps, at coordinates that are exact floats.
inline std::vector<Instance> tiles() {
  std::vector<Instance> instances;
  for (int i = 0; i < 64; ++i)
    instances.push_back(instance_of(glm::translate(dmat4(1.0), 8.0 * dvec3(i & 3, (i >> 2) & 3, i >> 4))));
  return instances;
}

inline std::vector<Instance> coincident() {
  Random random(5);
  std::vector<Instance> instances(50, instance_of(any_transform(random, 5.0)));
  for (const Instance& other : any_instances(10, 6, 10.0)) instances.push_back(other);
  return instances;
}

// Every second instance is empty: of no thickness along one axis, or inverted.
inline std::vector<Instance> flat() {
  std::vector<Instance> instances = any_instances(60, 7);
  for (std::size_t i = 0; i < instances.size(); i += 2) {
    core::CmGrid& grid = instances[i].grid;
    const int axis = static_cast<int>(i / 2 % 3);
    grid.box_max[axis] = grid.box_min[axis] - (i % 4 == 0 ? 1.0F : 0.0F);
  }
  return instances;
}

inline std::vector<Ray> any_rays(std::size_t count, unsigned seed, const InstanceTable& table) {
  Random random(seed);
  const CmInstanceNode& box = table.nodes[0];
  const auto point = [&](double grow) {
    const vec3 half = 0.5F * (box.high - box.low);
    return 0.5F * (box.low + box.high) + half * vec3(random.in_box(-grow, grow));
  };
  std::vector<Ray> rays(count);
  for (std::size_t i = 0; i < count; ++i) {
    Ray& ray = rays[i];
    ray.o = point(i % 4 == 0 ? 0.5 : 3.0);
    ray.d = glm::normalize(point(0.8) - ray.o);
    if (i % 5 == 0) ray.d[static_cast<int>(i / 5 % 3)] = i % 2 == 0 ? 0.0F : -0.0F;
    if (i % 35 == 0) {  // along an axis
      ray.d = vec3(0.0F);
      ray.d[random.below(3)] = random.below(2) == 0 ? 1.0F : -1.0F;
    }
    if (i % 7 == 0) ray.t_end = static_cast<float>(random(0.0, 100.0));
    if (i % 11 == 0) {  // from a corner of a box, or near it
      const core::CmSpace& space =
          table.records[static_cast<std::size_t>(random.below(int(table.records.size())))].space;
      const vec3 v(random.below(2) == 0 ? space.box_min.x : space.box_max.x,
                   random.below(2) == 0 ? space.box_min.y : space.box_max.y,
                   random.below(2) == 0 ? space.box_min.z : space.box_max.z);
      ray.o = space.from_cube_x * v.x + space.from_cube_y * v.y + space.from_cube_z * v.z + space.cube_origin;
    }
    if (i % 13 == 0) ray.flags = static_cast<std::uint32_t>(random.below(8));
  }
  return rays;
}

inline core::InstanceRays rays_of(const InstanceTable& table) { return {table.records, table.nodes}; }

inline Visits visits_of(core::InstanceRays& rays, const Ray& ray) {
  Visits visits;
  Visit at{-1.0F, CM_INSTANCE_NONE};
  while (rays.cm_next_instance(ray.o, ray.d, ray.t_end, ray.flags, at.entry, at.instance)) {
    visits.push_back(at);
    if (visits.size() > rays.cm_instances.size()) throw std::logic_error("one is visited twice");
  }
  return visits;
}

// Keeps the same instances as a flat list, without the tree.
inline InstanceTable flattened(const InstanceTable& table) {
  InstanceTable list = table;
  list.nodes = {table.nodes[0]};
  for (const CmInstanceNode& node : table.nodes) {
    if (node.instance == CM_INSTANCE_NONE) continue;
    list.nodes.push_back(node);
    list.nodes.back().skip = static_cast<std::uint32_t>(list.nodes.size());
  }
  list.nodes[0].skip = static_cast<std::uint32_t>(list.nodes.size());
  return list;
}

// All instances that a ray hits, sorted.
inline Visits sorted_visits(core::InstanceRays& rays, const Ray& ray) {
  Visits visits;
  for (const CmInstanceNode& node : rays.cm_instance_nodes) {
    if (node.instance == CM_INSTANCE_NONE) continue;
    const CmInstance& record = rays.cm_instances[node.instance];
    if ((record.flags & ray.flags) != ray.flags) continue;
    const glm::vec2 near = rays.cm_instance_span(ray.o, rays.cm_instance_inverse(ray.d), node.low, node.high);
    const vec3 o = rays.cm_in_instance_point(node.instance, ray.o);
    const vec3 inverse = rays.cm_instance_inverse(rays.cm_in_instance(node.instance, ray.d));
    const glm::vec2 own = rays.cm_instance_span(o, inverse, record.space.box_min, record.space.box_max);
    const float entry = std::max(near.x, own.x);
    if (entry < std::min(near.y, own.y) && entry < ray.t_end) visits.push_back({entry, node.instance});
  }
  std::ranges::sort(visits, {}, [](const Visit& v) { return std::pair(v.entry, v.instance); });
  return visits;
}

}  // namespace cumulet::test::instances
