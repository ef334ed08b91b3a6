#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <memory>
#include <utility>
#include <vector>

#include "base/shared_code.hpp"
#include "gl/objects.hpp"
#include "gl/programs.hpp"
#include "grid/lattice.hpp"
#include "render/dynamic/brick_kernels.hpp"
#include "render/dynamic/brick_moves.hpp"
#include "render/dynamic/device_memories.hpp"
#include "render/pacing/upload.hpp"

namespace cumulet::core {
#include "grid/grid_state.glsl"
}  // namespace cumulet::core

namespace cumulet::render {

/// Throws Error(unsupported) if the driver's storage blocks are smaller. what: names the buffer.
void require_block(const gl::Limits& limits, std::uint64_t bytes, const char* what);

/// A refinement lattice in GL: the input from which grids of any view are built, and the buffers for refinement
/// decisions. Only one build may use it at a time.
class LatticeData {
 public:
  [[nodiscard]] const grid::Lattice& lattice() const { return *lattice_; }
  /// GL memory.
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }

 private:
  friend class LatticeUpload;
  friend class GridBuild;
  grid::LatticePtr lattice_;
  gl::Object nodes_, own_, blocks_, entries_, coarse_, bricks_;
  struct Channel {
    gl::Object entries, coarse, bricks;
  };
  std::vector<Channel> channels_;  // as in the lattice
  gl::Object points_, parts_;      // uniform buffers
  gl::Object priorities_, bins_, state_;
  std::uint64_t bytes_ = 0;
};
using LatticeDataPtr = std::shared_ptr<const LatticeData>;

/// Uploads a lattice in steps. All calls need a current context and an active StateGuard.
class LatticeUpload {
 public:
  /// Allocates nothing yet. statistics, channels: those that the lattice was made of; they are held until the last step
  /// is done. Values of GPU-resident bricks are copied on the GPU, and their priorities are computed there. Throws
  /// Error(unsupported) if a limit of the driver is exceeded, which the message names, or if `memories` does not hold
  /// the bricks.
  LatticeUpload(const gl::FunctionsPtr& gl, gl::ProgramsPtr programs, const gl::Limits& limits,
                grid::LatticePtr lattice, std::shared_ptr<const grid::Statistics> statistics,
                grid::Channels channels = {}, DeviceMemoriesPtr memories = nullptr);
  LatticeUpload(const LatticeUpload&) = delete;
  LatticeUpload& operator=(const LatticeUpload&) = delete;
  /// Returns and throws as Upload::advance().
  bool advance(Deadline deadline) { return upload_.advance(deadline); }
  [[nodiscard]] double progress() const { return upload_.progress(); }
  /// GL memory of the complete data.
  [[nodiscard]] std::uint64_t bytes() const { return data_->bytes(); }
  [[nodiscard]] const grid::LatticePtr& lattice() const { return data_->lattice_; }
  /// Only after advance() returned true.
  LatticeDataPtr take() { return std::move(data_); }

 private:
  void plan_buffer(gl::Object& buffer, std::uint64_t bytes, const void* from, const char* what);
  void plan_bytes(const gl::Object& buffer, std::uint64_t bytes, const void* from);
  void plan_bricks();
  void plan_device_bricks();
  void plan_device_bricks(const grid::LatticeChannel& channel, const grid::ChannelFields& fields, const gl::Object& to);
  void plan_priorities();
  void plan_priorities(const grid::Statistics& field, const grid::BricksToRate::Field& rated);
  // list: per brick its node number, and the index of its values.
  void plan_priorities(const std::vector<glm::uvec2>& list, bool of_density, const grid::OwnMeasure& measure);
  void plan_channels();
  // Plans the upload of complete bricks. fill: writes the values of a brick to the given address.
  using FillBrick = std::function<void(std::size_t brick, std::byte* to)>;
  void plan_values(const gl::Object& buffer, std::size_t bricks, std::size_t brick_bytes, const FillBrick& fill);

  // Temporary buffers of the steps.
  struct Scratch {
    gl::Object to_rate, values;  // of one field at a time
    gl::Object lit, tree, points;
  };

  gl::FunctionsPtr gl_;
  gl::ProgramsPtr programs_;
  gl::Limits limits_;
  DeviceMemoriesPtr memories_;
  Scratch scratch_;
  std::shared_ptr<const grid::Statistics> statistics_;
  grid::Channels channels_;
  std::vector<grid::ChannelFields> fields_;
  std::shared_ptr<LatticeData> data_;
  BrickMoves moves_;
  Upload upload_;  // its steps use the members above
};

}  // namespace cumulet::render
