#pragma once

#include <cumulet/cumulet.h>

#include <cstdint>
#include <instances.hpp>
#include <scene_file.hpp>
#include <string>

#include "picture_job.hpp"

namespace cumulet::demo {

/// Returns true if the displayed image has this size and is not a preview: each pixel has a sample.
[[nodiscard]] bool is_whole(const cumulet_frame_result& shown, std::uint32_t width, std::uint32_t height);

/// Writes the shown picture to a PNG file, as it is displayed. Returns a note of one line if pixels are brighter than
/// PNG's straight alpha can hold, else "". Throws std::runtime_error, one line.
[[nodiscard]] std::string save_png(cumulet_viewer* viewer, const SceneOptions& scene, const cumulet_frame_result& shown,
                                   const std::string& path);

/// Writes the shown picture to an EXR file in linear radiance, with the layers that docs/aovs.md lists. Debug views
/// have no layers. Throws std::runtime_error, one line.
void save_exr(cumulet_viewer* viewer, const SceneOptions& scene, const cumulet_frame_result& shown,
              const std::string& path);

/// Writes the viewer's picture to a file with the chosen format, layers and denoising. others: the further volumes, as
/// shown by the viewer. Returns a note of one line, or "". Throws std::runtime_error, one line.
[[nodiscard]] std::string write_picture_file(cumulet_viewer* viewer, const SceneOptions& scene, const Instances& others,
                                             const cumulet_frame_result& shown, const PictureFile& file);

}  // namespace cumulet::demo
