#pragma once

#include <cstddef>
#include <glm/glm.hpp>
#include <optional>

#include "base/log.hpp"
#include "base/shared_code.hpp"
#include "grid/rgb_field.hpp"
#include "light/black_body.hpp"
#include "volume/frame.hpp"
#include "volume/ramp.hpp"

namespace cumulet::core {
#include "brick_glow.glsl"
}  // namespace cumulet::core

namespace cumulet::scene {

/// What of a volume's fields gives off light: Blender's Principled Volume, but for the default of temperature_scale.
struct Emission {
  double flame_strength = 1.0;  ///< radiance a world unit of length where flame is 1
  glm::vec3 flame_colour{1.0F};
  /// Kelvin = offset + scale x the field's value. Nothing: as suits the volume, which VolumeAsset::emission_by fills
  /// in; else 1500.
  std::optional<double> temperature_scale = {};
  double temperature_offset = 0.0;
  double blackbody = 0.0;  ///< intensity of black body light (light::BlackBody); 0: none
  glm::vec3 blackbody_tint{1.0F};
  volume::Ramp temperature_ramp = {};  ///< of the field's values, before offset and scale
  volume::Ramp flame_ramp = {};
  bool operator==(const Emission&) const = default;

  [[nodiscard]] double kelvin_a_value() const { return temperature_scale.value_or(1500.0); }

  /// Whether flame does, where there is any.
  [[nodiscard]] bool burns() const { return flame_strength > 0.0 && flame_colour != glm::vec3(0.0F); }
  /// Whether temperature does.
  [[nodiscard]] bool is_hot() const { return blackbody > 0.0 && blackbody_tint != glm::vec3(0.0F); }
};

/// The same for shaders (glsl/brick_products.comp).
core::CmBrickGlow shader_glow(const Emission& emission, const light::BlackBody& body);

/// Flame x strength x colour + what a black body of the temperature gives off: radiance a world unit of length, linear
/// Rec. 709, voxel by voxel on the fields' lattice. Nothing if there is no such field, or none of them glows. O(bricks
/// of both) time and memory. Throws Error(unsupported) for temperatures that glow over a box of more than 2^27 voxels
/// without any detail.
std::optional<grid::RgbField::Components> emission_of(const volume::VolumeFrame& frame, const Emission& emission,
                                                      const Progress* progress = nullptr);

/// The ramp of density x colour, of which no component counts above 1, voxel by voxel: black where the frame has no
/// colour. Nothing if it has none at all, or no density. Throws as emission_of does.
std::optional<grid::RgbField::Components> scattering_of(const volume::VolumeFrame& frame,
                                                        const volume::Ramp& density_ramp = {},
                                                        const Progress* progress = nullptr);

/// Luminance of the ramp of density x colour, of which no component counts above 1, times (1 + anisotropy) / 2, voxel
/// by voxel. Nothing if the frame has no anisotropy, or no density. Throws as emission_of does.
std::optional<volume::ScalarVolume> forward_of(const volume::VolumeFrame& frame, const volume::Ramp& density_ramp = {},
                                               const Progress* progress = nullptr);

/// The mean of two fields of one lattice, voxel by voxel; null: 0 everywhere. Nothing where that is 0. Throws as
/// emission_of does; what: for its message.
std::optional<volume::ScalarVolume> mean_of(const volume::ScalarVolume* a, const volume::ScalarVolume* b,
                                            const char* what, const Progress* progress = nullptr);
/// Of each component.
std::optional<grid::RgbField::Components> mean_of(const std::optional<grid::RgbField::Components>& a,
                                                  const std::optional<grid::RgbField::Components>& b, const char* what,
                                                  const Progress* progress = nullptr);

/// The ramp of density x velocity, along the axes of the lattice, voxel by voxel: grid::MomentumField says how. Nothing
/// if the frame has no velocity but 0, or no density; fastest: at least what the values are in units of; nor, with a
/// warning, where density without any detail is as much as emission_of throws for.
std::optional<grid::MomentumField::Values> momentum_of(const volume::VolumeFrame& frame,
                                                       const volume::Ramp& density_ramp = {},
                                                       const Progress* progress = nullptr, const Log& log = {},
                                                       double fastest = 0.0);
/// Voxels a second: along an axis of the lattice nothing of the frame is faster; 0: nothing moves.
double fastest_of(const volume::VolumeFrame& frame);

}  // namespace cumulet::scene
