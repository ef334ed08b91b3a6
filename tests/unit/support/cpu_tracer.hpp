#pragma once

#include <vector>

#include "grid/cell.hpp"
#include "grid/tet_grid.hpp"
#include "render/parameters.hpp"
#include "support/volumes.hpp"

// Marches share one signature; each leaves some of it unused.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-parameter"

// The shaders' path tracer as C++: the same source, with the marches' data in memory.
namespace cumulet::core {

struct CpuTetLinear {
  CmParameters cm{};
  const grid::TetGrid* grid = nullptr;
  float cm_surface_z(uvec2 pixel, vec2 within, uint layer) const { return 3.0e38F; }
  uvec4 cm_record(uint cell, uint part) const { return part == 0 ? grid->cells[cell].links : grid->cells[cell].data; }
  uint cm_tree(uint node) const { return grid->tree[node]; }
  uint cm_root_leaf(uint root) const { return grid->roots[root].first_leaf; }
  uint cm_root_node(uint root) const { return grid->roots[root].first_internal; }
#include "phase.glsl"
#include "random.glsl"
#define CM_LINEAR 1
#include "march_tet.glsl"
#include "run.glsl"
#include "support/traced_pixel.inc"
#undef CM_LINEAR
};

#undef CM_RANDOM_GLSL
#undef CM_PHASE_GLSL
#undef CM_FRAME_GLSL
#undef CM_MARCH_TET_GLSL
#undef CM_RAY_GLSL
#undef CM_LIGHT_GLSL
#undef CM_PATH_STATE_GLSL
#undef CM_PATH_VERTEX_GLSL
#undef CM_PATH_GLSL
#undef CM_FLIGHT_GLSL
#undef CM_RUN_GLSL

struct CpuDense {
  CmParameters cm{};
  const volume::ScalarVolume* volume = nullptr;
  ivec3 origin{0};
  float cm_surface_z(uvec2 pixel, vec2 within, uint layer) const { return 3.0e38F; }
  float cm_voxel(ivec3 voxel) const { return test::value_at(*volume, voxel + origin) / volume->max_value; }
#include "phase.glsl"
#include "random.glsl"
#define CM_MARCH 1
#include "march_voxel.glsl"
#include "run.glsl"
#include "support/traced_pixel.inc"
#undef CM_MARCH
};

}  // namespace cumulet::core

#pragma GCC diagnostic pop
