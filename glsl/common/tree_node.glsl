// A node of a tree over the boxes of a scene's instances, of volumes or of models, in threaded order: traversal needs
// no stack. Shared by GLSL and C++; the includer has parameters.glsl before this. Made by src/scene/threaded_tree.hpp.
#ifndef CM_TREE_NODE_GLSL
#define CM_TREE_NODE_GLSL

const uint CM_INSTANCE_NONE = 0xffffffffu;

// Nodes are stored in traversal order. If the ray comes near a node's box, the next node follows, else node `skip`.
CM_BLOCK(CmInstanceNode) {
  CM_ALIGN(16) vec3 low;  // scene's frame
  uint skip;              // in the root: the number of nodes
  CM_ALIGN(16) vec3 high;
  uint instance;           // CM_INSTANCE_NONE: an inner node, whose subtree ends before skip
};

#endif
