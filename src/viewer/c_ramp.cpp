// Ramps and color ramps of a viewer in the C ABI.

#include "viewer/c_ramp.hpp"

#include <utility>

#include "viewer/c_viewer.hpp"

using namespace cumulet::c_abi;
namespace core = cumulet::viewer;

cumulet_status cumulet_set_ramp(cumulet_viewer* viewer, cumulet_ramp ramp, const float* points, uint64_t count) {
  return with_state(viewer, [&](core::Viewer& v) {
    auto read = read_ramp(ramp, points, count);
    core::Ramps ramps = v.ramps();
    ramps.*read.target = std::move(read.ramp);
    v.set_ramps(ramps);
  });
}

cumulet_status cumulet_set_color_ramp(cumulet_viewer* viewer, cumulet_ramp ramp, const float* stops, uint64_t count) {
  return with_state(viewer, [&](core::Viewer& v) {
    auto read = read_color_ramp(ramp, stops, count);
    core::Ramps ramps = v.ramps();
    ramps.*read.target = std::move(read.ramp);
    v.set_ramps(ramps);
  });
}
