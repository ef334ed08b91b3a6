// The control for color ramps: a bar of colors with a marker below it for each stop.

#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <image.hpp>
#include <optional>
#include <string>

#include "ui.hpp"

namespace cumulet::demo {

namespace {

// Returns a linear color for the screen; peak: value that is shown as white.
ImU32 shown(const std::array<float, 3>& color, float peak) {
  const auto encoded = [&](std::size_t i) { return image::srgb_encode(std::clamp(color[i] / peak, 0.0f, 1.0f)); };
  return ImGui::GetColorU32(ImVec4(encoded(0), encoded(1), encoded(2), 1.0f));
}

}  // namespace

/// The bar of a gradient, whose ends are those of the view's range.
struct Ui::GradientArea {
  ImVec2 low, high;  // corners of the bar
  float end_y;       // lower end of the markers
  float min_value, max_value;

  [[nodiscard]] float x_of(float value) const {
    return low.x + (high.x - low.x) * ((value - min_value) / (max_value - min_value));
  }
  [[nodiscard]] float value_at(float x) const {
    return min_value + std::clamp((x - low.x) / (high.x - low.x), 0.0f, 1.0f) * (max_value - min_value);
  }
};

bool Ui::gradient(const char* label, const char* tip, settings::ColorStops& stops, ColorRampView& view) {
  const ImVec2 corner = ImGui::GetCursorScreenPos();
  const ImVec2 size(ImGui::GetContentRegionAvail().x, px(40.0f));
  ImGui::InvisibleButton((std::string("##") + label).c_str(), size,
                         ImGuiButtonFlags_MouseButtonLeft | ImGuiButtonFlags_MouseButtonRight);
  remember(label, tip);
  const float pad = px(7.0f);  // so that markers at the ends are not clipped
  const ImVec2 end(corner.x + size.x, corner.y + size.y);
  const GradientArea area{
      {corner.x + pad, corner.y}, {end.x - pad, end.y - px(15.0f)}, end.y, view.min_value, view.max_value};
  const ImVec2 mouse = ImGui::GetIO().MousePos;
  const bool hovered = ImGui::IsItemHovered();
  std::optional<std::size_t> near;
  float nearest = px(8.0f);
  for (std::size_t i = 0; hovered && i < stops.size(); ++i) {
    const float distance = std::abs(area.x_of(stops[i][0]) - mouse.x);
    if (distance > nearest) continue;
    nearest = distance;
    near = i;
  }

  bool changed = false;
  if (hovered && ImGui::IsMouseClicked(ImGuiMouseButton_Left)) {
    const std::size_t count = stops.size();
    view.held = near ? near : add_stop(stops, area.value_at(mouse.x));
    changed = stops.size() != count;
    if (view.held) view.chosen = *view.held;
  } else if (!ImGui::IsItemActive()) {
    view.held.reset();
    view.taken_off.reset();
  }
  const ImVec2 moved = ImGui::GetIO().MouseDelta;
  if (ImGui::IsItemActive() && !ImGui::IsMouseClicked(ImGuiMouseButton_Left) && (moved.x != 0.0f || moved.y != 0.0f)) {
    const float room = px(24.0f);  // a smaller distance from the bar does not remove a stop
    const bool off = mouse.y < corner.y - room || mouse.y > end.y + room;
    changed |= drag_stop(stops, view, area.value_at(mouse.x), off);
  }
  takes_delete_ |= hovered;
  const bool right = ImGui::IsMouseClicked(ImGuiMouseButton_Right);
  const bool deleted = hovered && ImGui::IsKeyPressed(ImGui::GetKeyIndex(ImGuiKey_Delete), false);
  const std::optional<std::size_t> removed = right ? near : deleted ? std::optional(view.chosen) : std::nullopt;
  if (removed && !view.held && remove_stop(stops, *removed)) {
    view.chosen = std::min(view.chosen, stops.size() - 1);
    near.reset();
    changed = true;
  }

  if (ImGui::IsItemVisible()) draw_gradient(area, stops, view, near);
  return changed;
}

void Ui::draw_gradient(const GradientArea& area, const settings::ColorStops& stops, const ColorRampView& view,
                       std::optional<std::size_t> near) const {
  ImDrawList& draw = *ImGui::GetWindowDrawList();
  float peak = 1.0f;
  for (const settings::ColorStop& stop : stops) peak = std::max({peak, stop[1], stop[2], stop[3]});
  // Between stops the light is linear, and the screen's encoding of it is not.
  const float step = px(3.0f);
  for (float x = area.low.x; x < area.high.x; x += step) {
    const float next = std::min(x + step, area.high.x);
    const ImU32 left = shown(color_at(stops, area.value_at(x)), peak);
    const ImU32 right = shown(color_at(stops, area.value_at(next)), peak);
    draw.AddRectFilledMultiColor({x, area.low.y}, {next, area.high.y}, left, right, right, left);
  }
  draw.AddRect(area.low, area.high, ImGui::GetColorU32(ImGuiCol_Border), px(2.0f));
  for (std::size_t i = 0; i < stops.size(); ++i) {
    const float x = std::clamp(area.x_of(stops[i][0]), area.low.x, area.high.x);
    const float half = px(6.0f);
    const float top = area.high.y - px(2.0f);
    const float shoulder = area.high.y + px(5.0f);
    const ImVec2 outline[5] = {
        {x, top}, {x + half, shoulder}, {x + half, area.end_y}, {x - half, area.end_y}, {x - half, shoulder}};
    draw.AddConvexPolyFilled(outline, 5, shown({stops[i][1], stops[i][2], stops[i][3]}, peak));
    const bool lit = i == near || i == view.held;
    draw.AddPolyline(outline, 5, ImGui::GetColorU32(i == view.chosen ? ImGuiCol_CheckMark : ImGuiCol_Text),
                     ImDrawFlags_Closed, px(lit || i == view.chosen ? 2.0f : 1.0f));
  }
}

}  // namespace cumulet::demo
