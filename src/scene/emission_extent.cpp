#include "scene/emission_extent.hpp"

#include <algorithm>

namespace cumulet::scene {

namespace {

constexpr double visible_share = 0.01;  // of the brightest emission

double largest_of(const glm::dvec3& color) { return std::max({color.r, color.g, color.b}); }

}  // namespace

std::vector<glm::dvec3> emitting_points(const volume::CoarseVolume& flame, const volume::CoarseVolume& temperature,
                                        const Emission& emission) {
  const FieldEmission field(emission);
  const auto burning = [&](float value) { return largest_of(field.flame(value)); };
  const auto hot = [&](float value) { return largest_of(field.black_body(value)); };
  const double brightest = std::max(flame.most(burning), temperature.most(hot));
  if (!(brightest > 0.0)) return {};
  std::vector<glm::dvec3> points = flame.points_where(burning, visible_share * brightest);
  const std::vector<glm::dvec3> more = temperature.points_where(hot, visible_share * brightest);
  points.insert(points.end(), more.begin(), more.end());
  return points;
}

}  // namespace cumulet::scene
