#pragma once

#include <chrono>

#include "render/pacing/pace.hpp"

namespace cumulet::render {

/// Decides how long the dispatches of a call may take, so that work is divided over frames: paths, rows of pixels, the
/// filter, and grid builds. Their costs are estimated by RoundCost, and for grids by GridPace.
class DispatchPacer {
 public:
  using Clock = std::chrono::steady_clock;

  /// deadline: about when the work of the call should end on the GPU. part: fraction of the remaining time that a
  /// dispatch may be estimated to take.
  explicit DispatchPacer(Clock::time_point deadline, double part = part_of_rest);

  /// Time for a dispatch beside the work in flight, in ms. Negative: there is none.
  [[nodiscard]] double left_ms(double in_flight_ms) const;
  /// Maximum time of a dispatch, so that a call has more than one.
  [[nodiscard]] double max_ms() const { return max_ms_; }
  [[nodiscard]] bool is_over() const { return Clock::now() >= deadline_; }

  void note_sent() { has_sent_ = true; }
  /// True if the call has sent a dispatch.
  [[nodiscard]] bool has_sent() const { return has_sent_; }
  /// True if the call must send a dispatch even if there is no time for it, because there would be no progress.
  [[nodiscard]] bool must_send(const InFlightDispatches& in_flight) const { return !has_sent_ && in_flight.empty(); }
  /// Waits briefly for dispatches in flight, without a GL call. Returns false without waiting if the call should end,
  /// because none is in flight or there is no time for more.
  [[nodiscard]] bool wait(const InFlightDispatches& in_flight) const;

 private:
  Clock::time_point deadline_;
  double part_;
  double max_ms_;
  bool has_sent_ = false;
};

}  // namespace cumulet::render
