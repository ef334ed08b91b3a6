// The BVH compared with brute force in double precision and with adversarial rays.

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
#include "support/gl_rays.hpp"
#include "support/mesh_rays.hpp"
#include "support/meshes.hpp"
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
#include "surface/bvh.glsl"
};
}  // namespace cumulet::test
#undef CM_HIT_ACCEPT

namespace {

using namespace cumulet;
using core::BvhRays;
using glm::dvec3;
using glm::vec3;
using surface::Bvh;
using surface::TriangleFlags;
using test::Mesh;
using test::MeshRay;
using test::rays_at;
using test::rays_out_of;
using test::tree_of;
using Hit = BvhRays::CmHit;

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

// Expects that every hit and miss is right, except where a ray grazes an edge within float precision.
void expect_like_brute_force(const Mesh& mesh, std::size_t count, unsigned seed, double max_doubtful = 0.01) {
  const Bvh bvh = tree_of(mesh);
  BvhRays rays{&bvh};
  std::size_t doubtful = 0;
  std::size_t hits = 0;
  for (const MeshRay& ray : rays_at(mesh, count, seed)) {
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

std::size_t slips(const Mesh& mesh, std::size_t count, unsigned seed) {
  const Bvh bvh = tree_of(mesh);
  BvhRays rays{&bvh};
  std::size_t slipped = 0;
  for (const MeshRay& ray : rays_out_of(mesh, count, seed)) {
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
  Bvh bvh = tree_of(rest);
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
    const Bvh anew = tree_of(posed);
    BvhRays refitted{&bvh};
    BvhRays rebuilt{&anew};
    std::size_t hits = 0;
    for (const MeshRay& ray : rays_at(posed, 20000, 12)) {
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
  EXPECT_LT(tree_of(plane).cost(), 60.0);
  EXPECT_GT(tree_of(plane).cost(), 10.0);
  // Two distant clusters: the first split separates them.
  Mesh two = test::icosphere(3);
  two.append(test::moved(test::icosphere(3), vec3(1.0F), vec3(100.0F, 0.0F, 0.0F)));
  const Bvh bvh = tree_of(two);
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
    Bvh bvh = tree_of(mesh);
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
    Bvh bvh = tree_of(*mesh);
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
  Bvh bvh = tree_of(one_point);
  BvhRays rays{&bvh};
  Hit hit{};
  EXPECT_FALSE(rays.cm_bvh_closest(vec3(0.25F, -3.0F, 0.0F), vec3(0.0F, 0.0F, 1.0F), 0.0F, 100.0F, hit));
  const Mesh grown = test::soup(5000, 0.3F, 1);
  bvh.refit(grown.vertices, one_point.indices);
  const Bvh anew = tree_of(grown);
  BvhRays expected{&anew};
  for (const MeshRay& ray : rays_at(grown, 300, 3)) {
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
  Bvh bvh = tree_of(mesh);
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
      return tree_of(mesh);
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
      const Bvh bvh = tree_of(mesh);
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

}  // namespace
