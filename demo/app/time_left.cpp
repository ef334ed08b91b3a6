#include "time_left.hpp"

namespace cumulet::demo {

void TimeLeft::see(double part, double now) {
  if (!start_ || part < last_.part) start_ = Point{part, now};
  last_ = {part, now};
}

std::optional<double> TimeLeft::seconds() const {
  constexpr double min_seconds = 0.5;  // a shorter time gives no meaningful rate
  if (!start_ || last_.part >= 1.0) return std::nullopt;
  const double gained = last_.part - start_->part;
  const double elapsed = last_.at - start_->at;
  if (elapsed < min_seconds || gained <= 0.0) return std::nullopt;
  return elapsed * (1.0 - last_.part) / gained;
}

}  // namespace cumulet::demo
