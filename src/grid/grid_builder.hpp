#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "base/progress_part.hpp"
#include "grid/channel_table.hpp"
#include "grid/refine.hpp"
#include "grid/statistics.hpp"
#include "grid/tet_grid.hpp"

namespace cumulet::grid {

/// Bisects the control cube at the set's diamonds, links neighbors while doing so, and fits densities. The result does
/// not depend on the number of threads. O(cells).
class GridBuilder {
 public:
  GridBuilder(const Statistics& statistics, const DiamondSet& diamonds);
  /// Throws Error(unsupported) for more than 2^31 nodes. progress, here and below: as for Statistics. After a cancelled
  /// bisect() the builder is unusable; after a cancelled records() that function may be called again.
  void bisect(Progress* progress = nullptr);
  /// channels: the cells' other fields, over the same cube.
  TetGrid records(CellKind cells, float max_value, const Channels& channels, Progress* progress = nullptr);
  TetGrid records(CellKind cells, float max_value, Progress* progress = nullptr) {
    return records(cells, max_value, {}, progress);
  }

 private:
  // A vertex: 16 bits of each coordinate, and 5 more of each in one word.
  struct Vertex {
    std::array<std::uint16_t, 3> low{};
    std::uint16_t high = 0;
    Vertex() = default;
    explicit Vertex(const glm::vec3& at);
    explicit operator glm::vec3() const;
    bool operator==(const Vertex&) const = default;
  };
  struct Node {
    std::array<std::uint32_t, 4> links;
    std::uint32_t child;  // 0: a leaf
    Vertex v0;
    std::uint16_t shape;
    std::uint16_t heap : 12;        // index in the brick's tree, 0 above bricks
    std::uint16_t permutation : 4;  // of that tree
  };
  static_assert(sizeof(Node) == 32);

  void make_roots();
  void split_level(std::uint32_t first, std::uint32_t last, ProgressPart& part);
  // Marks those of these nodes that split; returns their number.
  std::uint32_t mark_splits(std::uint32_t first, std::uint32_t last);
  void make_child(std::uint32_t parent, unsigned side);
  [[nodiscard]] std::uint32_t behind_whole(std::uint32_t other, std::uint32_t cell) const;
  [[nodiscard]] std::uint32_t resolve(std::uint32_t from, unsigned face) const;
  void order(Progress* progress);
  // Fills the roots and the tree of point location.
  void number_nodes(TetGrid& grid, ProgressPart& part) const;
  class LeafMoments;
  class LeafDensity;
  class LeafCorners;
  class LeafVoxels;
  class LeafChannels;
  // fit: mean and gradient, in units of the grid's density_unit.
  [[nodiscard]] CellRecord record(std::uint32_t index, const glm::vec4& fit, bool emits) const;

  const Statistics* statistics_;
  const DiamondSet* diamonds_;
  std::vector<Node> nodes_;
  std::vector<std::uint32_t> level_first_;
  std::vector<std::uint32_t> leaves_below_;
  std::vector<std::uint32_t> first_leaf_;
  std::vector<std::uint32_t> leaf_nodes_;
};

}  // namespace cumulet::grid
