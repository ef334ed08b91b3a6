#pragma once

#include <cstdint>
#include <vector>

#include "subject.hpp"

namespace cumulet::bench {

/// Root mean square error of the shaded image, relative to the mean radiance of the pixels that show the medium.
struct ImageError {
  double value = 0.0;
  double standard_error = 0.0;
};

/// The voxel image in independent parts, and the error of another grid type against it.
///
/// With A1, B1 of one seed and A2, B2 of another, the mean of (A1 - B1)(A2 - B2) is the square of the true difference:
/// Monte Carlo noise adds variance but no bias. The mean over all pairs of seeds is taken. Equal seeds for A and B keep
/// their paths similar, which reduces the noise of A - B: random directions do not depend on the grid type, and
/// distances depend on it only slightly.
class ImageReference {
 public:
  /// parts: at least two, each with this number of samples per pixel.
  ImageReference(Subject& voxels, std::uint32_t samples, std::uint32_t parts = 2);
  [[nodiscard]] ImageError error_of(Subject& subject) const;
  /// The fraction of pixels that show the medium.
  [[nodiscard]] double coverage() const {
    return static_cast<double>(medium_pixels_) / static_cast<double>(parts_[0].size());
  }

 private:
  std::uint32_t samples_;
  std::vector<std::vector<float>> parts_;  // luminance
  std::size_t medium_pixels_ = 0;
  double mean_ = 0.0;
};

/// Errors of the camera rays' optical depth and of the opacity 1 - exp(-depth); deterministic. Root mean square over
/// all pixels, normalized per pixel that shows the medium and relative to those pixels' mean.
struct DepthError {
  double depth = 0.0;
  double opacity = 0.0;
};

class DepthReference {
 public:
  /// density_scale: of the shaded image.
  DepthReference(Subject& dense, double density_scale, double mean_depth);
  [[nodiscard]] DepthError error_of(Subject& subject) const;

 private:
  [[nodiscard]] std::vector<double> depths(Subject& subject) const;

  double ray_scale_;  ///< small, so that the depth can be computed from the opacity that is read back
  double density_scale_;
  std::vector<double> depth_;
  std::size_t medium_pixels_ = 0;
  double mean_depth_ = 0.0;
  double mean_opacity_ = 0.0;
};

}  // namespace cumulet::bench
