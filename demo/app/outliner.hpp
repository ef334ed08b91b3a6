#pragma once

#include <optional>
#include <string>
#include <vector>

#include "model.hpp"
#include "ui.hpp"

namespace cumulet::demo {

/// The list of all parts and objects of the scene. A click selects the subject of the inspector. Objects have an eye,
/// which hides them, and a context menu; a double click renames them.
class Outliner {
 public:
  /// ui must outlive it.
  explicit Outliner(Ui& ui) : ui_(ui) {}
  Outliner(const Outliner&) = delete;
  Outliner& operator=(const Outliner&) = delete;
  ~Outliner() = default;

  /// Draws the list. max_height: in pixels; longer lists scroll. focus: gives it the keyboard focus.
  void draw(Model& model, float max_height, bool focus, std::vector<Command>& commands);

 private:
  void part(Model& model, Part part, const char* label, const char* tip);
  void item(Model& model, const Item& item, std::vector<Command>& commands);
  void surfaces(Model& model, std::vector<Command>& commands);
  // Draws the row of a kind of objects, with a button that adds one.
  void group(const char* label, const char* control, const char* tip, Action add, std::vector<Command>& commands);
  // Draws a row and returns true if it was clicked. room: width at the right for another control.
  bool row(const std::string& control, const char* tip, const std::string& text, const Subject& subject,
           const Model& model, float room);
  void eye(const std::string& control, bool& visible);
  void context_menu(const Item& item, std::vector<Command>& commands);
  void name_field(Model& model, const Item& item);

  Ui& ui_;
  std::optional<Item> renamed_;  // while its name is typed
  std::string name_;
};

}  // namespace cumulet::demo
