#pragma once

#include <cstddef>
#include <optional>
#include <scene_file.hpp>
#include <string>
#include <vector>

namespace cumulet::demo {

/// Undo and redo of complete scenes: settings, camera and volume.
class History {
 public:
  explicit History(const SceneOptions& scene) : states_{scene} {}

  /// Records the current scene. held: the user is still dragging a control or moving the camera; the whole change
  /// becomes one step. The initial camera fit by the library is not a step.
  void offer(const SceneOptions& scene, bool held);
  /// Returns the scene before the last step. Changes since then become a step first.
  [[nodiscard]] std::optional<SceneOptions> undo(const SceneOptions& scene);
  [[nodiscard]] std::optional<SceneOptions> redo(const SceneOptions& scene);

  [[nodiscard]] bool can_undo(const SceneOptions& scene) const;
  [[nodiscard]] bool can_redo() const { return now_ + 1 < states_.size(); }
  /// Returns the name of the step that undo would revert, and of the step that redo would repeat; nullopt if there is
  /// none.
  [[nodiscard]] std::optional<std::string> undo_name(const SceneOptions& scene) const;
  [[nodiscard]] std::optional<std::string> redo_name() const;
  [[nodiscard]] const SceneOptions& current() const { return states_[now_]; }
  /// Number of steps that can be undone.
  [[nodiscard]] std::size_t depth() const { return now_; }

 private:
  static constexpr std::size_t most_ = 256;
  std::vector<SceneOptions> states_;
  std::size_t now_ = 0;
};

/// Returns a name for the change between two scenes: the label of a setting, "Open cloud.vdb", "Add light"; "Change"
/// for all others.
[[nodiscard]] std::string change_name(const SceneOptions& before, const SceneOptions& after);

/// Returns true if the library still has to fit the camera.
[[nodiscard]] bool needs_fit(const cumulet_camera_desc& camera);

}  // namespace cumulet::demo
