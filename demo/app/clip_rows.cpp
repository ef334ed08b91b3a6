#include "clip_rows.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string>

namespace cumulet::demo {
namespace {

using glm::dvec3;
using settings::ClipBox;
using settings::ClipPlane;

/// Bounds of the volume with a margin, which linear interpolation may fill.
Box whole_of(const std::optional<Box>& box) {
  constexpr double margin = 0.01;
  if (!box) return {dvec3(-1.0), dvec3(1.0)};
  const dvec3 more = margin * (box->most - box->least);
  return {box->least - more, box->most + more};
}

void box_rows(Ui& ui, ClipBox& box, const Box& whole) {
  constexpr std::array names = {"X", "Y", "Z"};
  constexpr double least = 1e-3;  // extent, relative to the volume's
  for (int axis = 0; axis < 3; ++axis) {
    double& low = box[static_cast<std::size_t>(axis)];
    double& high = box[static_cast<std::size_t>(axis) + 3];
    const double apart = least * std::max(whole.most[axis] - whole.least[axis], 1e-30);
    const std::string name = std::string("Clip ") + names[static_cast<std::size_t>(axis)];
    if (ui.slider((name + " min").c_str(), "The box begins here, in the coordinates of the volume.", low,
                  whole.least[axis], whole.most[axis], "%.4g"))
      low = std::min(low, high - apart);
    if (ui.slider((name + " max").c_str(), "The box ends here, in the coordinates of the volume.", high,
                  whole.least[axis], whole.most[axis], "%.4g"))
      high = std::max(high, low + apart);
  }
}

void plane_rows(Ui& ui, settings::Clip& clip, const Box& whole) {
  const double size = glm::distance(whole.least, whole.most);
  for (std::size_t i = 0; i < clip.planes.size(); ++i) {
    const std::string name = "Clip plane " + std::to_string(i + 1);
    ClipPlane plane = clip.planes[i];
    if (ui.numbers(name.c_str(), "The plane's normal and its offset: the part with a x + b y + c z + d >= 0 is shown.",
                   plane, static_cast<float>(0.002 * std::max(1.0, size))) &&
        settings::clip_plane_refusal(plane).empty())
      clip.planes[i] = plane;
  }
  if (clip.planes.size() < CUMULET_CLIP_PLANES &&
      ui.button("Add clip plane", "Adds a plane through the middle of the volume.")) {
    const dvec3 middle = 0.5 * (whole.least + whole.most);
    clip.planes.push_back({0.0, -1.0, 0.0, middle.y});
  }
  if (!clip.planes.empty() && ui.button("Remove clip plane", "Removes the last plane.")) clip.planes.pop_back();
}

}  // namespace

settings::Clip turned(const settings::Clip& clip, UpAxis to) {
  // A volume with Z up has its Z along the scene's Y, and its Y along the scene's -Z.
  const auto point = [to](double x, double y, double z) { return to == UpAxis::z ? dvec3(x, z, -y) : dvec3(x, -z, y); };
  settings::Clip result;
  if (clip.box) {
    const ClipBox& box = *clip.box;
    const dvec3 a = point(box[0], box[1], box[2]);
    const dvec3 b = point(box[3], box[4], box[5]);
    const dvec3 low = glm::min(a, b);
    const dvec3 high = glm::max(a, b);
    result.box = {low.x, low.y, low.z, high.x, high.y, high.z};
  }
  for (const ClipPlane& plane : clip.planes) {
    const dvec3 normal = point(plane[0], plane[1], plane[2]);
    result.planes.push_back({normal.x, normal.y, normal.z, plane[3]});
  }
  return result;
}

void clip_rows(Ui& ui, settings::Clip& clip, const std::optional<Box>& box) {
  const Box whole = whole_of(box);
  bool clipped = clip.box.has_value();
  if (ui.checkbox("Clip box", "Shows only the part of the volume in a box. Drag the faces of the box in the image.",
                  clipped)) {
    clip.box.reset();
    if (clipped) clip.box = {whole.least.x, whole.least.y, whole.least.z, whole.most.x, whole.most.y, whole.most.z};
  }
  if (clip.box) box_rows(ui, *clip.box, whole);
  plane_rows(ui, clip, whole);
}

}  // namespace cumulet::demo
