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
  ScalarVolume density;                          ///< empty where the file has none
  std::optional<ScalarVolume> temperature = {};  ///< in the file's unit: 0 to 3, as simulations have it, or kelvin
  std::optional<ScalarVolume> flame = {};        ///< how much burns there
  std::optional<std::array<ScalarVolume, 3>> colour = {};  ///< of what scatters: linear Rec. 709; red, green, blue
};

/// Which grids of a file are which field. "none" leaves a field out. Empty: the scalar fog grid whose name, in whatever
/// case, comes first among these, but for grids that are named for another field:
/// - density: density, smoke, soot; of a file without all of density, temperature and flame what import_volume reads;
/// - temperature: temperature, heat, temp;
/// - flame: flame, flames, fire, burn, fuel;
/// - colour: cd_, color_, colour_, followed by r, g and b: three grids.
struct GridNames {
  std::string density = {};
  std::string temperature = {};
  std::string flame = {};
  std::string colour = {};  ///< of "colour" the grids "colour_r", "colour_g" and "colour_b"
};

/// Reads the fields of a .vdb or .nvdb file, each as import_volume reads a grid.
///
/// The lattice is density's; without density, that of temperature or flame, whichever has the smaller voxels or else
/// more active ones, so that such a file renders as fire. A field whose voxels are in the same places, to a thousandth
/// of a voxel, is taken as it is. Another one is resampled: a voxel is its trilinear interpolation between voxel
/// centres, at the centre of that voxel; where a step of the lattice is more than 1.5 of the field's voxels, the mean
/// of interpolations at equal distances within the voxel, an axis one for every voxel of the field in a step, 8 at
/// most. Beyond the field's bounds stands 0, to which it falls off within one of its voxels. Active are then the voxels
/// that are not 0. Offsets of whole voxels so move values exactly.
///
/// Throws Error(file) as import_volume does, too for a name that the file does not have and where every field is left
/// out. Warnings: as import_volume's; the grids that are not shown; temperature or colour that lies nowhere over
/// density. An info tells of temperatures that seem to be kelvin, degrees Celsius, or from 0 to 1.
VolumeFrame import_frame(const std::filesystem::path& file, const GridNames& names, const Log& log,
                         Progress* progress = nullptr);

}  // namespace cumulet::volume
