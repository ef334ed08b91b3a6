#pragma once

// The table of settings. A row describes everything about a setting except its effect on the image, which is documented
// in cumulet.h. The table defines the checks and defaults of the C API, scene-file keys, and flags with their help. It
// also defines the comparison of descriptors and the rows of the demo's panel.

#include <cumulet/cumulet.h>

#include <array>
#include <tuple>

#include "setting.hpp"

namespace cumulet::settings {

inline constexpr std::array grid_type_choices = {
    Choice{"tetrahedral", CUMULET_GRID_TETRAHEDRAL, "Tetrahedra", "The adaptive grid.", "tet"},
    Choice{"dense", CUMULET_GRID_DENSE, "Dense voxels", "All voxels at full resolution: the reference."},
    Choice{"bricks", CUMULET_GRID_BRICKS, "Bricks", "Voxels, with empty 8x8x8 bricks skipped.", "brick"}};
inline constexpr std::array cells_choices = {
    Choice{"constant", CUMULET_CELLS_CONSTANT, "Constant", "One density per cell: the mean."},
    Choice{"linear", CUMULET_CELLS_LINEAR, "Linear", "A least-squares fit: fewer cells for the same error."},
    Choice{"trilinear", CUMULET_CELLS_TRILINEAR, "Trilinear",
           "With linear interpolation: a fit, and in the finest cells the interpolated density itself, without edges "
           "in close views."}};
inline constexpr std::array voxel_interpolation_choices = {
    Choice{"auto", CUMULET_INTERPOLATION_AUTO, "Automatic", "Linear; nearest for dynamic volumes in GPU memory."},
    Choice{"nearest", CUMULET_INTERPOLATION_NEAREST, "Nearest", "A voxel is a cube of constant value."},
    Choice{"linear", CUMULET_INTERPOLATION_LINEAR, "Linear", "Trilinear interpolation between the centers of voxels."}};
inline constexpr std::array criterion_choices = {
    Choice{"transmittance", CUMULET_CRITERION_TRANSMITTANCE, "Transmittance",
           "Density error weighted by visibility (two-way transmittance)."},
    Choice{"range-mean", CUMULET_CRITERION_RANGE_MEAN, "Range / mean",
           "(max - min) / mean of the density in the cell."},
    Choice{"deviation", CUMULET_CRITERION_DEVIATION, "Deviation",
           "Standard deviation of the density x edge length, relative to the mean optical depth."}};
inline constexpr std::array build_device_choices = {
    Choice{"cpu", CUMULET_BUILD_CPU, "CPU", "A worker thread builds the grid."},
    Choice{"gpu", CUMULET_BUILD_GPU, "GPU", "Compute shaders build the grid within the frame budgets."}};
inline constexpr std::array surface_lighting_choices = {
    Choice{"global", CUMULET_SURFACE_LIGHTING_GLOBAL, "Global", "Global illumination between surfaces and volume.",
           "full"},
    Choice{"direct", CUMULET_SURFACE_LIGHTING_DIRECT, "Direct",
           "Direct light from sun, sky, lights and emission only, with shadows. Faster.", "shadows"},
    Choice{"rasterized", CUMULET_SURFACE_LIGHTING_RASTERIZED, "Rasterized", "Rasterized without shadows. Fastest.",
           "none"}};
inline constexpr std::array phase_choices = {
    Choice{"hg", CUMULET_PHASE_HG, "One lobe", "Henyey-Greenstein phase function."},
    Choice{"two-lobe", CUMULET_PHASE_TWO_LOBE, "Two lobes",
           "Two Henyey-Greenstein lobes, for example one forward and one backward."},
    Choice{"mie", CUMULET_PHASE_MIE, "Droplets", "Mie scattering by water droplets of one size, for clouds and fog."}};
inline constexpr std::array sky_choices = {
    Choice{"constant", CUMULET_SKY_CONSTANT, "Constant", "One color from all directions."},
    Choice{"physical", CUMULET_SKY_PHYSICAL, "Physical", "A clear sky for the position of the sun."}};
inline constexpr std::array ground_choices = {
    Choice{"none", CUMULET_GROUND_NONE, "None", "No ground plane."},
    Choice{"below", CUMULET_GROUND_BELOW, "Below", "Ground plane at the lowest point of volumes and surfaces."},
    Choice{"at-height", CUMULET_GROUND_AT_HEIGHT, "At a height", "Ground plane at the height set below."},
    Choice{"shadow-catcher", CUMULET_GROUND_SHADOW_CATCHER_BELOW, "Shadow catcher",
           "Shadows on the ground of the environment or sky, at the lowest point of volumes and surfaces."},
    Choice{"shadow-catcher-at-height", CUMULET_GROUND_SHADOW_CATCHER_AT_HEIGHT, "Shadow catcher at a height",
           "Shadows on the ground of the environment or sky, at the height set below."}};
inline constexpr std::array repeat_choices = {
    Choice{"hold", CUMULET_REPEAT_HOLD, "Hold",
           "Shows the first frame before the start and the last frame after the end."},
    Choice{"loop", CUMULET_REPEAT_LOOP, "Loop", "Continues with the first frame after the last."},
    Choice{"ping-pong", CUMULET_REPEAT_PING_PONG, "Ping-pong", "Plays backward and forward in turn."}};
inline constexpr std::array interpolation_choices = {
    Choice{"none", CUMULET_FRAME_INTERPOLATION_NONE, "None",
           "Each frame is shown until the next one; no interpolation."},
    Choice{"blend", CUMULET_FRAME_INTERPOLATION_BLEND, "Blend", "Cross-fades between frames."},
    Choice{"advect", CUMULET_FRAME_INTERPOLATION_ADVECT, "Advect",
           "Moves the frames along their velocity. Frames without velocity are cross-faded."}};
inline constexpr std::array view_choices = {
    Choice{"shaded", CUMULET_VIEW_SHADED, "Shaded", "The path-traced image."},
    Choice{"cells", CUMULET_VIEW_CELLS, "Cells", "The cells in a slice through the center, colored by level."},
    Choice{"steps", CUMULET_VIEW_STEPS, "Steps", "Number of cells along each camera ray, as a heat map."},
    Choice{"density", CUMULET_VIEW_DENSITY, "Density", "The opacity along each camera ray."},
    Choice{"wireframe", CUMULET_VIEW_WIREFRAME, "Wireframe", "The edges of the cells with density."}};
inline constexpr std::array preview_choices = {Choice{"auto", CUMULET_PREVIEW_AUTO, "", ""},
                                               Choice{"off", CUMULET_PREVIEW_OFF, "", ""}};
inline constexpr std::array tone_map_choices = {
    Choice{"neutral", CUMULET_TONE_MAP_NEUTRAL, "Neutral", "Khronos PBR Neutral: keeps colors, rolls off highlights."},
    Choice{"filmic", CUMULET_TONE_MAP_FILMIC, "Filmic", "A fit of the ACES curve: more contrast."},
    Choice{"clip", CUMULET_TONE_MAP_CLIP, "Clip", "Clips values above 1."}};
inline constexpr std::array background_choices = {
    Choice{"sky", CUMULET_BACKGROUND_SKY, "Sky", "The sky or the environment."},
    Choice{"transparent", CUMULET_BACKGROUND_TRANSPARENT, "Transparent",
           "No background; saved images have an alpha channel."},
    Choice{"color", CUMULET_BACKGROUND_COLOR, "Color", "One color. The lighting does not change."}};
inline constexpr std::array denoise_choices = {
    Choice{"off", CUMULET_DENOISE_OFF, "Off", "No denoising."},
    Choice{"fast", CUMULET_DENOISE_FAST, "Fast",
           "Filters each pixel with its neighbors, less as the number of samples grows."}};
inline constexpr std::array navigation_choices = {
    Choice{"simple", CUMULET_NAVIGATION_SIMPLE, "Simple", "Left: orbit; middle or Shift+left: pan; right: dolly."},
    Choice{"blender", CUMULET_NAVIGATION_BLENDER, "Blender", "Middle: orbit; Shift: pan; Ctrl: dolly; keypad views."},
    Choice{"maya", CUMULET_NAVIGATION_MAYA, "Maya", "Alt + left: orbit; Alt + middle: pan; Alt + right: dolly."}};
inline constexpr std::array depth_choices = {Choice{"standard", CUMULET_DEPTH_STANDARD, "", ""},
                                             Choice{"reversed", CUMULET_DEPTH_REVERSED, "", ""}};

inline constexpr std::array analytic_light_choices = {
    Choice{"point", CUMULET_LIGHT_POINT, "Point", "Point light: emits equally in all directions."},
    Choice{"spot", CUMULET_LIGHT_SPOT, "Spot", "Spotlight: emits into a cone."},
    Choice{"disk", CUMULET_LIGHT_DISK, "Disk", "Disk-shaped area light, one-sided.", "disc"},
    Choice{"rect", CUMULET_LIGHT_RECT, "Rectangle", "Rectangular area light, one-sided.", "rectangle"},
    Choice{"distant", CUMULET_LIGHT_DISTANT, "Distant", "Directional light: infinitely far away.", "sun"}};

/// Valid light group numbers.
inline constexpr Range group_range = {0.0, double{CUMULET_LIGHT_GROUPS} - 1.0};

// One setting, one row.
// clang-format off

template <>
struct Table<cumulet_medium_desc> {
  using Desc = cumulet_medium_desc;
  static constexpr const char* name = "cumulet_medium_desc";
  static constexpr std::tuple rows = {
      Setting(&Desc::density_scale, {.name = "density_scale", .range = {0.0, 1e60}, .given = above_zero, .zero = 1.0,
        .key = "medium.density_scale", .flag = "--density-scale", .type = "K|auto",
        .help = "Extinction is K x grid value, 1 / world unit (default: auto, for a mean optical depth of 8)",
        .row = {.label = "Density",
                .tip = "How opaque the medium is: multiplies the values of the density grid. The product is the "
                       "extinction per world unit.",
                .least = 1e-4, .most = 1e4, .format = "%.4g", .logarithmic = true}}),
      Setting(&Desc::coalbedo, {.name = "coalbedo", .range = {0.0, 1.0}, .spelling = Spelling::complement,
        .key = "medium.albedo", .flag = "--albedo", .type = "R,G,B",
        .help = "Single-scattering albedo, each from 0 to 1 (default: 1,1,1)",
        .row = {.label = "Scatter color",
                .tip = "Color of the light that the medium scatters; the rest is absorbed (single-scattering albedo). "
                       "White: nothing is absorbed."}}),
      Setting(&Desc::anisotropy, {.name = "anisotropy", .range = {-1.0, 1.0, true},
        .key = "medium.anisotropy", .flag = "--anisotropy", .type = "G",
        .help = "Henyey-Greenstein g between -1 and 1; with two lobes g of the first; not used with mie (default: "
                "0, isotropic)",
        .row = {.label = "Scatter direction",
                .tip = "0: light scatters in all directions alike. Above 0: mostly forward, which makes bright rims "
                       "against the light. Below 0: mostly backward (Henyey-Greenstein anisotropy).",
                .least = -0.99, .most = 0.99}}),
      Setting(&Desc::max_bounces, {.name = "max_bounces",
        .key = "medium.max_bounces", .flag = "--max-bounces", .type = "N",
        .help = "Maximum number of scattering events per path; 0: no limit (default)",
        .row = {.label = "Max bounces",
                .tip = "How often light may scatter before it is dropped. More bounces make thick clouds brighter.",
                .most = 256.0, .logarithmic = true, .zero = "no limit"}}),
      Setting(&Desc::emission, {.name = "emission", .range = light_range,
        .key = "medium.emission", .flag = "--emission", .type = "R,G,B",
        .help = "Emitted radiance of the medium where it is opaque (default: 0,0,0)",
        .row = {.label = "Emission",
                .tip = "Light that the medium itself emits: radiance where it is opaque. It lights the scene. 0: none.",
                .most = 1000.0,
                .color = "Emission color",
                .color_tip = "Color of the emitted light.",
                .hue = {1.0F, 0.35F, 0.08F}}}),
      Setting(&Desc::phase, {.name = "phase", .choices = phase_choices,
        .key = "medium.phase", .flag = "--phase",
        .help = "Phase function: the directions in which the medium scatters light (default: hg)",
        .row = {.label = "Scatter model",
                .tip = "How the directions of scattered light are distributed (phase function)."}}),
      Setting(&Desc::second_anisotropy, {.name = "second_anisotropy", .range = {-1.0, 1.0, true},
        .key = "medium.second_anisotropy", .flag = "--second-anisotropy", .type = "G",
        .help = "Henyey-Greenstein g of the second lobe, between -1 and 1 (default: 0)",
        .row = {.label = "Second direction",
                .tip = "Scatter direction of the second lobe.",
                .least = -0.99, .most = 0.99}}),
      Setting(&Desc::second_weight, {.name = "second_weight", .range = {0.0, 1.0}, .given = Range{0.01, 1.0},
        .zero = 0.5,
        .key = "medium.second_weight", .flag = "--second-weight", .type = "W",
        .help = "Weight of the second of two lobes, from 0.01 to 1 (default: 0.5)",
        .row = {.label = "Lobe mix",
                .tip = "Share of the second lobe: 1 is only the second.",
                .least = 0.01, .most = 1.0}}),
      Setting(&Desc::droplet_diameter, {.name = "droplet_diameter", .range = {5.0, 50.0}, .zero = 20.0,
        .key = "medium.droplet_diameter", .flag = "--droplet-diameter", .type = "UM",
        .help = "Diameter of the droplets for mie, from 5 to 50 micrometers (default: 20)",
        .row = {.label = "Droplet size",
                .tip = "Diameter of the droplets in micrometers: small for fog, about 20 for clouds.",
                .least = 5.0, .most = 50.0, .format = "%.1f µm"}}),
      Setting(&Desc::flame_strength, {.name = "flame_strength", .range = light_range, .given = above_zero, .zero = 1.0,
        .key = "medium.flame_strength", .flag = "--flame-strength", .type = "S",
        .help = "Emission of the flame grid per world unit of length, where its value is 1 (default: 1)",
        .row = {.label = "Flame brightness",
                .tip = "Brightness of the flame grid: emission per world unit where its value is 1.",
                .least = 1e-3, .most = 1e3, .format = "%.4g", .logarithmic = true}}),
      Setting(&Desc::flame_color, {.name = "flame_color", .range = light_range, .zero = 1.0,
        .key = "medium.flame_color", .flag = "--flame-color", .type = "R,G,B",
        .help = "Color of the flame (default: 1,1,1)",
        .row = {.label = "Flame color", .tip = "Color of the light of the flame grid."}}),
      Setting(&Desc::temperature_scale, {.name = "temperature_scale", .range = light_range, .given = above_zero,
        .key = "medium.temperature_scale", .flag = "--temperature-scale", .type = "K",
        .help = "Kelvin per unit of the temperature grid (default: 1500, or 1 if the grid has values above 20, "
                "which are taken as kelvin)",
        .row = {.label = "Temperature at 1",
                .tip = "Temperature where the temperature grid has the value 1. Automatic: 1500 K, or 1 K if the "
                       "grid's values are in kelvin.",
                .most = 1e4, .format = "%.4g K", .logarithmic = true, .zero = "automatic"}}),
      Setting(&Desc::temperature_offset, {.name = "temperature_offset", .range = {-1e6, 1e6},
        .key = "medium.temperature_offset", .flag = "--temperature-offset", .type = "K",
        .help = "Kelvin added to the scaled temperature; 273.15 with scale 1 for degrees Celsius (default: 0)",
        .row = {.label = "Temperature offset",
                .tip = "Added to all temperatures. 273.15 K for a grid in degrees Celsius.",
                .least = -2000.0, .most = 2000.0, .format = "%.1f K"}}),
      Setting(&Desc::blackbody, {.name = "blackbody", .range = light_range,
        .key = "medium.blackbody", .flag = "--blackbody", .type = "INTENSITY",
        .help = "Black-body emission of the temperature grid; 1: according to the Stefan-Boltzmann law (default: "
                "0, none)",
        .row = {.label = "Fire brightness",
                .tip = "Brightness of the glow of hot gas (black body), from the temperature grid. 0: none, 1: "
                       "physical.",
                .most = 100.0, .format = "%.4g", .logarithmic = true}}),
      Setting(&Desc::blackbody_tint, {.name = "blackbody_tint", .range = light_range, .zero = 1.0,
        .key = "medium.blackbody_tint", .flag = "--blackbody-tint", .type = "R,G,B",
        .help = "Tint of the black-body emission (default: 1,1,1)",
        .row = {.label = "Fire tint", .tip = "Multiplies the color of the glow of hot gas. White: that of its heat."}}),
      Setting(&Desc::group, {.name = "group", .range = group_range,
        .key = "medium.group", .flag = "--medium-group", .type = "N",
        .help = "Light group of the medium's emission, from 0 to 7 (default: 0); see --light-groups"}),
      Setting(&Desc::holdout, {.name = "holdout",
        .key = "medium.holdout", .flag = "--medium-holdout",
        .help = "Holdout: the volume leaves a hole with alpha 0 in the image"})};
};

template <>
struct Table<cumulet_sun_sky_desc> {
  using Desc = cumulet_sun_sky_desc;
  static constexpr const char* name = "cumulet_sun_sky_desc";
  static constexpr std::tuple rows = {
      Setting(&Desc::sun_azimuth_degrees, {.name = "sun_azimuth_degrees", .given = Range{-360.0, 360.0},
        .key = "sun_sky.sun.azimuth_degrees",
        .row = {.label = "Sun azimuth",
                .tip = "Direction of the sun, from +Z towards +X.",
                .least = -180.0, .most = 180.0, .format = "%.1f°"}}),
      Setting(&Desc::sun_elevation_degrees, {.name = "sun_elevation_degrees", .range = {-90.0, 90.0},
        .key = "sun_sky.sun.elevation_degrees",
        .row = {.label = "Sun elevation",
                .tip = "Angle of the sun above the horizon.",
                .least = -90.0, .most = 90.0, .format = "%.1f°"}}),
      Setting(&Desc::sun_irradiance, {.name = "sun_irradiance", .range = light_range,
        .key = "sun_sky.sun.irradiance",
        .row = {.label = "Sun strength",
                .tip = "Irradiance on a surface that faces the sun; 0: no sun.",
                .most = 1000.0,
                .color = "Sun color",
                .color_tip = "Color of the sun."}}),
      Setting(&Desc::sky_radiance, {.name = "sky_radiance", .range = light_range,
        .key = "sun_sky.sky.radiance", .flag = "--sky", .type = "R,G,B",
        .help = "Radiance of a constant sky",
        .row = {.label = "Sky strength",
                .tip = "Radiance of a constant sky; 0: black.",
                .most = 100.0,
                .color = "Sky color",
                .color_tip = "Color of the sky."}}),
      Setting(&Desc::sky, {.name = "sky", .choices = sky_choices,
        .key = "sun_sky.sky.model",
        .row = {.label = "Sky",
                .tip = "Model of the light from sun and sky."}}),
      Setting(&Desc::turbidity, {.name = "turbidity", .range = {1.0, 10.0}, .zero = 3.0,
        .key = "sun_sky.sky.turbidity",
        .row = {.label = "Haze",
                .tip = "Haze of the air: 2 is very clear, 3 clear, 6 hazy (turbidity).",
                .least = 1.0, .most = 10.0, .format = "%.1f"}}),
      Setting(&Desc::ground_albedo, {.name = "ground_albedo", .range = {0.0, 1.0},
        .key = "sun_sky.sky.ground_albedo",
        .row = {.label = "Ground brightness",
                .tip = "Fraction of the light that the ground reflects into the sky. The ground plane has its own "
                       "color.",
                .most = 1.0}}),
      Setting(&Desc::sun_angle_degrees, {.name = "sun_angle_degrees", .range = {-180.0, 180.0}, .given = Range{0.0, 180.0},
        .spelling = Spelling::zero_is_negative,
        .key = "sun_sky.sun.angle_degrees", .flag = "--sun-angle", .type = "DEG",
        .help = "Angular diameter of the sun in degrees, from 0 to 180; 0 gives hard shadows (default: 0; with "
                "--sky-model 0.53)",
        .row = {.label = "Sun size",
                .tip = "Angular diameter of the sun. A larger sun makes softer shadows.",
                .most = 30.0, .format = "%.2f°"}}),
      Setting(&Desc::sun_group, {.name = "sun_group", .range = group_range,
        .key = "sun_sky.sun.group", .flag = "--sun-group", .type = "N",
        .help = "Light group of the sun, from 0 to 7 (default: 0); see --light-groups"}),
      Setting(&Desc::sky_group, {.name = "sky_group", .range = group_range,
        .key = "sun_sky.sky.group", .flag = "--sky-group", .type = "N",
        .help = "Light group of the sky or the environment, from 0 to 7 (default: 0); see --light-groups"})};
};

/// The settings of one light in a list: keys are those of its object in a scene file.
template <>
struct Table<cumulet_light_desc> {
  using Desc = cumulet_light_desc;
  static constexpr const char* name = "cumulet_light_desc";
  static constexpr std::tuple rows = {
      Setting(&Desc::kind, {.name = "kind", .choices = analytic_light_choices,
        .key = "kind",
        .row = {.label = "Light type", .tip = "Shape of the light."}}),
      Setting(&Desc::position, {.name = "position",
        .key = "position",
        .row = {.label = "Position", .tip = "Position of the light's center."}}),
      Setting(&Desc::direction, {.name = "direction",
        .key = "direction",
        .row = {.label = "Direction", .tip = "Direction in which the light shines. The rotate tool turns it in the image."}}),
      Setting(&Desc::tangent, {.name = "tangent",
        .key = "tangent",
        .row = {.label = "Width direction", .tip = "Direction of a rectangle's width."}}),
      Setting(&Desc::color, {.name = "color", .range = light_range, .zero = 1.0,
        .key = "color",
        .row = {.label = "Light color", .tip = "Color of the light; multiplied by the power."}}),
      Setting(&Desc::power, {.name = "power", .range = light_range,
        .key = "power",
        .row = {.label = "Power",
                .tip = "Brightness in watts, as in Blender. A distant light has watts per square meter.",
                .most = 1e9, .format = "%.4g", .logarithmic = true}}),
      Setting(&Desc::width, {.name = "width", .range = {0.0, 1e30}, .given = above_zero, .zero = 1.0,
        .key = "width",
        .row = {.label = "Width",
                .tip = "Width of a rectangle, or diameter of a disk.",
                .least = 1e-3, .most = 1e4, .format = "%.4g", .logarithmic = true}}),
      Setting(&Desc::height, {.name = "height", .range = {0.0, 1e30}, .given = above_zero, .zero = 1.0,
        .key = "height",
        .row = {.label = "Height",
                .tip = "Height of a rectangle.",
                .least = 1e-3, .most = 1e4, .format = "%.4g", .logarithmic = true}}),
      Setting(&Desc::angle_degrees, {.name = "angle_degrees", .range = {0.0, 180.0},
        .key = "angle_degrees",
        .row = {.label = "Angle",
                .tip = "Full cone angle of a spot, or angular diameter of a distant light.",
                .most = 180.0, .format = "%.1f°"}}),
      Setting(&Desc::blend, {.name = "blend", .range = {0.0, 1.0},
        .key = "blend",
        .row = {.label = "Blend",
                .tip = "Fraction of a spot's cone over which the light falls off.",
                .most = 1.0}}),
      Setting(&Desc::group, {.name = "group", .range = group_range,
        .key = "group"})};
};

template <>
struct Table<cumulet_environment_settings_desc> {
  using Desc = cumulet_environment_settings_desc;
  static constexpr const char* name = "cumulet_environment_settings_desc";
  static constexpr std::tuple rows = {
      Setting(&Desc::rotation_degrees, {.name = "rotation_degrees", .range = {-360.0, 360.0},
        .key = "environment.rotation_degrees", .flag = "--env-rotation", .type = "DEG",
        .help = "Rotation of the environment in degrees, from +Z towards +X (default: 0)",
        .row = {.label = "Rotation",
                .tip = "Rotates the environment from +Z towards +X.",
                .least = -180.0, .most = 180.0, .format = "%.1f°"}}),
      Setting(&Desc::strength, {.name = "strength", .range = {0.0, 1e6}, .given = Range{0.0, 1e6, true}, .zero = 1.0,
        .key = "environment.strength", .flag = "--env-strength", .type = "S",
        .help = "Multiplier of the environment's radiance (default: 1)",
        .row = {.label = "Strength",
                .tip = "Multiplier of the environment's radiance.",
                .least = 0.01, .most = 100.0, .format = "%.3g", .logarithmic = true}})};
};

template <>
struct Table<cumulet_ground_desc> {
  using Desc = cumulet_ground_desc;
  static constexpr const char* name = "cumulet_ground_desc";
  static constexpr std::tuple rows = {
      Setting(&Desc::mode, {.name = "mode", .choices = ground_choices,
        .key = "ground.mode", .flag = "--ground",
        .help = "Ground plane, infinite: diffuse, or a shadow catcher, which shows the ground of the environment or sky "
                "with the shadows on it (default: below, if no light is given; with a model only in cumulet-render "
                "with --background sky; shadow-catcher, if an environment is given; else none)",
        .row = {.label = "Ground", .tip = "Infinite ground plane."}}),
      Setting(&Desc::height, {.name = "height", .range = {-1e30, 1e30},
        .key = "ground.height", .flag = "--ground-height", .type = "Y",
        .help = "Height (y) of the ground plane (default: 0); implies --ground at-height, or "
                "shadow-catcher-at-height with an environment",
        .row = {.label = "Ground height",
                .tip = "Height (y) of the ground plane.",
                .least = -1e3, .most = 1e3, .format = "%.4g"}}),
      Setting(&Desc::albedo, {.name = "albedo", .range = {0.0, 1.0}, .zero = 0.3,
        .key = "ground.albedo", .flag = "--ground-albedo", .type = "R,G,B",
        .help = "Albedo of the ground plane (default: 0.3,0.3,0.3)",
        .row = {.label = "Ground color", .tip = "Color of the ground plane."}})};
};

template <>
struct Table<cumulet_surface_settings_desc> {
  using Desc = cumulet_surface_settings_desc;
  static constexpr const char* name = "cumulet_surface_settings_desc";
  static constexpr std::tuple rows = {
      Setting(&Desc::time, {.name = "time",
        .key = "surfaces.time", .flag = "--gltf-time", .type = "SECONDS",
        .help = "Time in the model's animation (default: 0)",
        .row = {.label = "Time",
                .tip = "Time in the model's animation, in seconds.",
                .format = "%.2f s"}}),
      Setting(&Desc::animation, {.name = "animation",
        .key = "surfaces.animation", .flag = "--gltf-animation", .type = "N",
        .help = "Index of the animation, from 0 (default: 0)"}),
      Setting(&Desc::lighting, {.name = "lighting", .choices = surface_lighting_choices,
        .key = "surfaces.lighting", .flag = "--surface-lighting",
        .help = "Lighting of surfaces: global illumination, direct light only (with shadows), or rasterized "
                "without shadows (default: global)",
        .row = {.label = "Surface lighting",
                .tip = "Light that the surfaces receive and reflect."}}),
      Setting(&Desc::indirect_roughness, {.name = "indirect_roughness", .range = {0.0, 1.0},
        .key = "surfaces.indirect_roughness", .flag = "--indirect-roughness", .type = "R",
        .help = "Minimum roughness after a diffuse bounce; reduces fireflies (Cycles: Filter Glossy) (default: 0, "
                "no bias)",
        .row = {.label = "Indirect roughness",
                .tip = "Minimum roughness after a diffuse bounce. Removes fireflies from caustics; directly "
                       "visible surfaces do not change. 0: unbiased.",
                .most = 1.0, .format = "%.2f"}}),
      Setting(&Desc::double_sided, {.name = "double_sided",
        .key = "surfaces.double_sided", .flag = "--double-sided",
        .help = "Show both sides of all surfaces, for files with inverted triangle winding",
        .row = {.label = "Double sided",
                .tip = "Shows both sides of all surfaces, for models with inverted triangle winding."}}),
      Setting(&Desc::variant, {.name = "variant"}),
      Setting(&Desc::group, {.name = "group", .range = group_range,
        .key = "surfaces.group", .flag = "--gltf-group", .type = "N",
        .help = "Light group of the model's emission and lights, from 0 to 7 (default: 0); see --light-groups"}),
      Setting(&Desc::holdout, {.name = "holdout",
        .key = "surfaces.holdout", .flag = "--gltf-holdout",
        .help = "Holdout: the model leaves a hole with alpha 0 in the image"})};
};

template <>
struct Table<cumulet_grid_desc> {
  using Desc = cumulet_grid_desc;
  static constexpr const char* name = "cumulet_grid_desc";
  static constexpr std::tuple rows = {
      Setting(&Desc::type, {.name = "type", .choices = grid_type_choices,
        .key = "grid.type", .flag = "--grid-type",
        .help = "Grid type: adaptive tetrahedra (default), all voxels, or voxels with empty 8^3 bricks skipped",
        .row = {.label = "Grid type",
                .tip = "The grid that rays traverse (key M)."}}),
      Setting(&Desc::cells, {.name = "cells", .choices = cells_choices,
        .key = "grid.cells", .flag = "--cells",
        .help = "Density in a tetrahedron: constant, linear, or for close views with --interpolation linear trilinear "
                "in the finest ones (default: linear)",
        .row = {.label = "Cells",
                .tip = "Density in a tetrahedron: constant, linear, or trilinear in the finest ones."}}),
      Setting(&Desc::criterion, {.name = "criterion", .choices = criterion_choices,
        .key = "grid.criterion", .flag = "--criterion",
        .help = "Refinement criterion (default: transmittance; if only --threshold is given, deviation)",
        .row = {.label = "Criterion",
                .tip = "Refinement criterion: the error of a cell that is compared with the threshold."}}),
      Setting(&Desc::threshold, {.name = "threshold", .given = not_negative, .spelling = Spelling::zero_is_negative,
        .key = "grid.threshold", .flag = "--threshold", .type = "T",
        .help = "Split cells whose criterion is above this; 0: refine down to the voxels (default: 0.15; "
                "deviation: 0.02; range-mean: 1)",
        .row = {.label = "Threshold",
                .tip = "Cells whose criterion is above this are split. Smaller values give a finer grid.",
                .format = "%.4g", .logarithmic = true}}),
      Setting(&Desc::max_cells, {.name = "max_cells", .given = Range{1.0}, .zero = 5.4e6,
        .key = "grid.max_cells", .flag = "--max-cells", .type = "N",
        .help = "Maximum number of cells (default: 5400000)",
        .row = {.label = "Max cells",
                .tip = "Maximum number of cells. Cells with the largest criterion are split first.",
                .least = 1e3, .most = 5e7, .logarithmic = true}}),
      Setting(&Desc::camera_adaptive, {.name = "camera_adaptive",
        .key = "grid.camera_adaptive", .flag = "--camera-adaptive", .type = "on|off",
        .help = "Keep cells coarse if they are out of view or smaller than a pixel (default: off)",
        .row = {.label = "Camera adaptive",
                .tip = "Keeps cells coarse if they are out of view or smaller than a few pixels."}}),
      Setting(&Desc::pixel_size, {.name = "pixel_size", .range = {0.0, 1e6}, .given = above_zero, .zero = 1.0,
        .key = "grid.pixel_size", .flag = "--pixel-size", .type = "P",
        .help = "Split only cells whose longest edge covers at least this many pixels (default: 1)",
        .row = {.label = "Pixel size",
                .tip = "Only cells whose longest edge covers at least this many pixels are split.",
                .least = 0.25, .most = 32.0, .format = "%.2f", .logarithmic = true}}),
      Setting(&Desc::build_device, {.name = "build_device", .choices = build_device_choices,
        .key = "grid.build_device", .flag = "--build-device",
        .help = "Build the grid on the CPU or the GPU (default: cpu). Grids that do not fit in GPU memory are "
                "built on the CPU",
        .row = {.label = "Build on",
                .tip = "Where the grid is built. The GPU is faster when the camera moves with a camera-adaptive "
                       "grid."}}),
      Setting(&Desc::interpolation, {.name = "interpolation", .choices = voxel_interpolation_choices,
        .key = "grid.interpolation", .flag = "--interpolation",
        .help = "Interpolation between voxels: constant cubes, or trilinear between their centers (default: auto, "
                "which is linear)",
        .row = {.label = "Interpolation",
                .tip = "The density between the centers of voxels."}})};
};

template <>
struct Table<cumulet_sampling_desc> {
  using Desc = cumulet_sampling_desc;
  static constexpr const char* name = "cumulet_sampling_desc";
  static constexpr std::tuple rows = {
      Setting(&Desc::samples, {.name = "samples", .given = Range{1.0}, .zero = 256.0,
        .key = "picture.samples", .flag = "--spp", .type = "N",
        .help = "Samples per pixel (default: 64; maximum and default with --noise-target or --time-limit: 65536)",
        .row = {.label = "Max samples",
                .tip = "Samples per pixel at most. Raising it continues the current render.",
                .least = 1.0, .most = 65536.0, .logarithmic = true}}),
      Setting(&Desc::noise_target_percent, {.name = "noise_target_percent", .range = {0.0, 100.0},
        .key = "picture.noise_target_percent", .flag = "--noise-target", .type = "PERCENT",
        .help = "Stop when the image noise is at or below this; 0: no noise target (default)",
        .row = {.label = "Noise target",
                .tip = "Rendering stops at this noise, or at the maximum of samples if that comes first.",
                .most = 100.0, .format = "%.2f %%", .logarithmic = true, .zero = "none"}}),
      Setting(&Desc::adaptive, {.name = "adaptive",
        .key = "picture.adaptive", .flag = "--adaptive", .type = "on|off",
        .help = "Adaptive sampling with --noise-target: more samples in noisy areas (default: off)",
        .row = {.label = "Adaptive",
                .tip = "Adaptive sampling: with a noise target, noisy areas get more samples. Off: all pixels "
                       "have the same number."}}),
      Setting(&Desc::seed, {.name = "seed",
        .key = "picture.seed", .flag = "--seed", .type = "S",
        .help = "Random seed; the same seed and driver give the same image (default: 0)",
        .row = {.label = "Seed",
                .tip = "Random seed. The same seed and settings give the same image."}}),
      Setting(&Desc::view, {.name = "view", .choices = view_choices,
        .key = "picture.view", .flag = "--view",
        .help = "The shaded image (default), or a debug view of the grid",
        .row = {.label = "View",
                .tip = "The shaded image, or a debug view of the grid (keys 1 to 5)."}}),
      Setting(&Desc::preview, {.name = "preview", .choices = preview_choices}),
      Setting(&Desc::separate_volume_aov, {.name = "separate_volume_aov"}),
      Setting(&Desc::first_sample, {.name = "first_sample"}),
      Setting(&Desc::region, {.name = "region", .range = {0.0, 1.0},
        .key = "picture.region", .flag = "--region", .type = "X,Y,W,H",
        .help = "Render region (crop window), in fractions of the image from the upper left; W or H 0: to the "
                "edge (default: 0,0,0,0, the full image)",
        .row = {.label = "Region",
                .tip = "Render region (crop window): left, top, width and height as fractions (Ctrl+B, then "
                       "drag). Width or height 0: to the edge.",
                .most = 1.0, .format = "%.3f"}}),
      Setting(&Desc::light_groups, {.name = "light_groups", .range = {0.0, CUMULET_LIGHT_GROUPS}}),
      Setting(&Desc::shutter_seconds, {.name = "shutter_seconds", .range = {0.0, 1e6},
        .key = "picture.shutter_seconds", .flag = "--shutter", .type = "S",
        .help = "Motion blur: seconds that the shutter is open, centered at the frame time; 0: none (default)",
        .row = {.label = "Shutter",
                .tip = "Motion blur: shutter time in seconds, for moving cameras and objects, and volumes with "
                       "velocity.",
                .most = 1.0, .format = "%.4g s", .logarithmic = true, .zero = "none"}})};
};

template <>
struct Table<cumulet_display_desc> {
  using Desc = cumulet_display_desc;
  static constexpr const char* name = "cumulet_display_desc";
  static constexpr std::tuple rows = {
      Setting(&Desc::exposure_stops, {.name = "exposure_stops", .range = {-64.0, 64.0},
        .key = "display.exposure_stops", .flag = "--exposure", .type = "STOPS",
        .help = "Exposure of the display and of .png files: multiply by 2^STOPS (default: 0)",
        .row = {.label = "Exposure",
                .tip = "Brightness in stops; each stop doubles the light. Does not restart the render (keys [ and "
                       "]).",
                .least = -10.0, .most = 10.0, .format = "%.2f stops"}}),
      Setting(&Desc::tone_map, {.name = "tone_map", .choices = tone_map_choices,
        .key = "display.tone_map", .flag = "--tone-map",
        .help = "Tone mapping of the display and of .png files (default: neutral, Khronos PBR Neutral)",
        .row = {.label = "Tone map",
                .tip = "Tone mapping of the display and of PNG files."}}),
      Setting(&Desc::background, {.name = "background", .choices = background_choices,
        .key = "display.background", .flag = "--background",
        .help = "Background of the image (default: sky). Lighting and reflections do not change",
        .row = {.label = "Background",
                .tip = "Background of the image."}}),
      Setting(&Desc::background_color, {.name = "background_color", .range = light_range,
        .key = "display.background_color", .flag = "--background-color", .type = "R,G,B",
        .help = "Background color, linear radiance (default: 0,0,0); implies --background color",
        .row = {.label = "Background color",
                .tip = "Color of the background, if it is one color."}}),
      Setting(&Desc::denoise, {.name = "denoise", .choices = denoise_choices,
        .key = "display.denoise", .flag = "--denoise",
        .help = "Denoise the display: fast (with a filter) or off (default: fast)",
        .row = {.label = "Denoise",
                .tip = "Denoises the display. Files with linear values are not denoised."}})};
};

template <>
struct Table<cumulet_playback_desc> {
  using Desc = cumulet_playback_desc;
  static constexpr const char* name = "cumulet_playback_desc";
  static constexpr std::tuple rows = {
      Setting(&Desc::frames_per_second, {.name = "frames_per_second", .range = {0.0, 1e6},
        .given = Range{0.0, 1e6, true}, .zero = 24.0,
        .key = "sequence.frames_per_second",
        .row = {.label = "Frame rate",
                .tip = "Playback speed of the sequence in frames per second.",
                .least = 1.0, .most = 120.0, .format = "%.4g fps"}}),
      Setting(&Desc::offset_seconds, {.name = "offset_seconds", .range = {-1e9, 1e9},
        .key = "sequence.offset_seconds",
        .row = {.label = "Start time",
                .tip = "Time of the first frame, for models whose animations play along.",
                .least = -10.0, .most = 10.0, .format = "%.2f s"}}),
      Setting(&Desc::repeat, {.name = "repeat", .choices = repeat_choices,
        .key = "sequence.repeat",
        .row = {.label = "Repeat", .tip = "Playback after the last frame."}}),
      Setting(&Desc::first_frame, {.name = "first_frame"}),
      Setting(&Desc::frame_count, {.name = "frame_count"}),
      Setting(&Desc::interpolation, {.name = "interpolation", .choices = interpolation_choices,
        .key = "sequence.interpolation", .flag = "--frame-interpolation",
        .help = "Frame interpolation for fractional frames such as --frames 1-10x0.5 (default: advect)",
        .row = {.label = "Interpolation", .tip = "Interpolation between two frames."}}),
      Setting(&Desc::subframes, {.name = "subframes", .given = Range{1.0, 1000.0}, .zero = 4.0,
        .key = "sequence.subframes",
        .row = {.label = "Sub-frames",
                .tip = "Interpolated frames per frame. Each is built and cached like a frame.",
                .least = 1.0, .most = 32.0}}),
      Setting(&Desc::velocity_scale, {.name = "velocity_scale", .range = {-1e6, 1e6}, .zero = 1.0,
        .key = "sequence.velocity_scale", .flag = "--velocity-scale", .type = "K",
        .help = "Multiplier of the velocities for interpolation (default: 1, for units per second)",
        .row = {.label = "Velocity scale",
                .tip = "Multiplier of the velocities for interpolation, for files whose velocities are not in "
                       "units per second.",
                .least = -4.0, .most = 4.0, .format = "%.3g"}})};
};

template <>
struct Table<cumulet_camera_desc> {
  using Desc = cumulet_camera_desc;
  static constexpr const char* name = "cumulet_camera_desc";
  static constexpr std::tuple rows = {
      Setting(&Desc::eye, {.name = "eye"}),
      Setting(&Desc::target, {.name = "target"}),
      Setting(&Desc::up, {.name = "up"}),
      Setting(&Desc::fovy_degrees, {.name = "fovy_degrees", .zero = 40.0,
        .row = {.label = "Field of view",
                .tip = "Vertical field of view.",
                .least = 2.0, .most = 150.0, .format = "%.1f°"}}),
      Setting(&Desc::orthographic_height, {.name = "orthographic_height"}),
      Setting(&Desc::near_plane, {.name = "near_plane"}),
      Setting(&Desc::far_plane, {.name = "far_plane"}),
      Setting(&Desc::depth, {.name = "depth", .choices = depth_choices}),
      Setting(&Desc::lens_radius, {.name = "lens_radius", .range = not_negative,
        .key = "camera.lens_radius", .flag = "--lens-radius", .type = "R",
        .help = "Depth of field: lens radius in world units (default: 0, pinhole)",
        .row = {.label = "Aperture radius",
                .tip = "Depth of field: radius of the lens opening in world units. A larger one blurs what is out of "
                       "focus.",
                .least = 1e-3, .most = 100.0, .format = "%.3g", .logarithmic = true, .zero = "all sharp"}}),
      Setting(&Desc::focus_distance, {.name = "focus_distance", .range = not_negative,
        .key = "camera.focus_distance", .flag = "--focus-distance", .type = "D",
        .help = "Focus distance from the eye along the viewing axis; 0: distance of the target (default)",
        .row = {.label = "Focus distance",
                .tip = "Distance at which objects are in focus.",
                .least = 1e-2, .most = 1e4, .format = "%.4g", .logarithmic = true, .zero = "at the target"}})};
};

template <>
struct Table<cumulet_navigation_desc> {
  using Desc = cumulet_navigation_desc;
  static constexpr const char* name = "cumulet_navigation_desc";
  static constexpr std::tuple rows = {
      Setting(&Desc::style, {.name = "style", .choices = navigation_choices,
        .row = {.label = "Navigation",
                .tip = "Mouse and keyboard preset; Help (F1) lists the controls."}}),
      Setting(&Desc::fly, {.name = "fly",
        .row = {.label = "Fly",
                .tip = "Fly mode (G). Any button: look around; W A S D: move; E and Q: up and down; Shift: faster."}}),
      Setting(&Desc::speed, {.name = "speed", .range = {0.0, 1e6}, .zero = 1.0,
        .row = {.label = "Speed",
                .tip = "Speed of camera motion.",
                .least = 0.05, .most = 20.0, .format = "%.2f", .logarithmic = true}}),
      Setting(&Desc::turntable_degrees_per_second, {.name = "turntable_degrees_per_second", .range = {-3600.0, 3600.0},
        .row = {.label = "Turn speed",
                .tip = "Degrees per second; negative values turn in the other direction.",
                .least = -90.0, .most = 90.0, .format = "%.1f°/s"}})};
};

// clang-format on

/// Returns the refinement criterion of a grid. A descriptor of zeros selects the default, not the criterion that has
/// the value 0.
[[nodiscard]] constexpr cumulet_refinement_criterion criterion_of(const cumulet_grid_desc& desc) {
  const bool zeros = desc.criterion == CUMULET_CRITERION_DEVIATION && desc.threshold == 0.0;
  return zeros ? CUMULET_CRITERION_TRANSMITTANCE : desc.criterion;
}

/// Returns the threshold that 0 means, for a criterion from criterion_of().
[[nodiscard]] constexpr double default_threshold(cumulet_refinement_criterion criterion) {
  switch (criterion) {
    case CUMULET_CRITERION_TRANSMITTANCE:
      return 0.15;
    case CUMULET_CRITERION_RANGE_MEAN:
      return 1.0;
    default:
      return 0.02;
  }
}

/// For a descriptor whose criterion was set explicitly: sets the threshold so that a criterion of 0 is taken literally.
constexpr void name_criterion(cumulet_grid_desc& desc) {
  if (criterion_of(desc) != desc.criterion) desc.threshold = default_threshold(desc.criterion);
}

/// Returns the angular diameter of the sun that 0 means, in degrees.
[[nodiscard]] constexpr float default_sun_angle(cumulet_sky_model sky) {
  return sky == CUMULET_SKY_PHYSICAL ? 0.53F : 0.0F;
}

}  // namespace cumulet::settings
