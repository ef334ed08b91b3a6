#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

// Results of dispatches, as far as they are known. This header is free of GL.

namespace cumulet::render {

/// A block of the lanes that sample a tile's pixels in one pass.
struct Block {
  std::uint32_t unfinished = 0;  // upper bound of the lanes that have a pixel
  std::uint32_t empty = 0;       // lanes of these whose pixel has no sample
  std::uint32_t under_way = 0;   // dispatches in flight
  bool begins = true;
  std::uint32_t list = 0;  // list index: CM_LIST_BIT of glsl/path/path_blocks.glsl
};
using Blocks = std::vector<Block>;

/// Sums over all pixels that have two samples, from which the noise is computed.
struct ErrorSums {
  double squared = 0.0;     // squared standard errors of luminance
  double brightness = 0.0;  // luminances
  double pixels = 0.0;

  ErrorSums& operator+=(const ErrorSums& other);
  /// Returns the root mean square standard error over the mean luminance; 0 for black. Returns nullopt if there are no
  /// pixels or a sum is not finite.
  [[nodiscard]] std::optional<double> noise() const;
};

/// ErrorSums of one adaptive-sampling block, over its pixels with two samples. The squared errors of even and odd rows
/// are separate.
struct SquareError {
  std::array<double, 2> squared{};
  double brightness = 0.0;
  double pixels = 0.0;
};
/// Blocks of a tile, row by row; empty until they are known.
using SquareErrors = std::vector<SquareError>;

/// Samples that are known to be finished, and those among them with nonfinite radiance, which count as black.
struct SampleCount {
  std::uint64_t finished = 0;
  std::uint64_t not_finite = 0;
};

}  // namespace cumulet::render
