#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "denoise/network.hpp"

namespace cumulet::denoise {

/// Channels that kernels read and write at once (a uvec4 per pixel), and output channels per work group.
inline constexpr std::uint32_t block_channels = 8;
inline constexpr std::uint32_t group_channels = 16;

constexpr std::uint32_t divided_up(std::uint32_t value, std::uint32_t by) { return (value + by - 1) / by; }

/// Number of channel blocks: the network's input is padded to whole blocks, results to whole groups.
std::uint32_t input_blocks(const Network& network);
std::uint32_t result_blocks(const Convolution& convolution);

/// Padding around an image: its own pixels, mirrored, so that pixels at the border are denoised as well as others.
inline constexpr std::uint32_t rim = 16;

/// A part of an image that is denoised separately, in pixels of the padded image.
struct Tile {
  glm::uvec2 begin{0U};
  glm::uvec2 size{0U};  ///< multiples of Network::alignment; may extend beyond the padded image
  /// The region where the result equals denoising without tiles. These regions cover the padded image.
  glm::uvec2 keep_begin{0U};
  glm::uvec2 keep_end{0U};
};

/// Splits a padded image into tiles of at most that many pixels. Tiles keep at least 64 pixels per axis plus the pixels
/// that these depend on, even if that exceeds the limit.
std::vector<Tile> tiles_of(glm::uvec2 picture, std::uint64_t max_pixels);

/// Offsets of a tile's channels while it is denoised: memory that is no longer needed is reused.
struct Memory {
  std::uint32_t input = 0;                                          ///< all in uvec4
  std::array<std::uint32_t, Network::convolution_count> results{};  ///< unused for the last, which writes the image
  std::uint32_t size = 0;
};

/// Returns the layout for tiles up to that size.
Memory memory_of(const Network& network, glm::uvec2 tile);

}  // namespace cumulet::denoise
