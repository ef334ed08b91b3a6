#pragma once

#include <algorithm>
#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "base/progress_part.hpp"
#include "grid/rgb_field.hpp"
#include "grid/statistics.hpp"

namespace cumulet::grid {

/// Refinement criterion: the error indicator of a cell that is compared with the threshold. s is the standard deviation
/// that the cell leaves, e its longest edge, and d the mean optical depth of the volume's rays.
///
///  - deviation: s e / d.
///  - range_mean: (max - min) / mean, as in the paper.
///  - transmittance: s e weighted by visibility: T^2 s e / (1 + r m e) / (1 - exp(-d)). Extinctions use
///    RefineSettings::density_scale. m is the cell's mean, r the reduced extinction (hiding()), and T the transmittance
///    from outside to the cell (Transmittance of r). T^2 is the two-way transmittance. The first divisor is there
///    because only the front of an opaque cell is visible, the second because the opacity in an image saturates. In
///    thin media this equals deviation. Emission has one-way transmittance: 1.2 T s e, divided by the mean depth of the
///    strongest component, or of the luminance.
enum class Criterion { deviation = 0, range_mean = 1, transmittance = 2 };
enum class CellKind { linear, constant };

/// A pinhole camera for adaptive refinement, in world space.
struct RefineCamera {
  glm::dvec3 eye{0.0};
  glm::dvec3 forward{0.0, 0.0, -1.0};  ///< unit vectors: forward, right and up
  glm::dvec3 right{1.0, 0.0, 0.0};
  glm::dvec3 up{0.0, 1.0, 0.0};
  double tan_half_x = 0.5;
  double tan_half_y = 0.5;
  double pixels_per_radian = 1000.0;  ///< image height / (2 tan_half_y)
  /// Instance transforms (affine) from the volume's world space to the camera's. The grid is refined for the instance
  /// that needs the finest cells.
  std::vector<glm::dmat4> transforms{glm::dmat4(1.0)};
  bool operator==(const RefineCamera&) const = default;
};

/// Returns the reduced extinction of a grid value, by similarity theory: forward scattering does not count. anisotropy:
/// mean cosine of the phase function.
inline double hiding(double density_scale, double anisotropy) {
  return density_scale * (1.0 - std::max(anisotropy, 0.0));
}

struct RefineSettings {
  Criterion criterion = Criterion::deviation;
  CellKind cells = CellKind::linear;
  double threshold = 0.02;  ///< negative: split every cell that is not uniform, down to the voxel
  // Medium; used by Criterion::transmittance.
  double density_scale = 1.0;
  double anisotropy = 0.0;
  std::uint64_t max_cells = 5'400'000;
  std::optional<RefineCamera> camera;  ///< if set: no split outside its frustum or below pixel_size (ViewLevels)
  double pixel_size = 1.0;             ///< pixels that the longest edge of a splitting level must cover
  bool operator==(const RefineSettings&) const = default;
};

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
  /// glsl/lattice.glsl, in no particular order.
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
