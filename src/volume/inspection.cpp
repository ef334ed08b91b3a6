#include "volume/inspection.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "volume/bricks.hpp"
#include "volume/frame.hpp"
#include "volume/import_detail.hpp"

namespace cumulet::volume {

using namespace detail;

namespace {

/// Calls f(value, voxels) for every active voxel of a brick, and every active tile.
template <typename Call>
void for_active(const SourceGrid& source, Call&& f) {
  std::array<float, brick_voxels> values;
  for (std::size_t leaf = 0; leaf < source.leaves->count(); ++leaf) {
    const ActiveMask mask = source.leaves->active(leaf);
    source.leaves->values(leaf, values.data());
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (((mask[i / 64] >> (i % 64)) & 1U) != 0) f(values[i], std::uint64_t{1});
    }
  }
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

  float least = std::numeric_limits<float>::max();
  float most = std::numeric_limits<float>::lowest();
  double sum = 0.0;
  std::uint64_t finite = 0;
  for_active(source, [&](float value, std::uint64_t voxels) {
    if (!std::isfinite(value)) {
      out.non_finite_voxels += voxels;
      return;
    }
    if (value < 0.0F) out.negative_voxels += voxels;
    least = std::min(least, value);
    most = std::max(most, value);
    sum += double{value} * static_cast<double>(voxels);
    finite += voxels;
  });
  if (finite == 0) return out;
  out.min = least;
  out.max = most;
  out.mean = sum / static_cast<double>(finite);
  const double bins_a_unit = most > least ? double{histogram_bins} / (double{most} - double{least}) : 0.0;
  for_active(source, [&](float value, std::uint64_t voxels) {
    if (!std::isfinite(value)) return;
    const auto bin = static_cast<std::size_t>((double{value} - double{least}) * bins_a_unit);
    out.histogram[std::min(bin, histogram_bins - 1)] += voxels;
  });
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

Inspection::Inspection(const std::filesystem::path& file) : file_(file) {
  naming(file.string(), [&] {
    const std::unique_ptr<Reader> reader = open(file, nullptr);
    bytes_ = std::filesystem::file_size(file);
    format_ = reader->format();
    metadata_ = reader->metadata();
    grids_ = reader->grids();
    channels_ = channels_by_name(grids_);
  });
  facts_.resize(grids_.size());
  try {
    chosen_ = choose_grid(grids_, "");
  } catch (const std::runtime_error&) {
    // None can be shown; each says why.
  }
}

const GridFacts& Inspection::facts(std::size_t grid) {
  const std::scoped_lock lock(mutex_);
  std::optional<GridFacts>& facts = facts_.at(grid);
  if (facts) return *facts;
  GridFacts found{.values = {}, .refusal = grids_[grid].refusal};
  if (grids_[grid].values != Values::none) {
    try {
      // A reader of its own: one that fails leaves its stream in no state to go on from.
      found.values = values_of(open(file_, nullptr)->read(grid, {}, {}, ""));
    } catch (const std::bad_alloc&) {
      throw Error(ErrorCode::out_of_memory, one_line(file_.string() + ": not enough memory to read it"));
    } catch (const std::ios_base::failure&) {
      found.refusal = end_of_file;
    } catch (const std::exception& e) {
      found.refusal = one_line(e.what());
    }
  }
  return facts.emplace(std::move(found));
}

}  // namespace cumulet::volume
