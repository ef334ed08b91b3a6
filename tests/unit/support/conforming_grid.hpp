#pragma once

// Grids that tests build, and the check that their cells conform.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>

#include "grid/cell.hpp"
#include "grid/grid_builder.hpp"
#include "grid/refine.hpp"
#include "grid/statistics.hpp"

namespace cumulet::test {

struct Built {
  std::unique_ptr<grid::Statistics> statistics;
  grid::TetGrid grid;
};

// Settings of a grid with constant cells that is refined wherever voxels differ.
inline grid::RefineSettings voxel_by_voxel() {
  grid::RefineSettings settings;
  settings.threshold = -1.0;
  settings.cells = grid::CellKind::constant;
  return settings;
}

inline Built build(const volume::ScalarVolume& volume, const grid::RefineSettings& settings) {
  Built built;
  built.statistics = std::make_unique<grid::Statistics>(volume, grid::fit_cube(volume));
  const grid::DiamondSet diamonds(*built.statistics, settings);
  grid::GridBuilder builder(*built.statistics, diamonds);
  builder.bisect();
  built.grid = builder.records(settings.cells, volume.max_value);
  EXPECT_EQ(built.grid.cells.size(), diamonds.cell_count());
  return built;
}

inline std::array<glm::vec3, 4> vertices_of(const grid::CellRecord& cell, bool wide = false) {
  const glm::vec3 v0 = core::cm_record_v0(cell.data, wide);
  const std::uint32_t shape = core::cm_record_shape(cell.data, wide);
  return {v0, core::cm_cell_vertex(v0, shape, 1), core::cm_cell_vertex(v0, shape, 2),
          core::cm_cell_vertex(v0, shape, 3)};
}

inline double volume_of(const std::array<glm::vec3, 4>& v) {
  return std::abs(glm::dot(glm::dvec3(v[1] - v[0]), glm::cross(glm::dvec3(v[2] - v[0]), glm::dvec3(v[3] - v[0])))) /
         6.0;
}

inline constexpr std::array<std::array<unsigned, 4>, 3> opposite{{{3, 1, 2, 0}, {1, 3, 2, 0}, {3, 2, 1, 0}}};

using Face = std::array<std::array<float, 3>, 3>;
inline Face face_of(const grid::CellRecord& cell, unsigned face, bool wide) {
  const auto v = vertices_of(cell, wide);
  const unsigned skip = opposite[core::cm_shape_class(core::cm_record_shape(cell.data, wide))][face];
  Face f{};
  unsigned n = 0;
  for (unsigned i = 0; i < 4; ++i) {
    if (i != skip) f[n++] = {v[i].x, v[i].y, v[i].z};
  }
  std::sort(f.begin(), f.end());
  return f;
}

// Expects that every interior face is shared by exactly two cells that link to each other, and that the volumes add up
// to the cube.
inline void expect_conforming(const grid::TetGrid& grid) {
  double volume = 0.0;
  std::size_t wrong = 0;
  const auto size = static_cast<float>(grid.cube.size());
  const bool wide = grid.cube.wide();
  for (std::uint32_t c = 0; c < grid.cells.size(); ++c) {
    const grid::CellRecord& cell = grid.cells[c];
    const auto v = vertices_of(cell, wide);
    volume += volume_of(v);
    for (unsigned face = 0; face < 4; ++face) {
      const std::uint32_t other = cell.links[static_cast<int>(face)];
      const Face mine = face_of(cell, face, wide);
      if (other == CM_NONE) {
        bool on_boundary = false;
        for (unsigned axis = 0; axis < 3; ++axis) {
          on_boundary = on_boundary || (mine[0][axis] == mine[1][axis] && mine[1][axis] == mine[2][axis] &&
                                        (mine[0][axis] == 0.0F || mine[0][axis] == size));
        }
        wrong += on_boundary ? 0 : 1;
        continue;
      }
      if (other >= grid.cells.size()) {
        ++wrong;
        continue;
      }
      bool matched = false;
      for (unsigned back = 0; back < 4; ++back) {
        matched = matched || (grid.cells[other].links[static_cast<int>(back)] == c &&
                              face_of(grid.cells[other], back, wide) == mine);
      }
      wrong += matched ? 0 : 1;
    }
  }
  EXPECT_EQ(wrong, 0U);
  EXPECT_NEAR(volume / std::pow(double(size), 3.0), 1.0, 1e-9);
}

}  // namespace cumulet::test
