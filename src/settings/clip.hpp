#pragma once

// Clips of volumes (cumulet_set_clip), as users give them, and checks of their numbers.

#include <cumulet/cumulet.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace cumulet::settings {

/// Lowest corner, then highest corner.
using ClipBox = std::array<double, 6>;
/// a, b, c and d: the part with a x + b y + c z + d >= 0 is shown.
using ClipPlane = std::array<double, 4>;

/// The shown part of a volume, in the volume's own world space.
struct Clip {
  std::optional<ClipBox> box = {};
  std::vector<ClipPlane> planes = {};  ///< at most CUMULET_CLIP_PLANES

  bool operator==(const Clip&) const = default;
  [[nodiscard]] bool empty() const { return !box && planes.empty(); }
};

namespace detail {

inline bool are_moderate(std::span<const double> values) {
  return std::ranges::all_of(values, [](double value) { return std::abs(value) <= 1e30; });
}

}  // namespace detail

/// These return why a part of a clip is rejected, as text that follows its name; "" if it is accepted.
inline std::string clip_box_refusal(const ClipBox& box) {
  if (!detail::are_moderate(box)) return "has a number that is not from -1e30 to 1e30";
  const bool solid = box[0] < box[3] && box[1] < box[4] && box[2] < box[5];
  return solid ? "" : "is empty: each number of its lowest corner must be below that of its highest corner";
}
inline std::string clip_plane_refusal(const ClipPlane& plane) {
  if (!detail::are_moderate(plane)) return "has a number that is not from -1e30 to 1e30";
  const double length = std::hypot(plane[0], plane[1], plane[2]);
  return length >= 1e-30 ? "" : "has no direction: its first three numbers are 0";
}
inline std::string clip_count_refusal(std::size_t planes) {
  if (planes <= CUMULET_CLIP_PLANES) return "";
  return "has " + std::to_string(planes) + " planes; it must have at most " + std::to_string(CUMULET_CLIP_PLANES);
}

/// Returns the library's descriptor. It refers to `clip`, which must outlive it.
inline cumulet_clip_desc clip_desc_of(const Clip& clip) {
  cumulet_clip_desc desc{};
  desc.struct_size = sizeof desc;
  desc.box = clip.box ? 1 : 0;
  for (std::size_t axis = 0; axis < 3 && clip.box; ++axis) {
    desc.box_min[axis] = (*clip.box)[axis];
    desc.box_max[axis] = (*clip.box)[axis + 3];
  }
  desc.planes = clip.planes.empty() ? nullptr : clip.planes.front().data();
  desc.plane_count = clip.planes.size();
  return desc;
}

}  // namespace cumulet::settings
