// The path tracer: one path at a time, as a machine that can stop after any number of steps and go on later with the
// same result. Shared by GLSL and C++; the includer provides
//   cm                                            the parameters
//   uvec3 cm_march_enter(vec3 p)                  the cell (or voxel) that holds point p of cube space
//   void cm_march_step(uvec3 cell, o, d, inv_d, t, t_1, r_0, r_1, next)
// which gives the part of the ray inside the cell, from t to t_1, the density at both ends (linear between them), and
// the next cell; next.x == CM_NONE outside. The third word of a cell is the march's own cache, CM_NONE when unknown.
//
// Free paths are sampled exactly: an optical depth -ln(1 - u) is used up along the march; inside a cell the depth is a
// quadratic in t, inverted in closed form. No majorant, no step size.
#ifndef CM_PATH_GLSL
#define CM_PATH_GLSL

#define CM_MODE_START 0u
#define CM_MODE_FLIGHT 1u
#define CM_MODE_SHADOW_SUN 2u
#define CM_MODE_SHADOW_SKY 3u
#define CM_MODE_DONE 4u

#define CM_EVENT_NONE 0u
#define CM_EVENT_COLLISION 1u
#define CM_EVENT_ESCAPE 2u

// Next-event transmittance below e^-2 is estimated by Russian roulette: an opaque way out costs no more than it tells.
#define CM_SHADOW_DEPTH 2.0f

// Cells marched before events are looked at: keeps neighbouring lanes together.
#ifndef CM_CHUNK
#define CM_CHUNK 16
#endif

struct CmPath {
  vec3 o;           // cube space
  float t;          // world distance from o
  vec3 d;           // cube space, per unit of world distance
  float depth;      // optical depth left before the collision (or the end of the shadow ray)
  vec3 w;           // world direction of flight, kept during shadow rays
  float depth_0;    // optical depth at the ray's start
  vec3 throughput;
  uint mode;
  vec3 radiance;    // of this sample so far
  uint bounce;
  vec3 light;       // what the shadow ray carries if nothing stops it
  uint random;
  uvec3 cell;
  uint stream;
  uvec2 home;       // the cell of o, while a shadow ray is under way
  uint samples;     // finished in this pixel
  uint steps;       // of all its samples
};

CM_FN vec3 cm_to_cube(vec3 v) { return cm.to_cube_x.xyz * v.x + cm.to_cube_y.xyz * v.y + cm.to_cube_z.xyz * v.z; }

// Where a ray is inside the box: t.x to t.y, empty if t.x > t.y.
CM_FN vec2 cm_box_range(vec3 o, vec3 d) {
  float t_in = 0.0f;
  float t_out = 3.0e38f;
  for (int axis = 0; axis < 3; ++axis) {
    if (d[axis] != 0.0f) {
      float a = (cm.box_min[axis] - o[axis]) / d[axis];
      float b = (cm.box_max[axis] - o[axis]) / d[axis];
      t_in = max(t_in, min(a, b));
      t_out = min(t_out, max(a, b));
    } else if (o[axis] < cm.box_min[axis] || o[axis] > cm.box_max[axis]) {
      t_out = -1.0f;
    }
  }
  return vec2(t_in, t_out);
}

CM_FN void cm_finish(CM_INOUT(CmPath) p, CM_INOUT(vec4) sum) {
  sum += vec4(p.radiance, p.bounce > 0u ? 1.0f : 0.0f);
  p.samples += 1u;
  p.mode = p.samples >= cm.image.w ? CM_MODE_DONE : CM_MODE_START;
}

CM_FN vec3 cm_camera_direction(uvec2 pixel, vec2 within) {
  float x = 2.0f * (float(pixel.x) + within.x) / float(cm.image.x) - 1.0f;
  float y = 1.0f - 2.0f * (float(pixel.y) + within.y) / float(cm.image.y);
  return normalize(cm.forward.xyz + x * cm.right.xyz + y * cm.up.xyz);
}

CM_FN void cm_start(CM_INOUT(CmPath) p, uvec2 pixel, CM_INOUT(vec4) sum) {
  uvec3 h = cm_hash3(uvec3(pixel.y * cm.image.x + pixel.x, p.samples, cm.image.z));
  p.random = h.x;
  p.stream = h.y | 1u;
  float jitter_x = cm_random(p.random, p.stream);
  float jitter_y = cm_random(p.random, p.stream);
  p.w = cm_camera_direction(pixel, vec2(jitter_x, jitter_y));
  p.o = cm.eye.xyz;
  p.d = cm_to_cube(p.w);
  p.throughput = vec3(1.0f, 1.0f, 1.0f);
  p.radiance = vec3(0.0f, 0.0f, 0.0f);
  p.bounce = 0u;
  vec2 range = cm_box_range(p.o, p.d);
  if (!(range.x < range.y)) {
    p.radiance = cm.sky_radiance.xyz;
    cm_finish(p, sum);
    return;
  }
  p.t = range.x;
  vec3 entry = p.o + range.x * p.d;
  p.cell = cm_march_enter(clamp(entry, cm.box_min.xyz, cm.box_max.xyz));
  p.depth_0 = cm_random_depth(p.random, p.stream);
  p.depth = p.depth_0;
  p.mode = CM_MODE_FLIGHT;
}

// A new direction from the phase function, and a new free path.
CM_FN void cm_fly_on(CM_INOUT(CmPath) p) {
  float cosine = cm_phase_cosine(cm.medium.y, cm_random(p.random, p.stream));
  float angle = 6.28318531f * cm_random(p.random, p.stream);
  p.w = cm_around(p.w, cosine, angle);
  p.d = cm_to_cube(p.w);
  p.t = 0.0f;
  p.cell = uvec3(p.home.x, p.home.y, CM_NONE);
  p.depth_0 = cm_random_depth(p.random, p.stream);
  p.depth = p.depth_0;
  p.mode = CM_MODE_FLIGHT;
}

CM_FN void cm_collide(CM_INOUT(CmPath) p, CM_INOUT(vec4) sum) {
  p.bounce += 1u;
  p.throughput *= cm.albedo.xyz;
  float strongest = max(p.throughput.x, max(p.throughput.y, p.throughput.z));
  bool alive = strongest > 0.0f && (cm.march.y == 0u || p.bounce <= cm.march.y);
  if (alive && strongest < 0.5f) {
    float survival = max(strongest, 0.05f);
    alive = cm_random(p.random, p.stream) < survival;
    p.throughput = p.throughput / survival;
  }
  if (!alive) {
    cm_finish(p, sum);
    return;
  }
  p.o = p.o + p.t * p.d;
  p.t = 0.0f;
  p.home = uvec2(p.cell.x, p.cell.y);
  // One next-event estimate: to the sky with probability q, else to the sun.
  float q = cm.medium.z;
  bool to_sky = cm_random(p.random, p.stream) < q;
  if (to_sky) {
    float cosine = cm_phase_cosine(cm.medium.y, cm_random(p.random, p.stream));
    float angle = 6.28318531f * cm_random(p.random, p.stream);
    p.d = cm_to_cube(cm_around(p.w, cosine, angle));
    p.light = p.throughput * cm.sky_radiance.xyz;
    p.mode = CM_MODE_SHADOW_SKY;
  } else {
    p.d = cm.sun_cube.xyz;
    float phase = cm_phase(cm.medium.y, dot(p.w, cm.sun_world.xyz));
    p.light = p.throughput * cm.sun_irradiance.xyz * (phase / max(1.0f - q, 1e-6f));
    p.mode = CM_MODE_SHADOW_SUN;
  }
  if (p.light.x + p.light.y + p.light.z > 0.0f) {
    p.depth_0 = CM_SHADOW_DEPTH + cm_random_depth(p.random, p.stream);
    p.depth = p.depth_0;
    p.cell.z = CM_NONE;
  } else {
    cm_fly_on(p);
  }
}

CM_FN void cm_escape(CM_INOUT(CmPath) p, CM_INOUT(vec4) sum) {
  float depth = p.depth_0 - p.depth;
  float transmittance = exp(-depth);
  // Sky: the flight escapes with probability T, next-event estimation has density q of the same directions. The balance
  // heuristic gives T / (q + T) to the one and q / (q + T), times T / q, to the other.
  float balanced = transmittance / max(cm.medium.z + transmittance, 1e-30f);
  if (p.mode == CM_MODE_FLIGHT) {
    p.radiance += p.throughput * cm.sky_radiance.xyz * (p.bounce == 0u ? 1.0f : balanced);
    cm_finish(p, sum);
  } else {
    float survival = min(1.0f, exp(CM_SHADOW_DEPTH - depth));
    p.radiance += p.light * ((p.mode == CM_MODE_SHADOW_SKY ? balanced : transmittance) / survival);
    cm_fly_on(p);
  }
}

// Marches at most CM_CHUNK cells. Leaves t, cell and depth at the event, or where it got.
CM_FN uint cm_march(CM_INOUT(CmPath) p) {
  float t_end = cm_box_range(p.o, p.d).y;
  vec3 inv_d = vec3(1.0f, 1.0f, 1.0f) / p.d;
  uint event = CM_EVENT_NONE;
  for (int i = 0; i < CM_CHUNK && event == CM_EVENT_NONE; ++i) {
    float t_1 = 0.0f;
    float r_0 = 0.0f;
    float r_1 = 0.0f;
    uvec3 next = uvec3(CM_NONE, 0u, CM_NONE);
    cm_march_step(p.cell, p.o, p.d, inv_d, p.t, t_1, r_0, r_1, next);
    p.steps += 1u;
    float e_0 = cm.medium.x * r_0;
    float e_1 = cm.medium.x * r_1;
    float span = t_1 - p.t;
    float used = 0.5f * (e_0 + e_1) * span;
    if (used > p.depth) {
      // e_0 s + (e_1 - e_0) s^2 / (2 span) = depth, in the form that loses nothing.
      float root = sqrt(max(0.0f, e_0 * e_0 + 2.0f * (e_1 - e_0) / span * p.depth));
      p.t += min(span, 2.0f * p.depth / (e_0 + root));
      p.depth = -1.0f;
      event = CM_EVENT_COLLISION;
    } else {
      p.depth -= used;
      p.t = t_1;
      p.cell = next;
      if (next.x == CM_NONE || t_1 >= t_end) event = CM_EVENT_ESCAPE;
    }
  }
  return event;
}

// At most `iterations` chunks of this pixel's samples.
CM_FN void cm_run(CM_INOUT(CmPath) p, uvec2 pixel, uint iterations, CM_INOUT(vec4) sum) {
  for (uint i = 0u; i < iterations && p.mode != CM_MODE_DONE; ++i) {
    if (p.mode == CM_MODE_START) cm_start(p, pixel, sum);
    if (p.mode == CM_MODE_FLIGHT || p.mode == CM_MODE_SHADOW_SUN || p.mode == CM_MODE_SHADOW_SKY) {
      uint event = cm_march(p);
      if (event == CM_EVENT_COLLISION) {
        if (p.mode == CM_MODE_FLIGHT) {
          cm_collide(p, sum);
        } else {
          cm_fly_on(p);
        }
      } else if (event == CM_EVENT_ESCAPE) {
        cm_escape(p, sum);
      }
    }
  }
}

#endif
