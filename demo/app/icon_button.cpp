#include "icon_button.hpp"

#include <string>

namespace cumulet::demo {

bool icon_button(Ui& ui, const IconButton& button, float side) {
  constexpr float units = 32.0f;  // an icon of 20 units and a margin
  const ImVec2 corner = ImGui::GetCursorScreenPos();
  ImGui::BeginDisabled(!button.enabled);
  const bool clicked = ImGui::InvisibleButton((std::string("##") + button.control).c_str(), {side, side});
  ImGui::EndDisabled();
  const bool hovered = ImGui::IsItemHovered();
  ImDrawList& list = *ImGui::GetWindowDrawList();
  const ImVec2 end(corner.x + side, corner.y + side);
  if (button.active || (hovered && button.enabled))
    list.AddRectFilled(corner, end, ImGui::GetColorU32(button.active ? ImGuiCol_ButtonActive : ImGuiCol_ButtonHovered),
                       ui.px(4.0f));
  const Pen pen(list, {corner.x + 0.5f * side, corner.y + 0.5f * side}, side / units,
                ImGui::GetColorU32(button.enabled ? ImGuiCol_Text : ImGuiCol_TextDisabled));
  button.draw(pen);
  ui.remember(button.control, button.tip);
  return clicked;
}

}  // namespace cumulet::demo
