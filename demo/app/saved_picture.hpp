#pragma once

#include <cumulet/cumulet.h>

#include <cstdint>
#include <scene_file.hpp>
#include <string>

namespace cumulet::demo {

/// Returns true if the displayed image has this size and is not a preview: each pixel has a sample.
[[nodiscard]] bool is_whole(const cumulet_frame_result& shown, std::uint32_t width, std::uint32_t height);

/// Writes the displayed image to a PNG file. Throws std::runtime_error, one line.
void save_png(cumulet_viewer* viewer, const SceneOptions& scene, const cumulet_frame_result& shown,
              const std::string& path);

/// Writes linear radiance and AOVs to an OpenEXR file, as described in docs/aovs.md. Debug views have no AOVs. Throws
/// std::runtime_error, one line.
void save_exr(cumulet_viewer* viewer, const SceneOptions& scene, const cumulet_frame_result& shown,
              const std::string& path);

}  // namespace cumulet::demo
