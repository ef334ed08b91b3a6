#include "stage/model_stage.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "base/error.hpp"
#include "scene/model_table.hpp"

namespace cumulet::viewer {

void ModelStage::add_model(std::shared_ptr<ModelInstance> model, std::uint64_t id) {
  failures_.retire();
  host_.sync();
  if (find(*model) != shown_.end()) throw Error(ErrorCode::invalid_argument, "the model is already in the viewer");
  shown_.emplace_back(std::move(model), id, host_);
  host_.sync();  // starts posing its surfaces
  host_.touch();
}

void ModelStage::remove_model(const ModelInstance& model) {
  failures_.retire();
  host_.sync();
  const auto found = find(model);
  if (found == shown_.end()) throw Error(ErrorCode::invalid_argument, "the model is not in the viewer");
  shown_.erase(found);
  poses_due_ = true;
  host_.sync();  // drops its failures
  host_.touch();
}

std::vector<ModelStage::Shown>::iterator ModelStage::find(const ModelInstance& model) {
  return std::ranges::find_if(shown_, [&](const Shown& shown) { return shown.object.get() == &model; });
}

std::size_t ModelStage::sync() {
  std::size_t changed = 0;
  for (Shown& shown : shown_) {
    const SurfaceAssetPtr before = shown.settings.surfaces;
    if (!shown.read_settings()) continue;
    if (before != shown.settings.surfaces && shown.source &&
        (!shown.settings.surfaces || shown.source->scene.get() != &shown.settings.surfaces->scene())) {
      shown.source = nullptr;
      shown.begun.reset();
    }
    poses_due_ = true;
    ++changed;
  }
  take_poses();
  if (auto surfaces = surfaces_.take()) {
    if (surfaces->asset) asset_ = std::move(surfaces->asset);
    source_ = std::move(surfaces->source);
  }
  return changed;
}

std::optional<PoseCache::Request> ModelStage::previous_pose(const Shown& shown) {
  const ModelSettings& settings = shown.settings;
  if (!settings.previous_time || *settings.previous_time == settings.choice.time) return std::nullopt;
  SurfaceChoice choice = settings.choice;
  choice.time = *settings.previous_time;
  return PoseCache::Request{settings.surfaces, choice};
}

void ModelStage::take_poses() {
  if (!poses_.take_changes() && !poses_due_) return;
  std::vector<PoseCache::Request> requests;
  for (Shown& shown : shown_) {
    if (!shown.is_wanted()) {
      shown.request.reset();
      continue;
    }
    PoseCache::Request request{shown.settings.surfaces, choice_to_pose(shown.settings.choice, shown.settings.surfaces)};
    if (shown.request != request) {
      if (shown.request && poses_.is_under_way(*shown.request)) shown.begun = std::move(shown.request);
      shown.request = request;
    }
    if (std::ranges::find(requests, request) == requests.end()) requests.push_back(request);
    const std::optional<PoseCache::Request> then = previous_pose(shown);
    if (then && std::ranges::find(requests, *then) == requests.end()) requests.push_back(*then);
  }
  // Take results before sending the requests, which may drop poses made for earlier ones.
  for (Shown& shown : shown_) {
    if (!shown.request) continue;
    auto source = poses_.built(*shown.request);
    if (source) shown.begun.reset();  // older poses are not shown again
    // If requests change faster than poses are made, show one that was begun.
    if (!source && shown.begun && shown.begun->surfaces == shown.settings.surfaces) source = poses_.built(*shown.begun);
    if (source) shown.source = std::move(*source);
    const std::optional<PoseCache::Request> then = previous_pose(shown);
    shown.previous_source = then ? poses_.built(*then).value_or(nullptr) : nullptr;
  }
  if (std::exchange(poses_due_, false)) poses_.request(std::move(requests));
}

void ModelStage::load_surfaces(const FilePath& path) {
  failures_.retire();
  host_.sync();
  surfaces_.load(path, choice_to_pose(settings_.choice, nullptr));
  host_.touch();
}

void ModelStage::cancel_surfaces(bool keep_poses) {
  surfaces_.forget_failure();
  if (keep_poses) {
    surfaces_.cancel_loads();
  } else {
    surfaces_.cancel();
  }
}

void ModelStage::show_surfaces(scene::ModelSourcePtr surfaces) {
  failures_.retire();
  cancel_surfaces(false);
  host_.sync();
  asset_ = std::make_shared<const SurfaceAsset>(surfaces->scene, std::string());
  source_ = std::move(surfaces);
  host_.touch();
}

void ModelStage::set_surfaces(SurfaceAssetPtr surfaces) {
  failures_.retire();
  cancel_surfaces(surfaces != nullptr);
  host_.sync();
  asset_ = std::move(surfaces);
  pose_surfaces();
  if (!asset_) source_ = nullptr;
  host_.touch();
}

SurfaceAssetPtr ModelStage::surfaces_asset() {
  host_.sync();
  return asset_;
}

void ModelStage::set_surface_settings(const SurfaceSettings& settings) {
  // A running load uses them without another pose.
  const bool poses =
      settings.choice != settings_.choice && !surfaces_.configure_load(choice_to_pose(settings.choice, nullptr));
  if (poses) host_.sync();
  settings_ = settings;
  if (poses) pose_surfaces();
  host_.touch();
}

const surface::SceneCamera& ModelStage::camera(std::size_t index) const {
  const std::size_t count = source_ ? source_->pose.cameras.size() : 0;
  if (index >= count) {
    throw Error(ErrorCode::invalid_argument,
                "there is no camera " + std::to_string(index) + ": the surfaces have " + std::to_string(count));
  }
  return source_->pose.cameras[index];
}

void ModelStage::pose_surfaces() {
  failures_.retire();
  if (asset_) surfaces_.pose(asset_, choice_to_pose(settings_.choice, asset_));
}

void ModelStage::set_shutter(double seconds) {
  if (shutter_seconds_ == seconds) return;
  shutter_seconds_ = seconds;
  poses_due_ = true;
  const bool loads = surfaces_.configure_load(choice_to_pose(settings_.choice, nullptr));
  if (!loads && asset_ && asset_->scene().may_move(settings_.choice.animation)) pose_surfaces();
}

SurfaceChoice ModelStage::choice_to_pose(SurfaceChoice choice, const SurfaceAssetPtr& surfaces) const {
  if (!surfaces || surfaces->scene().may_move(choice.animation)) choice.shutter_seconds = shutter_seconds_;
  return choice;
}

std::vector<scene::Model> ModelStage::models() const {
  std::vector<scene::Model> models;
  if (source_) {
    scene::Model& own = models.emplace_back();
    own.source = source_;
    own.group = settings_.group;
    own.holdout = settings_.holdout;
  }
  for (const Shown& shown : shown_) {
    if (shown.is_shown())
      models.push_back({shown.id, shown.source, shown.settings.to_world, shown.settings.shadow_only,
                        shown.settings.group, shown.settings.previous, shown.previous_source, shown.settings.holdout,
                        while_open(shown.settings.ends, shutter_seconds_)});
  }
  return models;
}

bool ModelStage::shows_models() const { return source_ || std::ranges::any_of(shown_, &Shown::is_shown); }

bool ModelStage::shows_triangles() const {
  return std::ranges::any_of(models(), [](const scene::Model& m) { return m.source->scene->triangle_count() > 0; });
}

void ModelStage::append_bounds(std::vector<Bounds>& boxes) const {
  if (source_ && source_->scene->triangle_count() > 0) boxes.push_back({source_->pose.low, source_->pose.high});
  for (const Shown& shown : shown_) {
    if (!shown.is_shown()) continue;
    const scene::ModelBounds bounds = scene::bounds_of(*shown.source, shown.settings.to_world);
    if (bounds.any) boxes.push_back({bounds.low, bounds.high});
  }
}

std::optional<std::uint64_t> ModelStage::tag_of(std::uint64_t id) const {
  const auto found = std::ranges::find(shown_, id, &Shown::id);
  return found != shown_.end() ? std::optional(found->settings.tag) : std::nullopt;
}

}  // namespace cumulet::viewer
