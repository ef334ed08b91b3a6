#include "surface/precision.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/number_text.hpp"
#include "base/one_line.hpp"

namespace cumulet::surface::detail {

namespace {

std::string digits(double value) { return general_text(value, 3); }

}  // namespace

std::optional<Rounding> visible_rounding(float farthest, double size) {
  constexpr float infinite = std::numeric_limits<float>::infinity();
  const double error = 0.5 * (double{std::nextafter(farthest, infinite)} - double{farthest});
  // The object may be a single point on purpose, but hardly where floats are a thousandth from each other.
  constexpr double min_error = 5e-4;
  constexpr double visible = 1.0 / 4096.0;
  if (size > 0.0 ? error < visible * size : error < min_error) return std::nullopt;
  return Rounding{farthest, error, size};
}

void PrecisionRemark::add(const std::string& what, const glm::vec3& low, const glm::vec3& high) {
  const glm::vec3 most = glm::max(glm::abs(low), glm::abs(high));
  add(what, std::max({most.x, most.y, most.z}), glm::distance(glm::dvec3(low), glm::dvec3(high)));
}

void PrecisionRemark::add(const std::string& what, double farthest, double size) {
  const std::optional<Rounding> rounding = visible_rounding(static_cast<float>(farthest), size);
  if (!rounding) return;
  ++count_;
  if (count_ > 1 && rounding->part() <= worst_.part()) return;
  what_ = what;
  worst_ = *rounding;
}

std::string PrecisionRemark::text(const std::string& name) const {
  if (count_ == 0) return {};
  const std::string more = count_ == 1 ? "" : ", and those of " + std::to_string(count_ - 1) + " more,";
  const std::string size =
      worst_.size > 0.0 ? ", " + digits(100.0 * worst_.part()) + " % of its size" : ", more than its size";
  return cumulet::one_line(name, 4096) + ": the positions of " + what_ + more + " lose precision: they reach " +
         digits(worst_.farthest) + ", where 32-bit floats have a rounding error of up to " + digits(worst_.error) +
         size + ". Use a node translation for large offsets";
}

}  // namespace cumulet::surface::detail
