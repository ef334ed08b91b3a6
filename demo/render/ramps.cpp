#include "ramps.hpp"

#include <cstddef>

namespace cumulet::demo {

cumulet_status set_ramps(cumulet_viewer* viewer, const SceneVolume& volume) {
  cumulet_status status = CUMULET_OK;
  for (std::size_t i = 0; i < volume.ramps.size() && status == CUMULET_OK; ++i) {
    const auto& points = volume.ramps[i];
    status = cumulet_set_ramp(viewer, static_cast<cumulet_ramp>(i), settings::numbers_of(points), points.size());
  }
  for (std::size_t i = 0; i < volume.color_ramps.size() && status == CUMULET_OK; ++i) {
    const auto& stops = volume.color_ramps[i];
    status = cumulet_set_color_ramp(viewer, static_cast<cumulet_ramp>(i), settings::numbers_of(stops), stops.size());
  }
  return status;
}

}  // namespace cumulet::demo
