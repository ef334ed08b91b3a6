#include "scene/emissive_cells.hpp"

#include <cmath>
#include <utility>

#include "base/luminance.hpp"
#include "grid/cell.hpp"

namespace cumulet::scene {

namespace {

// Returns the volume of a cell in its frame, in units: a sixth of the determinant of the three edges at v0.
double frame_volume(std::uint32_t cell_class) {
  const auto vertex = [&](std::uint32_t i) { return glm::dvec3(core::cm_frame_vertex(cell_class, i)); };
  return std::abs(glm::dot(vertex(1), glm::cross(vertex(2), vertex(3)))) / 6.0;
}

double brightness_of(const grid::EmissionRecord& emission) { return luminance(glm::dvec3(emission.mean)); }

}  // namespace

EmissiveTable emissive_table(std::vector<GlowingCell> cells, const grid::Cube& cube, const Progress* progress) {
  EmissiveTable table;
  const double unit_volume = std::abs(glm::determinant(glm::dmat3(cube.to_world)));
  std::erase_if(cells, [](const GlowingCell& cell) { return !(brightness_of(cell.emission) > 0.0); });
  std::vector<double> power;
  double square = 0.0;
  for (const GlowingCell& cell : cells) {
    if (power.size() % 65536 == 0) check(progress);
    const double bright = brightness_of(cell.emission);
    const std::uint32_t shape = core::cm_record_shape({cell.v0_shape, 0U, 0U}, cube.wide());
    const double unit = core::cm_shape_unit(shape);
    power.push_back(bright * frame_volume(core::cm_shape_class(shape)) * unit * unit * unit * unit_volume);
    square += bright * power.back();
    table.power += power.back();
  }
  table.cells = std::move(cells);
  if (!(table.power > 1e-30)) return {};  // its inverse must fit in a float
  table.length = std::cbrt(table.power / square * table.power);
  const std::vector<light::Alias> aliases = light::alias_table(std::move(power), table.power, progress);
  for (std::size_t i = 0; i < aliases.size(); ++i) table.cells[i].alias = aliases[i];
  return table;
}

EmissiveTable emissive_table(const grid::TetGrid& grid, const Progress* progress) {
  std::vector<GlowingCell> cells;
  for (std::size_t i = 0; i < grid.channels.emission.size(); ++i) {
    if (i % 65536 == 0) check(progress);
    const glm::uvec4& data = grid.cells[i].data;
    if (brightness_of(grid.channels.emission[i]) > 0.0)
      cells.push_back({{}, glm::uvec2(data.x, data.y), grid.channels.emission[i]});
  }
  return emissive_table(std::move(cells), grid.cube, progress);
}

}  // namespace cumulet::scene
