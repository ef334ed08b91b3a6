#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "volume/memory.hpp"
#include "volume/volume.hpp"

namespace cumulet::volume {

/// Voxels a second, along an axis: the most that a half float holds.
inline constexpr double fastest_velocity = 65504.0;

/// How matter moves.
struct Velocity {
  /// Along x: how far it is above 0, and how far below; along y, and along z.
  std::array<ScalarVolume, 6> parts;
  /// Voxels a second along the lattice's axes = to_index * (x, y, z).
  glm::dmat3 to_index{1.0};

  /// Of velocities in world units a second along the world's axes.
  [[nodiscard]] static glm::dmat3 to_index_of(const glm::dmat4& index_to_world) {
    return glm::inverse(glm::dmat3(index_to_world));
  }
  /// No component as given is more: nothing is then faster than fastest_velocity.
  [[nodiscard]] float most() const;
};

/// Temperatures that simulations write are 0 to 3 or so; more than this are kelvin.
inline constexpr float max_relative_temperature = 20.0F;
/// Kelvin where a temperature field is 1, by the most that it reaches: 1 where its values are kelvin, else 1500.
constexpr double temperature_scale_of(float max_value) { return max_value > max_relative_temperature ? 1.0 : 1500.0; }

/// The fields of one file, all on one lattice: each has the same index_to_world, and voxel (i,j,k) of each is the same
/// place. Bounds and bricks are each field's own.
struct VolumeFrame {
  ScalarVolume density;                          ///< empty where the file has none
  std::optional<ScalarVolume> temperature = {};  ///< in the file's unit: 0 to 3, as simulations have it, or kelvin
  std::optional<ScalarVolume> flame = {};        ///< how much burns there
  std::optional<std::array<ScalarVolume, 3>> colour = {};  ///< of what scatters: linear Rec. 709; red, green, blue
  /// The mean cosine of what scatters, from -1 to 1: how far it is above 0, and how far below.
  std::optional<std::array<ScalarVolume, 2>> anisotropy = {};
  std::optional<Velocity> velocity = {};
  /// Kelvin where temperature is 1, which the sequence that this is part of has in common; nothing: by its own values.
  std::optional<double> temperature_scale = {};

  /// All that the fields beside density are made of.
  [[nodiscard]] std::vector<const ScalarVolume*> beside_density() const;
  [[nodiscard]] std::vector<ScalarVolume*> beside_density();
  /// Density, and these.
  [[nodiscard]] std::vector<const ScalarVolume*> fields() const;
  [[nodiscard]] std::vector<ScalarVolume*> fields();
};

/// Which grids of a file are which field. "none" leaves a field out. Empty: the grid whose name comes first among those
/// below, but for one that is named for another field. A name in this case comes before the same name in another case.
struct GridNames {
  /// density, smoke, soot; of a file without any of density, temperature and flame, what import_volume reads.
  std::string density = {};
  /// temperature, heat, temp.
  std::string temperature = {};
  /// flame, flames, fire, burn, fuel.
  std::string flame = {};
  /// cd, color, colour, of vectors of floats that are not staggered. Three grids of numbers are read only if they are
  /// named, "color" for "color_r", "color_g" and "color_b": those that Mantaflow writes hold colour times density, as
  /// it advects them. They are taken as they are, as Cycles takes them.
  std::string colour = {};
  /// anisotropy, scatter_anisotropy, phase_anisotropy, phase_g.
  std::string anisotropy = {};
  /// velocity, vel, v: of vectors, staggered or not, or three grids of numbers with x, y and z behind that name, or
  /// behind "_" or "." after it; else a staggered grid of vectors, whatever its name.
  std::string velocity = {};
};

/// Which field each of a file's grids is where nothing is said of names: "density", "temperature", "flame", "color",
/// "anisotropy", "velocity", or "" for none.
std::vector<std::string> channels_by_name(const std::vector<GridInfo>& grids);

/// Reads the fields of a .vdb or .nvdb file, each as import_volume reads a grid.
///
/// The lattice is density's; without density, that of temperature or flame, whichever has the smaller voxels or else
/// more active ones, so that such a file renders as fire. A field whose voxels are in the same places, to a thousandth
/// of a voxel, is taken as it is. Another one is resampled: a voxel is its trilinear interpolation between voxel
/// centres, at the centre of that voxel; where a step of the lattice is more than 1.5 of the field's voxels, the mean
/// of interpolations at equal distances within the voxel, an axis one for every voxel of the field in a step, 8 at
/// most. Beyond the field's bounds stands 0, to which it falls off within one of its voxels. Active are then the voxels
/// that are not 0. Offsets of whole voxels so move values exactly. What would fill more than 2^21 bricks of the lattice
/// is refused, and voxels smaller than a 64th of the lattice's.
///
/// A component of a staggered grid lies half a voxel below the voxel's centre, along its own axis, and is resampled
/// from there. Velocities are world units a second along the axes of the file's world, but for those of a grid whose
/// metadata say that they are in local space (is_local_space) and change with it (vector_type contravariant): these are
/// its own voxels a second, along its own axes. More than 65504 voxels of the lattice a second count as that. Where
/// there is density, velocity is kept over the box of its active voxels and one voxel more, in whole bricks: elsewhere
/// it may be missing.
///
/// Throws Error(file) as import_volume does, too for a name that the file does not have and where every field is left
/// out; but a velocity that nobody named is left out where it fails, with a warning that says why. Warnings:
/// import_volume's; the grids that are not shown; grids that fit a field's name as well as the one that is read;
/// temperature, colour, anisotropy or velocity that lies nowhere over density; anisotropy beyond -1 and 1, which counts
/// as these; velocities that are clamped. An info tells of colour in three grids that is not read, and of temperatures
/// that are taken as kelvin, or seem to be degrees Celsius or from 0 to 1.
VolumeFrame import_frame(const FilePath& file, const GridNames& names, const Log& log, Progress* progress = nullptr);

/// The same of fields in memory, which check_fields() accepts and which are copied. Velocities are world units a second
/// along the world's axes. name begins every message. Throws Error(file), also of a velocity that cannot be had.
VolumeFrame import_fields(std::span<const MemoryField> fields, const std::string& name, const Log& log,
                          Progress* progress = nullptr);

}  // namespace cumulet::volume
