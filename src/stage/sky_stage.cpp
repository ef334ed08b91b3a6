#include "stage/sky_stage.hpp"

#include <cmath>
#include <glm/glm.hpp>
#include <numbers>
#include <string>
#include <utility>

#include "base/one_line.hpp"
#include "scene/origin.hpp"

namespace cumulet::viewer {

namespace {

using glm::dvec3;

double radians(double degrees) { return degrees * std::numbers::pi / 180.0; }

dvec3 to_sun(double azimuth_degrees, double elevation_degrees) {
  const double azimuth = radians(azimuth_degrees);
  const double elevation = radians(elevation_degrees);
  return {std::sin(azimuth) * std::cos(elevation), std::sin(elevation), std::cos(azimuth) * std::cos(elevation)};
}

}  // namespace

void SkyStage::set_light(const Light& light) {
  light_ = light;
  update();
  host_.touch();
}

void SkyStage::set_lights(light::AnalyticLights lights) {
  analytic_lights_ = std::move(lights);
  lights_origin_.reset();
  host_.touch();
}

const scene::Part<light::AnalyticLights>& SkyStage::analytic_lights(const dvec3& origin) {
  if (lights_origin_ != origin) relative_lights_.set(scene::counted_from(analytic_lights_, origin));
  lights_origin_ = origin;
  return relative_lights_;
}

void SkyStage::load_environment(const FilePath& path) {
  failures_.retire();
  host_.sync();
  builder_.load(path);
  host_.touch();
}

void SkyStage::set_environment(light::EnvironmentPtr environment) {
  failures_.retire();
  builder_.drop_loads();
  host_.sync();
  show(std::move(environment));
  host_.touch();
}

const light::EnvironmentPtr& SkyStage::environment() {
  host_.sync();
  return environment_;
}

void SkyStage::show(light::EnvironmentPtr environment) {
  if (environment && !environment->remarks.empty()) {
    std::string remarks;
    for (const std::string& remark : environment->remarks) remarks.append(remarks.empty() ? ": " : "; ").append(remark);
    log_.warning(one_line(environment->name) + remarks);
  }
  if (environment && environment->replaced > 0) {
    log_.warning(one_line(environment->name) + ": " + std::to_string(environment->replaced) +
                 " pixels have non-finite, negative or too large (above 1e30) values, which are read as 0");
  }
  environment_ = std::move(environment);
  update();
}

void SkyStage::set_environment_settings(const EnvironmentSettings& settings) {
  environment_settings_ = settings;
  update();
  host_.touch();
}

void SkyStage::set_ground(const GroundSettings& settings) {
  ground_ = settings;
  update();
  host_.touch();
}

void SkyStage::sync() {
  if (auto read = builder_.take_environment()) show(std::move(*read));
  if (auto sky = builder_.take_sky()) {
    if (asked_day_ == sky->day) asked_day_.reset();
    // A sky requested earlier is displayed until the newest is ready.
    if (const auto wanted = day(); wanted && !(daylight_ && daylight_->day == *wanted)) daylight_ = std::move(*sky);
    update();
  }
}

std::optional<light::Day> SkyStage::day() const {
  if (!light_.sky) return std::nullopt;
  return light::Day{*light_.sky, light_.sun_elevation_degrees, has_ground() && !ground_.shadow_catcher};
}

void SkyStage::update() {
  light::Surroundings surroundings{environment_, environment_settings_.rotation_degrees,
                                   environment_settings_.strength};
  const std::optional<light::Day> wanted = day();
  if (!wanted) {
    builder_.forget_sky_failure();
    daylight_.reset();
    lights_.set({to_sun(light_.sun_azimuth_degrees, light_.sun_elevation_degrees), light_.sun_irradiance,
                 light_.sky_radiance, light_.sun_angle_degrees});
  } else if (!(daylight_ && daylight_->day == *wanted) && asked_day_ != wanted) {
    builder_.make_sky(*wanted);
    asked_day_ = wanted;
  }
  // Until the new sky is ready, sun and sky stay unchanged except for the azimuth.
  if (daylight_) {
    lights_.set({to_sun(light_.sun_azimuth_degrees, daylight_->day.sun_elevation_degrees), daylight_->sun_irradiance,
                 light_.sky_radiance, light_.sun_angle_degrees});
    if (!environment_)
      surroundings = {.environment = daylight_->surroundings, .rotation_degrees = light_.sun_azimuth_degrees};
  }
  surroundings_.set(std::move(surroundings));
}

std::optional<scene::Ground> SkyStage::ground(const std::optional<Bounds>& box, bool shows_triangles,
                                              const std::optional<glm::dvec3>& eye) const {
  // A ground plane at a given height is also shown without other objects: a sequence's frame may be empty.
  if (!has_ground() || (ground_.mode == GroundMode::below && !box)) return std::nullopt;
  scene::Ground ground{ground_.height, ground_.albedo, 0.0, ground_.shadow_catcher};
  // With models it is slightly below the bounds, because many models include a floor.
  if (ground_.mode == GroundMode::below)
    ground.height = box->min.y - (shows_triangles ? 1e-4 * glm::distance(box->min, box->max) : 0.0);
  // Then the visible edge of the plane is at most 1e-4 radians below the true horizon.
  const double height = eye ? std::abs(eye->y - ground.height) : 0.0;
  const double scene = box ? glm::distance(box->min, box->max) + std::abs(box->min.y - ground.height) : 0.0;
  ground.reach = 1e4 * (scene + height);
  return ground;
}

}  // namespace cumulet::viewer
