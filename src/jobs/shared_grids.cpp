#include "jobs/shared_grids.hpp"

#include <algorithm>
#include <chrono>

#include "jobs/cell_budget.hpp"

namespace cumulet::viewer {

namespace {

// Returns the settings without those that do not change the grid of this volume.
BuildSettings essential(BuildSettings settings, const VolumeAsset& volume) {
  if (!volume.moves()) settings.shutter_seconds = 0.0;
  if (settings.march != scene::March::tet || settings.refine.criterion != grid::Criterion::transmittance) {
    settings.refine.density_scale = 1.0;
    settings.refine.anisotropy = 0.0;
  }
  return settings;
}

// Returns true if a build under these limits would make the same grid.
bool is_allowed(const Built& built, const ResourceLimits& resource_limits) {
  return built.bytes() <= resource_limits.memory_bytes() &&
         (built.source->march != scene::March::tet || has_cells_allowed(built, resource_limits));
}

// Reports the progress of another thread's work as one's own.
void follow(const Progress& other, Progress& progress) {
  if (progress.stage() != other.stage()) progress.begin(other.stage());
  progress.at(other.fraction());
}

}  // namespace

std::shared_ptr<SharedGrids::Entry> SharedGrids::entry_of(const BuildSettings& settings) {
  std::erase_if(entries_, [](const std::shared_ptr<Entry>& entry) {
    std::erase_if(entry->made, [](const Made& made) { return made.source.expired(); });
    return entry.use_count() == 1 && entry->made.empty();
  });
  const auto found = std::ranges::find(entries_, settings, [](const auto& entry) { return entry->settings; });
  if (found != entries_.end()) return *found;
  entries_.push_back(std::make_shared<Entry>());
  entries_.back()->settings = settings;
  return entries_.back();
}

std::optional<Built> SharedGrids::find(const Entry& entry, const VolumeAssetPtr& volume, const BuildSettings& settings,
                                       const ResourceLimits& resource_limits, Lines& lines) {
  for (const Made& made : entry.made) {
    Built built = made.built;
    built.source = made.source.lock();
    if (!built.source) continue;
    built.volume = volume;
    built.settings = settings;
    if (!is_allowed(built, resource_limits)) continue;
    lines = made.lines;
    return built;
  }
  return std::nullopt;
}

Built SharedGrids::get(const Log& log, const VolumeAssetPtr& volume, const BuildSettings& settings, Progress& progress,
                       const ResourceLimits& resource_limits) {
  constexpr std::chrono::milliseconds step(5);  // between checks for cancellation
  std::unique_lock lock(mutex_);
  const std::shared_ptr<Entry> entry = entry_of(essential(settings, *volume));
  for (;; changed_.wait_for(lock, step)) {
    Lines lines;
    if (std::optional<Built> found = find(*entry, volume, settings, resource_limits, lines)) {
      lock.unlock();
      for (const auto& [level, line] : lines) log.write(level, line);
      return *std::move(found);
    }
    if (entry->building == nullptr) break;
    follow(*entry->building, progress);
  }
  // Also if the build fails, or a callback of the host ends the thread.
  struct End {
    SharedGrids& grids;
    Entry& entry;
    ~End() {
      {
        const std::scoped_lock ending(grids.mutex_);
        entry.building = nullptr;
      }
      grids.changed_.notify_all();
    }
  };
  entry->building = &progress;
  lock.unlock();
  const End end{*this, *entry};
  Lines lines;
  const Log both([&](LogLevel level, const char* line) {
    lines.emplace_back(level, line);
    log.write(level, line);
  });
  Built built = build_grid(both, volume, settings, progress, resource_limits);
  if (!built.source) return built;
  Made made{built, built.source, std::move(lines)};
  made.built.volume.reset();
  made.built.source.reset();
  lock.lock();
  entry->made.push_back(std::move(made));
  lock.unlock();
  return built;
}

void SharedGrids::forget() {
  std::vector<std::shared_ptr<Entry>> old;  // destroyed after the lock is released
  const std::scoped_lock lock(mutex_);
  entries_.swap(old);
}

Built shared_grid(const Log& log, const VolumeAssetPtr& volume, const BuildSettings& settings, Progress& progress,
                  const ResourceLimits& resource_limits, const scene::GridPlanPtr& before) {
  if (before || volume->in_gl()) return build_grid(log, volume, settings, progress, resource_limits, before);
  return volume->kept<SharedGrids>()->get(log, volume, settings, progress, resource_limits);
}

void forget_grids(const VolumeAssetPtr& volume) {
  if (volume) volume->kept<SharedGrids>()->forget();
}

}  // namespace cumulet::viewer
