#include "denoised.hpp"

#include <filesystem>
#include <program.hpp>
#include <stdexcept>

namespace cumulet::demo {

namespace {

// The network for HDR color with noise-free albedo and normals: the guides are rendered without noise.
constexpr const char* network_name = "rt_hdr_calb_cnrm.tza";

}  // namespace

std::string denoiser_folder() {
  if (std::string named = environment_variable("CUMULET_OIDN_WEIGHTS"); !named.empty()) return named;
  const std::string data = user_folder("XDG_DATA_HOME", ".local/share");
  return data.empty() ? "" : data + "/cumulet/oidn";
}

std::string find_network(const std::string& folder) {
  const std::string in = folder.empty() ? denoiser_folder() : folder;
  if (in.empty()) throw std::runtime_error("no folder with Open Image Denoise networks: see --oidn-weights");
  std::string file = in + "/" + network_name;
  if (!std::filesystem::is_regular_file(file)) {
    throw std::runtime_error(file + ": network not found: see --oidn-weights and scripts/install_oidn_weights.sh");
  }
  return file;
}

Denoiser find_denoiser(const std::string& folder, const std::string& library, std::string& note) {
  Denoiser denoiser;
  const std::string named = library.empty() ? environment_variable("CUMULET_OIDN_LIBRARY") : library;
  if (named != "off") denoiser.library = named;
  try {
    denoiser.network = find_network(folder);
  } catch (const std::exception& error) {
    const char* const instead = denoiser.library ? " unless the library of Open Image Denoise can be used: " : ": ";
    note = std::string("using the fast filter") + instead + error.what();
  }
  return denoiser;
}

std::vector<float> denoised(cumulet_viewer* viewer, const Denoiser& denoiser, std::size_t floats) {
  cumulet_denoise_desc desc{};
  desc.struct_size = sizeof desc;
  if (!denoiser.network.empty()) desc.network = denoiser.network.c_str();
  if (denoiser.library) desc.oidn_library = denoiser.library->c_str();
  std::vector<float> rgba(floats);
  if (cumulet_read_denoised(viewer, &desc, rgba.data(), rgba.size()) != CUMULET_OK) {
    throw std::runtime_error(cumulet_last_error(viewer));
  }
  return rgba;
}

}  // namespace cumulet::demo
