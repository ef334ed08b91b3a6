// Ray traversal of volume instances in order, compared with brute force, and the table's other data.

#include "scene/instances.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>

#include "base/error.hpp"
#include "support/instance_rays.hpp"

namespace {

using namespace cumulet;
using namespace cumulet::test::instances;
using core::CM_INSTANCE_EMITS;
using core::CM_INSTANCE_OVERLAPS;
using core::CM_INSTANCE_SEEN;
using glm::dvec4;

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

}  // namespace
