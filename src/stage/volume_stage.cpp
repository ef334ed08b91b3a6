#include "stage/volume_stage.hpp"

#include <algorithm>
#include <array>
#include <glm/gtc/matrix_transform.hpp>
#include <set>

#include "base/corners.hpp"
#include "base/error.hpp"
#include "jobs/build_grid.hpp"
#include "jobs/cell_budget.hpp"
#include "jobs/shared_grids.hpp"
#include "scene/emission_extent.hpp"
#include "scene/origin.hpp"
#include "scene/space.hpp"

namespace cumulet::viewer {

namespace {

using glm::dvec3;

// Maximum number of volume instances for which the camera fit uses their visible parts instead of their boxes.
constexpr std::size_t most_looked_at = 8;

bool glows(const VolumeAsset& volume) { return volume.may_emit(); }

Bounds both(const Bounds& a, const Bounds& b) { return {glm::min(a.min, b.min), glm::max(a.max, b.max)}; }

// Keeps displaying the previous data of a volume.
void stay_with(scene::Volume& volume, const scene::Volume& was) {
  volume.source = was.source;
  volume.frame = was.frame;
}

// Refers to a source of jobs of the viewer, which outlives the result.
template <class Source>
std::shared_ptr<Source> borrowed(Source& source) {
  return {std::shared_ptr<void>(), &source};
}

}  // namespace

void VolumeStage::sync() {
  if (file_ && file_->take_volume()) show_file();
  follow_feed();
  fit_cells();
  follow_proxy();
  take_states(false);
  follow_instances();
}

void VolumeStage::show_file() {
  take_volume(file_->volume());
  const bool played = plays();
  if (played) leave_feed();
  feed_ = file_;
  if (const auto& scale = feed_->suggested_density_scale()) grid_.build.refine.density_scale = *scale;
  if (played) take_medium();
}

void VolumeStage::follow_proxy() {
  // A sequence or a dynamic volume is shown until the new volume is ready. Without previews no proxy is used, because
  // read-back must only contain the requested volume.
  if (file_ && file_->take_proxy(preview_ && !plays())) show_medium();
  if (!shows_proxy() || file_->loads_after_proxy()) return;
  // Either the volume was loaded and the next frame requests its grid, or the load failed.
  const bool waits = grid_.camera_adaptive && volume_ && built_.volume != volume_ && !jobs_.builder.status().failure;
  if (!waits) drop_proxy();
}

void VolumeStage::drop_proxy() {
  if (!shows_proxy()) return;
  file_->drop_proxy();
  show_medium();
}

void VolumeStage::take_suggestion() {
  const std::optional<double> scale = feed_->take_suggestion();
  if (!scale) return;
  medium_.density_scale = *scale / stretch();
  show_medium();
}

void VolumeStage::take_volume(VolumeAssetPtr volume) {
  volume_ = std::move(volume);
  volume_info_ = volume_ ? volume_->volume_info() : nullptr;
  track_.built_for.reset();
  remark_on_anisotropy();
  requests_due_ = true;  // instances may use its grid, or can no longer do so
}

bool VolumeStage::begin_anew(bool shows, bool showed) {
  if (!shows && !showed) return false;
  reported_failures_.retire();
  jobs_.builder.forget();
  drop_proxy();
  host_.sync();
  leave_feed();
  file_.reset();
  if (!shows) {
    take_volume(nullptr);
    built_ = {};
    host_.touch();
    return false;
  }
  take_medium();
  track_.built_for.reset();
  return true;
}

void VolumeStage::set_sequence(std::shared_ptr<Sequence> sequence) {
  if (!begin_anew(sequence != nullptr, as_sequence(feed_) != nullptr)) return;
  feed_ =
      std::make_shared<SequenceFeed>(std::move(sequence), settings_at_once(), borrowed(jobs_.frames),
                                     SequenceFeed::Suggestion::used_if_asked, budget_.shared_limits(), feed_context());
  follow_feed();
  host_.touch();
}

void VolumeStage::set_live(std::shared_ptr<Live> live) {
  if (!begin_anew(live != nullptr, as_dynamic(feed_) != nullptr)) return;
  host_.track(live);
  std::optional<BuildSettings> settings = settings_at_once();
  if (settings) settings->interpolation = interpolation_of(*live);
  feed_ = std::make_shared<DynamicFeed>(std::move(live), settings, borrowed(jobs_.states), feed_context());
  host_.touch();
}

FeedContext VolumeStage::feed_context() {
  return {++numbers_.last_feed, numbers_.last_taken, [host = &host_] { host->notify(); }};
}

void VolumeStage::leave_feed() {
  feed_.reset();
  jobs_.frames.clear();
  jobs_.states.follow(nullptr, std::nullopt);
}

bool VolumeStage::is_seen(const VolumeFeed& feed) const {
  const std::optional<scene::SequenceFrame>& taken = feed.frame();
  return !preview_ || !taken || host_.is_displayed(*taken, feed.is_rendered());
}

void VolumeStage::follow_feed() {
  if (!feed_) return;
  if (feed_->take_info()) {
    volume_ = nullptr;
    volume_info_ = feed_->info();
    requests_due_ = true;
    remark_on_anisotropy();
    if (const auto& scale = feed_->suggested_density_scale()) grid_.build.refine.density_scale = *scale;
  }
  take_from_feed(is_seen(*feed_));
}

void VolumeStage::take_from_feed(bool is_seen) {
  const VolumeFeed::Taken taken = feed_->take(is_seen);
  if (taken == VolumeFeed::Taken::nothing) return;
  volume_ = feed_->volume();
  if (taken == VolumeFeed::Taken::same || !feed_->built()) return;
  Built built = *feed_->built();
  const bool is_asset = as_asset(feed_) != nullptr;
  if (is_asset) {
    // A rebuild keeps the timings of the load.
    if (built.volume == built_.volume) {
      if (built.seconds.load == 0.0) built.seconds.load = built_.seconds.load;
      if (built.seconds.statistics == 0.0) built.seconds.statistics = built_.seconds.statistics;
    }
    cuts_own_ = false;
  }
  built_ = std::move(built);
  if (VolumeInfoPtr info = feed_->info(); info != volume_info_) {
    volume_info_ = std::move(info);
    remark_on_anisotropy();
  }
  if (is_asset || !shown_.empty()) requests_due_ = true;
  if (taken == VolumeFeed::Taken::former) return;
  drop_proxy();
  take_suggestion();
}

const DynamicFeed& VolumeStage::own_live() {
  host_.sync();
  const DynamicFeed* live = as_dynamic(feed_);
  if (live == nullptr) throw Error(ErrorCode::invalid_argument, "the viewer shows no dynamic volume");
  return *live;
}

const SequenceFeed& VolumeStage::own_sequence() {
  host_.sync();
  const SequenceFeed* sequence = as_sequence(feed_);
  if (sequence == nullptr) throw Error(ErrorCode::invalid_argument, "the viewer shows no sequence");
  return *sequence;
}

std::vector<VolumeStage::Shown>::iterator VolumeStage::look_up(const Instance& instance) {
  host_.sync();
  const auto shown = find(instance);
  if (shown == shown_.end()) throw Error(ErrorCode::invalid_argument, "the instance is not in the viewer");
  return shown;
}

const SequenceFeed& VolumeStage::sequence_of(const Instance& instance) {
  const Shown& shown = *look_up(instance);
  const SequenceFeed* sequence = as_sequence(shown.feed);
  if (!shown.is_seen() || sequence == nullptr)
    throw Error(ErrorCode::invalid_argument, "the instance shows no sequence");
  return *sequence;
}

std::optional<BuildSettings> VolumeStage::settings_at_once() const {
  if (grid_.camera_adaptive) return std::nullopt;
  return grid_.build;
}

BuildSettings VolumeStage::settings_for_view() const {
  BuildSettings settings = grid_.build;
  settings.refine.camera = refine_camera();
  settings.refine.camera->transforms.clear();
  for (const scene::InstanceTransform& transform : transforms_)
    settings.refine.camera->transforms.push_back(transform.to_world);
  return settings;
}

grid::Interpolation VolumeStage::interpolation_of(const Live& live) {
  if (live.values_wanted() == nullptr) return grid_.build.interpolation;
  const bool is_linear = grid_.interpolation_in_gl == grid_.build.interpolation;
  const bool is_trilinear = grid_.build.refine.cells == grid::CellKind::trilinear;
  if ((!is_linear || is_trilinear) && !std::exchange(remarked_.interpolation, true))
    log_.info(
        is_linear
            ? "GPU-resident dynamic volumes are copied to main memory, because trilinear cells need interpolation "
              "between voxels"
            : "GPU-resident dynamic volumes are built without interpolation between voxels, because linear "
              "interpolation needs the voxels in main memory");
  return grid_.interpolation_in_gl;
}

std::optional<BuildSettings> VolumeStage::for_own_feed(std::optional<BuildSettings> settings) {
  const DynamicFeed* live = as_dynamic(feed_);
  if (live != nullptr && settings) settings->interpolation = interpolation_of(live->live());
  return settings;
}

bool VolumeStage::built_for_another() const {
  const bool own_is_due = track_.own_left_out && !jobs_.builder.loads();
  return grid_.camera_adaptive && track_.view &&
         (track_.built_in_motion || own_is_due || track_.built_for != build_view());
}

void VolumeStage::request_build(bool (*concerned)(const VolumeAsset&)) {
  reported_failures_.retire();
  const bool loads = jobs_.builder.configure_load(settings_at_once());
  if (loads && !plays()) return;
  host_.sync();
  if (plays()) {
    // The `concerned` test is skipped, because other frames may have fields that the displayed one lacks.
    if (!loads) jobs_.builder.forget_failure();  // of a load that would have replaced the sequence
  } else if (loads || (concerned != nullptr && volume_ && !concerned(*volume_))) {
    return;
  }
  track_.built_for.reset();
  if (feed_) feed_->request(for_own_feed(settings_at_once()));
}

void VolumeStage::load_volume(const VolumeFile& file) {
  reported_failures_.retire();
  host_.sync();
  if (feed_ && !plays()) feed_->take_suggestion();  // the medium stays
  take_medium(medium_density_scale());
  drop_proxy();
  file_ = std::make_shared<FileFeed>(file, settings_at_once(), preview_ ? std::optional(grid_.build) : std::nullopt,
                                     borrowed(jobs_.builder), feed_context());
  // A sequence or a dynamic volume is shown until the new volume is ready.
  if (plays()) take_medium();
  host_.touch();
}

void VolumeStage::set_volume(VolumeAssetPtr volume) {
  reported_failures_.retire();
  jobs_.builder.forget_failure();
  if (volume) {
    jobs_.builder.cancel_loads();  // builds continue: a host may set volumes faster than they build
  } else {
    jobs_.builder.cancel();
  }
  jobs_.builder.drop_loaded();
  drop_proxy();
  host_.sync();
  leave_feed();
  file_.reset();
  if (volume) feed_ = std::make_shared<AssetFeed>(volume, borrowed(jobs_.builder), feed_context());
  take_volume(std::move(volume));
  if (!feed_) {
    built_ = {};
  } else if (!grid_.camera_adaptive) {
    take_medium();
    feed_->request(grid_.build);
  }
  host_.touch();
}

void VolumeStage::set_transforms(const std::vector<scene::InstanceTransform>& transforms) {
  host_.sync();
  transforms_ = transforms;
  transforms_changed_ = true;
  show_medium();
  if (other_opacity()) {
    take_medium();
    request_build();
  }
  host_.touch();
}

void VolumeStage::add_instance(std::shared_ptr<Instance> instance, std::uint64_t id) {
  reported_failures_.retire();
  host_.sync();
  if (find(*instance) != shown_.end())
    throw Error(ErrorCode::invalid_argument, "the instance is already in the viewer");
  shown_.emplace_back(std::move(instance), id, host_);
  host_.touch();
}

void VolumeStage::remove_instance(const Instance& instance) {
  reported_failures_.retire();
  shown_.erase(look_up(instance));
  requests_due_ = true;
  host_.sync();  // drops its failures
  host_.touch();
}

std::vector<VolumeStage::Shown>::iterator VolumeStage::find(const Instance& instance) {
  return std::ranges::find_if(shown_, [&](const Shown& shown) { return shown.object.get() == &instance; });
}

bool VolumeStage::makes_room(const Shown& shown) const {
  return shown.is_seen() && shown.request && shown.built && jobs_.grids.busy() && !budget_.fits(*shown.built) &&
         !grid_of(*shown.request);
}

void VolumeStage::fit_cells() {
  // The running job may have been started under other limits, or for another volume.
  if (!budget_.cells_are_due() || jobs_.builder.busy()) return;
  budget_.note_cells();
  if (!volume_ || !is_of_cells(built_) || plays()) return;
  cuts_own_ = !has_cells_allowed(built_, budget_.limits());
  if (cuts_own_) request_build();
}

bool VolumeStage::builds() const {
  return jobs_.busy(ContentKind::volume) || jobs_.busy(ContentKind::instances) || frames_are_due();
}

bool VolumeStage::frames_are_due() const {
  const auto is_due = [](const VolumeFeedPtr& feed) { return feed && feed->is_due(); };
  return is_due(feed_) || std::ranges::any_of(feeds_, is_due);
}

void VolumeStage::set_grid(const GridSettings& settings) {
  grid_ = settings;
  requests_due_ = true;
  take_medium();
  request_build();
  host_.touch();
}

void VolumeStage::take_medium(double density_scale) {
  grid_.build.emission = field_emission();
  grid_.build.density_ramp = ramps_.density;
  grid_.build.density_colors = ramps_.density_colors;
  grid_.build.refine.density_scale = density_scale;
  grid_.build.refine.anisotropy = scene::mean_cosine(medium_.phase);
  grid_.build.anisotropic = medium_.phase.may_vary();
  grid_.build.shutter_seconds = shutter_seconds_;
}

scene::Emission VolumeStage::field_emission() const { return emission_of(medium_, ramps_); }

void VolumeStage::set_ramps(const Ramps& ramps) {
  const bool other_density = ramps.density != ramps_.density || ramps.density_colors != ramps_.density_colors;
  const bool other_emission = emission_of(medium_, ramps) != field_emission();
  if (!other_density && !other_emission) return;
  ramps_ = ramps;
  take_medium();
  request_build(other_density ? nullptr : glows);
  host_.touch();
}

void VolumeStage::remark_on_anisotropy() {
  if (medium_.phase.may_vary()) remarked_.anisotropy.reset();
  if (!volume_info_ || !volume_info_->anisotropy_grid || medium_.phase.may_vary()) return;
  const std::string& name = *volume_info_->anisotropy_grid;
  if (remarked_.anisotropy == name) return;
  remarked_.anisotropy = name;
  log_.info("grid \"" + name + "\" is ignored: the Mie phase function has its own anisotropy");
}

void VolumeStage::set_medium(const Medium& medium) {
  host_.sync();
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
  host_.touch();
}

double VolumeStage::density_scale_to_come() const {
  return feed_ ? feed_->suggested_density_scale().value_or(medium_density_scale()) : medium_density_scale();
}

bool VolumeStage::other_opacity() const {
  BuildSettings wanted = grid_.build;
  wanted.refine.density_scale = density_scale_to_come();
  wanted.refine.anisotropy = scene::mean_cosine(medium_.phase);
  return !suits(grid_.build, wanted);
}

Medium VolumeStage::seen_medium() const {
  Medium medium = medium_;
  if (const Proxy* shown = proxy(); shown != nullptr && shown->density_scale)
    medium.density_scale = *shown->density_scale / stretch();
  return medium;
}

void VolumeStage::show_medium() { shown_medium_.set(shown_medium(seen_medium())); }

double VolumeStage::stretch() const {
  double most = 0.0;
  for (const scene::InstanceTransform& transform : transforms_)
    most = std::max(most, scene::mean_stretch(transform.to_world));
  return most;
}

Bounds VolumeStage::bounds_of(const VolumeInfo& volume) const {
  Bounds all = volume.bounds(transforms_.front().to_world);
  for (std::size_t i = 1; i < transforms_.size(); ++i) all = both(all, volume.bounds(transforms_[i].to_world));
  return all;
}

grid::RefineCamera VolumeStage::refine_camera() const {
  const ViewFrame& view = *track_.view;
  grid::RefineCamera refine;
  refine.right = glm::normalize(view.right);
  refine.up = glm::normalize(view.up);
  refine.forward = glm::normalize(glm::cross(refine.up, refine.right));
  // Off-axis projection: use the symmetric frustum that contains the image's.
  refine.tan_half_x = glm::length(view.right) + std::abs(glm::dot(view.forward, refine.right));
  refine.tan_half_y = glm::length(view.up) + std::abs(glm::dot(view.forward, refine.up));
  refine.eye = view.eye;
  refine.pixels_per_radian = track_.size.y / (2.0 * glm::length(view.up));
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

bool VolumeStage::shows_instances() const {
  return std::ranges::any_of(shown_, [](const Shown& shown) { return shown.is_seen() && shown.built; });
}

const DynamicFeed& VolumeStage::live_of(const Instance& instance) {
  const Shown& shown = *look_up(instance);
  const DynamicFeed* live = as_dynamic(shown.feed);
  if (!shown.is_seen() || live == nullptr)
    throw Error(ErrorCode::invalid_argument, "the instance shows no dynamic volume");
  return *live;
}

void VolumeStage::set_preview(bool previews) {
  preview_ = previews;
  if (!preview_) drop_proxy();
}

void VolumeStage::set_shutter(double seconds) {
  shutter_seconds_ = seconds;
  if (grid_.build.shutter_seconds == seconds) return;
  requests_due_ = true;
  take_medium();
  request_build([](const VolumeAsset& volume) { return volume.moves(); });
}

void VolumeStage::set_limits(unsigned threads, std::uint64_t memory_bytes, std::uint64_t gl_bytes) {
  // Grids are adapted here and when the number of grids changes, but not in every frame: the number of allowed cells
  // depends on the memory that each frame's images leave.
  if (budget_.set_limits(threads, memory_bytes, gl_bytes)) requests_due_ = requests_due_ || !shown_.empty();
  host_.sync();
  const auto renew = [](const VolumeFeedPtr& feed) {
    if (SequenceFeed* sequence = as_sequence(feed)) sequence->renew_request();
  };
  renew(feed_);
  std::ranges::for_each(feeds_, renew);
}

void VolumeStage::rebuild() {
  reported_failures_.retire();
  for (Shown& shown : shown_) {
    shown.request.reset();
    if (shown.built) shown.built->volume = nullptr;  // stays displayed until replaced, but cannot be reused
    forget_grids(shown.settings.volume);
  }
  forget_grids(volume_);
  jobs_.rebuild();
  requests_due_ = true;
  take_medium();
  request_build();
}

std::optional<std::uint64_t> VolumeStage::tag_of(std::uint64_t id) const {
  const auto found = std::ranges::find(shown_, id, &Shown::id);
  return found != shown_.end() ? std::optional(found->settings.tag) : std::nullopt;
}

std::optional<grid::Interpolation> VolumeStage::interpolation() const {
  const auto has_grid = [](const Shown& shown) { return shown.is_seen() && shown.built && shown.built->source; };
  const auto shown = std::ranges::find_if(shown_, has_grid);
  // Without a volume the own grid is the empty one for surfaces.
  const Built& built = (built_.source && volume_info_) || shown == shown_.end() ? built_ : *shown->built;
  return built.source ? std::optional(built.settings.interpolation) : std::nullopt;
}

GridTotals VolumeStage::totals() const {
  GridTotals totals;
  const auto add_built = [&](const Built& built) {
    if (!built.source || !built.source->plan) totals.add(built.cells, built.levels, built.limited);
  };
  add_built(built_);
  const SequenceFeed* own = as_sequence(feed_);
  totals.active_voxels = volume_ ? volume_->volume().active_voxels : (own != nullptr ? built_.active_voxels : 0);
  std::set<scene::MarchSourcePtr> grids{built_.source};
  std::set<VolumeAssetPtr> volumes{volume_};
  for (const Shown& shown : shown_) {
    if (!shown.is_seen()) continue;
    const VolumeAssetPtr& volume = shown.settings.volume;
    if (volume && volumes.insert(volume).second) totals.active_voxels += volume->volume().active_voxels;
    if (!shown.built || !grids.insert(shown.built->source).second) continue;
    if (!volume) totals.active_voxels += shown.built->active_voxels;
    add_built(*shown.built);
  }
  const auto bytes_of = [](const SequenceFeed& feed) { return feed.cache().frames().bytes; };
  totals.memory_bytes = own != nullptr ? bytes_of(*own) : built_.bytes();
  for (const VolumeFeedPtr& feed : feeds_) {
    if (const SequenceFeed* sequence = as_sequence(feed)) totals.memory_bytes += bytes_of(*sequence);
  }
  return totals;
}

void VolumeStage::for_each_grid(const std::function<void(Built&)>& visit) {
  visit(built_);
  for (Shown& shown : shown_) {
    if (shown.built) visit(*shown.built);
  }
}

void VolumeStage::append_bounds(std::vector<Bounds>& boxes) const {
  if (const VolumeInfoPtr& volume_info = shown_info(); volume_info && !volume_info->empty) {
    for (const scene::InstanceTransform& transform : transforms_)
      boxes.push_back(volume_info->bounds(transform.to_world));
  }
  for (const Shown& shown : shown_) {
    if (shown.is_there() && !shown.volume_info()->empty)
      boxes.push_back(shown.volume_info()->bounds(shown.settings.to_world));
  }
}

void VolumeStage::visit_reach(const dvec3& direction, const std::function<void(const dvec3&)>& add) const {
  const VolumeInfoPtr& own = shown_info();
  const std::size_t count = (own ? transforms_.size() : 0) + shown_.size();
  const auto add_volume = [&](const VolumeInfo& volume, const glm::dmat4& to_world, const Medium& medium,
                              const scene::Emission& emission) {
    const Bounds box = volume.bounds(to_world);
    const auto add_box = [&] { std::ranges::for_each(corners_of(box.min, box.max), add); };
    // With many volumes, one of them hardly extends the visible bounds.
    if (count > most_looked_at) {
      add_box();
      return;
    }
    const dvec3 along = glm::inverse(glm::dmat3(to_world)) * direction;
    const double density_scale = medium.density_scale / glm::length(along);
    const auto add_points = [&](const std::vector<dvec3>& points) {
      for (const dvec3& p : points) add(dvec3(to_world * glm::dvec4(p, 1.0)));
    };
    add_points(volume.coarse.visible(glm::normalize(along), density_scale));
    // Emission is visible at any density.
    if (volume.has_unknown_emission()) return add_box();
    add_points(scene::emitting_points(volume.flame, volume.temperature, volume.emission_defaults.complete(emission)));
  };
  for (const scene::InstanceTransform& transform : transforms_) {
    if (own) add_volume(*own, transform.to_world, seen_medium(), field_emission());
  }
  for (const Shown& shown : shown_) {
    if (!shown.is_there()) continue;
    const InstanceSettings& settings = shown.settings;
    add_volume(*shown.volume_info(), settings.to_world, settings.medium, emission_of(settings.medium, settings.ramps));
  }
}

bool VolumeStage::is_shown() const {
  const auto is_dynamic = [](const VolumeFeedPtr& feed) { return as_dynamic(feed) != nullptr; };
  return shown_info() || std::ranges::any_of(shown_, &Shown::is_there) || is_dynamic(feed_) ||
         std::ranges::any_of(feeds_, is_dynamic);
}

void VolumeStage::show_nothing(const std::optional<Bounds>& box) {
  if (volume_info_ || shows_instances() || built_.source || jobs_.builder.busy()) return;
  Progress progress;
  built_ = build_grid(log_, empty_volume(box), grid_.build, progress);
}

void VolumeStage::set_view(const std::optional<ViewFrame>& view, const glm::uvec2& size) {
  track_.view = view;
  track_.size = size;
}

void VolumeStage::send_due_requests() {
  if (requests_due_) follow_instances();
}

void VolumeStage::request_for_view(bool view_rests, const std::function<bool()>& displays_newest) {
  const bool transforms_rest = !std::exchange(transforms_changed_, false);
  // A build of the previous volume would replace the queued load.
  const bool another_comes = jobs_.builder.loads();
  AssetFeed* own = as_asset(feed_);
  const bool waits = another_comes && own != nullptr && std::ranges::none_of(shown_, &Shown::is_there);
  if (!is_shown() || !built_for_another() || waits) return;
  const bool rests = !preview_ || !track_.built_for || (view_rests && transforms_rest);
  // GPU builds follow a moving camera, one grid after another, each of which is displayed.
  const bool follows = own != nullptr && built_.source && built_.source->plan && grid_.build.on == BuildOn::gpu &&
                       !jobs_.builder.busy() && displays_newest();
  if (!rests && !follows) return;
  take_medium();
  if (own != nullptr) {
    if (!another_comes) own->build(settings_for_view(), rests ? nullptr : built_.source->plan);
  } else if (feed_) {
    feed_->request(for_own_feed(settings_for_view()));
    if (as_dynamic(feed_) == nullptr) follow_feed();
  }
  requests_due_ = true;
  follow_instances();
  track_.built_for = build_view();
  track_.own_left_out = volume_ && another_comes;
  track_.built_in_motion = !rests;
}

VolumeAssetPtr VolumeStage::empty_volume(const std::optional<Bounds>& box) {
  if (!empty_volume_) {
    volume::ScalarVolume empty;
    empty.name = "nothing";
    empty.bounds_max = glm::ivec3(0);
    const dvec3 middle = box ? 0.5 * (box->min + box->max) : dvec3(0.0);
    // If the scene is far away, count_from() moves the volume to the scene's origin.
    const bool near = !box || scene::origin_of_scene(std::array{scene::Extent{box->min, box->max}}, {}) == dvec3(0.0);
    empty.index_to_world[3] = glm::dvec4(near ? middle : dvec3(0.0), 1.0);
    empty_volume_ = std::make_shared<const VolumeAsset>(std::move(empty));
  }
  return empty_volume_;
}

std::vector<scene::Volume> VolumeStage::volumes(const std::vector<scene::Volume>& before) const {
  std::vector<scene::Volume> volumes;
  // The empty volume for surfaces is left out if instances are displayed.
  const scene::MarchSourcePtr& source = shows_proxy() ? proxy()->source : built_.source;
  if (source && (shown_info() || !shows_instances())) {
    const auto frame = feed_ ? feed_->frame() : std::nullopt;
    for (const scene::InstanceTransform& transform : transforms_)
      volumes.push_back(
          {0, source, shown_medium_, {transform.to_world, while_open(transform.ends, shutter_seconds_)}, frame});
    for (std::size_t i = 0; i < std::min(volumes.size(), previous_transforms_.size()); ++i)
      volumes[i].previous = previous_transforms_[i];
    if (shown_info()) std::ranges::for_each(volumes, [this](scene::Volume& volume) { volume.clip = clip_; });
  }
  for (const Shown& shown : shown_) {
    if (shown.is_seen() && shown.built)
      volumes.push_back({shown.id,
                         shown.built->source,
                         shown.medium,
                         {shown.settings.to_world, while_open(shown.settings.ends, shutter_seconds_)},
                         shown.frame(),
                         shown.settings.previous,
                         shown.settings.clip});
  }
  const auto differs = [&](const scene::Volume& volume) {
    const scene::MarchSource& first = *volumes.front().source;
    return !volume.source->goes_with(first);
  };
  if (std::ranges::any_of(volumes, differs)) keep_to_one_march(volumes, before);
  keep_until_cells_are_cut(volumes, before);
  return volumes;
}

void VolumeStage::keep_to_one_march(std::vector<scene::Volume>& volumes,
                                    const std::vector<scene::Volume>& before) const {
  const bool building = builds();
  // While grids are being built, keep volumes that match the displayed ones; afterwards those that match the settings.
  const auto fits = [&](const scene::Volume& volume) {
    if (building && !before.empty()) return volume.source->goes_with(*before.front().source);
    const bool linear = grid_.build.march == scene::March::tet
                            ? grid::has_fits(grid_.build.refine.cells)
                            : grid_.build.interpolation == grid::Interpolation::linear;
    const bool trilinear =
        grid_.build.march == scene::March::tet && grid_.build.refine.cells == grid::CellKind::trilinear;
    return volume.source->march == grid_.build.march && volume.source->linear == linear &&
           volume.source->trilinear == trilinear;
  };
  for (scene::Volume& volume : volumes) {
    if (fits(volume)) continue;
    const auto was =
        std::ranges::find_if(before, [&](const scene::Volume& other) { return other.id == volume.id && fits(other); });
    if (was != before.end()) stay_with(volume, *was);
  }
  std::erase_if(volumes, [&](const scene::Volume& volume) { return !fits(volume); });
}

void VolumeStage::keep_until_cells_are_cut(std::vector<scene::Volume>& volumes,
                                           const std::vector<scene::Volume>& before) const {
  if (!budget_.is_limited()) return;
  const bool own = cuts_own_ && jobs_.builder.busy() && !jobs_.builder.loads() && !shows_proxy() && !plays();
  if (!own && std::ranges::none_of(shown_, [this](const Shown& shown) { return makes_room(shown); })) return;
  const auto was = [&](const scene::Volume& volume) {
    return std::ranges::find(before, volume.id, &scene::Volume::id);
  };
  std::erase_if(volumes, [&](const scene::Volume& volume) { return was(volume) == before.end(); });
  for (scene::Volume& volume : volumes) stay_with(volume, *was(volume));
}

void VolumeStage::count_from(std::vector<scene::Volume>& volumes, const dvec3& origin) const {
  for (scene::Volume& volume : volumes) {
    const bool is_nothing = volume.id == 0 && built_.volume && built_.volume == empty_volume_;
    if (!is_nothing) {
      volume = scene::counted_from(std::move(volume), origin);
    } else if (origin != dvec3(0.0)) {
      // The empty volume for surfaces is moved to the origin.
      volume.transform = {glm::translate(glm::dmat4(1.0), -dvec3(empty_volume_->volume().index_to_world[3]))};
    }
  }
}

void VolumeStage::note_rendered() {
  if (feed_) feed_->note_rendered();
  for (const VolumeFeedPtr& feed : feeds_) feed->note_rendered();
}

void VolumeStage::note_displayed(const scene::SequenceFrames& shown) {
  const auto note = [&](const VolumeFeedPtr& feed) {
    DynamicFeed* live = as_dynamic(feed);
    if (live == nullptr) return;
    if (const auto frame = live->find_in(shown)) live->note_displayed(*frame);
  };
  note(feed_);
  std::ranges::for_each(feeds_, note);
}

void VolumeStage::take_gl_bytes(std::uint64_t beside_volumes) {
  // Requests made before the first frame did not include the memory of images.
  if (budget_.set_bytes_beside(beside_volumes)) requests_due_ = requests_due_ || !shown_.empty();
}

void VolumeStage::take_unseen_states() {
  if (as_dynamic(feed_) != nullptr) take_from_feed(true);
  take_states(true);
}

bool VolumeStage::something_waits() const {
  const auto waits = [](const VolumeFeedPtr& feed) { return feed && feed->waits(); };
  return waits(feed_) || std::ranges::any_of(feeds_, waits);
}

}  // namespace cumulet::viewer
