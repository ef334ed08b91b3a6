#pragma once

#include <cumulet/cumulet.h>

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace cumulet::demo {

/// Returns the default folder of the denoiser networks: $CUMULET_OIDN_WEIGHTS, else cumulet/oidn below $XDG_DATA_HOME,
/// else below ~/.local/share; "" if none of these is set. scripts/install_oidn_weights.sh installs the networks there.
[[nodiscard]] std::string denoiser_folder();

/// Returns the path of the network in `folder`; "": in denoiser_folder(). Throws std::runtime_error, one line, if the
/// file does not exist.
[[nodiscard]] std::string find_network(const std::string& folder);

/// The denoiser of an image. Without both members it is the filter of the Cumulet library.
struct Denoiser {
  std::string network = {};                 ///< path; "": none
  std::optional<std::string> library = {};  ///< as cumulet_denoise_desc::oidn_library
};

/// Returns the denoiser of --denoise high. folder: of the networks, as for find_network. library: a file of Open Image
/// Denoise's library or "off"; "": $CUMULET_OIDN_LIBRARY, else the installed one. note: receives a line if there is no
/// network.
[[nodiscard]] Denoiser find_denoiser(const std::string& folder, const std::string& library, std::string& note);

/// Returns the viewer's denoised image. `floats`: size of the image, 4 per pixel. Throws std::runtime_error, one line,
/// on failure.
[[nodiscard]] std::vector<float> denoised(cumulet_viewer* viewer, const Denoiser& denoiser, std::size_t floats);

}  // namespace cumulet::demo
