#version 450
// Lists the emissive cells of a grid, in no order. The CPU makes a light table from them
// (src/scene/emissive_cells.hpp).
layout(local_size_x = 64) in;

#include "common/bindings.glsl"
#include "common/shared.glsl"
#include "grid/cell.glsl"
#include "grid/grid_state.glsl"

struct CmGlowingCell {
  uint cell;
  uint v0_shape[2];  // as in a record
  uint emission[4];  // grid::EmissionRecord
};
layout(std430, binding = CM_STORAGE_GRID_STATE) buffer CmState { CmGridState cm_state; };
layout(std430, binding = CM_STORAGE_GRID_RECORDS) readonly buffer CmRecords { uvec4 cm_records[]; };
layout(std430, binding = CM_STORAGE_GRID_CHANNEL) readonly buffer CmChannel { uvec4 cm_emission[]; };
layout(std430, binding = CM_STORAGE_GRID_GLOWING) writeonly buffer CmGlowing { CmGlowingCell cm_glowing[]; };
layout(location = 0) uniform uint cm_first;
layout(location = 1) uniform uint cm_end;

void main() {
  uint i = cm_first + gl_GlobalInvocationID.x;
  if (i >= cm_end) return;
  uvec4 data = cm_records[2u * i + 1u];
  if ((data.y & CM_RECORD_EMITS) == 0u) return;
  uvec4 emission = cm_emission[i];
  cm_glowing[atomicAdd(cm_state.glowing, 1u)] =
      CmGlowingCell(i, uint[2](data.x, data.y), uint[4](emission.x, emission.y, emission.z, emission.w));
}
