#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "volume/memory.hpp"
#include "volume/volume.hpp"

namespace cumulet::volume {

/// Maximum speed along an axis, in voxels per second: the largest half float.
inline constexpr double fastest_velocity = 65504.0;

/// A velocity field.
struct Velocity {
  /// Positive and negative part of the x component, then of y and of z.
  std::array<ScalarVolume, 6> parts;
  /// Velocity along the lattice's axes in voxels per second = to_index * (x, y, z).
  glm::dmat3 to_index{1.0};

  /// Returns to_index for velocities in world units per second along the world's axes.
  [[nodiscard]] static glm::dmat3 to_index_of(const glm::dmat4& index_to_world) {
    return glm::inverse(glm::dmat3(index_to_world));
  }
  /// Returns the limit for each component at which no speed exceeds fastest_velocity.
  [[nodiscard]] float most() const;
};

/// Temperatures of simulations are about 0 to 3; fields with larger values than this are taken as kelvin.
inline constexpr float max_relative_temperature = 20.0F;
/// Returns kelvin per unit of a temperature field with this maximum: 1 if its values are kelvin, else 1500.
constexpr double temperature_scale_of(float max_value) { return max_value > max_relative_temperature ? 1.0 : 1500.0; }

/// The fields of one file, all on one lattice: they have the same index_to_world, and voxel (i,j,k) of each is at the
/// same position. Bounds and bricks differ between fields.
struct VolumeFrame {
  ScalarVolume density;                                   ///< empty if the file has none
  std::optional<ScalarVolume> temperature = {};           ///< in the file's unit: 0 to 3, as in simulations, or kelvin
  std::optional<ScalarVolume> flame = {};                 ///< amount that burns
  std::optional<std::array<ScalarVolume, 3>> color = {};  ///< scattering color: linear Rec. 709; red, green, blue
  /// The mean cosine of scattering, from -1 to 1: its positive and its negative part.
  std::optional<std::array<ScalarVolume, 2>> anisotropy = {};
  std::optional<Velocity> velocity = {};
  /// Kelvin per unit of temperature for the whole sequence; empty: derived from this frame's values.
  std::optional<double> temperature_scale = {};

  /// Returns all scalar volumes of the fields other than density.
  [[nodiscard]] std::vector<const ScalarVolume*> beside_density() const;
  [[nodiscard]] std::vector<ScalarVolume*> beside_density();
  /// Returns density, followed by beside_density().
  [[nodiscard]] std::vector<const ScalarVolume*> fields() const;
  [[nodiscard]] std::vector<ScalarVolume*> fields();
};

/// Names of a file's grids for each field. "none" leaves a field out. Empty: the first match among the names below,
/// except a grid that is named for another field. A name in this case is preferred to the same name in another case.
struct GridNames {
  /// density, smoke, soot; if the file has none of density, temperature and flame, the grid that import_volume reads.
  std::string density = {};
  /// temperature, heat, temp.
  std::string temperature = {};
  /// flame, flames, fire, burn, fuel.
  std::string flame = {};
  /// cd, color, colour: a grid of float vectors that is not staggered. Three scalar grids are read only if they are
  /// named explicitly, "color" for "color_r", "color_g" and "color_b": Mantaflow writes color times density there,
  /// because it advects them. They are used unchanged, as in Cycles.
  std::string color = {};
  /// anisotropy, scatter_anisotropy, phase_anisotropy, phase_g.
  std::string anisotropy = {};
  /// velocity, vel, v: a vector grid, staggered or not, or three scalar grids with x, y and z appended to the name,
  /// optionally after "_" or "."; else a staggered vector grid of any name.
  std::string velocity = {};
};

/// Returns the field of each grid of a file when no names are given: "density", "temperature", "flame", "color",
/// "anisotropy", "velocity", or "" for none.
std::vector<std::string> channels_by_name(const std::vector<GridInfo>& grids);

/// Reads the fields of a .vdb or .nvdb file, each as import_volume reads a grid.
///
/// The lattice is that of density. Without density it is that of temperature or flame: the one with smaller voxels, or
/// else with more active voxels. Such a file then renders as fire. A field whose voxel positions agree to a thousandth
/// of a voxel is used unchanged. Other fields are resampled: a voxel is the trilinear interpolation between voxel
/// centers, at the center of that voxel. If a lattice step is more than 1.5 of the field's voxels, it is the mean of
/// interpolations at equal distances within the voxel. Per axis their number is the field's voxels per step, at most 8.
/// Outside of the field's bounds the value is 0, and it falls off to 0 within one of the field's voxels. Voxels that
/// are not 0 become active. Offsets by whole voxels thus preserve values exactly. Errors: a field that would fill more
/// than 2^21 bricks of the lattice, and voxels smaller than 1/64 of the lattice's.
///
/// A component of a staggered grid is located half a voxel below the voxel's center along its own axis, and is
/// resampled from there. Velocities are in world units per second along the axes of the file's world. Exception: grids
/// whose metadata declare local space (is_local_space and vector_type contravariant) are in their own voxels per second
/// along their own axes. Speeds are clamped to 65504 lattice voxels per second. If there is density, velocity is kept
/// within the box of its active voxels, enlarged by one voxel, in whole bricks; elsewhere it may be missing.
///
/// Throws Error(file) as import_volume does, and also if a named grid is missing or if all fields are left out. A
/// velocity that was not named explicitly is left out if it fails, with a warning that gives the reason. Warnings:
/// those of import_volume; grids that are not used; grids that match a field's name as well as the chosen one;
/// temperature, color, anisotropy or velocity that does not overlap density; anisotropy that is clamped to -1 and 1;
/// velocities that are clamped. An info message reports color in three grids that is not read. Another one reports
/// temperatures that are taken as kelvin, or that look like degrees Celsius or like a range from 0 to 1.
VolumeFrame import_frame(const FilePath& file, const GridNames& names, const Log& log, Progress* progress = nullptr);

/// Imports fields in memory that check_fields() accepts; they are copied. Velocities are in world units per second
/// along the world's axes. name: prefix of every message. Throws Error(file), also for an invalid velocity.
VolumeFrame import_fields(std::span<const MemoryField> fields, const std::string& name, const Log& log,
                          Progress* progress = nullptr);

}  // namespace cumulet::volume
