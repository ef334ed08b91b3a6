#include "grid/refine.hpp"

#include <tbb/blocked_range.h>
#include <tbb/combinable.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "base/luminance.hpp"
#include "base/progress_part.hpp"
#include "grid/cell.hpp"
#include "grid/transmittance.hpp"

namespace cumulet::grid {

namespace {

using glm::dvec3;
using glm::ivec3;
using glm::vec3;

int trailing_zeros(const ivec3& v) { return std::countr_zero(static_cast<unsigned>(v.x | v.y | v.z)); }

// A positive float's high half sorts like the float: 7 bits of mantissa, steps under one percent.
std::uint16_t quantize(double squared) {
  const auto bits = std::bit_cast<std::uint32_t>(static_cast<float>(squared));
  return static_cast<std::uint16_t>(std::max<std::uint32_t>(bits >> 16U, 1));
}

// World length of the refinement edge of every shape, by class and frame: |M edge|.
class EdgeLengths {
 public:
  explicit EdgeLengths(const glm::dmat4& to_world) : linear_(to_world) {}
  [[nodiscard]] double operator()(std::uint32_t shape) const {
    return glm::length(linear_ * dvec3(core::cm_cell_vertex(vec3(0.0F), shape, 1)));
  }

 private:
  glm::dmat3 linear_;
};

// How deviations of a field count.
struct Weights {
  double per_depth = 0.0;      // times a deviation and its length
  double own_hiding = 0.0;     // reduced extinction of a value: of what hides itself
  bool there_and_back = true;  // light passes what hides a cell twice

  // depth: of the mean ray.
  static Weights of_density(double depth, const RefineSettings& settings) {
    if (!(depth > 0.0)) return {};
    if (settings.criterion != Criterion::transmittance) return {.per_depth = 1.0 / depth};
    const double scale = settings.density_scale;
    return {.per_depth = scale / -std::expm1(-scale * depth), .own_hiding = hiding(scale, settings.anisotropy)};
  }
  // depth: of each component. A deviation counts by the strongest, or by what it does to the luminance where that is
  // more: most of a red fire's is green. And by a fifth more than density's, which scattering blurs: fires are so
  // within the image error that clouds are (tests/bench/README.md, Grids by default).
  static Weights of_emission(const dvec3& depth, int component, const RefineSettings& settings) {
    const double most = std::max({depth.r, depth.g, depth.b});
    if (!(most > 0.0)) return {};
    dvec3 only(0.0);
    only[component] = 1.0;
    const double sharp = settings.criterion == Criterion::transmittance ? 1.2 : 1.0;
    return {.per_depth = sharp * std::max(1.0 / most, luminance(only) / luminance(depth)), .there_and_back = false};
  }
};

// The criterion's squared value for a cell.
class Measure {
 public:
  Measure(const Weights& weights, const RefineSettings& settings)
      : settings_(&settings),
        scale_(static_cast<float>(weights.per_depth * weights.per_depth)),
        own_hiding_(static_cast<float>(weights.own_hiding)),
        there_and_back_(weights.there_and_back) {}

  // No cell of a region whose values lie in [min, max] exceeds this: a variance is at most a quarter of the range
  // squared. lit: the most of the region.
  [[nodiscard]] float bound(float min, float max, float edge_squared, float lit) const {
    if (settings_->criterion == Criterion::range_mean) return std::numeric_limits<float>::infinity();
    return 0.25F * (max - min) * (max - min) * edge_squared * scale_ * seen_squared(lit);
  }

  // covariance: of position and density in the frame, per unit. No more than floor: the exact value does not matter.
  [[nodiscard]] float squared(std::uint32_t cell_class, float mean, float variance, const vec3& covariance, float min,
                              float max, float edge_squared, float lit, float floor) const {
    if (min >= max) return 0.0F;
    if (settings_->criterion == Criterion::range_mean) {
      const float ratio = (max - min) / mean;
      return ratio * ratio;
    }
    const float own = 1.0F + own_hiding_ * mean * std::sqrt(edge_squared);
    const float weight = edge_squared * scale_ * seen_squared(lit) / (own * own);
    const float value = variance * weight;
    if (value <= floor || settings_->cells == CellKind::constant) return value;
    const float explained = fit_linear(cell_class, covariance, mean).explained;
    return std::max(0.0F, variance - explained) * weight;
  }

 private:
  // lit: what part of the light gets there, or back.
  [[nodiscard]] float seen_squared(float lit) const { return there_and_back_ ? lit * lit * lit * lit : lit * lit; }

  const RefineSettings* settings_;
  float scale_;
  float own_hiding_;
  bool there_and_back_;
};

// The largest singular value, by power iteration: where that converges slowly others are as large.
double largest_stretch(const glm::dmat3& linear) {
  const glm::dmat3 square = glm::transpose(linear) * linear;
  dvec3 v = glm::normalize(dvec3(1.0, 0.9, 0.8));
  for (int i = 0; i < 64; ++i) v = glm::normalize(square * v);
  return glm::length(linear * v);
}

// What the camera allows: the shortest edge worth splitting in a sphere, or none at all, all in the volume's world.
class CameraLimit {
 public:
  explicit CameraLimit(const RefineSettings& settings) : settings_(&settings) {
    if (!settings.camera) return;
    const RefineCamera& c = *settings.camera;
    for (const glm::dmat4& place : c.places) placed_.push_back({place, largest_stretch(glm::dmat3(place))});
    const auto side = [&](const dvec3& axis, double tangent) {
      planes_.push_back(glm::normalize(c.forward * tangent - axis));
    };
    side(c.right, c.tan_half_x);
    side(-c.right, c.tan_half_x);
    side(c.up, c.tan_half_y);
    side(-c.up, c.tan_half_y);
  }

  // Infinity: no split. 0: no limit.
  [[nodiscard]] double shortest_edge(const dvec3& centre, double radius) const {
    if (!settings_->camera) return 0.0;
    double shortest = std::numeric_limits<double>::infinity();
    for (const Placed& placed : placed_) {
      shortest = std::min(shortest, shortest_edge(placed, centre, radius));
      if (shortest <= 0.0) break;
    }
    return shortest;
  }

 private:
  struct Placed {
    glm::dmat4 place{1.0};
    double stretch = 1.0;  // the most that a length grows on its way into the camera's world
  };

  [[nodiscard]] double shortest_edge(const Placed& placed, const dvec3& centre, double radius) const {
    const RefineCamera& camera = *settings_->camera;
    const dvec3 to = dvec3(placed.place * glm::dvec4(centre, 1.0)) - camera.eye;
    radius *= placed.stretch;
    for (const dvec3& plane : planes_) {
      if (glm::dot(plane, to) < -radius) return std::numeric_limits<double>::infinity();
    }
    const double distance = std::max(0.0, glm::length(to) - radius);
    return settings_->pixel_size * distance / (camera.pixels_per_radian * placed.stretch);
  }

  const RefineSettings* settings_;
  std::vector<Placed> placed_;
  std::vector<dvec3> planes_;
};

dvec3 centroid_of(const vec3& v0, std::uint32_t shape) {
  const vec3 in_frame = core::cm_frame_centroid(core::cm_shape_class(shape)) * core::cm_shape_unit(shape);
  return dvec3(v0) + dvec3(core::cm_from_frame(in_frame, shape));
}

ivec3 midpoint(const vec3& v0, std::uint32_t shape) {
  const vec3 in_frame = core::cm_frame_midpoint(core::cm_shape_class(shape)) * core::cm_shape_unit(shape);
  return {v0 + core::cm_from_frame(in_frame, shape)};
}

}  // namespace

DiamondSet::Address DiamondSet::address(const ivec3& vertex) {
  const int scale = trailing_zeros(vertex) / 3;
  const ivec3 lattice = vertex >> (3 * scale);
  const ivec3 corner = lattice >> 3;
  const ivec3 local = lattice & 7;
  const std::uint64_t key = (std::uint64_t(scale) << 60U) | (std::uint64_t(std::uint32_t(corner.x)) << 40U) |
                            (std::uint64_t(std::uint32_t(corner.y)) << 20U) | std::uint32_t(corner.z);
  return {key, static_cast<unsigned>(local.x * 64 + local.y * 8 + local.z), scale, corner};
}

void DiamondSet::Raiser::operator()(const ivec3& vertex, std::uint16_t priority) {
  const Address a = address(vertex);
  if (a.key != key_) {
    auto found = set_->map_.find(a.key);
    if (found == set_->map_.end()) {
      auto block = std::make_unique<Block>();
      block->scale = a.scale;
      block->corner = a.corner;
      found = set_->map_.emplace(a.key, std::move(block)).first;
    }
    key_ = a.key;
    block_ = found->second.get();
  }
  std::atomic<std::uint16_t>& slot = block_->priority[a.local];
  std::uint16_t old = slot.load(std::memory_order_relaxed);
  while (old < priority && !slot.compare_exchange_weak(old, priority, std::memory_order_relaxed)) {
  }
}

bool DiamondCursor::is_split(const ivec3& vertex) {
  const DiamondSet::Address a = DiamondSet::address(vertex);
  if (a.key != key_) {
    const auto found = set_->map_.find(a.key);
    key_ = a.key;
    block_ = found == set_->map_.end() ? nullptr : found->second.get();
  }
  return block_ != nullptr && block_->priority[a.local].load(std::memory_order_relaxed) >= set_->cut_;
}

// The criterion over all cells of the statistics.
class DiamondSet::Evaluation {
 public:
  // transmittance: of density; null where nothing is hidden.
  Evaluation(const Statistics& statistics, const Weights& weights, const Transmittance* transmittance,
             const RefineSettings& settings)
      : statistics_(&statistics),
        transmittance_(transmittance),
        measure_(weights, settings),
        camera_(settings),
        edge_length_(statistics.cube().to_world) {
    // A node's bounding sphere: half its world diagonal, the longest of four.
    for (int i = 0; i < 4; ++i) {
      const dvec3 diagonal(1.0, (i & 1) != 0 ? -1.0 : 1.0, (i & 2) != 0 ? -1.0 : 1.0);
      unit_radius_ = std::max(unit_radius_, 0.5 * glm::length(glm::dmat3(statistics.cube().to_world) * diagonal));
    }
    for (std::uint32_t signs = 0; signs < 8; ++signs) {
      for (std::uint32_t permutation = 0; permutation < 6; ++permutation) {
        const ivec3 corner(8 * static_cast<int>(signs & 1U), 8 * static_cast<int>((signs >> 1U) & 1U),
                           8 * static_cast<int>(signs >> 2U));
        const BrickTree& tree = brick_tree(kuhn_frame(corner, 8, permutation));
        auto& edges = edge_squared_[signs * 6 + permutation];
        for (unsigned h = 1; h < 512; ++h) {
          const double edge = edge_length_(tree.shape[h]);
          edges[h] = static_cast<float>(edge * edge);
          float& longest = longest_[std::bit_width(h) - 1];
          longest = std::max(longest, edges[h]);
        }
      }
    }
  }

  [[nodiscard]] const Statistics& statistics() const { return *statistics_; }

  // Calls visit(vertex, squared) for every cell of a brick whose criterion is above the floor.
  template <class Visit>
  void brick(const Statistics::Node& node, BrickSums& sums, float floor, Visit visit) const {
    BrickTransmittance lit;
    const double shortest = shortest_edge(node);
    const auto shortest_squared = static_cast<float>(shortest * shortest);
    const ivec3 odd = (node.corner / 8) & 1;
    const auto signs = static_cast<unsigned>(odd.x + 2 * odd.y + 4 * odd.z);
    const float* blocks = transmittance_ != nullptr ? transmittance_->blocks(node.corner) : nullptr;
    const float most = blocks != nullptr ? *std::max_element(blocks, blocks + Transmittance::blocks_a_brick) : 1.0F;
    const float* values = nullptr;
    volume::BrickValues::Brick room;
    for (std::uint32_t permutation = 0; permutation < 6; ++permutation) {
      const Moments& whole = statistics_->kuhn(node, permutation);
      if (whole.min >= whole.max) continue;
      const BrickTree& tree = brick_tree(kuhn_frame(node.corner, 8, permutation));
      const auto& edges = edge_squared_[signs * 6 + permutation];
      // Edges shrink from level to level: below some level nothing can exceed the floor.
      unsigned end = 1;
      while (end < 512 && measure_.bound(whole.min, whole.max, longest_[std::bit_width(end) - 1], most) > floor)
        end *= 2;
      if (end == 1) continue;
      if (values == nullptr) values = statistics_->values(node, room);
      sums.compute(values, tree);
      if (blocks != nullptr) lit.compute(blocks, tree);
      for (unsigned h = 1; h < end; ++h) {
        if (sums.min[h] >= sums.max[h] || edges[h] < shortest_squared) continue;
        const std::uint32_t shape = tree.shape[h];
        const float inverse_count = 1.0F / static_cast<float>(512U >> (static_cast<unsigned>(std::bit_width(h)) - 1U));
        const float shifted_mean = sums.mass[h] * inverse_count;
        const float variance = std::max(0.0F, sums.square[h] * inverse_count - shifted_mean * shifted_mean);
        const vec3 covariance =
            vec3(sums.x[h], sums.y[h], sums.z[h]) * inverse_count - tree.node_centroid[h] * shifted_mean;
        const float squared =
            measure_.squared(core::cm_shape_class(shape), sums.reference + shifted_mean, variance,
                             core::cm_to_frame(covariance, shape) * core::cm_shape_inverse_unit(shape), sums.min[h],
                             sums.max[h], edges[h], blocks != nullptr ? lit.most[h] : 1.0F, floor);
        if (squared > floor) visit(node.corner + ivec3(tree.midpoint[h]), squared);
      }
    }
  }

  // Likewise for one cell above bricks.
  template <class Visit>
  void cell(const vec3& v0, std::uint32_t shape, double shortest, float lit, float floor, Visit visit) const {
    const Moments m = statistics_->moments(v0, shape);
    const double edge = edge_length_(shape);
    if (edge < shortest) return;
    const float squared = measure_.squared(
        core::cm_shape_class(shape), static_cast<float>(m.mean()), static_cast<float>(m.variance()),
        frame_covariance(m, shape, centroid_of(v0, shape)), m.min, m.max, static_cast<float>(edge * edge), lit, floor);
    if (squared > floor) visit(midpoint(v0, shape), squared);
  }

  // Likewise for a Kuhn cell (B) of a node above bricks, its two halves (C) and four quarters (A).
  template <class Visit>
  void kuhn_cell(const Statistics::Node& node, std::uint32_t permutation, double shortest, float floor,
                 Visit visit) const {
    const int size = node.log2_size;
    const float lit = transmittance_ != nullptr ? transmittance_->most(node.corner, size) : 1.0F;
    vec3 v0(node.corner);
    for (int axis = 0; axis < 3; ++axis) {
      if (((node.corner[axis] >> size) & 1) != 0) v0[axis] += static_cast<float>(1 << size);
    }
    const std::uint32_t frame = kuhn_frame(node.corner, 1 << size, permutation);
    const std::uint32_t shape = frame | (1U << 9U) | (static_cast<std::uint32_t>(size) << 11U);
    cell(v0, shape, shortest, lit, floor, visit);
    for (unsigned a = 0; a < 2; ++a) {
      const std::uint32_t child = core::cm_child_shape(shape, a);
      const vec3 child_v0 = a == 0 ? v0 : core::cm_cell_vertex(v0, shape, 1);
      cell(child_v0, child, shortest, lit, floor, visit);
      for (unsigned b = 0; b < 2; ++b) {
        cell(b == 0 ? child_v0 : core::cm_cell_vertex(child_v0, child, 1), core::cm_child_shape(child, b), shortest,
             lit, floor, visit);
      }
    }
  }

  [[nodiscard]] double shortest_edge(const Statistics::Node& node) const {
    const double size = 1 << node.log2_size;
    const dvec3 centre = dvec3(node.corner) + 0.5 * size;
    return camera_.shortest_edge(dvec3(statistics_->cube().to_world * glm::dvec4(centre, 1.0)), unit_radius_ * size);
  }

 private:
  const Statistics* statistics_;
  const Transmittance* transmittance_;
  Measure measure_;
  CameraLimit camera_;
  EdgeLengths edge_length_;
  double unit_radius_ = 0.0;
  std::array<std::array<float, 512>, 48> edge_squared_{};  // of a brick tree's nodes
  std::array<float, 9> longest_{};                         // of a level of those
};

namespace {

// A value that the cut of max_cells will not fall below: the brick cells above it would alone be too many. From every
// 16th brick; the closure only adds cells. Saves evaluating and keeping what is cut off anyway.
template <class Evaluation>
double estimate_floor(const Evaluation& evaluation, std::uint64_t max_cells, double threshold_squared,
                      const Progress* progress) {
  constexpr std::size_t stride = 16;
  const Statistics& statistics = evaluation.statistics();
  const auto& bricks = statistics.nodes_of_size(3);
  if (bricks.size() < 64 * stride) return threshold_squared;
  tbb::combinable<std::vector<std::uint64_t>> partial([] { return std::vector<std::uint64_t>(65536); });
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, bricks.size() / stride, 4), [&](const auto& range) {
    check(progress);
    const auto sums = std::make_unique<BrickSums>();
    std::vector<std::uint64_t>& histogram = partial.local();
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      evaluation.brick(statistics.nodes()[bricks[i * stride]], *sums, static_cast<float>(threshold_squared),
                       [&](const ivec3& /*vertex*/, float squared) { ++histogram[quantize(squared)]; });
    }
  });
  std::vector<std::uint64_t> histogram(65536);
  partial.combine_each([&](const std::vector<std::uint64_t>& p) {
    for (std::size_t i = 0; i < histogram.size(); ++i) histogram[i] += p[i];
  });
  std::uint64_t cells = 0;
  for (std::size_t i = 0xffff; i > 0; --i) {
    cells += stride * histogram[i];
    if (cells > max_cells) {
      const auto bits = static_cast<std::uint32_t>(i) << 16U;
      return std::max(threshold_squared, 0.5 * double(std::bit_cast<float>(bits)));
    }
  }
  return threshold_squared;
}

double mass_of(const Statistics& statistics) {
  double mass = 0.0;
  for (unsigned root = 0; root < 24; ++root) {
    vec3 v0;
    std::uint32_t shape = 0;
    core::cm_root_cell(root, static_cast<std::uint32_t>(statistics.cube().log2_size - 1), v0, shape);
    mass += statistics.moments(v0, shape).mass;
  }
  return mass;
}

// Of all that scatters.
double mean_anisotropy(const Statistics& density, const Channels& channels) {
  double scattering = mass_of(density);
  if (const RgbField* coloured = channels.scattering.get()) {
    scattering = luminance(
        dvec3(mass_of(coloured->component(0)), mass_of(coloured->component(1)), mass_of(coloured->component(2))));
  }
  return scattering > 0.0 ? 2.0 * mass_of(channels.forward->statistics()) / scattering - 1.0 : 0.0;
}

}  // namespace

DiamondSet::DiamondSet(const Statistics& statistics, const Channels& channels, const RefineSettings& settings,
                       Progress* progress)
    : log2_size_(statistics.cube().log2_size) {
  check(progress);
  RefineSettings used = settings;
  if (channels.forward) used.anisotropy = std::max(used.anisotropy, mean_anisotropy(statistics, channels));
  Evaluations evaluations;
  std::optional<const Transmittance> transmittance;
  if (settings.criterion == Criterion::transmittance)
    transmittance.emplace(statistics, hiding(used.density_scale, used.anisotropy), progress);
  const auto add = [&](const Statistics& field, const Weights& weights) {
    evaluations.push_back(
        std::make_unique<const Evaluation>(field, weights, transmittance ? &*transmittance : nullptr, used));
  };
  const Weights of_density = Weights::of_density(statistics.mean_optical_depth(), used);
  add(statistics, of_density);
  for (std::size_t i = 0; i < 3; ++i) {
    if (channels.emission)
      add(channels.emission->component(i),
          Weights::of_emission(channels.emission->mean_depth(), static_cast<int>(i), used));
    if (channels.scattering) add(channels.scattering->component(i), of_density);
  }
  if (channels.forward) add(channels.forward->statistics(), of_density);
  const double threshold = std::max(settings.threshold, 0.0);
  double floor = 0.0;
  for (const auto& evaluation : evaluations)
    floor = std::max(floor, estimate_floor(*evaluation, settings.max_cells, threshold * threshold, progress));
  evaluate(evaluations, floor, progress, 0.02, 0.5);
  choose_cut(settings.max_cells, progress);
  if (!limited_ && floor > threshold * threshold) {
    // The estimate was too high after all.
    map_.clear();
    evaluate(evaluations, threshold * threshold, progress, 0.5, progress_part);
    choose_cut(settings.max_cells, progress);
  }
}

void DiamondSet::evaluate(const Evaluations& evaluations, double floor_squared, Progress* progress, double from,
                          double to) {
  std::uint64_t nodes = 0;
  for (const auto& evaluation : evaluations) {
    for (int size = 3; size < log2_size_; ++size) nodes += evaluation->statistics().nodes_of_size(size).size();
  }
  const double closing = from + 0.8 * (to - from);
  ProgressPart part(progress, from, closing, nodes);
  for (const auto& evaluation : evaluations) evaluate(*evaluation, floor_squared, part);
  close(progress, closing, to);
}

void DiamondSet::evaluate(const Evaluation& evaluation, double floor_squared, ProgressPart& part) {
  const Statistics& statistics = evaluation.statistics();
  const auto floor = static_cast<float>(floor_squared);
  // Inside bricks: 511 cells in each of six trees.
  const auto& bricks = statistics.nodes_of_size(3);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, bricks.size(), 16), [&](const auto& range) {
    const auto sums = std::make_unique<BrickSums>();
    Raiser raise(*this);
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      evaluation.brick(statistics.nodes()[bricks[i]], *sums, floor,
                       [&](const ivec3& vertex, float squared) { raise(vertex, quantize(squared)); });
    }
    part.add(range.size());
  });

  // Above bricks; then the 24 roots.
  for (int size = 4; size < log2_size_; ++size) {
    const auto& level = statistics.nodes_of_size(size);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, level.size(), 16), [&](const auto& range) {
      Raiser raise(*this);
      const auto visit = [&](const ivec3& vertex, float squared) { raise(vertex, quantize(squared)); };
      for (std::size_t i = range.begin(); i != range.end(); ++i) {
        const Statistics::Node& node = statistics.nodes()[level[i]];
        const double shortest = evaluation.shortest_edge(node);
        for (std::uint32_t permutation = 0; permutation < 6; ++permutation) {
          evaluation.kuhn_cell(node, permutation, shortest, floor, visit);
        }
      }
      part.add(range.size());
    });
  }
  if (!statistics.nodes()[0].is_uniform()) {
    Raiser raise(*this);
    const double shortest = evaluation.shortest_edge(statistics.nodes()[0]);
    for (unsigned root = 0; root < 24; ++root) {
      vec3 v0;
      std::uint32_t shape = 0;
      core::cm_root_cell(root, static_cast<std::uint32_t>(log2_size_ - 1), v0, shape);
      evaluation.cell(v0, shape, shortest, 1.0F, floor,
                      [&](const ivec3& vertex, float squared) { raise(vertex, quantize(squared)); });
    }
  }
}

std::vector<DiamondSet::Block*> DiamondSet::blocks_of(int scale, const Progress* progress) const {
  std::vector<Block*> blocks;
  for (const auto& [key, block] : map_) {
    check(progress);
    if (block->scale == scale) blocks.push_back(block.get());
  }
  return blocks;
}

void DiamondSet::close(Progress* progress, double from, double to) {
  ProgressPart part(progress, from, to, static_cast<std::uint64_t>(3 * log2_size_));
  // From the finest level up: edge middles (A), face middles (C), cube middles (B), then twice the spacing.
  for (int octave = 0; octave < log2_size_; ++octave) {
    for (int odd = 1; odd <= 3; ++odd) {
      if (octave == log2_size_ - 1) break;  // the control cube's own edges: their cells are there from the start
      close_octave(octave, odd, blocks_of(octave / 3, progress), progress);
      part.add(1);
    }
  }
}

void DiamondSet::close_octave(int octave, int odd_coordinates, const std::vector<Block*>& blocks,
                              const Progress* progress) {
  tbb::parallel_for(std::size_t{0}, blocks.size(), [&](std::size_t b) {
    check(progress);
    close_block(*blocks[b], octave, odd_coordinates);
  });
}

void DiamondSet::close_block(const Block& block, int octave, int odd_coordinates) {
  const int step = 1 << (octave % 3);
  Raiser raise(*this);
  for (int x = 0; x < 8; x += step) {
    for (int y = 0; y < 8; y += step) {
      for (int z = 0; z < 8; z += step) {
        const ivec3 local(x, y, z);
        const ivec3 odd = (local / step) & 1;
        if (odd.x + odd.y + odd.z != odd_coordinates) continue;
        const std::uint16_t priority =
            block.priority[static_cast<unsigned>(x * 64 + y * 8 + z)].load(std::memory_order_relaxed);
        if (priority == 0) continue;
        const ivec3 v = (block.corner * 8 + local) << (3 * block.scale);
        raise_parents(raise, v, odd, octave, priority);
      }
    }
  }
}

void DiamondSet::raise_parents(Raiser& raise, const ivec3& v, const ivec3& odd, int octave,
                               std::uint16_t priority) const {
  const int h = 1 << octave;
  if (odd == ivec3(1)) {
    // Cube middle: of its corners, low is a multiple of 4 h and high is the opposite one.
    ivec3 low;
    ivec3 high;
    for (int axis = 0; axis < 3; ++axis) {
      const bool even = ((v[axis] - h) & (4 * h - 1)) == 0;
      low[axis] = even ? v[axis] - h : v[axis] + h;
      high[axis] = even ? v[axis] + h : v[axis] - h;
    }
    raise({high.x, low.y, low.z}, priority);
    raise({low.x, high.y, low.z}, priority);
    raise({low.x, low.y, high.z}, priority);
    return;
  }
  const int size = 1 << log2_size_;
  for (int axis = 0; axis < 3; ++axis) {
    if (odd[axis] != 0) continue;
    for (const int offset : {h, -h}) {
      ivec3 parent = v;
      parent[axis] += offset;
      if (parent[axis] >= 0 && parent[axis] <= size) raise(parent, priority);
    }
  }
}

unsigned DiamondSet::cells_around(const ivec3& vertex, int octave) const {
  const int h = 1 << octave;
  unsigned odd = 0;
  unsigned outside = 0;
  for (int axis = 0; axis < 3; ++axis) {
    if (((vertex[axis] / h) & 1) != 0) {
      ++odd;
    } else if (vertex[axis] == 0 || vertex[axis] == 1 << log2_size_) {
      ++outside;
    }
  }
  constexpr std::array<unsigned, 4> inside{0, 8, 4, 6};
  return inside[odd] >> outside;
}

void DiamondSet::choose_cut(std::uint64_t max_cells, const Progress* progress) {
  // How many cells each priority adds; splitting a diamond adds one cell for each that it has.
  std::vector<Block*> blocks;
  blocks.reserve(map_.size());
  for (const auto& [key, block] : map_) blocks.push_back(block.get());
  tbb::combinable<std::vector<std::uint64_t>> partial([] { return std::vector<std::uint64_t>(65536); });
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, blocks.size()), [&](const auto& range) {
    std::vector<std::uint64_t>& histogram = partial.local();
    for (std::size_t b = range.begin(); b != range.end(); ++b) {
      check(progress);
      const Block& block = *blocks[b];
      for (unsigned i = 0; i < 512; ++i) {
        const std::uint16_t priority = block.priority[i].load(std::memory_order_relaxed);
        if (priority == 0) continue;
        const ivec3 local(i / 64, (i / 8) % 8, i % 8);
        const ivec3 v = (block.corner * 8 + local) << (3 * block.scale);
        histogram[priority] += cells_around(v, trailing_zeros(v));
      }
    }
  });
  std::vector<std::uint64_t> histogram(65536);
  partial.combine_each([&](const std::vector<std::uint64_t>& p) {
    for (std::size_t i = 0; i < histogram.size(); ++i) histogram[i] += p[i];
  });
  cells_ = 24;
  limited_ = false;
  cut_ = 0xffff;
  for (std::size_t i = 0xffff; i >= 1; --i) {
    if (cells_ + histogram[i] > std::max<std::uint64_t>(max_cells, 24)) {
      limited_ = true;
      break;
    }
    cells_ += histogram[i];
    cut_ = static_cast<std::uint16_t>(i);
  }
}

}  // namespace cumulet::grid
