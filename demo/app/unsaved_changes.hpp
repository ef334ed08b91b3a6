#pragma once

#include <optional>
#include <scene_file.hpp>
#include <string>
#include <utility>

#include "recovery_file.hpp"

namespace cumulet::demo {

/// The changes of the scene that no scene file has. While there are some, a copy of the scene is kept in a recovery
/// file. Orbiting, panning and dollying are no changes, but the recovery file has the current camera.
class UnsavedChanges {
 public:
  /// folder: of the recovery file; "": none. interval: seconds between two copies. scene: the current scene.
  UnsavedChanges(const std::string& folder, double interval, SceneOptions scene)
      : recovery_(folder), interval_(interval), saved_(std::move(scene)) {}

  /// The scene has the changes since `saved`.
  void reset(const SceneOptions& saved) { saved_ = saved; }
  /// The program itself has changed the scene, for example because a file has been loaded. That is no unsaved change
  /// unless the user has changed the scene before.
  void take_program_change(const SceneOptions& before, const SceneOptions& after);
  /// Compares the scene with the saved one. now: in seconds.
  void follow(const SceneOptions& scene, double now);
  [[nodiscard]] bool any() const { return due_.has_value(); }

  /// Returns the time of the next copy; nullopt if there are no changes.
  [[nodiscard]] const std::optional<double>& due() const { return due_; }
  /// Writes the copy if it is due. Throws std::runtime_error, one line.
  void autosave(const SceneOptions& scene, const std::string& scene_path, double now);
  [[nodiscard]] RecoveryFile& recovery() { return recovery_; }

 private:
  RecoveryFile recovery_;
  double interval_;
  SceneOptions saved_;
  std::optional<SceneOptions> copied_;  // scene in the recovery file
  std::optional<double> due_;           // time of the next copy; nullopt: there are no changes
};

}  // namespace cumulet::demo
