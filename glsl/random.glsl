// Random numbers: a PCG stream a path. Shared by GLSL and C++.
#ifndef CM_RANDOM_GLSL
#define CM_RANDOM_GLSL

// pcg3d of Jarzynski and Olano, "Hash Functions for GPU Rendering", JCGT 9(3), 2020.
CM_FN uvec3 cm_hash3(uvec3 v) {
  v = v * 1664525u + 1013904223u;
  v.x += v.y * v.z;
  v.y += v.z * v.x;
  v.z += v.x * v.y;
  v = v ^ (v >> 16u);
  v.x += v.y * v.z;
  v.y += v.z * v.x;
  v.z += v.x * v.y;
  return v;
}

// The high 24 bits as a number in [0, 1).
CM_FN float cm_unit_float(uint word) { return float(word >> 8) * (1.0f / 16777216.0f); }

// A random word as a number below count, each as likely.
CM_FN uint cm_below(uint word, uint count) {
  uint number;
  uint unused;
  umulExtended(word, count, number, unused);
  return number;
}

// PCG-RXS-M-XS 32 (O'Neill 2014); odd stream number selects one of 2^31 sequences. In [0, 1), 24 bits.
CM_FN float cm_random(CM_INOUT(uint) state, uint stream) {
  uint word = ((state >> ((state >> 28) + 4u)) ^ state) * 277803737u;
  state = state * 747796405u + stream;
  word = (word >> 22) ^ word;
  return cm_unit_float(word);
}

// Free path in optical depth: -ln(1 - u), u in [0, 1).
CM_FN float cm_random_depth(CM_INOUT(uint) state, uint stream) { return -log(1.0f - cm_random(state, stream)); }

#endif
