#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "denoise/network.hpp"

namespace cumulet::denoise {

/// Channels that kernels read and write at once, a uvec4 a pixel; and of their results.
inline constexpr std::uint32_t block_channels = 8;
inline constexpr std::uint32_t group_channels = 16;

constexpr std::uint32_t divided_up(std::uint32_t value, std::uint32_t by) { return (value + by - 1) / by; }

/// Blocks of that many channels: the network's input is filled up to a block, results to a group.
std::uint32_t input_blocks(const Network& network);
std::uint32_t result_blocks(const Convolution& convolution);

/// Pixels around a picture that a network sees as well: its own, mirrored, so that its outermost ones are as good as
/// others.
inline constexpr std::uint32_t rim = 16;

/// A part of a picture that is denoised by itself, in pixels of the picture with its rim.
struct Tile {
  glm::uvec2 begin{0U};
  glm::uvec2 size{0U};  ///< multiples of Network::alignment; may go beyond the picture and its rim
  /// Where it is what denoising all at once gives. Of all tiles together: the picture with its rim.
  glm::uvec2 keep_begin{0U};
  glm::uvec2 keep_end{0U};
};

/// Tiles of a picture with its rim, of at most so many pixels each, as far as 64 of them in each direction and what
/// these depend on fit.
std::vector<Tile> tiles_of(glm::uvec2 picture, std::uint64_t most_pixels);

/// Where a tile's channels are while it is denoised: what is needed no more makes room for what comes.
struct Memory {
  std::uint32_t input = 0;                                          ///< in uvec4, as all
  std::array<std::uint32_t, Network::convolution_count> results{};  ///< the last has none: it is the picture
  std::uint32_t size = 0;
};

/// Of tiles up to that size.
Memory memory_of(const Network& network, glm::uvec2 tile);

}  // namespace cumulet::denoise
