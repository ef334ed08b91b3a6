#pragma once

#include <chrono>
#include <glm/glm.hpp>
#include <memory>
#include <optional>

#include "assets/camera.hpp"
#include "scene/snapshot.hpp"
#include "stage/navigation.hpp"
#include "stage/stage_host.hpp"
#include "surface/scene.hpp"

namespace cumulet::viewer {

/// The camera and its navigation, the camera of the previous frame, and the views of frames. Functions are called on
/// the host's thread. Functions that change settings have the contract of those of Viewer with the same name.
class CameraStage {
 public:
  /// host: outlives the stage.
  explicit CameraStage(StageHost& host) : host_(host) {}

  void set_camera(std::shared_ptr<Camera> camera);
  [[nodiscard]] const std::shared_ptr<Camera>& camera() const { return camera_; }
  void set_previous_camera(std::shared_ptr<Camera> camera, double seconds);
  void set_navigation(const NavigationSettings& settings);
  /// 0: views do not change while the shutter is open.
  void set_shutter(double seconds) { shutter_seconds_ = seconds; }
  /// subject: the objects to fit the camera to; nullopt: there are none.
  bool input(const InputEvent& event, const std::optional<Subject>& subject);
  /// Moves the camera until the subject fills the image.
  void fit(const Subject& subject);
  /// Copies a camera of a model. box: bounds of the scene; nullopt: it is empty.
  void copy(const surface::SceneCamera& other, const std::optional<Bounds>& box);

  /// Moves the camera as navigation has since the last frame. box: bounds of the scene; nullopt: it is empty.
  void advance(const std::optional<Bounds>& box);
  /// Begins a frame, which has no view yet. size: of its image, in pixels.
  void begin_frame(const glm::uvec2& size);
  /// Set the views of the frame, whose size is not 0.
  void set_view(const std::optional<Subject>& subject);
  void set_previous_view(const std::optional<Subject>& subject);
  /// Marks the frame as traced.
  void note_traced();
  /// True if the camera moves by itself, so that frames are needed without other changes.
  [[nodiscard]] bool moves() const { return navigation_.moving(); }
  /// True if the user is dragging the camera.
  [[nodiscard]] bool is_dragged() const { return navigation_.dragging(); }

  /// Image size of the last frame.
  [[nodiscard]] const glm::uvec2& size() const { return size_; }
  /// View of the last frame; nullopt: nothing is rendered.
  [[nodiscard]] const std::optional<ViewFrame>& view() const { return view_; }
  [[nodiscard]] std::optional<glm::dvec3> eye() const;
  /// True if it equals the view of the last traced frame before.
  [[nodiscard]] bool rests() const { return view_ == last_view_; }
  /// Views at both ends of the shutter interval; nullopt: the camera does not move.
  [[nodiscard]] std::optional<scene::ViewEnds> view_ends() const;
  /// View of the previous camera; nullopt: the camera has not moved.
  [[nodiscard]] const std::optional<ViewFrame>& previous_view() const { return previous_view_; }
  /// Time between the previous frame and this one.
  [[nodiscard]] double previous_seconds() const { return previous_seconds_; }

 private:
  // Width over height of the last frame, which is not empty.
  [[nodiscard]] double aspect() const { return double(size_.x) / size_.y; }

  StageHost& host_;
  std::shared_ptr<Camera> camera_;
  std::shared_ptr<void> listener_;
  Navigation navigation_;
  std::chrono::steady_clock::time_point last_time_{};  // of the last advance()
  double shutter_seconds_ = 0.0;
  std::shared_ptr<Camera> previous_camera_;
  std::shared_ptr<void> previous_listener_;
  double previous_seconds_ = 0.0;
  glm::uvec2 size_{0U};
  std::optional<ViewFrame> view_;
  std::optional<ViewFrame> previous_view_;
  std::optional<ViewFrame> traced_view_;  // of the last traced frame
  std::optional<ViewFrame> last_view_;    // of the traced frame before it
};

}  // namespace cumulet::viewer
