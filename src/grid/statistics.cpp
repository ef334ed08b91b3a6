#include "grid/statistics.hpp"

#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <bit>
#include <memory>
#include <numeric>
#include <optional>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "base/error.hpp"
#include "base/never_destroyed.hpp"
#include "base/progress_part.hpp"
#include "grid/cell.hpp"
#include "volume/bricks.hpp"

namespace cumulet::grid {

namespace {

using glm::dvec3;
using glm::ivec3;
using glm::vec3;

double cell_volume(std::uint32_t shape) {
  const double unit = core::cm_shape_unit(shape);
  constexpr std::array<double, 3> factor{1.0 / 3.0, 1.0 / 6.0, 2.0 / 3.0};
  return factor[core::cm_shape_class(shape)] * unit * unit * unit;
}

vec3 cell_centroid(const vec3& v0, std::uint32_t shape) {
  return v0 +
         core::cm_from_frame(core::cm_frame_centroid(core::cm_shape_class(shape)) * core::cm_shape_unit(shape), shape);
}

constexpr std::uint32_t shape_word(std::uint32_t frame, std::uint32_t cell_class, int exponent) {
  return frame | (cell_class << 9U) | (static_cast<std::uint32_t>(exponent) << 11U);
}

vec3 child_v0(const vec3& v0, std::uint32_t shape, unsigned child) {
  return child == 0 ? v0 : core::cm_cell_vertex(v0, shape, 1);
}

std::array<std::uint32_t, 3> axes_of(std::uint32_t permutation) {
  const std::uint32_t px = permutation / 2;
  const std::uint32_t low = px == 0 ? 1 : 0;
  const std::uint32_t high = px == 2 ? 1 : 2;
  return (permutation & 1U) == 0 ? std::array{px, low, high} : std::array{px, high, low};
}

// Bits 0-2 of a frame hold the signs of the frame's axes, but a cube corner gives the signs of the cube's.
std::uint32_t frame_from(const std::array<bool, 3>& cube_axis_negative, std::uint32_t permutation) {
  const auto axes = axes_of(permutation);
  std::uint32_t frame = 0;
  for (std::uint32_t i = 0; i < 3; ++i) {
    frame |= (cube_axis_negative[axes[i]] ? 1U : 0U) << i;
    frame |= axes[i] << (3 + 2 * i);
  }
  return frame;
}

int corner_index(const ivec3& point) { return (point.x * brick_corners + point.y) * brick_corners + point.z; }

BrickTree::Leaf leaf_of(const vec3& v0, std::uint32_t shape) {
  BrickTree::Leaf leaf{};
  leaf.first = static_cast<std::uint16_t>(corner_index(ivec3(v0)));
  for (int i = 0; i < 3; ++i) {
    vec3 along(0.0F);
    along[i] = 1.0F;
    const ivec3 step(core::cm_from_frame(along, shape));
    const int axis = step.x != 0 ? 0 : (step.y != 0 ? 1 : 2);
    const auto at = static_cast<std::size_t>(i);
    leaf.step[at] = static_cast<std::int16_t>(corner_index(step));
    leaf.axis[at] = static_cast<std::int16_t>(step[axis] > 0 ? axis : ~axis);
  }
  return leaf;
}

void fill_tree(BrickTree& tree, unsigned heap, const vec3& v0, std::uint32_t shape) {
  const vec3 centroid = cell_centroid(v0, shape);
  if (heap >= 512) {
    const ivec3 voxel(centroid);
    tree.voxel[heap - 512] = static_cast<std::uint16_t>((voxel.x * 8 + voxel.y) * 8 + voxel.z);
    for (int axis = 0; axis < 3; ++axis) tree.centroid[static_cast<std::size_t>(axis)][heap - 512] = centroid[axis];
    tree.leaf[heap - 512] = leaf_of(v0, shape);
    return;
  }
  tree.shape[heap] = static_cast<std::uint16_t>(shape);
  tree.node_centroid[heap] = centroid;
  tree.midpoint[heap] =
      glm::u8vec3(v0 + core::cm_from_frame(
                           core::cm_frame_midpoint(core::cm_shape_class(shape)) * core::cm_shape_unit(shape), shape));
  for (unsigned child = 0; child < 2; ++child) {
    fill_tree(tree, 2 * heap + child, child_v0(v0, shape, child), core::cm_child_shape(shape, child));
  }
}

std::array<bool, 3> signs_of_frame(std::uint32_t frame) {
  std::array<bool, 3> negative{};
  for (std::uint32_t i = 0; i < 3; ++i) negative[(frame >> (3 + 2 * i)) & 3U] = ((frame >> i) & 1U) != 0;
  return negative;
}

struct BrickTrees {
  std::array<BrickTree, 48> trees;
  BrickTrees() {
    for (std::uint32_t permutation = 0; permutation < 6; ++permutation) {
      for (std::uint32_t signs = 0; signs < 8; ++signs) {
        const std::array<bool, 3> negative{(signs & 1U) != 0, (signs & 2U) != 0, (signs & 4U) != 0};
        const std::uint32_t frame = frame_from(negative, permutation);
        const vec3 v0(negative[0] ? 8.0F : 0.0F, negative[1] ? 8.0F : 0.0F, negative[2] ? 8.0F : 0.0F);
        fill_tree(trees[permutation * 8 + signs], 1, v0, shape_word(frame, 1, 3));
      }
    }
  }
};

}  // namespace

Moments& Moments::operator+=(const Moments& other) {
  volume += other.volume;
  mass += other.mass;
  square += other.square;
  first += other.first;
  min = std::min(min, other.min);
  max = std::max(max, other.max);
  return *this;
}

double Moments::variance() const {
  if (min >= max) return 0.0;
  const double m = mean();
  return std::max(0.0, square / volume - m * m);
}

vec3 frame_covariance(const Moments& moments, std::uint32_t shape, const dvec3& centroid) {
  const dvec3 in_cube = moments.first / moments.volume - centroid * moments.mean();
  return core::cm_to_frame(vec3(in_cube), shape) / core::cm_shape_unit(shape);
}

LinearFit fit_linear(std::uint32_t cell_class, const vec3& covariance, float mean) {
  const core::CmFit fit = core::cm_fit_linear(cell_class, covariance, mean);
  return {fit.gradient, fit.explained};
}

std::uint32_t permutation_of(std::uint32_t shape) {
  const std::uint32_t px = (shape >> 3U) & 3U;
  const std::uint32_t py = (shape >> 5U) & 3U;
  return px * 2 + (py == (px == 0 ? 1U : 0U) ? 0U : 1U);
}

std::uint32_t kuhn_frame(const ivec3& corner, int size, std::uint32_t permutation) {
  // v0 is the corner of the cube that is a multiple of twice its size.
  std::array<bool, 3> negative{};
  for (int axis = 0; axis < 3; ++axis) negative[axis] = ((corner[axis] / size) & 1) != 0;
  return frame_from(negative, permutation);
}

const BrickTree& brick_tree(std::uint32_t frame) {
  static const NeverDestroyed<const BrickTrees> trees;
  const auto negative = signs_of_frame(frame);
  const unsigned signs = (negative[0] ? 1U : 0U) | (negative[1] ? 2U : 0U) | (negative[2] ? 4U : 0U);
  return trees.get().trees[permutation_of(frame) * 8 + signs];
}

float BrickSums::reference_of(const float* values) {
  // The order of additions matches glsl/grid/brick_sums.glsl.
  std::array<float, 128> sums{};
  for (std::size_t row = 0; row < 64; ++row) {
    for (std::size_t z = 0; z < 8; ++z) sums[64 + row] += values[8 * row + z];
  }
  for (std::size_t i = 63; i >= 1; --i) sums[i] = sums[2 * i] + sums[2 * i + 1];
  return sums[1] / static_cast<float>(volume::brick_voxels);
}

void BrickSums::compute(const float* values, float of_brick, const BrickTree& tree) {
  reference = of_brick;
  for (unsigned i = 0; i < 512; ++i) min[512 + i] = values[tree.voxel[i]];
  std::copy(min.begin() + 512, min.end(), max.begin() + 512);
  // Separate loops: each vectorizes.
  for (unsigned i = 0; i < 512; ++i) mass[512 + i] = min[512 + i] - reference;
  for (unsigned i = 0; i < 512; ++i) square[512 + i] = mass[512 + i] * mass[512 + i];
  for (unsigned i = 0; i < 512; ++i) x[512 + i] = mass[512 + i] * tree.centroid[0][i];
  for (unsigned i = 0; i < 512; ++i) y[512 + i] = mass[512 + i] * tree.centroid[1][i];
  for (unsigned i = 0; i < 512; ++i) z[512 + i] = mass[512 + i] * tree.centroid[2][i];
  add_up();
}

void BrickSums::add_up() {
  for (unsigned level = 256; level >= 1; level /= 2) {
    const auto add = [level](std::array<float, 1024>& a) {
      for (unsigned h = level; h < 2 * level; ++h) a[h] = a[2 * h] + a[2 * h + 1];
    };
    add(mass);
    add(square);
    add(x);
    add(y);
    add(z);
    for (unsigned h = level; h < 2 * level; ++h) min[h] = std::min(min[2 * h], min[2 * h + 1]);
    for (unsigned h = level; h < 2 * level; ++h) max[h] = std::max(max[2 * h], max[2 * h + 1]);
  }
}

void BrickField::read(const Statistics& statistics, const Statistics::Node& node) {
  interpolates_ = statistics.interpolates();
  if (interpolates_) {
    statistics.read_corners(node, corners_);
    reference_ = std::accumulate(corners_.begin(), corners_.end(), 0.0F) / static_cast<float>(corners_.size());
  } else {
    values_ = statistics.values(node, room_);
    reference_ = BrickSums::reference_of(values_);
  }
}

void BrickField::sum(const BrickTree& tree, BrickSums& sums) const {
  if (interpolates_) {
    sums.compute_between(corners_, reference_, tree);
  } else {
    sums.compute(values_, reference_, tree);
  }
}

namespace {

// Converts sums over `leaves` leaves, relative to the reference, to moments. centroid: from the brick's low corner.
Moments moments_of_sums(double leaves, float reference, float mass, float square, const vec3& first,
                        const vec3& centroid, const ivec3& corner) {
  constexpr double leaf_volume = 1.0 / 6.0;
  Moments m;
  m.volume = leaves * leaf_volume;
  m.mass = (mass + leaves * reference) * leaf_volume;
  // square: sum (f' + r)^2 = sum f'^2 + 2 r sum f' + n r^2
  m.square = (square + 2.0 * reference * mass + leaves * reference * static_cast<double>(reference)) * leaf_volume;
  m.first = dvec3(first) * leaf_volume + dvec3(centroid) * (m.volume * reference) + dvec3(corner) * m.mass;
  return m;
}

}  // namespace

Moments BrickSums::moments(unsigned h, const ivec3& corner, const BrickTree& tree) const {
  const vec3 centroid = h < 512 ? tree.node_centroid[h]
                                : vec3(tree.centroid[0][h - 512], tree.centroid[1][h - 512], tree.centroid[2][h - 512]);
  Moments m =
      moments_of_sums(512.0 / std::bit_floor(h), reference, mass[h], square[h], {x[h], y[h], z[h]}, centroid, corner);
  m.min = min[h];
  m.max = max[h];
  return m;
}

Moments moments_of(const volume::BrickSummary& summary, std::uint32_t permutation, const ivec3& corner,
                   const BrickTree& tree) {
  const float* sums = summary.cells + std::size_t{7} * permutation;
  Moments m = moments_of_sums(512.0, summary.reference, sums[0], sums[1], {sums[2], sums[3], sums[4]},
                              tree.node_centroid[1], corner);
  m.min = sums[5];
  m.max = sums[6];
  return m;
}

Moments uniform_moments(const vec3& v0, std::uint32_t shape, float value) {
  Moments m;
  m.volume = cell_volume(shape);
  m.mass = value * m.volume;
  m.square = value * m.mass;
  m.first = dvec3(cell_centroid(v0, shape)) * m.mass;
  m.min = m.max = value;
  return m;
}

Statistics::Statistics(const volume::ScalarVolume& volume, const Cube& cube, Progress* progress)
    : cube_(cube),
      by_size_(static_cast<std::size_t>(cube.log2_size) + 1),
      volume_(&volume),
      on_device_(volume.on_device) {
  build_topology(volume, progress);
  compute_mean_optical_depth(volume, progress);
  compute_moments(progress);
}

const float* Statistics::values(const Node& node, volume::BrickValues::Brick& room) const {
  if (interpolates()) {
    BrickCorners corners;
    read_corners(node, corners);
    for (int v = 0; v < volume::brick_voxels; ++v) {
      float sum = 0.0F;
      for (int i = 0; i < 8; ++i)
        sum += corners[static_cast<std::size_t>(
            corner_index({v / 64 + (i >> 2), v / 8 % 8 + ((i >> 1) & 1), v % 8 + (i & 1)}))];
      room[static_cast<std::size_t>(v)] = 0.125F * sum;
    }
    return room.data();
  }
  const auto count = static_cast<std::int32_t>(volume_->brick_values.size() / volume::brick_voxels);
  return node.values < count ? volume_->brick_values.brick(std::size_t(node.values), room)
                             : extra_values_.data() + std::size_t(node.values - count) * volume::brick_voxels;
}

namespace {

// Copies the voxels of a brick that are lattice points of a brick with interpolation. offset: of the first brick, in
// bricks from the second one, 0 or 1 along each axis. values: null for 0.
void copy_corners(const ivec3& offset, const float* values, BrickCorners& corners) {
  const ivec3 from = offset * volume::brick_size;
  const ivec3 to = glm::mix(ivec3(volume::brick_size), ivec3(brick_corners), glm::equal(offset, ivec3(1)));
  for (int i = from.x; i < to.x; ++i) {
    for (int j = from.y; j < to.y; ++j) {
      for (int k = from.z; k < to.z; ++k)
        corners[static_cast<std::size_t>(corner_index({i, j, k}))] =
            values == nullptr ? 0.0F : values[((i & 7) * 8 + (j & 7)) * 8 + (k & 7)];
    }
  }
}

// Reads a brick's corners. tiles: null if neither tiles nor the background have other voxels than 0.
void gather_corners(const volume::ScalarVolume& volume, const ivec3& low, const std::vector<std::uint32_t>* tiles,
                    BrickCorners& corners) {
  volume::BrickValues::Brick room;
  for (int i = 0; i < 8; ++i) {
    const ivec3 offset(i >> 2, (i >> 1) & 1, i & 1);
    const ivec3 origin = low + offset * volume::brick_size;
    const float* values = volume::find_brick(volume, origin, room);
    if (values == nullptr && tiles != nullptr) {
      volume::fill_brick(volume, origin, *tiles, room.data());
      values = room.data();
    }
    copy_corners(offset, values, corners);
  }
}

bool are_equal(const BrickCorners& corners) {
  return std::ranges::all_of(corners, [&](float value) { return value == corners[0]; });
}

}  // namespace

void Statistics::read_corners(const Node& node, BrickCorners& corners) const {
  if (node.values == 0) {
    gather_corners(*volume_, node.corner + cube_.origin, nullptr, corners);
  } else {
    std::copy_n(extra_values_.begin() + std::ptrdiff_t{node.values - 1} * std::ssize(corners), corners.size(),
                corners.begin());
  }
}

bool Statistics::values_are_halves() const {
  if (on_device_) return on_device_->are_halves();
  return volume_->brick_values.are_halves() &&
         std::ranges::all_of(extra_values_, [](float value) { return volume::exact_half(value).has_value(); });
}

namespace {

// A box of voxels; high is inclusive.
struct VoxelBox {
  ivec3 low;
  ivec3 high;
  [[nodiscard]] bool holds(const VoxelBox& box) const {
    return glm::all(glm::greaterThanEqual(box.low, low)) && glm::all(glm::lessThanEqual(box.high, high));
  }
  [[nodiscard]] bool overlaps(const VoxelBox& box) const {
    return glm::all(glm::lessThanEqual(low, box.high)) && glm::all(glm::greaterThanEqual(high, box.low));
  }
};

VoxelBox box_of(const volume::Tile& tile) { return {tile.min, tile.max}; }

// Returns the value of a box without bricks if it is uniform. tiles: all tiles that overlap the box.
std::optional<float> one_value(const volume::ScalarVolume& volume, const VoxelBox& box,
                               const std::vector<std::uint32_t>& tiles) {
  const VoxelBox bounds{volume.bounds_min, volume.bounds_max};
  if (tiles.empty() && (volume.background == 0.0F || bounds.holds(box))) return volume.background;
  if (tiles.size() == 1 && box_of(volume.tiles[tiles[0]]).holds(box)) return volume.tiles[tiles[0]].value;
  return std::nullopt;
}

// Returns the origins of the bricks that may have values beside tiles and the background. With interpolation these
// include the bricks whose far lattice points are in a brick of the volume.
std::vector<ivec3> occupied_bricks(const volume::ScalarVolume& volume, bool interpolates) {
  if (!interpolates) return volume.brick_origins;
  std::vector<ivec3> origins;
  origins.reserve(8 * volume.brick_origins.size());
  for (const ivec3& origin : volume.brick_origins) {
    for (int i = 0; i < 8; ++i) origins.push_back(origin - volume::brick_size * ivec3(i >> 2, (i >> 1) & 1, i & 1));
  }
  tbb::parallel_sort(origins, volume::lexicographic);
  origins.erase(std::unique(origins.begin(), origins.end()), origins.end());
  return origins;
}

// Sorts bricks [first, last) by octant about the middle; octant i (x fastest) is then [ends[i], ends[i + 1]).
std::array<std::uint32_t, 9> sort_by_octant(const std::vector<ivec3>& origins, std::vector<std::uint32_t>& bricks,
                                            std::uint32_t first, std::uint32_t last, const ivec3& middle) {
  const auto split = [&](std::uint32_t from, std::uint32_t to, int axis) {
    return static_cast<std::uint32_t>(std::partition(bricks.begin() + from, bricks.begin() + to,
                                                     [&](std::uint32_t b) { return origins[b][axis] < middle[axis]; }) -
                                      bricks.begin());
  };
  std::array<std::uint32_t, 9> ends{};
  ends[0] = first;
  ends[8] = last;
  ends[4] = split(ends[0], ends[8], 2);
  for (unsigned i : {0U, 4U}) ends[i + 2] = split(ends[i], ends[i + 4], 1);
  for (unsigned i : {0U, 2U, 4U, 6U}) ends[i + 1] = split(ends[i], ends[i + 2], 0);
  return ends;
}

}  // namespace

void Statistics::set_values(Node& node, const std::optional<std::uint32_t>& brick,
                            const std::vector<std::uint32_t>& tiles) {
  if (brick) {
    node.values = static_cast<std::int32_t>(*brick);
    return;
  }
  // A tile or the background ends inside this brick.
  node.values = static_cast<std::int32_t>(volume_->brick_origins.size() + extra_values_.size() / volume::brick_voxels);
  extra_values_.resize(extra_values_.size() + volume::brick_voxels);
  volume::fill_brick(*volume_, node.corner + cube_.origin, tiles,
                     &extra_values_[extra_values_.size() - volume::brick_voxels]);
}

void Statistics::set_corners(Node& node, const std::vector<std::uint32_t>& tiles) {
  const bool only_bricks = tiles.empty() && volume_->background == 0.0F;
  BrickCorners corners;
  gather_corners(*volume_, node.corner + cube_.origin, only_bricks ? nullptr : &tiles, corners);
  if (are_equal(corners)) {
    node.uniform = corners[0];
    return;
  }
  // The corners of payload 0 are gathered again when they are read.
  node.values = 0;
  if (only_bricks) return;
  extra_values_.insert(extra_values_.end(), corners.begin(), corners.end());
  node.values = static_cast<std::int32_t>(extra_values_.size() / corners.size());
}

void Statistics::build_topology(const volume::ScalarVolume& volume, Progress* progress) {
  const std::vector<ivec3> origins = occupied_bricks(volume, interpolates());
  const int reach = interpolates() ? 1 : 0;  // lattice points beyond the cells of a node
  ProgressPart part(progress, 0.0, 0.1, origins.size());
  struct Work {
    std::uint32_t node;
    std::uint32_t first, last;         // range of bricks
    std::vector<std::uint32_t> tiles;  // tiles that overlap the node
  };
  std::vector<std::uint32_t> bricks(origins.size());
  for (std::uint32_t i = 0; i < bricks.size(); ++i) bricks[i] = i;

  std::vector<std::uint32_t> all_tiles(volume.tiles.size());
  for (std::uint32_t i = 0; i < all_tiles.size(); ++i) all_tiles[i] = i;
  nodes_.push_back({.corner = ivec3(0), .log2_size = cube_.log2_size});
  std::vector<Work> stack;
  stack.push_back({0, 0, static_cast<std::uint32_t>(bricks.size()), std::move(all_tiles)});

  std::uint64_t rounds = 0;
  std::uint64_t done = 0;
  while (!stack.empty()) {
    if (++rounds % 256 == 0) part.add(std::exchange(done, 0));
    Work work = std::move(stack.back());
    stack.pop_back();
    const ivec3 corner = nodes_[work.node].corner;
    const int log2_size = nodes_[work.node].log2_size;
    const ivec3 low = corner + cube_.origin;
    const VoxelBox box{low, low + ((1 << log2_size) - 1 + reach)};
    if (!box.overlaps({volume.bounds_min, volume.bounds_max})) continue;  // uniform zero
    std::erase_if(work.tiles, [&](std::uint32_t t) { return !box.overlaps(box_of(volume.tiles[t])); });
    const bool no_bricks = work.first == work.last;
    Node& node = nodes_[work.node];
    if (const auto value = no_bricks ? one_value(volume, box, work.tiles) : std::nullopt) {
      node.uniform = *value;
      continue;
    }
    if (log2_size == 3 && interpolates()) {
      set_corners(node, work.tiles);
    } else if (log2_size == 3) {
      set_values(node, no_bricks ? std::nullopt : std::optional(bricks[work.first]), work.tiles);
    }
    if (log2_size > 3 || !node.is_uniform()) by_size_[static_cast<std::size_t>(log2_size)].push_back(work.node);
    if (log2_size == 3) {
      done += no_bricks ? 0 : 1;
      continue;
    }
    const auto child = static_cast<std::uint32_t>(nodes_.size());
    node.child = child;
    const int half = 1 << (log2_size - 1);
    const auto ends = sort_by_octant(origins, bricks, work.first, work.last, low + half);
    for (unsigned i = 0; i < 8; ++i) {
      nodes_.push_back(
          {.corner = corner + half * ivec3(i & 1U, (i >> 1U) & 1U, (i >> 2U) & 1U), .log2_size = log2_size - 1});
      stack.push_back({child + i, ends[i], ends[i + 1], work.tiles});
    }
  }
}

const Statistics::Node& Statistics::node_at(const ivec3& p, int min_log2_size) const {
  const Node* node = nodes_.data();
  while (node->child != 0 && node->log2_size > min_log2_size) {
    const int bit = node->log2_size - 1;
    const unsigned octant = ((p.x >> bit) & 1) | (((p.y >> bit) & 1) << 1) | (((p.z >> bit) & 1) << 2);
    node = &nodes_[node->child + octant];
  }
  return *node;
}

Moments Statistics::moments(const vec3& v0, std::uint32_t shape) const {
  const vec3 centroid = cell_centroid(v0, shape);
  const ivec3 voxel(centroid);
  const std::uint32_t cell_class = core::cm_shape_class(shape);
  const int exponent = static_cast<int>(core::cm_shape_exponent(shape));
  if (cell_class == 1) {
    const Node& node = node_at(voxel, exponent);
    if (node.is_uniform()) return uniform_moments(v0, shape, node.uniform);
    if (node.log2_size == exponent) return kuhn(node, permutation_of(shape));
    throw Error(ErrorCode::internal, "no statistics for a cell smaller than a brick node");
  }
  Moments sum = moments(v0, core::cm_child_shape(shape, 0));
  sum += moments(child_v0(v0, shape, 1), core::cm_child_shape(shape, 1));
  return sum;
}

void Statistics::compute_moments(Progress* progress) {
  std::uint32_t count = 0;
  for (const auto& level : by_size_) {
    for (const std::uint32_t n : level) {
      nodes_[n].moments = count;
      count += 6;
    }
  }
  const auto& bricks = by_size_[3];
  ProgressPart part(progress, 0.3, 1.0, count / 6);
  part.resize(moments_, count);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, bricks.size(), 16), [&](const auto& range) {
    const auto sums = std::make_unique<BrickSums>();
    BrickField field;
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      const Node& node = nodes_[bricks[i]];
      if (const volume::BrickSummary* known = summary(node)) {
        for (std::uint32_t permutation = 0; permutation < 6; ++permutation) {
          moments_[node.moments + permutation] =
              moments_of(*known, permutation, node.corner, brick_tree(kuhn_frame(node.corner, 8, permutation)));
        }
        continue;
      }
      field.read(*this, node);
      for (std::uint32_t permutation = 0; permutation < 6; ++permutation) {
        const BrickTree& tree = brick_tree(kuhn_frame(node.corner, 8, permutation));
        field.sum(tree, *sums);
        moments_[node.moments + permutation] = sums->moments(1, node.corner, tree);
      }
    }
    part.add(range.size());
  });
  for (std::size_t size = 4; size < by_size_.size(); ++size) {
    const auto& level = by_size_[size];
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, level.size(), 64), [&](const auto& range) {
      for (std::size_t i = range.begin(); i != range.end(); ++i) {
        const Node& node = nodes_[level[i]];
        for (std::uint32_t permutation = 0; permutation < 6; ++permutation) {
          const std::uint32_t frame = kuhn_frame(node.corner, 1 << size, permutation);
          const auto negative = signs_of_frame(frame);
          const vec3 v0 =
              vec3(node.corner) + static_cast<float>(1 << size) * vec3(negative[0], negative[1], negative[2]);
          const std::uint32_t shape = shape_word(frame, 1, static_cast<int>(size));
          Moments sum = moments(v0, core::cm_child_shape(shape, 0));
          sum += moments(child_v0(v0, shape, 1), core::cm_child_shape(shape, 1));
          moments_[node.moments + permutation] = sum;
        }
      }
      part.add(range.size());
    });
  }
}

namespace {

// Set of the voxel columns along an axis that hit any density. Memory is proportional to the number of bricks and
// uniform cubes, not to their size.
class Shadow {
 public:
  Shadow(int axis, int log2_size) : axis_(axis), squares_(static_cast<std::size_t>(log2_size) + 1) {}
  // columns: 8 x 8 bits.
  void add_brick(const ivec3& corner, std::uint64_t columns) {
    if (columns != 0) bricks_[key(corner, 3)] |= columns;
  }
  void add_cube(const ivec3& corner, int log2_size) {
    squares_[static_cast<std::size_t>(log2_size)].insert(key(corner, log2_size));
  }
  [[nodiscard]] std::uint64_t voxels() const {
    std::uint64_t all = 0;
    for (const auto& [at, columns] : bricks_) {
      if (!covered(at, 3, 3)) all += static_cast<std::uint64_t>(std::popcount(columns));
    }
    for (std::size_t size = 0; size < squares_.size(); ++size) {
      for (const std::uint64_t at : squares_[size]) {
        if (!covered(at, size, size + 1)) all += std::uint64_t{1} << (2 * size);
      }
    }
    return all;
  }

 private:
  [[nodiscard]] std::uint64_t key(const ivec3& corner, int log2_size) const {
    return (std::uint64_t(std::uint32_t(corner[(axis_ + 1) % 3] >> log2_size)) << 32U) |
           std::uint32_t(corner[(axis_ + 2) % 3] >> log2_size);
  }
  // Returns true if the square of side 2^size at this position lies within one of side 2^from or larger.
  [[nodiscard]] bool covered(std::uint64_t at, std::size_t size, std::size_t from) const {
    for (std::size_t larger = from; larger < squares_.size(); ++larger) {
      if (squares_[larger].empty()) continue;
      const std::size_t up = larger - size;
      const std::uint64_t above = ((at >> 32U >> up) << 32U) | ((at & 0xffffffffU) >> up);
      if (squares_[larger].contains(above)) return true;
    }
    return false;
  }

  int axis_;
  std::unordered_map<std::uint64_t, std::uint64_t> bricks_;
  std::vector<std::unordered_set<std::uint64_t>> squares_;  // indexed by log2 of their side
};

}  // namespace

void Statistics::compute_mean_optical_depth(const volume::ScalarVolume& volume, Progress* progress) {
  struct Projection {
    double sum = 0.0;
    std::array<std::uint64_t, 3> masks{};
  };
  const auto& bricks = by_size_[3];
  std::vector<Projection> projections(bricks.size());
  ProgressPart part(progress, 0.1, 0.3, 2 * bricks.size() + nodes_.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, bricks.size(), 64), [&](const auto& range) {
    volume::BrickValues::Brick room;
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      Projection& p = projections[i];
      if (const volume::BrickSummary* known = summary(nodes_[bricks[i]])) {
        p.sum = std::accumulate(std::begin(known->blocks), std::end(known->blocks), 0.0);
        for (std::size_t axis = 0; axis < 3; ++axis)
          p.masks[axis] = known->shadows[2 * axis] | std::uint64_t{known->shadows[2 * axis + 1]} << 32U;
        continue;
      }
      const float* data = values(nodes_[bricks[i]], room);
      for (unsigned v = 0; v < volume::brick_voxels; ++v) {
        if (!(data[v] > 0.0F)) continue;
        p.sum += data[v];
        const std::array<unsigned, 3> xyz{v / 64, (v / 8) % 8, v % 8};
        for (unsigned axis = 0; axis < 3; ++axis) {
          p.masks[axis] |= std::uint64_t{1} << (xyz[(axis + 1) % 3] * 8 + xyz[(axis + 2) % 3]);
        }
      }
    }
    part.add(range.size());
  });
  std::array<Shadow, 3> shadows{Shadow(0, cube_.log2_size), Shadow(1, cube_.log2_size), Shadow(2, cube_.log2_size)};
  double mass = 0.0;
  for (std::size_t i = 0; i < bricks.size(); ++i) {
    mass += projections[i].sum;
    for (std::size_t axis = 0; axis < 3; ++axis)
      shadows[axis].add_brick(nodes_[bricks[i]].corner, projections[i].masks[axis]);
    if (i % 1024 == 1023) part.add(1024);
  }
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    if (i % 1024 == 1023) part.add(1024);
    const Node& node = nodes_[i];
    if (!node.is_uniform() || !(node.uniform > 0.0F)) continue;
    mass += node.uniform * std::pow(double(1 << node.log2_size), 3.0);
    for (Shadow& shadow : shadows) shadow.add_cube(node.corner, node.log2_size);
  }
  double sum = 0.0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::uint64_t hit = shadows[axis].voxels();
    if (hit == 0) return;
    sum += mass * glm::length(dvec3(volume.index_to_world[static_cast<int>(axis)])) / static_cast<double>(hit);
  }
  mean_optical_depth_ = sum / 3.0;
}

}  // namespace cumulet::grid
