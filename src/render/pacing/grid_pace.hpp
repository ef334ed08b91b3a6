#pragma once

#include <map>
#include <memory>
#include <vector>

#include "gl/programs.hpp"

namespace cumulet::render {

/// Measured time per item of the kernels that build grids, in ms.
class GridPace {
 public:
  /// Returns the time per item. cost: estimate while there is no measurement.
  [[nodiscard]] double ms(const gl::ProgramKey& key, double cost) const;
  struct Sent {
    gl::ProgramKey key;
    double cost = 0.0;
    double items = 0.0;
    double weight = 1.0;  ///< per item, if the items of a kernel differ
  };
  enum class Measured {
    exactly,  ///< time of these dispatches only
    at_most   ///< until they were seen to be finished, so other work of the host is included
  };
  /// Updates the estimates: these dispatches took `ms` in sequence. Measurements with the first dispatch of a kernel
  /// are ignored, because drivers compile in it.
  void learn(const std::vector<Sent>& sent, double ms, Measured measured);

 private:
  std::map<gl::ProgramKey, double> known_;  // per item
};
using GridPacePtr = std::shared_ptr<GridPace>;

}  // namespace cumulet::render
