#include "error.hpp"

#include <algorithm>
#include <cmath>

namespace cumulet::bench {

namespace {

constexpr std::uint32_t seed_1 = 101;
constexpr std::uint32_t seed_2 = 202;

std::vector<float> luminance(const std::vector<float>& rgba) {
  std::vector<float> result(rgba.size() / 4);
  for (std::size_t i = 0; i < result.size(); ++i) {
    result[i] = 0.2126F * rgba[4 * i] + 0.7152F * rgba[4 * i + 1] + 0.0722F * rgba[4 * i + 2];
  }
  return result;
}

}  // namespace

ImageReference::ImageReference(Subject& voxels, std::uint32_t samples) : samples_(samples) {
  const Run a = voxels.shaded(samples, seed_1);
  const Run b = voxels.shaded(samples, seed_2);
  first_ = luminance(a.rgba);
  second_ = luminance(b.rgba);
  shows_medium_.resize(first_.size());
  for (std::size_t i = 0; i < first_.size(); ++i) {
    shows_medium_[i] = a.rgba[4 * i + 3] + b.rgba[4 * i + 3] > 0.0F ? 1 : 0;
    if (shows_medium_[i] == 0) continue;
    ++medium_pixels_;
    mean_ += 0.5 * (first_[i] + second_[i]);
  }
  mean_ /= static_cast<double>(std::max<std::size_t>(1, medium_pixels_));
}

ImageError ImageReference::error_of(Subject& subject) const {
  const std::vector<float> a = luminance(subject.shaded(samples_, seed_1).rgba);
  const std::vector<float> b = luminance(subject.shaded(samples_, seed_2).rgba);
  double sum = 0.0;
  double square = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const double product = (double{a[i]} - first_[i]) * (double{b[i]} - second_[i]);
    sum += product;
    square += product * product;
  }
  const auto pixels = static_cast<double>(std::max<std::size_t>(1, medium_pixels_));
  const double scale = 1.0 / (mean_ * mean_);
  const double mean = sum / pixels * scale;
  const double deviation = std::sqrt(square) / pixels * scale;
  ImageError error;
  error.value = std::sqrt(std::max(0.0, mean));
  // d sqrt(x) = dx / (2 sqrt(x)); near zero the root of the deviation bounds it.
  error.standard_error = mean > deviation ? 0.5 * deviation / error.value : std::sqrt(deviation);
  return error;
}

DepthReference::DepthReference(Subject& dense, double density_scale, double mean_depth)
    : ray_scale_(density_scale * 0.2 / std::max(mean_depth, 1e-30)), density_scale_(density_scale) {
  depth_ = depths(dense);
  for (const double depth : depth_) {
    if (depth <= 0.0) continue;
    ++medium_pixels_;
    mean_depth_ += depth;
    mean_opacity_ += 1.0 - std::exp(-depth);
  }
  const auto pixels = static_cast<double>(std::max<std::size_t>(1, medium_pixels_));
  mean_depth_ /= pixels;
  mean_opacity_ /= pixels;
}

std::vector<double> DepthReference::depths(Subject& subject) const {
  const Run run = subject.primary(ray_scale_);
  std::vector<double> result(run.rgba.size() / 4);
  for (std::size_t i = 0; i < result.size(); ++i) {
    const double opacity = std::min(double{run.rgba[4 * i + 3]}, 1.0 - 1e-7);
    result[i] = -std::log1p(-opacity) * density_scale_ / ray_scale_;
  }
  return result;
}

DepthError DepthReference::error_of(Subject& subject) const {
  const std::vector<double> other = depths(subject);
  DepthError error;
  for (std::size_t i = 0; i < other.size(); ++i) {
    const double d = other[i] - depth_[i];
    const double o = std::exp(-depth_[i]) - std::exp(-other[i]);
    error.depth += d * d;
    error.opacity += o * o;
  }
  const auto pixels = static_cast<double>(std::max<std::size_t>(1, medium_pixels_));
  error.depth = std::sqrt(error.depth / pixels) / mean_depth_;
  error.opacity = std::sqrt(error.opacity / pixels) / mean_opacity_;
  return error;
}

}  // namespace cumulet::bench
