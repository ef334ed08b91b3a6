#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "path/path_blocks.glsl"
#include "render/pacing/dispatch_results.hpp"

namespace cumulet::render {

/// Adaptive sampler: decides which pixels of a picture are sampled further, so that the noise reaches a target with few
/// samples.
///
/// A half-block is the even or the odd rows of a block of 8 x 8 pixels. For half-blocks of w pixels with a standard
/// deviation s per sample, sum(w s^2 / n) is the squared error. The allocation n ~ s reaches a squared error V with the
/// minimum total sum(w n). Reference: Neyman, "On the Two Different Aspects of the Representative Method", 1934.
/// Half-blocks that already have more samples leave less for the others to do.
/// A half-block stops when it has its n samples. It starts again when n has grown to more than twice its samples. It
/// also starts again when other pixels have 16 times its samples, so that rare light that neither half has sampled is
/// not missed for good.
/// The deviation that decides is that of the other half of the block, because its samples are independent of the
/// half-block's own. The sample count of a pixel must hardly depend on its sample values, which would bias the result.
/// A block without a second half uses the block above. If no half-block continues by this rule although noise is left,
/// the half-blocks' own errors decide.
class Allotment {
 public:
  static constexpr unsigned edge = CM_SQUARE_EDGE;

  /// Starts a picture of this size; all its pixels are sampled.
  void begin(glm::uvec2 size);
  /// Decides which half-blocks continue. errors: of all blocks, row by row. samples: samples per pixel of the
  /// half-blocks that are sampled now.
  void decide(std::span<const SquareError> errors, double noise_target, std::uint32_t samples);
  /// Returns the expected total number of samples of all pixels; most: maximum samples per pixel.
  [[nodiscard]] double expected(double most) const;

  /// Number of blocks in x and y.
  [[nodiscard]] glm::uvec2 squares() const { return squares_; }
  /// Bit 0: the block's even rows are sampled; bit 1: its odd rows.
  [[nodiscard]] std::uint32_t live(glm::uvec2 square) const { return live_[index(square)]; }
  [[nodiscard]] bool is_live(glm::uvec2 pixel) const { return is_live(pixel / edge, pixel.y & 1U); }
  /// Returns how many pixels of the block are sampled.
  [[nodiscard]] std::uint32_t live_pixels(glm::uvec2 square) const;

  /// State for a checkpoint, one byte per block. Together with the pixels' sample counts it is all that restore()
  /// needs.
  [[nodiscard]] std::span<const std::uint8_t> saved() const { return live_; }
  void restore(std::span<const std::uint8_t> saved, const std::function<std::uint32_t(glm::uvec2 pixel)>& samples_of);

 private:
  struct Half {
    std::uint32_t samples = 0;  // per pixel, at the last decision
    double wanted = 0.0;
    double deviation = 0.0;
  };
  [[nodiscard]] std::size_t index(glm::uvec2 square) const { return std::size_t{square.y} * squares_.x + square.x; }
  [[nodiscard]] bool is_live(glm::uvec2 square, unsigned half) const { return (live(square) >> half & 1U) != 0; }
  void set_live(glm::uvec2 square, unsigned half, bool live);
  [[nodiscard]] std::uint32_t pixels(glm::uvec2 square, unsigned half) const;
  // Calls visit with each half-block that has pixels, its block, its number in the block and its pixel count.
  template <class Visit>
  void for_each_half(Visit&& visit);
  // Returns the common ratio deviation / samples at which the total squared error equals `squared`. Half-blocks already
  // below the ratio keep their current error.
  double even_out(double squared);

  glm::uvec2 size_{0U};
  glm::uvec2 squares_{0U};
  std::vector<std::uint8_t> live_;
  std::vector<std::array<Half, 2>> halves_;  // empty until the first decision
  bool decided_ = false;
};

}  // namespace cumulet::render
