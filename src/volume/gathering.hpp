#pragma once

// Private to volume/: fields on a lattice whose voxels are made of other fields' voxels nearby.

#include <tbb/enumerable_thread_specific.h>

#include <atomic>
#include <deque>
#include <optional>
#include <span>
#include <vector>

#include "volume/import_detail.hpp"

namespace cumulet::volume::detail {

/// Of a voxel: places that differ by rounding alone give a voxel's own value.
inline constexpr double alike = 1e-4;

/// A field's bricks and tiles that meet a box of its voxels: places in brick_origins, then in tiles.
using Items = std::vector<std::uint32_t>;

/// A field's values within a box, by cells of the bricks' size.
class Window {
 public:
  /// items: those that meet the box.
  Window(const ScalarVolume& field, const Box& box, const Items& items);

  [[nodiscard]] double voxel(glm::ivec3 p) const;
  /// The value all over a box within the window's, if cells alone tell it.
  [[nodiscard]] std::optional<double> constant(const Box& box) const;
  /// Trilinear between the centres of voxels.
  [[nodiscard]] double at(const glm::dvec3& p) const;

 private:
  struct Cell {
    std::optional<std::size_t> first;  // place of its brick's values
    float constant;
  };
  [[nodiscard]] std::size_t place(glm::ivec3 cell) const;

  const ScalarVolume* field_;
  glm::ivec3 low_, size_;
  std::vector<Cell> cells_;
};

/// f(voxel, weight) for those that a trilinear interpolation at p is made of.
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

/// Makes fields of a lattice, cube by cube: what is made of one value all over is a tile, the rest bricks. In parallel,
/// the same whatever the threads. O(voxels that become bricks).
class Gathering {
 public:
  Gathering(const Gathering&) = delete;
  Gathering& operator=(const Gathering&) = delete;

 protected:
  using Brick = std::array<float, brick_voxels>;

  /// Of the sources the first `made` become fields, each of its own values; others have a part in that, too.
  Gathering(std::vector<const ScalarVolume*> sources, std::size_t made, Progress* progress, Portion portion);
  virtual ~Gathering() = default;

  /// The fields within a box of the lattice, beyond which stand whole bricks and tiles, or nothing.
  [[nodiscard]] std::vector<SourceGrid> gather(const Box& box);
  [[nodiscard]] const ScalarVolume& source(std::size_t i) const { return *sources_[i]; }

  /// A source's voxels that a box of the lattice, of any size, is made of.
  [[nodiscard]] virtual Box support(std::size_t source, const Box& box) const = 0;
  /// A field's value where each of its sources has one all over, or none that is known.
  [[nodiscard]] virtual std::optional<float> constant(std::size_t field,
                                                      std::span<const std::optional<float>> sources) const {
    return sources[field];
  }
  /// The values of a brick of the lattice. windows: one a source. wanted: fields, for each of which a brick is filled.
  virtual void sample(const glm::ivec3& origin, std::span<const Window> windows, std::span<const std::size_t> wanted,
                      std::span<Brick> bricks) const = 0;
  /// Throws for what is more than 2^21 bricks: 4 GiB of a field's values.
  [[noreturn]] virtual void too_large() const = 0;
  static constexpr std::uint64_t most_bricks = std::uint64_t{1} << 21U;

 private:
  struct Placed {
    glm::ivec3 origin;
    Brick values;
  };
  using Bricks = std::vector<std::deque<Placed>>;  // one of each field
  class Leaves;

  [[nodiscard]] Box box_of(std::size_t i, std::uint32_t item) const;
  // The value all over a box of a source, if that is known without looking at voxels.
  [[nodiscard]] std::optional<float> value_all_over(std::size_t i, const Box& box, const Items& items) const;
  // A cube of the lattice, of the items of each source that may meet what it is made of.
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

/// From what was gathered to the contract of volumes, in the place and by the name of those that it was gathered from.
void assemble_in_place_of(std::span<const ScalarVolume* const> before, std::vector<SourceGrid> gathered,
                          std::span<ScalarVolume* const> out, Progress* progress, Portion portion);

}  // namespace cumulet::volume::detail
