#include "region_drag.hpp"

#include <algorithm>
#include <cmath>

namespace cumulet::demo {

bool RegionDrag::cancel() {
  const bool was = !std::holds_alternative<std::monostate>(state_);
  state_ = std::monostate{};
  return was;
}

bool RegionDrag::take(const Event& event, double x, double y, bool over_picture) {
  const bool left = event.type == Event::Type::button && event.code == 0;
  if (std::holds_alternative<Armed>(state_) && left && event.down && over_picture) {
    state_ = Drawn{x, y, x, y};
    return true;
  }
  auto* drawn = std::get_if<Drawn>(&state_);
  if (drawn == nullptr) return false;
  if (event.type == Event::Type::focus_lost) {
    cancel();
    return false;
  }
  if (event.type != Event::Type::move && !left) return false;
  drawn->to_x = x;
  drawn->to_y = y;
  drawn->ends = left && !event.down;
  return true;
}

std::optional<Rectangle> RegionDrag::drawn() const {
  const auto* drawn = std::get_if<Drawn>(&state_);
  if (drawn == nullptr) return std::nullopt;
  return Rectangle{std::min(drawn->x, drawn->to_x), std::min(drawn->y, drawn->to_y), std::abs(drawn->to_x - drawn->x),
                   std::abs(drawn->to_y - drawn->y)};
}

std::optional<std::array<float, 4>> RegionDrag::taken(const Rectangle& viewport) {
  constexpr double least = 4.0;  // pixels
  const auto* drawn = std::get_if<Drawn>(&state_);
  if (drawn == nullptr || !drawn->ends) return std::nullopt;
  const Rectangle of = *this->drawn();
  state_ = std::monostate{};
  std::array<float, 4> region{};
  if (of.width < least || of.height < least || !(viewport.width > 0.0) || !(viewport.height > 0.0)) return region;
  const auto part = [](double at, double begin, double size) { return std::clamp((at - begin) / size, 0.0, 1.0); };
  const double left = part(of.x, viewport.x, viewport.width);
  const double top = part(of.y, viewport.y, viewport.height);
  const double right = part(of.x + of.width, viewport.x, viewport.width);
  const double bottom = part(of.y + of.height, viewport.y, viewport.height);
  if (right > left && bottom > top)
    region = {static_cast<float>(left), static_cast<float>(top), static_cast<float>(right - left),
              static_cast<float>(bottom - top)};
  return region;
}

}  // namespace cumulet::demo
