#pragma once

// Settings of the data that is shown, from checked descriptors (viewer/c_settings.hpp).

#include <cumulet/cumulet.h>

#include <algorithm>
#include <cstdint>
#include <glm/glm.hpp>
#include <glm/gtc/type_ptr.hpp>
#include <optional>

#include "assets/medium.hpp"
#include "assets/surface_asset.hpp"
#include "jobs/built.hpp"
#include "light/sky.hpp"
#include "scene/snapshot.hpp"
#include "settings/settings.hpp"

namespace cumulet::viewer {

// The enums have the numbers of cumulet.h.
static_assert(static_cast<int>(grid::Criterion::range_mean) == CUMULET_CRITERION_RANGE_MEAN);
static_assert(static_cast<int>(grid::Criterion::transmittance) == CUMULET_CRITERION_TRANSMITTANCE);

static_assert(static_cast<int>(BuildOn::gpu) == CUMULET_BUILD_GPU);

// Trilinear cells without corners are linear ones, with which they share grids.
inline grid::CellKind cells_of(cumulet_cell_density cells, grid::Interpolation interpolation) {
  using grid::CellKind;
  if (cells == CUMULET_CELLS_CONSTANT) return CellKind::constant;
  const bool trilinear = cells == CUMULET_CELLS_TRILINEAR;
  return trilinear && grid::has_corners(CellKind::trilinear, interpolation) ? CellKind::trilinear : CellKind::linear;
}

struct GridSettings {
  BuildSettings build;  // refine.camera is filled in from the viewer's camera
  bool camera_adaptive = false;
  /// For dynamic volumes whose voxels may stay in GL (Live::values_wanted()), in place of build.interpolation.
  grid::Interpolation interpolation_in_gl = grid::Interpolation::nearest;

  static GridSettings of(const cumulet_grid_desc& d) {
    GridSettings s;
    s.build.march = static_cast<scene::March>(d.type);
    s.build.on = static_cast<BuildOn>(d.build_device);
    s.build.interpolation =
        d.interpolation == CUMULET_INTERPOLATION_NEAREST ? grid::Interpolation::nearest : grid::Interpolation::linear;
    // Linear interpolation alone would bring them to main memory. Trilinear cells need it, and grids with other cells
    // cannot be shown beside them.
    const bool may_stay_in_gl =
        s.build.march == scene::March::tet && s.build.on == BuildOn::gpu && d.cells != CUMULET_CELLS_TRILINEAR;
    const bool automatic = d.interpolation == CUMULET_INTERPOLATION_AUTO;
    s.interpolation_in_gl = automatic && may_stay_in_gl ? grid::Interpolation::nearest : s.build.interpolation;
    grid::RefineSettings& refine = s.build.refine;
    refine.cells = cells_of(d.cells, s.build.interpolation);
    const cumulet_refinement_criterion criterion = settings::criterion_of(d);
    refine.criterion = static_cast<grid::Criterion>(criterion);
    refine.threshold = d.threshold != 0.0 ? d.threshold : settings::default_threshold(criterion);
    refine.max_cells = d.max_cells;
    refine.pixel_size = d.pixel_size;
    s.camera_adaptive = d.camera_adaptive == 1;
    return s;
  }
};

struct Light {
  float sun_azimuth_degrees = 0.0F;
  float sun_elevation_degrees = 0.0F;
  glm::vec3 sun_irradiance{0.0F};
  glm::vec3 sky_radiance{0.0F};
  std::optional<light::SkyModel> sky = std::nullopt;  ///< if set, it replaces the two members above
  float sun_angle_degrees = 0.0F;
  std::uint32_t sun_group = 0;  ///< light group
  std::uint32_t sky_group = 0;  ///< light group of the sky or the environment

  static Light of(const cumulet_sun_sky_desc& d) {
    Light light{d.sun_azimuth_degrees, d.sun_elevation_degrees, glm::make_vec3(d.sun_irradiance),
                glm::make_vec3(d.sky_radiance), std::nullopt};
    if (d.sky == CUMULET_SKY_PHYSICAL) light.sky = {.turbidity = d.turbidity, .ground_albedo = d.ground_albedo};
    light.sun_angle_degrees =
        d.sun_angle_degrees != 0.0F ? std::max(0.0F, d.sun_angle_degrees) : settings::default_sun_angle(d.sky);
    light.sun_group = d.sun_group;
    light.sky_group = d.sky_group;
    return light;
  }
};

struct EnvironmentSettings {
  float rotation_degrees = 0.0F;
  float strength = 1.0F;

  static EnvironmentSettings of(const cumulet_environment_settings_desc& d) { return {d.rotation_degrees, d.strength}; }
};

enum class GroundMode { none = 0, below = 1, at_height = 2 };

struct GroundSettings {
  GroundMode mode = GroundMode::none;
  double height = 0.0;
  glm::vec3 albedo{0.3F};
  bool shadow_catcher = false;

  static GroundSettings of(const cumulet_ground_desc& d) {
    const bool catcher =
        d.mode == CUMULET_GROUND_SHADOW_CATCHER_BELOW || d.mode == CUMULET_GROUND_SHADOW_CATCHER_AT_HEIGHT;
    constexpr int other = CUMULET_GROUND_SHADOW_CATCHER_BELOW - CUMULET_GROUND_BELOW;
    return {static_cast<GroundMode>(catcher ? d.mode - other : d.mode), d.height, glm::make_vec3(d.albedo), catcher};
  }
};

/// Returns the emission of a medium, with the ramps of its grids.
[[nodiscard]] inline scene::Emission emission_of(const Medium& medium, const Ramps& ramps) {
  scene::Emission emission = medium.field_emission;
  emission.temperature_ramp = ramps.temperature;
  emission.flame_ramp = ramps.flame;
  emission.temperature_colors = ramps.temperature_colors;
  emission.flame_colors = ramps.flame_colors;
  return emission;
}

/// Returns the medium as scenes use it.
[[nodiscard]] inline scene::Medium shown_medium(const Medium& medium) {
  return {medium.density_scale, medium.albedo, medium.phase, medium.emission, medium.group, medium.holdout};
}

/// Returns `ends` if the shutter has a duration.
[[nodiscard]] inline std::optional<scene::ShutterTransforms> while_open(
    const std::optional<scene::ShutterTransforms>& ends, double shutter_seconds) {
  return shutter_seconds > 0.0 ? ends : std::nullopt;
}

enum class SurfaceLight { full = 0, shadows = 1, none = 2 };

struct SurfaceSettings {
  SurfaceChoice choice;
  SurfaceLight light = SurfaceLight::full;
  float indirect_roughness = 0.0F;
  std::uint32_t group = 0;  ///< light group
  bool holdout = false;

  static SurfaceSettings of(const cumulet_surface_settings_desc& d) {
    return {{d.time, d.animation, d.double_sided == 1, d.variant},
            static_cast<SurfaceLight>(d.lighting),
            d.indirect_roughness,
            d.group,
            d.holdout == 1};
  }
};

}  // namespace cumulet::viewer
