// Keys and buttons of the window.

#include <GLFW/glfw3.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "given_settings.hpp"
#include "input.hpp"
#include "model.hpp"
#include "replay.hpp"
#include "support/folder.hpp"

namespace {

using namespace cumulet::demo;

Event button(int code, bool down) {
  Event event;
  event.type = Event::Type::button;
  event.code = code;
  event.down = down;
  return event;
}

Event key(int code, bool down) {
  Event event = button(code, down);
  event.type = Event::Type::key;
  return event;
}

Event move(double x) {
  Event event;
  event.x = x;
  return event;
}

TEST(Input, EachFrameHandlesOneButtonChange) {
  Input input;
  for (const Event& event : {move(1), button(0, true), move(2), button(0, false), button(0, true)}) input.push(event);
  EXPECT_EQ(input.take().size(), 2u);
  EXPECT_TRUE(input.button(0));
  EXPECT_EQ(input.x(), 1.0);
  EXPECT_EQ(input.take().size(), 2u);
  EXPECT_FALSE(input.button(0));
  EXPECT_TRUE(input.pending());
  EXPECT_EQ(input.take().size(), 1u);
  EXPECT_TRUE(input.button(0));
  EXPECT_FALSE(input.pending());
}

Event key_change(int code, bool down) {
  Event event;
  event.type = Event::Type::key;
  event.code = code;
  event.down = down;
  return event;
}

// Tests each order of releasing the two keys, and each part of the events in one frame.
TEST(Input, ChordWithinOneFrameIsRecognized) {
  const std::vector<std::vector<Event>> chords = {
      {key_change(GLFW_KEY_LEFT_CONTROL, true), key_change(GLFW_KEY_O, true), key_change(GLFW_KEY_O, false),
       key_change(GLFW_KEY_LEFT_CONTROL, false)},
      {key_change(GLFW_KEY_LEFT_CONTROL, true), key_change(GLFW_KEY_O, true), key_change(GLFW_KEY_LEFT_CONTROL, false),
       key_change(GLFW_KEY_O, false)}};
  for (const auto& chord : chords) {
    for (std::size_t early = 0; early <= chord.size(); ++early) {
      Input input;
      int opened = 0;
      const auto frames = [&] {
        do {
          for (const Event& event : input.take()) {
            const auto command = event.type == Event::Type::key && event.down
                                     ? command_of(event.code, event.modifiers, false)
                                     : std::nullopt;
            if (command && command->action == Action::open_dialog) ++opened;
            // Dear ImGui reads the current state: in the frame with O, Ctrl must still be held.
            if (event.code == GLFW_KEY_O && event.down) {
              EXPECT_EQ(input.modifiers(), modifier_ctrl);
            }
          }
        } while (input.pending());
      };
      for (std::size_t i = 0; i < chord.size(); ++i) {
        if (i == early) frames();
        input.push(chord[i]);
      }
      frames();
      EXPECT_EQ(opened, 1) << early;
      EXPECT_EQ(input.modifiers(), 0u);
    }
  }
}

TEST(Input, TypingIsHandledInOneFrame) {
  Input input;
  for (int i = 0; i < 57; ++i) {
    input.push(key_change(GLFW_KEY_A + i % 26, true));
    Event character;
    character.type = Event::Type::character;
    character.code = 'a' + i % 26;
    input.push(character);
    input.push(key_change(GLFW_KEY_A + i % 26, false));
  }
  EXPECT_EQ(input.take().size(), 3u * 57u);
}

TEST(Input, ModifiersFollowTheKeysUntilTheFocusIsLost) {
  Input input;
  input.push(key(GLFW_KEY_RIGHT_CONTROL, true));
  input.push(key(GLFW_KEY_LEFT_SHIFT, true));
  input.push(button(2, true));
  static_cast<void>(input.take());
  EXPECT_EQ(input.modifiers(), static_cast<unsigned>(modifier_ctrl | modifier_shift));
  Event lost;
  lost.type = Event::Type::focus_lost;
  input.push(lost);
  static_cast<void>(input.take());
  EXPECT_EQ(input.modifiers(), 0u);
  EXPECT_FALSE(input.any_button());
}

TEST(Input, KeyNamesRoundTrip) {
  int named = 0;
  for (int code = 0; code < Input::keys; ++code) {
    const std::string name = key_name(code);
    if (name.empty()) continue;
    ++named;
    EXPECT_EQ(key_of(name), code) << name;
  }
  EXPECT_GT(named, 80);
  EXPECT_EQ(key_of("nonsense"), -1);
  EXPECT_EQ(key_of(""), -1);
  for (const Shortcut& shortcut : shortcuts()) EXPECT_NE(key_name(shortcut.key), "") << shortcut.what;
  EXPECT_EQ(viewer_key(GLFW_KEY_W), 'W');
  EXPECT_EQ(viewer_key(GLFW_KEY_KP_5), CUMULET_KEY_KEYPAD_0 + 5);
  EXPECT_EQ(viewer_key(GLFW_KEY_F1), CUMULET_KEY_NONE);
}

}  // namespace
