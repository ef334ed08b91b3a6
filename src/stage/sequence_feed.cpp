#include "stage/sequence_feed.hpp"

#include <algorithm>
#include <utility>

namespace cumulet::viewer {

SequenceFeed::SequenceFeed(std::shared_ptr<Sequence> sequence, const std::optional<BuildSettings>& settings,
                           std::shared_ptr<FrameCache> cache, Suggestion suggestion, ResourceLimitsPtr resource_limits,
                           const FeedContext& context)
    : VolumeFeed(context),
      sequence_(std::move(sequence)),
      cache_(std::move(cache)),
      suggestion_(suggestion),
      resource_limits_(std::move(resource_limits)),
      listener_(sequence_->listen(context.notify)) {
  set_settings(settings);
}

void SequenceFeed::request(const std::optional<BuildSettings>& settings) {
  set_settings(settings);
  request_due_ = true;
}

bool SequenceFeed::take_info() {
  auto analyzed = cache_->take_analyzed();
  if (!analyzed) return false;
  volume_ = nullptr;
  volume_info_ = std::move(analyzed->volume_info);
  density_scale_ = analyzed->density_scale;
  const bool is_used = suggestion_ == Suggestion::used_if_asked && sequence_->files()->shown.suggested_density_scale;
  suggest(is_used ? density_scale_ : std::nullopt);
  if (suggested_density_scale()) {
    std::optional<BuildSettings> scaled = settings();
    if (scaled) scaled->refine.density_scale = *suggested_density_scale();
    request(scaled);
  }
  return true;
}

void SequenceFeed::send_request() {
  if (const std::uint64_t revision = sequence_->revision(); revision != revision_) {
    revision_ = revision;
    state_ = sequence_->get();
    request_due_ = true;
  }
  if (request_due_) {
    std::optional<BuildSettings> settings = this->settings();
    if (settings) settings->shutter_seconds *= state_.playback.velocity_scale;
    cache_->request({sequence_->files(), scene::upcoming(state_.playback, state_.moment, state_.forward), settings,
                     std::min(state_.memory_bytes, resource_limits_->memory_bytes()),
                     FrameCache::Steps::of(state_.playback), suggestion_ == Suggestion::used_if_asked});
    request_due_ = false;
    take_due_ = true;
  }
  if (const std::uint64_t cache_revision = cache_->revision(); cache_revision != cache_revision_) {
    cache_revision_ = cache_revision;
    take_due_ = true;
  }
}

VolumeFeed::Taken SequenceFeed::take(bool is_seen) {
  send_request();
  if (!take_due_ || !is_seen) return Taken::nothing;
  take_due_ = false;
  auto ready = cache_->take();
  if (!ready) return Taken::nothing;
  volume_ = ready->built.volume;
  const std::optional<scene::SequenceFrame>& last = frame();
  const std::optional<Built>& before = built();
  const bool is_same_frame = last && ready->frame == last->number && ready->part == last->part;
  if (is_same_frame && before && ready->built.source == before->source) return Taken::same;
  set_taken(ready->frame, ready->part, std::move(ready->built));
  return Taken::other;
}

SequenceFeed::Status SequenceFeed::status(const std::optional<scene::SequenceFrame>& shown) const {
  Status status;
  status.asked = scene::frame_of(state_.playback, state_.moment);
  const std::uint32_t step = scene::step_of(state_.playback, state_.moment);
  status.requested_position = FrameCache::Steps::of(state_.playback).position(step);
  if (shown) status.drawn = static_cast<double>(shown->number) + shown->part;
  status.frames = cache_->frames();
  status.density_scale = density_scale_;
  return status;
}

}  // namespace cumulet::viewer
