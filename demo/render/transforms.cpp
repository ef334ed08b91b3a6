#include "transforms.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace cumulet::demo {

cumulet_status set_transforms(cumulet_viewer* viewer, const SceneOptions& scene) {
  const double* first = scene.transforms.empty() ? nullptr : scene.transforms.front().data();
  const cumulet_status status =
      cumulet_set_volume_transforms(viewer, first, static_cast<std::uint32_t>(scene.transforms.size()));
  if (status != CUMULET_OK || !scene.shutter.moves()) return status;
  const std::size_t count = std::max<std::size_t>(scene.transforms.size(), 1);
  std::vector<double> open;
  std::vector<double> close;
  for (std::size_t i = 0; i < count; ++i) {
    double transform[16] = {};
    double at_open[16];
    double at_close[16];
    if (!scene.transforms.empty()) std::ranges::copy(scene.transforms[i], transform);
    set_shutter(scene.shutter, transform, at_open, at_close);
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
