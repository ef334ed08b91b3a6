#include "stage/camera_stage.hpp"

#include <algorithm>
#include <utility>

namespace cumulet::viewer {

using glm::dvec3;

void CameraStage::set_camera(std::shared_ptr<Camera> camera) {
  listener_.reset();
  camera_ = std::move(camera);
  listener_ = camera_->listen([host = &host_] { host->notify(); });
  host_.touch();
}

void CameraStage::set_previous_camera(std::shared_ptr<Camera> camera, double seconds) {
  previous_listener_.reset();
  previous_camera_ = std::move(camera);
  if (previous_camera_) previous_listener_ = previous_camera_->listen([host = &host_] { host->notify(); });
  previous_seconds_ = seconds;
  host_.touch();
}

void CameraStage::set_navigation(const NavigationSettings& settings) {
  navigation_.set(settings);
  host_.touch();
}

bool CameraStage::input(const InputEvent& event, const std::optional<Subject>& subject) {
  const bool handled = navigation_.input(event, *camera_, size_.x, size_.y, subject);
  if (navigation_.moving()) host_.notify();
  return handled;
}

void CameraStage::fit(const Subject& subject) { camera_->fit(subject, size_.y > 0 ? aspect() : 1.0); }

void CameraStage::copy(const surface::SceneCamera& other, const std::optional<Bounds>& box) {
  const dvec3 eye(other.to_world[3]);
  const dvec3 forward = -glm::normalize(dvec3(other.to_world[2]));
  CameraPose pose = camera_->pose();
  pose.eye = eye;
  // The target for orbits is as far away as the middle of the scene.
  double distance = 1.0;
  if (box) {
    distance =
        std::max(glm::dot(0.5 * (box->min + box->max) - eye, forward), 1e-3 * glm::length(box->max - box->min) + 1e-12);
  }
  pose.target = eye + forward * distance;
  pose.up = glm::normalize(dvec3(other.to_world[1]));
  pose.orthographic_height = other.orthographic ? other.height : 0.0;
  if (!other.orthographic) pose.fovy_degrees = glm::degrees(other.vertical_fov);
  pose.near_plane = other.near_plane;
  pose.far_plane = other.far_plane;
  camera_->set(pose);
}

void CameraStage::advance(const std::optional<Bounds>& box) {
  const auto now = std::chrono::steady_clock::now();
  const double since = std::chrono::duration<double>(now - std::exchange(last_time_, now)).count();
  navigation_.advance(std::min(since, 0.25), *camera_, box);
}

void CameraStage::begin_frame(const glm::uvec2& size) {
  size_ = size;
  view_.reset();
  previous_view_.reset();
}

void CameraStage::set_view(const std::optional<Subject>& subject) { view_ = camera_->view(aspect(), subject); }

void CameraStage::set_previous_view(const std::optional<Subject>& subject) {
  if (previous_camera_) previous_view_ = previous_camera_->view(aspect(), subject);
}

void CameraStage::note_traced() { last_view_ = std::exchange(traced_view_, view_); }

std::optional<dvec3> CameraStage::eye() const { return view_ ? std::optional(view_->eye) : std::nullopt; }

std::optional<scene::ViewEnds> CameraStage::view_ends() const {
  return view_ && shutter_seconds_ > 0.0 ? camera_->ends(aspect(), *view_) : std::nullopt;
}

}  // namespace cumulet::viewer
