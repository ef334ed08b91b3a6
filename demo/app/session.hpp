#pragma once

#include <cumulet/cumulet.h>

#include <functional>
#include <image.hpp>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "model.hpp"

namespace cumulet::demo {

/// A cumulet viewer that follows a model. Needs the GL context current throughout, as all of it runs in one thread.
class Session {
 public:
  /// wake is called from any thread when there is something new to draw. Throws std::runtime_error.
  Session(cumulet_get_proc_fn get_proc, void* get_proc_user, std::function<void()> wake);
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;
  ~Session() = default;

  /// Hands the viewer what has changed in the model since the last time. While a control is held, the grid's settings
  /// wait until the worker is free, so that it is not restarted with every pixel of a drag.
  void follow(Model& model, bool held);
  /// One frame into framebuffer 0; then the model's status is the newest, and its camera where input has moved it.
  void render(Model& model, const cumulet_frame_desc& frame);

  /// A new volume will be framed once it is there: its camera does not come from a scene file.
  void fit_next() { fit_ = true; }
  /// The volume is loaded again, though it is the same.
  void reload();
  /// Whether something is still to come of itself: a load, or the camera's first place.
  [[nodiscard]] bool waiting() const { return waiting_; }
  /// Whether the last frame moved the camera, by whatever.
  [[nodiscard]] bool camera_moved() const { return camera_moved_; }

  void cancel() { cumulet_cancel(viewer_.get()); }
  void frame_all(Model& model);
  /// Whether it meant something to the camera.
  bool input(const cumulet_event& event);
  void orbit(double yaw, double pitch);
  void dolly(double factor);

  /// As it is displayed, but as linear values that the sRGB curve takes back to the same bytes.
  [[nodiscard]] image::Image read_display(const Model& model);
  /// The picture in linear radiance with its layers, as docs/aovs.md says; debug views have none.
  void write_exr(const Model& model, const std::string& path);
  /// Measures it for the model's status.
  void measure_noise(Model& model);

 private:
  struct DestroyViewer {
    void operator()(cumulet_viewer* viewer) const { cumulet_destroy(viewer); }
  };
  struct ReleaseCamera {
    void operator()(cumulet_camera* camera) const { cumulet_camera_release(camera); }
  };
  struct Shared {  // with the callbacks, from any thread
    std::function<void()> wake;
    std::mutex mutex;
    std::vector<std::string> warnings;
  };

  static void on_log(void* user, cumulet_log_level level, const char* message);
  static void on_update(void* user);

  /// Tells a failed call in the message bar.
  bool check(Model& model, cumulet_status status);
  void follow_volume(Model& model);
  void follow_surfaces(Model& model);
  void finish_surfaces(Model& model);
  // What the library says of those it shows.
  void read_surfaces(Model& model);
  void finish_load(Model& model);
  void set_camera(Model& model);

  std::unique_ptr<Shared> shared_;
  std::unique_ptr<cumulet_viewer, DestroyViewer> viewer_;
  std::unique_ptr<cumulet_camera, ReleaseCamera> camera_;
  std::optional<SceneOptions> known_;  // what the viewer was given last
  cumulet_navigation_desc navigation_{};
  cumulet_camera_desc seen_{};  // the viewer's camera
  std::string shown_volume_, shown_grid_, shown_surfaces_;
  bool waiting_for_surfaces_ = false;
  bool waiting_ = false;
  bool fit_ = false;
  bool camera_moved_ = false;
};

/// Adds a line to the message bar, in place of an equal one. Errors stay, others go after a while.
void tell(Model& model, bool error, const std::string& text, double now);

}  // namespace cumulet::demo
