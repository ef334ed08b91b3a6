#include "light/analytic_lights.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "base/luminance.hpp"
#include "light/alias_table.hpp"

namespace cumulet::light {

namespace {

constexpr double pi = std::numbers::pi;
constexpr double alike = 0.2;  // fraction of the light samples that is distributed uniformly over the lights

// Returns the luminance of the irradiance at the ball.
double arriving(const core::CmAnalyticLight& analytic_light, const Lit& at) {
  const double intensity = luminance(glm::dvec3(analytic_light.intensity));
  if (analytic_light.kind == core::CM_ANALYTIC_LIGHT_DISTANT) return intensity;
  const double distance = glm::distance(glm::dvec3(analytic_light.position), at.centre);
  if (analytic_light.range > 0.0F && distance > double{analytic_light.range} + at.radius) return 0.0;
  const double way = std::max(distance, at.radius);
  return intensity / (way * way);
}

// narrowest: minimum difference of the cosines of the inner and the outer cone angle.
void set_cone(core::CmAnalyticLight& record, float inner, float outer, float narrowest) {
  const float edge = std::cos(outer);
  record.cone_scale = 1.0F / std::max(narrowest, std::cos(inner) - edge);
  record.cone_offset = -edge * record.cone_scale;
}

}  // namespace

core::CmAnalyticLight analytic_light_record(const surface::PunctualLight& light, const glm::dvec3& origin) {
  using Kind = surface::PunctualLight::Kind;
  core::CmAnalyticLight record{};
  record.kind = light.kind == Kind::directional ? core::CM_ANALYTIC_LIGHT_DISTANT : core::CM_ANALYTIC_LIGHT_POINT;
  record.position = glm::vec3(glm::dvec3(light.position) - origin);
  record.direction = light.direction;
  record.range = light.range;
  record.intensity = light.intensity;
  record.cone_offset = 1.0F;
  if (light.kind == Kind::spot)
    set_cone(record, light.inner_cone, light.outer_cone, 0.001F);  // as in KHR_lights_punctual
  return record;
}

core::CmAnalyticLight analytic_light_record(const AnalyticLight& analytic_light, const glm::dvec3& origin) {
  core::CmAnalyticLight record{};
  record.group = analytic_light.group;
  record.position = glm::vec3(analytic_light.position - origin);
  record.direction = glm::vec3(analytic_light.direction);
  record.intensity = analytic_light.power;
  record.cone_offset = 1.0F;
  glm::dvec2 half(0.0);  // half extents
  switch (analytic_light.kind) {
    case AnalyticLight::Kind::point:
    case AnalyticLight::Kind::spot:
      record.kind = core::CM_ANALYTIC_LIGHT_POINT;
      record.intensity *= static_cast<float>(1.0 / (4.0 * pi));
      if (analytic_light.kind == AnalyticLight::Kind::spot) {
        const double outer = 0.5 * analytic_light.angle;
        const double sine = std::sin(0.5 * outer);
        // A thousandth of the cone's own range: with a fixed limit, a narrow cone would never reach full brightness.
        const float narrowest = std::max(1e-7F, static_cast<float>(2e-3 * sine * sine));
        set_cone(record, static_cast<float>(outer * (1.0 - analytic_light.blend)), static_cast<float>(outer),
                 narrowest);
      }
      break;
    case AnalyticLight::Kind::disc:
    case AnalyticLight::Kind::rectangle: {
      const bool disc = analytic_light.kind == AnalyticLight::Kind::disc;
      record.kind = disc ? core::CM_ANALYTIC_LIGHT_DISC : core::CM_ANALYTIC_LIGHT_RECTANGLE;
      record.intensity *= 0.25F;
      half = 0.5 * glm::dvec2(analytic_light.width, disc ? analytic_light.width : analytic_light.height);
      break;
    }
    case AnalyticLight::Kind::sun: {
      record.kind = core::CM_ANALYTIC_LIGHT_DISTANT;
      const double cosine = std::cos(0.5 * analytic_light.angle);
      half = glm::dvec2(std::tan(0.5 * analytic_light.angle));
      record.intensity *= static_cast<float>(1.0 / (cosine * cosine));  // radiance times the disk's area at distance 1
      break;
    }
  }
  record.extended = half.x > 0.0 ? 1U : 0U;
  record.across = glm::vec3(analytic_light.across * half.x);
  record.along = glm::vec3(glm::cross(analytic_light.direction, analytic_light.across) * half.y);
  return record;
}

std::vector<core::CmAnalyticLight> analytic_light_records(const AnalyticLights& of_host,
                                                          std::span<const surface::PunctualLight> of_scene,
                                                          const glm::dvec3& origin) {
  std::vector<core::CmAnalyticLight> records;
  records.reserve(of_host.size() + of_scene.size());
  for (const AnalyticLight& analytic_light : of_host) records.push_back(analytic_light_record(analytic_light, origin));
  for (const surface::PunctualLight& analytic_light : of_scene)
    records.push_back(analytic_light_record(analytic_light, origin));
  return records;
}

double share_looks(std::span<core::CmAnalyticLight> records, std::span<const Lit> lit) {
  const std::size_t count = records.size();
  std::vector<double> shares(count, 0.0);
  double all = 0.0;
  double shared = 0.0;
  for (const Lit& one : lit) {
    if (!(one.radius > 0.0)) continue;
    std::vector<double> arrives;
    double sum = 0.0;
    for (const core::CmAnalyticLight& analytic_light : records) {
      arrives.push_back(arriving(analytic_light, one));
      sum += arrives.back();
    }
    all = std::max(all, sum);
    if (!(sum > 0.0) || !std::isfinite(sum)) continue;
    for (std::size_t i = 0; i < count; ++i) shares[i] += arrives[i] / sum;
    shared += 1.0;
  }
  const double even = 1.0 / static_cast<double>(std::max<std::size_t>(1, count));
  for (double& share : shares) share = shared > 0.0 ? (1.0 - alike) * share / shared + alike * even : even;
  const std::vector<Alias> table = count > 0 ? alias_table(shares, 1.0) : std::vector<Alias>();
  for (std::size_t i = 0; i < count; ++i) {
    records[i].probability = static_cast<float>(shares[i]);
    records[i].stays = table[i].stays;
    records[i].other = table[i].other;
  }
  return all;
}

std::optional<double> nearest_analytic_light(std::span<const core::CmAnalyticLight> records, const Lit& ball) {
  std::optional<double> nearest;
  if (!(ball.radius > 0.0)) return nearest;
  for (const core::CmAnalyticLight& analytic_light : records) {
    if (analytic_light.kind == core::CM_ANALYTIC_LIGHT_DISTANT) continue;
    const double distance = glm::distance(glm::dvec3(analytic_light.position), ball.centre) / ball.radius;
    nearest = std::min(nearest.value_or(distance), distance);
  }
  return nearest;
}

bool suits_equiangular(std::optional<double> nearest, double optical_depth) {
  // For a light outside, irradiance is nearly constant along a ray; equiangular sampling then helps only because few
  // rays collide.
  constexpr double max_within = 3.0;
  constexpr double max_outside = 0.25;
  return nearest && optical_depth < (*nearest <= 1.0 ? max_within : max_outside);
}

void add_analytic_lights(SceneLights& lights, const AnalyticLights& analytic_lights) {
  for (const AnalyticLight& analytic_light : analytic_lights) {
    double share = 1.0;  // emitted power / `power`
    if (analytic_light.kind == AnalyticLight::Kind::disc || analytic_light.kind == AnalyticLight::Kind::rectangle)
      share = 0.25 * pi;
    if (analytic_light.kind == AnalyticLight::Kind::spot) share = 0.5 * (1.0 - std::cos(0.5 * analytic_light.angle));
    if (analytic_light.kind == AnalyticLight::Kind::sun) share = lights.cross_section;
    lights.analytic_light_flux += luminance(glm::dvec3(analytic_light.power)) * share;
  }
  lights.analytic_lights += static_cast<std::uint32_t>(analytic_lights.size());
}

}  // namespace cumulet::light
