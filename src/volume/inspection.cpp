#include "volume/inspection.hpp"

#include <tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "volume/bricks.hpp"
#include "volume/frame_import.hpp"
#include "volume/import_detail.hpp"

namespace cumulet::volume {

using namespace detail;

namespace {

/// Statistics of active values, without the histogram.
struct Sums {
  float least = std::numeric_limits<float>::max();
  float most = std::numeric_limits<float>::lowest();
  double sum = 0.0;
  std::uint64_t finite = 0;
  std::uint64_t negative = 0;
  std::uint64_t non_finite = 0;

  void add(float value, std::uint64_t voxels) {
    if (!std::isfinite(value)) {
      non_finite += voxels;
      return;
    }
    if (value < 0.0F) negative += voxels;
    least = std::min(least, value);
    most = std::max(most, value);
    sum += double{value} * static_cast<double>(voxels);
    finite += voxels;
  }
  void add(const Sums& other) {
    least = std::min(least, other.least);
    most = std::max(most, other.most);
    sum += other.sum;
    finite += other.finite;
    negative += other.negative;
    non_finite += other.non_finite;
  }
};

using Histogram = std::array<std::uint64_t, histogram_bins>;

/// Calls the result of take_of(leaf) with the value of each active voxel of the leaf, on several threads.
template <typename TakeOf>
void for_active(const LeafSource& leaves, TakeOf&& take_of) {
  const auto visit = [&](std::size_t leaf, std::span<const float, brick_voxels> values) {
    const ActiveMask mask = leaves.active(leaf);
    const auto take = take_of(leaf);
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (((mask[i / 64] >> (i % 64)) & 1U) != 0) take(values[i]);
    }
    return true;
  };
  leaves.sweep(visit, nullptr, {});
}

/// Calls f(value, voxels) for every active tile.
template <typename Call>
void for_active_tiles(const SourceGrid& source, Call&& f) {
  for (const SourceTile& tile : source.tiles) {
    if (tile.active) f(tile.box.value, Box{tile.box.min, tile.box.max}.voxels());
  }
}

GridValues values_of(const SourceGrid& source) {
  GridValues out;
  out.index_to_world = source.index_to_world;
  const LeafSource& leaves = *source.leaves;
  ProgressPart part(nullptr, 0.0, 1.0, leaves.count());
  ActiveRegion region = active_leaf_region(leaves, part);
  for (const SourceTile& tile : source.tiles) {
    if (!tile.active) continue;
    const Box box{tile.box.min, tile.box.max};
    region.box.expand(box);
    region.voxels += box.voxels();
  }
  out.active_voxels = region.voxels;
  if (!region.box.empty()) {
    out.bounds_min = region.box.min;
    out.bounds_max = region.box.max;
  }
  out.memory_bytes =
      leaves.count() * (brick_voxels * sizeof(float) + sizeof(glm::ivec3)) +
      static_cast<std::uint64_t>(std::ranges::count_if(source.tiles, &SourceTile::active)) * sizeof(Tile);

  // Separate sums per leaf, so that results do not depend on the order of threads.
  std::vector<Sums> of_leaves(leaves.count());
  for_active(leaves, [&](std::size_t leaf) { return [&sums = of_leaves[leaf]](float value) { sums.add(value, 1); }; });
  Sums all;
  for (const Sums& leaf : of_leaves) all.add(leaf);
  for_active_tiles(source, [&](float value, std::uint64_t voxels) { all.add(value, voxels); });
  out.negative_voxels = all.negative;
  out.non_finite_voxels = all.non_finite;
  if (all.finite == 0) return out;
  out.min = all.least;
  out.max = all.most;
  out.mean = all.sum / static_cast<double>(all.finite);
  const double bins_a_unit =
      all.most > all.least ? double{histogram_bins} / (double{all.most} - double{all.least}) : 0.0;
  const auto count = [&](Histogram& histogram, float value, std::uint64_t voxels) {
    if (!std::isfinite(value)) return;
    const auto bin = static_cast<std::size_t>((double{value} - double{all.least}) * bins_a_unit);
    histogram[std::min(bin, histogram_bins - 1)] += voxels;
  };
  tbb::enumerable_thread_specific<Histogram> histograms([] { return Histogram{}; });
  for_active(leaves, [&](std::size_t /*leaf*/) {
    return [&count, &histogram = histograms.local()](float value) { count(histogram, value, 1); };
  });
  for_active_tiles(source, [&](float value, std::uint64_t voxels) { count(out.histogram, value, voxels); });
  for (const Histogram& some : histograms)
    std::transform(some.begin(), some.end(), out.histogram.begin(), out.histogram.begin(), std::plus<>());
  return out;
}

}  // namespace

std::array<std::uint64_t, histogram_bins> histogram(const ScalarVolume& volume) {
  std::array<std::uint64_t, histogram_bins> counts{};
  const double bins_a_unit = volume.max_value > 0.0F ? histogram_bins / double{volume.max_value} : 0.0;
  const auto add = [&](float value, std::int64_t voxels) {
    if (value > 0.0F)
      counts.at(std::min(static_cast<std::size_t>(double{value} * bins_a_unit), histogram_bins - 1)) += voxels;
  };
  for (std::size_t i = 0; i < volume.brick_values.size(); ++i) add(volume.brick_values[i], 1);
  for (const Tile& tile : volume.tiles) add(tile.value, voxels_of(tile));
  if (volume.background > 0.0F) add(volume.background, background_voxels(volume));
  return counts;
}

Inspection::Inspection(const FilePath& file) : file_(file) {
  naming(file.given(), [&] {
    const std::unique_ptr<Reader> reader = open(file.absolute(), nullptr);
    bytes_ = bytes_of(file.absolute());
    format_ = reader->format();
    metadata_ = reader->metadata();
    grids_ = reader->grids();
    channels_ = channels_by_name(grids_);
  });
  statistics_.resize(grids_.size());
  try {
    chosen_ = choose_grid(grids_, "");
  } catch (const std::runtime_error&) {
    // No grid is usable; each grid's refusal gives the reason.
  }
}

const GridStatistics& Inspection::statistics(std::size_t grid) {
  const std::scoped_lock lock(mutex_);
  std::optional<GridStatistics>& statistics = statistics_.at(grid);
  if (statistics) return *statistics;
  GridStatistics found{.values = {}, .refusal = grids_[grid].refusal};
  if (grids_[grid].values != Values::none) {
    try {
      // Uses a new reader: a failed read would leave its stream in an undefined state.
      const std::unique_ptr<Reader> reader = open(file_.absolute(), nullptr);
      found.values = values_of(reader->read(grid, {}, {}, ""));
    } catch (const std::bad_alloc&) {
      throw Error(ErrorCode::out_of_memory, one_line(file_.given() + ": not enough memory to read it"));
    } catch (const std::ios_base::failure&) {
      found.refusal = end_of_file;
    } catch (const std::exception& e) {
      found.refusal = one_line(e.what());
    }
  }
  return statistics.emplace(std::move(found));
}

}  // namespace cumulet::volume
