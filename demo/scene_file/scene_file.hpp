#pragma once

#include <cumulet/cumulet.h>

#include <array>
#include <clip.hpp>
#include <cstddef>
#include <cstdint>
#include <frame_row.hpp>
#include <frames.hpp>
#include <optional>
#include <ramp.hpp>
#include <settings.hpp>
#include <string>
#include <vector>

#include "ground_mode.hpp"
#include "keys.hpp"
#include "names.hpp"
#include "ocio_view.hpp"

namespace cumulet::demo {

/// A volume file, its grids and its transform. Changing any of these requires loading it again.
struct VolumeFile {
  std::string volume;
  std::string grid_name = {};         // density grid; "", here and below: selected by name
  std::string temperature_grid = {};  // "none", here and below: not used
  std::string flame_grid = {};
  std::string color_grid = {};
  std::string anisotropy_grid = {};
  std::string velocity_grid = {};
  UpAxis up = UpAxis::y;              // up axis of the file
  std::array<double, 16> to_world{};  // applied after the up-axis rotation; column-major; all 0: transform of the file

  bool operator==(const VolumeFile&) const = default;
};

/// Playback of a volume whose file name is a frame pattern (demo/sequence).
struct SceneSequence {
  cumulet_playback_desc playback{};  // without the frame range, which the next fields set
  std::optional<Frame> first = {};   // number of the first played frame; nullopt: the first file
  std::optional<Frame> last = {};    // number of the last played frame; nullopt: the last file
  std::optional<Moment> frame = {};  // displayed frame while no clock runs

  SceneSequence() { playback.struct_size = sizeof playback; }
  bool operator==(const SceneSequence& other) const {
    return settings::same(playback, other.playback) && first == other.first && last == other.last &&
           frame == other.frame;
  }
};

/// Returns the library's playback descriptor for these files.
[[nodiscard]] cumulet_playback_desc playback_of(const SceneSequence& sequence, const FrameRow& row);
/// Transforms relative to the world transform of an object, at shutter open and close: 4x4, column-major; nullopt: no
/// motion.
struct SceneShutter {
  std::optional<std::array<double, 16>> open = {};
  std::optional<std::array<double, 16>> close = {};

  bool operator==(const SceneShutter&) const = default;
  [[nodiscard]] bool moves() const { return open || close; }
};
/// Fills a descriptor's open_to_world and close_to_world for an object with the transform to_world. All 0: transform of
/// the file.
void set_shutter(const SceneShutter& shutter, const double (&to_world)[16], double (&open)[16], double (&close)[16]);

/// A volume in a scene, stored as library descriptors with struct_size set. 0 means the library's default.
struct SceneVolume : VolumeFile {
  std::string name;  // "": file name
  bool visible = true;
  std::vector<std::array<double, 16>> transforms;  // instance transforms, applied after to_world; empty: one instance
  SceneShutter shutter;                            // for all instances
  cumulet_medium_desc medium{};
  std::array<settings::RampPoints, settings::ramps.size()> ramps;              // indexed by cumulet_ramp
  std::array<settings::ColorStops, settings::color_ramps.size()> color_ramps;  // indexed by cumulet_ramp
  settings::Clip clip;             // in the world space of the file, after to_world
  SceneSequence sequence;          // for a volume that is a sequence
  bool auto_density_scale = true;  // medium.density_scale is derived from the volume when it is loaded
  bool albedo_given = false;       // the albedo also applies to smoke, which is gray by default

  SceneVolume();
  /// Returns the name, or the file name if there is none.
  [[nodiscard]] std::string label() const;
  [[nodiscard]] bool is_shown() const { return visible && !volume.empty(); }
};

/// A model in a scene, in addition to its surfaces.
struct SceneModel {
  std::string file;                   // glTF file
  std::string name = {};              // "": file name
  std::array<double, 16> to_world{};  // column-major; all 0: transform of the file
  SceneShutter shutter = {};
  bool visible = true;
  bool shadow_only = false;  // invisible to the camera
  bool holdout = false;      // the camera sees a hole (alpha 0)
  double time = 0.0;         // seconds, in its animation
  std::uint32_t animation = 0;
  std::string variant = {};  // material variant, by name or number; "": none
  bool double_sided = false;
  std::uint32_t group = 0;  // light group

  bool operator==(const SceneModel&) const = default;
  /// Returns the name, or the file name if there is none.
  [[nodiscard]] std::string label() const;
};

/// A camera and its poses at shutter open and close.
struct SceneCamera {
  cumulet_camera_desc camera{};
  std::optional<cumulet_camera_desc> camera_open = {};   // nullopt: same as `camera`
  std::optional<cumulet_camera_desc> camera_close = {};  // nullopt: same as `camera`

  SceneCamera() { camera.struct_size = sizeof camera; }
};

/// A saved camera of a scene.
struct NamedCamera : SceneCamera {
  std::string name;  // unique, not empty
};

/// A scene, as all demo programs show it. The base class SceneVolume is the first volume, which the flags and the
/// demo's panel edit; it may be empty.
struct SceneOptions : SceneVolume, SceneCamera {
  std::vector<SceneVolume> others;   // max_bounces is 0: the first volume's value applies to all
  std::string surfaces;              // glTF file; "": none
  std::string surface_variant;       // material variant, by name or number; "": none
  std::int32_t surface_camera = -1;  // index of a camera of the surfaces' file; negative: use `camera`
  std::vector<SceneModel> models;    // in addition to the surfaces, which have the transform of their file
  std::uint32_t width = 1280;
  std::uint32_t height = 720;
  cumulet_grid_desc grid{};
  cumulet_sun_sky_desc light{};
  std::vector<cumulet_light_desc> analytic_lights;
  std::string environment;  // .hdr or .exr file; "": the sky of `light`
  cumulet_environment_settings_desc environment_settings{};
  cumulet_ground_desc ground{};
  std::vector<NamedCamera> cameras;  // saved cameras, in addition to the current one
  cumulet_surface_settings_desc surface{};
  cumulet_sampling_desc sampling{};
  cumulet_display_desc display{};
  OcioView ocio;                          // its view replaces the tone map
  std::vector<std::string> light_groups;  // names of the separate light groups, starting at group 0

  SceneOptions();
  /// Sets a clear day, the light if none is given: a sun to the right of the default camera, above and in front of it.
  void set_daylight();
  /// Sets the light of version 1 scene files without light: the same sun, with a constant sky color.
  void set_daylight_of_version_1();
  /// Sets the environment map. Removes the default daylight, because the user did not choose it.
  void set_environment(const std::string& file);
};

/// Calls visit with each descriptor of a scene.
template <class Scene, class Visit>
void for_each_group(Scene& scene, Visit&& visit) {
  visit(scene.surface);
  visit(scene.medium);
  visit(scene.light);
  visit(scene.environment_settings);
  visit(scene.ground);
  visit(scene.grid);
  visit(scene.sampling);
  visit(scene.display);
}

/// Returns the library's descriptor. It refers to strings of `file`, which must outlive it.
[[nodiscard]] cumulet_volume_file_desc volume_file(const VolumeFile& file);
/// Selects the saved camera with this name. Throws std::runtime_error, a line that lists the names, if there is none.
void look_through(SceneOptions& scene, const std::string& name);
/// Returns the first saved camera that equals the current camera; null if there is none.
[[nodiscard]] const NamedCamera* looked_through(const SceneOptions& scene);
/// Removes the camera's shutter poses: a camera that the user moves is static.
void end_shutter(SceneOptions& scene);
/// Sets the time, in seconds, of the animations of the surfaces and of all models. Negative times count as 0.
void set_animation_time(SceneOptions& scene, double seconds);

/// Returns true if the scene contains no volume and no surfaces.
[[nodiscard]] inline bool is_empty(const SceneOptions& scene) {
  return scene.volume.empty() && scene.others.empty() && scene.surfaces.empty() && scene.models.empty();
}

/// Returns an error if a file with this number of animations cannot show animation `wanted`; else "". The library would
/// show the rest pose, but a missing animation is a mistake of the user.
[[nodiscard]] std::string animation_refusal(const std::string& file, std::uint32_t wanted, std::uint32_t animations);

/// Returns the names of the surfaces' material variants.
[[nodiscard]] inline std::vector<std::string> variant_names(const cumulet_surfaces* surfaces) {
  std::vector<std::string> names;
  cumulet_variant_info info{};
  info.struct_size = sizeof info;
  for (std::uint32_t i = 0; cumulet_surfaces_get_variant(surfaces, i, &info) == CUMULET_OK; ++i)
    names.emplace_back(info.name);
  return names;
}

/// Returns cumulet_surface_settings_desc::variant for a variant given by name or number; 0 for "". Throws
/// std::runtime_error, one line that lists the variants, if it does not exist.
[[nodiscard]] std::uint32_t variant_number(const std::string& file, const std::string& wanted,
                                           const std::vector<std::string>& names);

/// Returns the cause if these cannot be the names of light groups, as the end of an error message; else "". The names
/// become layer names in OpenEXR files.
[[nodiscard]] std::string light_groups_refusal(const std::vector<std::string>& names);

/// Parses the text of a scene file (JSON: docs/scene_file.md). path: the file's name, for errors; relative file names
/// are resolved against its folder. Missing settings are as in SceneOptions(); missing light is a clear day, or the
/// daylight of version 1. Throws std::runtime_error, one line with the path, the key and the cause.
[[nodiscard]] SceneOptions parse_scene(const std::string& text, const std::string& path);
/// Reads a scene file. Throws as parse_scene.
[[nodiscard]] SceneOptions load_scene(const std::string& path);

/// Returns the text for parse_scene. All settings are written except those left to the library's default. Files in the
/// scene file's folder or below it get relative names.
[[nodiscard]] std::string scene_text(const SceneOptions& scene, const std::string& path,
                                     SceneFormat format = SceneFormat::third);
/// Writes the file atomically: on failure the old file remains. Throws as parse_scene, also for a file whose name is
/// not UTF-8, in which scene_text() replaces what is invalid.
void save_scene(const SceneOptions& scene, const std::string& path, SceneFormat format = SceneFormat::third);

/// Returns true if both scenes have the same content. The displayed frame is ignored.
[[nodiscard]] bool same_scene(const SceneOptions& a, const SceneOptions& b);

/// Returns the version of cumulet.h: major.minor.patch.
[[nodiscard]] std::string version_text();

/// Returns 16 hexadecimal digits that are equal for scenes with the same content. They cover all settings except number
/// of samples, noise target, adaptive sampling and seed, and the names and sizes of the files without folders. FNV-1a:
/// it distinguishes images, but does not protect against manipulation.
[[nodiscard]] std::string scene_hash(const SceneOptions& scene);

}  // namespace cumulet::demo
