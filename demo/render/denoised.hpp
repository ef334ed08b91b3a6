#pragma once

#include <cumulet/cumulet.h>

#include <cstddef>
#include <string>
#include <vector>

namespace cumulet::demo {

/// Returns the default folder of the denoiser networks: $CUMULET_OIDN_WEIGHTS, else cumulet/oidn below $XDG_DATA_HOME,
/// else below ~/.local/share; "" if none of these is set. scripts/install_oidn_weights.sh installs the networks there.
[[nodiscard]] std::string denoiser_folder();

/// Returns the path of the network in `folder`; "": in denoiser_folder(). Throws std::runtime_error, one line, if the
/// file does not exist.
[[nodiscard]] std::string find_network(const std::string& folder);

/// Returns the viewer's image, denoised with the given network. "": with the library's own filter. `floats`: size of
/// the image, 4 per pixel. Throws std::runtime_error, one line, on failure.
[[nodiscard]] std::vector<float> denoised(cumulet_viewer* viewer, const std::string& network, std::size_t floats);

}  // namespace cumulet::demo
