#pragma once

// Private to surface/: primitives as triangles, before they are posed.

#include <functional>
#include <glm/glm.hpp>

#include "surface/accessors.hpp"
#include "surface/scene.hpp"

namespace cumulet::surface::detail {

/// Displacements, a vertex each; empty: none.
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
  std::vector<glm::vec4> tangents;  ///< empty: the material has no normal map, nor has that of a variant
  bool flat = false;                ///< normals are the triangles', of which no two share a vertex
  std::size_t influences = 0;       ///< a vertex, of a skin
  std::vector<std::uint32_t> joints;
  std::vector<float> weights;     ///< of a vertex add up to 1
  std::uint32_t joint_count = 0;  ///< that a skin must have
  std::vector<MorphTarget> targets;
  std::vector<glm::vec3> velocities;  ///< a second, at rest; empty: none
  glm::vec3 low{0.0F};                ///< bounds of the positions
  glm::vec3 high{0.0F};
};

/// What of a file is not drawn as it was meant, for one line each.
struct MeshRemarks {
  std::size_t not_triangles = 0;     ///< primitives of points and lines
  std::size_t incomplete = 0;        ///< primitives with indices left over
  std::size_t not_finite = 0;        ///< primitives with normals, tangents, coordinates or colours that are not
  std::size_t without_data = 0;      ///< primitives in buffers that name no data
  std::size_t without_elements = 0;  ///< primitives with an accessor that has a count of 0
  std::size_t unbound = 0;           ///< primitives under a node with a skin that no joint holds
};

/// All primitives of a mesh that draw triangles, in a file of so many variants. Throws Error(file).
std::vector<MeshPart> import_mesh(const GltfFile& file, std::size_t mesh, const std::vector<Material>& materials,
                                  std::size_t variants, Budget& budget, MeshRemarks& remarks);

/// Triangles of a triangle list, strip or fan (glTF 2.0, 3.7.2.1), without those that name a vertex twice.
std::vector<std::uint32_t> triangles(const std::vector<std::uint32_t>& indices, int mode);

/// Renumbers a part's indices, of `count` vertices, to vertices of its own: those that they name or, if it is flat,
/// three a triangle. Returns which each of them was.
std::vector<std::uint32_t> own_vertices(MeshPart& part, std::size_t count);

/// Gives normals unit length; those of none become the average of the triangles around.
void make_unit(MeshPart& part);

/// Tangents where a normal map has none: per triangle the direction in which u grows, perpendicular to the vertex
/// normal, averaged over the triangles around a vertex by their angle there; w such that the bitangent points against
/// growing v, up in the image (glTF 2.0, 3.9.3). Vertices that agree in position, normal and coordinates count as one.
/// One whose triangles are not all of the same side is split: indices of one side go to a copy, `origins` says of which
/// vertex each copy is, and the tangents returned are those of all vertices, then of the copies. (As M. Mikkelsen's
/// tangent space, which also tells apart triangles around a vertex that share no edge.) check may throw.
std::vector<glm::vec4> make_tangents(
    std::vector<std::uint32_t>& indices, const std::vector<glm::vec3>& positions, const std::vector<glm::vec3>& normals,
    const std::vector<glm::vec2>& uvs, std::vector<std::uint32_t>& origins,
    const std::function<void(std::size_t turn)>& check = [](std::size_t) {});

/// Unit, perpendicular to a unit vector.
glm::vec3 any_perpendicular(const glm::vec3& normal);
inline bool finite(const glm::vec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

}  // namespace cumulet::surface::detail
