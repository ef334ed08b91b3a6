#pragma once

#include <array>
#include <clip.hpp>
#include <glm/glm.hpp>
#include <optional>
#include <string>

#include "gizmo.hpp"

// Geometry of the handles of a clip box, without a window: one at the center of each face, which moves along its axis.

namespace cumulet::demo {

struct ClipFace {
  int axis = 0;
  bool high = false;  // the face at the box's highest corner

  bool operator==(const ClipFace&) const = default;
};
inline constexpr std::array<ClipFace, 6> clip_faces = {
    {{0, false}, {0, true}, {1, false}, {1, true}, {2, false}, {2, true}}};

/// Returns "clip X min".
[[nodiscard]] std::string name_of(const ClipFace& face);
/// Returns the world-space center of a face. transform: of the volume.
[[nodiscard]] glm::dvec3 center_of(const ClipFace& face, const settings::ClipBox& box, const glm::dmat4& transform);
/// Returns false for a face that is seen so much from its front that dragging would be imprecise.
[[nodiscard]] bool can_be_dragged(const ClipFace& face, const settings::ClipBox& box, const glm::dmat4& transform,
                                  const Sight& sight);
/// Returns the face whose handle is at a pixel, with a tolerance in pixels.
[[nodiscard]] std::optional<ClipFace> clip_face_at(const settings::ClipBox& box, const glm::dmat4& transform,
                                                   const Sight& sight, const glm::dvec2& pixel, double tolerance);

/// A drag of a face.
class ClipDrag {
 public:
  ClipDrag(const ClipFace& face, const settings::ClipBox& box, const glm::dmat4& transform, const Sight& sight,
           const glm::dvec2& from);

  /// Returns the box with the face at the pointer. It stays before the opposite face. If the pointer gives no position,
  /// returns the previous box. snapped: in steps of a round length, about a twentieth of the box.
  settings::ClipBox to(const Sight& sight, const glm::dvec2& pixel, bool snapped);
  [[nodiscard]] const ClipFace& face() const { return face_; }
  /// Returns the position of the face as text: "X 1.25".
  [[nodiscard]] std::string label() const;

 private:
  // Returns the distance of the pointer along the axis from the center of the face, in units of the box.
  [[nodiscard]] std::optional<double> along(const Sight& sight, const glm::dvec2& pixel) const;
  [[nodiscard]] std::size_t number() const { return static_cast<std::size_t>(face_.axis) + (face_.high ? 3 : 0); }

  ClipFace face_;
  settings::ClipBox begun_;
  settings::ClipBox box_;
  glm::dvec3 center_{};
  glm::dvec3 axis_{};  // one unit of the box in world space
  std::optional<double> grasp_;
};

}  // namespace cumulet::demo
