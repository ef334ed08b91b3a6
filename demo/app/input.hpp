#pragma once

#include <array>
#include <bitset>
#include <cstdint>
#include <deque>
#include <string>
#include <vector>

namespace cumulet::demo {

/// A window event, from the window system or from a replay file.
struct Event {
  enum class Type { move, button, wheel, key, character, drop, resize, focus_lost, close };

  Type type = Type::move;
  double x = 0.0;  // move: position in framebuffer pixels; resize: width in framebuffer pixels
  double y = 0.0;  // move: position; resize: height; wheel: steps
  int code = 0;    // button: 0 left, 1 right, 2 middle (GLFW's numbers); key: GLFW key; character: Unicode
  bool down = false;
  std::vector<std::string> files = {};  // drop: their paths
  double time = 0.0;                    // glfwGetTime() when the event was received; 0 in a replay
  unsigned modifiers = 0;               // Modifier bits after the event; set by Input::take
};

enum Modifier : unsigned { modifier_shift = 1, modifier_ctrl = 2, modifier_alt = 4 };  // same values as in cumulet.h

/// Queue of events. Dear ImGui polls states, so a frame gets at most one change of each button and key: a press and
/// release that arrive together are split into two frames. A change of Ctrl, Shift or Alt after another key waits for
/// the next frame too. Keys that only type characters are not limited.
class Input {
 public:
  static constexpr int buttons = 3;
  static constexpr int keys = 512;

  void push(Event event) { queue_.push_back(std::move(event)); }
  [[nodiscard]] bool pending() const { return !queue_.empty(); }
  /// Returns the events of the next frame and updates the state below.
  [[nodiscard]] std::vector<Event> take();

  [[nodiscard]] double x() const { return x_; }
  [[nodiscard]] double y() const { return y_; }
  [[nodiscard]] bool button(int code) const { return buttons_[static_cast<std::size_t>(code)]; }
  [[nodiscard]] bool any_button() const { return buttons_.any(); }
  [[nodiscard]] bool any_key() const { return keys_.any(); }
  [[nodiscard]] unsigned modifiers() const;

 private:
  std::deque<Event> queue_;
  double x_ = -1e9;  // no position yet
  double y_ = -1e9;
  std::bitset<buttons> buttons_;
  std::bitset<keys> keys_;
};

/// Parses "left", "right" or "middle"; -1 if it is none of them.
[[nodiscard]] int button_of(const std::string& name);
[[nodiscard]] std::string button_name(int code);
/// Parses a key name of replay files and the help: "a", "f1", "ctrl", "kp_5"; -1 if there is none.
[[nodiscard]] int key_of(const std::string& name);
/// Returns the name of a key; "" if it has none.
[[nodiscard]] std::string key_name(int code);
/// Converts a GLFW key to the number in cumulet.h; CUMULET_KEY_NONE if there is none.
[[nodiscard]] std::int32_t viewer_key(int code);

}  // namespace cumulet::demo
