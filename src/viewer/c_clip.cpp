// Clips of volumes in the C ABI. cumulet.h documents the calls.

#include "viewer/c_clip.hpp"

#include <string>

#include "scene/instances.hpp"
#include "settings/clip.hpp"
#include "viewer/c_support.hpp"
#include "viewer/c_viewer.hpp"

namespace cumulet::c_abi {

static_assert(6 + CUMULET_CLIP_PLANES <= scene::max_clip_planes);

scene::ClipPlanes clip_planes_of(const cumulet_clip_desc* desc) {
  scene::ClipPlanes planes;
  if (desc == nullptr) return planes;
  const cumulet_clip_desc d = read_desc(desc, "cumulet_clip_desc");
  const auto accept = [](const std::string& what, const std::string& why) {
    if (!why.empty()) refuse("cumulet_clip_desc" + what + ' ' + why);
  };
  require(d.box == 0 || d.box == 1, "cumulet_clip_desc.box is not 0 or 1");
  if (d.box == 1) {
    accept("'s box", settings::clip_box_refusal(
                         {d.box_min[0], d.box_min[1], d.box_min[2], d.box_max[0], d.box_max[1], d.box_max[2]}));
    for (int axis = 0; axis < 3; ++axis) {
      glm::dvec4 low(0.0, 0.0, 0.0, -d.box_min[axis]);
      glm::dvec4 high(0.0, 0.0, 0.0, d.box_max[axis]);
      low[axis] = 1.0;
      high[axis] = -1.0;
      planes.push_back(low);
      planes.push_back(high);
    }
  }
  accept("", settings::clip_count_refusal(d.plane_count));
  const std::span<const double> given = array_of(d.planes, d.plane_count, 4, "cumulet_clip_desc.planes");
  for (std::size_t i = 0; i < given.size(); i += 4) {
    const settings::ClipPlane plane{given[i], given[i + 1], given[i + 2], given[i + 3]};
    accept(": plane " + std::to_string(i / 4), settings::clip_plane_refusal(plane));
    planes.emplace_back(plane[0], plane[1], plane[2], plane[3]);
  }
  return planes;
}

}  // namespace cumulet::c_abi

cumulet_status cumulet_set_clip(cumulet_viewer* viewer, const cumulet_clip_desc* desc) {
  using namespace cumulet::c_abi;
  return with_state(viewer, [&](cumulet::viewer::Viewer& v) { v.set_clip(clip_planes_of(desc)); });
}
