#pragma once

// An independent path tracer: delta tracking over the voxels, no NEE towards the sky, no Russian roulette;
// transmittance towards the sun by delta tracking. It shares only the definition of the medium with glsl/.

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>
#include <numbers>
#include <optional>
#include <random>

#include "grid/cube.hpp"
#include "support/interpolated.hpp"
#include "support/volumes.hpp"

namespace cumulet::test {

/// A medium in the light of a sun and a sky. Default: sun at azimuth 40 and elevation 25 degrees.
struct TrackedMedium {
  double scale = 0.6;
  glm::dvec3 albedo{0.95, 0.8, 0.5};
  double anisotropy = 0.4;
  glm::dvec3 sun = to_sun(40.0, 25.0);
  glm::dvec3 irradiance{3.0, 2.5, 2.0};
  glm::dvec3 sky{0.3, 0.5, 0.8};
  glm::dvec3 emission{0.2, 0.1, 0.05};

  /// Direction to the sun. Both angles in degrees.
  static glm::dvec3 to_sun(double azimuth, double elevation) {
    azimuth *= std::numbers::pi / 180.0;
    elevation *= std::numbers::pi / 180.0;
    return {std::sin(azimuth) * std::cos(elevation), std::sin(elevation), std::cos(azimuth) * std::cos(elevation)};
  }
};

/// Mean radiance of an image, and its standard error.
struct TrackedMean {
  glm::dvec3 radiance;
  glm::dvec3 error;
};

class DeltaTracker {
 public:
  DeltaTracker(const volume::ScalarVolume& volume, grid::Interpolation interpolation, const TrackedMedium& medium)
      : volume_(&volume), interpolation_(interpolation), medium_(medium) {}

  glm::dvec3 path(glm::dvec3 o, glm::dvec3 d) {
    const double g = medium_.anisotropy;
    glm::dvec3 weight(1.0);
    glm::dvec3 radiance(0.0);
    while (true) {
      const auto hit = collide(o, d);
      if (!hit) return radiance + weight * medium_.sky;
      o = *hit;
      radiance += weight * medium_.emission;
      weight *= medium_.albedo;
      const double cosine = glm::dot(d, medium_.sun);
      const double phase = (1.0 - g * g) / (4.0 * std::numbers::pi * std::pow(1.0 + g * g - 2.0 * g * cosine, 1.5));
      if (!collide(o, medium_.sun)) radiance += weight * phase * medium_.irradiance;
      d = scatter(d);
    }
  }

  /// Renders a square image. fovy: degrees.
  TrackedMean view(const glm::dvec3& eye, const glm::dvec3& target, double fovy, int paths) {
    const glm::dvec3 forward = glm::normalize(target - eye);
    const glm::dvec3 right = glm::normalize(glm::cross(forward, glm::dvec3(0, 1, 0)));
    const glm::dvec3 up = glm::cross(right, forward);
    const double tangent = std::tan(0.5 * fovy * std::numbers::pi / 180.0);
    glm::dvec3 sum(0.0);
    glm::dvec3 square(0.0);
    for (int i = 0; i < paths; ++i) {
      const glm::dvec3 d =
          glm::normalize(forward + tangent * (2.0 * uniform() - 1.0) * right + tangent * (2.0 * uniform() - 1.0) * up);
      const glm::dvec3 radiance = path(eye, d);
      sum += radiance;
      square += radiance * radiance;
    }
    const glm::dvec3 mean = sum / double(paths);
    return {mean, glm::sqrt((square / double(paths) - mean * mean) / double(paths))};
  }

 private:
  double uniform() { return uniform_(engine_); }
  [[nodiscard]] double density(const glm::dvec3& p) const {
    if (interpolation_ == grid::Interpolation::linear) return value_between(*volume_, p);
    return value_at(*volume_, glm::ivec3(glm::floor(p + 0.5)));
  }
  std::optional<glm::dvec3> collide(const glm::dvec3& o, const glm::dvec3& d) {
    const double border = interpolation_ == grid::Interpolation::linear ? 1.0 : 0.5;
    const glm::dvec3 low = glm::dvec3(volume_->bounds_min) - border;
    const glm::dvec3 high = glm::dvec3(volume_->bounds_max) + border;
    double t0 = 0.0;
    double t1 = 1e30;
    for (int axis = 0; axis < 3; ++axis) {
      const double a = (low[axis] - o[axis]) / d[axis];
      const double b = (high[axis] - o[axis]) / d[axis];
      t0 = std::max(t0, std::min(a, b));
      t1 = std::min(t1, std::max(a, b));
    }
    const double majorant = medium_.scale * volume_->max_value;
    for (double t = t0;;) {
      t -= std::log(1.0 - uniform()) / majorant;
      if (t >= t1) return std::nullopt;
      const glm::dvec3 p = o + t * d;
      if (uniform() * volume_->max_value < density(p)) return p;
    }
  }
  glm::dvec3 scatter(const glm::dvec3& d) {
    // Rejection sampling, so that no inversion formula is shared.
    const double g = medium_.anisotropy;
    while (true) {
      const double z = 2.0 * uniform() - 1.0;
      const double angle = 2.0 * std::numbers::pi * uniform();
      const double r = std::sqrt(1.0 - z * z);
      const glm::dvec3 w(r * std::cos(angle), r * std::sin(angle), z);
      const double value = (1.0 - g * g) / std::pow(1.0 + g * g - 2.0 * g * glm::dot(d, w), 1.5);
      const double most = (1.0 + std::abs(g)) / ((1.0 - std::abs(g)) * (1.0 - std::abs(g)));
      if (uniform() * most < value) return w;
    }
  }

  const volume::ScalarVolume* volume_;
  grid::Interpolation interpolation_;
  TrackedMedium medium_;
  std::mt19937_64 engine_{12345};
  std::uniform_real_distribution<double> uniform_{0.0, 1.0};
};

}  // namespace cumulet::test
