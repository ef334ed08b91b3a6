#include "stage/gl_budget.hpp"

#include <algorithm>

#include "jobs/cell_budget.hpp"
#include "scene/march_source.hpp"

namespace cumulet::viewer {

namespace {

bool apart_by_an_eighth(std::uint64_t a, std::uint64_t b) {
  return std::max(a, b) - std::min(a, b) > std::max(a, b) / 8;
}

}  // namespace

bool is_of_cells(const Built& built) { return built.source && built.source->march == scene::March::tet; }

bool GlBudget::set_limits(unsigned threads, std::uint64_t memory_bytes, std::uint64_t gl_bytes) {
  const bool others = gl_bytes != max_bytes_ || memory_bytes != limits_->memory_bytes();
  limits_->set(threads, memory_bytes);
  max_bytes_ = gl_bytes;
  share();
  if (others) renew();
  return others;
}

bool GlBudget::set_bytes_beside(std::uint64_t bytes) {
  const bool is_first = !bytes_beside_ && is_limited();
  bytes_beside_ = bytes;
  share();
  return is_first;
}

void GlBudget::set_grids(std::size_t grids) {
  const std::size_t before = std::exchange(grids_, std::max<std::size_t>(grids, 1));
  share();
  if (is_limited() && (grids_ != before || apart_by_an_eighth(part_, limits_->gl_bytes()))) renew();
}

bool GlBudget::fits(const Built& built) const {
  ResourceLimits part;
  part.set_gl(part_);
  return !is_of_cells(built) || has_cells_allowed(built, part);
}

void GlBudget::share() {
  // Images vary by some KiB from frame to frame. Rounding keeps the number of cells constant.
  constexpr std::uint64_t step = std::uint64_t{1} << 18U;
  const std::uint64_t beside = (bytes_beside_.value_or(0) + step - 1) / step * step;
  const std::uint64_t left = max_bytes_ - std::min(max_bytes_, beside);
  limits_->set_gl(is_limited() ? left / grids_ : ResourceLimits::no_limit);
}

void GlBudget::renew() {
  cells_due_ = true;
  part_ = limits_->gl_bytes();
}

}  // namespace cumulet::viewer
