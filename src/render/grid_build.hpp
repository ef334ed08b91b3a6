#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <functional>
#include <future>
#include <glm/glm.hpp>
#include <initializer_list>
#include <limits>
#include <list>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "base/progress.hpp"
#include "base/shared_code.hpp"
#include "gl/objects.hpp"
#include "gl/programs.hpp"
#include "grid/lattice.hpp"
#include "render/brick_kernels.hpp"
#include "render/brick_moves.hpp"
#include "render/device_memories.hpp"
#include "render/upload.hpp"
#include "scene/emissive_cells.hpp"
#include "scene/march_source.hpp"

namespace cumulet::core {
#include "grid_state.glsl"
}  // namespace cumulet::core

namespace cumulet::render {

/// A refinement lattice in GL: the input from which grids of any view are built, and the buffers for refinement
/// decisions. Only one build may use it at a time.
class LatticeData {
 public:
  [[nodiscard]] const grid::Lattice& lattice() const { return *lattice_; }
  /// GL memory.
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }

 private:
  friend class LatticeUpload;
  friend class GridBuild;
  grid::LatticePtr lattice_;
  gl::Object nodes_, own_, blocks_, entries_, coarse_, bricks_;
  struct Channel {
    gl::Object entries, coarse, bricks;
  };
  std::vector<Channel> channels_;  // as in the lattice
  gl::Object points_, parts_;      // uniform buffers
  gl::Object priorities_, bins_, state_;
  std::uint64_t bytes_ = 0;
};
using LatticeDataPtr = std::shared_ptr<const LatticeData>;

/// Uploads a lattice in steps. All calls need a current context and an active StateGuard.
class LatticeUpload {
 public:
  /// Allocates nothing yet. statistics, channels: those that the lattice was made of; they are held until the last step
  /// is done. Values of GPU-resident bricks are copied on the GPU, and their priorities are computed there. Throws
  /// Error(unsupported) if a limit of the driver is exceeded, which the message names, or if `memories` does not hold
  /// the bricks.
  LatticeUpload(const gl::FunctionsPtr& gl, gl::ProgramsPtr programs, const gl::Limits& limits,
                grid::LatticePtr lattice, std::shared_ptr<const grid::Statistics> statistics,
                grid::Channels channels = {}, DeviceMemoriesPtr memories = nullptr);
  LatticeUpload(const LatticeUpload&) = delete;
  LatticeUpload& operator=(const LatticeUpload&) = delete;
  /// Returns and throws as Upload::advance().
  bool advance(Deadline deadline) { return upload_.advance(deadline); }
  [[nodiscard]] double progress() const { return upload_.progress(); }
  /// GL memory of the complete data.
  [[nodiscard]] std::uint64_t bytes() const { return data_->bytes(); }
  [[nodiscard]] const grid::LatticePtr& lattice() const { return data_->lattice_; }
  /// Only after advance() returned true.
  LatticeDataPtr take() { return std::move(data_); }

 private:
  void plan_buffer(gl::Object& buffer, std::uint64_t bytes, const void* from, const char* what);
  void plan_bytes(const gl::Object& buffer, std::uint64_t bytes, const void* from);
  void plan_bricks();
  void plan_device_bricks();
  void plan_device_bricks(const grid::LatticeChannel& channel, const grid::ChannelFields& fields, const gl::Object& to);
  void plan_priorities();
  void plan_priorities(const grid::Statistics& field, const grid::BricksToRate::Field& rated);
  // list: per brick its node number, and the index of its values.
  void plan_priorities(const std::vector<glm::uvec2>& list, bool of_density, const grid::OwnMeasure& measure);
  void plan_channels();
  // Plans the upload of complete bricks. fill: writes the values of a brick to the given address.
  using FillBrick = std::function<void(std::size_t brick, std::byte* to)>;
  void plan_values(const gl::Object& buffer, std::size_t bricks, std::size_t brick_bytes, const FillBrick& fill);

  // Temporary buffers of the steps.
  struct Scratch {
    gl::Object to_rate, values;  // of one field at a time
    gl::Object lit, tree, points;
  };

  gl::FunctionsPtr gl_;
  gl::ProgramsPtr programs_;
  gl::Limits limits_;
  DeviceMemoriesPtr memories_;
  Scratch scratch_;
  std::shared_ptr<const grid::Statistics> statistics_;
  grid::Channels channels_;
  std::vector<grid::ChannelFields> fields_;
  std::shared_ptr<LatticeData> data_;
  BrickMoves moves_;
  Upload upload_;  // its steps use the members above
};

/// A grid that was built on the GPU. Equal to a grid::TetGrid bit for bit, except for rounding of coefficients and
/// channels.
struct BuiltGrid {
  gl::Object cells;  ///< grid::CellRecord each
  gl::Object tree;   ///< 26 grid::RootEntry, of which the last is padding, then TetGrid::tree
  /// Records as in TetGrid, indexed by grid::Channel; null: there is no such channel.
  std::array<gl::Object, 4> channels;
  scene::EmissiveTable emissive;  ///< in main memory
  /// Set instead of the buffers if the GPU could not build it; why_not then gives the reason.
  std::shared_ptr<const grid::TetGrid> grid;
  std::string why_not;
  std::uint32_t count = 0;
  std::uint32_t levels = 0;
  bool limited = false;
  glm::vec3 content_min{0.0F};
  glm::vec3 content_max{0.0F};

  /// GL memory.
  [[nodiscard]] std::uint64_t bytes() const;
};
/// Returns the size of the records of a channel.
std::uint64_t channel_bytes(grid::Channel channel, std::size_t cells);
/// Returns the GL memory per cell of a build in progress, in addition to its result.
std::uint64_t building_bytes_per_cell(bool emits);
/// Returns the minimum GL memory of a build in progress, however few cells it has.
std::uint64_t building_bytes_at_least();

/// Measured time per item of the kernels that build grids, in ms.
class GridPace {
 public:
  /// Returns the time per item. cost: estimate while there is no measurement.
  [[nodiscard]] double ms(const gl::ProgramKey& key, double cost) const;
  struct Sent {
    gl::ProgramKey key;
    double cost = 0.0;
    double items = 0.0;
    double weight = 1.0;  ///< per item, if the items of a kernel differ
  };
  enum class Measured {
    exactly,  ///< time of these dispatches only
    at_most   ///< until they were seen to be finished, so other work of the host is included
  };
  /// Updates the estimates: these dispatches took `ms` in sequence. Measurements with the first dispatch of a kernel
  /// are ignored, because drivers compile in it.
  void learn(const std::vector<Sent>& sent, double ms, Measured measured);

 private:
  std::map<gl::ProgramKey, double> known_;  // per item
};
using GridPacePtr = std::shared_ptr<GridPace>;

/// Builds a grid for a view on the GPU, in compute passes. The priorities of splits are raised and closed in the
/// lattice as in grid::DiamondSet. A histogram gives the priority threshold for the cell budget. Cells are made level
/// by level as in grid::GridBuilder.
/// The number of cells per level is read back once, before the first is made, without waiting. All later buffers have
/// exactly the needed size. Emissive cells are also read back without waiting, and a worker thread makes their table.
/// Passes are split into dispatches of about a millisecond, by the measured times of their kernels; a frame may stop
/// between dispatches. Fences bound the work in flight. All calls need a current context and an active StateGuard.
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
  // A pass of one kernel. cost: estimated time per item, relative to a cheap one.
  struct Pass {
    gl::ProgramKey key;
    std::uint32_t cost = 1;
    bool item_a_group = false;  // one work group of 64 invocations per item, else one invocation
    bool of_lattice = true;     // the kernel includes glsl/lattice_lookup.glsl
    double weight = 1.0;        // per item, if the items of a kernel differ
  };
  using Bind = std::function<void(GLuint program)>;
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
  void plan_leaves(const Pass& coarse, const Pass& fine, const Bind& bind);
  // Plans the channels of the cells: emission, velocity, color and anisotropy.
  void plan_channels();
  void plan_channel(std::size_t index);
  void plan_clear_cones();
  void plan_emissive();
  void begin_emissive_table();
  void plan_read_back(Upload& upload);
  // Plans a pass over items [first, end), in dispatches of bounded time. bind: binds buffers, and sets uniforms beyond
  // the first three.
  void plan_pass(Upload& upload, const Pass& pass, std::uint32_t first, std::uint32_t end, const Bind& bind);
  // Sends one dispatch with the first of the items. Returns the end of its items; nullopt if it has to wait.
  std::optional<std::uint32_t> dispatch(const Pass& pass, std::uint32_t first, std::uint32_t end, const Bind& bind);
  [[nodiscard]] double aim_ms() const;
  // Returns whether little enough work is in flight.
  bool has_room_in_flight();
  void require_room(std::uint64_t bytes) const;
  void bind_storage(std::initializer_list<std::pair<GLint, const gl::Object*>> buffers) const;
  [[nodiscard]] gl::Object make_storage(std::uint64_t bytes, const char* what);

  gl::FunctionsPtr gl_;
  gl::ProgramsPtr programs_;
  gl::Limits limits_;
  LatticeDataPtr data_;
  std::vector<std::uint8_t> levels_;
  std::uint32_t max_cells_;
  std::uint64_t max_bytes_;
  GridPacePtr pace_;
  Deadline deadline_{};  // of the current call
  std::uint64_t bytes_ = 0;
  gl::Object level_bytes_;
  gl::Object tree_cells_, links_, below_, list_, clear_, glowing_;
  BuiltGrid built_;
  gl::ReadBack read_back_;
  gl::Fence fence_;
  std::vector<GridPace::Sent> in_flight_;       // since the previous ones were seen to be finished
  double in_flight_ms_ = 0.0;                   // estimated time of these
  std::chrono::steady_clock::time_point sent_;  // when the first of them was sent
  core::CmGridState state_{};                   // as read back
  Upload decision_;
  gl::ReadBack emissive_read_back_;
  std::vector<std::uint32_t> emissive_words_;
  std::future<scene::EmissiveTable> emissive_table_;
  std::vector<Level> tree_levels_;
  std::optional<Upload> cells_;     // set when the number of cells is known; their steps use the members above
  std::optional<Upload> emissive_;  // set when the number of emissive cells is known
};

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

/// Grids that were built for the GPU, by source.
using BuiltGrids = std::map<scene::MarchSourcePtr, BuiltGrid>;

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
