#pragma once

#include <cumulet/cumulet.h>

#include <array>
#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "replay.hpp"

// Geometry of the transform handles, without a window: their shapes, hit testing and the transform that a drag
// produces. All values are doubles; pixels have y down.

namespace cumulet::demo {

struct Ray {
  glm::dvec3 origin;
  glm::dvec3 direction;  // unit vector
};

/// Returns the parameter of the point on an axis (unit vector through `point`) that is nearest to a ray. Returns
/// nullopt if they are parallel, or if the point on the ray is behind its origin.
[[nodiscard]] std::optional<double> nearest_on_axis(const Ray& ray, const glm::dvec3& point, const glm::dvec3& axis);
/// Intersects a ray with a plane. Returns nullopt if the ray is parallel to it, or if the hit is behind the ray's
/// origin.
[[nodiscard]] std::optional<glm::dvec3> plane_hit(const Ray& ray, const glm::dvec3& point, const glm::dvec3& normal);
/// Returns the signed angle about an axis (unit vector) between two directions; radians, right-handed.
[[nodiscard]] double angle_about(const glm::dvec3& axis, const glm::dvec3& from, const glm::dvec3& to);
/// Returns the largest 1, 2 or 5 times a power of ten that does not exceed `most`.
[[nodiscard]] double round_step(double most);

/// Projection of a camera to a rectangle of the window.
class Sight {
 public:
  /// The camera must have a position, and the rectangle must not be empty.
  Sight(const cumulet_camera_desc& camera, const Rectangle& area);

  /// Returns nullopt for points behind the near limit.
  [[nodiscard]] std::optional<glm::dvec2> project(const glm::dvec3& point) const;
  /// Projects the part of a segment in front of the near limit; nullopt if there is none.
  [[nodiscard]] std::optional<std::array<glm::dvec2, 2>> project(const glm::dvec3& a, const glm::dvec3& b) const;
  [[nodiscard]] Ray ray(const glm::dvec2& pixel) const;
  /// Returns the world-space size of a pixel at a point.
  [[nodiscard]] double pixel_at(const glm::dvec3& point) const;
  /// Unit vector from a point to the eye.
  [[nodiscard]] glm::dvec3 to_eye(const glm::dvec3& point) const;
  /// Unit vector of the viewing direction.
  [[nodiscard]] glm::dvec3 forward() const;

 private:
  [[nodiscard]] glm::dvec3 in_eye_space(const glm::dvec3& point) const;
  [[nodiscard]] glm::dvec2 pixel_of(const glm::dvec3& in_eye_space) const;

  glm::dmat4 to_eye_{1.0};
  glm::dmat4 to_world_{1.0};
  glm::dmat4 projection_{1.0};
  bool perspective_ = true;
  double nearest_ = 0.0;  // near limit, a depth; for a perspective camera
  Rectangle area_;
};

enum class Tool { none, move, rotate, scale };
enum class Axes { world, local };
/// Three axes, three planes (perpendicular to an axis), and the free handle. The free handle moves in the image plane,
/// rotates about the viewing direction, or scales uniformly.
enum class Handle { x, y, z, yz, zx, xy, free };

[[nodiscard]] constexpr bool is_axis(Handle handle) { return handle <= Handle::z; }
[[nodiscard]] constexpr bool is_plane(Handle handle) { return Handle::yz <= handle && handle <= Handle::xy; }
/// Returns the handle's axis, or the normal of its plane. Not for the free handle.
[[nodiscard]] constexpr int axis_of(Handle handle) { return static_cast<int>(handle) % 3; }

/// A set of handles around a point. Their size on the screen is constant.
struct Gizmo {
  Tool tool = Tool::none;
  glm::dvec3 pivot{};
  glm::dmat3 axes{1.0};  // unit vectors
  double reach = 0.0;    // length of an axis in pixels
};

/// Returns the handles for an object with this transform, centered at a world-space point. Scaling always uses
/// the object's own axes.
[[nodiscard]] Gizmo gizmo_of(Tool tool, Axes axes, const glm::dmat4& transform, const glm::dvec3& pivot, double reach);

/// Returns the shape of a handle in pixels: a line from the pivot, the outline of a square, an arc, or a circle for the
/// free handle. Returns an empty shape if the handle is seen so much from its end or edge that dragging would be
/// imprecise.
[[nodiscard]] std::vector<glm::dvec2> shape_of(const Gizmo& gizmo, Handle handle, const Sight& sight);
[[nodiscard]] bool is_closed(const Gizmo& gizmo, Handle handle);
/// Returns the handle at a pixel, with a tolerance in pixels.
[[nodiscard]] std::optional<Handle> handle_at(const Gizmo& gizmo, const Sight& sight, const glm::dvec2& pixel,
                                              double tolerance);

/// A drag of a handle.
class Drag {
 public:
  Drag(const Gizmo& gizmo, Handle handle, const Sight& sight, const glm::dvec2& from);

  /// Returns the world-space transform since the drag began; affine and invertible. If the pointer gives no position
  /// (its ray misses the plane, or passes the axis behind the eye), returns the previous transform. snapped: in steps
  /// of a round length (about a tenth of a handle), 15 degrees, or 0.1.
  glm::dmat4 to(const Sight& sight, const glm::dvec2& pixel, bool snapped);
  /// Returns the transform as text: "X 1.25", "30.0°", "1.50 x".
  [[nodiscard]] std::string label() const;
  [[nodiscard]] Handle handle() const { return handle_; }

 private:
  // Returns the point on the axis or on the handle's plane, relative to the pivot at the start of the drag.
  [[nodiscard]] std::optional<glm::dvec3> grasp(const Sight& sight, const glm::dvec2& pixel) const;
  void follow(const Sight& sight, const glm::dvec2& pixel);
  void turn(const Sight& sight, const glm::dvec2& pixel);
  void stretch(const Sight& sight, const glm::dvec2& pixel);
  [[nodiscard]] glm::dvec3 snapped_move() const;
  [[nodiscard]] glm::dmat4 change() const;

  Gizmo begun_;
  Handle handle_;
  glm::dvec2 from_;
  glm::dvec3 normal_{};                // normal of the drag plane, which is the axis of a rotation
  std::optional<glm::dvec3> grasp_;    // relative to the pivot: start point of the drag, or current point of a rotation
  std::optional<glm::dvec2> tangent_;  // radians per pixel; set for a ring that is seen from its edge
  double step_ = 0.0;                  // step of snapped moves
  bool snapped_ = false;
  // Current result. The tool changes only one of these.
  glm::dvec3 move_{0.0};
  double angle_ = 0.0;
  glm::dvec3 stretch_{1.0};
};

}  // namespace cumulet::demo
