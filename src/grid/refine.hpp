#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <span>
#include <vector>

#include "base/progress_part.hpp"
#include "grid/channel_table.hpp"
#include "grid/refine_settings.hpp"
#include "grid/statistics.hpp"

namespace cumulet::grid {

class Evaluation;
class Evaluations;
struct OwnPriorities;
class ViewLevels;

/// The set of diamonds to split, each named by the vertex that its split creates.
///
/// All cells that share a refinement edge split together (a diamond), at the edge's middle: an integer point that
/// belongs to no other diamond. Let h = 2^(trailing zeros common to the three coordinates). The number of coordinates
/// that are odd multiples of h gives the class: 3 the middle of a cube (class B cells), 2 of a face (C), 1 of an edge
/// (A). The cells of a diamond exist when the 2 to 4 diamonds one level up are split (Weiss and De Floriani, "Diamond
/// hierarchies", 2010). So a set that is closed under "parents of a diamond" gives a conforming grid, in any order of
/// splits. Each vertex has a priority, and a parent's priority is raised to the maximum of its children's. Then all
/// vertices above any threshold priority form such a closed set.
class DiamondSet {
 public:
  /// Evaluates the criterion for every cell of the statistics, in parallel. O(active nodes). progress: as for
  /// Statistics; the fraction ends at progress_part, and GridBuilder::bisect continues from there. channels: their
  /// fields cause splits as density does. If channels has anisotropy, the larger of its mean and the settings'
  /// anisotropy is used.
  DiamondSet(const Statistics& statistics, const Channels& channels, const RefineSettings& settings,
             Progress* progress = nullptr);
  DiamondSet(const Statistics& statistics, const RefineSettings& settings, Progress* progress = nullptr)
      : DiamondSet(statistics, {}, settings, progress) {}

  /// Builds the set from stored priorities, with this view and cell budget. The result equals that of the constructor
  /// above with the settings of `own`. levels: OwnPriorities::levels() of the view.
  DiamondSet(const OwnPriorities& own, std::span<const std::uint8_t> levels, std::uint64_t max_cells,
             Progress* progress = nullptr);

  DiamondSet(DiamondSet&&) noexcept;
  DiamondSet& operator=(DiamondSet&&) noexcept;
  ~DiamondSet();

  static constexpr double progress_part = 0.6;

  /// Number of cells of the grid.
  [[nodiscard]] std::uint64_t cell_count() const { return cells_; }
  /// True if max_cells, not the threshold, ended the refinement.
  [[nodiscard]] bool limited() const { return limited_; }
  /// Returns the blocks of 8^3 lattice points that hold all vertices with a non-zero priority, packed as in
  /// glsl/grid/lattice.glsl, in no particular order.
  [[nodiscard]] std::vector<glm::uvec2> blocks(const Progress* progress = nullptr) const;

 private:
  friend class DiamondCursor;
  struct Block;
  struct Blocks;
  class Raiser;

  void evaluate(const Evaluations& evaluations, const ViewLevels& view, double floor_squared, Progress* progress,
                double from, double to);
  // Evaluates the nodes of one size.
  void evaluate(const Evaluation& evaluation, const ViewLevels& view, int size, float floor, ProgressPart& part);
  void close(Progress* progress, double from, double to);
  void close_octave(int octave, int odd_coordinates, const std::vector<Block*>& blocks, const Progress* progress);
  void close_block(const Block& block, int octave, int odd_coordinates);
  // Raises the parents of vertex v, whose odd coordinates are odd multiples of 2^octave.
  void raise_parents(Raiser& raise, const glm::ivec3& v, const glm::ivec3& odd, int octave,
                     std::uint16_t priority) const;
  void choose_cut(std::uint64_t max_cells, const Progress* progress);
  [[nodiscard]] std::vector<Block*> blocks_of(int scale, const Progress* progress) const;

  int log2_size_;
  std::unique_ptr<Blocks> blocks_;
  std::uint16_t cut_ = 1;
  std::uint64_t cells_ = 24;
  bool limited_ = false;
};

/// Looks up diamonds. It caches the last block, so lookups of nearby vertices are cheap. Use one cursor per thread.
class DiamondCursor {
 public:
  explicit DiamondCursor(const DiamondSet& set) : set_(&set) {}
  [[nodiscard]] bool is_split(const glm::ivec3& vertex);

 private:
  const DiamondSet* set_;
  std::uint64_t key_ = ~std::uint64_t{0};
  const DiamondSet::Block* block_ = nullptr;
};

}  // namespace cumulet::grid
