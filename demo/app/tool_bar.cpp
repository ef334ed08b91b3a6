#include "tool_bar.hpp"

#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "icon_button.hpp"

namespace cumulet::demo {
namespace {

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

void draw_entry(Ui& ui, const Entry& entry, float side, const Model& model, std::vector<Command>& commands) {
  const bool is_tool = entry.command.action == Action::tool;
  const bool active = is_tool && model.tool == static_cast<Tool>(entry.command.value);
  const std::string keys = keys_of(entry.command);
  const std::string tip = entry.tip + (keys.empty() ? "" : " (" + keys + ")");
  if (icon_button(ui, {entry.control, tip.c_str(), entry.draw, active, is_tool || model.status.has_content}, side))
    commands.push_back(entry.command);
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
  // Icons shrink in a low window, so that all of them are in it.
  const auto count = static_cast<float>(entries().size());
  const float gap = ui.px(4.0f) + ImGui::GetStyle().ItemSpacing.y * (count + 1.0f);
  const float room = (ImGui::GetContentRegionAvail().y - gap) / count;
  const float side = std::clamp(std::floor(room), ui.px(10.0f), ui.px(32.0f));
  for (const Entry& entry : entries()) {
    if (entry.command.action == Action::frame_all) ImGui::Dummy({0.0f, ui.px(4.0f)});
    draw_entry(ui, entry, side, model, commands);
  }
  ImGui::End();
  ImGui::PopStyleVar(3);
}

}  // namespace cumulet::demo
