#include "jobs/cell_budget.hpp"

#include <algorithm>

#include "grid/memory.hpp"
#include "grid/tet_grid.hpp"

namespace cumulet::viewer {

namespace {

bool emits(const Carried& carried) { return carried.channels[grid::index_of(grid::Channel::emission)]; }

// Includes the cell's tree node and its entry in the emission table.
std::uint64_t bytes_per_cell(const Carried& carried) {
  std::uint64_t bytes = sizeof(grid::CellRecord) + sizeof(std::uint32_t);
  for (const grid::ChannelRow& row : grid::channel_table) {
    if (carried.channels[grid::index_of(row.channel)]) bytes += row.record_bytes;
  }
  if (emits(carried)) bytes += sizeof(scene::GlowingCell);
  if (carried.change) bytes += sizeof(glm::uvec2);
  if (carried.corners) bytes += sizeof(glm::uvec4);
  return bytes;
}

// Size of a grid's fixed tables.
constexpr std::uint64_t tables = 4096;

std::uint64_t left_of(std::uint64_t most, std::uint64_t held) { return most - std::min(most, held); }

std::uint64_t fit_in_memory(const Carried& carried, std::uint64_t held, const ResourceLimits& resource_limits) {
  return left_of(resource_limits.memory_bytes(), held + tables) / bytes_per_cell(carried);
}

std::uint64_t fit_in_gl(const Carried& carried, const ResourceLimits& resource_limits) {
  // The old grid stays until the new one is uploaded, and images may grow meanwhile.
  return left_of(resource_limits.gl_bytes() / 5 * 2, tables) / bytes_per_cell(carried);
}

}  // namespace

Carried Carried::of(const grid::Channels& channels, bool corners) {
  Carried carried{.change = channels.ends != nullptr, .corners = corners};
  for (const grid::ChannelRow& row : grid::channel_table)
    carried.channels[grid::index_of(row.channel)] = row.is_in(channels);
  return carried;
}

Carried Carried::of(const scene::MarchSource& source) {
  Carried carried{.change = source.changes(), .corners = source.trilinear};
  for (const grid::ChannelRow& row : grid::channel_table)
    carried.channels[grid::index_of(row.channel)] = source.has(row.channel);
  return carried;
}

std::uint64_t cells_that_fit(std::uint64_t max_cells, const Carried& carried, std::uint64_t held,
                             const ResourceLimits& resource_limits) {
  return std::min({max_cells, fit_in_memory(carried, held, resource_limits), fit_in_gl(carried, resource_limits)});
}

std::optional<std::uint64_t> planned_cells_that_fit(std::uint64_t max_cells, const Carried& carried,
                                                    const grid::Lattice& lattice, std::uint64_t held,
                                                    const ResourceLimits& resource_limits) {
  // Beside the cells this leaves room for the lattice, build buffers, the previous grid, a copy, and unused parts of
  // heap pages.
  const std::uint64_t room = left_of(resource_limits.gl_bytes(), lattice.device_bytes() + tables);
  const std::uint64_t kept = 4 * bytes_per_cell(carried);
  const std::uint64_t in_gl = std::min(room / (kept + grid::building_bytes_per_cell(emits(carried))),
                                       left_of(room, grid::building_bytes_at_least()) / kept);
  // With a small lattice the result is at least two fifths of the CPU limit.
  if (in_gl < std::min(max_cells, fit_in_gl(carried, resource_limits) / 4)) return std::nullopt;
  return std::min({max_cells, fit_in_memory(carried, held, resource_limits), in_gl});
}

bool has_cells_allowed(const Built& built, const ResourceLimits& resource_limits) {
  const scene::MarchSource& source = *built.source;
  const Carried carried = Carried::of(source);
  const std::uint64_t max_cells = built.settings.refine.max_cells;
  const std::uint64_t held = built.volume ? built.volume->bytes() : 0;
  const auto planned = source.plan
                           ? planned_cells_that_fit(max_cells, carried, *source.plan->lattice, held, resource_limits)
                           : std::nullopt;
  const std::uint64_t allowed = planned ? *planned : cells_that_fit(max_cells, carried, held, resource_limits);
  if (allowed < fewest_cells) return true;  // a coarser grid does not exist
  // Only the GPU knows the number of cells of a planned grid.
  const std::uint64_t has = source.plan ? built.cell_limit : built.cells;
  const bool wants_more = built.limited || source.plan;
  return has <= allowed && !(wants_more && built.cell_limit < allowed);
}

}  // namespace cumulet::viewer
