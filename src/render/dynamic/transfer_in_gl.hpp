#pragma once

#include <cstdint>
#include <exception>
#include <memory>
#include <optional>
#include <vector>

#include "render/dynamic/brick_kernels.hpp"
#include "render/dynamic/state_products.hpp"
#include "render/dynamic/voxel_transfer.hpp"

namespace cumulet::render {

/// Converts a host's voxels into bricks that stay GPU-resident, and joins them to a state.
class TransferInGl : public PackedTransfer {
 public:
  /// Requests the programs that it will need.
  static void ask_for_programs(const TransferContext& context, const PackedFields& packed);
  TransferInGl(TransferContext& context, Info info, PackedFields packed, gl::Fence fence, StayInGl stay);
  Step advance(Deadline deadline) override;
  [[nodiscard]] std::optional<Announced> announced() const override;

 private:
  // GPU-resident bricks of a piece.
  struct Kept {
    std::shared_ptr<volume::DeviceMemory> memory;  // null: there are none
    std::uint32_t filled = 0;                      // bricks in `memory`
    std::uint32_t summarized = 0;                  // bricks of these that have been summarized
  };
  enum class Stage {
    summaries,  // bricks are converted and summarized
    read_back,  // the summaries are read back
    products    // the fields have been joined
  };
  // Converts and summarizes GPU-resident bricks. Returns whether all dispatches have been sent.
  bool summarize(Deadline deadline);
  void begin_summaries();
  [[nodiscard]] BrickSummaries summaries_of(std::size_t piece) const;
  [[nodiscard]] StateProducts::Fields take_fields() const;
  // Joins the fields. Returns the transfer to main memory if the state that they update is there. Nothing arrives if
  // there are no products_ then.
  [[nodiscard]] VoxelTransferPtr join();

  StayInGl stay_;
  Stage stage_ = Stage::summaries;
  std::vector<Kept> kept_;  // per piece
  gl::Object brick_tree_;   // only while bricks are summarized
  StateProducts::Fields fields_;
  std::optional<StateProducts> products_;
  std::exception_ptr failure_;  // error of a product
};

}  // namespace cumulet::render
