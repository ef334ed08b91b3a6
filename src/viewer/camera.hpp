#pragma once

#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <memory>
#include <mutex>
#include <optional>

#include "base/listeners.hpp"
#include "scene/snapshot.hpp"
#include "viewer/subject.hpp"

namespace cumulet::viewer {

enum class DepthConvention { standard = 0, reversed = 1 };
enum class ClipDepth { negative_one_to_one = 0, zero_to_one = 1 };
enum class AxisView { front, back, right, left, top, bottom };

/// cumulet_camera_desc, defaults filled in.
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

/// What one picture is seen through, and the host's depth: a depth buffer holds depth_a + depth_b / z, or + depth_b z
/// where orthographic.
struct ViewFrame : scene::Viewpoint {
  double depth_a = 1.0;
  double depth_b = -0.1;
  bool operator==(const ViewFrame&) const = default;
};

/// A camera that viewers may share: every call locks. Operations as in cumulet.h; arguments are finite. An operation
/// goes on from the host's matrices as from the nearest pose, and throws Error(invalid_argument), changing nothing,
/// where it would lead out of what doubles tell apart. A camera that still waits for bounds to fit has nothing to turn
/// about: operations but frame, fit and toggle_orthographic leave it waiting.
class Camera {
 public:
  explicit Camera(const CameraPose& pose = {}) : pose_(pose) {}

  void set(const CameraPose& pose);
  [[nodiscard]] CameraPose pose() const;
  /// Throws Error(invalid_argument) for what is no view or no projection. An orthographic view looks along -z of eye
  /// space; a perspective one to where w grows. Signs of the projection may mirror the picture.
  void set_matrices(const glm::dmat4& view, const glm::dmat4& projection, ClipDepth clip);
  /// The host's own matrices come back as they are, whatever the aspect ratio; but for their clip depth.
  void matrices(double aspect, ClipDepth clip, glm::dmat4& view, glm::dmat4& projection) const;

  /// Where it is as the shutter opens, and as it closes; nothing: where it is. Until it changes.
  void set_shutter(const std::optional<CameraPose>& open, const std::optional<CameraPose>& close);
  /// Likewise, of a picture of this aspect ratio; now: what view() told. Nothing where it stands still.
  [[nodiscard]] std::optional<scene::ViewEnds> ends(double aspect, const scene::Viewpoint& now) const;

  /// Turns about the pose's up and stops just short of it. yaw: anticlockwise as seen from above (an eye on +Z moves
  /// towards +X, a look along -Z turns towards -X); pitch: raises the eye, or the look.
  void orbit(double yaw, double pitch);
  void look(double yaw, double pitch);
  /// Leans clockwise, as seen from behind the camera; the picture turns anticlockwise.
  void roll(double angle);
  void pan(double right, double up);
  /// factor > 0. The distance stays within 1e-12 (and what doubles resolve at the target) and 1e12, unless it was
  /// outside; an orthographic height follows it.
  void dolly(double factor);
  /// As dolly, but an orthographic eye stays where it is: its near plane would come to cut the scene.
  void zoom(double factor);
  void fly(double right, double up, double forward);
  /// Moves until the box just fills the picture; the direction is kept, or is the one of a camera that waited.
  void frame(const Bounds& box, double aspect);
  /// Likewise, of what is seen of the subject, with a margin of 6 % of the picture's shorter side.
  void fit(const Subject& subject, double aspect);
  /// Looks at the target from one side, the distance kept; the axis nearest to up becomes up. Where that is +Y, front
  /// is +Z and right +X; where +Z, front is -Y.
  void look_from(AxisView side);
  /// Perspective to orthographic of the same size at the target, or back. An orthographic eye moves back until the
  /// bounds are in front of it from wherever it may orbit to.
  void toggle_orthographic(const std::optional<Bounds>& bounds);

  /// The frame for a picture of this aspect ratio. A pose that fits the subject (eye == target) is placed first, for
  /// good, where there is one; without any it looks at the origin from +Z.
  [[nodiscard]] ViewFrame view(double aspect, const std::optional<Subject>& subject);
  /// Counts changes; setting what is set already is none.
  [[nodiscard]] std::uint64_t revision() const;
  /// Calls changed after every change, on the thread that made it, until the token is gone; then no call is under way
  /// any more. It must not change a camera, nor throw.
  [[nodiscard]] std::shared_ptr<void> listen(std::function<void()> changed) {
    return listeners_.listen(std::move(changed));
  }

 private:
  /// Locks; on its end unlocks, and tells the listeners of a change.
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
    std::uint64_t revision = 0;  // with which it holds
  };

  mutable std::mutex mutex_;
  std::optional<Shutter> shutter_;
  [[nodiscard]] bool shutter_holds() const { return shutter_ && shutter_->revision == revision_; }
  CameraPose pose_;                   // with matrices_: the nearest to them
  std::optional<Matrices> matrices_;  // the host's, until an operation
  ViewFrame matrices_frame_;          // theirs
  CameraPose own_;                    // the last pose that is not theirs: it knows the target
  std::uint64_t revision_ = 1;
  Listeners listeners_;
};

}  // namespace cumulet::viewer
