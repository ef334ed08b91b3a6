#pragma once

// Reads voxels that a host has in GL textures or buffers, into main memory or into GPU-resident bricks.

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "gl/programs.hpp"
#include "render/dynamic/brick_packer.hpp"
#include "render/dynamic/device_memories.hpp"
#include "render/dynamic/host_voxels.hpp"
#include "render/dynamic/voxel_transfer.hpp"
#include "render/pacing/upload.hpp"

namespace cumulet::render {

/// Packs the nonempty bricks of a host's voxels on the device at once, and takes them to main memory when they have
/// arrived. Never waits. All calls except the queries need a current context and an active StateGuard.
class VoxelTransfers {
 public:
  /// memories: for bricks that stay GPU-resident.
  VoxelTransfers(gl::FunctionsPtr gl, gl::ProgramsPtr programs, const gl::Limits& limits, DeviceMemoriesPtr memories);
  VoxelTransfers(const VoxelTransfers&) = delete;
  VoxelTransfers& operator=(const VoxelTransfers&) = delete;

  using Arrive = render::Arrive;
  using StayInGl = render::StayInGl;
  using Arrival = std::variant<Arrive, StayInGl>;
  /// Called if a complete state is invalid. Updates of it that were in flight are dropped.
  using Refuse = std::function<void()>;
  /// Starts a transfer. whose: identifies the volume. If several complete states of one volume are in flight, the
  /// oldest and the newest arrive; others are dropped. The caller must have checked channels and transforms. Throws
  /// Error(invalid_argument) for invalid objects, Error(unsupported) beyond the driver's limits, and the errors of GL
  /// allocations; then nothing has changed.
  void begin(const GlState& state, const void* whose, Arrival arrival, Refuse refuse);
  /// Transfers a GPU-resident state to main memory, as a complete state, after the transfers in flight. find: returns
  /// the state at that time; null: nothing is transferred. channels: channels of the state.
  using Find = FindState;
  void bring_back(const void* whose, const std::vector<volume::Channel>& channels, Find find, Arrive arrive,
                  Refuse refuse);
  /// Computes missing products of the state that stay.join returns for no fields, after the transfers in flight.
  /// Nothing arrives if no product is missing or there is no state.
  void make_products(const void* whose, std::string name, StayInGl stay);
  using Announced = VoxelTransfer::Announced;
  /// Returns the newest complete state of a volume in flight; nullopt: there is none.
  [[nodiscard]] std::optional<Announced> announced(const void* whose) const;
  /// True if any transfer is in flight.
  [[nodiscard]] bool busy() const { return !transfers_.empty(); }
  /// Processes transfers that have arrived, until about the deadline. Throws the errors of the callbacks, and
  /// Error(file) for voxels that are not finite. The state is then dropped, with its updates if it is a complete one.
  /// The next call continues.
  void follow(Deadline deadline);
  /// GL memory.
  [[nodiscard]] std::uint64_t bytes() const;

 private:
  // In the order of begin().
  using Transfers = std::deque<VoxelTransferPtr>;
  // Removes a transfer that is not needed any more. Returns the next one.
  Transfers::iterator drop(const Transfers::iterator& transfer);
  // Drops the updates behind a complete state, and calls its refuse().
  void refuse_on_top(const VoxelTransfer::Info& whole);

  TransferContext context_;
  BrickPacker packer_;
  Transfers transfers_;  // they use context_
  int idle_ = 0;         // calls of follow() without transfers
};

}  // namespace cumulet::render
