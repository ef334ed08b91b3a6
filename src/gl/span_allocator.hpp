#pragma once

#include <cstddef>
#include <map>
#include <optional>

namespace cumulet::gl {

/// Best-fit allocator for the units of one page. Adjacent gaps are merged.
class SpanAllocator {
 public:
  /// Initially, the whole page is free.
  explicit SpanAllocator(std::size_t size) : size_(size), free_(size) {
    if (size > 0) gaps_.emplace(0, size);
  }

  /// Returns the start of the smallest gap that holds `size` units (> 0), or nullopt. O(gaps).
  std::optional<std::size_t> take(std::size_t size);
  /// Frees a span that take() returned, as a whole. O(log gaps).
  void give_back(std::size_t first, std::size_t size);

  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] std::size_t free() const { return free_; }
  [[nodiscard]] bool empty() const { return free_ == size_; }
  [[nodiscard]] std::size_t gaps() const { return gaps_.size(); }

 private:
  std::size_t size_;
  std::size_t free_;
  std::map<std::size_t, std::size_t> gaps_;  // size of each gap, keyed by its start
};

}  // namespace cumulet::gl
