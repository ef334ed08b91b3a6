#pragma once

#include <array>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

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

/// Calls visit with each optional field that is an amount per unit volume, like density. frames: one frame, or several
/// whose fields are passed together. The order is that of VolumeFrame::fields().
template <class Visit, class... Frame>
void for_each_amount(const Visit& visit, Frame&... frames) {
  visit(frames.temperature...);
  visit(frames.flame...);
}
/// Calls visit with each optional field that is a property of matter, averaged with the density as weight. Velocity has
/// axes and is left out.
template <class Visit, class... Frame>
void for_each_property(const Visit& visit, Frame&... frames) {
  visit(frames.color...);
  visit(frames.anisotropy...);
}

}  // namespace cumulet::volume
