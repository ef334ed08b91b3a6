#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/byte_source.hpp"
#include "base/file_path.hpp"
#include "base/log.hpp"
#include "base/progress.hpp"
#include "volume/frame.hpp"
#include "volume/memory.hpp"
#include "volume/proxy.hpp"
#include "volume/volume.hpp"

namespace cumulet::volume {

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
/// Like the other import_frame, for the content of a file. name: prefix of every message.
VolumeFrame import_frame(std::unique_ptr<ByteSource> content, const std::string& name, const GridNames& names,
                         const Log& log);

/// A file with this many bricks takes about a second of one core to load.
inline constexpr std::uint64_t worth_a_proxy = 50'000;

struct ProxyRequest {
  /// Called on the import's thread, at most once, before the full-resolution import. Its exceptions propagate.
  std::function<void(Proxy)> take;
  std::uint64_t min_bricks = worth_a_proxy;  ///< minimum bricks of the first field; smaller files get no proxy
};

/// Like the other import_frame, but makes a proxy first for a .vdb file of many bricks, which takes about a twentieth
/// of the time. There is no proxy for files from before OpenVDB 3, or if making it fails: errors of a file are reported
/// by the full-resolution import.
VolumeFrame import_frame(const FilePath& file, const GridNames& names, const Log& log, Progress* progress,
                         const ProxyRequest& proxy);

/// Imports fields in memory that check_fields() accepts; they are copied. Velocities are in world units per second
/// along the world's axes. name: prefix of every message. Throws Error(file), also for an invalid velocity.
VolumeFrame import_fields(std::span<const MemoryField> fields, const std::string& name, const Log& log,
                          Progress* progress = nullptr);

}  // namespace cumulet::volume
