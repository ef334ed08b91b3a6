#include "grid/lattice.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <tuple>
#include <unordered_map>

#include "base/progress_part.hpp"
#include "grid/cell.hpp"
#include "grid/evaluation.hpp"
#include "grid/sixth_means.hpp"

namespace cumulet::grid {

namespace {

using glm::ivec3;
using glm::uvec2;
using glm::vec3;

uvec2 pack_block(const ivec3& corner, std::uint32_t scale) {
  const glm::uvec3 c(corner);
  return {c.x | (c.y << 16U), c.z | (scale << 16U)};
}

// Orders blocks by scale, coarsest first, then by position.
bool before(const uvec2& a, const uvec2& b) {
  const auto key = [](const uvec2& block) {
    return std::make_tuple(~core::cm_block_scale(block), block.x, block.y & 0xffffU);
  };
  return key(a) < key(b);
}

// Returns the density data of a record for a cell above bricks.
uvec2 coefficients_of(const Moments& m, const vec3& v0, std::uint32_t shape, CellKind cells, double to_relative) {
  const double mean = std::clamp(m.mean(), double(m.min), double(m.max));
  vec3 gradient(0.0F);
  if (has_fits(cells) && m.min < m.max) {
    gradient = fit_linear(core::cm_shape_class(shape), frame_covariance(m, shape, centroid_of(v0, shape)),
                          static_cast<float>(mean))
                   .gradient *
               static_cast<float>(to_relative);
  }
  return {glm::packHalf2x16({static_cast<float>(mean * to_relative), gradient.x}),
          glm::packHalf2x16({gradient.y, gradient.z})};
}

// Calls visit(v0, shape) for the coarse cells of an octree cube: its Kuhn tetrahedra, their halves and quarters. For
// the control cube these are the roots.
template <class Visit>
void for_coarse_cells(const ivec3& corner, int cube_size, int log2_size, Visit visit) {
  if (cube_size == log2_size) {
    for (unsigned root = 0; root < 24; ++root) {
      vec3 v0;
      std::uint32_t shape = 0;
      core::cm_root_cell(root, static_cast<std::uint32_t>(log2_size - 1), v0, shape);
      visit(v0, shape);
    }
    return;
  }
  const int size = 1 << cube_size;
  for (std::uint32_t permutation = 0; permutation < 6; ++permutation) {
    vec3 v0(corner);
    for (int axis = 0; axis < 3; ++axis) v0[axis] += static_cast<float>(corner[axis] & size);
    const std::uint32_t shape =
        kuhn_frame(corner, size, permutation) | (1U << 9U) | (static_cast<std::uint32_t>(cube_size) << 11U);
    visit(v0, shape);
    for (unsigned a = 0; a < 2; ++a) {
      const std::uint32_t half = core::cm_child_shape(shape, a);
      const vec3 half_v0 = a == 0 ? v0 : core::cm_cell_vertex(v0, shape, 1);
      visit(half_v0, half);
      for (unsigned b = 0; b < 2; ++b)
        visit(b == 0 ? half_v0 : core::cm_cell_vertex(half_v0, half, 1), core::cm_child_shape(half, b));
    }
  }
}

}  // namespace

Lattice::Lattice(const Statistics& statistics, const Channels& beside, const RefineSettings& settings, float max_value,
                 Progress* progress)
    : cube(statistics.cube()),
      own(statistics, beside, settings, progress),
      density_unit(max_value > 0.0F ? max_value : 1.0F),
      cells(settings.cells) {
  const std::vector<ChannelFields> fields = fields_of(statistics, beside);
  find_blocks(statistics, fields, progress);
  fill_entries(statistics, progress);
  fill_coarse(statistics, progress);
  for (const ChannelFields& of : fields) channels.push_back(make_channel(of, progress));
}

std::uint64_t Lattice::device_bytes() const {
  std::uint64_t values = std::uint64_t{bricks} * brick_voxels() * (halves ? 2 : 4);
  for (const LatticeChannel& channel : channels)
    values += (channel.even_bricks.size() + channel.bricks.size()) * channel.brick_voxels * channel.numbers * 4;
  return bytes() + values + 2 * own.to_rate.values + std::uint64_t{blocks.size()} * CM_BLOCK_POINTS * 4;
}

void Lattice::find_blocks(const Statistics& statistics, const std::vector<ChannelFields>& beside, Progress* progress) {
  std::vector<std::uint8_t> all;
  resize(all, own.nodes.size(), progress);
  std::ranges::transform(own.nodes, all.begin(),
                         [](const auto& node) { return static_cast<std::uint8_t>(core::cm_node_levels(node)); });
  // With all levels enabled, this set contains every vertex that any view can raise.
  const DiamondSet everywhere(own, all, std::numeric_limits<std::uint64_t>::max(), progress);
  blocks = everywhere.blocks(progress);
  // Lookups start at the coarsest block, so every block's ancestors must exist.
  const auto pair_less = [](const uvec2& a, const uvec2& b) { return before(a, b); };
  std::set<uvec2, decltype(pair_less)> above(pair_less);
  const auto add_above = [&](ivec3 corner, std::uint32_t scale) {
    while (scale < top_scale()) {
      corner >>= 3;
      if (!above.insert(pack_block(corner, ++scale)).second) return;
    }
  };
  above.insert(pack_block(ivec3(0), top_scale()));
  for (const uvec2& block : blocks) add_above(core::cm_block_corner(block), core::cm_block_scale(block));
  const auto add_bricks = [&](const Statistics& field) {
    for (const std::uint32_t n : field.nodes_of_size(3)) add_above(field.nodes()[n].corner >> 3, 0);
  };
  add_bricks(statistics);
  for (const ChannelFields& fields : beside)
    std::ranges::for_each(fields.statistics(), [&](const Statistics* field) { add_bricks(*field); });
  blocks.insert(blocks.end(), above.begin(), above.end());
  std::ranges::sort(blocks, before);
  blocks.erase(std::unique(blocks.begin(), blocks.end()), blocks.end());
  blocks.insert(blocks.begin(), uvec2(0U));
  for (std::uint32_t scale = 0; scale < first.size(); ++scale) {
    const auto begin = std::partition_point(blocks.begin() + 1, blocks.end(),
                                            [&](const uvec2& block) { return core::cm_block_scale(block) > scale; });
    first[scale] = static_cast<std::uint32_t>(begin - blocks.begin());
  }
}

std::uint32_t Lattice::block_at(const ivec3& corner, std::uint32_t scale) const {
  const uvec2 block = pack_block(corner, scale);
  const auto found = std::lower_bound(blocks.begin() + 1, blocks.end(), block, before);
  return found != blocks.end() && *found == block ? static_cast<std::uint32_t>(found - blocks.begin()) : 0;
}

template <class Visit>
void Lattice::for_each_entry(const Progress* progress, Visit&& visit) const {
  for (std::uint32_t b = 1; b < first[0]; ++b) {
    check(progress);
    const int scale = static_cast<int>(core::cm_block_scale(blocks[b]));
    for (int i = 0; i < static_cast<int>(CM_BLOCK_POINTS); ++i) {
      const ivec3 point = core::cm_block_corner(blocks[b]) * 8 + ivec3(i / 64, i / 8 % 8, i % 8);
      const ivec3 corner = point << (3 * scale);
      if (std::max({corner.x, corner.y, corner.z}) >= cube.size()) continue;
      visit(std::size_t{b} * CM_BLOCK_POINTS + static_cast<std::size_t>(i), corner, scale);
    }
  }
}

std::size_t Lattice::entry_about(const ivec3& corner, int log2_size) const {
  const ivec3 middle = corner + (1 << (log2_size - 1));
  const std::uint32_t scale = core::cm_octave(middle) / 3;
  const ivec3 point = middle >> static_cast<int>(3 * scale);
  return std::size_t{block_at(point >> 3, scale)} * CM_BLOCK_POINTS + core::cm_in_block(point);
}

void Lattice::fill_entries(const Statistics& statistics, const Progress* progress) {
  resize(entries, std::size_t{first[0]} * CM_BLOCK_POINTS, progress);
  even_bricks.push_back(0.0F);
  std::unordered_map<float, std::uint32_t> even{{0.0F, 0}};
  struct Brick {
    std::size_t entry;
    std::uint32_t number;
  };
  std::vector<Brick> with_values;
  for (std::uint32_t b = 2; b < blocks.size(); ++b) {
    // The entry for a block is at the point of the next coarser scale at its corner.
    const ivec3 corner = core::cm_block_corner(blocks[b]);
    const std::uint32_t above = block_at(corner >> 3, core::cm_block_scale(blocks[b]) + 1);
    entries[std::size_t{above} * CM_BLOCK_POINTS + core::cm_in_block(corner)].block = b;
  }
  for_each_entry(progress, [&](std::size_t index, const ivec3& corner, int scale) {
    const Statistics::Node& node = statistics.node_at(corner, 3 * scale);
    if (node.is_uniform()) {
      const auto [found, added] = even.emplace(node.uniform, static_cast<std::uint32_t>(even_bricks.size()));
      if (added) even_bricks.push_back(node.uniform);
      entries[index].brick = found->second;
    } else if (scale == 1) {
      with_values.push_back({index, node.moments / 6});
    }
  });
  for (const Brick& brick : with_values)
    entries[brick.entry].brick = static_cast<std::uint32_t>(even_bricks.size()) + brick.number;
  bricks = even_bricks.size() + statistics.nodes_of_size(3).size();
  halves = statistics.values_are_halves() &&
           std::ranges::all_of(even_bricks, [](float value) { return volume::exact_half(value).has_value(); });
}

void Lattice::fill_coarse(const Statistics& statistics, const Progress* progress) {
  std::vector<const Statistics::Node*> nodes;
  for (int size = 4; size <= cube.log2_size; ++size) {
    for (const std::uint32_t n : statistics.nodes_of_size(size)) nodes.push_back(&statistics.nodes()[n]);
  }
  resize(coarse, nodes.size() + 1, progress);
  const double to_relative = 1.0 / density_unit;
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, nodes.size(), 16), [&](const auto& range) {
    check(progress);
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      const Statistics::Node& node = *nodes[i];
      CoarseCells& made = coarse[i + 1];
      for_coarse_cells(node.corner, node.log2_size, cube.log2_size, [&](const vec3& v0, std::uint32_t shape) {
        const std::uint32_t cell = core::cm_coarse_cell(v0, shape, vec3(node.corner));
        const Moments m = statistics.moments(v0, shape);
        made.coefficients[cell] = coefficients_of(m, v0, shape, cells, to_relative);
        if (m.max > 0.0F) made.dense[cell / 32] |= 1U << (cell % 32);
      });
      entries[entry_about(node.corner, node.log2_size)].coarse = static_cast<std::uint32_t>(i + 1);
    }
  });
}

namespace {

// Octree cubes above bricks in which any of the fields varies, without duplicates.
struct CoarseCube {
  int log2_size;
  ivec3 corner;
  [[nodiscard]] auto key() const { return std::tie(log2_size, corner.x, corner.y, corner.z); }
};
std::vector<CoarseCube> coarse_cubes(const ChannelFields& fields, int log2_size, const Progress* progress) {
  std::vector<CoarseCube> cubes;
  for (const Statistics* field : fields.statistics()) {
    for (int size = 4; size <= log2_size; ++size) {
      check(progress);
      for (const std::uint32_t n : field->nodes_of_size(size)) cubes.push_back({size, field->nodes()[n].corner});
    }
  }
  std::ranges::sort(cubes, {}, &CoarseCube::key);
  const auto same = [](const CoarseCube& a, const CoarseCube& b) { return a.key() == b.key(); };
  cubes.erase(std::unique(cubes.begin(), cubes.end(), same), cubes.end());
  return cubes;
}

}  // namespace

LatticeChannel Lattice::make_channel(const ChannelFields& fields, const Progress* progress) const {
  LatticeChannel made;
  made.channel = fields.channel();
  made.numbers = fields.count();
  made.fastest = fields.fastest();
  made.brick_voxels = brick_voxels();
  fill_bricks(fields, made, progress);
  const std::size_t words = fields.record_words();
  const std::size_t cube_words = core::cm_coarse_channel_words(static_cast<std::uint32_t>(words));
  const std::vector<CoarseCube> cubes = coarse_cubes(fields, cube.log2_size, progress);
  resize(made.coarse, (cubes.size() + 1) * cube_words, progress);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, cubes.size(), 16), [&](const auto& range) {
    check(progress);
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      const CoarseCube& at = cubes[i];
      const std::span<std::uint32_t> records = std::span(made.coarse).subspan((i + 1) * cube_words, cube_words);
      for_coarse_cells(at.corner, at.log2_size, cube.log2_size, [&](const vec3& v0, std::uint32_t shape) {
        const std::uint32_t cell = core::cm_coarse_cell(v0, shape, vec3(at.corner));
        const ChannelFields::CellMoments moments = fields.moments(v0, shape);
        fields.put_record(moments, centroid_of(v0, shape), shape, cells, records.subspan(words * cell, words));
        if (fields.emits(moments)) records[words * CM_COARSE_CELLS + cell / 32] |= 1U << (cell % 32);
      });
      made.entries[entry_about(at.corner, at.log2_size)].coarse = static_cast<std::uint32_t>(i + 1);
    }
  });
  return made;
}

void Lattice::fill_bricks(const ChannelFields& fields, LatticeChannel& made, const Progress* progress) const {
  resize(made.entries, entries.size(), progress);
  std::ranges::transform(entries, made.entries.begin(),
                         [](const LatticeEntry& entry) { return LatticeEntry{.block = entry.block}; });
  made.even_bricks.push_back({});
  std::map<ChannelNumbers, std::uint32_t> even{{ChannelNumbers{}, 0}};
  std::vector<std::size_t> with_values;
  for_each_entry(progress, [&](std::size_t index, const ivec3& corner, int scale) {
    if (const std::optional<ChannelNumbers> numbers = fields.even(corner, 3 * scale)) {
      const auto [found, added] = even.emplace(*numbers, static_cast<std::uint32_t>(made.even_bricks.size()));
      if (added) made.even_bricks.push_back(*numbers);
      made.entries[index].brick = found->second;
    } else if (scale == 1) {
      with_values.push_back(index);
      made.bricks.push_back(corner);
    }
  });
  for (std::size_t i = 0; i < with_values.size(); ++i)
    made.entries[with_values[i]].brick = static_cast<std::uint32_t>(made.even_bricks.size() + i);
}

namespace {

// The weight of one voxel in a cell, in sixths, and its moment.
struct Share {
  double weight = 0.0;
  glm::dvec3 moment{0.0};
};
using Shares = std::map<std::tuple<int, int, int>, Share>;

void add_sixth(const vec3& v0, std::uint32_t shape, Interpolation interpolation, Shares& shares) {
  const auto add = [&](const ivec3& voxel, double weight, const glm::dvec3& moment) {
    Share& share = shares[{voxel.x, voxel.y, voxel.z}];
    share.weight += weight;
    share.moment += moment;
  };
  if (interpolation == Interpolation::nearest) {
    const glm::dvec3 middle = centroid_of(v0, shape);
    return add(ivec3(glm::floor(middle)), 1.0, middle);
  }
  for (std::size_t corner = 0; corner < sixth_monomials; ++corner) {
    const vec3 offset(exponent_in(corner, 0), exponent_in(corner, 1), exponent_in(corner, 2));
    const glm::dvec3 mean(mean_of_weight(corner, 0), mean_of_weight(corner, 1), mean_of_weight(corner, 2));
    const double weight = mean_of_weight(corner);
    add(ivec3(v0 + core::cm_from_frame(offset, shape)), weight,
        weight * glm::dvec3(v0) + glm::dvec3(core::cm_from_frame(vec3(mean), shape)));
  }
}

void collect(const vec3& v0, std::uint32_t shape, Interpolation interpolation, Shares& shares) {
  if (core::cm_shape_class(shape) == 1 && core::cm_shape_exponent(shape) == 0)
    return add_sixth(v0, shape, interpolation, shares);
  collect(v0, core::cm_child_shape(shape, 0), interpolation, shares);
  collect(core::cm_cell_vertex(v0, shape, 1), core::cm_child_shape(shape, 1), interpolation, shares);
}

CellParts make_cell_parts(Interpolation interpolation) {
  CellParts made;
  unsigned count = 0;
  if (interpolation == Interpolation::linear) made.sixth = CM_SIXTH_BETWEEN;
  // Frame whose axes are the cube's axes.
  std::uint32_t shape = (1U << 5U) | (2U << 7U) | (1U << 9U) | (3U << 11U);
  for (unsigned level = 0; level <= brick_levels; ++level) {
    Shares shares;
    collect(vec3(0.0F), shape, interpolation, shares);
    const glm::dvec3 centroid = centroid_of(vec3(0.0F), shape);
    for (const auto& [voxel, share] : shares) {
      const auto [x, y, z] = voxel;
      const auto weight = static_cast<std::uint32_t>(std::lround(share.weight * made.sixth));
      made.parts[count++] = {
          vec3((share.moment / share.weight - centroid) * double(core::cm_shape_inverse_unit(shape))),
          static_cast<std::uint32_t>(x | (y << 4) | (z << 8)) | (weight << 12U)};
    }
    made.first[level + 1] = count;
    shape = core::cm_child_shape(shape, 0);
  }
  return made;
}

}  // namespace

const CellParts& cell_parts(Interpolation interpolation) {
  static const CellParts nearest = make_cell_parts(Interpolation::nearest);
  static const CellParts linear = make_cell_parts(Interpolation::linear);
  return interpolation == Interpolation::linear ? linear : nearest;
}

}  // namespace cumulet::grid
