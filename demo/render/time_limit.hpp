#pragma once

#include <algorithm>
#include <chrono>
#include <optional>

namespace cumulet::demo {

/// The time limit of an image. The clock starts at construction.
class TimeLimit {
 public:
  explicit TimeLimit(const std::optional<double>& seconds) : seconds_(seconds) {}
  [[nodiscard]] double over() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }
  [[nodiscard]] bool reached() const { return seconds_ && over() >= *seconds_; }
  /// Returns the budget of the next frame in milliseconds, so that it ends in time. most: without a limit.
  [[nodiscard]] double budget(double most) const {
    return seconds_ ? std::clamp(1e3 * (*seconds_ - over()), min_ms, most) : most;
  }

 private:
  static constexpr double min_ms = 5.0;
  std::optional<double> seconds_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace cumulet::demo
