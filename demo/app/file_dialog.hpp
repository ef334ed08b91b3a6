#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "desktop_dialog.hpp"
#include "folder_list.hpp"
#include "model.hpp"
#include "ui.hpp"

namespace cumulet::demo {

/// A modal file dialog: the desktop's own, or else places, a path field and a list of files.
class FileDialog {
 public:
  /// Uses the desktop's dialogs. program: path of cumulet-file-dialog; parent: see DesktopDialog::Request.
  void use_desktop(const std::string& program, std::string parent);
  void use_own() { desktop_.reset(); }
  /// done: the command that receives the path. endings: file extensions that are listed in addition to folders.
  /// suggestion: for saving the initial path, for opening the initial folder.
  void open(const std::string& title, Action done, std::vector<std::string> endings, const std::string& suggestion);
  /// Draws the dialog if it is open. Adds the command when the user has chosen a file.
  void draw(Ui& ui, const Preferences& preferences, std::vector<Command>& commands);
  [[nodiscard]] bool is_open() const { return opening_ || open_; }
  /// Returns true while the desktop's dialog is open. Call draw() repeatedly then.
  [[nodiscard]] bool waits() const { return desktop_ && desktop_->is_open(); }

 private:
  [[nodiscard]] bool saving() const {
    return done_ == Action::save_png || done_ == Action::save_exr || done_ == Action::save_scene_as;
  }
  /// Returns true if the file name has one of the extensions.
  [[nodiscard]] bool takes(const std::string& file) const;
  [[nodiscard]] std::string endings_text() const;
  void enter(const std::string& folder);
  /// Enters a folder, or accepts the file.
  void choose(std::vector<Command>& commands);
  void take_desktop_result(const DesktopDialog::Result& result, std::vector<Command>& commands);
  void draw_waiting(Ui& ui, std::vector<Command>& commands);
  void draw_own(Ui& ui, const Preferences& preferences, std::vector<Command>& commands);
  void draw_places(Ui& ui);
  void list(Ui& ui, std::vector<Command>& commands);
  void recent(Ui& ui, const Preferences& preferences, std::vector<Command>& commands);
  void draw_trouble(const std::string& endings) const;
  void close();

  std::optional<DesktopDialog> desktop_;  // nullopt: own dialogs only
  std::string parent_;
  bool open_ = false;
  bool opening_ = false;
  std::string title_;
  Action done_ = Action::open;
  std::vector<std::string> endings_;
  std::string folder_;
  std::string name_;  // suggested for a new file
  std::string path_;
  std::string search_;
  std::string trouble_;
  std::vector<FolderEntry> entries_;
  bool sorted_ = false;        // entries_ have the order of the table's header
  std::vector<Place> places_;  // when the dialog was opened
};

}  // namespace cumulet::demo
