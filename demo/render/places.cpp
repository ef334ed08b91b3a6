#include "places.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace cumulet::demo {

cumulet_status set_places(cumulet_viewer* viewer, const SceneOptions& scene) {
  const double* first = scene.places.empty() ? nullptr : scene.places.front().data();
  const cumulet_status status =
      cumulet_set_volume_transforms(viewer, first, static_cast<std::uint32_t>(scene.places.size()));
  if (status != CUMULET_OK || !scene.shutter.moves()) return status;
  const std::size_t count = std::max<std::size_t>(scene.places.size(), 1);
  std::vector<double> open;
  std::vector<double> close;
  for (std::size_t i = 0; i < count; ++i) {
    double place[16] = {};
    double at_open[16];
    double at_close[16];
    if (!scene.places.empty()) std::ranges::copy(scene.places[i], place);
    set_shutter(scene.shutter, place, at_open, at_close);
    open.insert(open.end(), at_open, at_open + 16);
    close.insert(close.end(), at_close, at_close + 16);
  }
  return cumulet_set_volume_shutter_transforms(viewer, open.data(), close.data(), static_cast<std::uint32_t>(count));
}

cumulet_status set_camera(cumulet_camera* camera, const SceneOptions& scene) {
  const auto end = [](const auto& desc) { return desc ? &*desc : nullptr; };
  const cumulet_status status = cumulet_camera_set(camera, &scene.camera);
  if (status != CUMULET_OK || !(scene.camera_open || scene.camera_close)) return status;
  return cumulet_camera_set_shutter(camera, end(scene.camera_open), end(scene.camera_close));
}

}  // namespace cumulet::demo
