#pragma once

// Bounding volume hierarchy over triangles, for the rays of glsl/surface/bvh.glsl. Does not use GL.

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "base/progress.hpp"
#include "surface/scene.hpp"

namespace cumulet::surface {

/// Flags of a triangle for ray intersection, one word per triangle: CM_TRIANGLE_* of glsl/surface/bvh.glsl.
struct TriangleFlags {
  static constexpr std::uint32_t ask = 0x80000000U;        ///< alpha or transmission: the shader's cm_hit_accept
                                                           ///< accepts or rejects a hit
  static constexpr std::uint32_t one_sided = 0x40000000U;  ///< rays pass through its back side
  static constexpr std::uint32_t clockwise = 0x20000000U;  ///< its front is the side from which its vertices are in
                                                           ///< clockwise order
  static constexpr std::uint32_t left_out = 0x10000000U;   ///< not in the tree
  static constexpr std::uint32_t user = 0x0fffffffU;       ///< user bits, returned with a hit
};

/// Returns the flags of a scene's triangles, in the order of Scene::indices.
///   - user bits: index of the Draw.
///   - ask: AlphaMode::mask or blend, or may_be_clear().
///   - one_sided: neither the material nor the pose is double sided, and the material does not bound a volume.
///   - clockwise: the pose flips the draw.
///   - left_out: the pose hides the draw.
std::vector<std::uint32_t> triangle_flags(const Scene& scene, const Pose& pose);

/// A binary bounding volume hierarchy, built by binned surface area heuristic (Wald, "On fast Construction of SAH-based
/// Bounding Volume Hierarchies", 2007) with leaves of 1 to 4 triangles. Both arrays are uploaded unchanged to texture
/// buffers (RGBA32UI).
///
/// No path has more than max_depth nodes: where the heuristic would go deeper, the builder splits at the median. The
/// result is deterministic, for any number of threads.
///
/// Triangles without area stay in the tree, because a later pose may give them one; no ray hits them. Triangles with a
/// coordinate that is not finite or beyond 1e12 in size are treated in the same way.
///
/// Memory for n triangles: 48 n bytes of records and 20 n to 30 n of nodes; build() uses 150 n at its peak.
class Bvh {
 public:
  static constexpr int max_depth = 24;
  static constexpr std::uint32_t max_leaf = 4;
  static constexpr std::uint32_t leaf_bit = 0x80000000U;
  static constexpr std::size_t max_triangles = std::size_t{max_leaf} << unsigned{max_depth};

  /// Four texels.
  struct Node {
    struct Child {
      glm::vec3 low;
      std::uint32_t link;  ///< a node; or leaf_bit | (triangles - 1) << 29 | first record
      glm::vec3 high;
      std::uint32_t spare;
    };
    std::array<Child, 2> child;
  };
  /// Three texels.
  struct Record {
    glm::vec3 v0;
    std::uint32_t triangle;  ///< index of the triangle in the index array
    glm::vec3 v1;
    std::uint32_t flags;
    glm::vec3 v2;
    std::uint32_t spare;  ///< 1: a coordinate is not finite or too large; all corners are set to 0
  };
  static_assert(sizeof(Node) == 64 && sizeof(Record) == 48);

  /// Creates a tree that no ray hits.
  Bvh();

  /// Builds a tree in which triangle i has the corners indices[3 i .. 3 i + 2] and the word flags[i]; without flags all
  /// words are 0. Throws Error(invalid_argument) for sizes that do not match or an index out of range. Throws
  /// Error(unsupported) for more than max_triangles, and Error(cancelled). O(n log n), on TBB's threads.
  static Bvh build(std::span<const PosedVertex> vertices, std::span<const std::uint32_t> indices,
                   std::span<const std::uint32_t> flags = {}, const Progress* progress = nullptr);

  /// Updates the boxes for moved vertices and keeps the topology. Hits remain exact, but traversal is slower where
  /// triangles have moved away from each other (see cost()). The indices and flags must be those of build(). Throws
  /// Error(invalid_argument) for another number of indices or one out of range, and then leaves the tree unchanged.
  /// Throws Error(cancelled), after which the tree is unusable. O(n), on TBB's threads.
  void refit(std::span<const PosedVertex> vertices, std::span<const std::uint32_t> indices,
             const Progress* progress = nullptr);

  /// Returns the surface area heuristic's estimate for a ray that hits the root's box: nodes visited plus triangles
  /// tested,
  ///   1 + sum over child boxes c of A(c) / A(root) * (1 for a node, its triangles for a leaf).
  /// Returns 0 for an empty tree or one without area. Rebuild a refitted tree if the cost has grown by half. O(n).
  [[nodiscard]] double cost() const;

  /// There is at least one node.
  [[nodiscard]] std::span<const Node> nodes() const { return nodes_; }
  [[nodiscard]] std::span<const Record> records() const { return records_; }
  /// Number of nodes on the longest path. O(n).
  [[nodiscard]] int depth() const;

 private:
  // Nodes [begin, end) of a self-contained subtree: links inside it lead only to its own nodes and to records. Nodes
  // between parts are ancestors of parts.
  struct Part {
    std::uint32_t begin;
    std::uint32_t end;
  };
  class Builder;
  struct Bounds;

  [[nodiscard]] Bounds bounds_of(std::uint32_t link) const;
  void fit(std::uint32_t node);

  std::vector<Node> nodes_;      // depth first
  std::vector<Record> records_;  // in the order of the leaves
  std::vector<Part> parts_;      // in ascending order
  std::size_t triangles_ = 0;
};

}  // namespace cumulet::surface
