#pragma once

// The interface of transfers, which bring voxels of a dynamic volume to main memory or keep them in GL.

#include <cstdint>
#include <exception>
#include <functional>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "gl/objects.hpp"
#include "gl/programs.hpp"
#include "light/black_body.hpp"
#include "render/dynamic/brick_packer.hpp"
#include "render/dynamic/device_memories.hpp"
#include "render/pacing/upload.hpp"
#include "scene/state_in_gl.hpp"
#include "volume/memory.hpp"
#include "volume/state.hpp"

namespace cumulet::render {

/// Receives the fields as copies of bricks. For an update, empty bricks are included as zeros.
using Arrive = std::function<void(std::vector<volume::FieldCopy> fields)>;
/// The fields stay GPU-resident.
struct StayInGl {
  /// Combines the transferred fields, given in their order, into a new state, including the products of the state
  /// that it updates. Returns nullopt if that state is no longer on the GPU. Bricks of an update are not yet sorted
  /// and merged.
  std::function<std::optional<scene::StateInGl>(const std::vector<scene::StateInGl::Field>& fields)> join;
  /// Returns the settings for which emission is needed.
  std::function<std::vector<scene::Emission>()> wanted;
  /// Receives the state with exactly the needed products. Returns false if the state that it updates has changed in
  /// the meantime; the fields are joined again then.
  std::function<bool(scene::StateInGl state)> arrive;
  /// Receives an update in main memory if the state that it updates is there; null: the update is dropped.
  Arrive instead;
  volume::ValuesWantedPtr values_wanted;  ///< for the values of its bricks; null: they are never requested
};
/// Returns the GPU-resident state at the time of the call; null: there is none.
using FindState = std::function<scene::StateInGlPtr()>;

/// Prefix of GL error messages.
constexpr const char* transfer_step = "copying the host's voxels";

/// The objects that the transfers of a context share.
struct TransferContext {
  gl::FunctionsPtr gl;
  gl::ProgramsPtr programs;
  DeviceMemoriesPtr memories;
  std::optional<light::BlackBody> body;  ///< made when first needed, in about a millisecond

  /// Returns an empty fence if the driver runs dispatches within the call.
  [[nodiscard]] gl::Fence fence() const { return gl->dispatches_in_call ? gl::Fence() : gl::Fence(gl); }
  /// Returns whether the bricks of all fields belong to this context.
  [[nodiscard]] bool has(const scene::StateInGl& state) const;
};

/// A transfer in flight. All calls except the queries need a current context and an active StateGuard.
class VoxelTransfer {
 public:
  struct Info {
    const void* whose = nullptr;   ///< identifies the volume
    bool whole = true;             ///< false: an update of a state, or its products
    std::string name;              ///< prefix of error messages
    std::function<void()> refuse;  ///< called if a complete state is invalid
  };
  /// A complete state that the transfer brings.
  struct Announced {
    std::vector<volume::Channel> channels;
    bool gpu_resident = false;
    glm::dmat4 index_to_world{1.0};  ///< of the first field
  };
  /// Result of a step. The transfer waits for the device, or has no time left.
  struct Waits {};
  /// Everything has arrived. failure: error of a product of a valid state; null: there is none.
  struct Arrived {
    std::exception_ptr failure;
  };
  /// The last alternative takes the place of this transfer.
  using Step = std::variant<Waits, Arrived, std::unique_ptr<VoxelTransfer>>;

  /// context: must outlive this object.
  VoxelTransfer(TransferContext& context, Info info) : context_(context), info_(std::move(info)) {}
  VoxelTransfer(const VoxelTransfer&) = delete;
  VoxelTransfer& operator=(const VoxelTransfer&) = delete;
  virtual ~VoxelTransfer() = default;

  /// Works until about the deadline, and hands over the result when it is complete. Never waits. Throws the errors of
  /// the callbacks, and Error(file) for voxels that are not finite.
  virtual Step advance(Deadline deadline) = 0;
  /// nullopt: it brings no complete state.
  [[nodiscard]] virtual std::optional<Announced> announced() const { return std::nullopt; }
  /// Whether a newer complete state from the host makes it unnecessary.
  [[nodiscard]] virtual bool is_superseded() const { return false; }
  /// Whether it is dropped if the complete state before it is invalid.
  [[nodiscard]] virtual bool needs_state_before() const { return true; }
  /// Gives its buffers back.
  virtual void recycle(BrickPacker& /*packer*/) {}
  /// GL memory.
  [[nodiscard]] virtual std::uint64_t bytes() const { return 0; }

  [[nodiscard]] const Info& info() const { return info_; }
  /// Makes later commands of this context run after those of the transfer, which another context may have sent.
  void order() const { fence_.order(); }

 protected:
  TransferContext& context_;
  Info info_;
  gl::Fence fence_;
};
using VoxelTransferPtr = std::unique_ptr<VoxelTransfer>;

/// A transfer of voxels that the host has passed.
class PackedTransfer : public VoxelTransfer {
 public:
  /// packed: with `fence` after its packing.
  PackedTransfer(TransferContext& context, Info info, PackedFields packed, gl::Fence fence);
  [[nodiscard]] bool is_superseded() const override { return true; }
  void recycle(BrickPacker& packer) override { packer.recycle(packed_); }
  [[nodiscard]] std::uint64_t bytes() const override { return packed_.bytes(); }

 protected:
  [[nodiscard]] std::vector<volume::Channel> channels() const;

  PackedFields packed_;
};

}  // namespace cumulet::render
