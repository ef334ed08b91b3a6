#include "empty_window.hpp"

#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>

namespace cumulet::demo {
namespace {

constexpr std::size_t max_recent = 6;
constexpr float wanted_width = 560.0f;
constexpr float title_scale = 2.4f;

void draw_gradient(const Rectangle& view) {
  const ImVec2 low(static_cast<float>(view.x), static_cast<float>(view.y));
  const ImVec2 high(low.x + static_cast<float>(view.width), low.y + static_cast<float>(view.height));
  constexpr ImU32 above = IM_COL32(30, 40, 54, 255);
  constexpr ImU32 below = IM_COL32(15, 17, 21, 255);
  ImGui::GetBackgroundDrawList()->AddRectFilledMultiColor(low, high, above, above, below, below);
}

void draw_centered(const char* text) {
  const float room = ImGui::GetContentRegionAvail().x;
  const float length = ImGui::CalcTextSize(text, nullptr, false, room).x;
  ImGui::SetCursorPosX(ImGui::GetCursorPosX() + std::max(0.0f, 0.5f * (room - length)));
  ImGui::TextUnformatted(text);
}

void draw_samples(Ui& ui, const Model& model, std::vector<Command>& commands) {
  if (model.samples.empty()) return;
  const float gap = ImGui::GetStyle().ItemSpacing.x;
  const auto count = static_cast<float>(model.samples.size());
  const float width = (ImGui::GetContentRegionAvail().x - gap * (count - 1.0f)) / count;
  const float label = ImGui::GetTextLineHeightWithSpacing();
  for (const SampleCard& sample : model.samples) {
    if (&sample != model.samples.data()) ImGui::SameLine();
    const ImVec2 corner = ImGui::GetCursorScreenPos();
    const ImVec2 end(corner.x + width, corner.y + std::round(0.5f * width));
    const std::string control = std::string("Start/") + sample.label;
    if (ImGui::InvisibleButton(("##" + control).c_str(), {width, end.y - corner.y + label}))
      commands.push_back({Action::open_sample, sample.scene});
    const bool hovered = ImGui::IsItemHovered();
    ui.remember(control.c_str(), sample.tip);
    ImDrawList& list = *ImGui::GetWindowDrawList();
    // NOLINTNEXTLINE(performance-no-int-to-ptr): so ImGui has textures
    auto* picture = reinterpret_cast<ImTextureID>(std::uintptr_t{sample.texture});
    const float round = ui.px(4.0f);
    list.AddImageRounded(picture, corner, end, {0.0f, 0.0f}, {1.0f, 1.0f}, IM_COL32_WHITE, round);
    if (hovered) list.AddRect(corner, end, ImGui::GetColorU32(ImGuiCol_Text, 0.8f), round, 0, ui.px(1.5f));
    list.AddText({corner.x + ui.px(2.0f), end.y + ui.px(2.0f)},
                 ImGui::GetColorU32(hovered ? ImGuiCol_Text : ImGuiCol_TextDisabled), sample.label);
  }
  ImGui::Spacing();
}

void draw_recent(Ui& ui, const Model& model, std::vector<Command>& commands) {
  const std::vector<std::string>& recent = model.preferences.recent;
  if (recent.empty()) return;
  ImGui::Spacing();
  ImGui::Separator();
  Ui::heading("Recent");
  for (std::size_t i = 0; i < std::min(recent.size(), max_recent); ++i) {
    const std::string name = std::filesystem::path(recent[i]).filename().string();
    if (Ui::entry(name, i, false)) commands.push_back({Action::open, recent[i]});
    ui.remember(("Start/" + name).c_str(), recent[i].c_str());
    const char* const kind = kind_of_file(recent[i]);
    ImGui::SameLine(ImGui::GetWindowContentRegionMax().x - ImGui::CalcTextSize(kind).x);
    Ui::heading(kind);
  }
}

}  // namespace

const char* kind_of_file(const std::string& path) {
  if (has_ending(path, ".json")) return "Scene";
  if (is_model(path)) return "Model";
  return is_environment(path) ? "Environment" : "Volume";
}

void draw_empty_window(Ui& ui, const Rectangle& view, const Model& model, std::vector<Command>& commands) {
  draw_gradient(view);
  const float width = std::min(ui.px(wanted_width), static_cast<float>(view.width) - ui.px(24.0f));
  const ImVec2 middle(static_cast<float>(view.x + 0.5 * view.width), static_cast<float>(view.y + 0.5 * view.height));
  ImGui::SetNextWindowPos(middle, ImGuiCond_Always, {0.5f, 0.5f});
  ImGui::SetNextWindowSizeConstraints({width, 0.0f}, {width, static_cast<float>(view.height)});
  ImGui::SetNextWindowBgAlpha(0.0f);
  ImGui::PushStyleVar(ImGuiStyleVar_WindowBorderSize, 0.0f);
  ImGui::Begin("start", nullptr,
               ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove |
                   ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoFocusOnAppearing |
                   ImGuiWindowFlags_NoBringToFrontOnFocus | ImGuiWindowFlags_NoNav | ImGuiWindowFlags_AlwaysAutoResize);
  ImGui::PushTextWrapPos();
  ImGui::SetWindowFontScale(title_scale);
  draw_centered("Cumulet");
  ImGui::SetWindowFontScale(1.0f);
  ImGui::Spacing();
  if (ImGui::Button("Open...", {-1.0f, 0.0f})) commands.push_back({Action::open_dialog});
  ui.remember("Start/Open", "Opens a volume, a model, an environment map or a scene (Ctrl+O).");
  ImGui::Spacing();
  constexpr std::array lines{"Drop a volume (.vdb, .nvdb, .nrrd, .nhdr, .vti, .raw, .tif),",
                             "surfaces (.gltf, .glb), an environment (.hdr, .exr) or a scene (.json) here,",
                             "or press Ctrl+O.  F1 shows all keys."};
  for (const char* line : lines) draw_centered(line);
  ImGui::PopTextWrapPos();
  ImGui::Spacing();
  draw_samples(ui, model, commands);
  draw_recent(ui, model, commands);
  ImGui::End();
  ImGui::PopStyleVar();
}

}  // namespace cumulet::demo
