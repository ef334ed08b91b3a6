#include "scene/emission_extent.hpp"

#include <algorithm>

#include "light/black_body.hpp"

namespace cumulet::scene {

namespace {

constexpr double visible_share = 0.01;  // of the brightest emission

double largest_of(const glm::vec3& color) { return double{std::max({color.r, color.g, color.b})}; }

// Emission per unit length where a field has this value. Colors count with their largest component.
double flame_light(const Emission& emission, float value) {
  const glm::vec3 color = emission.flame_colors.empty() ? emission.flame_color : emission.flame_colors(value);
  return double{emission.flame_ramp(value)} * emission.flame_strength * largest_of(color);
}

double black_body_light(const Emission& emission, float value) {
  const float temperature = emission.temperature_ramp(value);
  if (!(temperature > 0.0F)) return 0.0;
  const double kelvin = emission.temperature_offset + emission.kelvin_a_value() * double{temperature};
  glm::vec3 color = emission.blackbody_tint;
  if (!emission.temperature_colors.empty()) color *= emission.temperature_colors(value);
  return light::black_body_radiance(kelvin, emission.blackbody) * largest_of(color);
}

}  // namespace

std::vector<glm::dvec3> emitting_points(const volume::CoarseVolume& flame, const volume::CoarseVolume& temperature,
                                        const Emission& emission) {
  const auto burning = [&](float value) { return emission.burns() ? flame_light(emission, value) : 0.0; };
  const auto hot = [&](float value) { return emission.is_hot() ? black_body_light(emission, value) : 0.0; };
  const double brightest = std::max(flame.most(burning), temperature.most(hot));
  if (!(brightest > 0.0)) return {};
  std::vector<glm::dvec3> points = flame.points_where(burning, visible_share * brightest);
  const std::vector<glm::dvec3> more = temperature.points_where(hot, visible_share * brightest);
  points.insert(points.end(), more.begin(), more.end());
  return points;
}

}  // namespace cumulet::scene
