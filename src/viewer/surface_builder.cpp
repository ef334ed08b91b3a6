#include "viewer/surface_builder.hpp"

namespace cumulet::viewer {

void SurfaceBuilder::load(const std::string& path, SurfaceMoment moment) {
  const auto load = std::make_shared<Load>(Load{moment});
  const std::scoped_lock lock(mutex_);
  load_ = load;
  result_.reset();
  worker_.replace(
      {path, Progress::Stage::loading, [this, path, load](Progress& progress) { read(path, *load, progress); }});
}

void SurfaceBuilder::read(const std::string& path, Load& load, Progress& progress) {
  const auto asset = std::make_shared<const SurfaceAsset>(surface::import_gltf(path, log_, &progress), path);
  SurfacePtr made;
  SurfaceMoment moment;
  for (;;) {
    {
      const std::scoped_lock lock(mutex_);
      progress.check();
      if (made && moment == load.moment) {
        load.open = false;
        result_ = {asset, std::move(made)};
        return;
      }
      moment = load.moment;
    }
    made = asset->posed(moment, progress);
  }
}

void SurfaceBuilder::cancel() {
  {
    const std::scoped_lock lock(mutex_);
    load_.reset();  // what it stops soon takes no other settings
  }
  worker_.cancel();
}

bool SurfaceBuilder::configure_load(SurfaceMoment moment) {
  const std::scoped_lock lock(mutex_);
  const auto load = load_.lock();
  if (!load || !load->open) return false;
  load->moment = moment;
  return true;
}

void SurfaceBuilder::pose(SurfaceAssetPtr asset, SurfaceMoment moment) {
  worker_.post(
      {"posing the surfaces", Progress::Stage::loading, [this, asset = std::move(asset), moment](Progress& progress) {
         PosedSurfaces made{asset, asset->posed(moment, progress)};
         const std::scoped_lock lock(mutex_);
         progress.check();
         result_ = std::move(made);
       }});
}

std::optional<PosedSurfaces> SurfaceBuilder::take() {
  const std::scoped_lock lock(mutex_);
  return std::exchange(result_, std::nullopt);
}

bool SurfaceBuilder::busy() const {
  // In this order: what a job leaves is there before it ends.
  if (worker_.busy()) return true;
  const std::scoped_lock lock(mutex_);
  return result_.has_value();
}

}  // namespace cumulet::viewer
