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
    Choice{"dense", CUMULET_GRID_DENSE, "Dense voxels", "Every voxel: the reference."},
    Choice{"bricks", CUMULET_GRID_BRICKS, "Bricks", "Voxels, with empty 8x8x8 bricks skipped.", "brick"}};
inline constexpr std::array cells_choices = {
    Choice{"constant", CUMULET_CELLS_CONSTANT, "Constant", "The mean."},
    Choice{"linear", CUMULET_CELLS_LINEAR, "Linear", "A least-squares fit: fewer cells for the same error."}};
inline constexpr std::array criterion_choices = {
    Choice{"transmittance", CUMULET_CRITERION_TRANSMITTANCE, "Transmittance",
           "What is seen of deviations: less where little light comes and goes."},
    Choice{"range-mean", CUMULET_CRITERION_RANGE_MEAN, "Range / mean", "(max - min) / mean, as in the paper."},
    Choice{"deviation", CUMULET_CRITERION_DEVIATION, "Deviation",
           "Standard deviation x edge length, against the mean depth."}};
inline constexpr std::array build_device_choices = {
    Choice{"cpu", CUMULET_BUILD_CPU, "CPU", "A worker builds the cells."},
    Choice{"gpu", CUMULET_BUILD_GPU, "GPU", "Compute shaders build the cells, within frames' budgets."}};
inline constexpr std::array surface_lighting_choices = {
    Choice{"global", CUMULET_SURFACE_LIGHTING_GLOBAL, "Global", "To each other and to the volume, and back.", "full"},
    Choice{"direct", CUMULET_SURFACE_LIGHTING_DIRECT, "Direct",
           "Sun, sky, lights and emissive surfaces only, and the shadows of all: faster.", "shadows"},
    Choice{"rasterized", CUMULET_SURFACE_LIGHTING_RASTERIZED, "Rasterized", "Without shadows: the fastest.", "none"}};
inline constexpr std::array phase_choices = {
    Choice{"hg", CUMULET_PHASE_HG, "One lobe", "Henyey-Greenstein's."},
    Choice{"two-lobe", CUMULET_PHASE_TWO_LOBE, "Two lobes", "Of Henyey-Greenstein: say, one forward and one back."},
    Choice{"mie", CUMULET_PHASE_MIE, "Droplets", "What water droplets of one size do: clouds and fog."}};
inline constexpr std::array sky_choices = {
    Choice{"constant", CUMULET_SKY_CONSTANT, "Constant", "One colour from everywhere."},
    Choice{"physical", CUMULET_SKY_PHYSICAL, "Physical", "A clear day's, with the sun where it stands."}};
inline constexpr std::array ground_choices = {
    Choice{"none", CUMULET_GROUND_NONE, "None", "Nothing."},
    Choice{"below", CUMULET_GROUND_BELOW, "Below", "At the lowest point of volume and surfaces."},
    Choice{"at-height", CUMULET_GROUND_AT_HEIGHT, "At a height", "Where it is set to be."}};
inline constexpr std::array repeat_choices = {
    Choice{"hold", CUMULET_REPEAT_HOLD, "Hold", "The first and the last frame stay."},
    Choice{"loop", CUMULET_REPEAT_LOOP, "Loop", "After the last frame the first."},
    Choice{"ping-pong", CUMULET_REPEAT_PING_PONG, "Ping-pong", "Back, and forth again."}};
inline constexpr std::array interpolation_choices = {
    Choice{"none", CUMULET_FRAME_INTERPOLATION_NONE, "Nothing", "The frame that came last stays until the next."},
    Choice{"blend", CUMULET_FRAME_INTERPOLATION_BLEND, "Blended", "A frame fades into the next."},
    Choice{"advect", CUMULET_FRAME_INTERPOLATION_ADVECT, "Advected",
           "Frames move along their velocity; those without fade into the next."}};
inline constexpr std::array view_choices = {
    Choice{"shaded", CUMULET_VIEW_SHADED, "Shaded", "The path-traced picture."},
    Choice{"cells", CUMULET_VIEW_CELLS, "Cells", "The cells on a cut through the middle, coloured by level."},
    Choice{"steps", CUMULET_VIEW_STEPS, "Steps", "How many cells a camera ray passes, as a heat map."},
    Choice{"density", CUMULET_VIEW_DENSITY, "Density", "The opacity along each camera ray."},
    Choice{"wireframe", CUMULET_VIEW_WIREFRAME, "Wireframe", "The edges of the cells that hold density."}};
inline constexpr std::array preview_choices = {Choice{"auto", CUMULET_PREVIEW_AUTO, "", ""},
                                               Choice{"off", CUMULET_PREVIEW_OFF, "", ""}};
inline constexpr std::array tone_map_choices = {
    Choice{"neutral", CUMULET_TONE_MAP_NEUTRAL, "Neutral", "Khronos PBR Neutral: keeps colours, rolls off highlights."},
    Choice{"filmic", CUMULET_TONE_MAP_FILMIC, "Filmic", "A fit of the ACES curve: more contrast."},
    Choice{"clip", CUMULET_TONE_MAP_CLIP, "Clip", "What is above 1 is white."}};
inline constexpr std::array background_choices = {
    Choice{"sky", CUMULET_BACKGROUND_SKY, "Sky", "The sky's radiance."},
    Choice{"transparent", CUMULET_BACKGROUND_TRANSPARENT, "Transparent",
           "Nothing: saved pictures have an alpha channel."},
    Choice{"color", CUMULET_BACKGROUND_COLOR, "Colour", "One colour; what lights the scene stays."}};
inline constexpr std::array denoise_choices = {
    Choice{"off", CUMULET_DENOISE_OFF, "Off", "Samples as they are."},
    Choice{"fast", CUMULET_DENOISE_FAST, "Fast", "Neighbours help, the less the more samples there are."}};
inline constexpr std::array navigation_choices = {
    Choice{"simple", CUMULET_NAVIGATION_SIMPLE, "Simple", "Left: orbit; middle or Shift+left: pan; right: dolly."},
    Choice{"blender", CUMULET_NAVIGATION_BLENDER, "Blender", "Middle: orbit; Shift: pan; Ctrl: dolly; keypad views."},
    Choice{"maya", CUMULET_NAVIGATION_MAYA, "Maya", "Alt + left: orbit; Alt + middle: pan; Alt + right: dolly."}};
inline constexpr std::array depth_choices = {Choice{"standard", CUMULET_DEPTH_STANDARD, "", ""},
                                             Choice{"reversed", CUMULET_DEPTH_REVERSED, "", ""}};

inline constexpr std::array analytic_light_choices = {
    Choice{"point", CUMULET_LIGHT_POINT, "Point", "The same in all directions."},
    Choice{"spot", CUMULET_LIGHT_SPOT, "Spot", "A point that shines into a cone."},
    Choice{"disk", CUMULET_LIGHT_DISK, "Disk", "A round area that shines to one side.", "disc"},
    Choice{"rect", CUMULET_LIGHT_RECT, "Rectangle", "An area that shines to one side.", "rectangle"},
    Choice{"distant", CUMULET_LIGHT_DISTANT, "Distant", "Far away: the same everywhere.", "sun"}};

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
        .row = {.label = "Density scale",
                .tip = "Extinction is this times the grid's value, per world unit.",
                .least = 1e-4, .most = 1e4, .format = "%.4g", .logarithmic = true}}),
      Setting(&Desc::coalbedo, {.name = "coalbedo", .range = {0.0, 1.0}, .spelling = Spelling::complement,
        .key = "medium.albedo", .flag = "--albedo", .type = "R,G,B",
        .help = "Single-scattering albedo, each from 0 to 1 (default: 1,1,1)",
        .row = {.label = "Albedo",
                .tip = "Single-scattering albedo: the part of light that goes on after a collision. White: nothing "
                       "is absorbed."}}),
      Setting(&Desc::anisotropy, {.name = "anisotropy", .range = {-1.0, 1.0, true},
        .key = "medium.anisotropy", .flag = "--anisotropy", .type = "G",
        .help = "Henyey-Greenstein g, of two lobes the first one's, between -1 and 1; not of mie (default: 0, isotropic)",
        .row = {.label = "Anisotropy",
                .tip = "Henyey-Greenstein g: below 0 light turns back, above 0 it goes on forward. Droplets have none.",
                .least = -0.99, .most = 0.99}}),
      Setting(&Desc::max_bounces, {.name = "max_bounces",
        .key = "medium.max_bounces", .flag = "--max-bounces", .type = "N",
        .help = "Scattering events a path may have; 0: no limit (default)",
        .row = {.label = "Max bounces",
                .tip = "Scattering events a path may have.",
                .most = 256.0, .logarithmic = true, .zero = "no limit"}}),
      Setting(&Desc::emission, {.name = "emission", .range = light_range,
        .key = "medium.emission", .flag = "--emission", .type = "R,G,B",
        .help = "What an opaque body of the medium glows with, as fire does (default: 0,0,0)",
        .row = {.label = "Glow",
                .tip = "Radiance of an opaque body of the medium, as of fire: it lights all the rest. 0: dark.",
                .most = 1000.0,
                .color = "Glow colour",
                .color_tip = "The colour of the medium's own light, as it looks on the screen.",
                .hue = {1.0F, 0.35F, 0.08F}}}),
      Setting(&Desc::phase, {.name = "phase", .choices = phase_choices,
        .key = "medium.phase", .flag = "--phase",
        .help = "Where light goes that the medium scatters (default: hg)",
        .row = {.label = "Phase function", .tip = "Where light goes that the medium scatters."}}),
      Setting(&Desc::second_anisotropy, {.name = "second_anisotropy", .range = {-1.0, 1.0, true},
        .key = "medium.second_anisotropy", .flag = "--second-anisotropy", .type = "G",
        .help = "g of the second of two lobes, between -1 and 1 (default: 0)",
        .row = {.label = "Second anisotropy",
                .tip = "Of two lobes the second one's Henyey-Greenstein g.",
                .least = -0.99, .most = 0.99}}),
      Setting(&Desc::second_weight, {.name = "second_weight", .range = {0.0, 1.0}, .given = Range{0.01, 1.0},
        .zero = 0.5,
        .key = "medium.second_weight", .flag = "--second-weight", .type = "W",
        .help = "Weight of the second of two lobes, from 0.01 to 1 (default: 0.5)",
        .row = {.label = "Lobe mix",
                .tip = "Of two lobes the part of the light that is in the second one.",
                .least = 0.01, .most = 1.0}}),
      Setting(&Desc::droplet_diameter, {.name = "droplet_diameter", .range = {5.0, 50.0}, .zero = 20.0,
        .key = "medium.droplet_diameter", .flag = "--droplet-diameter", .type = "UM",
        .help = "Of droplets (mie), from 5 to 50 micrometres (default: 20)",
        .row = {.label = "Droplet diameter",
                .tip = "Of droplets, in micrometres: fog has small ones, clouds have some of 20.",
                .least = 5.0, .most = 50.0, .format = "%.1f µm"}}),
      Setting(&Desc::flame_strength, {.name = "flame_strength", .range = light_range, .given = above_zero, .zero = 1.0,
        .key = "medium.flame_strength", .flag = "--flame-strength", .type = "S",
        .help = "Light of the flame grid, a world unit of length where it is 1 (default: 1)",
        .row = {.label = "Flame strength",
                .tip = "Light that the flame grid gives off, per world unit where it is 1.",
                .least = 1e-3, .most = 1e3, .format = "%.4g", .logarithmic = true}}),
      Setting(&Desc::flame_color, {.name = "flame_color", .range = light_range, .zero = 1.0,
        .key = "medium.flame_color", .flag = "--flame-color", .type = "R,G,B",
        .help = "Its colour (default: 1,1,1)",
        .row = {.label = "Flame colour", .tip = "The colour of the flame grid's light."}}),
      Setting(&Desc::temperature_scale, {.name = "temperature_scale", .range = light_range, .given = above_zero,
        .key = "medium.temperature_scale", .flag = "--temperature-scale", .type = "K",
        .help = "Kelvin where the temperature grid is 1 (default: 1500, or 1 for a grid that reaches more than 20: it "
                "holds kelvin)",
        .row = {.label = "Temperature scale",
                .tip = "Kelvin where the temperature grid is 1. By its values: 1500, or 1 if they are kelvin.",
                .most = 1e4, .format = "%.4g K", .logarithmic = true, .zero = "by its values"}}),
      Setting(&Desc::temperature_offset, {.name = "temperature_offset", .range = {-1e6, 1e6},
        .key = "medium.temperature_offset", .flag = "--temperature-offset", .type = "K",
        .help = "Kelvin that are added: 273.15 for degrees Celsius with scale 1 (default: 0)",
        .row = {.label = "Temperature offset",
                .tip = "Kelvin that are added to it.",
                .least = -2000.0, .most = 2000.0, .format = "%.1f K"}}),
      Setting(&Desc::blackbody, {.name = "blackbody", .range = light_range,
        .key = "medium.blackbody", .flag = "--blackbody", .type = "INTENSITY",
        .help = "Light of the temperature grid, as of a black body: 1 by the Stefan-Boltzmann law (default: 0, none)",
        .row = {.label = "Black body",
                .tip = "Light that the temperature grid gives off, as a black body does. 1: as bright as physics has it.",
                .most = 100.0, .format = "%.4g", .logarithmic = true}}),
      Setting(&Desc::blackbody_tint, {.name = "blackbody_tint", .range = light_range, .zero = 1.0,
        .key = "medium.blackbody_tint", .flag = "--blackbody-tint", .type = "R,G,B",
        .help = "Its tint (default: 1,1,1)",
        .row = {.label = "Black body tint", .tip = "Multiplies the black body's colour."}}),
      Setting(&Desc::group, {.name = "group", .range = group_range,
        .key = "medium.group", .flag = "--medium-group", .type = "N",
        .help = "Group of lights that what it gives off is in, from 0 to 7 (default: 0); see --light-groups"}),
      Setting(&Desc::holdout, {.name = "holdout",
        .key = "medium.holdout", .flag = "--medium-holdout",
        .help = "The camera sees a hole in place of the volume, without alpha"})};
};

template <>
struct Table<cumulet_sun_sky_desc> {
  using Desc = cumulet_sun_sky_desc;
  static constexpr const char* name = "cumulet_sun_sky_desc";
  static constexpr std::tuple rows = {
      Setting(&Desc::sun_azimuth_degrees, {.name = "sun_azimuth_degrees", .given = Range{-360.0, 360.0},
        .key = "sun_sky.sun.azimuth_degrees",
        .row = {.label = "Sun azimuth",
                .tip = "From +Z towards +X.",
                .least = -180.0, .most = 180.0, .format = "%.1f°"}}),
      Setting(&Desc::sun_elevation_degrees, {.name = "sun_elevation_degrees", .range = {-90.0, 90.0},
        .key = "sun_sky.sun.elevation_degrees",
        .row = {.label = "Sun elevation",
                .tip = "Above the horizon.",
                .least = -90.0, .most = 90.0, .format = "%.1f°"}}),
      Setting(&Desc::sun_irradiance, {.name = "sun_irradiance", .range = light_range,
        .key = "sun_sky.sun.irradiance",
        .row = {.label = "Sun strength",
                .tip = "Irradiance on a surface that faces the sun; 0: no sun.",
                .most = 1000.0,
                .color = "Sun colour",
                .color_tip = "The sun's colour, as it looks on the screen."}}),
      Setting(&Desc::sky_radiance, {.name = "sky_radiance", .range = light_range,
        .key = "sun_sky.sky.radiance", .flag = "--sky", .type = "R,G,B",
        .help = "Radiance, the same from everywhere",
        .row = {.label = "Sky strength",
                .tip = "Radiance from everywhere; 0: black.",
                .most = 100.0,
                .color = "Sky colour",
                .color_tip = "The sky's colour, as it looks on the screen."}}),
      Setting(&Desc::sky, {.name = "sky", .choices = sky_choices,
        .key = "sun_sky.sky.model",
        .row = {.label = "Sky",
                .tip = "Where sun and sky have their light from."}}),
      Setting(&Desc::turbidity, {.name = "turbidity", .range = {1.0, 10.0}, .zero = 3.0,
        .key = "sun_sky.sky.turbidity",
        .row = {.label = "Turbidity",
                .tip = "Of a physical sky: 2 is very clear, 3 clear, 6 hazy.",
                .least = 1.0, .most = 10.0, .format = "%.1f"}}),
      Setting(&Desc::ground_albedo, {.name = "ground_albedo", .range = {0.0, 1.0},
        .key = "sun_sky.sky.ground_albedo",
        .row = {.label = "Ground albedo",
                .tip = "Of a physical sky: what the ground sends back.",
                .most = 1.0}}),
      Setting(&Desc::sun_angle_degrees, {.name = "sun_angle_degrees", .range = {-180.0, 180.0}, .given = Range{0.0, 180.0},
        .spelling = Spelling::zero_is_negative,
        .key = "sun_sky.sun.angle_degrees", .flag = "--sun-angle", .type = "DEG",
        .help = "That the sun's disc takes, up to 180; 0: none, and hard shadows (default: 0, of a --sky-model 0.53)",
        .row = {.label = "Sun angle",
                .tip = "That the sun's disc takes: larger is softer.",
                .most = 30.0, .format = "%.2f°"}}),
      Setting(&Desc::sun_group, {.name = "sun_group", .range = group_range,
        .key = "sun_sky.sun.group", .flag = "--sun-group", .type = "N",
        .help = "Group of lights that the sun is in, from 0 to 7 (default: 0); see --light-groups"}),
      Setting(&Desc::sky_group, {.name = "sky_group", .range = group_range,
        .key = "sun_sky.sky.group", .flag = "--sky-group", .type = "N",
        .help = "Likewise, of the sky or the environment"})};
};

/// The settings of one light in a list: keys are those of its object in a scene file.
template <>
struct Table<cumulet_light_desc> {
  using Desc = cumulet_light_desc;
  static constexpr const char* name = "cumulet_light_desc";
  static constexpr std::tuple rows = {
      Setting(&Desc::kind, {.name = "kind", .choices = analytic_light_choices,
        .key = "kind",
        .row = {.label = "Light", .tip = "What shape of light it is."}}),
      Setting(&Desc::position, {.name = "position",
        .key = "position",
        .row = {.label = "Position", .tip = "In the world, of its middle."}}),
      Setting(&Desc::direction, {.name = "direction",
        .key = "direction",
        .row = {.label = "Direction", .tip = "Where it shines."}}),
      Setting(&Desc::tangent, {.name = "tangent",
        .key = "tangent",
        .row = {.label = "Tangent", .tip = "Along a rectangle's width."}}),
      Setting(&Desc::color, {.name = "color", .range = light_range, .zero = 1.0,
        .key = "color",
        .row = {.label = "Light colour", .tip = "Times its power."}}),
      Setting(&Desc::power, {.name = "power", .range = light_range,
        .key = "power",
        .row = {.label = "Power",
                .tip = "Watts, as Blender's; of a distant light W/m² on what faces it.",
                .most = 1e6, .format = "%.4g", .logarithmic = true}}),
      Setting(&Desc::width, {.name = "width", .range = {0.0, 1e30}, .given = above_zero, .zero = 1.0,
        .key = "width",
        .row = {.label = "Width",
                .tip = "Of a rectangle; a disk's diameter.",
                .least = 1e-3, .most = 1e4, .format = "%.4g", .logarithmic = true}}),
      Setting(&Desc::height, {.name = "height", .range = {0.0, 1e30}, .given = above_zero, .zero = 1.0,
        .key = "height",
        .row = {.label = "Height",
                .tip = "Of a rectangle.",
                .least = 1e-3, .most = 1e4, .format = "%.4g", .logarithmic = true}}),
      Setting(&Desc::angle_degrees, {.name = "angle_degrees", .range = {0.0, 180.0},
        .key = "angle_degrees",
        .row = {.label = "Angle",
                .tip = "Of a spot's whole cone; what a distant light covers of the sky.",
                .most = 180.0, .format = "%.1f°"}}),
      Setting(&Desc::blend, {.name = "blend", .range = {0.0, 1.0},
        .key = "blend",
        .row = {.label = "Blend",
                .tip = "The part of a spot's cone in which it dims.",
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
        .help = "Turns the environment's middle from +Z towards +X (default: 0)",
        .row = {.label = "Env. turn",
                .tip = "Turns the environment from +Z towards +X.",
                .least = -180.0, .most = 180.0, .format = "%.1f°"}}),
      Setting(&Desc::strength, {.name = "strength", .range = {0.0, 1e6}, .given = Range{0.0, 1e6, true}, .zero = 1.0,
        .key = "environment.strength", .flag = "--env-strength", .type = "S",
        .help = "Times the environment's radiance (default: 1)",
        .row = {.label = "Env. strength",
                .tip = "Times the environment's radiance.",
                .least = 0.01, .most = 100.0, .format = "%.3g", .logarithmic = true}})};
};

template <>
struct Table<cumulet_ground_desc> {
  using Desc = cumulet_ground_desc;
  static constexpr const char* name = "cumulet_ground_desc";
  static constexpr std::tuple rows = {
      Setting(&Desc::mode, {.name = "mode", .choices = ground_choices,
        .key = "ground.mode", .flag = "--ground",
        .help = "A level plane that catches light and shadows (default: below, without a model or a word of light; "
                "else none)",
        .row = {.label = "Ground", .tip = "A level plane that catches light and shadows."}}),
      Setting(&Desc::height, {.name = "height", .range = {-1e30, 1e30},
        .key = "ground.height", .flag = "--ground-height", .type = "Y",
        .help = "Of a ground at a height (default: 0)",
        .row = {.label = "Ground height",
                .tip = "Its y in the world.",
                .least = -1e3, .most = 1e3, .format = "%.4g"}}),
      Setting(&Desc::albedo, {.name = "albedo", .range = {0.0, 1.0}, .zero = 0.3,
        .key = "ground.albedo", .flag = "--ground-albedo", .type = "R,G,B",
        .help = "What it sends back (default: 0.3,0.3,0.3)",
        .row = {.label = "Ground colour", .tip = "What it sends back of the light."}})};
};

template <>
struct Table<cumulet_surface_settings_desc> {
  using Desc = cumulet_surface_settings_desc;
  static constexpr const char* name = "cumulet_surface_settings_desc";
  static constexpr std::tuple rows = {
      Setting(&Desc::time, {.name = "time",
        .key = "surfaces.time", .flag = "--gltf-time", .type = "SECONDS",
        .help = "Moment of its animation (default: 0)",
        .row = {.label = "Time",
                .tip = "Seconds into the model's animation.",
                .format = "%.2f s"}}),
      Setting(&Desc::animation, {.name = "animation",
        .key = "surfaces.animation", .flag = "--gltf-animation", .type = "N",
        .help = "Which animation of the file, from 0 (default: 0)"}),
      Setting(&Desc::lighting, {.name = "lighting", .choices = surface_lighting_choices,
        .key = "surfaces.lighting", .flag = "--surface-lighting",
        .help = "Light between surfaces and volume (default: global), or only from sun, sky, lights and emissive "
                "surfaces",
        .row = {.label = "Surface lighting",
                .tip = "What light the surfaces pass on."}}),
      Setting(&Desc::indirect_roughness, {.name = "indirect_roughness", .range = {0.0, 1.0},
        .key = "surfaces.indirect_roughness", .flag = "--indirect-roughness", .type = "R",
        .help = "Least roughness that scattered paths find: softens what mirrors and lakes throw (default: 0, no "
                "bias)",
        .row = {.label = "Indirect roughness",
                .tip = "Softens what mirrors and lakes throw on walls and clouds: no bright specks. What you look at "
                       "keeps its gloss. 0: as physics has it.",
                .most = 1.0, .format = "%.2f"}}),
      Setting(&Desc::double_sided, {.name = "double_sided",
        .key = "surfaces.double_sided", .flag = "--double-sided",
        .help = "Show both sides of all surfaces, for files that are wound inside out",
        .row = {.label = "Double sided",
                .tip = "Shows both sides of all surfaces, for models that are wound inside out."}}),
      Setting(&Desc::variant, {.name = "variant"}),
      Setting(&Desc::group, {.name = "group", .range = group_range,
        .key = "surfaces.group", .flag = "--gltf-group", .type = "N",
        .help = "Group of lights that what its surfaces and lights give off is in, from 0 to 7 (default: 0); see "
                "--light-groups"}),
      Setting(&Desc::holdout, {.name = "holdout",
        .key = "surfaces.holdout", .flag = "--gltf-holdout",
        .help = "The camera sees a hole in place of the model, without alpha"})};
};

template <>
struct Table<cumulet_grid_desc> {
  using Desc = cumulet_grid_desc;
  static constexpr const char* name = "cumulet_grid_desc";
  static constexpr std::tuple rows = {
      Setting(&Desc::type, {.name = "type", .choices = grid_type_choices,
        .key = "grid.type", .flag = "--grid-type",
        .help = "Adaptive tetrahedra (default), every voxel, or voxels that skip empty 8^3 bricks",
        .row = {.label = "Grid type",
                .tip = "What rays step through (key M)."}}),
      Setting(&Desc::cells, {.name = "cells", .choices = cells_choices,
        .key = "grid.cells", .flag = "--cells",
        .help = "Density inside a tetrahedron (default: linear)",
        .row = {.label = "Cells",
                .tip = "The density inside a tetrahedron."}}),
      Setting(&Desc::criterion, {.name = "criterion", .choices = criterion_choices,
        .key = "grid.criterion", .flag = "--criterion",
        .help = "What is compared with the threshold (default: transmittance, with a threshold alone deviation)",
        .row = {.label = "Criterion",
                .tip = "What is compared with the threshold, to decide whether a cell is split."}}),
      Setting(&Desc::threshold, {.name = "threshold", .given = not_negative, .spelling = Spelling::zero_is_negative,
        .key = "grid.threshold", .flag = "--threshold", .type = "T",
        .help = "Split cells above it; 0: down to the voxel (default: 0.15, for deviation 0.02, for range-mean 1)",
        .row = {.label = "Threshold",
                .tip = "Cells above it are split: smaller is finer.",
                .format = "%.4g", .logarithmic = true}}),
      Setting(&Desc::max_cells, {.name = "max_cells", .given = Range{1.0}, .zero = 5.4e6,
        .key = "grid.max_cells", .flag = "--max-cells", .type = "N",
        .help = "Stop splitting there (default: 5400000)",
        .row = {.label = "Cell budget",
                .tip = "The most cells: spent where the criterion is largest.",
                .least = 1e3, .most = 5e7, .logarithmic = true}}),
      Setting(&Desc::camera_adaptive, {.name = "camera_adaptive",
        .key = "grid.camera_adaptive", .flag = "--camera-adaptive", .type = "on|off",
        .help = "Keep cells coarse that are out of sight or under a pixel (default: off)",
        .row = {.label = "Camera adaptive",
                .tip = "Keeps cells coarse that are out of sight or smaller than a few pixels."}}),
      Setting(&Desc::pixel_size, {.name = "pixel_size", .range = {0.0, 1e6}, .given = above_zero, .zero = 1.0,
        .key = "grid.pixel_size", .flag = "--pixel-size", .type = "P",
        .help = "Pixels that a split cell's longest edge must cover (default: 1)",
        .row = {.label = "Pixel size",
                .tip = "Pixels that a cell's longest edge must cover to be split.",
                .least = 0.25, .most = 32.0, .format = "%.2f", .logarithmic = true}}),
      Setting(&Desc::build_device, {.name = "build_device", .choices = build_device_choices,
        .key = "grid.build_device", .flag = "--build-device",
        .help = "Device that builds the cells (default: cpu); the CPU builds grids for which GL has no room",
        .row = {.label = "Build on",
                .tip = "Device that builds the cells. On the GPU a camera that moves has its cells sooner."}})};
};

template <>
struct Table<cumulet_sampling_desc> {
  using Desc = cumulet_sampling_desc;
  static constexpr const char* name = "cumulet_sampling_desc";
  static constexpr std::tuple rows = {
      Setting(&Desc::samples, {.name = "samples", .given = Range{1.0}, .zero = 256.0,
        .key = "picture.samples", .flag = "--spp", .type = "N",
        .help = "Samples a pixel (default: 64; with --noise-target or --time-limit the most, 65536)",
        .row = {.label = "Samples",
                .tip = "A pixel; more go on from where it is.",
                .least = 1.0, .most = 65536.0, .logarithmic = true}}),
      Setting(&Desc::noise_target_percent, {.name = "noise_target_percent", .range = {0.0, 100.0},
        .key = "picture.noise_target_percent", .flag = "--noise-target", .type = "PERCENT",
        .help = "Stop once the picture's noise is no more than this; 0: at the samples (default)",
        .row = {.label = "Noise target",
                .tip = "The picture is done once it has no more noise than this, if it takes fewer than its samples.",
                .most = 100.0, .format = "%.2f %%", .logarithmic = true, .zero = "none"}}),
      Setting(&Desc::adaptive, {.name = "adaptive",
        .key = "picture.adaptive", .flag = "--adaptive", .type = "on|off",
        .help = "With --noise-target: sample most where there is most noise (default: off)",
        .row = {.label = "Adaptive",
                .tip = "Up to a noise target, samples go where there is most noise. Off: all pixels have the same."}}),
      Setting(&Desc::seed, {.name = "seed",
        .key = "picture.seed", .flag = "--seed", .type = "S",
        .help = "Same seed, same driver: same picture (default: 0)",
        .row = {.label = "Seed",
                .tip = "The same seed and settings give the same picture."}}),
      Setting(&Desc::view, {.name = "view", .choices = view_choices,
        .key = "picture.view", .flag = "--view",
        .help = "The picture (default), or a look at the grid that made it",
        .row = {.label = "View",
                .tip = "The picture, or a look at the grid that makes it (keys 1 to 5)."}}),
      Setting(&Desc::preview, {.name = "preview", .choices = preview_choices}),
      Setting(&Desc::separate_volume_aov, {.name = "separate_volume_aov"}),
      Setting(&Desc::first_sample, {.name = "first_sample"}),
      Setting(&Desc::region, {.name = "region", .range = {0.0, 1.0},
        .key = "picture.region", .flag = "--region", .type = "X,Y,W,H",
        .help = "Make only this part of the picture, in fractions of it from its upper left; W or H 0: to its end "
                "(default: 0,0,0,0, all of it)",
        .row = {.label = "Region",
                .tip = "The part of the picture that is made: left, top, width, height, as fractions (Ctrl+B, and "
                       "drag). Width or height 0: to the end.",
                .most = 1.0, .format = "%.3f"}}),
      Setting(&Desc::light_groups, {.name = "light_groups", .range = {0.0, CUMULET_LIGHT_GROUPS}}),
      Setting(&Desc::shutter_seconds, {.name = "shutter_seconds", .range = {0.0, 1e6},
        .key = "picture.shutter_seconds", .flag = "--shutter", .type = "S",
        .help = "Motion blur: seconds that the shutter is open, about the frame's moment; 0: none (default)",
        .row = {.label = "Shutter",
                .tip = "Motion blur of what moves while it is open: cameras, places, and volumes by their velocity.",
                .most = 1.0, .format = "%.4g s", .logarithmic = true, .zero = "Still"}})};
};

template <>
struct Table<cumulet_display_desc> {
  using Desc = cumulet_display_desc;
  static constexpr const char* name = "cumulet_display_desc";
  static constexpr std::tuple rows = {
      Setting(&Desc::exposure_stops, {.name = "exposure_stops", .range = {-64.0, 64.0},
        .key = "display.exposure_stops", .flag = "--exposure", .type = "STOPS",
        .help = "Brightens what is shown, and a .png, by 2^STOPS (default: 0)",
        .row = {.label = "Exposure",
                .tip = "Brightness in stops: each doubles the light. Restarts nothing (keys [ and ]).",
                .least = -10.0, .most = 10.0, .format = "%.2f stops"}}),
      Setting(&Desc::tone_map, {.name = "tone_map", .choices = tone_map_choices,
        .key = "display.tone_map", .flag = "--tone-map",
        .help = "From radiance to the screen and a .png (default: neutral, the Khronos PBR one)",
        .row = {.label = "Tone map",
                .tip = "How radiance becomes what the screen can show."}}),
      Setting(&Desc::background, {.name = "background", .choices = background_choices,
        .key = "display.background", .flag = "--background",
        .help = "What is behind all (default: sky); light is the same, and mirrors show the sky",
        .row = {.label = "Background",
                .tip = "What is behind the volume."}}),
      Setting(&Desc::background_color, {.name = "background_color", .range = light_range,
        .key = "display.background_color", .flag = "--background-color", .type = "R,G,B",
        .help = "One colour as the background, linear radiance (default: 0,0,0)",
        .row = {.label = "Background colour",
                .tip = "What is behind the volume, where that is one colour."}}),
      Setting(&Desc::denoise, {.name = "denoise", .choices = denoise_choices,
        .key = "display.denoise", .flag = "--denoise",
        .help = "Take the noise away: `fast` by a filter (default: fast)",
        .row = {.label = "Denoise",
                .tip = "What the screen shows of few samples. Files with linear values have them as they are."}})};
};

template <>
struct Table<cumulet_playback_desc> {
  using Desc = cumulet_playback_desc;
  static constexpr const char* name = "cumulet_playback_desc";
  static constexpr std::tuple rows = {
      Setting(&Desc::frames_per_second, {.name = "frames_per_second", .range = {0.0, 1e6},
        .given = Range{0.0, 1e6, true}, .zero = 24.0,
        .key = "sequence.frames_per_second",
        .row = {.label = "Frames/s",
                .tip = "How fast the sequence plays.",
                .least = 1.0, .most = 120.0, .format = "%.4g"}}),
      Setting(&Desc::offset_seconds, {.name = "offset_seconds", .range = {-1e9, 1e9},
        .key = "sequence.offset_seconds",
        .row = {.label = "Offset",
                .tip = "When, by the clock that a model's animation has, the first frame comes.",
                .least = -10.0, .most = 10.0, .format = "%.2f s"}}),
      Setting(&Desc::repeat, {.name = "repeat", .choices = repeat_choices,
        .key = "sequence.repeat",
        .row = {.label = "Repeat", .tip = "What follows the last frame."}}),
      Setting(&Desc::first_frame, {.name = "first_frame"}),
      Setting(&Desc::frame_count, {.name = "frame_count"}),
      Setting(&Desc::interpolation, {.name = "interpolation", .choices = interpolation_choices,
        .key = "sequence.interpolation", .flag = "--frame-interpolation",
        .help = "What --frames 1-10x0.5 makes between two frames (default: advect)",
        .row = {.label = "Interpolation", .tip = "What is shown between two frames."}}),
      Setting(&Desc::subframes, {.name = "subframes", .given = Range{1.0, 1000.0}, .zero = 4.0,
        .key = "sequence.subframes",
        .row = {.label = "Sub-frames",
                .tip = "From a frame to the next: each is made, and kept, as frames are.",
                .least = 1.0, .most = 32.0}}),
      Setting(&Desc::velocity_scale, {.name = "velocity_scale", .range = {-1e6, 1e6}, .zero = 1.0,
        .key = "sequence.velocity_scale", .flag = "--velocity-scale", .type = "K",
        .help = "By which velocities are multiplied between frames (default: 1: units a second)",
        .row = {.label = "Velocity x",
                .tip = "Of what moves between frames: another where a file's velocities are not units a second.",
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
                .tip = "From bottom to top of the picture.",
                .least = 2.0, .most = 150.0, .format = "%.1f°"}}),
      Setting(&Desc::orthographic_height, {.name = "orthographic_height"}),
      Setting(&Desc::near_plane, {.name = "near_plane"}),
      Setting(&Desc::far_plane, {.name = "far_plane"}),
      Setting(&Desc::depth, {.name = "depth", .choices = depth_choices}),
      Setting(&Desc::lens_radius, {.name = "lens_radius", .range = not_negative,
        .key = "camera.lens_radius", .flag = "--lens-radius", .type = "R",
        .help = "Blur what is not in focus, as a lens of this radius does, in world units",
        .row = {.label = "Lens radius",
                .tip = "Of a lens, which blurs what is nearer or farther than its focus.",
                .least = 1e-3, .most = 100.0, .format = "%.3g", .logarithmic = true, .zero = "Pinhole"}}),
      Setting(&Desc::focus_distance, {.name = "focus_distance", .range = not_negative,
        .key = "camera.focus_distance", .flag = "--focus-distance", .type = "D",
        .help = "What a lens has sharp: its distance from the eye, along the axis; 0: the target's",
        .row = {.label = "Focus",
                .tip = "Distance of what is sharp.",
                .least = 1e-2, .most = 1e4, .format = "%.4g", .logarithmic = true, .zero = "At the target"}})};
};

template <>
struct Table<cumulet_navigation_desc> {
  using Desc = cumulet_navigation_desc;
  static constexpr const char* name = "cumulet_navigation_desc";
  static constexpr std::tuple rows = {
      Setting(&Desc::style, {.name = "style", .choices = navigation_choices,
        .row = {.label = "Navigation",
                .tip = "Whose habits the mouse follows; Help (F1) lists them."}}),
      Setting(&Desc::fly, {.name = "fly",
        .row = {.label = "Fly",
                .tip = "Any button looks around; W A S D move, E and Q rise and sink, Shift is faster (G)."}}),
      Setting(&Desc::speed, {.name = "speed", .range = {0.0, 1e6}, .zero = 1.0,
        .row = {.label = "Speed",
                .tip = "Of all camera motion.",
                .least = 0.05, .most = 20.0, .format = "%.2f", .logarithmic = true}}),
      Setting(&Desc::turntable_degrees_per_second, {.name = "turntable_degrees_per_second", .range = {-3600.0, 3600.0},
        .row = {.label = "Turn speed",
                .tip = "Degrees a second; negative: the other way.",
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
