#include "stage/navigation.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string_view>

#include "cumulet/cumulet.h"

namespace cumulet::viewer {

namespace {

constexpr double pi = std::numbers::pi;
constexpr double key_orbit = pi / 12.0;
constexpr double key_pan = 0.05;
constexpr double wheel_step = 1.15;
constexpr double drag_dolly = 10.0;  // factor for a drag over the image's height
constexpr double fly_speed = 0.5;    // fraction of the bounds' diagonal, or of the distance to the target
constexpr double fast_speed = 4.0;
constexpr std::string_view fly_keys = "DAEQWS";  // pairs: right and left, up and down, forward and back
constexpr std::uint32_t none = 0;
constexpr std::uint32_t shift = CUMULET_MODIFIER_SHIFT;
constexpr std::uint32_t ctrl = CUMULET_MODIFIER_CTRL;
constexpr std::uint32_t alt = CUMULET_MODIFIER_ALT;

/// Returns 0 for other keys.
std::uint32_t fly_key(int key) {
  for (std::size_t i = 0; i < fly_keys.size(); ++i) {
    if (fly_keys[i] == key) return 1U << i;
  }
  return 0;
}

/// Positive steps zoom in. The exponent is clamped far beyond the camera's own limits.
void zoom(Camera& camera, double base, double steps) { camera.zoom(std::pow(base, -std::clamp(steps, -400.0, 400.0))); }

/// Blender's keypad views. opposite: ctrl is held.
bool keypad_view(int digit, bool opposite, Camera& camera, const std::optional<Subject>& subject) {
  switch (digit) {
    case 1:
      camera.look_from(opposite ? AxisView::back : AxisView::front);
      return true;
    case 3:
      camera.look_from(opposite ? AxisView::left : AxisView::right);
      return true;
    case 7:
      camera.look_from(opposite ? AxisView::bottom : AxisView::top);
      return true;
    default:
      break;
  }
  if (opposite) return false;
  switch (digit) {
    case 2:
      camera.orbit(0.0, -key_orbit);
      return true;
    case 4:
      camera.orbit(-key_orbit, 0.0);
      return true;
    case 5:
      camera.toggle_orthographic(subject ? std::optional(subject->bounds) : std::nullopt);
      return true;
    case 6:
      camera.orbit(key_orbit, 0.0);
      return true;
    case 8:
      camera.orbit(0.0, key_orbit);
      return true;
    default:
      return false;
  }
}

}  // namespace

void Navigation::set(const NavigationSettings& settings) {
  if (settings.style != settings_.style || settings.fly != settings_.fly) release();
  settings_ = settings;
}

void Navigation::release() {
  drag_ = Drag::none;
  keys_ = 0;
  fast_ = false;
}

Navigation::Drag Navigation::drag_of(int button, std::uint32_t modifiers) const {
  if (settings_.fly) return Drag::look;
  struct Habit {
    NavigationStyle style;
    int button;
    std::uint32_t modifiers;
    Drag drag;
  };
  static constexpr Habit habits[] = {
      {NavigationStyle::simple, CUMULET_BUTTON_LEFT, none, Drag::orbit},
      {NavigationStyle::simple, CUMULET_BUTTON_LEFT, shift, Drag::pan},
      {NavigationStyle::simple, CUMULET_BUTTON_MIDDLE, none, Drag::pan},
      {NavigationStyle::simple, CUMULET_BUTTON_RIGHT, none, Drag::dolly},
      {NavigationStyle::blender, CUMULET_BUTTON_MIDDLE, none, Drag::orbit},
      {NavigationStyle::blender, CUMULET_BUTTON_MIDDLE, shift, Drag::pan},
      {NavigationStyle::blender, CUMULET_BUTTON_MIDDLE, ctrl, Drag::dolly},
      {NavigationStyle::maya, CUMULET_BUTTON_LEFT, alt, Drag::orbit},
      {NavigationStyle::maya, CUMULET_BUTTON_MIDDLE, alt, Drag::pan},
      {NavigationStyle::maya, CUMULET_BUTTON_RIGHT, alt, Drag::dolly},
  };
  for (const Habit& habit : habits) {
    if (habit.style == settings_.style && habit.button == button && habit.modifiers == modifiers) return habit.drag;
  }
  return Drag::none;
}

/// dx, dy: fractions of the image's height, y down.
void Navigation::drag_by(double dx, double dy, Camera& camera) const {
  const double right = dx * settings_.speed;
  const double down = dy * settings_.speed;
  switch (drag_) {
    case Drag::none:
      break;
    case Drag::orbit:
      camera.orbit(-right * pi, down * pi);
      break;
    case Drag::pan:
      camera.pan(right, -down);
      break;
    case Drag::dolly:  // Maya also dollies in for a drag to the right
      zoom(camera, drag_dolly, (settings_.style == NavigationStyle::maya ? right : 0.0) - down);
      break;
    case Drag::look:
      camera.look(-right * pi / 2.0, -down * pi / 2.0);
      break;
  }
}

bool Navigation::input(const InputEvent& event, Camera& camera, double width, double height,
                       const std::optional<Subject>& subject) {
  fast_ = (event.modifiers & shift) != 0;
  const bool sized = width > 0.0 && height > 0.0;
  switch (event.type) {
    case InputEvent::Type::button_down: {
      if (drag_ != Drag::none && drag_button_ != event.button) return false;
      drag_ = drag_of(event.button, event.modifiers & (shift | ctrl | alt));
      drag_button_ = event.button;
      last_x_ = event.x;
      last_y_ = event.y;
      return drag_ != Drag::none;
    }
    case InputEvent::Type::pointer_move:
    case InputEvent::Type::button_up: {
      const bool up = event.type == InputEvent::Type::button_up;
      if (drag_ == Drag::none || (up && drag_button_ != event.button)) return false;
      const double dx = event.x - last_x_;
      const double dy = event.y - last_y_;
      last_x_ = event.x;
      last_y_ = event.y;
      const Drag drag = drag_;
      if (sized) drag_by(dx / height, dy / height, camera);
      if (up) drag_ = Drag::none;
      return drag != Drag::none;
    }
    case InputEvent::Type::wheel:
      if (event.wheel == 0.0) return false;
      zoom(camera, wheel_step, event.wheel * settings_.speed);
      return true;
    case InputEvent::Type::key_down:
      return key_down(event, camera, sized ? width / height : 1.0, subject);
    case InputEvent::Type::key_up: {
      const std::uint32_t bit = keys_ & fly_key(event.key);
      keys_ &= ~bit;
      return bit != 0;
    }
    case InputEvent::Type::focus_lost: {
      const bool held = drag_ != Drag::none || keys_ != 0;
      release();
      return held;
    }
  }
  return false;
}

bool Navigation::key_down(const InputEvent& event, Camera& camera, double aspect,
                          const std::optional<Subject>& subject) {
  const bool keypad = event.key >= CUMULET_KEY_KEYPAD_0 && event.key <= CUMULET_KEY_KEYPAD_0 + 9;
  if (keypad && settings_.style == NavigationStyle::blender && (event.modifiers & (shift | alt)) == 0) {
    return keypad_view(event.key - CUMULET_KEY_KEYPAD_0, (event.modifiers & ctrl) != 0, camera, subject);
  }
  if ((event.modifiers & (ctrl | alt)) != 0) return false;
  if (settings_.fly) {
    const std::uint32_t bit = fly_key(event.key);
    keys_ |= bit;
    if (bit != 0) return true;
  }
  const auto arrow = [&](int right, int up) {
    if ((event.modifiers & shift) != 0) {
      camera.pan(-right * key_pan, -up * key_pan);
    } else {
      camera.orbit(right * key_orbit, up * key_orbit);
    }
    return true;
  };
  switch (event.key) {
    case 'F':
    case CUMULET_KEY_HOME:
    case CUMULET_KEY_KEYPAD_PERIOD:
      if (subject) camera.fit(*subject, aspect);
      return subject.has_value();
    case CUMULET_KEY_LEFT:
      return arrow(-1, 0);
    case CUMULET_KEY_RIGHT:
      return arrow(1, 0);
    case CUMULET_KEY_UP:
      return arrow(0, 1);
    case CUMULET_KEY_DOWN:
      return arrow(0, -1);
    case '+':
    case '=':
      zoom(camera, wheel_step, 1.0);
      return true;
    case '-':
      zoom(camera, wheel_step, -1.0);
      return true;
    default:
      return false;
  }
}

glm::dvec3 Navigation::fly_direction() const {
  glm::dvec3 way(0.0);
  if (!settings_.fly) return way;
  for (int axis = 0; axis < 3; ++axis) {
    way[axis] = static_cast<int>((keys_ >> (2 * axis)) & 1U) - static_cast<int>((keys_ >> (2 * axis + 1)) & 1U);
  }
  const double length = glm::length(way);
  return length > 0.0 ? way / length : way;
}

bool Navigation::advance(double seconds, Camera& camera, const std::optional<Bounds>& bounds) {
  if (!(seconds > 0.0) || !moving()) return false;
  const std::uint64_t before = camera.revision();
  const glm::dvec3 way = fly_direction();
  if (way != glm::dvec3(0.0)) {
    double reach = bounds ? glm::length(bounds->max - bounds->min) : 0.0;
    if (!(reach > 0.0)) {
      const CameraPose pose = camera.pose();
      reach = glm::length(pose.target - pose.eye);
    }
    const double step = fly_speed * settings_.speed * (fast_ ? fast_speed : 1.0) * reach * seconds;
    camera.fly(step * way.x, step * way.y, step * way.z);
  }
  camera.orbit(settings_.turntable_degrees_per_second * pi / 180.0 * seconds, 0.0);
  return camera.revision() != before;
}

bool Navigation::moving() const {
  return settings_.turntable_degrees_per_second != 0.0 || fly_direction() != glm::dvec3(0.0);
}

}  // namespace cumulet::viewer
