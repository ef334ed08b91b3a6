#version 450
// Feature buffers (AOVs), without noise except that of BLEND surfaces' stochastic coverage. They are anti-aliased by a
// fixed set of feature rays. cm.dispatch.samples is the number of rays per pixel; earlier dispatches traced rays_before
// of them. A pixel whose first rays_least rays agree traces no more.
//   normal        mean shading normal of the nearest surface (world space, towards the eye), 0 if there is none; the
//                 volume is ignored
//   albedo        mean base color of the nearest surface, 0 if there is none; the volume is ignored
//   transmittance of the volume up to the nearest surface (including the host's), or through all of it; mean
//   surface z     view depth of that surface at the pixel's center, infinity if there is none
//   volume z      view depth at the pixel's center where the volume in front of it reaches half opacity, else infinity
//   emission      directly visible emission, unscattered: of the volume along the ray, and of the nearest surface
//                 through it, if it is not behind the ground; plus sunlight scattered once to the eye. Alpha is the
//                 fraction of the sunlight. Sunlight on surfaces is their diffuse part, with shadows; in the volume it
//                 is approximate. Neither is included if the scene has extended materials. Holdouts add no sunlight,
//                 and holdout surfaces no emission; mean
//   velocity      of the volume at its first scattering, world units per second; mean, 0 if nothing scatters
//   motion        motion vectors from the current position to that one frame ago, pixels, y up. xy: of the surface or
//                 ground, or else the background, at the pixel's center; the volume is ignored. zw: of the volume at
//                 its first scattering, mean, 0 if nothing scatters
// Additional components, for temporal reprojection: normal.w is the view depth of the surface or ground at the pixel's
// center. albedo.w is the mean view depth of the volume's first scattering, infinity if there is none. transmittance.y
// is the fraction covered by surfaces, volume z's second component the fraction covered by the ground. For the
// convergence test, transmittance.z is the number of rays and .w the mean square of cm_seen_along per ray.
// variants: VOLUME or VOLUMES or VOLUMES CM_CLIP=1
// variants: - or CM_SURFACES=1
// variants: - or CM_CHANNELS=1 or CM_CHANNELS=1 CM_VELOCITY=1
layout(local_size_x = 8, local_size_y = 8) in;

#include "common/bindings.glsl"
#include "common/shared.glsl"
#include "common/parameters.glsl"
#include "grid/cell.glsl"
#include "common/random.glsl"
#include "common/luminance.glsl"
#include "common/frame.glsl"
#include "path/phase.glsl"
#include "common/buffers.glsl"
#include "traversal/march.glsl"
#if CM_SURFACES
#define CM_BVH_SHARED_STACK 64u
#include "surface/surface.glsl"
#endif
#include "traversal/ray.glsl"
#include "traversal/walk.glsl"
#include "surface/ground.glsl"
#include "features/feature_ray.glsl"

layout(rgba32f, binding = CM_IMAGE_NORMAL) uniform image2D cm_normal;
layout(rgba32f, binding = CM_IMAGE_ALBEDO) uniform image2D cm_albedo;
layout(rgba32f, binding = CM_IMAGE_TRANSMITTANCE) uniform image2D cm_transmittance;
layout(r32f, binding = CM_IMAGE_SURFACE_Z) uniform writeonly image2D cm_surface_depth;
layout(rg32f, binding = CM_IMAGE_VOLUME_Z) uniform image2D cm_volume_z;
layout(rgba32f, binding = CM_IMAGE_EMISSION) uniform image2D cm_emission_out;
#if CM_VELOCITY
layout(rgba32f, binding = CM_IMAGE_VELOCITY) uniform image2D cm_velocity;
layout(rgba32f, binding = CM_IMAGE_MOTION) uniform image2D cm_motion;

#include "features/motion.glsl"
layout(std140, binding = CM_STORAGE_MOTION) readonly buffer CmMotions {
  CmMotionFrame cm_motion_frame;
  CmMotion cm_motions[];
};
#define CM_MOTION_NOW 0u
#define CM_MOTION_STILL 1u
#define CM_MOTION_VOLUMES 2u

vec3 cm_move(uint map, vec3 v) { return cm_motions[map].x * v.x + cm_motions[map].y * v.y + cm_motions[map].z * v.z; }
vec3 cm_move_point(uint map, vec3 p) { return cm_move(map, p) + cm_motions[map].origin; }

// Motion vector in pixels between two positions in views; 0 if one of them is behind the eye.
vec2 cm_backward(vec3 now, vec3 then) {
  bool parallel_now = cm_motion_frame.orthographic_now != 0u;
  bool parallel_then = cm_motion_frame.orthographic_then != 0u;
  if ((!parallel_now && now.z <= 0.0) || (!parallel_then && then.z <= 0.0)) return vec2(0.0);
  vec2 to = parallel_then ? then.xy : then.xy / then.z;
  vec2 from = parallel_now ? now.xy : now.xy / now.z;
  return 0.5 * vec2(cm.view.size) * (to - from);
}

// Motion vector of a point in ray space, moved by a map.
vec2 cm_backward_point(vec3 now, vec3 then, uint map) {
  return cm_backward(cm_move_point(CM_MOTION_NOW, now), cm_move_point(map, then));
}

// Motion vector of the background in this direction.
vec2 cm_backward_far(vec3 d) {
  if (cm_motion_frame.orthographic_now != 0u || cm_motion_frame.orthographic_then != 0u) return vec2(0.0);
  return cm_backward(cm_move(CM_MOTION_NOW, d), cm_move(CM_MOTION_STILL, d));
}

#if CM_SURFACES
// Motion vector of a point of a triangle, which is now at p.
vec2 cm_backward_surface(CmHit hit, vec3 p) {
  uint model = cm_model_of(hit.triangle);
  CmVertexMix m = cm_vertex_mix(model, hit.triangle - cm_models[model].first, hit.barycentrics);
  uint map = cm_motion_frame.first_model + model;
  vec3 then = vec3(0.0);
  for (int i = 0; i < 3; ++i)
    then += m.weight[i] * vec3(cm_floats(cm_motions[map].vertices + m.corner[i] - cm_models[model].vertices));
  return cm_backward(cm_move_point(CM_MOTION_NOW, cm_to_cube_point(p)), cm_move_point(map, then));
}
#endif

// Motion vector of the media at t, weighted by extinction in the ray's segment up to t_1.
vec2 cm_walk_backward(inout CmWalk walk, float t_1, float t) {
  vec3 p = walk.o + t * walk.d;
  vec2 motion = vec2(0.0);
  float sum = 0.0;
  for (int k = 0; CM_IS_FRONT(k, walk); ++k) {
    CmFront front = walk.front[k];
    cm_stand_at(front);
    float extinction = cm_front_extinction(front, walk.t) + cm_front_extinction(front, t_1);
    vec3 then = p;
    if (CM_GRID.moves != 0u)
      then -= cm_motion_frame.seconds * cm_to_cube(cm_out_of_volume(cm_march_velocity(front.cell.xy, cm_volume_point_at(walk.o, walk.d, t))));
    motion += extinction * cm_backward_point(p, then, CM_MOTION_VOLUMES + front.volume);
    sum += extinction;
  }
  return sum > 0.0 ? motion / sum : vec2(0.0);
}
#endif

#define CM_INFINITE uintBitsToFloat(0x7f800000u)
#define CM_OCTAVES 4u

// Direction to a point of the sun.
vec3 cm_to_sun(vec2 u) {
  vec3 across;
  vec3 along;
  cm_frame(cm.lights.sun_direction, across, along);
  vec2 apart = sqrt(2.0 * cm.lights.sun_spread) * cm_on_disc(u);
  return normalize(cm.lights.sun_direction + apart.x * across + apart.y * along);
}

// Optical depth from a point (world) to infinity along d; 1e30 if a surface or the ground is in between.
float cm_depth_to_far(vec3 from, vec3 d) {
  vec3 o = cm_to_cube_point(from);
  if (cm_solid_ground_distance(o, cm_to_cube(d)) < CM_NO_GROUND) return 1e30;
#if CM_SURFACES
  CmHit hit;
  cm_hit_camera = false;
  if (cm_trace_models(from, d, 0.0, 3.0e38, true, hit)) return 1e30;
#endif
  float used = 0.0;
  CmWalk walk = cm_walk(o, cm_to_cube(d), 3.0e38, false);
  float t_1;
  CmBernstein e;
  for (int j = 0; j < 100000 && used < 40.0 && cm_walk_part(walk, t_1, e); ++j) {
    used += cm_depth_of(e, t_1 - walk.t, t_1 - walk.t);
    cm_walk_on(walk, t_1);
  }
  return used;
}

// Approximate phase function with multiple scattering, times transmittance, for light through this optical depth. Each
// octave halves the weight, the optical depth and the mean cosine (Wrenninge, Kulla and Lundqvist, "Oz: The Great and
// Volumetric", SIGGRAPH Talks 2013).
float cm_scattered_by_many(float g, float cosine, float depth) {
  uint most = cm.integrator.max_bounces == 0u ? CM_OCTAVES : min(CM_OCTAVES, cm.integrator.max_bounces);
  float sum = 0.0;
  float part = 1.0;
  for (uint n = 0u; n < most; ++n, part *= 0.5)
    sum += part * cm_henyey_greenstein(part * g, cosine) * exp(-part * depth);
  return sum;
}

// Depth at which feature ray i samples the sunlight in a medium, in standard deviations from its mean scattering depth.
// The rays follow an exponential distribution of depths, so that shadows in the medium are as soft as they should be.
float cm_deviation_of_ray(int i) { return -log(1.0 - fract(0.5 + float(i) * 0.6180339887)) - 1.0; }

// Scalar for the convergence test of feature rays: noise-free light (relative to the distant light), albedo and
// transmittance. It is linear in these.
float cm_seen_along(vec3 known, vec3 albedo, float transmittance) {
  float far = cm_luminance(cm.lights.sun_irradiance) * 0.318309886 + cm_luminance(cm.lights.sky_radiance);
  return cm_luminance(known) / max(far, 1e-6) + cm_luminance(albedo) + transmittance;
}

// Returns true if the standard error of the mean over the rays is at most 1 %, with a floor that ignores invisible
// errors.
bool cm_is_settled(float seen, float square, float transmittance, float rays) {
  float least = 0.01 * (seen - transmittance + 0.05);
  return square - seen * seen <= rays * least * least;
}

void main() {
  uvec2 local = gl_GlobalInvocationID.xy + uvec2(0u, cm.dispatch.rows.x);
  if (local.x >= cm.dispatch.tile_size.x || local.y >= cm.dispatch.rows.y) return;
  uvec2 pixel = cm.dispatch.tile_corner + local;
  vec3 normal = vec3(0.0);
  float transmittance = 0.0;
  vec3 albedo = vec3(0.0);
  float surface_z = CM_INFINITE;
  float volume_z = CM_INFINITE;
  float solid_z = CM_INFINITE;
  float scattered_z = 0.0;  // sum over scattering probabilities, and the sum of these
  float scattered = 0.0;
  vec2 covered = vec2(0.0);  // by surfaces, by the ground
  vec3 emission = vec3(0.0);
  vec3 sunlit = vec3(0.0);
#if CM_VELOCITY
  vec3 velocity = vec3(0.0);  // sums
  vec2 volume_motion = vec2(0.0);
  vec2 motion = vec2(0.0);
#endif
  ivec2 texel = ivec2(pixel);
  if (cm.dispatch.rays_before >= cm.dispatch.rays_least) {
    vec4 through = imageLoad(cm_transmittance, texel);
    float seen = cm_seen_along(imageLoad(cm_emission_out, texel).rgb, imageLoad(cm_albedo, texel).rgb, through.x);
    if (cm_is_settled(seen, through.w, through.x, through.z)) return;
  }
  float seen_before = 0.0;
  float squares = 0.0;
  for (int i = int(cm.dispatch.rays_before); i < int(cm.dispatch.samples); ++i) {
    CmFeatureRay ray = cm_feature_ray(pixel, i);
    vec3 o = ray.o;
    vec3 w = ray.w;
    vec3 d = ray.d;
    float t_per_z = ray.t_per_z;
    float surface_t = ray.end;
    vec3 to_sun = cm_to_sun(fract(0.5 + float(i) * vec2(0.8191725134, 0.6710436067)));
    vec3 sun_from[2];  // points lit by the sun: on the surface, in the medium
    vec2 scatters = vec2(0.0);  // of this ray: sums of scattering probabilities, and of depths
    vec4 medium = vec4(0.0);    // sums of albedo and mean cosine, in front of the surface and the ground
    vec3 before = vec3(0.0);    // sums of the probabilities there, of depths and of squared depths, relative to first_z
    float first_z = 0.0;
#if CM_SURFACES
    vec3 of_surface = vec3(0.0);
    vec3 of_sun = vec3(0.0);
    CmHit hit;
    if (cm_trace_models(cm_from_cube_point(o), w, 0.0, surface_t, false, hit)) {
      surface_t = hit.t;
      CmSurfacePoint point = cm_surface_point(hit.triangle, hit.barycentrics, w, !hit.front);
      normal += point.material.normal;
      albedo += point.material.base_color;
      covered.x += 1.0;
      bool is_hole = (cm_models[cm_model_of(hit.triangle)].flags & CM_MODEL_HOLDOUT) != 0u;
      if (!is_hole) of_surface = point.emission;
      float cosine = dot(point.material.matte_normal, to_sun);
      if (cosine > 0.0 && !point.unlit && !is_hole && cm.surfaces.extended_bsdf == 0u) {
        of_sun = 0.318309886 * cosine * cm_terminator(point.material, to_sun) * cm.lights.sun_irradiance *
                 cm_matte_albedo(point.material, dot(point.material.normal, -w));
        vec3 shift;
        sun_from[0] = cm_surface_origin(hit.triangle, hit.barycentrics, point.behind, point.lifted, to_sun, shift);
      }
#if CM_VELOCITY
      if (i == 0) motion = cm_backward_surface(hit, point.position);
#endif
    }
#endif
    if (i == 0 && surface_t < 1e37) surface_z = surface_t / t_per_z;
    float ground_t = cm_ground_distance(o, d);
    float solid_t = min(surface_t, ground_t);
    if (ground_t < min(surface_t, CM_NO_GROUND)) covered.y += 1.0;
    if (i == 0 && solid_t < 1e37) solid_z = solid_t / t_per_z;
#if CM_VELOCITY
    if (i == 0 && (covered.x == 0.0 || ground_t < surface_t)) {
      motion = solid_t < 1e37 ? cm_backward_point(o + solid_t * d, o + solid_t * d, CM_MOTION_STILL) : cm_backward_far(d);
    }
#endif
    float used = 0.0;
    float clear = 1.0;
    CmWalk walk = cm_walk(o, d, surface_t, true);
    // Beyond e^-40 nothing remains visible.
    float t_1;
    CmBernstein e;
    for (int j = 0; j < 100000 && used < 40.0 && cm_walk_part(walk, t_1, e); ++j) {
      float t = walk.t;
      float span = t_1 - t;
      float depth = cm_depth_of(e, span, walk.t_end - t);
      if (i == 0 && volume_z == CM_INFINITE && used + depth >= 0.69314718) {
        volume_z = (t + cm_depth_distance(e, span, 0.69314718 - used)) / t_per_z;
      }
      used += depth;
      // Scattering in this segment: its probability, and its mean position, as if extinction were constant.
      float probability = 1.0 - exp(-depth);
      float middle = t + cm_middle_of_part(depth, probability) * min(span, walk.t_end - t);
#if CM_CHANNELS
      // Absorption as if extinction were constant in this segment.
      float dimmed = depth > 1e-3 ? clear * probability / depth : clear;
      emission += dimmed * cm_walk_emitted(walk, min(t_1, solid_t));
#endif
      float z = middle / t_per_z;
      scatters += clear * probability * vec2(1.0, z);
      if (t < solid_t) {
        emission += clear * probability * cm_walk_source(walk);
        medium += clear * probability * cm_walk_scatters(walk, middle);
        if (before.x == 0.0) first_z = z;
        float beyond = z - first_z;
        before += clear * probability * vec3(1.0, beyond, beyond * beyond);
      }
#if CM_VELOCITY
      velocity += clear * probability * cm_walk_velocity(walk, t_1, middle);
      volume_motion += clear * probability * cm_walk_backward(walk, t_1, middle);
#endif
      clear -= clear * probability;
      cm_walk_on(walk, t_1);
    }
    transmittance += exp(-used);
#if CM_SURFACES
    // If another renderer draws the surfaces below, their light is not part of this image.
    bool drawn_here = cm.layers.count == 0u || cm.layers.colored != 0u;
    of_sun *= exp(-used);
    if (drawn_here && surface_t <= ground_t) {
      emission += exp(-used) * of_surface;
    } else {
      of_sun = vec3(0.0);
    }
#else
    vec3 of_sun = vec3(0.0);
#endif
    scattered += scatters.x;
    scattered_z += scatters.y;
    if (before.x > 0.0) {
      vec2 moments = before.yz / before.x;
      float sample_z = first_z + moments.x + sqrt(max(0.0, moments.y - moments.x * moments.x)) * cm_deviation_of_ray(i);
      sun_from[1] = cm_from_cube_point(o + min(sample_z * t_per_z, solid_t) * d);
    }
    vec3 light[2] = vec3[2](of_sun, medium.rgb * cm.lights.sun_irradiance);
#if CM_SURFACES
    if (cm.surfaces.extended_bsdf != 0u) light[1] = vec3(0.0);
#endif
    for (int k = 0; k < 2; ++k) {
      if (light[k] == vec3(0.0)) continue;
      float depth = cm_depth_to_far(sun_from[k], to_sun);
      sunlit += light[k] * (k == 0 ? exp(-depth) : cm_scattered_by_many(medium.a / before.x, dot(w, to_sun), depth));
    }
    float seen = cm_seen_along(emission + sunlit, albedo, transmittance);
    squares += (seen - seen_before) * (seen - seen_before);
    seen_before = seen;
  }
  // The buffers hold the means over earlier rays; converts them back to sums. The sum of a ray's scattering
  // probabilities is 1 - transmittance.
  float rays = float(cm.dispatch.samples - cm.dispatch.rays_before);
  vec3 known = emission + sunlit;
  float of_sun = known == vec3(0.0) ? 0.0 : cm_luminance(sunlit);
  if (cm.dispatch.rays_before > 0u) {
    vec4 through_before = imageLoad(cm_transmittance, texel);
    vec4 albedo_before = imageLoad(cm_albedo, texel);
    vec4 light_before = imageLoad(cm_emission_out, texel);
    float before = through_before.z;
    rays += before;
    vec4 normal_before = imageLoad(cm_normal, texel);
    vec2 volume_before = imageLoad(cm_volume_z, texel).xy;
    float probabilities = before * (1.0 - through_before.x);
    normal += before * normal_before.xyz;
    solid_z = normal_before.w;
    albedo += before * albedo_before.rgb;
    if (albedo_before.a < CM_INFINITE) {
      scattered_z += probabilities * albedo_before.a;
      scattered += probabilities;
    }
    transmittance += before * through_before.x;
    squares += before * through_before.w;
    covered += before * vec2(through_before.y, volume_before.y);
    volume_z = volume_before.x;
    known += before * light_before.rgb;
    of_sun += before * light_before.a * cm_luminance(light_before.rgb);
#if CM_VELOCITY
    vec4 motion_before = imageLoad(cm_motion, texel);
    velocity += probabilities * imageLoad(cm_velocity, texel).xyz;
    volume_motion += probabilities * motion_before.zw;
    motion = motion_before.xy;
#endif
  } else {
    imageStore(cm_surface_depth, texel, vec4(surface_z));
  }
  float share = 1.0 / rays;
  imageStore(cm_normal, texel, vec4(share * normal, solid_z));
  imageStore(cm_albedo, texel, vec4(share * albedo, scattered > 0.0 ? scattered_z / scattered : CM_INFINITE));
  imageStore(cm_transmittance, texel, vec4(share * vec2(transmittance, covered.x), rays, share * squares));
  imageStore(cm_volume_z, texel, vec4(volume_z, share * covered.y, 0.0, 0.0));
  imageStore(cm_emission_out, texel, vec4(share * known, of_sun == 0.0 ? 0.0 : of_sun / cm_luminance(known)));
#if CM_VELOCITY
  imageStore(cm_velocity, texel, vec4(scattered > 0.0 ? velocity / scattered : vec3(0.0), 0.0));
  imageStore(cm_motion, texel, vec4(motion, scattered > 0.0 ? volume_motion / scattered : vec2(0.0)));
#endif
}
