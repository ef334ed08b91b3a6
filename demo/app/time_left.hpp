#pragma once

#include <optional>

namespace cumulet::demo {

/// Estimates the remaining time of a work from its completed fraction.
class TimeLeft {
 public:
  /// Records the completed fraction at a time in seconds. A smaller one than before means that other work has begun.
  void see(double part, double now);
  /// Records that nothing is worked on.
  void rest() { start_.reset(); }
  /// Returns the remaining seconds at the last call of see(); nullopt if too little is known.
  [[nodiscard]] std::optional<double> seconds() const;

 private:
  struct Point {
    double part;
    double at;
  };
  std::optional<Point> start_;
  Point last_{0.0, 0.0};
};

}  // namespace cumulet::demo
