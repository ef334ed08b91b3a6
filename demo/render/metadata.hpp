#pragma once

#include <cumulet/cumulet.h>

#include <cstdint>
#include <layers.hpp>
#include <scene_file.hpp>
#include <vector>

namespace cumulet::demo {

/// What an OpenEXR file says of the picture that the viewer has of this scene, width x height: how it was made, by
/// which camera, and how much noise it has. docs/aovs.md names each. No date and no name of a machine: the same picture
/// is the same file. Of a picture that was read back: the noise is as of then. Throws std::runtime_error, one line, for
/// what the viewer refuses.
[[nodiscard]] std::vector<image::Attribute> metadata_of(cumulet_viewer* viewer, const SceneOptions& scene,
                                                        std::uint32_t width, std::uint32_t height);

/// Of a camera, by its matrices as cumulet_camera_get_matrices gives them: worldToCamera, worldToNDC, and the window of
/// one that is no orthographic one.
[[nodiscard]] std::vector<image::Attribute> camera_metadata(const double view[16], const double projection[16]);

/// As flags and scene files call it.
[[nodiscard]] const char* march_name(cumulet_march march);

}  // namespace cumulet::demo
