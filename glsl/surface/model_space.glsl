// Instance transforms of models. Shared by GLSL and C++; the includer has the tables of model_table.glsl.
#ifndef CM_MODEL_SPACE_GLSL
#define CM_MODEL_SPACE_GLSL

#if CM_MOTION
CM_FN CmInstanceTransform cm_model_end(uint at) {
  return CmInstanceTransform(cm_models[at].to_world_x, cm_models[at].to_world_y, cm_models[at].to_world_z, cm_models[at].origin);
}
// The table has further records behind its own: the transforms of all models at shutter open and at shutter close.
CM_FN uint cm_model_open(uint at) { return at + cm.surfaces.models; }
CM_FN uint cm_model_close(uint at) { return at + 2u * cm.surfaces.models; }
CM_FN bool cm_model_moves(uint at) { return (cm_models[at].flags & CM_MODEL_MOVES) != 0u; }
CM_FN CmInstanceTransform cm_model_transform(uint at) {
  return cm_between(cm_model_end(cm_model_open(at)), cm_model_end(cm_model_close(at)));
}
// For a deforming model those records name a tree and vertices of that time.
CM_FN bool cm_model_deforms(uint at) { return (cm_models[at].flags & CM_MODEL_DEFORMS) != 0u; }
#endif

// World position of the origin of a model's own space.
CM_FN vec3 cm_model_origin(uint at) {
#if CM_MOTION
  if (cm_model_moves(at)) return cm_model_transform(at).origin;
#endif
  return cm_models[at].origin;
}

// Transforms a vector and a point from the world to a model's own space, and back.
CM_FN vec3 cm_in_model(uint at, vec3 v) {
#if CM_MOTION
  if (cm_model_moves(at)) return cm_to_instance(cm_model_transform(at), v);
#endif
  return cm_models[at].to_own_x * v.x + cm_models[at].to_own_y * v.y + cm_models[at].to_own_z * v.z;
}
CM_FN vec3 cm_in_model_point(uint at, vec3 p) { return cm_in_model(at, p - cm_model_origin(at)); }
CM_FN vec3 cm_out_of_model(uint at, vec3 v) {
#if CM_MOTION
  if (cm_model_moves(at)) return cm_from_instance(cm_model_transform(at), v);
#endif
  return cm_models[at].to_world_x * v.x + cm_models[at].to_world_y * v.y + cm_models[at].to_world_z * v.z;
}
CM_FN vec3 cm_out_of_model_point(uint at, vec3 p) { return cm_out_of_model(at, p) + cm_model_origin(at); }

// Transforms a direction from a model's own space to the world, unit.
CM_FN vec3 cm_model_direction(uint at, vec3 d) {
  vec3 v = cm_out_of_model(at, d);
  float largest = max(max(abs(v.x), abs(v.y)), abs(v.z));
  return largest > 0.0f ? normalize(v / largest) : d;
}

// Transforms a normal from a model's own space to the world, unit, on the same side of the surface.
CM_FN vec3 cm_model_normal(uint at, vec3 n) {
  // Normals transform by the rows of the inverse.
  vec3 v = vec3(dot(cm_models[at].to_own_x, n), dot(cm_models[at].to_own_y, n), dot(cm_models[at].to_own_z, n));
#if CM_MOTION
  if (cm_model_moves(at)) {
    CmInstanceTransform s = cm_model_transform(at);
    v = (n.x * cross(s.y, s.z) + n.y * cross(s.z, s.x) + n.z * cross(s.x, s.y)) * sign(cm_transform_determinant(s));
  }
#endif
  float largest = max(max(abs(v.x), abs(v.y)), abs(v.z));
  return largest > 0.0f ? normalize(v / largest) : n;
}

// Area in a model's own space per unit area in the world, on a plane perpendicular to n (unit).
CM_FN float cm_own_area(uint at, vec3 n) {
#if CM_MOTION
  if (cm_model_moves(at)) {
    CmInstanceTransform s = cm_model_transform(at);
    return length(vec3(dot(s.x, n), dot(s.y, n), dot(s.z, n))) / abs(cm_transform_determinant(s));
  }
#endif
  vec3 v = vec3(dot(cm_models[at].to_world_x, n), dot(cm_models[at].to_world_y, n), dot(cm_models[at].to_world_z, n));
  return cm_models[at].own_volume * length(v);
}

// Bound of the rounding error of a surface point in world space, and of a ray in the model's own space.
CM_FN float cm_model_room(uint at, vec3 p) {
  vec3 o = abs(cm_model_origin(at));
  vec3 from = abs(p);
  return 5e-7f * (max(max(o.x, o.y), o.z) + max(max(from.x, from.y), from.z));
}

// Returns the model that contains the triangle of this number. O(log models).
CM_FN uint cm_model_of(uint triangle) {
  uint low = 0u;
  uint high = cm.surfaces.models;
  while (low + 1u < high) {
    uint middle = (low + high) >> 1u;
    bool below = cm_models[middle].first <= triangle;
    low = below ? middle : low;
    high = below ? high : middle;
  }
  return low;
}

#endif
