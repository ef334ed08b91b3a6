#pragma once

#include <cumulet/cumulet.h>

#include <cstddef>
#include <string>
#include <vector>

namespace cumulet::demo {

/// Where networks are looked for that no flag names: $CUMULET_OIDN_WEIGHTS, else cumulet/oidn below $XDG_DATA_HOME,
/// else below ~/.local/share; "" if there is none of these. scripts/install_oidn_weights.sh puts them there.
[[nodiscard]] std::string denoiser_folder();

/// The network in that folder; "": in denoiser_folder(). Throws std::runtime_error, one line, if it is not there.
[[nodiscard]] std::string find_network(const std::string& folder);

/// The viewer's picture of so many floats, denoised by that network; "": by the library's own filter. Throws
/// std::runtime_error, one line, if it cannot be.
[[nodiscard]] std::vector<float> denoised(cumulet_viewer* viewer, const std::string& network, std::size_t floats);

}  // namespace cumulet::demo
