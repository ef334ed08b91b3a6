#pragma once

#include <cumulet/cumulet.h>

#include <cstddef>
#include <string>
#include <vector>

namespace cumulet::demo {

/// Where networks are looked for that no flag names: $CUMULET_OIDN_WEIGHTS, else cumulet/oidn below $XDG_DATA_HOME,
/// else below ~/.local/share; "" if there is none of these. scripts/install_oidn_weights.sh puts them there.
[[nodiscard]] std::string denoiser_folder();

/// Throws std::runtime_error, one line, unless the network is in that folder; "": denoiser_folder().
void check_denoiser(const std::string& folder);

/// The viewer's picture of so many floats, denoised by the network in that folder. Throws std::runtime_error, one line,
/// if it cannot be.
[[nodiscard]] std::vector<float> denoised(cumulet_viewer* viewer, const std::string& folder, std::size_t floats);

}  // namespace cumulet::demo
