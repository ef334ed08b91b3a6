#pragma once

// Calls that change a camera.

#include <array>

#include "api_fuzz_arguments.hpp"
#include "unit/support/c_host.hpp"

namespace cumulet::fuzz {

/// Sets a valid camera except for its lens, which sometimes is valid too.
inline void focus_camera(Arguments& arguments, cumulet_camera* camera) {
  auto desc = test::make_desc<cumulet_camera_desc>();
  if (cumulet_camera_get(camera, &desc) != CUMULET_OK) fail("a camera that cannot be read");
  const bool right = arguments.input.ConsumeBool();
  desc.lens_radius =
      right ? arguments.input.ConsumeFloatingPointInRange(0.0, 2.0) : Arguments::bits<double>(arguments.number());
  desc.focus_distance =
      right ? arguments.input.ConsumeFloatingPointInRange(0.0, 50.0) : Arguments::bits<double>(arguments.number());
  if (cumulet_camera_set(camera, &desc) != CUMULET_OK) {
    if (right) fail("a lens that is right is refused");
    return;
  }
  auto seen = test::make_desc<cumulet_camera_desc>();
  if (cumulet_camera_get(camera, &seen) != CUMULET_OK || seen.lens_radius != desc.lens_radius ||
      seen.focus_distance != desc.focus_distance)
    fail("a lens that is not what it was set to");
}

/// Moves or sets the camera, with any numbers.
inline void steer_camera(Arguments& arguments, cumulet_camera* camera) {
  const double a = Arguments::bits<double>(arguments.number());
  const double b = Arguments::bits<double>(arguments.number());
  const double c = Arguments::bits<double>(arguments.number());
  std::array<double, 16> view{};
  std::array<double, 16> projection{};
  for (double& value : view) value = Arguments::bits<double>(arguments.number());
  for (double& value : projection) value = Arguments::bits<double>(arguments.number());
  const auto desc = arguments.described<cumulet_camera_desc>();
  const auto clip = static_cast<cumulet_clip_space>(arguments.input.ConsumeIntegralInRange(0, 1));
  switch (arguments.input.ConsumeIntegralInRange(0, 10)) {
    case 0:
      cumulet_camera_orbit(camera, a, b);
      break;
    case 1:
      cumulet_camera_look(camera, a, b);
      break;
    case 2:
      cumulet_camera_roll(camera, a);
      break;
    case 3:
      cumulet_camera_pan(camera, a, b);
      break;
    case 4:
      cumulet_camera_dolly(camera, a);
      break;
    case 5:
      cumulet_camera_fly(camera, a, b, c);
      break;
    case 6:
      cumulet_camera_set(camera, &desc);
      break;
    case 7:
      cumulet_camera_set_matrices(camera, view.data(), projection.data(), clip);
      break;
    case 8:
      cumulet_camera_get_matrices(camera, a, clip, view.data(), projection.data());
      break;
    case 9:
      cumulet_camera_set_shutter(camera, clip == CUMULET_CLIP_ZERO_TO_ONE ? &desc : nullptr, &desc);
      break;
    default:
      cumulet_camera_frame(camera, view.data(), projection.data(), a);
      break;
  }
  // In any state, it can be read and set again.
  auto read = test::make_desc<cumulet_camera_desc>();
  if (cumulet_camera_get(camera, &read) != CUMULET_OK) fail("a camera that cannot be read");
  for (const double value : read.eye) {
    if (value != value) fail("a camera at NaN");
  }
}

}  // namespace cumulet::fuzz
