#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <initializer_list>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "base/shared_code.hpp"
#include "gl/objects.hpp"
#include "gl/programs.hpp"
#include "grid/lattice.hpp"
#include "render/upload.hpp"
#include "scene/march_source.hpp"

namespace cumulet::core {
#include "grid_state.glsl"
}  // namespace cumulet::core

namespace cumulet::render {

/// A lattice in GL: all that grids of any view are built from there, and the room to decide what splits. One build at a
/// time uses it.
class LatticeData {
 public:
  [[nodiscard]] const grid::Lattice& lattice() const { return *lattice_; }
  /// Of GL memory.
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }

 private:
  friend class LatticeUpload;
  friend class GridBuild;
  grid::LatticePtr lattice_;
  gl::Object nodes_, own_, blocks_, places_, coarse_, bricks_;
  gl::Object points_, parts_;  // uniforms
  gl::Object priorities_, bins_, state_;
  std::uint64_t bytes_ = 0;
};
using LatticeDataPtr = std::shared_ptr<const LatticeData>;

/// Brings a lattice to GL piece by piece. All calls need the context current and a StateGuard around.
class LatticeUpload {
 public:
  /// statistics: of density, that the lattice was made of; both are held until the last step is made. Throws
  /// Error(unsupported) that names the limit that does not suffice; allocates nothing yet.
  LatticeUpload(const gl::FunctionsPtr& gl, const gl::Limits& limits, grid::LatticePtr lattice,
                std::shared_ptr<const grid::Statistics> statistics);
  LatticeUpload(const LatticeUpload&) = delete;
  LatticeUpload& operator=(const LatticeUpload&) = delete;
  /// As Upload has them.
  bool advance(Deadline deadline) { return upload_.advance(deadline); }
  [[nodiscard]] double progress() const { return upload_.progress(); }
  /// Of GL memory, of what will be there.
  [[nodiscard]] std::uint64_t bytes() const { return data_->bytes(); }
  [[nodiscard]] const grid::LatticePtr& lattice() const { return data_->lattice_; }
  /// Only after advance returned true.
  LatticeDataPtr take() { return std::move(data_); }

 private:
  void plan_buffer(gl::Object LatticeData::*buffer, std::uint64_t bytes, const void* from, const char* what);
  void plan_bricks();

  gl::FunctionsPtr gl_;
  gl::Limits limits_;
  std::shared_ptr<const grid::Statistics> statistics_;
  std::shared_ptr<LatticeData> data_;
  Upload upload_;  // its steps use the above
};

/// A grid that was built in GL: what a grid::TetGrid of density alone is, bit for bit but for the rounding of
/// coefficients.
struct BuiltGrid {
  gl::Object cells;  ///< grid::CellRecord each
  gl::Object tree;   ///< 26 grid::RootEntry, the last of which is room, then TetGrid::tree
  std::uint32_t count = 0;
  std::uint32_t levels = 0;
  bool limited = false;
  glm::vec3 content_min{0.0F};
  glm::vec3 content_max{0.0F};

  /// Of GL memory.
  [[nodiscard]] std::uint64_t bytes() const {
    return std::uint64_t{count} * (sizeof(grid::CellRecord) + 4) + 28 * sizeof(std::uint32_t);
  }
};

/// Builds a grid for a view, in compute passes: the splits' priorities are raised into the lattice and closed as
/// grid::DiamondSet has it, a histogram gives the cut of the budget, and cells are made level by level as
/// grid::GridBuilder does. How many there are of each level is read back once, before the first is made, without
/// waiting: all that follows has known bounds and exactly the memory that it needs. Passes are cut into dispatches of
/// about a millisecond, between which a frame may stop; what is on its way to the device is bounded by fences. All
/// calls need the context current and a StateGuard around.
class GridBuild {
 public:
  /// levels: grid::OwnPriorities::levels() of the view. max_cells: at most 2^30 are made.
  GridBuild(gl::FunctionsPtr gl, gl::ProgramsPtr programs, const gl::Limits& limits, LatticeDataPtr data,
            std::vector<std::uint8_t> levels, std::uint64_t max_cells);
  GridBuild(const GridBuild&) = delete;
  GridBuild& operator=(const GridBuild&) = delete;

  /// Works until the deadline, one step at least, or until it has to wait for the device or the driver's compiler.
  /// Returns whether the grid is whole. Throws Error(out_of_memory, unsupported, gl); then there is nothing to go on
  /// with.
  bool advance(Deadline deadline);
  [[nodiscard]] double progress() const;
  /// Of GL memory, while it is built: without the lattice's.
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }
  /// Only after advance returned true.
  BuiltGrid take() { return std::move(built_); }

 private:
  // Of one kernel; cost: of an item, about what a cheap one's is.
  struct Pass {
    gl::ProgramKey key;
    std::uint32_t cost = 1;
    bool item_a_group = false;  // a work group of 64 an item, else an invocation
  };
  using Bind = std::function<void(GLuint program)>;
  void plan_decision();
  void plan_cells();
  void plan_tree_cells(const std::vector<std::uint32_t>& level_first);
  void plan_read_back(Upload& upload);
  // Items [first, end), by dispatches of bounded length; bind: buffers, and uniforms beyond the first three.
  void plan_pass(Upload& upload, const Pass& pass, std::uint32_t first, std::uint32_t end, const Bind& bind);
  bool dispatch(const Pass& pass, std::uint32_t first, std::uint32_t end, const Bind& bind);
  void bind_storage(std::initializer_list<std::pair<GLint, const gl::Object*>> buffers) const;
  [[nodiscard]] gl::Object make_storage(std::uint64_t bytes, const char* what);

  gl::FunctionsPtr gl_;
  gl::ProgramsPtr programs_;
  gl::Limits limits_;
  LatticeDataPtr data_;
  std::vector<std::uint8_t> levels_;
  std::uint32_t max_cells_;
  std::uint64_t bytes_ = 0;
  gl::Object level_bytes_;
  gl::Object tree_cells_, links_, order_;
  BuiltGrid built_;
  gl::ReadBack read_back_;
  gl::Fence fence_;
  std::uint64_t in_flight_ = 0;  // cost since the last fence
  core::CmGridState state_{};    // as it was read back
  Upload decision_;
  std::optional<Upload> cells_;  // once it is known how many; their steps use the above
};

/// Grids that GL built, by what they were built of.
using BuiltGrids = std::map<scene::MarchSourcePtr, BuiltGrid>;

/// Builds the grids of sources that have a plan, one after another. Their lattices stay for the next views. All calls
/// but those that tell need the context current and a StateGuard around.
class GridBuilds {
 public:
  using Sources = std::vector<scene::MarchSourcePtr>;
  GridBuilds(gl::FunctionsPtr gl, gl::ProgramsPtr programs, const gl::Limits& limits)
      : gl_(std::move(gl)), programs_(std::move(programs)), limits_(limits) {}

  /// Those of sources, until about the deadline. Returns whether all are there. kept: whose lattices stay, these among
  /// them; others go. Throws Error(out_of_memory, unsupported, gl); then none is under way.
  bool advance(const Sources& sources, const Sources& kept, Deadline deadline);
  [[nodiscard]] const BuiltGrids& built() const { return built_; }
  /// 0 to 1, of the grid that is under way; else 1.
  [[nodiscard]] double progress() const;
  /// Grids are somewhere else by now, or not wanted any more; lattices stay.
  void clear_built();
  /// And lattices go.
  void clear();
  /// Of GL memory, of lattices and of what is built.
  [[nodiscard]] std::uint64_t bytes() const;

 private:
  // Returns whether it is there.
  bool build(const scene::MarchSourcePtr& source, Deadline deadline);
  [[nodiscard]] LatticeDataPtr find(const grid::LatticePtr& lattice) const;

  gl::FunctionsPtr gl_;
  gl::ProgramsPtr programs_;
  gl::Limits limits_;
  std::vector<LatticeDataPtr> lattices_;
  std::unique_ptr<LatticeUpload> upload_;
  struct UnderWay {
    scene::MarchSourcePtr of;
    std::unique_ptr<GridBuild> work;
  };
  std::optional<UnderWay> under_way_;
  BuiltGrids built_;
};

}  // namespace cumulet::render
