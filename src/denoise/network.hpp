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

/// A source of a convolution's channels: the network's input, or the result of another convolution, by index.
struct Source {
  std::optional<std::size_t> convolution;  ///< empty: the network's input
  bool enlarged = false;                   ///< upsampled by 2 in both directions, nearest neighbor
};

/// A 3x3 convolution layer: its sources are concatenated and zero-padded. It is followed by bias and ReLU, and by 2x2
/// max pooling if `pooled`.
struct Convolution {
  std::string_view name;
  std::vector<Source> sources;
  bool pooled = false;
  std::uint32_t inputs = 0;    ///< channels of all sources
  std::uint32_t outputs = 0;   ///< channels
  unsigned level = 0;          ///< it runs at the image size >> level
  std::vector<float> weights;  ///< indexed [output][input][y][x]
  std::vector<float> biases;
};

/// A U-Net of Open Image Denoise. The structure follows its training code (training/model.py there) and the tensors'
/// shapes. The sides of its input are multiples of `alignment`.
struct Network {
  static constexpr unsigned alignment = 16;
  /// Receptive-field radius in pixels, rounded up to whole alignments: the radii of the convolutions, each times its
  /// level's pixel size, sum to 79, and positions within pooled blocks add up to 15.
  static constexpr unsigned reach = 96;
  static constexpr std::size_t convolution_count = 16;

  std::uint32_t inputs = 0;  ///< 3: color; 9: color, albedo, normal
  std::array<Convolution, convolution_count> convolutions;
  /// Returns the multiply-adds per pixel.
  [[nodiscard]] double multiply_adds() const;
};

using NetworkPtr = std::shared_ptr<const Network>;

/// Makes a network of an archive's tensors. name: prefix of messages. Throws Error(file) with the name of a tensor that
/// is missing or does not have the shape that the previous tensors require.
NetworkPtr make_network(const TensorArchive& archive, const std::string& name);

}  // namespace cumulet::denoise
