#include "grid/tet_grid.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace cumulet::grid {

namespace {

using glm::dvec3;
using glm::vec3;
using glm::vec4;

std::uint32_t pack_emission_gradient(const vec3& gradient) {
  std::uint32_t word = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const float part = std::clamp(gradient[axis] / CM_EMISSION_STEEPEST, -1.0F, 1.0F);
    word |= (static_cast<std::uint32_t>(std::lround(511.0F * part)) & 0x3ffU) << static_cast<unsigned>(10 * axis);
  }
  return word;
}

}  // namespace

std::array<RootCell, 24> root_cells(int log2_size) {
  std::array<RootCell, 24> roots;
  std::array<std::array<vec3, 4>, 24> vertices;
  for (unsigned root = 0; root < 24; ++root) {
    core::cm_root_cell(root, static_cast<std::uint32_t>(log2_size - 1), roots[root].v0, roots[root].shape);
    for (unsigned i = 0; i < 4; ++i) vertices[root][i] = core::cm_cell_vertex(roots[root].v0, roots[root].shape, i);
  }
  constexpr std::array<unsigned, 4> opposite{3, 1, 2, 0};  // per face: the opposite vertex
  for (unsigned a = 0; a < 24; ++a) {
    for (unsigned face = 0; face < 4; ++face) {
      for (unsigned b = 0; b < 24; ++b) {
        unsigned shared = 0;
        for (unsigned i = 0; i < 4; ++i) {
          if (i == opposite[face]) continue;
          shared += std::count(vertices[b].begin(), vertices[b].end(), vertices[a][i]) > 0 ? 1U : 0U;
        }
        if (a != b && shared == 3) roots[a].links[face] = b;
      }
    }
  }
  return roots;
}

EmissionRecord emission_record(const std::array<Moments, 3>& moments, std::uint32_t shape, const dvec3& centroid,
                               CellKind cells) {
  EmissionRecord record{};
  vec3 slope(0.0F);
  float sum = 0.0F;
  for (int i = 0; i < 3; ++i) {
    const Moments& m = moments[static_cast<std::size_t>(i)];
    record.mean[i] = static_cast<float>(std::clamp(m.mean(), double(m.min), double(m.max)));
    sum += record.mean[i];
    if (has_fits(cells) && m.min < m.max)
      slope += fit_linear(core::cm_shape_class(shape), frame_covariance(m, shape, centroid), record.mean[i]).gradient;
  }
  if (sum > 0.0F) record.gradient = pack_emission_gradient(slope / sum);
  return record;
}

bool emits(const std::array<Moments, 3>& moments) {
  return std::ranges::any_of(moments, [](const Moments& m) { return m.max > 0.0F; });
}

std::uint32_t pack_color(const dvec3& scattering, double mass) {
  if (!(mass > 0.0)) return 0;
  const auto whole = [&](double part, float most) {
    return static_cast<std::uint32_t>(std::lround(most * std::clamp(static_cast<float>(part / mass), 0.0F, 1.0F)));
  };
  return whole(scattering.x, 2047.0F) | (whole(scattering.y, 2047.0F) << 11U) | (whole(scattering.z, 1023.0F) << 22U);
}

std::int16_t pack_anisotropy(double forward, double scattering) {
  if (!(scattering > 0.0)) return 0;
  // Beyond this limit the lobe is narrower than the float resolution of cosines.
  constexpr double most = 0.999;
  const double mean = std::clamp(2.0 * forward / scattering - 1.0, -most, most);
  return static_cast<std::int16_t>(std::lround(mean * std::numeric_limits<std::int16_t>::max()));
}

glm::uvec2 pack_velocity(const dvec3& momentum, double mass, float fastest) {
  if (!(mass > 0.0)) return glm::uvec2(0U);
  const vec3 mean(double{fastest} * glm::clamp(2.0 * momentum / mass - 1.0, -1.0, 1.0));
  return {glm::packHalf2x16({mean.x, mean.y}), glm::packHalf2x16({mean.z, 0.0F})};
}

glm::uvec2 pack_fit(const vec4& fit) { return {glm::packHalf2x16({fit.x, fit.y}), glm::packHalf2x16({fit.z, fit.w})}; }

std::uint32_t locate(const TetGrid& grid, const vec3& p) {
  const auto size = static_cast<float>(grid.cube.size());
  if (!glm::all(glm::greaterThanEqual(p, vec3(0.0F))) || !glm::all(glm::lessThanEqual(p, vec3(size)))) return CM_NONE;
  const std::uint32_t root = core::cm_root_of(p, 0.5F * size);
  vec3 v0;
  std::uint32_t shape = 0;
  core::cm_root_cell(root, static_cast<std::uint32_t>(grid.cube.log2_size - 1), v0, shape);
  std::uint32_t leaf = grid.roots[root].first_leaf;
  std::uint32_t internal = grid.roots[root].first_internal;
  std::uint32_t inside = grid.roots[root + 1].first_internal - internal;
  while (inside > 0) {
    const std::uint32_t left = grid.tree[internal];
    const bool second = core::cm_on_child_1(core::cm_shape_class(shape),
                                            core::cm_to_frame(p - v0, shape) * core::cm_shape_inverse_unit(shape));
    if (second) {
      v0 = core::cm_cell_vertex(v0, shape, 1);
      leaf += left + 1;
      internal += left + 1;
      inside -= left + 1;
    } else {
      internal += 1;
      inside = left;
    }
    shape = core::cm_child_shape(shape, second ? 1 : 0);
  }
  return leaf;
}

}  // namespace cumulet::grid
