// The environment section of the panel, with a thumbnail that can be rotated by dragging.

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>

#include "environment_view.hpp"
#include "panel.hpp"

namespace cumulet::demo {

void Panel::environment(Model& model, std::vector<Command>& commands) {
  const std::string& file = model.scene.environment;
  using Desc = cumulet_environment_settings_desc;
  Desc& settings = model.scene.environment_settings;
  const bool any = !file.empty();
  ui_.value_row("Image",
                any ? std::filesystem::path(file).filename().string() : "none: drop an .hdr or .exr file here");
  if (any && model.thumbnail_texture != 0) {
    const auto& camera = model.scene.camera;
    const double ahead =
        std::atan2(camera.target[0] - camera.eye[0], camera.target[2] - camera.eye[2]) * 180.0 / std::numbers::pi;
    ui_.environment("Environment view",
                    "The environment map; +Z is in the middle. Drag to rotate, double-click to reset. The triangle "
                    "marks the viewing direction.",
                    model.thumbnail_texture, settings.rotation_degrees, ahead);
  }
  if (any) settings::for_each<Desc>([&](const auto& setting) { rows_.draw(setting, settings.*setting.field); });
  const float width = any ? Ui::width_beside("Open environment", "Remove environment") : -1.0f;
  if (ui_.button("Open environment",
                 "Opens an equirectangular Radiance (.hdr) or OpenEXR (.exr) image, or an .exr cube map.",
                 {width, 0.0f}))
    commands.push_back({Action::environment_dialog});
  if (!any) return;
  if (width > 0.0f) ImGui::SameLine();
  if (ui_.button("Remove environment", "Removes the environment map; sun and sky light the scene again.",
                 {width, 0.0f}))
    commands.push_back({Action::clear_environment});
}

bool Ui::environment(const char* label, const char* tip, unsigned texture, float& rotation_degrees,
                     double ahead_degrees) {
  const ImVec2 corner = ImGui::GetCursorScreenPos();
  const float width = ImGui::GetContentRegionAvail().x;
  const ImVec2 end(corner.x + width, corner.y + std::round(0.5f * width));
  ImGui::InvisibleButton((std::string("##") + label).c_str(), {width, end.y - corner.y});
  remember(label, tip);
  const bool hovered = ImGui::IsItemHovered();
  const bool held = ImGui::IsItemActive();
  if (hovered || held) ImGui::SetMouseCursor(ImGuiMouseCursor_ResizeEW);
  const float moved = ImGui::GetIO().MouseDelta.x;
  bool changed = false;
  if (hovered && ImGui::IsMouseDoubleClicked(ImGuiMouseButton_Left)) {
    changed = rotation_degrees != 0.0f;
    rotation_degrees = 0.0f;
  } else if (held && !ImGui::IsMouseClicked(ImGuiMouseButton_Left) && moved != 0.0f) {
    rotation_degrees =
        static_cast<float>(dragged(static_cast<double>(rotation_degrees), static_cast<double>(moved / width)));
    changed = true;
  }

  if (!ImGui::IsItemVisible()) return changed;
  ImDrawList& draw = *ImGui::GetWindowDrawList();
  const auto left = static_cast<float>(left_edge(static_cast<double>(rotation_degrees)));
  // NOLINTNEXTLINE(performance-no-int-to-ptr): so ImGui has textures
  auto* picture = reinterpret_cast<ImTextureID>(std::uintptr_t{texture});
  draw.AddImageRounded(picture, corner, end, {left, 0.0f}, {left + 1.0f, 1.0f}, IM_COL32_WHITE, px(4.0f));
  const float x = std::clamp(corner.x + width * static_cast<float>(position_of(ahead_degrees)), corner.x + px(6.0f),
                             end.x - px(6.0f));
  const float wing = px(6.0f);
  const auto triangle = [&](float size, ImU32 color) {
    draw.AddTriangleFilled({x - size, end.y}, {x + size, end.y}, {x, end.y - 1.5f * size}, color);
  };
  triangle(wing + px(1.5f), IM_COL32(0, 0, 0, 200));
  triangle(wing, IM_COL32(255, 255, 255, 255));
  if (hovered || held) draw.AddRect(corner, end, ImGui::GetColorU32(ImGuiCol_Text, 0.5f), px(4.0f), 0, px(1.5f));
  return changed;
}

}  // namespace cumulet::demo
