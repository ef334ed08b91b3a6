#pragma once

#include <cstdint>
#include <future>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/progress.hpp"
#include "render/dynamic/device_memories.hpp"
#include "render/grid/built_grid.hpp"
#include "render/grid/grid_build.hpp"
#include "render/grid/lattice_upload.hpp"
#include "render/pacing/grid_pace.hpp"
#include "render/pacing/upload.hpp"
#include "scene/march_source.hpp"

namespace cumulet::render {

/// Builds the grid of a source with a plan on a worker thread, if the GPU cannot. The destructor cancels it.
class CpuGridBuild {
 public:
  CpuGridBuild(scene::MarchSourcePtr source, std::string why);
  CpuGridBuild(const CpuGridBuild&) = delete;
  CpuGridBuild& operator=(const CpuGridBuild&) = delete;
  CpuGridBuild(CpuGridBuild&&) = delete;
  CpuGridBuild& operator=(CpuGridBuild&&) = delete;
  ~CpuGridBuild();
  /// Returns nullopt while the build is in progress. Throws its errors.
  std::optional<BuiltGrid> take();
  [[nodiscard]] const scene::MarchSourcePtr& of() const { return source_; }
  [[nodiscard]] double progress() const { return progress_->fraction(); }

 private:
  scene::MarchSourcePtr source_;
  std::string why_;
  std::shared_ptr<Progress> progress_;
  std::future<BuiltGrid> made_;
};

/// Builds the grids of sources with a plan, one after another. Their lattices are kept for later views. The CPU builds
/// grids that exceed the GL memory limit or the driver's block size. All calls except the queries need a current
/// context and an active StateGuard.
class GridBuilds {
 public:
  using Sources = std::vector<scene::MarchSourcePtr>;
  /// memories: bricks of GPU-resident volumes.
  GridBuilds(gl::FunctionsPtr gl, gl::ProgramsPtr programs, const gl::Limits& limits, DeviceMemoriesPtr memories)
      : gl_(std::move(gl)), programs_(std::move(programs)), limits_(limits), memories_(std::move(memories)) {}

  /// Builds the grids of sources until about the deadline. Returns whether all are built. kept: sources whose lattices
  /// are kept, these included; other lattices are freed. max_bytes: limit of GL memory for lattices and grids. Throws
  /// Error(gl), and the errors of the CPU build; then no build is in progress.
  bool advance(const Sources& sources, const Sources& kept, std::uint64_t max_bytes, Deadline deadline);
  [[nodiscard]] const BuiltGrids& built() const { return built_; }
  /// Fraction of the current build that is done, 0 to 1; 1 if there is none.
  [[nodiscard]] double progress() const;
  /// Frees built grids, which were copied or are not needed any more. Lattices are kept.
  void clear_built();
  /// Does clear_built(), and ends builds in progress.
  void stop();
  /// Frees built grids and lattices.
  void clear();
  /// GL memory of lattices and grids.
  [[nodiscard]] std::uint64_t bytes() const;

 private:
  // Returns whether the grid is built.
  bool build(const scene::MarchSourcePtr& source, std::uint64_t max_bytes, Deadline deadline);
  // Returns bricks of the source that are in another context or were lost with it; null: none.
  [[nodiscard]] volume::DeviceBricksPtr not_here(const scene::MarchSource& source) const;
  // Builds on the GPU.
  bool build_there(const scene::MarchSourcePtr& source, std::uint64_t max_bytes, Deadline deadline);
  void begin_upload(const scene::MarchSource& source, std::uint64_t max_bytes);
  [[nodiscard]] LatticeDataPtr find(const grid::LatticePtr& lattice) const;

  gl::FunctionsPtr gl_;
  gl::ProgramsPtr programs_;
  gl::Limits limits_;
  DeviceMemoriesPtr memories_;
  std::vector<LatticeDataPtr> lattices_;
  std::unique_ptr<LatticeUpload> upload_;
  struct UnderWay {
    scene::MarchSourcePtr of;
    std::unique_ptr<GridBuild> work;
  };
  std::optional<UnderWay> under_way_;
  std::unique_ptr<CpuGridBuild> on_cpu_;
  GridPacePtr pace_ = std::make_shared<GridPace>();
  BuiltGrids built_;
};

}  // namespace cumulet::render
