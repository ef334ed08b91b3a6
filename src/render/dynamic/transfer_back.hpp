#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "render/dynamic/voxel_transfer.hpp"

namespace cumulet::render {

/// Brings a GPU-resident state to main memory.
class TransferBack : public VoxelTransfer {
 public:
  /// channels: of the state. find: called when the transfer begins.
  TransferBack(TransferContext& context, Info info, std::vector<volume::Channel> channels, FindState find,
               Arrive arrive);
  Step advance(Deadline deadline) override;
  [[nodiscard]] std::optional<Announced> announced() const override;
  [[nodiscard]] std::uint64_t bytes() const override;

 private:
  void read(const scene::StateInGlPtr& state);
  // Returns whether all bricks have been processed.
  bool take(Deadline deadline);

  std::vector<volume::Channel> channels_;
  FindState find_;
  Arrive arrive_;
  scene::StateInGlPtr state_;                        // set by find_
  std::vector<std::vector<gl::ReadBack>> memories_;  // per memory of each field
  std::vector<volume::FieldCopy> fields_;
  std::size_t field_ = 0;  // that is being processed
  std::size_t taken_ = 0;  // bricks processed of that field
};

}  // namespace cumulet::render
