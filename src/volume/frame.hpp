#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>

#include "volume/volume.hpp"

namespace cumulet::volume {

/// The fields of one file, all on one lattice: each has the same index_to_world, and voxel (i,j,k) of each is the same
/// place. Bounds and bricks are each field's own.
struct VolumeFrame {
  ScalarVolume density;                               ///< empty where the file has none
  std::optional<ScalarVolume> temperature;            ///< in the file's unit: 0 to 3, as simulations have it, or kelvin
  std::optional<ScalarVolume> flame;                  ///< how much burns there
  std::optional<std::array<ScalarVolume, 3>> colour;  ///< of what scatters: linear Rec. 709
};

/// Which grids of a file are which field. Empty: by name; "none": the field is left out.
struct GridNames {
  std::string density;
  std::string temperature;
  std::string flame;
  std::string colour;  ///< a grid of vectors, or of "colour" the three "colour_r", "colour_g", "colour_b"
};

/// Reads what import_volume does, and what belongs to it.
VolumeFrame import_frame(const std::filesystem::path& file, const GridNames& names, const Log& log,
                         Progress* progress = nullptr);

}  // namespace cumulet::volume
