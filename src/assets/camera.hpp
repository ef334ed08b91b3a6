#pragma once

#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <memory>
#include <mutex>
#include <optional>

#include "assets/subject.hpp"
#include "base/listeners.hpp"
#include "scene/snapshot.hpp"

namespace cumulet::viewer {

enum class DepthConvention { standard = 0, reversed = 1 };
enum class ClipDepth { negative_one_to_one = 0, zero_to_one = 1 };
enum class AxisView { front, back, right, left, top, bottom };

/// cumulet_camera_desc with its defaults filled in.
struct CameraPose {
  glm::dvec3 eye{0.0};
  glm::dvec3 target{0.0};  // eye == target: fit the subject
  glm::dvec3 up{0.0, 1.0, 0.0};
  double fovy_degrees = 40.0;
  double orthographic_height = 0.0;  // 0: perspective
  double near_plane = 0.0;           // 0: the default, see cumulet.h
  double far_plane = 0.0;            // 0: the default
  DepthConvention depth = DepthConvention::standard;
  double lens_radius = 0.0;     // 0: a pinhole
  double focus_distance = 0.0;  // 0: at the target
  bool operator==(const CameraPose&) const = default;
};

/// The view of one image and the host's depth convention: a depth buffer holds depth_a + depth_b / z for perspective,
/// or depth_a + depth_b z for orthographic.
struct ViewFrame : scene::Viewpoint {
  double depth_a = 1.0;
  double depth_b = -0.1;
  bool operator==(const ViewFrame&) const = default;
};

/// A camera that viewers may share: every call locks. Operations are as in cumulet.h; arguments must be finite.
///
/// After set_matrices() an operation continues from the pose nearest to the matrices. An operation whose result exceeds
/// double precision throws Error(invalid_argument) and changes nothing. While the camera waits for bounds to fit,
/// operations other than frame, fit and toggle_orthographic have no effect.
class Camera {
 public:
  explicit Camera(const CameraPose& pose = {}) : pose_(pose) {}

  void set(const CameraPose& pose);
  [[nodiscard]] CameraPose pose() const;
  /// Throws Error(invalid_argument) if the matrices are not a view and a projection. An orthographic view looks along
  /// -z of eye space, a perspective view in the direction of growing w. Signs in the projection may mirror the image.
  void set_matrices(const glm::dmat4& view, const glm::dmat4& projection, ClipDepth clip);
  /// Matrices set by the host are returned unchanged for any aspect ratio, except for the clip depth range.
  void matrices(double aspect, ClipDepth clip, glm::dmat4& view, glm::dmat4& projection) const;

  /// Sets the poses at shutter open and shutter close; nullopt: the current pose. They apply until the camera changes.
  void set_shutter(const std::optional<CameraPose>& open, const std::optional<CameraPose>& close);
  /// Returns the views at both ends of the shutter interval for this aspect ratio. now: the result of view(). Returns
  /// nullopt if the camera does not move.
  [[nodiscard]] std::optional<scene::ViewEnds> ends(double aspect, const scene::Viewpoint& now) const;

  /// Rotates about the pose's up axis and stops just short of it. Angles are in radians. yaw: counter-clockwise as seen
  /// from above (an eye on +Z moves towards +X; a view along -Z turns towards -X). pitch: raises the eye (orbit) or the
  /// view direction (look).
  void orbit(double yaw, double pitch);
  void look(double yaw, double pitch);
  /// Rolls the camera clockwise as seen from behind it; the image turns counter-clockwise.
  void roll(double angle);
  void pan(double right, double up);
  /// factor > 0. The distance is kept within 1e-12 (and double resolution at the target) and 1e12, unless it was
  /// outside before. An orthographic height follows the distance.
  void dolly(double factor);
  /// Like dolly(), but an orthographic eye does not move; otherwise its near plane would cut into the scene.
  void zoom(double factor);
  void fly(double right, double up, double forward);
  /// Moves the camera until the box just fills the image. The direction is kept; a waiting camera has a default
  /// direction.
  void frame(const Bounds& box, double aspect);
  /// Moves the camera to fit the visible part of the subject, with a margin of 6 % of the image's shorter side.
  void fit(const Subject& subject, double aspect);
  /// Looks at the target from one side at the same distance; the axis nearest to up becomes up. If it is +Y, front is
  /// +Z and right is +X; if it is +Z, front is -Y.
  void look_from(AxisView side);
  /// Switches between perspective and orthographic with the same size at the target. An orthographic eye moves back
  /// until the bounds are in front of it from any orbit position.
  void toggle_orthographic(const std::optional<Bounds>& bounds);

  /// Returns the view for an image of this aspect ratio. A pose with eye == target is first replaced permanently by one
  /// that fits the subject. Without a subject it looks at the origin from +Z.
  [[nodiscard]] ViewFrame view(double aspect, const std::optional<Subject>& subject);
  /// Counts changes. Setting an equal value is not a change.
  [[nodiscard]] std::uint64_t revision() const;
  /// Calls `changed` after every change, on the thread that made it, until the token is released. Its release waits for
  /// a running call. `changed` must not change a camera and must not throw.
  [[nodiscard]] std::shared_ptr<void> listen(std::function<void()> changed) {
    return listeners_.listen(std::move(changed));
  }

 private:
  /// Locks the camera; the destructor unlocks it and notifies the listeners of a change.
  class Edit {
   public:
    explicit Edit(Camera& camera) : camera_(camera), lock_(camera.mutex_), before_(camera.revision_) {}
    ~Edit();
    Edit(const Edit&) = delete;
    Edit& operator=(const Edit&) = delete;

   private:
    Camera& camera_;
    std::unique_lock<std::mutex> lock_;
    std::uint64_t before_;
  };
  struct Matrices {
    glm::dmat4 view{1.0};
    glm::dmat4 projection{1.0};
    ClipDepth clip = ClipDepth::negative_one_to_one;
    bool operator==(const Matrices&) const = default;
  };

  [[nodiscard]] bool waits_for_bounds() const { return pose_.eye == pose_.target; }
  void change(const CameraPose& pose);
  void scale(double factor, bool keep_orthographic_eye);
  void frame(const Subject& subject, double aspect, double margin);

  struct Shutter {
    std::optional<CameraPose> open;
    std::optional<CameraPose> close;
    std::uint64_t revision = 0;  // camera revision to which it applies
  };

  mutable std::mutex mutex_;
  std::optional<Shutter> shutter_;
  [[nodiscard]] bool shutter_holds() const { return shutter_ && shutter_->revision == revision_; }
  CameraPose pose_;                   // with matrices_: the pose nearest to them
  std::optional<Matrices> matrices_;  // set by the host; reset by an operation
  ViewFrame matrices_frame_;          // frame of matrices_
  CameraPose own_;                    // the last pose not derived from matrices; it has the target
  std::uint64_t revision_ = 1;
  Listeners listeners_;
};

}  // namespace cumulet::viewer
