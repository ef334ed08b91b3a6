#include "viewer/viewer.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <limits>
#include <numbers>
#include <numeric>
#include <utility>

#include "base/corners.hpp"
#include "base/error.hpp"
#include "base/library_thread.hpp"
#include "base/milliseconds.hpp"
#include "base/one_line.hpp"
#include "jobs/cell_budget.hpp"
#include "scene/model_table.hpp"
#include "scene/origin.hpp"
#include "scene/space.hpp"

namespace cumulet::viewer {

namespace {

using glm::dvec3;
using Clock = std::chrono::steady_clock;

// Maximum number of volume instances for which the camera fit uses their visible parts instead of their boxes.
constexpr std::size_t most_looked_at = 8;
// Maximum number of triangles that the camera fit visits individually.
constexpr std::size_t max_vertices = std::size_t{1} << 24U;

bool glows(const VolumeAsset& volume) { return volume.may_emit(); }

Bounds both(const Bounds& a, const Bounds& b) { return {glm::min(a.min, b.min), glm::max(a.max, b.max)}; }

// Box around all of these; nullopt if there are none.
std::optional<Bounds> box_of(const std::vector<Bounds>& boxes) {
  if (boxes.empty()) return std::nullopt;
  return std::accumulate(boxes.begin() + 1, boxes.end(), boxes.front(), both);
}

scene::Emission emission_of(const Medium& medium, const Ramps& ramps) {
  scene::Emission emission = medium.field_emission;
  emission.temperature_ramp = ramps.temperature;
  emission.flame_ramp = ramps.flame;
  return emission;
}

scene::Medium shown_medium(const Medium& medium) {
  return {medium.density_scale, medium.albedo, medium.phase, medium.emission, medium.group, medium.holdout};
}

// Returns true if both differ only in opacity and in the view.
bool same_but_view(BuildSettings a, const BuildSettings& b) {
  a.refine.density_scale = b.refine.density_scale;
  a.refine.anisotropy = b.refine.anisotropy;
  if (a.refine.camera && b.refine.camera) a.refine.camera->transforms = b.refine.camera->transforms;
  return a == b;
}

// Makes `a` as fine as both.
void join(BuildSettings& a, const BuildSettings& b) {
  a.refine.density_scale = std::max(a.refine.density_scale, b.refine.density_scale);
  a.refine.anisotropy = std::min(a.refine.anisotropy, b.refine.anisotropy);
  if (a.refine.camera && b.refine.camera)
    a.refine.camera->transforms.insert(a.refine.camera->transforms.end(), b.refine.camera->transforms.begin(),
                                       b.refine.camera->transforms.end());
}

bool is_of_cells(const Built& built) { return built.source && built.source->march == scene::March::tet; }

bool apart_by_an_eighth(std::uint64_t a, std::uint64_t b) {
  return std::max(a, b) - std::min(a, b) > std::max(a, b) / 8;
}

// Keeps displaying the previous data of a volume.
void stay_with(scene::Volume& volume, const scene::Volume& was) {
  volume.source = was.source;
  volume.frame = was.frame;
}

using Add = std::function<void(const dvec3&)>;

// Adds the vertices of a mesh, or the corners of its box.
void add_mesh(const scene::ModelSource& source, const scene::ModelMesh& mesh, const glm::dmat4& to_world, bool as_box,
              const Add& add) {
  if (as_box) {
    const auto [low, high] = scene::box_of(mesh.bvh);
    for (const dvec3& corner : corners_of(low, high)) add(dvec3(to_world * glm::dvec4(corner, 1.0)));
    return;
  }
  const auto first = source.scene->indices.begin() + 3 * std::ptrdiff_t{mesh.first_triangle};
  for (auto i = first; i != first + 3 * std::ptrdiff_t{mesh.triangle_count}; ++i)
    add(dvec3(to_world * glm::dvec4(source.pose.vertices[*i].position, 1.0)));
}

// Returns why a frame of a sequence cannot be shown.
std::optional<Error> failure_of(const SequenceFeed& feed, std::uint32_t frame) {
  if (frame >= feed.sequence().files()->count())
    throw Error(ErrorCode::invalid_argument, "the sequence has no frame " + std::to_string(frame));
  return feed.cache().failure_of(frame);
}

// Refers to a source of jobs of the viewer, which outlives the result.
template <class Source>
std::shared_ptr<Source> borrowed(Source& source) {
  return {std::shared_ptr<void>(), &source};
}

}  // namespace

Viewer::Viewer(Log log, std::function<void()> update, bool restore_state, Trace trace, std::shared_ptr<Sharing> sharing)
    : log_(std::move(log)),
      trace_(trace),
      update_(std::move(update)),
      restore_state_(restore_state),
      sharing_(sharing ? std::move(sharing) : std::make_shared<Sharing>()),
      jobs_({.log = log_, .notify = [this] { notify(); }, .trace = trace, .resource_limits = resource_limits_}) {
  volume::initialize_readers();
  set_medium({});
  set_light({});
  set_camera(std::make_shared<Camera>());
}

Viewer::~Viewer() {
  feed_.reset();  // its listener notifies a builder, which is destroyed first
  dynamic_gl_.clear();
  cancel();  // all workers at once: with a thread limit, jobs wait for each other
  // Without the viewer's context its objects cannot be deleted, and in another context the names belong to other
  // objects.
  if (gl_ && !gl_->group().is_current()) context_lost();
}

// ---- the host's callback ----

void Viewer::notify() {
  if (!update_ || process_is_ending() || update_pending_.exchange(true)) return;
  const CallbackScope inside;
  update_();
}

void Viewer::touch() {
  ++settings_revision_;
  notify();
}

// ---- volumes and grid builds ----

void Viewer::sync() {
  if (auto loaded = jobs_.builder.take_loaded()) {
    take_volume(std::move(loaded->volume));
    suggested_density_scale_ = loaded->density_scale;
    if (suggested_density_scale_) grid_.build.refine.density_scale = *suggested_density_scale_;
    if (feed_) {
      leave_feed();
      take_medium();
    }
  }
  if (auto built = jobs_.builder.take_built()) {
    // A rebuild keeps the timings of the load.
    if (built->volume == built_.volume) {
      if (built->seconds.load == 0.0) built->seconds.load = built_.seconds.load;
      if (built->seconds.statistics == 0.0) built->seconds.statistics = built_.seconds.statistics;
    }
    built_ = std::move(*built);
    cuts_own_ = false;
    requests_due_ = true;
    if (built_.volume == volume_) {  // else it is the previous volume, for which a grid was requested
      drop_proxy();
      take_suggestion();
    }
  }
  fit_cells();
  follow_proxy();
  follow_feed();
  take_states(false);
  follow_instances();
  settings_revision_ += models_.sync();
  sky_.sync();
}

void Viewer::follow_proxy() {
  // A sequence or a dynamic volume is shown until the new volume is ready. Without previews no proxy is used, because
  // read-back must only contain the requested volume.
  if (auto made = jobs_.builder.take_proxy(); made && sampling_.preview && !feed_) {
    proxy_ = std::move(made);
    show_medium();
  }
  // Check in this order: a job stores its result before it ends.
  if (!proxy_ || !proxy_->load.expired() || jobs_.builder.has_result()) return;
  // Either the volume was loaded and the next frame requests its grid, or the load failed.
  const bool waits = grid_.camera_adaptive && volume_ && built_.volume != volume_ && !jobs_.builder.status().failure;
  if (!waits) drop_proxy();
}

void Viewer::drop_proxy() {
  if (!proxy_) return;
  proxy_.reset();
  show_medium();
}

void Viewer::take_suggestion() {
  if (!suggested_density_scale_) return;
  medium_.density_scale = *std::exchange(suggested_density_scale_, std::nullopt) / stretch();
  show_medium();
}

void Viewer::take_volume(VolumeAssetPtr volume) {
  volume_ = std::move(volume);
  volume_info_ = volume_ ? volume_->volume_info() : nullptr;
  built_for_.reset();
  remark_on_anisotropy();
  requests_due_ = true;  // instances may use its grid, or can no longer do so
}

bool Viewer::begin_anew(bool shows, bool showed) {
  if (!shows && !showed) return false;
  reported_failures_.retire();
  jobs_.builder.forget();
  drop_proxy();
  sync();
  leave_feed();
  if (!shows) {
    take_volume(nullptr);
    built_ = {};
    touch();
    return false;
  }
  suggested_density_scale_.reset();
  take_medium();
  built_for_.reset();
  return true;
}

void Viewer::set_sequence(std::shared_ptr<Sequence> sequence) {
  if (!begin_anew(sequence != nullptr, as_sequence(feed_) != nullptr)) return;
  feed_ = std::make_shared<SequenceFeed>(std::move(sequence), settings_at_once(), borrowed(jobs_.frames),
                                         SequenceFeed::Suggestion::used_if_asked, resource_limits_, feed_context());
  follow_feed();
  touch();
}

void Viewer::set_live(std::shared_ptr<Live> live) {
  if (!begin_anew(live != nullptr, as_dynamic(feed_) != nullptr)) return;
  dynamic_gl_.track(live);
  feed_ = std::make_shared<DynamicFeed>(std::move(live), settings_at_once(), borrowed(jobs_.states), feed_context());
  touch();
}

FeedContext Viewer::feed_context() {
  return {++last_feed_, last_taken_, [this] { notify(); }};
}

void Viewer::leave_feed() {
  feed_.reset();
  jobs_.frames.clear();
  jobs_.states.follow(nullptr, std::nullopt);
}

bool Viewer::is_seen(const VolumeFeed& feed) const {
  const std::optional<scene::SequenceFrame>& taken = feed.frame();
  if (!sampling_.preview || !taken) return true;
  if (gl_) return feed.is_rendered() && !gl_->has_pending_frame(*taken);
  return !simulated_gl_ || (feed.is_rendered() && simulated_gl_->displays_frames);
}

void Viewer::follow_feed() {
  if (!feed_) return;
  if (feed_->take_info()) {
    volume_ = nullptr;
    volume_info_ = feed_->info();
    requests_due_ = true;
    remark_on_anisotropy();
    suggested_density_scale_ = feed_->density_scale_to_use();
    if (suggested_density_scale_) grid_.build.refine.density_scale = *suggested_density_scale_;
  }
  take_from_feed(is_seen(*feed_));
}

void Viewer::take_from_feed(bool is_seen) {
  const VolumeFeed::Taken taken = feed_->take(is_seen);
  if (taken == VolumeFeed::Taken::nothing) return;
  volume_ = feed_->volume();
  const std::optional<Built>& built = feed_->built();
  if (taken == VolumeFeed::Taken::same || !built) return;
  built_ = *built;
  if (VolumeInfoPtr info = feed_->info(); info != volume_info_) {
    volume_info_ = std::move(info);
    remark_on_anisotropy();
  }
  if (!shown_.empty()) requests_due_ = true;
  take_suggestion();
}

const DynamicFeed& Viewer::own_live() {
  sync();
  const DynamicFeed* live = as_dynamic(feed_);
  if (live == nullptr) throw Error(ErrorCode::invalid_argument, "the viewer shows no dynamic volume");
  return *live;
}

Viewer::LiveStatus Viewer::live() { return own_live().status(); }

Viewer::LiveStatus Viewer::live(const Instance& instance) {
  const Shown& shown = *look_up(instance);
  const DynamicFeed* live = as_dynamic(shown.feed);
  if (!shown.is_seen() || live == nullptr)
    throw Error(ErrorCode::invalid_argument, "the instance shows no dynamic volume");
  return live->status();
}

const SequenceFeed& Viewer::own_sequence() {
  sync();
  const SequenceFeed* sequence = as_sequence(feed_);
  if (sequence == nullptr) throw Error(ErrorCode::invalid_argument, "the viewer shows no sequence");
  return *sequence;
}

Viewer::SequenceStatus Viewer::status_of(const SequenceFeed& feed) const {
  // The displayed frame may belong to another sequence.
  return feed.status(gl_ ? frame_of(*gl_, feed.id()) : std::nullopt);
}

Viewer::SequenceStatus Viewer::sequence() { return status_of(own_sequence()); }

std::optional<Error> Viewer::frame_failure(std::uint32_t frame) { return failure_of(own_sequence(), frame); }

std::vector<Viewer::Shown>::iterator Viewer::look_up(const Instance& instance) {
  sync();
  const auto shown = find(instance);
  if (shown == shown_.end()) throw Error(ErrorCode::invalid_argument, "the instance is not in the viewer");
  return shown;
}

const SequenceFeed& Viewer::sequence_of(const Instance& instance) {
  const Shown& shown = *look_up(instance);
  const SequenceFeed* sequence = as_sequence(shown.feed);
  if (!shown.is_seen() || sequence == nullptr)
    throw Error(ErrorCode::invalid_argument, "the instance shows no sequence");
  return *sequence;
}

Viewer::SequenceStatus Viewer::sequence(const Instance& instance) { return status_of(sequence_of(instance)); }

std::optional<Error> Viewer::frame_failure(const Instance& instance, std::uint32_t frame) {
  return failure_of(sequence_of(instance), frame);
}

std::optional<BuildSettings> Viewer::settings_at_once() const {
  if (grid_.camera_adaptive) return std::nullopt;
  return grid_.build;
}

BuildSettings Viewer::settings_for_view() const {
  BuildSettings settings = grid_.build;
  settings.refine.camera = refine_camera();
  settings.refine.camera->transforms.clear();
  for (const scene::InstanceTransform& transform : transforms_)
    settings.refine.camera->transforms.push_back(transform.to_world);
  return settings;
}

bool Viewer::built_for_another() const {
  const bool own_is_due = own_left_out_ && !jobs_.builder.loads();
  return grid_.camera_adaptive && view_ && (built_in_motion_ || own_is_due || built_for_ != build_view());
}

void Viewer::request_build(bool (*concerned)(const VolumeAsset&)) {
  reported_failures_.retire();
  const bool loads = jobs_.builder.configure_load(settings_at_once());
  if (loads && !feed_) return;
  sync();
  const auto settings = settings_at_once();
  if (feed_) {
    if (!loads) jobs_.builder.forget_failure();  // of a load that would have replaced the sequence
    // The `concerned` test is skipped, because other frames may have fields that the displayed one lacks.
    built_for_.reset();
    feed_->request(settings);
    return;
  }
  if (loads) return;
  if (concerned != nullptr && volume_ && !concerned(*volume_)) return;
  built_for_.reset();
  if (volume_ && settings) jobs_.builder.build(volume_, *settings);
}

void Viewer::load_volume(const VolumeFile& file) {
  reported_failures_.retire();
  sync();
  const auto suggested = std::exchange(suggested_density_scale_, std::nullopt);
  take_medium();
  drop_proxy();
  jobs_.builder.load(file, settings_at_once(), sampling_.preview ? std::optional(grid_.build) : std::nullopt);
  // A sequence or a dynamic volume is shown until the new volume is ready.
  if (feed_) {
    suggested_density_scale_ = suggested;
    take_medium();
  }
  touch();
}

void Viewer::set_volume(VolumeAssetPtr volume) {
  reported_failures_.retire();
  jobs_.builder.forget_failure();
  if (volume) {
    jobs_.builder.cancel_loads();  // builds continue: a host may set volumes faster than they build
  } else {
    jobs_.builder.cancel();
  }
  jobs_.builder.take_loaded();  // drops a loaded volume that has not been shown
  drop_proxy();
  sync();
  leave_feed();
  take_volume(std::move(volume));
  suggested_density_scale_.reset();
  if (!volume_) {
    built_ = {};
  } else if (!grid_.camera_adaptive) {
    take_medium();
    jobs_.builder.build(volume_, grid_.build);
  }
  touch();
}

VolumeAssetPtr Viewer::volume() {
  sync();
  return volume_;
}

VolumeInfoPtr Viewer::volume_info() {
  sync();
  return volume_info_;
}

void Viewer::set_transforms(const std::vector<scene::InstanceTransform>& transforms) {
  sync();
  transforms_ = transforms;
  transforms_changed_ = true;
  show_medium();
  if (other_opacity()) {
    take_medium();
    request_build();
  }
  touch();
}

void Viewer::add_instance(std::shared_ptr<Instance> instance) {
  reported_failures_.retire();
  sync();
  if (find(*instance) != shown_.end())
    throw Error(ErrorCode::invalid_argument, "the instance is already in the viewer");
  Shown shown;
  shown.id = ++last_id_;
  shown.listener = instance->listen([this] { notify(); });
  shown.instance = std::move(instance);
  shown_.push_back(std::move(shown));
  touch();
}

void Viewer::remove_instance(const Instance& instance) {
  reported_failures_.retire();
  shown_.erase(look_up(instance));
  requests_due_ = true;
  sync();  // drops its failures
  touch();
}

std::vector<Viewer::Shown>::iterator Viewer::find(const Instance& instance) {
  return std::ranges::find_if(shown_, [&](const Shown& shown) { return shown.instance.get() == &instance; });
}

void Viewer::add_model(std::shared_ptr<ModelInstance> model) {
  reported_failures_.retire();
  sync();
  models_.add(std::move(model), last_id_ + 1);
  ++last_id_;
  sync();  // starts posing its surfaces
  touch();
}

void Viewer::remove_model(const ModelInstance& model) {
  reported_failures_.retire();
  sync();
  models_.remove(model);
  sync();  // drops its failures
  touch();
}

void Viewer::follow_instances() {
  for (Shown& shown : shown_) {
    const std::uint64_t revision = shown.instance->revision();
    if (revision == shown.revision) continue;
    shown.settings = shown.instance->get();
    shown.revision = revision;
    shown.medium.set(shown_medium(shown.settings.medium));
    const bool has_other_source = shown.feed && shown.feed->source() != shown.source();
    if (has_other_source || !shown.has_anything()) shown.forget();
    if (!shown.settings.volume) {
      shown.request.reset();
      shown.begun.reset();
    }
    requests_due_ = true;
    ++settings_revision_;
  }
  if (requests_due_) request_for_feeds();
  take_frames();
  if (jobs_.grids.take_changes()) take_grids();
  // The viewer's own grid, which was to be reused, may have failed.
  if (waits_for_own_ && !jobs_.builder.busy()) requests_due_ = true;
  if (!requests_due_ || (grid_.camera_adaptive && !view_)) return;
  requests_due_ = false;
  request_for_grids();
  take_grids();
}

VolumeFeedPtr Viewer::make_feed(const InstanceSettings& settings, const std::optional<BuildSettings>& build) {
  const FeedContext context = feed_context();
  const JobContext jobs = jobs_.context(context.id);
  if (settings.sequence) {
    return std::make_shared<SequenceFeed>(settings.sequence, build, std::make_shared<FrameCache>(jobs),
                                          SequenceFeed::Suggestion::ignored, resource_limits_, context);
  }
  dynamic_gl_.track(settings.live);
  return std::make_shared<DynamicFeed>(settings.live, build, std::make_shared<LiveBuilder>(jobs), context);
}

void Viewer::share_feeds(bool (*is_of_kind)(const Shown&), std::vector<VolumeFeedPtr>& feeds) {
  struct Wanted {
    std::optional<BuildSettings> settings;
    std::vector<Shown*> by;
    [[nodiscard]] const void* source() const { return by.front()->source(); }
  };
  std::vector<Wanted> all;
  for (Shown& shown : shown_) {
    // A hidden instance keeps its feed for when it is shown again.
    if (!is_of_kind(shown) || !shown.is_seen()) continue;
    std::optional<BuildSettings> settings;
    if (!grid_.camera_adaptive || view_) settings = settings_of(shown);
    const auto same = std::ranges::find_if(all, [&](const Wanted& wanted) {
      const bool alike =
          settings && wanted.settings ? same_but_view(*wanted.settings, *settings) : !settings && !wanted.settings;
      return alike && wanted.source() == shown.source();
    });
    if (same == all.end()) {
      all.push_back({settings, {&shown}});
    } else {
      if (settings) join(*same->settings, *settings);
      same->by.push_back(&shown);
    }
  }
  for (Wanted& wanted : all) {
    const auto suits_it = [&](const VolumeFeedPtr& feed) {
      return feed && feed->source() == wanted.source() && std::ranges::find(feeds, feed) == feeds.end();
    };
    const auto had = std::ranges::find_if(wanted.by, [&](const Shown* shown) { return suits_it(shown->feed); });
    const auto any = std::ranges::find_if(feeds_, suits_it);
    VolumeFeedPtr feed = had != wanted.by.end() ? (*had)->feed : any != feeds_.end() ? *any : nullptr;
    if (!feed) {
      feed = make_feed(wanted.by.front()->settings, wanted.settings);
    } else if (feed->settings() != wanted.settings) {
      feed->request(wanted.settings);
    }
    for (Shown* shown : wanted.by) shown->feed = feed;
    feeds.push_back(std::move(feed));
  }
}

void Viewer::request_for_feeds() {
  for (Shown& shown : shown_) {
    if (shown.source() == nullptr) shown.feed.reset();
  }
  std::vector<VolumeFeedPtr> feeds;
  share_feeds([](const Shown& shown) { return shown.settings.sequence != nullptr; }, feeds);
  share_feeds([](const Shown& shown) { return shown.settings.live != nullptr; }, feeds);
  feeds_ = std::move(feeds);
  std::vector<std::shared_ptr<JobSource>> players;
  for (const VolumeFeedPtr& feed : feeds_) players.push_back(feed->jobs());
  jobs_.set_players(std::move(players));
}

void Viewer::take_states(bool unseen) {
  for (const VolumeFeedPtr& feed : feeds_) {
    if (as_dynamic(feed) != nullptr) feed->take(unseen || is_seen(*feed));
  }
}

void Viewer::take_frames() {
  for (const VolumeFeedPtr& feed : feeds_) {
    if (as_sequence(feed) == nullptr) continue;
    feed->take_info();
    feed->take(is_seen(*feed));
  }
  for (Shown& shown : shown_) {
    if (shown.feed && shown.feed->built()) shown.built = shown.feed->built();
  }
}

std::optional<Built> Viewer::grid_of(const GridCache::Request& request) const {
  const auto is = [&](const Built& built) {
    return built.volume == request.volume && built.settings == request.settings;
  };
  if (built_.source && is(built_)) return built_;
  for (const Shown& shown : shown_) {
    if (shown.built && is(*shown.built) && fits(*shown.built)) return shown.built;
  }
  return jobs_.grids.built(request);
}

void Viewer::take_grids() {
  for (Shown& shown : shown_) {
    if (!shown.request) continue;
    auto built = grid_of(*shown.request);
    // If requests change faster than grids are built, show one that was begun.
    if (!built && shown.begun) built = jobs_.grids.built(*shown.begun);
    if (built) shown.built = std::move(built);
  }
}

BuildSettings Viewer::settings_of(const Shown& shown) const {
  const Medium& medium = shown.settings.medium;
  BuildSettings settings = grid_.build;
  settings.density_ramp = shown.settings.ramps.density;
  settings.emission = emission_of(medium, shown.settings.ramps);
  settings.refine.density_scale = medium.density_scale * scene::mean_stretch(shown.settings.to_world);
  settings.refine.anisotropy = scene::mean_cosine(medium.phase);
  settings.anisotropic = medium.phase.may_vary();
  if (grid_.camera_adaptive) {
    settings.refine.camera = refine_camera();
    settings.refine.camera->transforms = {shown.settings.to_world};
  }
  return settings;
}

void Viewer::reuse_grid(GridCache::Request& request) const {
  const auto serves = [&](const Built& built) {
    return built.volume == request.volume && built.serves(request.settings) && fits(built);
  };
  if (built_.source && built_.volume == request.volume && built_.serves(request.settings)) {
    request.settings = built_.settings;
    return;
  }
  for (const Shown& shown : shown_) {
    if (shown.built && serves(*shown.built)) {
      request.settings = shown.built->settings;
      return;
    }
  }
  for (const Shown& shown : shown_) {
    if (shown.request && shown.request->volume == request.volume && shown.request->gl_bytes == request.gl_bytes &&
        suits(shown.request->settings, request.settings)) {
      request.settings = shown.request->settings;
      return;
    }
  }
}

void Viewer::request_for_grids() {
  // One request for all instances that can share a grid, as fine as the finest of them needs.
  std::vector<GridCache::Request> requests;
  std::vector<std::optional<std::size_t>> request_of(shown_.size());
  for (std::size_t i = 0; i < shown_.size(); ++i) {
    const Shown& shown = shown_[i];
    if (!shown.is_seen() || !shown.settings.volume) continue;
    const BuildSettings settings = settings_of(shown);
    const auto same = std::ranges::find_if(requests, [&](const GridCache::Request& request) {
      return request.volume == shown.settings.volume && same_but_view(request.settings, settings);
    });
    request_of[i] = static_cast<std::size_t>(same - requests.begin());
    if (same == requests.end()) {
      requests.push_back({shown.settings.volume, settings});
    } else {
      join(same->settings, settings);
    }
  }
  const bool own_is_apart =
      (volume_ && std::ranges::none_of(requests,
                                       [&](const GridCache::Request& request) {
                                         return request.volume == volume_ && suits(grid_.build, request.settings);
                                       })) ||
      feed_;
  const std::size_t grids = requests.size() + feeds_.size() + (own_is_apart ? 1 : 0);
  const std::size_t before = std::exchange(grids_, std::max<std::size_t>(grids, 1));
  share_gl();
  // The memory left by each frame always varies a little; only a change of an eighth matters.
  const bool limited = max_gl_bytes_ != ResourceLimits::no_limit;
  if (limited && (grids_ != before || apart_by_an_eighth(part_of_gl_, resource_limits_->gl_bytes()))) share_gl_anew();
  for (GridCache::Request& request : requests) request.gl_bytes = part_of_gl_;
  waits_for_own_ = false;
  std::vector<GridCache::Request> to_build;
  for (GridCache::Request& request : requests) {
    reuse_grid(request);
    if (grid_of(request)) continue;
    const bool comes = jobs_.builder.busy() && !grid_.camera_adaptive && request.volume == volume_;
    if (comes && suits(grid_.build, request.settings)) {
      waits_for_own_ = true;
    } else {
      to_build.push_back(request);
    }
  }
  for (std::size_t i = 0; i < shown_.size(); ++i) {
    Shown& shown = shown_[i];
    if (!request_of[i] || shown.request == requests[*request_of[i]]) continue;
    if (shown.request && jobs_.grids.is_under_way(*shown.request)) shown.begun = std::move(shown.request);
    shown.request = requests[*request_of[i]];
  }
  jobs_.grids.request(std::move(to_build));
  fit_cells();  // its share of GPU memory may have changed
}

void Viewer::rebuild() {
  reported_failures_.retire();
  for (Shown& shown : shown_) {
    shown.request.reset();
    if (shown.built) shown.built->volume = nullptr;  // stays displayed until replaced, but cannot be reused
  }
  jobs_.rebuild();
  requests_due_ = true;
  models_.renew_requests();
  take_medium();
  request_build();
  touch();
}

void Viewer::share_gl() {
  const bool limited = max_gl_bytes_ != ResourceLimits::no_limit;
  // Images vary by some KiB from frame to frame. Rounding keeps the number of cells constant.
  constexpr std::uint64_t step = std::uint64_t{1} << 18U;
  const std::uint64_t beside = (gl_beside_volumes_.value_or(0) + step - 1) / step * step;
  const std::uint64_t left = max_gl_bytes_ - std::min(max_gl_bytes_, beside);
  resource_limits_->set_gl(limited ? left / grids_ : ResourceLimits::no_limit);
}

void Viewer::share_gl_anew() {
  cells_due_ = true;
  part_of_gl_ = resource_limits_->gl_bytes();
}

bool Viewer::fits(const Built& built) const {
  ResourceLimits part;
  part.set_gl(part_of_gl_);
  return !is_of_cells(built) || has_cells_allowed(built, part);
}

bool Viewer::makes_room(const Shown& shown) const {
  return shown.is_seen() && shown.request && shown.built && jobs_.grids.busy() && !fits(*shown.built) &&
         !grid_of(*shown.request);
}

void Viewer::set_limits(const Limits& limits) {
  // Grids are adapted here and when the number of grids changes, but not in every frame: the number of allowed cells
  // depends on the memory that each frame's images leave.
  const bool others = limits.gl_bytes != max_gl_bytes_ || limits.memory_bytes != resource_limits_->memory_bytes();
  resource_limits_->set(limits.threads, limits.memory_bytes);
  max_gl_bytes_ = limits.gl_bytes;
  share_gl();
  if (others) {
    share_gl_anew();
    requests_due_ = requests_due_ || !shown_.empty();
  }
  sync();
  const auto renew = [](const VolumeFeedPtr& feed) {
    if (SequenceFeed* sequence = as_sequence(feed)) sequence->renew_request();
  };
  renew(feed_);
  std::ranges::for_each(feeds_, renew);
  touch();
}

void Viewer::fit_cells() {
  // The running job may have been started under other limits, or for another volume.
  if (!cells_due_ || jobs_.builder.busy()) return;
  cells_due_ = false;
  if (!volume_ || !is_of_cells(built_) || feed_) return;
  cuts_own_ = !has_cells_allowed(built_, *resource_limits_);
  if (cuts_own_) request_build();
}

bool Viewer::busy() const { return jobs_.busy() || frames_are_due(); }

bool Viewer::builds() const {
  return jobs_.busy(ContentKind::volume) || jobs_.busy(ContentKind::instances) || frames_are_due();
}

bool Viewer::frames_are_due() const {
  const auto is_due = [](const VolumeFeedPtr& feed) { return feed && feed->is_due(); };
  return is_due(feed_) || std::ranges::any_of(feeds_, is_due);
}

void Viewer::load_surfaces(const FilePath& path) {
  reported_failures_.retire();
  sync();
  models_.load(path);
  touch();
}

void Viewer::show_surfaces(scene::ModelSourcePtr surfaces) {
  reported_failures_.retire();
  models_.cancel_surfaces(false);
  sync();
  models_.show(std::move(surfaces));
  touch();
}

void Viewer::set_surfaces(SurfaceAssetPtr surfaces) {
  reported_failures_.retire();
  models_.cancel_surfaces(surfaces != nullptr);
  sync();
  models_.set_surfaces(std::move(surfaces));
  touch();
}

SurfaceAssetPtr Viewer::surfaces_asset() {
  sync();
  return models_.asset();
}

void Viewer::set_surface_settings(const SurfaceSettings& settings) {
  const bool poses = models_.configure_load(settings);
  if (poses) sync();
  models_.set_settings(settings);
  if (poses) models_.pose_surfaces();
  touch();
}

void Viewer::use_surface_camera(std::size_t index) {
  sync();
  const scene::ModelSourcePtr& source = models_.source();
  const std::size_t count = source ? source->pose.cameras.size() : 0;
  if (index >= count) {
    throw Error(ErrorCode::invalid_argument,
                "there is no camera " + std::to_string(index) + ": the surfaces have " + std::to_string(count));
  }
  const surface::SceneCamera& seen = source->pose.cameras[index];
  const dvec3 eye(seen.to_world[3]);
  const dvec3 forward = -glm::normalize(dvec3(seen.to_world[2]));
  CameraPose pose = camera_->pose();
  pose.eye = eye;
  // The target for orbits is as far away as the middle of the scene.
  double distance = 1.0;
  if (const auto all = box()) {
    distance =
        std::max(glm::dot(0.5 * (all->min + all->max) - eye, forward), 1e-3 * glm::length(all->max - all->min) + 1e-12);
  }
  pose.target = eye + forward * distance;
  pose.up = glm::normalize(dvec3(seen.to_world[1]));
  pose.orthographic_height = seen.orthographic ? seen.height : 0.0;
  if (!seen.orthographic) pose.fovy_degrees = glm::degrees(seen.vertical_fov);
  pose.near_plane = seen.near_plane;
  pose.far_plane = seen.far_plane;
  camera_->set(pose);
}

void Viewer::wait(double timeout_ms) {
  std::optional<Clock::time_point> until;
  if (timeout_ms >= 0.0) until = deadline_after(timeout_ms);
  // One result may cause further work.
  do {
    // Stopped workers never become idle.
    if (process_is_ending()) throw Error(ErrorCode::cancelled, "the process is exiting");
    sync();
    if (!jobs_.wait(until)) throw Error(ErrorCode::timeout, "not ready in time");
    // The newest state is waited for, so it need not wait until the previous one has been displayed.
    if (as_dynamic(feed_) != nullptr) take_from_feed(true);
    take_states(true);
    sync();
  } while (busy());
  if (const auto failure = reported_failures_.report(jobs_.status().failures, ReportedFailures::Cancelled::reported))
    throw Error(*failure);
}

Viewer::Status Viewer::status() const {
  const JobList::Status jobs = jobs_.status();
  const auto either = [&](ContentKind kind, ContentKind other) {
    return jobs.failures[kind] ? jobs.failures[kind] : jobs.failures[other];
  };
  Status status;
  status.volume_failure = either(ContentKind::volume, ContentKind::instances);
  status.surfaces_failure = either(ContentKind::surfaces, ContentKind::models);
  status.environment_failure = jobs.failures[ContentKind::environment];
  status.failure = reported_failures_.report(jobs.failures, ReportedFailures::Cancelled::reported);
  const double upload = upload_progress_.load(std::memory_order_relaxed);
  if (jobs.stage != Progress::Stage::idle) {
    status.stage = jobs.stage;
    status.fraction = jobs.fraction;
  } else if (upload < 1.0) {
    status.stage = Progress::Stage::uploading;
    status.fraction = upload;
  }
  return status;
}

// ---- settings ----

void Viewer::set_grid(const GridSettings& settings) {
  grid_ = settings;
  requests_due_ = true;
  take_medium();
  request_build();
  touch();
}

void Viewer::take_medium() {
  grid_.build.emission = field_emission();
  grid_.build.density_ramp = ramps_.density;
  grid_.build.refine.density_scale = density_scale_to_come();
  grid_.build.refine.anisotropy = scene::mean_cosine(medium_.phase);
  grid_.build.anisotropic = medium_.phase.may_vary();
  grid_.build.shutter_seconds = sampling_.shutter_seconds;
}

scene::Emission Viewer::field_emission() const { return emission_of(medium_, ramps_); }

void Viewer::set_ramps(const Ramps& ramps) {
  const bool other_density = ramps.density != ramps_.density;
  const bool other_emission = ramps.temperature != ramps_.temperature || ramps.flame != ramps_.flame;
  if (!other_density && !other_emission) return;
  ramps_ = ramps;
  take_medium();
  request_build(other_density ? nullptr : glows);
  touch();
}

void Viewer::remark_on_anisotropy() {
  if (medium_.phase.may_vary()) remarked_anisotropy_.reset();
  if (!volume_info_ || !volume_info_->anisotropy_grid || medium_.phase.may_vary()) return;
  const std::string& name = *volume_info_->anisotropy_grid;
  if (remarked_anisotropy_ == name) return;
  remarked_anisotropy_ = name;
  log_.info("grid \"" + name + "\" is ignored: the Mie phase function has its own anisotropy");
}

void Viewer::set_medium(const Medium& medium) {
  sync();
  medium_ = medium;
  remark_on_anisotropy();
  const scene::Emission emission = field_emission();
  const bool other_emission = grid_.build.emission != emission;
  if (other_opacity()) {
    take_medium();
    request_build();
  } else if (const bool other_phase = medium.phase.may_vary() != grid_.build.anisotropic;
             other_emission || other_phase) {
    const auto varied = [](const VolumeAsset& volume) { return volume.has_anisotropy(); };
    const auto either = [](const VolumeAsset& volume) { return volume.may_emit() || volume.has_anisotropy(); };
    grid_.build.emission = emission;
    grid_.build.anisotropic = medium.phase.may_vary();
    request_build(!other_phase ? glows : other_emission ? +either : +varied);
  }
  show_medium();
  touch();
}

double Viewer::density_scale_to_come() const {
  return suggested_density_scale_ ? *suggested_density_scale_ : medium_.density_scale * stretch();
}

bool Viewer::other_opacity() const {
  BuildSettings wanted = grid_.build;
  wanted.refine.density_scale = density_scale_to_come();
  wanted.refine.anisotropy = scene::mean_cosine(medium_.phase);
  return !suits(grid_.build, wanted);
}

Medium Viewer::seen_medium() const {
  Medium medium = medium_;
  if (proxy_ && proxy_->density_scale) medium.density_scale = *proxy_->density_scale / stretch();
  return medium;
}

void Viewer::show_medium() { shown_medium_.set(shown_medium(seen_medium())); }

void Viewer::set_light(const Light& light) {
  sky_.set_light(light);
  touch();
}

void Viewer::set_lights(light::AnalyticLights analytic_lights) {
  analytic_lights_ = std::move(analytic_lights);
  analytic_lights_due_ = true;
  touch();
}

void Viewer::load_environment(const FilePath& path) {
  reported_failures_.retire();
  sync();
  jobs_.environments.load(path);
  touch();
}

void Viewer::set_environment(light::EnvironmentPtr environment) {
  reported_failures_.retire();
  jobs_.environments.drop_loads();
  sync();
  sky_.set_environment(std::move(environment));
  touch();
}

const light::EnvironmentPtr& Viewer::environment() {
  sync();
  return sky_.environment();
}

void Viewer::set_environment_settings(const EnvironmentSettings& settings) {
  sky_.set_environment_settings(settings);
  touch();
}

void Viewer::set_ground(const GroundSettings& settings) {
  sky_.set_ground(settings);
  touch();
}

void Viewer::set_sampling(const Sampling& sampling) {
  sync();
  sampling_ = sampling;
  if (!sampling_.preview) drop_proxy();
  models_.set_shutter(sampling.shutter_seconds);
  if (grid_.build.shutter_seconds != sampling.shutter_seconds) {
    requests_due_ = true;
    take_medium();
    request_build([](const VolumeAsset& volume) { return volume.moves(); });
  }
  touch();
}

void Viewer::set_display(const DisplaySettings& display) {
  display_ = display;
  touch();
}

void Viewer::set_camera(std::shared_ptr<Camera> camera) {
  camera_listener_.reset();
  camera_ = std::move(camera);
  camera_listener_ = camera_->listen([this] { notify(); });
  touch();
}

void Viewer::set_previous_camera(std::shared_ptr<Camera> camera, double seconds) {
  previous_listener_.reset();
  previous_camera_ = std::move(camera);
  if (previous_camera_) previous_listener_ = previous_camera_->listen([this] { notify(); });
  previous_seconds_ = seconds;
  touch();
}

void Viewer::set_previous_transforms(std::vector<scene::InstanceTransform> transforms) {
  previous_transforms_ = std::move(transforms);
  touch();
}

void Viewer::set_navigation(const NavigationSettings& settings) {
  navigation_.set(settings);
  touch();
}

bool Viewer::input(const InputEvent& event) {
  sync();
  const bool handled = navigation_.input(event, *camera_, frame_size_.x, frame_size_.y, subject());
  if (navigation_.moving()) notify();
  return handled;
}

void Viewer::frame_all() {
  static_cast<void>(bounds());  // throws if there is nothing to fit
  camera_->fit(*subject(), frame_size_.y > 0 ? double(frame_size_.x) / frame_size_.y : 1.0);
}

double Viewer::stretch() const {
  double most = 0.0;
  for (const scene::InstanceTransform& transform : transforms_)
    most = std::max(most, scene::mean_stretch(transform.to_world));
  return most;
}

Bounds Viewer::bounds_of(const VolumeInfo& volume) const {
  Bounds all = volume.bounds(transforms_.front().to_world);
  for (std::size_t i = 1; i < transforms_.size(); ++i) all = both(all, volume.bounds(transforms_[i].to_world));
  return all;
}

std::vector<Bounds> Viewer::boxes() const {
  std::vector<Bounds> boxes;
  if (const VolumeInfoPtr& volume_info = shown_info(); volume_info && !volume_info->empty) {
    for (const scene::InstanceTransform& transform : transforms_)
      boxes.push_back(volume_info->bounds(transform.to_world));
  }
  for (const Shown& shown : shown_) {
    if (shown.is_there() && !shown.volume_info()->empty)
      boxes.push_back(shown.volume_info()->bounds(shown.settings.to_world));
  }
  models_.append_bounds(boxes);
  return boxes;
}

std::optional<Bounds> Viewer::box() const { return box_of(boxes()); }

dvec3 Viewer::scene_origin(const std::vector<Bounds>& boxes, const std::optional<scene::Ground>& ground) const {
  std::vector<scene::Extent> things;
  things.reserve(boxes.size());
  for (const Bounds& bounds : boxes) things.push_back({bounds.min, bounds.max});
  if (!view_) return scene::origin_of_scene(things, std::nullopt);
  if (things.empty() && ground) {
    const dvec3 below(view_->eye.x, ground->height, view_->eye.z);
    things.push_back({below, below});
  }
  return scene::origin_of_scene(things, view_->eye);
}

void Viewer::remark_on_precision() {
  for (const scene::Model& model : scene_.models) {
    const surface::ScenePtr& scene = model.source->scene;
    if (scene->precision_remark.empty()) continue;
    std::erase_if(remarked_scenes_, [](const auto& remarked) { return remarked.expired(); });
    const auto is = [&](const auto& remarked) { return remarked.lock() == scene; };
    if (std::ranges::any_of(remarked_scenes_, is)) continue;
    remarked_scenes_.emplace_back(scene);
    log_.warning(scene->precision_remark);
  }
}

void Viewer::count_from(const dvec3& origin) {
  if (analytic_lights_due_ || scene_.origin != origin)
    scene_.analytic_lights.set(scene::counted_from(analytic_lights_, origin));
  analytic_lights_due_ = false;
  scene_.origin = origin;
  for (scene::Volume& volume : scene_.volumes) {
    const bool is_nothing = volume.id == 0 && built_.volume && built_.volume == empty_volume_;
    if (!is_nothing) {
      volume = scene::counted_from(std::move(volume), origin);
    } else if (origin != dvec3(0.0)) {
      // The empty volume for surfaces is moved to the origin.
      volume.transform = {glm::translate(glm::dmat4(1.0), -dvec3(empty_volume_->volume().index_to_world[3]))};
    }
  }
}

std::optional<scene::Ground> Viewer::ground(const std::optional<Bounds>& all) const {
  const bool on_triangles = sky_.has_ground() && models_.shows_triangles();
  return sky_.ground(all, on_triangles, view_ ? std::optional(view_->eye) : std::nullopt);
}

std::optional<Subject> Viewer::subject() const {
  const auto all = box();
  if (!all) return std::nullopt;
  Subject subject(*all);
  subject.reach = [this](const dvec3& direction, std::span<const dvec3> normals) {
    return seen_reach(direction, normals);
  };
  return subject;
}

std::vector<double> Viewer::seen_reach(const dvec3& direction, std::span<const dvec3> normals) const {
  std::vector<double> reach;
  const auto add = [&](const dvec3& p) {
    reach.resize(normals.size(), std::numeric_limits<double>::lowest());
    for (std::size_t i = 0; i < normals.size(); ++i) reach[i] = std::max(reach[i], glm::dot(p, normals[i]));
  };
  const VolumeInfoPtr& own = shown_info();
  const std::size_t count = (own ? transforms_.size() : 0) + shown_.size();
  const auto add_volume = [&](const VolumeInfo& volume, const glm::dmat4& to_world, const Medium& medium) {
    const Bounds box = volume.bounds(to_world);
    const auto add_box = [&] { std::ranges::for_each(corners_of(box.min, box.max), add); };
    // With many volumes, one of them hardly extends the visible bounds.
    if (count > most_looked_at) {
      add_box();
      return;
    }
    const dvec3 along = glm::inverse(glm::dmat3(to_world)) * direction;
    const double density_scale = medium.density_scale / glm::length(along);
    for (const dvec3& p : volume.coarse.visible(glm::normalize(along), density_scale))
      add(dvec3(to_world * glm::dvec4(p, 1.0)));
    // Emission is visible at any density.
    if (volume.may_emit) add_box();
  };
  std::size_t vertices = 0;
  for (const scene::InstanceTransform& transform : transforms_) {
    if (own) add_volume(*own, transform.to_world, seen_medium());
  }
  for (const Shown& shown : shown_) {
    if (shown.is_there()) add_volume(*shown.volume_info(), shown.settings.to_world, shown.settings.medium);
  }
  for (const scene::Model& model : models_.models()) {
    for (const scene::ModelMesh& mesh : model.source->meshes) {
      for (const glm::dmat4& transform : mesh.transforms) {
        // For many instances the boxes are sufficient.
        vertices += mesh.triangle_count;
        add_mesh(*model.source, mesh, model.to_world * transform, vertices > max_vertices, add);
      }
    }
  }
  return reach;
}

Bounds Viewer::bounds() {
  sync();
  const auto all = box();
  if (!all) throw Error(ErrorCode::invalid_argument, "the scene is empty: no volume and no surfaces");
  return *all;
}

grid::RefineCamera Viewer::refine_camera() const {
  const ViewFrame& view = *view_;
  grid::RefineCamera refine;
  refine.right = glm::normalize(view.right);
  refine.up = glm::normalize(view.up);
  refine.forward = glm::normalize(glm::cross(refine.up, refine.right));
  // Off-axis projection: use the symmetric frustum that contains the image's.
  refine.tan_half_x = glm::length(view.right) + std::abs(glm::dot(view.forward, refine.right));
  refine.tan_half_y = glm::length(view.up) + std::abs(glm::dot(view.forward, refine.up));
  refine.eye = view.eye;
  refine.pixels_per_radian = frame_size_.y / (2.0 * glm::length(view.up));
  if (view.orthographic) {
    // Approximated by a pinhole camera so far back that its rays are nearly parallel.
    const double back = 1e4 * glm::length(view.up);
    refine.eye -= back * refine.forward;
    refine.tan_half_x /= back;
    refine.tan_half_y /= back;
    refine.pixels_per_radian *= back;
  }
  return refine;
}

VolumeAssetPtr Viewer::empty_volume() {
  if (!empty_volume_) {
    volume::ScalarVolume empty;
    empty.name = "nothing";
    empty.bounds_max = glm::ivec3(0);
    const auto all = box();
    const dvec3 middle = all ? 0.5 * (all->min + all->max) : dvec3(0.0);
    // If the scene is far away, count_from() moves the volume to the scene's origin.
    const bool near = !all || scene::origin_of_scene(std::array{scene::Extent{all->min, all->max}}, {}) == dvec3(0.0);
    empty.index_to_world[3] = glm::dvec4(near ? middle : dvec3(0.0), 1.0);
    empty_volume_ = std::make_shared<const VolumeAsset>(std::move(empty));
  }
  return empty_volume_;
}

bool Viewer::shows_instances() const {
  return std::ranges::any_of(shown_, [](const Shown& shown) { return shown.is_seen() && shown.built; });
}

void Viewer::show_volumes() {
  std::vector<scene::Volume> volumes;
  // The empty volume for surfaces is left out if instances are displayed.
  const scene::MarchSourcePtr& source = proxy_ ? proxy_->source : built_.source;
  if (source && (shown_info() || !shows_instances())) {
    const auto frame = feed_ ? feed_->frame() : std::nullopt;
    for (const scene::InstanceTransform& transform : transforms_)
      volumes.push_back({0,
                         source,
                         shown_medium_,
                         {transform.to_world, while_open(transform.ends, sampling_.shutter_seconds)},
                         frame});
    for (std::size_t i = 0; i < std::min(volumes.size(), previous_transforms_.size()); ++i)
      volumes[i].previous = previous_transforms_[i];
  }
  for (const Shown& shown : shown_) {
    if (shown.is_seen() && shown.built)
      volumes.push_back({shown.id,
                         shown.built->source,
                         shown.medium,
                         {shown.settings.to_world, while_open(shown.settings.ends, sampling_.shutter_seconds)},
                         shown.frame(),
                         shown.settings.previous});
  }
  const auto differs = [&](const scene::Volume& volume) {
    const scene::MarchSource& first = *volumes.front().source;
    return !volume.source->goes_with(first);
  };
  if (std::ranges::any_of(volumes, differs)) keep_to_one_march(volumes);
  keep_until_cells_are_cut(volumes);
  scene_.volumes = std::move(volumes);
}

void Viewer::keep_to_one_march(std::vector<scene::Volume>& volumes) const {
  const bool building = builds();
  // While grids are being built, keep volumes that match the displayed ones; afterwards those that match the settings.
  const auto fits = [&](const scene::Volume& volume) {
    if (building && !scene_.volumes.empty()) return volume.source->goes_with(*scene_.volumes.front().source);
    return volume.source->march == grid_.build.march &&
           (volume.source->march != scene::March::tet ||
            volume.source->linear == (grid_.build.refine.cells == grid::CellKind::linear));
  };
  for (scene::Volume& volume : volumes) {
    if (fits(volume)) continue;
    const auto was = std::ranges::find_if(
        scene_.volumes, [&](const scene::Volume& other) { return other.id == volume.id && fits(other); });
    if (was != scene_.volumes.end()) stay_with(volume, *was);
  }
  std::erase_if(volumes, [&](const scene::Volume& volume) { return !fits(volume); });
}

void Viewer::keep_until_cells_are_cut(std::vector<scene::Volume>& volumes) const {
  if (max_gl_bytes_ == ResourceLimits::no_limit) return;
  const bool own = cuts_own_ && jobs_.builder.busy() && !jobs_.builder.loads() && !proxy_ && !feed_;
  if (!own && std::ranges::none_of(shown_, [this](const Shown& shown) { return makes_room(shown); })) return;
  const auto was = [&](const scene::Volume& volume) {
    return std::ranges::find(scene_.volumes, volume.id, &scene::Volume::id);
  };
  std::erase_if(volumes, [&](const scene::Volume& volume) { return was(volume) == scene_.volumes.end(); });
  for (scene::Volume& volume : volumes) stay_with(volume, *was(volume));
}

scene::SnapshotPtr Viewer::snapshot() {
  show_volumes();
  const std::vector<Bounds> boxes = this->boxes();
  const std::optional<scene::Ground> ground = this->ground(box_of(boxes));
  const dvec3 origin = scene_origin(boxes, ground);
  count_from(origin);
  scene_.lights = sky_.lights();
  scene_.surroundings = sky_.surroundings();
  scene_.models = models_.models();
  for (scene::Model& model : scene_.models) model = scene::counted_from(std::move(model), origin);
  remark_on_precision();
  const auto seen = [&](const std::optional<ViewFrame>& view) {
    return scene::counted_from(view ? std::optional<scene::Viewpoint>(*view) : std::nullopt, origin);
  };
  scene_.view.set(seen(view_));
  scene_.previous.set({seen(previous_view_), previous_seconds_});
  const bool lasts = view_ && sampling_.shutter_seconds > 0.0;
  scene_.view_ends.set(
      scene::counted_from(lasts ? camera_->ends(double(frame_size_.x) / frame_size_.y, *view_) : std::nullopt, origin));
  scene_.ground.set(scene::counted_from(ground, origin));
  if (!snapshot_ || *snapshot_ != scene_) snapshot_ = std::make_shared<const scene::Snapshot>(scene_);
  return snapshot_;
}

Shot Viewer::shot() {
  Shot shot;
  shot.scene = snapshot();
  shot.size = frame_size_;
  if (view_) {
    shot.depth_a = view_->depth_a;
    shot.depth_b = view_->depth_b;
  }
  shot.view_rests = view_ == last_view_;
  shot.held = navigation_.dragging();
  shot.max_bounces = medium_.max_bounces;
  shot.sun_group = sky_.light().sun_group;
  shot.sky_group = sky_.light().sky_group;
  shot.sampling = sampling_;
  shot.surfaces = models_.settings();
  shot.display = display_;
  shot.settings = settings_revision_;
  return shot;
}

}  // namespace cumulet::viewer
