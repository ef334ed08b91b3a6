#include "question.hpp"

#include <imgui.h>

#include <algorithm>
#include <utility>

namespace cumulet::demo {

void Question::ask(const std::string& title, const std::string& text, std::vector<Answer> answers) {
  opening_ = true;
  title_ = title;
  text_ = text;
  answers_ = std::move(answers);
}

void Question::draw(Ui& ui, std::vector<Command>& commands) {
  const std::string id = title_ + "###question";
  if (opening_) ImGui::OpenPopup(id.c_str());
  const ImVec2 screen = ImGui::GetIO().DisplaySize;
  ImGui::SetNextWindowPos({screen.x * 0.5f, screen.y * 0.5f}, ImGuiCond_Always, {0.5f, 0.5f});
  ImGui::SetNextWindowSize({std::min(ui.px(440.0f), screen.x * 0.95f), 0.0f});
  ImGui::SetNextWindowSizeConstraints({0.0f, 0.0f}, {screen.x, screen.y * 0.98f});
  open_ = ImGui::BeginPopupModal(
      id.c_str(), nullptr, ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_AlwaysAutoResize);
  const bool opened = std::exchange(opening_, false);
  if (!open_) return;
  ImGui::TextWrapped("%s", text_.c_str());
  ImGui::Dummy({0.0f, ui.px(6.0f)});
  const Answer* given = nullptr;
  for (const Answer& answer : answers_) {
    if (&answer != &answers_.front()) ImGui::SameLine();
    if (opened && &answer == &answers_.front()) ImGui::SetKeyboardFocusHere();
    if (ImGui::Button(answer.label, {ui.px(110.0f), 0.0f})) given = &answer;
    ui.remember((std::string("Question/") + answer.label).c_str(), answer.tip);
  }
  if (!opened && ImGui::IsKeyPressed(ImGui::GetKeyIndex(ImGuiKey_Escape))) given = &answers_.back();
  if (!opened && ImGui::IsKeyPressed(ImGui::GetKeyIndex(ImGuiKey_Enter), false)) given = &answers_.front();
  if (given != nullptr) {
    if (given->command) commands.push_back(*given->command);
    open_ = false;
    ImGui::CloseCurrentPopup();
  }
  ImGui::EndPopup();
}

}  // namespace cumulet::demo
