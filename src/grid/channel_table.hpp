#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "grid/cell.hpp"
#include "grid/rgb_field.hpp"
#include "grid/tet_grid.hpp"

namespace cumulet::grid {

/// Quantities that cells store beside density, each in a record of its own.
enum class Channel {
  emission = CM_CHANNEL_EMISSION,
  color = CM_CHANNEL_COLOR,
  anisotropy = CM_CHANNEL_ANISOTROPY,
  velocity = CM_CHANNEL_VELOCITY
};

/// The properties of a channel that budgets, lattices and uploads need.
struct ChannelRow {
  Channel channel;
  std::size_t record_bytes;                                    ///< of one cell: 16, 8, 4 or 2
  std::size_t numbers;                                         ///< values per voxel (ChannelNumbers)
  bool (*is_in)(const Channels& fields);                       ///< whether a volume has the channel
  std::span<const std::byte> (*records)(const TetGrid& grid);  ///< empty: the grid does not have the channel
};

/// Indexed by Channel.
inline constexpr std::array channel_table{
    ChannelRow{Channel::emission, sizeof(EmissionRecord), 3, [](const Channels& f) { return f.emission != nullptr; },
               [](const TetGrid& grid) { return std::as_bytes(std::span(grid.emission)); }},
    ChannelRow{Channel::color, sizeof(std::uint32_t), 4, [](const Channels& f) { return f.scattering != nullptr; },
               [](const TetGrid& grid) { return std::as_bytes(std::span(grid.color)); }},
    ChannelRow{Channel::anisotropy, sizeof(std::int16_t), 2, [](const Channels& f) { return f.forward != nullptr; },
               [](const TetGrid& grid) { return std::as_bytes(std::span(grid.anisotropy)); }},
    ChannelRow{Channel::velocity, sizeof(glm::uvec2), 4, [](const Channels& f) { return f.momentum != nullptr; },
               [](const TetGrid& grid) { return std::as_bytes(std::span(grid.velocity)); }}};
static_assert([] {
  for (std::size_t i = 0; i < channel_table.size(); ++i) {
    if (channel_table[i].channel != static_cast<Channel>(i)) return false;
  }
  return true;
}());

[[nodiscard]] constexpr std::size_t index_of(Channel channel) { return static_cast<std::size_t>(channel); }
[[nodiscard]] constexpr const ChannelRow& row_of(Channel channel) { return channel_table[index_of(channel)]; }
/// Returns the size of the records of a channel.
[[nodiscard]] constexpr std::uint64_t channel_bytes(Channel channel, std::size_t cells) {
  return cells * row_of(channel).record_bytes;
}

}  // namespace cumulet::grid
