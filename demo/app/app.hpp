#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <timeline.hpp>
#include <vector>

#include "demo_options.hpp"
#include "handles.hpp"
#include "history.hpp"
#include "model.hpp"
#include "panel.hpp"
#include "preferences.hpp"
#include "region_drag.hpp"
#include "replay.hpp"
#include "session.hpp"
#include "window.hpp"

struct GladGLContext;

namespace cumulet::demo {

class Renderer;
class ThumbnailTexture;

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
  /// Whether a replay is at the wheel: each frame shows what it asked for, however long that takes.
  [[nodiscard]] bool stepped() const { return player_ && order_.idle <= 0.0; }

  void handle(const std::vector<Event>& events);
  void handle_key(const Event& event);
  void to_viewer(const Event& event);
  /// A button in the picture: a handle's, a click's or the camera's.
  void press(const Event& event);
  void let_go(const Event& event);
  void choose_at(const glm::dvec2& pixel);
  [[nodiscard]] glm::dvec2 pointer() const { return {window_->input().x(), window_->input().y()}; }
  /// How the picture sees the scene; nothing before the camera has a place.
  [[nodiscard]] std::optional<Sight> sight() const;
  void drag_handle();
  void draw_handles();

  void execute(const std::vector<Command>& commands);
  void execute(const Command& command);
  void open(const std::string& path);
  void save_scene(const std::string& path);
  void step_history(bool back);
  void cancel();
  /// To a frame, by its place in the row.
  void go_to(std::uint32_t index);
  void play_row();
  /// Or pauses; anew from the beginning at an end that is held.
  void play_or_pause();
  void step(int frames);
  /// Moves the clock, and what goes by it.
  void advance_clock(double seconds);
  void follow_playback();

  void follow_history();
  /// Sends what has changed to the renderer.
  void ask();
  /// What has come back since, if anything.
  void take();
  void accept(const Answer& answer);
  void remember_files(const Answer& answer);
  /// Whether the newest wish is answered.
  [[nodiscard]] bool settled() const { return answered_ >= wish_.number; }
  /// Whether a load is still to end, be it that the viewer has not heard of it yet.
  [[nodiscard]] bool waiting() const;
  /// Whether what the medium is came of no hand, no flag and no scene file.
  [[nodiscard]] bool is_unsaid() const;
  void complain(const std::string& cause);
  /// Whether there was anything to draw that the window does not show already.
  bool draw();
  void take_frame_time(const std::vector<Event>& events, bool drawn, bool picture);
  void take_statistics();
  void take_thumbnail();
  void obey(const Player::Order& order);
  void save_window(const std::string& path);
  void write_report(const std::string& path) const;
  void remember();

  DemoOptions options_;
  std::string preferences_path_;
  Model model_;
  std::unique_ptr<Window> window_;
  Window::Context context_;
  std::unique_ptr<GladGLContext> gl_;
  ThumbnailPtr thumbnail_;  // as it was uploaded
  std::unique_ptr<ThumbnailTexture> thumbnail_texture_;
  Timeline timeline_;  // with --trace
  std::unique_ptr<Renderer> renderer_;
  std::optional<History> history_;
  std::optional<Player> player_;
  std::optional<Recorder> recorder_;
  Panel panel_;
  Player::Order order_;
  float ui_scale_ = 0.0f;
  Rectangle viewport_;
  RegionDrag region_drag_;
  unsigned viewport_buttons_ = 0;  // pressed in the picture, a bit each
  Handles handles_;
  std::optional<glm::dvec2> clicked_;  // where the left button went down, while that may be a click
  bool held_ = false;                  // a change is still going on
  bool quit_ = false;
  bool reload_ = false;  // the volume, though it is the same
  bool fit_next_ = false;
  bool suggest_next_ = false;
  bool pick_next_ = false;  // a file that was opened without a grid's name is there next
  bool answer_waits_ = false;
  bool camera_moved_ = false;
  bool starting_ = true;  // until what the command line named is there, or is not
  bool owes_ = false;     // a frame of what changed, as one that would have shown it was not drawn
  double now_ = 0.0;
  double last_event_ = 0.0;
  double last_motion_ = -1.0;
  double rate_since_ = 0.0;
  double device_seconds_ = 0.0;  // as they were told last
  std::uint64_t rate_samples_ = 0;

  Wish wish_;  // sent last; its camera, volume and surfaces as they are known to the viewer
  std::optional<cumulet_medium_desc> look_;  // that a volume got, nothing being said of its medium
  std::vector<ViewerInput> inputs_;
  std::vector<Request> requests_;
  std::uint64_t answered_ = 0;
  std::uint64_t drawn_ = 0;  // the newest that a picture was drawn for
  // The oldest change that no picture has followed yet.
  std::optional<double> changed_at_;
  std::uint64_t changed_number_ = 0;
  std::uint64_t answered_volume_ = 0;  // edits that the last answer knew of
  std::uint64_t answered_surfaces_ = 0;
  std::uint64_t answered_environment_ = 0;
  const cumulet_sequence* known_sequence_ = nullptr;  // that the clock is of
  std::string opening_scene_;                         // a scene file whose parts are still to come
  std::string opening_environment_;
  std::uint64_t pictures_ = 0;  // that came to be shown
  std::uint64_t drawn_pictures_ = 0;
  double drawn_at_ = -1.0;
  FrameTimes frame_times_;
  std::string last_state_;  // the state line of the frame before this
  std::string title_;       // the window's
  std::uint64_t frames_ = 0;
  std::uint64_t drawn_frames_ = 0;  // the others would have looked as the one before
};

}  // namespace cumulet::demo
