#pragma once

// Voxels that a host has in GL textures or buffers.

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "gl/objects.hpp"
#include "render/dynamic/brick_kernels.hpp"
#include "volume/memory.hpp"

namespace cumulet::render {

/// One component of a GL_TEXTURE_3D.
struct VoxelTexture {
  GLuint name = 0;
  int component = 0;
};

/// Voxels in a buffer.
struct VoxelBuffer {
  GLuint name = 0;
  VoxelFormat format = VoxelFormat::floats;
  std::uint64_t offset = 0;                   ///< byte offset of voxel 0
  std::array<std::uint64_t, 3> strides = {};  ///< bytes along x, y and z; all zero: tightly packed, x fastest
  glm::ivec3 size{0};
};

struct GlVoxels {
  volume::Channel channel;
  std::variant<VoxelTexture, VoxelBuffer> source;
  glm::dmat4 index_to_world{1.0};
};

/// Both ends inclusive.
struct VoxelBox {
  glm::ivec3 min{0};
  glm::ivec3 max{0};
};

struct GlState {
  std::string name;  ///< prefix of every error message
  std::vector<GlVoxels> fields;
  std::optional<std::vector<VoxelBox>> changed;  ///< nullopt: all of it
  GLsync wait = nullptr;                         ///< the device waits for it first
};

/// A texture or buffer of the host that has been checked.
struct HostVoxels {
  GLuint texture = 0;
  int component = 0;
  GLuint buffer = 0;
  std::uint64_t offset = 0;
  glm::u64vec3 strides{0};
  glm::ivec3 size{0};
  VoxelFormat format = VoxelFormat::floats;
  std::uint64_t alignment = 4;  ///< of byte offsets that the driver can bind

  /// Returns the byte range of these layers of bricks (first, end) in the buffer: begin, end.
  [[nodiscard]] glm::u64vec2 range_of(glm::ivec2 layers) const;
};

/// Checks the host's object. alignment: of byte offsets that the driver can bind. what: prefix of error messages.
/// Throws Error(invalid_argument) if it is not valid, and Error(unsupported) if it has too many voxels.
[[nodiscard]] HostVoxels check_voxels(const gl::Functions& gl, const GlVoxels& field, std::uint64_t alignment,
                                      const std::string& what);
/// Returns the bricks that the boxes touch, in the order of their numbers.
[[nodiscard]] std::vector<std::uint32_t> touched(const std::vector<VoxelBox>& boxes, glm::ivec3 size);

}  // namespace cumulet::render
