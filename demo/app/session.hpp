#pragma once

#include <cumulet/cumulet.h>

#include <cstdint>
#include <functional>
#include <future>
#include <instances.hpp>
#include <memory>
#include <models.hpp>
#include <mutex>
#include <optional>
#include <places.hpp>
#include <shader_cache.hpp>
#include <string>
#include <timeline.hpp>
#include <vector>

#include "given_settings.hpp"
#include "model.hpp"

namespace cumulet::demo {

/// An event of the picture, and GLFW's key for what the viewer has no use for.
struct ViewerInput {
  cumulet_event event{};
  int key = 0;
};

/// What is asked for once, beside what is wished all the time.
struct Request {
  enum class Type { frame_all, save_png, save_exr, forget_saves, suggest_density, pick };
  Type type = Type::frame_all;
  std::string path = {};
  double x = 0.0;  // pick: pixels of the picture
  double y = 0.0;
};

/// What was met where somebody clicked.
struct Picked {
  std::optional<Item> item;  // nothing that can be chosen
};

/// All that the window wants to see: a value, sent to the viewer's thread.
struct Wish {
  std::uint64_t number = 0;  // rises with each
  SceneOptions scene;
  // What the viewer changes by itself is taken from the scene only where these say that the user has changed it since.
  std::uint64_t camera_edit = 0;
  std::uint64_t volume_edit = 0;  // the volume, its grid or its up axis; the same file may be wished anew
  std::uint64_t surfaces_edit = 0;
  std::uint64_t environment_edit = 0;
  bool fit = false;      // that volume is framed once it is there: its camera comes from no scene file
  bool suggest = false;  // its density scale is told, too: none comes from a scene file
  bool unsaid = false;   // nor is anything said of its medium: one that burns gets a look of fire
  cumulet_navigation_desc navigation{};
  bool adaptive_resolution = true;
  bool held = false;    // a control or the camera is: the grid's settings may wait for the worker
  bool paused = false;  // nothing is traced
  double budget_ms = 0.0;
  std::uint32_t width = 0;  // of the picture, pixels
  std::uint32_t height = 0;
  double scale = 1.0;
};

/// What the viewer makes of a wish.
struct Answer {
  std::uint64_t wish = 0;  // the newest that was seen
  Status status;
  std::vector<GridInfo> grids;
  bool waiting = false;  // something is still to come of itself: a load, or the camera's first place
  cumulet_camera_desc camera{};
  VolumeFile volume;  // shown, or being loaded
  std::string surfaces;
  std::string environment;
  std::uint64_t camera_edit = 0;  // what these follow
  std::uint64_t volume_edit = 0;
  std::uint64_t surfaces_edit = 0;
  std::uint64_t environment_edit = 0;
  // Since the last answer that was taken:
  bool drawn = false;                       // there is another picture
  bool camera_moved = false;                // by whatever
  std::optional<double> density_scale;      // that suits the volume
  std::optional<cumulet_medium_desc> look;  // a volume's that was wished with nothing said of its medium
  std::optional<Picked> picked;             // by the last of such requests
  struct Notice {
    bool error = false;
    std::string text;
  };
  std::vector<Notice> notices;
  struct File {
    enum class Fate { opened, failed, saved };
    std::string path;
    Fate fate = Fate::opened;
  };
  std::vector<File> files;
};

[[nodiscard]] bool same_camera(const cumulet_camera_desc& a, const cumulet_camera_desc& b);
/// Whether they ask for the same, whatever their numbers.
[[nodiscard]] bool same_wish(const Wish& a, const Wish& b);

/// A cumulet viewer that follows wishes. All of it in the one thread that has its GL context.
class Session {
 public:
  /// wake is called from any thread when there is something new to draw. Throws std::runtime_error.
  Session(cumulet_get_proc_fn get_proc, void* get_proc_user, std::function<void()> wake, Timeline* timeline,
          const std::string& shader_cache, const std::string& shaders);
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;
  ~Session() = default;

  /// Hands the viewer what has changed since the last wish; for the same again, what had to wait.
  void follow(const Wish& wish);
  void input(const ViewerInput& input);
  void execute(const Request& request);
  /// Whether the programs of the first scene are still to be compiled: warm_up, in place of work.
  [[nodiscard]] bool cold() const;
  /// Works on what the first picture needs, to be drawn into a framebuffer of its size.
  void warm_up(unsigned framebuffer);
  /// Works on the last wish for its budget.
  void work();
  /// Whether draw would draw anything but what it drew last.
  [[nodiscard]] bool has_news() const;
  /// Draws what there is into a framebuffer of the picture's size.
  void draw(unsigned framebuffer);
  /// Whether work has anything left to do.
  [[nodiscard]] bool more() const;
  /// Whether a file is read or a grid is built, whose progress is worth a look now and then.
  [[nodiscard]] bool busy() const { return status_.busy; }
  /// What there is to tell; the notices and the files once.
  [[nodiscard]] Answer answer();

  /// From any thread.
  void cancel() { cumulet_cancel(viewer_.get()); }

 private:
  struct DestroyViewer {
    void operator()(cumulet_viewer* viewer) const { cumulet_destroy(viewer); }
  };
  struct ReleaseCamera {
    void operator()(cumulet_camera* camera) const { cumulet_camera_release(camera); }
  };
  struct ReleaseVolume {
    void operator()(cumulet_volume* volume) const { cumulet_volume_release(volume); }
  };
  using VolumePtr = std::unique_ptr<cumulet_volume, ReleaseVolume>;
  struct Shared {  // with the callbacks, from any thread
    std::function<void()> wake;
    std::mutex mutex;
    std::vector<std::string> warnings;
    std::optional<ThumbnailPtr> thumbnail;  // made, to be taken
    bool opened = false;                    // one of the other volumes is, or is known not to
    bool opened_model = false;              // likewise of the models
  };

  static void on_log(void* user, cumulet_log_level level, const char* message);
  static void on_update(void* user);

  void tell(bool error, const std::string& text) { notices_.push_back({error, text}); }
  /// Tells a failed call.
  bool check(cumulet_status status);
  void follow_volume();
  // Begins to read it, be it a file's or a sequence's.
  bool begin_volume();
  // After a load that failed: as it was before.
  void restore_volume();
  void follow_playback();
  void see_sequence();
  // Hides the volume, or shows it again.
  void follow_visible();
  struct Opened;
  // Shows the others that are there, and begins to open the next that is not.
  void follow_others();
  void finish_others();
  // Likewise of models.
  void follow_models();
  void finish_models();
  void follow_environment();
  void finish_environment();
  // Begins a picture of the one that is shown, on a thread of its own.
  void begin_thumbnail();
  void drop_thumbnail();
  [[nodiscard]] bool waits() const {
    return waiting_ || waiting_for_surfaces_ || waiting_for_environment_ || opening_.made.valid() ||
           opening_model_.made.valid();
  }
  void follow_ramps();
  void follow_lamps();
  void follow_places();
  void follow_surfaces();
  void set_surfaces();
  void remove_surfaces();
  void finish_surfaces();
  [[nodiscard]] cumulet_frame_desc frame() const;
  // What has come of a call that works.
  void see_work();
  [[nodiscard]] bool has_surfaces() const;
  // What the library says of those it shows.
  void read_surfaces();
  void finish_load();
  void set_camera();
  /// Of loads and builds.
  void see_ends();
  /// Told, if it did not succeed.
  bool load_failed(cumulet_status status, const char* message, const std::string& path);
  void see_camera();
  // What files' volumes and models take up.
  void see_boxes();
  void move_by_keys(int key);
  void measure_noise();
  /// The viewer's volume, or none.
  VolumePtr shown();
  void suggest_density();
  void pick(double x, double y);
  // With it the medium, where nothing is said of that.
  void suggest_look();
  void give_known_medium();
  void tell_warnings();
  void follow_backdrop();
  VolumePtr make_backdrop();
  void follow_navigation();
  /// Saves what was asked for, once the picture is whole.
  void finish_saves();
  void save(const Request& request);

  std::unique_ptr<Shared> shared_;
  std::unique_ptr<cumulet_viewer, DestroyViewer> viewer_;
  std::unique_ptr<cumulet_camera, ReleaseCamera> camera_;
  Wish wish_;
  SceneOptions& scene_ = wish_.scene;  // with what the viewer has made of it
  std::optional<SceneOptions> known_;  // what the viewer was given last
  GivenSettings given_;
  std::vector<Request> saves_;  // that wait for a whole picture
  cumulet_camera_desc seen_{};  // the viewer's camera
  std::uint32_t drawn_width_ = 0;
  std::uint32_t drawn_height_ = 0;
  cumulet_display_desc drawn_display_{};
  VolumeFile shown_volume_;
  std::optional<Box> shown_box_;  // of that, where it is known
  std::string shown_surfaces_;
  std::string shown_environment_;
  bool warm_ = false;                 // the first scene's programs are there
  std::optional<double> cold_since_;  // seconds, when the first of them was asked for
  bool waiting_for_surfaces_ = false;
  bool waiting_for_environment_ = false;
  bool waiting_ = false;
  cumulet_status told_surfaces_ = CUMULET_OK;  // how the last job of each ended, as far as that was told
  cumulet_status told_volume_ = CUMULET_OK;
  cumulet_status told_environment_ = CUMULET_OK;
  std::optional<cumulet_camera_desc> fit_;  // the camera to place when the volume is there
  bool suggest_ = false;
  std::optional<double> density_scale_;
  std::optional<cumulet_medium_desc> look_;
  std::optional<Picked> picked_;
  bool camera_moved_ = false;
  double last_noise_ = 0.0;
  std::uint64_t noise_samples_ = 0;
  Status status_;
  VolumePtr backdrop_;                          // an empty volume, while an environment is all that is shown
  VolumePtr hidden_;                            // the viewer's volume, while it is not to be seen
  std::shared_ptr<cumulet_sequence> sequence_;  // in its place
  std::optional<FrameRow> row_;                 // of that
  struct Before {
    std::shared_ptr<cumulet_sequence> sequence;
    std::optional<FrameRow> row;
    VolumePtr volume;  // where there was no sequence
  };
  std::optional<Before> before_;  // what a sequence stands in place of, until the load has ended
  Instances others_;
  struct Opening {
    VolumeFile file;
    std::future<OpenVolume> made;  // while one is opened
  } opening_;
  Models models_;
  struct OpeningModel {
    std::string file;
    std::future<SurfacesPtr> made;  // while one is opened
  } opening_model_;
  std::vector<GridInfo> grids_;
  std::vector<Answer::Notice> notices_;
  std::vector<Answer::File> files_;
  std::future<void> drawing_;  // of a thumbnail, until that is taken
};

}  // namespace cumulet::demo
