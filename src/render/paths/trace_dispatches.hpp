#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "base/parameters.hpp"
#include "render/pacing/pace.hpp"
#include "render/pacing/pass_timer.hpp"
#include "render/pacing/region.hpp"
#include "render/pacing/upload.hpp"
#include "render/scene/march_data.hpp"
#include "render/scene/trace_inputs.hpp"

namespace cumulet::render {

/// The dispatches of the passes that trace rays, with their parameters and results, and the draws of surface passes.
/// All calls need a current context and an active StateGuard.
class TraceDispatches {
 public:
  explicit TraceDispatches(gl::FunctionsPtr gl) : gl_(gl), in_flight_(gl), draws_(std::move(gl)) {}

  /// Allocates the buffer of the parameters, unless it exists.
  void allocate();
  /// Makes the program current, and binds the data, the inputs and the parameters.
  void use(const gl::Program& program, const MarchData& data, const TraceInputs& trace_inputs);
  /// Sets the parameters of the next dispatch.
  void set(const core::CmParameters& parameters) const;
  [[nodiscard]] InFlightDispatches& in_flight() { return in_flight_; }
  /// The surface passes in flight.
  [[nodiscard]] InFlightDispatches& draws() { return draws_; }
  /// Makes later commands of this context run after the in-flight dispatches, whichever context sent them. Does not
  /// wait.
  void order() const { in_flight_.order(); }
  /// Processes finished dispatches and draws.
  void collect();
  /// Runs the kernel in use over the rows from `row` on, until done or about the deadline. Returns whether it is done.
  bool run_rows(const PixelBox& box, core::CmParameters parameters, const std::shared_ptr<RoundCost>& cost,
                std::uint32_t& row, Deadline deadline);

  /// Returns a new revision number of a picture.
  std::uint64_t next_revision() { return ++revision_; }
  /// Appends a record for every dispatch that ends, for tests.
  void set_log(std::vector<DispatchRecord>* log) { log_ = log; }
  /// GPU time of the trace, inspect and surface passes.
  [[nodiscard]] const PassSeconds& seconds() const { return seconds_; }
  /// Recent speed of the surface pass, in pixels per millisecond.
  [[nodiscard]] double raster_rate() const { return raster_rate_; }

 private:
  void collect_samples(const InFlightDispatches::Completed& completed);

  gl::FunctionsPtr gl_;
  gl::Object parameters_;
  InFlightDispatches in_flight_;
  InFlightDispatches draws_;
  std::uint64_t revision_ = 0;  // newest revision of a picture
  std::vector<DispatchRecord>* log_ = nullptr;
  PassSeconds seconds_;
  double raster_rate_ = 2e4;
};

}  // namespace cumulet::render
