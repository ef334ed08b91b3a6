// The messages of the panel: toasts at the lower right of the image, and the log behind them.

#include <algorithm>
#include <string>

#include "panel.hpp"

namespace cumulet::demo {
namespace {

constexpr float toast_width = 400.0f;
constexpr ImU32 error_color = IM_COL32(230, 105, 85, 255);
constexpr ImU32 notice_color = IM_COL32(127, 180, 230, 255);

}  // namespace

void Panel::messages(Model& model, std::vector<Command>& commands) {
  std::erase_if(model.messages, [this](const Message& message) { return !message.error && message.until < time_; });
  if (model.messages.empty()) return;
  const auto right = static_cast<float>(view_.x + view_.width);
  const float width = std::min(ui_.px(toast_width), static_cast<float>(view_.width) - ui_.px(24.0f));
  ImGui::SetNextWindowPos({right - ui_.px(12.0f), static_cast<float>(view_.y + view_.height) - ui_.px(44.0f)},
                          ImGuiCond_Always, {1.0f, 1.0f});
  ImGui::SetNextWindowSize({width, 0.0f});
  // In a low window the messages scroll, so that they do not cover the menus.
  ImGui::SetNextWindowSizeConstraints(
      {0.0f, 0.0f}, {width, std::max(static_cast<float>(view_.height) - ui_.px(56.0f), ui_.px(40.0f))});
  ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, {ui_.px(10.0f), ui_.px(7.0f)});
  ImGui::Begin("messages", nullptr,
               ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoCollapse |
                   ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoFocusOnAppearing |
                   ImGuiWindowFlags_NoNav);
  for (std::size_t i = 0; i < model.messages.size(); ++i) {
    ImGui::PushID(static_cast<int>(i));
    toast(model.messages[i], commands);
    ImGui::PopID();
  }
  ImGui::End();
  ImGui::PopStyleVar();
}

void Panel::toast(const Message& message, std::vector<Command>& commands) {
  const float button = ui_.px(76.0f);
  const ImVec2 corner = ImGui::GetCursorScreenPos();
  const float right = ImGui::GetWindowContentRegionMax().x;
  // In a narrow window the buttons are below the text.
  const bool narrow = right < ui_.px(280.0f);
  ImGui::SetCursorPosX(ImGui::GetCursorPosX() + ui_.px(12.0f));
  ImGui::AlignTextToFramePadding();
  // Messages are wrapped, not truncated.
  ImGui::PushTextWrapPos(narrow ? right : right - button - ui_.px(8.0f));
  ImGui::TextUnformatted(message.text.c_str());
  ImGui::PopTextWrapPos();
  ImGui::GetWindowDrawList()->AddRectFilled({corner.x, ImGui::GetItemRectMin().y},
                                            {corner.x + ui_.px(4.0f), ImGui::GetItemRectMax().y},
                                            message.error ? error_color : notice_color, ui_.px(2.0f));
  ui_.remember("Message", message.text.c_str());
  if (!narrow) ImGui::SameLine();
  ImGui::SetCursorPosX(narrow ? ImGui::GetCursorPosX() + ui_.px(12.0f) : right - button);
  if (ui_.button("Dismiss", "Hides the message (Escape).", {button, 0.0f}))
    commands.push_back({Action::dismiss, message.text});
  if (!message.button) return;
  ImGui::SetCursorPosX(ImGui::GetCursorPosX() + ui_.px(12.0f));
  const bool pressed = ImGui::Button(message.button->label);
  ui_.remember((std::string("Message/") + message.button->label).c_str(), message.button->tip);
  if (!pressed) return;
  commands.push_back(message.button->command);
  commands.push_back({Action::dismiss, message.text});
}

void Panel::log(Model& model, std::vector<Command>& commands) {
  const float width = static_cast<float>(view_.width) - ui_.px(24.0f);
  ImGui::SetNextWindowPos(
      {static_cast<float>(view_.x) + ui_.px(12.0f), static_cast<float>(view_.y + view_.height) - ui_.px(44.0f)},
      ImGuiCond_Always, {0.0f, 1.0f});
  ImGui::SetNextWindowSize(
      {std::min(ui_.px(640.0f), width), std::min(ui_.px(260.0f), static_cast<float>(view_.height) * 0.6f)});
  ImGui::Begin("Messages", &model.log_open,
               ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoCollapse |
                   ImGuiWindowFlags_NoSavedSettings);
  if (ui_.button("Copy log", "Copies all messages to the clipboard.")) {
    std::string text;
    for (const LoggedMessage& message : model.log) text += message.time + " " + message.text + "\n";
    ImGui::SetClipboardText(text.c_str());
  }
  ImGui::SameLine();
  if (ui_.button("Clear log", "Removes all messages from the log.")) commands.push_back({Action::clear_log});
  ImGui::BeginChild("log", {0.0f, 0.0f}, true);
  ImGui::PushTextWrapPos(0.0f);
  for (const LoggedMessage& message : model.log) {
    Ui::heading(message.time.c_str());
    ImGui::SameLine();
    if (message.error) ImGui::PushStyleColor(ImGuiCol_Text, error_color);
    ImGui::TextUnformatted(message.text.c_str());
    if (message.error) ImGui::PopStyleColor();
  }
  ImGui::PopTextWrapPos();
  if (ImGui::GetScrollY() >= ImGui::GetScrollMaxY()) ImGui::SetScrollHereY(1.0f);
  ImGui::EndChild();
  ImGui::End();
}

}  // namespace cumulet::demo
