#pragma once

#include <array>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "volume/volume.hpp"

namespace cumulet::volume {

/// Voxels in a box that begins at (0,0,0); voxels that are not zero are active.
struct DenseVoxels {
  std::span<const float> values;  ///< x fastest, then y, then z
  glm::ivec3 size{0};             ///< values.size() is their product
  glm::dmat4 index_to_world{1.0};
};

/// A tree with the structure of OpenVDB's.
struct SparseVoxels {
  std::span<const std::int32_t> brick_origins;  ///< 3 per brick: multiples of 8, distinct
  std::span<const float> brick_values;          ///< 512 per brick, z fastest, then y, then x
  std::span<const std::uint64_t> brick_active;  ///< 8 words per brick: word x, bit y * 8 + z; empty: all are active
  std::vector<SourceTile> tiles;                ///< disjoint, not overlapping bricks
  float background = 0.0F;
  glm::dmat4 index_to_world{1.0};
};

/// Imports voxels in memory like import_volume; they are copied. name: prefix of every message. Throws
/// Error(invalid_argument) for spans and sizes that do not match, else Error(file) as for a file.
ScalarVolume import_dense(const DenseVoxels& voxels, const std::string& name, const Log& log,
                          Progress* progress = nullptr);
ScalarVolume import_sparse(SparseVoxels voxels, const std::string& name, const Log& log, Progress* progress = nullptr);

/// The meaning of a field's values; vectors are three fields.
enum class Channel { density, temperature, flame, red, green, blue, anisotropy, velocity_x, velocity_y, velocity_z };
inline constexpr std::size_t channel_count = 10;
const char* name_of(Channel channel);

/// The voxels of one channel in memory.
struct MemoryField {
  Channel channel;
  std::variant<DenseVoxels, SparseVoxels> voxels;
};

/// Checks everything that does not require reading values. Throws Error(invalid_argument) for duplicate or missing
/// channels, and for spans and sizes that do not match. Throws Error(file) for invalid transforms, bricks and tiles.
/// name: prefix of the message.
void check_fields(std::span<const MemoryField> fields, const std::string& name);
/// Like check_fields() for an update of some fields of a state: other fields may be missing.
void check_update(std::span<const MemoryField> fields, const std::string& name);
/// Throws Error(file) with the field and the voxel if a value is not finite. O(values), in parallel.
void require_finite(const MemoryField& field, const std::string& name);

}  // namespace cumulet::volume
