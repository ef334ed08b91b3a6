#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "base/file_path.hpp"
#include "base/log.hpp"
#include "base/trace.hpp"
#include "denoise/network_cache.hpp"
#include "denoise/oidn_cache.hpp"
#include "jobs/jobs.hpp"
#include "stage/stage.hpp"
#include "viewer/attached_context.hpp"
#include "viewer/context.hpp"
#include "viewer/dynamic_gl_bridge.hpp"
#include "viewer/settings.hpp"
#include "viewer/state_lock.hpp"
#include "viewer/update_callback.hpp"

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
  std::uint64_t cell_viewers = 0;
  std::uint64_t steps = 0;
  std::optional<double> noise;  // nullopt: unknown
  GlStrings strings;
};

/// The implementation behind the C ABI: takes settings, renders images. A change causes only the rebuilds that it
/// requires. GL context and GL state: see cumulet.h. Functions throw Error; a call that throws leaves the viewer
/// unchanged.
///
/// Threads: status() and cancel() may be called at any time. Calls that use the context wait for each other, and hold
/// the state lock only while they take or update the state. For all other calls, except those for tests, the caller
/// holds the state lock if other threads may call.
class Viewer final : private StageHost {
 public:
  using GetProc = AttachedContext::GetProc;
  /// restore_state: [GL] calls restore the GL state that they found. sharing: resources of viewers that share shader
  /// programs; null: its own.
  Viewer(Log log, std::function<void()> update, bool restore_state, Trace trace = {},
         std::shared_ptr<Sharing> sharing = nullptr);
  ~Viewer() override;
  Viewer(const Viewer&) = delete;
  Viewer& operator=(const Viewer&) = delete;

  /// Locks the state of settings and input. Calls that use the context must not be made under it, nor wait() and
  /// encode_display().
  [[nodiscard]] StateLock::Held hold_state() const { return StateLock::Held(state_); }

  void attach(GetProc get_proc, void* user);
  void detach();
  void context_lost();
  [[nodiscard]] bool attached() const { return gl_.find() != nullptr; }

  void load_volume(const VolumeFile& file) { stage_.volumes.load_volume(file); }
  void set_volume(VolumeAssetPtr volume) { stage_.volumes.set_volume(std::move(volume)); }
  /// Returns the newest volume; null if there is none.
  VolumeAssetPtr volume();
  /// Returns the metadata of the volume or the sequence; null if there is none.
  VolumeInfoPtr volume_info();
  /// As VolumeStage::interpolation().
  std::optional<grid::Interpolation> interpolation();
  /// Shows the current frame of a sequence instead of the volume. Null: removes the sequence that is shown, if any.
  void set_sequence(std::shared_ptr<Sequence> sequence) { stage_.volumes.set_sequence(std::move(sequence)); }
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
  void set_live(std::shared_ptr<Live> live) { stage_.volumes.set_live(std::move(live)); }
  /// [GL] Submits the next state of a dynamic volume from voxels in GL. `live` need not be shown by this viewer. state:
  /// a complete state, or the changes to the last one.
  void set_live_gl(std::shared_ptr<Live> live, const render::GlState& state);
  using LiveStatus = DynamicFeed::Status;
  /// Throws Error(invalid_argument) if the viewer shows no dynamic volume.
  LiveStatus live() { return stage_.volumes.own_live().status(); }
  /// Throws Error(invalid_argument) for an instance that the viewer does not show or that has no dynamic volume.
  LiveStatus live(const Instance& instance) { return stage_.volumes.live_of(instance).status(); }
  /// Sets the instance transforms of the viewer's own volume, sequence or dynamic volume: affine, from its own world
  /// space; at least one. A grid that does not suit the new scale is rebuilt.
  void set_transforms(const std::vector<scene::InstanceTransform>& transforms) {
    stage_.volumes.set_transforms(transforms);
  }
  [[nodiscard]] const std::vector<scene::InstanceTransform>& transforms() const { return stage_.volumes.transforms(); }
  /// World bounds of all instances of a volume.
  [[nodiscard]] Bounds bounds_of(const VolumeInfo& volume) const { return stage_.volumes.bounds_of(volume); }
  /// Shows an instance with its current settings, beside the viewer's own volume. Throws Error(invalid_argument) if it
  /// is shown already.
  void add_instance(std::shared_ptr<Instance> instance) { stage_.add_instance(std::move(instance)); }
  /// Throws Error(invalid_argument) if the viewer does not show it.
  void remove_instance(const Instance& instance) { stage_.volumes.remove_instance(instance); }
  /// Shows a model with its current settings, beside the viewer's own surfaces. Throws Error(invalid_argument) if it is
  /// shown already.
  void add_model(std::shared_ptr<ModelInstance> model) { stage_.add_model(std::move(model)); }
  /// Throws Error(invalid_argument) if the viewer does not show it.
  void remove_model(const ModelInstance& model) { stage_.models.remove_model(model); }
  void rebuild() { stage_.rebuild(); }
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

  void load_surfaces(const FilePath& path) { stage_.models.load_surfaces(path); }
  /// Shows these at once. Cancels a running load.
  void show_surfaces(scene::ModelSourcePtr surfaces) { stage_.models.show_surfaces(std::move(surfaces)); }
  /// Poses these, then shows them. Null: removes the surfaces at once. Cancels a running load.
  void set_surfaces(SurfaceAssetPtr surfaces) { stage_.models.set_surfaces(std::move(surfaces)); }
  /// Returns the newest surfaces; null if there are none.
  SurfaceAssetPtr surfaces_asset() { return stage_.models.surfaces_asset(); }
  void set_surface_settings(const SurfaceSettings& settings) { stage_.models.set_surface_settings(settings); }
  /// Copies a camera of the newest surfaces to the viewer's. Throws Error(invalid_argument) if it does not exist.
  void use_surface_camera(std::size_t index) { stage_.use_surface_camera(index); }

  void set_grid(const GridSettings& settings) { stage_.volumes.set_grid(settings); }
  void set_medium(const Medium& medium) { stage_.volumes.set_medium(medium); }
  void set_ramps(const Ramps& ramps) { stage_.volumes.set_ramps(ramps); }
  [[nodiscard]] const Ramps& ramps() const { return stage_.volumes.ramps(); }
  /// Clips the viewer's own volume, sequence or dynamic volume. No grid is rebuilt.
  void set_clip(scene::ClipPlanes clip) { stage_.volumes.set_clip(std::move(clip)); }
  void set_light(const Light& light) { stage_.sky.set_light(light); }
  void set_lights(light::AnalyticLights lights) { stage_.sky.set_lights(std::move(lights)); }
  void load_environment(const FilePath& path) { stage_.sky.load_environment(path); }
  /// Null: the sky of the light settings. Cancels a running load.
  void set_environment(light::EnvironmentPtr environment) { stage_.sky.set_environment(std::move(environment)); }
  void set_environment_settings(const EnvironmentSettings& settings) { stage_.sky.set_environment_settings(settings); }
  /// Returns the newest environment; null if there is none.
  const light::EnvironmentPtr& environment() { return stage_.sky.environment(); }
  void set_ground(const GroundSettings& settings) { stage_.sky.set_ground(settings); }
  void set_sampling(const Sampling& sampling);
  /// The LUT of the settings is ignored.
  void set_display(const DisplaySettings& display);
  /// Null: none.
  void set_display_lut(render::DisplayLutPtr lut);
  void set_camera(std::shared_ptr<Camera> camera) { stage_.camera.set_camera(std::move(camera)); }
  [[nodiscard]] const std::shared_ptr<Camera>& camera() const { return stage_.camera.camera(); }
  /// Sets the camera of the previous frame, `seconds` ago; null: the camera has not moved.
  void set_previous_camera(std::shared_ptr<Camera> camera, double seconds) {
    stage_.camera.set_previous_camera(std::move(camera), seconds);
  }
  /// Sets the previous transforms of the volume's first instances.
  void set_previous_transforms(std::vector<scene::InstanceTransform> transforms) {
    stage_.volumes.set_previous_transforms(std::move(transforms));
  }
  void set_navigation(const NavigationSettings& settings) { stage_.camera.set_navigation(settings); }
  bool input(const InputEvent& event) { return stage_.input(event); }
  void frame_all() { stage_.frame_all(); }

  FrameResult render(const Frame& frame);
  /// Compiles the programs that frames like this need and uses each once. all: also compiles all other programs.
  WarmUp warm_up(const Frame& frame, bool all);
  Pick pick(double x, double y);
  MapResult update_map(const MapRequest& request);
  void drop_map(std::uint32_t slot);
  /// Throws Error(invalid_argument) without a volume or surfaces.
  Bounds bounds() { return stage_.bounds(); }
  void read_light_group(std::uint32_t group, float* rgb, std::size_t count);
  void read_mattes(const MatteIdOf& id_of, std::uint32_t ranks, float* values, std::size_t count);
  void read_linear(float* rgba, std::size_t count);
  /// Begins to read without waiting; returns the number of the read.
  std::uint64_t begin_read(const ReadRequest& request);
  /// values: receives the values if they are ready, which ends the read; null: none.
  ReadState finish_read(std::uint64_t read, float* values, std::size_t count);
  void cancel_read(std::uint64_t read);
  void read_display(std::uint8_t* rgba, std::size_t count);
  /// network_file: denoiser weights, which stay in memory; null: use the real-time filter. oidn_library: is used in its
  /// place on drivers that compute on the CPU, if it can be used; null: none. Throws Error(file) if the weights are
  /// invalid.
  void read_denoised(const char* network_file, const char* oidn_library, float* rgba, std::size_t count);
  /// Converts the result of read_linear() to the result of read_display().
  void encode_display(std::span<const float> linear, std::span<std::uint8_t> rgba) const;
  void read_aov(Aov aov, float* values, std::size_t count);
  std::optional<double> measure_noise();
  /// Size of the data that read_accumulation() writes. Both throw Error(invalid_argument) for images with previews and
  /// for debug views.
  std::size_t accumulation_bytes();
  /// needed: receives the size of the data, also if `bytes` is too small; null: it is not wanted.
  void read_accumulation(std::span<std::byte> bytes, std::size_t* needed = nullptr);
  /// Throws Error(invalid_argument) for data of another image, and then leaves the image unchanged.
  void restore_accumulation(std::span<const std::byte> bytes);
  Stats stats();

  /// Calls the host's update callback. Calls are coalesced. Thread-safe.
  void notify() override { state_.notify(); }

  /// Returns the shader parameters of the current image; for tests.
  const core::CmParameters& trace_parameters();
  /// Sets a list that receives every completed path-tracing dispatch, or null; for tests.
  void set_dispatch_log(std::vector<render::DispatchRecord>* log) { gl_.get().progressive().tracer().set_log(log); }
  /// Limits the texels per page of cell records; 0: the driver's limit; for tests.
  void set_page_texels(std::int64_t texels) { upload_limits_.page_texels = texels; }
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
  // Runs `body` in the context, after the calls of other threads that use it.
  void in_context(const std::function<void(Context&)>& body);
  // Updates the copy of the context's state for other threads. The caller holds the state lock.
  void take_frames();
  // True if a worker is busy or has a result that has not been taken.
  [[nodiscard]] bool busy() const { return jobs_.busy() || stage_.volumes.frames_are_due(); }
  void sync() override { stage_.sync(); }
  void touch() override;
  [[nodiscard]] bool is_displayed(const scene::SequenceFrame& frame, bool is_rendered) const override;
  void track(const std::shared_ptr<Live>& live) override { dynamic_gl_.track(live); }
  [[nodiscard]] SequenceStatus status_of(const SequenceFeed& feed) const;
  // Prepares a frame before uploads. The caller holds the state lock.
  void prepare(const Frame& frame);
  // Takes the state as it is now. The caller holds the state lock.
  [[nodiscard]] Shot shot();
  // Does so, with the lock.
  [[nodiscard]] Shot shot_now();
  [[nodiscard]] DisplaySettings display_now() const;
  // Prepares a frame and takes its state. is_rendered: the frame will show the volumes' states, so newer ones may
  // follow.
  void take_state(const Frame& frame, bool is_rendered, Shot& shot, Context::UploadLimits& limits);
  // Records the displayed frames, and fills in the flags about pending work.
  void finish_frame(Context& g, FrameResult& result);
  // Updates the upload progress for status() and stats().
  void follow_upload(const Context& g);
  // Takes the cell counts of GPU-built grids once they are built.
  void take_cells(const Context& g);
  // Fills in the flags about pending work and failures.
  void report_pending(FrameResult& result);
  // Logs a warning about non-finite samples: once per image, or only once if previews are on.
  void remark_on_samples(Context& g, const Shot& shot);

  UpdateCallback update_;
  mutable StateLock state_;
  std::mutex context_mutex_;                       // of gl_; locked before state_
  std::chrono::steady_clock::time_point entered_;  // when the running call got context_mutex_
  Log log_;
  Trace trace_;
  mutable ReportedFailures reported_failures_;
  std::atomic<double> upload_progress_ = 1.0;
  Context::UploadLimits upload_limits_{.max_bytes = ResourceLimits::no_limit};
  std::optional<SimulatedGl> simulated_gl_;
  std::optional<FramesInContext> frames_;  // nullopt: no context
  Sampling sampling_;
  DisplaySettings display_;
  denoise::NetworkCache networks_;
  denoise::OidnCache oidn_;
  std::optional<std::uint64_t> remarked_picture_;  // the last image with a warning about its samples
  render::Totals totals_;
  std::uint64_t last_read_ = 0;  // number of the last begin_read()
  DynamicGlBridge dynamic_gl_{[this] { notify(); }};
  std::shared_ptr<ResourceLimits> resource_limits_ = std::make_shared<ResourceLimits>();
  AttachedContext gl_;
  Jobs jobs_;  // its threads use the above
  Stage stage_;
};

}  // namespace cumulet::viewer
