#pragma once

// Private to surface/: files whose floats are too coarse for their contents.

#include <glm/glm.hpp>
#include <optional>
#include <string>

namespace cumulet::surface::detail {

/// How far floats round positions that are far from 0, and the size of the thing that has them.
struct Rounding {
  double farthest = 0.0;  ///< coordinate
  double error = 0.0;     ///< half the distance of the floats there
  double size = 0.0;
  [[nodiscard]] double part() const { return size > 0.0 ? error / size : 1.0; }
};

/// Where it can be seen: an error of 1 / 4096 of the size or more. Nothing else.
std::optional<Rounding> visible_rounding(float farthest, double size);

/// The worst of some, in a line.
class PrecisionRemark {
 public:
  /// what: names the numbers.
  void add(const std::string& what, const glm::vec3& low, const glm::vec3& high);
  /// The same of offsets, up to that far, of something of that size.
  void add(const std::string& what, double farthest, double size);
  /// One line that begins with `name`; empty: all is well.
  [[nodiscard]] std::string text(const std::string& name) const;

 private:
  std::string what_;
  Rounding worst_;
  std::size_t count_ = 0;
};

}  // namespace cumulet::surface::detail
