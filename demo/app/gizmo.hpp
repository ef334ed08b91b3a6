#pragma once

#include <cumulet/cumulet.h>

#include <array>
#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "replay.hpp"

// What the handles in the picture are made of, without a window: where they are in it, which one a pointer is at, and
// what a drag of it makes of a thing's place. All in doubles; pixels have y down.

namespace cumulet::demo {

struct Ray {
  glm::dvec3 origin;
  glm::dvec3 direction;  // unit
};

/// Where along an axis (unit) from a point a ray passes nearest. Nothing where they run alike, or where that is not
/// before the ray's origin.
[[nodiscard]] std::optional<double> nearest_on_axis(const Ray& ray, const glm::dvec3& point, const glm::dvec3& axis);
/// Where a ray meets a plane; nothing where it grazes it, or where that is not before the ray's origin.
[[nodiscard]] std::optional<glm::dvec3> plane_hit(const Ray& ray, const glm::dvec3& point, const glm::dvec3& normal);
/// The turn about an axis (unit) from one direction to another, as seen along the axis; radians, right-handed.
[[nodiscard]] double angle_about(const glm::dvec3& axis, const glm::dvec3& from, const glm::dvec3& to);
/// 1, 2 or 5 times a power of ten, the largest that is no more than this.
[[nodiscard]] double round_step(double most);

/// How a camera sees the world in a rectangle of the window.
class Sight {
 public:
  /// Of a camera that is placed; the rectangle is not empty.
  Sight(const cumulet_camera_desc& camera, const Rectangle& place);

  /// Nothing behind the eye, or right before it.
  [[nodiscard]] std::optional<glm::dvec2> project(const glm::dvec3& point) const;
  /// As much of a segment as is before the eye.
  [[nodiscard]] std::optional<std::array<glm::dvec2, 2>> project(const glm::dvec3& a, const glm::dvec3& b) const;
  [[nodiscard]] Ray ray(const glm::dvec2& pixel) const;
  /// The length in the world that a pixel is there.
  [[nodiscard]] double pixel_at(const glm::dvec3& point) const;
  /// Unit, from there to the eye.
  [[nodiscard]] glm::dvec3 to_eye(const glm::dvec3& point) const;
  /// Unit, where the camera looks.
  [[nodiscard]] glm::dvec3 forward() const;

 private:
  [[nodiscard]] glm::dvec3 in_eye_space(const glm::dvec3& point) const;
  [[nodiscard]] glm::dvec2 pixel_of(const glm::dvec3& in_eye_space) const;

  glm::dmat4 to_eye_{1.0};
  glm::dmat4 to_world_{1.0};
  glm::dmat4 projection_{1.0};
  bool perspective_ = true;
  double nearest_ = 0.0;  // depth that is still shown, of a perspective
  Rectangle place_;
};

enum class Tool { none, move, rotate, scale };
enum class Axes { world, local };
/// Those of an axis, those of the plane across it, and the one that is of no axis: it moves in the picture's plane,
/// turns about the sight, or scales all alike.
enum class Handle { x, y, z, yz, zx, xy, free };

[[nodiscard]] constexpr bool is_axis(Handle handle) { return handle <= Handle::z; }
[[nodiscard]] constexpr bool is_plane(Handle handle) { return Handle::yz <= handle && handle <= Handle::xy; }
/// Its axis, or the one across its plane; not of the free one.
[[nodiscard]] constexpr int axis_of(Handle handle) { return static_cast<int>(handle) % 3; }

/// Handles about a point. They are as large on the screen wherever it is.
struct Gizmo {
  Tool tool = Tool::none;
  glm::dvec3 pivot{};
  glm::dmat3 axes{1.0};  // unit
  double reach = 0.0;    // of an axis, pixels
};

/// The handles of a thing that stands at a place, about a point of the world. Things are scaled along their own axes.
[[nodiscard]] Gizmo gizmo_of(Tool tool, Axes axes, const glm::dmat4& place, const glm::dvec3& pivot, double reach);

/// What there is of a handle to see and to grasp, in pixels: a line from the pivot, an outline of a square, an arc, or
/// for the free one a circle. Empty where it is seen so much from its end or edge that a drag would say little.
[[nodiscard]] std::vector<glm::dvec2> shape_of(const Gizmo& gizmo, Handle handle, const Sight& sight);
[[nodiscard]] bool is_closed(const Gizmo& gizmo, Handle handle);
/// The one that is at a pixel, or within so many of it.
[[nodiscard]] std::optional<Handle> handle_at(const Gizmo& gizmo, const Sight& sight, const glm::dvec2& pixel,
                                              double tolerance);

/// A handle that is dragged.
class Drag {
 public:
  Drag(const Gizmo& gizmo, Handle handle, const Sight& sight, const glm::dvec2& from);

  /// What has become of the world about the thing since the drag began, affine and never flat. Where the pointer says
  /// nothing (its ray misses the plane, or passes the axis behind the eye), that is what it was before. snapped: by
  /// steps, of a round length about a tenth of a handle's, of 15 degrees, of a tenth.
  glm::dmat4 to(const Sight& sight, const glm::dvec2& pixel, bool snapped);
  /// What that is, in words: "X 1.25", "30.0°", "1.50 x".
  [[nodiscard]] std::string told() const;
  [[nodiscard]] Handle handle() const { return handle_; }

 private:
  // Its place along the axis, or where it meets the handle's plane, from the pivot where the drag began.
  [[nodiscard]] std::optional<glm::dvec3> grasp(const Sight& sight, const glm::dvec2& pixel) const;
  void follow(const Sight& sight, const glm::dvec2& pixel);
  void turn(const Sight& sight, const glm::dvec2& pixel);
  void stretch(const Sight& sight, const glm::dvec2& pixel);
  [[nodiscard]] glm::dvec3 snapped_move() const;
  [[nodiscard]] glm::dmat4 change() const;

  Gizmo begun_;
  Handle handle_;
  glm::dvec2 from_;
  glm::dvec3 normal_{};                // of the plane that the pointer is on, or the axis that it turns about
  std::optional<glm::dvec3> grasp_;    // from the pivot, where the drag began, or for a turn where it is now
  std::optional<glm::dvec2> tangent_;  // of a ring that is seen from its edge: radians a pixel
  double step_ = 0.0;                  // of moves that snap
  bool snapped_ = false;
  // What it came to; of these one is what the tool changes.
  glm::dvec3 move_{0.0};
  double angle_ = 0.0;
  glm::dvec3 stretch_{1.0};
};

}  // namespace cumulet::demo
