// Random numbers: a PCG stream per path, and low-discrepancy pairs over a pixel's samples. Shared by GLSL and C++.
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

// Converts the upper 24 bits to [0, 1).
CM_FN float cm_unit_float(uint word) { return float(word >> 8) * (1.0f / 16777216.0f); }

// Maps a random word to a uniform integer below count.
CM_FN uint cm_below(uint word, uint count) {
  uint number;
  uint unused;
  umulExtended(word, count, number, unused);
  return number;
}

// PCG-RXS-M-XS 32 (O'Neill 2014). The odd stream number selects one of 2^31 sequences. Returns 24 bits in [0, 1).
CM_FN float cm_random(CM_INOUT(uint) state, uint stream) {
  uint word = ((state >> ((state >> 28) + 4u)) ^ state) * 277803737u;
  state = state * 747796405u + stream;
  word = (word >> 22) ^ word;
  return cm_unit_float(word);
}

// Owen scrambling of a number whose lowest bit is the first digit after the point: Laine and Karras' hash with
// Vegdahl's constants.
CM_FN uint cm_owen_scramble(uint digits, uint seed) {
  digits ^= digits * 0x3d20adeau;
  digits += seed;
  digits *= (seed >> 16) | 1u;
  digits ^= digits * 0x05526c56u;
  digits ^= digits * 0x53a22864u;
  return digits;
}

// Point `number` of a pixel's low-discrepancy set: the (0,2)-sequence of Sobol' with Owen-scrambled values. The order
// is scrambled too: any first 2^k points stay well distributed, and the sets of all pixels are independent. (Burley,
// "Practical Hash-based Owen Scrambling", JCGT 9(4), 2020.) Returns 24 bits in [0, 1).
CM_FN vec2 cm_even_pair(uint number, uint pixel, uint set) {
  uvec3 seed = cm_hash3(uvec3(pixel, set, 0x2545f491u));
  uint first = bitfieldReverse(cm_owen_scramble(bitfieldReverse(number), seed.x));
  // Multiplies by Pascal's triangle modulo 2.
  uint second = first;
  second ^= (second >> 1) & 0x55555555u;
  second ^= (second >> 2) & 0x33333333u;
  second ^= (second >> 4) & 0x0f0f0f0fu;
  second ^= (second >> 8) & 0x00ff00ffu;
  second ^= second >> 16;
  return vec2(cm_unit_float(bitfieldReverse(cm_owen_scramble(first, seed.y))),
              cm_unit_float(bitfieldReverse(cm_owen_scramble(second, seed.z))));
}

// A set that no event uses (glsl/path/path_vertex.glsl counts their sets from 2).
const uint CM_SET_LENS = 0xffffffffu;

// Samples a free-flight optical depth with u in [0, 1).
CM_FN float cm_free_depth(float u) { return -log(1.0f - u); }

#endif
