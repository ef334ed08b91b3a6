#pragma once

#include <glm/glm.hpp>

namespace cumulet {

/// Returns the luminance of a linear Rec. 709 color.
template <class T>
T luminance(const glm::vec<3, T>& v) {
  return glm::dot(v, glm::vec<3, T>(T(0.2126), T(0.7152), T(0.0722)));
}

}  // namespace cumulet
