#include "first_view.hpp"

#include <cmath>
#include <numbers>

namespace cumulet::demo {
namespace {

constexpr double radian = std::numbers::pi / 180.0;
constexpr double azimuth = -40.0 * radian;  // from +Z towards +X; the default sun is at 65 degrees
constexpr double elevation = 20.0 * radian;

}  // namespace

void turn_to_first_view(cumulet_viewer* viewer) {
  cumulet_camera* camera = nullptr;
  if (cumulet_get_camera(viewer, &camera) != CUMULET_OK) return;
  const double placed_elevation = std::atan(0.2);
  const cumulet_status turned = cumulet_camera_orbit(camera, azimuth, elevation - placed_elevation);
  cumulet_camera_release(camera);
  if (turned == CUMULET_OK) static_cast<void>(cumulet_frame_all(viewer));  // fails without a scene
}

}  // namespace cumulet::demo
