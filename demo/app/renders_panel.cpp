#include "renders_panel.hpp"

#include <imgui.h>

#include <algorithm>
#include <filesystem>
#include <progress.hpp>
#include <string>

namespace cumulet::demo {
namespace {

std::string state_text(const RenderEntry& entry) {
  switch (entry.state) {
    case RenderEntry::State::waiting:
      return "waiting";
    case RenderEntry::State::running:
      return entry.text + (entry.seconds_left ? ", " + format_duration(*entry.seconds_left) + " left" : "");
    case RenderEntry::State::done:
      return entry.text;
    case RenderEntry::State::failed:
      return "failed: " + entry.text;
    case RenderEntry::State::cancelled:
      return "canceled";
  }
  return "";
}

void draw_entry(Ui& ui, const RenderEntry& entry, std::vector<Command>& commands) {
  const std::string number = std::to_string(entry.number);
  const std::string prefix = "Render " + number + "/";
  ImGui::PushID(number.c_str());
  ImGui::TextUnformatted(std::filesystem::path(entry.path).filename().string().c_str());
  ui.remember((prefix + "Name").c_str(), entry.path.c_str());
  const float button = ui.px(110.0f);
  const bool runs = entry.state == RenderEntry::State::running;
  if (!entry.has_ended()) {
    const float width = ImGui::GetContentRegionAvail().x - button - ImGui::GetStyle().ItemSpacing.x;
    ImGui::ProgressBar(runs ? static_cast<float>(entry.part) : 0.0f, {std::max(width, 1.0f), ImGui::GetFrameHeight()});
    ImGui::SameLine();
    if (ImGui::Button("Cancel", {button, 0.0f})) commands.push_back({Action::cancel_render, number});
    ui.remember((prefix + "Cancel").c_str(), "Cancels this picture; nothing is written.");
  } else if (entry.state == RenderEntry::State::done) {
    if (ImGui::Button("Show in folder", {button, 0.0f})) commands.push_back({Action::show_in_folder, entry.path});
    ui.remember((prefix + "Show in folder").c_str(), "Opens the folder of the file.");
  }
  ImGui::PushTextWrapPos(0.0f);
  Ui::heading(state_text(entry).c_str());
  ImGui::PopTextWrapPos();
  ImGui::PopID();
}

}  // namespace

void draw_renders(Ui& ui, const Rectangle& view, Model& model, std::vector<Command>& commands) {
  if (!model.renders_open) return;
  const float room = static_cast<float>(view.width) - ui.px(24.0f);
  // Beside the progress of loading, or below it if the image is narrow.
  const bool narrow = static_cast<float>(view.width) < ui.px(1090.0f);
  const ImVec2 corner(static_cast<float>(view.x + view.width) - ui.px(12.0f),
                      static_cast<float>(view.y) + ui.px(narrow ? 84.0f : 12.0f));
  ImGui::SetNextWindowPos(corner, ImGuiCond_Always, {1.0f, 0.0f});
  ImGui::SetNextWindowSize({std::min(ui.px(340.0f), room), 0.0f});
  ImGui::SetNextWindowSizeConstraints({0.0f, 0.0f}, {room, static_cast<float>(view.height) * 0.6f});
  ImGui::Begin("Render queue", &model.renders_open,
               ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoCollapse |
                   ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoFocusOnAppearing);
  if (model.renders.empty()) Ui::heading("No pictures. F12 renders one.");
  for (const RenderEntry& entry : model.renders) {
    draw_entry(ui, entry, commands);
    ImGui::Spacing();
  }
  if (std::ranges::any_of(model.renders, &RenderEntry::has_ended) &&
      ui.button("Clear list", "Removes the ended pictures from the list. The files stay."))
    commands.push_back({Action::clear_renders});
  ImGui::End();
}

}  // namespace cumulet::demo
