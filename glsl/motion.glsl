// What aovs.comp is told of where things were a frame ago, in a std140 buffer: a map each, into a view. Shared by GLSL and
// C++; the includer has parameters.glsl before this. Made by src/scene/motion.hpp.
#ifndef CM_MOTION_GLSL
#define CM_MOTION_GLSL

// Points become (x z, y z, z), orthographic (x, y, z): x and y as in clip space, z the depth along the view.
CM_BLOCK(CmMotion) {
  CM_ALIGN(16) vec3 x;  // columns of its linear part
  uint vertices;        // of a model: where those of then begin, in words
  CM_ALIGN(16) vec3 y;
  CM_ALIGN(16) vec3 z;
  CM_ALIGN(16) vec3 origin;
};

// Maps are of the space that rays are in, those of models of their meshes' own space.
CM_BLOCK(CmMotionFrame) {
  uint orthographic_now;
  uint orthographic_then;
  float seconds;        // from then to now
  uint first_model;     // maps: that of the view now, of what stands still then, of each volume, and from here of each model
};

#endif
