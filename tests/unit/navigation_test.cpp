// Mouse and keyboard navigation of the camera in every style.

#include "assets/camera.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "cumulet/cumulet.h"
#include "stage/navigation.hpp"
#include "support/camera_poses.hpp"

namespace {

using cumulet::test::angle;
using cumulet::test::distance;
using cumulet::test::elevation;
using cumulet::test::expect_near;
using cumulet::test::forward;
using cumulet::test::pose_at;
using cumulet::test::project;
using cumulet::test::widest;
using cumulet::viewer::Bounds;
using cumulet::viewer::Camera;
using cumulet::viewer::CameraPose;
using cumulet::viewer::InputEvent;
using cumulet::viewer::Navigation;
using cumulet::viewer::NavigationSettings;
using cumulet::viewer::NavigationStyle;
using cumulet::viewer::ViewFrame;
using glm::dvec2;
using glm::dvec3;

constexpr double pi = std::numbers::pi;

constexpr std::uint32_t shift = CUMULET_MODIFIER_SHIFT;
constexpr std::uint32_t ctrl = CUMULET_MODIFIER_CTRL;
constexpr std::uint32_t alt = CUMULET_MODIFIER_ALT;
constexpr double width = 800.0;
constexpr double height = 400.0;

/// An image of 800 x 400 pixels with a box of 4 x 4 x 2, seen from +Z at a distance of 10.
struct Session {
  explicit Session(NavigationStyle style = NavigationStyle::simple, bool fly = false) {
    NavigationSettings settings;
    settings.style = style;
    settings.fly = fly;
    navigation.set(settings);
  }
  bool send(const InputEvent& event) { return navigation.input(event, camera, width, height, bounds); }
  bool down(int button, double x, double y, std::uint32_t modifiers = 0) {
    return send({InputEvent::Type::button_down, x, y, 0.0, button, 0, modifiers});
  }
  bool move(double x, double y, std::uint32_t modifiers = 0) {
    return send({InputEvent::Type::pointer_move, x, y, 0.0, 0, 0, modifiers});
  }
  bool up(int button, double x, double y, std::uint32_t modifiers = 0) {
    return send({InputEvent::Type::button_up, x, y, 0.0, button, 0, modifiers});
  }
  bool wheel(double steps) { return send({InputEvent::Type::wheel, 0.0, 0.0, steps, 0, 0, 0}); }
  bool press(int key, std::uint32_t modifiers = 0) {
    return send({InputEvent::Type::key_down, 0.0, 0.0, 0.0, 0, key, modifiers});
  }
  bool lift(int key, std::uint32_t modifiers = 0) {
    return send({InputEvent::Type::key_up, 0.0, 0.0, 0.0, 0, key, modifiers});
  }
  bool lose_focus() { return send({InputEvent::Type::focus_lost, 0.0, 0.0, 0.0, 0, 0, 0}); }
  bool advance(double seconds) { return navigation.advance(seconds, camera, bounds); }
  [[nodiscard]] dvec3 eye() const { return camera.pose().eye; }
  [[nodiscard]] dvec3 target() const { return camera.pose().target; }

  Camera camera{pose_at({0, 0, 10})};
  Navigation navigation;
  std::optional<Bounds> bounds = Bounds{dvec3(-2, -2, -1), dvec3(2, 2, 1)};
};

enum class Motion { none, orbit, pan, dolly, look };

/// The camera motion caused by a short drag with this button and these modifiers.
Motion motion_of(NavigationStyle style, bool fly, int button, std::uint32_t modifiers) {
  Session session(style, fly);
  const bool began = session.down(button, 400, 200, modifiers);
  EXPECT_EQ(session.move(420, 215, modifiers), began);
  EXPECT_EQ(session.up(button, 420, 215, modifiers), began);
  EXPECT_FALSE(session.move(500, 300));
  const bool eye = session.eye() != dvec3(0, 0, 10);
  const bool target = session.target() != dvec3(0);
  const bool far = std::abs(distance(session.camera.pose()) - 10.0) > 1e-9;
  if (far) return eye && !target ? Motion::dolly : Motion::none;
  if (eye && target) return Motion::pan;
  if (eye) return Motion::orbit;
  return target ? Motion::look : Motion::none;
}

TEST(Navigation, ButtonsFollowTheNavigationStyle) {
  for (const auto style : {NavigationStyle::simple, NavigationStyle::blender, NavigationStyle::maya}) {
    for (const int button : {CUMULET_BUTTON_LEFT, CUMULET_BUTTON_MIDDLE, CUMULET_BUTTON_RIGHT}) {
      for (std::uint32_t modifiers = 0; modifiers < 8; ++modifiers) {
        const auto is = [&](NavigationStyle s, int b, std::uint32_t m) {
          return style == s && button == b && modifiers == m;
        };
        Motion expected = Motion::none;
        if (is(NavigationStyle::simple, CUMULET_BUTTON_LEFT, 0)) expected = Motion::orbit;
        if (is(NavigationStyle::simple, CUMULET_BUTTON_LEFT, shift)) expected = Motion::pan;
        if (is(NavigationStyle::simple, CUMULET_BUTTON_MIDDLE, 0)) expected = Motion::pan;
        if (is(NavigationStyle::simple, CUMULET_BUTTON_RIGHT, 0)) expected = Motion::dolly;
        if (is(NavigationStyle::blender, CUMULET_BUTTON_MIDDLE, 0)) expected = Motion::orbit;
        if (is(NavigationStyle::blender, CUMULET_BUTTON_MIDDLE, shift)) expected = Motion::pan;
        if (is(NavigationStyle::blender, CUMULET_BUTTON_MIDDLE, ctrl)) expected = Motion::dolly;
        if (is(NavigationStyle::maya, CUMULET_BUTTON_LEFT, alt)) expected = Motion::orbit;
        if (is(NavigationStyle::maya, CUMULET_BUTTON_MIDDLE, alt)) expected = Motion::pan;
        if (is(NavigationStyle::maya, CUMULET_BUTTON_RIGHT, alt)) expected = Motion::dolly;
        EXPECT_EQ(motion_of(style, false, button, modifiers), expected)
            << static_cast<int>(style) << " button " << button << " modifiers " << modifiers;
        EXPECT_EQ(motion_of(style, true, button, modifiers), Motion::look);
      }
    }
  }
}

TEST(Navigation, DragsRotateTheSceneWithThePointer) {
  Session session;
  session.down(CUMULET_BUTTON_LEFT, 100, 200);
  session.move(300, 200);  // right by half the height: the scene's front goes right, the eye left
  expect_near(session.eye(), {-10, 0, 0}, 1e-9);
  session.move(300, 200 + height / 6);  // down: the eye rises
  EXPECT_NEAR(elevation(session.camera.pose()), pi / 6, 1e-9);
  session.up(CUMULET_BUTTON_LEFT, 100, 200 + height / 6);  // the position of the button release counts too
  EXPECT_NEAR(session.eye().x, 0.0, 1e-9);
  EXPECT_NEAR(session.eye().z, 10 * std::cos(pi / 6), 1e-9);

  Session in_two;
  in_two.down(CUMULET_BUTTON_RIGHT, 400, 300);
  in_two.move(400, 250);
  in_two.move(400, 100);  // up by half the height: nearer by a factor of the square root of 10
  EXPECT_NEAR(distance(in_two.camera.pose()), 10.0 / std::sqrt(10.0), 1e-9);

  Session maya(NavigationStyle::maya);
  maya.down(CUMULET_BUTTON_RIGHT, 400, 300, alt);
  maya.move(500, 300, alt);  // right dollies in as well
  EXPECT_LT(distance(maya.camera.pose()), 9.0);

  Session fly(NavigationStyle::simple, true);
  fly.down(CUMULET_BUTTON_LEFT, 400, 200);
  fly.move(600, 200);  // right: the view direction follows
  EXPECT_GT(fly.target().x, 1.0);
  fly.move(600, 100);  // up
  EXPECT_GT(fly.target().y, 1.0);
  EXPECT_EQ(fly.eye(), dvec3(0, 0, 10));
}

TEST(Navigation, PanKeepsThePointUnderThePointer) {
  for (const double orthographic_height : {0.0, 3.0}) {
    Session session;
    CameraPose pose = pose_at({3, 4, 10}, {1, 0, 0});
    pose.orthographic_height = orthographic_height;
    session.camera.set(pose);
    const ViewFrame frame = session.camera.view(width / height, std::nullopt);
    const double far = orthographic_height > 0.0 ? 1.0 : distance(pose);
    const dvec3 p = pose.target + far * (0.25 * frame.right - 0.5 * frame.up);  // at pixel 500, 300
    session.down(CUMULET_BUTTON_MIDDLE, 500, 300);
    for (const dvec2 pixel : {dvec2(510, 290), dvec2(350, 20), dvec2(-40, 390.5)}) {
      session.move(pixel.x, pixel.y);
      const dvec3 at = project(session.camera, p, width / height);
      EXPECT_NEAR((at.x + 1.0) / 2.0 * width, pixel.x, 1e-6);
      EXPECT_NEAR((1.0 - at.y) / 2.0 * height, pixel.y, 1e-6);
    }
  }
}

TEST(Navigation, DragEndsWhenItsButtonIsReleased) {
  Session session;
  EXPECT_FALSE(session.move(10, 10));
  EXPECT_FALSE(session.up(CUMULET_BUTTON_LEFT, 10, 10));
  EXPECT_EQ(session.camera.revision(), 1U);
  EXPECT_TRUE(session.down(CUMULET_BUTTON_LEFT, 100, 100));
  EXPECT_FALSE(session.down(CUMULET_BUTTON_RIGHT, 120, 100));
  EXPECT_FALSE(session.down(CUMULET_BUTTON_MIDDLE, 120, 100));
  EXPECT_TRUE(session.move(150, 100, shift));  // still an orbit, whichever buttons and keys are held
  EXPECT_FALSE(session.up(CUMULET_BUTTON_RIGHT, 150, 100));
  EXPECT_TRUE(session.move(200, 100));
  expect_near(session.eye(), {-10 * std::sin(pi / 4), 0, 10 * std::cos(pi / 4)}, 1e-9);
  EXPECT_TRUE(session.up(CUMULET_BUTTON_LEFT, 200, 100));
  EXPECT_FALSE(session.move(300, 300));
  EXPECT_FALSE(session.up(CUMULET_BUTTON_MIDDLE, 300, 300));
  // In Maya's style alt may be released first.
  Session maya(NavigationStyle::maya);
  maya.down(CUMULET_BUTTON_LEFT, 100, 100, alt);
  EXPECT_TRUE(maya.move(120, 100));
  EXPECT_TRUE(maya.up(CUMULET_BUTTON_LEFT, 120, 100));
  // A second press of the button (its release was lost) starts a new drag without a jump.
  maya.down(CUMULET_BUTTON_LEFT, 100, 100, alt);
  const dvec3 eye = maya.eye();
  EXPECT_TRUE(maya.down(CUMULET_BUTTON_LEFT, 700, 100, alt));
  EXPECT_EQ(maya.eye(), eye);
  maya.move(700, 100);
  EXPECT_EQ(maya.eye(), eye);
}

TEST(Navigation, FocusLossReleasesButtonsAndKeys) {
  Session session(NavigationStyle::simple, true);
  EXPECT_FALSE(session.lose_focus());
  session.press('W', shift);
  session.down(CUMULET_BUTTON_LEFT, 100, 100, shift);
  EXPECT_TRUE(session.navigation.moving());
  EXPECT_TRUE(session.lose_focus());
  EXPECT_FALSE(session.navigation.moving());
  EXPECT_FALSE(session.advance(1.0));
  EXPECT_FALSE(session.move(300, 300));
  EXPECT_FALSE(session.lift('W'));
  EXPECT_FALSE(session.up(CUMULET_BUTTON_LEFT, 300, 300));
  EXPECT_EQ(session.camera.revision(), 1U);
}

TEST(Navigation, ChangingTheStyleEndsTheCurrentDrag) {
  Session session(NavigationStyle::simple, true);
  session.press('W');
  session.down(CUMULET_BUTTON_LEFT, 100, 100);
  NavigationSettings settings = session.navigation.settings();
  settings.speed = 2.0;
  session.navigation.set(settings);  // only the speed changed: the drag continues
  EXPECT_TRUE(session.navigation.moving());
  EXPECT_TRUE(session.move(110, 100));
  settings.fly = false;
  session.navigation.set(settings);
  EXPECT_FALSE(session.navigation.moving());
  EXPECT_FALSE(session.move(120, 100));
}

TEST(Navigation, WheelStepsMayBeFractional) {
  Session session;
  EXPECT_TRUE(session.wheel(1.0));
  const double step = 10.0 / distance(session.camera.pose());
  EXPECT_GT(step, 1.1);
  EXPECT_LT(step, 1.2);
  for (int i = 0; i < 10; ++i) session.wheel(-0.1);
  EXPECT_NEAR(distance(session.camera.pose()), 10.0, 1e-9);
  EXPECT_FALSE(session.wheel(0.0));
  session.wheel(1e300);
  EXPECT_GT(distance(session.camera.pose()), 0.0);
  session.wheel(-1e300);
  EXPECT_LT(distance(session.camera.pose()), 1e13);

  CameraPose pose = pose_at({0, 0, 10});
  pose.orthographic_height = 4.0;
  session.camera.set(pose);
  session.wheel(1.0);
  EXPECT_NEAR(session.camera.pose().orthographic_height, 4.0 / step, 1e-9);
  EXPECT_EQ(session.eye(), dvec3(0, 0, 10));
}

TEST(Navigation, SpeedScalesEveryMotion) {
  NavigationSettings settings;
  settings.speed = 0.5;
  Session session;
  session.navigation.set(settings);
  session.down(CUMULET_BUTTON_LEFT, 0, 0);
  session.up(CUMULET_BUTTON_LEFT, -height, 0);
  expect_near(session.eye(), {10, 0, 0}, 1e-9);
  Session half;
  half.navigation.set(settings);
  Session whole;
  half.wheel(2.0);
  whole.wheel(1.0);
  expect_near(half.eye(), whole.eye(), 1e-12);
}

TEST(Navigation, DragsWithoutAnImageSizeMoveNothing) {
  Session session;
  session.down(CUMULET_BUTTON_LEFT, 0, 0);
  const InputEvent move{InputEvent::Type::pointer_move, 50, 50, 0.0, 0, 0, 0};
  EXPECT_TRUE(session.navigation.input(move, session.camera, 0.0, 0.0, session.bounds));
  EXPECT_EQ(session.camera.revision(), 1U);
  EXPECT_TRUE(session.press('F'));
  session.navigation.input({InputEvent::Type::key_down, 0, 0, 0, 0, 'F', 0}, session.camera, 0.0, 0.0, session.bounds);
  EXPECT_NEAR(widest(session.camera, *session.bounds, 1.0), 0.88, 1e-9);
}

TEST(Navigation, FrameAllKeysWork) {
  for (const auto style : {NavigationStyle::simple, NavigationStyle::blender, NavigationStyle::maya}) {
    for (const bool fly : {false, true}) {
      for (const int key :
           {static_cast<int>('F'), static_cast<int>(CUMULET_KEY_HOME), static_cast<int>(CUMULET_KEY_KEYPAD_PERIOD)}) {
        Session session(style, fly);
        session.camera.set(pose_at({30, 40, 100}, {30, 0, 0}));
        const dvec3 ahead = forward(session.camera.pose());
        EXPECT_TRUE(session.press(key));
        EXPECT_NEAR(widest(session.camera, *session.bounds, width / height), 0.88, 1e-9);
        EXPECT_LT(angle(forward(session.camera.pose()), ahead), 1e-9);
        session.lift(key);
        EXPECT_FALSE(session.press(key, ctrl));  // a host's own shortcut
        EXPECT_FALSE(session.press(key, alt));
        session.bounds.reset();
        const std::uint64_t before = session.camera.revision();
        EXPECT_FALSE(session.press(key));
        EXPECT_EQ(session.camera.revision(), before);
      }
    }
  }
}

TEST(Navigation, ArrowPlusAndMinusKeysWorkInEveryStyle) {
  for (const auto style : {NavigationStyle::simple, NavigationStyle::blender, NavigationStyle::maya}) {
    for (const bool fly : {false, true}) {
      Session session(style, fly);
      for (int i = 0; i < 6; ++i) EXPECT_TRUE(session.press(CUMULET_KEY_RIGHT));
      expect_near(session.eye(), {10, 0, 0}, 1e-9);
      for (int i = 0; i < 6; ++i) EXPECT_TRUE(session.press(CUMULET_KEY_LEFT));
      expect_near(session.eye(), {0, 0, 10}, 1e-9);
      EXPECT_TRUE(session.press(CUMULET_KEY_UP));
      EXPECT_NEAR(elevation(session.camera.pose()), pi / 12, 1e-9);
      EXPECT_TRUE(session.press(CUMULET_KEY_DOWN));
      EXPECT_TRUE(session.press(CUMULET_KEY_DOWN));
      EXPECT_NEAR(elevation(session.camera.pose()), -pi / 12, 1e-9);
      EXPECT_TRUE(session.press(CUMULET_KEY_UP));
      EXPECT_TRUE(session.press(CUMULET_KEY_RIGHT, shift));
      EXPECT_GT(session.target().x, 0.1);
      EXPECT_TRUE(session.press(CUMULET_KEY_LEFT, shift));
      EXPECT_TRUE(session.press(CUMULET_KEY_UP, shift));
      EXPECT_GT(session.target().y, 0.1);
      EXPECT_NEAR(distance(session.camera.pose()), 10.0, 1e-9);
      EXPECT_TRUE(session.press('='));
      EXPECT_LT(distance(session.camera.pose()), 9.0);
      EXPECT_TRUE(session.press('-'));
      EXPECT_NEAR(distance(session.camera.pose()), 10.0, 1e-9);
      EXPECT_TRUE(session.press('+', shift));
      EXPECT_LT(distance(session.camera.pose()), 9.0);
      EXPECT_FALSE(session.press(CUMULET_KEY_RIGHT, ctrl));
      EXPECT_FALSE(session.press('Z'));
      EXPECT_FALSE(session.press(CUMULET_KEY_NONE));
    }
  }
}

TEST(Navigation, KeypadViewsMatchBlender) {
  const auto key = [](int digit) { return CUMULET_KEY_KEYPAD_0 + digit; };
  for (const auto style : {NavigationStyle::simple, NavigationStyle::maya}) {
    Session session(style);
    for (int digit = 0; digit < 10; ++digit) EXPECT_FALSE(session.press(key(digit)));
    EXPECT_EQ(session.camera.revision(), 1U);
  }
  Session session(NavigationStyle::blender);
  session.press(CUMULET_KEY_UP);
  session.press(CUMULET_KEY_RIGHT);
  const std::pair<int, dvec3> sides[] = {{1, {0, 0, 10}}, {3, {10, 0, 0}}, {7, {0, 10, 0}}};
  for (const auto& [digit, eye] : sides) {
    EXPECT_TRUE(session.press(key(digit)));
    expect_near(session.eye(), eye, 1e-2);
    EXPECT_TRUE(session.press(key(digit), ctrl));
    expect_near(session.eye(), -eye, 1e-2);
  }
  EXPECT_TRUE(session.press(key(1)));
  EXPECT_TRUE(session.press(key(5)));
  EXPECT_NEAR(session.camera.pose().orthographic_height, 20 * std::tan(pi / 9), 1e-9);
  EXPECT_TRUE(session.press(key(5)));
  EXPECT_EQ(session.camera.pose().orthographic_height, 0.0);
  for (int i = 0; i < 6; ++i) EXPECT_TRUE(session.press(key(6)));
  expect_near(session.eye(), {10, 0, 0}, 1e-9);
  EXPECT_TRUE(session.press(key(4)));
  EXPECT_TRUE(session.press(key(8)));
  EXPECT_NEAR(elevation(session.camera.pose()), pi / 12, 1e-9);
  EXPECT_TRUE(session.press(key(2)));
  expect_near(session.eye(), {10 * std::cos(pi / 12), 0, 10 * std::sin(pi / 12)}, 1e-9);
  EXPECT_FALSE(session.press(key(0)));
  EXPECT_FALSE(session.press(key(5), ctrl));
  EXPECT_FALSE(session.press(key(1), alt));
  // From the top view, an orbit continues about +Y.
  EXPECT_TRUE(session.press(key(7)));
  session.down(CUMULET_BUTTON_MIDDLE, 0, 0);
  session.up(CUMULET_BUTTON_MIDDLE, 0, -height / 2);
  expect_near(session.eye(), {0, 0, 10}, 1e-2);
}

TEST(Navigation, FlySpeedIsIndependentOfTheFrameRate) {
  dvec3 ends[3];
  const int frames[] = {1, 30, 1000};
  for (int i = 0; i < 3; ++i) {
    Session session(NavigationStyle::blender, true);
    EXPECT_FALSE(session.navigation.moving());
    EXPECT_TRUE(session.press('W'));
    EXPECT_TRUE(session.press('D'));
    EXPECT_TRUE(session.press('D'));  // a key repeats
    EXPECT_TRUE(session.navigation.moving());
    for (int frame = 0; frame < frames[i]; ++frame) EXPECT_TRUE(session.advance(1.0 / frames[i]));
    EXPECT_TRUE(session.lift('D'));
    EXPECT_TRUE(session.lift('W'));
    EXPECT_FALSE(session.navigation.moving());
    EXPECT_FALSE(session.advance(1.0));
    ends[i] = session.eye();
    EXPECT_NEAR(distance(session.camera.pose()), 10.0, 1e-9);
  }
  expect_near(ends[0], ends[1], 1e-9);
  expect_near(ends[0], ends[2], 1e-9);
  EXPECT_NEAR(glm::length(ends[0] - dvec3(0, 0, 10)), 3.0, 1e-9);  // half of the box's diagonal: 6
  EXPECT_NEAR(ends[0].x, 3.0 / std::sqrt(2.0), 1e-9);
  EXPECT_NEAR(ends[0].z, 10 - 3.0 / std::sqrt(2.0), 1e-9);
}

TEST(Navigation, FlyKeysMoveAlongTheCamerasAxes) {
  const std::pair<char, dvec3> ways[] = {{'W', {0, 0, -1}}, {'S', {0, 0, 1}}, {'A', {-1, 0, 0}},
                                         {'D', {1, 0, 0}},  {'E', {0, 1, 0}}, {'Q', {0, -1, 0}}};
  for (const auto& [key, way] : ways) {
    Session session(NavigationStyle::simple, true);
    EXPECT_TRUE(session.press(key));
    session.advance(1.0);
    expect_near(session.eye(), dvec3(0, 0, 10) + 3.0 * way, 1e-9);
    // Shift is faster, even if it arrives with another event.
    session.move(5, 5, shift);
    session.advance(0.25);
    expect_near(session.eye(), dvec3(0, 0, 10) + 6.0 * way, 1e-9);
    session.move(5, 5);
    session.advance(1.0);
    expect_near(session.eye(), dvec3(0, 0, 10) + 9.0 * way, 1e-9);
    // Keys with ctrl are the host's; so are all keys if fly mode is off.
    Session plain;
    EXPECT_FALSE(plain.press(key));
    EXPECT_FALSE(plain.advance(1.0));
    Session shortcut(NavigationStyle::simple, true);
    EXPECT_FALSE(shortcut.press(key, ctrl));
    EXPECT_FALSE(shortcut.navigation.moving());
  }
  Session both(NavigationStyle::simple, true);
  both.press('W');
  both.press('S');
  EXPECT_FALSE(both.navigation.moving());
  both.lift('S');
  EXPECT_TRUE(both.navigation.moving());
  // Without bounds the speed depends on the distance to the target.
  both.bounds.reset();
  both.advance(1.0);
  expect_near(both.eye(), {0, 0, 5}, 1e-9);
  both.advance(1.0);  // the distance does not shrink
  expect_near(both.eye(), {0, 0, 0}, 1e-9);
}

TEST(Navigation, TurntableSpeedFollowsTheClock) {
  for (const int frames : {1, 25}) {
    Session session;
    NavigationSettings settings;
    settings.turntable_degrees_per_second = 45.0;
    settings.speed = 7.0;  // speed of mouse motion
    session.navigation.set(settings);
    EXPECT_TRUE(session.navigation.moving());
    for (int i = 0; i < frames; ++i) EXPECT_TRUE(session.advance(2.0 / frames));
    expect_near(session.eye(), {10, 0, 0}, 1e-9);
    EXPECT_FALSE(session.advance(0.0));
    EXPECT_FALSE(session.advance(-1.0));
    EXPECT_FALSE(session.advance(NAN));
    settings.turntable_degrees_per_second = 0.0;
    session.navigation.set(settings);
    EXPECT_FALSE(session.navigation.moving());
  }
  // A camera that waits for its bounds is not moved.
  Session waiting;
  waiting.camera.set(CameraPose());
  NavigationSettings settings;
  settings.turntable_degrees_per_second = 45.0;
  waiting.navigation.set(settings);
  EXPECT_FALSE(waiting.advance(1.0));
}

}  // namespace
