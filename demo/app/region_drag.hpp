#pragma once

#include <array>
#include <optional>
#include <variant>

#include "input.hpp"
#include "replay.hpp"

namespace cumulet::demo {

/// A rectangle that a hand draws over the picture with the left button: the part of it that is made from then on.
class RegionDrag {
 public:
  /// The next press in the picture begins one.
  void arm() { state_ = Armed{}; }
  /// Whether there was one to be given up.
  bool cancel();
  /// Whether the event is for it. x, y: where the pointer is, in the window; over_picture: no panel is there.
  bool take(const Event& event, double x, double y, bool over_picture);
  /// In the window, while it is drawn.
  [[nodiscard]] std::optional<Rectangle> drawn() const;
  /// Once the button is up, as cumulet_sampling_desc has it: zeros of one too small to be meant.
  [[nodiscard]] std::optional<std::array<float, 4>> taken(const Rectangle& viewport);

 private:
  struct Armed {};
  struct Drawn {
    double x = 0.0;  // where it began
    double y = 0.0;
    double to_x = 0.0;
    double to_y = 0.0;
    bool ends = false;
  };
  std::variant<std::monostate, Armed, Drawn> state_;
};

}  // namespace cumulet::demo
