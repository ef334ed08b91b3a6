#pragma once

#include <cstdint>
#include <default_medium.hpp>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <timeline.hpp>
#include <utility>
#include <vector>

#include "demo_options.hpp"
#include "end_signals.hpp"
#include "exchange.hpp"
#include "history.hpp"
#include "image_input.hpp"
#include "measurements.hpp"
#include "model.hpp"
#include "panel.hpp"
#include "picture_renderer.hpp"
#include "preferences.hpp"
#include "recent_thumbnails.hpp"
#include "replay.hpp"
#include "samples.hpp"
#include "sequence_clock.hpp"
#include "unsaved_changes.hpp"
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
  /// Returns true while files are read or the scene is prepared.
  [[nodiscard]] bool loads() const;
  /// Returns true if a replay controls the program. Each frame then waits for the image that it requested.
  [[nodiscard]] bool stepped() const { return replay_.player && replay_.order.idle <= 0.0; }

  void handle(const std::vector<Event>& events);
  void handle_key(const Event& event);

  struct Commands;
  void execute(const std::vector<Command>& commands);
  void execute(const Command& command);
  /// Opens the file dialog in the last used folder. endings: the extensions of files that it lists.
  /// Uses the desktop's file dialogs or the program's own, as the preferences say. A replay uses the own ones.
  void choose_dialogs();
  /// Shows the version, the OpenGL driver, the libraries and their licenses.
  void show_about();
  void open_dialog(const char* title, Action action, std::vector<std::string> endings);
  /// Opens the file dialog for a new file with this extension.
  void save_dialog(const char* title, Action action, const char* ending);
  void open(const std::string& path);
  /// Opens a sample scene when its files are written.
  void open_sample(const std::string& scene);
  void follow_samples();
  /// Makes and shows the thumbnails of recent files while the window is empty.
  void follow_recent();
  void make_sample_cards();
  void open_dropped(const std::vector<std::string>& files);
  /// Selects an object that the user has added. It is placed in the scene when its size is known.
  void take_added(const Item& item);
  /// Removes the objects that were added with this file, which cannot be opened. Objects of a scene file stay.
  void drop_failed(const std::string& file);
  /// Gives added objects that are tiny, huge or far a size and a place that suit the scene.
  void place_added();
  /// Sets the up axis of a volume. Its clip turns with it.
  void set_up_axis(SceneVolume& volume, UpAxis up);
  /// Says that a volume stands on its Z axis, with a button for the Y axis. further: the file of a further volume, ""
  /// for the first one.
  void show_up_axis(const std::string& path, const std::string& further);
  /// Offers the Z axis for the first volume if its file's metadata says that Z is up.
  void suggest_up_axis();
  /// Renders the picture of the dialog in the background.
  void render_picture();
  /// Shows the progress and the results of the background pictures.
  void follow_renders();
  /// Returns true if pictures are rendered in the background. Asks the user about them.
  bool ask_about_renders();
  /// Opens a scene. source: the file that is read, which may be a copy of the scene file.
  /// Returns false and reports the error if the file cannot be read.
  bool open_scene(const std::string& path, const std::string& source);
  void save_scene(const std::string& path);
  void new_scene();
  void show(SceneOptions scene, const std::string& path);
  /// Returns true if the scene has unsaved changes. Asks the user about them; unless he cancels, the commands are then
  /// executed.
  bool ask_about_changes(std::vector<Command> commands);
  void discard_changes();
  void execute_waiting();
  void offer_recovery();
  void recover();
  void autosave();
  /// Removes the recovery file, or, if a signal ends the program, completes it for the next start.
  void keep_or_remove_recovery();
  void step_history(bool back);
  void cancel();

  void follow_history();
  void request(Request request) { exchange_.requests.push_back(std::move(request)); }
  /// Sends changes to the renderer.
  void ask();
  /// Takes the renderer's answer, if there is one.
  void take();
  void accept(const Answer& answer);
  void remember_files(const Answer& answer);
  /// Whether the volume has the default medium of a fire, so that its flames are displayed.
  [[nodiscard]] bool burns() const;
  /// Sets the default medium of a volume, and dusk light if it burns.
  void take_look(const DefaultMedium& look);
  /// Returns true if the medium was set neither by the user nor by a flag or scene file.
  [[nodiscard]] bool is_unsaid() const;
  /// Measures the exposure when everything is loaded, unless the user has disabled that.
  void meter_when_loaded() { loading_.meter = model_.preferences.auto_exposure; }
  /// Sets the measured exposure, or keeps one that the user or a scene file has set.
  void take_exposure(const Metered& metered);
  void complain(const std::string& cause);
  /// Returns true if the window was drawn, and false if it would not have changed.
  bool draw();
  void take_thumbnail();
  void obey(const Player::Order& order);
  void save_window(const std::string& path);
  void write_report(const std::string& path) const;
  void remember();

  struct Replay {
    std::optional<Player> player;
    std::optional<Recorder> recorder;
    Player::Order order;
  };
  /// Options of the next load, and the files that are still loading.
  struct Loading {
    std::vector<Command> waiting;  // for the user's answer about unsaved changes
    bool reload = false;           // reload the volume even if it is unchanged
    bool fit = false;
    bool suggest = false;
    bool meter = false;       // measure the exposure when everything is loaded
    bool pick = false;        // the volume being loaded was opened without a grid name
    bool starting = true;     // until the files of the command line are loaded or have failed
    bool discards = false;    // the user continues without the unsaved changes
    bool surfaces = false;    // a model was opened, not as a part of a scene, and is not placed yet
    bool fit_all = false;     // the command line gives no camera
    bool remark = false;      // remark on objects that are hard to see, when everything is loaded
    std::vector<Item> added;  // objects that were added and are not placed yet
    std::string scene;        // scene file
    std::string environment;  // environment map
  };
  /// Frames of the window.
  struct Frames {
    std::uint64_t count = 0;
    std::uint64_t drawn = 0;           // frames that were drawn because they changed
    std::uint64_t pictures = 0;        // number of displayed images
    std::uint64_t drawn_pictures = 0;  // value of `pictures` in the last drawn frame
    double drawn_at = -1.0;
    bool pending = false;   // a change is not drawn yet
    bool in_popup = false;  // a menu or dialog was open before this frame, which a key may have closed since
    std::string state;      // state line of the previous frame
    std::string title;      // window title
  };

  DemoOptions options_;
  std::string preferences_path_;
  Model model_;
  std::unique_ptr<Window> window_;
  Window::Context context_;
  std::unique_ptr<GladGLContext> gl_;
  struct UploadedThumbnail {
    ThumbnailPtr thumbnail;
    std::unique_ptr<ThumbnailTexture> texture;
  } thumbnail_;  // of the environment
  struct Samples {
    SampleFiles files{sample_program(), sample_folder()};
    std::vector<std::unique_ptr<ThumbnailTexture>> textures;
  } samples_;
  struct Recent {
    RecentThumbnails thumbnails{thumbnail_program(), thumbnail_folder()};
    std::map<std::string, std::unique_ptr<ThumbnailTexture>> textures;  // by the path of the thumbnail
  } recent_;
  Timeline timeline_;  // used with --trace
  std::unique_ptr<Renderer> renderer_;
  PictureRenderer pictures_;
  std::optional<History> history_;
  std::optional<UnsavedChanges> changes_;
  Replay replay_;
  Panel panel_;
  Exchange exchange_;
  std::optional<ImageInput> image_;
  SequenceClock clock_{model_};
  Measurements measurements_{model_.charts};
  Loading loading_;
  Frames frames_;
  float ui_scale_ = 0.0f;
  bool held_ = false;  // the user is still making a change
  struct Ending {
    bool quit = false;
    EndSignals signals{Window::wake};
  } ending_;
  bool camera_moved_ = false;
  double now_ = 0.0;
  double last_event_ = 0.0;
  double last_motion_ = -1.0;
  /// Settings that were derived from the scene. They stay if the user changes them.
  struct Derived {
    std::optional<DefaultMedium> look;  // of the volume
    std::optional<float> exposure;      // stops
    bool exposure_given = false;        // a flag or a scene file has set the exposure
    bool exposure_asked = false;        // the user has requested the measurement
  } derived_;
};

}  // namespace cumulet::demo
