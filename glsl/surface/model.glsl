// Two-level BVH of a scene's triangles: a tree over the boxes of models, and per model the tree of its mesh (bvh.glsl)
// in the mesh's own space. Rays keep the same parameter t in both. So a moving model changes a record, not triangles.
// Shared by GLSL and C++. The includer has the requirements of bvh.glsl, the tables of model_table.glsl, and
//   uint cm_model   where functions may change it: the model whose mesh the words belong to
#ifndef CM_MODEL_GLSL
#define CM_MODEL_GLSL

#include "surface/model_space.glsl"

// cm_bvh_trace through all models. Camera rays (cm_hit_camera) pass models that only cast shadows.
CM_FN bool cm_trace_models(vec3 o, vec3 d, float t_min, float t_max, bool any, CM_OUT(CmHit) hit) {
  cm_bvh_begin(t_max, hit);
  float t_first = max(t_min, 0.0f);
  uint nodes = cm_model_nodes[0].skip;
  uint i = 0u;
  while (i < nodes) {
    vec3 slack;
    vec3 inverse = cm_bvh_inverse(d, slack);
    vec2 slabs = cm_bvh_slabs(cm_model_nodes[i].low, cm_model_nodes[i].high, o, inverse, slack);
    bool hits = max(slabs.x, t_first) <= min(slabs.y, hit.t);
    uint at = cm_model_nodes[i].instance;
    i = hits ? i + 1u : cm_model_nodes[i].skip;
    if (hits && at != CM_INSTANCE_NONE && (!cm_hit_camera || (cm_models[at].flags & CM_MODEL_SEEN) != 0u)) {
      cm_model = at;
      cm_bvh_search(cm_in_model_point(at, o), cm_in_model(at, d), t_first, any, hit);
      if (any && hit.triangle != CM_BVH_NONE) i = nodes;
    }
  }
  return hit.triangle != CM_BVH_NONE;
}

#endif
