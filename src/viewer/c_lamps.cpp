#include "viewer/c_lamps.hpp"

#include <cmath>
#include <numbers>

#include "settings/lamp_limits.hpp"

namespace cumulet::c_abi {

namespace {

using glm::dvec3;

/// Normalizes a vector of any length above 0.
dvec3 unit(const dvec3& v) {
  const dvec3 size = glm::abs(v);
  return glm::normalize(v / std::max({size.x, size.y, size.z}));
}

/// Returns the tangent of a rectangle light along its width, perpendicular to its direction.
dvec3 across_of(const dvec3& wanted, const dvec3& direction) {
  const dvec3 level = glm::cross(dvec3(0.0, 1.0, 0.0), direction);
  const dvec3 otherwise = glm::length(level) > 1e-6 ? level : dvec3(1.0, 0.0, 0.0);
  const dvec3 way = wanted == dvec3(0.0) ? otherwise : unit(wanted);
  const dvec3 upright = way - glm::dot(way, direction) * direction;
  return glm::normalize(glm::length(upright) > 1e-6 ? upright : otherwise);
}

light::Lamp lamp_of(const cumulet_lamp_desc& d) {
  light::Lamp lamp;
  lamp.kind = static_cast<light::Lamp::Kind>(d.kind);
  lamp.position = to_dvec3(d.position);
  if (to_dvec3(d.direction) != dvec3(0.0)) lamp.direction = unit(to_dvec3(d.direction));
  lamp.across = across_of(to_dvec3(d.across), lamp.direction);
  lamp.power = to_vec3(d.color) * d.power;
  lamp.width = d.width;
  lamp.height = d.height;
  const double degrees = d.kind == CUMULET_LAMP_SPOT && d.angle_degrees == 0.0 ? 45.0 : d.angle_degrees;
  lamp.angle = degrees * std::numbers::pi / 180.0;
  lamp.blend = d.blend;
  lamp.group = d.group;
  return lamp;
}

}  // namespace

light::Lamps lamps_of(const cumulet_lamp_desc* lamps, uint64_t count) {
  light::Lamps made;
  if (const std::string why = settings::lamp_count_refusal(count); !why.empty()) refuse(why);
  for_each_desc(lamps, count, "cumulet_lamp_desc", "lamp",
                [&](const cumulet_lamp_desc& given, const std::string& what) {
                  cumulet_lamp_desc d{};
                  try {
                    d = read_settings(&given);
                  } catch (const Error& error) {
                    refuse(what + ": " + error.what());
                  }
                  if (const auto refusal = settings::lamp_refusal(d))
                    refuse(what + ": cumulet_lamp_desc." + refusal->name + " " + refusal->cause);
                  const light::Lamp lamp = lamp_of(d);
                  if (lamp.power != glm::vec3(0.0F)) made.push_back(lamp);
                });
  return made;
}

}  // namespace cumulet::c_abi
