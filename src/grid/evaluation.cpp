#include "grid/evaluation.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "base/luminance.hpp"

namespace cumulet::grid {

namespace {

using glm::dvec3;
using glm::ivec3;
using glm::vec3;

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

// Mean over all scattering.
double mean_anisotropy(const Statistics& density, const Channels& channels) {
  double scattering = mass_of(density);
  if (const RgbField* colored = channels.scattering.get()) {
    scattering = luminance(
        dvec3(mass_of(colored->component(0)), mass_of(colored->component(1)), mass_of(colored->component(2))));
  }
  return scattering > 0.0 ? 2.0 * mass_of(channels.forward->statistics()) / scattering - 1.0 : 0.0;
}

}  // namespace

Weights Weights::of_density(double depth, const RefineSettings& settings) {
  if (!(depth > 0.0)) return {};
  if (settings.criterion != Criterion::transmittance) return {.per_depth = 1.0 / depth};
  const double scale = settings.density_scale;
  const double hidden = -std::expm1(-scale * depth);
  // If the occlusion underflows in double precision, it is proportional to the depth.
  return {.per_depth = hidden > 0.0 ? scale / hidden : 1.0 / depth, .own_hiding = hiding(scale, settings.anisotropy)};
}

// A deviation is weighted relative to the strongest component, or by its effect on the luminance if that is larger: in
// a red fire, green has most of the luminance. The factor is one fifth above that of density, because scattering blurs
// density. It was chosen so that fires have the same image error as clouds (tests/bench/results/default_grids.csv).
Weights Weights::of_emission(const dvec3& depth, int component, const RefineSettings& settings) {
  const double most = std::max({depth.r, depth.g, depth.b});
  if (!(most > 0.0)) return {};
  dvec3 only(0.0);
  only[component] = 1.0;
  const double sharp = settings.criterion == Criterion::transmittance ? 1.2 : 1.0;
  return {.per_depth = sharp * std::max(1.0 / most, luminance(only) / luminance(depth)), .two_way = false};
}

float Measure::bound(float min, float max, float edge_squared, float lit) const {
  if (criterion_ == Criterion::range_mean) return std::numeric_limits<float>::infinity();
  return 0.25F * (max - min) * (max - min) * edge_squared * scale_ * seen_squared(lit);
}

float Measure::bound_of_steepest(float variance, float left, float lit) const {
  if (criterion_ == Criterion::range_mean) return std::numeric_limits<float>::infinity();
  return (has_fits(cells_) ? left : variance) * scale_ * seen_squared(lit);
}

float Measure::squared(std::uint32_t cell_class, float mean, float variance, const vec3& covariance, float min,
                       float max, float edge_squared, float lit, float floor) const {
  if (min >= max) return 0.0F;
  if (criterion_ == Criterion::range_mean) {
    const float ratio = (max - min) / mean;
    return ratio * ratio;
  }
  const float own = 1.0F + own_hiding_ * mean * std::sqrt(edge_squared);
  const float weight = edge_squared * scale_ * seen_squared(lit) / (own * own);
  const float value = variance * weight;
  if (value <= floor || !has_fits(cells_)) return value;
  const float explained = fit_linear(cell_class, covariance, mean).explained;
  return std::max(0.0F, variance - explained) * weight;
}

Evaluation::Evaluation(const Statistics& statistics, const Weights& weights, const Transmittance* transmittance,
                       const RefineSettings& settings)
    : statistics_(&statistics),
      transmittance_(transmittance),
      measure_(weights, settings),
      edge_length_(statistics.cube().to_world) {
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

unsigned Evaluation::levels_at_most(const Statistics::Node& brick, float floor) const {
  const volume::BrickSummary& summary = *statistics_->summary(brick);
  const float* blocks = lit(brick);
  const float most = blocks != nullptr ? *std::max_element(blocks, blocks + Transmittance::blocks_per_brick) : 1.0F;
  const auto all = static_cast<int>(splitting_levels(statistics_->cube().log2_size));
  auto levels =
      static_cast<unsigned>(std::clamp(all - kuhn_level(statistics_->cube().log2_size, 3), 0, int{brick_levels}));
  const auto upper_half = [](std::uint32_t bits) { return std::bit_cast<float>(bits << 16U); };
  while (levels > 0) {
    const std::uint32_t steepest = summary.steepest[levels - 1];
    if (measure_.bound_of_steepest(upper_half(steepest >> 16U), upper_half(steepest & 0xffffU), most) > floor) break;
    --levels;
  }
  return levels;
}

std::array<float, CM_BRICK_EDGES> brick_edges(const glm::dmat4& to_world) {
  const EdgeLengths length(to_world);
  std::array<float, CM_BRICK_EDGES> squared{};
  for (int octant = 0; octant < 8; ++octant) {
    const ivec3 corner = 8 * ivec3(octant & 1, (octant >> 1) & 1, octant >> 2);
    for (std::uint32_t permutation = 0; permutation < 6; ++permutation) {
      // The edges of all cells occur among the first children of these tetrahedra.
      std::uint32_t shape = brick_tree(kuhn_frame(corner, 8, permutation)).shape[1];
      for (unsigned level = 0; level < CM_BRICK_LEVELS; ++level) {
        const double edge = length(shape);
        const vec3 along = core::cm_cell_vertex(vec3(0.0F), shape, 1);
        squared[CM_LEVEL_EDGES * level + core::cm_edge_of(along)] = static_cast<float>(edge * edge);
        shape = core::cm_child_shape(shape, 0);
      }
    }
  }
  return squared;
}

std::vector<EvaluatedField> evaluated_fields(const Statistics& density, const Channels& channels) {
  std::vector<EvaluatedField> fields;
  if (channels.ends) {
    // A field between both ends deviates no more than one of them.
    fields = {{&channels.ends->open.statistics(), {}}, {&channels.ends->close.statistics(), {}}};
  } else {
    fields = {{&density, {}}};
  }
  for (int i = 0; i < 3; ++i) {
    const auto component = static_cast<std::size_t>(i);
    if (channels.emission) fields.push_back({&channels.emission->component(component), i});
    if (channels.scattering) fields.push_back({&channels.scattering->component(component), {}});
  }
  if (channels.forward) fields.push_back({&channels.forward->statistics(), {}});
  return fields;
}

Evaluations::Evaluations(const Statistics& statistics, const Channels& channels, const RefineSettings& settings,
                         const Progress* progress) {
  RefineSettings used = settings;
  if (channels.forward) used.anisotropy = std::max(used.anisotropy, mean_anisotropy(statistics, channels));
  if (settings.criterion == Criterion::transmittance) {
    transmittance_ =
        std::make_unique<const Transmittance>(statistics, hiding(used.density_scale, used.anisotropy), progress);
  }
  const Weights of_density = Weights::of_density(statistics.mean_optical_depth(), used);
  for (const EvaluatedField& of : evaluated_fields(statistics, channels)) {
    const Weights weights =
        of.light ? Weights::of_emission(channels.emission->mean_depth(), *of.light, used) : of_density;
    all_.emplace_back(*of.field, weights, transmittance_.get(), used);
  }
}

}  // namespace cumulet::grid
