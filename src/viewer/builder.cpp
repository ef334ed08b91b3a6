#include "viewer/builder.hpp"

#include <algorithm>
#include <utility>

#include "base/detached_work.hpp"
#include "grid/grid_builder.hpp"
#include "scene/space.hpp"
#include "viewer/cell_budget.hpp"
#include "viewer/stopwatch.hpp"
#include "volume/advection.hpp"

namespace cumulet::viewer {

namespace {

// Maximum ratio of opacities for which a grid refined by opacity can be reused.
constexpr double max_opacity_ratio = 2.0;

bool apart(double a, double b) { return a > max_opacity_ratio * b || b > max_opacity_ratio * a; }

}  // namespace

bool suits(const BuildSettings& made, const BuildSettings& wanted) {
  BuildSettings alike = made;
  alike.refine.density_scale = wanted.refine.density_scale;
  alike.refine.anisotropy = wanted.refine.anisotropy;
  if (alike != wanted) return false;
  const grid::RefineSettings& a = made.refine;
  const grid::RefineSettings& b = wanted.refine;
  if (wanted.march != scene::March::tet || b.criterion != grid::Criterion::transmittance) return true;
  return !apart(a.density_scale, b.density_scale) &&
         !apart(grid::hiding(a.density_scale, a.anisotropy), grid::hiding(b.density_scale, b.anisotropy));
}

std::uint64_t Built::bytes() const {
  // Voxel sources share the volume's data.
  const std::uint64_t read = source && source->volume && volume ? source->volume->bytes() : 0;
  const std::uint64_t statistics = source && source->statistics && volume ? source->statistics->bytes() : 0;
  const std::uint64_t channels = source && volume ? source->channels.bytes() : 0;
  const std::uint64_t lattice = source && source->plan && volume ? source->plan->lattice->bytes() : 0;
  return (volume ? volume->bytes() : 0) + (source ? source->bytes() : 0) - read - statistics - channels - lattice;
}

bool Built::serves(const BuildSettings& wanted) const {
  BuildSettings made = settings;
  if (!moves) made.shutter_seconds = wanted.shutter_seconds;
  return suits(made, wanted);
}

namespace {

// Returns the volume for the shutter interval; null if nothing moves.
VolumeAssetPtr open_of(const VolumeAssetPtr& volume, double seconds, Progress& progress) {
  try {
    return volume->while_open(seconds, progress);
  } catch (const Error& error) {
    if (error.code() == ErrorCode::cancelled) throw;
    throw Error(error.code(), volume->name() + ", while the shutter is open: " + error.what());
  }
}

// Density scale for values in `unit`, limited to the maximum extinction of path tracing.
double density_scale_in(double unit, const volume::ScalarVolume& voxels, const grid::Cube& cube, double scale) {
  const glm::dmat3 axes(cube.to_world);
  const double edge = cube.size() * std::max({glm::length(axes[0]), glm::length(axes[1]), glm::length(axes[2])});
  const double max_value = voxels.max_value;
  return max_value > 0.0 ? std::min(scale * unit, scene::max_extinction(edge) / max_value) : scale * unit;
}

}  // namespace

bool needs_values(const VolumeAsset& volume, const BuildSettings& settings) {
  return settings.march != scene::March::tet || settings.on != BuildOn::gpu || !settings.density_ramp.empty() ||
         volume.is_extreme() || (settings.shutter_seconds != 0.0 && volume.moves());
}

void log_limited(const Log& log, std::uint64_t most, std::uint64_t max_cells) {
  log.info((most < max_cells ? "the memory limit of " + std::to_string(most) + " cells"
                             : "max_cells (" + std::to_string(max_cells) + ")") +
           " stopped the refinement above the threshold");
}

Built build_grid(const Log& log, const VolumeAssetPtr& volume, const BuildSettings& settings, Progress& progress,
                 const ResourceLimits& resource_limits, const scene::GridPlanPtr& before) {
  Built built;
  const volume::DeviceBricksPtr& in_gl = volume->volume().on_device;
  if (in_gl && needs_values(*volume, settings)) {
    in_gl->ask_for_values();
    return built;
  }
  built.volume = volume;
  built.settings = settings;
  built.active_voxels = volume->volume().active_voxels;
  built.moves = volume->moves();
  Stopwatch watch;
  const VolumeAssetPtr moving = open_of(volume, settings.shutter_seconds, progress);
  const VolumeAsset& shown = moving ? *moving : *volume;
  if (moving && 0.5 * settings.shutter_seconds * volume->fastest() > volume::farthest_voxels)
    log.info(volume->name() + ": motion blur is limited to 64 voxels per half shutter time");
  const double taken = watch.lap();
  const auto [voxels, statistics, unit] = shown.density(settings.density_ramp, progress, built.seconds.statistics);
  watch.lap();
  const grid::Channels channels =
      shown.channels(settings.density_ramp, settings.emission, settings.anisotropic, progress, log);
  built.seconds.statistics += taken + watch.lap();
  progress.begin(Progress::Stage::refining);
  const auto finished = [unit = unit, depth = unit * statistics->mean_optical_depth()](scene::MarchSource source) {
    source.value_unit = unit;
    source.optical_depth = depth;
    return std::make_shared<const scene::MarchSource>(std::move(source));
  };
  if (settings.march != scene::March::tet) {
    built.source = finished(scene::make_voxel_source(settings.march, voxels, statistics, channels));
    resource_limits.require(built.bytes(), volume->name());
    built.seconds.records = watch.lap();
    return built;
  }
  if (settings.on == BuildOn::gpu && moving)
    log.info(volume->name() + ": its grid is built on the CPU because it has motion blur");
  const Carried carried = Carried::of(channels);
  const std::uint64_t max_cells = settings.refine.max_cells;
  grid::RefineSettings refine = settings.refine;
  refine.density_scale = density_scale_in(unit, *voxels, statistics->cube(), settings.refine.density_scale);
  grid::LatticePtr lattice;
  std::optional<std::uint64_t> planned;
  if (settings.on == BuildOn::gpu && !moving) {
    lattice = volume->lattice(settings.density_ramp, channels, refine, progress);
    planned = planned_cells_that_fit(max_cells, carried, *lattice, volume->bytes(), resource_limits);
    if (!planned && in_gl) {
      in_gl->ask_for_values();
      return {};
    }
    if (!planned)
      log.info(volume->name() + ": its grid is built on the CPU: a lattice of " +
               std::to_string(lattice->device_bytes()) + " bytes leaves too little of the GPU memory limit of " +
               std::to_string(resource_limits.gl_bytes()) + " bytes");
  }
  if (planned) {
    std::vector<std::uint8_t> levels =
        before && before->lattice == lattice
            ? lattice->own.levels(lattice->cube, settings.refine, before->levels, &progress)
            : lattice->own.levels(grid::ViewLevels(lattice->cube, settings.refine), &progress);
    built.source =
        finished(scene::make_planned_source({lattice, std::move(levels), *planned}, voxels, statistics, channels));
    built.cell_limit = *planned;
    resource_limits.require(built.bytes(), volume->name());
    built.seconds.refine = watch.lap();
    return built;
  }
  refine.max_cells = built.cell_limit = cells_that_fit(max_cells, carried, volume->bytes(), resource_limits);
  const auto diamonds = make_deferred_delete<const grid::DiamondSet>(*statistics, channels, refine, &progress);
  auto builder = make_deferred_delete<grid::GridBuilder>(*statistics, *diamonds);
  builder->bisect(&progress);
  built.seconds.refine = watch.lap();
  progress.begin(Progress::Stage::records);
  const float max_value = voxels->max_value;
  auto grid = make_deferred_delete<const grid::TetGrid>(
      builder->records(settings.refine.cells, max_value, channels, &progress));
  builder.reset();
  built.seconds.records = watch.lap();
  built.cells = grid->cells.size();
  built.levels = grid->levels;
  built.limited = grid->limited;
  if (grid->limited) log_limited(log, refine.max_cells, max_cells);
  built.source = finished(
      scene::make_tet_source(std::move(grid), settings.refine.cells == grid::CellKind::linear, max_value, &progress));
  resource_limits.require(built.bytes(), volume->name());
  return built;
}

namespace {

void transform(volume::VolumeFrame& frame, const glm::dmat4& to_world) {
  for (volume::ScalarVolume* field : frame.fields()) field->index_to_world = to_world * field->index_to_world;
}

}  // namespace

VolumeAssetPtr VolumeFile::read(const Log& log, Progress* progress) const { return read(log, progress, {}); }

VolumeAssetPtr VolumeFile::read(const Log& log, Progress* progress,
                                const std::function<void(volume::Proxy)>& take_proxy) const {
  const auto take = [&](volume::Proxy made) {
    transform(made.frame, to_world);
    if (made.extent) made.extent->index_to_world = to_world * made.extent->index_to_world;
    take_proxy(std::move(made));
  };
  volume::VolumeFrame frame = take_proxy ? volume::import_frame(path, grids, log, progress, {take, min_proxy_bricks})
                                         : volume::import_frame(path, grids, log, progress);
  transform(frame, to_world);
  frame.temperature_scale = temperature_scale;
  try {
    return std::make_shared<const VolumeAsset>(std::move(frame), progress);
  } catch (const Error& e) {
    if (e.code() == ErrorCode::cancelled) throw;
    throw Error(e.code(), path.given() + ": " + e.what());
  }
}

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
  Built built = build_grid(log_, volume, settings, progress, *resource_limits_, before);
  built.seconds.load = load_seconds;
  const std::scoped_lock lock(mutex_);
  progress.check();
  built_ = std::move(built);
  proxy_.reset();  // not displayed yet
}

}  // namespace cumulet::viewer
