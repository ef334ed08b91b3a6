#include "viewer/c_lights.hpp"

#include <cmath>
#include <numbers>

#include "settings/analytic_light_limits.hpp"

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

light::AnalyticLight analytic_light_of(const cumulet_light_desc& d) {
  light::AnalyticLight analytic_light;
  analytic_light.kind = static_cast<light::AnalyticLight::Kind>(d.kind);
  analytic_light.position = to_dvec3(d.position);
  if (to_dvec3(d.direction) != dvec3(0.0)) analytic_light.direction = unit(to_dvec3(d.direction));
  analytic_light.across = across_of(to_dvec3(d.tangent), analytic_light.direction);
  analytic_light.power = to_vec3(d.color) * d.power;
  analytic_light.width = d.width;
  analytic_light.height = d.height;
  const double degrees = d.kind == CUMULET_LIGHT_SPOT && d.angle_degrees == 0.0 ? 45.0 : d.angle_degrees;
  analytic_light.angle = degrees * std::numbers::pi / 180.0;
  analytic_light.blend = d.blend;
  analytic_light.group = d.group;
  return analytic_light;
}

}  // namespace

light::AnalyticLights analytic_lights_of(const cumulet_light_desc* analytic_lights, uint64_t count) {
  light::AnalyticLights made;
  if (const std::string why = settings::analytic_light_count_refusal(count); !why.empty()) refuse(why);
  for_each_desc(analytic_lights, count, "cumulet_light_desc", "light",
                [&](const cumulet_light_desc& given, const std::string& what) {
                  cumulet_light_desc d{};
                  try {
                    d = read_settings(&given);
                  } catch (const Error& error) {
                    refuse(what + ": " + error.what());
                  }
                  if (const auto refusal = settings::analytic_light_refusal(d))
                    refuse(what + ": cumulet_light_desc." + refusal->name + " " + refusal->cause);
                  const light::AnalyticLight analytic_light = analytic_light_of(d);
                  if (analytic_light.power != glm::vec3(0.0F)) made.push_back(analytic_light);
                });
  return made;
}

}  // namespace cumulet::c_abi
