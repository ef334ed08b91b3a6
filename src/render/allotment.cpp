#include "render/allotment.hpp"

#include <algorithm>
#include <cmath>

namespace cumulet::render {

void Allotment::begin(glm::uvec2 size) {
  size_ = size;
  squares_ = (size + edge - 1U) / edge;
  const std::size_t count = std::size_t{squares_.x} * squares_.y;
  live_.assign(count, 0);
  halves_.assign(count, {});
  for_each_half([&](const Half&, std::size_t square, unsigned number, double) {
    live_[square] = static_cast<std::uint8_t>(live_[square] | 1U << number);
  });
  decided_ = false;
}

std::uint32_t Allotment::pixels(glm::uvec2 square, unsigned half) const {
  const glm::uvec2 extent = glm::min(glm::uvec2(edge), size_ - edge * square);
  return extent.x * (half == 0 ? (extent.y + 1) / 2 : extent.y / 2);
}

std::uint32_t Allotment::live_pixels(glm::uvec2 square) const {
  const std::uint32_t bits = live(square);
  return ((bits & 1U) != 0 ? pixels(square, 0) : 0) + ((bits & 2U) != 0 ? pixels(square, 1) : 0);
}

template <class Visit>
void Allotment::for_each_half(Visit&& visit) {
  for (unsigned y = 0; y < squares_.y; ++y) {
    for (unsigned x = 0; x < squares_.x; ++x) {
      const glm::uvec2 square(x, y);
      for (unsigned half = 0; half < 2; ++half) {
        const std::uint32_t count = pixels(square, half);
        if (count > 0) visit(halves_[index(square)][half], index(square), half, double(count));
      }
    }
  }
}

double Allotment::even_out(double squared) {
  constexpr int most_steps = 16;
  double least = 0.0;
  for (int step = 0; step < most_steps; ++step) {
    double left = squared;
    double deviations = 0.0;
    for_each_half([&](const Half& half, std::size_t, unsigned, double count) {
      if (half.deviation <= least * half.samples) {
        left -= count * half.deviation * half.deviation / std::max(1U, half.samples);
      } else {
        deviations += count * half.deviation;
      }
    });
    // It only grows, and with it what counts as it is.
    if (deviations <= 0.0 || left / deviations <= least) break;
    least = left / deviations;
  }
  return least;
}

void Allotment::decide(std::span<const SquareError> errors, double noise_target, std::uint32_t samples) {
  constexpr double woken = 2.0;
  constexpr double looked_after = 16.0;
  double brightness = 0.0;
  double all = 0.0;
  for (const SquareError& error : errors) {
    brightness += error.brightness;
    all += error.pixels;
  }
  const double mean = brightness / std::max(1.0, all);
  const double squared = noise_target * mean * noise_target * mean;  // a pixel
  const auto rests = [&](std::size_t square, unsigned half) { return (live_[square] >> half & 1U) == 0; };
  for_each_half([&](Half& half, std::size_t square, unsigned number, double) {
    if (!rests(square, number)) half.samples = samples;
  });
  const auto own = [&](std::size_t square, unsigned half) {
    const glm::uvec2 at(square % squares_.x, square / squares_.x);
    return errors[square].squared.at(half) / std::max(1U, pixels(at, half));
  };
  for_each_half([&](Half& half, std::size_t square, unsigned number, double) {
    const glm::uvec2 at(square % squares_.x, square / squares_.x);
    const bool alone = pixels(at, 1 - number) == 0;
    // Of a last row that is alone the square above; of a picture that is no more than that itself.
    const std::size_t teller = alone && at.y > 0 ? square - squares_.x : square;
    const unsigned other = alone ? number : 1 - number;
    half.deviation = std::sqrt(own(teller, other) * halves_[teller].at(other).samples);
  });
  const double ratio = even_out(squared * all);
  bool any = false;
  for_each_half([&](Half& half, std::size_t square, unsigned number, double) {
    half.wanted = ratio > 0.0 ? half.deviation / ratio : 0.0;
    const bool rested = rests(square, number);
    // What is so rare that neither half has found it is looked for now and then.
    const bool forgotten = rested && samples >= looked_after * half.samples;
    const bool goes_on = half.wanted > (rested ? woken : 1.0) * half.samples || forgotten;
    live_[square] = static_cast<std::uint8_t>((live_[square] & ~(1U << number)) | (goes_on ? 1U << number : 0U));
    any = any || goes_on;
  });
  decided_ = true;
  if (any) return;
  // The halves' own samples show more noise than the others' told.
  for_each_half([&](Half& half, std::size_t square, unsigned number, double) {
    if (own(square, number) <= squared) return;
    half.wanted = own(square, number) / squared * half.samples;
    live_[square] = static_cast<std::uint8_t>(live_[square] | 1U << number);
  });
}

double Allotment::expected(double most) const {
  double sum = 0.0;
  for (unsigned y = 0; y < squares_.y; ++y) {
    for (unsigned x = 0; x < squares_.x; ++x) {
      for (unsigned number = 0; number < 2; ++number) {
        const glm::uvec2 square(x, y);
        const Half& half = halves_[index(square)].at(number);
        const bool goes_on = (live(square) >> number & 1U) != 0;
        const double each = decided_ ? (goes_on ? std::max<double>(half.samples, half.wanted) : half.samples) : most;
        sum += pixels(square, number) * std::min(most, each);
      }
    }
  }
  return sum;
}

void Allotment::restore(std::span<const std::uint8_t> saved,
                        const std::function<std::uint32_t(glm::uvec2 pixel)>& samples_of) {
  std::ranges::copy(saved, live_.begin());
  for_each_half([&](Half& half, std::size_t square, unsigned number, double) {
    const glm::uvec2 at(square % squares_.x, square / squares_.x);
    half.samples = samples_of(edge * at + glm::uvec2(0U, number));
  });
  decided_ = false;
}

}  // namespace cumulet::render
