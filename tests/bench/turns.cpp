#include "turns.hpp"

#include <algorithm>
#include <cmath>

#include "base/luminance.hpp"

namespace cumulet::bench {

namespace {

constexpr double noisiest = 0.005;  // fraction of pixels that is ignored, because of fireflies

double luminance_of(const Run& run, std::size_t pixel) {
  const float* rgba = &run.rgba[4 * pixel];
  return luminance(glm::dvec3(rgba[0], rgba[1], rgba[2]));
}

}  // namespace

std::vector<std::size_t> pixels_of(const std::vector<Run>& runs) {
  std::vector<std::size_t> pixels;
  for (std::size_t i = 0; 4 * i < runs.front().rgba.size(); ++i) {
    if (std::ranges::any_of(runs, [i](const Run& run) { return run.rgba[4 * i + 3] > 0.0F; })) pixels.push_back(i);
  }
  return pixels;
}

double mean_of(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(std::max<std::size_t>(1, values.size()));
}

Cost cost_of(const std::vector<Run>& runs, const std::vector<std::size_t>& pixels, std::uint32_t samples) {
  Cost cost;
  for (const Run& run : runs) {
    cost.step.push_back(run.seconds / static_cast<double>(run.steps));
    cost.sample.push_back(run.seconds / static_cast<double>(run.samples));
    cost.steps += run.steps_per_sample() / static_cast<double>(runs.size());
  }
  std::vector<double> variances;
  std::vector<double> means;
  for (const std::size_t pixel : pixels) {
    std::vector<double> values;
    std::array<double, 2> half{};
    for (std::size_t k = 0; k < runs.size(); ++k) {
      values.push_back(luminance_of(runs[k], pixel));
      half[k % 2] += values.back();
    }
    const double mean = mean_of(values);
    double square = 0.0;
    for (const double value : values) square += (value - mean) * (value - mean);
    variances.push_back(square / static_cast<double>(values.size() - 1));
    means.push_back(mean);
    for (std::size_t k = 0; k < 2; ++k)
      cost.halves[k].push_back(half[k] / static_cast<double>((values.size() + 1 - k) / 2));
  }
  std::ranges::sort(variances);
  variances.resize(variances.size() - static_cast<std::size_t>(noisiest * static_cast<double>(variances.size())));
  const double mean = mean_of(means);
  cost.variance = samples * mean_of(variances) / (mean * mean);
  return cost;
}

}  // namespace cumulet::bench
