#pragma once

#include <deque>
#include <exception>
#include <vector>

#include "render/dynamic/brick_products.hpp"
#include "render/dynamic/voxel_transfer.hpp"

namespace cumulet::render {

/// A GPU-resident state, and the computation of its needed products in GL.
class StateProducts {
 public:
  using Fields = std::vector<scene::StateInGl::Field>;
  /// changed: bricks of these fields differ from those that the state's products were computed from.
  StateProducts(TransferContext& context, const StayInGl& stay, scene::StateInGl state, const Fields& changed);
  /// Works until the deadline. Returns whether all products are complete or one has failed. Throws only
  /// Error(context_lost) and errors that are not Errors.
  bool advance(Deadline deadline);
  /// The error of a product, which main memory computes then; null: none.
  [[nodiscard]] const std::exception_ptr& failure() const { return failure_; }
  /// Returns whether no product is computed.
  [[nodiscard]] bool empty() const { return computed_.empty(); }
  /// Returns the state with all products that were computed; call it once.
  [[nodiscard]] scene::StateInGl take();

 private:
  scene::StateInGl state_;
  std::vector<scene::ProductInGl> kept_;  // unchanged products
  std::deque<BrickProducts> computed_;
  std::exception_ptr failure_;
};

}  // namespace cumulet::render
