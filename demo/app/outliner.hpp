#pragma once

#include <optional>
#include <string>
#include <vector>

#include "model.hpp"
#include "ui.hpp"

namespace cumulet::demo {

/// The list of all parts and objects of the scene. A click selects the subject of the inspector. Ctrl+click,
/// Shift+click and a box that is dragged from an empty place select several objects. Objects have an eye, which hides
/// them, and a context menu; a double click renames them, and a drag changes their order within their kind.
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
  struct Row {
    Item item;
    float top;  // on the screen
    float bottom;
  };

  void part(Model& model, Part part, const char* label, const char* tip);
  void item(Model& model, const Item& item, std::vector<Command>& commands);
  void click(Model& model, const Item& item);
  // Lets the last drawn row be dragged to another row, and others to it.
  void drag(const Item& item);
  void drag_box(Model& model);
  // Draws the row of a kind of objects, with a button that adds one.
  void group(const char* label, const char* control, const char* tip, Action add, std::vector<Command>& commands);
  // Draws a row and returns true if it was clicked. room: width at the right for another control.
  bool row(const std::string& control, const char* tip, const std::string& text, const Subject& subject,
           const Model& model, float room);
  // Returns true if the eye was clicked.
  bool eye(const std::string& control, bool visible);
  void context_menu(const Item& item, std::vector<Command>& commands);
  void name_field(Model& model, const Item& item);

  Ui& ui_;
  std::vector<Item> selected_;  // of the current frame
  std::vector<Row> rows_;       // of the objects, from top to bottom
  std::vector<Row> last_rows_;  // in the last frame
  std::optional<float> box_;    // position at which the drag of a box began
  struct Drop {
    Item from;
    Item to;
  };
  std::optional<Drop> drop_;     // of the current frame
  std::optional<Item> renamed_;  // while its name is typed
  std::string name_;
};

}  // namespace cumulet::demo
