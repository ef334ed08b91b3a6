#include "first_view.hpp"

#include <algorithm>
#include <numbers>

namespace cumulet::demo {
namespace {

constexpr double azimuth = -40.0 * std::numbers::pi / 180.0;  // from +Z towards +X; the default sun is at 65 degrees

}  // namespace

bool fits(const cumulet_camera_desc& camera) { return std::equal(camera.eye, camera.eye + 3, camera.target); }

void turn_to_first_view(cumulet_viewer* viewer) {
  cumulet_camera* camera = nullptr;
  if (cumulet_get_camera(viewer, &camera) != CUMULET_OK) return;
  // The library's elevation of 11 degrees stays: with more, the picture has no horizon and no sky.
  const cumulet_status turned = cumulet_camera_orbit(camera, azimuth, 0.0);
  cumulet_camera_release(camera);
  if (turned == CUMULET_OK) static_cast<void>(cumulet_frame_all(viewer));  // fails without a scene
}

}  // namespace cumulet::demo
