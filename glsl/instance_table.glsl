// What shaders are told of a scene's instances of volumes, in two std140 buffers: a record each, and a tree over their
// boxes. Shared by GLSL and C++; the includer has parameters.glsl before this. Made by src/scene/instances.hpp.
#ifndef CM_INSTANCE_TABLE_GLSL
#define CM_INSTANCE_TABLE_GLSL

const uint CM_INSTANCE_NONE = 0xffffffffu;

// Of a record's flags.
const uint CM_INSTANCE_SEEN = 1u;      // by camera rays; others meet it in any case
const uint CM_INSTANCE_EMITS = 2u;     // its cells give off light
const uint CM_INSTANCE_OVERLAPS = 4u;  // there are points in its box and in another's

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

// In the order in which they are met: after a node that a ray comes near the one behind it, else the one that it names.
CM_BLOCK(CmInstanceNode) {
  CM_ALIGN(16) vec3 low;  // scene's frame
  uint skip;              // of the first node, the root: how many there are
  CM_ALIGN(16) vec3 high;
  uint instance;          // CM_INSTANCE_NONE: an inner node, of all up to skip
};

#endif
