#pragma once

#include <array>
#include <optional>
#include <variant>

#include "input.hpp"
#include "replay.hpp"

namespace cumulet::demo {

/// A rectangle that the user drags over the image with the left button. It becomes the render region.
class RegionDrag {
 public:
  /// Starts waiting for a press in the image.
  void arm() { state_ = Armed{}; }
  /// Cancels. Returns true if a drag was pending.
  bool cancel();
  /// Handles an event; returns true if it belongs to the drag. x, y: pointer position in the window. over_picture: the
  /// pointer is not over a panel.
  bool take(const Event& event, double x, double y, bool over_picture);
  /// Returns the rectangle in window coordinates during the drag.
  [[nodiscard]] std::optional<Rectangle> drawn() const;
  /// Returns the region after the button is released, as in cumulet_sampling_desc. All zeros (no region) if the
  /// rectangle is too small.
  [[nodiscard]] std::optional<std::array<float, 4>> taken(const Rectangle& viewport);

 private:
  struct Armed {};
  struct Drawn {
    double x = 0.0;  // start of the drag
    double y = 0.0;
    double to_x = 0.0;
    double to_y = 0.0;
    bool ends = false;
  };
  std::variant<std::monostate, Armed, Drawn> state_;
};

}  // namespace cumulet::demo
