#pragma once

// Evaluates the refinement criterion for every cell that a grid may have. The results are the priorities of splits
// before the closure of the diamond set.

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <vector>

#include "grid/cell.hpp"
#include "grid/channel_table.hpp"
#include "grid/own_measure.hpp"
#include "grid/refine_settings.hpp"
#include "grid/statistics.hpp"
#include "grid/transmittance.hpp"
#include "grid/view_levels.hpp"

namespace cumulet::grid {

/// Returns the high half of a positive float, which sorts like the float: 7 bits of mantissa, steps below one percent.
/// Minimum: 1.
inline std::uint16_t quantize(double squared) {
  const auto bits = std::bit_cast<std::uint32_t>(static_cast<float>(squared));
  return static_cast<std::uint16_t>(std::max<std::uint32_t>(bits >> 16U, 1));
}

/// World-space length of the refinement edge of every shape, by class and frame: |M edge|.
class EdgeLengths {
 public:
  explicit EdgeLengths(const glm::dmat4& to_world) : linear_(to_world) {}
  [[nodiscard]] double operator()(std::uint32_t shape) const {
    return glm::length(linear_ * glm::dvec3(core::cm_cell_vertex(glm::vec3(0.0F), shape, 1)));
  }

 private:
  glm::dmat3 linear_;
};

/// Weights of a field's deviations in the criterion.
struct Weights {
  double per_depth = 0.0;   ///< factor for deviation times edge length
  double own_hiding = 0.0;  ///< reduced (similarity-scaled) extinction per grid value, for a cell's occlusion of
                            ///< itself; 0: none
  bool two_way = true;      ///< true: two-way transmittance, for density; false: one-way, for emission

  /// depth: mean optical depth of a ray per unit extinction scale.
  static Weights of_density(double depth, const RefineSettings& settings);
  /// depth: mean of each component's integral along a ray. component: 0 to 2.
  static Weights of_emission(const glm::dvec3& depth, int component, const RefineSettings& settings);
};

/// Computes the squared criterion of a cell.
class Measure {
 public:
  Measure(const Weights& weights, const RefineSettings& settings)
      : criterion_(settings.criterion),
        cells_(settings.cells),
        scale_(static_cast<float>(weights.per_depth * weights.per_depth)),
        own_hiding_(static_cast<float>(weights.own_hiding)),
        two_way_(weights.two_way) {}

  /// Returns an upper bound for all cells of a region whose values lie in [min, max]: a variance is at most a quarter
  /// of the range squared. lit: maximum transmittance of the region.
  [[nodiscard]] float bound(float min, float max, float edge_squared, float lit) const;
  /// Returns an upper bound for all cells of a level. variance: maximum over these cells of variance times squared edge
  /// length. left: the same maximum for the variance that a linear fit leaves.
  [[nodiscard]] float bound_of_steepest(float variance, float left, float lit) const;
  [[nodiscard]] OwnMeasure numbers(float floor) const {
    return {scale_, own_hiding_, floor, has_fits(cells_), two_way_, criterion_};
  }
  /// covariance: of position and density in the cell's frame, per unit. A result that is not above the floor may be
  /// inexact.
  [[nodiscard]] float squared(std::uint32_t cell_class, float mean, float variance, const glm::vec3& covariance,
                              float min, float max, float edge_squared, float lit, float floor) const;

 private:
  // lit: transmittance from outside to the cell.
  [[nodiscard]] float seen_squared(float lit) const { return two_way_ ? lit * lit * lit * lit : lit * lit; }

  Criterion criterion_;
  CellKind cells_;
  float scale_;
  float own_hiding_;
  bool two_way_;
};

/// The refinement criterion of one field.
class Evaluation {
 public:
  /// transmittance: of the density field; null: no occlusion.
  Evaluation(const Statistics& statistics, const Weights& weights, const Transmittance* transmittance,
             const RefineSettings& settings);

  [[nodiscard]] const Statistics& statistics() const { return *statistics_; }

  /// Returns the maximum number of levels of a brick's cells that may split, from the brick's summary.
  [[nodiscard]] unsigned levels_at_most(const Statistics::Node& brick, float floor) const;
  /// Returns the transmittance to each block of the brick; null without occlusion.
  [[nodiscard]] const float* lit(const Statistics::Node& brick) const {
    return transmittance_ != nullptr ? transmittance_->blocks(brick.corner) : nullptr;
  }
  [[nodiscard]] OwnMeasure measure(float floor) const { return measure_.numbers(floor); }

  /// Calls visit(vertex, squared) for every cell of a non-uniform node whose criterion is above the floor. A brick
  /// visits all its cells, a larger cube the first three levels of its Kuhn tetrahedra, the whole cube its roots.
  /// levels: only cells of that many first bisection levels are visited. sums: scratch memory.
  template <class Visit>
  void node(const Statistics::Node& node, unsigned levels, BrickSums& sums, float floor, Visit visit) const {
    if (node.log2_size == 3) {
      brick(node, levels, sums, floor, visit);
    } else if (node.log2_size < statistics_->cube().log2_size) {
      for (std::uint32_t permutation = 0; permutation < 6; ++permutation)
        kuhn_cell(node, permutation, levels, floor, visit);
    } else {
      for (unsigned root = 0; root < 24; ++root) {
        glm::vec3 v0;
        std::uint32_t shape = 0;
        core::cm_root_cell(root, static_cast<std::uint32_t>(node.log2_size - 1), v0, shape);
        cell(v0, shape, levels, 1.0F, floor, visit);
      }
    }
  }

 private:
  template <class Visit>
  void brick(const Statistics::Node& node, unsigned levels, BrickSums& sums, float floor, Visit visit) const;
  // Evaluates one cell above bricks.
  template <class Visit>
  void cell(const glm::vec3& v0, std::uint32_t shape, unsigned levels, float lit, float floor, Visit visit) const;
  // Evaluates a Kuhn cell (B) of a node above bricks, its two halves (C) and its four quarters (A).
  template <class Visit>
  void kuhn_cell(const Statistics::Node& node, std::uint32_t permutation, unsigned levels, float floor,
                 Visit visit) const;

  const Statistics* statistics_;
  const Transmittance* transmittance_;
  Measure measure_;
  EdgeLengths edge_length_;
  std::array<std::array<float, 512>, 48> edge_squared_{};  // squared edge lengths of each brick tree's nodes
  std::array<float, 9> longest_{};                         // maximum of edge_squared_ per level
};

/// Returns the squared lengths of a brick's refinement edges, CM_LEVEL_EDGES per level (glsl/grid/brick_summary.glsl).
std::array<float, CM_BRICK_EDGES> brick_edges(const glm::dmat4& to_world);

/// A field that can cause cells to split.
struct EvaluatedField {
  const Statistics* field;
  std::optional<int> light;  ///< component of emission, 0 to 2; nullopt: weighted like density
};
/// Returns density (or its two shutter ends) and the fields of the channels, in the order of Evaluations.
std::vector<EvaluatedField> evaluated_fields(const Statistics& density, const Channels& channels);

/// The criteria of all fields that can cause cells to split: density and its channels.
class Evaluations {
 public:
  /// statistics: of density. All fields must outlive this object. Throws Error(cancelled) if progress is cancelled.
  Evaluations(const Statistics& statistics, const Channels& channels, const RefineSettings& settings,
              const Progress* progress = nullptr);
  [[nodiscard]] auto begin() const { return all_.begin(); }
  [[nodiscard]] auto end() const { return all_.end(); }
  /// Null: no occlusion.
  [[nodiscard]] const Transmittance* transmittance() const { return transmittance_.get(); }

 private:
  std::unique_ptr<const Transmittance> transmittance_;
  std::vector<Evaluation> all_;
};

/// Centroid of a cell, in cube space.
inline glm::dvec3 centroid_of(const glm::vec3& v0, std::uint32_t shape) {
  const glm::vec3 in_frame = core::cm_frame_centroid(core::cm_shape_class(shape)) * core::cm_shape_unit(shape);
  return glm::dvec3(v0) + glm::dvec3(core::cm_from_frame(in_frame, shape));
}
/// Midpoint of a cell's refinement edge, in cube space.
inline glm::ivec3 midpoint_of(const glm::vec3& v0, std::uint32_t shape) {
  const glm::vec3 in_frame = core::cm_frame_midpoint(core::cm_shape_class(shape)) * core::cm_shape_unit(shape);
  return {v0 + core::cm_from_frame(in_frame, shape)};
}

template <class Visit>
void Evaluation::brick(const Statistics::Node& node, unsigned levels, BrickSums& sums, float floor, Visit visit) const {
  using glm::ivec3;
  using glm::vec3;
  const int log2_size = statistics_->cube().log2_size;
  const int inside = std::clamp(static_cast<int>(levels) - kuhn_level(log2_size, node.log2_size), 0, 9);
  const unsigned last = 1U << static_cast<unsigned>(inside);
  BrickTransmittance lit;
  const ivec3 odd = (node.corner / 8) & 1;
  const auto signs = static_cast<unsigned>(odd.x + 2 * odd.y + 4 * odd.z);
  const float* blocks = transmittance_ != nullptr ? transmittance_->blocks(node.corner) : nullptr;
  const float most = blocks != nullptr ? *std::max_element(blocks, blocks + Transmittance::blocks_per_brick) : 1.0F;
  BrickField field;
  bool is_read = false;
  for (std::uint32_t permutation = 0; permutation < 6; ++permutation) {
    const Moments& whole = statistics_->kuhn(node, permutation);
    if (whole.min >= whole.max) continue;
    const BrickTree& tree = brick_tree(kuhn_frame(node.corner, 8, permutation));
    const auto& edges = edge_squared_[signs * 6 + permutation];
    // Edges shrink from level to level, so below some level no cell can exceed the floor.
    unsigned end = 1;
    while (end < last && measure_.bound(whole.min, whole.max, longest_[std::bit_width(end) - 1], most) > floor)
      end *= 2;
    if (end == 1) continue;
    if (!is_read) field.read(*statistics_, node);
    is_read = true;
    field.sum(tree, sums);
    if (blocks != nullptr) lit.compute(blocks, tree);
    for (unsigned h = 1; h < end; ++h) {
      if (sums.min[h] >= sums.max[h]) continue;
      const std::uint32_t shape = tree.shape[h];
      const float inverse_count = 1.0F / static_cast<float>(512U >> (static_cast<unsigned>(std::bit_width(h)) - 1U));
      const float shifted_mean = sums.mass[h] * inverse_count;
      const float variance = std::max(0.0F, sums.square[h] * inverse_count - shifted_mean * shifted_mean);
      const vec3 covariance =
          vec3(sums.x[h], sums.y[h], sums.z[h]) * inverse_count - tree.node_centroid[h] * shifted_mean;
      const float squared =
          measure_.squared(core::cm_shape_class(shape), sums.reference + shifted_mean, variance,
                           core::cm_to_frame(covariance, shape) * core::cm_shape_inverse_unit(shape), sums.min[h],
                           sums.max[h], edges[h], blocks != nullptr ? lit.most[h] : 1.0F, floor);
      if (squared > floor) visit(node.corner + ivec3(tree.midpoint[h]), squared);
    }
  }
}

template <class Visit>
void Evaluation::cell(const glm::vec3& v0, std::uint32_t shape, unsigned levels, float lit, float floor,
                      Visit visit) const {
  if (level_of(shape, statistics_->cube().log2_size) >= levels) return;
  const Moments m = statistics_->moments(v0, shape);
  const double edge = edge_length_(shape);
  const float squared = measure_.squared(
      core::cm_shape_class(shape), static_cast<float>(m.mean()), static_cast<float>(m.variance()),
      frame_covariance(m, shape, centroid_of(v0, shape)), m.min, m.max, static_cast<float>(edge * edge), lit, floor);
  if (squared > floor) visit(midpoint_of(v0, shape), squared);
}

template <class Visit>
void Evaluation::kuhn_cell(const Statistics::Node& node, std::uint32_t permutation, unsigned levels, float floor,
                           Visit visit) const {
  using glm::vec3;
  const int size = node.log2_size;
  const float lit = transmittance_ != nullptr ? transmittance_->most(node.corner, size) : 1.0F;
  vec3 v0(node.corner);
  for (int axis = 0; axis < 3; ++axis) {
    if (((node.corner[axis] >> size) & 1) != 0) v0[axis] += static_cast<float>(1 << size);
  }
  const std::uint32_t frame = kuhn_frame(node.corner, 1 << size, permutation);
  const std::uint32_t shape = frame | (1U << 9U) | (static_cast<std::uint32_t>(size) << 11U);
  cell(v0, shape, levels, lit, floor, visit);
  for (unsigned a = 0; a < 2; ++a) {
    const std::uint32_t child = core::cm_child_shape(shape, a);
    const vec3 child_v0 = a == 0 ? v0 : core::cm_cell_vertex(v0, shape, 1);
    cell(child_v0, child, levels, lit, floor, visit);
    for (unsigned b = 0; b < 2; ++b) {
      cell(b == 0 ? child_v0 : core::cm_cell_vertex(child_v0, child, 1), core::cm_child_shape(child, b), levels, lit,
           floor, visit);
    }
  }
}

}  // namespace cumulet::grid
