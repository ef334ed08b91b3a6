#pragma once

#include <array>

#include "viewer/settings.hpp"

namespace cumulet::test {

/// A grid type and the kind of its cells.
struct MarchKind {
  render::March march;
  grid::CellKind cells;
};
inline constexpr std::array<MarchKind, 4> march_kinds{{{render::March::tet, grid::CellKind::linear},
                                                       {render::March::tet, grid::CellKind::constant},
                                                       {render::March::dense, grid::CellKind::constant},
                                                       {render::March::brick, grid::CellKind::constant}}};

/// Grid settings with this threshold. A negative threshold refines down to the voxels.
inline viewer::GridSettings settings_of(const MarchKind& kind, double threshold = -1.0) {
  viewer::GridSettings s;
  s.build.march = kind.march;
  s.build.refine.cells = kind.cells;
  s.build.refine.threshold = threshold;
  return s;
}

}  // namespace cumulet::test
