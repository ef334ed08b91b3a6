#pragma once

#include <chrono>
#include <cstddef>
#include <fstream>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "input.hpp"

namespace cumulet::demo {

// Replay files: one command a line, one command a frame. docs/replay.md lists them.

struct Rectangle {
  double x = 0.0;
  double y = 0.0;
  double width = 0.0;
  double height = 0.0;
};

/// A place in the window, known once the command's turn has come.
struct Place {
  enum class Of { window, viewport, control };
  Of of = Of::window;
  std::string control;  // its label
  double x = 0.0;       // framebuffer pixels, or parts of the viewport's or the control's size
  double y = 0.0;
};

struct ReplayStep {
  enum class Type { wait_loaded, wait_converged, frames, idle, move, event, text, screenshot, report, quit };
  int line = 0;
  Type type = Type::frames;
  int count = 1;         // frames
  double seconds = 0.0;  // idle
  Place from;            // move: part of the way from one to the other
  Place to;
  double part = 1.0;
  Event event;
  std::string text;  // text; screenshot, report: the file
};

/// Throws std::runtime_error, "path:line: cause".
[[nodiscard]] std::vector<ReplayStep> parse_replay(const std::string& text, const std::string& path);

/// What the player sees of the program, and does to it.
struct ReplayHost {
  bool loading = false;
  bool converged = false;
  Rectangle viewport;
  /// Where a control is; brings it into view if it is not, for the next frame.
  std::function<std::optional<Rectangle>(const std::string& label)> find;
};

/// Plays a file: one step each frame.
class Player {
 public:
  /// What is to be done once the frame is drawn.
  struct Order {
    std::string screenshot;  // of the window; "": none
    std::string report;
    double idle = 0.0;  // seconds for which the program may sleep as it does without a replay
    bool quit = false;
  };

  Player(std::vector<ReplayStep> steps, std::string path);
  /// Throws std::runtime_error, "path:line: cause", when a control or the end of a wait does not come.
  [[nodiscard]] Order next(const ReplayHost& host, Input& input);
  /// Frames during the last idle, drawn or not.
  [[nodiscard]] int idle_frames() const { return idle_frames_; }

 private:
  using Clock = std::chrono::steady_clock;
  [[noreturn]] void fail(const std::string& cause) const;
  [[nodiscard]] std::optional<Rectangle> locate(const ReplayHost& host, const Place& place) const;
  /// Whether a step that waits has waited for long enough; frames counts how often it was asked.
  [[nodiscard]] bool wait_over(const ReplayHost& host);

  std::vector<ReplayStep> steps_;
  std::string path_;
  std::size_t at_ = 0;
  int frames_ = 0;  // that the step has had
  int idle_frames_ = 0;
  Clock::time_point since_;
};

/// Writes what happens as a replay file.
class Recorder {
 public:
  /// Throws std::runtime_error, one line, if the file cannot be written.
  explicit Recorder(const std::string& path);
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;
  ~Recorder();
  /// One frame; loading: whether a file or a grid is under way after it.
  void frame(const std::vector<Event>& events, bool loading);

 private:
  std::ofstream file_;
  int quiet_ = 0;
  bool loading_ = false;
};

}  // namespace cumulet::demo
