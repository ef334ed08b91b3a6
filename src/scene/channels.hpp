#pragma once

#include <cstddef>
#include <glm/glm.hpp>
#include <optional>
#include <utility>

#include "base/log.hpp"
#include "base/shared_code.hpp"
#include "grid/rgb_field.hpp"
#include "light/black_body.hpp"
#include "volume/frame.hpp"
#include "volume/ramp.hpp"

namespace cumulet::core {
#include "grid/brick_emission.glsl"
}  // namespace cumulet::core

namespace cumulet::scene {

/// Maps a volume's fields to emission, like Blender's Principled Volume except for the default of temperature_scale.
struct Emission {
  double flame_strength = 1.0;  ///< radiance per world unit of length where flame is 1
  glm::vec3 flame_color{1.0F};
  /// Kelvin = offset + scale * field value. If empty, EmissionDefaults chooses a value for the volume; the fallback is
  /// 1500.
  std::optional<double> temperature_scale = {};
  double temperature_offset = 0.0;
  double blackbody = 0.0;  ///< intensity of black-body emission (light::BlackBody); 0: none
  glm::vec3 blackbody_tint{1.0F};
  volume::Ramp temperature_ramp = {};  ///< applied to field values before offset and scale
  volume::Ramp flame_ramp = {};
  volume::ColorRamp temperature_colors = {};  ///< of field values; replaces the colors of black bodies
  volume::ColorRamp flame_colors = {};        ///< of field values; replaces flame_color
  bool operator==(const Emission&) const = default;

  [[nodiscard]] double kelvin_a_value() const { return temperature_scale.value_or(1500.0); }

  /// Whether it has a color ramp. Shaders do not evaluate them.
  [[nodiscard]] bool has_color_ramp() const { return !temperature_colors.empty() || !flame_colors.empty(); }
  /// Whether a flame field emits with these settings.
  [[nodiscard]] bool burns() const { return flame_strength > 0.0 && flame_color != glm::vec3(0.0F); }
  /// Whether a temperature field emits with these settings.
  [[nodiscard]] bool is_hot() const { return blackbody > 0.0 && blackbody_tint != glm::vec3(0.0F); }
};

/// Values that a volume chooses for emission settings which leave them open.
struct EmissionDefaults {
  std::optional<double> temperature_scale = {};  ///< kelvin at temperature 1; empty: it has no temperature
  bool has_only_temperature = false;             ///< it would be invisible without black-body emission

  /// Returns the settings with these values. A temperature ramp chooses its own scale by its largest output.
  [[nodiscard]] Emission complete(Emission emission) const;
};

/// Evaluates the emission of field values: radiance per world unit of length, linear Rec. 709.
class FieldEmission {
 public:
  explicit FieldEmission(const Emission& emission);
  /// Returns the emission of a flame value.
  [[nodiscard]] glm::dvec3 flame(float value) const;
  /// Returns the emission of a temperature value.
  [[nodiscard]] glm::dvec3 black_body(float value) const;
  /// Returns their sum, at most 1e12.
  [[nodiscard]] glm::vec3 operator()(float temperature_value, float flame_value) const;

 private:
  Emission emission_;
  light::BlackBody black_body_;
};

/// Maps a density field to scattering.
struct DensityRamps {
  volume::Ramp values = {};
  volume::ColorRamp colors = {};  ///< of field values before `values`; factor of the color

  DensityRamps() = default;
  // A ramp of values alone.
  DensityRamps(volume::Ramp ramp) : values(std::move(ramp)) {}  // NOLINT(google-explicit-constructor)
  DensityRamps(volume::Ramp ramp, volume::ColorRamp color_ramp)
      : values(std::move(ramp)), colors(std::move(color_ramp)) {}
  bool operator==(const DensityRamps&) const = default;
};

/// Converts the settings for shaders (glsl/grid/brick_products.comp). They must not have a color ramp.
core::CmBrickEmissive shader_emissive(const Emission& emission, const light::BlackBody& body);

/// Returns flame * strength * color + emission of the temperature, with color ramps: radiance per world unit of length,
/// linear Rec. 709, per voxel on the lattice of the fields. Returns nullopt if there is no such field or none of them
/// emits. O(bricks of both) time and memory. Throws Error(unsupported) if tiles or a background with emission fill more
/// than 2^27 voxels.
std::optional<grid::RgbField::Components> emission_of(const volume::VolumeFrame& frame, const Emission& emission,
                                                      const Progress* progress = nullptr);

/// Returns ramp(density) * color ramp * color per voxel, with color components clamped to 1; black where a color has no
/// value. Returns nullopt if there is neither a color nor a color ramp, or no density. Errors as for emission_of().
/// colored_by: the densities that the color ramp maps; null: those of the frame.
std::optional<grid::RgbField::Components> scattering_of(const volume::VolumeFrame& frame,
                                                        const DensityRamps& ramps = {},
                                                        const Progress* progress = nullptr,
                                                        const volume::ScalarVolume* colored_by = nullptr);

/// Returns the luminance of scattering_of(), or ramp(density) if that is nullopt, times (1 + anisotropy) / 2, per
/// voxel. Returns nullopt if the frame has no anisotropy or no density. Errors as for emission_of(). colored_by: as for
/// scattering_of().
std::optional<volume::ScalarVolume> forward_of(const volume::VolumeFrame& frame, const DensityRamps& ramps = {},
                                               const Progress* progress = nullptr,
                                               const volume::ScalarVolume* colored_by = nullptr);

/// Returns the voxelwise mean of two fields on one lattice; null counts as 0 everywhere. Returns nullopt if the mean is
/// 0 everywhere. Errors as for emission_of(); what: name of the field in the message.
std::optional<volume::ScalarVolume> mean_of(const volume::ScalarVolume* a, const volume::ScalarVolume* b,
                                            const char* what, const Progress* progress = nullptr);
/// Returns the voxelwise mean of each component.
std::optional<grid::RgbField::Components> mean_of(const std::optional<grid::RgbField::Components>& a,
                                                  const std::optional<grid::RgbField::Components>& b, const char* what,
                                                  const Progress* progress = nullptr);

/// Returns ramp(density) * velocity along the lattice axes, per voxel, encoded as in grid::MomentumField. fastest:
/// minimum for the velocity that values are relative to. Returns nullopt if the velocity is missing or 0, or if there
/// is no density. Also returns nullopt, and logs a warning, where emission_of() would throw.
std::optional<grid::MomentumField::Values> momentum_of(const volume::VolumeFrame& frame,
                                                       const volume::Ramp& density_ramp = {},
                                                       const Progress* progress = nullptr, const Log& log = {},
                                                       double fastest = 0.0);
/// Returns an upper bound of the frame's speed along any lattice axis, in voxels per second; 0 if nothing moves.
double fastest_of(const volume::VolumeFrame& frame);

}  // namespace cumulet::scene
