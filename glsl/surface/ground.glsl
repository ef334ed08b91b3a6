// The ground: an infinite level plane with Lambertian reflection. Rays hit it only from above. Shared by GLSL and C++;
// the includer has glsl/traversal/ray.glsl.
//
// A shadow catcher is a ground that only camera rays hit. Its albedo is pi / E times the radiance B of the background
// in the ray's direction, where E is the irradiance of sun and sky on a horizontal plane. Without objects it therefore
// reflects B. The estimator adds B, and subtracts the light that an unoccluded ray would bring from every sample of sun
// and sky (a control variate with the mean B). So the catcher has no noise where nothing shades it.
#ifndef CM_GROUND_GLSL
#define CM_GROUND_GLSL

#define CM_NO_GROUND 3.0e38f

// CM_GROUND 0: there is no ground.
#ifndef CM_GROUND
#define CM_GROUND 1
#endif

// CM_SHADOW_CATCHER 0: the ground is no shadow catcher.
#ifndef CM_SHADOW_CATCHER
#define CM_SHADOW_CATCHER 1
#endif

// CM_GROUND_AIMS 1: some rays from the ground are aimed at the bounds of a medium with emission.
#define CM_GROUND_AIMS (CM_GROUND && CM_CHANNELS)

// Distance along a ray to the ground, CM_NO_GROUND if the ray misses it. o, d: cube space; d per unit of world
// distance.
CM_FN float cm_ground_distance(vec3 o, vec3 d) {
#if CM_GROUND
  float above = cm_from_cube_point(o).y - cm.ground.height;
  float t = -above / cm_to_world(d).y;
  return above > 0.0f && t > 0.0f && t < cm.ground.reach ? t : CM_NO_GROUND;
#else
  return CM_NO_GROUND;
#endif
}

CM_FN bool cm_ground_catches() { return CM_GROUND != 0 && CM_SHADOW_CATCHER != 0 && cm.ground.catches != 0u; }

// Returns the distance to a ground that all rays hit; CM_NO_GROUND for a shadow catcher.
CM_FN float cm_solid_ground_distance(vec3 o, vec3 d) {
  return cm_ground_catches() ? CM_NO_GROUND : cm_ground_distance(o, d);
}

// Returns true if the ground is the end of a ray that otherwise ends at `reach`.
CM_FN bool cm_ground_ends(float ground, float reach) { return CM_GROUND != 0 && ground < min(reach, CM_NO_GROUND); }

#endif
