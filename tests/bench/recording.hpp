#pragma once

// Paths of the shaders' own source on the CPU (as tests/unit/support/cpu_tracer.hpp) through a viewer's grid, which
// record their work.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <headless.hpp>
#include <vector>

#include "settings/settings.hpp"
#include "support/cpu_tracer.hpp"

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-parameter"
namespace cumulet::core {

#undef CM_SURFACES
#define CM_SURFACES 0
#define CM_MARCH 0
#define CM_LINEAR 1

struct RecordingData {
  CmParameters cm{};
  const grid::TetGrid* grid = nullptr;
  std::function<void(std::uint32_t cell)> march;  // into it
  float cm_surface_z(uvec2 pixel, vec2 within, uint layer) const { return 3.0e38F; }
  uvec4 cm_record(uint cell, uint part) const {
    if (part != 0) return grid->cells[cell].data;
    if (march) march(cell);
    return grid->cells[cell].links;
  }
  mutable uint levels = 0;  // number of tree nodes that were read
  uint cm_tree(uint node) const {
    ++levels;
    return grid->tree[node];
  }
  uint cm_root_leaf(uint root) const { return grid->roots[root].first_leaf; }
  uint cm_root_node(uint root) const { return grid->roots[root].first_internal; }
};

struct Recording : RecordingData {
#include "support/traced.inc"
  float density_at(std::uint32_t cell, const vec3& p) const {
    const uvec4 data = grid->cells[cell].data;
    const uint shape = cm_record_shape(data);
    return cm_cell_density(data, cm_cell_frame(cm_record_v0(data), shape, p, vec3(0.0F)), shape).x;
  }
};

}  // namespace cumulet::core
#pragma GCC diagnostic pop

namespace cumulet::bench {

struct RecordingOptions {
  double threshold = settings::default_threshold(CUMULET_CRITERION_TRANSMITTANCE);
  double optical_depth = 10.0;
  std::uint32_t size = 128;
  std::uint32_t samples = 2;
  std::vector<std::filesystem::path> files;
};

/// A function that receives the recording of a file's grid.
using UseRecording =
    std::function<void(core::Recording&, const std::filesystem::path& file, const RecordingOptions& options)>;

/// Runs `use` for each file of the arguments. Returns the exit status of the program.
int record_files(int argc, char** argv, const char* program, const UseRecording& use);

}  // namespace cumulet::bench
