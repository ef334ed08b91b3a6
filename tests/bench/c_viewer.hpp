#pragma once

#include <stdexcept>

#include "support/c_host.hpp"

/// Viewers for benchmarks that are hosts using only cumulet.h.
namespace cumulet::bench {

/// Throws std::runtime_error.
inline void must(cumulet_viewer* viewer, cumulet_status status) {
  if (status != CUMULET_OK) throw std::runtime_error(cumulet_last_error(viewer));
}

inline cumulet_sun_sky_desc daylight() {
  auto light = test::make_desc<cumulet_sun_sky_desc>();
  light.sun_elevation_degrees = 40.0F;
  for (float& value : light.sun_irradiance) value = 2.5F;
  for (float& value : light.sky_radiance) value = 0.3F;
  return light;
}

/// A viewer in daylight with the library's defaults, except that voxels are cubes as in older results.
inline test::ViewerPtr make_viewer(headless::Context& context) {
  auto create = test::make_desc<cumulet_create_desc>();
  create.get_proc = headless::Context::get_proc;
  create.get_proc_user = &context;
  test::ViewerPtr viewer = test::make_plain_viewer(create);
  const cumulet_sun_sky_desc light = daylight();
  must(viewer.get(), cumulet_set_sun_sky(viewer.get(), &light));
  auto grid = test::make_desc<cumulet_grid_desc>();
  grid.interpolation = CUMULET_INTERPOLATION_NEAREST;
  must(viewer.get(), cumulet_set_grid(viewer.get(), &grid));
  return viewer;
}

}  // namespace cumulet::bench
