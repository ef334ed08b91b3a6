// The table of a scene's volume instances, in two std140 buffers: one record each, and a tree over their boxes. Behind
// the tree's nodes are the clip records: two planes each, in the fields of a node. A plane's normal is in `low` or
// `high`, and its offset has the bits of the next field. Shared by GLSL and C++; the includer has parameters.glsl before
// this. Made by src/scene/instances.hpp.
#ifndef CM_INSTANCE_TABLE_GLSL
#define CM_INSTANCE_TABLE_GLSL

#include "common/tree_node.glsl"

// Flags of a record.
const uint CM_INSTANCE_SEEN = 1u;      // visible to camera rays; other rays always traverse it
const uint CM_INSTANCE_EMITS = 2u;     // its cells give off light
const uint CM_INSTANCE_OVERLAPS = 4u;  // its box overlaps another's
const uint CM_INSTANCE_MOVES = 8u;     // its transform differs at shutter open and close (glsl/traversal/moment.glsl)

// In these structs "world" means the scene's frame: the world relative to a point near the scene.
CM_BLOCK(CmInstance) {
  CmSpace space;
  CmGrid grid;
  CmEmissive emissive;  // density: over all instances together
  CmMedium medium;
  uint flags;
  uint alias;        // alias table: a uniformly drawn entry stays if a random word is below this,
  uint alias_other;  // else this other instance is used
  uint clip;         // CM_CLIP only: clip records: their number in the lowest 3 bits, above it the index of the first
};

#endif
