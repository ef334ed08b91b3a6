#pragma once

#include <cstdint>
#include <optional>

#include "assets/camera.hpp"

namespace cumulet::viewer {

enum class NavigationStyle { simple = 0, blender = 1, maya = 2 };

struct NavigationSettings {
  NavigationStyle style = NavigationStyle::simple;
  bool fly = false;
  double speed = 1.0;
  double turntable_degrees_per_second = 0.0;
  bool operator==(const NavigationSettings&) const = default;
};

/// cumulet_event with its enums checked; numbers are finite.
struct InputEvent {
  enum class Type { pointer_move, button_down, button_up, wheel, key_down, key_up, focus_lost };
  Type type = Type::pointer_move;
  double x = 0.0;
  double y = 0.0;
  double wheel = 0.0;
  int button = 0;
  int key = 0;
  std::uint32_t modifiers = 0;
};

/// Converts a viewer's input into camera operations. Buttons and keys act only with exactly the modifiers of the style.
/// A drag continues until its own button is released.
///
/// With speed 1, a drag over the image's height orbits by half a turn or looks by a quarter turn. It pans by the height
/// at the target, or dollies by a factor of 10. A wheel step dollies by 1.15.
///
/// Keys in every style: F, Home, keypad '.': fit the subject; arrows: orbit by 15 degrees, with shift: pan by a
/// twentieth; + (or =) and -: dolly as the wheel does. Additional keypad keys of Blender: 1, 3, 7 (ctrl: the opposite
/// view), 5, and 2, 4, 6, 8 as arrows.
class Navigation {
 public:
  /// Ends drags and held keys if style or fly changes.
  void set(const NavigationSettings& settings);
  [[nodiscard]] const NavigationSettings& settings() const { return settings_; }
  /// width, height: of the image, in pixels (0: not known yet). Returns true if the event was used.
  bool input(const InputEvent& event, Camera& camera, double width, double height,
             const std::optional<Subject>& subject);
  /// Applies fly keys and turntable rotation for the elapsed seconds. Returns true if the camera moved.
  bool advance(double seconds, Camera& camera, const std::optional<Bounds>& bounds);
  /// True if advance() would move the camera, so that frames are needed without other changes.
  [[nodiscard]] bool moving() const;
  /// True if the pointer is dragging the camera.
  [[nodiscard]] bool dragging() const { return drag_ != Drag::none; }

 private:
  enum class Drag { none, orbit, pan, dolly, look };

  [[nodiscard]] Drag drag_of(int button, std::uint32_t modifiers) const;
  void drag_by(double dx, double dy, Camera& camera) const;
  bool key_down(const InputEvent& event, Camera& camera, double aspect, const std::optional<Subject>& subject);
  [[nodiscard]] glm::dvec3 fly_direction() const;
  void release();

  NavigationSettings settings_;
  Drag drag_ = Drag::none;
  int drag_button_ = 0;
  double last_x_ = 0.0;
  double last_y_ = 0.0;
  std::uint32_t keys_ = 0;  // held fly keys, by bit
  bool fast_ = false;       // shift was held at the last event
};

}  // namespace cumulet::viewer
