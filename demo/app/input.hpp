#pragma once

#include <array>
#include <bitset>
#include <cstdint>
#include <deque>
#include <string>
#include <vector>

namespace cumulet::demo {

/// One thing that happened to the window, from the window system or from a replay file.
struct Event {
  enum class Type { move, button, wheel, key, character, drop, resize, focus_lost };

  Type type = Type::move;
  double x = 0.0;  // move: position in framebuffer pixels; resize: size in the same
  double y = 0.0;  // likewise; wheel: steps
  int code = 0;    // button: 0 left, 1 right, 2 middle (as GLFW has them); key: GLFW's; character: Unicode
  bool down = false;
  std::string path = {};   // drop
  double time = 0.0;       // seconds, glfwGetTime's, at which it was heard of; 0: of a replay
  unsigned modifiers = 0;  // Modifier bits held right after it; Input::take knows
};

enum Modifier : unsigned { modifier_shift = 1, modifier_ctrl = 2, modifier_alt = 4 };  // as in cumulet.h

/// Events wait here until a frame takes them. A frame sees a button or a key change once only, and no change of Ctrl,
/// Shift or Alt after that of another key: a press and a release that came together are seen in two frames, for the
/// user interface looks at states, not at events. Keys that only type are not looked at: any number of them comes at
/// once.
class Input {
 public:
  static constexpr int buttons = 3;
  static constexpr int keys = 512;

  void push(Event event) { queue_.push_back(std::move(event)); }
  [[nodiscard]] bool pending() const { return !queue_.empty(); }
  /// The next frame's events, which are then in the state below.
  [[nodiscard]] std::vector<Event> take();

  [[nodiscard]] double x() const { return x_; }
  [[nodiscard]] double y() const { return y_; }
  [[nodiscard]] bool button(int code) const { return buttons_[static_cast<std::size_t>(code)]; }
  [[nodiscard]] bool any_button() const { return buttons_.any(); }
  [[nodiscard]] bool any_key() const { return keys_.any(); }
  [[nodiscard]] unsigned modifiers() const;

 private:
  std::deque<Event> queue_;
  double x_ = -1e9;  // nowhere yet
  double y_ = -1e9;
  std::bitset<buttons> buttons_;
  std::bitset<keys> keys_;
};

/// "left", "right" and "middle", or -1.
[[nodiscard]] int button_of(const std::string& name);
[[nodiscard]] std::string button_name(int code);
/// A key as replay files and the help spell it: "a", "f1", "ctrl", "kp_5"; -1 if there is none.
[[nodiscard]] int key_of(const std::string& name);
/// "" if it has no name.
[[nodiscard]] std::string key_name(int code);
/// GLFW's key as cumulet.h numbers it, or CUMULET_KEY_NONE.
[[nodiscard]] std::int32_t viewer_key(int code);

}  // namespace cumulet::demo
