// The ground: an infinite level plane with Lambertian reflection. Rays hit it only from above. Shared by GLSL and C++;
// the includer has glsl/ray.glsl.
#ifndef CM_GROUND_GLSL
#define CM_GROUND_GLSL

#define CM_NO_GROUND 3.0e38f

// Distance along a ray to the ground, CM_NO_GROUND if the ray misses it. o, d: cube space; d per unit of world
// distance.
CM_FN float cm_ground_distance(vec3 o, vec3 d) {
  float above = cm_from_cube_point(o).y - cm.ground.height;
  float t = -above / cm_to_world(d).y;
  return above > 0.0f && t > 0.0f && t < cm.ground.reach ? t : CM_NO_GROUND;
}

#endif
