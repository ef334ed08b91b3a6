#pragma once

#include <cumulet/cumulet.h>

#include <cstdint>
#include <layers.hpp>
#include <scene_file.hpp>
#include <vector>

namespace cumulet::demo {

/// Returns the OpenEXR attributes of the viewer's image of this scene, width x height: settings, camera and noise.
/// docs/aovs.md describes each. They contain no date and no host name, so that equal images give equal files. Call
/// after the image was read back: the noise is the last measured value. Throws std::runtime_error, one line, if the
/// viewer refuses a read.
[[nodiscard]] std::vector<image::Attribute> metadata_of(cumulet_viewer* viewer, const SceneOptions& scene,
                                                        std::uint32_t width, std::uint32_t height);

/// Returns the attributes of a camera with the matrices of cumulet_camera_get_matrices: worldToCamera, worldToNDC, and
/// for a perspective camera the screen window.
[[nodiscard]] std::vector<image::Attribute> camera_metadata(const double view[16], const double projection[16]);

/// Returns the name of the grid type in flags and scene files.
[[nodiscard]] const char* grid_type_name(cumulet_grid_type type);
/// Returns the name of the density in cells, as in flags.
[[nodiscard]] const char* cells_name(cumulet_cell_density cells);
/// Returns the name of an interpolation between voxels, as in flags.
[[nodiscard]] const char* interpolation_name(cumulet_interpolation interpolation);

}  // namespace cumulet::demo
