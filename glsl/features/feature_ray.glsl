// Feature rays: a fixed, deterministic set of rays per pixel, spread uniformly over the pixel, the lens and, with
// CM_MOTION, the shutter interval. The includer has buffers.glsl and ray.glsl before this, and with CM_SURFACES
// surface.glsl.
#ifndef CM_FEATURE_RAY_GLSL
#define CM_FEATURE_RAY_GLSL

struct CmFeatureRay {
  vec3 o;         // cube space
  vec3 w;         // world, unit
  vec3 d;         // w in cube space
  float t_per_z;  // distance along it per unit of view depth
  float end;      // distance to the host's depth
};

// Returns ray i, by Roberts's R sequences. Ray 0 is at the center of pixel and lens, at mid-shutter. Rays hit the
// triangles visible to cameras; partial coverage uses a random number per ray.
CmFeatureRay cm_feature_ray(uvec2 pixel, int i) {
  vec2 within = fract(0.5 + float(i) * vec2(0.7548776662, 0.5698402910));
  vec2 lens = fract(0.5 + float(i) * vec2(0.6287067210, 0.5385972572));
#if CM_MOTION
  cm_now = fract(0.5 + float(i) * 0.8566748839);
#endif
  CmFeatureRay ray;
  ray.t_per_z = cm_lens_ray(pixel, within, cm_on_disc(lens), ray.o, ray.w);
  ray.d = cm_to_cube(ray.w);
  ray.end = ray.t_per_z * cm_surface_z(pixel, within, uint(i));
#if CM_SURFACES
  cm_hit_seed = cm_hash3(uvec3(pixel.y * cm.view.size.x + pixel.x, uint(i), cm.integrator.seed)).x;
  cm_hit_camera = true;
#endif
  return ray;
}

// Mean position of the first scattering in a segment, from 0 at its start to 1, as if extinction were constant. depth:
// optical depth of the segment; probability: that of scattering in it.
float cm_middle_of_part(float depth, float probability) {
  return depth > 0.05 ? 1.0 / depth - (1.0 - probability) / probability : 0.5 - depth * (1.0 / 12.0);
}

#endif
