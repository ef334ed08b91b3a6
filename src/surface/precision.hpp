#pragma once

// Private to surface/: detects files whose float positions are too coarse for their contents.

#include <glm/glm.hpp>
#include <optional>
#include <string>

namespace cumulet::surface::detail {

/// Rounding of float positions far from 0, relative to the size of their object.
struct Rounding {
  double farthest = 0.0;  ///< largest coordinate
  double error = 0.0;     ///< half the spacing of floats there
  double size = 0.0;
  [[nodiscard]] double part() const { return size > 0.0 ? error / size : 1.0; }
};

/// Returns the rounding if it is visible: an error of 1 / 4096 of the size or more.
std::optional<Rounding> visible_rounding(float farthest, double size);

/// Reports the worst of several roundings in one line.
class PrecisionRemark {
 public:
  /// what: names the positions in the report.
  void add(const std::string& what, const glm::vec3& low, const glm::vec3& high);
  /// Adds the rounding of offsets up to `farthest`, for an object of this size.
  void add(const std::string& what, double farthest, double size);
  /// Returns one line that begins with `name`; empty if no rounding is visible.
  [[nodiscard]] std::string text(const std::string& name) const;

 private:
  std::string what_;
  Rounding worst_;
  std::size_t count_ = 0;
};

}  // namespace cumulet::surface::detail
