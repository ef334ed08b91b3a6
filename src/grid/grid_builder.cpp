#include "grid/grid_builder.hpp"

#include <tbb/blocked_range.h>
#include <tbb/combinable.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "base/error.hpp"
#include "grid/brick_voxels.hpp"
#include "grid/cell.hpp"
#include "grid/clear_cones.hpp"
#include "grid/lattice_channel.hpp"
#include "grid/sixth_means.hpp"

namespace cumulet::grid {

namespace {

using glm::ivec3;
using glm::vec3;
using glm::vec4;

}  // namespace

GridBuilder::Vertex::Vertex(const vec3& at) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto whole = static_cast<std::uint32_t>(at[static_cast<int>(axis)]);
    low[axis] = static_cast<std::uint16_t>(whole);
    high = static_cast<std::uint16_t>(high | ((whole >> 16U) << (5 * axis)));
  }
}

GridBuilder::Vertex::operator vec3() const {
  const auto whole = [&](std::size_t axis) {
    return static_cast<float>(low[axis] | (((std::uint32_t{high} >> (5 * axis)) & 31U) << 16U));
  };
  return {whole(0), whole(1), whole(2)};
}

GridBuilder::GridBuilder(const Statistics& statistics, const DiamondSet& diamonds)
    : statistics_(&statistics), diamonds_(&diamonds) {}

void GridBuilder::make_roots() {
  const std::array<RootCell, 24> roots = root_cells(statistics_->cube().log2_size);
  for (unsigned root = 0; root < 24; ++root) {
    nodes_[root] = {.links = roots[root].links,
                    .child = 0,
                    .v0 = Vertex(roots[root].v0),
                    .shape = static_cast<std::uint16_t>(roots[root].shape),
                    .heap = 0,
                    .permutation = 0};
  }
}

void GridBuilder::bisect(Progress* progress) {
  const std::uint64_t count = 24 + 2 * (diamonds_->cell_count() - 24);
  if (count >= (std::uint64_t{1} << 31U)) {
    throw Error(ErrorCode::unsupported, "a grid of " + std::to_string(diamonds_->cell_count()) +
                                            " cells: the limit is 2^30; lower max_cells or raise the threshold");
  }
  ProgressPart part(progress, DiamondSet::progress_part, 0.95, count);
  part.resize(nodes_, count, {});
  make_roots();
  level_first_ = {0, 24};
  while (level_first_.back() != level_first_[level_first_.size() - 2]) {
    split_level(level_first_[level_first_.size() - 2], level_first_.back(), part);
  }
  level_first_.pop_back();
  if (level_first_.back() != count)
    throw Error(ErrorCode::internal, "bisection missed diamonds: the refinement set is not conforming");
  order(progress);
}

std::uint32_t GridBuilder::mark_splits(std::uint32_t first, std::uint32_t last) {
  DiamondCursor cursor(*diamonds_);
  std::uint32_t splits = 0;
  for (std::uint32_t i = first; i < last; ++i) {
    Node& node = nodes_[i];
    const std::uint32_t cell_class = core::cm_shape_class(node.shape);
    node.child = 0;
    if (cell_class == 1 && core::cm_shape_exponent(node.shape) == 0) continue;  // a sixth of a voxel
    const vec3 middle =
        vec3(node.v0) +
        core::cm_from_frame(core::cm_frame_midpoint(cell_class) * core::cm_shape_unit(node.shape), node.shape);
    if (cursor.is_split(ivec3(middle))) {
      node.child = 1;
      ++splits;
    }
  }
  return splits;
}

// Returns the cell on the other side of a face that `cell` shares with `other`, if the face stays whole when `other`
// splits. Face 3 of `other` then belongs to its child 1, and its other whole face to child 0.
std::uint32_t GridBuilder::behind_whole(std::uint32_t other, std::uint32_t cell) const {
  if (other == CM_NONE || nodes_[other].child == 0) return other;
  return nodes_[other].child + (nodes_[other].links[3] == cell ? 1 : 0);
}

void GridBuilder::make_child(std::uint32_t parent, unsigned side) {
  const Node node = nodes_[parent];
  const std::uint32_t cell_class = core::cm_shape_class(node.shape);
  Node& child = nodes_[node.child + side];
  const std::uint32_t shape = core::cm_child_shape(node.shape, side);
  child.child = 0;
  child.shape = static_cast<std::uint16_t>(shape);
  child.v0 = side == 0 ? node.v0 : Vertex(core::cm_cell_vertex(vec3(node.v0), node.shape, 1));
  child.heap = node.heap == 0 ? 0 : (2U * node.heap + side) & 0xfffU;
  child.permutation = node.permutation;
  if (core::cm_shape_class(shape) == 1 && core::cm_shape_exponent(shape) == 3) {
    child.heap = 1;
    child.permutation = permutation_of(shape) & 15U;
  }
  child.links[3] = node.child + 1 - side;
  for (unsigned k = 0; k < 2; ++k) {
    const glm::uvec2 faces = core::cm_half_face(cell_class, side, k);
    const std::uint32_t other = node.links[faces.y];
    if (other == CM_NONE) {
      child.links[faces.x] = CM_NONE;
      continue;
    }
    // The neighbor belongs to the same diamond and splits too: link to its child at the same end of the edge.
    const Node& neighbour = nodes_[other];
    child.links[faces.x] = neighbour.child + (neighbour.v0 == child.v0 ? 0 : 1);
  }
  const glm::uvec2 faces = core::cm_whole_face(cell_class, side);
  child.links[faces.x] = behind_whole(node.links[faces.y], parent);
}

void GridBuilder::split_level(std::uint32_t first, std::uint32_t last, ProgressPart& part) {
  constexpr std::uint32_t chunk = 4096;
  const std::uint32_t chunks = (last - first + chunk - 1) / chunk;
  const auto begin_of = [&](std::uint32_t c) { return first + c * chunk; };
  const auto end_of = [&](std::uint32_t c) { return std::min(last, begin_of(c + 1)); };
  std::vector<std::uint32_t> splits(chunks);
  // Mark splits first. Then children get consecutive indices in the order of their parents.
  tbb::parallel_for(0U, chunks, [&](std::uint32_t c) {
    part.check();
    splits[c] = mark_splits(begin_of(c), end_of(c));
  });
  std::uint32_t next = last;
  for (std::uint32_t& n : splits) {
    const std::uint32_t here = n;
    n = next;
    next += 2 * here;
  }
  if (next > nodes_.size())
    throw Error(ErrorCode::internal, "bisection exceeded its count: the refinement set is not conforming");
  tbb::parallel_for(0U, chunks, [&](std::uint32_t c) {
    std::uint32_t child = splits[c];
    for (std::uint32_t i = begin_of(c); i < end_of(c); ++i) {
      if (nodes_[i].child == 0) continue;
      nodes_[i].child = child;
      child += 2;
    }
  });
  tbb::parallel_for(0U, chunks, [&](std::uint32_t c) {
    for (std::uint32_t i = begin_of(c); i < end_of(c); ++i) {
      if (nodes_[i].child == 0) continue;
      make_child(i, 0);
      make_child(i, 1);
    }
    part.add(end_of(c) - begin_of(c));
  });
  level_first_.push_back(next);
}

// A link may refer to a cell that has split since. This happens at most once, because the next split cuts a face that
// neither cell's split cuts.
std::uint32_t GridBuilder::resolve(std::uint32_t from, unsigned face) const {
  return behind_whole(nodes_[from].links[face], from);
}

void GridBuilder::order(Progress* progress) {
  const auto count = static_cast<std::uint32_t>(nodes_.size());
  ProgressPart part(progress, 0.95, 1.0, 2 * std::uint64_t{count});
  part.resize(leaves_below_, count, 1U);
  part.resize(first_leaf_, count);
  for (std::size_t level = level_first_.size() - 1; level-- > 0;) {
    tbb::parallel_for(tbb::blocked_range<std::uint32_t>(level_first_[level], level_first_[level + 1], 4096),
                      [&](const auto& range) {
                        for (std::uint32_t i = range.begin(); i != range.end(); ++i) {
                          const std::uint32_t child = nodes_[i].child;
                          if (child != 0) leaves_below_[i] = leaves_below_[child] + leaves_below_[child + 1];
                        }
                        part.add(range.size());
                      });
  }
  for (unsigned root = 1; root < 24; ++root) first_leaf_[root] = first_leaf_[root - 1] + leaves_below_[root - 1];
  part.resize(leaf_nodes_, diamonds_->cell_count());
  for (std::size_t level = 0; level + 1 < level_first_.size(); ++level) {
    tbb::parallel_for(tbb::blocked_range<std::uint32_t>(level_first_[level], level_first_[level + 1], 4096),
                      [&](const auto& range) {
                        for (std::uint32_t i = range.begin(); i != range.end(); ++i) {
                          const std::uint32_t child = nodes_[i].child;
                          if (child == 0) {
                            leaf_nodes_[first_leaf_[i]] = i;
                          } else {
                            first_leaf_[child] = first_leaf_[i];
                            first_leaf_[child + 1] = first_leaf_[i] + leaves_below_[child];
                          }
                        }
                        part.add(range.size());
                      });
  }
}

void GridBuilder::number_nodes(TetGrid& grid, ProgressPart& part) const {
  const auto count = static_cast<std::uint32_t>(leaf_nodes_.size());
  part.resize(grid.tree, count - 24);
  // The depth-first number of an internal node is (leaves before it) - (roots before it) + (its internal ancestors). It
  // is computed level by level: child 0 follows its parent, child 1 follows the whole subtree of child 0.
  for (unsigned root = 0; root < 24; ++root) {
    grid.roots[root] = {first_leaf_[root], first_leaf_[root] - root};
  }
  grid.roots[24] = {count, count - 24};
  std::vector<std::uint32_t> numbers;
  part.resize(numbers, nodes_.size());
  for (unsigned root = 0; root < 24; ++root) numbers[root] = grid.roots[root].first_internal;
  for (std::size_t level = 0; level + 1 < level_first_.size(); ++level) {
    tbb::parallel_for(tbb::blocked_range<std::uint32_t>(level_first_[level], level_first_[level + 1], 4096),
                      [&](const auto& range) {
                        for (std::uint32_t i = range.begin(); i != range.end(); ++i) {
                          const std::uint32_t child = nodes_[i].child;
                          if (child == 0) continue;
                          grid.tree[numbers[i]] = leaves_below_[child] - 1;
                          numbers[child] = numbers[i] + 1;
                          numbers[child + 1] = numbers[i] + leaves_below_[child];
                        }
                        part.add(range.size());
                      });
  }
}

// Computes moments of consecutive leaves. Leaves in one brick's tree share its sums.
class GridBuilder::LeafMoments {
 public:
  explicit LeafMoments(const Statistics& statistics) : statistics_(&statistics) {}
  Moments operator()(const Node& node, const vec3& centroid) {
    const vec3 v0 = vec3(node.v0);
    if (node.heap == 0) return statistics_->moments(v0, node.shape);
    const Statistics::Node& holder = statistics_->node_at(ivec3(centroid));
    if (holder.is_uniform()) return uniform_moments(v0, node.shape, holder.uniform);
    if (&holder != brick_ || node.permutation != permutation_) {
      if (&holder != brick_) field_.read(*statistics_, holder);
      brick_ = &holder;
      permutation_ = node.permutation;
      tree_ = &brick_tree(kuhn_frame(holder.corner, volume::brick_size, node.permutation));
      field_.sum(*tree_, *sums_);
    }
    return sums_->moments(node.heap, holder.corner, *tree_);
  }

 private:
  const Statistics* statistics_;
  std::unique_ptr<BrickSums> sums_ = std::make_unique<BrickSums>();
  BrickField field_;
  const Statistics::Node* brick_ = nullptr;  // brick of sums_
  unsigned permutation_ = 0;
  const BrickTree* tree_ = nullptr;
};

// Computes the density of leaves: mean and gradient, in units of density_unit. With shutter ends it returns the mean of
// both and half of their difference.
class GridBuilder::LeafDensity {
 public:
  LeafDensity(const Statistics& density, const Channels& channels, CellKind cells, float unit)
      : linear_(has_fits(cells)), to_relative_(1.0 / unit) {
    if (channels.ends) {
      fields_.emplace_back(channels.ends->open.statistics());
      fields_.emplace_back(channels.ends->close.statistics());
    } else {
      fields_.emplace_back(density);
    }
  }
  struct Of {
    vec4 fit{0.0F};
    vec4 change{0.0F};
    double mass = 0.0;
    bool any = false;
  };
  Of operator()(const Node& node, const vec3& centroid) {
    Of of = one(fields_[0], node, centroid);
    if (fields_.size() < 2) return of;
    const Of close = one(fields_[1], node, centroid);
    of.change = 0.5F * (close.fit - of.fit);
    of.fit = 0.5F * (of.fit + close.fit);
    of.mass = 0.5 * (of.mass + close.mass);
    of.any = of.any || close.any;
    return of;
  }

 private:
  Of one(LeafMoments& moments, const Node& node, const vec3& centroid) const {
    const Moments m = moments(node, centroid);
    const double mean = std::clamp(m.mean(), double(m.min), double(m.max));
    vec3 gradient(0.0F);
    if (linear_ && m.min < m.max) {
      gradient = fit_linear(core::cm_shape_class(node.shape), frame_covariance(m, node.shape, centroid),
                            static_cast<float>(mean))
                     .gradient *
                 static_cast<float>(to_relative_);
    }
    return {vec4(static_cast<float>(mean * to_relative_), gradient), vec4(0.0F), m.mass, m.max > 0.0F};
  }

  std::vector<LeafMoments> fields_;  // density, or both shutter ends
  bool linear_;
  double to_relative_;
};

// Reads the voxels between which the field of a sixth is interpolated, in units of density_unit.
class GridBuilder::LeafCorners {
 public:
  LeafCorners(const Statistics& density, float unit) : density_(&density), to_relative_(1.0F / unit) {}
  // Returns them as half floats; the order is that of cm_corner_offset (glsl/traversal/trilinear.glsl) in the frame of
  // the sixth.
  glm::uvec4 operator()(const Node& node, const vec3& centroid) {
    glm::uvec4 words(0U);
    if (node.heap < 512) return words;
    const ivec3 corner = ivec3(centroid) & ~(volume::brick_size - 1);
    if (corner != corner_) voxels_.look_up(*density_, corner);
    corner_ = corner;
    const BrickTree& tree = brick_tree(kuhn_frame(corner, volume::brick_size, node.permutation));
    const BrickTree::Leaf& leaf = tree.leaf[node.heap - 512U];
    const auto value = [&](int i) {
      const int at = leaf.first + (i >> 2) * leaf.step[0] + ((i >> 1) & 1) * leaf.step[1] + (i & 1) * leaf.step[2];
      return voxels_[at] * to_relative_;
    };
    for (int i = 0; i < 4; ++i) words[i] = glm::packHalf2x16({value(2 * i), value(2 * i + 1)});
    return words;
  }

 private:
  const Statistics* density_;
  float to_relative_;
  ivec3 corner_{-1};  // of the brick in voxels_
  BrickVoxels voxels_;
};

// Sums the voxels of leaves in double precision.
class GridBuilder::LeafVoxels {
 public:
  explicit LeafVoxels(std::span<const Statistics* const> fields)
      : fields_(fields.begin(), fields.end()), found_(fields.size()) {}
  // Returns the masses of the fields.
  ChannelFields::CellMoments operator()(const Node& node, const vec3& centroid) {
    ChannelFields::CellMoments sums{};
    if (node.heap == 0) {
      for (std::size_t i = 0; i < fields_.size(); ++i)
        sums[i].mass = fields_[i]->moments(vec3(node.v0), node.shape).mass;
      return sums;
    }
    look_up(ivec3(centroid) & ~(volume::brick_size - 1));
    const BrickTree& tree = brick_tree(kuhn_frame(corner_, volume::brick_size, node.permutation));
    const std::uint32_t leaves = 512U / std::bit_floor(std::uint32_t{node.heap});
    const std::uint32_t first = node.heap * leaves - 512U;
    for (std::size_t i = 0; i < fields_.size(); ++i) {
      const BrickVoxels& voxels = found_[i];
      double& sum = sums[i].mass;
      if (voxels.uniform()) {
        sum = double{*voxels.uniform()} * leaves;
      } else if (fields_[i]->interpolates()) {
        for (const auto& leaf : std::span(tree.leaf).subspan(first, leaves)) sum += mean_between(voxels, leaf);
      } else {
        for (const auto voxel : std::span(tree.voxel).subspan(first, leaves)) sum += voxels[voxel];
      }
    }
    return sums;
  }

 private:
  void look_up(const ivec3& corner) {
    if (corner == corner_) return;
    corner_ = corner;
    for (std::size_t i = 0; i < fields_.size(); ++i) found_[i].look_up(*fields_[i], corner);
  }
  // Mean of the interpolated field in a sixth of a cell.
  static double mean_between(const BrickVoxels& voxels, const BrickTree::Leaf& leaf) {
    static constexpr std::array<double, sixth_monomials> weights{
        mean_of_weight(0), mean_of_weight(1), mean_of_weight(2), mean_of_weight(3),
        mean_of_weight(4), mean_of_weight(5), mean_of_weight(6), mean_of_weight(7)};
    double mean = 0.0;
    for (std::size_t corner = 0; corner < weights.size(); ++corner) {
      int at = leaf.first;
      for (unsigned axis = 0; axis < 3; ++axis) at += exponent_in(corner, axis) != 0 ? leaf.step[axis] : 0;
      mean += weights[corner] * double{voxels[at]};
    }
    return mean;
  }

  std::vector<const Statistics*> fields_;
  ivec3 corner_{-1};  // corner of the brick in found_
  std::vector<BrickVoxels> found_;
};

// Computes all channels of leaves other than density. A field that several channels share is summed once.
class GridBuilder::LeafChannels {
 public:
  // channels: must outlive this object.
  LeafChannels(const Statistics& density, const std::vector<ChannelFields>& channels, CellKind cells)
      : cells_(cells), fields_{&density} {
    for (const ChannelFields& channel : channels) {
      Part& part = parts_.emplace_back();
      part.channel = &channel;
      if (channel.needs_precise_sums()) {
        part.voxels = std::make_unique<LeafVoxels>(channel.statistics());
      } else {
        for (const Statistics* field : channel.statistics()) part.fields.push_back(index_of(field));
      }
    }
    here_.resize(fields_.size());
  }
  // Writes the leaf's records. mass: of the leaf's density. Returns true if the leaf emits light.
  bool put(const Node& node, const vec3& centroid, double mass, ChannelRecords& records, std::uint32_t rank) {
    here_[0].mass = mass;
    for (std::size_t i = 0; i < sums_.size(); ++i) here_[i + 1] = sums_[i](node, centroid);
    bool emits = false;
    for (const Part& part : parts_) {
      ChannelFields::CellMoments moments{};
      if (part.voxels) {
        moments = (*part.voxels)(node, centroid);
      } else {
        for (std::size_t i = 0; i < part.fields.size(); ++i) moments[i] = here_[part.fields[i]];
      }
      std::array<std::uint32_t, max_record_words> record{};
      part.channel->put_record(moments, centroid, node.shape, cells_, record);
      const ChannelRow& row = row_of(part.channel->channel());
      std::memcpy(&row.writable(records)[rank * row.record_bytes], record.data(), row.record_bytes);
      emits = emits || part.channel->emits(moments);
    }
    return emits;
  }

 private:
  struct Part {
    const ChannelFields* channel = nullptr;
    std::vector<std::size_t> fields{};     // indices in here_
    std::unique_ptr<LeafVoxels> voxels{};  // in place of fields
  };
  std::size_t index_of(const Statistics* field) {
    const auto found = std::ranges::find(fields_, field);
    const auto index = static_cast<std::size_t>(found - fields_.begin());
    if (found == fields_.end()) {
      fields_.push_back(field);
      sums_.emplace_back(*field);
    }
    return index;
  }

  CellKind cells_;
  std::vector<const Statistics*> fields_;  // density, whose mass is given, and others
  std::vector<LeafMoments> sums_;          // of the others
  std::vector<Moments> here_;              // of all fields, for the current leaf
  std::vector<Part> parts_;
};

CellRecord GridBuilder::record(std::uint32_t index, const vec4& fit, bool emits) const {
  const Node& node = nodes_[index];
  CellRecord record{};
  for (unsigned face = 0; face < 4; ++face) {
    const std::uint32_t other = resolve(index, face);
    record.links[static_cast<int>(face)] = other == CM_NONE ? CM_NONE : first_leaf_[other];
  }
  const glm::uvec2 v0_shape = core::cm_pack_v0_shape(vec3(node.v0), node.shape, statistics_->cube().wide());
  record.data.x = v0_shape.x;
  record.data.y = v0_shape.y | (emits ? CM_RECORD_EMITS : 0U);
  const glm::uvec2 packed = pack_fit(fit);
  record.data.z = packed.x;
  record.data.w = packed.x == 0 ? 0 : packed.y;
  return record;
}

TetGrid GridBuilder::records(CellKind cells, float max_value, const Channels& channels, Progress* progress) {
  TetGrid grid;
  grid.cube = statistics_->cube();
  grid.limited = diamonds_->limited();
  grid.levels = static_cast<std::uint32_t>(level_first_.size() - 2);
  grid.density_unit = max_value > 0.0F ? max_value : 1.0F;
  const auto count = static_cast<std::uint32_t>(leaf_nodes_.size());
  ProgressPart allocation(progress, 0.0, 0.1, nodes_.size());
  allocation.resize(grid.cells, count);
  for (const ChannelRow& row : channel_table) {
    if (row.is_in(channels)) row.resize(grid.channels, count, allocation);
  }
  if (channels.ends) allocation.resize(grid.change, count);
  const bool has_corners = grid::has_corners(cells, statistics_->cube().interpolation);
  if (has_corners) allocation.resize(grid.corners, count);
  number_nodes(grid, allocation);

  struct Box {
    vec3 low{3.0e38F};
    vec3 high{-3.0e38F};
  };
  tbb::combinable<Box> boxes;
  const std::vector<ChannelFields> fields = fields_of(*statistics_, channels);
  ProgressPart part(progress, 0.1, 0.9, count);
  tbb::parallel_for(tbb::blocked_range<std::uint32_t>(0, count, 8192), [&](const auto& range) {
    LeafDensity density(*statistics_, channels, cells, grid.density_unit);
    LeafChannels beside(*statistics_, fields, cells);
    LeafCorners corners(*statistics_, grid.density_unit);
    Box& box = boxes.local();
    for (std::uint32_t rank = range.begin(); rank != range.end(); ++rank) {
      const Node& node = nodes_[leaf_nodes_[rank]];
      const vec3 v0 = vec3(node.v0);
      const std::uint32_t shape = node.shape;
      const std::uint32_t cell_class = core::cm_shape_class(shape);
      const float unit = core::cm_shape_unit(shape);
      const vec3 centroid = v0 + core::cm_from_frame(core::cm_frame_centroid(cell_class) * unit, shape);
      const LeafDensity::Of of = density(node, centroid);
      const bool emits = beside.put(node, centroid, of.mass, grid.channels, rank);
      if (of.any || emits) {
        for (std::uint32_t i = 0; i < 4; ++i) {
          const vec3 vertex = core::cm_cell_vertex(v0, shape, i);
          box.low = glm::min(box.low, vertex);
          box.high = glm::max(box.high, vertex);
        }
      }
      grid.cells[rank] = record(leaf_nodes_[rank], of.fit, emits);
      if (channels.ends) grid.change[rank] = pack_fit(of.change);
      if (has_corners) grid.corners[rank] = corners(node, centroid);
    }
    part.add(range.size());
  });
  Box all;
  boxes.combine_each([&](const Box& box) {
    all.low = glm::min(all.low, box.low);
    all.high = glm::max(all.high, box.high);
  });
  if (all.low.x <= all.high.x) {
    grid.content_min = all.low;
    grid.content_max = all.high;
  }
  find_clear_cones(grid, progress);
  return grid;
}

}  // namespace cumulet::grid
