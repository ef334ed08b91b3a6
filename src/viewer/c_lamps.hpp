#pragma once

// Lights of the C ABI.

#include "light/lamps.hpp"
#include "viewer/c_settings.hpp"

namespace cumulet::c_abi {

/// Converts light descriptors; lights without power are left out. Throws Error(invalid_argument) with the light and the
/// field.
light::Lamps lamps_of(const cumulet_lamp_desc* lamps, uint64_t count);

}  // namespace cumulet::c_abi
