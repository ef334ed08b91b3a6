#include "render/built_grid.hpp"

namespace cumulet::render {

std::uint64_t channel_bytes(grid::Channel channel, std::size_t cells) {
  switch (channel) {
    case grid::Channel::emission:
      return cells * sizeof(grid::EmissionRecord);
    case grid::Channel::color:
      return cells * sizeof(std::uint32_t);
    case grid::Channel::anisotropy:
      return cells * sizeof(std::int16_t);
    case grid::Channel::velocity:
      break;
  }
  return cells * sizeof(glm::uvec2);
}

std::uint64_t BuiltGrid::bytes() const {
  if (grid) return 0;
  std::uint64_t bytes = std::uint64_t{count} * (sizeof(grid::CellRecord) + 4) + 28 * sizeof(std::uint32_t);
  for (std::size_t i = 0; i < channels.size(); ++i) {
    if (channels[i]) bytes += channel_bytes(static_cast<grid::Channel>(i), count);
  }
  return bytes;
}

}  // namespace cumulet::render
