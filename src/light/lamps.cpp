#include "light/lamps.hpp"

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
double arriving(const core::CmLamp& lamp, const Lit& at) {
  const double intensity = luminance(glm::dvec3(lamp.intensity));
  if (lamp.kind == core::CM_LAMP_DISTANT) return intensity;
  const double distance = glm::distance(glm::dvec3(lamp.position), at.centre);
  if (lamp.range > 0.0F && distance > double{lamp.range} + at.radius) return 0.0;
  const double way = std::max(distance, at.radius);
  return intensity / (way * way);
}

// narrowest: minimum difference of the cosines of the inner and the outer cone angle.
void set_cone(core::CmLamp& record, float inner, float outer, float narrowest) {
  const float edge = std::cos(outer);
  record.cone_scale = 1.0F / std::max(narrowest, std::cos(inner) - edge);
  record.cone_offset = -edge * record.cone_scale;
}

}  // namespace

core::CmLamp lamp_record(const surface::PunctualLight& light, const glm::dvec3& origin) {
  using Kind = surface::PunctualLight::Kind;
  core::CmLamp record{};
  record.kind = light.kind == Kind::directional ? core::CM_LAMP_DISTANT : core::CM_LAMP_POINT;
  record.position = glm::vec3(glm::dvec3(light.position) - origin);
  record.direction = light.direction;
  record.range = light.range;
  record.intensity = light.intensity;
  record.cone_offset = 1.0F;
  if (light.kind == Kind::spot)
    set_cone(record, light.inner_cone, light.outer_cone, 0.001F);  // as in KHR_lights_punctual
  return record;
}

core::CmLamp lamp_record(const Lamp& lamp, const glm::dvec3& origin) {
  core::CmLamp record{};
  record.group = lamp.group;
  record.position = glm::vec3(lamp.position - origin);
  record.direction = glm::vec3(lamp.direction);
  record.intensity = lamp.power;
  record.cone_offset = 1.0F;
  glm::dvec2 half(0.0);  // half extents
  switch (lamp.kind) {
    case Lamp::Kind::point:
    case Lamp::Kind::spot:
      record.kind = core::CM_LAMP_POINT;
      record.intensity *= static_cast<float>(1.0 / (4.0 * pi));
      if (lamp.kind == Lamp::Kind::spot) {
        const double outer = 0.5 * lamp.angle;
        const double sine = std::sin(0.5 * outer);
        // A thousandth of the cone's own range: with a fixed limit, a narrow cone would never reach full brightness.
        const float narrowest = std::max(1e-7F, static_cast<float>(2e-3 * sine * sine));
        set_cone(record, static_cast<float>(outer * (1.0 - lamp.blend)), static_cast<float>(outer), narrowest);
      }
      break;
    case Lamp::Kind::disc:
    case Lamp::Kind::rectangle: {
      const bool disc = lamp.kind == Lamp::Kind::disc;
      record.kind = disc ? core::CM_LAMP_DISC : core::CM_LAMP_RECTANGLE;
      record.intensity *= 0.25F;
      half = 0.5 * glm::dvec2(lamp.width, disc ? lamp.width : lamp.height);
      break;
    }
    case Lamp::Kind::sun: {
      record.kind = core::CM_LAMP_DISTANT;
      const double cosine = std::cos(0.5 * lamp.angle);
      half = glm::dvec2(std::tan(0.5 * lamp.angle));
      record.intensity *= static_cast<float>(1.0 / (cosine * cosine));  // radiance times the disk's area at distance 1
      break;
    }
  }
  record.extended = half.x > 0.0 ? 1U : 0U;
  record.across = glm::vec3(lamp.across * half.x);
  record.along = glm::vec3(glm::cross(lamp.direction, lamp.across) * half.y);
  return record;
}

std::vector<core::CmLamp> lamp_records(const Lamps& of_host, std::span<const surface::PunctualLight> of_scene,
                                       const glm::dvec3& origin) {
  std::vector<core::CmLamp> records;
  records.reserve(of_host.size() + of_scene.size());
  for (const Lamp& lamp : of_host) records.push_back(lamp_record(lamp, origin));
  for (const surface::PunctualLight& lamp : of_scene) records.push_back(lamp_record(lamp, origin));
  return records;
}

double share_looks(std::span<core::CmLamp> records, std::span<const Lit> lit) {
  const std::size_t count = records.size();
  std::vector<double> shares(count, 0.0);
  double all = 0.0;
  double shared = 0.0;
  for (const Lit& one : lit) {
    if (!(one.radius > 0.0)) continue;
    std::vector<double> arrives;
    double sum = 0.0;
    for (const core::CmLamp& lamp : records) {
      arrives.push_back(arriving(lamp, one));
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
    records[i].chance = static_cast<float>(shares[i]);
    records[i].stays = table[i].stays;
    records[i].other = table[i].other;
  }
  return all;
}

std::optional<double> nearest_lamp(std::span<const core::CmLamp> records, const Lit& ball) {
  std::optional<double> nearest;
  if (!(ball.radius > 0.0)) return nearest;
  for (const core::CmLamp& lamp : records) {
    if (lamp.kind == core::CM_LAMP_DISTANT) continue;
    const double distance = glm::distance(glm::dvec3(lamp.position), ball.centre) / ball.radius;
    nearest = std::min(nearest.value_or(distance), distance);
  }
  return nearest;
}

bool suits_equiangular(std::optional<double> nearest, double optical_depth) {
  // For a light outside, irradiance is nearly constant along a ray; equiangular sampling then helps only because few
  // rays collide.
  constexpr double most_within = 3.0;
  constexpr double most_outside = 0.25;
  return nearest && optical_depth < (*nearest <= 1.0 ? most_within : most_outside);
}

void add_lamps(SceneLights& lights, const Lamps& lamps) {
  for (const Lamp& lamp : lamps) {
    double share = 1.0;  // emitted power / `power`
    if (lamp.kind == Lamp::Kind::disc || lamp.kind == Lamp::Kind::rectangle) share = 0.25 * pi;
    if (lamp.kind == Lamp::Kind::spot) share = 0.5 * (1.0 - std::cos(0.5 * lamp.angle));
    if (lamp.kind == Lamp::Kind::sun) share = lights.cross_section;
    lights.lamp_flux += luminance(glm::dvec3(lamp.power)) * share;
  }
  lights.lamps += static_cast<std::uint32_t>(lamps.size());
}

}  // namespace cumulet::light
