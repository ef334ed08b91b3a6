#pragma once

// import_gltf() for bytes in memory.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "surface/scene.hpp"

namespace cumulet::surface {

/// How much a file may ask for. What would exceed it is refused before it is allocated.
struct GltfLimits {
  std::uint64_t memory = std::uint64_t{16} << 30U;   ///< bytes, of all decoded data together
  std::uint64_t unbacked = std::uint64_t{1} << 24U;  ///< elements of an accessor that has no buffer view
  std::uint32_t image_side = 16384;                  ///< pixels
};

/// As import_gltf(path), of the bytes of a .gltf or .glb. `label` stands for the path in errors and log lines; files
/// that it refers to are looked for relative to `folder`; without one they are refused.
ScenePtr import_gltf(std::vector<std::uint8_t> bytes, const std::string& label,
                     const std::optional<std::filesystem::path>& folder, const Log& log, Progress* progress = nullptr,
                     const GltfLimits& limits = {});

}  // namespace cumulet::surface
