#pragma once

#include <array>
#include <cmath>
#include <map>
#include <random>
#include <utility>
#include <vector>

#include "surface/scene.hpp"

namespace cumulet::test {

/// Triangles for ray intersection tests.
struct Mesh {
  std::vector<surface::PosedVertex> vertices;
  std::vector<std::uint32_t> indices;

  [[nodiscard]] const glm::vec3& corner(std::size_t triangle, std::size_t i) const {
    return vertices[indices[3 * triangle + i]].position;
  }
  void append_triangle(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c) {
    for (const glm::vec3& p : {a, b, c}) {
      indices.push_back(static_cast<std::uint32_t>(vertices.size()));
      vertices.push_back({p, {}, {}});
    }
  }
  void append(const Mesh& other) {
    const auto base = static_cast<std::uint32_t>(vertices.size());
    vertices.insert(vertices.end(), other.vertices.begin(), other.vertices.end());
    for (const std::uint32_t i : other.indices) indices.push_back(base + i);
  }
  [[nodiscard]] std::pair<glm::vec3, glm::vec3> bounds() const {
    std::pair<glm::vec3, glm::vec3> b(vertices.at(0).position, vertices.at(0).position);
    for (const surface::PosedVertex& v : vertices) {
      b.first = glm::min(b.first, v.position);
      b.second = glm::max(b.second, v.position);
    }
    return b;
  }
};

/// Random triangles of about this size in the unit cube.
inline Mesh soup(std::size_t triangles, float size, unsigned seed) {
  std::mt19937 engine(seed);
  std::uniform_real_distribution<float> uniform(0.0F, 1.0F);
  const auto point = [&] {
    const float x = uniform(engine);
    const float y = uniform(engine);
    return glm::vec3(x, y, uniform(engine));
  };
  Mesh mesh;
  for (std::size_t i = 0; i < triangles; ++i) {
    const glm::vec3 at = point();
    const glm::vec3 a = at + size * point();
    const glm::vec3 b = at + size * point();
    mesh.append_triangle(a, b, at + size * point());
  }
  return mesh;
}

/// Needles: one edge is up to a million times longer than the height over it.
inline Mesh slivers(std::size_t triangles, unsigned seed) {
  Mesh mesh = soup(triangles, 1.0F, seed);
  std::mt19937 engine(seed);
  std::uniform_real_distribution<float> uniform(0.0F, 1.0F);
  for (std::size_t i = 0; i < triangles; ++i) {
    const glm::vec3 a = mesh.corner(i, 0);
    const glm::vec3 b = mesh.corner(i, 1);
    glm::vec3& c = mesh.vertices[mesh.indices[3 * i + 2]].position;
    const float along = uniform(engine);
    c = a + (b - a) * along + (c - a) * std::pow(10.0F, -6.0F * uniform(engine));
  }
  return mesh;
}

/// A closed unit sphere of 20 * 4^level triangles that face outwards. From level 1 on, there are vertices on the axes.
inline Mesh icosphere(int level) {
  const float g = 0.5F + std::sqrt(1.25F);
  std::vector<glm::vec3> points{{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                                {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  for (glm::vec3& p : points) p = glm::normalize(p);
  std::vector<std::uint32_t> indices{0, 11, 5,  0, 5,  1, 0, 1, 7, 0, 7,  10, 0, 10, 11, 1, 5, 9, 5, 11,
                                     4, 11, 10, 2, 10, 7, 6, 7, 1, 8, 3,  9,  4, 3,  4,  2, 3, 2, 6, 3,
                                     6, 8,  3,  8, 9,  4, 9, 5, 2, 4, 11, 6,  2, 10, 8,  6, 7, 9, 8, 1};
  for (int i = 0; i < level; ++i) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const auto [found, is_new] = middles.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(points.size()));
      if (is_new) points.push_back(glm::normalize(points[a] + points[b]));
      return found->second;
    };
    std::vector<std::uint32_t> finer;
    for (std::size_t t = 0; t < indices.size(); t += 3) {
      const std::uint32_t a = indices[t];
      const std::uint32_t b = indices[t + 1];
      const std::uint32_t c = indices[t + 2];
      const std::uint32_t ab = middle(a, b);
      const std::uint32_t bc = middle(b, c);
      const std::uint32_t ca = middle(c, a);
      for (const std::uint32_t v : {a, ab, ca, b, bc, ab, c, ca, bc, ab, bc, ca}) finer.push_back(v);
    }
    indices = finer;
  }
  Mesh mesh;
  for (const glm::vec3& p : points) mesh.vertices.push_back({p, p, {}});
  mesh.indices = indices;
  return mesh;
}

/// A closed cube [-1, 1]^3 that faces outwards, with 2 n^2 triangles per side. Adjacent sides have equal vertex
/// positions but separate vertices.
inline Mesh cube(int n) {
  Mesh mesh;
  for (int side = 0; side < 6; ++side) {
    const int axis = side / 2;
    const float sign = side % 2 == 0 ? -1.0F : 1.0F;
    const auto point = [&](int i, int j) {
      glm::vec3 p;
      p[axis] = sign;
      p[(axis + 1) % 3] = 2.0F * float(i) / float(n) - 1.0F;
      p[(axis + 2) % 3] = 2.0F * float(j) / float(n) - 1.0F;
      return p;
    };
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) {
        std::array<glm::vec3, 4> p{point(i, j), point(i + 1, j), point(i + 1, j + 1), point(i, j + 1)};
        if (sign < 0.0F) std::swap(p[1], p[3]);
        mesh.append_triangle(p[0], p[1], p[2]);
        mesh.append_triangle(p[0], p[2], p[3]);
      }
    }
  }
  return mesh;
}

/// Hills over the unit square of x and z that face upwards, 2 n^2 triangles.
inline Mesh terrain(int n) {
  Mesh mesh;
  for (int j = 0; j <= n; ++j) {
    for (int i = 0; i <= n; ++i) {
      const float x = float(i) / float(n);
      const float z = float(j) / float(n);
      mesh.vertices.push_back(
          {{x, 0.1F * std::sin(20.0F * x) * std::cos(17.0F * z) + 0.02F * std::sin(150.0F * x * z), z}, {}, {}});
    }
  }
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      const auto a = static_cast<std::uint32_t>(j * (n + 1) + i);
      const std::uint32_t b = a + static_cast<std::uint32_t>(n) + 1;
      for (const std::uint32_t v : {a, b, a + 1, a + 1, b, b + 1}) mesh.indices.push_back(v);
    }
  }
  return mesh;
}

inline Mesh moved(Mesh mesh, const glm::vec3& scale, const glm::vec3& offset) {
  for (surface::PosedVertex& v : mesh.vertices) v.position = v.position * scale + offset;
  return mesh;
}

}  // namespace cumulet::test
