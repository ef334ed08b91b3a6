#pragma once

#include <cstddef>
#include <optional>

#include "render/dynamic/voxel_transfer.hpp"

namespace cumulet::render {

/// Brings a host's voxels to main memory.
class TransferToMemory : public PackedTransfer {
 public:
  TransferToMemory(TransferContext& context, Info info, PackedFields packed, gl::Fence fence, Arrive arrive);
  Step advance(Deadline deadline) override;
  [[nodiscard]] std::optional<Announced> announced() const override;

 private:
  // Copies filled bricks beyond the expected number.
  void copy_rest();
  // Returns whether all bricks have been processed.
  bool take(Deadline deadline);

  Arrive arrive_;
  bool counted_ = false;   // the number of filled bricks is known, and they have been copied
  std::size_t piece_ = 0;  // that is being processed
  std::size_t taken_ = 0;  // bricks processed of that piece, filled and emptied ones
  bool finite_ = true;
};

}  // namespace cumulet::render
