#pragma once

// Private to volume/: computes fields on a lattice whose voxels depend on nearby voxels of other fields.

#include <tbb/enumerable_thread_specific.h>

#include <atomic>
#include <deque>
#include <optional>
#include <span>
#include <vector>

#include "volume/import_detail.hpp"

namespace cumulet::volume::detail {

/// In voxels: positions that differ from a voxel's center only by rounding use the voxel's own value.
inline constexpr double alike = 1e-4;

/// The bricks and tiles of a field that overlap a box: indices into brick_origins, continued by indices into tiles.
using Items = std::vector<std::uint32_t>;

/// A field's values within a box, in cells of the size of a brick.
class Window {
 public:
  /// items: the bricks and tiles that overlap the box.
  Window(const ScalarVolume& field, const Box& box, const Items& items);

  [[nodiscard]] double voxel(glm::ivec3 p) const;
  /// Returns the constant value of a box inside the window, if it can be derived from cells without their voxels.
  [[nodiscard]] std::optional<double> constant(const Box& box) const;
  /// Interpolates trilinearly between voxel centers.
  [[nodiscard]] double at(const glm::dvec3& p) const;

 private:
  struct Cell {
    std::optional<std::size_t> first;  // index of its brick's first value
    float constant;
  };
  [[nodiscard]] std::size_t index_of(glm::ivec3 cell) const;

  const ScalarVolume* field_;
  glm::ivec3 low_, size_;
  std::vector<Cell> cells_;
};

/// Calls f(voxel, weight) for the voxels of a trilinear interpolation at p.
template <class F>
void for_each_corner(glm::dvec3 p, F&& f) {
  const glm::dvec3 nearest = glm::round(p);
  for (int axis = 0; axis < 3; ++axis) {
    if (std::abs(p[axis] - nearest[axis]) < alike) p[axis] = nearest[axis];
  }
  const glm::dvec3 low = glm::floor(p);
  const glm::dvec3 part = p - low;
  const glm::ivec3 voxel_low(low);
  for (int corner = 0; corner < 8; ++corner) {
    const glm::ivec3 offset(corner & 1, (corner >> 1) & 1, corner >> 2);
    const glm::dvec3 weights = glm::mix(1.0 - part, part, glm::dvec3(offset));
    const double weight = weights.x * weights.y * weights.z;
    if (weight > 0.0) f(voxel_low + offset, weight);
  }
}

/// Computes fields on a lattice, cube by cube: regions with a constant value become tiles, all others bricks. Runs in
/// parallel; the result does not depend on threads. O(voxels that become bricks).
class Gathering {
 public:
  Gathering(const Gathering&) = delete;
  Gathering& operator=(const Gathering&) = delete;

 protected:
  using Brick = std::array<float, brick_voxels>;

  /// The first `made` sources become fields. Each field depends on its own source, and may depend on others.
  Gathering(std::vector<const ScalarVolume*> sources, std::size_t made, Progress* progress, Portion portion);
  virtual ~Gathering() = default;

  /// Computes the fields within a box of the lattice. Outside of the box they may have parts of bricks and tiles.
  [[nodiscard]] std::vector<SourceGrid> gather(const Box& box);
  [[nodiscard]] const ScalarVolume& source(std::size_t i) const { return *sources_[i]; }

  /// Returns the voxels of a source that determine a box of the lattice, of any size.
  [[nodiscard]] virtual Box support(std::size_t source, const Box& box) const = 0;
  /// Returns a field's value in a region where sources are constant (nullopt: not known to be). Returns nullopt if the
  /// result is not constant.
  [[nodiscard]] virtual std::optional<float> constant(std::size_t field,
                                                      std::span<const std::optional<float>> sources) const {
    return sources[field];
  }
  /// Computes the values of a brick of the lattice. windows: one per source. wanted: the fields to compute. bricks: one
  /// brick per wanted field.
  virtual void sample(const glm::ivec3& origin, std::span<const Window> windows, std::span<const std::size_t> wanted,
                      std::span<Brick> bricks) const = 0;
  /// Throws for more than 2^21 bricks, which is 4 GiB of a field's values.
  [[noreturn]] virtual void too_large() const = 0;
  static constexpr std::uint64_t max_bricks = std::uint64_t{1} << 21U;

 private:
  struct LatticeBrick {
    glm::ivec3 origin;
    Brick values;
  };
  using Bricks = std::vector<std::deque<LatticeBrick>>;  // one deque per field
  class Leaves;

  [[nodiscard]] Box box_of(std::size_t i, std::uint32_t item) const;
  // Returns the constant value of a source in a box, if it is known without reading voxels.
  [[nodiscard]] std::optional<float> value_all_over(std::size_t i, const Box& box, const Items& items) const;
  // Processes a cube of the lattice. candidates: for each source, the items that may overlap its support.
  void refine(glm::ivec3 origin, int size, int depth, std::span<const Items> candidates);
  void make_brick(const glm::ivec3& origin, std::span<const Box> needed, std::span<const Items> items,
                  std::span<const std::size_t> wanted);

  std::vector<const ScalarVolume*> sources_;
  std::size_t made_;
  Box box_;
  ProgressPart part_;
  std::atomic<std::uint64_t> sampled_ = 0;
  tbb::enumerable_thread_specific<Bricks> bricks_;
  tbb::enumerable_thread_specific<std::vector<std::vector<SourceTile>>> tiles_;
};

/// Assembles the gathered fields to volumes, with the names and transforms of the fields that they were gathered from.
void assemble_in_place_of(std::span<const ScalarVolume* const> before, std::vector<SourceGrid> gathered,
                          std::span<ScalarVolume* const> out, Progress* progress, Portion portion);

}  // namespace cumulet::volume::detail
