#pragma once

#include <cumulet/cumulet.h>

#include <cstdint>
#include <default_medium.hpp>
#include <functional>
#include <future>
#include <instances.hpp>
#include <memory>
#include <models.hpp>
#include <mutex>
#include <optional>
#include <shader_cache.hpp>
#include <string>
#include <timeline.hpp>
#include <transforms.hpp>
#include <vector>

#include "exposure_meter.hpp"
#include "given_settings.hpp"
#include "model.hpp"
#include "picture_job.hpp"
#include "viewer_file.hpp"
#include "viewer_setup.hpp"

namespace cumulet::demo {

/// An event in the image. key: the GLFW key, for keys that the viewer does not handle.
struct ViewerInput {
  cumulet_event event{};
  int key = 0;
};

/// A one-time request, in addition to DesiredState.
struct Request {
  enum class Type { frame_all, save_png, save_exr, forget_saves, suggest_density, meter_exposure, pick };
  Type type = Type::frame_all;
  std::string path = {};
  double x = 0.0;  // pick: position in image pixels
  double y = 0.0;
};

/// Result of a pick.
struct Picked {
  std::optional<Item> item;  // nullopt: no item that can be selected
};

/// Counters of the user's changes of values that the viewer itself changes too.
struct Edits {
  std::uint64_t camera = 0;
  std::uint64_t volume = 0;  // volume, grid or up axis; also incremented to reload the same file
  std::uint64_t surfaces = 0;
  std::uint64_t environment = 0;

  bool operator==(const Edits&) const = default;
  /// Returns true if both have the same files.
  [[nodiscard]] bool same_files(const Edits& other) const {
    return volume == other.volume && surfaces == other.surfaces && environment == other.environment;
  }
};

/// The complete state that the window requests, as a value that is sent to the viewer's thread.
struct DesiredState {
  std::uint64_t number = 0;  // increases with each request
  SceneOptions scene;
  // The viewer takes the values counted here from the scene only if the counter has changed, which means that the user
  // has changed them.
  Edits edits;
  bool fit = false;      // fit the camera when the volume is loaded, because no scene file sets it
  bool suggest = false;  // also compute a suggested density scale, because no scene file sets it
  bool unsaid = false;   // the medium is not set; the volume gets its default medium
  cumulet_navigation_desc navigation{};
  bool adaptive_resolution = true;
  bool held = false;    // the user is dragging a control or the camera; grid settings may wait for the worker thread
  bool paused = false;  // no tracing
  double budget_ms = 0.0;
  std::uint32_t width = 0;  // size of the image in pixels
  std::uint32_t height = 0;
  double scale = 1.0;
};

/// Events of the viewer since the last answer that was taken.
struct AnswerEvents {
  struct Notice {
    bool error = false;
    std::string text;
  };
  struct File {
    enum class Fate { opened, failed, saved };
    std::string path;
    Fate fate = Fate::opened;
  };
  bool camera_moved = false;            // by input, turntable or camera fit
  std::optional<double> density_scale;  // suggested density scale
  std::optional<DefaultMedium> look;    // of a volume that was requested with `unsaid`
  std::optional<Picked> picked;         // result of the last pick
  std::optional<Metered> metered;       // requested exposure
  std::vector<Notice> notices;
  std::vector<File> files;
};

/// The viewer's state, as the answer to a request.
struct Answer : AnswerEvents {
  std::uint64_t desired = 0;  // number of the latest request that was processed
  Status status;
  std::vector<GridInfo> grids;
  bool waiting = false;  // a load or the first camera fit is pending
  cumulet_camera_desc camera{};
  VolumeFile volume;  // displayed or loading
  std::string surfaces;
  std::string environment;
  Edits edits;         // of the request that these values belong to
  bool drawn = false;  // there is a new image since the last answer that was taken
};

[[nodiscard]] bool same_camera(const cumulet_camera_desc& a, const cumulet_camera_desc& b);
/// Returns true if both request the same state. The numbers are ignored.
[[nodiscard]] bool same_request(const DesiredState& a, const DesiredState& b);

/// A Cumulet viewer that is controlled by requests. All calls from the thread that has its GL context.
class Session {
 public:
  /// wake: called from any thread when there is something new to draw. Throws std::runtime_error.
  Session(cumulet_get_proc_fn get_proc, void* get_proc_user, std::function<void()> wake, Timeline* timeline,
          const ViewerSetup& setup);
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;
  ~Session() = default;

  /// Passes the changes since the last request to the viewer. If the request is unchanged, passes changes that had to
  /// wait.
  void follow(const DesiredState& desired);
  void input(const ViewerInput& input);
  void execute(const Request& request);
  /// Returns true if the programs of the first scene are not compiled yet. Call warm_up instead of work.
  [[nodiscard]] bool cold() const;
  /// Compiles what the first image needs. framebuffer: has the image's size.
  void warm_up(unsigned framebuffer);
  /// Traces for the budget of the last request.
  void work();
  /// Returns true if draw would draw a different image than before.
  [[nodiscard]] bool has_news() const;
  /// Draws the current image into a framebuffer of the image's size.
  void draw(unsigned framebuffer);
  /// Writes the current image. Returns a note of one line, or "". Throws std::runtime_error, one line.
  [[nodiscard]] std::string write(const PictureFile& file);
  /// Returns true if work is not finished.
  [[nodiscard]] bool more() const;
  /// Returns true while a file or the image is read or a grid is built, so that the progress should be polled.
  [[nodiscard]] bool busy() const { return status_.busy || meter_.reads(); }
  /// Returns the current state. Notices and files are returned once.
  [[nodiscard]] Answer answer();

  /// Any thread.
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
  struct Shared {  // shared with callbacks in any thread
    std::function<void()> wake;
    std::mutex mutex;
    std::vector<std::string> warnings;
    std::optional<ThumbnailPtr> thumbnail;  // finished thumbnail
    bool opened = false;                    // opening one of the other volumes is done, or has failed
    bool opened_model = false;              // opening one of the models is done, or has failed
  };

  static void on_log(void* user, cumulet_log_level level, const char* message);
  static void on_update(void* user);

  void add_notice(bool error, const std::string& text) { events_.notices.push_back({error, text}); }
  /// Reports the error of a failed call. Returns true on success.
  bool check(cumulet_status status);
  void follow_volume();
  // Starts loading the volume, a file or a sequence.
  bool begin_volume();
  // Restores the previous volume after a failed load.
  void restore_volume();
  void follow_playback();
  void see_sequence();
  // Hides or shows the volume.
  void follow_visible();
  struct Opened;
  // Shows the other volumes that are open, and starts opening the next missing one.
  void follow_others();
  void finish_others();
  // Shows the models that are open, and starts opening the next missing one.
  void follow_models();
  void finish_models();
  void follow_environment();
  void finish_environment();
  // Starts a thread that creates a thumbnail of the displayed environment.
  void begin_thumbnail();
  void drop_thumbnail();
  [[nodiscard]] bool waits() const {
    return volume_.loading || surfaces_.loading || environment_.loading || opening_.made.valid() ||
           opening_model_.made.valid();
  }
  void follow_ramps();
  // Sets the view of OpenColorIO, or none.
  void follow_ocio();
  void follow_clip();
  void follow_analytic_lights();
  void follow_transforms();
  void follow_surfaces();
  void set_surfaces();
  void remove_surfaces();
  void finish_surfaces();
  [[nodiscard]] cumulet_frame_desc frame() const;
  // Updates the status after work.
  void see_work();
  [[nodiscard]] bool has_surfaces() const;
  // Reads the properties of the displayed surfaces.
  void read_surfaces();
  void finish_load();
  void set_camera();
  /// Handles finished loads and builds.
  void see_ends();
  /// Returns true and reports the cause if the load did not succeed.
  bool load_failed(cumulet_status status, const char* message, const std::string& path);
  void see_camera();
  // Updates the bounding boxes of volumes and models.
  void see_boxes();
  void move_by_keys(int key);
  void measure_noise();
  void measure_exposure();
  /// Returns the viewer's volume, or null.
  VolumePtr shown();
  void suggest_density();
  void pick(double x, double y);
  // Suggests the density scale, and the medium if it is not set.
  void suggest_look();
  void give_known_medium();
  void add_warnings();
  void follow_backdrop();
  VolumePtr make_backdrop();
  void follow_navigation();
  /// Writes the requested files when all pixels have a sample.
  void finish_saves();
  void save(const Request& request);

  std::unique_ptr<Shared> shared_;
  std::unique_ptr<cumulet_viewer, DestroyViewer> viewer_;
  std::unique_ptr<cumulet_camera, ReleaseCamera> camera_;
  DesiredState desired_;
  SceneOptions& scene_ = desired_.scene;  // includes the viewer's changes
  std::optional<SceneOptions> known_;     // settings that were passed to the viewer
  GivenSettings given_;
  ViewerFile<VolumeFile> volume_;
  ViewerFile<std::string> surfaces_;
  ViewerFile<std::string> environment_;
  std::vector<Request> saves_;  // waiting for a complete image
  cumulet_camera_desc seen_{};  // last camera of the viewer
  struct Drawn {
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    cumulet_display_desc display{};
    OcioView ocio;
  } drawn_;
  std::optional<Box> shown_box_;  // bounding box of the displayed volume, if known
  struct WarmUp {
    bool done = false;            // the first scene's programs are compiled
    std::optional<double> since;  // time in seconds of the first compile request
  } warm_up_;
  struct FirstView {
    std::optional<cumulet_camera_desc> fit;  // camera to fit when the volume is loaded
    bool suggest = false;                    // suggest the density scale then
  } first_view_;
  struct Noise {
    double measured_at = 0.0;
    std::uint64_t samples = 0;
  } noise_;
  ExposureMeter meter_;
  AnswerEvents events_;
  Status status_;
  VolumePtr backdrop_;  // empty volume, used while only an environment is shown
  VolumePtr hidden_;    // the viewer's volume while it is hidden
  struct Playing {
    std::shared_ptr<cumulet_sequence> sequence;  // shown instead of a volume
    std::optional<FrameRow> row;                 // files of the sequence
  } playing_;
  struct Before {
    Playing playing;
    VolumePtr volume;  // if there was no sequence
  };
  std::optional<Before> before_;  // state to restore if loading the sequence fails
  Instances others_;
  struct Opening {
    VolumeFile file;
    std::future<OtherVolume> made;  // valid while a volume is being opened
  } opening_;
  Models models_;
  struct OpeningModel {
    std::string file;
    std::future<SurfacesPtr> made;  // valid while surfaces are being opened
  } opening_model_;
  std::vector<GridInfo> grids_;
  std::future<void> drawing_;  // valid until the thumbnail is taken
};

}  // namespace cumulet::demo
