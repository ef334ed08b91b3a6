// The table of the models that a scene's triangles belong to: one record each in a std140 buffer, beside a tree over
// their boxes (tree_node.glsl). Shared by GLSL and C++; the includer has parameters.glsl before this. Made by
// src/scene/model_table.hpp.
#ifndef CM_MODEL_TABLE_GLSL
#define CM_MODEL_TABLE_GLSL
#include "common/tree_node.glsl"

// Flags of a record.
const uint CM_MODEL_SEEN = 1u;      // visible to camera rays; other rays always hit it
const uint CM_MODEL_MIRRORS = 2u;   // its transform mirrors: clockwise in its own space is not in the world
const uint CM_MODEL_HOLDOUT = 4u;   // holdout: cameras see a hole
const uint CM_MODEL_MOVES = 8u;     // its transform differs at shutter open and close (glsl/traversal/moment.glsl)
const uint CM_MODEL_DEFORMS = 16u;  // its mesh differs at shutter open and close

// An instance of a mesh. The word indices refer to the tables of surface_tables.glsl, which all instances of a mesh
// share.
CM_BLOCK(CmModel) {
  CM_ALIGN(16) vec3 to_own_x;  // columns of the linear part of world to the mesh's own space
  uint first;                  // number of its first triangle among those of all models; ascending
  CM_ALIGN(16) vec3 to_own_y;
  uint nodes;                  // first word of its tree
  CM_ALIGN(16) vec3 to_own_z;
  uint records;                // records of that tree
  CM_ALIGN(16) vec3 to_world_x;
  uint triangles;
  CM_ALIGN(16) vec3 to_world_y;
  uint vertices;
  CM_ALIGN(16) vec3 to_world_z;
  uint materials;
  CM_ALIGN(16) vec3 origin;  // world: origin of its own space
  uint textures;
  uint emitters;             // its emissive triangles
  uint emitter_count;
  float emitter_probability;  // probability that NEE of emissive triangles picks one of this model
  float own_volume;          // volume in its own space of a unit of world volume
  uint flags;
  uint alias;        // alias table: a uniformly drawn entry stays if a random word is at most
  uint alias_other;  // this, else this other model is used
  uint group;        // light group
};

#endif
