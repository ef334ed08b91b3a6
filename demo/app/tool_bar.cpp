#include "tool_bar.hpp"

#include <imgui.h>

#include <array>
#include <cmath>
#include <numbers>
#include <string>

namespace cumulet::demo {
namespace {

/// Draws an icon in a square of 20 units around a center.
class Pen {
 public:
  Pen(ImDrawList& list, ImVec2 center, float unit, ImU32 color)
      : list_(list), center_(center), unit_(unit), color_(color) {}

  void line(ImVec2 from, ImVec2 to) const { list_.AddLine(at(from), at(to), color_, 1.6f * unit_); }
  void triangle(ImVec2 a, ImVec2 b, ImVec2 c) const { list_.AddTriangleFilled(at(a), at(b), at(c), color_); }
  void rectangle(ImVec2 low, ImVec2 high) const { list_.AddRect(at(low), at(high), color_, 0.0f, 0, 1.6f * unit_); }
  void disk(ImVec2 middle, float radius) const { list_.AddCircleFilled(at(middle), radius * unit_, color_, 12); }
  /// Angles in radians, clockwise from the right.
  void arc(float radius, float from, float to) const {
    list_.PathArcTo(center_, radius * unit_, from, to, 24);
    list_.PathStroke(color_, 0, 1.6f * unit_);
  }

 private:
  [[nodiscard]] ImVec2 at(ImVec2 point) const { return {center_.x + point.x * unit_, center_.y + point.y * unit_}; }

  ImDrawList& list_;
  ImVec2 center_;
  float unit_;
  ImU32 color_;
};

void draw_select(const Pen& pen) {
  pen.triangle({-4.0f, -8.0f}, {-4.0f, 5.0f}, {5.0f, 2.0f});
  pen.line({0.0f, 2.0f}, {3.0f, 8.0f});
}

void draw_move(const Pen& pen) {
  constexpr float tip = 9.0f;
  constexpr float base = 5.5f;
  constexpr float wing = 3.0f;
  for (const float side : {-1.0f, 1.0f}) {
    pen.line({0.0f, 0.0f}, {side * base, 0.0f});
    pen.line({0.0f, 0.0f}, {0.0f, side * base});
    pen.triangle({side * tip, 0.0f}, {side * base, -wing}, {side * base, wing});
    pen.triangle({0.0f, side * tip}, {-wing, side * base}, {wing, side * base});
  }
}

void draw_rotate(const Pen& pen) {
  constexpr float radius = 6.5f;
  constexpr float pi = std::numbers::pi_v<float>;
  pen.arc(radius, -0.25f * pi, 1.45f * pi);
  pen.triangle({0.0f, -radius - 3.5f}, {0.0f, -radius + 3.5f}, {4.5f, -radius});
}

void draw_scale(const Pen& pen) {
  pen.rectangle({-8.0f, 1.0f}, {-1.0f, 8.0f});
  pen.line({0.0f, 0.0f}, {5.5f, -5.5f});
  pen.triangle({8.0f, -8.0f}, {2.5f, -7.0f}, {7.0f, -2.5f});
}

void draw_frame(const Pen& pen) {
  constexpr float far = 8.0f;
  constexpr float arm = 3.5f;
  for (const float x : {-1.0f, 1.0f}) {
    for (const float y : {-1.0f, 1.0f}) {
      pen.line({x * far, y * far}, {x * (far - arm), y * far});
      pen.line({x * far, y * far}, {x * far, y * (far - arm)});
    }
  }
  pen.disk({0.0f, 0.0f}, 3.0f);
}

void draw_region(const Pen& pen) {
  constexpr float far = 8.0f;
  for (const float from : {-8.0f, -2.0f, 4.0f}) {
    for (const float side : {-far, far}) {
      pen.line({from, side}, {from + 4.0f, side});
      pen.line({side, from}, {side, from + 4.0f});
    }
  }
}

void draw_exposure(const Pen& pen) {
  constexpr float radius = 4.0f;
  pen.arc(radius, 0.0f, 2.0f * std::numbers::pi_v<float>);
  pen.disk({0.0f, 0.0f}, 2.0f);
  for (int i = 0; i < 8; ++i) {
    const float angle = 0.25f * std::numbers::pi_v<float> * static_cast<float>(i);
    const ImVec2 ray(std::cos(angle), std::sin(angle));
    pen.line({6.0f * ray.x, 6.0f * ray.y}, {8.5f * ray.x, 8.5f * ray.y});
  }
}

struct Entry {
  const char* control;
  const char* tip;
  Command command;
  void (*draw)(const Pen& pen);
};

const std::vector<Entry>& entries() {
  const auto tool = [](Tool value) { return Command{Action::tool, "", static_cast<int>(value)}; };
  static const std::vector<Entry> all = {
      {"Tool/Select", "Select: a click selects an object. No outlines, handles or light icons.", tool(Tool::none),
       draw_select},
      {"Tool/Move", "Move the selected object by its handles.", tool(Tool::move), draw_move},
      {"Tool/Rotate", "Rotate the selected object by its handles.", tool(Tool::rotate), draw_rotate},
      {"Tool/Scale", "Scale the selected object by its handles.", tool(Tool::scale), draw_scale},
      {"Tool/Frame all", "Fit the whole scene into the image.", {Action::frame_all}, draw_frame},
      {"Tool/Region", "Drag the region of the image that is rendered.", {Action::draw_region}, draw_region},
      {"Tool/Auto exposure",
       "Set the exposure that suits the displayed image.",
       {Action::auto_exposure},
       draw_exposure},
  };
  return all;
}

void draw_entry(Ui& ui, const Entry& entry, const Model& model, std::vector<Command>& commands) {
  const bool is_tool = entry.command.action == Action::tool;
  const bool active = is_tool && model.tool == static_cast<Tool>(entry.command.value);
  const bool enabled = is_tool || model.status.has_content;
  const ImVec2 corner = ImGui::GetCursorScreenPos();
  const float size = ui.px(32.0f);
  ImGui::BeginDisabled(!enabled);
  if (ImGui::InvisibleButton((std::string("##") + entry.control).c_str(), {size, size}))
    commands.push_back(entry.command);
  ImGui::EndDisabled();
  const bool hovered = ImGui::IsItemHovered();
  const std::string keys = keys_of(entry.command);
  const std::string tip = entry.tip + (keys.empty() ? "" : " (" + keys + ")");
  ImDrawList& list = *ImGui::GetWindowDrawList();
  const ImVec2 end(corner.x + size, corner.y + size);
  if (active || (hovered && enabled))
    list.AddRectFilled(corner, end, ImGui::GetColorU32(active ? ImGuiCol_ButtonActive : ImGuiCol_ButtonHovered),
                       ui.px(4.0f));
  const Pen pen(list, {corner.x + 0.5f * size, corner.y + 0.5f * size}, ui.px(1.0f),
                ImGui::GetColorU32(enabled ? ImGuiCol_Text : ImGuiCol_TextDisabled));
  entry.draw(pen);
  ui.remember(entry.control, tip.c_str());
}

}  // namespace

void draw_tool_bar(Ui& ui, const Rectangle& view, const Model& model, std::vector<Command>& commands) {
  const auto top = static_cast<float>(view.y);
  ImGui::SetNextWindowPos({0.0f, top});
  ImGui::SetNextWindowSize({static_cast<float>(view.x), static_cast<float>(view.height)});
  ImGui::PushStyleVar(ImGuiStyleVar_WindowRounding, 0.0f);
  ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, {ui.px(4.0f), ui.px(6.0f)});
  ImGui::PushStyleVar(ImGuiStyleVar_ItemSpacing, {0.0f, ui.px(3.0f)});
  ImGui::Begin("Tools", nullptr,
               ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoSavedSettings |
                   ImGuiWindowFlags_NoBringToFrontOnFocus | ImGuiWindowFlags_NoFocusOnAppearing |
                   ImGuiWindowFlags_NoNav);
  for (const Entry& entry : entries()) {
    if (entry.command.action == Action::frame_all) ImGui::Dummy({0.0f, ui.px(4.0f)});
    draw_entry(ui, entry, model, commands);
  }
  ImGui::End();
  ImGui::PopStyleVar(3);
}

}  // namespace cumulet::demo
