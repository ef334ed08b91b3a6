#include "history.hpp"

#include <algorithm>

namespace cumulet::demo {

bool needs_fit(const cumulet_camera_desc& camera) { return std::equal(camera.eye, camera.eye + 3, camera.target); }

void History::offer(const SceneOptions& scene, bool held) {
  SceneOptions& now = states_[now_];
  if (needs_fit(now.camera) && !needs_fit(scene.camera)) now.camera = scene.camera;
  if (held || same_scene(scene, now)) return;
  states_.resize(now_ + 1);
  states_.push_back(scene);
  if (states_.size() > most_) states_.erase(states_.begin());
  now_ = states_.size() - 1;
}

std::optional<SceneOptions> History::undo(const SceneOptions& scene) {
  offer(scene, false);
  if (now_ == 0) return std::nullopt;
  return states_[--now_];
}

std::optional<SceneOptions> History::redo(const SceneOptions& scene) {
  offer(scene, false);
  if (!can_redo()) return std::nullopt;
  return states_[++now_];
}

std::optional<std::string> History::undo_name(const SceneOptions& scene) const {
  if (!same_scene(scene, states_[now_])) return change_name(states_[now_], scene);
  if (now_ == 0) return std::nullopt;
  return change_name(states_[now_ - 1], states_[now_]);
}

std::optional<std::string> History::redo_name() const {
  if (!can_redo()) return std::nullopt;
  return change_name(states_[now_], states_[now_ + 1]);
}

bool History::can_undo(const SceneOptions& scene) const { return now_ > 0 || !same_scene(scene, states_[now_]); }

}  // namespace cumulet::demo
