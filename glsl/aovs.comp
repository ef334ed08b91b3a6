#version 450
// What is known of a pixel without light, as AOVs: no noise but that of BLEND surfaces' chance, and anti-aliased by a
// fixed set of rays, cm.dispatch.samples of them.
//   normal        mean shading normal of the nearest surface (world space, towards the eye), 0 where there is none
//   albedo        mean base colour of the nearest surface, likewise; both as if there were no volume
//   transmittance of the volume up to the nearest surface, ours or the host's, or beyond the volume; mean
//   surface z     view depth of that surface at the pixel's centre, infinity where there is none
//   volume z      view depth at which the volume before it reaches half opacity, there too; infinity where it does not
//   emission      what reaches the eye straight from what gives it off, unscattered: the volume along the ray, and through
//                 it the nearest surface, none behind the ground; mean
//   velocity      of the volume where it scatters light for the first time, world units a second; mean, 0 where nothing
//                 scatters
// and, as a filter that follows what moves asks for them, beside the normal the view depth of what is solid at the
// pixel's centre, the ground counted in, and beside the albedo the mean view depth at which the volume scatters light
// for the first time, infinity where there is none; beside the transmittance the share that surfaces cover, beside the
// volume's depth the share that the ground covers.
// variants: CM_MARCH=0 CM_LINEAR=0,1 CM_PAGES=1,2,6 or CM_MARCH=1,2 CM_LINEAR=0 CM_PAGES=1 or CM_MARCH=0 CM_LINEAR=0,1 CM_PAGES=6 CM_INSTANCES=1 or CM_MARCH=1,2 CM_LINEAR=0 CM_PAGES=1 CM_INSTANCES=1
// variants: - or CM_SURFACES=1
// variants: - or CM_CHANNELS=1 or CM_CHANNELS=1 CM_VELOCITY=1
layout(local_size_x = 8, local_size_y = 8) in;

#include "bindings.glsl"
#include "shared.glsl"
#include "parameters.glsl"
#include "cell.glsl"
#include "random.glsl"
#include "phase.glsl"
#include "buffers.glsl"
#include "march.glsl"
#if CM_SURFACES
#define CM_BVH_SHARED_STACK 64u
#include "surface.glsl"
#endif
#include "ray.glsl"
#include "walk.glsl"
#include "ground.glsl"

layout(rgba32f, binding = CM_IMAGE_NORMAL) uniform writeonly image2D cm_normal;
layout(rgba32f, binding = CM_IMAGE_ALBEDO) uniform writeonly image2D cm_albedo;
layout(rg32f, binding = CM_IMAGE_TRANSMITTANCE) uniform writeonly image2D cm_transmittance;
layout(r32f, binding = CM_IMAGE_SURFACE_Z) uniform writeonly image2D cm_surface_depth;
layout(rg32f, binding = CM_IMAGE_VOLUME_Z) uniform writeonly image2D cm_volume_z;
layout(rgba32f, binding = CM_IMAGE_EMISSION) uniform writeonly image2D cm_emission_out;
#if CM_VELOCITY
layout(rgba32f, binding = CM_IMAGE_VELOCITY) uniform writeonly image2D cm_velocity;
#endif

#define CM_INFINITE uintBitsToFloat(0x7f800000u)

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
  float scattered_z = 0.0;  // sum, and of the chances
  float scattered = 0.0;
  vec2 covered = vec2(0.0);  // by surfaces, by the ground
  vec3 emission = vec3(0.0);
#if CM_VELOCITY
  vec3 velocity = vec3(0.0);  // sum
#endif
  float share = 1.0 / float(cm.dispatch.samples);
  for (int i = 0; i < int(cm.dispatch.samples); ++i) {
    // Roberts's sequences; the first ray is the pixel's and the lens' middle.
    vec2 within = fract(0.5 + float(i) * vec2(0.7548776662, 0.5698402910));
    vec3 o;
    vec3 w;
    vec2 lens = fract(0.5 + float(i) * vec2(0.6287067210, 0.5385972572));
    float t_per_z = cm_lens_ray(pixel, within, cm_on_disc(lens), o, w);
    vec3 d = cm_to_cube(w);
    float surface_t = t_per_z * cm_surface_z(pixel, within, uint(i));
#if CM_SURFACES
    vec3 of_surface = vec3(0.0);
    CmHit hit;
    cm_hit_seed = cm_hash3(uvec3(pixel.y * cm.view.size.x + pixel.x, uint(i), cm.integrator.seed)).x;
    cm_hit_camera = true;
    if (cm_trace_models(cm_from_cube_point(o), w, 0.0, surface_t, false, hit)) {
      surface_t = hit.t;
      CmSurfacePoint point = cm_surface_point(hit.triangle, hit.barycentrics, w, !hit.front);
      normal += point.material.normal;
      albedo += point.material.base_color;
      covered.x += 1.0;
      of_surface = point.emission;
    }
#endif
    if (i == 0 && surface_t < 1e37) surface_z = surface_t / t_per_z;
    float ground_t = cm_ground_distance(o, d);
    float solid_t = min(surface_t, ground_t);
    if (ground_t < min(surface_t, CM_NO_GROUND)) covered.y += 1.0;
    if (i == 0 && solid_t < 1e37) solid_z = solid_t / t_per_z;
    float used = 0.0;
    float clear = 1.0;
    CmWalk walk = cm_walk(o, d, surface_t);
    // Beyond e^-40 nothing is left to know.
    for (int j = 0; j < 100000 && used < 40.0; ++j) {
      float t_1, e_0, e_1;
      if (!cm_walk_part(walk, t_1, e_0, e_1)) break;
      float t = walk.t;
      float span = t_1 - t;
      float depth = cm_depth_of(e_0, e_1, span, walk.t_end - t);
      if (i == 0 && volume_z == CM_INFINITE && used + depth >= 0.69314718) {
        volume_z = (t + cm_depth_distance(e_0, e_1, span, 0.69314718 - used)) / t_per_z;
      }
      used += depth;
      // Of what scatters in this part of the ray: its chance, and where in it, as if it were even.
      float chance = 1.0 - exp(-depth);
      float within_part = depth > 0.05 ? 1.0 / depth - (1.0 - chance) / chance : 0.5 - depth * (1.0 / 12.0);
#if CM_CHANNELS
      // As if it were dimmed evenly within this part.
      float dimmed = depth > 1e-3 ? clear * chance / depth : clear;
      emission += dimmed * cm_walk_emitted(walk, min(t_1, solid_t));
#endif
      if (t < solid_t) emission += clear * chance * cm_walk_source(walk);
      scattered_z += clear * chance * (t + within_part * min(span, walk.t_end - t)) / t_per_z;
      scattered += clear * chance;
#if CM_VELOCITY
      velocity += clear * chance * cm_walk_velocity(walk, t_1);
#endif
      clear -= clear * chance;
      cm_walk_on(walk, t_1);
    }
    transmittance += exp(-used);
#if CM_SURFACES
    // Where another draws the surfaces beneath, their light is none of the picture's.
    bool drawn_here = cm.layers.count == 0u || cm.layers.coloured != 0u;
    if (drawn_here && surface_t <= ground_t) emission += exp(-used) * of_surface;
#endif
  }
  imageStore(cm_normal, ivec2(pixel), vec4(share * normal, solid_z));
  imageStore(cm_albedo, ivec2(pixel), vec4(share * albedo, scattered > 0.0 ? scattered_z / scattered : CM_INFINITE));
#if CM_VELOCITY
  imageStore(cm_velocity, ivec2(pixel), vec4(scattered > 0.0 ? velocity / scattered : vec3(0.0), 0.0));
#endif
  imageStore(cm_emission_out, ivec2(pixel), vec4(share * emission, 0.0));
  imageStore(cm_transmittance, ivec2(pixel), share * vec4(transmittance, covered.x, 0.0, 0.0));
  imageStore(cm_surface_depth, ivec2(pixel), vec4(surface_z));
  imageStore(cm_volume_z, ivec2(pixel), vec4(volume_z, share * covered.y, 0.0, 0.0));
}
