#pragma once

#include <string>
#include <vector>

#include "model.hpp"
#include "ui.hpp"

namespace cumulet::demo {

/// A small modal window: a path to type, and a folder to walk through.
class FileDialog {
 public:
  /// done: the command that gets the path. endings: what is listed besides folders. A path to save to starts with
  /// suggestion; to open, it is the folder to begin in.
  void open(const std::string& title, Action done, std::vector<std::string> endings, const std::string& suggestion);
  /// Draws it, if it is open, and adds its command once the user has chosen.
  void draw(Ui& ui, const Preferences& preferences, std::vector<Command>& commands);
  [[nodiscard]] bool is_open() const { return open_; }

 private:
  struct Entry {
    std::string name;
    bool folder = false;
  };
  [[nodiscard]] bool saving() const {
    return done_ == Action::save_png || done_ == Action::save_exr || done_ == Action::save_scene_as;
  }
  /// Whether the file's name has one of the endings.
  [[nodiscard]] bool takes(const std::string& file) const;
  [[nodiscard]] std::string endings_text() const;
  void enter(const std::string& folder);
  /// Opens a folder, or takes the file.
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
