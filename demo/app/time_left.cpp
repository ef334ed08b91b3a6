#include "time_left.hpp"

#include <algorithm>

namespace cumulet::demo {

double part_of_a_sample(const cumulet_sampling_desc& sampling) { return 1.0 / std::max(1U, sampling.samples); }

void TimeLeft::see(double part, double now) {
  if (!start_ || part < last_.part) start_ = Point{part, now};
  last_ = {part, now};
}

std::optional<double> TimeLeft::seconds(double min_part) const {
  constexpr double min_seconds = 0.5;  // a shorter time gives no meaningful rate
  if (!start_ || last_.part >= 1.0) return std::nullopt;
  const double gained = last_.part - start_->part;
  const double elapsed = last_.at - start_->at;
  if (elapsed < min_seconds || gained <= 0.0 || gained < min_part) return std::nullopt;
  return elapsed * (1.0 - last_.part) / gained;
}

}  // namespace cumulet::demo
