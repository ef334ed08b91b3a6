// Ray traversal of volume instances in order, compared with brute force; the table's other data; and the same on the
// GPU.

#include "scene/instances.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <limits>
#include <random>
#include <set>

#include "base/error.hpp"
#include "gl/bindings.hpp"
#include "support/gl_compute.hpp"
#include "support/gl_state.hpp"

namespace cumulet::core {

/// glsl/instance.glsl over a table in memory.
struct InstanceRays {
  std::span<const CmInstance> cm_instances;
  std::span<const CmInstanceNode> cm_instance_nodes;
#include "instance.glsl"
};

}  // namespace cumulet::core

namespace {

using namespace cumulet;
using core::CM_INSTANCE_EMITS;
using core::CM_INSTANCE_NONE;
using core::CM_INSTANCE_OVERLAPS;
using core::CM_INSTANCE_SEEN;
using core::CmInstance;
using core::CmInstanceNode;
using glm::dmat4;
using glm::dvec3;
using glm::dvec4;
using glm::vec3;
using scene::Instance;
using scene::InstanceTable;

const dvec3 origin(1.0e3, -2.0e3, 3.0e3);  // of the scene's frame

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

Instance instance_of(const dmat4& transform, const vec3& low = vec3(0.0F), const vec3& high = vec3(16.0F)) {
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

dmat4 any_transform(Random& random, double wide) {
  dmat4 transform = glm::translate(dmat4(1.0), random.in_box(-wide, wide));
  transform = glm::rotate(transform, random(0.0, 6.0), random.unit());
  transform = glm::scale(transform, random.in_box(1.0, 5.0));
  transform[1] += random(-0.5, 0.5) * transform[0];  // sheared
  if (random.below(4) == 0) transform[2] = -transform[2];
  return transform;
}

// Random instances: rotated, sheared, mirrored, with boxes anywhere in their cubes.
std::vector<Instance> any_instances(std::size_t count, unsigned seed, double wide = 25.0) {
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
std::vector<Instance> tiles() {
  std::vector<Instance> instances;
  for (int i = 0; i < 64; ++i)
    instances.push_back(instance_of(glm::translate(dmat4(1.0), 8.0 * dvec3(i & 3, (i >> 2) & 3, i >> 4))));
  return instances;
}

std::vector<Instance> coincident() {
  Random random(5);
  std::vector<Instance> instances(50, instance_of(any_transform(random, 5.0)));
  for (const Instance& other : any_instances(10, 6, 10.0)) instances.push_back(other);
  return instances;
}

// Every second instance is empty: of no thickness along one axis, or inverted.
std::vector<Instance> flat() {
  std::vector<Instance> instances = any_instances(60, 7);
  for (std::size_t i = 0; i < instances.size(); i += 2) {
    core::CmGrid& grid = instances[i].grid;
    const int axis = static_cast<int>(i / 2 % 3);
    grid.box_max[axis] = grid.box_min[axis] - (i % 4 == 0 ? 1.0F : 0.0F);
  }
  return instances;
}

std::vector<Ray> any_rays(std::size_t count, unsigned seed, const InstanceTable& table) {
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

core::InstanceRays rays_of(const InstanceTable& table) { return {table.records, table.nodes}; }

Visits visits_of(core::InstanceRays& rays, const Ray& ray) {
  Visits visits;
  Visit at{-1.0F, CM_INSTANCE_NONE};
  while (rays.cm_next_instance(ray.o, ray.d, ray.t_end, ray.flags, at.entry, at.instance)) {
    visits.push_back(at);
    if (visits.size() > rays.cm_instances.size()) throw std::logic_error("one is visited twice");
  }
  return visits;
}

// Keeps the same instances as a flat list, without the tree.
InstanceTable flattened(const InstanceTable& table) {
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
Visits sorted_visits(core::InstanceRays& rays, const Ray& ray) {
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

// The interval of a ray inside an instance's box, in double precision.
struct Span {
  double first = 0.0;
  double last = std::numeric_limits<double>::infinity();
};
Span exact_span(const Instance& instance, const Ray& ray) {
  const dmat4 from_scene =
      glm::inverse(glm::translate(dmat4(1.0), -origin) * instance.transform * instance.source->cube.to_world);
  const dvec3 o(from_scene * dvec4(dvec3(ray.o), 1.0));
  const dvec3 d(from_scene * dvec4(dvec3(ray.d), 0.0));
  Span span;
  for (int axis = 0; axis < 3; ++axis) {
    const double t_0 = (double{instance.grid.box_min[axis]} - o[axis]) / d[axis];
    const double t_1 = (double{instance.grid.box_max[axis]} - o[axis]) / d[axis];
    if (std::abs(d[axis]) > 1e-9) {
      span.first = std::max(span.first, std::min(t_0, t_1));
      span.last = std::min(span.last, std::max(t_0, t_1));
    } else if (o[axis] < double{instance.grid.box_min[axis]} || o[axis] > double{instance.grid.box_max[axis]}) {
      span.last = -1.0;
    }
  }
  return span;
}

struct Counts {
  std::size_t visits = 0;
  std::size_t doubtful = 0;
  std::size_t rays_with_ties = 0;
};

// Compares with the sorted list bit by bit, and with double precision except where floats cannot decide.
Counts expect_like_brute_force(const std::vector<Instance>& instances, std::size_t count, unsigned seed) {
  const InstanceTable table = scene::make_instances(instances, origin);
  core::InstanceRays rays = rays_of(table);
  Counts counts;
  const std::vector<Ray> all = any_rays(count, seed, table);
  for (std::size_t r = 0; r < all.size(); ++r) {
    const Ray& ray = all[r];
    const Visits visits = visits_of(rays, ray);
    EXPECT_EQ(visits, sorted_visits(rays, ray)) << r;
    if (testing::Test::HasFailure()) return counts;
    counts.visits += visits.size();
    for (std::size_t i = 1; i < visits.size(); ++i) {
      if (visits[i].entry == visits[i - 1].entry) {
        ++counts.rays_with_ties;
        break;
      }
    }
    if (r % 10 != 0) continue;
    std::vector<float> entries(instances.size(), -1.0F);
    for (const Visit& visit : visits) entries[visit.instance] = visit.entry;
    for (std::size_t i = 0; i < instances.size(); ++i) {
      const bool asked = (table.records[i].flags & ray.flags) == ray.flags;
      const bool solid = glm::all(glm::lessThan(instances[i].grid.box_min, instances[i].grid.box_max));
      const Span span = exact_span(instances[i], ray);
      const double unsure = 1e-4 * (1.0 + glm::length(dvec3(ray.o)));
      if (asked && solid && std::abs(std::min(span.last, double{ray.t_end}) - span.first) < unsure) {
        ++counts.doubtful;
        continue;
      }
      const bool hits = asked && solid && span.first < std::min(span.last, double{ray.t_end});
      EXPECT_EQ(entries[i] >= 0.0F, hits) << r << ' ' << i << ' ' << span.first << ' ' << span.last;
      if (hits) {
        EXPECT_NEAR(entries[i], span.first, unsure) << r << ' ' << i;
      }
      if (testing::Test::HasFailure()) return counts;
    }
  }
  return counts;
}

TEST(InstanceTree, VisitsInstancesInSortedOrder) {
  const Counts counts = expect_like_brute_force(any_instances(200, 1), 100000, 2);
  EXPECT_GT(counts.visits, 300000U);
  EXPECT_LT(counts.doubtful, 20000U) << "of 2 million";
  EXPECT_GT(counts.rays_with_ties, 5000U) << "several boxes hold their start";
}

TEST(InstanceTree, CoincidentInstancesAreVisitedByIndex) {
  const Counts counts = expect_like_brute_force(coincident(), 5000, 3);
  EXPECT_GT(counts.rays_with_ties, 1000U);
}

TEST(InstanceTree, SkipsEmptyInstancesAndNonFiniteRays) {
  EXPECT_GT(expect_like_brute_force(flat(), 5000, 4).visits, 3000U);
  const std::vector<Instance> one = {flat()[0]};
  const InstanceTable table = scene::make_instances(one, origin);
  core::InstanceRays rays = rays_of(table);
  EXPECT_TRUE(visits_of(rays, {vec3(-100.0F), 3e38F, vec3(0.57735F), 0}).empty());
  EXPECT_EQ(table.records.size(), 1U);
  const InstanceTable some = scene::make_instances(coincident(), origin);
  core::InstanceRays of_some = rays_of(some);
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    EXPECT_TRUE(visits_of(of_some, {vec3(0.0F, bad, 0.0F), 3e38F, vec3(1.0F), 0}).empty());
    EXPECT_TRUE(visits_of(of_some, {vec3(0.0F), 3e38F, vec3(bad, 1.0F, 1.0F), 0}).empty());
  }
  const InstanceTable none = scene::make_instances({}, origin);
  core::InstanceRays of_none = rays_of(none);
  EXPECT_TRUE(visits_of(of_none, {vec3(-100.0F), 3e38F, vec3(0.57735F), 0}).empty());
  EXPECT_EQ(none.nodes.size(), 1U);
}

// The origin of the scene's frame depends only on the scene, is near it, and rarely changes while something moves.
TEST(InstanceTree, SceneOriginIsNearTheInstances) {
  EXPECT_EQ(scene::origin_of({}), dvec3(0.0));
  const auto all = any_instances(20, 21);
  for (const double scale : {1e-6, 1.0, 1e5}) {
    for (const dvec3& at : {dvec3(0.0), dvec3(3.0, -40.0, 900.0), dvec3(1e5, 2e5, -3e4)}) {
      std::vector<Instance> there = all;
      dvec3 low(1e300);
      dvec3 high(-1e300);
      for (Instance& instance : there) {
        instance.transform = glm::scale(glm::translate(dmat4(1.0), scale * at), dvec3(scale)) * instance.transform;
        for (int corner = 0; corner < 8; ++corner) {
          const dvec3 unit(corner & 1, corner / 2 & 1, corner / 4);
          const dvec3 in_grid = glm::mix(dvec3(instance.grid.box_min), dvec3(instance.grid.box_max), unit);
          const dvec3 point(instance.transform * instance.source->cube.to_world * glm::dvec4(in_grid, 1.0));
          low = glm::min(low, point);
          high = glm::max(high, point);
        }
      }
      EXPECT_LT(glm::distance(scene::origin_of(there), 0.5 * (low + high)), 2.0 * glm::distance(low, high));
      int jumps = 0;
      for (int step = 0; step < 100; ++step) {
        const dvec3 before = scene::origin_of(there);
        for (Instance& instance : there)
          instance.transform =
              glm::translate(dmat4(1.0), dvec3(0.01 * glm::distance(low, high), 0.0, 0.0)) * instance.transform;
        jumps += scene::origin_of(there) == before ? 0 : 1;
      }
      EXPECT_LE(jumps, 1) << "by its own size";
    }
  }
}

TEST(InstanceTree, MatchesAFlatList) {
  for (const std::vector<Instance>& instances :
       {any_instances(200, 8), coincident(), flat(), tiles(), any_instances(1, 9), any_instances(4, 10)}) {
    const InstanceTable table = scene::make_instances(instances, origin);
    const InstanceTable list = flattened(table);
    core::InstanceRays by_tree = rays_of(table);
    core::InstanceRays by_list = rays_of(list);
    for (const Ray& ray : any_rays(5000, 11, table)) ASSERT_EQ(visits_of(by_tree, ray), visits_of(by_list, ray));
  }
}

// At coordinates where a float's steps are as wide as a box, results with and without the tree are still equal.
TEST(InstanceTree, MatchesAFlatListFarFromTheOrigin) {
  std::vector<Instance> instances = any_instances(100, 12);
  for (Instance& instance : instances)
    instance.transform = glm::translate(dmat4(1.0), dvec3(3e8, -1e8, 7e7)) * instance.transform;
  const InstanceTable table = scene::make_instances(instances, origin);
  const InstanceTable list = flattened(table);
  core::InstanceRays by_tree = rays_of(table);
  core::InstanceRays by_list = rays_of(list);
  std::size_t visits = 0;
  for (const Ray& ray : any_rays(5000, 13, table)) {
    const Visits by_tree_ones = visits_of(by_tree, ray);
    ASSERT_EQ(by_tree_ones, visits_of(by_list, ray));
    visits += by_tree_ones.size();
  }
  EXPECT_GT(visits, 500U);
}

TEST(InstanceTree, RaysOnSharedFacesVisitOneInstance) {
  const InstanceTable table = scene::make_instances(tiles(), origin);
  core::InstanceRays rays = rays_of(table);
  for (int axis = 0; axis < 3; ++axis) {
    for (int i = 0; i <= 8; ++i) {
      for (int j = 0; j <= 8; ++j) {
        for (const float to : {1.0F, -1.0F}) {
          vec3 o(0.0F);
          o[axis] = -50.0F * to;
          o[(axis + 1) % 3] = 4.0F * static_cast<float>(i);
          o[(axis + 2) % 3] = 4.0F * static_cast<float>(j);
          vec3 d(0.0F);
          d[axis] = to;
          const Visits visits = visits_of(rays, {o, 3e38F, d, 0});
          // Rays along the upper outer faces hit nothing.
          ASSERT_EQ(visits.size(), i == 8 || j == 8 ? 0U : 4U) << axis << ' ' << i << ' ' << j;
          for (std::size_t k = 0; k < visits.size(); ++k)
            ASSERT_EQ(visits[k].entry, (to > 0.0F ? 50.0F : 18.0F) + 8.0F * static_cast<float>(k));
        }
      }
    }
  }
  // From a vertex shared by eight cubes, along their edges and away from them: each ray hits two cubes in succession.
  for (int way = 0; way < 27; ++way) {
    const vec3 d(way % 3 - 1, way / 3 % 3 - 1, way / 9 - 1);
    if (d == vec3(0.0F)) continue;
    const Visits visits = visits_of(rays, {vec3(16.0F), 3e38F, d, 0});
    ASSERT_EQ(visits.size(), 2U) << way;
    EXPECT_EQ(visits[0].entry, 0.0F);
    EXPECT_EQ(visits[1].entry, 8.0F);
  }
}

// ---- the table's data ----

// Finds a point inside the intersection of two boxes: the mean of the vertices where three of the twelve faces meet.
// Returns how deep it is inside both boxes, negative if there is no intersection.
double common_margin(const Instance& a, const Instance& b) {
  struct Face {
    dvec3 normal;
    double at;
  };
  std::vector<Face> faces;
  for (const Instance* instance : {&a, &b}) {
    const dmat4 to_scene = glm::translate(dmat4(1.0), -origin) * instance->transform * instance->source->cube.to_world;
    const dmat4 normals = glm::transpose(glm::inverse(to_scene));
    for (int axis = 0; axis < 3; ++axis) {
      const dvec3 n = glm::normalize(dvec3(normals[axis]));
      const auto at = [&](const vec3& p) { return glm::dot(n, dvec3(to_scene * dvec4(dvec3(p), 1.0))); };
      faces.push_back({n, std::max(at(instance->grid.box_min), at(instance->grid.box_max))});
      faces.push_back({-n, -std::min(at(instance->grid.box_min), at(instance->grid.box_max))});
    }
  }
  const auto margin = [&](const dvec3& p) {
    double least = std::numeric_limits<double>::infinity();
    for (const Face& face : faces) least = std::min(least, face.at - glm::dot(face.normal, p));
    return least;
  };
  dvec3 sum(0.0);
  double count = 0.0;
  for (std::size_t i = 0; i < 12; ++i) {
    for (std::size_t j = i + 1; j < 12; ++j) {
      for (std::size_t k = j + 1; k < 12; ++k) {
        const glm::dmat3 rows = glm::transpose(glm::dmat3(faces[i].normal, faces[j].normal, faces[k].normal));
        if (std::abs(glm::determinant(rows)) < 1e-9) continue;
        const dvec3 corner = glm::inverse(rows) * dvec3(faces[i].at, faces[j].at, faces[k].at);
        if (margin(corner) < -1e-9) continue;
        sum += corner;
        count += 1.0;
      }
    }
  }
  return count > 0.0 ? margin(sum / count) : -1.0;
}

TEST(InstanceTree, OverlapIsReported) {
  for (const double wide : {25.0, 45.0, 80.0}) {
    const std::vector<Instance> instances = any_instances(60, 14, wide);
    const InstanceTable table = scene::make_instances(instances, origin);
    std::vector<bool> expected(instances.size());
    for (std::size_t i = 0; i < instances.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        const double margin = common_margin(instances[i], instances[j]);
        ASSERT_GT(std::abs(margin), 1e-5) << "not sure";
        if (margin > 0.0) expected[i] = expected[j] = true;
      }
    }
    std::size_t overlapping = 0;
    for (std::size_t i = 0; i < instances.size(); ++i) {
      EXPECT_EQ((table.records[i].flags & CM_INSTANCE_OVERLAPS) != 0, expected[i]) << i;
      overlapping += expected[i] ? 1 : 0;
    }
    EXPECT_GT(overlapping, 3U) << wide;
    EXPECT_LT(overlapping, wide > 40.0 ? 57U : 61U) << wide;
  }
}

TEST(InstanceTree, TouchingInstancesDoNotOverlapAndCoincidentOnesDo) {
  for (const CmInstance& record : scene::make_instances(tiles(), origin).records)
    EXPECT_EQ(record.flags & CM_INSTANCE_OVERLAPS, 0U);
  const InstanceTable ones = scene::make_instances(coincident(), origin);
  for (std::size_t i = 0; i < 50; ++i) EXPECT_NE(ones.records[i].flags & CM_INSTANCE_OVERLAPS, 0U);
  std::vector<Instance> slightly = tiles();
  slightly[21].transform = glm::translate(dmat4(1.0), dvec3(1e-3, 0.0, 0.0)) * slightly[21].transform;
  const InstanceTable moved = scene::make_instances(slightly, origin);
  std::set<std::size_t> overlapping;
  for (std::size_t i = 0; i < 64; ++i) {
    if ((moved.records[i].flags & CM_INSTANCE_OVERLAPS) != 0) overlapping.insert(i);
  }
  EXPECT_EQ(overlapping, (std::set<std::size_t>{21, 22}));
}

TEST(InstanceTree, RecordsRoundTrip) {
  std::vector<Instance> instances = any_instances(30, 15);
  for (std::size_t i = 0; i < instances.size(); ++i) {
    instances[i].grid.first_cell = static_cast<std::uint32_t>(100 + i);
    instances[i].medium.extinction = static_cast<float>(i);
  }
  const InstanceTable table = scene::make_instances(instances, origin);
  for (std::size_t i = 0; i < instances.size(); ++i) {
    const CmInstance& record = table.records[i];
    EXPECT_EQ(record.grid, instances[i].grid);
    EXPECT_EQ(record.medium, instances[i].medium);
    EXPECT_EQ((record.flags & CM_INSTANCE_SEEN) != 0, !instances[i].hidden_from_camera);
    EXPECT_EQ((record.flags & CM_INSTANCE_EMITS) != 0, instances[i].medium.emits != 0);
    core::InstanceRays rays = rays_of(table);
    const dvec3 v(3.0, 5.0, 7.0);
    const dvec3 p(instances[i].transform * instances[i].source->cube.to_world * dvec4(v, 1.0));
    EXPECT_LT(glm::distance(dvec3(rays.cm_in_instance_point(static_cast<std::uint32_t>(i), vec3(p - origin))), v),
              1e-3);
  }
}

// Sets the emitted power of the instance's source.
void make_emissive(Instance& instance, double power, double length) {
  instance.emissive = {.power = power, .length = length};
}

TEST(InstanceTree, EmitterSelectionFollowsPower) {
  std::vector<Instance> instances = any_instances(40, 16);
  double sum = 0.0;
  std::vector<double> power(instances.size());
  for (std::size_t i = 0; i < instances.size(); ++i) {
    const double of_source = i % 3 == 0 ? 0.0 : std::exp2(static_cast<double>(i % 7));
    make_emissive(instances[i], of_source, 2.0);
    power[i] = of_source * std::abs(glm::determinant(glm::dmat3(instances[i].transform)));
    sum += power[i];
  }
  const InstanceTable table = scene::make_instances(instances, origin);
  EXPECT_NEAR(table.emissive_power, sum, 1e-9 * sum);
  std::vector<double> probability(instances.size());
  for (std::size_t i = 0; i < instances.size(); ++i) {
    const double stays = static_cast<double>(table.records[i].alias) / 4294967296.0;
    probability[i] += stays / static_cast<double>(instances.size());
    probability.at(table.records[i].alias_other) += (1.0 - stays) / static_cast<double>(instances.size());
  }
  core::InstanceRays rays = rays_of(table);
  for (std::size_t i = 0; i < instances.size(); ++i) {
    EXPECT_NEAR(probability[i], power[i] / sum, 1e-8);
    if (power[i] > 0.0) {
      EXPECT_FLOAT_EQ(table.records[i].emissive.density, static_cast<float>(1.0 / sum));
      EXPECT_GT(table.records[i].emissive.min_stretch, 0.0F);
      continue;
    }
    EXPECT_EQ(table.records[i].emissive, core::CmEmissive{});
    for (std::uint32_t drawn = 0; drawn < instances.size(); ++drawn) {
      for (const std::uint32_t word : {0U, 1U, 0x7fffffffU, 0xffffffffU}) {
        ASSERT_NE(rays.cm_glowing_instance(drawn, word), i) << "it has no cell to pick";
      }
    }
  }
}

TEST(InstanceTree, PowerScalesWithVolume) {
  Instance one = instance_of(glm::scale(dmat4(1.0), dvec3(2.0, 3.0, 4.0)));
  make_emissive(one, 5.0, 7.0);
  const auto table_of = [](const std::vector<Instance>& instances) { return scene::make_instances(instances, origin); };
  EXPECT_NEAR(table_of({one}).emissive_power, 5.0 * 24.0, 1e-9);
  EXPECT_NEAR(table_of({one}).emissive_length, 7.0 * std::cbrt(24.0), 1e-9);
  EXPECT_NEAR(table_of({one}).records[0].emissive.extent, 7.0 * std::cbrt(24.0), 1e-5);
  EXPECT_EQ(table_of({one}).records[0].alias, 0xffffffffU);
  // Two instances emit as much as one of twice the volume. A dark third one changes nothing.
  Instance dark = one;
  make_emissive(dark, 0.0, 0.0);
  EXPECT_NEAR(table_of({one, dark, one}).emissive_power, 2.0 * 5.0 * 24.0, 1e-9);
  EXPECT_NEAR(table_of({one, dark, one}).emissive_length, 7.0 * std::cbrt(2.0 * 24.0), 1e-9);
  EXPECT_EQ(table_of({dark}).emissive_power, 0.0);
  EXPECT_EQ(table_of({dark}).records[0].emissive, core::CmEmissive{});
}

void expect_refused(const Instance& instance, ErrorCode code, const char* cause) {
  const std::vector<Instance> instances{instance_of(dmat4(1.0)), instance};
  try {
    scene::make_instances(instances, origin);
    FAIL() << "taken";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), code);
    EXPECT_EQ(std::string(error.what()), std::string("instance 1: ") + cause);
  }
}

TEST(InstanceTree, InvalidTransformsAreRejected) {
  constexpr const char* nowhere = "its transform is not finite, is singular, or is too large";
  expect_refused(instance_of(glm::scale(dmat4(1.0), dvec3(1.0, 0.0, 1.0))), ErrorCode::invalid_argument, nowhere);
  expect_refused(instance_of(glm::translate(dmat4(1.0), dvec3(std::nan("")))), ErrorCode::invalid_argument, nowhere);
  expect_refused(instance_of(glm::translate(dmat4(1.0), dvec3(1e300))), ErrorCode::invalid_argument, nowhere);
  expect_refused(instance_of(glm::translate(dmat4(1.0), dvec3(0.0, 2e12, 0.0))), ErrorCode::unsupported,
                 "it extends 1e12 or more from the scene");
}

// ---- on the GPU ----

class GlInstanceTree : public test::GlTest {
 protected:
  static std::string head() {
    return "#version 450\n" + test::glsl_file("shared.glsl") + test::glsl_file("bindings.glsl") +
           test::glsl_file("parameters.glsl") + test::glsl_file("instance_table.glsl") +
           test::glsl_file("instance.glsl");
  }
};
CUMULET_ON_BACKENDS(GlInstanceTree);

constexpr std::size_t max_visits = 32;

// GPU division is accurate to two and a half units in the last place.
bool is_alike(const Visit& a, const Visit& b) {
  return a.instance == b.instance && std::abs(a.entry - b.entry) <= 4e-6F * std::max(1.0F, std::abs(b.entry));
}

TEST_P(GlInstanceTree, ShaderMatchesCpp) {
  const gl::Object program = test::compute_program(gl_, head() + R"(
layout(local_size_x = 64) in;
struct Ray { vec3 o; float t_end; vec3 d; uint flags; };
layout(std430, binding = 0) readonly buffer Rays { Ray rays[]; };
layout(std430, binding = 1) buffer Visits { uint visits[]; };
void main() {
  uint i = gl_GlobalInvocationID.x;
  if (i >= uint(rays.length())) return;
  float entry = -1.0;
  uint instance = CM_INSTANCE_NONE;
  uint count = 0u;
  while (count < 32u && cm_next_instance(rays[i].o, rays[i].d, rays[i].t_end, rays[i].flags, entry, instance)) {
    visits[64u * i + 2u * count] = floatBitsToUint(entry);
    visits[64u * i + 2u * count + 1u] = instance;
    ++count;
  }
}
)");
  for (const std::vector<Instance>& instances : {any_instances(200, 17), coincident(), flat(), tiles()}) {
    const InstanceTable table = scene::make_instances(instances, origin);
    const std::vector<Ray> rays = any_rays(2000, 18, table);
    std::vector<Visit> found(rays.size() * max_visits, Visit{-1.0F, CM_INSTANCE_NONE});
    const auto buffer = [&](const auto& values) {
      return gl::make_buffer(gl_, values.size() * sizeof(values[0]), values.data(), 0, "instances");
    };
    const std::array buffers{buffer(rays), buffer(found), buffer(table.records), buffer(table.nodes)};
    const std::array<GLuint, 4> bindings{0, 1, GLuint{core::CM_STORAGE_INSTANCES},
                                         GLuint{core::CM_STORAGE_INSTANCE_NODES}};
    gl_->UseProgram(program.name());
    for (std::size_t i = 0; i < 4; ++i) gl_->BindBufferBase(GL_SHADER_STORAGE_BUFFER, bindings[i], buffers[i].name());
    gl_->DispatchCompute(static_cast<GLuint>((rays.size() + 63) / 64), 1, 1);
    gl_->MemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
    gl_->GetNamedBufferSubData(buffers[1].name(), 0, static_cast<GLsizeiptr>(found.size() * sizeof(Visit)),
                               found.data());
    core::InstanceRays by_cpp = rays_of(table);
    std::size_t visits = 0;
    std::size_t others = 0;
    for (std::size_t r = 0; r < rays.size(); ++r) {
      Visits expected = visits_of(by_cpp, rays[r]);
      visits += expected.size();
      expected.resize(max_visits, Visit{-1.0F, CM_INSTANCE_NONE});
      for (std::size_t i = 0; i < max_visits; ++i) others += is_alike(found[r * max_visits + i], expected[i]) ? 0 : 1;
    }
    EXPECT_GT(visits, 1000U);
    EXPECT_EQ(others, 0U) << "of " << visits;
  }
}

struct Field {
  std::string name;
  std::size_t offset;
};
#define CM_RECORD(field) \
  Field { "cm_instances[0]." #field, offsetof(CmInstance, field) }
#define CM_NODE(field) \
  Field { "cm_instance_nodes[0]." #field, offsetof(CmInstanceNode, field) }

TEST_P(GlInstanceTree, RecordLayoutMatchesTheDriver) {
  const std::vector<Field> records{CM_RECORD(space.to_cube_x),
                                   CM_RECORD(space.to_cube_y),
                                   CM_RECORD(space.to_cube_z),
                                   CM_RECORD(space.from_cube_x),
                                   CM_RECORD(space.from_cube_y),
                                   CM_RECORD(space.from_cube_z),
                                   CM_RECORD(space.cube_origin),
                                   CM_RECORD(space.unit_volume),
                                   CM_RECORD(space.box_min),
                                   CM_RECORD(space.volumes),
                                   CM_RECORD(space.box_max),
                                   CM_RECORD(grid.box_min),
                                   CM_RECORD(grid.root_exponent),
                                   CM_RECORD(grid.box_max),
                                   CM_RECORD(grid.levels),
                                   CM_RECORD(grid.page_shift),
                                   CM_RECORD(grid.first_cell),
                                   CM_RECORD(grid.tree),
                                   CM_RECORD(grid.emission_unit),
                                   CM_RECORD(grid.first_records[0]),
                                   CM_RECORD(grid.first_glowing),
                                   CM_RECORD(grid.glowing),
                                   CM_RECORD(grid.moves),
                                   CM_RECORD(grid.first_change),
                                   CM_RECORD(emissive.density),
                                   CM_RECORD(emissive.extent),
                                   CM_RECORD(emissive.min_stretch),
                                   CM_RECORD(medium.albedo),
                                   CM_RECORD(medium.extinction),
                                   CM_RECORD(medium.source),
                                   CM_RECORD(medium.anisotropy),
                                   CM_RECORD(medium.second_anisotropy),
                                   CM_RECORD(medium.second_bend),
                                   CM_RECORD(medium.second_weight),
                                   CM_RECORD(medium.emits),
                                   CM_RECORD(medium.colored),
                                   CM_RECORD(medium.anisotropic),
                                   CM_RECORD(medium.group),
                                   CM_RECORD(medium.holdout),
                                   CM_RECORD(medium.changes),
                                   CM_RECORD(flags),
                                   CM_RECORD(alias),
                                   CM_RECORD(alias_other)};
  const std::vector<Field> nodes{CM_NODE(low), CM_NODE(skip), CM_NODE(high), CM_NODE(instance)};
  const gl::Object program = test::compute_program(gl_, head() + R"(
layout(local_size_x = 1) in;
layout(std430, binding = 0) buffer Words { uint words[]; };
void main() { words[0] = cm_glowing_instance(cm_instance_nodes[1].instance, 0u); }
)");
  const auto of_block = [&](const char* block, GLenum what) {
    const GLuint index = gl_->GetProgramResourceIndex(program.name(), GL_SHADER_STORAGE_BLOCK, block);
    EXPECT_NE(index, GL_INVALID_INDEX) << block;
    GLint value = -1;
    gl_->GetProgramResourceiv(program.name(), GL_SHADER_STORAGE_BLOCK, index, 1, &what, 1, nullptr, &value);
    return value;
  };
  const auto of_field = [&](const std::string& name, GLenum what) {
    const GLuint index = gl_->GetProgramResourceIndex(program.name(), GL_BUFFER_VARIABLE, name.c_str());
    EXPECT_NE(index, GL_INVALID_INDEX) << name;
    GLint value = -1;
    gl_->GetProgramResourceiv(program.name(), GL_BUFFER_VARIABLE, index, 1, &what, 1, nullptr, &value);
    return value;
  };
  const auto expect = [&](const char* block, const std::vector<Field>& fields, std::size_t stride) {
    EXPECT_EQ(of_block(block, GL_NUM_ACTIVE_VARIABLES), static_cast<GLint>(fields.size())) << "the list is not whole";
    for (const Field& field : fields) {
      EXPECT_EQ(of_field(field.name, GL_OFFSET), static_cast<GLint>(field.offset)) << field.name;
      EXPECT_EQ(of_field(field.name, GL_TOP_LEVEL_ARRAY_STRIDE), static_cast<GLint>(stride)) << field.name;
    }
  };
  expect("CmInstances", records, sizeof(CmInstance));
  expect("CmInstanceNodes", nodes, sizeof(CmInstanceNode));
  EXPECT_EQ(of_block("CmInstances", GL_BUFFER_BINDING), core::CM_STORAGE_INSTANCES);
  EXPECT_EQ(of_block("CmInstanceNodes", GL_BUFFER_BINDING), core::CM_STORAGE_INSTANCE_NODES);
}

}  // namespace
