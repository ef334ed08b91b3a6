#include "grid/clear_cones.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <vector>

#include "base/progress_part.hpp"
#include "grid/cell.hpp"

namespace cumulet::grid {

namespace {

using glm::ivec3;
using glm::uvec2;

constexpr auto side = static_cast<int>(CM_CLEAR_SIDE);

// Rows of cubes, one bit per cube.
using Rows = std::vector<uvec2>;
void set(std::uint32_t& word, std::uint32_t bits) {
  if (bits == 0) return;
#ifdef __cpp_lib_atomic_ref
  std::atomic_ref(word).fetch_or(bits, std::memory_order_relaxed);
#else  // libc++ before version 19
  __atomic_fetch_or(&word, bits, __ATOMIC_RELAXED);
#endif
}

bool is_empty(const TetGrid& grid, std::size_t cell) {
  return core::cm_record_is_empty(grid.cells[cell].data) && (grid.change.empty() || grid.change[cell] == uvec2(0U));
}

class ClearMap {
 public:
  explicit ClearMap(const TetGrid& grid)
      : map_(core::cm_clear_map(glm::uvec3(grid.content_min), glm::uvec3(grid.content_max))) {
    for (Rows& rows : full_) rows.assign(CM_CLEAR_ROWS, uvec2(0U));
    for (Rows& rows : clear_) rows.resize(CM_CLEAR_ROWS);
  }
  /// Marks the cubes that a cell touches as occupied. Thread-safe.
  void fill(const glm::vec3& v0, std::uint32_t shape) {
    const core::CmClearRange range = core::cm_clear_range(v0, shape, map_);
    for_cubes(range, [&](const ivec3& at) {
      if (!core::cm_clear_touches(v0, shape, map_, at, range.step)) return;
      for (int i = 0; i < range.step; ++i) {
        for (int j = 0; j < range.step; ++j) {
          fill(full_[CM_CLEAR_ALONG_X], at.z + i, at.y + j, core::cm_clear_bits(at.x, range.step));
          fill(full_[CM_CLEAR_ALONG_Z], at.x + i, at.y + j, core::cm_clear_bits(at.z, range.step));
        }
      }
    });
  }
  /// Computes the clear cubes of every cone. Must be called after the last fill().
  void sweep() {
    tbb::parallel_for(std::uint32_t{0}, CM_CLEAR_CONES, [this](std::uint32_t cone) { sweep(cone); });
  }
  [[nodiscard]] std::uint32_t cones(const glm::vec3& v0, std::uint32_t shape) const {
    const core::CmClearRange range = core::cm_clear_range(v0, shape, map_);
    if (range.step > 1 || !core::cm_clear_has(range)) return 0;
    std::uint32_t cones = (1U << CM_CLEAR_CONES) - 1U;
    for_cubes(range, [&](const ivec3& at) {
      if (!core::cm_clear_touches(v0, shape, map_, at, 1)) return;
      for (std::uint32_t cone = 0; cone < CM_CLEAR_CONES; ++cone) {
        const uvec2 row = clear_[cone][core::cm_clear_row_of_cube(cone, at)];
        const std::uint32_t bit = core::cm_clear_bit_of_cube(cone, at);
        if ((row[bit / 32] >> (bit % 32) & 1U) == 0) cones &= ~(1U << cone);
      }
    });
    return cones;
  }

 private:
  template <class Visit>
  static void for_cubes(const core::CmClearRange& range, const Visit& visit) {
    ivec3 at;
    for (at.z = range.first.z; at.z <= range.last.z; at.z += range.step) {
      for (at.y = range.first.y; at.y <= range.last.y; at.y += range.step) {
        for (at.x = range.first.x; at.x <= range.last.x; at.x += range.step) visit(at);
      }
    }
  }
  // The cubes of a large cell are tested in groups of step^3 cubes, so some of them may lie outside the map.
  static void fill(Rows& rows, int layer, int y, const uvec2& bits) {
    if (layer < 0 || layer >= side || y < 0 || y >= side) return;
    uvec2& row = rows[static_cast<std::uint32_t>(layer * side + y)];
    set(row.x, bits.x);
    set(row.y, bits.y);
  }
  void sweep(std::uint32_t cone) {
    const Rows& full = full_[core::cm_clear_rows(cone)];
    const bool rows_up = core::cm_clear_up(cone, core::cm_clear_axis_of_rows(cone));
    const bool bits_up = core::cm_clear_up(cone, core::cm_clear_axis_of_bits(cone));
    std::array<uvec2, CM_CLEAR_SIDE> behind;
    behind.fill(uvec2(~0U));
    for (std::uint32_t i = 0; i < CM_CLEAR_SIDE; ++i) {
      const std::uint32_t layer = core::cm_clear_up(cone, cone / 8) ? CM_CLEAR_SIDE - 1 - i : i;
      std::array<uvec2, CM_CLEAR_SIDE> here;
      for (std::uint32_t row = 0; row < CM_CLEAR_SIDE; ++row) {
        const std::uint32_t beside = rows_up ? row + 1 : row - 1;
        const bool inside = beside < CM_CLEAR_SIDE;
        const std::uint32_t at = core::cm_clear_row_of_layer(cone, layer, row);
        const uvec2 full_beside = inside ? full[core::cm_clear_row_of_layer(cone, layer, beside)] : uvec2(0U);
        here[row] =
            core::cm_clear_row(full[at], full_beside, behind[row], inside ? behind[beside] : uvec2(~0U), bits_up);
        clear_[cone][at] = here[row];
      }
      behind = here;
    }
  }

  core::CmClearMap map_;
  std::array<Rows, 2> full_;
  std::array<Rows, CM_CLEAR_CONES> clear_;
};

}  // namespace

void find_clear_cones(TetGrid& grid, Progress* progress) {
  ClearMap map(grid);
  ProgressPart part(progress, 0.9, 1.0, 2 * grid.cells.size());
  const bool wide = grid.cube.wide();
  const auto for_cells = [&](bool empty, const auto& visit) {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, grid.cells.size(), 4096), [&](const auto& range) {
      for (std::size_t i = range.begin(); i != range.end(); ++i) {
        const glm::uvec4& data = grid.cells[i].data;
        if (is_empty(grid, i) == empty) visit(i, core::cm_record_v0(data, wide), core::cm_record_shape(data, wide));
      }
      part.add(range.size());
    });
  };
  for_cells(false, [&](std::size_t, const glm::vec3& v0, std::uint32_t shape) { map.fill(v0, shape); });
  map.sweep();
  for_cells(true, [&](std::size_t i, const glm::vec3& v0, std::uint32_t shape) {
    grid.cells[i].data.w = map.cones(v0, shape);
  });
}

}  // namespace cumulet::grid
