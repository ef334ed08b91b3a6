#pragma once

#include <span>

namespace cumulet::image {

/// Returns the luminance of linear Rec. 709. pixel: red, green, blue, and further channels.
inline double luminance(std::span<const float> pixel) {
  return 0.2126 * double{pixel[0]} + 0.7152 * double{pixel[1]} + 0.0722 * double{pixel[2]};
}

}  // namespace cumulet::image
