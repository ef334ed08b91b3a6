// Random numbers: a PCG stream a path, and sets that are even over a pixel's samples. Shared by GLSL and C++.
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

// Laine and Karras' hash with Vegdahl's constants: Owen's scramble of a number whose digits after the point begin with
// the lowest bit.
CM_FN uint cm_owen_scramble(uint digits, uint seed) {
  digits ^= digits * 0x3d20adeau;
  digits += seed;
  digits *= (seed >> 16) | 1u;
  digits ^= digits * 0x05526c56u;
  digits ^= digits * 0x53a22864u;
  return digits;
}

// The pair that sample `number` of a pixel has of a set: Sobol's (0,2)-sequence, scrambled, and in an order scrambled so
// that any first 2^k of it are even, each set of each pixel by itself (Burley, "Practical Hash-based Owen Scrambling",
// JCGT 9(4), 2020). In [0, 1), 24 bits.
CM_FN vec2 cm_even_pair(uint number, uint pixel, uint set) {
  uvec3 seed = cm_hash3(uvec3(pixel, set, 0x2545f491u));
  uint first = bitfieldReverse(cm_owen_scramble(bitfieldReverse(number), seed.x));
  // Times Pascal's triangle modulo 2.
  uint second = first;
  second ^= (second >> 1) & 0x55555555u;
  second ^= (second >> 2) & 0x33333333u;
  second ^= (second >> 4) & 0x0f0f0f0fu;
  second ^= (second >> 8) & 0x00ff00ffu;
  second ^= second >> 16;
  return vec2(cm_unit_float(bitfieldReverse(cm_owen_scramble(first, seed.y))),
              cm_unit_float(bitfieldReverse(cm_owen_scramble(second, seed.z))));
}

// A set that no event has (glsl/path_vertex.glsl counts theirs from 2).
const uint CM_SET_LENS = 0xffffffffu;

// Free path in optical depth of u in [0, 1).
CM_FN float cm_free_depth(float u) { return -log(1.0f - u); }

#endif
