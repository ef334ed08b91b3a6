#include "grid/memory.hpp"

#include "grid/tet_grid.hpp"

namespace cumulet::grid {

std::uint64_t channel_bytes(Channel channel, std::size_t cells) {
  switch (channel) {
    case Channel::emission:
      return cells * sizeof(EmissionRecord);
    case Channel::color:
      return cells * sizeof(std::uint32_t);
    case Channel::anisotropy:
      return cells * sizeof(std::int16_t);
    case Channel::velocity:
      break;
  }
  return cells * sizeof(glm::uvec2);
}

std::uint64_t building_bytes_per_cell(bool emits) {
  // A tree with n leaves has fewer than n inner cells.
  return 2 * tree_cell_bytes + (emits ? glowing_words * sizeof(std::uint32_t) : 0);
}

std::uint64_t building_bytes_at_least() { return clear_bytes; }

}  // namespace cumulet::grid
