#pragma once

// Analytic lights of the C ABI.

#include "light/analytic_lights.hpp"
#include "viewer/c_settings.hpp"

namespace cumulet::c_abi {

/// Converts descriptors of analytic lights; lights without power are left out. Throws Error(invalid_argument) with the
/// light and the field.
light::AnalyticLights analytic_lights_of(const cumulet_light_desc* analytic_lights, uint64_t count);

}  // namespace cumulet::c_abi
