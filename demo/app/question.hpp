#pragma once

#include <optional>
#include <string>
#include <vector>

#include "model.hpp"
#include "ui.hpp"

namespace cumulet::demo {

/// A modal question with a button per answer.
class Question {
 public:
  struct Answer {
    const char* label;
    const char* tip;
    std::optional<Command> command;  // nullopt: the answer has no effect
  };

  /// Opens the question. Enter gives the first answer, and Escape the last one.
  void ask(const std::string& title, const std::string& text, std::vector<Answer> answers);
  /// Draws the question if it is open. Adds the command of the given answer.
  void draw(Ui& ui, std::vector<Command>& commands);
  [[nodiscard]] bool is_open() const { return opening_ || open_; }
  [[nodiscard]] const std::string& title() const { return title_; }

 private:
  bool opening_ = false;
  bool open_ = false;
  std::string title_;
  std::string text_;
  std::vector<Answer> answers_;
};

}  // namespace cumulet::demo
