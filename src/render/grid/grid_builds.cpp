#include "render/grid/grid_builds.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

#include "base/detached_work.hpp"
#include "base/error.hpp"
#include "grid/evaluation.hpp"
#include "grid/grid_builder.hpp"

namespace cumulet::render {

LatticeDataPtr GridBuilds::find(const grid::LatticePtr& lattice) const {
  const auto found =
      std::ranges::find(lattices_, lattice.get(), [](const LatticeDataPtr& data) { return &data->lattice(); });
  return found == lattices_.end() ? nullptr : *found;
}

bool GridBuilds::advance(const Sources& sources, const Sources& kept, std::uint64_t max_bytes, Deadline deadline) {
  std::erase_if(lattices_, [&](const LatticeDataPtr& data) {
    return std::ranges::none_of(kept, [&](const scene::MarchSourcePtr& source) {
      return source->plan && source->plan->lattice.get() == &data->lattice();
    });
  });
  try {
    return std::ranges::all_of(sources, [&](const scene::MarchSourcePtr& source) {
      return !source->plan || built_.contains(source) || build(source, max_bytes, deadline);
    });
  } catch (...) {
    stop();
    throw;
  }
}

namespace {

// Wraps a grid that the CPU built.
BuiltGrid built_of(grid::TetGrid grid) {
  BuiltGrid made;
  made.grid = std::make_shared<const grid::TetGrid>(std::move(grid));
  made.count = static_cast<std::uint32_t>(made.grid->cells.size());
  made.levels = made.grid->levels;
  made.limited = made.grid->limited;
  made.content_min = made.grid->content_min;
  made.content_max = made.grid->content_max;
  return made;
}

// Returns an empty grid: the source's voxels are not available.
BuiltGrid nothing_of(const scene::MarchSource& source) {
  volume::ScalarVolume none;
  none.index_to_world = source.volume->index_to_world;
  none.bounds_max = none.bounds_min;
  const grid::Statistics statistics(none, source.cube);
  const grid::DiamondSet diamonds(statistics, grid::RefineSettings{});
  grid::GridBuilder builder(statistics, diamonds);
  builder.bisect();
  return built_of(builder.records(source.plan->lattice->cells, 0.0F));
}

}  // namespace

volume::DeviceBricksPtr GridBuilds::not_here(const scene::MarchSource& source) const {
  std::vector<volume::DeviceBricksPtr> all{source.statistics->on_device()};
  for (const grid::ChannelFields& fields : grid::fields_of(*source.statistics, source.channels)) {
    for (const grid::Statistics* field : fields.statistics()) all.push_back(field->on_device());
  }
  const auto found = std::ranges::find_if(all, [&](const volume::DeviceBricksPtr& bricks) {
    return bricks && (memories_ == nullptr || !memories_->has(*bricks));
  });
  return found == all.end() ? nullptr : *found;
}

bool GridBuilds::build(const scene::MarchSourcePtr& source, std::uint64_t max_bytes, Deadline deadline) {
  const volume::DeviceBricksPtr& in_gl = source->statistics->on_device();
  if (const volume::DeviceBricksPtr elsewhere = not_here(*source)) {
    // Other volumes of the scene are shown meanwhile.
    BuiltGrid& made = built_.emplace(source, nothing_of(*source)).first->second;
    try {
      elsewhere->ask_for_values();
      made.why_not = "it is empty, because its voxels belong to another OpenGL context; they are copied to main memory";
    } catch (const Error& error) {
      made.why_not = std::string("it is empty: ") + error.what();
    }
    return true;
  }
  if (!on_cpu_ || on_cpu_->of() != source) {
    on_cpu_.reset();
    try {
      return build_there(source, max_bytes, deadline);
    } catch (const Error& error) {
      upload_.reset();
      under_way_.reset();
      if (error.code() != ErrorCode::unsupported && error.code() != ErrorCode::out_of_memory) throw;
      // If memory is insufficient, the lattice is freed for the cells.
      if (error.code() == ErrorCode::out_of_memory)
        std::erase_if(lattices_, [&](const auto& data) { return &data->lattice() == source->plan->lattice.get(); });
      if (in_gl) {
        in_gl->ask_for_values();
        throw Error(error.code(), std::string(error.what()) + "; its voxels are copied to main memory");
      }
      on_cpu_ = std::make_unique<CpuGridBuild>(source, error.what());
    }
  }
  std::optional<BuiltGrid> made = on_cpu_->take();
  if (!made) return false;
  on_cpu_.reset();
  built_.emplace(source, std::move(*made));
  return true;
}

void GridBuilds::begin_upload(const scene::MarchSource& source, std::uint64_t max_bytes) {
  upload_ = std::make_unique<LatticeUpload>(gl_, programs_, limits_, source.plan->lattice, source.statistics,
                                            source.channels, memories_);
  const std::uint64_t needs = bytes();
  if (needs <= max_bytes) return;
  throw Error(ErrorCode::out_of_memory, "the lattice needs " + std::to_string(needs) + " bytes of GPU memory; " +
                                            std::to_string(max_bytes) + " are left within the limit");
}

bool GridBuilds::build_there(const scene::MarchSourcePtr& source, std::uint64_t max_bytes, Deadline deadline) {
  const scene::GridPlan& plan = *source->plan;
  LatticeDataPtr data = find(plan.lattice);
  if (!data) {
    under_way_.reset();
    if (!upload_ || upload_->lattice() != plan.lattice) begin_upload(*source, max_bytes);
    if (!upload_->advance(deadline)) return false;
    data = upload_->take();
    upload_.reset();
    lattices_.push_back(data);
  }
  if (!under_way_ || under_way_->of != source) {
    under_way_.reset();
    const std::uint64_t room = max_bytes - std::min(max_bytes, bytes());
    under_way_ = UnderWay{source, std::make_unique<GridBuild>(gl_, programs_, limits_, std::move(data), plan.levels,
                                                              plan.max_cells, room, pace_)};
  }
  if (!under_way_->work->advance(deadline)) return false;
  built_.emplace(source, under_way_->work->take());
  under_way_.reset();
  return true;
}

double GridBuilds::progress() const {
  if (on_cpu_) return on_cpu_->progress();
  if (upload_) return 0.5 * upload_->progress();
  return under_way_ ? 0.5 + 0.5 * under_way_->work->progress() : 1.0;
}

CpuGridBuild::CpuGridBuild(scene::MarchSourcePtr source, std::string why)
    : source_(std::move(source)), why_(std::move(why)), progress_(std::make_shared<Progress>()) {
  made_ = make_detached<BuiltGrid>("building the grid on the CPU", [of = source_, progress = progress_] {
    const scene::GridPlan& plan = *of->plan;
    const grid::DiamondSet diamonds(plan.lattice->own, plan.levels, plan.max_cells, progress.get());
    grid::GridBuilder builder(*of->statistics, diamonds);
    builder.bisect(progress.get());
    BuiltGrid made = built_of(builder.records(plan.lattice->cells, of->max_value, of->channels, progress.get()));
    made.emissive = scene::emissive_table(*made.grid, progress.get());
    return made;
  });
}

CpuGridBuild::~CpuGridBuild() { progress_->cancel(); }

std::optional<BuiltGrid> CpuGridBuild::take() {
  if (made_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return std::nullopt;
  BuiltGrid made = made_.get();
  made.why_not = why_;
  return made;
}

void GridBuilds::clear_built() { built_.clear(); }

void GridBuilds::stop() {
  clear_built();
  under_way_.reset();
  on_cpu_.reset();
  upload_.reset();
}

void GridBuilds::clear() {
  stop();
  lattices_.clear();
}

std::uint64_t GridBuilds::bytes() const {
  std::uint64_t bytes = (upload_ ? upload_->bytes() : 0) + (under_way_ ? under_way_->work->bytes() : 0);
  for (const LatticeDataPtr& data : lattices_) bytes += data->bytes();
  for (const auto& [source, grid] : built_) bytes += grid.bytes();
  return bytes;
}

}  // namespace cumulet::render
