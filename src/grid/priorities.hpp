#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "base/progress.hpp"
#include "grid/cell.hpp"
#include "grid/channel_table.hpp"
#include "grid/own_measure.hpp"
#include "grid/refine_settings.hpp"
#include "grid/statistics.hpp"
#include "grid/view_levels.hpp"

namespace cumulet::grid {

/// Number of points of a brick's 9^3 at which the cells of its first levels split, by number of levels.
inline constexpr std::array<unsigned, brick_levels + 1> points_of_levels{CM_POINTS_OF_LEVELS};
/// Split points of a brick, level by level. For a larger cube they are scaled with its size.
using BrickPoints = std::array<glm::u8vec3, CM_BRICK_POINTS>;
const BrickPoints& brick_points();

/// Maps each of a brick's 9^3 points, x first, to its index in brick_points().
using BrickPointIndices = std::array<std::uint16_t, 9 * 9 * 9>;
const BrickPointIndices& brick_point_indices();

/// GPU-resident bricks. glsl/grid/own_priorities.comp computes their priorities on the GPU.
struct BricksToRate {
  /// Nodes in which this field varies, as numbers relative to first_node. The priority of a node's vertex is the
  /// maximum over its fields.
  struct Field {
    OwnMeasure measure;
    std::vector<std::uint32_t> nodes;
  };
  std::size_t first_node = 0;  ///< these bricks are the last nodes of OwnPriorities::nodes
  std::vector<Field> fields;   ///< density; then the fields of the channels, in the order of Evaluations
  std::vector<float> lit;      ///< transmittance to each node's 64 blocks; empty: 1 everywhere
  std::size_t values = 0;      ///< number of priorities of all these bricks, after OwnPriorities::values
  std::array<float, CM_BRICK_EDGES> edges_squared{};

  [[nodiscard]] std::uint64_t bytes() const {
    std::uint64_t words = lit.size();
    for (const Field& field : fields) words += field.nodes.size();
    return 4 * words;
  }
};

/// View-independent priorities of splits. It has an entry for each octree cube in which a split is worthwhile. The
/// entry has the 16-bit priorities that the cube's own cells give to their split vertices, down to the last level with
/// any. A view only limits the number of levels per cube. Memory: at most 2 bytes per point of 9^3 per brick.
struct OwnPriorities {
  /// Layout: glsl/grid/lattice.glsl.
  using Node = glm::uvec3;

  /// Contains everything above the settings' threshold. The camera and the cell budget are not used. Runs in parallel.
  /// progress: as for DiamondSet.
  OwnPriorities(const Statistics& statistics, const Channels& channels, const RefineSettings& settings,
                Progress* progress = nullptr);

  int log2_size;
  std::vector<Node> nodes;
  std::vector<std::uint16_t> values;  ///< priorities of all nodes except those in to_rate
  BricksToRate to_rate;

  /// Returns for each node how many levels of its cells may split and have priorities: 0 to brick_levels. O(nodes).
  [[nodiscard]] std::vector<std::uint8_t> levels(const ViewLevels& view, const Progress* progress = nullptr) const;
  /// Returns the levels for a moving camera: at least those of these settings, and those of `before` as far as
  /// with_slack() allows them.
  [[nodiscard]] std::vector<std::uint8_t> levels(const Cube& cube, const RefineSettings& settings,
                                                 std::span<const std::uint8_t> before,
                                                 const Progress* progress = nullptr) const;
  /// Calls visit(vertex, priority) for the priorities of a node's first `levels` levels. For a brick of to_rate it
  /// visits all split points, with priority 1.
  template <class Visit>
  void for_each(const Node& node, unsigned levels, Visit&& visit) const;
  [[nodiscard]] std::uint64_t bytes() const {
    return nodes.size() * sizeof(Node) + values.size() * 2 + to_rate.bytes();
  }
  [[nodiscard]] std::size_t all_values() const { return values.size() + to_rate.values; }

 private:
  // bricks: corners of the bricks in which any field varies.
  void plan_to_rate(const class Evaluations& evaluations, const std::vector<glm::ivec3>& bricks, float floor);
};

template <class Visit>
void OwnPriorities::for_each(const Node& node, unsigned levels, Visit&& visit) const {
  const BrickPoints& points = brick_points();
  const glm::ivec3 corner = core::cm_node_corner(node);
  const int finer = static_cast<int>(core::cm_node_size(node)) - 3;
  const bool known = node.z < values.size();
  for (unsigned i = 0; i < points_of_levels[levels]; ++i) {
    if (!known) {
      visit(corner + (glm::ivec3(points[i]) << finer), std::uint16_t{1});
    } else if (values[node.z + i] != 0) {
      visit(corner + (glm::ivec3(points[i]) << finer), values[node.z + i]);
    }
  }
}

}  // namespace cumulet::grid
