#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "base/progress.hpp"
#include "grid/cell.hpp"
#include "grid/refine.hpp"
#include "grid/statistics.hpp"
#include "grid/view_levels.hpp"

namespace cumulet::grid {

/// Levels of cells inside a brick that may split, its Kuhn tetrahedra the first. Of cells of larger cubes the first
/// three are the cube's own.
inline constexpr unsigned brick_levels = CM_BRICK_LEVELS;
/// How many points of a brick's 9^3 the cells of its first levels split at.
inline constexpr std::array<unsigned, brick_levels + 1> points_of_levels{CM_POINTS_OF_LEVELS};
/// Those points, level by level; of a larger cube they are larger by as much.
using BrickPoints = std::array<glm::u8vec3, CM_BRICK_POINTS>;
const BrickPoints& brick_points();

/// Of a brick's 9^3 points, x first, which of brick_points() each is.
using PlacesOfBrickPoints = std::array<std::uint16_t, 9 * 9 * 9>;
const PlacesOfBrickPoints& places_of_brick_points();

/// Numbers of a criterion of density, as shaders are told them.
struct OwnMeasure {
  float scale = 0.0F;
  float own_hiding = 0.0F;
  float floor = 0.0F;  ///< no more is nothing
  bool linear = false;
  bool there_and_back = true;  ///< light passes what hides a cell twice
  Criterion criterion = Criterion::transmittance;
};

/// Bricks whose values are in GL, and so are to be the priorities that their cells give (glsl/own_priorities.comp).
struct BricksToRate {
  /// Its nodes, by number from first_node on, have the most of what each gives.
  struct Field {
    OwnMeasure measure;
    std::vector<std::uint32_t> nodes;
  };
  std::size_t first_node = 0;  ///< theirs are the last ones
  std::vector<Field> fields;   ///< density; red, green and blue of emission, if there is any
  std::vector<float> lit;      ///< of each node what part of the light gets to its blocks, 64 each; empty: all of it
  std::size_t values = 0;      ///< of all, from the end of those that are known on
  std::array<float, CM_BRICK_EDGES> edges_squared{};

  [[nodiscard]] std::uint64_t bytes() const {
    std::uint64_t words = lit.size();
    for (const Field& field : fields) words += field.nodes.size();
    return 4 * words;
  }
};

/// What does not depend on the view of which splits are worth it: of each cube of the octree in which any is, the
/// priorities that its own cells give the vertices that they split at, 16 bits each, as far down as there are any. A
/// view says how many levels of each cube count. 2 bytes a point of 9^3 a brick at most.
struct OwnPriorities {
  /// As shaders read it: glsl/lattice.glsl.
  using Node = glm::uvec3;

  /// Of all that is above the settings' threshold; not of their camera nor of their budget. In parallel. progress: as
  /// for DiamondSet.
  OwnPriorities(const Statistics& statistics, const Channels& channels, const RefineSettings& settings,
                Progress* progress = nullptr);

  int log2_size;
  std::vector<Node> nodes;
  std::vector<std::uint16_t> values;  ///< but those of
  BricksToRate to_rate;

  /// Of each node, how many levels of its cells may split and have priorities: 0 to brick_levels. O(nodes).
  [[nodiscard]] std::vector<std::uint8_t> levels(const ViewLevels& view, const Progress* progress = nullptr) const;
  /// The same in motion: no less than these settings want, and what there was before as far as with_slack() allows it.
  [[nodiscard]] std::vector<std::uint8_t> levels(const Cube& cube, const RefineSettings& settings,
                                                 std::span<const std::uint8_t> before,
                                                 const Progress* progress = nullptr) const;
  /// Calls visit(vertex, priority) for what a node's cells of that many levels give; of one to be rated for what they
  /// might, at 1.
  template <class Visit>
  void for_each(const Node& node, unsigned levels, Visit&& visit) const;
  [[nodiscard]] std::uint64_t bytes() const {
    return nodes.size() * sizeof(Node) + values.size() * 2 + to_rate.bytes();
  }
  [[nodiscard]] std::size_t all_values() const { return values.size() + to_rate.values; }

 private:
  // bricks: corners of those in which any of the fields varies.
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
