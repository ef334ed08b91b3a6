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

/// What is compared with the threshold. Standard deviations are those that a cell leaves, s; its longest edge is e, and
/// d the mean optical depth of the volume's rays.
///
///  - deviation: s e / d.
///  - range_mean: (max - min) / mean, as in the paper.
///  - transmittance: what is seen of s e, with extinctions by RefineSettings::density_scale, where m is the cell's
///  mean,
///    r extinctions reduced by what is scattered forward (hiding()), and T what part of the light outside gets there
///    (Transmittance of r): T^2 s e / (1 + r m e) / (1 - exp(-d)).
///    Light comes in and goes out; of what is itself opaque the front is seen; and what a picture shows of a volume
///    saturates. In thin media it is the deviation. What cells give off only goes out: 1.2 T s e,
///    against the mean ray's of the strongest component, or of luminance.
enum class Criterion { deviation = 0, range_mean = 1, transmittance = 2 };
enum class CellKind { linear, constant };

/// A pinhole camera for adaptive refinement, in world space.
struct RefineCamera {
  glm::dvec3 eye{0.0};
  glm::dvec3 forward{0.0, 0.0, -1.0};  ///< unit, as are right and up
  glm::dvec3 right{1.0, 0.0, 0.0};
  glm::dvec3 up{0.0, 1.0, 0.0};
  double tan_half_x = 0.5;
  double tan_half_y = 0.5;
  double pixels_per_radian = 1000.0;  ///< image height / (2 tan_half_y)
  /// Affine: of the volume's world in the camera's. It is fitted to where it is seen best.
  std::vector<glm::dmat4> places{glm::dmat4(1.0)};
  bool operator==(const RefineCamera&) const = default;
};

/// What hides: extinction reduced by what is scattered forward, of a grid value. anisotropy: the phase function's mean
/// cosine.
inline double hiding(double density_scale, double anisotropy) {
  return density_scale * (1.0 - std::max(anisotropy, 0.0));
}

struct RefineSettings {
  Criterion criterion = Criterion::deviation;
  CellKind cells = CellKind::linear;
  double threshold = 0.02;  ///< negative: split whatever varies, down to the voxel
  // Of the medium, for transmittance.
  double density_scale = 1.0;
  double anisotropy = 0.0;
  std::uint64_t max_cells = 5'400'000;
  std::optional<RefineCamera> camera;  ///< set: no split outside its frustum or under pixel_size (ViewLevels)
  double pixel_size = 1.0;             ///< pixels that the longest edge of a cell's level must cover to be split
  bool operator==(const RefineSettings&) const = default;
};

class Evaluation;
class Evaluations;
struct OwnPriorities;
class ViewLevels;

/// The set of diamonds to split, each named by the vertex that its split makes.
///
/// All cells that share a refinement edge split together (a diamond), at the edge's middle: an integer point that
/// belongs to no other diamond. With h = 2^(trailing zeros common to the three coordinates), the number of coordinates
/// that are odd multiples of h tells the class: 3 the middle of a cube (class B cells), 2 of a face (C), 1 of an edge
/// (A). The cells of a diamond exist when the 2 to 4 diamonds one level up are split (Weiss and De Floriani, "Diamond
/// hierarchies", 2010). So a set that is closed under "parents of a diamond" gives a conforming grid, whatever the
/// order: each vertex carries a priority, a parent's is raised to the maximum of its children's, and every cut of the
/// priorities at one value is such a set.
class DiamondSet {
 public:
  /// Evaluates the criterion for every cell of the statistics, in parallel. O(active nodes). progress: as for
  /// Statistics; the fraction ends at progress_part, and GridBuilder::bisect goes on from there.
  /// channels: cells are split for them as they are for density. An anisotropy of theirs counts for the medium's, where
  /// it is larger.
  DiamondSet(const Statistics& statistics, const Channels& channels, const RefineSettings& settings,
             Progress* progress = nullptr);
  DiamondSet(const Statistics& statistics, const RefineSettings& settings, Progress* progress = nullptr)
      : DiamondSet(statistics, {}, settings, progress) {}

  /// Of priorities that were kept: what the constructor above makes of the settings that they were made with, with
  /// this camera and budget. levels: OwnPriorities::levels() of a view.
  DiamondSet(const OwnPriorities& own, std::span<const std::uint8_t> levels, std::uint64_t max_cells,
             Progress* progress = nullptr);

  DiamondSet(DiamondSet&&) noexcept;
  DiamondSet& operator=(DiamondSet&&) noexcept;
  ~DiamondSet();

  static constexpr double progress_part = 0.6;

  /// How many cells the grid has.
  [[nodiscard]] std::uint64_t cell_count() const { return cells_; }
  /// Whether max_cells, not the threshold, ended the refinement.
  [[nodiscard]] bool limited() const { return limited_; }
  /// The blocks of 8^3 lattice points that hold all whose priority is not 0, as glsl/lattice.glsl has them; in no
  /// order.
  [[nodiscard]] std::vector<glm::uvec2> blocks(const Progress* progress = nullptr) const;

 private:
  friend class DiamondCursor;
  struct Block;
  struct Blocks;
  class Raiser;

  void evaluate(const Evaluations& evaluations, const ViewLevels& view, double floor_squared, Progress* progress,
                double from, double to);
  // Of nodes of one size.
  void evaluate(const Evaluation& evaluation, const ViewLevels& view, int size, float floor, ProgressPart& part);
  void close(Progress* progress, double from, double to);
  void close_octave(int octave, int odd_coordinates, const std::vector<Block*>& blocks, const Progress* progress);
  void close_block(const Block& block, int octave, int odd_coordinates);
  // Of the vertex v, whose odd coordinates are odd multiples of 2^octave.
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

/// Looks diamonds up; remembers the last block, so neighbouring look-ups are cheap. One a thread.
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
