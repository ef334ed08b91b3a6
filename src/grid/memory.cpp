#include "grid/memory.hpp"

namespace cumulet::grid {

std::uint64_t building_bytes_per_cell(bool emits) {
  // A tree with n leaves has fewer than n inner cells.
  return 2 * tree_cell_bytes + (emits ? glowing_words * sizeof(std::uint32_t) : 0);
}

std::uint64_t building_bytes_at_least() { return clear_bytes; }

}  // namespace cumulet::grid
