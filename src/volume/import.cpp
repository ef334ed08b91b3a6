#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>
#include <tbb/parallel_sort.h>
#include <tbb/partitioner.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>

#include "base/detached_work.hpp"
#include "base/progress_part.hpp"
#include "volume/bricks.hpp"
#include "volume/import_detail.hpp"

namespace cumulet::volume {

using namespace detail;

std::string detail::scalar_fog_refusal(std::string_view type, std::string_view grid_class, bool scalar) {
  if (type == "points") return "contains points, not a fog volume";
  if (!scalar) return "has type " + std::string(type) + ", not a float or half scalar";
  if (grid_class == "fog volume" || grid_class == "unknown") return {};
  return "is a " + std::string(grid_class) + ", not a fog volume";
}

std::string detail::to_string(glm::ivec3 v) {
  std::string text(1, '(');
  return text.append(std::to_string(v.x) + ", " + std::to_string(v.y) + ", " + std::to_string(v.z) + ")");
}

ActiveMask detail::not_zero(std::span<const float, brick_voxels> values) {
  ActiveMask mask{};
  for (std::size_t i = 0; i < values.size(); ++i) {
    mask[i / 64] |= std::uint64_t{values[i] != 0.0F ? 1U : 0U} << (i % 64);
  }
  return mask;
}

namespace {

std::string label(const GridInfo& entry) {
  return "\"" + entry.unique_name + "\" (" + entry.type + ", " + entry.grid_class + ")";
}

}  // namespace

std::string detail::describe(const std::vector<GridInfo>& grids, std::span<const std::size_t> which) {
  std::string out;
  for (const std::size_t i : which) out += (out.empty() ? "" : ", ") + label(grids[i]);
  return out;
}

namespace {

// Grids used as density of a file without density, in order of preference.
constexpr std::array<std::string_view, 5> likely_names = {"flames", "flame", "fire", "temperature", "heat"};

bool is_among(std::size_t grid, std::span<const std::size_t> some) {
  return std::ranges::find(some, grid) != some.end();
}

}  // namespace

std::string detail::lower_case(std::string text) {
  for (char& c : text)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return text;
}

std::vector<std::size_t> detail::called_so(const std::vector<GridInfo>& grids, std::string_view name,
                                           const std::function<bool(const GridInfo&)>& suits) {
  std::vector<std::size_t> found;
  const std::string lower_name = lower_case(std::string(name));
  for (std::size_t i = 0; i < grids.size(); ++i) {
    if (lower_case(grids[i].name) == lower_name && suits(grids[i])) found.push_back(i);
  }
  std::stable_partition(found.begin(), found.end(), [&](std::size_t i) { return grids[i].name == name; });
  return found;
}

namespace {

// Returns scalar grids named `name`, `join` and an axis letter; those with exactly this case come first.
std::array<std::vector<std::size_t>, 3> axes_called(const std::vector<GridInfo>& grids, std::string_view name,
                                                    std::string_view join) {
  std::array<std::vector<std::size_t>, 3> found;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::string called = std::string(name).append(join) + "xyz"[axis];
    found[axis] = called_so(grids, called, [](const GridInfo& grid) { return grid.values == Values::scalars; });
  }
  const bool whole = std::ranges::none_of(found, [](const auto& axis) { return axis.empty(); });
  return whole ? found : std::array<std::vector<std::size_t>, 3>{};
}

constexpr std::array<std::string_view, 3> axis_joins = {"", "_", "."};

}  // namespace

std::vector<std::size_t> detail::along_axes(const std::vector<GridInfo>& grids, std::string_view name) {
  for (const std::string_view join : axis_joins) {
    const auto found = axes_called(grids, name, join);
    if (!found[0].empty()) return {found[0][0], found[1][0], found[2][0]};
  }
  return {};
}

std::vector<std::size_t> detail::velocities(const std::vector<GridInfo>& grids) {
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < grids.size(); ++i) {
    const bool called = std::ranges::find(velocity_names, lower_case(grids[i].name)) != velocity_names.end();
    if (grids[i].values == Values::lengths && (called || grids[i].grid_class == "staggered")) found.push_back(i);
  }
  for (const std::string_view name : velocity_names) {
    for (const std::string_view join : axis_joins) {
      for (const auto& axis : axes_called(grids, name, join)) found.insert(found.end(), axis.begin(), axis.end());
    }
  }
  return found;
}

std::string detail::remark_on_choice(const std::vector<GridInfo>& grids, std::size_t chosen,
                                     std::span<const std::size_t> shown) {
  std::vector<std::size_t> others;
  const std::vector<std::size_t> motion = velocities(grids);
  bool one_density = lower_case(grids[chosen].name) == "density";
  for (std::size_t i = 0; i < grids.size(); ++i) {
    if (!grids[i].refusal.empty() || is_among(i, shown) || is_among(i, motion)) continue;
    others.push_back(i);
    one_density = one_density && lower_case(grids[i].name) != "density";
  }
  if (others.empty() || one_density) return {};
  return "uses the grid " + label(grids[chosen]) + "; it also has " + describe(grids, others);
}

std::vector<std::string> detail::remarks_on_case(const std::vector<GridInfo>& grids, const std::string& field,
                                                 std::span<const std::size_t> chosen,
                                                 std::span<const std::size_t> shown) {
  std::vector<std::string> remarks;
  for (const std::size_t grid : chosen) {
    const auto alike = [&](const GridInfo& other) {
      return other.values == grids[grid].values && other.refusal.empty() == grids[grid].refusal.empty();
    };
    std::vector<std::size_t> others = called_so(grids, grids[grid].name, alike);
    std::erase_if(others, [&](std::size_t i) { return is_among(i, shown); });
    if (others.empty()) continue;
    remarks.push_back("uses the grid " + label(grids[grid]) + " as " + field + "; it also has " +
                      describe(grids, others));
  }
  return remarks;
}

std::vector<std::size_t> detail::named(const std::vector<GridInfo>& grids, const std::string& name) {
  const auto all_with = [&](auto member) {
    std::vector<std::size_t> found;
    for (std::size_t i = 0; i < grids.size(); ++i) {
      if (grids[i].*member == name) found.push_back(i);
    }
    return found;
  };
  // "density[1]" selects one of several grids of the same name; an exact name has priority.
  std::vector<std::size_t> found = all_with(&GridInfo::name);
  return found.empty() ? all_with(&GridInfo::unique_name) : found;
}

std::optional<std::size_t> detail::first_fog(const std::vector<GridInfo>& grids,
                                             std::span<const std::string_view> names,
                                             std::span<const std::size_t> taken) {
  for (const std::string_view name : names) {
    for (const std::size_t i : called_so(grids, name, [](const GridInfo& grid) { return grid.refusal.empty(); })) {
      if (!is_among(i, taken)) return i;
    }
  }
  return std::nullopt;
}

std::optional<std::size_t> detail::any_fog(const std::vector<GridInfo>& grids, std::span<const std::size_t> taken) {
  if (const auto likely = first_fog(grids, likely_names, taken)) return likely;
  const std::vector<std::size_t> motion = velocities(grids);
  for (std::size_t i = 0; i < grids.size(); ++i) {
    if (grids[i].refusal.empty() && !is_among(i, motion) && !is_among(i, taken)) return i;
  }
  return std::nullopt;
}

void detail::fail_without(const std::vector<GridInfo>& grids, const std::string& what) {
  std::vector<std::size_t> all(grids.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  fail(what + describe(grids, all));
}

std::size_t detail::choose_named(const std::vector<GridInfo>& grids, const std::string& name,
                                 const std::function<std::string(const GridInfo&)>& refusal) {
  const std::vector<std::size_t> found = named(grids, name);
  if (found.empty()) fail_without(grids, "has no grid \"" + name + "\"; it has ");
  std::vector<std::size_t> usable;
  std::ranges::copy_if(found, std::back_inserter(usable), [&](std::size_t i) { return refusal(grids[i]).empty(); });
  if (usable.empty()) fail("grid \"" + grids[found[0]].unique_name + "\" " + refusal(grids[found[0]]));
  if (usable.size() > 1) fail("several grids have this name, choose one of: " + describe(grids, usable));
  return usable[0];
}

std::size_t detail::choose_grid(const std::vector<GridInfo>& grids, const std::string& name) {
  if (grids.empty()) fail("contains no grids");
  if (!name.empty()) return choose_named(grids, name, &GridInfo::refusal);
  if (const auto density = first_fog(grids, density_names)) return *density;
  if (const auto any = any_fog(grids)) return *any;
  if (grids.size() == 1) fail("grid \"" + grids[0].unique_name + "\" " + grids[0].refusal);
  fail_without(grids, "no scalar fog volume among its grids: ");
}

namespace {

Box box_of_active(const ActiveMask& mask, glm::ivec3 origin) {
  int x0 = brick_size;
  int x1 = -1;
  std::uint64_t slab = 0;  // bit y * 8 + z
  for (int x = 0; x < brick_size; ++x) {
    const std::uint64_t word = mask[static_cast<std::size_t>(x)];
    if (word == 0) continue;
    x0 = std::min(x0, x);
    x1 = x;
    slab |= word;
  }
  if (slab == 0) return {};
  std::uint64_t row = slab | (slab >> 32U);
  row |= row >> 16U;
  row = (row | (row >> 8U)) & 0xFFU;
  const glm::ivec3 min(x0, std::countr_zero(slab) / 8, std::countr_zero(row));
  const glm::ivec3 max(x1, (63 - std::countl_zero(slab)) / 8, 63 - std::countl_zero(row));
  return {origin + min, origin + max};
}

}  // namespace

bool detail::HeldLeaves::sweep_chosen(const Choice& chosen, const Visit& visit, Progress* progress,
                                      Portion portion) const {
  ProgressPart part(progress, portion.from, portion.to, count());
  std::atomic<bool> wanted = true;
  const auto visit_some = [&](const tbb::blocked_range<std::size_t>& range) {
    std::array<float, brick_voxels> room;
    for (std::size_t i = range.begin(); i != range.end() && wanted; ++i) {
      if (chosen && !chosen(i)) continue;
      values(i, room.data());
      if (!visit(i, room)) wanted = false;
    }
    part.add(range.size());
  };
  // In small chunks, so that progress is reported often.
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count(), 64), visit_some, tbb::simple_partitioner());
  return wanted;
}

ActiveRegion detail::active_leaf_region(const LeafSource& leaves, ProgressPart& part) {
  return tbb::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, leaves.count(), 256), ActiveRegion{},
      [&](const tbb::blocked_range<std::size_t>& range, ActiveRegion sum) {
        for (std::size_t i = range.begin(); i != range.end(); ++i) {
          const ActiveMask mask = leaves.active(i);
          for (const std::uint64_t word : mask) sum.voxels += static_cast<std::uint64_t>(std::popcount(word));
          sum.box.expand(box_of_active(mask, leaves.origin(i)));
        }
        part.add(range.size());
        return sum;
      },
      [](ActiveRegion a, const ActiveRegion& b) {
        a.box.expand(b.box);
        a.voxels += b.voxels;
        return a;
      });
}

namespace {

/// Whether a value is finite and beyond largest_value, larger than any measured value.
bool is_huge(float value) { return std::isfinite(value) && std::abs(value) > largest_value; }

/// Returns the value that the volume stores for a voxel.
float counted(float value) { return value > 0.0F && value <= largest_value ? value : 0.0F; }  // also turns -0 into 0

/// Statistics of a brick's voxels within bounds.
struct CleanBrick {
  std::uint32_t negative = 0;
  std::uint32_t non_finite = 0;
  std::uint32_t huge = 0;
  float max = 0.0F;
  bool constant = true;  ///< all values are equal
  float first = 0.0F;    ///< the first value
};

/// Replaces a leaf's values by those that the volume stores. Integer arithmetic vectorizes.
CleanBrick clean_inside(std::span<float, brick_voxels> values) {
  constexpr std::int32_t infinite = 0x7f800000;
  constexpr auto largest = std::bit_cast<std::int32_t>(largest_value);
  std::uint32_t negative = 0;
  std::uint32_t non_finite = 0;
  std::uint32_t beyond = 0;  // huge or not finite
  std::int32_t most = 0;
  std::int32_t other = 0;
  const auto keep = [](std::int32_t bits) { return bits > 0 && bits <= largest ? bits : 0; };
  const std::int32_t first = keep(std::bit_cast<std::int32_t>(values[0]));
  for (float& value : values) {
    const auto bits = std::bit_cast<std::int32_t>(value);
    const std::int32_t size = bits & std::numeric_limits<std::int32_t>::max();
    non_finite += size >= infinite ? 1U : 0U;
    beyond += size > largest ? 1U : 0U;
    negative += bits < 0 && size > 0 && size <= largest ? 1U : 0U;
    const std::int32_t kept = keep(bits);
    most = std::max(most, kept);
    other |= kept ^ first;
    value = std::bit_cast<float>(kept);
  }
  return {
      negative, non_finite, beyond - non_finite, std::bit_cast<float>(most), other == 0, std::bit_cast<float>(first)};
}

/// Same as clean_inside() for a leaf that extends beyond the bounds, where values become 0.
CleanBrick clean_across(std::span<float, brick_voxels> values, const glm::ivec3& origin, const Box& bounds) {
  CleanBrick brick;
  std::optional<float> first;
  for (int i = 0; i < brick_voxels; ++i) {
    float& value = values[static_cast<std::size_t>(i)];
    const glm::ivec3 voxel = origin + glm::ivec3(i >> 6, (i >> 3) & 7, i & 7);
    if (!bounds.contains({voxel, voxel})) {
      value = 0.0F;
      continue;
    }
    if (!std::isfinite(value)) {
      ++brick.non_finite;
    } else if (is_huge(value)) {
      ++brick.huge;
    } else if (value < 0.0F) {
      ++brick.negative;
    }
    value = counted(value);
    brick.max = std::max(brick.max, value);
    if (!first) first = value;
    brick.constant = brick.constant && value == *first;
  }
  brick.first = first.value_or(0.0F);
  return brick;
}

CleanBrick clean(std::span<float, brick_voxels> values, const glm::ivec3& origin, const Box& bounds) {
  return bounds.contains({origin, origin + (brick_size - 1)}) ? clean_inside(values)
                                                              : clean_across(values, origin, bounds);
}

/// Stores a brick's values exactly; returns false if that is not possible.
bool keep(std::span<const float, brick_voxels> values, float* out) {
  std::ranges::copy(values, out);
  return true;
}
bool keep(std::span<const float, brick_voxels> values, std::uint16_t* out) {
  // Nearly all values are 0 or normal halves; this path vectorizes.
  bool plain = true;
  for (std::size_t i = 0; i < brick_voxels; ++i) {
    const auto bits = std::bit_cast<std::uint32_t>(values[i]);
    plain &= bits == 0 || (bits - (113U << 23U) < (30U << 23U) && (bits & 0x1fffU) == 0);
    out[i] = static_cast<std::uint16_t>(bits == 0 ? 0U : (bits >> 13U) - (112U << 10U));
  }
  if (plain) return true;
  for (std::size_t i = 0; i < brick_voxels; ++i) {
    const std::optional<std::uint16_t> half = exact_half(values[i]);
    if (!half) return false;
    out[i] = *half;
  }
  return true;
}

struct BrickTotals {
  std::uint64_t negative = 0;
  std::uint64_t non_finite = 0;
  std::uint64_t huge = 0;
  float max = 0.0F;

  void add(const BrickTotals& b) {
    negative += b.negative;
    non_finite += b.non_finite;
    huge += b.huge;
    max = std::max(max, b.max);
  }
};

/// A grid's leaves that overlap its bounds, sorted by origin, with the results of a sweep.
struct Bricks {
  std::vector<std::size_t> index_of;  ///< for each leaf its index; the end for leaves outside of the bounds
  std::vector<glm::ivec3> origins;
  std::vector<char> constant;  ///< 1: all values are equal
  std::vector<float> first;    ///< first value
  BrickTotals totals;
};

/// Fills the values of all bricks that are not constant. Returns false if a T cannot represent one of them exactly; the
/// results are then invalid.
template <class T>
bool fill(const LeafSource& leaves, const Box& bounds, Bricks& bricks, std::vector<T>& values, Progress* progress,
          Portion portion) {
  resize(values, bricks.origins.size() * brick_voxels, progress);
  tbb::enumerable_thread_specific<BrickTotals> totals;
  const auto take = [&](std::size_t leaf, std::span<float, brick_voxels> found) {
    const std::size_t index = bricks.index_of[leaf];
    if (index == bricks.origins.size()) return true;
    const CleanBrick brick = clean(found, bricks.origins[index], bounds);
    totals.local().add({brick.negative, brick.non_finite, brick.huge, brick.max});
    bricks.constant[index] = brick.constant ? 1 : 0;
    bricks.first[index] = brick.first;
    return brick.constant || keep(found, values.data() + index * brick_voxels);
  };
  if (!leaves.sweep(take, progress, portion)) return false;
  bricks.totals = {};
  for (const BrickTotals& some : totals) bricks.totals.add(some);
  return true;
}

/// Whether the first bricks read can be stored as halves.
bool begins_with_halves(const LeafSource& leaves, const Box& bounds, const Bricks& bricks, double at) {
  constexpr int enough = 64;
  std::atomic<int> looked_at = 0;
  std::atomic<bool> halves = true;
  const auto look = [&](std::size_t leaf, std::span<float, brick_voxels> found) {
    const std::size_t index = bricks.index_of[leaf];
    if (index == bricks.origins.size()) return true;
    std::array<std::uint16_t, brick_voxels> room;
    if (!clean(found, bricks.origins[index], bounds).constant && !keep(found, room.data())) halves = false;
    return halves && ++looked_at < enough;
  };
  leaves.sweep(look, nullptr, {at, at});
  return halves;
}

/// Removes the gaps of constant bricks.
template <class T>
void close_gaps(const Bricks& bricks, std::vector<T>& values, std::vector<glm::ivec3>& origins,
                const Progress* progress) {
  origins.reserve(bricks.origins.size());
  for (std::size_t i = 0; i < bricks.origins.size(); ++i) {
    if (i % 4096 == 0) check(progress);
    if (bricks.constant[i] != 0) continue;
    if (origins.size() != i)
      std::copy_n(values.data() + i * brick_voxels, brick_voxels, values.data() + origins.size() * brick_voxels);
    origins.push_back(bricks.origins[i]);
  }
  const std::size_t all = values.size();
  values.resize(origins.size() * brick_voxels);
  if (values.size() < all - all / 8) values.shrink_to_fit();
}

/// Returns leaf indices sorted by origin. Throws if an origin is not that of a brick or occurs twice.
std::vector<std::size_t> sorted_leaves(const LeafSource& leaves, const Progress* progress) {
  std::vector<std::size_t> order(leaves.count());
  std::iota(order.begin(), order.end(), std::size_t{0});
  tbb::parallel_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    check(progress);
    return lexicographic(leaves.origin(a), leaves.origin(b));
  });
  for (std::size_t i = 0; i < order.size(); ++i) {
    const glm::ivec3 origin = leaves.origin(order[i]);
    if (((origin.x | origin.y | origin.z) & (brick_size - 1)) != 0)
      fail("damaged tree: misaligned brick at " + to_string(origin));
    if (i > 0 && leaves.origin(order[i - 1]) == origin) fail("damaged tree: two bricks at " + to_string(origin));
  }
  return order;
}

/// Throws if the active voxels are too many along an axis or have indices that are too large.
void check_bounds(const Box& bounds) {
  const glm::i64vec3 extent = glm::i64vec3(bounds.max) - glm::i64vec3(bounds.min) + std::int64_t{1};
  if (glm::any(glm::greaterThan(extent, glm::i64vec3(max_extent)))) {
    fail("its active voxels span " + std::to_string(extent.x) + " x " + std::to_string(extent.y) + " x " +
         std::to_string(extent.z) + " voxels; the limit is " + std::to_string(max_extent) + " per axis");
  }
  if (glm::any(glm::lessThan(bounds.min, glm::ivec3(-max_coordinate))) ||
      glm::any(glm::greaterThan(bounds.max, glm::ivec3(max_coordinate)))) {
    fail("its voxel indices exceed " + std::to_string(max_coordinate));
  }
}

/// Returns the part of a brick within the bounds.
Box clipped_brick(const glm::ivec3& origin, const Box& bounds) {
  return bounds.clipped({origin, origin + (brick_size - 1)});
}

/// Returns the leaves that overlap the bounds, without the results of a sweep.
Bricks bricks_within(const LeafSource& leaves, const Box& bounds, const Progress* progress) {
  Bricks bricks;
  std::vector<std::size_t> order = sorted_leaves(leaves, progress);
  std::erase_if(order, [&](std::size_t leaf) { return clipped_brick(leaves.origin(leaf), bounds).empty(); });
  bricks.index_of.assign(leaves.count(), order.size());
  for (std::size_t i = 0; i < order.size(); ++i) bricks.index_of[order[i]] = i;
  bricks.origins.reserve(order.size());
  for (const std::size_t leaf : order) bricks.origins.push_back(leaves.origin(leaf));
  bricks.constant.resize(order.size());
  bricks.first.resize(order.size());
  return bricks;
}

/// Reads the values of all bricks into the volume, and the results of the sweep into `bricks`.
void read_values(const LeafSource& leaves, const Box& bounds, Bricks& bricks, ScalarVolume& out, Progress* progress,
                 Portion portion) {
  // Tries halves first, unless a quick check, before memory is allocated, shows that they are not exact.
  const auto sweep = [&](auto values, Portion part) {
    if (!fill(leaves, bounds, bricks, values, progress, part)) return false;
    close_gaps(bricks, values, out.brick_origins, progress);
    out.brick_values = std::move(values);
    return true;
  };
  if (!begins_with_halves(leaves, bounds, bricks, portion.at(0.3)) ||
      !sweep(std::vector<std::uint16_t>(), portion.part(0.3, 1.0))) {
    const double reached = progress != nullptr ? progress->fraction() : portion.at(0.3);
    sweep(std::vector<float>(), {reached, portion.to});
  }
  out.negative_voxels = bricks.totals.negative;
  out.non_finite_voxels = bricks.totals.non_finite;
  out.huge_voxels = bricks.totals.huge;
  out.max_value = bricks.totals.max;
}

/// Adds the source's tiles and its background to a volume whose bricks have been read.
void add_tiles(const SourceGrid& source, const Box& bounds, const Bricks& bricks, ScalarVolume& out) {
  const auto count_uncounted = [&out](float value, std::uint64_t voxels) {
    if (!std::isfinite(value)) {
      out.non_finite_voxels += voxels;
    } else if (is_huge(value)) {
      out.huge_voxels += voxels;
    } else if (value < 0.0F) {
      out.negative_voxels += voxels;
    }
  };
  std::uint64_t covered = 0;
  for (const glm::ivec3& origin : bricks.origins) covered += clipped_brick(origin, bounds).voxels();
  for (const SourceTile& tile : source.tiles) {
    const Box box = bounds.clipped({tile.box.min, tile.box.max});
    if (box.empty()) continue;
    if (tile.active) out.active_voxels += box.voxels();
    covered += box.voxels();
    count_uncounted(tile.box.value, box.voxels());
    const float value = counted(tile.box.value);
    out.max_value = std::max(out.max_value, value);
    if (value != out.background) out.tiles.push_back({box.min, box.max, value});
  }
  // Voxels without a brick or tile have the background value.
  const std::uint64_t uncovered = bounds.voxels() - std::min(covered, bounds.voxels());
  if (uncovered > 0) {
    out.max_value = std::max(out.max_value, out.background);
    count_uncounted(source.background, uncovered);
  }
}

/// Adds the constant bricks as tiles, which take a seventieth of the memory, and sorts all tiles.
void add_constant_bricks(const Box& bounds, const Bricks& bricks, ScalarVolume& out) {
  for (std::size_t i = 0; i < bricks.origins.size(); ++i) {
    if (bricks.constant[i] == 0 || bricks.first[i] == out.background) continue;
    const Box box = clipped_brick(bricks.origins[i], bounds);
    out.tiles.push_back({box.min, box.max, bricks.first[i]});
  }
  tbb::parallel_sort(out.tiles.begin(), out.tiles.end(),
                     [](const Tile& a, const Tile& b) { return lexicographic(a.min, b.min); });
}

}  // namespace

void detail::check_transform(const glm::dmat4& m) {
  for (int column = 0; column < 4; ++column) {
    for (int row = 0; row < 4; ++row) {
      if (!std::isfinite(m[column][row])) fail("its transform is not finite");
    }
  }
  // Relative to the lengths of the axes, so that tiny voxels do not count as singular.
  const glm::dvec3 x(m[0]);
  const glm::dvec3 y(m[1]);
  const glm::dvec3 z(m[2]);
  const double volume = std::abs(glm::dot(glm::cross(x / glm::length(x), y / glm::length(y)), z / glm::length(z)));
  if (!(volume > 1e-9)) fail("its transform is singular");
}

ScalarVolume detail::assemble(SourceGrid source, const Log& log, const std::string& log_prefix, Progress* progress,
                              Portion portion) {
  check_transform(source.index_to_world);

  const auto made = make_deferred_delete<ScalarVolume>();
  ScalarVolume& out = *made;
  out.index_to_world = source.index_to_world;

  ProgressPart looking(progress, portion.at(0.0), portion.at(0.2), source.leaves->count());
  ActiveRegion region = active_leaf_region(*source.leaves, looking);
  for (const SourceTile& tile : source.tiles) {
    if (tile.active) region.box.expand({tile.box.min, tile.box.max});
  }
  const Box bounds = region.box;
  if (bounds.empty()) {
    log.warning(log_prefix + "is empty: it has no active voxels");
    out.bounds_max = out.bounds_min;
    return std::move(out);
  }
  out.background = counted(source.background);
  check_bounds(bounds);
  out.bounds_min = bounds.min;
  out.bounds_max = bounds.max;
  out.active_voxels = region.voxels;

  Bricks bricks = bricks_within(*source.leaves, bounds, progress);
  read_values(*source.leaves, bounds, bricks, out, progress, portion);
  add_tiles(source, bounds, bricks, out);
  add_constant_bricks(bounds, bricks, out);
  const auto warn = [&](std::uint64_t voxels, const char* what, const char* how) {
    if (voxels > 0)
      log.warning(log_prefix + std::to_string(voxels) + what + (voxels == 1 ? " voxel" : " voxels") + how);
  };
  warn(out.negative_voxels, " negative",
       out.max_value > 0.0F ? " clamped to 0" : " clamped to 0, and no value is above 0");
  warn(out.non_finite_voxels, " non-finite", " read as 0");
  warn(out.huge_voxels, "", " above 1e30 (fill values) read as 0");
  return std::move(out);
}

std::vector<GridInfo> list_grids(const FilePath& file) {
  return naming(file.given(), [&] { return open(file.absolute(), nullptr)->grids(); });
}

namespace {

// Returns the result of f(name of the grid, prefix for messages) for one grid of an open file.
template <class F>
auto of_grid(Reader& reader, std::size_t grid, const std::string& file, F&& f) {
  const GridInfo& entry = reader.grids()[grid];
  const std::string name = one_line(file + ": grid \"" + entry.unique_name + "\"");
  return naming(name, [&] { return f(entry.name, name); });
}

bool is_empty(const ScalarVolume& volume) { return volume.empty(); }
bool is_empty(const std::array<ScalarVolume, 2>& signs) { return signs[0].empty(); }

constexpr double reading_vectors = 0.7;  // fraction of an import's time

// Calls make() for each component of a vector grid.
template <class Axis, class Make>
std::array<Axis, 3> of_axes(Reader& reader, std::size_t grid, const std::string& file, const Log& log, Portion portion,
                            const Make& make) {
  return of_grid(reader, grid, file, [&](const std::string& grid_name, const std::string& name) {
    std::array<SourceGrid, 3> sources = reader.read_vector(grid, portion.part(0.0, reading_vectors), log, name + ": ");
    std::array<Axis, 3> out;
    double from = reading_vectors;
    for (int axis = 0; axis < 3; ++axis) {
      const double to = from + (1.0 - reading_vectors) / 3.0;
      // All components are empty together, which is logged once.
      const Log& heard = axis > 0 && is_empty(out[0]) ? Log() : log;
      out[axis] =
          make(std::move(sources[axis]), grid_name, heard, name + ", " + "xyz"[axis] + ": ", portion.part(from, to));
      from = to;
    }
    return out;
  });
}

}  // namespace

ScalarVolume detail::import_grid(Reader& reader, std::size_t grid, const std::string& file, const Log& log,
                                 Progress* progress, Portion portion) {
  return of_grid(reader, grid, file, [&](const std::string& grid_name, const std::string& name) {
    SourceGrid source = reader.read(grid, portion.part(0.0, reader.reading()), log, name + ": ");
    ScalarVolume volume = assemble(std::move(source), log, name + ": ", progress, portion.part(reader.reading(), 1.0));
    volume.name = grid_name;
    return volume;
  });
}

std::array<ScalarVolume, 3> detail::import_vector_grid(Reader& reader, std::size_t grid, const std::string& file,
                                                       const Log& log, Progress* progress, Portion portion) {
  return of_axes<ScalarVolume>(
      reader, grid, file, log, portion,
      [&](SourceGrid source, const std::string& grid_name, const Log& heard, const std::string& prefix, Portion part) {
        ScalarVolume volume = assemble(std::move(source), heard, prefix, progress, part);
        volume.name = grid_name;
        return volume;
      });
}

namespace {

/// The values of another source with one sign.
class OneSign final : public LeafSource {
 public:
  OneSign(std::shared_ptr<const LeafSource> leaves, float sign) : leaves_(std::move(leaves)), sign_(sign) {}

  /// Non-finite and huge values are kept.
  [[nodiscard]] float operator()(float value) const {
    const float own = sign_ * value;
    return std::isfinite(value) && !is_huge(value) && own < 0.0F ? 0.0F : own;
  }
  [[nodiscard]] std::size_t count() const override { return leaves_->count(); }
  [[nodiscard]] glm::ivec3 origin(std::size_t leaf) const override { return leaves_->origin(leaf); }
  [[nodiscard]] ActiveMask active(std::size_t leaf) const override { return leaves_->active(leaf); }
  bool sweep_chosen(const Choice& chosen, const Visit& visit, Progress* progress, Portion portion) const override {
    const auto signed_visit = [&](std::size_t leaf, std::span<float, brick_voxels> values) {
      std::ranges::transform(values, values.begin(), std::ref(*this));
      return visit(leaf, values);
    };
    return leaves_->sweep_chosen(chosen, signed_visit, progress, portion);
  }

 private:
  std::shared_ptr<const LeafSource> leaves_;
  float sign_;
};

}  // namespace

std::array<ScalarVolume, 2> detail::assemble_signed(SourceGrid whole, const std::string& grid_name, const Log& log,
                                                    const std::string& log_prefix, Progress* progress,
                                                    Portion portion) {
  const std::shared_ptr<const LeafSource> leaves = std::move(whole.leaves);
  const auto part = [&](float sign, const Log& heard, Portion of_load) {
    auto signed_leaves = std::make_unique<OneSign>(leaves, sign);
    SourceGrid source{whole.index_to_world, (*signed_leaves)(whole.background), whole.tiles, nullptr};
    for (SourceTile& tile : source.tiles) tile.box.value = (*signed_leaves)(tile.box.value);
    source.leaves = std::move(signed_leaves);
    ScalarVolume volume = assemble(std::move(source), heard, log_prefix, progress, of_load);
    volume.name = grid_name;
    return volume;
  };
  // Both parts have the same invalid voxels, or none; these are logged once.
  ScalarVolume above = part(1.0F, log, portion.part(0.0, 0.5));
  return {std::move(above), part(-1.0F, Log(), portion.part(0.5, 1.0))};
}

std::array<ScalarVolume, 2> detail::import_signed_grid(Reader& reader, std::size_t grid, const std::string& file,
                                                       const Log& log, Progress* progress, Portion portion) {
  return of_grid(reader, grid, file, [&](const std::string& grid_name, const std::string& name) {
    SourceGrid whole = reader.read(grid, portion.part(0.0, reader.reading()), log, name + ": ");
    return assemble_signed(std::move(whole), grid_name, log, name + ": ", progress,
                           portion.part(reader.reading(), 1.0));
  });
}

std::array<std::array<ScalarVolume, 2>, 3> detail::import_signed_vector_grid(Reader& reader, std::size_t grid,
                                                                             const std::string& file, const Log& log,
                                                                             Progress* progress, Portion portion) {
  return of_axes<std::array<ScalarVolume, 2>>(
      reader, grid, file, log, portion,
      [&](SourceGrid source, const std::string& grid_name, const Log& heard, const std::string& prefix, Portion part) {
        return assemble_signed(std::move(source), grid_name, heard, prefix, progress, part);
      });
}

ScalarVolume import_volume(const FilePath& file, const std::string& grid_name, const Log& log, Progress* progress) {
  return naming(file.given(), [&] {
    const std::unique_ptr<Reader> reader = open(file.absolute(), progress);
    for (const std::string& text : reader->remarks()) log.warning(one_line(file.given() + ": " + text));
    const std::size_t chosen = choose_grid(reader->grids(), grid_name);
    if (grid_name.empty()) {
      const std::string remark = remark_on_choice(reader->grids(), chosen, std::span(&chosen, 1));
      if (!remark.empty()) log.warning(one_line(file.given() + ": " + remark));
    }
    return import_grid(*reader, chosen, file.given(), log, progress, {reader->opened(), 1.0});
  });
}

}  // namespace cumulet::volume
