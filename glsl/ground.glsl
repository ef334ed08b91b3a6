// The ground: a level plane that scatters evenly, as Lambert's law has it. It is met from above; from beneath it is not
// there. Shared by GLSL and C++; the includer has glsl/ray.glsl.
#ifndef CM_GROUND_GLSL
#define CM_GROUND_GLSL

#define CM_NO_GROUND 3.0e38f

// How far along a ray it is. o, d: cube space; d per unit of world distance.
CM_FN float cm_ground_distance(vec3 o, vec3 d) {
  float above = cm_from_cube_point(o).y - cm.ground.height;
  float t = -above / cm_to_world(d).y;
  return above > 0.0f && t > 0.0f && t < cm.ground.reach ? t : CM_NO_GROUND;
}

#endif
