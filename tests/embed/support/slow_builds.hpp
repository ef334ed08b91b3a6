#pragma once

// Grids and surfaces that take long to build.

#include <chrono>
#include <cmath>
#include <vector>

#include "support/c_host.hpp"

namespace cumulet::test {

/// Timeout of a stream; much longer than needed on any test machine.
inline constexpr auto patience = std::chrono::seconds(60);

/// A grid refined to the voxels: building takes many times the interval of requests.
inline cumulet_grid_desc slow_grid() {
  auto grid = make_desc<cumulet_grid_desc>();
  grid.threshold = -1.0;
  return grid;
}

/// A cloth of n x n squares with this width.
inline SurfacesRef make_cloth(int n, float width) {
  std::vector<float> positions;
  std::vector<std::uint32_t> indices;
  const auto at = [n](int x, int y) { return static_cast<std::uint32_t>(y * (n + 1) + x); };
  for (int y = 0; y <= n; ++y) {
    for (int x = 0; x <= n; ++x) {
      const float u = static_cast<float>(x) / static_cast<float>(n);
      const float v = static_cast<float>(y) / static_cast<float>(n);
      positions.insert(positions.end(), {width * u, 0.1F * std::sin(40.0F * u * v), v});
      if (x < n && y < n) {
        for (const auto corner : {at(x, y), at(x, y + 1), at(x + 1, y), at(x + 1, y), at(x, y + 1), at(x + 1, y + 1)}) {
          indices.push_back(corner);
        }
      }
    }
  }
  auto mesh = make_desc<cumulet_mesh_desc>();
  mesh.positions = positions.data();
  mesh.vertex_count = positions.size() / 3;
  mesh.indices = indices.data();
  mesh.index_count = indices.size();
  return cumulet::test::make_surfaces({&mesh, 1});
}

}  // namespace cumulet::test
