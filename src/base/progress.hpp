#pragma once

#include <atomic>

#include "base/error.hpp"

namespace cumulet {

/// Progress of a long job, readable from other threads, and their request to cancel it. Safe from any thread.
class Progress {
 public:
  enum class Stage { idle = 0, loading = 1, statistics = 2, refining = 3, records = 4, uploading = 5 };

  void begin(Stage stage) {
    check();
    fraction_.store(0.0, std::memory_order_relaxed);
    stage_.store(stage, std::memory_order_relaxed);
  }
  /// Throws Error(cancelled) if cancellation was requested. Cheap: call it between pieces of a few milliseconds.
  void check() const {
    if (cancelled_.load(std::memory_order_relaxed)) throw Error(ErrorCode::cancelled, "cancelled");
  }
  void at(double fraction) {
    check();
    fraction_.store(fraction, std::memory_order_relaxed);
  }
  void cancel() { cancelled_.store(true, std::memory_order_relaxed); }

  [[nodiscard]] bool cancelled() const { return cancelled_.load(std::memory_order_relaxed); }
  [[nodiscard]] Stage stage() const { return stage_.load(std::memory_order_relaxed); }
  [[nodiscard]] double fraction() const { return fraction_.load(std::memory_order_relaxed); }

 private:
  std::atomic<bool> cancelled_ = false;
  std::atomic<Stage> stage_ = Stage::idle;
  std::atomic<double> fraction_ = 0.0;
};

}  // namespace cumulet
