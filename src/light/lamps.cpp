#include "light/lamps.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/luminance.hpp"

namespace cumulet::light {

namespace {

constexpr double pi = std::numbers::pi;

// narrowest: of the band in which it dims, in cosine.
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
    set_cone(record, light.inner_cone, light.outer_cone, 0.001F);  // as KHR_lights_punctual has it
  return record;
}

core::CmLamp lamp_record(const Lamp& lamp, const glm::dvec3& origin) {
  core::CmLamp record{};
  record.position = glm::vec3(lamp.position - origin);
  record.direction = glm::vec3(lamp.direction);
  record.intensity = lamp.power;
  record.cone_offset = 1.0F;
  glm::dvec2 half(0.0);  // of its extent
  switch (lamp.kind) {
    case Lamp::Kind::point:
    case Lamp::Kind::spot:
      record.kind = core::CM_LAMP_POINT;
      record.intensity *= static_cast<float>(1.0 / (4.0 * pi));
      if (lamp.kind == Lamp::Kind::spot) {
        const double outer = 0.5 * lamp.angle;
        const double sine = std::sin(0.5 * outer);
        // A thousandth of the cone's own, or a narrow one would never be bright.
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
      record.intensity *= static_cast<float>(1.0 / (cosine * cosine));  // radiance times the disc's area at distance 1
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

void add_lamps(SceneLights& lights, const Lamps& lamps) {
  for (const Lamp& lamp : lamps) {
    double share = 1.0;  // of its power that it sends out
    if (lamp.kind == Lamp::Kind::disc || lamp.kind == Lamp::Kind::rectangle) share = 0.25 * pi;
    if (lamp.kind == Lamp::Kind::spot) share = 0.5 * (1.0 - std::cos(0.5 * lamp.angle));
    if (lamp.kind == Lamp::Kind::sun) share = lights.cross_section;
    lights.lamp_flux += luminance(glm::dvec3(lamp.power)) * share;
  }
  lights.lamps += static_cast<std::uint32_t>(lamps.size());
}

}  // namespace cumulet::light
