#include "error.hpp"

#include <algorithm>
#include <cmath>

#include "base/luminance.hpp"

namespace cumulet::bench {

namespace {

std::uint32_t seed_of(std::size_t part) { return static_cast<std::uint32_t>(101 * (part + 1)); }

std::vector<float> luminances(const std::vector<float>& rgba) {
  std::vector<float> result(rgba.size() / 4);
  for (std::size_t i = 0; i < result.size(); ++i) {
    result[i] = luminance(glm::vec3(rgba[4 * i], rgba[4 * i + 1], rgba[4 * i + 2]));
  }
  return result;
}

}  // namespace

ImageReference::ImageReference(Subject& voxels, std::uint32_t samples, std::uint32_t parts) : samples_(samples) {
  std::vector<float> alpha;
  for (std::uint32_t part = 0; part < parts; ++part) {
    const Run run = voxels.shaded(samples, seed_of(part));
    parts_.push_back(luminances(run.rgba));
    alpha.resize(parts_[0].size());
    for (std::size_t i = 0; i < alpha.size(); ++i) alpha[i] += run.rgba[4 * i + 3];
  }
  // Fire without density has no alpha, but is brighter than the uniform sky behind it.
  const bool covers = *std::ranges::max_element(alpha) > 0.0F;
  const float darkest = *std::ranges::min_element(parts_[0]);
  for (std::size_t i = 0; i < alpha.size(); ++i) {
    if (covers ? !(alpha[i] > 0.0F) : parts_[0][i] <= 1.0001F * darkest) continue;
    ++medium_pixels_;
    for (const std::vector<float>& part : parts_) mean_ += part[i] / static_cast<double>(parts);
  }
  mean_ /= static_cast<double>(std::max<std::size_t>(1, medium_pixels_));
}

ImageError ImageReference::error_of(Subject& subject) const {
  std::vector<double> differences(parts_[0].size());
  std::vector<double> squares(parts_[0].size());
  for (std::size_t part = 0; part < parts_.size(); ++part) {
    const std::vector<float> other = luminances(subject.shaded(samples_, seed_of(part)).rgba);
    for (std::size_t i = 0; i < other.size(); ++i) {
      const double difference = double{other[i]} - parts_[part][i];
      differences[i] += difference;
      squares[i] += difference * difference;
    }
  }
  const double pairs = static_cast<double>(parts_.size()) * (static_cast<double>(parts_.size()) - 1.0);
  double sum = 0.0;
  double square = 0.0;
  for (std::size_t i = 0; i < differences.size(); ++i) {
    const double product = (differences[i] * differences[i] - squares[i]) / pairs;
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
