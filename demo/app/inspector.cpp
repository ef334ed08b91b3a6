// The inspector of the panel, which shows the settings of the selected part or object only.

#include <imgui.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "clip_rows.hpp"
#include "panel.hpp"
#include "selection.hpp"

namespace cumulet::demo {

void Panel::inspector(Model& model, std::vector<Command>& commands) {
  const Subject subject = subject_of(model);
  if (const Item* item = std::get_if<Item>(&subject)) {
    switch (item->kind) {
      case Item::Kind::volume:
        return volume(model, *item, commands);
      case Item::Kind::model:
        return one_model(model, model.scene.models[item->index]);
      case Item::Kind::analytic_light:
        return analytic_light(model, model.scene.analytic_lights[item->index]);
    }
  }
  switch (std::get<Part>(subject)) {
    case Part::render:
      return render(model, commands);
    case Part::camera:
      return camera(model, commands);
    case Part::sun_sky:
      return light(model, commands);
    case Part::environment:
      return environment(model, commands);
    case Part::ground:
      return ground(model);
  }
}

void Panel::render(Model& model, std::vector<Command>& commands) {
  ui_.group("Image", true, "Image", [&] { display(model, commands); });
  ui_.group("Sampling", true, "Sampling", [&] { sampling(model); });
  ui_.group("Advanced", false, "Advanced", [&] {
    advanced_sampling(model);
    Ui::heading("Grid");
    grid(model);
    Ui::heading("Statistics");
    statistics(model);
  });
}

void Panel::volume(Model& model, const Item& item, std::vector<Command>& commands) {
  // Tabs that would be shortened to a few letters are reached by arrows and by a list.
  const bool plays = item.index == 0 && (model.status.play || model.status.neighbours);
  const float needed = ui_.px(plays ? 264.0f : 190.0f);
  const ImGuiTabBarFlags narrow = ImGuiTabBarFlags_FittingPolicyScroll | ImGuiTabBarFlags_TabListPopupButton;
  if (!ImGui::BeginTabBar("volume", ImGui::GetContentRegionAvail().x < needed ? narrow : 0)) return;
  const auto tab = [this](const char* label, const char* tip, const auto& content) {
    const bool open = ImGui::BeginTabItem(label);
    ui_.remember(label, tip);
    if (!open) return;
    ImGui::Spacing();
    content();
    ImGui::EndTabItem();
  };
  SceneVolume& shown = volume_at(model.scene, item.index);
  const bool first = item.index == 0;
  tab("Material", "How the medium scatters, absorbs and emits light.", [&] { medium(model, item.index, commands); });
  tab("Object", "Name, transform and clip.", [&] {
    object(shown, item, commands);
    const settings::Clip before = shown.clip;
    clip_rows(ui_, shown.clip, box_of(model.scene, model.status.boxes, item));
    // The clip's handles are those of the selected object.
    if (shown.clip != before && !model.chosen) model.chosen = item;
  });
  tab("Grids", "The grids of the file and its up axis.", [&] {
    if (first)
      grids(model, commands);
    else
      up_axis(shown.up, shown.volume, commands);
  });
  if (plays) tab("Sequence", "Playback of numbered files.", [&] { sequence(model, commands); });
  ImGui::EndTabBar();
}

void Panel::object(SceneVolume& volume, const Item& item, std::vector<Command>& commands) {
  if (item.index == 0) {
    if (path_of_ != volume.volume) path_ = path_of_ = volume.volume;
    if (ui_.text("Volume file", "Press Enter to open another file in place of this one.", "Path of a file", path_))
      commands.push_back({Action::open, path_});
  } else {
    ui_.value_row("Volume file", volume.volume);
  }
  name_row(volume.name);
  ui_.checkbox("Visible", "If off, the object is hidden and casts no shadow.", volume.visible);
  transform_.draw(volume, item.transform_index);
}

void Panel::name_row(std::string& name) {
  if (!ImGui::IsAnyItemActive()) name_ = name;
  if (ui_.text("Name", "Name in the scene file. Press Enter to accept.", "name of the file", name_)) name = name_;
}

void Panel::grids(Model& model, std::vector<Command>& commands) {
  std::vector<Choice> grids;
  std::vector<std::string> tips;
  tips.reserve(model.grids.size());
  int now = -1;
  for (std::size_t i = 0; i < model.grids.size(); ++i) {
    const GridInfo& grid = model.grids[i];
    tips.push_back(grid.refusal.empty() ? grid.type : grid.type + ": " + grid.refusal);
    grids.push_back({grid.name.c_str(), static_cast<int>(i), tips.back().c_str()});
    if (grid.name == model.status.grid) now = static_cast<int>(i);
  }
  if (!grids.empty() && ui_.choose("Grid name", "Density grid: a scalar fog volume of the file.", grids, now))
    model.scene.grid_name = model.grids[static_cast<std::size_t>(now)].name;
  up_axis(model.scene.up, "", commands);
  if (ui_.button("Inspect grids", "Shows type, voxels, range and histogram of each grid, and lets you select one.",
                 {-1.0f, 0.0f}))
    commands.push_back({Action::grids_dialog});
}

void Panel::up_axis(UpAxis now, const std::string& other, std::vector<Command>& commands) {
  int up = static_cast<int>(now);
  if (ui_.choose("Up axis", "Up axis of the volume. The file is loaded again and framed.",
                 {{"Y", static_cast<int>(UpAxis::y), "Y is up."},
                  {"Z", static_cast<int>(UpAxis::z), "Z is up, as in files of Blender and Mantaflow."}},
                 up))
    commands.push_back({Action::choose_up, other, up});
}

}  // namespace cumulet::demo
