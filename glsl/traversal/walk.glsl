// Deterministic traversal of a ray through the volume, or through all volumes together, segment by segment. Extinction
// is a polynomial in each segment (segment.glsl). Used for feature rays and transmittance; paths traverse volumes one
// by one (free_flight.glsl). The includer has march.glsl and ray.glsl before this.
#ifndef CM_WALK_GLSL
#define CM_WALK_GLSL

// Maximum number of volumes that a ray may be in at once. If more overlap, those entered last wait until others end.
#if CM_INSTANCES
#define CM_MAX_FRONTS 4
#define CM_IS_FRONT(k, walk) (k < walk.count)
#else
#define CM_MAX_FRONTS 1
#define CM_IS_FRONT(k, walk) (k < 1 && k < walk.count)  // without a loop
#endif

// An active volume of the ray: its current cell, which spans t_0 to t_1, with the extinction along it.
struct CmFront {
  uvec3 cell;
  uvec3 next;
  float t_0;
  float t_1;
  CmBernstein e;
  uint volume;
};

struct CmWalk {
  vec3 o;
  vec3 d;
  float t;  // start of the current segment
  float t_end;
  bool of_camera;  // a camera ray, which skips volumes hidden from cameras
  int count;
  CmFront front[CM_MAX_FRONTS];
  float entry;   // distance where it enters the next volume; 3e38: there is none
  uint volume;   // that next volume
};

void cm_stand_at(CmFront front) {
#if CM_INSTANCES
  cm_here = front.volume;
#endif
}

// Steps into front.next, from t on.
void cm_front_step(vec3 o, vec3 d, float t, inout CmFront front) {
  cm_stand_at(front);
  CmMarchRay ray = cm_march_ray(cm_in_volume_point(o), cm_in_volume(d));
  front.cell = front.next;
  front.t_0 = t;
  CmBernstein r;
  cm_march_step(front.cell, ray, t, front.t_1, r, front.next);
  front.e = CM_MEDIUM.extinction * r;
#if CM_CLIP
  float t_end = max(t, cm_clip_end(front.volume, ray.o, ray.d));
  if (t_end < front.t_1) {
    front.e = cm_segment_part(front.e, 0.0, (t_end - t) / (front.t_1 - t));
    front.t_1 = t_end;
    front.next.x = CM_NONE;
  }
#endif
}

float cm_front_extinction(CmFront front, float t) {
  if (t >= front.t_1) return cm_segment_end(front.e);
  return cm_segment_at(front.e, (t - front.t_0) / (front.t_1 - front.t_0));
}

// Position of t in the front's cell, from 0 to 1.
float cm_front_position(CmFront front, float t) {
  return t >= front.t_1 ? 1.0 : (t - front.t_0) / (front.t_1 - front.t_0);
}

// The extinction from t to t_1.
CmBernstein cm_front_part(CmFront front, float t, float t_1) {
#if CM_CUBIC
  if (t == front.t_0 && t_1 >= front.t_1) return front.e;
  return cm_segment_part(front.e, cm_front_position(front, t), cm_front_position(front, t_1));
#else
  return vec2(t == front.t_0 ? front.e.x : cm_front_extinction(front, t), cm_front_extinction(front, t_1));
#endif
}

// Finds the next volume.
void cm_walk_seek(inout CmWalk walk) {
#if CM_INSTANCES
  uint flags = walk.of_camera ? CM_INSTANCE_SEEN : 0u;
  if (!cm_next_instance(walk.o, walk.d, walk.t_end, flags, walk.entry, walk.volume)) walk.entry = 3.0e38;
#else
  walk.entry = 3.0e38;
#endif
}

CmWalk cm_walk(vec3 o, vec3 d, float t_end, bool of_camera) {
  CmWalk walk;
  walk.of_camera = of_camera;
  walk.o = o;
  walk.d = d;
  walk.t = 0.0;
  walk.t_end = t_end;
  walk.count = 0;
#if CM_INSTANCES
  walk.entry = -1.0;
  walk.volume = CM_INSTANCE_NONE;
  cm_walk_seek(walk);
#else
  vec2 range = cm_box_range(o, d);
  walk.t_end = min(range.y, t_end);
  walk.entry = range.x < walk.t_end ? range.x : 3.0e38;
  walk.volume = 0u;
#endif
  return walk;
}

// The segment from walk.t on. t_1: its end, which may be beyond t_end; e: extinction along it. Returns false if there
// is none.
bool cm_walk_part(inout CmWalk walk, out float t_1, out CmBernstein e) {
  t_1 = 3.0e38;
  e = CmBernstein(0.0);
  while (walk.count < CM_MAX_FRONTS && walk.entry < 3.0e38 && (walk.count == 0 || walk.entry <= walk.t)) {
    walk.t = max(walk.t, walk.entry);
    CmFront front;
    front.volume = walk.volume;
    cm_stand_at(front);
    front.next = cm_march_enter_at(walk.o, walk.d, walk.t);
    cm_front_step(walk.o, walk.d, walk.t, front);
    walk.front[walk.count] = front;
    walk.count += 1;
    cm_walk_seek(walk);
  }
  if (walk.count == 0 || walk.t >= walk.t_end) return false;
  if (walk.count < CM_MAX_FRONTS) t_1 = walk.entry;
  for (int k = 0; CM_IS_FRONT(k, walk); ++k) t_1 = min(t_1, walk.front[k].t_1);
  for (int k = 0; CM_IS_FRONT(k, walk); ++k) e += cm_front_part(walk.front[k], walk.t, t_1);
  return true;
}

// Advances to the segment after t_1.
void cm_walk_on(inout CmWalk walk, float t_1) {
  walk.t = t_1;
  int kept = 0;
  for (int k = 0; CM_IS_FRONT(k, walk); ++k) {
    CmFront front = walk.front[k];
    bool leaves = front.t_1 <= t_1;
    if (leaves && front.next.x == CM_NONE) continue;
    if (leaves) cm_front_step(walk.o, walk.d, walk.t, front);
    walk.front[kept] = front;
    kept += 1;
  }
  walk.count = kept;
}

// Advances to a volume that contains the point at t, and locates its cell as the first front. Returns false if there is
// none.
bool cm_walk_to(inout CmWalk walk, float t) {
  while (walk.entry < t) {
    CmFront front;
    front.volume = walk.volume;
    cm_stand_at(front);
    vec3 p = cm_in_volume_point(walk.o) + t * cm_in_volume(walk.d);
    bool kept = p == clamp(p, CM_GRID.box_min, CM_GRID.box_max);
#if CM_CLIP
    kept = kept && cm_clip_keeps(front.volume, p);
#endif
    if (kept) {
      front.cell = cm_march_enter(p);
      walk.front[0] = front;
      return true;
    }
    cm_walk_seek(walk);
  }
  return false;
}

// Returns the active volume with the maximum extinction at t.
uint cm_walk_densest(inout CmWalk walk, float t) {
  uint densest = walk.front[0].volume;
  float most = -1.0;
  for (int k = 0; CM_IS_FRONT(k, walk); ++k) {
    float extinction = cm_front_extinction(walk.front[k], t);
    if (extinction > most) densest = walk.front[k].volume;
    most = max(most, extinction);
  }
  return densest;
}

// Source radiance (emission over extinction) of the active media in the current segment.
vec3 cm_walk_source(inout CmWalk walk) {
#if CM_INSTANCES
  vec3 source = vec3(0.0);
  float sum = 0.0;
  for (int k = 0; CM_IS_FRONT(k, walk); ++k) {
    cm_stand_at(walk.front[k]);
    float extinction = cm_segment_mean(walk.front[k].e);
    if (CM_MEDIUM.holdout == 0u) source += extinction * CM_MEDIUM.source;
    sum += extinction;
  }
  return sum > 0.0 ? source / sum : vec3(0.0);
#else
  return cm.medium.source;
#endif
}

// The point of a ray at t, in the cube space of the volume where it stands.
vec3 cm_volume_point_at(vec3 o, vec3 d, float t) { return cm_in_volume_point(o) + t * cm_in_volume(d); }

// Albedo and mean scattering cosine of the active media at t, weighted by extinction.
vec4 cm_walk_scatters(inout CmWalk walk, float t) {
  vec4 scatters = vec4(0.0);
  float sum = 0.0;
  for (int k = 0; CM_IS_FRONT(k, walk); ++k) {
    cm_stand_at(walk.front[k]);
    float extinction = cm_segment_mean(walk.front[k].e);
    vec3 albedo = CM_MEDIUM.holdout != 0u ? vec3(0.0) : CM_MEDIUM.albedo;
    vec4 here = vec4(albedo, mix(CM_MEDIUM.anisotropy, CM_MEDIUM.second_anisotropy, CM_MEDIUM.second_weight));
#if CM_CHANNELS
    if (CM_MEDIUM.colored != 0u) here.rgb *= cm_march_color(walk.front[k].cell.xy, cm_volume_point_at(walk.o, walk.d, t));
    if (CM_MEDIUM.anisotropic != 0u) here.a = cm_march_anisotropy(walk.front[k].cell.xy, cm_volume_point_at(walk.o, walk.d, t));
#endif
    scatters += extinction * here;
    sum += extinction;
  }
  return sum > 0.0 ? scatters / sum : vec4(0.0);
}

#if CM_VELOCITY
// Velocity of the media at t, weighted by extinction in the segment up to t_1; world units per second.
vec3 cm_walk_velocity(inout CmWalk walk, float t_1, float t) {
  vec3 velocity = vec3(0.0);
  float sum = 0.0;
  for (int k = 0; CM_IS_FRONT(k, walk); ++k) {
    CmFront front = walk.front[k];
    cm_stand_at(front);
    float extinction = cm_front_extinction(front, walk.t) + cm_front_extinction(front, t_1);
    if (extinction > 0.0 && CM_GRID.moves != 0u)
      velocity += extinction * cm_out_of_volume(cm_march_velocity(front.cell.xy, cm_volume_point_at(walk.o, walk.d, t)));
    sum += extinction;
  }
  return sum > 0.0 ? velocity / sum : vec3(0.0);
}
#endif

#if CM_CHANNELS
// Emission of the active cells from the segment's start to t_1.
vec3 cm_walk_emitted(inout CmWalk walk, float t_1) {
  vec3 emitted = vec3(0.0);
  for (int k = 0; CM_IS_FRONT(k, walk); ++k) {
    CmFront front = walk.front[k];
    cm_stand_at(front);
    if (CM_MEDIUM.holdout != 0u) continue;
    CmEmission emission =
        cm_march_emission(front.cell, cm_in_volume_point(walk.o), cm_in_volume(walk.d));
    emitted += cm_emitted(emission, walk.t, t_1);
  }
  return emitted;
}
#endif

#endif
