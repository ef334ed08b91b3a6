#include <algorithm>
#include <cmath>
#include <cstring>
#include <unordered_map>

#include "surface/meshes.hpp"

namespace cumulet::surface::detail {

namespace {

/// What makes two vertices one, and the side of their triangles.
struct Corner {
  glm::vec3 position;
  glm::vec3 normal;
  glm::vec2 uv;
  float side;

  bool operator==(const Corner& other) const {
    return position == other.position && normal == other.normal && uv == other.uv && side == other.side;
  }
};

struct CornerHash {
  std::size_t operator()(const Corner& corner) const {
    std::uint64_t hash = 0xCBF29CE484222325U;
    for (const float value : {corner.position.x, corner.position.y, corner.position.z, corner.normal.x, corner.normal.y,
                              corner.normal.z, corner.uv.x, corner.uv.y, corner.side}) {
      std::uint32_t bits = 0;
      const float plain = value + 0.0F;  // -0 is 0
      std::memcpy(&bits, &plain, sizeof bits);
      hash = (hash ^ bits) * 0x100000001B3U;
      hash ^= hash >> 29U;
    }
    return hash;
  }
};

float angle_between(const glm::vec3& a, const glm::vec3& b) {
  const float lengths = glm::length(a) * glm::length(b);
  return lengths > 0.0F ? std::acos(std::clamp(glm::dot(a, b) / lengths, -1.0F, 1.0F)) : 0.0F;
}

}  // namespace

glm::vec3 any_perpendicular(const glm::vec3& normal) {
  const glm::vec3 axis = std::abs(normal.x) < 0.6F ? glm::vec3(1, 0, 0) : glm::vec3(0, 1, 0);
  return glm::normalize(glm::cross(normal, axis));
}

std::vector<glm::vec4> make_tangents(std::vector<std::uint32_t>& indices, const std::vector<glm::vec3>& positions,
                                     const std::vector<glm::vec3>& normals, const std::vector<glm::vec2>& uvs,
                                     std::vector<std::uint32_t>& origins) {
  struct Face {
    glm::vec3 direction{0.0F};
    float side = 0.0F;  ///< 0: no area in texture space
  };
  std::vector<Face> faces(indices.size() / 3);
  for (std::size_t f = 0; f < faces.size(); ++f) {
    const std::uint32_t* v = &indices[3 * f];
    const glm::vec3 p1 = positions[v[1]] - positions[v[0]];
    const glm::vec3 p2 = positions[v[2]] - positions[v[0]];
    const glm::vec2 t1 = uvs[v[1]] - uvs[v[0]];
    const glm::vec2 t2 = uvs[v[2]] - uvs[v[0]];
    const float area = t1.x * t2.y - t1.y * t2.x;
    if (area == 0.0F || !std::isfinite(area)) continue;
    // Solves p = t.x dP/du + t.y dP/dv along two edges, but for the factor 1 / |area|.
    faces[f].side = area > 0.0F ? 1.0F : -1.0F;
    faces[f].direction = (t2.y * p1 - t1.y * p2) * faces[f].side;
  }

  // Sums of what counts as one vertex, by side.
  std::unordered_map<Corner, glm::vec3, CornerHash> sums;
  const auto corner = [&](std::uint32_t vertex, float side) {
    return Corner{positions[vertex], normals[vertex], uvs[vertex], side};
  };
  for (std::size_t f = 0; f < faces.size(); ++f) {
    if (faces[f].side == 0.0F) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t v = indices[3 * f + k];
      const glm::vec3 flat = faces[f].direction - normals[v] * glm::dot(normals[v], faces[f].direction);
      const float length = glm::length(flat);
      if (!(length > 0.0F) || !std::isfinite(length)) continue;
      const float angle = angle_between(positions[indices[3 * f + (k + 1) % 3]] - positions[v],
                                        positions[indices[3 * f + (k + 2) % 3]] - positions[v]);
      sums[corner(v, faces[f].side)] += flat / length * angle;
    }
  }

  const auto count = static_cast<std::uint32_t>(positions.size());
  std::vector<float> sides(count, 0.0F);
  std::unordered_map<std::uint32_t, std::uint32_t> mirrored;  // the copy for triangles of side -1
  origins.clear();
  for (std::size_t f = 0; f < faces.size(); ++f) {
    if (faces[f].side == 0.0F) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      float& side = sides[indices[3 * f + k]];
      if (side == 0.0F) side = faces[f].side;
    }
  }
  for (std::size_t f = 0; f < faces.size(); ++f) {
    for (std::size_t k = 0; k < 3; ++k) {
      std::uint32_t& v = indices[3 * f + k];
      if (faces[f].side == 0.0F || sides[v] == faces[f].side) continue;
      const auto [found, added] = mirrored.try_emplace(v, count + static_cast<std::uint32_t>(origins.size()));
      if (added) origins.push_back(v);
      v = found->second;
    }
  }

  std::vector<glm::vec4> tangents(count + origins.size());
  for (std::size_t v = 0; v < tangents.size(); ++v) {
    const bool copy = v >= count;
    const std::uint32_t original = copy ? origins[v - count] : static_cast<std::uint32_t>(v);
    const float first = sides[original] == 0.0F ? 1.0F : sides[original];
    const float side = copy ? -first : first;
    const auto found = sums.find(corner(original, side));
    const float length = found == sums.end() ? 0.0F : glm::length(found->second);
    const glm::vec3 direction = length > 0.0F ? found->second / length : any_perpendicular(normals[original]);
    // glTF's v grows downwards in the image, its bitangent cross(n, t) * w upwards.
    tangents[v] = glm::vec4(direction, -side);
  }
  return tangents;
}

}  // namespace cumulet::surface::detail
