#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "assets/camera.hpp"
#include "assets/instance.hpp"
#include "base/log.hpp"
#include "jobs/jobs.hpp"
#include "scene/snapshot.hpp"
#include "stage/asset_feed.hpp"
#include "stage/dynamic_feed.hpp"
#include "stage/file_feed.hpp"
#include "stage/gl_budget.hpp"
#include "stage/sequence_feed.hpp"
#include "stage/settings.hpp"
#include "stage/shared_item.hpp"
#include "stage/stage_host.hpp"

namespace cumulet::viewer {

/// Counts of all displayed grids.
struct GridTotals {
  std::uint64_t cells = 0;
  std::uint32_t levels = 0;
  bool limited = false;
  std::uint64_t memory_bytes = 0;  ///< of volumes and grids
  std::uint64_t active_voxels = 0;

  void add(std::uint64_t more_cells, std::uint32_t its_levels, bool is_limited) {
    cells += more_cells;
    levels = std::max(levels, its_levels);
    limited = limited || is_limited;
  }
};

/// The viewer's own volume, sequence or dynamic volume, and instances: which grids are requested, and which are shown.
/// Functions are called under the state lock. Functions that change settings have the contract of those of Viewer with
/// the same name.
class VolumeStage {
 public:
  /// jobs, failures, host: outlive the stage.
  VolumeStage(Jobs& jobs, ReportedFailures& failures, StageHost& host, std::shared_ptr<ResourceLimits> limits, Log log)
      : jobs_(jobs), reported_failures_(failures), host_(host), log_(std::move(log)), budget_(std::move(limits)) {}

  /// Stops following the viewer's own feed, before its worker is destroyed.
  void close() { feed_.reset(); }
  /// Takes results and requests grids.
  void sync();
  /// Returns how many instances have changed since the last call.
  [[nodiscard]] std::size_t take_changes() { return std::exchange(changed_instances_, 0); }

  void load_volume(const VolumeFile& file);
  void set_volume(VolumeAssetPtr volume);
  void set_sequence(std::shared_ptr<Sequence> sequence);
  void set_live(std::shared_ptr<Live> live);
  void set_transforms(const std::vector<scene::InstanceTransform>& transforms);
  void set_previous_transforms(std::vector<scene::InstanceTransform> transforms) {
    previous_transforms_ = std::move(transforms);
    host_.touch();
  }
  void add_instance(std::shared_ptr<Instance> instance, std::uint64_t id);
  void remove_instance(const Instance& instance);
  void set_grid(const GridSettings& settings);
  void set_ramps(const Ramps& ramps);
  void set_clip(scene::ClipPlanes clip) {
    clip_ = std::move(clip);
    host_.touch();
  }
  void set_medium(const Medium& medium);
  /// previews: if off, images show only the requested volume, and no frame waits until another has been displayed.
  void set_preview(bool previews);
  void set_shutter(double seconds);
  /// gl_bytes: no volume is uploaded beyond it.
  void set_limits(unsigned threads, std::uint64_t memory_bytes, std::uint64_t gl_bytes);
  void rebuild();

  /// The newest volume; of a sequence, that of the frame taken last, if in memory. Null: none.
  [[nodiscard]] const VolumeAssetPtr& volume() const { return volume_; }
  /// Metadata of the volume or the sequence.
  [[nodiscard]] const VolumeInfoPtr& volume_info() const { return volume_info_; }
  /// Metadata of the displayed volume: that of the proxy while there is one.
  [[nodiscard]] const VolumeInfoPtr& shown_info() const { return proxy() ? proxy()->volume_info : volume_info_; }
  [[nodiscard]] bool shows_proxy() const { return proxy() != nullptr; }
  [[nodiscard]] const std::vector<scene::InstanceTransform>& transforms() const { return transforms_; }
  [[nodiscard]] const Ramps& ramps() const { return ramps_; }
  [[nodiscard]] const Medium& medium() const { return medium_; }
  [[nodiscard]] Built& built() { return built_; }
  /// Throw Error(invalid_argument) if there is none.
  [[nodiscard]] const SequenceFeed& own_sequence();
  [[nodiscard]] const DynamicFeed& own_live();
  /// Also throw Error(invalid_argument) for an instance that is not shown.
  [[nodiscard]] const SequenceFeed& sequence_of(const Instance& instance);
  [[nodiscard]] const DynamicFeed& live_of(const Instance& instance);
  /// Returns the host's tag of an instance; nullopt if it is not shown.
  [[nodiscard]] std::optional<std::uint64_t> tag_of(std::uint64_t id) const;
  [[nodiscard]] GridTotals totals() const;
  /// Returns that of the viewer's own grid, or else of the first instance that has one; nullopt: there is no grid.
  [[nodiscard]] std::optional<grid::Interpolation> interpolation() const;
  /// Calls `visit` with the grids of the viewer's own volume and of instances.
  void for_each_grid(const std::function<void(Built&)>& visit);

  /// World bounds of all instances of a volume.
  [[nodiscard]] Bounds bounds_of(const VolumeInfo& volume) const;
  void append_bounds(std::vector<Bounds>& boxes) const;
  /// Calls `add` with points of the hull of the visible parts for a view direction.
  void visit_reach(const glm::dvec3& direction, const std::function<void(const glm::dvec3&)>& add) const;

  /// True if there is a volume, or a dynamic volume whose contents may not be known yet.
  [[nodiscard]] bool is_shown() const;
  /// True if an instance with a grid is displayed.
  [[nodiscard]] bool shows_instances() const;
  void drop_grid() { built_ = {}; }
  /// Shows an empty volume for surfaces if nothing else is shown. Its minimal grid is built here, not in a job, so that
  /// the last job's status is kept. box: bounds of the scene.
  void show_nothing(const std::optional<Bounds>& box);
  /// Sets the view of a frame, for which grids may be built; nullopt: none.
  void set_view(const std::optional<ViewFrame>& view, const glm::uvec2& size);
  /// Sends requests that were waiting for a view.
  void send_due_requests();
  /// Requests grids for the view. view_rests: it is that of the last frame. displays_newest: whether the newest grids
  /// are displayed.
  void request_for_view(bool view_rests, const std::function<bool()>& displays_newest);
  /// True if the current or requested grid was built for another view than that of the last frame.
  [[nodiscard]] bool built_for_another() const;
  /// True if the last request kept cells of the previous grid, because the camera moves.
  [[nodiscard]] bool built_in_motion() const { return track_.built_in_motion; }
  /// Returns the volumes to show. before: those shown until now.
  [[nodiscard]] std::vector<scene::Volume> volumes(const std::vector<scene::Volume>& before) const;
  /// Makes volumes relative to this origin.
  void count_from(std::vector<scene::Volume>& volumes, const glm::dvec3& origin) const;

  /// Marks all frames and states taken last as rendered.
  void note_rendered();
  /// Records the frames and states that are displayed.
  void note_displayed(const scene::SequenceFrames& shown);
  /// Takes the GPU memory used by everything except volumes in this frame.
  void take_gl_bytes(std::uint64_t beside_volumes);
  /// Takes newest states although the previous ones have not been displayed.
  void take_unseen_states();
  /// True if a sequence has a request that was not sent, or results that were not checked.
  [[nodiscard]] bool frames_are_due() const;
  /// True if a frame or a state is ready, but waits until the previous one has been displayed.
  [[nodiscard]] bool something_waits() const;

 private:
  // A displayed instance.
  struct Shown : SharedItem<InstanceSettings> {
    using SharedItem::SharedItem;
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
  struct BuildView {
    ViewFrame view;
    glm::uvec2 size{0U};
    std::vector<scene::InstanceTransform> transforms;
    bool operator==(const BuildView&) const = default;
  };
  // The view that grids are built for.
  struct ViewTrack {
    std::optional<ViewFrame> view;       // of the last frame
    glm::uvec2 size{0U};                 // image size of the last frame
    std::optional<BuildView> built_for;  // camera-adaptive: view of the last request
    bool built_in_motion = false;        // that request kept cells of the previous grid
    bool own_left_out = false;           // that request left out the viewer's own volume, because a load may replace it
  };
  [[nodiscard]] BuildView build_view() const { return {*track_.view, track_.size, transforms_}; }
  struct FeedNumbers {
    std::uint64_t last_feed = 0;
    std::uint64_t last_taken = 0;
  };

  // True if a sequence or a dynamic volume is shown instead of a volume.
  [[nodiscard]] bool plays() const { return feed_ && as_asset(feed_) == nullptr; }
  // The proxy of a volume that is being loaded, which is shown instead of the volume and of its predecessor; null:
  // none.
  [[nodiscard]] const Proxy* proxy() const { return file_ && file_->proxy() ? &*file_->proxy() : nullptr; }
  // Shows the volume of file_, which has been read.
  void show_file();
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
  // Stops following the viewer's own feed.
  void leave_feed();
  // Returns true if the state or frame taken last has been displayed, or if images are not being displayed at all.
  [[nodiscard]] bool is_seen(const VolumeFeed& feed) const;
  // Must be called before a sequence or a dynamic volume is shown or removed. Returns true if one is to be shown.
  bool begin_anew(bool shows, bool showed);
  // Makes this the current volume; null: none.
  void take_volume(VolumeAssetPtr volume);
  // Sets the medium's density scale to the one that the feed suggests. Called with the first grid built for it.
  void take_suggestion();
  // Requests new grids. concerned: if set, a volume for which it returns false keeps its grid.
  void request_build(bool (*concerned)(const VolumeAsset&) = nullptr);
  // Copies the medium and the ramps to the build settings, with the density scale of coming grids or with this one.
  void take_medium() { take_medium(density_scale_to_come()); }
  void take_medium(double density_scale);
  // Maximum mean scale factor of the volume's instance transforms.
  [[nodiscard]] double stretch() const;
  // Density scale of the medium, per unit length of the volume's own world space.
  [[nodiscard]] double medium_density_scale() const { return medium_.density_scale * stretch(); }
  // Density scale for coming grids: the one that the feed suggests, or that of the medium.
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
  // Returns the interpolation of a dynamic volume. Logs once if other volumes have another.
  [[nodiscard]] grid::Interpolation interpolation_of(const Live& live);
  // Returns these settings with the interpolation of the viewer's own feed.
  [[nodiscard]] std::optional<BuildSettings> for_own_feed(std::optional<BuildSettings> settings);
  [[nodiscard]] grid::RefineCamera refine_camera() const;
  // True if workers that build grids are busy.
  [[nodiscard]] bool builds() const;
  // Arguments of a new feed.
  [[nodiscard]] FeedContext feed_context();
  // Creates the feed of an instance.
  [[nodiscard]] VolumeFeedPtr make_feed(const InstanceSettings& settings, const std::optional<BuildSettings>& build);
  // Assigns one feed to all instances that can share it. Existing feeds are reused. is_of_kind: instances to consider;
  // feeds: receives their feeds.
  void share_feeds(bool (*is_of_kind)(const Shown&), std::vector<VolumeFeedPtr>& feeds);
  std::vector<Shown>::iterator find(const Instance& instance);
  // Throws Error(invalid_argument) for an instance that is not shown.
  [[nodiscard]] std::vector<Shown>::iterator look_up(const Instance& instance);
  void follow_instances();
  // If grids depend on the view, there must be a view.
  [[nodiscard]] BuildSettings settings_of(const Shown& shown);
  void request_for_grids();
  // Changes a request to the settings of an existing or requested grid that can be used for it.
  void reuse_grid(GridCache::Request& request) const;
  // Returns the matching grid among all existing ones.
  [[nodiscard]] std::optional<Built> grid_of(const GridCache::Request& request) const;
  void take_grids();
  // True if its grid is about to be replaced by a coarser one, because more grids share the memory or the limit was
  // lowered.
  [[nodiscard]] bool makes_room(const Shown& shown) const;
  [[nodiscard]] VolumeAssetPtr empty_volume(const std::optional<Bounds>& box);
  // Volumes displayed together must have the same grid type and kind of cells; keeps previous grids until all match.
  void keep_to_one_march(std::vector<scene::Volume>& volumes, const std::vector<scene::Volume>& before) const;
  // While grids are being coarsened to fit a memory limit, keeps all previous grids, so that old and new ones are not
  // mixed.
  void keep_until_cells_are_cut(std::vector<scene::Volume>& volumes, const std::vector<scene::Volume>& before) const;

  Jobs& jobs_;
  ReportedFailures& reported_failures_;
  StageHost& host_;
  Log log_;
  GlBudget budget_;
  GridSettings grid_;
  Medium medium_;
  Ramps ramps_;
  bool preview_ = true;
  double shutter_seconds_ = 0.0;
  VolumeAssetPtr volume_;
  VolumeInfoPtr volume_info_;
  VolumeAssetPtr empty_volume_;  // used for surfaces without a volume
  struct Remarked {
    bool interpolation = false;             // that of GPU-resident volumes was logged
    std::optional<std::string> anisotropy;  // the ignored grid that was logged
  };
  Remarked remarked_;
  Built built_;                                          // newest; uploaded again after a change of context
  bool cuts_own_ = false;                                // the running build coarsens it to fit a limit
  std::vector<scene::InstanceTransform> transforms_{1};  // instance transforms of the volume; at least one
  std::vector<scene::InstanceTransform> previous_transforms_;
  scene::ClipPlanes clip_;                   // of all instances of the volume
  bool transforms_changed_ = false;          // since the last traced frame
  scene::Part<scene::Medium> shown_medium_;  // of the viewer's own volume
  std::vector<Shown> shown_;                 // in the order in which they were added
  bool requests_due_ = false;                // the requests for grids are outdated
  bool waits_for_own_ = false;               // an instance waits for the volume's own grid, which is being built
  ViewTrack track_;
  VolumeFeedPtr feed_;                // of the viewer's own volume; null: none
  std::shared_ptr<FileFeed> file_;    // requested last; it becomes feed_ when it was read
  std::vector<VolumeFeedPtr> feeds_;  // of instances: sequences, then dynamic volumes
  FeedNumbers numbers_;
  std::size_t changed_instances_ = 0;
};

}  // namespace cumulet::viewer
