#pragma once

#include <cumulet/cumulet.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <frame_row.hpp>
#include <instances.hpp>
#include <map>
#include <memory>
#include <ocio_lut.hpp>
#include <optional>
#include <scene_file.hpp>
#include <span>
#include <string>
#include <vector>

#include "environment_view.hpp"
#include "gizmo.hpp"
#include "preferences.hpp"
#include "render_entry.hpp"
#include "replay.hpp"
#include "scene_items.hpp"

namespace cumulet::demo {

/// Samples per pixel of a new scene: more than for a file, because the image is viewed while it refines.
inline constexpr std::uint32_t default_samples = 256;

/// User commands other than changes of settings.
enum class Action {
  new_scene,
  open_dialog,
  open,         // text: a file of any kind
  open_sample,  // text: the name of its scene file
  add_volume_dialog,
  add_volume,  // text: the file
  add_model_dialog,
  add_model,  // text: the file
  environment_dialog,
  clear_environment,
  ocio_dialog,
  open_ocio,  // text: an OpenColorIO configuration
  save_scene,
  save_scene_dialog,
  save_scene_as,    // text: the file
  discard_changes,  // then carries out the commands that wait for the user's answer
  recover,          // opens the scene that an ended process has left
  discard_recovery,
  render_dialog,
  render,         // renders the picture of the dialog in the background
  cancel_render,  // text: the number of an entry of the render queue
  toggle_renders,
  clear_renders,   // removes the ended entries from the list
  show_in_folder,  // text: the file
  png_dialog,
  save_png,  // text: the file
  exr_dialog,
  save_exr,  // text: the file
  undo,
  redo,
  frame_all,
  cancel,  // Escape: closes the help, dismisses a message or cancels a load
  cancel_load,
  dismiss,  // text: that of the message
  toggle_log,
  clear_log,
  toggle_panel,
  focus_panel,
  duplicate_selected,
  remove_selected,
  hide_selected,
  add_light,
  toggle_help,
  scale_interface,  // value: percent; 0: as the screen
  toggle_fly,
  toggle_turntable,
  tool,         // value: a Tool
  toggle_axes,  // axes of the handles: world or local
  brighter,
  darker,
  auto_exposure,         // sets the exposure that suits the displayed image
  toggle_auto_exposure,  // the same after each load
  toggle_desktop_dialogs,
  next_grid_type,
  view,  // value: a cumulet_view_mode
  grids_dialog,
  choose_grid,   // text: the grid's name
  choose_up,     // value: an UpAxis; text: the file of a further volume, "" for the first one
  auto_density,  // sets the suggested density scale
  play_row,      // plays the sequence that the volume's file belongs to
  play,          // play or pause
  step,          // value: number of frames, negative for backwards
  go_to,         // value: index of a frame in the sequence
  begin_here,    // the displayed frame becomes the first played frame
  end_here,
  draw_region,   // the next drag over the image sets the render region
  clear_region,  // removes the render region
  quit,          // asks about unsaved changes and unfinished pictures
  quit_anyway,   // asks only about unsaved changes
  follow_light,  // measures the exposure again, because the sun has moved
  daylight,      // sets the default daylight and display instead of the dusk of a burning volume
  white,         // sets the albedo 1 instead of the gray of smoke
  keep_place,    // text: "volume" or "model", value: its index; removes the transform that the program gave it
  go_to_end,     // value: -1 for the first played frame, 1 for the last one
  about          // shows the version, the OpenGL driver and the libraries
};

struct Command {
  Action action;
  std::string text = {};
  int value = 0;
};

struct Shortcut {
  int key;             // GLFW key
  unsigned modifiers;  // exact match
  Command command;
  const char* keys;  // keys as shown in the help; "" if another entry shows them
  const char* what;
};

[[nodiscard]] const std::vector<Shortcut>& shortcuts();
/// Returns the keys of a command as menus show them, such as "Ctrl+Shift+S"; "" if it has none.
[[nodiscard]] std::string keys_of(const Command& command);
/// Returns the command of a key; nullopt if there is none. typing: a text field has the focus, which uses the other
/// keys itself.
[[nodiscard]] std::optional<Command> command_of(int key, unsigned modifiers, bool typing);

struct GridInfo {
  std::string name;
  std::string type;
  std::string refusal;  // "": the grid can be shown
};

/// Returns the file of a scene's first volume.
[[nodiscard]] inline const VolumeFile& volume_of(const SceneVolume& scene) { return scene; }
inline void set_volume(SceneOptions& scene, const VolumeFile& volume) { static_cast<VolumeFile&>(scene) = volume; }

/// A button of a message, which executes a command and removes the message.
struct MessageButton {
  const char* label;
  const char* tip;
  Command command;
};

struct Message {
  bool error = false;
  std::string text;
  double until = 0.0;  // in seconds; errors stay until they are dismissed
  std::optional<MessageButton> button = {};
};

/// A message in the log.
struct LoggedMessage {
  bool error = false;
  std::string time;  // local time: "14:05:12"
  std::string text;
};

/// A series of values over time, oldest first.
class Series {
 public:
  void add(float value);
  void clear() { values_.clear(); }
  [[nodiscard]] const std::vector<float>& values() const { return values_; }
  [[nodiscard]] float latest() const { return values_.empty() ? 0.0f : values_.back(); }

 private:
  static constexpr std::size_t most_ = 160;
  std::vector<float> values_;
};

/// Measures the latency that the user sees. While images are expected: the time between two images, even if the window
/// is drawn more often. Otherwise: the time from an input event to the window that shows its effect. All times are in
/// seconds of one clock.
class FrameTimes {
 public:
  /// Records an input event.
  void hand(double at);
  /// Records that the window was drawn. picture: with a new image; due: another image is expected. Returns the measured
  /// time, if there is one.
  std::optional<double> shown(double at, bool picture, bool due);
  /// Records that nothing was drawn and no image is expected: the input had no effect.
  void rest() { since_.reset(); }

 private:
  std::optional<double> since_;
};

/// Values of a grid of the volume.
struct FieldValues {
  float most = 0.0f;           // maximum; 0: there is no such grid
  std::vector<float> heights;  // histogram from 0 to `most`; heights from 0 to 1
};

/// Values of a volume's grids, indexed by cumulet_ramp.
using Fields = std::array<FieldValues, settings::ramps.size()>;
/// Returns the values of a volume's grids. Any thread; takes some milliseconds per million voxels.
[[nodiscard]] Fields fields_of(const cumulet_volume& volume);

/// A volume of the scene other than the first one, without its data.
struct OtherVolume {
  VolumeFile file;
  OpenVolume open;  // without `volume`
  Fields fields;
};

/// The parts of a model's file that its settings choose between.
struct ModelFile {
  struct Animation {
    std::string name;       // "": none
    double duration = 0.0;  // seconds
  };
  std::string file;
  std::vector<Animation> animations;
  std::vector<std::string> variants;  // names of the material variants
};

/// Converts counts to bar heights from 0 to 1, on a logarithmic scale.
[[nodiscard]] std::vector<float> heights(const std::uint64_t (&counts)[CUMULET_HISTOGRAM_BINS]);

/// The displayed sequence.
struct Play {
  std::shared_ptr<cumulet_sequence> sequence;  // playback functions may be called from any thread
  FrameRow row;
  cumulet_sequence_info info{};
  std::vector<std::uint8_t> states;  // a cumulet_frame_state per frame
  std::string failure;               // error of the current frame

  [[nodiscard]] Frame frame() const { return row.number(info.requested_frame); }
};

/// State of the viewer in the last answer.
struct Status {
  cumulet_frame_result frame{};
  cumulet_progress work{};
  cumulet_stats stats{};
  cumulet_surfaces_info surfaces{};
  ModelFile surfaces_file;             // of the surfaces
  std::vector<ModelFile> model_files;  // of the other models, if they are open
  std::optional<double> compiled;      // fraction of the first scene's programs that are compiled; nullopt when all are
  bool busy = false;                   // a file is read, a grid is built, a sky is computed or programs are compiled
  std::string loading;                 // file that is being loaded
  ThumbnailPtr thumbnail;              // of the displayed environment; null: no environment, or not ready
  bool has_volume = false;
  bool has_content = false;                  // a volume, surfaces or an environment are shown
  std::string saving;                        // file that is saved when all pixels have a sample; "": none
  std::optional<Play> play;                  // if the volume is a sequence
  std::optional<FrameRow> neighbours;        // numbered files that the volume's file belongs to
  std::string grid;                          // name of the displayed grid
  std::optional<double> noise;               // relative standard error; nullopt if it is unknown
  Fields fields;                             // of the first volume
  std::vector<OtherVolume> others;           // that are open
  Boxes boxes;                               // bounding boxes of the loaded files
  std::shared_ptr<const OcioDisplays> ocio;  // of the OpenColorIO configuration in use; null: none
};

/// Statistics that are plotted over time.
struct Charts {
  Series frame_ms;    // from FrameTimes
  Series picture_ms;  // time from a change to the window with the next drawn image
  Series samples_per_second;
  Series noise_percent;
  Series compiled_percent;  // programs of the first scene
  Series device_ms;         // GPU time of the library's passes per window frame
};

/// Returns the sum over all passes.
double device_seconds(const cumulet_stats& stats);

/// A sample scene that can be opened.
struct SampleCard {
  const char* label;
  const char* tip;
  const char* scene;     // name of its scene file
  unsigned texture = 0;  // OpenGL name of its picture in the window's context
};

inline constexpr std::size_t max_listed_files = 6;
/// Returns the recent files that the empty window lists.
[[nodiscard]] std::span<const std::string> listed_files(const Preferences& preferences);

/// All data that the user interface shows and edits.
struct Model {
  SceneOptions scene;            // defaults are replaced by their values, except for the camera's position
  bool unchosen_ground = false;  // the ground below the scene is the default
  cumulet_navigation_desc navigation{};
  bool adaptive_resolution = true;
  bool panel = true;
  bool help = false;
  Tool tool = Tool::move;          // none: no handles, outlines or light icons in the image
  Axes axes = Axes::world;         // axes of the handles
  std::optional<Item> chosen;      // selected object
  std::optional<Subject> subject;  // shown in the inspector; nullopt: the first object
  std::vector<Item> marked;        // objects that are selected together with the subject, which is one of them
  bool playing = false;
  double clock = 0.0;               // seconds; the animations of models use it too if a sequence is shown
  std::optional<std::string> undo;  // name of the step that can be undone
  std::optional<std::string> redo;  // name of the step that can be repeated
  std::string scene_path;           // scene file that was opened or saved last
  bool modified = false;            // the scene has unsaved changes
  std::vector<GridInfo> grids;
  Status status;
  std::vector<SampleCard> samples;
  std::map<std::string, unsigned> recent_textures;  // of listed files' thumbnails: OpenGL names in the window's context
  unsigned thumbnail_texture = 0;                   // OpenGL name of status.thumbnail in the window's context; 0: none
  Charts charts;
  std::optional<double> seconds_left;  // until the image has all samples; nullopt if that is unknown
  std::vector<Message> messages;
  std::vector<LoggedMessage> log;  // all messages, oldest first
  bool log_open = false;
  std::vector<RenderEntry> renders;  // pictures of the render queue, oldest first
  bool renders_open = false;
  Preferences preferences;

  Model();
};

/// Sets the kind of the ground below the scene, unless the user or a scene file has chosen one.
void set_default_ground(Model& model, cumulet_ground_mode wanted);

/// Opens the surfaces of a file, which replace the previous ones.
void open_surfaces(Model& model, const std::string& path);
/// Returns only the settings that apply to all models.
[[nodiscard]] cumulet_surface_settings_desc shared_settings(const cumulet_surface_settings_desc& settings);

/// Adds a message to the displayed ones, where it replaces an equal one, and to the log. Errors stay; notices disappear
/// after a while, those with a button later.
void show_message(Model& model, bool error, const std::string& text, double now,
                  std::optional<MessageButton> button = std::nullopt);

/// Replaces zeros that mean a default by the default value (cumulet.h), so that controls can show it.
void spell_out_defaults(SceneOptions& scene);

/// The viewer's current work, such as "Reading the file" or "Refining the grid", and its completed fraction.
struct Work {
  const char* name;
  double part;
  bool stops;  // cumulet_cancel stops it
};
[[nodiscard]] Work work_of(const Status& status);

/// Returns the file that a scene is named after: the volume's, or the first other file in the scene.
[[nodiscard]] std::string main_file(const SceneOptions& scene);

/// Returns the name of the scene: that of its scene file, or else of its main file; "" for an empty scene. An asterisk
/// at the front marks unsaved changes.
[[nodiscard]] std::string scene_name(const Model& model);

/// Suggests a path for a new file: the main file's name, a free number and the extension, in the last used folder.
[[nodiscard]] std::string suggest_path(const Model& model, const std::string& ending);

/// Returns true if the name has this extension, including the dot; case-insensitive.
[[nodiscard]] bool has_ending(const std::string& path, const std::string& ending);
/// Returns true for the extension of a glTF file.
[[nodiscard]] bool is_model(const std::string& path);
/// Returns true for the extension of an environment map.
[[nodiscard]] bool is_environment(const std::string& path);

}  // namespace cumulet::demo
