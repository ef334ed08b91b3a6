#pragma once

#include <glm/glm.hpp>
#include <optional>
#include <utility>

#include "base/file_path.hpp"
#include "base/log.hpp"
#include "jobs/environment_builder.hpp"
#include "jobs/reported_failures.hpp"
#include "light/analytic_lights.hpp"
#include "light/environment.hpp"
#include "light/sky.hpp"
#include "scene/snapshot.hpp"
#include "stage/settings.hpp"
#include "stage/stage_host.hpp"

namespace cumulet::viewer {

/// Sun, sky, environment, the host's lights and the settings of the ground. Functions are called under the state lock.
/// Functions that change settings have the contract of those of Viewer with the same name.
class SkyStage {
 public:
  /// builder, failures, host: outlive the stage.
  SkyStage(EnvironmentBuilder& builder, ReportedFailures& failures, StageHost& host, Log log)
      : builder_(builder), failures_(failures), host_(host), log_(std::move(log)) {}

  void set_light(const Light& light);
  [[nodiscard]] const Light& light() const { return light_; }
  void set_lights(light::AnalyticLights lights);
  void load_environment(const FilePath& path);
  void set_environment(light::EnvironmentPtr environment);
  const light::EnvironmentPtr& environment();
  void set_environment_settings(const EnvironmentSettings& settings);
  void set_ground(const GroundSettings& settings);
  /// The background decides whether a shadow catcher is there. shows_sky: it is the sky or the environment.
  void set_background(bool shows_sky) { shows_sky_ = shows_sky; }
  [[nodiscard]] bool has_ground() const {
    return ground_.mode != GroundMode::none && (shows_sky_ || !ground_.shadow_catcher);
  }
  /// Takes the results of the builder.
  void sync();

  /// Returns the ground. box: bounds of the scene; nullopt: it is empty. eye: nullopt: there is no view.
  [[nodiscard]] std::optional<scene::Ground> ground(const std::optional<Bounds>& box, bool shows_triangles,
                                                    const std::optional<glm::dvec3>& eye) const;
  [[nodiscard]] const scene::Part<light::DistantLights>& lights() const { return lights_; }
  [[nodiscard]] const scene::Part<light::Surroundings>& surroundings() const { return surroundings_; }
  /// The host's lights, relative to this origin.
  [[nodiscard]] const scene::Part<light::AnalyticLights>& analytic_lights(const glm::dvec3& origin);

 private:
  // Shows this environment. Null: the sky of the light settings.
  void show(light::EnvironmentPtr environment);
  // Updates lights and surroundings from the settings.
  void update();
  // Returns the inputs of the physical sky; nullopt without one.
  [[nodiscard]] std::optional<light::Day> day() const;

  EnvironmentBuilder& builder_;
  ReportedFailures& failures_;
  StageHost& host_;
  Log log_;
  Light light_;
  std::optional<light::Day> asked_day_;      // sky being computed
  std::optional<light::Daylight> daylight_;  // displayed physical sky
  light::EnvironmentPtr environment_;        // newest
  EnvironmentSettings environment_settings_;
  GroundSettings ground_;
  bool shows_sky_ = true;
  scene::Part<light::DistantLights> lights_;
  scene::Part<light::Surroundings> surroundings_;
  light::AnalyticLights analytic_lights_;  // set by the host, in world space
  scene::Part<light::AnalyticLights> relative_lights_;
  std::optional<glm::dvec3> lights_origin_ = glm::dvec3(0.0);  // of relative_lights_; nullopt: they are outdated
};

}  // namespace cumulet::viewer
