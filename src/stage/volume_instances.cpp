// The part of VolumeStage that requests grids of instances.

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "scene/space.hpp"
#include "stage/volume_stage.hpp"

namespace cumulet::viewer {

namespace {

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

}  // namespace

void VolumeStage::follow_instances() {
  for (Shown& shown : shown_) {
    if (!shown.read_settings()) continue;
    shown.medium.set(shown_medium(shown.settings.medium));
    const bool has_other_source = shown.feed && shown.feed->source() != shown.source();
    if (has_other_source || !shown.has_anything()) shown.forget();
    if (!shown.settings.volume) {
      shown.request.reset();
      shown.begun.reset();
    }
    requests_due_ = true;
    ++changed_instances_;
  }
  if (requests_due_) request_for_feeds();
  take_frames();
  if (jobs_.grids.take_changes()) take_grids();
  // The viewer's own grid, which was to be reused, may have failed.
  if (waits_for_own_ && !jobs_.builder.busy()) requests_due_ = true;
  if (!requests_due_ || (grid_.camera_adaptive && !track_.view)) return;
  requests_due_ = false;
  request_for_grids();
  take_grids();
}

VolumeFeedPtr VolumeStage::make_feed(const InstanceSettings& settings, const std::optional<BuildSettings>& build) {
  const FeedContext context = feed_context();
  const JobContext jobs = jobs_.context(context.id);
  if (settings.sequence) {
    return std::make_shared<SequenceFeed>(settings.sequence, build, std::make_shared<FrameCache>(jobs),
                                          SequenceFeed::Suggestion::ignored, budget_.shared_limits(), context);
  }
  host_.track(settings.live);
  return std::make_shared<DynamicFeed>(settings.live, build, std::make_shared<LiveBuilder>(jobs), context);
}

void VolumeStage::share_feeds(bool (*is_of_kind)(const Shown&), std::vector<VolumeFeedPtr>& feeds) {
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
    if (!grid_.camera_adaptive || track_.view) settings = settings_of(shown);
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

void VolumeStage::request_for_feeds() {
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

void VolumeStage::take_states(bool unseen) {
  for (const VolumeFeedPtr& feed : feeds_) {
    if (as_dynamic(feed) != nullptr) feed->take(unseen || is_seen(*feed));
  }
}

void VolumeStage::take_frames() {
  for (const VolumeFeedPtr& feed : feeds_) {
    if (as_sequence(feed) == nullptr) continue;
    feed->take_info();
    feed->take(is_seen(*feed));
  }
  for (Shown& shown : shown_) {
    if (shown.feed && shown.feed->built()) shown.built = shown.feed->built();
  }
}

std::optional<Built> VolumeStage::grid_of(const GridCache::Request& request) const {
  const auto is = [&](const Built& built) {
    return built.volume == request.volume && built.settings == request.settings;
  };
  if (built_.source && is(built_)) return built_;
  for (const Shown& shown : shown_) {
    if (shown.built && is(*shown.built) && budget_.fits(*shown.built)) return shown.built;
  }
  return jobs_.grids.built(request);
}

void VolumeStage::take_grids() {
  for (Shown& shown : shown_) {
    if (!shown.request) continue;
    auto built = grid_of(*shown.request);
    // If requests change faster than grids are built, show one that was begun.
    if (!built && shown.begun) built = jobs_.grids.built(*shown.begun);
    if (built) shown.built = std::move(built);
  }
}

BuildSettings VolumeStage::settings_of(const Shown& shown) {
  const Medium& medium = shown.settings.medium;
  BuildSettings settings = grid_.build;
  settings.density_ramp = shown.settings.ramps.density;
  settings.density_colors = shown.settings.ramps.density_colors;
  settings.emission = emission_of(medium, shown.settings.ramps);
  settings.refine.density_scale = medium.density_scale * scene::mean_stretch(shown.settings.to_world);
  settings.refine.anisotropy = scene::mean_cosine(medium.phase);
  settings.anisotropic = medium.phase.may_vary();
  if (grid_.camera_adaptive) {
    settings.refine.camera = refine_camera();
    settings.refine.camera->transforms = {shown.settings.to_world};
  }
  if (shown.settings.live) settings.interpolation = interpolation_of(*shown.settings.live);
  return settings;
}

void VolumeStage::reuse_grid(GridCache::Request& request) const {
  const auto serves = [&](const Built& built) {
    return built.volume == request.volume && built.serves(request.settings) && budget_.fits(built);
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

void VolumeStage::request_for_grids() {
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
      plays();
  const std::size_t grids = requests.size() + feeds_.size() + (own_is_apart ? 1 : 0);
  budget_.set_grids(grids);
  for (GridCache::Request& request : requests) request.gl_bytes = budget_.part();
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

}  // namespace cumulet::viewer
