#pragma once

#include <cstdint>
#include <future>
#include <glm/glm.hpp>
#include <initializer_list>
#include <limits>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "gl/objects.hpp"
#include "gl/programs.hpp"
#include "render/grid/built_grid.hpp"
#include "render/grid/grid_passes.hpp"
#include "render/grid/lattice_upload.hpp"
#include "render/pacing/grid_pace.hpp"
#include "render/pacing/upload.hpp"
#include "scene/emissive_cells.hpp"

namespace cumulet::render {

/// Builds a grid for a view on the GPU, in compute passes. The priorities of splits are raised and closed in the
/// lattice as in grid::DiamondSet. A histogram gives the priority threshold for the cell budget. Cells are made level
/// by level as in grid::GridBuilder.
/// The number of cells per level is read back once, before the first is made, without waiting. All later buffers have
/// exactly the needed size. Emissive cells are also read back without waiting, and a worker thread makes their table.
/// GridPasses splits its passes into dispatches, and a frame may stop between them. All calls need a current context
/// and an active StateGuard.
class GridBuild {
 public:
  /// levels: grid::OwnPriorities::levels() of the view. max_cells: capped at 2^30. max_bytes: limit of GL memory.
  GridBuild(gl::FunctionsPtr gl, gl::ProgramsPtr programs, const gl::Limits& limits, LatticeDataPtr data,
            std::vector<std::uint8_t> levels, std::uint64_t max_cells,
            std::uint64_t max_bytes = std::numeric_limits<std::uint64_t>::max(),
            GridPacePtr pace = std::make_shared<GridPace>());
  GridBuild(const GridBuild&) = delete;
  GridBuild& operator=(const GridBuild&) = delete;

  /// Works until the deadline, but at least one step, or until it has to wait for the device or the driver's compiler.
  /// Returns whether the grid is complete. Throws Error(out_of_memory, unsupported, gl); the build cannot be continued
  /// then.
  bool advance(Deadline deadline);
  [[nodiscard]] double progress() const;
  /// GL memory of the build in progress, without the lattice's.
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }
  /// Only after advance() returned true.
  BuiltGrid take() { return std::move(built_); }

 private:
  using Pass = GridPasses::Pass;
  using Bind = GridPasses::Bind;
  // A level of the tree: its range of cells, and the range in the list of those that split. In the list all splits come
  // before all leaves. The last level has no splits.
  struct Level {
    std::uint32_t cells_begin = 0;
    std::uint32_t cells_end = 0;
    std::uint32_t splits_begin = 0;
    std::uint32_t splits_end = 0;
    [[nodiscard]] std::uint32_t leaves() const { return cells_end - cells_begin - (splits_end - splits_begin); }
  };
  [[nodiscard]] std::vector<Level> levels_of_tree() const;
  void plan_decision();
  void plan_clear(Upload& upload, const gl::Object& buffer, std::uint64_t bytes);
  void plan_cells();
  void plan_tree_cells();
  void plan_records();
  // Plans a pass over the leaves. coarse: kernel for cells larger than bricks; fine: for cells within bricks.
  void plan_leaves(const Pass& coarse, const Pass& fine, const Bind& bind, const Bind& bind_fine);
  // Plans the channels of the cells.
  void plan_channels();
  void plan_channel(std::size_t index);
  void plan_clear_cones();
  void plan_emissive();
  void begin_emissive_table();
  void plan_read_back(Upload& upload);
  void require_room(std::uint64_t bytes) const;
  void bind_storage(std::initializer_list<std::pair<GLint, const gl::Object*>> buffers) const;
  [[nodiscard]] gl::Object make_storage(std::uint64_t bytes, const char* what);

  gl::FunctionsPtr gl_;
  gl::Limits limits_;
  LatticeDataPtr data_;
  std::vector<std::uint8_t> levels_;
  std::uint32_t max_cells_;
  std::uint64_t max_bytes_;
  GridPasses passes_;
  std::uint64_t bytes_ = 0;
  gl::Object level_bytes_;
  gl::Object tree_cells_, links_, below_, list_, clear_, glowing_;
  BuiltGrid built_;
  gl::ReadBack read_back_;
  gl::Fence fence_;
  core::CmGridState state_{};  // as read back
  Upload decision_;
  gl::ReadBack emissive_read_back_;
  std::vector<std::uint32_t> emissive_words_;
  std::future<scene::EmissiveTable> emissive_table_;
  std::vector<Level> tree_levels_;
  std::optional<Upload> cells_;     // set when the number of cells is known; their steps use the members above
  std::optional<Upload> emissive_;  // set when the number of emissive cells is known
};

}  // namespace cumulet::render
