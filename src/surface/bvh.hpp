#pragma once

// A tree of boxes over triangles, for the rays of glsl/bvh.glsl. No GL.

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "base/progress.hpp"
#include "surface/scene.hpp"

namespace cumulet::surface {

/// What a triangle is to rays, one word each: CM_TRIANGLE_* of glsl/bvh.glsl.
struct TriangleFlags {
  static constexpr std::uint32_t ask = 0x80000000U;        ///< alpha: the shader's cm_hit_accept decides
  static constexpr std::uint32_t one_sided = 0x40000000U;  ///< rays pass its back
  static constexpr std::uint32_t clockwise = 0x20000000U;  ///< its front is where its vertices turn clockwise
  static constexpr std::uint32_t left_out = 0x10000000U;   ///< not in the tree
  static constexpr std::uint32_t user = 0x0fffffffU;       ///< bits that come back with a hit as they are
};

/// The flags of a scene's triangles in the order of Scene::indices: user bits the number of the Draw; ask for
/// AlphaMode::mask and blend, and transmission; one_sided unless the material, or the pose, is double sided; clockwise
/// where the pose is flipped; left_out where it hides the draw.
std::vector<std::uint32_t> triangle_flags(const Scene& scene, const Pose& pose);

/// A binary bounding volume hierarchy, built by binned surface area heuristic (Wald, "On fast Construction of SAH-based
/// Bounding Volume Hierarchies", 2007) with leaves of 1 to 4 triangles. Both arrays go into texture buffers (RGBA32UI)
/// as they are.
///
/// No path through it has more than max_depth nodes, whatever the triangles: where the heuristic would go deeper, it
/// splits at the median. The same input gives the same bits, for any number of threads.
///
/// Triangles without area stay in the tree, for a later pose may give them one; no ray meets them. So do triangles with
/// a coordinate that is not finite or beyond 1e12 in size, as if they had no area.
///
/// Memory for n triangles: 48 n bytes of records and 20 n to 30 n of nodes; build() has 150 n in use at its most.
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
    std::uint32_t triangle;  ///< its number in the indices
    glm::vec3 v1;
    std::uint32_t flags;
    glm::vec3 v2;
    std::uint32_t spare;  ///< 1: a coordinate is not finite or too large, the corners are put to 0
  };
  static_assert(sizeof(Node) == 64 && sizeof(Record) == 48);

  /// A tree that no ray hits.
  Bvh();

  /// Triangle i has the corners indices[3 i .. 3 i + 2] and the word flags[i]; no flags: all 0. Throws
  /// Error(invalid_argument) for sizes that do not match or an index out of range, Error(unsupported) for more than
  /// max_triangles, Error(cancelled). O(n log n), on TBB's threads.
  static Bvh build(std::span<const PosedVertex> vertices, std::span<const std::uint32_t> indices,
                   std::span<const std::uint32_t> flags = {}, const Progress* progress = nullptr);

  /// The same tree over moved vertices: boxes grow and shrink with their triangles, so hits are right, if slower where
  /// triangles have moved apart (see cost()). The indices and flags are those of build(). Throws
  /// Error(invalid_argument) for another number of indices or one out of range; the tree is then as it was. Throws
  /// Error(cancelled), and the tree is then of no use. O(n), on TBB's threads.
  void refit(std::span<const PosedVertex> vertices, std::span<const std::uint32_t> indices,
             const Progress* progress = nullptr);

  /// The surface area heuristic's estimate for a ray that meets the root's box: nodes visited plus triangles tested,
  ///   1 + sum over child boxes c of A(c) / A(root) * (1 for a node, its triangles for a leaf).
  /// 0 for an empty tree or one without area. To judge a refit: build anew when it has grown by half. O(n).
  [[nodiscard]] double cost() const;

  /// At least one node.
  [[nodiscard]] std::span<const Node> nodes() const { return nodes_; }
  [[nodiscard]] std::span<const Record> records() const { return records_; }
  /// Nodes on the longest path. O(n).
  [[nodiscard]] int depth() const;

 private:
  // Nodes [begin, end), children of each other and of records alone. The nodes between are above them.
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
  std::vector<Part> parts_;      // in order
  std::size_t triangles_ = 0;
};

}  // namespace cumulet::surface
