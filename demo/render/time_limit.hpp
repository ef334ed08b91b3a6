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

/// Returns the seconds for the samples of an image that is to be denoised and written `whole` seconds after the start,
/// `over` seconds after it. A slow start does not take them all, because a file manager keeps a thumbnail.
[[nodiscard]] constexpr double sampling_seconds(double whole, double over) {
  constexpr double least = 0.9, most = 1.5;
  constexpr double denoising = 0.7;  // of the time for samples: two feature rays per sample
  return std::clamp((whole - over) / (1.0 + denoising), least, most);
}

}  // namespace cumulet::demo
