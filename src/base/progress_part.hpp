#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/progress.hpp"

namespace cumulet {

/// Throws Error(cancelled) if there is a Progress and it is cancelled.
inline void check(const Progress* progress) {
  if (progress != nullptr) progress->check();
}

/// Like vector.resize(size), but checks for cancellation between blocks of 4 MiB.
template <class T>
void resize(std::vector<T>& vector, std::size_t size, const Progress* progress, const T& value = T()) {
  constexpr std::size_t piece = std::max<std::size_t>((std::size_t{4} << 20U) / sizeof(T), 1);
  vector.reserve(size);
  while (vector.size() < size) {
    check(progress);
    vector.resize(std::min(size, vector.size() + piece), value);
  }
}

/// One step of a stage: maps a count of completed items, added by any number of threads, to a span of the stage's
/// fraction. Without a Progress it does nothing. Methods throw Error(cancelled) if cancellation was requested.
class ProgressPart {
 public:
  ProgressPart(Progress* progress, double from, double to, std::uint64_t total)
      : progress_(progress), from_(from), to_(to), total_(std::max<std::uint64_t>(total, 1)) {
    if (progress_ != nullptr) progress_->at(from);
  }

  void check() const { cumulet::check(progress_); }
  /// Call it for pieces of a millisecond or so, not for every voxel.
  void add(std::uint64_t done) {
    if (progress_ == nullptr) return;
    done_.fetch_add(done, std::memory_order_relaxed);
    progress_->check();
    // Only one thread at a time updates the fraction, so that it never falls. Items added by other threads are included
    // in the next update.
    if (telling_.test_and_set(std::memory_order_acquire)) return;
    const double part = static_cast<double>(done_.load(std::memory_order_relaxed)) / static_cast<double>(total_);
    progress_->at(from_ + (to_ - from_) * std::min(part, 1.0));
    telling_.clear(std::memory_order_release);
  }

  /// Like cumulet::resize().
  template <class T>
  void resize(std::vector<T>& vector, std::size_t size, const T& value = T()) const {
    cumulet::resize(vector, size, progress_, value);
  }

 private:
  Progress* progress_;
  double from_;
  double to_;
  std::uint64_t total_;
  std::atomic<std::uint64_t> done_ = 0;
  std::atomic_flag telling_;
};

}  // namespace cumulet
