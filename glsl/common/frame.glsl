// Orthonormal bases, and rotation of directions. Shared by GLSL and C++.
#ifndef CM_FRAME_GLSL
#define CM_FRAME_GLSL

// Completes the unit vector w to a right-handed orthonormal basis u, v, w. Duff et al., "Building an Orthonormal
// Basis, Revisited", JCGT 6(1), 2017.
CM_FN void cm_frame(vec3 w, CM_OUT(vec3) u, CM_OUT(vec3) v) {
  float sign_z = w.z >= 0.0f ? 1.0f : -1.0f;
  float a = -1.0f / (sign_z + w.z);
  float b = w.x * w.y * a;
  u = vec3(1.0f + sign_z * w.x * w.x * a, sign_z * b, -sign_z * w.x);
  v = vec3(b, sign_z + w.y * w.y * a, -w.y);
}

// Rotates about +Y from +Z towards -X by the angle with cosine turn.x and sine turn.y. The negative sine rotates back.
CM_FN vec3 cm_turned(vec3 w, vec2 turn) {
  return vec3(turn.x * w.x - turn.y * w.z, w.y, turn.x * w.z + turn.y * w.x);
}

#endif
