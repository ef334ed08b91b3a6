#include "render/dynamic/host_voxels.hpp"

#include <algorithm>
#include <cstddef>

#include "base/error.hpp"
#include "base/one_line.hpp"
#include "gl/bindings.hpp"
#include "render/dynamic/voxel_formats.hpp"
#include "volume/bricks.hpp"

namespace cumulet::render {

using volume::brick_size;

namespace {

constexpr int longest_side = 1 << 20;  // limit of all volumes
constexpr std::uint64_t max_bricks = std::uint64_t{1} << 27U;

[[noreturn]] void refuse(ErrorCode code, const std::string& what, const std::string& cause) {
  throw Error(code, one_line(what + ", " + cause));
}
[[noreturn]] void refuse(const std::string& what, const std::string& cause) {
  refuse(ErrorCode::invalid_argument, what, cause);
}

std::string text(glm::ivec3 v) { return std::to_string(v.x) + "x" + std::to_string(v.y) + "x" + std::to_string(v.z); }

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

HostVoxels check_texture(const gl::Functions& gl, const VoxelTexture& texture, const std::string& what) {
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
  HostVoxels source;
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

HostVoxels check_buffer(const gl::Functions& gl, const VoxelBuffer& buffer, std::uint64_t alignment,
                        const std::string& what) {
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
  HostVoxels source;
  source.buffer = buffer.name;
  source.size = buffer.size;
  source.format = buffer.format;
  source.offset = buffer.offset;
  source.alignment = alignment;
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
  if (beyond || source.range_of({0, bricks_of(source.size).z}).y > there)
    refuse(name, "has " + std::to_string(there) + " bytes, which is too small for its voxels");
  return source;
}

}  // namespace

HostVoxels check_voxels(const gl::Functions& gl, const GlVoxels& field, std::uint64_t alignment,
                        const std::string& what) {
  const auto* texture = std::get_if<VoxelTexture>(&field.source);
  HostVoxels source = texture != nullptr ? check_texture(gl, *texture, what)
                                         : check_buffer(gl, std::get<VoxelBuffer>(field.source), alignment, what);
  const glm::u64vec3 bricks(bricks_of(source.size));
  if (bricks.x * bricks.y * bricks.z > max_bricks)
    refuse(ErrorCode::unsupported, what, "its size of " + text(source.size) + " is more than 2^36 voxels");
  return source;
}

glm::u64vec2 HostVoxels::range_of(glm::ivec2 layers) const {
  const glm::u64vec3 last(size.x - 1, size.y - 1, std::min(brick_size * layers.y, size.z) - 1);
  const std::uint64_t first = std::uint64_t{brick_size} * static_cast<std::uint64_t>(layers.x);
  const std::uint64_t begin = offset + first * strides.z;
  const std::uint64_t end = offset + last.x * strides.x + last.y * strides.y + last.z * strides.z + bytes_of(format);
  return {begin / alignment * alignment, (end + 3) / 4 * 4};
}

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

}  // namespace cumulet::render
