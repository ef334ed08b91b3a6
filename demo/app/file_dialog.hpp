#pragma once

#include <string>
#include <vector>

#include "model.hpp"
#include "ui.hpp"

namespace cumulet::demo {

/// A modal file dialog: a path field and a folder browser.
class FileDialog {
 public:
  /// done: the command that receives the path. endings: file extensions that are listed in addition to folders.
  /// suggestion: for saving the initial path, for opening the initial folder.
  void open(const std::string& title, Action done, std::vector<std::string> endings, const std::string& suggestion);
  /// Draws the dialog if it is open. Adds the command when the user has chosen a file.
  void draw(Ui& ui, const Preferences& preferences, std::vector<Command>& commands);
  [[nodiscard]] bool is_open() const { return opening_ || open_; }

 private:
  struct Entry {
    std::string name;
    bool folder = false;
  };
  [[nodiscard]] bool saving() const {
    return done_ == Action::save_png || done_ == Action::save_exr || done_ == Action::save_scene_as;
  }
  /// Returns true if the file name has one of the extensions.
  [[nodiscard]] bool takes(const std::string& file) const;
  [[nodiscard]] std::string endings_text() const;
  void enter(const std::string& folder);
  /// Enters a folder, or accepts the file.
  void choose(std::vector<Command>& commands);
  void list(Ui& ui, std::vector<Command>& commands);
  void recent(Ui& ui, const Preferences& preferences, std::vector<Command>& commands);
  void close();

  bool open_ = false;
  bool opening_ = false;
  std::string title_;
  Action done_ = Action::open;
  std::vector<std::string> endings_;
  std::string folder_;
  std::string path_;
  std::string trouble_;
  std::vector<Entry> entries_;
};

}  // namespace cumulet::demo
