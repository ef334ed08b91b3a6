#pragma once

#include <cumulet/cumulet.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <frame_row.hpp>
#include <memory>
#include <optional>
#include <scene_file.hpp>
#include <string>
#include <vector>

#include "environment_view.hpp"
#include "gizmo.hpp"
#include "preferences.hpp"
#include "replay.hpp"
#include "scene_items.hpp"

namespace cumulet::demo {

/// What the user can ask for besides changing a setting.
enum class Action {
  open_dialog,
  open,  // a file of any kind: text
  add_volume_dialog,
  add_volume,  // text
  add_model_dialog,
  add_model,  // text
  environment_dialog,
  clear_environment,
  save_scene,
  save_scene_dialog,
  save_scene_as,  // text
  png_dialog,
  save_png,  // text
  exr_dialog,
  save_exr,  // text
  undo,
  redo,
  frame_all,
  cancel,  // what Escape does: the help, a message or a load goes away
  cancel_load,
  dismiss,
  toggle_panel,
  focus_panel,
  toggle_help,
  toggle_fly,
  toggle_turntable,
  tool,         // value: a Tool, of the handles
  toggle_axes,  // of the world, or of the thing
  brighter,
  darker,
  next_march,
  view,  // value: a cumulet_view
  grids_dialog,
  choose_grid,   // text
  choose_up,     // value: an UpAxis
  auto_density,  // a density scale that suits the volume
  play_row,      // the sequence that the volume's file is in
  play,          // and pause
  step,          // value: frames, on or back
  go_to,         // value: a frame's place in the row
  begin_here,    // the frame is the first that is played
  end_here,
  draw_region,   // the next drag over the picture
  clear_region,  // all of it is made
  quit
};

struct Command {
  Action action;
  std::string text = {};
  int value = 0;
};

struct Shortcut {
  int key;             // GLFW's
  unsigned modifiers;  // exactly these
  Command command;
  const char* keys;  // as the help spells it; "" if it is told elsewhere
  const char* what;
};

[[nodiscard]] const std::vector<Shortcut>& shortcuts();
/// The command of a key, if it has one. While a text is typed only those that a text field has no use for.
[[nodiscard]] std::optional<Command> command_of(int key, unsigned modifiers, bool typing);

struct GridInfo {
  std::string name;
  std::string type;
  std::string refusal;  // "": can be shown
};

/// Of a scene, the first one's.
[[nodiscard]] inline const VolumeFile& volume_of(const SceneVolume& scene) { return scene; }
inline void set_volume(SceneOptions& scene, const VolumeFile& volume) { static_cast<VolumeFile&>(scene) = volume; }

struct Message {
  bool error = false;
  std::string text;
  double until = 0.0;  // seconds; errors stay until dismissed
};

/// Values over time, the newest last.
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

/// How long whoever watches a window waits: from one picture to the next while more are due, however often the window
/// is drawn beside them; where none is, from what a hand did to the window that shows it. In seconds of one clock.
class FrameTimes {
 public:
  /// A hand did something then.
  void hand(double at);
  /// The window was drawn then; picture: with a new one; due: another is to come. Returns how long that was waited for,
  /// if it was.
  std::optional<double> shown(double at, bool picture, bool due);
  /// Nothing was drawn, and nothing is to come: what a hand did changes nothing.
  void rest() { since_.reset(); }

 private:
  std::optional<double> since_;
};

/// What a grid of the volume holds.
struct FieldValues {
  float most = 0.0f;           // 0: there is no such grid
  std::vector<float> heights;  // of a histogram from 0 to that: from 0 to 1
};

/// Heights of bars, from 0 to 1, of counts that differ by orders of magnitude.
[[nodiscard]] std::vector<float> heights(const std::uint64_t (&counts)[CUMULET_HISTOGRAM_BINS]);

/// A sequence that is shown.
struct Play {
  std::shared_ptr<cumulet_sequence> sequence;  // any thread moves it
  FrameRow row;
  cumulet_sequence_info info{};
  std::vector<std::uint8_t> states;  // cumulet_frame_state, each
  std::string failure;               // of the frame where it stands

  [[nodiscard]] Frame frame() const { return row.number(info.asked_frame); }
};

/// What the viewer has told last.
struct Status {
  cumulet_frame_result frame{};
  cumulet_progress work{};
  cumulet_stats stats{};
  cumulet_surfaces_info surfaces{};
  cumulet_animation_info animation{};  // that is set, of those
  std::vector<std::string> variants;   // of their materials
  std::optional<double> compiled;      // the part of the first scene's programs that is, until all are
  bool busy = false;                   // a file is read, a grid is built, a sky computed or programs are compiled
  std::string loading;                 // the file that is read, until what it shows is there
  ThumbnailPtr thumbnail;              // of the environment that is shown; null: none, or not yet
  bool has_volume = false;
  bool has_content = false;                                // a volume, a model or an environment is shown
  std::string saving;                                      // the file that waits for a whole picture; "": none
  std::optional<Play> play;                                // where it is a sequence's
  std::optional<FrameRow> neighbours;                      // where it is one of several that are numbered
  std::string grid;                                        // of the file, that is shown
  std::optional<double> noise;                             // relative standard error; nothing while it is unknown
  std::array<FieldValues, settings::ramps.size()> fields;  // each ramp's
  Boxes boxes;                                             // of the files that are there
};

/// What of it is drawn over time.
struct Charts {
  Series frame_ms;    // FrameTimes
  Series picture_ms;  // from a change to the window with the picture that was drawn next
  Series samples_per_second;
  Series noise_percent;
  Series compiled_percent;  // of the first scene's programs
  Series device_ms;         // that the library's passes took, a frame of the window
};

/// Of all passes.
double device_seconds(const cumulet_stats& stats);

/// All that the user interface shows and changes.
struct Model {
  SceneOptions scene;            // with no default left to the library but the camera's place
  bool unchosen_ground = false;  // a ground below all is the default one
  cumulet_navigation_desc navigation{};
  bool adaptive_resolution = true;
  bool panel = true;
  bool help = false;
  Tool tool = Tool::move;      // none: no handles, outlines and lamps' marks in the picture
  Axes axes = Axes::world;     // of handles
  std::optional<Item> chosen;  // of the scene's
  bool playing = false;
  double clock = 0.0;  // seconds, of the sequence and of the model's animation beside it
  bool can_undo = false;
  bool can_redo = false;
  std::string scene_path;  // of the scene file last opened or saved
  std::vector<GridInfo> grids;
  Status status;
  unsigned thumbnail_texture = 0;  // of the status' thumbnail, in the window's context; 0: none
  Charts charts;
  std::vector<Message> messages;
  Preferences preferences;

  Model();
};

/// Shows the surfaces of a file, instead of those before and of the default ground: models bring their own.
void open_surfaces(Model& model, const std::string& path);

/// Once an environment lights the scene it needs no default daylight, whose sun would be a second one; once it is taken
/// away it is day again where there is no other light.
void take_daylight(SceneOptions& scene);
void give_daylight(SceneOptions& scene);

/// Adds a line to the message bar, in place of an equal one. Errors stay, others go after a while.
void tell(Model& model, bool error, const std::string& text, double now);

/// Replaces the zeros that stand for a default by what they stand for (cumulet.h), so that controls can show them.
void spell_out_defaults(SceneOptions& scene);

/// What keeps the viewer busy: "Reading the file", "Refining the grid", ..., and the part of it that is done.
struct Work {
  const char* name;
  double part;
  bool stops;  // cumulet_cancel ends it
};
[[nodiscard]] Work work_of(const Status& status);

/// The file that a scene is called by: its volume's, or that of the first other thing in it.
[[nodiscard]] std::string main_file(const SceneOptions& scene);

/// Where a new file may go: the main file's name, a free number and the ending, in the folder used last.
[[nodiscard]] std::string suggest_path(const Model& model, const std::string& ending);

/// Whether a name ends so, whatever its case; with the dot.
[[nodiscard]] bool has_ending(const std::string& path, const std::string& ending);
/// Of a glTF model, by its ending.
[[nodiscard]] bool is_model(const std::string& path);
/// Of an environment's picture, by its ending.
[[nodiscard]] bool is_environment(const std::string& path);

}  // namespace cumulet::demo
