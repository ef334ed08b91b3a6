#pragma once

// import_gltf() for bytes in memory.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "surface/gltf_limits.hpp"
#include "surface/scene.hpp"

namespace cumulet::surface {

/// Imports the bytes of a .gltf or .glb, like import_gltf(path). `label` replaces the path in errors and log lines.
/// Referenced files are looked up relative to `folder`; without a folder they are refused.
ScenePtr import_gltf(std::vector<std::uint8_t> bytes, const std::string& label,
                     const std::optional<std::filesystem::path>& folder, const Log& log, Progress* progress = nullptr,
                     const GltfLimits& limits = {});

}  // namespace cumulet::surface
