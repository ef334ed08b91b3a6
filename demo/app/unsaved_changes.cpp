#include "unsaved_changes.hpp"

#include <algorithm>

namespace cumulet::demo {
namespace {

/// Copies the parts of a camera that navigation changes.
void copy_view(const SceneCamera& from, SceneCamera& to) {
  std::ranges::copy(from.camera.eye, to.camera.eye);
  std::ranges::copy(from.camera.target, to.camera.target);
  std::ranges::copy(from.camera.up, to.camera.up);
  if (from.camera.orthographic_height > 0.0 && to.camera.orthographic_height > 0.0)
    to.camera.orthographic_height = from.camera.orthographic_height;
  // A moved camera has no shutter poses.
  to.camera_open = from.camera_open;
  to.camera_close = from.camera_close;
}

bool differs(const SceneOptions& saved, SceneOptions scene) {
  copy_view(saved, scene);
  return !same_scene(saved, scene);
}

}  // namespace

void UnsavedChanges::take_program_change(const SceneOptions& before, const SceneOptions& after) {
  if (!differs(saved_, before)) saved_ = after;
}

void UnsavedChanges::follow(const SceneOptions& scene, double now) {
  if (differs(saved_, scene)) {
    if (!due_) due_ = now + interval_;
    return;
  }
  if (!due_) return;
  due_.reset();
  copied_.reset();
  recovery_.remove();
}

void UnsavedChanges::autosave(const SceneOptions& scene, const std::string& scene_path, double now) {
  if (!due_ || now < *due_) return;
  due_ = now + interval_;
  if (copied_ && same_scene(*copied_, scene)) return;
  copied_ = scene;
  recovery_.write(scene, scene_path);
}

}  // namespace cumulet::demo
