// Replay files, and the times of frames that they report.

#include <GLFW/glfw3.h>
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "given_settings.hpp"
#include "input.hpp"
#include "model.hpp"
#include "replay.hpp"
#include "support/folder.hpp"

namespace {

using namespace cumulet::demo;

std::string replay_error(const std::string& text) {
  try {
    static_cast<void>(parse_replay(text, "r"));
    return "";
  } catch (const std::runtime_error& error) {
    return error.what();
  }
}

TEST(Replay, ErrorsNameTheLine) {
  EXPECT_EQ(replay_error("# a comment\n\n  frames 2\nwait loaded\r\n"), "");
  for (const char* line : {"jump",
                           "wait",
                           "wait long",
                           "frames",
                           "frames 0",
                           "frames -1",
                           "frames 1 2",
                           "move",
                           "move 1",
                           "move here 1",
                           "move \"a",
                           "down sideways",
                           "drag 1 2 3 4",
                           "drag 1 2 to",
                           "key",
                           "key ctrl+nothing",
                           "press",
                           "text",
                           "text \"a",
                           "drop",
                           "resize 0 1",
                           "resize 1",
                           "screenshot",
                           "idle 0",
                           "idle 61",
                           "wheel up",
                           "click viewport 1"})
    EXPECT_EQ(replay_error("frames 1\n" + std::string(line) + "\n").rfind("r:2: ", 0), 0u)
        << line << ": " << replay_error("frames 1\n" + std::string(line));
}

TEST(FrameTimes, CountImagesNotWindowFrames) {
  FrameTimes times;
  std::vector<double> waited;
  // A two-second drag: the window is drawn every 1/64 s, and every 16th time with a new image.
  constexpr double frame = 1.0 / 64.0;
  constexpr int pictures = 8;
  for (int i = 0; i <= 16 * pictures; ++i) {
    times.hand(i * frame);
    if (const auto seconds = times.shown(i * frame, i > 0 && i % 16 == 0, i < 16 * pictures))
      waited.push_back(*seconds);
  }
  EXPECT_EQ(waited, std::vector<double>(pictures, 16 * frame));
}

TEST(FrameTimes, AtRestMeasureEventLatency) {
  FrameTimes times;
  EXPECT_FALSE(times.shown(1.0, true, false)) << "nobody waited";
  EXPECT_FALSE(times.shown(2.0, false, false));
  times.hand(3.0);
  times.hand(3.5);  // of the same frame
  EXPECT_EQ(times.shown(3.75, false, false), 0.75);
  EXPECT_FALSE(times.shown(4.0, false, false)) << "a rest is no frame";
  // A change followed by a new image; the window is drawn once before it.
  times.hand(5.0);
  EXPECT_FALSE(times.shown(5.25, false, true));
  EXPECT_EQ(times.shown(6.0, true, true), 1.0);
  EXPECT_EQ(times.shown(6.5, true, false), 0.5);
  // The pointer moves over nothing, and half a minute later over a button.
  times.hand(7.0);
  times.rest();
  times.hand(37.0);
  EXPECT_EQ(times.shown(37.25, false, false), 0.25);
}

/// All events that a replay file generates, in all frames.
std::vector<Event> play(const std::string& text, const ReplayHost& host, std::vector<Player::Order>* orders = nullptr) {
  Player player(parse_replay(text, "r"), "r");
  Input input;
  std::vector<Event> events;
  for (int frame = 0; frame < 1000; ++frame) {
    const Player::Order order = player.next(host, input);
    for (Event& event : input.take()) events.push_back(std::move(event));
    if (orders != nullptr) orders->push_back(order);
    if (order.quit) return events;
  }
  throw std::runtime_error("the replay does not end");
}

ReplayHost host_with_control() {
  ReplayHost host;
  host.viewport = {0, 0, 200, 100};
  host.find = [](const std::string& label) -> std::optional<Rectangle> {
    if (label == "Exposure") return Rectangle{300, 40, 100, 20};
    return std::nullopt;
  };
  return host;
}

TEST(Replay, PositionsAreInWindowViewportOrControls) {
  const auto events =
      play("move 5 6\nmove viewport 0.5 0.25\nmove \"Exposure\"\nmove \"Exposure\" 0 1\nquit", host_with_control());
  ASSERT_EQ(events.size(), 4u);
  EXPECT_EQ(std::make_pair(events[0].x, events[0].y), std::make_pair(5.0, 6.0));
  EXPECT_EQ(std::make_pair(events[1].x, events[1].y), std::make_pair(100.0, 25.0));
  EXPECT_EQ(std::make_pair(events[2].x, events[2].y), std::make_pair(350.0, 50.0));
  EXPECT_EQ(std::make_pair(events[3].x, events[3].y), std::make_pair(300.0, 60.0));
  EXPECT_THROW(play("click \"Nothing\"\n", host_with_control()), std::runtime_error);
}

TEST(Replay, DragIsPressMovesAndRelease) {
  const auto events = play("drag viewport 0 0 to viewport 1 1 middle\n", host_with_control());
  ASSERT_EQ(events.size(), 11u);
  EXPECT_TRUE(events[1].down);
  EXPECT_EQ(events[1].code, GLFW_MOUSE_BUTTON_MIDDLE);
  EXPECT_EQ(events[9].x, 200.0);
  EXPECT_FALSE(events[10].down);
}

TEST(Replay, ChordKeysArePressedInOrder) {
  const auto events = play("key ctrl+shift+z\ntext \"\xC3\xA4\\\"b\"", host_with_control());
  ASSERT_EQ(events.size(), 9u);
  EXPECT_EQ(events[2].code, GLFW_KEY_Z);
  EXPECT_TRUE(events[2].down);
  EXPECT_EQ(events[3].code, GLFW_KEY_Z);
  EXPECT_FALSE(events[3].down);
  EXPECT_EQ(events[5].code, GLFW_KEY_LEFT_CONTROL);
  EXPECT_EQ(events[6].code, 0xE4);
  EXPECT_EQ(events[7].code, '"');
}

TEST(Replay, CommandsRunInTheirFrame) {
  std::vector<Player::Order> orders;
  play("frames 3\nscreenshot \"a.png\"\nreport \"a.json\"\nquit\n", host_with_control(), &orders);
  ASSERT_EQ(orders.size(), 6u);
  EXPECT_EQ(orders[3].screenshot, "a.png");
  EXPECT_EQ(orders[4].report, "a.json");
  EXPECT_TRUE(orders[5].quit);
}

TEST(Replay, RecordingReplaysIdentically) {
  const cumulet::test::Folder folder;
  const std::string path = (folder / "recorded.replay").string();
  const std::string text =
      "move 12.5 40\ndown left\nmove 13 41\nup left\nwheel -2\nkey ctrl+f12\ntext \"a \xE2\x82\xAC\\\\\"\ndrop \"/a "
      "b/c.vdb\"\n";
  const std::vector<Event> played = play(text, host_with_control());
  {
    Recorder recorder(path);
    for (const Event& event : played) recorder.frame({event}, false);
    recorder.frame({}, true);
    recorder.frame({}, false);
  }
  std::ifstream file(path);
  std::stringstream recorded;
  recorded << file.rdbuf();
  EXPECT_NE(recorded.str().find("wait loaded"), std::string::npos);
  const std::vector<Event> again = play(recorded.str(), host_with_control());
  ASSERT_EQ(again.size(), played.size());
  for (std::size_t i = 0; i < again.size(); ++i) {
    EXPECT_EQ(again[i].type, played[i].type) << i;
    EXPECT_EQ(again[i].code, played[i].code) << i;
    EXPECT_EQ(again[i].down, played[i].down) << i;
    EXPECT_EQ(again[i].x, played[i].x) << i;
    EXPECT_EQ(again[i].y, played[i].y) << i;
    EXPECT_EQ(again[i].files, played[i].files) << i;
  }
  EXPECT_THROW(Recorder("/nowhere/a.replay"), std::runtime_error);
}

}  // namespace
