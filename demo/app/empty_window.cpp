#include "empty_window.hpp"

#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <string>
#include <vector>

namespace cumulet::demo {
namespace {

constexpr float wanted_width = 560.0f;

void draw_gradient(const Rectangle& view) {
  const ImVec2 low(static_cast<float>(view.x), static_cast<float>(view.y));
  const ImVec2 high(low.x + static_cast<float>(view.width), low.y + static_cast<float>(view.height));
  constexpr ImU32 above = IM_COL32(30, 40, 54, 255);
  constexpr ImU32 below = IM_COL32(15, 17, 21, 255);
  ImGui::GetBackgroundDrawList()->AddRectFilledMultiColor(low, high, above, above, below, below);
}

/// Draws text in lines that are as long as the window is wide, each centered.
void draw_centered(const char* text) {
  const float room = ImGui::GetContentRegionAvail().x;
  const char* const end = text + std::strlen(text);
  while (text < end) {
    const ImFont& font = *ImGui::GetFont();
    const char* stop = font.CalcWordWrapPositionA(ImGui::GetFontSize() / font.FontSize, text, end, room);
    if (stop == text) ++stop;  // a character that is wider than the window
    const float length = ImGui::CalcTextSize(text, stop).x;
    ImGui::SetCursorPosX(ImGui::GetCursorPosX() + std::max(0.0f, 0.5f * (room - length)));
    ImGui::TextUnformatted(text, stop);
    for (text = stop; text < end && *text == ' ';) ++text;
  }
}

/// Draws the program's name, in a size that fits the window.
void draw_title() {
  ImFont* const font = title_font();
  ImGui::PushFont(font);
  const float room = ImGui::GetContentRegionAvail().x;
  const float length = ImGui::CalcTextSize("Cumulet").x;
  ImGui::SetWindowFontScale(std::min(1.0f, 0.98f * room / length));
  draw_centered("Cumulet");
  ImGui::SetWindowFontScale(1.0f);
  ImGui::PopFont();
}

/// Returns the OpenGL texture as ImGui's.
ImTextureID texture_id(unsigned name) {
  // NOLINTNEXTLINE(performance-no-int-to-ptr): so ImGui has textures
  return reinterpret_cast<ImTextureID>(std::uintptr_t{name});
}

/// A picture to click on, with lines of text below.
struct Card {
  std::string control;
  std::string tip;
  unsigned texture = 0;  // 0: an empty frame
  std::vector<std::string> lines;
};

/// Returns true if the card was clicked.
bool draw_card(Ui& ui, const Card& card, ImVec2 size) {
  const float line = ImGui::GetTextLineHeightWithSpacing();
  const ImVec2 corner = ImGui::GetCursorScreenPos();
  const ImVec2 end(corner.x + size.x, corner.y + size.y);
  const auto lines = static_cast<float>(card.lines.size());
  const bool clicked = ImGui::InvisibleButton(("##" + card.control).c_str(), {size.x, size.y + lines * line});
  const bool hovered = ImGui::IsItemHovered();
  ui.remember(card.control.c_str(), card.tip.c_str());
  ImDrawList& list = *ImGui::GetWindowDrawList();
  const float round = ui.px(4.0f);
  if (card.texture != 0)
    list.AddImageRounded(texture_id(card.texture), corner, end, {0.0f, 0.0f}, {1.0f, 1.0f}, IM_COL32_WHITE, round);
  else
    list.AddRectFilled(corner, end, IM_COL32(255, 255, 255, 12), round);
  if (hovered) list.AddRect(corner, end, ImGui::GetColorU32(ImGuiCol_Text, 0.8f), round, 0, ui.px(1.5f));
  float y = end.y + ui.px(2.0f);
  for (const std::string& text : card.lines) {
    const bool first = &text == card.lines.data();
    list.AddText({corner.x + ui.px(2.0f), y},
                 ImGui::GetColorU32(hovered && first ? ImGuiCol_Text : ImGuiCol_TextDisabled), text.c_str());
    y += line;
  }
  return clicked;
}

/// Returns the width of each of `count` cards in a row.
float card_width(std::size_t count) {
  const auto cards = static_cast<float>(count);
  return (ImGui::GetContentRegionAvail().x - ImGui::GetStyle().ItemSpacing.x * (cards - 1.0f)) / cards;
}

void draw_samples(Ui& ui, const Model& model, std::vector<Command>& commands) {
  if (model.samples.empty()) return;
  const float width = card_width(model.samples.size());
  for (const SampleCard& sample : model.samples) {
    if (&sample != model.samples.data()) ImGui::SameLine();
    const Card card{std::string("Start/") + sample.label, sample.tip, sample.texture, {sample.label}};
    if (draw_card(ui, card, {width, std::round(0.5f * width)})) commands.push_back({Action::open_sample, sample.scene});
  }
  ImGui::Spacing();
}

void draw_recent(Ui& ui, const Model& model, std::vector<Command>& commands) {
  const auto recent = listed_files(model.preferences);
  if (recent.empty()) return;
  ImGui::Spacing();
  ImGui::Separator();
  Ui::heading("Recent");
  const float width = card_width(max_listed_files);
  for (const std::string& file : recent) {
    if (&file != recent.data()) ImGui::SameLine();
    const std::string name = std::filesystem::path(file).filename().string();
    const auto texture = model.recent_textures.find(file);
    const Card card{"Start/" + name,
                    file,
                    texture != model.recent_textures.end() ? texture->second : 0U,
                    {end_of(name, width), kind_of_file(file)}};
    ImGui::PushID(file.c_str());  // files of one name
    if (draw_card(ui, card, {width, width})) commands.push_back({Action::open, file});
    ImGui::PopID();
  }
  ImGui::Spacing();
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
  draw_title();
  ImGui::Spacing();
  if (ImGui::Button("Open...", {-1.0f, 0.0f})) commands.push_back({Action::open_dialog});
  ui.remember("Start/Open",
              "Opens a volume (.vdb, .nvdb, .nrrd, .nhdr, .vti, .raw, .tif), a model (.gltf, .glb), an environment map "
              "(.hdr, .exr) or a scene (.json): Ctrl+O.");
  ImGui::Spacing();
  draw_centered("Or drop a volume, a model, an environment map or a scene here.");
  draw_centered("F1 shows all keys.");
  ImGui::Spacing();
  draw_samples(ui, model, commands);
  draw_recent(ui, model, commands);
  ImGui::End();
  ImGui::PopStyleVar();
}

}  // namespace cumulet::demo
