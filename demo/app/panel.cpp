#include "panel.hpp"

#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <numbers>
#include <settings.hpp>
#include <string>
#include <utility>
#include <vector>

#include "empty_window.hpp"
#include "history.hpp"
#include "menus.hpp"
#include "renders_panel.hpp"
#include "selection.hpp"
#include "status_line.hpp"
#include "tool_bar.hpp"

namespace cumulet::demo {
namespace {

constexpr float timeline_height = 58.0f;
constexpr ImGuiWindowFlags overlay = ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove |
                                     ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoFocusOnAppearing |
                                     ImGuiWindowFlags_NoNav | ImGuiWindowFlags_AlwaysAutoResize;

template <class... Values>
std::string print(const char* format, Values... values) {
  std::array<char, 160> text{};
  std::snprintf(text.data(), text.size(), format, values...);  // NOLINT(cppcoreguidelines-pro-type-vararg)
  return text.data();
}

/// Returns a format that prints an hour as a clock does: "14:12 (14.20 h)". The user can type the number.
std::string clock_text(double hour) {
  const auto minutes = static_cast<int>(std::lround(hour * 60.0));
  return print("%d:%02d", minutes / 60, minutes % 60) + "  (%.2f h)";
}

/// Returns the first name of the form "Camera 1" that no camera has.
std::string free_camera_name(const std::vector<NamedCamera>& cameras) {
  for (std::size_t number = 1;; ++number) {
    std::string name = std::string("Camera ").append(std::to_string(number));
    if (std::ranges::find(cameras, name, &NamedCamera::name) == cameras.end()) return name;
  }
}

std::string file_name(const std::string& path) { return std::filesystem::path(path).filename().string(); }

}  // namespace

Rectangle Panel::viewport(const Model& model, double width, double height, float scale) {
  const double wanted = std::round(static_cast<double>(model.preferences.panel_width * scale));
  const double side = model.panel ? std::min(wanted, width * 0.5) : 0.0;
  const double bar = model.panel ? std::round(static_cast<double>(tool_bar_width * scale)) : 0.0;
  const double above = std::min(static_cast<double>(ImGui::GetFrameHeight()), height);
  const double below =
      model.status.play ? std::min(std::round(static_cast<double>(timeline_height * scale)), height - above) : 0.0;
  return {bar, above, std::max(width - side - bar, 0.0), height - above - below};
}

void Panel::draw(Model& model, float scale, double time, std::vector<Command>& commands) {
  time_ = time;
  ui_.begin(scale, time);
  const ImVec2 screen = ImGui::GetIO().DisplaySize;
  view_ = viewport(model, static_cast<double>(screen.x), static_cast<double>(screen.y), scale);
  draw_menu_bar(ui_, model, commands);
  if (model.panel) {
    side(model, commands);
    draw_tool_bar(ui_, view_, model, commands);
  }
  if (model.status.play) timeline(model, commands);
  if (!model.status.has_content && !model.status.busy) draw_empty_window(ui_, view_, model, commands);
  // No progress bar for short work, such as the sky while the user drags the sun.
  const bool works = model.status.work.stage != CUMULET_STAGE_IDLE || model.status.compiled;
  if (model.status.busy && (works || !model.status.loading.empty())) loading(model, commands);
  state_.clear();
  if (model.status.has_content) state_line(model);
  if (model.log_open) log(model, commands);
  draw_renders(ui_, view_, model, commands);
  messages(model, commands);
  for (const std::string& refusal : ui_.take_refusals()) show_message(model, false, refusal, time_);
  if (model.help) help(model);
  help_was_closed_ = !model.help;
  dialog_.draw(ui_, model.preferences, commands);
  picker_.draw(ui_, commands);
  render_dialog_.draw(ui_, model, commands);
  question_.draw(ui_, commands);
}

void Panel::side(Model& model, std::vector<Command>& commands) {
  const ImVec2 screen = ImGui::GetIO().DisplaySize;
  const auto left = static_cast<float>(view_.x + view_.width);
  const auto top = static_cast<float>(view_.y);
  if (model.chosen && model.chosen != seen_ && subject_of(model) != Subject(*model.chosen))
    select(model, *model.chosen);
  seen_ = model.chosen;
  ImGui::SetNextWindowPos({left, top});
  ImGui::SetNextWindowSize({screen.x - left, screen.y - top});
  if (focus_) ImGui::SetNextWindowFocus();
  ImGui::PushStyleVar(ImGuiStyleVar_WindowRounding, 0.0f);
  ImGui::Begin(panel_name, nullptr,
               ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoSavedSettings |
                   ImGuiWindowFlags_NoBringToFrontOnFocus | ImGuiWindowFlags_NoFocusOnAppearing |
                   ImGuiWindowFlags_NoScrollWithMouse);
  ImGui::PopStyleVar();
  edge(model);
  // The inspector keeps at least three fifths of the height.
  outliner_.draw(model, 0.4f * ImGui::GetContentRegionAvail().y, std::exchange(focus_, false), commands);
  ImGui::Spacing();
  ImGui::Separator();
  ImGui::Spacing();
  ImGui::BeginChild("inspector", {0.0f, 0.0f}, false, ImGuiWindowFlags_NavFlattened | ImGuiWindowFlags_NoBackground);
  inspector(model, commands);
  ImGui::EndChild();
  ImGui::End();
}

void Panel::edge(Model& model) {
  const ImVec2 start = ImGui::GetCursorPos();
  ImGui::SetCursorPos({0.0f, 0.0f});
  const ImVec2 size(ui_.px(6.0f), ImGui::GetWindowHeight());
  const ImVec2 corner = ImGui::GetWindowPos();
  // The edge is in the window's padding, which the window clips.
  ImGui::PushClipRect(corner, {corner.x + size.x, corner.y + size.y}, false);
  ImGui::InvisibleButton("##Panel edge", size);
  const bool held = ImGui::IsItemActive();
  const bool lit = held || ImGui::IsItemHovered();
  ui_.remember("Panel edge", "Drag to change the panel's width.");
  if (lit) {
    ImGui::SetMouseCursor(ImGuiMouseCursor_ResizeEW);
    ImGui::GetWindowDrawList()->AddRectFilled(corner, {corner.x + ui_.px(2.0f), corner.y + size.y},
                                              ImGui::GetColorU32(ImGuiCol_SliderGrabActive));
  }
  if (held) {
    const float width = (ImGui::GetIO().DisplaySize.x - ImGui::GetIO().MousePos.x) / ui_.px(1.0f);
    model.preferences.panel_width = std::clamp(std::round(width), min_panel_width, max_panel_width);
  }
  ImGui::PopClipRect();
  ImGui::SetCursorPos(start);
}

void Panel::display(Model& model, std::vector<Command>& commands) {
  using Desc = cumulet_display_desc;
  Desc& display = model.scene.display;
  settings::for_each<Desc>([&](const auto& setting) {
    if (setting.is(&Desc::background_color) && display.background != CUMULET_BACKGROUND_COLOR) return;
    if (!setting.is(&Desc::tone_map) || model.scene.ocio.config.empty()) rows_.draw(setting, display.*setting.field);
    if (setting.is(&Desc::tone_map)) ocio(model, commands);
    if (!setting.is(&Desc::exposure_stops)) return;
    ImGui::BeginDisabled(!model.status.has_content);
    if (ui_.button("Auto exposure", "Sets the exposure that suits the displayed image. Ctrl+Z undoes that.",
                   {-1.0f, 0.0f}))
      commands.push_back({Action::auto_exposure});
    ImGui::EndDisabled();
  });
}

void Panel::light(Model& model, std::vector<Command>& commands) {
  cumulet_sun_sky_desc& light = model.scene.light;
  const auto& camera = model.scene.camera;
  const double azimuth =
      std::atan2(camera.eye[0] - camera.target[0], camera.eye[2] - camera.target[2]) * 180.0 / std::numbers::pi;
  const bool dialed = ui_.sun_dial(
      "Sun dial",
      "Drag to set the sun's direction. The angle is the azimuth, the rim the horizon, the center the zenith. "
      "Keyboard: Space, then the arrow keys, then Space. The triangle marks the camera.",
      light.sun_azimuth_degrees, light.sun_elevation_degrees, static_cast<float>(azimuth));
  const bool moved = time_of_day(light);
  sun_moves_ |= dialed || moved;
  if (sun_moves_ && !ImGui::IsAnyItemActive()) {
    sun_moves_ = false;
    commands.push_back({Action::follow_light});
  }
  using Desc = cumulet_sun_sky_desc;
  const bool physical = light.sky == CUMULET_SKY_PHYSICAL;
  settings::for_each<Desc>([&](const auto& setting) {
    const bool of_constant = setting.is(&Desc::sun_irradiance) || setting.is(&Desc::sky_radiance);
    const bool of_physical = setting.is(&Desc::turbidity) || setting.is(&Desc::ground_albedo);
    if (physical ? of_constant : of_physical) return;
    if (setting.is(&Desc::sun_angle_degrees)) {
      sun_angle(setting, light);
    } else {
      rows_.draw(setting, light.*setting.field);
    }
  });
}

bool Panel::time_of_day(cumulet_sun_sky_desc& light) {
  const SunAngles sun{static_cast<double>(light.sun_azimuth_degrees), static_cast<double>(light.sun_elevation_degrees)};
  // Every sun of the path keeps it, so that a drag from noon to the evening and back ends where it began.
  const auto is_on = [&](const SunPath& path) {
    constexpr double tolerance = 0.01;  // degrees
    const SunAngles nearest = path.at(path.hour_of(sun));
    return std::abs(nearest.elevation - sun.elevation) < tolerance &&
           std::abs(wrap_degrees(nearest.azimuth - sun.azimuth)) < tolerance;
  };
  if (!sun_path_ || !is_on(*sun_path_))
    sun_path_ = SunPath::through(sun, !sun_path_ || sun_path_->hour_of(sun) >= 12.0);
  double hour = sun_path_->hour_of(sun);
  if (!ui_.slider(
          "Time of day",
          "Moves the sun along its path over a day at the equinox: it rises at 6 and sets at 18 hours. The dial "
          "turns the path.",
          hour, SunPath::first_hour, SunPath::last_hour, clock_text(hour).c_str()))
    return false;
  const SunAngles moved = sun_path_->at(hour);
  light.sun_azimuth_degrees = static_cast<float>(moved.azimuth);
  light.sun_elevation_degrees = static_cast<float>(moved.elevation);
  return true;
}

void Panel::ground(Model& model) {
  cumulet_ground_desc& ground = model.scene.ground;
  using Desc = cumulet_ground_desc;
  settings::for_each<Desc>([&](const auto& setting) {
    const bool is_diffuse = ground.mode != CUMULET_GROUND_NONE && !is_shadow_catcher(ground.mode);
    if (setting.is(&Desc::albedo) && !is_diffuse) return;
    if (setting.is(&Desc::height) && !is_at_height(ground.mode)) return;
    const bool chosen = rows_.draw(setting, ground.*setting.field);
    if (chosen && setting.is(&Desc::mode)) model.unchosen_ground = false;
  });
}

void Panel::sun_angle(const settings::SettingInfo& info, cumulet_sun_sky_desc& light) {
  const float given = light.sun_angle_degrees;
  double shown = given != 0.0F ? std::max(0.0F, given) : settings::default_sun_angle(light.sky);
  if (rows_.draw(info, shown)) light.sun_angle_degrees = shown > 0.0 ? static_cast<float>(shown) : -1.0F;
}

void Panel::animation(const Model& model, const ModelFile& file, std::uint32_t& number, double& time) {
  const std::vector<ModelFile::Animation>& animations = file.animations;
  if (animations.empty()) return;
  if (animations.size() > 1) {
    std::vector<std::string> names;
    names.reserve(animations.size());
    for (const ModelFile::Animation& one : animations)
      names.push_back(one.name.empty() ? "Animation " + std::to_string(names.size() + 1) : one.name);
    std::vector<Choice> choices;
    for (std::size_t i = 0; i < names.size(); ++i)
      choices.push_back({names[i].c_str(), static_cast<int>(i), "An animation of the file."});
    int chosen = static_cast<int>(number);
    if (ui_.choose("Animation", "Animation of the model.", choices, chosen))
      number = static_cast<std::uint32_t>(chosen);
  }
  settings::with(&cumulet_surface_settings_desc::time, [&](auto row) {
    row.row.most = std::max(animations[std::min<std::size_t>(number, animations.size() - 1)].duration, 1e-3);
    // If a sequence is shown, the animation uses its clock.
    double clock = std::max(model.clock, 0.0);
    ImGui::BeginDisabled(model.status.play.has_value());
    rows_.draw(row, model.status.play ? clock : time);
    ImGui::EndDisabled();
  });
}

void Panel::variant(const ModelFile& file, std::string& wanted) {
  const std::vector<std::string>& names = file.variants;
  if (names.empty()) return;
  std::vector<Choice> choices = {{"none", 0, "The default materials of the file."}};
  int chosen = wanted.empty() ? 0 : -1;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const int number = static_cast<int>(i) + 1;
    choices.push_back({names[i].c_str(), number, "A material variant of the file."});
    if (chosen < 0 && (names[i] == wanted || std::to_string(i) == wanted)) chosen = number;
  }
  if (!ui_.choose("Variant", "Material variant of the model.", choices, chosen)) return;
  const auto index = static_cast<std::size_t>(chosen - 1);
  wanted = chosen == 0 ? "" : names[index];
  // If names are empty or ambiguous, the variant is stored by number.
  if (chosen > 0 && std::ranges::find(names, wanted) - names.begin() != chosen - 1) wanted = std::to_string(index);
  if (chosen > 0 && wanted.empty()) wanted = std::to_string(index);
}

void Panel::grid(Model& model) {
  using Desc = cumulet_grid_desc;
  Desc& grid = model.scene.grid;
  settings::for_each<Desc>([&](const auto& setting) {
    if (!setting.is(&Desc::type) && grid.type != CUMULET_GRID_TETRAHEDRAL) return;
    if (setting.is(&Desc::pixel_size) && grid.camera_adaptive == 0) return;
    if (setting.is(&Desc::threshold)) {
      threshold(setting, grid);
    } else if (rows_.draw(setting, grid.*setting.field) && setting.is(&Desc::criterion)) {
      grid.threshold = settings::default_threshold(grid.criterion);
    }
  });

  const cumulet_stats& stats = model.status.stats;
  if (grid.type == CUMULET_GRID_TETRAHEDRAL) {
    const std::string limited = stats.limited != 0 ? " (limit reached)" : "";
    ui_.value_row("Cell count",
                  model.status.has_volume ? short_count(static_cast<double>(stats.cells)) + limited : "-");
    ui_.value_row("Levels", model.status.has_volume ? std::to_string(stats.levels) : "-");
  }
  ui_.value_row("Grid data", model.status.has_volume ? short_bytes(static_cast<double>(stats.cell_bytes)) : "-");
}

void Panel::threshold(settings::SettingInfo info, cumulet_grid_desc& grid) {
  bool to_voxel = grid.threshold < 0.0;
  if (ui_.checkbox("Refine to voxels", "Splits cells wherever the density varies, down to the voxels.", to_voxel))
    grid.threshold = to_voxel ? -1.0 : settings::default_threshold(grid.criterion);
  const bool range = grid.criterion == CUMULET_CRITERION_RANGE_MEAN;
  info.row.least = range ? 1e-2 : 1e-4;
  info.row.most = range ? 100.0 : 1.0;
  if (!to_voxel) rows_.draw(info, grid.threshold);
}

void Panel::cameras(Model& model) {
  std::vector<NamedCamera>& cameras = model.scene.cameras;
  const NamedCamera* const shown = looked_through(model.scene);
  int chosen = shown != nullptr ? static_cast<int>(shown - cameras.data()) : -1;
  std::vector<Choice> choices;
  choices.reserve(cameras.size());
  for (const NamedCamera& camera : cameras)
    choices.push_back({camera.name.c_str(), static_cast<int>(choices.size()), "A saved camera of the scene."});
  if (!cameras.empty() &&
      ui_.choose("Saved camera", "The saved camera that is shown, until the camera is moved.", choices, chosen))
    look_through(model.scene, cameras[static_cast<std::size_t>(chosen)].name);
  const std::string free_name = free_camera_name(cameras);
  bool keep = ui_.text("Camera name", "Name of the camera that is added.", free_name.c_str(), camera_name_);
  const float width = chosen >= 0 ? Ui::width_beside("Add camera", "Remove camera") : -1.0f;
  const bool can_keep = !needs_fit(model.scene.camera);
  ImGui::BeginDisabled(!can_keep);
  keep |=
      ui_.button("Add camera", "Adds the current view as a camera of the scene; replaces a camera of the same name.",
                 {width, 0.0f});
  ImGui::EndDisabled();
  if (chosen >= 0) {
    if (width > 0.0f) ImGui::SameLine();
    if (ui_.button("Remove camera", "Removes the saved camera that is shown.", {width, 0.0f}))
      cameras.erase(cameras.begin() + chosen);
  }
  if (!keep || !can_keep) return;
  const std::string name = camera_name_.empty() ? free_name : camera_name_;
  const auto same = std::ranges::find(cameras, name, &NamedCamera::name);
  NamedCamera& kept = same != cameras.end() ? *same : cameras.emplace_back();
  static_cast<SceneCamera&>(kept) = model.scene;
  kept.name = name;
  camera_name_.clear();
}

void Panel::camera(Model& model, std::vector<Command>& commands) {
  using Desc = cumulet_navigation_desc;
  Desc& navigation = model.navigation;
  const auto turn = [&](const settings::SettingInfo& info) {
    bool on = navigation.turntable_degrees_per_second != 0.0;
    if (ui_.checkbox("Turntable", "Rotates the camera around the target (T).", on))
      commands.push_back({Action::toggle_turntable});
    double speed = navigation.turntable_degrees_per_second;
    if (on && rows_.draw(info, speed)) navigation.turntable_degrees_per_second = speed == 0.0 ? 0.1 : speed;
  };
  settings::for_each<Desc>([&](const auto& setting) {
    if (setting.is(&Desc::turntable_degrees_per_second)) return turn(setting);
    auto value = navigation.*setting.field;
    if (!rows_.draw(setting, value)) return;
    if (setting.is(&Desc::fly)) return commands.push_back({Action::toggle_fly});
    navigation.*setting.field = value;
    if (setting.is(&Desc::style)) model.preferences.style = navigation.style;
  });

  cumulet_camera_desc& view = model.scene.camera;
  bool other = false;
  settings::with(&cumulet_camera_desc::fovy_degrees,
                 [&](const auto& fovy) { other |= rows_.draw(fovy, view.fovy_degrees); });
  settings::with(&cumulet_camera_desc::lens_radius, [&](const auto& lens) { rows_.draw(lens, view.lens_radius); });
  if (view.lens_radius > 0.0)
    settings::with(&cumulet_camera_desc::focus_distance,
                   [&](const auto& focus) { rows_.draw(focus, view.focus_distance); });
  bool orthographic = view.orthographic_height > 0.0;
  if (ui_.checkbox("Orthographic", "Parallel projection.", orthographic)) {
    const double distance =
        std::hypot(view.eye[0] - view.target[0], view.eye[1] - view.target[1], view.eye[2] - view.target[2]);
    const double half = std::tan(view.fovy_degrees * std::numbers::pi / 360.0);
    view.orthographic_height = orthographic ? std::max(2.0 * distance * half, 1e-6) : 0.0;
    // Resets defaults that depend on the projection.
    view.near_plane = view.far_plane = 0.0;
    other = true;
  }
  if (other) end_shutter(model.scene);
  ImGui::BeginDisabled(!model.status.has_content);
  if (ui_.button("Frame all", "Fits the whole scene into the image (F, Home).", {-1.0f, 0.0f}))
    commands.push_back({Action::frame_all});
  ImGui::EndDisabled();
  cameras(model);
}

void Panel::sampling(Model& model) {
  using Desc = cumulet_sampling_desc;
  settings::for_each<Desc>([&](const auto& setting) {
    const bool advanced = setting.is(&Desc::seed) || setting.is(&Desc::region) || setting.is(&Desc::shutter_seconds);
    if (!advanced && !setting.is(&Desc::view)) rows_.draw(setting, model.scene.sampling.*setting.field);
  });
}

void Panel::advanced_sampling(Model& model) {
  using Desc = cumulet_sampling_desc;
  settings::for_each<Desc>([&](const auto& setting) {
    if (setting.is(&Desc::seed) || setting.is(&Desc::region) || setting.is(&Desc::shutter_seconds))
      rows_.draw(setting, model.scene.sampling.*setting.field);
  });
  // These apply to all models.
  settings::for_each<cumulet_surface_settings_desc>([&](const auto& setting) {
    if (model.scene.models.empty()) return;
    if (setting.is(&cumulet_surface_settings_desc::lighting) ||
        setting.is(&cumulet_surface_settings_desc::indirect_roughness))
      rows_.draw(setting, model.scene.surface.*setting.field);
  });
  ui_.checkbox("Fast preview", "Renders at a lower resolution during changes. Off: always full resolution.",
               model.adaptive_resolution);
}

void Panel::statistics(const Model& model) {
  const Status& status = model.status;
  const cumulet_stats& stats = status.stats;
  const Charts& charts = model.charts;
  ui_.plot("Frame time", "Milliseconds between images; when idle, from an input event to its display.",
           charts.frame_ms.values(), print("%.1f ms", static_cast<double>(charts.frame_ms.latest())));
  ui_.plot("Image latency", "Milliseconds from a change to the next displayed image.", charts.picture_ms.values(),
           print("%.0f ms", static_cast<double>(charts.picture_ms.latest())));
  ui_.plot("Samples per second", "Completed camera paths per second.", charts.samples_per_second.values(),
           short_count(static_cast<double>(charts.samples_per_second.latest())) + "/s");
  const auto noise = shown_noise(status);
  ui_.plot("Noise", "Relative standard error of the samples, before denoising, measured once per second.",
           charts.noise_percent.values(), noise ? print("%.2f %%", 100.0 * *noise) : std::string("-"));
  ui_.plot("GPU time", "GPU milliseconds of the library's passes per frame.", charts.device_ms.values(),
           print("%.1f ms", static_cast<double>(charts.device_ms.latest())));
  if (const double all = device_seconds(stats); all > 0.0) {
    const auto share = [all](double seconds) { return 100.0 * seconds / all; };
    ui_.value_row("Trace, surfaces", print("%.0f %%, ", share(stats.pass_seconds_trace)) +
                                         print("%.0f %%", share(stats.pass_seconds_surfaces)));
    ui_.value_row("Upload, display", print("%.0f %%, ", share(stats.pass_seconds_upload)) +
                                         print("%.0f %%", share(stats.pass_seconds_display)));
  }
  ImGui::Spacing();
  if (!status.has_content) return;
  if (status.has_volume) {
    ui_.value_row("Active voxels", short_count(static_cast<double>(stats.active_voxels)));
    ui_.value_row("Build", print("%.2f s", stats.build_seconds_total));
  }
  ui_.value_row("Trace", print("%.1f s", stats.trace_seconds));
  if (stats.steps > 0 && stats.samples > 0)
    ui_.value_row("Steps per path",
                  print("%.1f", static_cast<double>(stats.steps) / static_cast<double>(stats.samples)));
  ui_.value_row("GPU memory", short_bytes(static_cast<double>(stats.gl_bytes)));
  ui_.value_row("Renderer", stats.gl_renderer);
}

void Panel::loading(const Model& model, std::vector<Command>& commands) {
  const Work work = work_of(model.status);
  const float width = std::min(ui_.px(380.0f), static_cast<float>(view_.width) - ui_.px(24.0f));
  ImGui::SetNextWindowPos(
      {static_cast<float>(view_.x + 0.5 * view_.width), static_cast<float>(view_.y) + ui_.px(12.0f)}, ImGuiCond_Always,
      {0.5f, 0.0f});
  ImGui::SetNextWindowSize({width, 0.0f});
  ImGui::SetNextWindowBgAlpha(0.88f);
  ImGui::Begin("loading", nullptr, overlay & ~ImGuiWindowFlags_AlwaysAutoResize);
  const float button = ui_.px(76.0f);
  const std::string name = file_name(file_of_work(model));
  ImGui::TextUnformatted(work.name);
  if (!name.empty()) {
    ImGui::SameLine();
    ImGui::TextDisabled("%s", name.c_str());
  }
  const float right = work.stops ? button + ImGui::GetStyle().ItemSpacing.x : 0.0f;
  ImGui::ProgressBar(static_cast<float>(work.part), {-std::max(right, 1.0f), ImGui::GetFrameHeight()});
  if (work.stops) {
    ImGui::SameLine();
    if (ui_.button("Cancel", "Cancels loading and keeps the current scene (Escape).", {button, 0.0f}))
      commands.push_back({Action::cancel_load});
  }
  ImGui::End();
}

void Panel::state_line(const Model& model) {
  state_ = status_text(model);
  ImGui::SetNextWindowPos(
      {static_cast<float>(view_.x) + ui_.px(12.0f), static_cast<float>(view_.y + view_.height) - ui_.px(10.0f)},
      ImGuiCond_Always, {0.0f, 1.0f});
  ImGui::SetNextWindowBgAlpha(0.55f);
  ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, {ui_.px(9.0f), ui_.px(4.0f)});
  ImGui::Begin("state", nullptr, overlay | ImGuiWindowFlags_NoInputs);
  // A narrow image shows the beginning of the line.
  std::string shown = state_;
  const float room = static_cast<float>(view_.width) - ui_.px(42.0f);
  for (std::size_t cut = 0; ImGui::CalcTextSize(shown.c_str()).x > room; shown.resize(cut)) {
    cut = shown.rfind("   ");
    if (cut == std::string::npos) break;
  }
  ImGui::TextUnformatted(shown.c_str());
  // Rounded to whole pixels, because a smaller change would redraw the window without effect. In this window's list, so
  // that dialogs cover it.
  const double part = std::clamp(model.status.frame.progress, 0.0, 1.0);
  ImDrawList& list = *ImGui::GetWindowDrawList();
  list.PushClipRectFullScreen();
  list.AddRectFilled(
      {static_cast<float>(view_.x), static_cast<float>(view_.y + view_.height) - ui_.px(2.0f)},
      {static_cast<float>(view_.x + std::floor(view_.width * part)), static_cast<float>(view_.y + view_.height)},
      IM_COL32(95, 143, 191, 200));
  list.PopClipRect();
  ImGui::End();
  ImGui::PopStyleVar();
}

void Panel::help(Model& model) {
  const ImVec2 screen = ImGui::GetIO().DisplaySize;
  ImGui::SetNextWindowPos({screen.x * 0.5f, screen.y * 0.5f}, ImGuiCond_Always, {0.5f, 0.5f});
  ImGui::SetNextWindowBgAlpha(1.0f);
  ImGui::SetNextWindowSizeConstraints({0.0f, 0.0f}, screen);
  if (help_was_closed_) ImGui::SetNextWindowFocus();
  ImGui::Begin("Keys and mouse", &model.help,
               ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoCollapse | ImGuiWindowFlags_NoMove |
                   ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_AlwaysAutoResize |
                   ImGuiWindowFlags_HorizontalScrollbar);
  const auto row = [this](const char* keys, const char* what) {
    ImGui::TextUnformatted(keys);
    ImGui::SameLine(ui_.px(178.0f));
    Ui::heading(what);
  };
  for (const Shortcut& shortcut : shortcuts())
    if (shortcut.keys[0] != '\0') row(shortcut.keys, shortcut.what);
  row("Arrows,  -  =", "Orbit and dolly, when the image has the keyboard focus");
  ImGui::Spacing();
  ImGui::Separator();
  ImGui::Spacing();
  if (model.navigation.fly != 0) {
    row("Any button", "Look around");
    row("W A S D  E Q", "Move, up and down; Shift: faster");
  } else if (model.navigation.style == CUMULET_NAVIGATION_BLENDER) {
    row("Middle", "Orbit;  Shift: pan,  Ctrl: dolly");
    row("Keypad 1 3 7", "Front, right, top;  Ctrl: opposite side");
    row("Keypad 5", "Perspective or orthographic");
  } else if (model.navigation.style == CUMULET_NAVIGATION_MAYA) {
    row("Alt+left", "Orbit");
    row("Alt+middle", "Pan");
    row("Alt+right", "Dolly");
  } else {
    row("Left", "Orbit");
    row("Middle, Shift+left", "Pan");
    row("Right", "Dolly");
  }
  row("Wheel", "Dolly");
  row("Click", "Select an object;  drag its handles, Ctrl: snap");
  row("Ctrl, Shift+click", "Select several objects of the list;  drag: change the order");
  row("Double click", "Type a number into a slider;  Shift+drag: fine,  right click: default");
  ImGui::End();
}

}  // namespace cumulet::demo
