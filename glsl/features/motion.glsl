// Data of aovs.comp for motion vectors, in a std140 buffer: one map into a view per object. Shared by GLSL and C++; the
// includer has parameters.glsl before this. Made by src/scene/motion.hpp.
#ifndef CM_MOTION_GLSL
#define CM_MOTION_GLSL

// Points map to (x z, y z, z), in orthographic views to (x, y, z): x and y as in clip space, z the depth along the
// view.
CM_BLOCK(CmMotion) {
  CM_ALIGN(16) vec3 x;  // columns of the linear part
  uint vertices;        // of a model: first word of the previous frame's vertices
  CM_ALIGN(16) vec3 y;
  CM_ALIGN(16) vec3 z;
  CM_ALIGN(16) vec3 origin;
};

// Maps start in ray space, those of models in their meshes' own space.
CM_BLOCK(CmMotionFrame) {
  uint orthographic_now;
  uint orthographic_then;
  float seconds;        // time between both frames
  uint first_model;     // order of maps: current view, static objects then, each volume, and from here each model
};

#endif
