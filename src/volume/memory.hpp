#pragma once

#include <array>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "volume/volume.hpp"

namespace cumulet::volume {

/// A tile as a tree has it: not clipped to the active voxels, perhaps of the background value, perhaps inactive.
struct SourceTile {
  Tile box;
  bool active;
};

/// Voxels in a box from (0,0,0) on; active are those that are not zero.
struct DenseVoxels {
  std::span<const float> values;  ///< x fastest, then y, then z
  glm::ivec3 size{0};             ///< values.size() is their product
  glm::dmat4 index_to_world{1.0};
};

/// A tree as OpenVDB has it.
struct SparseVoxels {
  std::span<const std::int32_t> brick_origins;  ///< 3 a brick: multiples of 8, no two bricks in one place
  std::span<const float> brick_values;          ///< 512 a brick, z fastest, then y, then x
  std::span<const std::uint64_t> brick_active;  ///< 8 words a brick, word x, bit y * 8 + z; empty: all are active
  std::vector<SourceTile> tiles;                ///< disjoint, not over bricks
  float background = 0.0F;
  glm::dmat4 index_to_world{1.0};
};

/// The same as import_volume for voxels in memory, which are copied; name begins every message. Throws
/// Error(invalid_argument) for spans and sizes that do not agree, else Error(file) as for a file.
ScalarVolume import_dense(const DenseVoxels& voxels, const std::string& name, const Log& log,
                          Progress* progress = nullptr);
ScalarVolume import_sparse(SparseVoxels voxels, const std::string& name, const Log& log, Progress* progress = nullptr);

/// What a field's voxels are; vectors are three fields.
enum class Channel { density, temperature, flame, red, green, blue, anisotropy, velocity_x, velocity_y, velocity_z };
inline constexpr std::size_t channel_count = 10;
const char* name_of(Channel channel);

/// One channel's voxels in memory.
struct MemoryField {
  Channel channel;
  std::variant<DenseVoxels, SparseVoxels> voxels;
};

/// Throws what can be refused without looking at values: Error(invalid_argument) for channels that come twice or lack
/// others, and for spans and sizes that do not agree, Error(file) for transforms, bricks and tiles; name begins the
/// line.
void check_fields(std::span<const MemoryField> fields, const std::string& name);
/// The same of what changes some fields of a state: others need not be there.
void check_update(std::span<const MemoryField> fields, const std::string& name);
/// Throws Error(file) for a value that is not finite, with the field and the voxel. O(values), in parallel.
void require_finite(const MemoryField& field, const std::string& name);

}  // namespace cumulet::volume
