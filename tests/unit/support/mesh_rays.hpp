#pragma once

// Rays at and out of meshes, and trees of their triangles.

#include <array>
#include <cmath>
#include <limits>
#include <random>

#include "support/gl_rays.hpp"
#include "support/meshes.hpp"
#include "surface/bvh.hpp"

namespace cumulet::test {

inline surface::Bvh tree_of(const Mesh& mesh) { return surface::Bvh::build(mesh.vertices, mesh.indices); }

struct MeshRay {
  glm::vec3 o;
  glm::vec3 d;
  float t_max = 1e30F;
};

// Rays from all directions through the mesh's bounds.
inline std::vector<MeshRay> rays_at(const Mesh& mesh, std::size_t count, unsigned seed) {
  std::mt19937 engine(seed);
  std::uniform_real_distribution<float> uniform(0.0F, 1.0F);
  const auto bounds = mesh.bounds();
  const glm::vec3 low = bounds.first;
  const glm::vec3 high = bounds.second;
  const auto point = [&](float grow) {
    const glm::vec3 r(uniform(engine), uniform(engine), uniform(engine));
    return low + (high - low) * (0.5F + grow * (r - 0.5F));
  };
  std::vector<MeshRay> rays(count);
  for (std::size_t i = 0; i < count; ++i) {
    rays[i].o = point(3.0F);
    rays[i].d = (point(1.0F) - rays[i].o) * std::exp2(6.0F * uniform(engine) - 3.0F);
    // Every third ray is parallel to an axis.
    if (i % 3 == 0) {
      const glm::vec3 to = rays[i].d;
      rays[i].d = glm::vec3(0.0F);
      rays[i].d[static_cast<int>(i / 3 % 3)] = (i / 9 % 2) == 0 ? 1.0F : -2.0F;
      rays[i].o = rays[i].o + to - rays[i].d * glm::length(high - low) * 2.0F;
    }
    // Some rays end before they have passed the mesh.
    if (i % 5 == 0) rays[i].t_max = 3.0F * uniform(engine);
  }
  return rays;
}

// Rays from inside a closed mesh towards difficult targets (vertices, edges).
inline std::vector<MeshRay> rays_out_of(const Mesh& mesh, std::size_t count, unsigned seed) {
  const auto [low, high] = mesh.bounds();
  const glm::vec3 middle = 0.5F * (low + high);
  std::mt19937 engine(seed);
  std::uniform_real_distribution<float> uniform(0.0F, 1.0F);
  std::vector<MeshRay> rays;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t triangle = engine() % (mesh.indices.size() / 3);
    const glm::vec3 a = mesh.corner(triangle, i % 3);
    const glm::vec3 b = mesh.corner(triangle, (i + 1) % 3);
    glm::vec3 o = middle;
    if (i % 4 != 0) {
      for (int axis = 0; axis < 3; ++axis) {
        // Half of the origins lie in a plane of symmetry.
        if (engine() % 2 == 0) o[axis] += 0.25F * (high - low)[axis] * (2.0F * uniform(engine) - 1.0F);
      }
    }
    glm::vec3 target = a;
    if (i % 5 == 1) target = 0.5F * (a + b);
    if (i % 5 == 2) target = a + (b - a) * uniform(engine);
    if (i % 5 == 3) target = a + (b - a) * 1e-6F * uniform(engine);
    glm::vec3 d = target - o;
    if (i % 7 == 0) {
      // Directions along axes and diagonals.
      d = glm::vec3(float(engine() % 3) - 1.0F, float(engine() % 3) - 1.0F, float(engine() % 3) - 1.0F);
      if (d == glm::vec3(0.0F)) d.x = 1.0F;
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

}  // namespace cumulet::test
