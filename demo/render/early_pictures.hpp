#pragma once

#include <optional>

namespace cumulet::demo {

/// Decides when the image so far replaces the output file: after some seconds, and then whenever the time has doubled.
class EarlyPictures {
 public:
  /// first: seconds until the first one; nullopt: none is written.
  explicit EarlyPictures(std::optional<double> first) : next_(first) {}

  /// Returns true if an image should be written after this time in seconds.
  [[nodiscard]] bool due(double seconds) const { return next_ && seconds >= *next_; }
  /// Records that one was written, or could not be.
  void written(double seconds) { next_ = 2.0 * seconds; }

 private:
  std::optional<double> next_;
};

}  // namespace cumulet::demo
