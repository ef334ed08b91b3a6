#pragma once

#include <optional>

#include "render/dynamic/state_products.hpp"
#include "render/dynamic/voxel_transfer.hpp"

namespace cumulet::render {

/// Computes missing products of a GPU-resident state. No voxels are transferred.
class ProductTransfer : public VoxelTransfer {
 public:
  /// stay.join: returns the state for no fields.
  ProductTransfer(TransferContext& context, Info info, StayInGl stay);
  Step advance(Deadline deadline) override;
  // It uses the GPU-resident state.
  [[nodiscard]] bool needs_state_before() const override { return false; }

 private:
  StayInGl stay_;
  std::optional<StateProducts> products_;
};

}  // namespace cumulet::render
