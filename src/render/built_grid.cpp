#include "render/built_grid.hpp"

#include "grid/memory.hpp"

namespace cumulet::render {

std::uint64_t BuiltGrid::bytes() const {
  if (grid) return 0;
  std::uint64_t bytes = std::uint64_t{count} * (sizeof(grid::CellRecord) + 4) + 28 * sizeof(std::uint32_t);
  for (std::size_t i = 0; i < channels.size(); ++i) {
    if (channels[i]) bytes += grid::channel_bytes(static_cast<grid::Channel>(i), count);
  }
  return bytes;
}

}  // namespace cumulet::render
