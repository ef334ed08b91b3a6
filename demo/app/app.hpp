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

/// cumulet-demo: window, model, renderer and the main loop.
class App {
 public:
  /// Throws std::runtime_error, one line, without display, OpenGL 4.5 or replay file.
  explicit App(DemoOptions options);
  App(const App&) = delete;
  App& operator=(const App&) = delete;
  ~App();

  /// Runs until the window is closed or the replay has ended. Throws the error of a failed replay.
  void run();

 private:
  void frame();
  [[nodiscard]] double patience() const;
  /// Returns true if a replay controls the program. Each frame then waits for the image that it requested.
  [[nodiscard]] bool stepped() const { return player_ && order_.idle <= 0.0; }

  void handle(const std::vector<Event>& events);
  void handle_key(const Event& event);
  void to_viewer(const Event& event);
  /// Handles a mouse button in the image: for a handle, a click or the camera.
  void press(const Event& event);
  void let_go(const Event& event);
  void choose_at(const glm::dvec2& pixel);
  [[nodiscard]] glm::dvec2 pointer() const { return {window_->input().x(), window_->input().y()}; }
  /// Returns the projection of the scene to the window; nullopt while the camera has no position.
  [[nodiscard]] std::optional<Sight> sight() const;
  void drag_handle();
  void draw_handles();

  void execute(const std::vector<Command>& commands);
  void execute(const Command& command);
  void open(const std::string& path);
  void save_scene(const std::string& path);
  void step_history(bool back);
  void cancel();
  /// Shows the frame with this index in the sequence.
  void go_to(std::uint32_t index);
  void play_row();
  /// Plays or pauses. At the end of a sequence that is not repeated it starts again at the beginning.
  void play_or_pause();
  void step(int frames);
  /// Advances the clock and the sequence.
  void advance_clock(double seconds);
  void follow_playback();

  void follow_history();
  /// Sends changes to the renderer.
  void ask();
  /// Takes the renderer's answer, if there is one.
  void take();
  void accept(const Answer& answer);
  void remember_files(const Answer& answer);
  /// Returns true if the latest request is answered.
  [[nodiscard]] bool settled() const { return answered_ >= desired_.number; }
  /// Returns true if a load is pending, also if the viewer has not received it yet.
  [[nodiscard]] bool waiting() const;
  /// Returns true if the medium was set neither by the user nor by a flag or scene file.
  [[nodiscard]] bool is_unsaid() const;
  void complain(const std::string& cause);
  /// Returns true if the window was drawn, and false if it would not have changed.
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
  ThumbnailPtr thumbnail_;  // the uploaded one
  std::unique_ptr<ThumbnailTexture> thumbnail_texture_;
  Timeline timeline_;  // used with --trace
  std::unique_ptr<Renderer> renderer_;
  std::optional<History> history_;
  std::optional<Player> player_;
  std::optional<Recorder> recorder_;
  Panel panel_;
  Player::Order order_;
  float ui_scale_ = 0.0f;
  Rectangle viewport_;
  RegionDrag region_drag_;
  unsigned viewport_buttons_ = 0;  // buttons pressed in the image, as a bit mask
  Handles handles_;
  std::optional<glm::dvec2> clicked_;  // position of the left button press, while it may become a click
  bool held_ = false;                  // the user is still making a change
  bool quit_ = false;
  bool reload_ = false;  // reload the volume even if it is unchanged
  bool fit_next_ = false;
  bool suggest_next_ = false;
  bool pick_next_ = false;  // the volume being loaded was opened without a grid name
  bool answer_waits_ = false;
  bool camera_moved_ = false;
  bool starting_ = true;            // until the files of the command line are loaded or have failed
  bool has_pending_frame_ = false;  // a change is not drawn yet
  double now_ = 0.0;
  double last_event_ = 0.0;
  double last_motion_ = -1.0;
  double rate_since_ = 0.0;
  double device_seconds_ = 0.0;  // last value of the statistics
  std::uint64_t rate_samples_ = 0;

  DesiredState desired_;                     // last sent; camera, volume and surfaces as the viewer has them
  std::optional<cumulet_medium_desc> look_;  // default medium that was set for a volume
  std::vector<ViewerInput> inputs_;
  std::vector<Request> requests_;
  std::uint64_t answered_ = 0;
  std::uint64_t drawn_ = 0;  // latest request with a drawn image
  // Time of the oldest change that no image shows yet.
  std::optional<double> changed_at_;
  std::uint64_t changed_number_ = 0;
  std::uint64_t answered_volume_ = 0;  // edit counter of the last answer
  std::uint64_t answered_surfaces_ = 0;
  std::uint64_t answered_environment_ = 0;
  const cumulet_sequence* known_sequence_ = nullptr;  // sequence that the clock belongs to
  std::string opening_scene_;                         // scene file whose files are still loading
  std::string opening_environment_;
  std::uint64_t pictures_ = 0;  // number of displayed images
  std::uint64_t drawn_pictures_ = 0;
  double drawn_at_ = -1.0;
  FrameTimes frame_times_;
  std::string last_state_;  // state line of the previous frame
  std::string title_;       // window title
  std::uint64_t frames_ = 0;
  std::uint64_t drawn_frames_ = 0;  // frames that were drawn because they changed
};

}  // namespace cumulet::demo
