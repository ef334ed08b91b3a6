#pragma once

#include <utility>

#include "base/error.hpp"
#include "render/pacing/pace.hpp"

namespace cumulet::render {

/// GPU time of passes in seconds, as far as it is known.
struct PassSeconds {
  double upload = 0.0;
  double host_depth = 0.0;
  double surfaces = 0.0;
  double trace = 0.0;
  double inspect = 0.0;
  double display = 0.0;
};

/// Times passes on the GPU without waiting, as InFlightDispatches times dispatches. A pass is not timed if too many are
/// in flight.
class PassTimer {
 public:
  explicit PassTimer(gl::FunctionsPtr gl) : dispatches_in_flight_(std::move(gl)) {}

  /// Runs the pass. Throws its errors, and once Error(out_of_memory) if there is no memory for timing.
  template <class Pass>
  void run(Pass&& pass) {
    while (const auto completed = dispatches_in_flight_.take_completed())
      seconds_ += 1e-3 * completed->ms.value_or(0.0);
    if (!times_ || dispatches_in_flight_.full()) {
      pass();
      return;
    }
    try {
      dispatches_in_flight_.begin(InFlightDispatches::Kind::dispatch);
    } catch (const Error&) {  // no memory for timing: reported once, so that the pass can use the memory
      times_ = false;
      pass();
      throw;
    }
    struct End {
      InFlightDispatches& dispatches;
      explicit End(InFlightDispatches& of) : dispatches(of) {}
      End(const End&) = delete;
      End& operator=(const End&) = delete;
      ~End() {
        try {
          dispatches.end({}, 0, 0);
        } catch (const std::exception&) {  // no memory to record the pass: it is not timed
          dispatches.finish();
        }
      }
    };
    const End end(dispatches_in_flight_);
    pass();
  }
  [[nodiscard]] double seconds() const { return seconds_; }

 private:
  InFlightDispatches dispatches_in_flight_;
  bool times_ = true;
  double seconds_ = 0.0;
};

}  // namespace cumulet::render
