#include "render/film/allotment.hpp"

#include <algorithm>
#include <cmath>

namespace cumulet::render {

void Allotment::begin(glm::uvec2 size) {
  size_ = size;
  squares_ = (size + edge - 1U) / edge;
  live_.clear();
  live_.reserve(std::size_t{squares_.x} * squares_.y);
  for (unsigned y = 0; y < squares_.y; ++y)
    live_.insert(live_.end(), squares_.x, pixels({0U, y}, 1) > 0 ? std::uint8_t{3} : std::uint8_t{1});
  halves_.clear();
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
        if (count > 0) visit(halves_[index(square)][half], square, half, double(count));
      }
    }
  }
}

double Allotment::even_out(double squared) {
  constexpr int max_steps = 16;
  double least = 0.0;
  for (int step = 0; step < max_steps; ++step) {
    double left = squared;
    double deviations = 0.0;
    for_each_half([&](const Half& half, glm::uvec2, unsigned, double count) {
      if (half.deviation <= least * half.samples) {
        left -= count * half.deviation * half.deviation / std::max(1U, half.samples);
      } else {
        deviations += count * half.deviation;
      }
    });
    // The ratio only grows, and with it the number of half-blocks that keep their current error.
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
  const double squared = noise_target * mean * noise_target * mean;  // per pixel
  halves_.resize(live_.size());
  for_each_half([&](Half& half, glm::uvec2 square, unsigned number, double) {
    if (is_live(square, number)) half.samples = samples;
  });
  const auto own = [&](glm::uvec2 square, unsigned half) {
    return errors[index(square)].squared.at(half) / std::max(1U, pixels(square, half));
  };
  for_each_half([&](Half& half, glm::uvec2 square, unsigned number, double) {
    const bool alone = pixels(square, 1 - number) == 0;
    // If the block has no second half, the block above is used; if there is none above either, the half-block itself.
    const glm::uvec2 teller = alone && square.y > 0 ? square - glm::uvec2(0U, 1U) : square;
    const unsigned other = alone ? number : 1 - number;
    half.deviation = std::sqrt(own(teller, other) * halves_[index(teller)].at(other).samples);
  });
  const double ratio = even_out(squared * all);
  bool any = false;
  for_each_half([&](Half& half, glm::uvec2 square, unsigned number, double) {
    half.wanted = ratio > 0.0 ? half.deviation / ratio : 0.0;
    const bool rests = !is_live(square, number);
    // Rare light that neither half has sampled is looked for again from time to time.
    const bool forgotten = rests && samples >= looked_after * half.samples;
    const bool goes_on = half.wanted > (rests ? woken : 1.0) * half.samples || forgotten;
    set_live(square, number, goes_on);
    any = any || goes_on;
  });
  decided_ = true;
  if (any) return;
  // The half-blocks' own samples show more noise than the other halves' samples do.
  for_each_half([&](Half& half, glm::uvec2 square, unsigned number, double) {
    if (own(square, number) <= squared) return;
    half.wanted = own(square, number) / squared * half.samples;
    set_live(square, number, true);
  });
}

double Allotment::expected(double most) const {
  if (!decided_) return most * size_.x * size_.y;
  double sum = 0.0;
  for (unsigned y = 0; y < squares_.y; ++y) {
    for (unsigned x = 0; x < squares_.x; ++x) {
      for (unsigned number = 0; number < 2; ++number) {
        const glm::uvec2 square(x, y);
        const Half& half = halves_[index(square)].at(number);
        const double each = is_live(square, number) ? std::max<double>(half.samples, half.wanted) : half.samples;
        sum += pixels(square, number) * std::min(most, each);
      }
    }
  }
  return sum;
}

void Allotment::set_live(glm::uvec2 square, unsigned half, bool live) {
  std::uint8_t& bits = live_[index(square)];
  bits = static_cast<std::uint8_t>((bits & ~(1U << half)) | (live ? 1U << half : 0U));
}

void Allotment::restore(std::span<const std::uint8_t> saved,
                        const std::function<std::uint32_t(glm::uvec2 pixel)>& samples_of) {
  std::ranges::copy(saved, live_.begin());
  halves_.resize(live_.size());
  for_each_half([&](Half& half, glm::uvec2 square, unsigned number, double) {
    half.samples = samples_of(edge * square + glm::uvec2(0U, number));
  });
  decided_ = false;
}

}  // namespace cumulet::render
