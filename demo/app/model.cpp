#include "model.hpp"

#include <GLFW/glfw3.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <numbers>
#include <program.hpp>
#include <settings.hpp>
#include <span>
#include <system_error>
#include <utility>

#include "input.hpp"

namespace cumulet::demo {

namespace fs = std::filesystem;

std::vector<float> heights(const std::uint64_t (&counts)[CUMULET_HISTOGRAM_BINS]) {
  std::vector<float> result;
  float most = 0.0f;
  for (const std::uint64_t count : counts) {
    result.push_back(static_cast<float>(std::log1p(static_cast<double>(count))));
    most = std::max(most, result.back());
  }
  for (float& height : result) height /= std::max(most, 1e-6f);
  return result;
}

const std::vector<Shortcut>& shortcuts() {
  constexpr unsigned ctrl = modifier_ctrl;
  constexpr unsigned shift = modifier_shift;
  static const std::vector<Shortcut> all = {
      {GLFW_KEY_N, ctrl, {Action::new_scene}, "Ctrl+N", "New scene"},
      {GLFW_KEY_O, ctrl, {Action::open_dialog}, "Ctrl+O", "Open a volume, a model, an environment map or a scene"},
      {GLFW_KEY_S, ctrl, {Action::save_scene}, "Ctrl+S", "Save the scene"},
      {GLFW_KEY_S, ctrl | shift, {Action::save_scene_dialog}, "Ctrl+Shift+S", "Save the scene under another name"},
      {GLFW_KEY_F12, 0, {Action::render_dialog}, "F12", "Render a picture or a sequence in the background"},
      {GLFW_KEY_F12, ctrl, {Action::png_dialog}, "Ctrl+F12", "Save the displayed image as PNG"},
      {GLFW_KEY_F12, shift, {Action::exr_dialog}, "Shift+F12", "Save the displayed image as linear OpenEXR"},
      {GLFW_KEY_Z, ctrl, {Action::undo}, "Ctrl+Z", "Undo"},
      {GLFW_KEY_Z, ctrl | shift, {Action::redo}, "Ctrl+Shift+Z, Ctrl+Y", "Redo"},
      {GLFW_KEY_Y, ctrl, {Action::redo}, "", ""},
      {GLFW_KEY_F, 0, {Action::frame_all}, "F, Home", "Frame all"},
      {GLFW_KEY_HOME, 0, {Action::frame_all}, "", ""},
      {GLFW_KEY_G, 0, {Action::toggle_fly}, "G", "Toggle fly mode"},
      {GLFW_KEY_T, 0, {Action::toggle_turntable}, "T", "Turntable"},
      {GLFW_KEY_W,
       0,
       {Action::tool, "", static_cast<int>(Tool::move)},
       "W  E  R  Q",
       "Handles: move, rotate, scale, none"},
      {GLFW_KEY_E, 0, {Action::tool, "", static_cast<int>(Tool::rotate)}, "", ""},
      {GLFW_KEY_R, 0, {Action::tool, "", static_cast<int>(Tool::scale)}, "", ""},
      {GLFW_KEY_Q, 0, {Action::tool, "", static_cast<int>(Tool::none)}, "", ""},
      {GLFW_KEY_X, 0, {Action::toggle_axes}, "X", "Handles along world or local axes"},
      {GLFW_KEY_1,
       0,
       {Action::view, "", CUMULET_VIEW_SHADED},
       "1 to 5",
       "View: shaded, cells, steps, density, wireframe"},
      {GLFW_KEY_2, 0, {Action::view, "", CUMULET_VIEW_CELLS}, "", ""},
      {GLFW_KEY_3, 0, {Action::view, "", CUMULET_VIEW_STEPS}, "", ""},
      {GLFW_KEY_4, 0, {Action::view, "", CUMULET_VIEW_DENSITY}, "", ""},
      {GLFW_KEY_5, 0, {Action::view, "", CUMULET_VIEW_WIREFRAME}, "", ""},
      {GLFW_KEY_M, 0, {Action::next_grid_type}, "M", "Next grid type"},
      {GLFW_KEY_SPACE, 0, {Action::play}, "Space", "Play or pause a sequence"},
      {GLFW_KEY_COMMA, 0, {Action::step, "", -1}, ",  .", "Previous frame, next frame"},
      {GLFW_KEY_PERIOD, 0, {Action::step, "", 1}, "", ""},
      {GLFW_KEY_I, 0, {Action::begin_here}, "I  O", "Set the first, the last played frame"},
      {GLFW_KEY_O, 0, {Action::end_here}, "", ""},
      {GLFW_KEY_B, ctrl, {Action::draw_region}, "Ctrl+B", "Drag a render region (crop)"},
      {GLFW_KEY_B, ctrl | modifier_alt, {Action::clear_region}, "Ctrl+Alt+B", "Clear the render region"},
      {GLFW_KEY_LEFT_BRACKET, 0, {Action::darker}, "[  ]", "Exposure down, up by a third of a stop"},
      {GLFW_KEY_RIGHT_BRACKET, 0, {Action::brighter}, "", ""},
      {GLFW_KEY_D, ctrl, {Action::duplicate_selected}, "Ctrl+D", "Duplicate the selected objects"},
      {GLFW_KEY_DELETE, 0, {Action::remove_selected}, "Delete", "Remove the selected objects"},
      {GLFW_KEY_H, 0, {Action::hide_selected}, "H", "Hide or show the selected objects"},
      {GLFW_KEY_N, 0, {Action::toggle_panel}, "N", "Show or hide the panel and the tools"},
      {GLFW_KEY_F2,
       0,
       {Action::focus_panel},
       "F2",
       "Keyboard focus to the panel (arrows, Space, Enter; Escape leaves)"},
      {GLFW_KEY_F1, 0, {Action::toggle_help}, "F1", "This help"},
      {GLFW_KEY_ESCAPE,
       0,
       {Action::cancel},
       "Escape",
       "Release a handle, close the help, dismiss a message, cancel loading, clear the selection"},
      {GLFW_KEY_Q, ctrl, {Action::quit}, "Ctrl+Q", "Quit"},
  };
  return all;
}

std::string keys_of(const Command& command) {
  const auto same = [&](const Shortcut& shortcut) {
    return shortcut.command.action == command.action && shortcut.command.value == command.value;
  };
  const auto found = std::ranges::find_if(shortcuts(), same);
  if (found == shortcuts().end()) return "";
  std::string keys;
  if ((found->modifiers & modifier_ctrl) != 0) keys += "Ctrl+";
  if ((found->modifiers & modifier_alt) != 0) keys += "Alt+";
  if ((found->modifiers & modifier_shift) != 0) keys += "Shift+";
  const auto name_of = [](int key) -> std::string {
    if (key == GLFW_KEY_COMMA) return ",";
    if (key == GLFW_KEY_PERIOD) return ".";
    return key_name(key);
  };
  std::string name = name_of(found->key);
  if (!name.empty() && name[0] >= 'a' && name[0] <= 'z') name[0] = static_cast<char>(name[0] - 'a' + 'A');
  return keys + name;
}

std::optional<Command> command_of(int key, unsigned modifiers, bool typing) {
  for (const Shortcut& shortcut : shortcuts()) {
    if (shortcut.key != key || shortcut.modifiers != modifiers) continue;
    const bool text_key = shortcut.modifiers == 0 && key < GLFW_KEY_F1;
    const bool text_undo = key == GLFW_KEY_Z || key == GLFW_KEY_Y;
    if (typing && (text_key || text_undo)) return std::nullopt;
    return shortcut.command;
  }
  return std::nullopt;
}

void Series::add(float value) {
  if (values_.size() == most_) values_.erase(values_.begin());
  values_.push_back(value);
}

void FrameTimes::hand(double at) {
  if (!since_) since_ = at;
}

std::optional<double> FrameTimes::shown(double at, bool picture, bool due) {
  if (due && !picture) {
    hand(at);
    return std::nullopt;
  }
  std::optional<double> waited;
  if (since_) waited = at - *since_;
  since_.reset();
  if (due) since_ = at;
  return waited;
}

double device_seconds(const cumulet_stats& stats) {
  return stats.pass_seconds_upload + stats.pass_seconds_host_depth + stats.pass_seconds_surfaces +
         stats.pass_seconds_trace + stats.pass_seconds_inspect + stats.pass_seconds_display;
}

Fields fields_of(const cumulet_volume& volume) {
  Fields fields;
  for (std::size_t i = 0; i < fields.size(); ++i) {
    cumulet_histogram_info values{};
    values.struct_size = sizeof values;
    if (cumulet_volume_get_histogram(&volume, static_cast<cumulet_ramp>(i), &values) == CUMULET_OK &&
        values.max_value > 0.0f)
      fields[i] = {values.max_value, heights(values.histogram)};
  }
  return fields;
}

Model::Model() {
  navigation.struct_size = sizeof navigation;
  navigation.speed = 1.0;
  status.frame.struct_size = sizeof status.frame;
  status.work.struct_size = sizeof status.work;
  status.stats.struct_size = sizeof status.stats;
}

cumulet_surface_settings_desc shared_settings(const cumulet_surface_settings_desc& settings) {
  cumulet_surface_settings_desc shared{};
  shared.struct_size = sizeof shared;
  shared.lighting = settings.lighting;
  shared.indirect_roughness = settings.indirect_roughness;
  return shared;
}

void open_surfaces(Model& model, const std::string& path) {
  model.scene.surfaces = path;
  model.scene.surface = shared_settings(model.scene.surface);
  model.scene.surface_variant.clear();
  model.scene.surface_camera = -1;
  // A model that is cut out for compositing needs no ground.
  if (model.scene.display.background != CUMULET_BACKGROUND_SKY) set_default_ground(model, CUMULET_GROUND_NONE);
}

void set_default_ground(Model& model, cumulet_ground_mode wanted) {
  auto& mode = model.scene.ground.mode;
  if (model.unchosen_ground && !is_at_height(mode)) mode = wanted;
}

std::span<const std::string> listed_files(const Preferences& preferences) {
  return std::span(preferences.recent).first(std::min(preferences.recent.size(), max_listed_files));
}

namespace {

std::string clock_text() {
  std::array<char, 16> text{};
  std::tm local{};
  const std::time_t now = std::time(nullptr);
  if (::localtime_r(&now, &local) == nullptr) return "";
  return {text.data(), std::strftime(text.data(), text.size(), "%H:%M:%S", &local)};
}

}  // namespace

void show_message(Model& model, bool error, const std::string& text, double now, std::optional<MessageButton> button) {
  constexpr double seconds = 5.0;
  constexpr double button_seconds = 60.0;
  constexpr std::size_t most = 3;
  constexpr std::size_t max_logged = 500;
  const std::string line = one_line(text);
  if (model.log.size() == max_logged) model.log.erase(model.log.begin());
  model.log.push_back({error, clock_text(), line});
  std::erase_if(model.messages, [&](const Message& message) { return message.text == line; });
  if (model.messages.size() >= most) {
    // Notices are removed before errors.
    const auto notice = std::ranges::find(model.messages, false, &Message::error);
    model.messages.erase(notice != model.messages.end() ? notice : model.messages.begin());
  }
  const double until = now + (button ? button_seconds : seconds);
  model.messages.push_back({error, line, until, std::move(button)});
}

void spell_out_defaults(SceneOptions& scene) {
  for_each_group(scene, [](auto& group) { settings::spell_out_zeros(group); });
  settings::spell_out_zeros(scene.sequence.playback);
  settings::spell_out_zeros(scene.camera);
  for (NamedCamera& camera : scene.cameras) settings::spell_out_zeros(camera.camera);
  for (SceneVolume& other : scene.others) {
    const double scale = other.medium.density_scale;
    settings::spell_out_zeros(other.medium);
    if (other.auto_density_scale) other.medium.density_scale = scale;
  }
  for (cumulet_light_desc& analytic_light : scene.analytic_lights) settings::spell_out_zeros(analytic_light);
  scene.grid.criterion = settings::criterion_of(scene.grid);
  if (scene.grid.threshold == 0.0) scene.grid.threshold = settings::default_threshold(scene.grid.criterion);
}

namespace {

const char* stage_text(cumulet_stage stage) {
  switch (stage) {
    case CUMULET_STAGE_LOADING:
      return "Reading the file";
    case CUMULET_STAGE_STATISTICS:
      return "Computing voxel statistics";
    case CUMULET_STAGE_REFINING:
      return "Refining the grid";
    case CUMULET_STAGE_PACKING:
      return "Packing the cells";
    case CUMULET_STAGE_UPLOADING:
      return "Uploading";
    case CUMULET_STAGE_IDLE:
      break;
  }
  return "Starting";
}

}  // namespace

Work work_of(const Status& status) {
  if (status.work.stage == CUMULET_STAGE_IDLE && status.compiled) return {"Compiling shaders", *status.compiled, false};
  return {stage_text(status.work.stage), std::clamp(status.work.fraction, 0.0, 1.0), true};
}

std::string main_file(const SceneOptions& scene) {
  if (!scene.volume.empty()) return scene.volume;
  if (!scene.surfaces.empty()) return scene.surfaces;
  if (!scene.others.empty()) return scene.others.front().volume;
  return scene.models.empty() ? scene.environment : scene.models.front().file;
}

std::string scene_name(const Model& model) {
  const std::string& file = model.scene_path.empty() ? main_file(model.scene) : model.scene_path;
  std::string name = fs::path(file).filename().string();
  if (!model.modified) return name;
  return '*' + (name.empty() ? "Untitled" : name);
}

std::string suggest_path(const Model& model, const std::string& ending) {
  std::string stem = fs::path(main_file(model.scene)).stem().string();
  // A name with the mark of a frame number would be that of a sequence.
  if (const std::size_t mark = stem.find('#'); mark != std::string::npos) {
    stem.erase(mark);
    stem.erase(stem.find_last_not_of("_-. ") + 1);
  }
  if (stem.empty()) stem = "cumulet";
  const fs::path folder(model.preferences.folder);
  constexpr int most = 1000;
  for (int i = 1; i < most; ++i) {
    std::array<char, 16> number{};
    std::snprintf(number.data(), number.size(), "-%03d", i);
    const fs::path path = folder / std::string(stem).append(number.data()).append(ending);
    std::error_code error;
    if (!fs::exists(path, error)) return path.string();
  }
  return (folder / (stem + ending)).string();
}

bool has_ending(const std::string& path, const std::string& ending) {
  if (path.size() < ending.size()) return false;
  return std::equal(ending.rbegin(), ending.rend(), path.rbegin(), [](char a, char b) {
    const auto lower = [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; };
    return lower(a) == lower(b);
  });
}

bool is_model(const std::string& path) { return has_ending(path, ".gltf") || has_ending(path, ".glb"); }

bool is_environment(const std::string& path) { return has_ending(path, ".hdr") || has_ending(path, ".exr"); }

}  // namespace cumulet::demo
