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

/// vector.resize(size), looking at the cancel flag while gigabytes are filled.
template <class T>
void resize(std::vector<T>& vector, std::size_t size, const Progress* progress, const T& value = T()) {
  constexpr std::size_t piece = std::max<std::size_t>((std::size_t{4} << 20U) / sizeof(T), 1);
  vector.reserve(size);
  while (vector.size() < size) {
    check(progress);
    vector.resize(std::min(size, vector.size() + piece), value);
  }
}

/// One step of a stage: maps a count of things done, by any number of threads, to a span of the stage's fraction.
/// Without a Progress it does nothing. Methods throw Error(cancelled) when that is asked for.
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
    // One teller at a time, so that the fraction never falls; what others add it tells the next time.
    if (telling_.test_and_set(std::memory_order_acquire)) return;
    const double part = static_cast<double>(done_.load(std::memory_order_relaxed)) / static_cast<double>(total_);
    progress_->at(from_ + (to_ - from_) * std::min(part, 1.0));
    telling_.clear(std::memory_order_release);
  }

  /// As cumulet::resize().
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
