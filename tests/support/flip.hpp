#pragma once

// LDR-FLIP as published: Andersson, Nilsson, Akenine-Moller, Oskarsson, Astrom and Fairchild, "FLIP: A Difference
// Evaluator for Alternating Images", HPG 2020. It estimates the visible difference when a viewer alternates between two
// images.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <numbers>
#include <stdexcept>
#include <vector>

namespace cumulet::test {

class Flip {
 public:
  /// The paper's viewing conditions: a screen 0.7 m wide with 3840 pixels, seen from 0.7 m.
  static constexpr double usual_pixels_per_degree = 0.7 * (3840.0 / 0.7) * std::numbers::pi / 180.0;

  Flip(int width, int height, double pixels_per_degree = usual_pixels_per_degree)
      : width_(width), height_(height), degrees_(pixels_per_degree) {}

  /// The difference of each pixel, from 0 to 1. Images have 4 sRGB-encoded bytes per pixel; alpha is ignored.
  [[nodiscard]] std::vector<double> map(const std::vector<std::uint8_t>& reference,
                                        const std::vector<std::uint8_t>& other) const {
    const Opponent a = opponent(reference);
    const Opponent b = opponent(other);
    const std::vector<glm::dvec3> seen_a = seen(a);
    const std::vector<glm::dvec3> seen_b = seen(b);
    const Features features_a = features(a.y);
    const Features features_b = features(b.y);
    std::vector<double> differences(seen_a.size());
    for (std::size_t i = 0; i < differences.size(); ++i) {
      const double color = redistributed(hyab(seen_a[i], seen_b[i]));
      const double feature = std::max(std::abs(features_a.edges[i] - features_b.edges[i]),
                                      std::abs(features_a.points[i] - features_b.points[i]));
      differences[i] = std::pow(color, 1.0 - std::sqrt(feature / std::numbers::sqrt2));
    }
    return differences;
  }
  /// The mean of map().
  [[nodiscard]] double mean(const std::vector<std::uint8_t>& reference, const std::vector<std::uint8_t>& other) const {
    double sum = 0.0;
    const std::vector<double> differences = map(reference, other);
    for (const double difference : differences) sum += difference;
    return sum / static_cast<double>(std::max<std::size_t>(1, differences.size()));
  }

 private:
  using Plane = std::vector<double>;
  using Kernel = std::vector<double>;  // its middle is the pixel

  // The linear opponent space YyCxCz.
  struct Opponent {
    Plane y, cx, cz;
  };
  struct Features {
    Plane edges, points;
  };

  [[nodiscard]] std::size_t pixels() const {
    return static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_);
  }

  static double decoded(std::uint8_t byte) {
    const double value = byte / 255.0;
    return value > 0.04045 ? std::pow((value + 0.055) / 1.055, 2.4) : value / 12.92;
  }
  // Rec. 709 with D65, divided by the white point.
  static glm::dmat3 xyz_of_rgb() {
    const glm::dmat3 rows(0.4124564, 0.3575761, 0.1804375, 0.2126729, 0.7151522, 0.0721750, 0.0193339, 0.1191920,
                          0.9503041);
    glm::dmat3 m = glm::transpose(rows);
    const glm::dvec3 white = m * glm::dvec3(1.0);
    for (int column = 0; column < 3; ++column) m[column] /= white;
    return m;
  }

  [[nodiscard]] Opponent opponent(const std::vector<std::uint8_t>& rgba) const {
    if (rgba.size() != 4 * pixels()) throw std::invalid_argument("a picture of another size");
    const glm::dmat3 xyz = xyz_of_rgb();
    Opponent result{Plane(pixels()), Plane(pixels()), Plane(pixels())};
    for (std::size_t i = 0; i < pixels(); ++i) {
      const glm::dvec3 p = xyz * glm::dvec3(decoded(rgba[4 * i]), decoded(rgba[4 * i + 1]), decoded(rgba[4 * i + 2]));
      result.y[i] = 116.0 * p.y - 16.0;
      result.cx[i] = 500.0 * (p.x - p.y);
      result.cz[i] = 200.0 * (p.y - p.z);
    }
    return result;
  }

  // Pixels at the edge are repeated beyond the image.
  [[nodiscard]] Plane filtered(const Plane& from, const Kernel& along_x, const Kernel& along_y) const {
    const auto half_x = static_cast<int>(along_x.size() / 2);
    const auto half_y = static_cast<int>(along_y.size() / 2);
    const auto at = [this](int x, int y) {
      return static_cast<std::size_t>(std::clamp(y, 0, height_ - 1)) * static_cast<std::size_t>(width_) +
             static_cast<std::size_t>(std::clamp(x, 0, width_ - 1));
    };
    Plane rows(pixels());
    Plane result(pixels());
    for (int y = 0; y < height_; ++y) {
      for (int x = 0; x < width_; ++x) {
        double sum = 0.0;
        for (int d = -half_x; d <= half_x; ++d)
          sum += along_x[static_cast<std::size_t>(d + half_x)] * from[at(x + d, y)];
        rows[at(x, y)] = sum;
      }
    }
    for (int y = 0; y < height_; ++y) {
      for (int x = 0; x < width_; ++x) {
        double sum = 0.0;
        for (int d = -half_y; d <= half_y; ++d)
          sum += along_y[static_cast<std::size_t>(d + half_y)] * rows[at(x, y + d)];
        result[at(x, y)] = sum;
      }
    }
    return result;
  }

  template <class Function>
  static Kernel kernel(int radius, Function&& function) {
    Kernel result;
    for (int d = -radius; d <= radius; ++d) result.push_back(function(static_cast<double>(d)));
    return result;
  }
  static double sum_of(const Kernel& values) {
    double sum = 0.0;
    for (const double value : values) sum += value;
    return sum;
  }

  // Contrast sensitivity of one channel: a sum of Gaussians a sqrt(pi / b) exp(-(pi r)^2 / b), r in degrees.
  struct Gaussian {
    double a, b;
  };
  [[nodiscard]] Plane blurred(const Plane& from, const std::vector<Gaussian>& sensitivity) const {
    constexpr double widest = 0.04;
    const auto radius =
        static_cast<int>(std::ceil(3.0 * std::sqrt(widest / (2.0 * std::numbers::pi * std::numbers::pi)) * degrees_));
    Plane result(from.size(), 0.0);
    double total = 0.0;
    for (const Gaussian& g : sensitivity) {
      const Kernel k = kernel(radius, [&](double d) {
        const double r = std::numbers::pi * d / degrees_;
        return std::exp(-r * r / g.b);
      });
      const double weight = g.a * std::sqrt(std::numbers::pi / g.b);
      const Plane part = filtered(from, k, k);
      for (std::size_t i = 0; i < result.size(); ++i) result[i] += weight * part[i];
      total += weight * sum_of(k) * sum_of(k);
    }
    for (double& value : result) value /= total;
    return result;
  }

  static double cube_root(double t) {
    constexpr double delta = 6.0 / 29.0;
    return t > delta * delta * delta ? std::cbrt(t) : t / (3.0 * delta * delta) + 4.0 / 29.0;
  }
  // CIELAB of a linear color. Its chroma is reduced with the lightness (Hunt effect).
  static glm::dvec3 hunted(const glm::dvec3& xyz) {
    const double fy = cube_root(xyz.y);
    const double lightness = 116.0 * fy - 16.0;
    return {lightness, 0.01 * lightness * 500.0 * (cube_root(xyz.x) - fy),
            0.01 * lightness * 200.0 * (fy - cube_root(xyz.z))};
  }
  [[nodiscard]] std::vector<glm::dvec3> seen(const Opponent& picture) const {
    const Plane y = blurred(picture.y, {{1.0, 0.0047}});
    const Plane cx = blurred(picture.cx, {{1.0, 0.0053}});
    const Plane cz = blurred(picture.cz, {{34.1, 0.04}, {13.5, 0.025}});
    const glm::dmat3 to_xyz = xyz_of_rgb();
    const glm::dmat3 to_rgb = glm::inverse(to_xyz);
    std::vector<glm::dvec3> result;
    for (std::size_t i = 0; i < y.size(); ++i) {
      const double luminance = (y[i] + 16.0) / 116.0;
      const glm::dvec3 xyz(luminance + cx[i] / 500.0, luminance, luminance - cz[i] / 200.0);
      result.push_back(hunted(to_xyz * glm::clamp(to_rgb * xyz, 0.0, 1.0)));
    }
    return result;
  }
  static double hyab(const glm::dvec3& a, const glm::dvec3& b) {
    return std::abs(a.x - b.x) + std::hypot(a.y - b.y, a.z - b.z);
  }
  // Maps a difference to [0, 1]. Differences above 0.4 of the maximum (that of green and blue) map to the last
  // twentieth.
  static double redistributed(double difference) {
    constexpr double power = 0.7;
    constexpr double knee = 0.4;
    constexpr double value_at_knee = 0.95;
    static const double most = [] {
      const glm::dmat3 xyz = xyz_of_rgb();
      return std::pow(hyab(hunted(xyz[1]), hunted(xyz[2])), power);
    }();
    const double raised = std::pow(difference, power);
    if (raised < knee * most) return value_at_knee / (knee * most) * raised;
    return value_at_knee + (raised - knee * most) / (most - knee * most) * (1.0 - value_at_knee);
  }

  // Strength of edges and points in the lightness (0 to 1), from first and second derivatives of a Gaussian.
  [[nodiscard]] Features features(const Plane& opponent_y) const {
    constexpr double feature_degrees = 0.082;
    const double deviation = 0.5 * feature_degrees * degrees_;
    const auto radius = static_cast<int>(std::ceil(3.0 * deviation));
    const auto gauss = [&](double d) { return std::exp(-d * d / (2.0 * deviation * deviation)); };
    Kernel smooth = kernel(radius, gauss);
    const double sum = sum_of(smooth);
    for (double& value : smooth) value /= sum;
    const Kernel first = balanced(kernel(radius, [&](double d) { return -d * gauss(d); }));
    const Kernel second =
        balanced(kernel(radius, [&](double d) { return (d * d / (deviation * deviation) - 1.0) * gauss(d); }));
    Plane lightness(opponent_y.size());
    for (std::size_t i = 0; i < lightness.size(); ++i) lightness[i] = (opponent_y[i] + 16.0) / 116.0;
    const auto magnitude = [&](const Kernel& derivative) {
      Plane across = filtered(lightness, derivative, smooth);
      const Plane down = filtered(lightness, smooth, derivative);
      for (std::size_t i = 0; i < across.size(); ++i) across[i] = std::hypot(across[i], down[i]);
      return across;
    };
    return {magnitude(first), magnitude(second)};
  }
  // Scales positive values to the sum 1 and negative values to the sum -1.
  static Kernel balanced(Kernel values) {
    double positive = 0.0;
    double negative = 0.0;
    for (const double value : values) (value > 0.0 ? positive : negative) += std::abs(value);
    for (double& value : values) value /= value > 0.0 ? positive : negative;
    return values;
  }

  int width_;
  int height_;
  double degrees_;
};

}  // namespace cumulet::test
