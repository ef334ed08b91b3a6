#include "volume/coarse_reader.hpp"

#include <tbb/parallel_sort.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <memory>
#include <optional>

namespace cumulet::volume::detail {

namespace {

constexpr int step = 4;               // full-resolution voxels per coarse voxel, along an axis
constexpr int coarse_brick_log2 = 5;  // log2 of full-resolution voxels per coarse brick, along an axis
constexpr int step_log2 = 2;

// Selects one leaf in 16: four of the 64 in a coarse brick, one in each layer along every axis.
bool is_sampled(const glm::ivec3& origin) {
  const glm::ivec3 leaf = origin >> 3;
  return ((leaf.x + 4 * leaf.y + 7 * leaf.z) & 15) == 0;
}

/// Returns the number of active voxels in each octant of a leaf, which is one coarse voxel; z fastest.
std::array<int, 8> active_eighths(const ActiveMask& mask) {
  std::array<int, 8> counts{};
  for (std::size_t x = 0; x < mask.size(); ++x) {
    for (unsigned part = 0; part < 4; ++part) {  // y, z
      constexpr std::uint64_t corner = 0x0F0F0F0F;
      const std::uint64_t of_part = corner << (32 * (part >> 1U) + 4 * (part & 1U));
      counts[x / step * 4 + part] += std::popcount(mask[x] & of_part);
    }
  }
  return counts;
}

/// A tree's leaves and small tiles, as bricks of coarse voxels.
class CoarseLeaves final : public HeldLeaves {
 public:
  CoarseLeaves(const LeafSource& leaves, float background, const std::vector<SourceTile>& tiles, double at,
               Progress* progress)
      : leaves_(leaves), background_(std::max(background, 0.0F)) {
    parts_.reserve(leaves.count() + tiles.size());
    for (std::size_t i = 0; i < leaves.count(); ++i) {
      const glm::ivec3 origin = leaves.origin(i);
      if (((origin.x | origin.y | origin.z) & (brick_size - 1)) != 0) fail("damaged tree");
      parts_.push_back({origin, i});
    }
    for (const SourceTile& tile : tiles) {
      parts_.push_back({tile.box.min, leaves.count() + tiles_.size()});
      tiles_.push_back(tile);
    }
    check(progress);
    tbb::parallel_sort(parts_.begin(), parts_.end(), [](const Part& a, const Part& b) {
      return lexicographic(a.origin >> coarse_brick_log2, b.origin >> coarse_brick_log2);
    });
    check(progress);
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      const glm::ivec3 brick = parts_[i].origin >> coarse_brick_log2;
      if (i == 0 || bricks_.back().position != brick) bricks_.push_back({brick, i});
    }
    take_means(at, progress);
  }

  [[nodiscard]] std::size_t count() const override { return bricks_.size(); }
  [[nodiscard]] glm::ivec3 origin(std::size_t brick) const override { return bricks_[brick].position * brick_size; }
  [[nodiscard]] ActiveMask active(std::size_t brick) const override {
    ActiveMask mask{};
    for_parts(brick, [&](std::size_t part, const glm::ivec3& corner) {
      const std::array<int, 8> counts = active_of(part);
      for (int i = 0; i < 8; ++i) {
        const glm::ivec3 voxel = corner + glm::ivec3(i >> 2, (i >> 1) & 1, i & 1);
        const std::uint64_t bit = counts[static_cast<std::size_t>(i)] > 0 ? 1 : 0;
        mask[static_cast<std::size_t>(voxel.x)] |= bit << static_cast<unsigned>(voxel.y * 8 + voxel.z);
      }
    });
    return mask;
  }
  void values(std::size_t brick, float* out) const override {
    std::fill_n(out, brick_voxels, background_);
    const Around around(*this, brick);
    for_parts(brick, [&](std::size_t part, const glm::ivec3& corner) {
      const std::array<int, 8> counts = active_of(part);
      for (int i = 0; i < 8; ++i) {
        const glm::ivec3 voxel = corner + glm::ivec3(i >> 2, (i >> 1) & 1, i & 1);
        float& value = out[(voxel.x * brick_size + voxel.y) * brick_size + voxel.z];
        const float full = static_cast<float>(counts[static_cast<std::size_t>(i)]) / (step * step * step);
        value = part < leaves_.count() ? std::lerp(background_, around.mean(voxel), full)
                                       : std::max(tiles_[part - leaves_.count()].box.value, 0.0F);
      }
    });
  }

 private:
  struct Part {
    glm::ivec3 origin;  ///< of 8^3 full-resolution voxels
    std::size_t part;   ///< index of a leaf or, after the leaves, of a tile
  };
  struct Brick {
    glm::ivec3 position;             ///< in bricks
    std::size_t first;               ///< index of its first part
    std::optional<float> mean = {};  ///< of active voxels; empty: no leaf of it was read
  };

  /// The means of a brick and its neighbors.
  class Around {
   public:
    Around(const CoarseLeaves& of, std::size_t brick) {
      const glm::ivec3 position = of.bricks_[brick].position;
      for (int i = 0; i < 27; ++i) {
        const glm::ivec3 other = position + glm::ivec3(i / 9, i / 3 % 3, i % 3) - 1;
        const auto found = std::ranges::lower_bound(of.bricks_, other, lexicographic, &Brick::position);
        const bool is_there = found != of.bricks_.end() && found->position == other;
        if (is_there) means_[static_cast<std::size_t>(i)] = found->mean;
      }
    }
    /// Interpolates the means of the bricks linearly at a voxel's center.
    [[nodiscard]] float mean(const glm::ivec3& voxel) const {
      const glm::vec3 at = (glm::vec3(voxel) + 0.5F) / float{brick_size} + 0.5F;
      const glm::ivec3 low(at);
      const glm::vec3 part = at - glm::vec3(low);
      float sum = 0.0F;
      float weights = 0.0F;
      for (int i = 0; i < 8; ++i) {
        const glm::ivec3 corner(i >> 2, (i >> 1) & 1, i & 1);
        const glm::vec3 weight = glm::mix(1.0F - part, part, glm::vec3(corner));
        const glm::ivec3 brick = low + corner;
        const int index = (brick.x * 3 + brick.y) * 3 + brick.z;
        const std::optional<float> mean = means_[static_cast<std::size_t>(index)];
        if (!mean) continue;
        sum += weight.x * weight.y * weight.z * *mean;
        weights += weight.x * weight.y * weight.z;
      }
      return weights > 0.0F ? sum / weights : 0.0F;
    }

   private:
    std::array<std::optional<float>, 27> means_;
  };

  template <class Use>
  void for_parts(std::size_t brick, const Use& use) const {
    const std::size_t end = brick + 1 < bricks_.size() ? bricks_[brick + 1].first : parts_.size();
    for (std::size_t i = bricks_[brick].first; i < end; ++i)
      use(parts_[i].part, (parts_[i].origin - (bricks_[brick].position << coarse_brick_log2)) >> step_log2);
  }

  [[nodiscard]] std::array<int, 8> active_of(std::size_t part) const {
    if (part < leaves_.count()) return active_eighths(leaves_.active(part));
    std::array<int, 8> all{};
    if (tiles_[part - leaves_.count()].active) all.fill(step * step * step);
    return all;
  }

  void take_means(double at, Progress* progress) {
    // In a brick without a sampled leaf, the first leaf is read.
    std::vector<std::uint8_t> chosen(leaves_.count());
    for (std::size_t brick = 0; brick < bricks_.size(); ++brick) {
      bool any = false;
      std::optional<std::size_t> first;
      for_parts(brick, [&](std::size_t part, const glm::ivec3& /*corner*/) {
        if (part >= leaves_.count()) return;
        if (!first) first = part;
        if (!is_sampled(leaves_.origin(part))) return;
        chosen[part] = 1;
        any = true;
      });
      if (first && !any) chosen[*first] = 1;
    }
    std::vector<double> sums(leaves_.count());
    const auto add = [&](std::size_t leaf, std::span<float, brick_voxels> values) {
      for (const float value : values) sums[leaf] += std::isfinite(value) && value > 0.0F ? double{value} : 0.0;
      return true;
    };
    leaves_.sweep_chosen([&](std::size_t leaf) { return chosen[leaf] != 0; }, add, progress, {at, at});
    for (std::size_t brick = 0; brick < bricks_.size(); ++brick) {
      double sum = 0.0;
      int voxels = 0;
      for_parts(brick, [&](std::size_t part, const glm::ivec3& /*corner*/) {
        if (part >= leaves_.count() || chosen[part] == 0) return;
        sum += sums[part];
        for (const std::uint64_t word : leaves_.active(part)) voxels += std::popcount(word);
      });
      if (voxels > 0) bricks_[brick].mean = static_cast<float>(sum / voxels);
    }
  }

  const LeafSource& leaves_;
  float background_;
  std::vector<SourceTile> tiles_;  // of 8^3 voxels
  std::vector<Part> parts_;        // sorted by their bricks
  std::vector<Brick> bricks_;      // sorted
};

}  // namespace

SourceGrid CoarseReader::read(std::size_t grid, Portion /*portion*/, const Log& log, const std::string& log_prefix) {
  const double at = whole_.opened();
  SourceGrid read = whole_.read(grid, {at, at}, log, log_prefix);
  const bool is_first = looked_.empty();
  if (is_first) first_ = grid;
  SourceGrid& whole = (is_first ? first_source_ : later_source_) = std::move(read);
  if (is_first && whole.leaves->count() < min_bricks_) fail("is small enough to be read completely");

  ProgressPart part(progress_, at, at, whole.leaves->count());
  Box box = active_leaf_region(*whole.leaves, part).box;
  SourceGrid coarse;
  std::vector<SourceTile> small;
  for (const SourceTile& tile : whole.tiles) {
    if (tile.active) box.expand({tile.box.min, tile.box.max});
    if (tile.box.max.x - tile.box.min.x < brick_size) {
      small.push_back(tile);
    } else {
      coarse.tiles.push_back({{tile.box.min >> step_log2, tile.box.max >> step_log2, tile.box.value}, tile.active});
    }
  }
  looked_.push_back({whole_.grids()[grid].name, box, whole.index_to_world});
  // The center of a coarse voxel is that of the voxels it covers.
  coarse.index_to_world = whole.index_to_world *
                          glm::scale(glm::translate(glm::dmat4(1.0), glm::dvec3(0.5 * (step - 1))), glm::dvec3(step));
  coarse.background = whole.background;
  coarse.leaves = std::make_unique<CoarseLeaves>(*whole.leaves, whole.background, small, at, progress_);
  return coarse;
}

std::array<SourceGrid, 3> CoarseReader::read_vector(std::size_t /*grid*/, Portion /*portion*/, const Log& /*log*/,
                                                    const std::string& /*log_prefix*/) {
  fail("contains vectors");
}

std::optional<Proxy::Extent> CoarseReader::extent(const VolumeFrame& frame) const {
  std::vector<const ScalarVolume*> seen;
  if (!frame.density.empty()) seen.push_back(&frame.density);
  if (frame.flame && !frame.flame->empty()) seen.push_back(&*frame.flame);
  if (seen.empty() && frame.temperature) seen.push_back(&*frame.temperature);
  Box box;
  std::optional<glm::dmat4> index_to_world;
  for (const ScalarVolume* field : seen) {
    const auto looked = std::ranges::find(looked_, field->name, &Looked::name);
    if (looked == looked_.end() || (index_to_world && looked->index_to_world != *index_to_world)) return std::nullopt;
    box.expand(looked->box);
    index_to_world = looked->index_to_world;
  }
  if (box.empty()) return std::nullopt;
  return Proxy::Extent{box.min, box.max, *index_to_world};
}

SourceGrid CoarseReader::Rest::read(std::size_t grid, Portion portion, const Log& log, const std::string& log_prefix) {
  if (coarse_.first_ != grid) return whole().read(grid, portion, log, log_prefix);
  coarse_.first_.reset();
  return std::move(coarse_.first_source_);
}

}  // namespace cumulet::volume::detail
