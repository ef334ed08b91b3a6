#include "jobs/builder.hpp"

#include <utility>

#include "jobs/shared_grids.hpp"
#include "jobs/stopwatch.hpp"

namespace cumulet::viewer {

void Builder::load(const VolumeFile& file, std::optional<BuildSettings> settings, std::optional<BuildSettings> proxy) {
  if (job_log() != nullptr) job_log()->load_volume(file, settings, proxy);
  const auto load = std::make_shared<Load>(Load{std::move(settings), std::move(proxy)});
  const std::scoped_lock lock(mutex_);
  load_ = load;
  worker_.replace({file.path.given(), Progress::Stage::loading,
                   [this, file, load](Progress& progress) {
                     try {
                       read(file, load, progress);
                     } catch (...) {
                       const std::scoped_lock failing(mutex_);
                       if (proxy_ && proxy_->load.lock() == load) proxy_.reset();
                       throw;
                     }
                   },
                   true});
  drop_proxy();
}

void Builder::read(const VolumeFile& file, const std::shared_ptr<Load>& load, Progress& progress) {
  Stopwatch watch;
  std::function<void(volume::Proxy)> take_proxy;
  if (load->proxy) take_proxy = [&](volume::Proxy made) { build_proxy(file, std::move(made), load, progress); };
  LoadedVolume loaded{file.read(log_, &progress, take_proxy), {}};
  if (file.suggested_density_scale) loaded.density_scale = loaded.volume->coarse().suggest_density_scale();
  const double seconds = watch.lap();
  resource_limits_->require(loaded.volume->bytes(), file.path.given());
  {
    const std::scoped_lock handing(mutex_);
    progress.check();
    loaded_ = loaded;
    load->open = false;
  }
  // load->open is false, so no other thread changes the settings now.
  if (!load->settings) return;
  if (loaded.density_scale) load->settings->refine.density_scale = *loaded.density_scale;
  build_of(loaded.volume, *load->settings, seconds, progress);
}

void Builder::build_proxy(const VolumeFile& file, volume::Proxy made, const std::shared_ptr<const Load>& load,
                          const Progress& loading) {
  const auto progress = std::make_shared<Progress>();
  BuildSettings settings;
  {
    const std::scoped_lock lock(mutex_);
    loading.check();
    settings = load->settings ? *load->settings : *load->proxy;
    proxy_load_ = progress;
  }
  settings.on = BuildOn::cpu;
  settings.refine.camera.reset();
  Proxy proxy;
  proxy.load = load;
  try {
    const auto volume = std::make_shared<const VolumeAsset>(std::move(made.frame), progress.get());
    if (volume->empty()) return;
    if (file.suggested_density_scale) proxy.density_scale = volume->coarse().suggest_density_scale();
    if (proxy.density_scale) settings.refine.density_scale = *proxy.density_scale;
    VolumeInfo volume_info = *volume->volume_info();
    if (made.extent) {
      volume_info.low = made.extent->low;
      volume_info.high = made.extent->high;
      volume_info.index_to_world = made.extent->index_to_world;
    }
    proxy.volume_info = std::make_shared<const VolumeInfo>(std::move(volume_info));
    proxy.source = build_grid({}, volume, settings, *progress, *resource_limits_).source;
  } catch (...) {
    // No message: the whole file has the same problem.
    loading.check();
    return;
  }
  {
    const std::scoped_lock lock(mutex_);
    loading.check();
    proxy_ = std::move(proxy);
  }
  notify_();
}

void Builder::drop_proxy() {
  if (const auto progress = proxy_load_.lock()) progress->cancel();
  proxy_.reset();
}

void Builder::build(VolumeAssetPtr volume, const BuildSettings& settings, scene::GridPlanPtr before) {
  if (job_log() != nullptr) job_log()->build_volume(volume, settings, before);
  const std::scoped_lock lock(mutex_);
  load_.reset();  // replaces a queued load
  worker_.post({"building the grid", Progress::Stage::refining,
                [this, volume = std::move(volume), settings, before = std::move(before)](Progress& progress) {
                  build_of(volume, settings, 0.0, progress, before);
                }});
}

void Builder::cancel() {
  log_call("volume", "cancel");
  stop([this] { worker_.cancel(); });
}

void Builder::cancel_loads() {
  log_call("volume", "cancel loads");
  stop([this] { worker_.cancel_loads(); });
}

void Builder::stop(const std::function<void()>& jobs) {
  {
    const std::scoped_lock lock(mutex_);
    load_.reset();  // a load that is being stopped accepts no other settings
  }
  jobs();
  // Last: cancelled jobs make no new proxy.
  const std::scoped_lock lock(mutex_);
  drop_proxy();
}

void Builder::forget() {
  log_call("volume", "forget");
  const std::scoped_lock lock(mutex_);
  load_.reset();
  worker_.drop();
  drop_proxy();
  loaded_.reset();
  built_.reset();
}

bool Builder::loads() const {
  const std::scoped_lock lock(mutex_);
  const auto load = load_.lock();
  return load && load->open;
}

bool Builder::configure_load(const std::optional<BuildSettings>& settings) {
  const std::scoped_lock lock(mutex_);
  const auto load = load_.lock();
  if (!load || !load->open) return false;
  load->settings = settings;
  if (job_log() != nullptr) job_log()->configure_volume(settings);
  return true;
}

std::optional<LoadedVolume> Builder::take_loaded() {
  const std::scoped_lock lock(mutex_);
  return std::exchange(loaded_, std::nullopt);
}

void Builder::drop_loaded() {
  const std::scoped_lock lock(mutex_);
  if (!loaded_) return;
  if (built_ && built_->volume == loaded_->volume) built_.reset();
  loaded_.reset();
}

std::optional<Built> Builder::take_built() {
  const std::scoped_lock lock(mutex_);
  return std::exchange(built_, std::nullopt);
}

std::optional<Proxy> Builder::take_proxy() {
  const std::scoped_lock lock(mutex_);
  return std::exchange(proxy_, std::nullopt);
}

bool Builder::busy() const {
  // Check in this order: a job stores its result before it ends.
  return worker_.busy() || has_result();
}

bool Builder::has_result() const {
  const std::scoped_lock lock(mutex_);
  return loaded_ || built_;
}

void Builder::build_of(const VolumeAssetPtr& volume, const BuildSettings& settings, double load_seconds,
                       Progress& progress, const scene::GridPlanPtr& before) {
  Built built = shared_grid(log_, volume, settings, progress, *resource_limits_, before);
  built.seconds.load = load_seconds;
  const std::scoped_lock lock(mutex_);
  progress.check();
  built_ = std::move(built);
  proxy_.reset();  // not displayed yet
}

}  // namespace cumulet::viewer
