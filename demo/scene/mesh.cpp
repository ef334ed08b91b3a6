#include "mesh.hpp"

#include <array>
#include <cmath>

namespace cumulet::scene {

using glm::vec2;
using glm::vec3;

void Mesh::quad(const vec3& a, const vec3& b, const vec3& c, const vec3& d) {
  const vec3 n = glm::normalize(glm::cross(c - a, d == c ? c - b : d - b));
  const auto first = static_cast<std::uint32_t>(position.size());
  for (const vec3& p : {a, b, c, d}) {
    position.push_back(p);
    normal.push_back(n);
  }
  for (const std::uint32_t i : {0U, 1U, 2U}) index.push_back(first + i);
  if (d == c) return;
  for (const std::uint32_t i : {0U, 2U, 3U}) index.push_back(first + i);
}

namespace {

void add_box(Mesh& mesh, const vec3& centre, const vec3& x, const vec3& y, const vec3& z) {
  const auto corner = [&](int i, int j, int k) {
    return centre + static_cast<float>(i) * x + static_cast<float>(j) * y + static_cast<float>(k) * z;
  };
  for (const int s : {-1, 1}) {
    mesh.quad(corner(s, -1, s), corner(s, -1, -s), corner(s, 1, -s), corner(s, 1, s));
    mesh.quad(corner(-s, s, -1), corner(-s, s, 1), corner(s, s, 1), corner(s, s, -1));
    mesh.quad(corner(-1, -s, s), corner(1, -s, s), corner(1, s, s), corner(-1, s, s));
  }
}

}  // namespace

void Mesh::box(const vec3& centre, const vec3& half, float turn) {
  add_box(*this, centre, half.x * vec3(std::cos(turn), 0.0F, -std::sin(turn)), vec3(0.0F, half.y, 0.0F),
          half.z * vec3(std::sin(turn), 0.0F, std::cos(turn)));
}

void Mesh::bar(const vec3& from, const vec3& to, float half) {
  const vec3 along = 0.5F * (to - from);
  const vec3 unit = glm::normalize(along);
  const vec3 side = glm::normalize(glm::cross(std::abs(unit.y) > 0.9F ? vec3(1, 0, 0) : vec3(0, 1, 0), unit));
  add_box(*this, from + along, half * side, along, half * glm::cross(side, unit));
}

void Mesh::turned(const vec3& foot, const std::vector<vec2>& profile, int sides) {
  // The outward normal is to the right of the profile's direction.
  const auto outward = [&](std::size_t i) {
    const vec2 along = glm::normalize(profile[i + 1] - profile[i]);
    return vec2(along.y, -along.x);
  };
  const std::size_t last = profile.size() - 2;
  for (std::size_t i = 0; i <= last; ++i) {
    const vec2 n = outward(i);
    const auto smooth = [&](std::size_t other) {
      const vec2 m = outward(other);
      return glm::dot(n, m) > 0.866F ? glm::normalize(n + m) : n;
    };
    const std::array<vec2, 2> ends{i == 0 ? n : smooth(i - 1), i == last ? n : smooth(i + 1)};
    const auto first = static_cast<std::uint32_t>(position.size());
    for (int s = 0; s <= sides; ++s) {
      const float angle = 6.2831853F * static_cast<float>(s % sides) / static_cast<float>(sides);
      const vec3 out(std::cos(angle), 0.0F, std::sin(angle));
      for (std::size_t end = 0; end < 2; ++end) {
        position.push_back(foot + profile[i + end].x * out + vec3(0.0F, profile[i + end].y, 0.0F));
        normal.push_back(ends[end].x * out + vec3(0.0F, ends[end].y, 0.0F));
      }
    }
    for (std::uint32_t s = 0; s < static_cast<std::uint32_t>(sides); ++s) {
      const std::uint32_t a = first + 2 * s;
      if (profile[i].x > 0.0F) index.insert(index.end(), {a, a + 1, a + 2});
      if (profile[i + 1].x > 0.0F) index.insert(index.end(), {a + 1, a + 3, a + 2});
    }
  }
}

}  // namespace cumulet::scene
