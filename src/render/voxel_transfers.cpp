#include "render/voxel_transfers.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <cstring>
#include <exception>
#include <utility>

#include "base/error.hpp"
#include "base/one_line.hpp"
#include "gl/bindings.hpp"
#include "grid/evaluation.hpp"

namespace cumulet::render {

namespace {

using volume::brick_size;
using volume::brick_voxels;

constexpr int longest_side = 1 << 20;  // limit of all volumes
constexpr std::uint64_t max_bricks = std::uint64_t{1} << 27U;
constexpr const char* what_step = "copying the host's voxels";

[[noreturn]] void refuse(ErrorCode code, const std::string& what, const std::string& cause) {
  throw Error(code, one_line(what + ", " + cause));
}
[[noreturn]] void refuse(const std::string& what, const std::string& cause) {
  refuse(ErrorCode::invalid_argument, what, cause);
}

std::string text(glm::ivec3 v) { return std::to_string(v.x) + "x" + std::to_string(v.y) + "x" + std::to_string(v.z); }

std::size_t bytes_of(VoxelFormat format) {
  return format == VoxelFormat::floats ? 4 : format == VoxelFormat::bytes ? 1 : 2;
}
std::size_t brick_bytes(VoxelFormat format) { return brick_voxels * bytes_of(format); }
/// Bytes of a GPU-resident brick.
std::size_t kept_bytes(VoxelFormat format) { return volume::DeviceMemory::bytes_of(1, format == VoxelFormat::halves); }

// Cells are refined only by density.
BrickSummaries::Field field_of(volume::Channel channel) {
  using Field = BrickSummaries::Field;
  if (channel == volume::Channel::density) return Field::cells;
  return channel >= volume::Channel::anisotropy ? Field::as_is : Field::not_negative;
}

// Returns the bricks of a product that the changed fields affect.
std::vector<glm::ivec3> changed_for(const scene::Product& product, const std::vector<scene::StateInGl::Field>& fields) {
  const std::vector<volume::Channel> made_of = scene::fields_of(product);
  std::vector<glm::ivec3> changed;
  for (const scene::StateInGl::Field& field : fields) {
    if (std::ranges::find(made_of, field.channel) == made_of.end()) continue;
    changed.insert(changed.end(), field.bricks->origins.begin(), field.bricks->origins.end());
    changed.insert(changed.end(), field.bricks->emptied.begin(), field.bricks->emptied.end());
  }
  return changed;
}

glm::ivec3 bricks_of(glm::ivec3 size) { return (size - 1) / brick_size + 1; }

/// Returns the format that holds fetched values exactly.
VoxelFormat format_of(GLint internal) {
  switch (internal) {
    case GL_R8:
    case GL_RG8:
    case GL_RGB8:
    case GL_RGBA8:
      return VoxelFormat::bytes;
    case GL_R16:
    case GL_RG16:
    case GL_RGB16:
    case GL_RGBA16:
      return VoxelFormat::shorts;
    case GL_R16F:
    case GL_RG16F:
    case GL_RGB16F:
    case GL_RGBA16F:
      return VoxelFormat::halves;
    default:
      return VoxelFormat::floats;
  }
}

/// Converts a half by integer operations. Floats in between are never denormal, because a host may have set its threads
/// to flush denormals to 0.
float float_of(std::uint16_t half) {
  constexpr std::uint32_t rebias = 112U << 23U;
  constexpr auto least = std::bit_cast<float>(113U << 23U);  // smallest normal half
  const std::uint32_t bits = std::uint32_t{half} << 13U & 0x0fffe000U;
  const float small = std::bit_cast<float>(bits + rebias + (1U << 23U)) - least;
  const std::uint32_t normal = bits + rebias + (bits >= 0x7c00U << 13U ? rebias : 0U);
  const std::uint32_t magnitude = bits < 0x400U << 13U ? std::bit_cast<std::uint32_t>(small) : normal;
  return std::bit_cast<float>(magnitude | (std::uint32_t{half} & 0x8000U) << 16U);
}

template <class Number, class Convert>
void convert(const std::byte* from, std::span<float, brick_voxels> to, Convert&& number) {
  std::array<Number, brick_voxels> numbers;
  std::memcpy(numbers.data(), from, sizeof numbers);
  std::ranges::transform(numbers, to.begin(), number);
}

void unpack(VoxelFormat format, const std::byte* from, std::span<float, brick_voxels> to) {
  switch (format) {
    case VoxelFormat::floats:
      std::memcpy(to.data(), from, to.size_bytes());
      break;
    case VoxelFormat::halves:
      convert<std::uint16_t>(from, to, float_of);
      break;
    case VoxelFormat::shorts:
      convert<std::uint16_t>(from, to, [](std::uint16_t v) { return static_cast<float>(v) / 65535.0F; });
      break;
    case VoxelFormat::bytes:
      convert<std::uint8_t>(from, to, [](std::uint8_t v) { return static_cast<float>(v) / 255.0F; });
      break;
  }
}

// field: of a transfer, so its voxels are a BrickCopy.
const glm::dmat4& index_to_world_of(const volume::FieldCopy& field) {
  return std::get<volume::BrickCopy>(field.voxels).index_to_world();
}

/// Returns the bricks that the boxes touch.
std::vector<std::uint32_t> touched(const std::vector<VoxelBox>& boxes, glm::ivec3 size) {
  const glm::ivec3 bricks = bricks_of(size);
  std::vector<bool> any(std::size_t(bricks.x) * std::size_t(bricks.y) * std::size_t(bricks.z));
  for (const VoxelBox& box : boxes) {
    const glm::ivec3 low = glm::max(box.min, 0) / brick_size;
    const glm::ivec3 high = glm::min(box.max, size - 1);
    if (glm::any(glm::lessThan(high, glm::max(box.min, 0)))) continue;
    for (int z = low.z; z <= high.z / brick_size; ++z) {
      for (int y = low.y; y <= high.y / brick_size; ++y) {
        const std::size_t row = (std::size_t(z) * std::size_t(bricks.y) + std::size_t(y)) * std::size_t(bricks.x);
        std::fill(any.begin() + std::ptrdiff_t(row) + low.x,
                  any.begin() + std::ptrdiff_t(row) + high.x / brick_size + 1, true);
      }
    }
  }
  std::vector<std::uint32_t> found;
  for (std::size_t i = 0; i < any.size(); ++i) {
    if (any[i]) found.push_back(static_cast<std::uint32_t>(i));
  }
  return found;
}

void require_finite(const volume::DeviceBricks& bricks, volume::Channel channel, const std::string& name) {
  std::size_t bad = 0;
  while (bad < bricks.origins.size() && (bricks.summary(bad).voxels & CM_BRICK_NOT_FINITE) == 0) ++bad;
  if (bad == bricks.origins.size()) return;
  const glm::ivec3 origin = bricks.origins[bad];
  throw Error(ErrorCode::file, one_line(name + ": " + name_of(channel) + ": non-finite value in the 8x8x8 brick at (" +
                                        std::to_string(origin.x) + ", " + std::to_string(origin.y) + ", " +
                                        std::to_string(origin.z) + ")"));
}

}  // namespace

// Reads the list of bricks that glsl/pack_bricks.comp wrote: the filled ones come first.
class VoxelTransfers::PackedBricks {
 public:
  /// Throws Error if there are more filled bricks than `room`.
  PackedBricks(const gl::ReadBack& words, std::uint32_t room, glm::ivec3 size, const std::string& name)
      : words_(words.data()), room_(room), bricks_(bricks_of(size)), filled_(word(0)) {
    if (filled_ > room) throw Error(ErrorCode::gl, one_line(name + ": the driver did not pack the bricks correctly"));
  }
  [[nodiscard]] std::uint32_t filled() const { return filled_; }
  /// Number of bricks including empty ones.
  [[nodiscard]] std::size_t all() const { return std::size_t{filled_} + word(1); }
  [[nodiscard]] glm::ivec3 origin(std::size_t i) const {
    const auto brick = static_cast<int>(word(2 + (i < filled_ ? i : room_ - 1 - (i - filled_))));
    return brick_size * glm::ivec3(brick % bricks_.x, brick / bricks_.x % bricks_.y, brick / bricks_.x / bricks_.y);
  }

 private:
  [[nodiscard]] std::uint32_t word(std::size_t i) const {
    std::uint32_t word = 0;
    std::memcpy(&word, words_ + i * sizeof word, sizeof word);
    return word;
  }
  const std::byte* words_;
  std::uint32_t room_;
  glm::ivec3 bricks_;
  std::uint32_t filled_;
};

VoxelTransfers::VoxelTransfers(gl::FunctionsPtr gl, gl::ProgramsPtr programs, const gl::Limits& limits,
                               DeviceMemoriesPtr memories)
    : gl_(std::move(gl)), programs_(std::move(programs)), memories_(std::move(memories)) {
  constexpr std::int64_t most = std::int64_t{1} << 31U;  // word indices are 32-bit
  max_bytes_ = static_cast<std::uint64_t>(std::min(limits.storage_block_bytes, most));
  GLint alignment = 0;
  gl_->GetIntegerv(GL_SHADER_STORAGE_BUFFER_OFFSET_ALIGNMENT, &alignment);
  alignment_ = static_cast<std::uint64_t>(std::max(alignment, 4));
}

// ---- Checks of the host's objects ----

VoxelTransfers::Source VoxelTransfers::open_texture(const VoxelTexture& texture, const std::string& what) const {
  const auto& gl = *gl_;
  const std::string name = what + ": texture " + std::to_string(texture.name);
  // The target is checked by a binding, as in HostDepth.
  GLint bound = 0;
  if (gl.IsTexture(texture.name) != GL_FALSE) {
    gl.ActiveTexture(GL_TEXTURE0 + core::CM_UNIT_HOST_VOXELS);
    gl.BindTexture(GL_TEXTURE_3D, 0);
    gl.BindTextureUnit(core::CM_UNIT_HOST_VOXELS, texture.name);
    gl.GetIntegerv(GL_TEXTURE_BINDING_3D, &bound);
  }
  if (bound == 0) refuse(name, "is not a GL_TEXTURE_3D of this context's share group");
  const auto level = [&](GLenum parameter) {
    GLint value = 0;
    gl.GetTextureLevelParameteriv(texture.name, 0, parameter, &value);
    return value;
  };
  Source source;
  source.texture = texture.name;
  source.component = texture.component;
  source.size = {level(GL_TEXTURE_WIDTH), level(GL_TEXTURE_HEIGHT), level(GL_TEXTURE_DEPTH)};
  if (glm::any(glm::lessThanEqual(source.size, glm::ivec3(0)))) refuse(name, "has no level 0");
  GLint base = 0;
  gl.GetTextureParameteriv(texture.name, GL_TEXTURE_BASE_LEVEL, &base);
  if (base != 0) refuse(name, "has a base level that is not 0");
  constexpr std::array<std::array<GLenum, 2>, 4> components{{{GL_TEXTURE_RED_SIZE, GL_TEXTURE_RED_TYPE},
                                                             {GL_TEXTURE_GREEN_SIZE, GL_TEXTURE_GREEN_TYPE},
                                                             {GL_TEXTURE_BLUE_SIZE, GL_TEXTURE_BLUE_TYPE},
                                                             {GL_TEXTURE_ALPHA_SIZE, GL_TEXTURE_ALPHA_TYPE}}};
  const auto& [bits, type] = components.at(static_cast<std::size_t>(texture.component));
  if (level(bits) == 0) refuse(name, "has no component " + std::to_string(texture.component));
  const auto kind = static_cast<GLenum>(level(type));
  if (kind != GL_FLOAT && kind != GL_UNSIGNED_NORMALIZED && kind != GL_SIGNED_NORMALIZED)
    refuse(name, "has an integer format");
  source.format = format_of(level(GL_TEXTURE_INTERNAL_FORMAT));
  return source;
}

VoxelTransfers::Source VoxelTransfers::open_buffer(const VoxelBuffer& buffer, const std::string& what) const {
  const auto& gl = *gl_;
  const std::string name = what + ": buffer " + std::to_string(buffer.name);
  if (gl.IsBuffer(buffer.name) == GL_FALSE) refuse(name, "is not a buffer of this context's share group");
  if (glm::any(glm::lessThanEqual(buffer.size, glm::ivec3(0))) ||
      glm::any(glm::greaterThan(buffer.size, glm::ivec3(longest_side))))
    refuse(name, "has voxels of size " + text(buffer.size));
  GLint64 bytes = 0;
  GLint mapped = 0;
  GLint access = 0;
  gl.GetNamedBufferParameteri64v(buffer.name, GL_BUFFER_SIZE, &bytes);
  gl.GetNamedBufferParameteriv(buffer.name, GL_BUFFER_MAPPED, &mapped);
  gl.GetNamedBufferParameteriv(buffer.name, GL_BUFFER_ACCESS_FLAGS, &access);
  if (mapped != 0 && (static_cast<GLbitfield>(access) & GL_MAP_PERSISTENT_BIT) == 0) refuse(name, "is mapped");
  Source source;
  source.buffer = buffer.name;
  source.size = buffer.size;
  source.format = buffer.format;
  source.offset = buffer.offset;
  const std::uint64_t number = bytes_of(buffer.format);
  source.strides = {buffer.strides[0], buffer.strides[1], buffer.strides[2]};
  const glm::u64vec3 size(buffer.size);
  if (source.strides == glm::u64vec3(0)) {
    source.strides = number * glm::u64vec3(1, size.x, size.x * size.y);
  }
  const auto there = static_cast<std::uint64_t>(bytes);
  if (source.offset % number != 0 || source.strides % number != glm::u64vec3(0))
    refuse(name, "has an offset or strides that are not multiples of the component size, " + std::to_string(number) +
                     " bytes");
  // Overlapping voxels could be more than the buffer holds; such strides are rejected.
  const bool more = size.x * size.y > there || size.x * size.y * size.z > there / number;
  const bool beyond = more || source.offset > there || glm::any(glm::greaterThan(source.strides, glm::u64vec3(there)));
  if (beyond || range_of(source, {0, bricks_of(source.size).z}).y > there)
    refuse(name, "has " + std::to_string(there) + " bytes, which is too small for its voxels");
  return source;
}

VoxelTransfers::Source VoxelTransfers::open(const GlVoxels& field, const std::string& what) const {
  const auto* texture = std::get_if<VoxelTexture>(&field.source);
  Source source =
      texture != nullptr ? open_texture(*texture, what) : open_buffer(std::get<VoxelBuffer>(field.source), what);
  const glm::u64vec3 bricks(bricks_of(source.size));
  if (bricks.x * bricks.y * bricks.z > max_bricks)
    refuse(ErrorCode::unsupported, what, "its size of " + text(source.size) + " is more than 2^36 voxels");
  return source;
}

glm::u64vec2 VoxelTransfers::range_of(const Source& source, glm::ivec2 layers) const {
  const glm::u64vec3 last(source.size.x - 1, source.size.y - 1, std::min(brick_size * layers.y, source.size.z) - 1);
  const std::uint64_t first = std::uint64_t{brick_size} * static_cast<std::uint64_t>(layers.x);
  const std::uint64_t begin = source.offset + first * source.strides.z;
  const std::uint64_t end = source.offset + last.x * source.strides.x + last.y * source.strides.y +
                            last.z * source.strides.z + bytes_of(source.format);
  return {begin / alignment_ * alignment_, (end + 3) / 4 * 4};
}

// ---- Packing on the device ----

void VoxelTransfers::plan(Transfer& transfer, std::size_t field, const std::vector<std::uint32_t>* chosen,
                          const std::string& what) const {
  const Source& source = transfer.sources[field];
  const glm::ivec3 bricks = bricks_of(source.size);
  const std::uint64_t layer = std::uint64_t(bricks.x) * std::uint64_t(bricks.y);
  const std::size_t each =
      std::max(brick_bytes(source.format), transfer.gpu_resident() ? kept_bytes(source.format) : 0);
  const auto fits = [&](std::uint64_t count, glm::ivec2 layers) {
    if (count * each > max_bytes_) return false;
    if (source.buffer == 0) return true;
    const glm::u64vec2 range = range_of(source, layers);
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
      refuse(ErrorCode::unsupported, what,
             "a layer of its bricks exceeds the driver's maximum storage block size of " + std::to_string(max_bytes_) +
                 " bytes");
    }
    while (end < bricks.z && fits(before(end + 1) - first, {z, end + 1})) ++end;
    const std::uint64_t count = before(end) - first;
    if (count > 0) {
      Piece& piece = transfer.pieces.emplace_back();
      piece.field = field;
      piece.first = static_cast<std::uint32_t>(first);
      piece.count = static_cast<std::uint32_t>(count);
      piece.layers = {z, end};
    }
    z = end;
  }
}

VoxelTransfers::Room VoxelTransfers::take_room(std::size_t bricks, std::size_t bytes) {
  constexpr std::size_t small = std::size_t{1} << 20U;
  const auto found = std::ranges::find_if(spare_, [&](const Room& room) {
    return room.bricks >= bricks && room.bytes >= bytes && room.bytes <= 2 * bytes + small;
  });
  if (found != spare_.end()) {
    Room room = std::move(*found);
    spare_.erase(found);
    return room;
  }
  Room room;
  room.packed_bricks =
      gl::make_buffer(gl_, packed_bricks_bytes(bricks), nullptr, 0, "creating the index of the host's bricks");
  room.values = gl::make_buffer(gl_, bytes, nullptr, 0, "creating a copy of the host's bricks");
  room.packed_bricks_back =
      gl::ReadBack::unfilled(gl_, packed_bricks_bytes(bricks), "creating the read-back of the host's brick index");
  room.bricks = bricks;
  room.bytes = bytes;
  return room;
}

void VoxelTransfers::make_room_back(Room& room, std::size_t bytes) const {
  if (room.back_bytes >= bytes) return;
  room.values_back = gl::ReadBack::unfilled(gl_, bytes, "creating the read-back of the host's bricks");
  room.back_bytes = bytes;
}

void VoxelTransfers::pack(const Transfer& transfer, const Piece& piece, GLuint chosen) {
  const auto& gl = *gl_;
  const Source& source = transfer.sources[piece.field];
  const gl::Program& program = programs_->get(
      {"pack_bricks.comp",
       {source.buffer != 0 ? "CM_BUFFER 1" : "CM_BUFFER 0", chosen != 0 ? "CM_CHOSEN 1" : "CM_CHOSEN 0"}});
  const GLuint name = program.name();
  gl.ProgramUniform3i(name, 0, source.size.x, source.size.y, source.size.z);
  gl.ProgramUniform2ui(name, 1, piece.first, piece.count);
  gl.ProgramUniform1i(name, 2, static_cast<GLint>(source.format));
  if (source.buffer != 0) {
    const glm::u64vec2 range = range_of(source, piece.layers);
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
  gl.ClearNamedBufferSubData(piece.room.packed_bricks.name(), GL_R32UI, 0, 2 * sizeof(std::uint32_t), GL_RED_INTEGER,
                             GL_UNSIGNED_INT, nullptr);
  gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, core::CM_STORAGE_PACKED_BRICKS, piece.room.packed_bricks.name());
  gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, core::CM_STORAGE_PACKED_VALUES, piece.room.values.name());
  if (chosen != 0) gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, core::CM_STORAGE_PACKED_CHOICE, chosen);
  program.use(gl);
  dispatch_groups(gl, piece.count);
  if (source.buffer == 0) gl.BindSampler(core::CM_UNIT_HOST_VOXELS, 0);
}

gl::Fence VoxelTransfers::fence() const { return gl_->dispatches_in_call ? gl::Fence() : gl::Fence(gl_); }

void VoxelTransfers::begin(const GlState& state, const void* whose, Arrival arrival, Refuse refuse) {
  const auto& gl = *gl_;
  const gl::DebugGroup group(gl, "cumulet: dynamic voxels");
  if (state.wait != nullptr && gl.IsSync(state.wait) == GL_FALSE)
    throw Error(ErrorCode::invalid_argument, one_line(state.name + ": `wait` is not a valid GLsync"));
  Transfer transfer;
  transfer.whose = whose;
  transfer.whole = !state.changed;
  transfer.name = state.name;
  transfer.arrival = std::move(arrival);
  transfer.refuse = std::move(refuse);
  std::vector<gl::Object> choices(state.fields.size());
  for (std::size_t i = 0; i < state.fields.size(); ++i) {
    const GlVoxels& field = state.fields[i];
    const std::string what = state.name + ": " + name_of(field.channel);
    transfer.sources.push_back(open(field, what));
    transfer.fields.push_back({field.channel, volume::BrickCopy(field.index_to_world)});
    if (transfer.whole) {
      plan(transfer, i, nullptr, what);
      continue;
    }
    const std::vector<std::uint32_t> chosen = touched(*state.changed, transfer.sources.back().size);
    plan(transfer, i, &chosen, what);
    if (chosen.empty()) continue;
    choices[i] = gl::make_buffer(gl_, chosen.size() * sizeof(std::uint32_t), chosen.data(), 0,
                                 "creating the list of the host's bricks");
  }
  for (Piece& piece : transfer.pieces) {
    const std::size_t each = brick_bytes(transfer.sources[piece.field].format);
    piece.room = take_room(piece.count, piece.count * each);
    if (transfer.gpu_resident()) continue;
    // A plume grows little from one state to the next.
    const std::size_t expected = piece.room.expected + piece.room.expected / 4;
    piece.copied = std::min<std::size_t>(expected, piece.count);
    make_room_back(piece.room, piece.copied * each);
  }
  // The driver can compile the programs while bricks are packed.
  if (transfer.gpu_resident()) {
    for (const Piece& piece : transfer.pieces) programs_->ask(summaries_of(transfer, piece).program());
  }
  if (state.wait != nullptr) gl.WaitSync(state.wait, 0, GL_TIMEOUT_IGNORED);
  gl::memory_barrier(gl, GL_TEXTURE_FETCH_BARRIER_BIT | GL_SHADER_STORAGE_BARRIER_BIT);
  for (const Piece& piece : transfer.pieces) pack(transfer, piece, choices[piece.field].name());
  // The image barrier makes later stores of the host wait for these reads.
  gl::memory_barrier(gl, GL_BUFFER_UPDATE_BARRIER_BIT | GL_SHADER_STORAGE_BARRIER_BIT |
                             GL_SHADER_IMAGE_ACCESS_BARRIER_BIT | GL_TEXTURE_UPDATE_BARRIER_BIT);
  for (const Piece& piece : transfer.pieces) {
    const Room& room = piece.room;
    gl.CopyNamedBufferSubData(room.packed_bricks.name(), room.packed_bricks_back.name(), 0, 0,
                              static_cast<GLsizeiptr>(packed_bricks_bytes(piece.count)));
    const std::size_t bytes = piece.copied * brick_bytes(transfer.sources[piece.field].format);
    if (bytes > 0)
      gl.CopyNamedBufferSubData(room.values.name(), room.values_back.name(), 0, 0, static_cast<GLsizeiptr>(bytes));
  }
  transfer.fence = fence();
  gl::check(gl, what_step);
  if (transfer.whole) {
    // Superseded transfers are dropped except for the first, so that states arrive however fast they come.
    const auto of_one = [&](const Transfer& other) { return other.whose == whose && !other.makes() && !other.back; };
    auto other = std::ranges::find_if(transfers_, of_one);
    if (other != transfers_.end()) ++other;
    while ((other = std::find_if(other, transfers_.end(), of_one)) != transfers_.end()) other = drop(other);
  }
  transfers_.push_back(std::move(transfer));
}

// ---- Processing in main memory ----

std::optional<VoxelTransfers::Announced> VoxelTransfers::announced(const void* whose) const {
  const auto found = std::find_if(transfers_.rbegin(), transfers_.rend(),
                                  [&](const Transfer& t) { return t.whose == whose && t.whole; });
  if (found == transfers_.rend()) return std::nullopt;
  Announced announced{{}, found->gpu_resident(), index_to_world_of(found->fields[0])};
  for (const volume::FieldCopy& field : found->fields) announced.channels.push_back(field.channel);
  return announced;
}

void VoxelTransfers::bring_back(const void* whose, const std::vector<volume::Channel>& channels, Find find,
                                Arrive arrive, Refuse refuse) {
  Transfer transfer;
  transfer.whose = whose;
  transfer.name = "state";
  for (const volume::Channel channel : channels)
    transfer.fields.push_back({channel, volume::BrickCopy(glm::dmat4(1.0))});
  transfer.arrival = std::move(arrive);
  transfer.refuse = std::move(refuse);
  transfer.back = Return{.find = std::move(find), .state = {}, .memories = {}};
  transfers_.push_back(std::move(transfer));
}

bool VoxelTransfers::take_back(Transfer& transfer, Deadline deadline) {
  Return& back = *transfer.back;
  if (!back.state) {
    const scene::StateInGlPtr there = back.find();
    const auto has = [&](const volume::DeviceBricks* bricks) { return memories_->has(*bricks); };
    if (!there || !std::ranges::all_of(std::as_const(*there).all(), has)) {
      transfer.arrival = Arrive([](const auto& /*fields*/) {});
      return true;
    }
    transfer.fields.clear();
    for (const scene::StateInGl::Field& field : there->fields) {
      auto& memories = back.memories.emplace_back();
      for (const volume::DeviceMemoryPtr& memory : field.bricks->memories) {
        memories.push_back(gl::ReadBack::unfilled(gl_, memory->bytes(), "creating the read-back of the host's bricks"));
        gl_->CopyNamedBufferSubData(memories_->find(*memory)->name(), memories.back().name(), 0, 0,
                                    static_cast<GLsizeiptr>(memory->bytes()));
      }
      volume::BrickCopy copy(there->index_to_world);
      copy.reserve(field.bricks->origins.size() + field.bricks->emptied.size());
      for (const glm::ivec3& origin : field.bricks->emptied) copy.add(origin, std::array<float, brick_voxels>{});
      transfer.fields.push_back({field.channel, std::move(copy)});
    }
    transfer.fence = fence();
    gl::check(*gl_, what_step);
    back.state = there;
  }
  if (!transfer.fence.passed()) return false;
  constexpr std::size_t at_a_time = 256;
  std::array<float, brick_voxels> values{};
  for (; back.field < back.state->fields.size(); ++back.field, back.taken = 0) {
    const volume::DeviceBricks& bricks = *back.state->fields[back.field].bricks;
    auto& copy = std::get<volume::BrickCopy>(transfer.fields[back.field].voxels);
    while (back.taken < bricks.origins.size()) {
      const volume::DeviceBricks::Location& location = bricks.locations[back.taken];
      const VoxelFormat format = bricks.memories[location.memory]->halves ? VoxelFormat::halves : VoxelFormat::floats;
      unpack(format, back.memories[back.field][location.memory].data() + location.brick * brick_bytes(format), values);
      copy.add(bricks.origins[back.taken], values);
      if (++back.taken % at_a_time == 0 && std::chrono::steady_clock::now() > deadline) return false;
    }
  }
  return true;
}

void VoxelTransfers::make_products(const void* whose, std::string name, StayInGl stay) {
  Transfer transfer;
  transfer.whose = whose;
  transfer.whole = false;
  transfer.name = std::move(name);
  transfer.arrival = std::move(stay);
  transfer.refuse = [] {};
  transfer.counted = true;  // there is nothing to transfer
  transfers_.push_back(std::move(transfer));
}

VoxelTransfers::PackedBricks VoxelTransfers::read_packed_bricks(const Transfer& transfer, const Piece& piece) {
  return {piece.room.packed_bricks_back, piece.count, transfer.sources[piece.field].size, transfer.name};
}

void VoxelTransfers::begin_summaries(Transfer& transfer) {
  transfer.brick_tree = make_brick_tree(gl_, grid::brick_edges(index_to_world_of(transfer.fields[0])));
  for (Piece& piece : transfer.pieces) {
    Room& room = piece.room;
    piece.filled = read_packed_bricks(transfer, piece).filled();
    if (piece.filled == 0) continue;
    if (room.summed < piece.filled) {
      const std::size_t with_more = std::min<std::size_t>(piece.filled + piece.filled / 4, piece.count);
      const std::size_t bytes = with_more * sizeof(volume::BrickSummary);
      room.summaries = gl::make_buffer(gl_, bytes, nullptr, 0, "creating the statistics of the host's bricks");
      room.summaries_back =
          gl::ReadBack::unfilled(gl_, bytes, "creating the read-back of the statistics of the host's bricks");
      room.summed = with_more;
    }
    piece.kept = memories_->make(piece.filled, transfer.sources[piece.field].format == VoxelFormat::halves);
  }
}

BrickSummaries VoxelTransfers::summaries_of(const Transfer& transfer, const Piece& piece) const {
  const Source& source = transfer.sources[piece.field];
  return {.format = source.format,
          .field = field_of(transfer.fields[piece.field].channel),
          .packed_bricks = &piece.room.packed_bricks,
          .bricks = glm::uvec3(bricks_of(source.size)),
          .values = &piece.room.values,
          .kept = piece.kept ? memories_->find(*piece.kept) : nullptr,
          .summaries = &piece.room.summaries,
          .tree = &transfer.brick_tree};
}

bool VoxelTransfers::summarize(Transfer& transfer, Deadline deadline) {
  const auto& gl = *gl_;
  for (const Piece& piece : transfer.pieces) {
    if (!programs_->ask(summaries_of(transfer, piece).program()).usable()) return false;
  }
  if (!transfer.brick_tree) begin_summaries(transfer);
  const std::uint32_t a_step = bricks_per_step(gl);
  for (Piece& piece : transfer.pieces) {
    const BrickSummaries work = summaries_of(transfer, piece);
    while (piece.summarized < piece.filled) {
      const std::uint32_t left = piece.filled - piece.summarized;
      const std::uint32_t end = piece.summarized + std::min(left, a_step);
      work.dispatch(gl, programs_->ask(work.program()), piece.summarized, end);
      piece.summarized = end;
      if (std::chrono::steady_clock::now() > deadline) return false;
    }
  }
  gl::memory_barrier(gl, GL_BUFFER_UPDATE_BARRIER_BIT | GL_SHADER_STORAGE_BARRIER_BIT);
  for (const Piece& piece : transfer.pieces) {
    const std::size_t bytes = piece.filled * sizeof(volume::BrickSummary);
    if (bytes > 0)
      gl.CopyNamedBufferSubData(piece.room.summaries.name(), piece.room.summaries_back.name(), 0, 0,
                                static_cast<GLsizeiptr>(bytes));
  }
  transfer.brick_tree = {};
  transfer.fence = fence();
  gl::check(gl, what_step);
  return true;
}

std::vector<scene::StateInGl::Field> VoxelTransfers::take_fields(Transfer& transfer) {
  std::vector<volume::DeviceBricks> made(transfer.fields.size());
  for (Piece& piece : transfer.pieces) {
    volume::DeviceBricks& field = made[piece.field];
    const PackedBricks packed = read_packed_bricks(transfer, piece);
    if (piece.kept) {
      std::memcpy(piece.kept->summaries.data(), piece.room.summaries_back.data(),
                  piece.filled * sizeof(volume::BrickSummary));
      field.memories.push_back(piece.kept);
    }
    for (std::uint32_t i = 0; i < packed.filled(); ++i) {
      field.origins.push_back(packed.origin(i));
      field.locations.push_back({static_cast<std::uint32_t>(field.memories.size() - 1), i});
    }
    for (std::size_t i = packed.filled(); i < packed.all(); ++i) field.emptied.push_back(packed.origin(i));
  }
  std::vector<scene::StateInGl::Field> fields;
  for (std::size_t i = 0; i < made.size(); ++i) {
    const volume::Channel channel = transfer.fields[i].channel;
    require_finite(made[i], channel, transfer.name);
    made[i].drop_empty();
    if (transfer.whole) made[i].tidy();
    made[i].wanted = std::get<StayInGl>(transfer.arrival).values_wanted;
    fields.push_back({channel, std::make_shared<const volume::DeviceBricks>(std::move(made[i]))});
  }
  return fields;
}

void VoxelTransfers::join(Transfer& transfer, std::vector<scene::StateInGl::Field> fields) {
  const StayInGl& stay = std::get<StayInGl>(transfer.arrival);
  Staying& staying = transfer.staying.emplace();
  staying.fields = std::move(fields);
  staying.state = stay.join(staying.fields);
  if (!staying.state) {
    if (!stay.instead) return;
    // The state that it updates is in main memory.
    auto state = std::make_shared<scene::StateInGl>();
    state->name = transfer.name;
    state->fields = std::move(staying.fields);
    state->index_to_world = index_to_world_of(transfer.fields[0]);
    transfer.back = Return{.find = [state] { return state; }, .state = {}, .memories = {}};
    transfer.arrival = Arrive(stay.instead);
    transfer.staying.reset();
    return;
  }
  const auto is_here = [&](const volume::DeviceBricks* bricks) { return memories_->has(*bricks); };
  if (!std::ranges::all_of(std::as_const(*staying.state).all(), is_here)) {
    staying.state.reset();
    if (transfer.makes()) return;
    throw Error(ErrorCode::invalid_argument,
                one_line(transfer.name + ": other fields of it belong to another viewer's context"));
  }
  // The products are computed in main memory then.
  if (stay.values_wanted && stay.values_wanted->asked()) return;
  for (scene::Product& product : staying.state->wanted(stay.wanted())) {
    const scene::ProductInGl* before = staying.state->product(product);
    const std::vector<glm::ivec3> changed = changed_for(product, staying.fields);
    if (before != nullptr && changed.empty()) {
      staying.kept.push_back(*before);
    } else {
      if (!body_) body_.emplace();
      staying.making.emplace_back(gl_, programs_, memories_, *body_, *staying.state, std::move(product),
                                  before != nullptr ? std::optional(changed) : std::nullopt);
    }
  }
}

bool VoxelTransfers::take_in_gl(Transfer& transfer, Deadline deadline) {
  if (!transfer.counted) {
    if (!transfer.fence.passed() || !summarize(transfer, deadline)) return false;
    transfer.counted = true;
  }
  if (!transfer.staying) {
    if (!transfer.fence.passed()) return false;
    join(transfer, take_fields(transfer));
    if (transfer.back) return take_back(transfer, deadline);
  }
  Staying& staying = *transfer.staying;
  try {
    bool all = true;
    for (BrickProducts& products : staying.making) all = products.advance(deadline) && all;
    return all;
  } catch (const Error& error) {
    if (error.code() == ErrorCode::context_lost) throw;
    staying.failure = std::current_exception();
    staying.making.clear();
    return true;
  }
}

bool VoxelTransfers::arrive_in_gl(Transfer& transfer) {
  const StayInGl& stay = std::get<StayInGl>(transfer.arrival);
  Staying& staying = *transfer.staying;
  if (staying.failure && stay.values_wanted) stay.values_wanted->ask();
  // If no product was computed, the state has not changed.
  const bool arrives = staying.state && !(transfer.makes() && staying.making.empty());
  const std::exception_ptr failure = std::exchange(staying.failure, nullptr);
  if (arrives && !stay.arrive(made(staying)) && !transfer.makes()) {
    join(transfer, std::move(staying.fields));
    if (transfer.staying) transfer.staying->failure = failure;
    return false;
  }
  staying.failure = failure;
  if (failure) std::rethrow_exception(failure);
  return true;
}

scene::StateInGl VoxelTransfers::made(Staying& staying) {
  scene::StateInGl& state = *staying.state;
  for (BrickProducts& products : staying.making)
    staying.kept.push_back(products.take(state.product(products.product())));
  state.products = std::move(staying.kept);
  return std::move(state);
}

void VoxelTransfers::copy_rest(Transfer& transfer) const {
  bool copies = false;
  for (Piece& piece : transfer.pieces) {
    Room& room = piece.room;
    const std::size_t filled = read_packed_bricks(transfer, piece).filled();
    room.expected = filled;
    if (filled <= piece.copied) continue;
    const std::size_t each = brick_bytes(transfer.sources[piece.field].format);
    if (room.back_bytes < filled * each) {
      make_room_back(room, std::min<std::size_t>(filled + filled / 4, piece.count) * each);
      piece.copied = 0;
    }
    const auto from = static_cast<GLintptr>(piece.copied * each);
    gl_->CopyNamedBufferSubData(room.values.name(), room.values_back.name(), from, from,
                                static_cast<GLsizeiptr>(filled * each) - from);
    copies = true;
  }
  if (copies) transfer.fence = fence();
  gl::check(*gl_, what_step);
}

bool VoxelTransfers::take(Transfer& transfer, Deadline deadline) {
  if (transfer.back) return take_back(transfer, deadline);
  if (transfer.gpu_resident()) return take_in_gl(transfer, deadline);
  if (!transfer.fence.passed()) return false;
  if (!transfer.counted) {
    copy_rest(transfer);
    transfer.counted = true;
    if (!transfer.fence.passed()) return false;
  }
  constexpr int at_a_time = 256;
  int bricks_since = 0;
  std::array<float, brick_voxels> values{};
  for (Piece& piece : transfer.pieces) {
    const Source& source = transfer.sources[piece.field];
    auto& copy = std::get<volume::BrickCopy>(transfer.fields[piece.field].voxels);
    const PackedBricks packed = read_packed_bricks(transfer, piece);
    if (piece.taken == 0) copy.reserve(copy.count() + packed.all());
    for (; piece.taken < packed.all(); ++piece.taken) {
      if (bricks_since++ == at_a_time) {
        bricks_since = 0;
        if (std::chrono::steady_clock::now() > deadline) return false;
      }
      if (piece.taken >= packed.filled()) {
        values.fill(0.0F);
      } else {
        unpack(source.format, piece.room.values_back.data() + piece.taken * brick_bytes(source.format), values);
      }
      if (!copy.add(packed.origin(piece.taken), values)) transfer.finite = false;
    }
  }
  return true;
}

void VoxelTransfers::recycle(Transfer& transfer) {
  for (Piece& piece : transfer.pieces) spare_.push_back(std::move(piece.room));
  max_pieces_ = std::max(max_pieces_, transfer.pieces.size());
  // Enough for two states: one in flight and one that waits.
  while (spare_.size() > 2 * max_pieces_) spare_.pop_front();
}

VoxelTransfers::Transfers::iterator VoxelTransfers::drop(const Transfers::iterator& transfer) {
  transfer->fence.order();  // another context of the group may have started it
  recycle(*transfer);
  return transfers_.erase(transfer);
}

void VoxelTransfers::refuse_on_top(const Transfer& whole) {
  for (auto other = transfers_.begin(); other != transfers_.end();) {
    if (other->whose != whole.whose) {
      ++other;
      continue;
    }
    if (other->whole) break;
    // Product computations stay, because they use the GPU-resident state.
    other = other->makes() ? std::next(other) : drop(other);
  }
  whole.refuse();
}

void VoxelTransfers::follow(Deadline deadline) {
  constexpr int long_time = 300;
  memories_->collect();
  if (transfers_.empty()) {
    if (++idle_ == long_time) {
      spare_.clear();
      max_pieces_ = 0;
    }
    return;
  }
  idle_ = 0;
  while (!transfers_.empty()) {
    Transfer& first = transfers_.front();
    std::exception_ptr failure;
    try {
      if (!take(first, deadline)) return;
      if (first.gpu_resident()) {
        if (!arrive_in_gl(first)) continue;
      } else {
        if (!first.finite) {
          for (const volume::FieldCopy& field : first.fields) volume::require_finite(field.view(), first.name);
        }
        std::get<Arrive>(first.arrival)(std::move(first.fields));
      }
    } catch (...) {
      failure = std::current_exception();
    }
    Transfer done = std::move(first);
    transfers_.pop_front();
    recycle(done);
    if (failure) {
      // A state whose product failed is valid.
      if (done.whole && !(done.staying && done.staying->failure)) refuse_on_top(done);
      std::rethrow_exception(failure);
    }
    if (std::chrono::steady_clock::now() > deadline) return;
  }
}

std::uint64_t VoxelTransfers::bytes() const {
  std::uint64_t sum = 0;
  for (const Room& room : spare_) sum += room.all_bytes();
  for (const Transfer& transfer : transfers_) {
    for (const Piece& piece : transfer.pieces) sum += piece.room.all_bytes();
    if (!transfer.back || !transfer.back->state) continue;
    for (const scene::StateInGl::Field& field : transfer.back->state->fields) {
      for (const volume::DeviceMemoryPtr& memory : field.bricks->memories) sum += memory->bytes();
    }
  }
  return sum;
}

}  // namespace cumulet::render
