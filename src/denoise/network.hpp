#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "denoise/tza.hpp"

namespace cumulet::denoise {

/// Where a convolution's channels come from: the network's input, or a convolution's result by its place in the list.
struct Source {
  std::optional<std::size_t> convolution;  ///< none: the network's input
  bool enlarged = false;                   ///< twice in both directions, the nearest
};

/// A convolution of 3x3 with what comes before and after it: sources one after the other, zeros around them; a bias;
/// nothing below 0; and the largest of each 2x2, where it is pooled.
struct Convolution {
  std::string_view name;
  std::vector<Source> sources;
  bool pooled = false;
  std::uint32_t inputs = 0;    ///< channels of all sources
  std::uint32_t outputs = 0;   ///< channels
  unsigned level = 0;          ///< it works at a size of the picture's >> level
  std::vector<float> weights;  ///< of [output][input][y][x]
  std::vector<float> biases;
};

/// A U-Net of Open Image Denoise: what is written of its training (training/model.py there) and the tensors' shapes
/// say the same. Sides of what it works on are multiples of `alignment`.
struct Network {
  static constexpr unsigned alignment = 16;
  /// Pixels around one that its result depends on, in whole alignments: radii of the convolutions, each times its
  /// level's pixels, are 79, and places in pooled blocks add up to 15.
  static constexpr unsigned reach = 96;
  static constexpr std::size_t convolution_count = 16;

  std::uint32_t inputs = 0;  ///< 3: colour; 9: colour, albedo, normal
  std::array<Convolution, convolution_count> convolutions;
  /// Multiplications (with an addition each) a pixel.
  [[nodiscard]] double multiply_adds() const;
};

using NetworkPtr = std::shared_ptr<const Network>;

/// Of an archive's tensors. name: what messages begin with. Throws Error(file) that names the tensor which is not
/// there, or not of the shape that those before it ask for.
NetworkPtr make_network(const TensorArchive& archive, const std::string& name);

}  // namespace cumulet::denoise
