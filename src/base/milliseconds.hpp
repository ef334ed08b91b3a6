#pragma once

#include <algorithm>
#include <chrono>

namespace cumulet {

inline double milliseconds(std::chrono::steady_clock::duration duration) {
  return std::chrono::duration<double, std::milli>(duration).count();
}

/// Negative if the moment has passed. Subtracts in floating point, because the difference to the clock's minimum, which
/// is always past, overflows its integers.
inline double milliseconds_until(std::chrono::steady_clock::time_point moment) {
  return milliseconds(moment.time_since_epoch()) - milliseconds(std::chrono::steady_clock::now().time_since_epoch());
}

/// Returns the time point that many milliseconds from now. Negative values count as 0, values above 1e9 as 1e9 (eleven
/// days).
inline std::chrono::steady_clock::time_point deadline_after(double milliseconds) {
  using Clock = std::chrono::steady_clock;
  return Clock::now() + std::chrono::duration_cast<Clock::duration>(
                            std::chrono::duration<double, std::milli>(std::clamp(milliseconds, 0.0, 1e9)));
}

}  // namespace cumulet
