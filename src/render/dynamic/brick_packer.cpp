#include "render/dynamic/brick_packer.hpp"

#include <algorithm>
#include <cstring>
#include <utility>
#include <variant>

#include "base/error.hpp"
#include "base/one_line.hpp"
#include "gl/bindings.hpp"
#include "render/dynamic/brick_kernels.hpp"
#include "render/dynamic/voxel_formats.hpp"
#include "shader_macros.hpp"

namespace cumulet::render {

using volume::brick_size;

namespace {

std::size_t packed_bricks_bytes(std::size_t bricks) { return (2 + bricks) * sizeof(std::uint32_t); }

/// Bytes of a GPU-resident brick.
std::size_t kept_bytes(VoxelFormat format) { return volume::DeviceMemory::bytes_of(1, format == VoxelFormat::halves); }

}  // namespace

PackedBricks::PackedBricks(const gl::ReadBack& words, std::uint32_t room, glm::ivec3 size, const std::string& name)
    : words_(words.data()), room_(room), bricks_(render::bricks_of(size)), filled_(word(0)) {
  if (filled_ > room) throw Error(ErrorCode::gl, one_line(name + ": the driver did not pack the bricks correctly"));
}

glm::ivec3 PackedBricks::origin(std::size_t i) const {
  const auto brick = static_cast<int>(word(2 + (i < filled_ ? i : room_ - 1 - (i - filled_))));
  return brick_size * glm::ivec3(brick % bricks_.x, brick / bricks_.x % bricks_.y, brick / bricks_.x / bricks_.y);
}

std::uint32_t PackedBricks::word(std::size_t i) const {
  std::uint32_t word = 0;
  std::memcpy(&word, words_ + i * sizeof word, sizeof word);
  return word;
}

void PackBuffers::make_values_back(const gl::FunctionsPtr& gl, std::size_t bytes_needed) {
  if (back_bytes >= bytes_needed) return;
  values_back = gl::ReadBack::unfilled(gl, bytes_needed, "creating the read-back of the host's bricks");
  back_bytes = bytes_needed;
}

std::uint64_t PackBuffers::all_bytes() const {
  return 2 * packed_bricks_bytes(bricks) + bytes + back_bytes + 2 * summed * sizeof(volume::BrickSummary);
}

PackedBricks PackedFields::bricks_of(const PackedPiece& piece) const {
  return {piece.buffers.packed_bricks_back, piece.count, sources[piece.field].size, name};
}

const glm::dmat4& PackedFields::index_to_world() const {
  return std::get<volume::BrickCopy>(fields[0].voxels).index_to_world();
}

std::uint64_t PackedFields::bytes() const {
  std::uint64_t sum = 0;
  for (const PackedPiece& piece : pieces) sum += piece.buffers.all_bytes();
  return sum;
}

BrickPacker::BrickPacker(gl::FunctionsPtr gl, gl::ProgramsPtr programs, const gl::Limits& limits)
    : gl_(std::move(gl)), programs_(std::move(programs)) {
  constexpr std::int64_t most = std::int64_t{1} << 31U;  // word indices are 32-bit
  max_bytes_ = static_cast<std::uint64_t>(std::min(limits.storage_block_bytes, most));
  GLint alignment = 0;
  gl_->GetIntegerv(GL_SHADER_STORAGE_BUFFER_OFFSET_ALIGNMENT, &alignment);
  alignment_ = static_cast<std::uint64_t>(std::max(alignment, 4));
}

void BrickPacker::plan(PackedFields& packed, std::size_t field, const std::vector<std::uint32_t>* chosen,
                       std::size_t brick_bytes, const std::string& what) const {
  const HostVoxels& source = packed.sources[field];
  const glm::ivec3 bricks = bricks_of(source.size);
  const std::uint64_t layer = std::uint64_t(bricks.x) * std::uint64_t(bricks.y);
  const auto fits = [&](std::uint64_t count, glm::ivec2 layers) {
    if (count * brick_bytes > max_bytes_) return false;
    if (source.buffer == 0) return true;
    const glm::u64vec2 range = source.range_of(layers);
    return range.y - range.x <= max_bytes_;
  };
  // Returns the number of bricks before this layer.
  const auto before = [&](int z) {
    const std::uint64_t brick = layer * std::uint64_t(z);
    if (chosen == nullptr) return brick;
    return std::uint64_t(std::ranges::lower_bound(*chosen, brick) - chosen->begin());
  };
  for (int z = 0; z < bricks.z;) {
    const std::uint64_t first = before(z);
    int end = z + 1;
    if (!fits(before(end) - first, {z, end})) {
      throw Error(ErrorCode::unsupported,
                  one_line(what + ", a layer of its bricks exceeds the driver's maximum storage block size of " +
                           std::to_string(max_bytes_) + " bytes"));
    }
    while (end < bricks.z && fits(before(end + 1) - first, {z, end + 1})) ++end;
    const std::uint64_t count = before(end) - first;
    if (count > 0) {
      PackedPiece& piece = packed.pieces.emplace_back();
      piece.field = field;
      piece.first = static_cast<std::uint32_t>(first);
      piece.count = static_cast<std::uint32_t>(count);
      piece.layers = {z, end};
    }
    z = end;
  }
}

PackBuffers BrickPacker::take_buffers(std::size_t bricks, std::size_t bytes) {
  constexpr std::size_t small = std::size_t{1} << 20U;
  const auto found = std::ranges::find_if(spare_, [&](const PackBuffers& buffers) {
    return buffers.bricks >= bricks && buffers.bytes >= bytes && buffers.bytes <= 2 * bytes + small;
  });
  if (found != spare_.end()) {
    PackBuffers buffers = std::move(*found);
    spare_.erase(found);
    return buffers;
  }
  PackBuffers buffers;
  buffers.packed_bricks =
      gl::make_buffer(gl_, packed_bricks_bytes(bricks), nullptr, 0, "creating the index of the host's bricks");
  buffers.values = gl::make_buffer(gl_, bytes, nullptr, 0, "creating a copy of the host's bricks");
  buffers.packed_bricks_back =
      gl::ReadBack::unfilled(gl_, packed_bricks_bytes(bricks), "creating the read-back of the host's brick index");
  buffers.bricks = bricks;
  buffers.bytes = bytes;
  return buffers;
}

void BrickPacker::pack(const PackedFields& packed, const PackedPiece& piece) {
  const auto& gl = *gl_;
  const HostVoxels& source = packed.sources[piece.field];
  const GLuint chosen = packed.chosen[piece.field].name();
  const gl::Program& program =
      programs_->get({"pack_bricks.comp", {gl::macros::buffer(source.buffer != 0), gl::macros::chosen(chosen != 0)}});
  const GLuint name = program.name();
  gl.ProgramUniform3i(name, 0, source.size.x, source.size.y, source.size.z);
  gl.ProgramUniform2ui(name, 1, piece.first, piece.count);
  gl.ProgramUniform1i(name, 2, static_cast<GLint>(source.format));
  if (source.buffer != 0) {
    const glm::u64vec2 range = source.range_of(piece.layers);
    const std::uint64_t number = bytes_of(source.format);
    // The offset is modulo 2^32: voxel 0 may lie before the range, but voxels that are read do not.
    const std::uint64_t first =
        source.offset < range.x ? 0 - (range.x - source.offset) / number : (source.offset - range.x) / number;
    const glm::uvec3 strides(source.strides / number);
    gl.ProgramUniform4ui(name, 3, strides.x, strides.y, strides.z, static_cast<std::uint32_t>(first));
    gl.BindBufferRange(GL_SHADER_STORAGE_BUFFER, core::CM_STORAGE_HOST_VOXELS, source.buffer,
                       static_cast<GLintptr>(range.x), static_cast<GLsizeiptr>(range.y - range.x));
  } else {
    if (!sampler_) sampler_ = gl::make_sampler(gl_);
    gl.ProgramUniform1i(name, 3, source.component);
    gl.BindTextureUnit(core::CM_UNIT_HOST_VOXELS, source.texture);
    gl.BindSampler(core::CM_UNIT_HOST_VOXELS, sampler_.name());
  }
  gl.ClearNamedBufferSubData(piece.buffers.packed_bricks.name(), GL_R32UI, 0, 2 * sizeof(std::uint32_t), GL_RED_INTEGER,
                             GL_UNSIGNED_INT, nullptr);
  gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, core::CM_STORAGE_PACKED_BRICKS, piece.buffers.packed_bricks.name());
  gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, core::CM_STORAGE_PACKED_VALUES, piece.buffers.values.name());
  if (chosen != 0) gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, core::CM_STORAGE_PACKED_CHOICE, chosen);
  program.use(gl);
  dispatch_groups(gl, piece.count);
  if (source.buffer == 0) gl.BindSampler(core::CM_UNIT_HOST_VOXELS, 0);
}

PackedFields BrickPacker::plan(const GlState& state, bool gpu_resident) {
  PackedFields packed;
  packed.name = state.name;
  packed.chosen.resize(state.fields.size());
  for (std::size_t i = 0; i < state.fields.size(); ++i) {
    const GlVoxels& field = state.fields[i];
    const std::string what = state.name + ": " + name_of(field.channel);
    const HostVoxels& source = packed.sources.emplace_back(check_voxels(*gl_, field, alignment_, what));
    packed.fields.push_back({field.channel, volume::BrickCopy(field.index_to_world)});
    const std::size_t each = std::max(brick_bytes(source.format), gpu_resident ? kept_bytes(source.format) : 0);
    if (!state.changed) {
      plan(packed, i, nullptr, each, what);
      continue;
    }
    const std::vector<std::uint32_t> chosen = touched(*state.changed, source.size);
    plan(packed, i, &chosen, each, what);
    if (chosen.empty()) continue;
    packed.chosen[i] = gl::make_buffer(gl_, chosen.size() * sizeof(std::uint32_t), chosen.data(), 0,
                                       "creating the list of the host's bricks");
  }
  for (PackedPiece& piece : packed.pieces) {
    const std::size_t each = brick_bytes(packed.format_of(piece));
    piece.buffers = take_buffers(piece.count, piece.count * each);
    if (gpu_resident) continue;
    // A plume grows little from one state to the next.
    const std::size_t expected = piece.buffers.expected + piece.buffers.expected / 4;
    piece.copied = std::min<std::size_t>(expected, piece.count);
    piece.buffers.make_values_back(gl_, piece.copied * each);
  }
  return packed;
}

void BrickPacker::pack(PackedFields& packed, GLsync wait) {
  const auto& gl = *gl_;
  if (wait != nullptr) gl.WaitSync(wait, 0, GL_TIMEOUT_IGNORED);
  gl::memory_barrier(gl, GL_TEXTURE_FETCH_BARRIER_BIT | GL_SHADER_STORAGE_BARRIER_BIT);
  for (const PackedPiece& piece : packed.pieces) pack(packed, piece);
  packed.chosen.clear();
  // The image barrier makes later stores of the host wait for these reads.
  gl::memory_barrier(gl, GL_BUFFER_UPDATE_BARRIER_BIT | GL_SHADER_STORAGE_BARRIER_BIT |
                             GL_SHADER_IMAGE_ACCESS_BARRIER_BIT | GL_TEXTURE_UPDATE_BARRIER_BIT);
  for (const PackedPiece& piece : packed.pieces) {
    const PackBuffers& buffers = piece.buffers;
    gl.CopyNamedBufferSubData(buffers.packed_bricks.name(), buffers.packed_bricks_back.name(), 0, 0,
                              static_cast<GLsizeiptr>(packed_bricks_bytes(piece.count)));
    const std::size_t bytes = piece.copied * brick_bytes(packed.format_of(piece));
    if (bytes > 0)
      gl.CopyNamedBufferSubData(buffers.values.name(), buffers.values_back.name(), 0, 0,
                                static_cast<GLsizeiptr>(bytes));
  }
}

void BrickPacker::recycle(PackedFields& packed) {
  for (PackedPiece& piece : packed.pieces) spare_.push_back(std::move(piece.buffers));
  max_pieces_ = std::max(max_pieces_, packed.pieces.size());
  // Enough for two states: one in flight and one that waits.
  while (spare_.size() > 2 * max_pieces_) spare_.pop_front();
}

void BrickPacker::clear() {
  spare_.clear();
  max_pieces_ = 0;
}

std::uint64_t BrickPacker::bytes() const {
  std::uint64_t sum = 0;
  for (const PackBuffers& buffers : spare_) sum += buffers.all_bytes();
  return sum;
}

}  // namespace cumulet::render
