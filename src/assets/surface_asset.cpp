#include "assets/surface_asset.hpp"

#include <limits>

#include "assets/patient_lock.hpp"

namespace cumulet::viewer {

SurfaceAsset::Rest SurfaceAsset::rest() const {
  const std::scoped_lock lock(rest_mutex_);
  if (!rest_) {
    // No scene has an animation with this index, so the pose is at rest.
    const surface::Pose pose = scene_->pose(0.0, std::numeric_limits<std::size_t>::max());
    rest_ = Rest{pose.lights.size(), pose.cameras.size(), {pose.low, pose.high}};
  }
  return *rest_;
}

scene::ModelSourcePtr SurfaceAsset::posed(SurfaceChoice choice, Progress& progress) const {
  if (!scene_->may_move(choice.animation)) choice.shutter_seconds = 0.0;
  const auto lock = patient_lock(mutex_, progress);
  scene::ModelSourcePtr last = newest_.lock();
  if (last && newest_choice_ == choice) return last;
  progress.check();
  surface::Pose pose = scene_->pose(choice.time, choice.animation, &progress);
  pose.double_sided = choice.double_sided;
  if (choice.variant > 0 && choice.variant <= scene_->variants.size()) {
    pose.chosen = scene_->variants[choice.variant - 1].materials;
  }
  std::optional<surface::PoseEnds> ends;
  if (choice.shutter_seconds > 0.0)
    ends = scene_->pose_ends(choice.time, choice.animation, choice.shutter_seconds, &progress);
  scene::ModelSourcePtr made = last ? scene::make_model_source(*last, std::move(pose), &progress, ends)
                                    : scene::make_model_source(scene_, std::move(pose), &progress, ends);
  newest_ = made;
  newest_choice_ = choice;
  return made;
}

}  // namespace cumulet::viewer
