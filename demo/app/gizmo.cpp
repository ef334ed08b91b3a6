#include "gizmo.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/gtc/type_ptr.hpp>
#include <limits>
#include <memory>
#include <numbers>

namespace cumulet::demo {
namespace {

using glm::dmat3;
using glm::dmat4;
using glm::dvec2;
using glm::dvec3;
using glm::dvec4;

constexpr double degree = std::numbers::pi / 180.0;
// Fractions of a handle's reach.
constexpr double plane_begins = 0.28;
constexpr double plane_ends = 0.46;
constexpr double outer_ring = 1.2;
constexpr double free_radius = 0.09;
// Minimum projected extent of an axis or plane; a handle seen from its end or edge is hidden.
constexpr double min_axis = 0.17;
constexpr double min_plane = 0.2;
constexpr double min_ring = 0.15;  // rings seen more from the edge are dragged along their tangent
constexpr double min_scale = 0.01;
constexpr double behind = 0.3;  // part of a ring behind the center that is still shown, in radii
constexpr int ring_parts = 64;

/// Returns the next axis in right-handed order.
int next(int axis) { return (axis + 1) % 3; }

double distance_to(const dvec2& point, const dvec2& a, const dvec2& b) {
  const dvec2 along = b - a;
  const double length = glm::dot(along, along);
  const double part = length > 0.0 ? std::clamp(glm::dot(point - a, along) / length, 0.0, 1.0) : 0.0;
  return glm::distance(point, a + part * along);
}

double distance_to(const dvec2& point, const std::vector<dvec2>& line, bool closed) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = closed ? 0 : 1; i < line.size(); ++i)
    least = std::min(least, distance_to(point, line[i == 0 ? line.size() - 1 : i - 1], line[i]));
  return least;
}

/// Point-in-polygon test for a convex outline.
bool is_within(const dvec2& point, const std::vector<dvec2>& outline) {
  int left = 0;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const dvec2& a = outline[i];
    const dvec2 side = outline[(i + 1) % outline.size()] - a;
    left += side.x * (point.y - a.y) - side.y * (point.x - a.x) > 0.0 ? 1 : 0;
  }
  return !outline.empty() && (left == 0 || left == static_cast<int>(outline.size()));
}

std::vector<dvec2> circle(const dvec2& middle, double radius) {
  std::vector<dvec2> points;
  for (int i = 0; i < ring_parts; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / ring_parts;
    points.push_back(middle + radius * dvec2(std::cos(angle), std::sin(angle)));
  }
  return points;
}

std::vector<dvec2> line_of(const Gizmo& gizmo, int axis, const Sight& sight) {
  const double length = gizmo.reach * sight.pixel_at(gizmo.pivot);
  const auto from = sight.project(gizmo.pivot);
  const auto to = sight.project(gizmo.pivot + length * gizmo.axes[axis]);
  if (!from || !to || glm::distance(*from, *to) < min_axis * gizmo.reach) return {};
  return {*from, *to};
}

std::vector<dvec2> square_of(const Gizmo& gizmo, int across, const Sight& sight) {
  const dvec3 eye = sight.to_eye(gizmo.pivot);
  const dvec3& a = gizmo.axes[next(across)];
  const dvec3& b = gizmo.axes[next(next(across))];
  const dvec3 normal = glm::cross(a, b);
  if (std::abs(glm::dot(normal, eye)) < min_plane * glm::length(normal)) return {};
  // The square is on the eye's side, where it does not cover another axis.
  const double length = gizmo.reach * sight.pixel_at(gizmo.pivot);
  const dvec3 along_a = (glm::dot(a, eye) < 0.0 ? -length : length) * a;
  const dvec3 along_b = (glm::dot(b, eye) < 0.0 ? -length : length) * b;
  std::vector<dvec2> outline;
  for (const auto& [u, v] : {std::pair(plane_begins, plane_begins), std::pair(plane_ends, plane_begins),
                             std::pair(plane_ends, plane_ends), std::pair(plane_begins, plane_ends)}) {
    const auto corner = sight.project(gizmo.pivot + u * along_a + v * along_b);
    if (!corner) return {};
    outline.push_back(*corner);
  }
  return outline;
}

/// Returns the visible part of a ring: the side that faces the eye and a little more, or the full ring if seen along
/// its axis.
std::vector<dvec2> arc_of(const Gizmo& gizmo, int axis, const Sight& sight) {
  const dvec3 eye = sight.to_eye(gizmo.pivot);
  const dvec3& normal = gizmo.axes[axis];
  const dvec3 towards = eye - glm::dot(eye, normal) * normal;
  const double slant = glm::length(towards);
  const double half = slant > behind ? std::acos(-behind / slant) : std::numbers::pi;
  const dvec3 a = slant > 1e-6 ? towards / slant : glm::normalize(glm::cross(normal, gizmo.axes[next(axis)]));
  const dvec3 b = glm::cross(normal, a);
  const double radius = gizmo.reach * sight.pixel_at(gizmo.pivot);
  std::vector<dvec2> points;
  for (int i = 0; i <= ring_parts; ++i) {
    const double angle = half * (2.0 * i / ring_parts - 1.0);
    const auto point = sight.project(gizmo.pivot + radius * (std::cos(angle) * a + std::sin(angle) * b));
    if (!point) return {};
    points.push_back(*point);
  }
  return points;
}

dvec3 snap(const dvec3& value, double step) { return step > 0.0 ? step * glm::round(value / step) : value; }

template <class... Values>
std::string print(const char* format, Values... values) {
  std::array<char, 96> text{};
  std::snprintf(text.data(), text.size(), format, values...);  // NOLINT(cppcoreguidelines-pro-type-vararg)
  return text.data();
}

}  // namespace

std::optional<double> nearest_on_axis(const Ray& ray, const dvec3& point, const dvec3& axis) {
  constexpr double min_sine_2 = 1e-4;  // 0.57 degrees
  const double cosine = glm::dot(ray.direction, axis);
  const double sine_2 = 1.0 - cosine * cosine;
  if (!(sine_2 > min_sine_2)) return std::nullopt;
  const dvec3 to_point = point - ray.origin;
  const double along_ray = glm::dot(to_point, ray.direction);
  const double along_axis = glm::dot(to_point, axis);
  if (!((along_ray - cosine * along_axis) / sine_2 > 0.0)) return std::nullopt;
  return (cosine * along_ray - along_axis) / sine_2;
}

std::optional<dvec3> plane_hit(const Ray& ray, const dvec3& point, const dvec3& normal) {
  constexpr double min_cosine = 0.01;
  const double cosine = glm::dot(ray.direction, normal);
  if (!(std::abs(cosine) > min_cosine)) return std::nullopt;
  const double distance = glm::dot(point - ray.origin, normal) / cosine;
  if (!(distance > 0.0)) return std::nullopt;
  return ray.origin + distance * ray.direction;
}

double angle_about(const dvec3& axis, const dvec3& from, const dvec3& to) {
  const dvec3 a = from - glm::dot(from, axis) * axis;
  const dvec3 b = to - glm::dot(to, axis) * axis;
  return std::atan2(glm::dot(axis, glm::cross(a, b)), glm::dot(a, b));
}

double round_step(double most) {
  if (!(most > 0.0) || !std::isfinite(most)) return 0.0;
  const double ten = std::pow(10.0, std::floor(std::log10(most)));
  return (most >= 5.0 * ten ? 5.0 : most >= 2.0 * ten ? 2.0 : 1.0) * ten;
}

Sight::Sight(const cumulet_camera_desc& camera, const Rectangle& area) : area_(area) {
  cumulet_camera* made = nullptr;
  if (cumulet_camera_create(&camera, &made) != CUMULET_OK) return;
  const std::unique_ptr<cumulet_camera, void (*)(cumulet_camera*)> held(made, cumulet_camera_release);
  static_cast<void>(cumulet_camera_get_matrices(made, area.width / area.height, CUMULET_CLIP_NEGATIVE_ONE_TO_ONE,
                                                glm::value_ptr(to_eye_), glm::value_ptr(projection_)));
  to_world_ = glm::inverse(to_eye_);
  perspective_ = projection_[2][3] != 0.0;
  const double distance = glm::distance(glm::make_vec3(camera.eye), glm::make_vec3(camera.target));
  nearest_ = perspective_ ? 1e-3 * distance : -std::numeric_limits<double>::infinity();
}

dvec3 Sight::in_eye_space(const dvec3& point) const {
  const dvec4 seen = to_eye_ * dvec4(point, 1.0);
  return {seen.x, seen.y, seen.z};
}

dvec2 Sight::pixel_of(const dvec3& in_eye_space) const {
  const dvec4 clip = projection_ * dvec4(in_eye_space, 1.0);
  return {area_.x + 0.5 * (1.0 + clip.x / clip.w) * area_.width,
          area_.y + 0.5 * (1.0 - clip.y / clip.w) * area_.height};
}

std::optional<dvec2> Sight::project(const dvec3& point) const {
  const dvec3 seen = in_eye_space(point);
  if (!(-seen.z > nearest_)) return std::nullopt;
  return pixel_of(seen);
}

std::optional<std::array<dvec2, 2>> Sight::project(const dvec3& a, const dvec3& b) const {
  dvec3 from = in_eye_space(a);
  dvec3 to = in_eye_space(b);
  // Slightly in front of the near limit.
  const double nearest = perspective_ ? nearest_ * (1.0 + 1e-9) : nearest_;
  const bool from_seen = -from.z > nearest;
  const bool to_seen = -to.z > nearest;
  if (!from_seen && !to_seen) return std::nullopt;
  if (from_seen != to_seen) {
    const dvec3 cut = from + (-nearest - from.z) / (to.z - from.z) * (to - from);
    (from_seen ? to : from) = cut;
  }
  return std::array{pixel_of(from), pixel_of(to)};
}

Ray Sight::ray(const dvec2& pixel) const {
  const dvec2 clip(2.0 * (pixel.x - area_.x) / area_.width - 1.0, 1.0 - 2.0 * (pixel.y - area_.y) / area_.height);
  const dvec2 scale(projection_[0][0], projection_[1][1]);
  if (!perspective_) {
    const dvec2 at = (clip - dvec2(projection_[3])) / scale;
    return {dvec3(to_world_ * dvec4(at, 0.0, 1.0)), forward()};
  }
  const dvec2 slope = (clip + dvec2(projection_[2])) / scale;
  return {dvec3(to_world_[3]), glm::normalize(dvec3(to_world_ * dvec4(slope, -1.0, 0.0)))};
}

double Sight::pixel_at(const dvec3& point) const {
  const double height = 2.0 / projection_[1][1] / area_.height;
  return perspective_ ? height * std::max(-in_eye_space(point).z, nearest_) : height;
}

dvec3 Sight::to_eye(const dvec3& point) const {
  if (!perspective_) return -forward();
  const dvec3 way = dvec3(to_world_[3]) - point;
  const double length = glm::length(way);
  return length > 0.0 ? way / length : -forward();
}

dvec3 Sight::forward() const { return -glm::normalize(dvec3(to_world_[2])); }

Gizmo gizmo_of(Tool tool, Axes axes, const dmat4& transform, const dvec3& pivot, double reach) {
  Gizmo gizmo{tool, pivot, dmat3(1.0), reach};
  if (axes == Axes::world && tool != Tool::scale) return gizmo;
  for (int i = 0; i < 3; ++i) gizmo.axes[i] = glm::normalize(dvec3(transform[i]));
  return gizmo;
}

std::vector<dvec2> shape_of(const Gizmo& gizmo, Handle handle, const Sight& sight) {
  const auto pivot = sight.project(gizmo.pivot);
  if (gizmo.tool == Tool::none || !pivot) return {};
  const bool turns = gizmo.tool == Tool::rotate;
  if (handle == Handle::free) return circle(*pivot, (turns ? outer_ring : free_radius) * gizmo.reach);
  if (is_plane(handle)) return turns ? std::vector<dvec2>() : square_of(gizmo, axis_of(handle), sight);
  return turns ? arc_of(gizmo, axis_of(handle), sight) : line_of(gizmo, axis_of(handle), sight);
}

bool is_closed(const Gizmo& gizmo, Handle handle) {
  return handle == Handle::free || (gizmo.tool != Tool::rotate && is_plane(handle));
}

std::optional<Handle> handle_at(const Gizmo& gizmo, const Sight& sight, const dvec2& pixel, double tolerance) {
  const bool turns = gizmo.tool == Tool::rotate;
  std::optional<Handle> nearest;
  double least = tolerance;
  // Filled shapes are tested first, with the center handle before the planes; they take precedence over lines.
  for (const Handle handle : {Handle::free, Handle::yz, Handle::zx, Handle::xy, Handle::x, Handle::y, Handle::z}) {
    const std::vector<dvec2> shape = shape_of(gizmo, handle, sight);
    const bool filled = !turns && is_closed(gizmo, handle);
    if (filled && is_within(pixel, shape)) return handle;
    const double distance = distance_to(pixel, shape, is_closed(gizmo, handle));
    if (shape.empty() || !(distance <= least)) continue;
    least = distance;
    nearest = handle;
  }
  return nearest;
}

Drag::Drag(const Gizmo& gizmo, Handle handle, const Sight& sight, const dvec2& from)
    : begun_(gizmo), handle_(handle), from_(from) {
  const dvec3& pivot = gizmo.pivot;
  step_ = round_step(0.1 * gizmo.reach * sight.pixel_at(pivot));
  const bool turns = gizmo.tool == Tool::rotate;
  if (handle == Handle::free) {
    normal_ = turns ? sight.to_eye(pivot) : -sight.forward();
  } else if (turns) {
    normal_ = gizmo.axes[axis_of(handle)];
  } else {
    const int axis = axis_of(handle);
    normal_ = glm::normalize(glm::cross(gizmo.axes[next(axis)], gizmo.axes[next(next(axis))]));
  }
  const dvec3 eye = sight.to_eye(pivot);
  if (turns && std::abs(glm::dot(normal_, eye)) < min_ring) {
    // The ring's nearest point is dragged along the tangent.
    const double radius = gizmo.reach * sight.pixel_at(pivot);
    const dvec3 along = glm::normalize(glm::cross(normal_, eye));
    const auto ends = sight.project(pivot - 0.5 * radius * along, pivot + 0.5 * radius * along);
    const dvec2 way = ends ? (*ends)[1] - (*ends)[0] : dvec2(0.0);
    tangent_ = glm::dot(way, way) > 0.0 ? way / glm::dot(way, way) : dvec2(0.0);
  }
  grasp_ = grasp(sight, from);
}

std::optional<dvec3> Drag::grasp(const Sight& sight, const dvec2& pixel) const {
  const dvec3& pivot = begun_.pivot;
  const Ray ray = sight.ray(pixel);
  if (is_axis(handle_) && begun_.tool != Tool::rotate) {
    const dvec3& axis = begun_.axes[axis_of(handle_)];
    const auto along = nearest_on_axis(ray, pivot, axis);
    return along ? std::optional(*along * axis) : std::nullopt;
  }
  const auto hit = plane_hit(ray, pivot, normal_);
  return hit ? std::optional(*hit - pivot) : std::nullopt;
}

void Drag::follow(const Sight& sight, const dvec2& pixel) {
  const auto now = grasp(sight, pixel);
  if (now && grasp_) move_ = *now - *grasp_;
}

void Drag::turn(const Sight& sight, const dvec2& pixel) {
  if (tangent_) {
    angle_ = glm::dot(pixel - from_, *tangent_);
    return;
  }
  const auto now = grasp(sight, pixel);
  // The direction is undefined at the pivot.
  const double least = sight.pixel_at(begun_.pivot);
  if (!now || glm::length(*now) < least) return;
  // Angles are accumulated, so that rotations of more than a full turn are possible.
  if (grasp_ && glm::length(*grasp_) >= least) angle_ += angle_about(normal_, *grasp_, *now);
  grasp_ = now;
}

void Drag::stretch(const Sight& sight, const dvec2& pixel) {
  double scale = 1.0;
  if (handle_ == Handle::free) {
    const dvec2 way = pixel - from_;
    scale = std::exp((way.x - way.y) / (2.0 * begun_.reach));
  } else {
    const auto now = grasp(sight, pixel);
    if (!now || !grasp_ || !(glm::dot(*grasp_, *grasp_) > 0.0)) return;
    scale = glm::dot(*now, *grasp_) / glm::dot(*grasp_, *grasp_);
  }
  constexpr double max_scale = 1000.0;
  scale = std::clamp(scale, min_scale, max_scale);
  stretch_ = dvec3(1.0);
  for (int i = 0; i < 3; ++i) {
    const bool of_axis = handle_ != Handle::free && axis_of(handle_) == i;
    if (handle_ == Handle::free || is_axis(handle_) == of_axis) stretch_[i] = scale;
  }
}

dvec3 Drag::snapped_move() const {
  if (!snapped_) return move_;
  // Steps are along the gizmo's axes, and only along the axes of the handle.
  const dvec3 steps = snap(glm::inverse(begun_.axes) * move_, step_);
  return begun_.axes * steps;
}

dmat4 Drag::change() const {
  const dvec3& pivot = begun_.pivot;
  dmat4 change(1.0);
  switch (begun_.tool) {
    case Tool::none:
      break;
    case Tool::move:
      return glm::translate(change, snapped_move());
    case Tool::rotate: {
      constexpr double step = 15.0 * degree;
      const double angle = snapped_ ? step * std::round(angle_ / step) : angle_;
      change = glm::rotate(change, angle, normal_);
      break;
    }
    case Tool::scale: {
      constexpr double step = 0.1;
      const dvec3 scale = snapped_ ? glm::max(snap(stretch_, step), dvec3(step)) : stretch_;
      const dmat4 axes(begun_.axes);
      change = axes * glm::scale(dmat4(1.0), scale) * glm::inverse(axes);
      break;
    }
  }
  return glm::translate(dmat4(1.0), pivot) * change * glm::translate(dmat4(1.0), -pivot);
}

dmat4 Drag::to(const Sight& sight, const dvec2& pixel, bool snapped) {
  snapped_ = snapped;
  switch (begun_.tool) {
    case Tool::none:
      break;
    case Tool::move:
      follow(sight, pixel);
      break;
    case Tool::rotate:
      turn(sight, pixel);
      break;
    case Tool::scale:
      stretch(sight, pixel);
      break;
  }
  return change();
}

std::string Drag::label() const {
  constexpr std::array names = {'X', 'Y', 'Z'};
  if (begun_.tool == Tool::rotate) {
    constexpr double step = 15.0;
    const double degrees = angle_ / degree;
    return print("%.1f°", snapped_ ? step * std::round(degrees / step) : degrees);
  }
  if (begun_.tool == Tool::scale) {
    const dmat4 change = this->change();
    const int axis = handle_ == Handle::free ? 0 : is_axis(handle_) ? axis_of(handle_) : next(axis_of(handle_));
    return print("%.3g x", glm::length(glm::dmat3(change) * begun_.axes[axis]));
  }
  const dvec3 move = glm::inverse(begun_.axes) * snapped_move();
  std::string text;
  for (int i = 0; i < 3; ++i) {
    const bool has = handle_ == Handle::free || is_axis(handle_) == (axis_of(handle_) == i);
    if (has) text += print("%s%c %.4g", text.empty() ? "" : "  ", names[static_cast<std::size_t>(i)], move[i]);
  }
  return text;
}

}  // namespace cumulet::demo
