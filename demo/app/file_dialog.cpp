#include "file_dialog.hpp"

#include <imgui.h>

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <stdexcept>
#include <system_error>
#include <utility>

namespace cumulet::demo {

namespace fs = std::filesystem;

void FileDialog::use_desktop(const std::string& program, std::string parent) {
  desktop_.reset();
  if (program.empty()) return;
  desktop_.emplace(program);
  parent_ = std::move(parent);
}

void FileDialog::open(const std::string& title, Action done, std::vector<std::string> endings,
                      const std::string& suggestion) {
  opening_ = true;
  title_ = title;
  done_ = done;
  endings_ = std::move(endings);
  trouble_.clear();
  search_.clear();
  std::error_code error;
  const fs::path start(suggestion);
  fs::path folder = saving() ? start.parent_path() : start;
  if (folder.empty() || !fs::is_directory(folder, error)) folder = fs::current_path(error);
  enter(folder.string());
  name_ = start.filename().string();
  path_ = saving() ? (folder / name_).string() : "";
  if (desktop_ && !desktop_->open({saving(), title_, parent_, folder_, start.filename().string(), endings_}))
    desktop_.reset();
}

void FileDialog::enter(const std::string& folder) {
  std::error_code error;
  const fs::path there = fs::absolute(folder, error).lexically_normal();
  try {
    entries_ = list_folder(there.string(), endings_);
  } catch (const std::runtime_error& cause) {
    trouble_ = cause.what();
    return;
  }
  folder_ = there.string();
  sorted_ = false;
  trouble_.clear();
}

bool FileDialog::takes(const std::string& file) const {
  return std::ranges::any_of(endings_, [&](const std::string& ending) { return has_ending(file, ending); });
}

void FileDialog::choose(std::vector<Command>& commands) {
  if (path_.empty()) return;
  std::error_code error;
  // A name that was typed belongs to the folder that is shown.
  path_ = (fs::path(folder_) / path_).lexically_normal().string();
  if (fs::is_directory(path_, error)) {
    enter(path_);
    path_ = saving() ? (fs::path(folder_) / name_).string() : "";
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
  open_ = opening_ = false;
  ImGui::CloseCurrentPopup();
}

void FileDialog::take_desktop_result(const DesktopDialog::Result& result, std::vector<Command>& commands) {
  using Outcome = DesktopDialog::Result::Outcome;
  if (result.outcome == Outcome::closed) return close();
  if (result.outcome == Outcome::failed) {
    // The desktop has no portal, so that other dialogs would fail as well.
    desktop_.reset();
    return;
  }
  if (result.outcome == Outcome::unusable) {
    trouble_ = result.cause;
    return;
  }
  path_ = result.path;
  // The desktop has asked about replacing the chosen file, not about the one that has an extension added.
  std::error_code error;
  const bool other_file = saving() && !takes(path_) && fs::exists(path_ + endings_.front(), error);
  if (other_file) {
    path_ += endings_.front();
    return;
  }
  choose(commands);
}

void FileDialog::draw_places(Ui& ui) {
  for (std::size_t i = 0; i < places_.size(); ++i) {
    const Place& place = places_[i];
    if (Ui::entry(end_of(place.label, ImGui::GetContentRegionAvail().x), i, place.folder == folder_,
                  ImGuiSelectableFlags_DontClosePopups)) {
      const std::string name = fs::path(path_).filename().string();
      enter(place.folder);
      path_ = saving() ? (fs::path(folder_) / name).string() : "";
    }
    ui.remember(("Places/" + place.label).c_str(), place.folder.c_str());
  }
}

void FileDialog::list(Ui& ui, std::vector<Command>& commands) {
  constexpr ImGuiTableFlags look = ImGuiTableFlags_Sortable | ImGuiTableFlags_ScrollY | ImGuiTableFlags_RowBg;
  if (!ImGui::BeginTable("files", 3, look, {0.0f, ui.px(240.0f)})) return;
  ImGui::TableSetupScrollFreeze(0, 1);
  ImGui::TableSetupColumn("Name", ImGuiTableColumnFlags_DefaultSort | ImGuiTableColumnFlags_WidthStretch);
  ImGui::TableSetupColumn("Size", ImGuiTableColumnFlags_WidthFixed, ui.px(70.0f));
  ImGui::TableSetupColumn("Date", ImGuiTableColumnFlags_WidthFixed, ui.px(120.0f));
  ImGui::TableHeadersRow();
  ImGuiTableSortSpecs* const sort = ImGui::TableGetSortSpecs();
  if (sort != nullptr && sort->SpecsCount > 0 && (sort->SpecsDirty || !sorted_)) {
    sort_entries(entries_, static_cast<FolderOrder>(sort->Specs->ColumnIndex),
                 sort->Specs->SortDirection == ImGuiSortDirection_Descending);
    sort->SpecsDirty = false;
    sorted_ = true;
  }
  std::string entered;
  if (const fs::path up = fs::path(folder_).parent_path(); up != folder_) {
    ImGui::TableNextColumn();
    if (Ui::entry("../", entries_.size(), false, ImGuiSelectableFlags_DontClosePopups)) entered = up.string();
    ui.remember("../", "Opens the folder above.");
    ImGui::TableNextRow();
  }
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    const FolderEntry& entry = entries_[i];
    if (!matches(entry.name, search_)) continue;
    const std::string shown = entry.folder ? entry.name + "/" : entry.name;
    const std::string path = (fs::path(folder_) / entry.name).string();
    ImGui::TableNextColumn();
    if (Ui::entry(shown, i, !entry.folder && path == path_,
                  ImGuiSelectableFlags_DontClosePopups | ImGuiSelectableFlags_SpanAllColumns)) {
      if (entry.folder)
        entered = path;
      else
        path_ = path;
    }
    ui.remember(shown.c_str(), entry.folder ? "Opens the folder." : "Selects the file; double-click to open.");
    if (!entry.folder && ImGui::IsItemHovered() && ImGui::IsMouseDoubleClicked(0)) choose(commands);
    ImGui::TableNextColumn();
    ImGui::TextDisabled("%s", entry.size.c_str());
    ImGui::TableNextColumn();
    ImGui::TextDisabled("%s", entry.date.c_str());
  }
  ImGui::EndTable();
  if (entered.empty()) return;
  const std::string name = fs::path(path_).filename().string();
  search_.clear();
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

void FileDialog::draw_trouble(const std::string& endings) const {
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
}

void FileDialog::draw(Ui& ui, const Preferences& preferences, std::vector<Command>& commands) {
  const std::string id = title_ + "###dialog";
  if (opening_ && !open_) ImGui::OpenPopup(id.c_str());
  const ImVec2 screen = ImGui::GetIO().DisplaySize;
  ImGui::SetNextWindowPos({screen.x * 0.5f, screen.y * 0.5f}, ImGuiCond_Always, {0.5f, 0.5f});
  ImGui::SetNextWindowSize({std::min(ui.px(waits() ? 360.0f : 680.0f), screen.x * 0.95f), 0.0f});
  open_ = ImGui::BeginPopupModal(
      id.c_str(), nullptr, ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_AlwaysAutoResize);
  if (!open_) {
    opening_ = false;
    if (waits()) desktop_->close();
    return;
  }
  if (waits())
    draw_waiting(ui, commands);
  else
    draw_own(ui, preferences, commands);
  ImGui::EndPopup();
}

void FileDialog::draw_waiting(Ui& ui, std::vector<Command>& commands) {
  // The own dialog has its focus when it is drawn first, should the desktop's fail.
  ImGui::TextUnformatted("The desktop shows the file dialog.");
  ImGui::Spacing();
  const bool escape = ImGui::IsKeyPressed(ImGui::GetKeyIndex(ImGuiKey_Escape));
  if (ui.button("Close", "Closes the desktop's dialog (Escape).", {ui.px(110.0f), 0.0f}) || escape) {
    desktop_->close();
    close();
  } else if (const auto result = desktop_->take()) {
    take_desktop_result(*result, commands);
  }
}

void FileDialog::draw_own(Ui& ui, const Preferences& preferences, std::vector<Command>& commands) {
  if (opening_) {
    ImGui::SetKeyboardFocusHere();
    places_ = places(preferences.recent);
  }
  opening_ = false;
  const std::string endings = endings_text();
  if (ui.text("Path", ("Full path of the file: " + endings + ". Press Enter to accept.").c_str(),
              saving() ? "File name" : "Type a path or select a file below", path_))
    choose(commands);
  ImGui::Spacing();
  recent(ui, preferences, commands);
  Ui::heading(end_of(folder_, ImGui::GetContentRegionAvail().x).c_str());
  static_cast<void>(ui.text("Search", "Lists only names that contain these words.", "Part of a name", search_));
  ImGui::BeginChild("places", {ui.px(130.0f), ui.px(240.0f)}, true, ImGuiWindowFlags_NavFlattened);
  draw_places(ui);
  ImGui::EndChild();
  ImGui::SameLine();
  list(ui, commands);
  draw_trouble(endings);
  ImGui::Spacing();
  ImGui::BeginDisabled(path_.empty());
  const bool chosen = ui.button(saving() ? "Save file" : "Open file", "Uses the path above.", {ui.px(110.0f), 0.0f});
  ImGui::EndDisabled();
  if (chosen) choose(commands);
  ImGui::SameLine();
  const bool escape = ImGui::IsKeyPressed(ImGui::GetKeyIndex(ImGuiKey_Escape)) && !ImGui::IsAnyItemActive();
  if (ui.button("Cancel##dialog", "Closes the dialog (Escape).", {ui.px(110.0f), 0.0f}) || escape) close();
}

}  // namespace cumulet::demo
