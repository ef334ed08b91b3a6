#pragma once

#include <chrono>

namespace cumulet {

inline double milliseconds(std::chrono::steady_clock::duration duration) {
  return std::chrono::duration<double, std::milli>(duration).count();
}

/// Below 0 if that has passed.
inline double milliseconds_until(std::chrono::steady_clock::time_point moment) {
  return milliseconds(moment - std::chrono::steady_clock::now());
}

}  // namespace cumulet
