// Extinction at a point of the medium. Shared by GLSL and C++; the includer has march.glsl and path_state.glsl before
// this.
#ifndef CM_EXTINCTION_AT_GLSL
#define CM_EXTINCTION_AT_GLSL

struct CmExtinction {
  float extinction;
  uvec2 cell;  // cell in which the light scatters
#if CM_INSTANCES
  uint instance;  // volume of that cell; chosen at random in proportion to the extinctions there
#endif
};

// Extinction of the current volume of glsl/traversal/current_volume.glsl.
CM_FN float cm_extinction_here(vec3 o, vec3 d, uvec3 cell) {
  CmMarchRay ray = cm_march_ray(cm_in_volume_point(o), cm_in_volume(d));
  float t_1;
  CmBernstein r;
  uvec3 next;
  cm_march_step(cell, ray, 0.0f, t_1, r, next);
  return CM_MEDIUM.extinction * r.x;
}

// Extinction at p.o. cell: without CM_INSTANCES the cell of p.o, CM_NONE if it has none. seen: only volumes visible to
// cameras.
CM_FN CmExtinction cm_extinction_at(CM_INOUT(CmPath) p, uvec2 cell, bool seen) {
  CmExtinction there;
  there.extinction = 0.0f;
  there.cell = cell;
#if CM_INSTANCES
  uint stood = cm_here;
  there.instance = 0u;
  float entry = -1.0f;
  uint instance = CM_INSTANCE_NONE;
  while (cm_next_instance(p.o, p.d, 1e-30f, seen ? CM_INSTANCE_SEEN : 0u, entry, instance)) {
    cm_here = instance;
    uvec3 at = cm_march_enter_at(p.o, p.d, 0.0f);
    float extinction = cm_extinction_here(p.o, p.d, at);
    there.extinction += extinction;
    if (cm_random(p.random, p.stream) * there.extinction < extinction) {
      there.cell = uvec2(at.x, at.y);
      there.instance = instance;
    }
  }
  cm_here = stood;
#else
  if (cell.x != CM_NONE) there.extinction = cm_extinction_here(p.o, p.d, uvec3(cell.x, cell.y, CM_NONE));
#endif
  return there;
}

#endif
