#include "grid/cube.hpp"

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>

#include "base/error.hpp"
#include "grid/cell.hpp"

namespace cumulet::grid {

bool Cube::wide() const { return core::cm_is_wide(static_cast<std::uint32_t>(log2_size - 1)); }

Cube fit_cube(const volume::ScalarVolume& volume, const glm::ivec3& bounds_min, const glm::ivec3& bounds_max,
              Interpolation interpolation) {
  const double determinant = glm::determinant(glm::dmat3(volume.index_to_world));
  if (!std::isfinite(determinant) || determinant == 0.0) {
    throw Error(ErrorCode::file, "grid '" + volume.name + "' has a singular transform");
  }
  Cube cube;
  cube.interpolation = interpolation;
  const bool interpolated = interpolation == Interpolation::linear;
  const glm::ivec3 low = bounds_min - (interpolated ? 1 : 0);
  std::int64_t extent = 1;
  for (int axis = 0; axis < 3; ++axis) {
    // glsl/grid/summarize_bricks.comp needs the octant of each brick in its parent cube, hence the alignment to two
    // bricks.
    const int step = volume.on_device ? 2 * volume::brick_size : volume::brick_size;
    cube.origin[axis] = low[axis] & ~(step - 1);
    extent = std::max<std::int64_t>(extent, std::int64_t{bounds_max[axis]} - cube.origin[axis] + 1);
  }
  while ((std::int64_t{1} << cube.log2_size) < extent) ++cube.log2_size;
  if (cube.log2_size > Cube::max_log2_size) {
    throw Error(ErrorCode::unsupported, "grid '" + volume.name + "' is " + std::to_string(extent) +
                                            " voxels wide; the limit is " + std::to_string(1 << Cube::max_log2_size));
  }
  cube.to_world =
      volume.index_to_world * glm::translate(glm::dmat4(1.0), glm::dvec3(cube.origin) - (interpolated ? 0.0 : 0.5));
  return cube;
}

}  // namespace cumulet::grid
