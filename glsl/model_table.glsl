// What shaders are told of the models that a scene's triangles belong to: a record each, in a std140 buffer, beside a
// tree over their boxes (tree_node.glsl). Shared by GLSL and C++; the includer has parameters.glsl
// before this. Made by src/scene/model_table.hpp.
#ifndef CM_MODEL_TABLE_GLSL
#define CM_MODEL_TABLE_GLSL
#include "tree_node.glsl"

// Of a record's flags.
const uint CM_MODEL_SEEN = 1u;      // by camera rays; others meet it in any case
const uint CM_MODEL_MIRRORS = 2u;   // what turns clockwise in its own space turns the other way in the world
const uint CM_MODEL_HOLDOUT = 4u;   // cameras see a hole
const uint CM_MODEL_MOVES = 8u;     // it stands elsewhere as the shutter opens, or as it closes (glsl/moment.glsl)
const uint CM_MODEL_DEFORMS = 16u;  // its triangles are elsewhere in its own space

// One standing of a mesh. Words: of the tables of surface_tables.glsl, which meshes share wherever they stand.
CM_BLOCK(CmModel) {
  CM_ALIGN(16) vec3 to_own_x;  // columns of the linear part of world to the mesh's own space
  uint first;                  // the number that its first triangle has among those of all models; these ascend
  CM_ALIGN(16) vec3 to_own_y;
  uint nodes;                  // where its tree begins
  CM_ALIGN(16) vec3 to_own_z;
  uint records;                // of that tree
  CM_ALIGN(16) vec3 to_world_x;
  uint triangles;
  CM_ALIGN(16) vec3 to_world_y;
  uint vertices;
  CM_ALIGN(16) vec3 to_world_z;
  uint materials;
  CM_ALIGN(16) vec3 origin;  // world: where its own space's is
  uint textures;
  uint emitters;             // its emissive triangles
  uint emitter_count;
  float emitter_chance;      // that a look for one is for one of its
  float own_volume;          // of a unit of volume of the world, in its own space
  uint flags;
  uint alias;        // of an entry, drawn evenly: looks for emissive triangles are for its where a random word is at most
  uint alias_other;  // this, else for that one's
  uint group;        // of lights, that they are in
};

#endif
