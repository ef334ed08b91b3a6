// Octahedral mapping of directions (Cigolle et al., "A Survey of Efficient Representations for Independent Unit
// Vectors", JCGT 3(2), 2014). Shared by GLSL and C++.
#ifndef CM_OCTAHEDRON_GLSL
#define CM_OCTAHEDRON_GLSL

// Unit vector of two coordinates in [-1, 1].
CM_FN vec3 cm_from_octahedron(vec2 e) {
  vec3 v = vec3(e, 1.0f - abs(e.x) - abs(e.y));
  vec2 over = (1.0f - abs(vec2(e.y, e.x))) * mix(vec2(-1.0f), vec2(1.0f), greaterThanEqual(e, vec2(0.0f)));
  if (v.z < 0.0f) v = vec3(over, v.z);
  return normalize(v);
}

#endif
