#include "stage/dynamic_feed.hpp"

#include <glm/glm.hpp>
#include <utility>

namespace cumulet::viewer {

namespace {

// Metadata of a volume with unknown contents within a box.
VolumeInfoPtr info_of(const Bounds& bounds) {
  volume::ScalarVolume box;
  box.bounds_max = box.bounds_min;
  for (int axis = 0; axis < 3; ++axis) box.index_to_world[axis][axis] = bounds.max[axis] - bounds.min[axis];
  box.index_to_world[3] = glm::dvec4(0.5 * (bounds.min + bounds.max), 1.0);
  return std::make_shared<const VolumeInfo>(VolumeInfo{.empty = false,
                                                       .may_emit = true,
                                                       .index_to_world = box.index_to_world,
                                                       .anisotropy_grid = {},
                                                       .coarse = volume::CoarseVolume(box)});
}

}  // namespace

DynamicFeed::DynamicFeed(std::shared_ptr<Live> live, const std::optional<BuildSettings>& settings,
                         std::shared_ptr<LiveBuilder> builder, const FeedContext& context)
    : VolumeFeed(context), live_(std::move(live)), builder_(std::move(builder)) {
  if (const auto& bounds = live_->bounds()) volume_info_ = info_of(*bounds);
  listener_ = live_->listen([builder = builder_.get(), notify = context.notify] {
    builder->look();
    notify();
  });
  set_settings(settings);
  builder_->follow(live_, settings);
}

void DynamicFeed::request(const std::optional<BuildSettings>& settings) {
  set_settings(settings);
  builder_->configure(settings);
}

VolumeFeed::Taken DynamicFeed::take(bool is_seen) {
  waits_ = !is_seen;
  if (waits_) return Taken::nothing;
  auto ready = builder_->take();
  if (!ready) return Taken::nothing;
  counts_.ready = ready->number;
  ++counts_.ready_count;
  set_taken(ready->number, 0.0, std::move(ready->built));
  return Taken::other;
}

VolumeInfoPtr DynamicFeed::info() const {
  if (volume_info_) return volume_info_;
  const VolumeAssetPtr volume = this->volume();
  return volume ? volume->volume_info() : nullptr;
}

VolumeAssetPtr DynamicFeed::volume() const {
  const std::optional<Built>& last = built();
  return last ? last->volume : nullptr;
}

DynamicFeed::Status DynamicFeed::status() const {
  Status status = counts_;
  status.handed = live_->newest();
  return status;
}

void DynamicFeed::note_displayed(const scene::SequenceFrame& shown) {
  if (shown.taken == seen_last_) return;
  seen_last_ = shown.taken;
  counts_.drawn = shown.number;
  ++counts_.displayed_count;
}

}  // namespace cumulet::viewer
