#pragma once

#include <cstddef>
#include <map>
#include <optional>

namespace cumulet::gl {

/// Which parts of one page are taken. Gaps that touch are one gap.
class SpanAllocator {
 public:
  /// All of it is free.
  explicit SpanAllocator(std::size_t size) : size_(size), free_(size) {
    if (size > 0) gaps_.emplace(0, size);
  }

  /// The first place of the smallest gap that holds so many units (> 0). O(gaps).
  std::optional<std::size_t> take(std::size_t size);
  /// Of what was taken there, whole. O(log gaps).
  void give_back(std::size_t first, std::size_t size);

  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] std::size_t free() const { return free_; }
  [[nodiscard]] bool empty() const { return free_ == size_; }
  [[nodiscard]] std::size_t gaps() const { return gaps_.size(); }

 private:
  std::size_t size_;
  std::size_t free_;
  std::map<std::size_t, std::size_t> gaps_;  // their sizes, by where they begin
};

}  // namespace cumulet::gl
