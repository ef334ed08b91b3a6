#include "assets/camera.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/gtc/matrix_access.hpp>
#include <limits>
#include <numbers>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "base/error.hpp"

namespace cumulet::viewer {

namespace {

using glm::dmat3;
using glm::dmat4;
using glm::dvec2;
using glm::dvec3;
using glm::dvec4;

constexpr double pole_margin = 1e-4;  // radians: invisible, and far above the rounding of directions in double
                                      // precision
constexpr double farthest = 1e30;
constexpr double fit_margin = 0.06;      // fraction of the image's shorter side
constexpr double nearest_to_eye = 0.02;  // fraction of the subject's depth

struct Axes {
  dvec3 forward, right, up;
};

Axes axes_of(const CameraPose& pose) {
  const dvec3 forward = glm::normalize(pose.target - pose.eye);
  dvec3 right = glm::cross(forward, pose.up);
  // The view direction is parallel to up: any right axis is valid.
  if (glm::length(right) < 1e-9)
    right = glm::cross(forward, std::abs(forward.x) < 0.9 ? dvec3(1, 0, 0) : dvec3(0, 0, 1));
  right = glm::normalize(right);
  return {forward, right, glm::cross(right, forward)};
}

double tan_half(const CameraPose& pose) { return std::tan(0.5 * (pose.fovy_degrees * std::numbers::pi / 180.0)); }

double distance_of(const CameraPose& pose) { return glm::length(pose.target - pose.eye); }

double height_at_target(const CameraPose& pose) {
  return pose.orthographic_height > 0.0 ? pose.orthographic_height : 2.0 * distance_of(pose) * tan_half(pose);
}

double largest(const dvec3& v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); }

bool in_range(const dvec3& v) { return glm::all(glm::lessThanEqual(glm::abs(v), dvec3(farthest))); }  // false for NaN

double nearest_distance(const dvec3& target) { return std::max(1e-12, 1e-9 * largest(target)); }

/// Returns the view direction of a pose, rotated by yaw about up and raised by pitch.
dvec3 turned(const CameraPose& pose, double yaw, double pitch) {
  const Axes axes = axes_of(pose);
  const dvec3 up = glm::normalize(pose.up);
  const dvec3 level = glm::cross(up, axes.right);
  const double limit = 0.5 * std::numbers::pi - pole_margin;
  const double elevation = std::atan2(glm::dot(axes.forward, up), glm::dot(axes.forward, level)) + pitch;
  const double held = std::clamp(elevation, -limit, limit);
  const dvec3 ahead = level * std::cos(yaw) + glm::cross(up, level) * std::sin(yaw);
  return ahead * std::cos(held) + up * std::sin(held);
}

/// Minimum distance of an orthographic eye from the target at which no orbit brings the box behind the near plane.
double orthographic_distance(const CameraPose& pose, const Bounds& box) {
  const dvec3 centre = 0.5 * (box.min + box.max);
  const double reach = glm::length(centre - pose.target) + 0.5 * glm::length(box.max - box.min);
  return 1.01 * reach + std::max(0.0, pose.near_plane);
}

/// Extent of a box along normals.
std::vector<double> reach_of(const Bounds& box, std::span<const dvec3> normals) {
  const dvec3 centre = 0.5 * (box.min + box.max);
  const dvec3 half = 0.5 * (box.max - box.min);
  std::vector<double> reach;
  for (const dvec3& n : normals) reach.push_back(glm::dot(centre, n) + glm::dot(half, glm::abs(n)));
  return reach;
}

/// Returns the nearest pose that keeps the whole subject in the image, seen from direction `back` (unit). margin: to
/// the edges, as a fraction of the image's shorter side.
CameraPose fitted(const CameraPose& from, const dvec3& back, const Subject& subject, double aspect, double margin) {
  CameraPose pose = from;
  pose.target = dvec3(0.0);
  pose.eye = back;
  const Axes axes = axes_of(pose);
  const bool orthographic = pose.orthographic_height > 0.0;
  // Slopes of the frustum planes: maximum lateral offset of a point per unit of distance from the eye.
  const double tan_y = tan_half(pose);
  const double inset = 2.0 * margin * std::min(aspect, 1.0);
  const dvec2 tangent = tan_y * (dvec2(aspect, 1.0) - inset);
  const dvec2 slope = orthographic ? dvec2(0.0) : tangent;
  const std::array<dvec3, 6> normals = {axes.right + slope.x * back,
                                        -axes.right + slope.x * back,
                                        axes.up + slope.y * back,
                                        -axes.up + slope.y * back,
                                        back,
                                        -back};
  std::vector<double> reach;
  if (subject.reach) reach = subject.reach(back, normals);
  if (reach.empty()) reach = reach_of(subject.bounds, normals);
  const dvec2 middle = 0.5 * dvec2(reach[0] - reach[1], reach[2] - reach[3]);
  const dvec2 width(reach[0] + reach[1], reach[2] + reach[3]);
  const double depth = 0.5 * (reach[4] - reach[5]);
  pose.target = axes.right * middle.x + axes.up * middle.y + back * depth;
  const dvec2 size = 0.5 * width / tangent;
  double distance = std::max(size.x, size.y);
  if (!orthographic) {
    // With wide angles the side planes would allow an eye too close to a corner that points at it.
    distance = std::max(distance, reach[4] + nearest_to_eye * (reach[4] + reach[5])) - depth;
  }
  const double nearest = nearest_distance(pose.target);
  if (!(distance > nearest)) {  // a single point: keep the distance
    distance = from.eye == from.target ? 1.0 : std::max(nearest, distance_of(from));
  } else if (orthographic) {
    pose.orthographic_height = 2.0 * tan_y * distance;
    distance = std::max(distance, orthographic_distance(pose, subject.bounds));
  }
  pose.eye = pose.target + back * distance;
  return pose;
}

/// Replaces a pose with eye == target by one that fits the subject, or by a default pose without a subject.
CameraPose fitted_if_unset(const CameraPose& from, const std::optional<Subject>& subject, double aspect,
                           double margin) {
  if (from.eye != from.target) return from;
  if (subject) return fitted(from, glm::normalize(dvec3(0.0, 0.2, 1.0)), *subject, aspect, margin);
  CameraPose pose = from;
  pose.target = dvec3(0.0);
  pose.eye = dvec3(0.0, 0.0, 5.0);
  return pose;
}

struct Planes {
  double near, far;
};

Planes planes_of(const CameraPose& pose) {
  if (pose.orthographic_height > 0.0) {
    const double far = pose.far_plane != 0.0 ? pose.far_plane : 1000.0 * pose.orthographic_height;
    return {pose.near_plane, far > pose.near_plane ? far : pose.near_plane + 1000.0 * pose.orthographic_height};
  }
  const double near = pose.near_plane > 0.0 ? pose.near_plane : 0.1;
  return {near, pose.far_plane > near ? pose.far_plane : std::numeric_limits<double>::infinity()};
}

/// Sets the lens parameters. before: offset of the frame's z origin in front of the eye.
void set_lens(const CameraPose& pose, double before, ViewFrame& frame) {
  if (!(pose.lens_radius > 0.0)) return;
  const double focus = (pose.focus_distance > 0.0 ? pose.focus_distance : distance_of(pose)) - before;
  // The focus plane cannot be behind the eye.
  frame.focus = std::max(focus, 1e-6 * distance_of(pose));
  frame.lens_radius = pose.lens_radius;
}

ViewFrame frame_of(const CameraPose& pose, double aspect) {
  const Axes axes = axes_of(pose);
  const Planes planes = planes_of(pose);
  const bool reversed = pose.depth == DepthConvention::reversed;
  ViewFrame frame;
  frame.forward = axes.forward;
  frame.orthographic = pose.orthographic_height > 0.0;
  set_lens(pose, frame.orthographic ? planes.near : 0.0, frame);
  if (frame.orthographic) {
    const double half = 0.5 * pose.orthographic_height;
    frame.eye = pose.eye + axes.forward * planes.near;
    frame.right = axes.right * (half * aspect);
    frame.up = axes.up * half;
    const double slope = 1.0 / (planes.far - planes.near);
    frame.depth_a = reversed ? 1.0 : 0.0;
    frame.depth_b = reversed ? -slope : slope;
    return frame;
  }
  const double tan_y = tan_half(pose);
  const double tan_x = tan_y * aspect;
  frame.eye = pose.eye;
  frame.right = axes.right * tan_x;
  frame.up = axes.up * tan_y;
  const double near_share =
      std::isinf(planes.far) ? 0.0 : planes.near / (planes.far - planes.near);  // for the far plane: 1 + near_share
  frame.depth_a = reversed ? -near_share : 1.0 + near_share;
  frame.depth_b = planes.near * (reversed ? 1.0 + near_share : -(1.0 + near_share));
  return frame;
}

[[noreturn]] void refuse(const std::string& why) { throw Error(ErrorCode::invalid_argument, why); }

bool finite(const dmat4& m) {
  for (int i = 0; i < 16; ++i) {
    if (!(std::abs(m[i / 4][i % 4]) <= farthest)) return false;
  }
  return true;
}

/// Throws if the matrix is not a rotation and a translation within single precision.
void check_view(const dmat4& view) {
  if (!finite(view)) refuse("the view matrix has entries that are not finite or exceed 1e30");
  const dvec4 last = glm::row(view, 3);
  if (std::max(largest(dvec3(last)), std::abs(last.w - 1.0)) > 1e-6)
    refuse("the view matrix's last row is not 0 0 0 1");
  const dmat3 rotation(view);
  const dmat3 gram = glm::transpose(rotation) * rotation;
  for (int i = 0; i < 9; ++i) {
    if (std::abs(gram[i / 3][i % 3] - (i / 3 == i % 3 ? 1.0 : 0.0)) > 1e-3) {
      refuse("the view matrix scales, shears or is singular: a rotation and a translation are needed");
    }
  }
  if (glm::determinant(rotation) < 0.0) refuse("the view matrix mirrors: a rotation and a translation are needed");
}

/// Converts coefficients from normalized device depth a + b x to window depth.
void to_window_depth(ClipDepth clip, double& a, double& b) {
  if (clip == ClipDepth::zero_to_one) return;
  a = 0.5 * a + 0.5;
  b *= 0.5;
}

ViewFrame frame_of(const dmat4& view, const dmat4& projection, ClipDepth clip) {
  check_view(view);
  if (!finite(projection)) refuse("the projection matrix has entries that are not finite or exceed 1e30");
  dmat4 p = projection;
  const double dirt = 1e-6 * std::max(std::abs(p[0][0]), std::abs(p[1][1]));
  if (std::max(std::abs(p[0][1]), std::abs(p[1][0])) > dirt)
    refuse("the projection matrix rotates or shears the image");
  if (std::max(std::abs(p[0][2]), std::abs(p[1][2])) > dirt) refuse("the projection matrix has an oblique near plane");
  if (std::max(std::abs(p[0][3]), std::abs(p[1][3])) > 1e-6 * std::max(std::abs(p[2][3]), std::abs(p[3][3]))) {
    refuse("the projection matrix is neither perspective nor orthographic");
  }

  // In eye space first, where x_clip = p00 x + p20 z + p30 (column before row), and so on.
  ViewFrame frame;
  frame.orthographic = p[2][3] == 0.0;
  const double w = frame.orthographic ? p[3][3] : std::abs(p[2][3]);
  const char* const singular = "the projection matrix is singular";
  if (!(w > 0.0) || p[0][0] == 0.0 || p[1][1] == 0.0) refuse(singular);
  const double side = p[2][3] > 0.0 ? 1.0 : -1.0;
  p /= w;
  frame.right = dvec3(1.0 / p[0][0], 0.0, 0.0);
  frame.up = dvec3(0.0, 1.0 / p[1][1], 0.0);
  frame.forward = side * dvec3(-p[2][0] / p[0][0], -p[2][1] / p[1][1], 1.0);
  if (frame.orthographic) {
    frame.depth_a = p[3][2];
    frame.depth_b = -p[2][2];
    to_window_depth(clip, frame.depth_a, frame.depth_b);
    const double at_near = frame.depth_b > 0.0 ? 0.0 : 1.0;
    const double near = (at_near - frame.depth_a) / frame.depth_b;
    frame.depth_a = at_near;
    frame.eye = frame.forward * near - dvec3(p[3][0] / p[0][0], p[3][1] / p[1][1], 0.0);
  } else {
    // A translation before the projection, as in stereo pairs, moves the eye.
    const double behind = p[3][3] * side;
    frame.eye = -dvec3((p[3][0] - p[2][0] * behind) / p[0][0], (p[3][1] - p[2][1] * behind) / p[1][1], behind);
    frame.depth_a = side * p[2][2];
    frame.depth_b = p[3][2] - p[2][2] * behind;
    to_window_depth(clip, frame.depth_a, frame.depth_b);
  }
  const dmat3 to_world = glm::inverse(dmat3(view));
  frame.eye = to_world * (frame.eye - dvec3(view[3]));
  frame.forward = to_world * frame.forward;
  frame.right = to_world * frame.right;
  frame.up = to_world * frame.up;
  if (!in_range(frame.eye) || !in_range(frame.forward) || !in_range(frame.right) || !in_range(frame.up) ||
      !(std::abs(frame.depth_a) <= farthest && std::abs(frame.depth_b) >= 1.0 / farthest)) {
    refuse(singular);
  }
  return frame;
}

/// Returns the pose whose view is closest to the frame's and equal in the image's middle. before: supplies parameters
/// that the frame lacks.
CameraPose nearest_pose(const ViewFrame& frame, const CameraPose& before) {
  CameraPose pose;
  pose.lens_radius = before.lens_radius;
  pose.focus_distance = before.focus_distance;
  const double length = glm::length(frame.forward);
  const dvec3 forward = frame.forward / length;
  const double half_height = glm::length(frame.up);
  const bool reversed = frame.orthographic ? frame.depth_b < 0.0 : frame.depth_b > 0.0;
  pose.depth = reversed ? DepthConvention::reversed : DepthConvention::standard;
  if (frame.orthographic) {
    pose.orthographic_height = 2.0 * half_height;
    pose.fovy_degrees = before.fovy_degrees;
    pose.eye = frame.eye;  // therefore near_plane is 0
    pose.far_plane = 1.0 / std::abs(frame.depth_b);
  } else {
    const auto depth_at = [&](double depth) { return frame.depth_b / (depth - frame.depth_a); };
    const double near = depth_at(reversed ? 1.0 : 0.0);
    const double far = depth_at(reversed ? 0.0 : 1.0);
    pose.eye = frame.eye;
    pose.near_plane = near > 0.0 && near < farthest ? near : 0.0;
    pose.far_plane = far > near && far < farthest ? far : 0.0;
    pose.fovy_degrees = std::clamp(2.0 * std::atan(half_height / length) * 180.0 / std::numbers::pi, 0.01, 175.0);
  }

  // The target is at the distance of the previous target from the new eye.
  const bool knows = before.eye != before.target;
  const double old_distance = knows ? distance_of(before) : (frame.orthographic ? pose.orthographic_height : 1.0);
  const double distance = knows ? glm::length(before.target - pose.eye) : 0.0;
  pose.target = pose.eye + forward * (distance > 1e-3 * old_distance ? distance : old_distance);

  // A level image keeps the orbit axis.
  const dvec3 right = glm::normalize(frame.right);
  const dvec3 axis = glm::normalize(before.up);
  dvec3 up = glm::normalize(frame.up - forward * glm::dot(frame.up, forward));
  const bool mirrored = glm::dot(glm::cross(right, up), forward) > 0.0;
  if (mirrored && glm::dot(up, axis) < 0.0) up = -up;
  const double lean = glm::dot(axis, right);
  const double level = glm::dot(axis, up);
  pose.up = level > 1e-4 && std::abs(lean) < 1e-4 * level ? before.up : up;
  return pose;
}

}  // namespace

void Camera::set(const CameraPose& pose) {
  const Edit edit(*this);
  if (pose == pose_ && !matrices_) return;
  pose_ = pose;
  matrices_.reset();
  ++revision_;
}

CameraPose Camera::pose() const {
  const std::scoped_lock lock(mutex_);
  return pose_;
}

void Camera::set_matrices(const dmat4& view, const dmat4& projection, ClipDepth clip) {
  const Matrices matrices{view, projection, clip};
  const ViewFrame frame = frame_of(view, projection, clip);
  const Edit edit(*this);
  if (matrices_ == matrices) return;
  if (!matrices_) own_ = pose_;
  pose_ = nearest_pose(frame, own_);
  matrices_ = matrices;
  matrices_frame_ = frame;
  ++revision_;
}

void Camera::matrices(double aspect, ClipDepth clip, dmat4& view, dmat4& projection) const {
  const std::scoped_lock lock(mutex_);
  if (matrices_) {
    view = matrices_->view;
    projection = matrices_->projection;
    if (clip == matrices_->clip) return;
    for (int c = 0; c < 4; ++c) {
      projection[c][2] = clip == ClipDepth::zero_to_one ? 0.5 * (projection[c][2] + projection[c][3])
                                                        : 2.0 * projection[c][2] - projection[c][3];
    }
    return;
  }
  const CameraPose pose = fitted_if_unset(pose_, std::nullopt, aspect, 0.0);
  const ViewFrame frame = frame_of(pose, aspect);
  const Axes axes = axes_of(pose);
  const dmat3 rotation = glm::transpose(dmat3(axes.right, axes.up, -axes.forward));
  view = dmat4(rotation);
  view[3] = dvec4(rotation * -pose.eye, 1.0);

  // Clip depth before the division: the frame's z is -z of eye space, counted from the near plane if orthographic.
  double a = frame.depth_a;
  double b = frame.depth_b;
  if (clip == ClipDepth::negative_one_to_one) {
    a = 2.0 * a - 1.0;
    b *= 2.0;
  }
  projection = dmat4(0.0);
  projection[0][0] = 1.0 / glm::length(frame.right);
  projection[1][1] = 1.0 / glm::length(frame.up);
  if (frame.orthographic) {
    projection[2][2] = -b;
    projection[3][2] = a - b * planes_of(pose).near;
    projection[3][3] = 1.0;
  } else {
    projection[2][2] = -a;
    projection[2][3] = -1.0;
    projection[3][2] = b;
  }
}

void Camera::set_shutter(const std::optional<CameraPose>& open, const std::optional<CameraPose>& close) {
  const Edit edit(*this);
  const bool orthographic = matrices_ ? matrices_frame_.orthographic : pose_.orthographic_height > 0.0;
  for (const auto& end : {open, close}) {
    if (!end) continue;
    if (end->eye == end->target) refuse("a shutter camera has equal eye and target");
    if ((end->orthographic_height > 0.0) != orthographic)
      refuse("a shutter camera has another projection (perspective or orthographic) than the camera");
  }
  const bool held = shutter_holds();
  if (held ? shutter_->open == open && shutter_->close == close : !open && !close) return;
  shutter_.reset();
  ++revision_;
  if (open || close) shutter_ = Shutter{open, close, revision_};
}

std::optional<scene::ViewEnds> Camera::ends(double aspect, const scene::Viewpoint& now) const {
  const std::scoped_lock lock(mutex_);
  if (!shutter_holds() || !(aspect > 0.0)) return std::nullopt;
  const auto end = [&](const std::optional<CameraPose>& given) {
    if (!given) return now;
    CameraPose pose = *given;
    pose.near_plane = pose_.near_plane;
    pose.far_plane = pose_.far_plane;
    pose.depth = pose_.depth;
    pose.lens_radius = pose_.lens_radius;
    pose.focus_distance = pose_.focus_distance;
    return static_cast<scene::Viewpoint>(frame_of(pose, aspect));
  };
  const scene::ViewEnds ends{end(shutter_->open), end(shutter_->close)};
  if (ends.open == now && ends.close == now) return std::nullopt;
  return ends;
}

void Camera::change(const CameraPose& pose) {
  if (!in_range(pose.eye) || !in_range(pose.target) || pose.eye == pose.target) {
    refuse("the camera would exceed the coordinate range");
  }
  pose_ = pose;
  matrices_.reset();
  ++revision_;
}

void Camera::orbit(double yaw, double pitch) {
  const Edit edit(*this);
  if (waits_for_bounds() || (yaw == 0.0 && pitch == 0.0)) return;
  CameraPose pose = pose_;
  pose.eye = pose.target - turned(pose, yaw, -pitch) * distance_of(pose);
  change(pose);
}

void Camera::look(double yaw, double pitch) {
  const Edit edit(*this);
  if (waits_for_bounds() || (yaw == 0.0 && pitch == 0.0)) return;
  CameraPose pose = pose_;
  pose.target = pose.eye + turned(pose, yaw, pitch) * distance_of(pose);
  change(pose);
}

void Camera::roll(double angle) {
  const Edit edit(*this);
  if (waits_for_bounds() || angle == 0.0) return;
  CameraPose pose = pose_;
  const Axes axes = axes_of(pose);
  const dvec3 up = glm::normalize(pose.up);
  const double along = glm::dot(up, axes.forward);
  const dvec3 across = std::abs(along) < 1.0 - 1e-12 ? up - axes.forward * along : axes.up;
  pose.up = axes.forward * along + across * std::cos(angle) + glm::cross(axes.forward, across) * std::sin(angle);
  change(pose);
}

void Camera::pan(double right, double up) {
  const Edit edit(*this);
  if (waits_for_bounds() || (right == 0.0 && up == 0.0)) return;
  CameraPose pose = pose_;
  const Axes axes = axes_of(pose);
  const dvec3 step = (axes.right * right + axes.up * up) * height_at_target(pose);
  pose.eye -= step;
  pose.target -= step;
  change(pose);
}

void Camera::scale(double factor, bool keep_orthographic_eye) {
  if (waits_for_bounds() || factor == 1.0) return;
  CameraPose pose = pose_;
  const double distance = distance_of(pose);
  const bool by_height = keep_orthographic_eye && pose.orthographic_height > 0.0;
  const double size = by_height ? pose.orthographic_height : distance;
  const double low = std::min(size, nearest_distance(pose.target));
  const double high = std::max(size, 1e12);
  const double change_by = std::clamp(size * factor, low, high) / size;
  if (change_by == 1.0) return;
  if (!by_height) pose.eye = pose.target - axes_of(pose).forward * (distance * change_by);
  pose.orthographic_height *= change_by;
  change(pose);
}

void Camera::dolly(double factor) {
  const Edit edit(*this);
  scale(factor, false);
}

void Camera::zoom(double factor) {
  const Edit edit(*this);
  scale(factor, true);
}

void Camera::fly(double right, double up, double forward) {
  const Edit edit(*this);
  if (waits_for_bounds() || (right == 0.0 && up == 0.0 && forward == 0.0)) return;
  CameraPose pose = pose_;
  const Axes axes = axes_of(pose);
  const dvec3 step = axes.right * right + axes.up * up + axes.forward * forward;
  pose.eye += step;
  pose.target += step;
  change(pose);
}

void Camera::frame(const Subject& subject, double aspect, double margin) {
  change(waits_for_bounds() ? fitted_if_unset(pose_, subject, aspect, margin)
                            : fitted(pose_, -axes_of(pose_).forward, subject, aspect, margin));
}

void Camera::frame(const Bounds& box, double aspect) {
  const Edit edit(*this);
  frame(box, aspect, 0.0);
}

void Camera::fit(const Subject& subject, double aspect) {
  const Edit edit(*this);
  frame(subject, aspect, fit_margin);
}

void Camera::look_from(AxisView side) {
  const Edit edit(*this);
  if (waits_for_bounds()) return;
  CameraPose pose = pose_;
  const double size = largest(pose.up);
  for (int axis = 0; axis < 3; ++axis) {
    if (std::abs(pose.up[axis]) < size) continue;
    const double sign = pose.up[axis] < 0.0 ? -1.0 : 1.0;
    pose.up = dvec3(0.0);
    pose.up[axis] = sign;
    break;
  }
  const dvec3 front = pose.up.z != 0.0 ? dvec3(0.0, -pose.up.z, 0.0) : dvec3(0.0, 0.0, 1.0);
  const dvec3 right = glm::cross(pose.up, front);
  dvec3 back = front;
  switch (side) {
    case AxisView::front:
      break;
    case AxisView::back:
      back = -front;
      break;
    case AxisView::right:
      back = right;
      break;
    case AxisView::left:
      back = -right;
      break;
    case AxisView::top:
      back = pose.up * std::cos(pole_margin) + front * std::sin(pole_margin);
      break;
    case AxisView::bottom:
      back = -pose.up * std::cos(pole_margin) + front * std::sin(pole_margin);
      break;
  }
  pose.eye = pose.target + back * distance_of(pose);
  change(pose);
}

void Camera::toggle_orthographic(const std::optional<Bounds>& bounds) {
  const Edit edit(*this);
  CameraPose pose = pose_;
  const bool was_orthographic = pose.orthographic_height > 0.0;
  if (waits_for_bounds()) {
    pose_.orthographic_height = was_orthographic ? 0.0 : 1.0;  // its size is set with the bounds
    ++revision_;
    return;
  }
  const dvec3 forward = axes_of(pose).forward;
  const double height = height_at_target(pose);
  double distance = height / (2.0 * tan_half(pose));
  pose.orthographic_height = was_orthographic ? 0.0 : height;
  if (!was_orthographic && bounds) distance = std::max(distance, orthographic_distance(pose, *bounds));
  pose.eye = pose.target - forward * distance;
  change(pose);
}

ViewFrame Camera::view(double aspect, const std::optional<Subject>& subject) {
  const Edit edit(*this);
  if (matrices_) {
    if (own_.eye == own_.target && subject) {  // matrices were set before any pose: take the target distance from the
                                               // bounds
      const double distance = glm::length(0.5 * (subject->bounds.min + subject->bounds.max) - pose_.eye);
      if (distance > nearest_distance(pose_.eye)) {
        pose_.target = pose_.eye + axes_of(pose_).forward * distance;
        own_ = pose_;
      }
    }
    ViewFrame frame = matrices_frame_;
    set_lens(pose_, 0.0, frame);  // an orthographic pose derived from matrices has its eye in the near plane
    return frame;
  }
  if (!(aspect > 0.0 && std::isfinite(aspect)))
    return frame_of(fitted_if_unset(pose_, std::nullopt, 1.0, 0.0), 1.0);  // there is no image
  const CameraPose pose = fitted_if_unset(pose_, subject, aspect, fit_margin);
  if (subject && pose != pose_) {
    // Initial placement is not a motion, so the shutter poses stay valid.
    const bool held = shutter_holds();
    pose_ = pose;
    ++revision_;
    if (held) shutter_->revision = revision_;
  }
  return frame_of(pose, aspect);
}

std::uint64_t Camera::revision() const {
  const std::scoped_lock lock(mutex_);
  return revision_;
}

Camera::Edit::~Edit() {
  const bool changed = camera_.revision_ != before_;
  lock_.unlock();
  if (!changed) return;
  camera_.listeners_.notify();
}

}  // namespace cumulet::viewer
