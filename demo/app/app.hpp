#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "demo_options.hpp"
#include "history.hpp"
#include "model.hpp"
#include "panel.hpp"
#include "preferences.hpp"
#include "replay.hpp"
#include "session.hpp"
#include "window.hpp"

struct GladGLContext;

namespace cumulet::demo {

/// cumulet-demo: the window, what it shows, and the loop that joins them.
class App {
 public:
  /// Throws std::runtime_error, one line: no display, no OpenGL 4.5, no such replay file.
  explicit App(DemoOptions options);
  App(const App&) = delete;
  App& operator=(const App&) = delete;
  ~App();

  /// Until the window is closed, or the replay has ended. Throws what a replay that cannot go on says.
  void run();

 private:
  void frame();
  [[nodiscard]] double patience() const;

  void handle(const std::vector<Event>& events);
  void handle_key(const Event& event);
  void to_viewer(const Event& event);
  void move_by_keys(int key);

  void execute(const std::vector<Command>& commands);
  void execute(const Command& command);
  void open(const std::string& path);
  void save_scene(const std::string& path);
  void save_picture(const Command& command);
  void step_history(bool back);
  void cancel();

  void follow_history();
  void draw(double budget_ms);
  void take_statistics(double frame_seconds);
  void obey(const Player::Order& order);
  void save_window(const std::string& path);
  void write_report(const std::string& path) const;
  void remember();

  DemoOptions options_;
  std::string preferences_path_;
  Model model_;
  std::unique_ptr<Window> window_;
  std::unique_ptr<GladGLContext> gl_;
  std::unique_ptr<Session> session_;
  std::optional<History> history_;
  std::optional<Player> player_;
  std::optional<Recorder> recorder_;
  Panel panel_;
  Player::Order order_;
  float ui_scale_ = 0.0f;
  Rectangle viewport_;
  unsigned viewport_buttons_ = 0;  // pressed in the picture, a bit each
  bool held_ = false;              // a change is still going on
  bool quit_ = false;
  double now_ = 0.0;
  double last_event_ = 0.0;
  double last_motion_ = -1.0;
  double last_noise_ = 0.0;
  std::uint64_t noise_samples_ = 0;
  double rate_since_ = 0.0;
  std::uint64_t rate_samples_ = 0;
  std::uint64_t frames_ = 0;
};

}  // namespace cumulet::demo
