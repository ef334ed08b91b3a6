#pragma once

#include <cstddef>
#include <optional>
#include <scene_file.hpp>
#include <vector>

namespace cumulet::demo {

/// Undo and redo over whole scenes: settings, camera and volume.
class History {
 public:
  explicit History(const SceneOptions& scene) : states_{scene} {}

  /// The scene as it is now. While held (a control is dragged, the camera moves) it may still change: what it comes to
  /// is one step. A camera that the library has placed by itself is no step.
  void offer(const SceneOptions& scene, bool held);
  /// The scene before the last step, with whatever has changed since made a step first.
  [[nodiscard]] std::optional<SceneOptions> undo(const SceneOptions& scene);
  [[nodiscard]] std::optional<SceneOptions> redo(const SceneOptions& scene);

  [[nodiscard]] bool can_undo(const SceneOptions& scene) const;
  [[nodiscard]] bool can_redo() const { return now_ + 1 < states_.size(); }
  [[nodiscard]] const SceneOptions& current() const { return states_[now_]; }
  /// Steps that can be undone.
  [[nodiscard]] std::size_t depth() const { return now_; }

 private:
  static constexpr std::size_t most_ = 256;
  std::vector<SceneOptions> states_;
  std::size_t now_ = 0;
};

/// Whether the library is still to place the camera.
[[nodiscard]] bool is_unplaced(const cumulet_camera_desc& camera);

}  // namespace cumulet::demo
