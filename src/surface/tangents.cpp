#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <unordered_map>

#include "surface/meshes.hpp"

namespace cumulet::surface::detail {

namespace {

/// Vertices with equal members share a tangent. side: orientation of their triangles.
struct Corner {
  glm::vec3 position;
  glm::vec3 normal;
  glm::vec2 uv;
  float side;

  bool operator==(const Corner& other) const {
    return position == other.position && normal == other.normal && uv == other.uv && side == other.side;
  }
};

std::size_t hash_of(const Corner& corner) {
  std::uint64_t hash = 0xCBF29CE484222325U;
  for (const float value : {corner.position.x, corner.position.y, corner.position.z, corner.normal.x, corner.normal.y,
                            corner.normal.z, corner.uv.x, corner.uv.y, corner.side}) {
    std::uint32_t bits = 0;
    const float plain = value + 0.0F;  // turns -0 into 0
    std::memcpy(&bits, &plain, sizeof bits);
    hash = (hash ^ bits) * 0x100000001B3U;
    hash ^= hash >> 29U;
  }
  return hash;
}

/// Vectors by corner. The hash table has its final size from the start and is freed at once. A node-based map takes a
/// second to grow and to free, without a chance to cancel.
class Sums {
 public:
  /// corners: maximum number of entries.
  explicit Sums(std::size_t corners) : slots_(std::bit_ceil(2 * corners + 1), none) {}

  glm::vec3& operator[](const Corner& corner) {
    std::uint32_t& slot = slots_[slot_of(corner)];
    if (slot == none) {
      slot = static_cast<std::uint32_t>(entries_.size());
      entries_.push_back({corner, glm::vec3(0.0F)});
    }
    return entries_[slot].sum;
  }
  /// Returns null if there is none.
  [[nodiscard]] const glm::vec3* find(const Corner& corner) const {
    const std::uint32_t slot = slots_[slot_of(corner)];
    return slot == none ? nullptr : &entries_[slot].sum;
  }

 private:
  struct Entry {
    Corner corner;
    glm::vec3 sum;
  };
  static constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

  [[nodiscard]] std::size_t slot_of(const Corner& corner) const {
    const std::size_t mask = slots_.size() - 1;
    std::size_t at = hash_of(corner) & mask;
    while (slots_[at] != none && !(entries_[slots_[at]].corner == corner)) at = (at + 1) & mask;
    return at;
  }

  std::vector<std::uint32_t> slots_;
  std::vector<Entry> entries_;
};

float angle_between(const glm::vec3& a, const glm::vec3& b) {
  const float lengths = glm::length(a) * glm::length(b);
  return lengths > 0.0F ? std::acos(std::clamp(glm::dot(a, b) / lengths, -1.0F, 1.0F)) : 0.0F;
}

/// Direction of a triangle's texture coordinates.
struct Face {
  glm::vec3 direction{0.0F};  ///< direction of growing u, times the triangle's area
  float side = 0.0F;          ///< -1: mirrored; 0: no area in texture space
};

std::vector<Face> texture_faces(const std::vector<std::uint32_t>& indices, const std::vector<glm::vec3>& positions,
                                const std::vector<glm::vec2>& uvs, const std::function<void(std::size_t turn)>& check) {
  std::vector<Face> faces(indices.size() / 3);
  for (std::size_t f = 0; f < faces.size(); ++f) {
    check(f);
    const std::uint32_t* v = &indices[3 * f];
    const glm::vec3 p1 = positions[v[1]] - positions[v[0]];
    const glm::vec3 p2 = positions[v[2]] - positions[v[0]];
    const glm::vec2 t1 = uvs[v[1]] - uvs[v[0]];
    const glm::vec2 t2 = uvs[v[2]] - uvs[v[0]];
    const float area = t1.x * t2.y - t1.y * t2.x;
    if (area == 0.0F || !std::isfinite(area)) continue;
    // Solves p = t.x dP/du + t.y dP/dv along two edges, without the factor 1 / |area|.
    faces[f].side = area > 0.0F ? 1.0F : -1.0F;
    faces[f].direction = (t2.y * p1 - t1.y * p2) * faces[f].side;
  }
  return faces;
}

/// Vertices between triangles of both orientations get a copy for the second one. origins: receives the original of
/// each copy. Returns each vertex's (first) orientation, 0 if its triangles have none.
std::vector<float> part_sides(std::vector<std::uint32_t>& indices, const std::vector<Face>& faces, std::uint32_t count,
                              std::vector<std::uint32_t>& origins, const std::function<void(std::size_t turn)>& check) {
  std::vector<float> sides(count, 0.0F);
  std::unordered_map<std::uint32_t, std::uint32_t> copies;
  origins.clear();
  for (std::size_t f = 0; f < faces.size(); ++f) {
    if (faces[f].side == 0.0F) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      float& side = sides[indices[3 * f + k]];
      if (side == 0.0F) side = faces[f].side;
    }
  }
  for (std::size_t f = 0; f < faces.size(); ++f) {
    check(f);
    for (std::size_t k = 0; k < 3; ++k) {
      std::uint32_t& v = indices[3 * f + k];
      if (faces[f].side == 0.0F || sides[v] == faces[f].side) continue;
      const auto [found, added] = copies.try_emplace(v, count + static_cast<std::uint32_t>(origins.size()));
      if (added) origins.push_back(v);
      v = found->second;
    }
  }
  return sides;
}

}  // namespace

glm::vec3 any_perpendicular(const glm::vec3& normal) {
  const glm::vec3 axis = std::abs(normal.x) < 0.6F ? glm::vec3(1, 0, 0) : glm::vec3(0, 1, 0);
  return glm::normalize(glm::cross(normal, axis));
}

std::vector<glm::vec4> make_tangents(std::vector<std::uint32_t>& indices, const std::vector<glm::vec3>& positions,
                                     const std::vector<glm::vec3>& normals, const std::vector<glm::vec2>& uvs,
                                     std::vector<std::uint32_t>& origins,
                                     const std::function<void(std::size_t turn)>& check) {
  const std::vector<Face> faces = texture_faces(indices, positions, uvs, check);
  // Sums for all vertices that count as one, by orientation.
  Sums sums(std::min(2 * positions.size(), indices.size()));
  const auto corner = [&](std::uint32_t vertex, float side) {
    return Corner{positions[vertex], normals[vertex], uvs[vertex], side};
  };
  for (std::size_t f = 0; f < faces.size(); ++f) {
    check(f);
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
  const std::vector<float> sides = part_sides(indices, faces, count, origins, check);
  std::vector<glm::vec4> tangents(count + origins.size());
  for (std::size_t v = 0; v < tangents.size(); ++v) {
    check(v);
    const bool copy = v >= count;
    const std::uint32_t original = copy ? origins[v - count] : static_cast<std::uint32_t>(v);
    const float first = sides[original] == 0.0F ? 1.0F : sides[original];
    const float side = copy ? -first : first;
    const glm::vec3* found = sums.find(corner(original, side));
    const float length = found == nullptr ? 0.0F : glm::length(*found);
    const glm::vec3 direction = length > 0.0F ? *found / length : any_perpendicular(normals[original]);
    // glTF's v grows downward in the image, its bitangent cross(n, t) * w points upward.
    tangents[v] = glm::vec4(direction, -side);
  }
  return tangents;
}

}  // namespace cumulet::surface::detail
