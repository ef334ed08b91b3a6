#include "render/grid/built_grid.hpp"

namespace cumulet::render {

std::uint64_t BuiltGrid::bytes() const {
  if (grid) return 0;
  std::uint64_t bytes = std::uint64_t{count} * (sizeof(grid::CellRecord) + 4) + 28 * sizeof(std::uint32_t);
  for (const grid::ChannelRow& row : grid::channel_table) {
    if (channels[grid::index_of(row.channel)]) bytes += grid::channel_bytes(row.channel, count);
  }
  if (corners) bytes += std::uint64_t{count} * sizeof(glm::uvec4);
  return bytes;
}

}  // namespace cumulet::render
