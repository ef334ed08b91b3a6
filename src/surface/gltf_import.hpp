#pragma once

// import_gltf() for bytes in memory.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "surface/scene.hpp"

namespace cumulet::surface {

/// Limits on the size of a file's contents. Larger requests are refused before allocation.
struct GltfLimits {
  std::uint64_t memory = std::uint64_t{16} << 30U;   ///< bytes, total of all decoded data
  std::uint64_t unbacked = std::uint64_t{1} << 24U;  ///< elements of an accessor that has no buffer view
  std::uint32_t image_side = 16384;                  ///< pixels
};

/// Imports the bytes of a .gltf or .glb, like import_gltf(path). `label` replaces the path in errors and log lines.
/// Referenced files are looked up relative to `folder`; without a folder they are refused.
ScenePtr import_gltf(std::vector<std::uint8_t> bytes, const std::string& label,
                     const std::optional<std::filesystem::path>& folder, const Log& log, Progress* progress = nullptr,
                     const GltfLimits& limits = {});

}  // namespace cumulet::surface
