#include "clip_faces.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <setting.hpp>

namespace cumulet::demo {

using glm::dmat4;
using glm::dvec2;
using glm::dvec3;
using glm::dvec4;
using settings::ClipBox;

namespace {

constexpr double max_frontal_cosine = 0.98;  // cosine between the axis and the view
constexpr double min_extent = 1e-3;          // of a dragged box, relative to its extent before

dvec3 axis_of(const ClipFace& face, const dmat4& transform) {
  const dvec4& axis = transform[face.axis];
  return {axis.x, axis.y, axis.z};
}

}  // namespace

std::string name_of(const ClipFace& face) {
  return std::string("clip ") + "XYZ"[face.axis] + (face.high ? " max" : " min");
}

dvec3 center_of(const ClipFace& face, const ClipBox& box, const dmat4& transform) {
  const dvec3 low(box[0], box[1], box[2]);
  const dvec3 high(box[3], box[4], box[5]);
  dvec3 at = 0.5 * (low + high);
  at[face.axis] = face.high ? high[face.axis] : low[face.axis];
  const dvec4 center = transform * dvec4(at, 1.0);
  return {center.x, center.y, center.z};
}

bool can_be_dragged(const ClipFace& face, const ClipBox& box, const dmat4& transform, const Sight& sight) {
  const dvec3 axis = glm::normalize(axis_of(face, transform));
  return std::abs(glm::dot(axis, sight.to_eye(center_of(face, box, transform)))) < max_frontal_cosine;
}

std::optional<ClipFace> clip_face_at(const ClipBox& box, const dmat4& transform, const Sight& sight, const dvec2& pixel,
                                     double tolerance) {
  std::optional<ClipFace> found;
  double least = tolerance;
  for (const ClipFace& face : clip_faces) {
    const auto at = sight.project(center_of(face, box, transform));
    if (!at || !(glm::distance(*at, pixel) <= least) || !can_be_dragged(face, box, transform, sight)) continue;
    least = glm::distance(*at, pixel);
    found = face;
  }
  return found;
}

ClipDrag::ClipDrag(const ClipFace& face, const ClipBox& box, const dmat4& transform, const Sight& sight,
                   const dvec2& from)
    : face_(face),
      begun_(box),
      box_(box),
      center_(center_of(face, box, transform)),
      axis_(axis_of(face, transform)),
      grasp_(along(sight, from)) {}

ClipBox ClipDrag::to(const Sight& sight, const dvec2& pixel, bool snapped) {
  const auto now = along(sight, pixel);
  if (!now || !grasp_) return box_;
  const auto axis = static_cast<std::size_t>(face_.axis);
  const double extent = begun_[axis + 3] - begun_[axis];
  double at = begun_[number()] + *now - *grasp_;
  if (snapped) {
    constexpr double parts = 20.0;
    const double step = round_step(extent / parts);
    at = step * std::round(at / step);
  }
  box_ = begun_;
  box_[number()] = face_.high ? std::max(at, begun_[axis] + min_extent * extent)
                              : std::min(at, begun_[axis + 3] - min_extent * extent);
  return box_;
}

std::string ClipDrag::label() const {
  return std::string(1, "XYZ"[face_.axis]) + ' ' + settings::number_text(static_cast<float>(box_[number()]));
}

std::optional<double> ClipDrag::along(const Sight& sight, const dvec2& pixel) const {
  const double unit = glm::length(axis_);
  const auto at = nearest_on_axis(sight.ray(pixel), center_, axis_ / unit);
  return at ? std::optional(*at / unit) : std::nullopt;
}

}  // namespace cumulet::demo
