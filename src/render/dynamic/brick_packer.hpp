#pragma once

// Packs the nonempty bricks of a host's voxels on the device.

#include <cstddef>
#include <cstdint>
#include <deque>
#include <glm/glm.hpp>
#include <string>
#include <vector>

#include "gl/objects.hpp"
#include "gl/programs.hpp"
#include "render/dynamic/host_voxels.hpp"
#include "volume/device_bricks.hpp"
#include "volume/memory.hpp"
#include "volume/state.hpp"

namespace cumulet::render {

/// Reads the list of bricks that glsl/grid/pack_bricks.comp wrote: the filled ones come first.
class PackedBricks {
 public:
  /// Throws Error if there are more filled bricks than `room`.
  PackedBricks(const gl::ReadBack& words, std::uint32_t room, glm::ivec3 size, const std::string& name);
  [[nodiscard]] std::uint32_t filled() const { return filled_; }
  /// Number of bricks including empty ones.
  [[nodiscard]] std::size_t all() const { return std::size_t{filled_} + word(1); }
  [[nodiscard]] glm::ivec3 origin(std::size_t i) const;

 private:
  [[nodiscard]] std::uint32_t word(std::size_t i) const;

  const std::byte* words_;
  std::uint32_t room_;
  glm::ivec3 bricks_;
  std::uint32_t filled_;
};

/// Buffers for a number of packed bricks, empty ones included.
struct PackBuffers {
  std::size_t bricks = 0;
  std::size_t bytes = 0;  ///< of values
  std::size_t back_bytes = 0;
  gl::Object packed_bricks;
  gl::Object values;
  gl::ReadBack packed_bricks_back;
  gl::ReadBack values_back;
  std::size_t expected = 0;  ///< bricks filled last time
  std::size_t summed = 0;    ///< capacity of the summaries
  gl::Object summaries;
  gl::ReadBack summaries_back;

  /// Makes room for the read-back of values. Its previous content is lost if it grows.
  void make_values_back(const gl::FunctionsPtr& gl, std::size_t bytes);
  /// GL memory.
  [[nodiscard]] std::uint64_t all_bytes() const;
};

/// Layers of bricks of a field that one dispatch packs.
struct PackedPiece {
  std::size_t field = 0;
  std::uint32_t first = 0;  ///< first brick, or index in the list of chosen bricks
  std::uint32_t count = 0;
  glm::ivec2 layers{0};  ///< first, end
  PackBuffers buffers;
  std::size_t copied = 0;  ///< bricks read back before their number was known; 0: they stay GPU-resident
};

/// The packed fields of a state.
struct PackedFields {
  std::string name;                 ///< prefix of error messages
  std::vector<HostVoxels> sources;  ///< per field
  std::vector<gl::Object> chosen;   ///< per field: the bricks to pack; null: all. Only until they are packed
  std::vector<PackedPiece> pieces;
  std::vector<volume::FieldCopy> fields;  ///< BrickCopies without bricks

  /// Throws Error if the driver packed more bricks than there is room for.
  [[nodiscard]] PackedBricks bricks_of(const PackedPiece& piece) const;
  [[nodiscard]] VoxelFormat format_of(const PackedPiece& piece) const { return sources[piece.field].format; }
  [[nodiscard]] const glm::dmat4& index_to_world() const;  ///< of the first field
  [[nodiscard]] std::uint64_t bytes() const;               ///< GL memory
};

/// Packs bricks, and keeps buffers for the next states. All calls except the queries need a current context and an
/// active StateGuard.
class BrickPacker {
 public:
  BrickPacker(gl::FunctionsPtr gl, gl::ProgramsPtr programs, const gl::Limits& limits);

  /// Checks the host's objects and takes buffers. gpu_resident: the bricks are not read back. Throws as
  /// VoxelTransfers::begin().
  [[nodiscard]] PackedFields plan(const GlState& state, bool gpu_resident);
  /// Packs the bricks, and copies their index and the first `copied` bricks of each piece to the read-back. wait: null,
  /// or the device waits for it first.
  void pack(PackedFields& packed, GLsync wait);
  /// Takes buffers back.
  void recycle(PackedFields& packed);
  /// Frees the spare buffers.
  void clear();
  /// GL memory of the spare buffers.
  [[nodiscard]] std::uint64_t bytes() const;

 private:
  // chosen: bricks to pack; null: all.
  void plan(PackedFields& packed, std::size_t field, const std::vector<std::uint32_t>* chosen, std::size_t brick_bytes,
            const std::string& what) const;
  [[nodiscard]] PackBuffers take_buffers(std::size_t bricks, std::size_t bytes);
  void pack(const PackedFields& packed, const PackedPiece& piece);

  gl::FunctionsPtr gl_;
  gl::ProgramsPtr programs_;
  std::uint64_t max_bytes_;
  std::uint64_t alignment_;
  gl::Object sampler_;
  std::deque<PackBuffers> spare_;
  std::size_t max_pieces_ = 0;  // recent maximum per state
};

}  // namespace cumulet::render
