#include "file_dialog.hpp"

#include <imgui.h>

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <system_error>
#include <tuple>
#include <utility>

namespace cumulet::demo {

namespace fs = std::filesystem;

void FileDialog::open(const std::string& title, Action done, std::vector<std::string> endings,
                      const std::string& suggestion) {
  opening_ = true;
  title_ = title;
  done_ = done;
  endings_ = std::move(endings);
  trouble_.clear();
  std::error_code error;
  const fs::path start(suggestion);
  fs::path folder = saving() ? start.parent_path() : start;
  if (folder.empty() || !fs::is_directory(folder, error)) folder = fs::current_path(error);
  enter(folder.string());
  path_ = saving() ? (folder / start.filename()).string() : "";
}

void FileDialog::enter(const std::string& folder) {
  std::error_code error;
  const fs::path there = fs::absolute(folder, error).lexically_normal();
  std::vector<Entry> entries;
  fs::directory_iterator iterator(there, fs::directory_options::skip_permission_denied, error);
  if (error) {
    trouble_ = there.string() + ": " + error.message();
    return;
  }
  for (; iterator != fs::directory_iterator(); iterator.increment(error)) {
    if (error) break;
    const std::string name = iterator->path().filename().string();
    if (name.empty() || name[0] == '.') continue;
    std::error_code ignored;
    const bool is_folder = iterator->is_directory(ignored);
    if (is_folder || takes(name)) entries.push_back({name, is_folder});
  }
  std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
    return std::make_tuple(!a.folder, a.name) < std::make_tuple(!b.folder, b.name);
  });
  if (there.has_parent_path() && there != there.root_path()) entries.insert(entries.begin(), {"..", true});
  folder_ = there.string();
  entries_ = std::move(entries);
  trouble_.clear();
}

bool FileDialog::takes(const std::string& file) const {
  return std::ranges::any_of(endings_, [&](const std::string& ending) { return has_ending(file, ending); });
}

void FileDialog::choose(std::vector<Command>& commands) {
  if (path_.empty()) return;
  std::error_code error;
  if (fs::is_directory(path_, error)) {
    enter(path_);
    if (!saving()) path_.clear();
    return;
  }
  if (saving()) {
    if (!takes(path_)) path_ += endings_.front();
  } else if (!fs::exists(path_, error)) {
    trouble_ = path_ + ": file not found";
    return;
  } else if (!takes(path_)) {
    trouble_ = path_ + ": unsupported extension; expected one of: " + endings_text();
    return;
  }
  commands.push_back({done_, path_});
  close();
}

void FileDialog::close() {
  open_ = false;
  ImGui::CloseCurrentPopup();
}

void FileDialog::list(Ui& ui, std::vector<Command>& commands) {
  ImGui::BeginChild("files", {0.0f, ui.px(240.0f)}, true, ImGuiWindowFlags_NavFlattened);
  std::string entered;
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    const Entry& entry = entries_[i];
    const std::string shown = entry.folder ? entry.name + "/" : entry.name;
    const fs::path path = (fs::path(folder_) / entry.name).lexically_normal();
    if (Ui::entry(shown, i, !entry.folder && path.string() == path_, ImGuiSelectableFlags_DontClosePopups)) {
      if (entry.folder)
        entered = path.string();
      else
        path_ = path.string();
    }
    ui.remember(shown.c_str(), entry.folder ? "Opens the folder." : "Selects the file; double-click to open.");
    if (!entry.folder && ImGui::IsItemHovered() && ImGui::IsMouseDoubleClicked(0)) choose(commands);
  }
  ImGui::EndChild();
  if (entered.empty()) return;
  const std::string name = fs::path(path_).filename().string();
  enter(entered);
  path_ = saving() ? (fs::path(folder_) / name).string() : "";
}

void FileDialog::recent(Ui& ui, const Preferences& preferences, std::vector<Command>& commands) {
  // Only files of the kinds that this dialog opens.
  std::vector<std::string> files;
  std::ranges::copy_if(preferences.recent, std::back_inserter(files), [this](const auto& file) { return takes(file); });
  if (saving() || files.empty()) return;
  Ui::heading("Recent");
  ImGui::PushID("recent");
  for (std::size_t i = 0; i < files.size(); ++i) {
    const std::string& file = files[i];
    const std::string name = fs::path(file).filename().string();
    const std::string shown = end_of(file, ImGui::GetContentRegionAvail().x);
    if (Ui::entry(shown, i, false, ImGuiSelectableFlags_DontClosePopups)) {
      path_ = file;
      choose(commands);
    }
    ui.remember(("Recent/" + name).c_str(), file.c_str());
  }
  ImGui::PopID();
  ImGui::Spacing();
}

std::string FileDialog::endings_text() const {
  std::string text;
  for (const std::string& ending : endings_) text += (text.empty() ? "" : ", ") + ending;
  return text;
}

void FileDialog::draw(Ui& ui, const Preferences& preferences, std::vector<Command>& commands) {
  const std::string id = title_ + "###dialog";
  if (opening_) ImGui::OpenPopup(id.c_str());
  const ImVec2 screen = ImGui::GetIO().DisplaySize;
  ImGui::SetNextWindowPos({screen.x * 0.5f, screen.y * 0.5f}, ImGuiCond_Always, {0.5f, 0.5f});
  ImGui::SetNextWindowSize({std::min(ui.px(560.0f), screen.x * 0.95f), 0.0f});
  open_ = ImGui::BeginPopupModal(
      id.c_str(), nullptr, ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_AlwaysAutoResize);
  if (!open_) {
    opening_ = false;
    return;
  }
  if (opening_) ImGui::SetKeyboardFocusHere();
  opening_ = false;
  const std::string endings = endings_text();
  if (ui.text("Path", ("Full path of the file: " + endings + ". Press Enter to accept.").c_str(),
              saving() ? "File name" : "Type a path or select a file below", path_))
    choose(commands);
  ImGui::Spacing();
  recent(ui, preferences, commands);
  Ui::heading(end_of(folder_, ImGui::GetContentRegionAvail().x).c_str());
  list(ui, commands);
  std::error_code error;
  if (!trouble_.empty()) {
    ImGui::PushStyleColor(ImGuiCol_Text, {0.95f, 0.55f, 0.45f, 1.0f});
    ImGui::TextWrapped("%s", trouble_.c_str());
    ImGui::PopStyleColor();
  } else if (saving() && fs::exists(path_, error) && !fs::is_directory(path_, error)) {
    ImGui::TextColored({0.95f, 0.75f, 0.45f, 1.0f}, "This file will be replaced.");
  } else {
    Ui::heading(endings.c_str());
  }
  ImGui::Spacing();
  if (ui.button(saving() ? "Save file" : "Open file", "Uses the path above.", {ui.px(110.0f), 0.0f})) choose(commands);
  ImGui::SameLine();
  const bool escape = ImGui::IsKeyPressed(ImGui::GetKeyIndex(ImGuiKey_Escape)) && !ImGui::IsAnyItemActive();
  if (ui.button("Close", "Closes the dialog (Escape).", {ui.px(110.0f), 0.0f}) || escape) close();
  ImGui::EndPopup();
}

}  // namespace cumulet::demo
