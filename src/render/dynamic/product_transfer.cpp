#include "render/dynamic/product_transfer.hpp"

#include <utility>

namespace cumulet::render {

ProductTransfer::ProductTransfer(TransferContext& context, Info info, StayInGl stay)
    : VoxelTransfer(context, std::move(info)), stay_(std::move(stay)) {}

VoxelTransfer::Step ProductTransfer::advance(Deadline deadline) {
  if (!products_) {
    std::optional<scene::StateInGl> state = stay_.join({});
    if (!state || !context_.has(*state)) return Arrived{};
    products_.emplace(context_, stay_, std::move(*state), StateProducts::Fields{});
  }
  if (!products_->advance(deadline)) return Waits{};
  if (products_->failure() && stay_.values_wanted) stay_.values_wanted->ask();
  // If no product was computed, the state has not changed. If it has changed in the meantime, nothing arrives.
  if (!products_->empty()) stay_.arrive(products_->take());
  return Arrived{products_->failure()};
}

}  // namespace cumulet::render
