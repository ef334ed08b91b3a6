// Camera rays and the bounds of all density. Shared by GLSL and C++; the includer has
//   cm   the parameters (glsl/common/parameters.glsl)
#ifndef CM_RAY_GLSL
#define CM_RAY_GLSL

CM_FN vec3 cm_to_cube(vec3 v) { return cm.space.to_cube_x * v.x + cm.space.to_cube_y * v.y + cm.space.to_cube_z * v.z; }

CM_FN vec3 cm_to_world(vec3 v) {
  return cm.space.from_cube_x * v.x + cm.space.from_cube_y * v.y + cm.space.from_cube_z * v.z;
}
// Transforms a vector from the cube space of the current volume (glsl/traversal/current_volume.glsl) to the world.
CM_FN vec3 cm_out_of_volume(vec3 v) {
#if CM_INSTANCES
#if CM_MOTION
  if (cm_instance_moves(cm_here)) return cm_from_instance(cm_instance_transform(cm_here), v);
#endif
  return cm_instances[cm_here].space.from_cube_x * v.x + cm_instances[cm_here].space.from_cube_y * v.y +
         cm_instances[cm_here].space.from_cube_z * v.z;
#else
  return cm_to_world(v);
#endif
}
CM_FN vec3 cm_from_cube_point(vec3 p) { return cm_to_world(p) + cm.space.cube_origin; }
CM_FN vec3 cm_to_cube_point(vec3 p) { return cm_to_cube(p - cm.space.cube_origin); }

// Interval of a line, o + t d for any t, inside the bounds: t.x to t.y, empty if t.x > t.y.
CM_FN vec2 cm_box_line(vec3 o, vec3 d) {
  float t_in = -3.0e38f;
  float t_out = 3.0e38f;
  for (int axis = 0; axis < 3; ++axis) {
    if (d[axis] != 0.0f) {
      float a = (cm.space.box_min[axis] - o[axis]) / d[axis];
      float b = (cm.space.box_max[axis] - o[axis]) / d[axis];
      t_in = max(t_in, min(a, b));
      t_out = min(t_out, max(a, b));
    } else if (o[axis] < cm.space.box_min[axis] || o[axis] > cm.space.box_max[axis]) {
      t_in = 1.0f;
      t_out = -1.0f;
    }
  }
  return vec2(t_in, t_out);
}
// Interval of a ray inside the bounds, for t >= 0.
CM_FN vec2 cm_box_range(vec3 o, vec3 d) {
  vec2 line = cm_box_line(o, d);
  return vec2(max(0.0f, line.x), line.y);
}

// Maps the unit square uniformly onto the unit disk, center to center (Shirley and Chiu, "A Low Distortion Map Between
// Disk and Square", 1997).
CM_FN vec2 cm_on_disc(vec2 square) {
  vec2 s = 2.0f * square - vec2(1.0f, 1.0f);
  bool wide = abs(s.x) > abs(s.y);
  float radius = wide ? s.x : s.y;
  if (radius == 0.0f) return vec2(0.0f, 0.0f);
  float angle = 0.785398163f * (wide ? s.y / s.x : 2.0f - s.x / s.y);
  return radius * vec2(cos(angle), sin(angle));
}

#if CM_MOTION
CM_FN vec3 cm_turned(vec3 v) {
  float c = cos(cm.shutter.angle * cm_now);
  float s = sin(cm.shutter.angle * cm_now);
  return c * v + s * cross(cm.shutter.axis, v) + ((1.0f - c) * dot(cm.shutter.axis, v)) * cm.shutter.axis;
}
// The camera at cm_now: its axes rotate uniformly about one axis; all other fields are interpolated linearly.
CM_FN CmView cm_view() {
  CmView view = cm.view;
  view.eye = mix(cm.shutter.open.eye, cm.shutter.close.eye, cm_now);
  view.forward = cm_turned(mix(cm.shutter.open.forward, cm.shutter.close.forward, cm_now));
  view.right = cm_turned(mix(cm.shutter.open.right, cm.shutter.close.right, cm_now));
  view.up = cm_turned(mix(cm.shutter.open.up, cm.shutter.close.up, cm_now));
  view.inverse_focus = mix(cm.shutter.open.inverse_focus, cm.shutter.close.inverse_focus, cm_now);
  view.lens_right = mix(cm.shutter.open.lens_right, cm.shutter.close.lens_right, cm_now);
  view.lens_up = mix(cm.shutter.open.lens_up, cm.shutter.close.lens_up, cm_now);
  return view;
}
#define CM_VIEW view
#else
#define CM_VIEW cm.view
#endif

// Ray through a point of a pixel and a point of the lens (unit disk). o: cube space; w: unit vector in world space.
// Returns the distance along it per unit of view depth.
CM_FN float cm_lens_ray(uvec2 pixel, vec2 within, vec2 lens, CM_OUT(vec3) o, CM_OUT(vec3) w) {
#if CM_MOTION
  CmView view = cm_view();
#endif
  float x = 2.0f * (float(pixel.x) + within.x) / float(CM_VIEW.size.x) - 1.0f;
  float y = 1.0f - 2.0f * (float(pixel.y) + within.y) / float(CM_VIEW.size.y);
  vec3 aside = x * CM_VIEW.right + y * CM_VIEW.up;
  vec3 off = lens.x * CM_VIEW.lens_right * CM_VIEW.right + lens.y * CM_VIEW.lens_up * CM_VIEW.up;
  vec3 v = CM_VIEW.forward + (1.0f - float(CM_VIEW.orthographic)) * aside - CM_VIEW.inverse_focus * off;
  o = CM_VIEW.eye + cm_to_cube(float(CM_VIEW.orthographic) * aside + off);
  w = normalize(v);
  return length(v);
}
// Ray through the center of the lens.
CM_FN float cm_camera_ray(uvec2 pixel, vec2 within, CM_OUT(vec3) o, CM_OUT(vec3) w) {
  return cm_lens_ray(pixel, within, vec2(0.0f, 0.0f), o, w);
}

#endif
