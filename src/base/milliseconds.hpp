#pragma once

#include <algorithm>
#include <chrono>

namespace cumulet {

inline double milliseconds(std::chrono::steady_clock::duration duration) {
  return std::chrono::duration<double, std::milli>(duration).count();
}

/// Below 0 if that has passed.
inline double milliseconds_until(std::chrono::steady_clock::time_point moment) {
  return milliseconds(moment - std::chrono::steady_clock::now());
}

/// From now; of what is negative or endless, now and eleven days.
inline std::chrono::steady_clock::time_point deadline_after(double milliseconds) {
  using Clock = std::chrono::steady_clock;
  return Clock::now() + std::chrono::duration_cast<Clock::duration>(
                            std::chrono::duration<double, std::milli>(std::clamp(milliseconds, 0.0, 1e9)));
}

}  // namespace cumulet
