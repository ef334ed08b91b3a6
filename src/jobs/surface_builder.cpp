#include "jobs/surface_builder.hpp"

namespace cumulet::viewer {

void SurfaceBuilder::load(const FilePath& path, SurfaceChoice choice) {
  if (job_log() != nullptr) job_log()->load_surfaces(path, choice);
  const auto load = std::make_shared<Load>(Load{choice});
  const std::scoped_lock lock(mutex_);
  load_ = load;
  worker_.replace({path.given(), Progress::Stage::loading,
                   [this, path, load](Progress& progress) { read(path, *load, progress); }, true});
}

void SurfaceBuilder::read(const FilePath& path, Load& load, Progress& progress) {
  const auto asset = std::make_shared<const SurfaceAsset>(surface::import_gltf(path, log_, &progress), path.given());
  scene::ModelSourcePtr made;
  SurfaceChoice choice;
  for (;;) {
    {
      const std::scoped_lock lock(mutex_);
      progress.check();
      if (made && choice == load.choice) {
        load.open = false;
        result_ = {asset, std::move(made)};
        return;
      }
      choice = load.choice;
    }
    made = asset->posed(choice, progress);
  }
}

void SurfaceBuilder::cancel() {
  log_call("surfaces", "cancel");
  {
    const std::scoped_lock lock(mutex_);
    load_.reset();  // a load that is being stopped accepts no other settings
  }
  worker_.cancel();
}

void SurfaceBuilder::cancel_loads() {
  log_call("surfaces", "cancel loads");
  {
    const std::scoped_lock lock(mutex_);
    load_.reset();
  }
  worker_.cancel_loads();
}

bool SurfaceBuilder::configure_load(SurfaceChoice choice) {
  const std::scoped_lock lock(mutex_);
  const auto load = load_.lock();
  if (!load || !load->open) return false;
  load->choice = choice;
  if (job_log() != nullptr) job_log()->configure_surfaces(choice);
  return true;
}

void SurfaceBuilder::pose(SurfaceAssetPtr asset, SurfaceChoice choice) {
  if (job_log() != nullptr) job_log()->pose_surfaces(asset, choice);
  worker_.post(
      {"posing the surfaces", Progress::Stage::loading, [this, asset = std::move(asset), choice](Progress& progress) {
         PosedModel made{nullptr, asset->posed(choice, progress)};
         const std::scoped_lock lock(mutex_);
         progress.check();
         // An untaken result of a load keeps its asset.
         if (result_) made.asset = std::move(result_->asset);
         result_ = std::move(made);
       }});
}

std::optional<PosedModel> SurfaceBuilder::take() {
  const std::scoped_lock lock(mutex_);
  return std::exchange(result_, std::nullopt);
}

bool SurfaceBuilder::busy() const {
  // Check in this order: a job stores its result before it ends.
  if (worker_.busy()) return true;
  const std::scoped_lock lock(mutex_);
  return result_.has_value();
}

}  // namespace cumulet::viewer
