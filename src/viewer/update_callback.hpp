#pragma once

#include <atomic>
#include <functional>
#include <utility>

#include "base/library_thread.hpp"

namespace cumulet::viewer {

/// The host's update callback. Calls are coalesced. Thread-safe.
class UpdateCallback {
 public:
  /// Null: the host has none.
  explicit UpdateCallback(std::function<void()> callback) : callback_(std::move(callback)) {}

  /// Calls it, unless it was called since the last reset().
  void call() {
    if (!callback_ || process_is_ending() || is_pending_.exchange(true)) return;
    const CallbackScope inside;
    callback_();
  }
  void reset() { is_pending_ = false; }

 private:
  std::function<void()> callback_;
  std::atomic<bool> is_pending_ = false;
};

}  // namespace cumulet::viewer
