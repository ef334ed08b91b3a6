#include "render/grid/lattice_upload.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <string>
#include <utility>

#include "base/error.hpp"
#include "gl/bindings.hpp"
#include "grid/brick_voxels.hpp"
#include "grid/cell.hpp"
#include "grid/evaluation.hpp"
#include "shader_macros.hpp"
#include "volume/brick_values.hpp"
#include "volume/bricks.hpp"

namespace cumulet::render {

namespace {

using BrickPointWords = std::array<std::uint32_t, (CM_BRICK_POINTS + 3) / 4 * 4>;
BrickPointWords brick_point_words() {
  BrickPointWords words{};
  std::ranges::transform(grid::brick_points(), words.begin(),
                         [](const glm::u8vec3& p) { return std::uint32_t{p.x} | (p.y << 4U) | (p.z << 8U); });
  return words;
}

}  // namespace

void require_block(const gl::Limits& limits, std::uint64_t bytes, const char* what) {
  if (bytes <= static_cast<std::uint64_t>(limits.storage_block_bytes)) return;
  throw Error(ErrorCode::unsupported, std::string(what) + " needs a storage block of " + std::to_string(bytes) +
                                          " bytes; this driver's GL_MAX_SHADER_STORAGE_BLOCK_SIZE is " +
                                          std::to_string(limits.storage_block_bytes));
}

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
  const grid::CellParts& parts = grid::cell_parts(l.cube.interpolation);
  plan_buffer(data_->parts_, parts.size() * sizeof(grid::CellPart), parts.parts.data(), "creating the cell parts");
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
  const std::size_t brick_bytes = l.brick_voxels() * (l.halves ? sizeof(std::uint16_t) : sizeof(float));
  const auto fill = [this, &l, brick_bytes](std::size_t brick, std::byte* to) {
    const std::vector<std::uint32_t>& nodes = statistics_->nodes_of_size(3);
    std::vector<float> values(l.brick_voxels());
    if (brick < l.even_bricks.size()) {
      std::ranges::fill(values, l.even_bricks[brick]);
    } else {
      grid::BrickVoxels voxels;
      voxels.look_up(*statistics_, statistics_->nodes()[nodes[brick - l.even_bricks.size()]].corner);
      for (std::size_t i = 0; i < values.size(); ++i) values[i] = voxels[static_cast<int>(i)];
    }
    if (l.halves) {
      std::vector<std::uint16_t> halves(values.size());
      std::ranges::transform(values, halves.begin(), [](float value) { return volume::exact_half(value).value_or(0); });
      std::memcpy(to, halves.data(), brick_bytes);
    } else {
      std::memcpy(to, values.data(), brick_bytes);
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
                           {gl::macros::channel(fields.channel()), gl::macros::fields(bricks.size())}};
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
                           {gl::macros::halves(of_density && l.halves), gl::macros::criterion(measure.criterion)}};
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
      std::vector<float> numbers(channel.brick_voxels * channel.numbers);
      if (brick < channel.even_bricks.size()) {
        for (std::size_t n = 0; n < numbers.size(); ++n) numbers[n] = channel.even_bricks[brick][n % channel.numbers];
      } else {
        fields.fill(channel.bricks[brick - channel.even_bricks.size()], numbers);
      }
      std::memcpy(to, numbers.data(), numbers.size() * sizeof(float));
    };
    const std::size_t bricks = channel.even_bricks.size() + channel.bricks.size();
    const std::size_t brick_bytes = channel.brick_voxels * channel.numbers * sizeof(float);
    plan_buffer(data.bricks, bricks * brick_bytes, nullptr, "creating a channel's brick values");
    const bool on_device = fields_[i].statistics()[0]->on_device() != nullptr;
    plan_values(data.bricks, on_device ? channel.even_bricks.size() : bricks, brick_bytes, fill);
    if (on_device) plan_device_bricks(channel, fields_[i], data.bricks);
  }
}

}  // namespace cumulet::render
