#pragma once

#include <cumulet/cumulet.h>

#include <optional>

namespace cumulet::demo {

/// Returns the part of an image that one sample per pixel is. With a noise target it is the least part.
[[nodiscard]] double part_of_a_sample(const cumulet_sampling_desc& sampling);

/// Estimates the remaining time of a work from its completed fraction.
class TimeLeft {
 public:
  /// Records the completed fraction at a time in seconds. A smaller one than before means that other work has begun.
  void see(double part, double now);
  /// Records that nothing is worked on.
  void rest() { start_.reset(); }
  /// Returns the remaining seconds at the last call of see(); nullopt if too little is known. min_part: the part that
  /// must have been completed since the first call, such as a whole sample.
  [[nodiscard]] std::optional<double> seconds(double min_part) const;

 private:
  struct Point {
    double part;
    double at;
  };
  std::optional<Point> start_;
  Point last_{0.0, 0.0};
};

}  // namespace cumulet::demo
