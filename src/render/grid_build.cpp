#include "render/grid_build.hpp"

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <cstring>
#include <numeric>
#include <set>
#include <span>
#include <string>
#include <utility>

#include "base/detached_work.hpp"
#include "base/error.hpp"
#include "base/milliseconds.hpp"
#include "gl/bindings.hpp"
#include "grid/cell.hpp"
#include "grid/evaluation.hpp"
#include "grid/grid_builder.hpp"
#include "render/brick_kernels.hpp"
#include "render/pace.hpp"
#include "volume/brick_values.hpp"
#include "volume/bricks.hpp"

namespace cumulet::render {

namespace {

constexpr std::uint32_t group = 64;  // invocations per work group, of all kernels here
constexpr std::size_t roots_words = 2 * CM_ROOTS + 4;
constexpr double parts_weight = 0.05;     // cost of a part of a cell, relative to the rest of its record
constexpr double max_in_flight_ms = 8.0;  // independent of the deadline, because the host draws, too

// Layout as in glsl/grid_leaves.glsl.
struct TreeCell {
  std::uint32_t child;
  std::uint32_t rank;
  glm::uvec2 where;
};
static_assert(sizeof(TreeCell) == 16);

// Includes the cell's links, the counts below it, and its list entry.
constexpr std::uint64_t tree_cell_bytes =
    sizeof(TreeCell) + sizeof(glm::uvec4) + sizeof(glm::uvec2) + sizeof(std::uint32_t);

// Layout as in glsl/grid_clear.comp: rows of occupancy, rows per cone, and the cones of each cube.
constexpr std::uint64_t full_bytes = std::uint64_t{2} * CM_CLEAR_ROWS * sizeof(glm::uvec2);
constexpr std::uint64_t clear_bytes = full_bytes + std::uint64_t{CM_CLEAR_CONES} * CM_CLEAR_ROWS * sizeof(glm::uvec2) +
                                      std::uint64_t{CM_CLEAR_CUBES} * sizeof(std::uint32_t);

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

// Layout as in glsl/grid_emissive.comp: cell number, position, emission.
constexpr std::size_t glowing_words = 7;

// Returns the emissive cells in the order of the grid.
std::vector<scene::GlowingCell> in_order(std::span<const std::uint32_t> words) {
  const std::size_t count = words.size() / glowing_words;
  std::vector<std::uint32_t> order(count);
  std::iota(order.begin(), order.end(), 0U);
  std::ranges::sort(order, {}, [&](std::uint32_t i) { return words[i * glowing_words]; });
  std::vector<scene::GlowingCell> cells;
  cells.reserve(count);
  for (const std::uint32_t i : order) {
    const std::uint32_t* at = &words[i * glowing_words];
    const glm::uvec4 emission(at[3], at[4], at[5], at[6]);
    cells.push_back({{}, {at[1], at[2]}, {core::cm_emission_mean(emission), emission.w}});
  }
  return cells;
}

// Estimated time of a cheap item before any measurement. Drivers that run dispatches within the call run them on the
// CPU.
double cost_ms(const gl::Functions& gl) { return std::exp2(gl.dispatches_in_call ? -18.0 : -22.0); }

gl::ProgramKey lattice_key(int stage) { return {"grid_lattice.comp", {"CM_STAGE " + std::to_string(stage)}}; }
gl::ProgramKey cells_key(int stage) { return {"grid_cells.comp", {"CM_STAGE " + std::to_string(stage)}}; }

}  // namespace

LatticeUpload::LatticeUpload(const gl::FunctionsPtr& gl, gl::ProgramsPtr programs, const gl::Limits& limits,
                             grid::LatticePtr lattice, std::shared_ptr<const grid::Statistics> statistics,
                             grid::Channels channels, DeviceMemoriesPtr memories)
    : gl_(gl),
      programs_(std::move(programs)),
      limits_(limits),
      memories_(std::move(memories)),
      statistics_(std::move(statistics)),
      channels_(std::move(channels)),
      fields_(grid::fields_of(*statistics_, channels_)),
      data_(std::make_shared<LatticeData>()),
      moves_(gl_, programs_, memories_),
      upload_(gl, "uploading the lattice") {
  data_->lattice_ = std::move(lattice);
  const grid::Lattice& l = *data_->lattice_;
  // The shader's counters of added cells have 32 bits.
  constexpr std::size_t max_blocks = std::size_t{1} << 20U;
  if (l.blocks.size() > max_blocks) {
    throw Error(ErrorCode::unsupported,
                "a lattice of " + std::to_string(l.blocks.size()) + " blocks: the limit is 2^20; raise the threshold");
  }
  const auto plan = [&]<class T>(gl::Object& buffer, const std::vector<T>& from, const char* what) {
    plan_buffer(buffer, from.size() * sizeof(T), from.data(), what);
  };
  plan(data_->nodes_, l.own.nodes, "creating the lattice's nodes");
  plan_buffer(data_->own_, l.own.all_values() * 2, nullptr, "creating the split priorities");
  plan_bytes(data_->own_, l.own.values.size() * 2, l.own.values.data());
  plan(data_->blocks_, l.blocks, "creating the lattice's blocks");
  plan(data_->entries_, l.entries, "creating the lattice index");
  plan(data_->coarse_, l.coarse, "creating the coefficients of coarse cells");
  plan_bricks();
  plan_channels();
  if (statistics_->on_device()) {
    plan_device_bricks();
    upload_.add([this] { gl::memory_barrier(*gl_, GL_SHADER_STORAGE_BARRIER_BIT); });
    plan_priorities();
  }
  plan_buffer(data_->priorities_, l.blocks.size() * CM_BLOCK_POINTS * 4, nullptr, "creating the priorities");
  plan_buffer(data_->bins_, std::uint64_t{CM_PRIORITIES} * 4, nullptr, "creating the priorities' histogram");
  plan_buffer(data_->state_, sizeof(core::CmGridState), nullptr, "creating the grid's state");
  static const BrickPointWords points = brick_point_words();
  plan_buffer(data_->points_, sizeof points, points.data(), "creating the sample points of bricks");
  plan_buffer(data_->parts_, sizeof(grid::CellParts), grid::cell_parts().data(), "creating the cell parts");
}

void LatticeUpload::plan_buffer(gl::Object& buffer, std::uint64_t bytes, const void* from, const char* what) {
  const std::uint64_t whole = std::max<std::uint64_t>((bytes + 3) / 4 * 4, 4);
  require_block(limits_, whole, what);
  data_->bytes_ += whole;
  upload_.add(
      [this, &buffer, whole, what] { buffer = gl::make_buffer(gl_, whole, nullptr, GL_DYNAMIC_STORAGE_BIT, what); });
  if (from != nullptr) plan_bytes(buffer, bytes, from);
}

void LatticeUpload::plan_bytes(const gl::Object& buffer, std::uint64_t bytes, const void* from) {
  upload_.add_bytes([&buffer] { return Upload::Location{buffer.name(), 0}; }, from, bytes);
}

void LatticeUpload::plan_values(const gl::Object& buffer, std::size_t bricks, std::size_t brick_bytes,
                                const FillBrick& fill) {
  const auto put = [this, &buffer, brick_bytes, fill](std::size_t first, std::size_t bytes) {
    std::vector<std::byte> piece(bytes);
    for (std::size_t at = 0; at < bytes; at += brick_bytes) fill((first + at) / brick_bytes, &piece[at]);
    gl_->NamedBufferSubData(buffer.name(), static_cast<GLintptr>(first), static_cast<GLsizeiptr>(bytes), piece.data());
  };
  upload_.add_pieces(bricks * brick_bytes, put, brick_bytes);
}

void LatticeUpload::plan_bricks() {
  const grid::Lattice& l = *data_->lattice_;
  const std::size_t brick_bytes = volume::brick_voxels * (l.halves ? sizeof(std::uint16_t) : sizeof(float));
  const auto fill = [this, &l, brick_bytes](std::size_t brick, std::byte* to) {
    const std::vector<std::uint32_t>& nodes = statistics_->nodes_of_size(3);
    volume::BrickValues::Brick room;
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
      std::memcpy(to, halves.data(), brick_bytes);
    } else {
      std::memcpy(to, values, brick_bytes);
    }
  };
  plan_buffer(data_->bricks_, std::uint64_t{l.bricks} * brick_bytes, nullptr, "creating the values of bricks");
  plan_values(data_->bricks_, statistics_->on_device() ? l.even_bricks.size() : l.bricks, brick_bytes, fill);
}

void LatticeUpload::plan_device_bricks() {
  const grid::Lattice& l = *data_->lattice_;
  std::vector<MovedBrick> moved;
  for (const std::uint32_t node : statistics_->nodes_of_size(3))
    moved.emplace_back(statistics_->nodes()[node].values, moved.size());
  moves_.plan(upload_, *statistics_->on_device(), moved,
              {.to = &data_->bricks_, .to_halves = l.halves, .to_first = std::uint32_t(l.even_bricks.size())});
}

void LatticeUpload::plan_device_bricks(const grid::LatticeChannel& channel, const grid::ChannelFields& fields,
                                       const gl::Object& to) {
  std::vector<volume::DeviceBricksPtr> bricks;
  for (const grid::Statistics* field : fields.statistics()) bricks.push_back(field->on_device());
  std::vector<glm::ivec3> origins;
  for (const glm::ivec3& corner : channel.bricks) origins.push_back(corner + data_->lattice_->cube.origin);
  const auto to_first = static_cast<std::uint32_t>(channel.even_bricks.size());
  const gl::ProgramKey key{"channel_numbers.comp",
                           {"CM_CHANNEL " + std::to_string(static_cast<int>(fields.channel())),
                            "CM_FIELDS " + std::to_string(bricks.size())}};
  moves_.plan_together(upload_, bricks, origins, [&](std::size_t first, std::uint32_t count) {
    upload_.add_dispatches(programs_, key, count, bricks_per_step(*gl_),
                           [this, &to, to_first = to_first + static_cast<std::uint32_t>(first)](
                               const gl::Program& program, std::uint32_t begin, std::uint32_t end) {
                             gl_->ProgramUniform2ui(program.name(), 0, begin, end);
                             gl_->ProgramUniform1ui(program.name(), 1, to_first);
                             gl_->BindBufferBase(GL_SHADER_STORAGE_BUFFER, core::CM_STORAGE_BRICKS_TOGETHER,
                                                 moves_.together().name());
                             gl_->BindBufferBase(GL_SHADER_STORAGE_BUFFER, core::CM_STORAGE_BRICKS_NUMBERS, to.name());
                             program.use(*gl_);
                             dispatch_groups(*gl_, end - begin);
                           });
  });
}

void LatticeUpload::plan_priorities() {
  const grid::Lattice& l = *data_->lattice_;
  const grid::BricksToRate& rated = l.own.to_rate;
  if (rated.values == 0) return;
  upload_.add([this, &l, &rated] {
    const auto make = [this](const auto& from, const char* what) {
      return gl::make_buffer(gl_, std::max<std::size_t>(from.size() * sizeof from[0], 4),
                             from.empty() ? nullptr : from.data(), 0, what);
    };
    scratch_.lit = make(rated.lit, "creating the emission of bricks");
    scratch_.tree = make_brick_tree(gl_, rated.edges_squared);
    std::array<std::uint32_t, (std::tuple_size_v<grid::BrickPointIndices> + 3) / 4 * 4> indices{};
    std::ranges::copy(grid::brick_point_indices(), indices.begin());
    scratch_.points = make(indices, "creating the index of a brick's sample points");
    gl_->ClearNamedBufferSubData(data_->own_.name(), GL_R32UI, static_cast<GLintptr>(l.own.values.size() * 2),
                                 static_cast<GLsizeiptr>(rated.values * 2), GL_RED_INTEGER, GL_UNSIGNED_INT, nullptr);
  });
  const std::vector<grid::EvaluatedField> fields = grid::evaluated_fields(*statistics_, channels_);
  for (std::size_t i = 0; i < fields.size(); ++i) plan_priorities(*fields[i].field, rated.fields[i]);
  upload_.add([this] {
    scratch_ = {};
    moves_.drop();
  });
}

void LatticeUpload::plan_priorities(const grid::Statistics& field, const grid::BricksToRate::Field& rated) {
  const grid::Lattice& l = *data_->lattice_;
  const bool of_density = &field == statistics_.get();
  // Values of other fields are copied to a buffer first, a batch at a time.
  const std::size_t at_a_time = of_density ? std::max<std::size_t>(rated.nodes.size(), 1) : 4096;
  for (std::size_t first = 0; first < rated.nodes.size(); first += at_a_time) {
    // Per brick: its node number, and its index in the buffer of values.
    std::vector<glm::uvec2> list;
    std::vector<MovedBrick> moved;
    for (std::size_t i = first; i < std::min(first + at_a_time, rated.nodes.size()); ++i) {
      const glm::ivec3 corner = core::cm_node_corner(l.own.nodes[l.own.to_rate.first_node + rated.nodes[i]]);
      const grid::Statistics::Node& brick = field.node_at(corner);
      const auto at = static_cast<std::uint32_t>(list.size());
      list.emplace_back(rated.nodes[i],
                        of_density ? static_cast<std::uint32_t>(l.even_bricks.size()) + brick.moments / 6 : at);
      if (!of_density) moved.emplace_back(static_cast<std::uint32_t>(brick.values), at);
    }
    if (!of_density) {
      upload_.add([this, bytes = moved.size() * volume::brick_voxels * sizeof(float)] {
        scratch_.values = {};
        scratch_.values = gl::make_buffer(gl_, bytes, nullptr, 0, "creating the values of bricks for the criterion");
      });
      moves_.plan(upload_, *field.on_device(), moved, {.to = &scratch_.values});
      upload_.add([this] { gl::memory_barrier(*gl_, GL_SHADER_STORAGE_BARRIER_BIT); });
    }
    plan_priorities(list, of_density, rated.measure);
  }
}

void LatticeUpload::plan_priorities(const std::vector<glm::uvec2>& list, bool of_density,
                                    const grid::OwnMeasure& measure) {
  const grid::Lattice& l = *data_->lattice_;
  const auto count = static_cast<std::uint32_t>(list.size());
  upload_.add([this, list] {
    scratch_.to_rate = gl::make_buffer(gl_, list.size() * sizeof list[0], list.data(), 0,
                                       "creating the list of bricks for the criterion");
  });
  const gl::Object& values = of_density ? data_->bricks_ : scratch_.values;
  const gl::ProgramKey key{"own_priorities.comp",
                           {of_density && l.halves ? "CM_HALVES 1" : "CM_HALVES 0",
                            "CM_CRITERION " + std::to_string(static_cast<int>(measure.criterion))}};
  upload_.add_dispatches(
      programs_, key, count, bricks_per_step(*gl_),
      [this, &l, &measure, &values](const gl::Program& program, std::uint32_t first, std::uint32_t end) {
        const GLuint name = program.name();
        gl_->ProgramUniform2ui(name, 0, first, end);
        gl_->ProgramUniform1ui(name, 1, static_cast<GLuint>(l.own.to_rate.first_node));
        gl_->ProgramUniform3f(name, 2, measure.scale, measure.own_hiding, measure.floor);
        gl_->ProgramUniform1i(name, 3, measure.linear ? 1 : 0);
        gl_->ProgramUniform1f(name, 4, measure.two_way ? 1.0F : 0.0F);
        gl_->BindBufferBase(GL_SHADER_STORAGE_BUFFER, core::CM_STORAGE_GRID_NODES, data_->nodes_.name());
        gl_->BindBufferBase(GL_SHADER_STORAGE_BUFFER, core::CM_STORAGE_GRID_OWN, data_->own_.name());
        gl_->BindBufferBase(GL_SHADER_STORAGE_BUFFER, core::CM_STORAGE_GRID_BRICKS, values.name());
        gl_->BindBufferBase(GL_SHADER_STORAGE_BUFFER, core::CM_STORAGE_BRICKS_TO_RATE, scratch_.to_rate.name());
        gl_->BindBufferBase(GL_SHADER_STORAGE_BUFFER, core::CM_STORAGE_BRICKS_LIT, scratch_.lit.name());
        gl_->BindBufferBase(GL_UNIFORM_BUFFER, core::CM_UNIFORM_BRICK_TREE, scratch_.tree.name());
        gl_->BindBufferBase(GL_UNIFORM_BUFFER, core::CM_UNIFORM_POINT_INDICES, scratch_.points.name());
        program.use(*gl_);
        dispatch_groups(*gl_, end - first);
      });
  upload_.add([this] { gl::memory_barrier(*gl_, GL_SHADER_STORAGE_BARRIER_BIT); });
}

void LatticeUpload::plan_channels() {
  const std::vector<grid::LatticeChannel>& channels = data_->lattice_->channels;
  data_->channels_.resize(channels.size());
  for (std::size_t i = 0; i < channels.size(); ++i) {
    const grid::LatticeChannel& channel = channels[i];
    LatticeData::Channel& data = data_->channels_[i];
    plan_buffer(data.entries, channel.entries.size() * sizeof(grid::LatticeEntry), channel.entries.data(),
                "creating a channel's index");
    plan_buffer(data.coarse, channel.coarse.size() * 4, channel.coarse.data(), "creating a channel's coarse cells");
    const auto fill = [&channel, &fields = fields_[i]](std::size_t brick, std::byte* to) {
      std::vector<float> numbers(volume::brick_voxels * channel.numbers);
      if (brick < channel.even_bricks.size()) {
        for (std::size_t n = 0; n < numbers.size(); ++n) numbers[n] = channel.even_bricks[brick][n % channel.numbers];
      } else {
        fields.fill(channel.bricks[brick - channel.even_bricks.size()], numbers);
      }
      std::memcpy(to, numbers.data(), numbers.size() * sizeof(float));
    };
    const std::size_t bricks = channel.even_bricks.size() + channel.bricks.size();
    const std::size_t brick_bytes = volume::brick_voxels * channel.numbers * sizeof(float);
    plan_buffer(data.bricks, bricks * brick_bytes, nullptr, "creating a channel's brick values");
    const bool on_device = fields_[i].statistics()[0]->on_device() != nullptr;
    plan_values(data.bricks, on_device ? channel.even_bricks.size() : bricks, brick_bytes, fill);
    if (on_device) plan_device_bricks(channel, fields_[i], data.bricks);
  }
}

std::uint64_t channel_bytes(grid::Channel channel, std::size_t cells) {
  switch (channel) {
    case grid::Channel::emission:
      return cells * sizeof(grid::EmissionRecord);
    case grid::Channel::color:
      return cells * sizeof(std::uint32_t);
    case grid::Channel::anisotropy:
      return cells * sizeof(std::int16_t);
    case grid::Channel::velocity:
      break;
  }
  return cells * sizeof(glm::uvec2);
}

std::uint64_t building_bytes_per_cell(bool emits) {
  // A tree with n leaves has fewer than n inner cells.
  return 2 * tree_cell_bytes + (emits ? glowing_words * sizeof(std::uint32_t) : 0);
}

std::uint64_t building_bytes_at_least() { return clear_bytes; }

std::uint64_t BuiltGrid::bytes() const {
  if (grid) return 0;
  std::uint64_t bytes = std::uint64_t{count} * (sizeof(grid::CellRecord) + 4) + 28 * sizeof(std::uint32_t);
  for (std::size_t i = 0; i < channels.size(); ++i) {
    if (channels[i]) bytes += channel_bytes(static_cast<grid::Channel>(i), count);
  }
  return bytes;
}

double GridPace::ms(const gl::ProgramKey& key, double cost) const {
  const auto known = known_.find(key);
  return known == known_.end() ? cost : known->second;
}

void GridPace::learn(const std::vector<Sent>& sent, double ms, Measured measured) {
  double expected = 0.0;
  bool first = false;
  for (const Sent& s : sent) {
    expected += this->ms(s.key, s.cost) * s.weight * s.items;
    first = known_.try_emplace(s.key, s.cost).second || first;
  }
  if (first) return;
  // Late measurements must not slow down the build much.
  const double most = measured == Measured::exactly ? 64.0 : 4.0;
  constexpr double least = 1.0 / 64.0;
  const double step = std::sqrt(std::clamp(ms / std::max(expected, 1e-6), 0.25, 4.0));
  std::set<gl::ProgramKey> known;
  for (const Sent& s : sent) {
    // A dispatch of few items mostly measures its overhead. Several dispatches of a kernel count as one measurement.
    if (s.items < group || !known.insert(s.key).second) continue;
    double& of = known_.at(s.key);
    of = std::clamp(of * step, least * s.cost, most * s.cost);
  }
}

GridBuild::GridBuild(gl::FunctionsPtr gl, gl::ProgramsPtr programs, const gl::Limits& limits, LatticeDataPtr data,
                     std::vector<std::uint8_t> levels, std::uint64_t max_cells, std::uint64_t max_bytes,
                     GridPacePtr pace)
    : gl_(std::move(gl)),
      programs_(std::move(programs)),
      limits_(limits),
      data_(std::move(data)),
      levels_(std::move(levels)),
      max_cells_(static_cast<std::uint32_t>(std::clamp<std::uint64_t>(max_cells, CM_ROOTS, std::uint64_t{1} << 30U))),
      max_bytes_(max_bytes),
      pace_(std::move(pace)),
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
  deadline_ = deadline;
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

double GridBuild::aim_ms() const {
  constexpr double least = 0.5;
  constexpr double most = 2.0;
  const auto now = std::chrono::steady_clock::now();
  return now < deadline_ ? std::clamp(part_of_rest * milliseconds(deadline_ - now), least, most) : least;
}

bool GridBuild::has_room_in_flight() {
  if (in_flight_ms_ < max_in_flight_ms) return true;
  if (!fence_.passed()) return false;
  pace_->learn(in_flight_, milliseconds(std::chrono::steady_clock::now() - sent_), GridPace::Measured::at_most);
  in_flight_.clear();
  in_flight_ms_ = 0.0;
  return true;
}

std::optional<std::uint32_t> GridBuild::dispatch(const Pass& pass, std::uint32_t first, std::uint32_t end,
                                                 const Bind& bind) {
  if (!has_room_in_flight()) return std::nullopt;
  const gl::Program& program = programs_->ask(pass.key);
  if (!program.usable()) return std::nullopt;
  constexpr std::uint32_t max_groups = 65535;  // supported by every driver
  const double ms = pass.weight * pace_->ms(pass.key, pass.cost * cost_ms(*gl_));
  const double fit = std::clamp(aim_ms() / ms, double{group}, double{max_groups} * (pass.item_a_group ? 1.0 : group));
  const std::uint32_t items = std::min(static_cast<std::uint32_t>(fit), end - first);
  const gl::DebugGroup debug(*gl_, "cumulet: grid");
  gl_->ProgramUniform1ui(program.name(), 0, first);
  gl_->ProgramUniform1ui(program.name(), 1, first + items);
  if (pass.of_lattice) gl_->ProgramUniform1ui(program.name(), 2, static_cast<GLuint>(data_->lattice().cube.log2_size));
  bind(program.name());
  program.use(*gl_);
  const auto begun = std::chrono::steady_clock::now();
  gl_->DispatchCompute(pass.item_a_group ? items : (items + group - 1) / group, 1, 1);
  gl::memory_barrier(*gl_, GL_SHADER_STORAGE_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT);
  const GridPace::Sent sent{pass.key, pass.cost * cost_ms(*gl_), static_cast<double>(items), pass.weight};
  if (gl_->dispatches_in_call) {
    pace_->learn({sent}, milliseconds(std::chrono::steady_clock::now() - begun), GridPace::Measured::exactly);
    return first + items;
  }
  if (in_flight_.empty()) sent_ = begun;
  in_flight_.push_back(sent);
  in_flight_ms_ += ms * items;
  if (in_flight_ms_ >= max_in_flight_ms) fence_ = gl::Fence(gl_);
  return first + items;
}

void GridBuild::plan_pass(Upload& upload, const Pass& pass, std::uint32_t first, std::uint32_t end, const Bind& bind) {
  if (first == end) return;  // an empty pass would still cost a step
  upload.add_until([this, pass, next = first, end, bind]() mutable {
    while (next < end) {
      const std::optional<std::uint32_t> left = dispatch(pass, next, end, bind);
      if (!left) return false;
      next = *left;
      if (std::chrono::steady_clock::now() >= deadline_) break;
    }
    return next >= end;
  });
}

void GridBuild::plan_read_back(Upload& upload) {
  upload.add([this] {
    if (!read_back_) read_back_ = gl::ReadBack(gl_, sizeof(core::CmGridState), "creating the read-back of a grid");
    gl_->CopyNamedBufferSubData(data_->state_.name(), read_back_.name(), 0, 0, sizeof(core::CmGridState));
    gl::memory_barrier(*gl_, GL_CLIENT_MAPPED_BUFFER_BARRIER_BIT);
    fence_ = gl::Fence(gl_);
    in_flight_.clear();
    in_flight_ms_ = 0.0;
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
  plan_pass(decision_, {lattice_key(0), 512, true}, 0, static_cast<std::uint32_t>(l.own.nodes.size()), bind);
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
  std::uint64_t needs = std::max(count * tree_cell_bytes, clear_bytes);
  for (const grid::LatticeChannel& channel : data_->lattice().channels) {
    needs += channel_bytes(channel.channel, built_.count);
    if (channel.channel == grid::Channel::emission) needs += std::uint64_t{built_.count} * glowing_words * 4;
  }
  require_room(needs + built_.bytes());
  cells_.emplace(gl_, "building the grid");
  cells_->add([this, count] {
    tree_cells_ = make_storage(std::uint64_t{count} * sizeof(TreeCell), "creating the tree's cells");
    links_ = make_storage(std::uint64_t{count} * sizeof(glm::uvec4), "creating the tree's links");
    below_ = make_storage(std::uint64_t{count} * sizeof(glm::uvec2), "creating the child data of the tree");
    list_ = make_storage(std::uint64_t{count} * sizeof(std::uint32_t), "creating the list of the tree's cells");
  });
  cells_->add([this] {
    built_.cells = make_storage(std::uint64_t{built_.count} * sizeof(grid::CellRecord), "creating the cell data");
    built_.tree = make_storage((roots_words + built_.count - CM_ROOTS) * 4, "creating the point-location tree");
  });
  cells_->add([this] {
    std::array<TreeCell, CM_ROOTS> cells{};
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
    bytes_ -= count * tree_cell_bytes;
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

void GridBuild::plan_leaves(const Pass& coarse, const Pass& fine, const Bind& bind) {
  // All cells of a level have the same size.
  std::uint32_t shape = grid::root_cells(data_->lattice().cube.log2_size)[0].shape;
  std::uint32_t begin = tree_levels_.back().splits_end;
  for (const Level& level : tree_levels_) {
    Pass pass = coarse;
    if (core::cm_is_fine(shape)) {
      pass = fine;
      const std::uint32_t fine_level = core::cm_fine_level(shape);
      pass.weight += parts_weight * (grid::parts_of_levels[fine_level + 1] - grid::parts_of_levels[fine_level]);
    }
    plan_pass(*cells_, pass, begin, begin + level.leaves(), bind);
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
    gl_->ProgramUniform1i(program, 4, data_->lattice().cells == grid::CellKind::linear ? 1 : 0);
  };
  const auto key = [this](const char* size) {
    return gl::ProgramKey{"grid_records.comp", {size, data_->lattice().halves ? "CM_HALVES 1" : "CM_HALVES 0"}};
  };
  plan_leaves({key("CM_FINE 0"), 32}, {key("CM_FINE 1"), 32}, bind);
}

void GridBuild::plan_clear_cones() {
  cells_->add([this] { clear_ = make_storage(clear_bytes, "creating the empty-space cones"); });
  plan_clear(*cells_, clear_, full_bytes);
  const auto bind = [this](GLuint /*program*/) {
    bind_storage({{core::CM_STORAGE_GRID_STATE, &data_->state_},
                  {core::CM_STORAGE_GRID_RECORDS, &built_.cells},
                  {core::CM_STORAGE_GRID_CLEAR, &clear_}});
  };
  const auto key = [](int stage) { return gl::ProgramKey{"grid_clear.comp", {"CM_STAGE " + std::to_string(stage)}}; };
  plan_pass(*cells_, {key(0), 8}, 0, built_.count, bind);
  plan_pass(*cells_, {key(1), 4096, true}, 0, CM_CLEAR_CONES, bind);
  plan_pass(*cells_, {key(2), 8}, 0, CM_CLEAR_CUBES, bind);
  plan_pass(*cells_, {key(3), 8}, 0, built_.count, bind);
}

void GridBuild::plan_channels() {
  for (std::size_t i = 0; i < data_->lattice().channels.size(); ++i) plan_channel(i);
  const gl::Object& emission = built_.channels[static_cast<std::size_t>(grid::Channel::emission)];
  if (std::ranges::none_of(data_->lattice().channels,
                           [](const auto& channel) { return channel.channel == grid::Channel::emission; }))
    return;
  cells_->add([this] {
    glowing_ = make_storage(std::uint64_t{built_.count} * glowing_words * 4, "creating the list of emissive cells");
  });
  const auto bind = [this, &emission](GLuint /*program*/) {
    bind_storage({{core::CM_STORAGE_GRID_STATE, &data_->state_},
                  {core::CM_STORAGE_GRID_RECORDS, &built_.cells},
                  {core::CM_STORAGE_GRID_CHANNEL, &emission},
                  {core::CM_STORAGE_GRID_GLOWING, &glowing_}});
  };
  plan_pass(*cells_, {{"grid_emissive.comp", {}}, 2, false, false}, 0, built_.count, bind);
}

void GridBuild::plan_channel(std::size_t index) {
  const grid::LatticeChannel& channel = data_->lattice().channels[index];
  gl::Object& records = built_.channels[static_cast<std::size_t>(channel.channel)];
  const std::uint64_t bytes = (channel_bytes(channel.channel, built_.count) + 3) / 4 * 4;
  cells_->add([this, &records, bytes] { records = make_storage(bytes, "creating a channel's cell data"); });
  // Two cells share a word.
  if (channel.channel == grid::Channel::anisotropy) plan_clear(*cells_, records, bytes);
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
      gl_->ProgramUniform1i(program, 3, data_->lattice().cells == grid::CellKind::linear ? 1 : 0);
    if (channel.channel == grid::Channel::velocity) gl_->ProgramUniform1f(program, 3, channel.fastest);
  };
  const Pass pass{{"grid_channels.comp", {"CM_CHANNEL " + std::to_string(static_cast<int>(channel.channel))}}, 32};
  plan_leaves(pass, pass, bind);
}

void GridBuild::plan_emissive() {
  emissive_.emplace(gl_, "reading the emissive cells");
  if (state_.glowing == 0) return;
  const std::size_t bytes = std::size_t{state_.glowing} * glowing_words * 4;
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

namespace {

// Runs `work` on a detached thread; its failures become Errors.
template <class Made, class Work>
std::future<Made> make_detached(const char* what, Work work) {
  const auto task = std::make_shared<std::packaged_task<Made()>>([what, work = std::move(work)] {
    try {
      return work();
    } catch (...) {
      throw caught(what);
    }
  });
  std::future<Made> made = task->get_future();
  run_detached([task] { (*task)(); });
  return made;
}

}  // namespace

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
    plan_pass(*cells_, {cells_key(0), 8}, level.cells_begin, level.cells_end, bind_splits);
    plan_pass(*cells_, {cells_key(1), 16}, level.splits_begin, level.splits_end, bind);
  }
  for (std::size_t i = tree_levels_.size(); i-- > 0;)
    plan_pass(*cells_, {cells_key(2), 2}, tree_levels_[i].splits_begin, tree_levels_[i].splits_end, bind);
  plan_pass(*cells_, {cells_key(3), 1, true}, 0, 1, bind);
  for (const Level& level : tree_levels_)
    plan_pass(*cells_, {cells_key(4), 4}, level.splits_begin, level.splits_end, bind);
}

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
    upload_.reset();
    under_way_.reset();
    on_cpu_.reset();
    clear_built();
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

void GridBuilds::clear() {
  clear_built();
  under_way_.reset();
  on_cpu_.reset();
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
