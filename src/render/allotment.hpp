#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "path_blocks.glsl"
#include "render/pace.hpp"

namespace cumulet::render {

/// Which pixels of a picture are sampled on, so that its noise comes down to a target with few samples.
///
/// A half is the even or the odd rows of a square of 8 x 8 pixels. Of halves of w pixels with a sample's deviation s,
/// those n ~ s have a squared error sum(w s^2 / n) of V with the least sum(w n) (Neyman, "On the Two Different Aspects
/// of the Representative Method", 1934), less what those that have more already leave to the others. A half that has
/// its n rests; it is woken where that has come to more than twice as many since, and where others have 16 times as
/// many: rare light that neither half has found is not lost for good. The deviation that decides is that of the
/// square's other half (of a last row that is alone, the square above), whose samples are independent of its own: how
/// many a pixel has says next to nothing of what they are. Only where no half goes on by that, though there is noise
/// left, do their own errors decide.
class Allotment {
 public:
  static constexpr unsigned edge = CM_SQUARE_EDGE;

  /// Of a picture of that size, all of which is sampled.
  void begin(glm::uvec2 size);
  /// Decides anew, where pixels that are sampled have so many samples. errors: of all squares, row by row.
  void decide(std::span<const SquareError> errors, double noise_target, std::uint32_t samples);
  /// Samples of all pixels that it will likely take, with that many of each at most.
  [[nodiscard]] double expected(double most) const;

  /// That there are, in rows.
  [[nodiscard]] glm::uvec2 squares() const { return squares_; }
  /// Of a square: bit 0 its even rows, bit 1 its odd, where they are sampled.
  [[nodiscard]] std::uint32_t live(glm::uvec2 square) const { return live_[index(square)]; }
  [[nodiscard]] bool is_live(glm::uvec2 pixel) const { return is_live(pixel / edge, pixel.y & 1U); }
  /// How many pixels of a square are sampled.
  [[nodiscard]] std::uint32_t live_pixels(glm::uvec2 square) const;

  /// A byte a square: with pixels' samples all that it goes on from.
  [[nodiscard]] std::span<const std::uint8_t> saved() const { return live_; }
  void restore(std::span<const std::uint8_t> saved, const std::function<std::uint32_t(glm::uvec2 pixel)>& samples_of);

 private:
  struct Half {
    std::uint32_t samples = 0;  // a pixel, as of the last decision
    double wanted = 0.0;
    double deviation = 0.0;
  };
  [[nodiscard]] std::size_t index(glm::uvec2 square) const { return std::size_t{square.y} * squares_.x + square.x; }
  [[nodiscard]] bool is_live(glm::uvec2 square, unsigned half) const { return (live(square) >> half & 1U) != 0; }
  void set_live(glm::uvec2 square, unsigned half, bool live);
  [[nodiscard]] std::uint32_t pixels(glm::uvec2 square, unsigned half) const;
  // Calls visit with each half that has pixels, its square, its number there and its pixels.
  template <class Visit>
  void for_each_half(Visit&& visit);
  // What is to be had of s / n in every half: that of V, where those that have it count as they are.
  double even_out(double squared);

  glm::uvec2 size_{0U};
  glm::uvec2 squares_{0U};
  std::vector<std::uint8_t> live_;
  std::vector<std::array<Half, 2>> halves_;  // empty until something is decided
  bool decided_ = false;
};

}  // namespace cumulet::render
