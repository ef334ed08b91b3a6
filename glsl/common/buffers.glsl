// Bindings of the grid's data, of surfaces and of the host's depth.
#include "common/tree_node.glsl"
#include "traversal/current_volume.glsl"

layout(binding = CM_UNIT_HOST_DEPTH) uniform sampler2DArray cm_surface;

float cm_surface_z(uvec2 pixel, vec2 within, uint layer) {
  if (cm.host_depth.layers == 0u) return 3.0e38;
  vec2 at = (vec2(pixel) + within) * vec2(cm.host_depth.size) / vec2(cm.view.size.xy);
  ivec2 texel = min(ivec2(at), ivec2(cm.host_depth.size) - 1);
  return texelFetch(cm_surface, ivec3(texel, int(layer % cm.host_depth.layers)), 0).x;
}

#if CM_SURFACES || CM_LAYERS
layout(binding = CM_UNIT_LAYER_COLOR) uniform sampler2DArray cm_layer_color;
layout(binding = CM_UNIT_LAYER_Z) uniform sampler2DArray cm_layer_z;

// The surface at which a camera ray ends: the layer's opaque surface, or, with their coverage as probability, the
// blended ones in front of it, which count as one at the nearest. Returns its view depth. color: radiance, with alpha
// 1; alpha 0 if there is no surface.
float cm_layer_surface(uvec2 pixel, vec2 within, uint sample_number, float u, out vec4 color) {
  vec2 at = (vec2(pixel) + within) * vec2(cm.layers.size) / vec2(cm.view.size.xy);
  ivec3 texel = ivec3(min(ivec2(at), ivec2(cm.layers.size) - 1), int(sample_number % cm.layers.count));
  color = texelFetch(cm_layer_color, texel, 0);
  float z = texelFetch(cm_layer_z, texel, 0).x;
  if (cm.layers.blended != 0u) {
    texel.z += int(cm.layers.count);
    vec4 blended = texelFetch(cm_layer_color, texel, 0);
    if (u < blended.a) {
      color = vec4(blended.rgb / blended.a, 1.0);
      z = texelFetch(cm_layer_z, texel, 0).x;
    }
  }
  return z;
}
#endif

#if CM_SURFACES
layout(binding = CM_UNIT_SCENE_WORDS) uniform usamplerBuffer cm_scene_words;
layout(binding = CM_UNIT_ATLAS) uniform sampler2DArray cm_atlas;

#include "surface/model_table.glsl"
layout(std140, binding = CM_STORAGE_MODELS) readonly buffer CmModels { CmModel cm_models[]; };
layout(std140, binding = CM_STORAGE_MODEL_NODES) readonly buffer CmModelNodes { CmInstanceNode cm_model_nodes[]; };
uint cm_model = 0u;

uvec4 cm_words(uint word) { return texelFetch(cm_scene_words, int(word)); }
vec4 cm_atlas_value(ivec3 at) { return texelFetch(cm_atlas, at, 0); }
#endif

#if CM_ANALYTIC_LIGHTS
#include "light/punctual.glsl"
layout(std430, binding = CM_STORAGE_ANALYTIC_LIGHTS) readonly buffer CmAnalyticLightRecords { CmAnalyticLight cm_analytic_lights[]; };
CmAnalyticLight cm_analytic_light(uint i) { return cm_analytic_lights[i]; }
#endif

#if CM_ENVIRONMENT
layout(binding = CM_UNIT_ENVIRONMENT) uniform usamplerBuffer cm_environment_words;
uvec4 cm_environment_word(uint i) { return texelFetch(cm_environment_words, int(cm.environment.words + i)); }
#endif

#ifdef CM_MARCH
#define CM_CELL_CHANGES (CM_MOTION != 0 && CM_MARCH == 0)
#define CM_CELL_CORNERS (CM_LINEAR == 2 && CM_MARCH == 0)
#else
#define CM_CELL_CHANGES 0
#define CM_CELL_CORNERS 0
#endif
#if CM_CELL_LIGHTS || CM_CELL_CHANGES || CM_CELL_CORNERS
layout(binding = CM_UNIT_CHANNELS) uniform usamplerBuffer cm_channels;
#endif
#if CM_CELL_LIGHTS
uvec4 cm_emissive_word(uint i) { return texelFetch(cm_channels, int(CM_GRID.first_glowing + i)); }
#endif

#ifdef CM_MARCH
#if CM_MARCH == 0
// Texture buffers, not storage buffers: two 16-byte fetches per cell, up to 2^27 texels on today's drivers.
layout(binding = CM_UNIT_CELLS) uniform usamplerBuffer cm_cells[CM_PAGES];
layout(binding = CM_UNIT_TREE) uniform usamplerBuffer cm_tree_words;

uvec4 cm_record(uint cell, uint part) {
#if CM_PAGES == 1
  return texelFetch(cm_cells[0], int((CM_GRID.first_cell + cell) * 2u + part));
#else
  uint number = CM_GRID.first_cell + cell;
  uint page = number >> CM_GRID.page_shift;
  int texel = int((number & ((1u << CM_GRID.page_shift) - 1u)) * 2u + part);
  // Samplers may only be indexed by constants here, because lanes differ in their page.
  if (page == 0u) return texelFetch(cm_cells[0], texel);
#if CM_PAGES > 2
  if (page == 1u) return texelFetch(cm_cells[1], texel);
#endif
#if CM_PAGES > 3
  if (page == 2u) return texelFetch(cm_cells[2], texel);
#endif
#if CM_PAGES > 4
  if (page == 3u) return texelFetch(cm_cells[3], texel);
#endif
#if CM_PAGES > 5
  if (page == 4u) return texelFetch(cm_cells[4], texel);
#endif
  return texelFetch(cm_cells[CM_PAGES - 1], texel);
#endif
}

// Index of a channel's first record.
#define CM_FIRST_RECORD(channel) CM_GRID.first_records[(channel) / 4][(channel) % 4]
#if CM_CHANNELS
uvec4 cm_emission_record(uint cell) {
  return texelFetch(cm_channels, int(CM_FIRST_RECORD(CM_CHANNEL_EMISSION) + cell));
}
uint cm_channel_word(uint word) { return cm_link(texelFetch(cm_channels, int(word >> 2)), word & 3u); }
uint cm_color_record(uint cell) { return cm_channel_word(CM_FIRST_RECORD(CM_CHANNEL_COLOR) + cell); }
uint cm_anisotropy_record(uint cell) {
  return cm_channel_word(CM_FIRST_RECORD(CM_CHANNEL_ANISOTROPY) + (cell >> 1));
}
#endif
#if CM_VELOCITY || CM_MOTION
uvec2 cm_channel_pair(uint word) {
  uvec4 texel = texelFetch(cm_channels, int(word >> 2));
  return (word & 2u) == 0u ? texel.xy : texel.zw;
}
#endif
#if CM_VELOCITY
uvec2 cm_velocity_record(uint cell) {
  return cm_channel_pair(CM_FIRST_RECORD(CM_CHANNEL_VELOCITY) + 2u * cell);
}
#endif
#if CM_CELL_CORNERS
uvec4 cm_corners_record(uint cell) { return texelFetch(cm_channels, int(CM_GRID.first_corners + cell)); }
#endif
#if CM_MOTION
uvec2 cm_change_record(uint cell) { return cm_channel_pair(CM_GRID.first_change + 2u * cell); }
#endif

uint cm_tree_word(uint word) { return cm_link(texelFetch(cm_tree_words, int(word >> 2)), word & 3u); }
uint cm_tree(uint node) { return cm_tree_word(CM_GRID.tree + node); }
// Before the tree there are 25 pairs (first leaf, first tree node) and one unused pair.
uint cm_root_leaf(uint root) { return cm_tree_word(CM_GRID.tree - 52u + 2u * root); }
uint cm_root_node(uint root) { return cm_tree_word(CM_GRID.tree - 51u + 2u * root); }
#else
#if CM_CHANNELS
layout(binding = CM_UNIT_CHANNEL_VOXELS + CM_CHANNEL_EMISSION) uniform sampler3D cm_emission_voxels;
vec3 cm_emission_voxel(ivec3 voxel) {
  return CM_GRID.emission_unit * texelFetch(cm_emission_voxels, voxel - ivec3(CM_GRID.box_min), 0).rgb;
}
layout(binding = CM_UNIT_CHANNEL_VOXELS + CM_CHANNEL_COLOR) uniform sampler3D cm_scattering_voxels;
vec3 cm_scattering_voxel(ivec3 voxel) {
  return texelFetch(cm_scattering_voxels, voxel - ivec3(CM_GRID.box_min), 0).rgb;
}
layout(binding = CM_UNIT_CHANNEL_VOXELS + CM_CHANNEL_ANISOTROPY) uniform sampler3D cm_anisotropy_voxels;
float cm_anisotropy_voxel(ivec3 voxel) {
  return texelFetch(cm_anisotropy_voxels, voxel - ivec3(CM_GRID.box_min), 0).x;
}
#endif
#if CM_VELOCITY
layout(binding = CM_UNIT_CHANNEL_VOXELS + CM_CHANNEL_VELOCITY) uniform sampler3D cm_velocity_voxels;
vec3 cm_velocity_voxel(ivec3 voxel) {
  return texelFetch(cm_velocity_voxels, voxel - ivec3(CM_GRID.box_min), 0).xyz;
}
#endif
#if CM_MARCH == 1
layout(binding = CM_UNIT_VOXELS) uniform sampler3D cm_voxels;
float cm_voxel(ivec3 voxel) { return texelFetch(cm_voxels, voxel - ivec3(CM_GRID.box_min), 0).x; }
#if CM_MOTION
layout(binding = CM_UNIT_CHANGE_VOXELS) uniform sampler3D cm_voxel_changes;
float cm_voxel_change(ivec3 voxel) { return texelFetch(cm_voxel_changes, voxel - ivec3(CM_GRID.box_min), 0).x; }
#endif
#else
#if CM_LINEAR
#define CM_BRICK_VOXELS 729u
#else
#define CM_BRICK_VOXELS 512u
#endif
layout(binding = CM_UNIT_VOXELS) uniform samplerBuffer cm_brick_values;
layout(binding = CM_UNIT_BRICK_SLOTS) uniform usampler3D cm_brick_slots;
uint cm_brick_slot(ivec3 brick) {
  return texelFetch(cm_brick_slots, brick - (ivec3(CM_GRID.box_min) >> 3), 0).x;
}
float cm_brick_voxel(uint slot, uint index) { return texelFetch(cm_brick_values, int(slot * CM_BRICK_VOXELS + index)).x; }
#if CM_MOTION
layout(binding = CM_UNIT_CHANGE_VOXELS) uniform samplerBuffer cm_brick_changes;
float cm_brick_change(uint slot, uint index) { return texelFetch(cm_brick_changes, int(slot * CM_BRICK_VOXELS + index)).x; }
#endif
#endif
#endif
#endif
