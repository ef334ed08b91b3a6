#include "render/pacing/dispatch_pacer.hpp"

#include <algorithm>
#include <thread>

#include "base/milliseconds.hpp"

namespace cumulet::render {

DispatchPacer::DispatchPacer(Clock::time_point deadline, double part)
    : deadline_(deadline), part_(part), max_ms_(std::clamp(0.7 * milliseconds_until(deadline), min_ms, dispatch_ms)) {}

double DispatchPacer::left_ms(double in_flight_ms) const {
  return part_ * milliseconds_until(deadline_) - in_flight_ms;
}

bool DispatchPacer::wait(const InFlightDispatches& in_flight) const {
  if (in_flight.empty() || is_over() || (has_sent_ && left_ms(in_flight.expected_ms()) <= 0.0)) return false;
  std::this_thread::sleep_for(std::chrono::microseconds(50));
  return true;
}

}  // namespace cumulet::render
