#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "assets/instance.hpp"
#include "assets/sequence.hpp"
#include "base/file_path.hpp"
#include "base/log.hpp"
#include "base/trace.hpp"
#include "denoise/network.hpp"
#include "jobs/jobs.hpp"
#include "scene/snapshot.hpp"
#include "stage/dynamic_feed.hpp"
#include "stage/model_stage.hpp"
#include "stage/sequence_feed.hpp"
#include "stage/sky_stage.hpp"
#include "viewer/camera.hpp"
#include "viewer/context.hpp"
#include "viewer/dynamic_gl_bridge.hpp"
#include "viewer/navigation.hpp"
#include "viewer/settings.hpp"

namespace cumulet::viewer {

struct Stats {
  std::uint64_t cells = 0;
  std::uint32_t levels = 0;
  bool limited = false;
  std::uint64_t cell_bytes = 0;
  std::uint64_t gl_bytes = 0;
  std::uint64_t memory_bytes = 0;  ///< of volumes and grids
  std::uint64_t active_voxels = 0;
  BuildSeconds build_seconds;
  double trace_seconds = 0.0;
  render::PassSeconds pass_seconds;
  std::uint64_t samples = 0;
  std::uint64_t samples_not_finite = 0;
  std::uint64_t steps = 0;
  std::optional<double> noise;  // nullopt: unknown
  GlStrings strings;
};

/// The implementation behind the C ABI: takes settings, renders images. A change causes only the rebuilds that it
/// requires. Threads, GL context and GL state: see cumulet.h. Functions throw Error; a call that throws leaves the
/// viewer unchanged.
class Viewer {
 public:
  using GetProc = void* (*)(void* user, const char* name);
  /// restore_state: [GL] calls restore the GL state that they found. sharing: resources of viewers that share shader
  /// programs; null: its own.
  Viewer(Log log, std::function<void()> update, bool restore_state, Trace trace = {},
         std::shared_ptr<Sharing> sharing = nullptr);
  ~Viewer();
  Viewer(const Viewer&) = delete;
  Viewer& operator=(const Viewer&) = delete;

  void attach(GetProc get_proc, void* user);
  void detach();
  void context_lost();
  [[nodiscard]] bool attached() const { return gl_ != nullptr; }

  void load_volume(const VolumeFile& file);
  void set_volume(VolumeAssetPtr volume);
  /// Returns the newest volume; null if there is none.
  VolumeAssetPtr volume();
  /// Returns the metadata of the volume or the sequence; null if there is none.
  VolumeInfoPtr volume_info();
  /// Shows the current frame of a sequence instead of the volume. Null: removes the sequence that is shown, if any.
  void set_sequence(std::shared_ptr<Sequence> sequence);
  using SequenceStatus = SequenceFeed::Status;
  /// sequence() and frame_failure() throw Error(invalid_argument) if the viewer shows no sequence.
  SequenceStatus sequence();
  /// Returns why a frame cannot be shown.
  std::optional<Error> frame_failure(std::uint32_t frame);
  /// The corresponding calls for an instance. Both throw Error(invalid_argument) for an instance that the viewer does
  /// not show or that has no sequence.
  SequenceStatus sequence(const Instance& instance);
  std::optional<Error> frame_failure(const Instance& instance, std::uint32_t frame);
  /// Shows the newest state of a dynamic volume instead of the volume. Null: removes the dynamic volume that is shown,
  /// if any.
  void set_live(std::shared_ptr<Live> live);
  /// [GL] Submits the next state of a dynamic volume from voxels in GL. `live` need not be shown by this viewer. state:
  /// a complete state, or the changes to the last one.
  void set_live_gl(std::shared_ptr<Live> live, const render::GlState& state);
  using LiveStatus = DynamicFeed::Status;
  /// Throws Error(invalid_argument) if the viewer shows no dynamic volume.
  LiveStatus live();
  /// Throws Error(invalid_argument) for an instance that the viewer does not show or that has no dynamic volume.
  LiveStatus live(const Instance& instance);
  /// Sets the instance transforms of the viewer's own volume, sequence or dynamic volume: affine, from its own world
  /// space; at least one. A grid that does not suit the new scale is rebuilt.
  void set_transforms(const std::vector<scene::InstanceTransform>& transforms);
  [[nodiscard]] const std::vector<scene::InstanceTransform>& transforms() const { return transforms_; }
  /// World bounds of all instances of a volume.
  [[nodiscard]] Bounds bounds_of(const VolumeInfo& volume) const;
  /// Shows an instance with its current settings, beside the viewer's own volume. Throws Error(invalid_argument) if it
  /// is shown already.
  void add_instance(std::shared_ptr<Instance> instance);
  /// Throws Error(invalid_argument) if the viewer does not show it.
  void remove_instance(const Instance& instance);
  /// Shows a model with its current settings, beside the viewer's own surfaces. Throws Error(invalid_argument) if it is
  /// shown already.
  void add_model(std::shared_ptr<ModelInstance> model);
  /// Throws Error(invalid_argument) if the viewer does not show it.
  void remove_model(const ModelInstance& model);
  void rebuild();
  struct Limits {
    unsigned threads = 0;                                   ///< working at a time; 0: all cores
    std::uint64_t memory_bytes = ResourceLimits::no_limit;  ///< for volumes and grids in main memory
    std::uint64_t gl_bytes = ResourceLimits::no_limit;      ///< no volume is uploaded beyond it
  };
  /// Applies to work started after this call. Grids whose number of cells no longer suits the memory limits are
  /// rebuilt.
  void set_limits(const Limits& limits);
  void cancel() { jobs_.cancel(); }
  /// timeout_ms: negative: no limit. Throws Status::failure, or Error(timeout).
  void wait(double timeout_ms);
  struct Status {
    /// Stage of the first of these that is active: jobs of volumes, surfaces, environment; upload.
    Progress::Stage stage = Progress::Stage::idle;
    double fraction = 0.0;
    std::optional<Error> volume_failure;  ///< failure of the last job of each kind, if any
    std::optional<Error> surfaces_failure;
    std::optional<Error> environment_failure;
    std::optional<Error> failure;  ///< the first of them, unless it was reported before other work began
  };
  [[nodiscard]] Status status() const;

  void load_surfaces(const FilePath& path);
  /// Shows these at once. Cancels a running load.
  void show_surfaces(scene::ModelSourcePtr surfaces);
  /// Poses these, then shows them. Null: removes the surfaces at once. Cancels a running load.
  void set_surfaces(SurfaceAssetPtr surfaces);
  /// Returns the newest surfaces; null if there are none.
  SurfaceAssetPtr surfaces_asset();
  void set_surface_settings(const SurfaceSettings& settings);
  /// Copies a camera of the newest surfaces to the viewer's. Throws Error(invalid_argument) if it does not exist.
  void use_surface_camera(std::size_t index);

  void set_grid(const GridSettings& settings);
  void set_medium(const Medium& medium);
  void set_ramps(const Ramps& ramps);
  [[nodiscard]] const Ramps& ramps() const { return ramps_; }
  void set_light(const Light& light);
  void set_lights(light::AnalyticLights analytic_lights);
  void load_environment(const FilePath& path);
  /// Null: the sky of the light settings. Cancels a running load.
  void set_environment(light::EnvironmentPtr environment);
  void set_environment_settings(const EnvironmentSettings& settings);
  /// Returns the newest environment; null if there is none.
  const light::EnvironmentPtr& environment();
  void set_ground(const GroundSettings& settings);
  void set_sampling(const Sampling& sampling);
  void set_display(const DisplaySettings& display);
  void set_camera(std::shared_ptr<Camera> camera);
  [[nodiscard]] const std::shared_ptr<Camera>& camera() const { return camera_; }
  /// Sets the camera of the previous frame, `seconds` ago; null: the camera has not moved.
  void set_previous_camera(std::shared_ptr<Camera> camera, double seconds);
  /// Sets the previous transforms of the volume's first instances.
  void set_previous_transforms(std::vector<scene::InstanceTransform> transforms);
  void set_navigation(const NavigationSettings& settings);
  bool input(const InputEvent& event);
  void frame_all();

  FrameResult render(const Frame& frame);
  /// Compiles the programs that frames like this need and uses each once. all: also compiles all other programs.
  WarmUp warm_up(const Frame& frame, bool all);
  Pick pick(double x, double y);
  MapResult update_map(const MapRequest& request);
  void drop_map(std::uint32_t slot);
  /// Throws Error(invalid_argument) without a volume or surfaces.
  Bounds bounds();
  void read_light_group(std::uint32_t group, float* rgb, std::size_t count);
  void read_mattes(const MatteIdOf& id_of, std::uint32_t ranks, float* values, std::size_t count);
  void read_linear(float* rgba, std::size_t count);
  void read_display(std::uint8_t* rgba, std::size_t count);
  /// network_file: denoiser weights, which stay in memory; null: use the real-time filter. Throws Error(file) if the
  /// file is invalid.
  void read_denoised(const char* network_file, float* rgba, std::size_t count);
  /// Converts the result of read_linear() to the result of read_display().
  void encode_display(std::span<const float> linear, std::span<std::uint8_t> rgba) const;
  void read_aov(Aov aov, float* values, std::size_t count);
  std::optional<double> measure_noise();
  /// Size of the data that read_accumulation() writes. Both throw Error(invalid_argument) for images with previews and
  /// for debug views.
  std::size_t accumulation_bytes();
  void read_accumulation(std::span<std::byte> bytes);
  /// Throws Error(invalid_argument) for data of another image, and then leaves the image unchanged.
  void restore_accumulation(std::span<const std::byte> bytes);
  Stats stats();

  /// Calls the host's update callback. Calls are coalesced. Thread-safe.
  void notify();

  /// Returns the shader parameters of the current image; for tests.
  const core::CmParameters& trace_parameters();
  /// Sets a list that receives every completed path-tracing dispatch, or null; for tests.
  void set_dispatch_log(std::vector<render::DispatchRecord>* log) { gl().progressive().tracer().set_log(log); }
  /// Limits the texels per page of cell records; 0: the driver's limit; for tests.
  void set_page_texels(std::int64_t texels) { page_texels_ = texels; }
  /// Sets the receiver of all requests to workers, or null; for tests.
  void set_job_log(JobLog* log) { jobs_.set_job_log(log); }
  /// Answers of a GL context, for a viewer without one.
  struct SimulatedGl {
    bool displays_frames = true;             ///< each frame of a sequence is displayed once it was rendered
    std::uint64_t bytes_beside_volumes = 0;  ///< GPU memory used by everything except volumes
  };
  /// Sets the answers that dry_run() and later calls use; nullopt: none. For tests.
  void simulate_gl(const std::optional<SimulatedGl>& simulated) { simulated_gl_ = simulated; }
  struct DryRun {
    Shot shot;
    FrameResult result;  ///< of these only: loading, more, failed, and converged (nothing prevents it)
  };
  /// Makes the decisions of render() without its GL work: takes the results of workers, requests grids and updates the
  /// scene. For tests, on a viewer that is not attached.
  DryRun dry_run(const Frame& frame);

 private:
  [[nodiscard]] Context& gl() const;
  // Must be called after each change of a setting.
  void touch();
  // True if a worker is busy or has a result that has not been taken.
  [[nodiscard]] bool busy() const;
  // busy() for the workers that build grids.
  [[nodiscard]] bool builds() const;
  // True if a sequence has a request that was not sent, or results that were not checked.
  [[nodiscard]] bool frames_are_due() const;
  // Runs the body of a [GL] call with state guard and error handling.
  template <class Body>
  void with_gl(Body&& body);
  void sync();
  // Updates the request of the viewer's own feed and takes its results.
  void follow_feed();
  void take_from_feed(bool is_seen);
  // Updates the feeds of instances.
  void request_for_feeds();
  // Take the results of feeds of instances. Frames are taken after the requests were updated, states before.
  void take_frames();
  void take_states(bool unseen);
  // Takes the low-resolution proxy of a running load, and drops it when the load ends.
  void follow_proxy();
  // Requests a rebuild if the limits allow more cells or fewer cells than the grid has.
  void fit_cells();
  void drop_proxy();
  // Metadata of the displayed volume: that of the proxy while there is one.
  [[nodiscard]] const VolumeInfoPtr& shown_info() const { return proxy_ ? proxy_->volume_info : volume_info_; }
  // Stops showing a sequence or a dynamic volume.
  void leave_feed();
  // Returns true if the state or frame taken last has been displayed, or if images are not being displayed at all.
  [[nodiscard]] bool is_seen(const VolumeFeed& feed) const;
  // Must be called before a sequence or a dynamic volume is shown or removed. Returns true if one is to be shown.
  bool begin_anew(bool shows, bool showed);
  // Makes this the current volume; null: none.
  void take_volume(VolumeAssetPtr volume);
  // Sets the medium's density scale to the suggested one. Called with the first grid built for it.
  void take_suggestion();
  // Requests new grids. concerned: if set, a volume for which it returns false keeps its grid.
  void request_build(bool (*concerned)(const VolumeAsset&) = nullptr);
  // Copies the medium and the ramps to the build settings.
  void take_medium();
  // Maximum mean scale factor of the volume's instance transforms.
  [[nodiscard]] double stretch() const;
  // Density scale for coming grids, per unit length of the volume's own world space.
  [[nodiscard]] double density_scale_to_come() const;
  // True if the grid was refined for a density scale or anisotropy that no longer suits the medium, so that it must be
  // rebuilt.
  [[nodiscard]] bool other_opacity() const;
  // Medium for display. While a proxy is shown it has the density scale suggested for the proxy.
  [[nodiscard]] Medium seen_medium() const;
  // Updates the medium used for rendering.
  void show_medium();
  [[nodiscard]] scene::Emission field_emission() const;
  // Logs that an anisotropy grid is ignored; once per grid.
  void remark_on_anisotropy();
  // Build settings that do not depend on the view. Nullopt if grids do; the next frame requests them then.
  [[nodiscard]] std::optional<BuildSettings> settings_at_once() const;
  [[nodiscard]] BuildSettings settings_for_view() const;
  // True if the current or requested grid was built for another view than that of the last frame.
  [[nodiscard]] bool built_for_another() const;
  [[nodiscard]] grid::RefineCamera refine_camera() const;
  // Prepares a frame before uploads.
  void prepare(const Frame& frame);
  // Updates the upload progress for status() and stats().
  void follow_upload(const Context& g);
  // Takes the cell counts of GPU-built grids once they are built.
  void take_cells(const Context& g);
  // Sets the GPU memory limit of builds from the memory that the last frame left for volumes.
  void share_gl();
  // Also updates part_of_gl_ and lets grids be rebuilt, after a change of the limits or of the number of grids.
  void share_gl_anew();
  // True if a grid has as many cells as its share of GPU memory allows.
  [[nodiscard]] bool fits(const Built& built) const;
  // Returns the displayed frame of a sequence.
  [[nodiscard]] static std::optional<scene::SequenceFrame> frame_of(const Context& g, std::uint64_t sequence);
  // Takes the GPU memory used by everything except volumes in this frame.
  void take_gl_bytes(std::uint64_t beside_volumes);
  // Fills in the flags about pending work and failures.
  void report_pending(FrameResult& result);
  // Marks all frames and states taken last as rendered.
  void note_rendered();
  // True if a frame or a state is ready, but waits until the previous one has been displayed.
  [[nodiscard]] bool something_waits() const;
  [[nodiscard]] SequenceStatus status_of(const SequenceFeed& feed) const;
  // Records which state this frame's image shows.
  static void note_displayed(const Context& g, const VolumeFeedPtr& feed);
  // Arguments of a new feed.
  [[nodiscard]] FeedContext feed_context();
  struct Shown;
  // Creates the feed of an instance.
  [[nodiscard]] VolumeFeedPtr make_feed(const InstanceSettings& settings, const std::optional<BuildSettings>& build);
  // Assigns one feed to all instances that can share it. Existing feeds are reused. is_of_kind: instances to consider;
  // feeds: receives their feeds.
  void share_feeds(bool (*is_of_kind)(const Shown&), std::vector<VolumeFeedPtr>& feeds);
  // A displayed instance, with its settings when it was last checked.
  struct Shown {
    std::shared_ptr<Instance> instance;
    std::uint64_t id = 0;
    std::shared_ptr<void> listener;
    std::uint64_t revision = 0;
    InstanceSettings settings;
    scene::Part<scene::Medium> medium;
    std::optional<GridCache::Request> request;
    std::optional<GridCache::Request> begun;  // the last request before `request` that was being built
    std::optional<Built> built;               // the newest
    VolumeFeedPtr feed;                       // of its sequence or its dynamic volume; null: none
    void forget() {
      request.reset();
      begun.reset();
      built.reset();
      feed.reset();
    }
    // Its sequence or its dynamic volume; null: none.
    [[nodiscard]] const void* source() const {
      return settings.sequence ? static_cast<const void*>(settings.sequence.get()) : settings.live.get();
    }
    [[nodiscard]] bool has_anything() const { return settings.volume || source() != nullptr; }
    [[nodiscard]] bool is_seen() const { return has_anything() && !settings.hidden; }
    // Null: not known yet.
    [[nodiscard]] VolumeInfoPtr volume_info() const {
      if (settings.volume) return settings.volume->volume_info();
      return feed ? feed->info() : nullptr;
    }
    [[nodiscard]] bool is_there() const { return is_seen() && volume_info(); }
    // Frame of its sequence, or state of its dynamic volume, from which its grid was built.
    [[nodiscard]] std::optional<scene::SequenceFrame> frame() const {
      if (!feed || !built) return std::nullopt;
      const std::optional<Built>& last = feed->built();
      return last && built->source == last->source ? feed->frame() : std::nullopt;
    }
  };
  // Returns the host's tag of an instance or model; 0 for the viewer's own objects.
  [[nodiscard]] std::uint64_t tag_of(std::uint64_t id) const;
  std::vector<Shown>::iterator find(const Instance& instance);
  void follow_instances();
  // If grids depend on the view, there must be a view.
  [[nodiscard]] BuildSettings settings_of(const Shown& shown) const;
  void request_for_grids();
  // Changes a request to the settings of an existing or requested grid that can be used for it.
  void reuse_grid(GridCache::Request& request) const;
  // Returns the matching grid among all existing ones.
  [[nodiscard]] std::optional<Built> grid_of(const GridCache::Request& request) const;
  void take_grids();
  // True if its grid is about to be replaced by a coarser one, because more grids share the memory or the limit was
  // lowered.
  [[nodiscard]] bool makes_room(const Shown& shown) const;
  // True if an instance with a grid is displayed.
  [[nodiscard]] bool shows_instances() const;
  // Volumes displayed together must have the same grid type and kind of cells; keeps previous grids until all match.
  void keep_to_one_march(std::vector<scene::Volume>& volumes) const;
  // While grids are being coarsened to fit a memory limit, keeps all previous grids, so that old and new ones are not
  // mixed.
  void keep_until_cells_are_cut(std::vector<scene::Volume>& volumes) const;
  // Updates the scene's volumes.
  void show_volumes();
  // Returns the current scene; the previous snapshot if nothing changed.
  scene::SnapshotPtr snapshot();
  Shot shot();
  [[nodiscard]] std::optional<Bounds> box() const;
  // World bounds of each displayed object.
  [[nodiscard]] std::vector<Bounds> boxes() const;
  // Origin of scene coordinates.
  [[nodiscard]] glm::dvec3 scene_origin(const std::vector<Bounds>& boxes,
                                        const std::optional<scene::Ground>& ground) const;
  // Logs a warning once per scene whose positions lack precision.
  void remark_on_precision();
  // Logs a warning about non-finite samples: once per image, or only once if previews are on.
  void remark_on_samples(Context& g);
  // Makes the scene's volumes and lights relative to this origin.
  void count_from(const glm::dvec3& origin);
  // all: result of box().
  [[nodiscard]] std::optional<scene::Ground> ground(const std::optional<Bounds>& all) const;
  /// Returns the objects to fit a camera to. The result is valid until something changes.
  [[nodiscard]] std::optional<Subject> subject() const;
  [[nodiscard]] std::vector<double> seen_reach(const glm::dvec3& direction, std::span<const glm::dvec3> normals) const;
  VolumeAssetPtr empty_volume();

  Log log_;
  Trace trace_;
  std::function<void()> update_;
  std::atomic<bool> update_pending_ = false;
  mutable ReportedFailures reported_failures_;
  bool restore_state_;
  std::atomic<double> upload_progress_ = 1.0;
  std::shared_ptr<Sharing> sharing_;
  std::int64_t page_texels_ = 0;
  std::optional<SimulatedGl> simulated_gl_;

  GridSettings grid_;
  Medium medium_;
  Ramps ramps_;
  Sampling sampling_;
  DisplaySettings display_;
  denoise::NetworkPtr network_;          // network used last...
  std::filesystem::path denoiser_file_;  // ...and its file
  std::shared_ptr<Camera> camera_;
  std::shared_ptr<void> camera_listener_;
  Navigation navigation_;
  std::chrono::steady_clock::time_point last_frame_time_{};

  VolumeAssetPtr volume_;                           // newest; of a sequence, that of the frame taken last, if in memory
  VolumeInfoPtr volume_info_;                       // of the volume or the sequence
  VolumeAssetPtr empty_volume_;                     // used for surfaces without a volume
  std::optional<std::string> remarked_anisotropy_;  // the ignored grid that was logged
  std::optional<Proxy> proxy_;                      // shown instead of the volume, and of its predecessor, while it is
                                                    // loaded
  Built built_;                                     // newest; uploaded again after a change of context
  scene::Snapshot scene_;                           // current scene, from which snapshots are made
  scene::SnapshotPtr snapshot_;                     // newest
  light::AnalyticLights analytic_lights_;           // set by the host
  bool analytic_lights_due_ = false;                // the scene's lights are outdated
  std::vector<std::weak_ptr<const surface::Scene>> remarked_scenes_;
  std::optional<std::uint64_t> remarked_picture_;        // the last image with a warning about its samples
  std::vector<scene::InstanceTransform> transforms_{1};  // instance transforms of the volume; at least one
  scene::Part<scene::Medium> shown_medium_;              // of the viewer's own volume
  std::vector<Shown> shown_;                             // in the order in which they were added
  std::uint64_t last_id_ = 0;
  bool requests_due_ = false;        // the requests for grids are outdated
  bool waits_for_own_ = false;       // an instance waits for the volume's own grid, which is being built
  bool transforms_changed_ = false;  // since the last traced frame
  std::uint64_t settings_revision_ = 1;
  glm::uvec2 frame_size_{0U};  // image size of the last frame
  // In the volume's own world space, for volume_. It becomes the medium's once a grid has been built for it.
  std::optional<double> suggested_density_scale_;
  std::shared_ptr<Camera> previous_camera_;
  std::shared_ptr<void> previous_listener_;
  double previous_seconds_ = 0.0;
  std::vector<scene::InstanceTransform> previous_transforms_;
  std::optional<ViewFrame> previous_view_;  // view of previous_camera_
  std::optional<ViewFrame> view_;           // of the last frame
  std::optional<ViewFrame> traced_view_;    // of the last traced frame
  std::optional<ViewFrame> last_view_;      // of the traced frame before it
  struct BuildView {
    ViewFrame view;
    glm::uvec2 size{0U};
    std::vector<scene::InstanceTransform> transforms;
    bool operator==(const BuildView&) const = default;
  };
  [[nodiscard]] BuildView build_view() const { return {*view_, frame_size_, transforms_}; }
  std::optional<BuildView> built_for_;  // camera-adaptive: view of the last request
  bool built_in_motion_ = false;        // that request kept cells of the previous grid
  bool own_left_out_ = false;           // that request left out the viewer's own volume, because a load may replace it
  render::Totals totals_;

  // Throw Error(invalid_argument) if the viewer shows none.
  [[nodiscard]] const SequenceFeed& own_sequence();
  [[nodiscard]] const DynamicFeed& own_live();
  // Throw Error(invalid_argument) for an instance that the viewer does not show, or that has no sequence.
  [[nodiscard]] std::vector<Shown>::iterator look_up(const Instance& instance);
  [[nodiscard]] const SequenceFeed& sequence_of(const Instance& instance);
  VolumeFeedPtr feed_;                // shown instead of a volume; null: none
  std::vector<VolumeFeedPtr> feeds_;  // of instances: sequences, then dynamic volumes
  DynamicGlBridge dynamic_gl_{[this] { notify(); }};
  std::uint64_t last_feed_ = 0;
  std::uint64_t last_taken_ = 0;

  std::shared_ptr<ResourceLimits> resource_limits_ = std::make_shared<ResourceLimits>();
  std::uint64_t max_gl_bytes_ = ResourceLimits::no_limit;
  bool cells_due_ = false;                          // limits changed, so the grid may need another number of cells
  std::optional<std::uint64_t> gl_beside_volumes_;  // GPU memory used by everything except volumes in the last frame
  bool cuts_own_ = false;                           // the running build coarsens the viewer's own grid to fit a limit
  std::size_t grids_ = 1;                           // number of grids that share the GPU memory for volumes equally
  std::uint64_t part_of_gl_ = ResourceLimits::no_limit;  // share of each grid when cells were last requested
  std::unique_ptr<Context> gl_;
  Jobs jobs_;  // its threads use the above
  SkyStage sky_{jobs_.environments, log_};
  ModelStage models_{jobs_.surfaces, jobs_.poses, reported_failures_, [this] { notify(); }};
};

}  // namespace cumulet::viewer
