#pragma once

// Private to surface/: converts primitives to triangles, before posing.

#include <functional>
#include <glm/glm.hpp>

#include "surface/accessors.hpp"
#include "surface/scene.hpp"

namespace cumulet::surface::detail {

/// Displacements, one per vertex; empty: none.
struct MorphTarget {
  std::vector<glm::vec3> positions;
  std::vector<glm::vec3> normals;
  std::vector<glm::vec3> tangents;
};

/// The triangles of one primitive, at rest, in the space of its mesh.
struct MeshPart {
  std::uint32_t material = 0;
  std::vector<std::uint32_t> variants;  ///< its material in each variant of the file
  std::vector<std::uint32_t> indices;
  std::vector<VertexAttributes> attributes;
  std::vector<glm::vec3> positions;
  std::vector<glm::vec3> normals;   ///< unit; not used if flat
  std::vector<glm::vec4> tangents;  ///< empty: no material of the part, in any variant, needs tangents
  bool flat = false;                ///< normals are per triangle, and no two triangles share a vertex
  std::size_t influences = 0;       ///< skin joints per vertex
  std::vector<std::uint32_t> joints;
  std::vector<float> weights;     ///< sum to 1 per vertex
  std::uint32_t joint_count = 0;  ///< minimum number of joints of its skin
  std::vector<MorphTarget> targets;
  std::vector<glm::vec3> velocities;  ///< units per second, at rest; empty: none
  glm::vec3 low{0.0F};                ///< bounds of the positions
  glm::vec3 high{0.0F};
};

/// Counts of content that is not drawn as intended; each nonzero count is logged once.
struct MeshRemarks {
  std::size_t not_triangles = 0;     ///< primitives of points and lines
  std::size_t incomplete = 0;        ///< primitives with leftover indices
  std::size_t not_finite = 0;        ///< primitives with non-finite normals, tangents, coordinates or colors
  std::size_t without_data = 0;      ///< primitives in buffers that name no data
  std::size_t without_elements = 0;  ///< primitives with an accessor that has a count of 0
  std::size_t unbound = 0;           ///< primitives under a node with a skin, but without joints
};

/// Returns all primitives of a mesh that draw triangles. variants: number of the file's variants. Throws Error(file).
std::vector<MeshPart> import_mesh(const GltfFile& file, std::size_t mesh, const std::vector<Material>& materials,
                                  std::size_t variants, Budget& budget, MeshRemarks& remarks);

/// Converts a triangle list, strip or fan (glTF 2.0, 3.7.2.1) to a list. Triangles that name a vertex twice are
/// dropped.
std::vector<std::uint32_t> triangles(const std::vector<std::uint32_t>& indices, int mode);

/// Renumbers a part's indices, of `count` vertices, to its own vertices: those that it references or, if flat, three
/// per triangle. Returns the original index of each.
std::vector<std::uint32_t> own_vertices(MeshPart& part, std::size_t count);

/// Normalizes the normals. A zero normal becomes the average of the triangles around the vertex.
void make_unit(MeshPart& part);

/// Computes tangents for a normal map without them: per triangle the direction in which u grows, perpendicular to the
/// vertex normal, averaged over the triangles around a vertex, weighted by angle. w makes the bitangent point against
/// growing v, up in the image (glTF 2.0, 3.9.3).
///
/// Vertices with equal position, normal and coordinates count as one. A vertex between triangles of both orientations
/// is split: indices of one orientation go to a copy. `origins` receives the original vertex of each copy. The result
/// has the tangents of all vertices, then of the copies. M. Mikkelsen's tangent space also separates triangles around a
/// vertex that share no edge; this one does not. `check` may throw.
std::vector<glm::vec4> make_tangents(
    std::vector<std::uint32_t>& indices, const std::vector<glm::vec3>& positions, const std::vector<glm::vec3>& normals,
    const std::vector<glm::vec2>& uvs, std::vector<std::uint32_t>& origins,
    const std::function<void(std::size_t turn)>& check = [](std::size_t) {});

/// Returns a unit vector perpendicular to a unit vector.
glm::vec3 any_perpendicular(const glm::vec3& normal);
inline bool finite(const glm::vec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

}  // namespace cumulet::surface::detail
