#include "render/grid_build.hpp"

#include <algorithm>
#include <bit>
#include <cstring>
#include <string>
#include <utility>

#include "base/error.hpp"
#include "gl/bindings.hpp"
#include "grid/cell.hpp"
#include "grid/tet_grid.hpp"
#include "volume/brick_values.hpp"

namespace cumulet::render {

namespace {

constexpr std::uint32_t group = 64;  // invocations of a work group, of all kernels here
constexpr std::size_t roots_words = 52;

// As glsl/grid_cells.comp has it.
struct TreeCell {
  std::uint32_t child;
  std::uint32_t leaves;
  glm::uvec2 where;
};
static_assert(sizeof(TreeCell) == 16);

using BrickPointWords = std::array<std::uint32_t, (CM_BRICK_POINTS + 3) / 4 * 4>;
BrickPointWords brick_point_words() {
  BrickPointWords words{};
  std::ranges::transform(grid::brick_points(), words.begin(),
                         [](const glm::u8vec3& p) { return std::uint32_t{p.x} | (p.y << 4U) | (p.z << 8U); });
  return words;
}

void require_block(const gl::Limits& limits, std::uint64_t bytes, const char* what) {
  if (bytes <= static_cast<std::uint64_t>(limits.storage_block_bytes)) return;
  throw Error(ErrorCode::unsupported, std::string(what) + " needs a storage block of " + std::to_string(bytes) +
                                          " bytes; this driver's GL_MAX_SHADER_STORAGE_BLOCK_SIZE is " +
                                          std::to_string(limits.storage_block_bytes));
}

gl::ProgramKey lattice_key(int stage) { return {"grid_lattice.comp", {"CM_STAGE " + std::to_string(stage)}}; }
gl::ProgramKey cells_key(int stage) { return {"grid_cells.comp", {"CM_STAGE " + std::to_string(stage)}}; }

}  // namespace

LatticeUpload::LatticeUpload(const gl::FunctionsPtr& gl, const gl::Limits& limits, grid::LatticePtr lattice,
                             std::shared_ptr<const grid::Statistics> statistics)
    : gl_(gl),
      limits_(limits),
      statistics_(std::move(statistics)),
      data_(std::make_shared<LatticeData>()),
      upload_(gl, "uploading the lattice") {
  data_->lattice_ = std::move(lattice);
  const grid::Lattice& l = *data_->lattice_;
  // Each counts its cells' changes in 32 bits.
  constexpr std::size_t most_blocks = std::size_t{1} << 20U;
  if (l.blocks.size() > most_blocks) {
    throw Error(ErrorCode::unsupported,
                "a lattice of " + std::to_string(l.blocks.size()) + " blocks: the limit is 2^20; raise the threshold");
  }
  const auto plan = [&]<class T>(gl::Object LatticeData::*buffer, const std::vector<T>& from, const char* what) {
    plan_buffer(buffer, from.size() * sizeof(T), from.data(), what);
  };
  plan(&LatticeData::nodes_, l.own.nodes, "creating the lattice's nodes");
  plan(&LatticeData::own_, l.own.values, "creating the splits' own priorities");
  plan(&LatticeData::blocks_, l.blocks, "creating the lattice's blocks");
  plan(&LatticeData::places_, l.places, "creating the lattice's places");
  plan(&LatticeData::coarse_, l.coarse, "creating the coefficients of coarse cells");
  plan_bricks();
  plan_buffer(&LatticeData::priorities_, l.blocks.size() * CM_BLOCK_POINTS * 4, nullptr, "creating the priorities");
  plan_buffer(&LatticeData::bins_, std::uint64_t{CM_PRIORITIES} * 4, nullptr, "creating the priorities' histogram");
  plan_buffer(&LatticeData::state_, sizeof(core::CmGridState), nullptr, "creating the grid's state");
  static const BrickPointWords points = brick_point_words();
  plan_buffer(&LatticeData::points_, sizeof points, points.data(), "creating the points of bricks");
  plan_buffer(&LatticeData::parts_, sizeof(grid::CellParts), grid::cell_parts().data(), "creating the parts of cells");
}

void LatticeUpload::plan_buffer(gl::Object LatticeData::*buffer, std::uint64_t bytes, const void* from,
                                const char* what) {
  const std::uint64_t whole = std::max<std::uint64_t>((bytes + 3) / 4 * 4, 4);
  require_block(limits_, whole, what);
  data_->bytes_ += whole;
  upload_.add([this, buffer, whole, what] {
    (*data_).*buffer = gl::make_buffer(gl_, whole, nullptr, GL_DYNAMIC_STORAGE_BIT, what);
  });
  if (from == nullptr) return;
  const auto place = [this, buffer] { return Upload::Place{((*data_).*buffer).name(), 0}; };
  upload_.add_bytes(place, from, bytes);
}

void LatticeUpload::plan_bricks() {
  const grid::Lattice& l = *data_->lattice_;
  const std::size_t value_bytes = l.halves ? 2 : 4;
  const std::size_t brick_bytes = volume::brick_voxels * value_bytes;
  plan_buffer(&LatticeData::bricks_, l.bricks * brick_bytes, nullptr, "creating the values of bricks");
  const auto fill = [this, &l, brick_bytes](std::size_t first, std::size_t bytes) {
    std::vector<std::byte> piece(bytes);
    const std::vector<std::uint32_t>& nodes = statistics_->nodes_of_size(3);
    volume::BrickValues::Brick room;
    for (std::size_t at = 0; at < bytes; at += brick_bytes) {
      const std::size_t brick = (first + at) / brick_bytes;
      const float* values = room.data();
      if (brick < l.even_bricks.size()) {
        room.fill(l.even_bricks[brick]);
      } else {
        values = statistics_->values(statistics_->nodes()[nodes[brick - l.even_bricks.size()]], room);
      }
      if (l.halves) {
        std::array<std::uint16_t, volume::brick_voxels> halves{};
        std::transform(values, values + volume::brick_voxels, halves.begin(),
                       [](float value) { return volume::exact_half(value).value_or(0); });
        std::memcpy(&piece[at], halves.data(), brick_bytes);
      } else {
        std::memcpy(&piece[at], values, brick_bytes);
      }
    }
    gl_->NamedBufferSubData(data_->bricks_.name(), static_cast<GLintptr>(first), static_cast<GLsizeiptr>(bytes),
                            piece.data());
  };
  upload_.add_pieces(l.bricks * brick_bytes, fill, brick_bytes);
}

GridBuild::GridBuild(gl::FunctionsPtr gl, gl::ProgramsPtr programs, const gl::Limits& limits, LatticeDataPtr data,
                     std::vector<std::uint8_t> levels, std::uint64_t max_cells)
    : gl_(std::move(gl)),
      programs_(std::move(programs)),
      limits_(limits),
      data_(std::move(data)),
      levels_(std::move(levels)),
      max_cells_(static_cast<std::uint32_t>(std::clamp<std::uint64_t>(max_cells, 24, std::uint64_t{1} << 30U))),
      decision_(gl_, "deciding which cells split") {
  levels_.resize(std::max<std::size_t>((levels_.size() + 3) / 4 * 4, 4));
  plan_decision();
}

double GridBuild::progress() const {
  // Cells are most of it.
  constexpr double decision = 0.2;
  return decision * decision_.progress() + (cells_ ? (1.0 - decision) * cells_->progress() : 0.0);
}

bool GridBuild::advance(Deadline deadline) {
  if (!cells_) {
    if (!decision_.advance(deadline)) return false;
    plan_cells();
  }
  return cells_->advance(deadline);
}

gl::Object GridBuild::make_storage(std::uint64_t bytes, const char* what) {
  require_block(limits_, bytes, what);
  gl::Object made = gl::make_buffer(gl_, bytes, nullptr, GL_DYNAMIC_STORAGE_BIT, what);
  bytes_ += bytes;
  return made;
}

void GridBuild::bind_storage(std::initializer_list<std::pair<GLint, const gl::Object*>> buffers) const {
  for (const auto& [binding, buffer] : buffers)
    gl_->BindBufferBase(GL_SHADER_STORAGE_BUFFER, static_cast<GLuint>(binding), buffer->name());
}

bool GridBuild::dispatch(const Pass& pass, std::uint32_t first, std::uint32_t end, const Bind& bind) {
  // What is on its way is bounded, whatever the deadline: the host draws, too.
  constexpr std::uint64_t most_in_flight = std::uint64_t{1} << 25U;
  if (in_flight_ >= most_in_flight) {
    if (!fence_.passed()) return false;
    in_flight_ = 0;
  }
  const gl::Program& program = programs_->ask(pass.key);
  if (!program.usable()) return false;
  const gl::DebugGroup debug(*gl_, "cumulet: grid");
  gl_->ProgramUniform1ui(program.name(), 0, first);
  gl_->ProgramUniform1ui(program.name(), 1, end);
  gl_->ProgramUniform1ui(program.name(), 2, static_cast<GLuint>(data_->lattice().cube.log2_size));
  bind(program.name());
  program.use(*gl_);
  const std::uint32_t items = end - first;
  gl_->DispatchCompute(pass.item_a_group ? items : (items + group - 1) / group, 1, 1);
  gl::memory_barrier(*gl_, GL_SHADER_STORAGE_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT);
  in_flight_ += std::uint64_t{items} * pass.cost;
  if (in_flight_ >= most_in_flight) fence_ = gl::Fence(gl_);
  return true;
}

void GridBuild::plan_pass(Upload& upload, const Pass& pass, std::uint32_t first, std::uint32_t end, const Bind& bind) {
  // Where dispatches are over when their call returns, a processor computes them.
  const std::uint32_t budget = gl_->dispatches_in_call ? 1U << 18U : 1U << 22U;
  constexpr std::uint32_t most_groups = 65535;  // that every driver takes
  const std::uint32_t fit = std::max(budget / pass.cost, group);
  const std::uint32_t chunk = std::min(fit, pass.item_a_group ? most_groups : most_groups * group);
  for (std::uint32_t at = first; at < end; at += std::min(chunk, end - at)) {
    upload.add_until(
        [this, pass, at, to = at + std::min(chunk, end - at), bind] { return dispatch(pass, at, to, bind); });
  }
}

void GridBuild::plan_read_back(Upload& upload) {
  upload.add([this] {
    if (!read_back_) read_back_ = gl::ReadBack(gl_, sizeof(core::CmGridState), "creating the read-back of a grid");
    gl_->CopyNamedBufferSubData(data_->state_.name(), read_back_.name(), 0, 0, sizeof(core::CmGridState));
    gl::memory_barrier(*gl_, GL_CLIENT_MAPPED_BUFFER_BARRIER_BIT);
    fence_ = gl::Fence(gl_);
    in_flight_ = 0;
  });
  upload.add_until([this] {
    if (!fence_.passed()) return false;
    std::memcpy(&state_, read_back_.data(), sizeof state_);
    return true;
  });
}

void GridBuild::plan_decision() {
  const grid::Lattice& l = data_->lattice();
  decision_.add([this] { level_bytes_ = make_storage(levels_.size(), "creating the levels that a view allows"); });
  decision_.add_bytes([this] { return Upload::Place{level_bytes_.name(), 0}; }, levels_.data(), levels_.size());
  const auto clear = [this](const gl::Object& buffer, std::uint64_t bytes) {
    decision_.add_pieces(bytes, [this, &buffer](std::size_t first, std::size_t count) {
      gl_->ClearNamedBufferSubData(buffer.name(), GL_R32UI, static_cast<GLintptr>(first),
                                   static_cast<GLsizeiptr>(count), GL_RED_INTEGER, GL_UNSIGNED_INT, nullptr);
    });
  };
  clear(data_->priorities_, std::uint64_t{l.blocks.size()} * CM_BLOCK_POINTS * 4);
  clear(data_->bins_, std::uint64_t{CM_PRIORITIES} * 4);
  decision_.add([this] {
    core::CmGridState state{};
    std::ranges::fill(state.low, 0xffffffffU);
    gl_->NamedBufferSubData(data_->state_.name(), 0, sizeof state, &state);
  });

  const auto bind = [this](GLuint /*program*/) {
    bind_storage({{core::CM_STORAGE_GRID_STATE, &data_->state_},
                  {core::CM_STORAGE_GRID_PRIORITIES, &data_->priorities_},
                  {core::CM_STORAGE_GRID_PLACES, &data_->places_},
                  {core::CM_STORAGE_GRID_BLOCKS, &data_->blocks_},
                  {core::CM_STORAGE_GRID_NODES, &data_->nodes_},
                  {core::CM_STORAGE_GRID_LEVELS, &level_bytes_},
                  {core::CM_STORAGE_GRID_OWN, &data_->own_},
                  {core::CM_STORAGE_GRID_BINS, &data_->bins_}});
    gl_->BindBufferBase(GL_UNIFORM_BUFFER, core::CM_UNIFORM_BRICK_POINTS, data_->points_.name());
  };
  plan_pass(decision_, {lattice_key(0), 512, true}, 0, static_cast<std::uint32_t>(l.own.nodes.size()), bind);
  // From the finest level up, as DiamondSet::close() has it.
  for (std::uint32_t octave = 0; octave + 1 < static_cast<std::uint32_t>(l.cube.log2_size); ++octave) {
    const std::uint32_t scale = octave / 3;
    const std::uint32_t first_block = l.first[scale];
    const std::uint32_t blocks =
        (scale == 0 ? static_cast<std::uint32_t>(l.blocks.size()) : l.first[scale - 1]) - first_block;
    const std::uint32_t cubes = 1U << (3 * (2 - octave % 3));
    for (const std::uint32_t odd : {1U, 2U, 3U}) {
      const auto bind_octave = [this, bind, octave, odd, first_block](GLuint program) {
        bind(program);
        gl_->ProgramUniform1ui(program, 3, octave);
        gl_->ProgramUniform1ui(program, 4, odd);
        gl_->ProgramUniform1ui(program, 5, first_block);
      };
      plan_pass(decision_, {lattice_key(1), 2}, 0, blocks * cubes * (odd == 3 ? 1 : 3), bind_octave);
    }
  }
  const auto blocks = static_cast<std::uint32_t>(l.blocks.size());
  plan_pass(decision_, {lattice_key(2), 256, true}, 1, blocks, bind);
  const auto bind_budget = [this, bind](GLuint program) {
    bind(program);
    gl_->ProgramUniform1ui(program, 3, max_cells_);
  };
  plan_pass(decision_, {lattice_key(3), 1U << 16U, true}, 0, 1, bind_budget);
  plan_pass(decision_, {lattice_key(4), 256, true}, 1, blocks, bind);
  plan_read_back(decision_);
}

void GridBuild::plan_cells() {
  // Where levels begin.
  std::vector<std::uint32_t> level_first{0, 24};
  for (std::size_t level = 0; level < CM_SPLIT_LEVELS && state_.added[level] != 0; ++level)
    level_first.push_back(level_first.back() + 2 * state_.added[level]);
  const std::uint32_t count = level_first.back();
  if (count != 24 + 2 * (state_.cells - 24))
    throw Error(ErrorCode::internal, "splits of a level without those above: the set is not closed");
  built_.count = state_.cells;
  built_.limited = state_.limited != 0;
  built_.levels = static_cast<std::uint32_t>(level_first.size() - 2);
  cells_.emplace(gl_, "building the grid");
  cells_->add([this, count] {
    tree_cells_ = make_storage(std::uint64_t{count} * sizeof(TreeCell), "creating the tree's cells");
    links_ = make_storage(std::uint64_t{count} * sizeof(glm::uvec4), "creating the tree's links");
    order_ = make_storage(std::uint64_t{count} * sizeof(glm::uvec2), "creating the order of cells");
  });
  cells_->add([this] {
    built_.cells = make_storage(std::uint64_t{built_.count} * sizeof(grid::CellRecord), "creating cell records");
    built_.tree = make_storage((roots_words + built_.count - 24) * 4, "creating the point-location tree");
  });
  cells_->add([this] {
    std::array<TreeCell, 24> cells{};
    std::array<glm::uvec4, 24> links{};
    const std::array<grid::RootCell, 24> roots = grid::root_cells(data_->lattice().cube.log2_size);
    for (std::size_t i = 0; i < roots.size(); ++i) {
      const glm::uvec3 v0(roots[i].v0);
      cells[i] = {0, 1, {v0.x | (v0.y << 16U), v0.z | (roots[i].shape << 16U)}};
      links[i] = {roots[i].links[0], roots[i].links[1], roots[i].links[2], roots[i].links[3]};
    }
    gl_->NamedBufferSubData(tree_cells_.name(), 0, sizeof cells, cells.data());
    gl_->NamedBufferSubData(links_.name(), 0, sizeof links, links.data());
  });
  plan_tree_cells(level_first);
  const auto bind = [this](GLuint program) {
    bind_storage({{core::CM_STORAGE_GRID_STATE, &data_->state_},
                  {core::CM_STORAGE_GRID_COARSE, &data_->coarse_},
                  {core::CM_STORAGE_GRID_PLACES, &data_->places_},
                  {core::CM_STORAGE_GRID_CELLS, &tree_cells_},
                  {core::CM_STORAGE_GRID_LINKS, &links_},
                  {core::CM_STORAGE_GRID_ORDER, &order_},
                  {core::CM_STORAGE_GRID_RECORDS, &built_.cells},
                  {core::CM_STORAGE_GRID_BRICKS, &data_->bricks_}});
    gl_->BindBufferBase(GL_UNIFORM_BUFFER, core::CM_UNIFORM_CELL_PARTS, data_->parts_.name());
    gl_->ProgramUniform1f(program, 3, 1.0F / data_->lattice().density_unit);
    gl_->ProgramUniform1i(program, 4, data_->lattice().cells == grid::CellKind::linear ? 1 : 0);
  };
  gl::ProgramKey records = cells_key(5);
  records.defines.emplace_back(data_->lattice().halves ? "CM_HALVES 1" : "CM_HALVES 0");
  plan_pass(*cells_, {records, 32}, 0, count, bind);
  plan_read_back(*cells_);
  cells_->add([this] {
    if (state_.low[0] <= state_.high[0]) {
      built_.content_min = {state_.low[0], state_.low[1], state_.low[2]};
      built_.content_max = {state_.high[0], state_.high[1], state_.high[2]};
    }
    // What is not the grid's goes.
    for (gl::Object* scratch : {&tree_cells_, &links_, &order_, &level_bytes_}) *scratch = {};
  });
}

void GridBuild::plan_tree_cells(const std::vector<std::uint32_t>& level_first) {
  const auto bind = [this](GLuint /*program*/) {
    bind_storage({{core::CM_STORAGE_GRID_STATE, &data_->state_},
                  {core::CM_STORAGE_GRID_PRIORITIES, &data_->priorities_},
                  {core::CM_STORAGE_GRID_PLACES, &data_->places_},
                  {core::CM_STORAGE_GRID_CELLS, &tree_cells_},
                  {core::CM_STORAGE_GRID_LINKS, &links_},
                  {core::CM_STORAGE_GRID_ORDER, &order_},
                  {core::CM_STORAGE_GRID_TREE, &built_.tree}});
  };
  const std::size_t splitting = level_first.size() - 2;  // levels
  for (std::size_t level = 0; level < splitting; ++level) {
    const std::uint32_t next = level_first[level + 1];
    const auto bind_level = [this, bind, level, next](GLuint program) {
      bind(program);
      gl_->ProgramUniform1ui(program, 3, static_cast<GLuint>(level));
      gl_->ProgramUniform1ui(program, 4, next);
    };
    plan_pass(*cells_, {cells_key(0), 4}, level_first[level], next, bind_level);
    plan_pass(*cells_, {cells_key(1), 8}, level_first[level], next, bind);
  }
  for (std::size_t level = splitting; level-- > 0;)
    plan_pass(*cells_, {cells_key(2), 1}, level_first[level], level_first[level + 1], bind);
  plan_pass(*cells_, {cells_key(3), 1, true}, 0, 1, bind);
  for (std::size_t level = 0; level < splitting; ++level)
    plan_pass(*cells_, {cells_key(4), 2}, level_first[level], level_first[level + 1], bind);
}

LatticeDataPtr GridBuilds::find(const grid::LatticePtr& lattice) const {
  const auto found =
      std::ranges::find(lattices_, lattice.get(), [](const LatticeDataPtr& data) { return &data->lattice(); });
  return found == lattices_.end() ? nullptr : *found;
}

bool GridBuilds::advance(const Sources& sources, const Sources& kept, Deadline deadline) {
  std::erase_if(lattices_, [&](const LatticeDataPtr& data) {
    return std::ranges::none_of(kept, [&](const scene::MarchSourcePtr& source) {
      return source->plan && source->plan->lattice.get() == &data->lattice();
    });
  });
  try {
    return std::ranges::all_of(sources, [&](const scene::MarchSourcePtr& source) {
      return !source->plan || built_.contains(source) || build(source, deadline);
    });
  } catch (const Error&) {
    upload_.reset();
    under_way_.reset();
    clear_built();
    throw;
  }
}

bool GridBuilds::build(const scene::MarchSourcePtr& source, Deadline deadline) {
  const scene::GridPlan& plan = *source->plan;
  LatticeDataPtr data = find(plan.lattice);
  if (!data) {
    under_way_.reset();
    if (!upload_ || upload_->lattice() != plan.lattice)
      upload_ = std::make_unique<LatticeUpload>(gl_, limits_, plan.lattice, source->statistics);
    if (!upload_->advance(deadline)) return false;
    data = upload_->take();
    upload_.reset();
    lattices_.push_back(data);
  }
  if (!under_way_ || under_way_->of != source) {
    under_way_ = UnderWay{
        source, std::make_unique<GridBuild>(gl_, programs_, limits_, std::move(data), plan.levels, plan.max_cells)};
  }
  if (!under_way_->work->advance(deadline)) return false;
  built_.emplace(source, under_way_->work->take());
  under_way_.reset();
  return true;
}

double GridBuilds::progress() const {
  if (upload_) return 0.5 * upload_->progress();
  return under_way_ ? 0.5 + 0.5 * under_way_->work->progress() : 1.0;
}

void GridBuilds::clear_built() { built_.clear(); }

void GridBuilds::clear() {
  clear_built();
  under_way_.reset();
  upload_.reset();
  lattices_.clear();
}

std::uint64_t GridBuilds::bytes() const {
  std::uint64_t bytes = (upload_ ? upload_->bytes() : 0) + (under_way_ ? under_way_->work->bytes() : 0);
  for (const LatticeDataPtr& data : lattices_) bytes += data->bytes();
  for (const auto& [source, grid] : built_) bytes += grid.bytes();
  return bytes;
}

}  // namespace cumulet::render
