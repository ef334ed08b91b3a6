#pragma once

#include <optional>
#include <scene_file.hpp>
#include <string>

#include "recovery_file.hpp"

namespace cumulet::demo {

/// The changes of the scene that no scene file has. While there are some, a copy of the scene is kept in a recovery
/// file. Orbiting, panning and dollying are no changes, but the recovery file has the current camera.
class UnsavedChanges {
 public:
  /// folder: of the recovery file; "": none. interval: seconds between two copies.
  UnsavedChanges(const std::string& folder, double interval) : recovery_(folder), interval_(interval) {}

  /// The scene is an opened one, and has no changes when it is loaded.
  void reset() { saved_.reset(); }
  /// The scene has the changes since `scene`, or none.
  void reset(const SceneOptions& scene) { saved_ = scene; }
  /// Compares the scene with the saved one. loads: files are still loading. now: in seconds.
  void follow(const SceneOptions& scene, bool loads, double now);
  [[nodiscard]] bool any() const { return due_.has_value(); }

  /// Returns the time of the next copy; nullopt if there are no changes.
  [[nodiscard]] const std::optional<double>& due() const { return due_; }
  /// Writes the copy if it is due. Throws std::runtime_error, one line.
  void autosave(const SceneOptions& scene, const std::string& scene_path, double now);
  [[nodiscard]] RecoveryFile& recovery() { return recovery_; }

 private:
  RecoveryFile recovery_;
  double interval_;
  std::optional<SceneOptions> saved_;   // nullopt: the scene is loading
  std::optional<SceneOptions> copied_;  // scene in the recovery file
  std::optional<double> due_;           // time of the next copy; nullopt: there are no changes
};

}  // namespace cumulet::demo
