#include "gl/span_allocator.hpp"

#include <iterator>
#include <utility>

namespace cumulet::gl {

std::optional<std::size_t> SpanAllocator::take(std::size_t size) {
  auto best = gaps_.end();
  for (auto gap = gaps_.begin(); gap != gaps_.end(); ++gap) {
    if (gap->second >= size && (best == gaps_.end() || gap->second < best->second)) best = gap;
  }
  if (best == gaps_.end()) return std::nullopt;
  const auto [first, all] = *best;
  auto rest = gaps_.extract(best);  // the node is reinserted without an allocation, which could fail
  if (all > size) {
    rest.key() = first + size;
    rest.mapped() = all - size;
    gaps_.insert(std::move(rest));
  }
  free_ -= size;
  return first;
}

void SpanAllocator::give_back(std::size_t first, std::size_t size) {
  free_ += size;
  auto after = gaps_.lower_bound(first);
  if (after != gaps_.end() && after->first == first + size) {
    size += after->second;
    after = gaps_.erase(after);
  }
  if (after != gaps_.begin()) {
    const auto before = std::prev(after);
    if (before->first + before->second == first) {
      before->second += size;
      return;
    }
  }
  gaps_.emplace(first, size);
}

}  // namespace cumulet::gl
