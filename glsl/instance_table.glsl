// What shaders are told of a scene's instances of volumes, in two std140 buffers: a record each, and a tree over their
// boxes. Shared by GLSL and C++; the includer has parameters.glsl before this. Made by src/scene/instances.hpp.
#ifndef CM_INSTANCE_TABLE_GLSL
#define CM_INSTANCE_TABLE_GLSL

#include "tree_node.glsl"

// Of a record's flags.
const uint CM_INSTANCE_SEEN = 1u;      // by camera rays; others meet it in any case
const uint CM_INSTANCE_EMITS = 2u;     // its cells give off light
const uint CM_INSTANCE_OVERLAPS = 4u;  // there are points in its box and in another's
const uint CM_INSTANCE_MOVES = 8u;     // it stands elsewhere as the shutter opens, or as it closes (glsl/moment.glsl)

// "World" is here the scene's frame: the world, counted from a point near the scene.
CM_BLOCK(CmInstance) {
  CmSpace space;
  CmGrid grid;
  CmGlow glow;  // density: of all instances together
  CmMedium medium;
  uint flags;
  uint alias;        // of an entry, drawn evenly: it stands for itself where a random word is below this,
  uint alias_other;  // else for that
};

#endif
