// A node of a tree over the boxes of what stands in a scene, instances of volumes or models, in the order that needs no
// stack. Shared by GLSL and C++; the includer has parameters.glsl before this. Made by src/scene/threaded_tree.hpp.
#ifndef CM_TREE_NODE_GLSL
#define CM_TREE_NODE_GLSL

const uint CM_INSTANCE_NONE = 0xffffffffu;

// In the order in which they are met: after a node that a ray comes near the one behind it, else the one that it names.
CM_BLOCK(CmInstanceNode) {
  CM_ALIGN(16) vec3 low;  // scene's frame
  uint skip;              // of the first node, the root: how many there are
  CM_ALIGN(16) vec3 high;
  uint instance;           // CM_INSTANCE_NONE: an inner node, of all up to skip
};

#endif
