// Equi-angular sampling (Kulla and Fajardo, "Importance Sampling Techniques for Path Tracing in Participating Media",
// EGSR 2012): NEE of lights from points along a camera or scattered ray. In a thin medium few rays collide, and seldom
// near the light. Shared by GLSL and C++. The includer has light.glsl and path_vertex.glsl before this, and kernels
// that traverse the grid have march.glsl.
//
// The light scattered towards the path along the ray is transmittance x extinction x lighting at the point. A ray gets
// as far as t with a probability equal to the transmittance, so a point sampled up to the ray's end needs no other
// weight (as for emission: free_flight.glsl). NEE after a collision can find the same light, with pdf extinction x
// transmittance x probability of picking these lights. The MIS weights depend only on the line, the point and the
// light, without the transmittance, which both pdfs contain. An equi-angular sample has weight cm_equiangular_weight,
// NEE after a collision has the rest.
#ifndef CM_EQUIANGULAR_GLSL
#define CM_EQUIANGULAR_GLSL

// A point on a ray, and a sample of a light from there.
struct CmPassed {
  bool to_light;
  vec3 o;           // cube space
  bool seen;        // the ray is a camera ray
  vec3 light;       // light added by an unblocked shadow ray, times scattering coefficient and phase function
  vec3 direction;   // world, unit: to the light
  float distance;
  float way;        // random number of its optical depth
#if CM_GROUPS
  uint group;       // light group
#endif
};

// Angle under which a point sees the part of a line from `before` to `behind`. Both are measured from the point's
// projection onto the line; `across` is its distance from the line.
CM_FN float cm_angle_of(float across, float before, float behind) {
  return atan(across * (behind - before), across * across + before * behind);
}

// Pdf by distance with which equi-angular sampling of a line's whole segment in the bounds takes its point o. The
// light's point is at that distance from o.
CM_FN float cm_equiangular_pdf(vec3 o, vec3 w, vec3 to_light, float distance) {
  float along = dot(w, to_light) * distance;
  float across = max(length(cross(w, to_light)), 1e-4f) * distance;
  vec2 line = cm_box_line(o, cm_to_cube(w));
  float angle = cm_angle_of(across, min(line.x, 0.0f) - along, max(line.y, 0.0f) - along);
  // Where a line only touches the bounds the pdf is unbounded, and its square would overflow.
  return min(across / max(angle * distance * distance, 1e-30f), 1e18f);
}

// MIS weight of an equi-angular sample at a point of this extinction: the power heuristic.
CM_FN float cm_equiangular_weight(float pdf, float extinction) {
  float collided = cm.lights.analytic_light_probability * extinction;
  return cm_balance(pdf * pdf, collided * collided);
}

// Returns true if a ray that ended when the path had this many events gets an equi-angular sample. Rays that end at a
// layer do not, because p.light holds the layer's color.
CM_FN bool cm_is_passed(CmPath p, uint events) {
  bool limited = cm.integrator.max_bounces != 0u && events >= cm.integrator.max_bounces;
  return !limited && !(events == 0u && p.at_layer != 0u);
}

// Samples a point on the ray, before the ray's event is handled.
CM_FN CmPassed cm_pass(CM_INOUT(CmPath) p, CmVertex vertex) {
  CmPassed passed;
  passed.to_light = false;
  passed.o = p.o;
  passed.seen = p.start == CM_AT_CAMERA;
  passed.light = vec3(0.0f, 0.0f, 0.0f);
  passed.direction = p.w;
  passed.distance = 0.0f;
  passed.way = 0.0f;
#if CM_GROUPS
  passed.group = 0u;
#endif
  if (p.ray != CM_RAY_SCATTERED || cm_is_dark(p) || !cm_is_passed(p, p.bounces)) return passed;
  vec2 range = cm_box_range(p.o, p.d);
  range.y = min(range.y, cm_scattered_end(p, vertex));
  CmAnalyticLight analytic_light = cm_pick_analytic_light(p, 0x51ed270bu);
#if CM_GROUPS
  passed.group = analytic_light.group;
#endif
  if (!(range.x < range.y) || analytic_light.kind == CM_ANALYTIC_LIGHT_DISTANT) return passed;
  vec2 u;
  vec2 on_analytic_light;
  if (p.bounces <= CM_EVEN_EVENTS) {
    uint set = 4u * (CM_EVEN_EVENTS + 1u) + 2u * p.bounces;
    u = cm_even_pair(p.number, p.stream, set);
    on_analytic_light = cm_even_pair(p.number, p.stream, set + 1u);
  } else {
    u.x = cm_random(p.random, p.stream);
    u.y = cm_random(p.random, p.stream);
    on_analytic_light.x = cm_random(p.random, p.stream);
    on_analytic_light.y = cm_random(p.random, p.stream);
  }
  vec3 from = analytic_light.extended != 0u ? cm_analytic_light_point(analytic_light, on_analytic_light.x, on_analytic_light.y) : vec3(0.0f, 0.0f, 0.0f);
  vec3 o = cm_from_cube_point(p.o);
  vec3 way = analytic_light.position + from - o;
  float along = dot(way, p.w);
  float across = max(length(cross(way, p.w)), 1e-4f * length(way));
  float before = range.x - along;
  float behind = range.y - along;
  float angle = cm_angle_of(across, before, behind);
  passed.way = u.y;
  float cosine = cos(u.x * angle);
  float sine = sin(u.x * angle);
  float t = along + across * (before * cosine + across * sine) / (across * cosine - before * sine);
  t = clamp(t, range.x, range.y);
  float pdf = across / (angle * (across * across + (t - along) * (t - along)));
  vec3 light = cm_analytic_light_irradiance(analytic_light, from, o + t * p.w, passed.direction, passed.distance);
  passed.light = p.throughput * light / (analytic_light.probability * pdf);
  passed.o = p.o + t * p.d;
  // A ray of no length, or a light on it, gives NaN or infinity.
  bool hidden = cm_solid_ground_distance(passed.o, cm_to_cube(passed.direction)) < passed.distance;
  float strongest = max(passed.light.x, max(passed.light.y, passed.light.z));
  passed.to_light = !hidden && angle > 0.0f && cm_is_positive(strongest) && strongest < 3.0e38f;
  // In a dense medium, estimated from the optical depth that the ray used, collisions find the light as well. Lights
  // that contribute little are not worth a shadow ray each. Both are skipped by Russian roulette.
  float depth_used = p.depth_0 - max(p.depth, 0.0f);
  float share = cm_equiangular_weight(cm_equiangular_pdf(passed.o, p.w, passed.direction, passed.distance),
                                      depth_used / (range.y - range.x));
  float probability = clamp(2.0f * cm.lights.analytic_light_probability, 0.0f, 1.0f) * min(1.0f, 2.0f * share);
  passed.to_light = passed.to_light && cm_random(p.random, p.stream) < probability;
  passed.light /= max(probability, 1e-30f);
  return passed;
}

// After the event: starts the shadow ray, before the path continues.
CM_FN void cm_equiangular_nee(CM_INOUT(CmPath) p, CmPassed passed, bool finished) {
  p.seen = passed.seen ? 1u : 0u;
  p.finishes = finished ? 1u : 0u;
  p.ahead = dot(cm_to_world(p.o - passed.o), p.w);
  p.o = passed.o;
  p.d = cm_to_cube(passed.direction);
  p.light = passed.light;
#if CM_GROUPS
  p.group = passed.group;
#endif
  p.reach = passed.distance;
  p.ray = CM_RAY_EQUIANGULAR;
  p.pdf = 0.0f;
  p.found = CM_FOUND_NOT_ASKED;
  p.depth_0 = cm_free_depth(passed.way) + CM_SHADOW_DEPTH;
  p.depth = p.depth_0;
  p.stage = CM_STAGE_AIM;
}

#endif
