#include "menus.hpp"

#include <imgui.h>

#include <algorithm>
#include <filesystem>

#include "selection.hpp"

namespace cumulet::demo {
namespace {

bool has_content(const Model& model) { return model.status.has_content; }
bool has_volume(const Model& model) { return model.status.has_volume; }
bool plays(const Model& model) { return model.status.play.has_value(); }

template <Tool tool>
bool is_tool(const Model& model) {
  return model.tool == tool;
}

template <cumulet_view_mode view>
bool is_view(const Model& model) {
  return model.scene.sampling.view == view;
}

template <int percent>
MenuEntry scale_entry(const char* label) {
  return {
      label, {Action::scale_interface, "", percent}, "Size of texts and controls.", nullptr, [](const Model& model) {
        return model.preferences.scale_percent == percent;
      }};
}

const MenuEntry separator = {"", {Action::cancel}, ""};

template <Tool tool>
MenuEntry tool_entry(const char* label, const char* tip) {
  return {label, {Action::tool, "", static_cast<int>(tool)}, tip, nullptr, is_tool<tool>};
}

template <cumulet_view_mode view>
MenuEntry view_entry(const char* label, const char* tip) {
  return {label, {Action::view, "", view}, tip, nullptr, is_view<view>};
}

Menu file_menu() {
  return {"File",
          {{"New", {Action::new_scene}, "An empty scene with daylight."},
           {"Open...", {Action::open_dialog}, "Opens a volume, a model, an environment map or a scene."},
           {"Open recent",
            {Action::open},
            "Opens a recent scene or file.",
            [](const Model& model) { return !model.preferences.recent.empty(); }},
           separator,
           {"Save", {Action::save_scene}, "Saves the scene: all settings and the camera."},
           {"Save as...", {Action::save_scene_dialog}, "Saves the scene under another name."},
           separator,
           {"Add volume...", {Action::add_volume_dialog}, "Adds another volume."},
           {"Add model...", {Action::add_model_dialog}, "Adds another model."},
           {"Open environment...", {Action::environment_dialog}, "Opens an .hdr or .exr environment map."},
           {"Desktop's file dialogs",
            {Action::toggle_desktop_dialogs},
            "Uses the file dialogs of the desktop where it has some.",
            nullptr,
            [](const Model& model) { return model.preferences.desktop_dialogs; }},
           separator,
           {"Quit", {Action::quit}, "Ends the program. Asks if there are unsaved changes."}}};
}

Menu edit_menu() {
  return {
      "Edit",
      {{"Undo", {Action::undo}, "Undoes the last change.", [](const Model& model) { return model.undo.has_value(); }},
       {"Redo",
        {Action::redo},
        "Repeats the last undone change.",
        [](const Model& model) { return model.redo.has_value(); }},
       separator,
       {"Duplicate",
        {Action::duplicate_selected},
        "Duplicates the selected objects; copies share the data of their originals.",
        has_selection},
       {"Delete", {Action::remove_selected}, "Removes the selected objects from the scene.", has_selection},
       {"Hide", {Action::hide_selected}, "Hides the selected objects, or shows them if all are hidden.", can_hide},
       {"Remove environment",
        {Action::clear_environment},
        "Removes the environment map; it is day again.",
        [](const Model& model) { return !model.scene.environment.empty(); }},
       separator,
       {"Add light", {Action::add_light}, "Adds a point light above the camera's target."},
       {"Auto density",
        {Action::auto_density},
        "Sets a density that suits the volume: a mean optical depth of 8.",
        has_volume},
       {"Up axis Y",
        {Action::choose_up, "", static_cast<int>(UpAxis::y)},
        "The first volume's up axis is Y.",
        has_volume,
        [](const Model& model) { return model.scene.up == UpAxis::y; }},
       {"Up axis Z",
        {Action::choose_up, "", static_cast<int>(UpAxis::z)},
        "The first volume's up axis is Z, as in files of Blender and Mantaflow.",
        has_volume,
        [](const Model& model) { return model.scene.up == UpAxis::z; }},
       {"Inspect grids...", {Action::grids_dialog}, "Shows the grids of the first volume's file.", has_volume}}};
}

Menu view_menu() {
  return {"View",
          {{"Frame all", {Action::frame_all}, "Fits the whole scene into the image.", has_content},
           {"Fly",
            {Action::toggle_fly},
            "Moves the camera by W, A, S and D, as in games.",
            nullptr,
            [](const Model& model) { return model.navigation.fly != 0; }},
           {"Turntable",
            {Action::toggle_turntable},
            "Rotates the camera around the target.",
            nullptr,
            [](const Model& model) { return model.navigation.turntable_degrees_per_second != 0.0; }},
           separator,
           tool_entry<Tool::none>("No handles", "No outlines, handles or light icons."),
           tool_entry<Tool::move>("Move", "Handles that move the selected object."),
           tool_entry<Tool::rotate>("Rotate", "Handles that rotate the selected object."),
           tool_entry<Tool::scale>("Scale", "Handles that scale the selected object."),
           {"Local axes",
            {Action::toggle_axes},
            "Handles along the object's own axes.",
            nullptr,
            [](const Model& model) { return model.axes == Axes::local; }},
           separator,
           view_entry<CUMULET_VIEW_SHADED>("Shaded", "The rendered image."),
           view_entry<CUMULET_VIEW_CELLS>("Cells",
                                          "The cells of the grid in a slice, colored by size. For tests of the grid."),
           view_entry<CUMULET_VIEW_STEPS>("Steps", "The number of cells along each ray, which costs time, as colors."),
           view_entry<CUMULET_VIEW_DENSITY>("Density", "The opacity along each ray, without light."),
           view_entry<CUMULET_VIEW_WIREFRAME>("Wireframe", "The edges of the cells."),
           separator,
           {"Panel",
            {Action::toggle_panel},
            "Shows or hides the panel and the tools.",
            nullptr,
            [](const Model& model) { return model.panel; }},
           scale_entry<0>("Scale of the screen"),
           scale_entry<100>("Scale 100 %"),
           scale_entry<125>("Scale 125 %"),
           scale_entry<150>("Scale 150 %"),
           scale_entry<200>("Scale 200 %"),
           {"Keyboard to panel", {Action::focus_panel}, "Moves the keyboard focus to the panel."},
           {"Messages",
            {Action::toggle_log},
            "Shows the log of all messages.",
            nullptr,
            [](const Model& model) { return model.log_open; }},
           {"Dismiss message", {Action::dismiss}, "Hides the newest message.", [](const Model& model) {
              return !model.messages.empty();
            }}}};
}

Menu render_menu() {
  return {
      "Render",
      {{"Render...", {Action::render_dialog}, "Renders a picture or a sequence in the background.", has_content},
       {"Render queue",
        {Action::toggle_renders},
        "Shows the pictures that are rendered in the background.",
        nullptr,
        [](const Model& model) { return model.renders_open; }},
       separator,
       {"Save PNG...", {Action::png_dialog}, "Saves the displayed image at full resolution.", has_content},
       {"Save EXR...", {Action::exr_dialog}, "Saves the linear radiance and AOVs as OpenEXR.", has_content},
       separator,
       {"Brighter", {Action::brighter}, "Exposure up by a third of a stop."},
       {"Darker", {Action::darker}, "Exposure down by a third of a stop."},
       {"Auto exposure", {Action::auto_exposure}, "Sets the exposure that suits the displayed image.", has_content},
       {"Auto exposure after loading",
        {Action::toggle_auto_exposure},
        "Sets a suitable exposure once after each load, unless you or a scene file have set one.",
        nullptr,
        [](const Model& model) { return model.preferences.auto_exposure; }},
       {"Render region", {Action::draw_region}, "The next drag over the image sets the render region.", has_content},
       {"Clear render region", {Action::clear_region}, "Renders the whole image.", has_content},
       {"Next grid type",
        {Action::next_grid_type},
        "The grid that rays traverse: tetrahedra, all voxels, or bricks. The image stays the same."},
       {"Cancel loading",
        {Action::cancel_load},
        "Cancels loading and keeps the current scene.",
        [](const Model& model) { return model.status.busy; }},
       separator,
       {"Play the sequence",
        {Action::play_row},
        "Plays the numbered files to which the volume's file belongs.",
        [](const Model& model) { return model.status.neighbours.has_value(); }},
       {"Play", {Action::play}, "Plays or pauses.", plays, [](const Model& model) { return model.playing; }},
       {"First frame", {Action::go_to_end, "", -1}, "Shows the first frame of the playback.", plays},
       {"Previous frame", {Action::step, "", -1}, "Shows the previous frame.", plays},
       {"Next frame", {Action::step, "", 1}, "Shows the next frame.", plays},
       {"Last frame", {Action::go_to_end, "", 1}, "Shows the last frame of the playback.", plays},
       {"Set first frame", {Action::begin_here}, "Playback begins at the current frame.", plays},
       {"Set last frame", {Action::end_here}, "Playback ends at the current frame.", plays}}};
}

Menu help_menu() {
  return {"Help",
          {{"Keys and mouse",
            {Action::toggle_help},
            "All keys and mouse buttons.",
            nullptr,
            [](const Model& model) { return model.help; }},
           {"About Cumulet", {Action::about}, "Version, OpenGL driver, libraries and licenses."}}};
}

/// Draws the recent files: scenes first.
void draw_recent(Ui& ui, const Model& model, std::vector<Command>& commands) {
  const auto draw = [&](bool scenes) {
    for (const std::string& file : model.preferences.recent) {
      if (has_ending(file, ".json") != scenes) continue;
      const std::string name = std::filesystem::path(file).filename().string();
      ImGui::PushID(file.c_str());
      if (Ui::entry(name, 0, false)) commands.push_back({Action::open, file});
      ui.remember(("Recent/" + name).c_str(), file.c_str());
      ImGui::PopID();
    }
  };
  ImGui::Dummy({ui.px(220.0f), 0.0f});
  draw(true);
  ImGui::Separator();
  draw(false);
}

/// Returns the label with the name of the step that the command undoes or repeats.
std::string label_of(const MenuEntry& entry, const Model& model) {
  const auto named = [&](const std::optional<std::string>& step) {
    return step && !step->empty() ? std::string(entry.label) + " " + *step : entry.label;
  };
  if (entry.command.action == Action::undo) return named(model.undo);
  if (entry.command.action == Action::redo) return named(model.redo);
  return entry.label;
}

void draw_entry(Ui& ui, const std::string& control, const MenuEntry& entry, const Model& model,
                std::vector<Command>& commands) {
  const bool enabled = entry.enabled == nullptr || entry.enabled(model);
  if (entry.command.action == Action::open) {
    const bool open = ImGui::BeginMenu(entry.label, enabled);
    if (!open) ui.remember(control.c_str(), entry.tip);
    if (!open) return;
    draw_recent(ui, model, commands);
    ImGui::EndMenu();
    return;
  }
  const bool checked = entry.checked != nullptr && entry.checked(model);
  const std::string label = label_of(entry, model) + "###" + entry.label;
  Command command = entry.command;
  if (command.action == Action::dismiss && !model.messages.empty()) command.text = model.messages.back().text;
  if (ImGui::MenuItem(label.c_str(), keys_of(entry.command).c_str(), checked, enabled)) commands.push_back(command);
  ui.remember(control.c_str(), entry.tip);
}

}  // namespace

const std::vector<Menu>& menus() {
  static const std::vector<Menu> all = {file_menu(), edit_menu(), view_menu(), render_menu(), help_menu()};
  return all;
}

void draw_menu_bar(Ui& ui, const Model& model, std::vector<Command>& commands) {
  if (!ImGui::BeginMainMenuBar()) return;
  for (const Menu& menu : menus()) {
    const bool open = ImGui::BeginMenu(menu.label);
    if (!open) {
      ui.remember(menu.label, nullptr);
      continue;
    }
    for (const MenuEntry& entry : menu.entries) {
      if (*entry.label == '\0')
        ImGui::Separator();
      else
        draw_entry(ui, std::string(menu.label) + "/" + entry.label, entry, model, commands);
    }
    ImGui::EndMenu();
  }
  const float room = ImGui::GetWindowWidth() - ImGui::GetCursorPosX() - ui.px(14.0f);
  const std::string name = room > ui.px(60.0f) ? end_of(scene_name(model), room) : "";
  const float width = ImGui::CalcTextSize(name.c_str()).x + ui.px(14.0f);
  ImGui::SetCursorPosX(std::max(ImGui::GetWindowWidth() - width, ImGui::GetCursorPosX()));
  Ui::heading(name.c_str());
  ImGui::EndMainMenuBar();
}

}  // namespace cumulet::demo
