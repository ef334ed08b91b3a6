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

// Replay files contain one command per line. docs/replay.md lists the commands. One step is executed per frame.

struct Rectangle {
  double x = 0.0;
  double y = 0.0;
  double width = 0.0;
  double height = 0.0;
};

/// A position in the window, resolved when the command is executed.
struct Position {
  enum class Of { window, viewport, control };
  Of of = Of::window;
  std::string control;  // the control's label
  double x = 0.0;       // framebuffer pixels, or fractions of the viewport's or the control's size
  double y = 0.0;
};

struct ReplayStep {
  enum class Type {
    wait_loaded,
    wait_converged,
    wait_rendered,
    frames,
    idle,
    move,
    event,
    text,
    screenshot,
    report,
    quit
  };
  int line = 0;
  Type type = Type::frames;
  int count = 1;         // for frames
  double seconds = 0.0;  // for idle
  Position from;         // move: start and end; `part` is the fraction in between
  Position to;
  double part = 1.0;
  Event event;
  std::string text;  // text: the text; screenshot, report: the file
};

/// Parses a replay file. Throws std::runtime_error, "path:line: cause".
[[nodiscard]] std::vector<ReplayStep> parse_replay(const std::string& text, const std::string& path);

/// Interface of the player to the program.
struct ReplayHost {
  bool loading = false;
  bool converged = false;
  bool rendering = false;  // pictures are rendered in the background
  Rectangle viewport;
  /// Returns the rectangle of a control. If it is not in view, scrolls to it for the next frame.
  std::function<std::optional<Rectangle>(const std::string& label)> find;
};

/// Plays a replay file, one step per frame.
class Player {
 public:
  /// Work for the program after the frame is drawn.
  struct Order {
    std::string screenshot;  // screenshot file of the window; "": none
    std::string report;
    double idle = 0.0;  // seconds that the program may sleep, as it does without a replay
    bool quit = false;
  };

  Player(std::vector<ReplayStep> steps, std::string path);
  /// Executes a step. Throws std::runtime_error, "path:line: cause", if a control or the end of a wait does not come in
  /// time.
  [[nodiscard]] Order next(const ReplayHost& host, Input& input);
  /// Number of frames during the last idle, drawn or not.
  [[nodiscard]] int idle_frames() const { return idle_frames_; }

 private:
  using Clock = std::chrono::steady_clock;
  [[noreturn]] void fail(const std::string& cause) const;
  [[nodiscard]] std::optional<Rectangle> locate(const ReplayHost& host, const Position& position) const;
  /// Returns true if a waiting step is done. frames_ counts the calls.
  [[nodiscard]] bool wait_over(const ReplayHost& host);

  std::vector<ReplayStep> steps_;
  std::string path_;
  std::size_t at_ = 0;
  int frames_ = 0;  // number of frames of the current step
  int idle_frames_ = 0;
  Clock::time_point since_;
};

/// Records events to a replay file.
class Recorder {
 public:
  /// Throws std::runtime_error, one line, if the file cannot be written.
  explicit Recorder(const std::string& path);
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;
  ~Recorder();
  /// Records a frame. loading: a file is loading or a grid is being built after it.
  void frame(const std::vector<Event>& events, bool loading);

 private:
  std::ofstream file_;
  int quiet_ = 0;
  bool loading_ = false;
};

}  // namespace cumulet::demo
