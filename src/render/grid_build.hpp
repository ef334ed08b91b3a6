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
#include "scene/glow.hpp"
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
  struct Channel {
    gl::Object places, coarse, bricks;
  };
  std::vector<Channel> channels_;  // as the lattice has them
  gl::Object points_, parts_;      // uniforms
  gl::Object priorities_, bins_, state_;
  std::uint64_t bytes_ = 0;
};
using LatticeDataPtr = std::shared_ptr<const LatticeData>;

/// Brings a lattice to GL piece by piece. All calls need the context current and a StateGuard around.
class LatticeUpload {
 public:
  /// statistics, channels: that the lattice was made of; all are held until the last step is made. Throws
  /// Error(unsupported) that names the limit that does not suffice; allocates nothing yet.
  /// Of bricks that are in GL the values are copied there, and their priorities found. Throws Error(unsupported) where
  /// memories has them not.
  LatticeUpload(const gl::FunctionsPtr& gl, gl::ProgramsPtr programs, const gl::Limits& limits,
                grid::LatticePtr lattice, std::shared_ptr<const grid::Statistics> statistics,
                grid::Channels channels = {}, DeviceMemoriesPtr memories = nullptr);
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
  void plan_buffer(gl::Object& buffer, std::uint64_t bytes, const void* from, const char* what);
  void plan_bytes(const gl::Object& buffer, std::uint64_t bytes, const void* from);
  void plan_bricks();
  void plan_device_bricks();
  void plan_device_bricks(const grid::LatticeChannel& channel, const grid::ChannelFields& fields, const gl::Object& to);
  void plan_priorities();
  void plan_priorities(const grid::Statistics& field, const grid::BricksToRate::Field& rated);
  // list: of bricks their numbers, and which of the values they have.
  void plan_priorities(const std::vector<glm::uvec2>& list, bool of_density, const grid::OwnMeasure& measure);
  void plan_channels();
  // Bricks of whole values, which fill puts where it is told, one after another.
  using FillBrick = std::function<void(std::size_t brick, std::byte* to)>;
  void plan_values(const gl::Object& buffer, std::size_t bricks, std::size_t brick_bytes, const FillBrick& fill);

  // What steps make for others.
  struct Scratch {
    gl::Object to_rate, values;  // of one field after another
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
  Upload upload_;  // its steps use the above
};

/// A grid that was built in GL: what a grid::TetGrid is, bit for bit but for the rounding of coefficients and channels.
struct BuiltGrid {
  gl::Object cells;  ///< grid::CellRecord each
  gl::Object tree;   ///< 26 grid::RootEntry, the last of which is room, then TetGrid::tree
  /// By grid::Channel, records as TetGrid has them; null: it has no such.
  std::array<gl::Object, 4> channels;
  scene::GlowTable glow;  ///< in main memory
  /// Instead of what GL has: where GL could not build it. Then why.
  std::shared_ptr<const grid::TetGrid> grid;
  std::string why_not;
  std::uint32_t count = 0;
  std::uint32_t levels = 0;
  bool limited = false;
  glm::vec3 content_min{0.0F};
  glm::vec3 content_max{0.0F};

  /// Of GL memory.
  [[nodiscard]] std::uint64_t bytes() const;
};
/// Of the records of a channel of so many cells.
std::uint64_t channel_bytes(grid::Channel channel, std::size_t cells);
/// Of GL memory, what building a grid takes a cell beside what is built.
std::uint64_t building_bytes_a_cell(bool emits);
/// And how much it takes at least, of however few cells.
std::uint64_t building_bytes_at_least();

/// What kernels that build grids take, by how long they took: of an item, in ms.
class GridPace {
 public:
  /// cost: what is thought of it before any was measured.
  [[nodiscard]] double ms(const gl::ProgramKey& key, double cost) const;
  struct Sent {
    gl::ProgramKey key;
    double cost = 0.0;
    double items = 0.0;
    double weight = 1.0;  ///< of an item, where a kernel's differ
  };
  enum class Measured {
    exactly,  ///< of these alone
    at_most   ///< until it was seen that they are over: a host's own work and its frames count with them
  };
  /// These took that long, one after another. None that has the first of a kernel is believed: drivers compile in it.
  void learn(const std::vector<Sent>& sent, double ms, Measured measured);

 private:
  std::map<gl::ProgramKey, double> known_;  // of an item
};
using GridPacePtr = std::shared_ptr<GridPace>;

/// Builds a grid for a view, in compute passes: the splits' priorities are raised into the lattice and closed as
/// grid::DiamondSet has it, a histogram gives the cut of the budget, and cells are made level by level as
/// grid::GridBuilder does. How many there are of each level is read back once, before the first is made, without
/// waiting: all that follows has known bounds and exactly the memory that it needs. Of what gives off light the cells
/// are read back, too, likewise, and a thread of its own makes their table. Passes are cut into dispatches of about a
/// millisecond by what their kernels were seen to take, between which a frame may stop; what is on its way to the
/// device is bounded by fences. All calls need the context current and a StateGuard around.
class GridBuild {
 public:
  /// levels: grid::OwnPriorities::levels() of the view. max_cells: at most 2^30 are made. most_bytes: of GL memory.
  GridBuild(gl::FunctionsPtr gl, gl::ProgramsPtr programs, const gl::Limits& limits, LatticeDataPtr data,
            std::vector<std::uint8_t> levels, std::uint64_t max_cells,
            std::uint64_t most_bytes = std::numeric_limits<std::uint64_t>::max(),
            GridPacePtr pace = std::make_shared<GridPace>());
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
    bool of_lattice = true;     // knows glsl/grid_places.glsl
    double weight = 1.0;        // of an item, where a kernel's differ
  };
  using Bind = std::function<void(GLuint program)>;
  // Of the tree: its cells, and where those that split stand in the list, in front of all leaves. Of the last none do.
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
  // Of the leaves, those above bricks by one kernel, those within by another.
  void plan_leaves(const Pass& coarse, const Pass& fine, const Bind& bind);
  // What cells carry.
  void plan_channels();
  void plan_channel(std::size_t index);
  void plan_clear_cones();
  void plan_glow();
  void begin_glow_table();
  void plan_read_back(Upload& upload);
  // Items [first, end), by dispatches of bounded length; bind: buffers, and uniforms beyond the first three.
  void plan_pass(Upload& upload, const Pass& pass, std::uint32_t first, std::uint32_t end, const Bind& bind);
  // One dispatch, of the first of these items. Returns where what is left begins; nothing where it has to wait.
  std::optional<std::uint32_t> dispatch(const Pass& pass, std::uint32_t first, std::uint32_t end, const Bind& bind);
  [[nodiscard]] double aim_ms() const;
  // Whether what is on its way is little enough.
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
  std::uint64_t most_bytes_;
  GridPacePtr pace_;
  Deadline deadline_{};  // of the call
  std::uint64_t bytes_ = 0;
  gl::Object level_bytes_;
  gl::Object tree_cells_, links_, below_, list_, clear_, glowing_;
  BuiltGrid built_;
  gl::ReadBack read_back_;
  gl::Fence fence_;
  std::vector<GridPace::Sent> in_flight_;       // since those before were seen to be over
  double in_flight_ms_ = 0.0;                   // that these are thought to take
  std::chrono::steady_clock::time_point sent_;  // the first of them
  core::CmGridState state_{};                   // as it was read back
  Upload decision_;
  gl::ReadBack glow_read_back_;
  std::vector<std::uint32_t> glow_words_;
  std::future<scene::GlowTable> glow_table_;
  std::vector<Level> tree_levels_;
  std::optional<Upload> cells_;  // once it is known how many; their steps use the above
  std::optional<Upload> glow_;   // once it is known how many give off light
};

/// The grid of a source with a plan, on a thread of its own: where GL cannot. Dropped, it ends soon.
class CpuGridBuild {
 public:
  CpuGridBuild(scene::MarchSourcePtr source, std::string why);
  CpuGridBuild(const CpuGridBuild&) = delete;
  CpuGridBuild& operator=(const CpuGridBuild&) = delete;
  CpuGridBuild(CpuGridBuild&&) = delete;
  CpuGridBuild& operator=(CpuGridBuild&&) = delete;
  ~CpuGridBuild();
  /// Nothing while it is under way. Throws what the build threw.
  std::optional<BuiltGrid> take();
  [[nodiscard]] const scene::MarchSourcePtr& of() const { return source_; }
  [[nodiscard]] double progress() const { return progress_->fraction(); }

 private:
  scene::MarchSourcePtr source_;
  std::string why_;
  std::shared_ptr<Progress> progress_;
  std::future<BuiltGrid> made_;
};

/// Grids that GL built, by what they were built of.
using BuiltGrids = std::map<scene::MarchSourcePtr, BuiltGrid>;

/// Builds the grids of sources that have a plan, one after another. Their lattices stay for the next views. What GL has
/// no room for, or is larger than a block of its may be, the CPU builds. All calls but those that tell need the context
/// current and a StateGuard around.
class GridBuilds {
 public:
  using Sources = std::vector<scene::MarchSourcePtr>;
  /// memories: where volumes' bricks are that are in GL.
  GridBuilds(gl::FunctionsPtr gl, gl::ProgramsPtr programs, const gl::Limits& limits, DeviceMemoriesPtr memories)
      : gl_(std::move(gl)), programs_(std::move(programs)), limits_(limits), memories_(std::move(memories)) {}

  /// Those of sources, until about the deadline. Returns whether all are there. kept: whose lattices stay, these among
  /// them; others go. most_bytes: of GL memory that lattices and what is built may take. Throws Error(gl), and what the
  /// CPU's build throws; then none is under way.
  bool advance(const Sources& sources, const Sources& kept, std::uint64_t most_bytes, Deadline deadline);
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
  bool build(const scene::MarchSourcePtr& source, std::uint64_t most_bytes, Deadline deadline);
  // Of bricks in GL such as are in another context, or went with theirs; null: none.
  [[nodiscard]] volume::DeviceBricksPtr not_here(const scene::MarchSource& source) const;
  // By GL.
  bool build_there(const scene::MarchSourcePtr& source, std::uint64_t most_bytes, Deadline deadline);
  void begin_upload(const scene::MarchSource& source, std::uint64_t most_bytes);
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
