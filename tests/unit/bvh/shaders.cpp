// The tree on the GPU, compared with the CPU.

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "support/backends.hpp"
#include "support/gl_rays.hpp"
#include "support/mesh_rays.hpp"
#include "support/meshes.hpp"
#include "surface/bvh.hpp"
#include "surface/bvh_rays.hpp"

namespace {

using namespace cumulet;
using core::BvhRays;
using glm::vec3;
using surface::Bvh;
using surface::TriangleFlags;
using test::Mesh;
using test::MeshRay;
using test::rays_at;
using test::rays_out_of;
using test::tree_of;
using Hit = BvhRays::CmHit;

class BvhGl : public test::BackendTest {};

CUMULET_ON_BACKENDS(BvhGl);

TEST_P(BvhGl, ShadersMatchTheCpu) {
  const test::GlRays gl(*context_, "");
  for (const Mesh& mesh : {test::soup(20000, 0.05F, 31), test::terrain(60), test::slivers(2000, 33), test::icosphere(4),
                           test::soup(1, 1.0F, 35), Mesh()}) {
    const Bvh bvh = tree_of(mesh);
    BvhRays rays{&bvh};
    std::vector<test::GlRay> all;
    for (const MeshRay& r : rays_at(mesh.indices.empty() ? test::cube(1) : mesh, 20000, 34)) {
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
    const Bvh bvh = tree_of(mesh);
    std::vector<test::GlRay> all;
    for (const MeshRay& r : rays_out_of(mesh, 200000, 41)) all.push_back({r.o, 0.0F, r.d, r.t_max});
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
  for (const MeshRay& r : rays_at(mesh, 20000, 52)) all.push_back({r.o, 0.0F, r.d, r.t_max});
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
