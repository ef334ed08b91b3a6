#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <glm/glm.hpp>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/file_path.hpp"
#include "base/log.hpp"
#include "base/trace.hpp"
#include "denoise/network.hpp"
#include "scene/snapshot.hpp"
#include "viewer/builder.hpp"
#include "viewer/camera.hpp"
#include "viewer/context.hpp"
#include "viewer/environment_builder.hpp"
#include "viewer/frame_shelf.hpp"
#include "viewer/grid_shelf.hpp"
#include "viewer/instance.hpp"
#include "viewer/live_builder.hpp"
#include "viewer/navigation.hpp"
#include "viewer/pose_shelf.hpp"
#include "viewer/reported_failures.hpp"
#include "viewer/sequence.hpp"
#include "viewer/settings.hpp"
#include "viewer/surface_builder.hpp"

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
  std::optional<double> noise;  // unknown: nothing
  GlStrings strings;
};

/// The facade behind the C ABI: settings in, pictures out. Rebuilds what a change makes out of date, and nothing else.
/// Threads, context and GL state as cumulet.h says. Throws Error; a call that throws leaves the viewer as it was.
class Viewer {
 public:
  using GetProc = void* (*)(void* user, const char* name);
  /// restore_state: [GL] calls leave the GL state as they found it.
  /// sharing: of viewers that share programs; null: of its own.
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
  /// The newest volume; null if there is none.
  VolumeAssetPtr volume();
  /// What is known of the volume, or of the sequence; null if there is none.
  VolumeFactsPtr facts();
  /// Shows, in place of the volume, frames of it, as it stands at any time; null: none, and of one before nothing.
  void set_sequence(std::shared_ptr<Sequence> sequence);
  struct SequenceStatus {
    std::uint32_t asked = 0;      ///< the frame at which it stands
    double asked_position = 0.0;  ///< and the step, in frames
    std::optional<double> drawn;  ///< the step that is to be seen, likewise
    FrameShelf::Status frames;
    std::optional<double> density_scale;  ///< that suits all of them
  };
  /// Throws Error(invalid_argument) where the viewer shows no sequence; so does the next.
  SequenceStatus sequence();
  /// Why a frame cannot be shown.
  std::optional<Error> frame_failure(std::uint32_t frame);
  /// The same of an instance's. Both throw Error(invalid_argument) of one that the viewer does not show, or that
  /// follows no sequence.
  SequenceStatus sequence(const Instance& instance);
  std::optional<Error> frame_failure(const Instance& instance, std::uint32_t frame);
  /// Shows, in place of the volume, the newest state of it; null: none, and of one before nothing.
  void set_live(std::shared_ptr<Live> live);
  /// [GL] The next state of this, whoever shows it, from voxels in GL; of what changed, on top of the last.
  void set_live_gl(std::shared_ptr<Live> live, const render::GlState& state);
  struct LiveStatus {
    std::uint64_t handed = 0;       ///< the newest state's number; 0: none
    std::uint64_t ready = 0;        ///< of the one that was taken last
    std::uint64_t drawn = 0;        ///< that is to be seen
    std::uint64_t ready_count = 0;  ///< how many were taken
    std::uint64_t drawn_count = 0;  ///< how many of these were to be seen
  };
  /// Throws Error(invalid_argument) where the viewer shows no live volume.
  LiveStatus live();
  /// Of an instance's; throws likewise, for one that the viewer does not show, or that shows none.
  LiveStatus live(const Instance& instance);
  /// Where the volume stands, whichever it is: affine, from its own world, and once in each of these places, which are
  /// one at least. Moves what is there; a grid that suits a volume of that size no longer is built anew.
  void set_places(const std::vector<scene::Place>& places);
  [[nodiscard]] const std::vector<scene::Place>& places() const { return places_; }
  /// World bounds of a volume there.
  [[nodiscard]] Bounds bounds_of(const VolumeFacts& volume) const;
  /// Shows it beside the volume from now on, as it is at any time. Throws Error(invalid_argument) where it does.
  void add_instance(std::shared_ptr<Instance> instance);
  /// Throws Error(invalid_argument) where the viewer does not show it.
  void remove_instance(const Instance& instance);
  /// Shows it beside the surfaces from now on, as it is at any time. Throws Error(invalid_argument) where it does.
  void add_model(std::shared_ptr<ModelInstance> model);
  /// Throws Error(invalid_argument) where the viewer does not show it.
  void remove_model(const ModelInstance& model);
  void rebuild();
  struct Limits {
    unsigned threads = 0;                              ///< that work at a time; 0: as many as there are
    std::uint64_t memory_bytes = Allowance::no_limit;  ///< of volumes and grids in main memory
    std::uint64_t gl_bytes = Allowance::no_limit;      ///< beyond which no volume is uploaded
  };
  /// Of what is begun from now on.
  void set_limits(const Limits& limits);
  void cancel();
  /// Throws Status::failure, or Error(timeout).
  void wait(double timeout_ms);
  struct Status {
    /// Of the volume's jobs, else of the surfaces', else of the environment's, else uploading.
    Progress::Stage stage = Progress::Stage::idle;
    double fraction = 0.0;
    std::optional<Error> volume_failure;  ///< how the last job of each ended, if not well
    std::optional<Error> surfaces_failure;
    std::optional<Error> environment_failure;
    std::optional<Error> failure;  ///< the first of them, unless it was reported before other work began
  };
  [[nodiscard]] Status status() const;

  void load_surfaces(const FilePath& path);
  /// Shows these at once. Cancels a load under way.
  void show_surfaces(scene::ModelSourcePtr surfaces);
  /// Poses these, then shows them; null: none, at once. Cancels a load under way.
  void set_surfaces(SurfaceAssetPtr surfaces);
  /// The newest; null if there are none.
  SurfaceAssetPtr surfaces_asset();
  void set_surface_settings(const SurfaceSettings& settings);
  /// Looks through a camera of the newest surfaces. Throws Error(invalid_argument) if there is none such.
  void use_surface_camera(std::size_t index);

  void set_grid(const GridSettings& settings);
  void set_medium(const Medium& medium);
  void set_ramps(const Ramps& ramps);
  [[nodiscard]] const Ramps& ramps() const { return ramps_; }
  void set_light(const Light& light);
  void set_lamps(light::Lamps lamps);
  void load_environment(const FilePath& path);
  /// Null: the sky of the light. Cancels a load under way.
  void set_environment(light::EnvironmentPtr environment);
  void set_environment_settings(const EnvironmentSettings& settings);
  /// The newest; null if there is none.
  const light::EnvironmentPtr& environment();
  void set_ground(const GroundSettings& settings);
  void set_sampling(const Sampling& sampling);
  void set_display(const DisplaySettings& display);
  void set_camera(std::shared_ptr<Camera> camera);
  [[nodiscard]] const std::shared_ptr<Camera>& camera() const { return camera_; }
  /// Where the camera was a frame ago, so many seconds; null: where it is.
  void set_previous_camera(std::shared_ptr<Camera> camera, double seconds);
  /// And where the volume's first places were.
  void set_previous_places(std::vector<scene::Place> places);
  void set_navigation(const NavigationSettings& settings);
  bool input(const InputEvent& event);
  void frame_all();

  FrameResult render(const Frame& frame);
  /// Compiles and uses once the programs that frames like this need; all: compiles every other, too.
  WarmUp warm_up(const Frame& frame, bool all);
  Pick pick(double x, double y);
  MapResult update_map(const MapRequest& request);
  void drop_map(std::uint32_t slot);
  /// Throws Error(invalid_argument) without a volume.
  Bounds bounds();
  void read_light_group(std::uint32_t group, float* rgb, std::size_t count);
  void read_mattes(const MatteIdOf& id_of, std::uint32_t ranks, float* values, std::size_t count);
  void read_linear(float* rgba, std::size_t count);
  void read_display(std::uint8_t* rgba, std::size_t count);
  /// By the network in this file, which stays in memory. Throws Error(file) if it is none.
  void read_denoised(const char* network_file, float* rgba, std::size_t count);
  /// What read_display makes of this, as read_linear gives it.
  void encode_display(std::span<const float> linear, std::span<std::uint8_t> rgba) const;
  void read_aov(Aov aov, float* values, std::size_t count);
  std::optional<double> measure_noise();
  /// Of what read_accumulation gives. Both throw Error(invalid_argument) of what is no picture of samples alone.
  std::size_t accumulation_bytes();
  void read_accumulation(std::span<std::byte> bytes);
  /// Throws Error(invalid_argument), with the picture as it was, for what is not of such a picture.
  void restore_accumulation(std::span<const std::byte> bytes);
  Stats stats();

  /// Tells the host that there is something new. Coalesced; any thread.
  void notify();

  /// What the shaders were told of the picture under way; for tests.
  const core::CmParameters& trace_parameters();
  /// Where every dispatch of paths that ends is told, or null; for tests.
  void set_dispatch_log(std::vector<render::DispatchRecord>* log) { gl().progressive().tracer().set_log(log); }
  /// Pages of cell records end after so many texels; 0: at the driver's limit; for tests.
  void set_page_texels(std::int64_t texels) { page_texels_ = texels; }

 private:
  [[nodiscard]] Context& gl() const;
  // A setting changed.
  void touch();
  // How the last work of each kind of content ended. Any thread.
  [[nodiscard]] ContentFailures failures() const;
  // What the light and the environment make of the scene's.
  void surround();
  // What a physical sky is to be of.
  [[nodiscard]] std::optional<light::Day> day() const;
  void show_environment(light::EnvironmentPtr environment);
  // Whether workers have anything under way, or made what nobody took.
  [[nodiscard]] bool busy() const;
  // The same of those that make grids.
  [[nodiscard]] bool builds() const;
  // Runs a [GL] call's body between state guard and error handling.
  template <class Body>
  void with_gl(Body&& body);
  void sync();
  // The sequence's newest wish, and what came of it.
  void follow_sequence();
  void take_frame();
  // Those of instances, and their live volumes.
  void wish_for_sequences();
  void follow_played();
  // The stand-in of a load under way, which goes with it.
  void follow_stand_in();
  // Asks for cells that limits allow, where those that are shown are more, or fewer than there could be.
  void fit_cells();
  void drop_stand_in();
  // Of what is shown of the volume: of its stand-in, as long as there is one.
  [[nodiscard]] const VolumeFactsPtr& seen_facts() const { return stand_in_ ? stand_in_->facts : facts_; }
  // Those of a sequence, and of a live volume: neither is shown any more.
  void leave_sequence();
  // Takes states that are ready; unseen: though those before were not seen yet.
  void follow_live(bool unseen = false);
  void follow_watching(bool unseen = false);
  // Whether what was taken last was seen, where pictures are to be seen at all.
  [[nodiscard]] bool is_seen(const std::optional<scene::SequenceFrame>& taken, bool is_rendered) const;
  // Before a sequence or a live volume is shown, or is not any more. Returns whether one is to be.
  bool begin_anew(bool shows, bool showed);
  // It is this one, or none, from now on.
  void take_volume(VolumeAssetPtr volume);
  // The density scale that was suggested is the medium's, with the first grid that was made for it.
  void take_suggestion();
  // concerned: volumes that are not, whatever they are, are left as they are.
  void request_build(bool (*concerned)(const VolumeAsset&) = nullptr);
  // What grids to come know of the medium.
  void take_medium();
  // How much a length of the volume's own grows where it stands largest.
  [[nodiscard]] double stretch() const;
  // Of a unit of length in the volume's own world.
  [[nodiscard]] double density_scale_to_come() const;
  // Whether grids are fitted to what is hidden, and more of it is now, or less.
  [[nodiscard]] bool other_opacity() const;
  // As it is seen: until the volume is there with the density scale that is suggested for its stand-in.
  [[nodiscard]] Medium seen_medium() const;
  // What pictures to come know of it.
  void show_medium();
  [[nodiscard]] scene::Emission field_emission() const;
  // Once of a grid, however many volumes have it.
  void remark_on_anisotropy();
  // Nothing where the grid depends on the view: the next frame asks for it.
  [[nodiscard]] std::optional<BuildSettings> settings_at_once() const;
  [[nodiscard]] BuildSettings settings_for_view() const;
  // Whether a grid for another view than the last frame's is what there is, or comes.
  [[nodiscard]] bool built_for_another() const;
  [[nodiscard]] grid::RefineCamera refine_camera() const;
  // What a frame needs before anything is uploaded.
  void prepare(const Frame& frame);
  // Takes voxels from GL that are there.
  static void follow_transfers(Context& g, double budget_ms);
  // Of live volumes that are in GL: what they give off is found, what is needed in main memory brought there.
  void tend_voxels_in_gl(Context& g);
  // Whether there is any such thing to do.
  [[nodiscard]] bool voxels_in_gl_wait(Context& g) const;
  static void bring_back(Context& g, const std::shared_ptr<Live>& live, const std::vector<volume::Channel>& channels);
  // Where a state of a live volume stands that stays in GL; none: it does not.
  static std::optional<glm::dmat4> place_in_gl(Context& g, const std::shared_ptr<Live>& live,
                                               const render::GlState& state);
  static void make_products(Context& g, const std::shared_ptr<Live>& live);
  // Of its newest state bricks that are scattered.
  static void gather(Context& g, Live& live);
  // From now on.
  void tend(const std::shared_ptr<Live>& live);
  // What status() and stats() tell of it.
  void follow_upload(const Context& g);
  // Of grids that GL built, once they are there.
  void take_cells(const Context& g);
  // Tells builds what of GL memory the last frame left for volumes.
  void share_gl();
  // And where limits are others, or grids more or fewer, cells that are there.
  void share_gl_anew();
  // Whether a grid has as many cells as its part of GL memory takes.
  [[nodiscard]] bool fits(const Built& built) const;
  // Of what is shown, this sequence's.
  [[nodiscard]] static std::optional<scene::SequenceFrame> frame_of(const Context& g, std::uint64_t sequence);
  // A sequence that is followed: what was asked for, and taken.
  struct Followed {
    std::shared_ptr<Sequence> sequence;
    std::shared_ptr<void> listener;
    std::uint64_t revision = 0;             // of what was wished last
    std::optional<BuildSettings> settings;  // none: they wait for a view
    SequenceState state;
    std::optional<double> density_scale;  // that suits it, once it is judged
    bool wish_due = true;
    std::uint64_t shelved = 0;  // of its shelf, when it was last looked at
    bool take_due = false;
    std::uint64_t id = 0;                       // of this following
    std::optional<scene::SequenceFrame> frame;  // that was taken last
    bool is_wanted = false;                     // that one is all that there is to come
    bool is_rendered = false;                   // by a frame, since

    // Whether there is something to come for it.
    [[nodiscard]] bool waits(const FrameShelf& shelf) const {
      return !is_wanted && (wish_due || shelf.busy() || shelf.revision() != shelved);
    }
  };
  [[nodiscard]] Followed follow(std::shared_ptr<Sequence> sequence, std::optional<BuildSettings> settings);
  // Tells the shelf of its newest wish, and looks what is there.
  void tell_wish(Followed& f, FrameShelf& shelf) const;
  // What was taken last of all that plays is in this frame.
  void note_rendered();
  // Whether a frame or a state is ready, and not taken until the one before is seen.
  [[nodiscard]] bool something_waits() const;
  // What is to be shown of it now, if that may change.
  [[nodiscard]] std::optional<FrameShelf::Ready> take(Followed& f, const FrameShelf& shelf) const;
  // It is this from now on. Returns false if it was.
  bool note_taken(Followed& f, const FrameShelf::Ready& ready, const scene::MarchSourcePtr& before);
  [[nodiscard]] SequenceStatus status_of(const Followed& f, const FrameShelf& shelf) const;
  // One that instances follow, those of one whose grids are the same.
  struct Played {
    Played(Followed wished, const Log& log, std::function<void()> notify, Trace trace, AllowancePtr allowance)
        : followed(std::move(wished)), shelf(log, std::move(notify), trace, std::move(allowance)) {}
    Followed followed;
    VolumeFactsPtr facts;        // once it is judged
    std::optional<Built> built;  // of the frame that was taken last
    FrameShelf shelf;

    static const std::shared_ptr<Sequence>& source_of(const InstanceSettings& settings) { return settings.sequence; }
    [[nodiscard]] const std::shared_ptr<Sequence>& source() const { return followed.sequence; }
    void configure(const std::optional<BuildSettings>& wanted);
  };
  using PlayedPtr = std::shared_ptr<Played>;
  struct Shown;
  // A live volume that is followed: what was taken of it, and seen.
  struct Watched {
    std::shared_ptr<Live> live;
    std::shared_ptr<void> listener;
    VolumeFactsPtr facts;                       // of all states, if bounds are known
    std::uint64_t id = 0;                       // of this watching
    std::optional<scene::SequenceFrame> state;  // that was taken last
    bool is_rendered = false;                   // by a frame, since
    bool waits = false;                         // another is ready, and not taken until it is seen
    std::uint64_t seen_last = 0;                // as scene::SequenceFrame::taken
    LiveStatus told;

    [[nodiscard]] LiveStatus status() const;
  };
  // The builder is told of states as long as the watching lasts.
  [[nodiscard]] Watched watch(std::shared_ptr<Live> live, LiveBuilder& builder);
  [[nodiscard]] std::optional<LiveBuilder::Ready> take_state(Watched& w, LiveBuilder& builder, bool unseen);
  // What this frame's picture is of.
  static void note_drawn(const Context& g, Watched& w);
  // One that instances follow, those of one whose grids are the same.
  struct Watching {
    Watching(const Log& log, std::function<void()> notify, Trace trace, AllowancePtr allowance)
        : builder(log, std::move(notify), trace, std::move(allowance)) {}
    LiveBuilder builder;
    Watched watched;  // whose listener tells the builder
    std::optional<BuildSettings> settings;
    std::optional<Built> built;  // of the state that was taken last

    static const std::shared_ptr<Live>& source_of(const InstanceSettings& settings) { return settings.live; }
    [[nodiscard]] const std::shared_ptr<Live>& source() const { return watched.live; }
    void configure(const std::optional<BuildSettings>& wanted);
    [[nodiscard]] VolumeFactsPtr facts() const {
      if (watched.facts) return watched.facts;
      return built ? built->volume->facts() : nullptr;
    }
  };
  using WatchingPtr = std::shared_ptr<Watching>;
  // Who plays it, or watches it, from now on.
  PlayedPtr player_of(const std::shared_ptr<Sequence>& sequence, const std::optional<BuildSettings>& settings);
  WatchingPtr player_of(const std::shared_ptr<Live>& live, const std::optional<BuildSettings>& settings);
  // One for all instances that can share it: each goes on with what one of them had.
  template <class Player>
  void share(std::vector<std::shared_ptr<Player>>& players, std::shared_ptr<Player> Shown::*place);
  // An instance that is shown, as it was when it was last looked at.
  struct Shown {
    std::shared_ptr<Instance> instance;
    std::uint64_t id = 0;
    std::shared_ptr<void> listener;
    std::uint64_t revision = 0;
    InstanceSettings settings;
    scene::Part<scene::Medium> medium;
    std::optional<GridShelf::Wish> wish;
    std::optional<GridShelf::Wish> begun;  // the last before it that was being built
    std::optional<Built> built;            // the newest
    PlayedPtr played;                      // of a sequence; null: of none
    WatchingPtr watching;                  // of a live volume; likewise
    void forget() {
      wish.reset();
      begun.reset();
      built.reset();
      played.reset();
      watching.reset();
    }
    [[nodiscard]] bool has_anything() const { return settings.volume || settings.sequence || settings.live; }
    [[nodiscard]] bool is_seen() const { return has_anything() && !settings.hidden; }
    // Null: nothing is known of it yet.
    [[nodiscard]] VolumeFactsPtr facts() const {
      if (settings.volume) return settings.volume->facts();
      if (watching) return watching->facts();
      return played ? played->facts : nullptr;
    }
    [[nodiscard]] bool is_there() const { return is_seen() && facts(); }
    // Of a sequence, or a live volume, that its grid is of.
    [[nodiscard]] std::optional<scene::SequenceFrame> frame() const {
      const auto current = [&](const auto& player) {
        return player && player->built && built && built->source == player->built->source;
      };
      if (current(watching)) return watching->watched.state;
      return current(played) ? played->followed.frame : std::nullopt;
    }
  };
  // A model that is shown, likewise.
  struct ShownModel {
    std::shared_ptr<ModelInstance> model;
    std::uint64_t id = 0;
    std::shared_ptr<void> listener;
    std::uint64_t revision = 0;
    ModelSettings settings;
    std::optional<PoseShelf::Wish> wish;
    std::optional<PoseShelf::Wish> begun;   // the last before it that was being posed
    scene::ModelSourcePtr source;           // the newest; null: none yet
    scene::ModelSourcePtr previous_source;  // of a frame ago; null: as this
    [[nodiscard]] bool is_wanted() const { return settings.surfaces && !settings.hidden; }
    [[nodiscard]] bool is_shown() const { return is_wanted() && source; }
  };
  std::vector<ShownModel>::iterator find(const ModelInstance& model);
  // The host's, of an instance or a model that is shown; 0 of the viewer's own.
  [[nodiscard]] std::uint64_t tag_of(std::uint64_t id) const;
  void follow_models();
  // Their poses, as far as they are there.
  void follow_poses();
  // What it was a frame ago; none: as now.
  [[nodiscard]] static std::optional<PoseShelf::Wish> previous_pose(const ShownModel& shown);
  // Where the shutter opens.
  [[nodiscard]] std::optional<scene::PlaceEnds> while_open(const std::optional<scene::PlaceEnds>& ends) const;
  // Likewise, where surfaces may move; null: those that are to be read.
  [[nodiscard]] SurfaceChoice while_open(SurfaceChoice choice, const SurfaceAssetPtr& surfaces) const;
  // Begins to pose the viewer's own.
  void pose_surfaces();
  // All that are there, the viewer's own among them.
  [[nodiscard]] std::vector<scene::Model> models() const;
  std::vector<Shown>::iterator find(const Instance& instance);
  void follow_instances();
  // Where grids depend on the view, there has to be one.
  [[nodiscard]] BuildSettings settings_of(const Shown& shown) const;
  void wish_for_grids();
  // A wish that a grid serves that is there, or is wished for, becomes that one's.
  void reuse_grid(GridShelf::Wish& wish) const;
  // Of all that there are.
  [[nodiscard]] std::optional<Built> grid_of(const GridShelf::Wish& wish) const;
  void take_grids();
  // Whether its grid is about to be another for others' sake, or for a smaller cap's.
  [[nodiscard]] bool makes_room(const Shown& shown) const;
  // Whether a grid of one is there.
  [[nodiscard]] bool shows_instances() const;
  // Grids of one march and kind of cells are shown together.
  void keep_to_one_march(std::vector<scene::Volume>& volumes) const;
  // Under a cap that is too small for all that there are grids go together, and others come with those that are
  // coarser.
  void keep_until_cells_are_cut(std::vector<scene::Volume>& volumes) const;
  // The snapshot's volumes.
  void show_volumes();
  // The scene as it is now: the last snapshot, if nothing changed.
  scene::SnapshotPtr snapshot();
  Shot shot();
  [[nodiscard]] std::optional<Bounds> box() const;
  // World bounds of each thing that is shown.
  [[nodiscard]] std::vector<Bounds> boxes() const;
  // Where the scene counts from.
  [[nodiscard]] glm::dvec3 scene_origin(const std::vector<Bounds>& boxes,
                                        const std::optional<scene::Ground>& ground) const;
  // Warns once of each scene whose numbers lack precision.
  void remark_on_precision();
  // Warns of samples that were not finite: once a picture, or once at all where previews are on.
  void remark_on_samples(Context& g);
  // The snapshot's volumes and lamps from there.
  void count_from(const glm::dvec3& origin);
  [[nodiscard]] bool shows_triangles() const;
  [[nodiscard]] bool shows_models() const;
  // all: box().
  [[nodiscard]] std::optional<scene::Ground> ground(const std::optional<Bounds>& all) const;
  /// What cameras fit; good for as long as nothing changes.
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

  GridSettings grid_;
  Medium medium_;
  Ramps ramps_;
  Light light_;
  std::optional<light::Day> asked_day_;      // of a sky under way
  std::optional<light::Daylight> daylight_;  // of the physical sky that is shown
  light::EnvironmentPtr environment_;        // the host's, newest
  EnvironmentSettings environment_settings_;
  GroundSettings ground_;
  SurfaceSettings surface_settings_;
  SurfaceAssetPtr surface_asset_;       // newest
  scene::ModelSourcePtr model_source_;  // newest that is posed
  Sampling sampling_;
  DisplaySettings display_;
  denoise::NetworkPtr network_;          // the last that a picture was denoised by...
  std::filesystem::path denoiser_file_;  // ...of this file
  std::shared_ptr<Camera> camera_;
  std::shared_ptr<void> camera_listener_;
  Navigation navigation_;
  std::chrono::steady_clock::time_point last_frame_time_{};

  VolumeAssetPtr volume_;                           // newest; of a sequence, of the frame taken last, if it is there
  VolumeFactsPtr facts_;                            // of it, or of the sequence
  VolumeAssetPtr empty_volume_;                     // where there are surfaces alone
  std::optional<std::string> remarked_anisotropy_;  // the grid, as long as it is not shown
  std::optional<StandIn> stand_in_;                 // in its place, and of what was shown before, while it is loaded
  Built built_;                                     // newest, and what is uploaded again in a new context
  scene::Snapshot scene_;                           // as it is now: of it snapshots are made
  scene::SnapshotPtr snapshot_;                     // the newest
  light::Lamps lamps_;                              // the host's
  bool lamps_due_ = false;                          // the snapshot has others
  std::vector<std::weak_ptr<const surface::Scene>> remarked_scenes_;
  std::optional<std::uint64_t> remarked_picture_;  // the last whose samples were warned of
  std::vector<scene::Place> places_{1};            // of the volume; one at least
  scene::Part<scene::Medium> shown_medium_;        // its own
  std::vector<Shown> shown_;                       // in the order in which they were added
  std::vector<ShownModel> shown_models_;           // likewise
  std::uint64_t posed_ = 0;                        // of poses_, when it was last looked at
  std::uint64_t last_id_ = 0;
  std::uint64_t shelved_ = 0;    // of shelf_, when it was last looked at
  bool poses_due_ = false;       // what is wished of poses_ is to be told anew
  bool wishes_due_ = false;      // likewise of shelf_
  bool waits_for_own_ = false;   // the volume's own grid, which is being built, may serve for others
  bool places_changed_ = false;  // since the last frame that traced
  std::uint64_t settings_revision_ = 1;
  glm::uvec2 frame_size_{0U};  // of the last frame's picture
  // Of its own world; volume_ was loaded with it; the medium's once its grid is there.
  std::optional<double> suggested_density_scale_;
  std::shared_ptr<Camera> previous_camera_;
  std::shared_ptr<void> previous_listener_;
  double previous_seconds_ = 0.0;
  std::vector<scene::Place> previous_places_;
  std::optional<ViewFrame> previous_view_;  // by that camera
  std::optional<ViewFrame> view_;           // of the last frame
  std::optional<ViewFrame> traced_view_;    // of the last frame that traced
  std::optional<ViewFrame> last_view_;      // of the one before it
  struct BuildView {
    ViewFrame view;
    glm::uvec2 size{0U};
    std::vector<scene::Place> places;
    bool operator==(const BuildView&) const = default;
  };
  [[nodiscard]] BuildView build_view() const { return {*view_, frame_size_, places_}; }
  std::optional<BuildView> built_for_;  // camera-adaptive: what the grid was last asked for
  bool built_in_motion_ = false;        // for that, with cells that were there before
  bool own_left_out_ = false;           // of that the viewer's own volume: a file was read that may take its place
  render::Totals totals_;

  [[nodiscard]] Followed& followed();
  // Throw Error(invalid_argument) for an instance that the viewer does not show, or that follows no sequence.
  [[nodiscard]] std::vector<Shown>::iterator look_up(const Instance& instance);
  [[nodiscard]] const Shown& shown_sequence(const Instance& instance);
  std::optional<Followed> followed_;  // that is shown in place of a volume
  [[nodiscard]] Watched& watched();
  std::optional<Watched> watched_;  // a live volume that is
  // Whose voxels this context may have.
  struct InGl {
    std::weak_ptr<Live> live;
    std::array<std::shared_ptr<void>, 2> listeners;  // to who needs voxels, or what is given off
    // Of these it was tried, or is: what fails is not tried again.
    std::weak_ptr<const scene::StateInGl> brought, made;
    std::vector<scene::Emission> made_by;
    // Of its newest state, which this context has: in main memory, or what is made of it.
    [[nodiscard]] bool needs_values(Context& g, const scene::StateInGlPtr& state) const;
    [[nodiscard]] bool needs_products(const scene::StateInGlPtr& state) const;
  };
  std::vector<InGl> lives_in_gl_;
  std::uint64_t last_followed_ = 0;
  std::uint64_t last_taken_ = 0;

  std::shared_ptr<Allowance> allowance_ = std::make_shared<Allowance>();
  std::uint64_t most_gl_bytes_ = Allowance::no_limit;
  bool cells_due_ = false;                          // limits are others, and the grid's cells may have to be
  std::optional<std::uint64_t> gl_beside_volumes_;  // by the last frame
  bool cuts_own_ = false;                           // what is built is the viewer's own, of other cells for a cap
  std::size_t grids_ = 1;                           // that share what there is for volumes, each with as much of it
  std::uint64_t part_of_gl_ = Allowance::no_limit;  // of each, since that was last asked for
  std::unique_ptr<Context> gl_;
  Builder builder_;  // these last: their threads use the above
  SurfaceBuilder surface_builder_;
  EnvironmentBuilder environment_builder_;
  GridShelf shelf_;
  PoseShelf poses_;
  FrameShelf frames_;
  LiveBuilder lives_;
  mutable std::mutex played_mutex_;  // between the host's thread, which alone changes them, and others that look
  std::vector<PlayedPtr> played_;
  std::vector<WatchingPtr> watching_;
};

}  // namespace cumulet::viewer
