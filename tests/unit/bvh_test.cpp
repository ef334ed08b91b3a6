// The BVH compared with brute force in double precision, with adversarial rays, and on the GPU with the CPU.

#include "surface/bvh.hpp"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <optional>
#include <random>

#include "base/error.hpp"
#include "support/backends.hpp"
#include "support/gl_rays.hpp"
#include "support/meshes.hpp"
#include "support/osmesa_leaks.hpp"
#include "surface/bvh_rays.hpp"

// The same source with a cm_hit_accept.
#undef CM_BVH_GLSL
#undef CM_NUMBERS_GLSL
#define CM_HIT_ACCEPT
namespace cumulet::test {
using namespace glm;
struct MaskedTexels {
  const surface::Bvh* bvh;
  [[nodiscard]] uvec4 cm_bvh_node(uint t) const { return core::BvhRays::texel_of(bvh->nodes().data(), t); }
  [[nodiscard]] uvec4 cm_bvh_triangle(uint t) const { return core::BvhRays::texel_of(bvh->records().data(), t); }
  [[nodiscard]] static bool cm_hit_accept(uint /*triangle*/, vec2 barycentrics) { return barycentrics.x > 0.5F; }
};
struct MaskedRays : MaskedTexels {
#include "bvh.glsl"
};
}  // namespace cumulet::test
#undef CM_HIT_ACCEPT

namespace {

using namespace cumulet;
using core::BvhRays;
using glm::dvec3;
using glm::vec2;
using glm::vec3;
using Hit = BvhRays::CmHit;
using surface::Bvh;
using surface::TriangleFlags;
using test::Mesh;

Bvh build(const Mesh& mesh) { return Bvh::build(mesh.vertices, mesh.indices); }

// A hit in double precision. margin: the smallest barycentric coordinate, negative outside.
struct Exact {
  double t = 0.0;
  double margin = -1.0;
};
std::optional<Exact> exact_hit(const Mesh& mesh, std::size_t triangle, const dvec3& o, const dvec3& d) {
  const dvec3 v0 = mesh.corner(triangle, 0);
  const dvec3 e1 = dvec3(mesh.corner(triangle, 1)) - v0;
  const dvec3 e2 = dvec3(mesh.corner(triangle, 2)) - v0;
  const dvec3 p = glm::cross(d, e2);
  const double det = glm::dot(e1, p);
  if (std::abs(det) <= 1e-12 * glm::length(e1) * glm::length(e2) * glm::length(d)) return std::nullopt;
  const dvec3 s = o - v0;
  const double u = glm::dot(s, p) / det;
  const dvec3 q = glm::cross(s, e1);
  const double v = glm::dot(d, q) / det;
  return Exact{glm::dot(e2, q) / det, std::min({u, v, 1.0 - u - v})};
}

struct Ray {
  vec3 o;
  vec3 d;
  float t_max = 1e30F;
};

// Rays from all directions through the mesh's bounds.
std::vector<Ray> rays_at(const Mesh& mesh, std::size_t count, unsigned seed) {
  std::mt19937 engine(seed);
  std::uniform_real_distribution<float> uniform(0.0F, 1.0F);
  const auto bounds = mesh.bounds();
  const vec3 low = bounds.first;
  const vec3 high = bounds.second;
  const auto point = [&](float grow) {
    const vec3 r(uniform(engine), uniform(engine), uniform(engine));
    return low + (high - low) * (0.5F + grow * (r - 0.5F));
  };
  std::vector<Ray> rays(count);
  for (std::size_t i = 0; i < count; ++i) {
    rays[i].o = point(3.0F);
    rays[i].d = (point(1.0F) - rays[i].o) * std::exp2(6.0F * uniform(engine) - 3.0F);
    // Every third ray is parallel to an axis.
    if (i % 3 == 0) {
      const vec3 to = rays[i].d;
      rays[i].d = vec3(0.0F);
      rays[i].d[static_cast<int>(i / 3 % 3)] = (i / 9 % 2) == 0 ? 1.0F : -2.0F;
      rays[i].o = rays[i].o + to - rays[i].d * glm::length(high - low) * 2.0F;
    }
    // Some rays end before they have passed the mesh.
    if (i % 5 == 0) rays[i].t_max = 3.0F * uniform(engine);
  }
  return rays;
}

// Expects that every hit and miss is right, except where a ray grazes an edge within float precision.
void expect_like_brute_force(const Mesh& mesh, std::size_t count, unsigned seed, double max_doubtful = 0.01) {
  const Bvh bvh = build(mesh);
  BvhRays rays{&bvh};
  std::size_t doubtful = 0;
  std::size_t hits = 0;
  for (const Ray& ray : rays_at(mesh, count, seed)) {
    const dvec3 o(ray.o);
    const dvec3 d(ray.d);
    double nearest = ray.t_max;
    bool unsure = false;
    std::map<std::size_t, Exact> all;
    for (std::size_t i = 0; i < mesh.indices.size() / 3; ++i) {
      const auto exact = exact_hit(mesh, i, o, d);
      if (!exact) continue;
      if (exact->margin > -1e-4 && exact->t > -1e-4 && exact->t < ray.t_max * 1.0001) all[i] = *exact;
      if (exact->margin >= 0.0 && exact->t > 0.0) nearest = std::min(nearest, exact->t);
    }
    for (const auto& [i, exact] : all) {
      // Near an edge, or near an end of the ray.
      unsure = unsure || (std::abs(exact.margin) < 1e-4 && exact.t <= nearest) || std::abs(exact.t) < 1e-5 ||
               std::abs(exact.t - ray.t_max) < 1e-5 * ray.t_max;
    }
    doubtful += unsure ? 1 : 0;
    if (unsure) continue;
    Hit hit{};
    const bool is_hit = rays.cm_bvh_closest(ray.o, ray.d, 0.0F, ray.t_max, hit);
    ASSERT_EQ(is_hit, nearest < ray.t_max) << glm::length(ray.o);
    ASSERT_EQ(rays.cm_bvh_occluded(ray.o, ray.d, 0.0F, ray.t_max), is_hit);
    if (!is_hit) continue;
    ++hits;
    const double reach = glm::length(o) + nearest * glm::length(d);
    ASSERT_NEAR(hit.t, nearest, 2e-5 * reach / glm::length(d));
    const auto same = exact_hit(mesh, hit.triangle, o, d);
    ASSERT_TRUE(same);
    ASSERT_NEAR(same->t, nearest, 2e-5 * reach / glm::length(d));
    const dvec3 point(rays.cm_bvh_point(hit.record, hit.barycentrics));
    ASSERT_NEAR(glm::distance(point, o + nearest * d), 0.0, 1e-3 * reach) << hit.triangle;
    const vec3 n = glm::normalize(glm::cross(mesh.corner(hit.triangle, 1) - mesh.corner(hit.triangle, 0),
                                             mesh.corner(hit.triangle, 2) - mesh.corner(hit.triangle, 0)));
    ASSERT_NEAR(glm::distance(n, rays.cm_bvh_normal(hit.record)), 0.0, 1e-3);
    ASSERT_EQ(hit.front, glm::dot(dvec3(n), d) < 0.0);
  }
  EXPECT_LE(double(doubtful), max_doubtful * double(count));
  EXPECT_GE(hits, count / 20);
}

TEST(Bvh, RandomTrianglesMatchBruteForce) {
  expect_like_brute_force(test::soup(3, 1.0F, 1), 1000, 1);
  expect_like_brute_force(test::soup(5, 1.0F, 2), 1000, 2);
  expect_like_brute_force(test::soup(300, 0.3F, 3), 3000, 3);
  expect_like_brute_force(test::soup(3000, 0.1F, 4), 3000, 4);
}

TEST(Bvh, MeshesMatchBruteForce) {
  expect_like_brute_force(test::icosphere(3), 3000, 5, 0.1);
  expect_like_brute_force(test::terrain(30), 3000, 6, 0.1);
  expect_like_brute_force(test::cube(3), 3000, 7, 0.1);
}

TEST(Bvh, SliversMatchBruteForce) { expect_like_brute_force(test::slivers(1500, 8), 4000, 8, 0.7); }

// Rays from inside a closed mesh towards difficult targets (vertices, edges).
std::vector<Ray> rays_out_of(const Mesh& mesh, std::size_t count, unsigned seed) {
  const auto [low, high] = mesh.bounds();
  const vec3 middle = 0.5F * (low + high);
  std::mt19937 engine(seed);
  std::uniform_real_distribution<float> uniform(0.0F, 1.0F);
  std::vector<Ray> rays;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t triangle = engine() % (mesh.indices.size() / 3);
    const vec3 a = mesh.corner(triangle, i % 3);
    const vec3 b = mesh.corner(triangle, (i + 1) % 3);
    vec3 o = middle;
    if (i % 4 != 0) {
      for (int axis = 0; axis < 3; ++axis) {
        // Half of the origins lie in a plane of symmetry.
        if (engine() % 2 == 0) o[axis] += 0.25F * (high - low)[axis] * (2.0F * uniform(engine) - 1.0F);
      }
    }
    vec3 target = a;
    if (i % 5 == 1) target = 0.5F * (a + b);
    if (i % 5 == 2) target = a + (b - a) * uniform(engine);
    if (i % 5 == 3) target = a + (b - a) * 1e-6F * uniform(engine);
    vec3 d = target - o;
    if (i % 7 == 0) {
      // Directions along axes and diagonals.
      d = vec3(float(engine() % 3) - 1.0F, float(engine() % 3) - 1.0F, float(engine() % 3) - 1.0F);
      if (d == vec3(0.0F)) d.x = 1.0F;
    }
    if (i % 11 == 0) {
      const int axis = static_cast<int>(engine() % 3);
      const std::array<float, 5> tiny{0.0F, -0.0F, 1e-30F, -1e-20F, 1e-42F};
      if (std::abs(d[(axis + 1) % 3]) > 0.0F) d[axis] = tiny[engine() % 5];
    }
    if (i % 13 == 0) d *= std::exp2(30.0F * uniform(engine) - 15.0F);
    if (!(glm::length(d) > 0.0F)) continue;
    rays.push_back({o, d, std::numeric_limits<float>::infinity()});
  }
  return rays;
}

std::size_t slips(const Mesh& mesh, std::size_t count, unsigned seed) {
  const Bvh bvh = build(mesh);
  BvhRays rays{&bvh};
  std::size_t slipped = 0;
  for (const Ray& ray : rays_out_of(mesh, count, seed)) {
    Hit hit{};
    const bool is_hit = rays.cm_bvh_closest(ray.o, ray.d, 0.0F, ray.t_max, hit);
    slipped += is_hit && !hit.front && rays.cm_bvh_occluded(ray.o, ray.d, 0.0F, ray.t_max) ? 0 : 1;
  }
  return slipped;
}

TEST(Bvh, NoRaySlipsOutOfAClosedMesh) {
  EXPECT_EQ(slips(test::icosphere(4), 300000, 1), 0U);
  EXPECT_EQ(slips(test::cube(1), 200000, 2), 0U);
  EXPECT_EQ(slips(test::cube(7), 200000, 3), 0U);
  // Meshes that are far from the origin, large, small or thin.
  EXPECT_EQ(slips(test::moved(test::icosphere(3), vec3(1.0F), vec3(1000.0F, -300.0F, 77.0F)), 100000, 4), 0U);
  EXPECT_EQ(slips(test::moved(test::icosphere(3), vec3(1e6F), vec3(0.0F)), 50000, 5), 0U);
  EXPECT_EQ(slips(test::moved(test::icosphere(3), vec3(1e-6F), vec3(0.0F)), 50000, 6), 0U);
  EXPECT_EQ(slips(test::moved(test::cube(5), vec3(1.0F, 1e-3F, 30.0F), vec3(0.3F, 0.1F, -0.7F)), 100000, 7), 0U);
}

bool same_hit(const Hit& a, const Hit& b) {
  return a.t == b.t && a.triangle == b.triangle && a.barycentrics == b.barycentrics && a.front == b.front;
}

TEST(Bvh, RefitMatchesARebuild) {
  const Mesh rest = test::soup(20000, 0.05F, 11);
  Bvh bvh = build(rest);
  const std::vector<Bvh::Node> before(bvh.nodes().begin(), bvh.nodes().end());
  bvh.refit(rest.vertices, rest.indices);
  EXPECT_EQ(std::memcmp(before.data(), bvh.nodes().data(), before.size() * sizeof(Bvh::Node)), 0) << "at rest";
  const double cost = bvh.cost();
  EXPECT_GT(cost, 1.0);

  for (const float twist : {0.1F, 2.0F}) {
    Mesh posed = rest;
    for (surface::PosedVertex& v : posed.vertices) {
      const float angle = twist * v.position.y;
      v.position = vec3(std::cos(angle) * v.position.x - std::sin(angle) * v.position.z, v.position.y + 0.1F * twist,
                        std::sin(angle) * v.position.x + std::cos(angle) * v.position.z);
    }
    bvh.refit(posed.vertices, posed.indices);
    const Bvh anew = build(posed);
    BvhRays refitted{&bvh};
    BvhRays rebuilt{&anew};
    std::size_t hits = 0;
    for (const Ray& ray : rays_at(posed, 20000, 12)) {
      Hit a{};
      Hit b{};
      const bool is_hit = refitted.cm_bvh_closest(ray.o, ray.d, 0.0F, ray.t_max, a);
      ASSERT_EQ(is_hit, rebuilt.cm_bvh_closest(ray.o, ray.d, 0.0F, ray.t_max, b));
      hits += is_hit ? 1 : 0;
      ASSERT_TRUE(!is_hit || same_hit(a, b));
    }
    EXPECT_GT(hits, 5000U);
    // The refitted tree costs more than a rebuilt one, and little more if little moved.
    EXPECT_GE(bvh.cost(), 0.97 * anew.cost());
    EXPECT_LT(bvh.cost(), (twist < 1.0F ? 1.2 : 6.0) * anew.cost());
  }
  bvh.refit(rest.vertices, rest.indices);
  EXPECT_EQ(bvh.cost(), cost);
}

TEST(Bvh, CostIsCloseToTheExpectedSteps) {
  // For a plane of n triangles, a good tree costs about log2(n) nodes. Splits at the median count cost far more.
  const Mesh plane = test::terrain(100);
  EXPECT_LT(build(plane).cost(), 60.0);
  EXPECT_GT(build(plane).cost(), 10.0);
  // Two distant clusters: the first split separates them.
  Mesh two = test::icosphere(3);
  two.append(test::moved(test::icosphere(3), vec3(1.0F), vec3(100.0F, 0.0F, 0.0F)));
  const Bvh bvh = build(two);
  const Bvh::Node& root = bvh.nodes()[0];
  EXPECT_LT(std::min(root.child[0].high.x, root.child[1].high.x), 2.0F);
  EXPECT_GT(std::max(root.child[0].low.x, root.child[1].low.x), 98.0F);
  EXPECT_LT(bvh.cost(), 3.0);
}

void expect_sound(const Bvh& bvh, std::size_t triangles) {
  EXPECT_LE(bvh.depth(), Bvh::max_depth);
  ASSERT_EQ(bvh.records().size(), triangles);
  std::vector<int> nodes(bvh.nodes().size());
  std::vector<int> records(triangles);
  std::vector<int> numbers;
  nodes[0] = 1;
  for (const Bvh::Node& node : bvh.nodes()) {
    for (const Bvh::Node::Child& child : node.child) {
      if (child.link == 0xffffffffU) continue;
      if (child.link < Bvh::leaf_bit) {
        ASSERT_LT(child.link, nodes.size());
        ++nodes[child.link];
        continue;
      }
      const std::size_t first = child.link & 0x1fffffffU;
      const std::size_t count = ((child.link >> 29U) & 3U) + 1;
      ASSERT_LE(first + count, triangles);
      for (std::size_t i = first; i < first + count; ++i) {
        ++records[i];
        const Bvh::Record& r = bvh.records()[i];
        if (r.spare != 0) continue;
        for (const vec3& p : {r.v0, r.v1, r.v2}) {
          ASSERT_TRUE(glm::all(glm::lessThanEqual(child.low, p)) && glm::all(glm::lessThanEqual(p, child.high)));
        }
      }
    }
  }
  EXPECT_EQ(std::count(nodes.begin(), nodes.end(), 1), static_cast<std::ptrdiff_t>(nodes.size()));
  EXPECT_EQ(std::count(records.begin(), records.end(), 1), static_cast<std::ptrdiff_t>(triangles));
  for (const Bvh::Record& r : bvh.records()) numbers.push_back(static_cast<int>(r.triangle));
  std::sort(numbers.begin(), numbers.end());
  EXPECT_EQ(std::adjacent_find(numbers.begin(), numbers.end()), numbers.end());
}

TEST(Bvh, EmptyAndTinyMeshesBuild) {
  const Bvh none;
  BvhRays rays{&none};
  Hit hit{};
  EXPECT_FALSE(rays.cm_bvh_closest(vec3(0.0F), vec3(1.0F), 0.0F, std::numeric_limits<float>::infinity(), hit));
  EXPECT_EQ(hit.triangle, CM_BVH_NONE);
  EXPECT_EQ(none.cost(), 0.0);
  for (const std::size_t n : {0U, 1U, 2U, 3U, 4U, 5U, 6U, 17U}) {
    Mesh mesh = test::soup(n, 0.5F, 3);
    Bvh bvh = build(mesh);
    expect_sound(bvh, n);
    bvh.refit(mesh.vertices, mesh.indices);
    expect_sound(bvh, n);
    BvhRays of{&bvh};
    for (std::size_t i = 0; i < n; ++i) {
      const vec3 middle = (mesh.corner(i, 0) + mesh.corner(i, 1) + mesh.corner(i, 2)) / 3.0F;
      EXPECT_TRUE(of.cm_bvh_closest(vec3(-3.0F), middle - vec3(-3.0F), 0.0F, 2.0F, hit));
    }
    EXPECT_FALSE(of.cm_bvh_closest(vec3(-3.0F), vec3(-1.0F), 0.0F, std::numeric_limits<float>::infinity(), hit));
    EXPECT_FALSE(of.cm_bvh_closest(vec3(3.0F, 0.0F, 0.0F), vec3(1.0F, 0.0F, 0.0F), 0.0F, 1e38F, hit));
  }
}

TEST(Bvh, InvalidTrianglesGiveAValidTree) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float inf = std::numeric_limits<float>::infinity();
  Mesh one_point = test::soup(5000, 0.0F, 1);
  for (auto& v : one_point.vertices) v.position = vec3(0.25F, -3.0F, 7.0F);
  Mesh duplicates;
  for (int i = 0; i < 40000; ++i) duplicates.append(test::soup(1, 1.0F, 9));
  // 60 groups of triangles, each half the size of the previous one: every SAH split cuts off one group.
  Mesh shrinking;
  for (int i = 0; i < 60; ++i) {
    const float s = std::pow(0.5F, float(i));
    for (int k = 0; k < 3000; ++k) shrinking.append(test::moved(test::soup(1, 1.0F, 5), vec3(s), vec3(s)));
  }
  Mesh collinear;
  for (int i = 0; i < 3000; ++i) {
    const auto x = float(i);
    collinear.append_triangle({x, 0.0F, 0.0F}, {x + 1.0F, 0.0F, 0.0F}, {x + 2.0F, 0.0F, 0.0F});
  }
  Mesh unsound = test::soup(3000, 0.1F, 2);
  for (std::size_t i = 0; i < unsound.vertices.size(); i += 50) {
    unsound.vertices[i].position[static_cast<int>(i % 3)] = std::array<float, 4>{nan, inf, -inf, 1e30F}[i / 50 % 4];
  }
  Mesh all_unsound = one_point;
  for (auto& v : all_unsound.vertices) v.position.x = nan;
  Mesh wide = test::soup(2000, 0.1F, 7);
  for (std::size_t i = 0; i < wide.vertices.size(); ++i) {
    wide.vertices[i].position *= i % 2 == 0 ? 9e11F : 1e-30F;
  }
  for (const Mesh* mesh : {&one_point, &duplicates, &shrinking, &collinear, &unsound, &all_unsound, &wide}) {
    Bvh bvh = build(*mesh);
    expect_sound(bvh, mesh->indices.size() / 3);
    EXPECT_TRUE(std::isfinite(bvh.cost()));
    bvh.refit(mesh->vertices, mesh->indices);
    expect_sound(bvh, mesh->indices.size() / 3);
    BvhRays rays{&bvh};
    for (const float x : {0.0F, 1.0F, -1.0F, nan, inf, -inf, 1e-40F, 1e20F}) {
      for (const float y : {0.0F, 1.0F, nan, inf, 1e-20F}) {
        Hit hit{};
        rays.cm_bvh_closest(vec3(x, y, 0.5F), vec3(y, 1.0F, x), 0.0F, inf, hit);
        rays.cm_bvh_closest(vec3(y), vec3(x), x, y, hit);
        rays.cm_bvh_closest(vec3(0.0F), vec3(y, x, 0.0F), x, inf, hit);
        if (hit.triangle != CM_BVH_NONE) {
          EXPECT_TRUE(std::isfinite(hit.t));
          EXPECT_TRUE(std::isfinite(hit.barycentrics.x) && std::isfinite(hit.barycentrics.y));
        }
      }
    }
  }
  // Triangles without area are not hit until a pose gives them some.
  Bvh bvh = build(one_point);
  BvhRays rays{&bvh};
  Hit hit{};
  EXPECT_FALSE(rays.cm_bvh_closest(vec3(0.25F, -3.0F, 0.0F), vec3(0.0F, 0.0F, 1.0F), 0.0F, 100.0F, hit));
  const Mesh grown = test::soup(5000, 0.3F, 1);
  bvh.refit(grown.vertices, one_point.indices);
  const Bvh anew = build(grown);
  BvhRays expected{&anew};
  for (const Ray& ray : rays_at(grown, 300, 3)) {
    Hit other{};
    ASSERT_EQ(rays.cm_bvh_closest(ray.o, ray.d, 0.0F, ray.t_max, hit),
              expected.cm_bvh_closest(ray.o, ray.d, 0.0F, ray.t_max, other));
    ASSERT_EQ(hit.triangle, other.triangle);
  }
}

TEST(Bvh, WrongSizesAndIndicesAreErrors) {
  const Mesh mesh = test::soup(10, 0.1F, 1);
  std::vector<std::uint32_t> indices = mesh.indices;
  const std::vector<std::uint32_t> nine(9);
  EXPECT_THROW(Bvh::build(mesh.vertices, std::span(indices).first(29)), Error);
  EXPECT_THROW(Bvh::build(mesh.vertices, indices, nine), Error);
  Bvh bvh = build(mesh);
  EXPECT_THROW(bvh.refit(mesh.vertices, std::span(indices).first(27)), Error);
  EXPECT_THROW(bvh.refit(std::span(mesh.vertices).first(29), indices), Error);
  expect_sound(bvh, 10);
  indices[29] = 30;
  EXPECT_THROW(Bvh::build(mesh.vertices, indices), Error);
  Progress progress;
  progress.cancel();
  EXPECT_THROW(Bvh::build(mesh.vertices, mesh.indices, {}, &progress), Error);
}

TEST(Bvh, IsTheSameForAnyNumberOfThreads) {
  for (const Mesh& mesh : {test::soup(150000, 0.02F, 21), test::terrain(250)}) {
    const auto build_with = [&](std::size_t threads) {
      const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
      return build(mesh);
    };
    const Bvh one = build_with(1);
    for (const std::size_t threads : {2U, 8U}) {
      const Bvh many = build_with(threads);
      ASSERT_EQ(one.nodes().size(), many.nodes().size());
      EXPECT_EQ(std::memcmp(one.nodes().data(), many.nodes().data(), one.nodes().size_bytes()), 0);
      EXPECT_EQ(std::memcmp(one.records().data(), many.records().data(), one.records().size_bytes()), 0);
      EXPECT_EQ(one.cost(), many.cost());
    }
    expect_sound(one, mesh.indices.size() / 3);
  }
}

TEST(Bvh, FlagsSelectTriangles) {
  // Four sheets at z = 1 to 4 that face -z, against the ray.
  Mesh sheets;
  for (int i = 1; i <= 4; ++i) {
    const auto z = float(i);
    sheets.append_triangle({-1.0F, -1.0F, z}, {0.0F, 2.0F, z}, {1.0F, -1.0F, z});
  }
  std::vector<std::uint32_t> flags{7, 0, TriangleFlags::left_out, 0};
  const auto first = [&](const vec3& o, const vec3& d) {
    const Bvh bvh = Bvh::build(sheets.vertices, sheets.indices, flags);
    BvhRays rays{&bvh};
    Hit hit{};
    rays.cm_bvh_closest(o, d, 0.0F, 100.0F, hit);
    return hit;
  };
  const vec3 z(0.0F, 0.0F, 1.0F);
  EXPECT_EQ(first(vec3(0.0F), z).triangle, 0U);
  EXPECT_EQ(first(vec3(0.0F), z).flags & TriangleFlags::user, 7U);
  EXPECT_TRUE(first(vec3(0.0F), z).front);
  EXPECT_FALSE(first(5.0F * z, -z).front);
  EXPECT_EQ(first(2.5F * z, z).triangle, 3U);
  EXPECT_EQ(first(2.0F * z, z).triangle, 3U);  // not at the surface where it starts
  flags[0] = TriangleFlags::clockwise;
  EXPECT_FALSE(first(vec3(0.0F), z).front);
  EXPECT_TRUE(first(1.5F * z, -z).front);
  flags[0] = TriangleFlags::clockwise | TriangleFlags::one_sided;
  EXPECT_EQ(first(vec3(0.0F), z).triangle, 1U);
  EXPECT_EQ(first(1.5F * z, -z).triangle, 0U);
  flags[0] = TriangleFlags::one_sided;
  EXPECT_EQ(first(vec3(0.0F), z).triangle, 0U);
  EXPECT_EQ(first(1.5F * z, -z).triangle, CM_BVH_NONE);
}

TEST(Bvh, FlagsFollowTheScene) {
  struct Still : surface::Scene {
    [[nodiscard]] surface::Pose pose(double /*time*/, std::size_t /*animation*/,
                                     const cumulet::Progress* /*progress*/ = nullptr) const override {
      return {};
    }
  } scene;
  scene.materials.resize(3);
  scene.materials[0].double_sided = true;
  scene.materials[1].alpha_mode = surface::AlphaMode::mask;
  scene.draws = {{0, 6, 0, 0}, {6, 3, 1, 0}, {9, 3, 2, 0}};
  scene.indices.resize(12);
  surface::Pose pose;
  pose.flipped = {0, 0, 1};
  EXPECT_EQ(surface::triangle_flags(scene, pose),
            (std::vector<std::uint32_t>{0, 0, 1U | TriangleFlags::ask | TriangleFlags::one_sided,
                                        2U | TriangleFlags::one_sided | TriangleFlags::clockwise}));
}

TEST(Bvh, AnyHitFunctionDecidesOnFlaggedTriangles) {
  // cm_hit_accept rejects hits with a small barycentric coordinate of v1, so that rays reach the triangle behind.
  Mesh sheets = test::soup(0, 0.0F, 0);
  for (const float z : {1.0F, 2.0F}) sheets.append_triangle({-1.0F, -1.0F, z}, {0.0F, 2.0F, z}, {1.0F, -1.0F, z});
  const std::vector<std::uint32_t> flags{TriangleFlags::ask, 0};
  const Bvh bvh = Bvh::build(sheets.vertices, sheets.indices, flags);
  test::MaskedRays rays{{&bvh}};
  test::MaskedRays::CmHit hit{};
  const vec3 z(0.0F, 0.0F, 1.0F);
  EXPECT_TRUE(rays.cm_bvh_closest({0.0F, 1.5F, 0.0F}, z, 0.0F, 10.0F, hit));
  EXPECT_EQ(hit.triangle, 0U);
  EXPECT_TRUE(rays.cm_bvh_closest({0.0F, -0.9F, 0.0F}, z, 0.0F, 10.0F, hit));
  EXPECT_EQ(hit.triangle, 1U);
  EXPECT_TRUE(rays.cm_bvh_occluded({0.0F, 1.5F, 0.0F}, z, 0.0F, 1.5F));
  EXPECT_FALSE(rays.cm_bvh_occluded({0.0F, -0.9F, 0.0F}, z, 0.0F, 1.5F));
}

TEST(Bvh, OffsetOriginsLeaveTheirSurface) {
  // A ray that starts at another ray's hit point does not hit the same flat mesh again.
  std::mt19937 engine(5);
  std::uniform_real_distribution<float> uniform(-1.0F, 1.0F);
  for (const float scale : {0.01F, 1.0F, 100.0F}) {
    for (const float away : {0.0F, 1.0F, 30.0F}) {
      const Mesh mesh = test::moved(test::icosphere(3), vec3(scale), vec3(away, -away, 2.0F * away) * scale);
      const Bvh bvh = build(mesh);
      BvhRays rays{&bvh};
      const auto [low, high] = mesh.bounds();
      std::size_t again = 0;
      std::size_t all = 0;
      for (int i = 0; i < 20000; ++i) {
        const vec3 d = glm::normalize(vec3(uniform(engine), uniform(engine), uniform(engine)) + 1e-3F);
        Hit hit{};
        if (!rays.cm_bvh_closest(0.5F * (low + high) - 3.0F * scale * d, d, 0.0F, 1e30F, hit)) continue;
        const vec3 n = rays.cm_bvh_normal(hit.record);
        const vec3 o = rays.cm_offset_origin(rays.cm_bvh_point(hit.record, hit.barycentrics), n);
        vec3 out = glm::normalize(vec3(uniform(engine), uniform(engine), uniform(engine)) + 1e-3F);
        if (glm::dot(out, n) < 0.0F) out = -out;
        ++all;
        again += rays.cm_bvh_occluded(o, out, 0.0F, 1e30F) ? 1 : 0;
        EXPECT_LT(glm::distance(o, rays.cm_bvh_point(hit.record, hit.barycentrics)),
                  1e-4F * scale * (1.0F + away) + 2e-5F);
      }
      EXPECT_GT(all, 10000U);
      EXPECT_EQ(again, 0U) << scale << " " << away;
    }
  }
}

class BvhGl : public test::BackendTest {};
CUMULET_ON_BACKENDS(BvhGl);

TEST_P(BvhGl, ShadersMatchTheCpu) {
  const test::GlRays gl(*context_, "");
  for (const Mesh& mesh : {test::soup(20000, 0.05F, 31), test::terrain(60), test::slivers(2000, 33), test::icosphere(4),
                           test::soup(1, 1.0F, 35), Mesh()}) {
    const Bvh bvh = build(mesh);
    BvhRays rays{&bvh};
    std::vector<test::GlRay> all;
    for (const Ray& r : rays_at(mesh.indices.empty() ? test::cube(1) : mesh, 20000, 34)) {
      all.push_back({r.o, 0.0F, r.d, r.t_max});
    }
    const std::vector<test::GlHit> hits = gl.trace(bvh, all);
    std::size_t different = 0;
    std::size_t hit_count = 0;
    for (std::size_t i = 0; i < all.size(); ++i) {
      Hit hit{};
      const bool expected = rays.cm_bvh_closest(all[i].o, all[i].d, 0.0F, all[i].t_max, hit);
      hit_count += expected ? 1 : 0;
      ASSERT_EQ(hits[i].triangle != CM_BVH_NONE, hits[i].occluded != 0) << i;
      // GPU division may round differently. Hits at an edge, a needle or the ray's end may differ.
      if (hits[i].triangle != hit.triangle) {
        ++different;
        continue;
      }
      if (!expected) continue;
      ASSERT_NEAR(hits[i].t, hit.t, 1e-5F * (1.0F + std::abs(hit.t))) << i;
      ASSERT_EQ(hits[i].front != 0, hit.front) << i;
      ASSERT_NEAR(hits[i].barycentrics.x, hit.barycentrics.x, 1e-2F) << i;
      ASSERT_NEAR(hits[i].barycentrics.y, hit.barycentrics.y, 1e-2F) << i;
    }
    EXPECT_LE(different, all.size() / 500) << mesh.indices.size();
    EXPECT_GE(hit_count, mesh.indices.size() < 4 ? 0U : all.size() / 20);
  }
}

TEST_P(BvhGl, NoRaySlipsOutOfAClosedMesh) {
  // Holds for every contraction into fused operations that the driver chooses.
  const test::GlRays gl(*context_, "");
  for (const Mesh& mesh : {test::icosphere(4), test::cube(5),
                           test::moved(test::icosphere(3), vec3(1.0F), vec3(1000.0F, -300.0F, 77.0F))}) {
    const Bvh bvh = build(mesh);
    std::vector<test::GlRay> all;
    for (const Ray& r : rays_out_of(mesh, 200000, 41)) all.push_back({r.o, 0.0F, r.d, r.t_max});
    std::size_t slipped = 0;
    for (const test::GlHit& hit : gl.trace(bvh, all)) slipped += hit.occluded != 0 && hit.front == 0 ? 0 : 1;
    EXPECT_EQ(slipped, 0U);
  }
}

TEST_P(BvhGl, AnyHitFunctionDecidesOnFlaggedTriangles) {
  const test::GlRays gl(*context_, "return (triangle & 1u) == 1u && barycentrics.x > 0.3;");
  const Mesh mesh = test::soup(5000, 0.1F, 51);
  std::vector<std::uint32_t> flags(5000);
  for (std::size_t i = 0; i < flags.size(); ++i) flags[i] = i % 3 == 0 ? 0 : TriangleFlags::ask;
  const Bvh bvh = Bvh::build(mesh.vertices, mesh.indices, flags);
  std::vector<test::GlRay> all;
  for (const Ray& r : rays_at(mesh, 20000, 52)) all.push_back({r.o, 0.0F, r.d, r.t_max});
  std::array<std::size_t, 3> kinds{};
  for (const test::GlHit& hit : gl.trace(bvh, all)) {
    if (hit.triangle == CM_BVH_NONE) continue;
    ++kinds[flags[hit.triangle] == 0 ? 0 : 1];
    kinds[2] += flags[hit.triangle] != 0 && (hit.triangle % 2 == 0 || hit.barycentrics.x <= 0.3F) ? 1 : 0;
  }
  EXPECT_GT(kinds[0], 1000U);
  EXPECT_GT(kinds[1], 500U);
  EXPECT_EQ(kinds[2], 0U);
}

}  // namespace
