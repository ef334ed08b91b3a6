#include "render/dynamic/state_products.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include "base/error.hpp"

namespace cumulet::render {

namespace {

// Returns the bricks of a product that the changed fields affect.
std::vector<glm::ivec3> changed_for(const scene::Product& product, const std::vector<scene::StateInGl::Field>& fields) {
  const std::vector<volume::Channel> made_of = scene::fields_of(product);
  std::vector<glm::ivec3> changed;
  for (const scene::StateInGl::Field& field : fields) {
    if (std::ranges::find(made_of, field.channel) == made_of.end()) continue;
    changed.insert(changed.end(), field.bricks->origins.begin(), field.bricks->origins.end());
    changed.insert(changed.end(), field.bricks->emptied.begin(), field.bricks->emptied.end());
  }
  return changed;
}

}  // namespace

StateProducts::StateProducts(TransferContext& context, const StayInGl& stay, scene::StateInGl state,
                             const Fields& changed)
    : state_(std::move(state)) {
  // The products are computed in main memory then.
  if (stay.values_wanted && stay.values_wanted->asked()) return;
  for (scene::Product& product : state_.wanted(stay.wanted())) {
    const scene::ProductInGl* before = state_.product(product);
    const std::vector<glm::ivec3> bricks = changed_for(product, changed);
    if (before != nullptr && bricks.empty()) {
      kept_.push_back(*before);
    } else {
      if (!context.body) context.body.emplace();
      computed_.emplace_back(context.gl, context.programs, context.memories, *context.body, state_, std::move(product),
                             before != nullptr ? std::optional(bricks) : std::nullopt);
    }
  }
}

bool StateProducts::advance(Deadline deadline) {
  try {
    bool all = true;
    for (BrickProducts& products : computed_) all = products.advance(deadline) && all;
    return all;
  } catch (const Error& error) {
    if (error.code() == ErrorCode::context_lost) throw;
    failure_ = std::current_exception();
    computed_.clear();
    return true;
  }
}

scene::StateInGl StateProducts::take() {
  for (BrickProducts& products : computed_) kept_.push_back(products.take(state_.product(products.product())));
  state_.products = std::move(kept_);
  return std::move(state_);
}

}  // namespace cumulet::render
