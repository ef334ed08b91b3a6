#pragma once

#include <utility>

#include "base/error.hpp"
#include "render/pace.hpp"

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

/// Times passes on the GPU as Flights times dispatches, without waiting. A pass is not timed if too many are in flight.
class PassTimer {
 public:
  explicit PassTimer(gl::FunctionsPtr gl) : flights_(std::move(gl)) {}

  /// Runs the pass. Throws its errors, and once Error(out_of_memory) if there is no memory for timing.
  template <class Pass>
  void run(Pass&& pass) {
    while (const auto landed = flights_.land()) seconds_ += 1e-3 * landed->ms.value_or(0.0);
    if (!times_ || flights_.full()) {
      pass();
      return;
    }
    try {
      flights_.begin(Flights::Kind::dispatch);
    } catch (const Error&) {  // no memory for timing: reported once, so that the pass can use the memory
      times_ = false;
      pass();
      throw;
    }
    struct End {
      Flights& flights;
      explicit End(Flights& of) : flights(of) {}
      End(const End&) = delete;
      End& operator=(const End&) = delete;
      ~End() {
        try {
          flights.end({}, 0, 0);
        } catch (const std::exception&) {  // no memory to record the pass: it is not timed
          flights.finish();
        }
      }
    };
    const End end(flights_);
    pass();
  }
  [[nodiscard]] double seconds() const { return seconds_; }

 private:
  Flights flights_;
  bool times_ = true;
  double seconds_ = 0.0;
};

}  // namespace cumulet::render
