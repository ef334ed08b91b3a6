#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "input.hpp"
#include "model.hpp"
#include "time_left.hpp"

namespace cumulet::demo {

/// Measures latency and speed, and adds the values to the charts.
class Measurements {
 public:
  /// The charts must outlive it.
  explicit Measurements(Charts& charts) : charts_(charts) {}

  /// Records a change at a time in seconds, which the request with this number shows. A change that no image shows yet
  /// is older and stays.
  void change(double now, std::uint64_t number);
  /// Records a frame of the window. drawn: the window was drawn; picture: with a new image; due: another image is
  /// expected; pending: a change is not drawn yet.
  void take_frame(const std::vector<Event>& events, bool drawn, bool picture, bool due, bool pending);
  /// Records the viewer's statistics. drawn: the latest request with a drawn image.
  void take_status(const Status& status, std::uint64_t drawn, double now);
  /// Returns the seconds until the image has all samples, rounded up to whole seconds; nullopt until a sample per pixel
  /// was measured.
  [[nodiscard]] std::optional<double> seconds_left(const cumulet_sampling_desc& sampling) const;

 private:
  Charts& charts_;
  FrameTimes frame_times_;
  std::optional<double> changed_at_;  // time of the oldest change that no image shows yet
  std::uint64_t changed_number_ = 0;
  double device_seconds_ = 0.0;  // last value of the statistics
  double rate_since_ = 0.0;
  std::uint64_t rate_samples_ = 0;
  TimeLeft time_left_;
};

}  // namespace cumulet::demo
