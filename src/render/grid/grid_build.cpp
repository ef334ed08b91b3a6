#include "render/grid/grid_build.hpp"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <numeric>
#include <span>
#include <string>
#include <utility>

#include "base/detached_work.hpp"
#include "base/error.hpp"
#include "gl/bindings.hpp"
#include "grid/cell.hpp"
#include "grid/memory.hpp"
#include "grid/tet_grid.hpp"
#include "shader_macros.hpp"

namespace cumulet::render {

namespace {

constexpr std::size_t roots_words = 2 * CM_ROOTS + 4;
constexpr double parts_weight = 0.05;  // cost of a part of a cell, relative to the rest of its record

// Returns the emissive cells in the order of the grid.
std::vector<scene::GlowingCell> in_order(std::span<const std::uint32_t> words) {
  const std::size_t count = words.size() / grid::glowing_words;
  std::vector<std::uint32_t> order(count);
  std::iota(order.begin(), order.end(), 0U);
  std::ranges::sort(order, {}, [&](std::uint32_t i) { return words[i * grid::glowing_words]; });
  std::vector<scene::GlowingCell> cells;
  cells.reserve(count);
  for (const std::uint32_t i : order) {
    const std::uint32_t* at = &words[i * grid::glowing_words];
    const glm::uvec4 emission(at[3], at[4], at[5], at[6]);
    cells.push_back({{}, {at[1], at[2]}, {core::cm_emission_mean(emission), emission.w}});
  }
  return cells;
}

gl::ProgramKey lattice_key(int stage) { return {"grid_lattice.comp", {gl::macros::stage(stage)}}; }
// A program for the interpolation of the lattice's values. corners: it writes the corners of sixths.
gl::ProgramKey key_between(const grid::Lattice& lattice, gl::ProgramKey key, bool corners = false) {
  if (lattice.cube.interpolation == grid::Interpolation::linear)
    key.defines.emplace_back(gl::macros::linear(corners ? 2 : 1));
  return key;
}
gl::ProgramKey cells_key(int stage) { return {"grid_cells.comp", {gl::macros::stage(stage)}}; }

}  // namespace

GridBuild::GridBuild(gl::FunctionsPtr gl, gl::ProgramsPtr programs, const gl::Limits& limits, LatticeDataPtr data,
                     std::vector<std::uint8_t> levels, std::uint64_t max_cells, std::uint64_t max_bytes,
                     GridPacePtr pace)
    : gl_(std::move(gl)),
      limits_(limits),
      data_(std::move(data)),
      levels_(std::move(levels)),
      max_cells_(static_cast<std::uint32_t>(std::clamp<std::uint64_t>(max_cells, CM_ROOTS, std::uint64_t{1} << 30U))),
      max_bytes_(max_bytes),
      passes_(gl_, std::move(programs), std::move(pace), data_->lattice().cube.log2_size),
      decision_(gl_, "selecting the cells to split") {
  levels_.resize(std::max<std::size_t>((levels_.size() + 3) / 4 * 4, 4));
  plan_decision();
}

double GridBuild::progress() const {
  // Cells take most of the time.
  constexpr double decision = 0.2;
  return decision * decision_.progress() + (cells_ ? (1.0 - decision) * cells_->progress() : 0.0);
}

bool GridBuild::advance(Deadline deadline) {
  passes_.begin_call(deadline);
  if (!cells_) {
    if (!decision_.advance(deadline)) return false;
    plan_cells();
  }
  if (!emissive_) {
    if (!cells_->advance(deadline)) return false;
    plan_emissive();
  }
  return emissive_->advance(deadline);
}

gl::Object GridBuild::make_storage(std::uint64_t bytes, const char* what) {
  require_block(limits_, bytes, what);
  require_room(bytes);
  gl::Object made = gl::make_buffer(gl_, bytes, nullptr, GL_DYNAMIC_STORAGE_BIT, what);
  bytes_ += bytes;
  return made;
}

void GridBuild::bind_storage(std::initializer_list<std::pair<GLint, const gl::Object*>> buffers) const {
  for (const auto& [binding, buffer] : buffers)
    gl_->BindBufferBase(GL_SHADER_STORAGE_BUFFER, static_cast<GLuint>(binding), buffer->name());
}

void GridBuild::require_room(std::uint64_t bytes) const {
  if (bytes <= max_bytes_ - std::min(max_bytes_, bytes_)) return;
  throw Error(ErrorCode::out_of_memory, "building the grid needs " + std::to_string(bytes_ + bytes) +
                                            " bytes of GPU memory; " + std::to_string(max_bytes_) +
                                            " are left within the limit");
}

void GridBuild::plan_read_back(Upload& upload) {
  upload.add([this] {
    if (!read_back_) read_back_ = gl::ReadBack(gl_, sizeof(core::CmGridState), "creating the read-back of a grid");
    gl_->CopyNamedBufferSubData(data_->state_.name(), read_back_.name(), 0, 0, sizeof(core::CmGridState));
    gl::memory_barrier(*gl_, GL_CLIENT_MAPPED_BUFFER_BARRIER_BIT);
    fence_ = gl::Fence(gl_);
    passes_.clear_in_flight();
  });
  upload.add_until([this] {
    if (!fence_.passed()) return false;
    std::memcpy(&state_, read_back_.data(), sizeof state_);
    return true;
  });
}

void GridBuild::plan_clear(Upload& upload, const gl::Object& buffer, std::uint64_t bytes) {
  const auto clear = [this, &buffer](std::size_t first, std::size_t count) {
    gl_->ClearNamedBufferSubData(buffer.name(), GL_R32UI, static_cast<GLintptr>(first), static_cast<GLsizeiptr>(count),
                                 GL_RED_INTEGER, GL_UNSIGNED_INT, nullptr);
  };
  upload.add_pieces(bytes, clear, 4);
}

void GridBuild::plan_decision() {
  const grid::Lattice& l = data_->lattice();
  decision_.add([this] { level_bytes_ = make_storage(levels_.size(), "creating the maximum levels of a view"); });
  decision_.add_bytes([this] { return Upload::Location{level_bytes_.name(), 0}; }, levels_.data(), levels_.size());
  plan_clear(decision_, data_->priorities_, std::uint64_t{l.blocks.size()} * CM_BLOCK_POINTS * 4);
  plan_clear(decision_, data_->bins_, std::uint64_t{CM_PRIORITIES} * 4);
  decision_.add([this] {
    core::CmGridState state{};
    std::ranges::fill(state.low, 0xffffffffU);
    gl_->NamedBufferSubData(data_->state_.name(), 0, sizeof state, &state);
  });

  const auto bind = [this](GLuint /*program*/) {
    bind_storage({{core::CM_STORAGE_GRID_STATE, &data_->state_},
                  {core::CM_STORAGE_GRID_PRIORITIES, &data_->priorities_},
                  {core::CM_STORAGE_LATTICE_ENTRIES, &data_->entries_},
                  {core::CM_STORAGE_GRID_BLOCKS, &data_->blocks_},
                  {core::CM_STORAGE_GRID_NODES, &data_->nodes_},
                  {core::CM_STORAGE_GRID_LEVELS, &level_bytes_},
                  {core::CM_STORAGE_GRID_OWN, &data_->own_},
                  {core::CM_STORAGE_GRID_BINS, &data_->bins_}});
    gl_->BindBufferBase(GL_UNIFORM_BUFFER, core::CM_UNIFORM_BRICK_POINTS, data_->points_.name());
  };
  passes_.plan(decision_, {lattice_key(0), 512, true}, 0, static_cast<std::uint32_t>(l.own.nodes.size()), bind);
  // From the finest level up, as in DiamondSet::close().
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
      passes_.plan(decision_, {lattice_key(1), 2}, 0, blocks * cubes * (odd == 3 ? 1 : 3), bind_octave);
    }
  }
  const auto blocks = static_cast<std::uint32_t>(l.blocks.size());
  passes_.plan(decision_, {lattice_key(2), 256, true}, 1, blocks, bind);
  const auto bind_budget = [this, bind](GLuint program) {
    bind(program);
    gl_->ProgramUniform1ui(program, 3, max_cells_);
  };
  passes_.plan(decision_, {lattice_key(3), 1U << 16U, true}, 0, 1, bind_budget);
  passes_.plan(decision_, {lattice_key(4), 256, true}, 1, blocks, bind);
  plan_read_back(decision_);
}

std::vector<GridBuild::Level> GridBuild::levels_of_tree() const {
  std::vector<Level> levels;
  Level level{.cells_end = CM_ROOTS};
  for (std::size_t i = 0; i < CM_SPLIT_LEVELS && state_.added[i] != 0; ++i) {
    level.splits_end = level.splits_begin + state_.added[i];
    levels.push_back(level);
    level = {level.cells_end, level.cells_end + 2 * state_.added[i], level.splits_end, level.splits_end};
  }
  levels.push_back(level);
  if (level.splits_end != state_.cells - CM_ROOTS)
    throw Error(ErrorCode::internal,
                "a level has splits without those of the level above: the refinement set is not conforming");
  return levels;
}

void GridBuild::plan_cells() {
  tree_levels_ = levels_of_tree();
  const std::uint32_t count = tree_levels_.back().cells_end;
  built_.count = state_.cells;
  built_.limited = state_.limited != 0;
  built_.levels = static_cast<std::uint32_t>(tree_levels_.size() - 1);
  // The memory is checked before anything is allocated.
  std::uint64_t needs = std::max(count * grid::tree_cell_bytes, grid::clear_bytes);
  for (const grid::LatticeChannel& channel : data_->lattice().channels) {
    needs += grid::channel_bytes(channel.channel, built_.count);
    if (channel.channel == grid::Channel::emission) needs += std::uint64_t{built_.count} * grid::glowing_words * 4;
  }
  const bool has_corners = data_->lattice().has_corners();
  if (has_corners) needs += std::uint64_t{built_.count} * sizeof(glm::uvec4);
  require_room(needs + built_.bytes());
  cells_.emplace(gl_, "building the grid");
  cells_->add([this, count] {
    tree_cells_ = make_storage(std::uint64_t{count} * sizeof(grid::TreeCell), "creating the tree's cells");
    links_ = make_storage(std::uint64_t{count} * sizeof(glm::uvec4), "creating the tree's links");
    below_ = make_storage(std::uint64_t{count} * sizeof(glm::uvec2), "creating the child data of the tree");
    list_ = make_storage(std::uint64_t{count} * sizeof(std::uint32_t), "creating the list of the tree's cells");
  });
  cells_->add([this] {
    built_.cells = make_storage(std::uint64_t{built_.count} * sizeof(grid::CellRecord), "creating the cell data");
    built_.tree = make_storage((roots_words + built_.count - CM_ROOTS) * 4, "creating the point-location tree");
  });
  if (has_corners) {
    cells_->add([this] {
      const std::uint64_t bytes = std::uint64_t{built_.count} * sizeof(glm::uvec4);
      built_.corners = make_storage(bytes, "creating the corners of cells");
    });
  }
  cells_->add([this] {
    std::array<grid::TreeCell, CM_ROOTS> cells{};
    std::array<glm::uvec4, CM_ROOTS> links{};
    const std::array<grid::RootCell, CM_ROOTS> roots = grid::root_cells(data_->lattice().cube.log2_size);
    const bool wide = data_->lattice().cube.wide();
    for (std::size_t i = 0; i < roots.size(); ++i) {
      cells[i] = {0, 0, core::cm_pack_v0_shape(roots[i].v0, roots[i].shape, wide)};
      links[i] = {roots[i].links[0], roots[i].links[1], roots[i].links[2], roots[i].links[3]};
    }
    gl_->NamedBufferSubData(tree_cells_.name(), 0, sizeof cells, cells.data());
    gl_->NamedBufferSubData(links_.name(), 0, sizeof links, links.data());
  });
  plan_tree_cells();
  plan_records();
  plan_channels();
  // Temporary buffers are freed before more are allocated.
  cells_->add([this, count] {
    for (gl::Object* scratch : {&tree_cells_, &links_, &below_, &list_}) *scratch = {};
    bytes_ -= count * grid::tree_cell_bytes;
  });
  plan_clear_cones();
  plan_read_back(*cells_);
  cells_->add([this] {
    if (state_.low[0] <= state_.high[0]) {
      built_.content_min = {state_.low[0], state_.low[1], state_.low[2]};
      built_.content_max = {state_.high[0], state_.high[1], state_.high[2]};
    }
    for (gl::Object* scratch : {&level_bytes_, &clear_}) *scratch = {};
  });
}

void GridBuild::plan_leaves(const Pass& coarse, const Pass& fine, const Bind& bind, const Bind& bind_fine) {
  const grid::CellParts& parts = grid::cell_parts(data_->lattice().cube.interpolation);
  // All cells of a level have the same size.
  std::uint32_t shape = grid::root_cells(data_->lattice().cube.log2_size)[0].shape;
  std::uint32_t begin = tree_levels_.back().splits_end;
  for (const Level& level : tree_levels_) {
    Pass pass = coarse;
    const bool is_fine = core::cm_is_fine(shape);
    if (is_fine) {
      pass = fine;
      const std::uint32_t fine_level = core::cm_fine_level(shape);
      pass.weight += parts_weight * (parts.first[fine_level + 1] - parts.first[fine_level]);
    }
    passes_.plan(*cells_, pass, begin, begin + level.leaves(), is_fine ? bind_fine : bind);
    begin += level.leaves();
    shape = core::cm_child_shape(shape, 0);
  }
}

void GridBuild::plan_records() {
  const auto bind = [this](GLuint program) {
    bind_storage({{core::CM_STORAGE_GRID_STATE, &data_->state_},
                  {core::CM_STORAGE_GRID_COARSE, &data_->coarse_},
                  {core::CM_STORAGE_LATTICE_ENTRIES, &data_->entries_},
                  {core::CM_STORAGE_GRID_CELLS, &tree_cells_},
                  {core::CM_STORAGE_GRID_LINKS, &links_},
                  {core::CM_STORAGE_GRID_LIST, &list_},
                  {core::CM_STORAGE_GRID_RECORDS, &built_.cells},
                  {core::CM_STORAGE_GRID_BRICKS, &data_->bricks_}});
    gl_->BindBufferBase(GL_UNIFORM_BUFFER, core::CM_UNIFORM_CELL_PARTS, data_->parts_.name());
    gl_->ProgramUniform1f(program, 3, 1.0F / data_->lattice().density_unit);
    gl_->ProgramUniform1i(program, 4, grid::has_fits(data_->lattice().cells) ? 1 : 0);
  };
  const bool has_corners = data_->lattice().has_corners();
  const auto bind_fine = [this, bind, has_corners](GLuint program) {
    bind(program);
    if (has_corners) bind_storage({{core::CM_STORAGE_GRID_CORNERS, &built_.corners}});
  };
  const auto key = [this, has_corners](bool fine) {
    const grid::Lattice& lattice = data_->lattice();
    return key_between(lattice, {"grid_records.comp", {gl::macros::fine(fine), gl::macros::halves(lattice.halves)}},
                       fine && has_corners);
  };
  plan_leaves({key(false), 32}, {key(true), 32}, bind, bind_fine);
}

void GridBuild::plan_clear_cones() {
  cells_->add([this] { clear_ = make_storage(grid::clear_bytes, "creating the empty-space cones"); });
  plan_clear(*cells_, clear_, grid::clear_full_bytes);
  const auto bind = [this](GLuint /*program*/) {
    bind_storage({{core::CM_STORAGE_GRID_STATE, &data_->state_},
                  {core::CM_STORAGE_GRID_RECORDS, &built_.cells},
                  {core::CM_STORAGE_GRID_CLEAR, &clear_}});
  };
  const auto key = [](int stage) { return gl::ProgramKey{"grid_clear.comp", {gl::macros::stage(stage)}}; };
  passes_.plan(*cells_, {key(0), 8}, 0, built_.count, bind);
  passes_.plan(*cells_, {key(1), 4096, true}, 0, CM_CLEAR_CONES, bind);
  passes_.plan(*cells_, {key(2), 8}, 0, CM_CLEAR_CUBES, bind);
  passes_.plan(*cells_, {key(3), 8}, 0, built_.count, bind);
}

void GridBuild::plan_channels() {
  for (std::size_t i = 0; i < data_->lattice().channels.size(); ++i) plan_channel(i);
  const gl::Object& emission = built_.channels[grid::index_of(grid::Channel::emission)];
  if (std::ranges::none_of(data_->lattice().channels,
                           [](const auto& channel) { return channel.channel == grid::Channel::emission; }))
    return;
  cells_->add([this] {
    glowing_ =
        make_storage(std::uint64_t{built_.count} * grid::glowing_words * 4, "creating the list of emissive cells");
  });
  const auto bind = [this, &emission](GLuint /*program*/) {
    bind_storage({{core::CM_STORAGE_GRID_STATE, &data_->state_},
                  {core::CM_STORAGE_GRID_RECORDS, &built_.cells},
                  {core::CM_STORAGE_GRID_CHANNEL, &emission},
                  {core::CM_STORAGE_GRID_GLOWING, &glowing_}});
  };
  passes_.plan(*cells_, {{"grid_emissive.comp", {}}, 2, false, false}, 0, built_.count, bind);
}

void GridBuild::plan_channel(std::size_t index) {
  const grid::LatticeChannel& channel = data_->lattice().channels[index];
  gl::Object& records = built_.channels[grid::index_of(channel.channel)];
  const std::uint64_t bytes = (grid::channel_bytes(channel.channel, built_.count) + 3) / 4 * 4;
  cells_->add([this, &records, bytes] { records = make_storage(bytes, "creating a channel's cell data"); });
  // Two cells may share a word.
  if (grid::row_of(channel.channel).record_bytes < 4) plan_clear(*cells_, records, bytes);
  const auto bind = [this, &channel, &data = data_->channels_[index], &records](GLuint program) {
    bind_storage({{core::CM_STORAGE_GRID_STATE, &data_->state_},
                  {core::CM_STORAGE_GRID_COARSE, &data.coarse},
                  {core::CM_STORAGE_LATTICE_ENTRIES, &data.entries},
                  {core::CM_STORAGE_GRID_CELLS, &tree_cells_},
                  {core::CM_STORAGE_GRID_CHANNEL, &records},
                  {core::CM_STORAGE_GRID_LIST, &list_},
                  {core::CM_STORAGE_GRID_RECORDS, &built_.cells},
                  {core::CM_STORAGE_GRID_BRICKS, &data.bricks}});
    gl_->BindBufferBase(GL_UNIFORM_BUFFER, core::CM_UNIFORM_CELL_PARTS, data_->parts_.name());
    if (channel.channel == grid::Channel::emission)
      gl_->ProgramUniform1i(program, 3, grid::has_fits(data_->lattice().cells) ? 1 : 0);
    if (channel.channel == grid::Channel::velocity) gl_->ProgramUniform1f(program, 3, channel.fastest);
  };
  const Pass pass{key_between(data_->lattice(), {"grid_channels.comp", {gl::macros::channel(channel.channel)}}), 32};
  plan_leaves(pass, pass, bind, bind);
}

void GridBuild::plan_emissive() {
  emissive_.emplace(gl_, "reading the emissive cells");
  if (state_.glowing == 0) return;
  const std::size_t bytes = std::size_t{state_.glowing} * grid::glowing_words * 4;
  emissive_->add([this, bytes] {
    emissive_read_back_ = gl::ReadBack(gl_, bytes, "creating the read-back of emissive cells");
    emissive_words_.resize(bytes / 4);
  });
  emissive_->add_pieces(bytes, [this](std::size_t first, std::size_t count) {
    gl_->CopyNamedBufferSubData(glowing_.name(), emissive_read_back_.name(), static_cast<GLintptr>(first),
                                static_cast<GLintptr>(first), static_cast<GLsizeiptr>(count));
  });
  emissive_->add([this] {
    gl::memory_barrier(*gl_, GL_CLIENT_MAPPED_BUFFER_BARRIER_BIT);
    fence_ = gl::Fence(gl_);
  });
  emissive_->add_until([this] { return fence_.passed(); });
  emissive_->add_pieces(
      bytes,
      [this](std::size_t first, std::size_t count) {
        std::memcpy(&emissive_words_[first / 4], emissive_read_back_.data() + first, count);
      },
      4);
  emissive_->add([this] {
    emissive_read_back_ = {};
    glowing_ = {};
    begin_emissive_table();
  });
  emissive_->add_until([this] {
    if (emissive_table_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return false;
    built_.emissive = emissive_table_.get();
    return true;
  });
}

void GridBuild::begin_emissive_table() {
  emissive_table_ = make_detached<scene::EmissiveTable>(
      "building the emissive-cell distribution", [words = std::move(emissive_words_), cube = data_->lattice().cube] {
        return scene::emissive_table(in_order(words), cube);
      });
}

void GridBuild::plan_tree_cells() {
  const auto bind_splits = [this, first_leaf = tree_levels_.back().splits_end](GLuint program) {
    bind_storage({{core::CM_STORAGE_GRID_STATE, &data_->state_},
                  {core::CM_STORAGE_GRID_PRIORITIES, &data_->priorities_},
                  {core::CM_STORAGE_LATTICE_ENTRIES, &data_->entries_},
                  {core::CM_STORAGE_GRID_CELLS, &tree_cells_},
                  {core::CM_STORAGE_GRID_LIST, &list_},
                  {core::CM_STORAGE_GRID_BELOW, &below_}});
    gl_->ProgramUniform1ui(program, 3, first_leaf);
  };
  const auto bind = [this](GLuint /*program*/) {
    bind_storage({{core::CM_STORAGE_GRID_CELLS, &tree_cells_},
                  {core::CM_STORAGE_GRID_LINKS, &links_},
                  {core::CM_STORAGE_GRID_LIST, &list_},
                  {core::CM_STORAGE_GRID_BELOW, &below_},
                  {core::CM_STORAGE_GRID_TREE, &built_.tree}});
  };
  for (const Level& level : tree_levels_) {
    passes_.plan(*cells_, {cells_key(0), 8}, level.cells_begin, level.cells_end, bind_splits);
    passes_.plan(*cells_, {cells_key(1), 16}, level.splits_begin, level.splits_end, bind);
  }
  for (std::size_t i = tree_levels_.size(); i-- > 0;)
    passes_.plan(*cells_, {cells_key(2), 2}, tree_levels_[i].splits_begin, tree_levels_[i].splits_end, bind);
  passes_.plan(*cells_, {cells_key(3), 1, true}, 0, 1, bind);
  for (const Level& level : tree_levels_)
    passes_.plan(*cells_, {cells_key(4), 4}, level.splits_begin, level.splits_end, bind);
}

}  // namespace cumulet::render
