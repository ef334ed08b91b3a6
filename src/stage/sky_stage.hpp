#pragma once

#include <glm/glm.hpp>
#include <optional>
#include <utility>

#include "base/log.hpp"
#include "jobs/environment_builder.hpp"
#include "light/environment.hpp"
#include "light/sky.hpp"
#include "scene/snapshot.hpp"
#include "stage/settings.hpp"

namespace cumulet::viewer {

/// Sun, sky, environment and the settings of the ground. Functions are called on the host's thread.
class SkyStage {
 public:
  /// builder: outlives the stage.
  SkyStage(EnvironmentBuilder& builder, Log log) : builder_(builder), log_(std::move(log)) {}

  void set_light(const Light& light);
  [[nodiscard]] const Light& light() const { return light_; }
  /// Shows this environment. Null: the sky of the light settings.
  void set_environment(light::EnvironmentPtr environment);
  [[nodiscard]] const light::EnvironmentPtr& environment() const { return environment_; }
  void set_environment_settings(const EnvironmentSettings& settings);
  void set_ground(const GroundSettings& settings);
  [[nodiscard]] bool has_ground() const { return ground_.mode != GroundMode::none; }
  /// Takes the results of the builder.
  void sync();

  /// Returns the ground. box: bounds of the scene; nullopt: it is empty. eye: nullopt: there is no view.
  [[nodiscard]] std::optional<scene::Ground> ground(const std::optional<Bounds>& box, bool shows_triangles,
                                                    const std::optional<glm::dvec3>& eye) const;
  [[nodiscard]] const scene::Part<light::DistantLights>& lights() const { return lights_; }
  [[nodiscard]] const scene::Part<light::Surroundings>& surroundings() const { return surroundings_; }

 private:
  // Updates lights and surroundings from the settings.
  void update();
  // Returns the inputs of the physical sky; nullopt without one.
  [[nodiscard]] std::optional<light::Day> day() const;

  EnvironmentBuilder& builder_;
  Log log_;
  Light light_;
  std::optional<light::Day> asked_day_;      // sky being computed
  std::optional<light::Daylight> daylight_;  // displayed physical sky
  light::EnvironmentPtr environment_;        // newest
  EnvironmentSettings environment_settings_;
  GroundSettings ground_;
  scene::Part<light::DistantLights> lights_;
  scene::Part<light::Surroundings> surroundings_;
};

}  // namespace cumulet::viewer
