#pragma once

#include <cumulet/cumulet.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <frame_row.hpp>
#include <frames.hpp>
#include <optional>
#include <ramp.hpp>
#include <settings.hpp>
#include <string>
#include <vector>

namespace cumulet::demo {

/// Which way is up in a volume's file. Blender's and Mantaflow's is Z; pictures' is Y.
enum class UpAxis { y, z };

/// Which volume is shown, and how it lies: one load.
struct VolumeFile {
  std::string volume;
  std::string grid_name = {};         // of density; "", here and below: by name
  std::string temperature_grid = {};  // "none": without, here and below
  std::string flame_grid = {};
  std::string color_grid = {};
  std::string anisotropy_grid = {};
  std::string velocity_grid = {};
  UpAxis up = UpAxis::y;              // of the file
  std::array<double, 16> to_world{};  // once it is upright; column by column; all 0: as its file has it

  bool operator==(const VolumeFile&) const = default;
};

/// How a volume plays, where its file's name has a place for a frame's number (demo/sequence).
struct SceneSequence {
  cumulet_playback_desc playback{};  // but for its frames, which are those from...
  std::optional<Frame> first = {};   // ...this one's number on: else from the first that is there...
  std::optional<Frame> last = {};    // ...to this one's: else to the last
  std::optional<Moment> frame = {};  // where it stands, as long as no clock says

  SceneSequence() { playback.struct_size = sizeof playback; }
  bool operator==(const SceneSequence& other) const {
    return settings::same(playback, other.playback) && first == other.first && last == other.last &&
           frame == other.frame;
  }
};

/// As the library takes it, of these files.
[[nodiscard]] cumulet_playback_desc playback_of(const SceneSequence& sequence, const FrameRow& row);
/// How far something is, as the shutter opens and as it closes, from where it stands in the world: 4x4, column by
/// column; nothing: it is there.
struct SceneShutter {
  std::optional<std::array<double, 16>> open = {};
  std::optional<std::array<double, 16>> close = {};

  bool operator==(const SceneShutter&) const = default;
  [[nodiscard]] bool moves() const { return open || close; }
};
/// Into a descriptor's open_to_world and close_to_world, of what stands there; all 0: as its file has it.
void set_shutter(const SceneShutter& shutter, const double (&to_world)[16], double (&open)[16], double (&close)[16]);

/// A volume in a scene, as the library's own descriptors with struct_size set. Zero is the library's default, as there.
struct SceneVolume : VolumeFile {
  std::string name;  // "": its file's
  bool visible = true;
  std::vector<std::array<double, 16>> places;  // where it then stands, once in each; none: there alone
  SceneShutter shutter;                        // of all of these
  cumulet_medium_desc medium{};
  std::array<settings::RampPoints, settings::ramps.size()> ramps;  // as cumulet_ramp numbers them
  SceneSequence sequence;                                          // where it is one
  bool auto_density_scale = true;  // medium.density_scale is the one that suits the volume, once one is loaded

  SceneVolume();
  /// Its name, or its file's.
  [[nodiscard]] std::string label() const;
  [[nodiscard]] bool is_shown() const { return visible && !volume.empty(); }
};

/// A model in a scene, beside its surfaces.
struct SceneModel {
  std::string file;                   // a glTF file
  std::string name = {};              // "": its file's
  std::array<double, 16> to_world{};  // where it stands, column by column; all 0: as its file has it
  SceneShutter shutter = {};
  bool visible = true;
  bool shadow_only = false;  // cameras do not see it
  bool holdout = false;      // cameras see a hole
  double time = 0.0;         // seconds into its animation
  std::uint32_t animation = 0;
  std::string variant = {};  // of its materials, by name or number; "": none
  bool double_sided = false;
  std::uint32_t group = 0;  // of lights

  bool operator==(const SceneModel&) const = default;
  /// Its name, or its file's.
  [[nodiscard]] std::string label() const;
};

/// What is looked through: where it stands, and where as the shutter opens and closes.
struct SceneCamera {
  cumulet_camera_desc camera{};
  std::optional<cumulet_camera_desc> camera_open = {};   // nothing: as it is
  std::optional<cumulet_camera_desc> camera_close = {};  // likewise

  SceneCamera() { camera.struct_size = sizeof camera; }
};

/// One of those that a scene keeps to look through.
struct NamedCamera : SceneCamera {
  std::string name;  // not empty, and no other's
};

/// What every demo program can show. Its first volume is what flags and the demo's panel set, and may be none.
struct SceneOptions : SceneVolume, SceneCamera {
  std::vector<SceneVolume> others;   // beside the first; their max_bounces are 0: the first one's counts
  std::string surfaces;              // a glTF file; "": none
  std::string surface_variant;       // of the surfaces' materials, by name or number; "": none
  std::int32_t surface_camera = -1;  // of the surfaces' own; below 0: camera
  std::vector<SceneModel> models;    // beside the surfaces, which stand as their file has them
  std::uint32_t width = 1280;
  std::uint32_t height = 720;
  cumulet_grid_desc grid{};
  cumulet_light_desc light{};
  std::vector<cumulet_lamp_desc> lamps;
  std::string environment;  // a .hdr or .exr file; "": the light's sky
  cumulet_environment_settings_desc environment_settings{};
  cumulet_ground_desc ground{};
  std::vector<NamedCamera> cameras;  // beside the one that is looked through
  cumulet_surface_settings_desc surface{};
  cumulet_sampling_desc sampling{};
  cumulet_display_desc display{};
  std::vector<std::string> light_groups;  // names of those that are kept apart, from group 0 on

  SceneOptions();
  /// A clear day, what is lit when nothing says how: a sun from the right of a default camera, above and before it.
  void set_daylight();
  /// What scene files of version 1 mean that say nothing of light: the same sun, in a sky of one colour.
  void set_daylight_of_version_1();
  /// Surrounds the scene by this file. Daylight, which nobody chose, goes.
  void set_environment(const std::string& file);
};

/// Calls visit with each of a scene's groups of settings.
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

/// As the library takes it; the file must outlive it.
[[nodiscard]] cumulet_volume_file_desc volume_file(const VolumeFile& file);
/// Looks through the one of its cameras that has this name. Throws std::runtime_error, a line that lists them, where
/// there is none.
void look_through(SceneOptions& scene, const std::string& name);
/// The first of its cameras that is the same as what is looked through; null where none is.
[[nodiscard]] const NamedCamera* looked_through(const SceneOptions& scene);
/// Its camera is another from now on, and stands still.
void end_shutter(SceneOptions& scene);

/// Whether there is anything to be seen.
[[nodiscard]] inline bool is_empty(const SceneOptions& scene) {
  return scene.volume.empty() && scene.others.empty() && scene.surfaces.empty() && scene.models.empty();
}

/// Why a file with so many animations cannot be shown with this one; empty if it can. The library shows a scene at rest
/// whose animation is not there: whoever named it meant another.
[[nodiscard]] std::string animation_refusal(const std::string& file, std::uint32_t wanted, std::uint32_t animations);

/// Names of the surfaces' variants of materials.
[[nodiscard]] inline std::vector<std::string> variant_names(const cumulet_surfaces* surfaces) {
  std::vector<std::string> names;
  cumulet_variant_info info{};
  info.struct_size = sizeof info;
  for (std::uint32_t i = 0; cumulet_surfaces_get_variant(surfaces, i, &info) == CUMULET_OK; ++i)
    names.emplace_back(info.name);
  return names;
}

/// cumulet_surface_settings_desc::variant for a choice among a file's; 0 where there is none. Throws
/// std::runtime_error, one line that lists them, where it is not among them.
[[nodiscard]] std::uint32_t variant_number(const std::string& file, const std::string& wanted,
                                           const std::vector<std::string>& names);

/// Why these cannot be the names of a scene's groups of lights, after what they are; empty if they can: layers of files
/// are called so.
[[nodiscard]] std::string light_groups_refusal(const std::vector<std::string>& names);

/// A scene file's text (JSON: docs/scene_file.md). path is the file's name: errors name it, and a relative name of a
/// volume is taken from its folder. What the text does not say is as in SceneOptions(), on a clear day; of version
/// 1 in that version's daylight.
/// Throws std::runtime_error, one line with the path, the key and the cause.
[[nodiscard]] SceneOptions parse_scene(const std::string& text, const std::string& path);
/// Reads a file. Throws likewise.
[[nodiscard]] SceneOptions load_scene(const std::string& path);

/// Versions of the format. The first knows one volume, without a place, and no lamps: what is written in it is without
/// the rest.
enum class SceneFormat { first = 1, second = 2 };

/// The text that parse_scene reads: every setting is spelled out but those left to the library. A volume in the
/// file's folder, or below it, is named relative to it.
[[nodiscard]] std::string scene_text(const SceneOptions& scene, const std::string& path,
                                     SceneFormat format = SceneFormat::second);
/// Writes it in one step: a failure leaves the old file. Throws likewise.
void save_scene(const SceneOptions& scene, const std::string& path, SceneFormat format = SceneFormat::second);

/// Whether two scenes say the same.
[[nodiscard]] bool same_scene(const SceneOptions& a, const SceneOptions& b);

/// The version of cumulet.h: major.minor.patch.
[[nodiscard]] std::string version_text();

/// 16 hexadecimal digits that pictures share that show the same: of all settings but how long a picture takes (samples,
/// noise target and how it is met, seed), and of the files' names, without folders, and sizes. FNV-1a: for telling
/// pictures apart, not for proof.
[[nodiscard]] std::string scene_hash(const SceneOptions& scene);

}  // namespace cumulet::demo
