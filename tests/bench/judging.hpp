#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

namespace cumulet::bench {

/// The mean of several estimates from independent seeds.
struct Estimate {
  double mean = 0.0;
  double standard_error = 0.0;
};

inline Estimate estimate_of(const std::vector<double>& values) {
  Estimate result;
  const auto count = static_cast<double>(values.size());
  for (const double value : values) result.mean += value / count;
  if (values.size() < 2) return result;
  double square = 0.0;
  for (const double value : values) square += (value - result.mean) * (value - result.mean);
  result.standard_error = std::sqrt(square / (count - 1.0) / count);
  return result;
}

/// relMSE: the mean over pixels and colors of (x - r)^2 / (r^2 + 0.01), of exposed radiance (Rousselle et al. 2011).
/// The reference has two independent halves a and b: the mean of (x - a)(x - b) is the squared distance of x from the
/// truth, so that the reference's own noise adds no bias.
struct RelativeSquareError {
  double most = 0.0;    ///< of all pixels except the worst 0.5 %, which contain fireflies
  double specks = 0.0;  ///< fraction of the total error in the worst 0.5 %
};

inline RelativeSquareError relative_square_error(const std::vector<float>& rgba,
                                                 const std::array<std::vector<float>, 2>& halves, double exposure) {
  std::vector<double> errors(rgba.size() / 4);
  for (std::size_t i = 0; i < rgba.size(); ++i) {
    if (i % 4 == 3) continue;
    const double x = exposure * rgba[i];
    const double a = exposure * halves[0][i];
    const double b = exposure * halves[1][i];
    const double mean = 0.5 * (a + b);
    errors[i / 4] += (x - a) * (x - b) / (mean * mean + 0.01) / 3.0;
  }
  std::ranges::sort(errors);
  const std::size_t kept = errors.size() - errors.size() / 200;
  RelativeSquareError result;
  double worst = 0.0;
  for (std::size_t i = 0; i < errors.size(); ++i) (i < kept ? result.most : worst) += errors[i];
  result.specks = worst / std::max(result.most + worst, 1e-30);
  result.most /= static_cast<double>(std::max<std::size_t>(1, kept));
  return result;
}

/// Displayed luminance, 0 to 1.
inline std::vector<double> display_luminances(const std::vector<std::uint8_t>& rgba) {
  std::vector<double> result(rgba.size() / 4);
  for (std::size_t i = 0; i < result.size(); ++i) {
    result[i] = (0.2126 * rgba[4 * i] + 0.7152 * rgba[4 * i + 1] + 0.0722 * rgba[4 * i + 2]) / 255.0;
  }
  return result;
}

/// Root of the mean of (x - a)(x - b).
inline double root_error(const std::vector<double>& x, const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) sum += (x[i] - a[i]) * (x[i] - b[i]);
  return std::sqrt(std::max(0.0, sum / static_cast<double>(std::max<std::size_t>(1, x.size()))));
}

/// The count at which a falling curve through these points (count, error) has this error, interpolated linearly between
/// logarithms. nullopt if all its errors are larger.
inline std::optional<double> count_as_good(const std::vector<std::pair<double, double>>& curve, double error) {
  for (std::size_t i = 0; i < curve.size(); ++i) {
    const auto [count, here] = curve[i];
    if (here > error) continue;
    if (i == 0) return count;
    const auto [before, above] = curve[i - 1];
    const double part = here > 0.0 && error > 0.0 ? std::log(above / error) / std::log(above / here) : 1.0;
    return before * std::pow(count / before, part);
  }
  return std::nullopt;
}

}  // namespace cumulet::bench
