// Loads and stores a pixel's sums in the film's images.
#ifndef CM_PIXEL_STORE_GLSL
#define CM_PIXEL_STORE_GLSL

layout(rgba32f, binding = CM_IMAGE_SUM) uniform image2D cm_sum;
layout(rg32ui, binding = CM_IMAGE_COUNTS) uniform uimage2D cm_counts;          // samples, steps
layout(rgba32f, binding = CM_IMAGE_BACKGROUND) uniform image2D cm_background;
layout(r32f, binding = CM_IMAGE_MOMENTS) uniform image2D cm_moments;
#if CM_AOVS
layout(rgba32f, binding = CM_IMAGE_VOLUME_SUM) uniform image2D cm_volume_sum;  // first event in the volume
#endif

uint cm_pixel_samples(uvec2 at) { return imageLoad(cm_counts, ivec2(at)).x; }

CmPixel cm_load_pixel(uvec2 at) {
  ivec2 texel = ivec2(at);
  uvec4 counts = imageLoad(cm_counts, texel);
  CmPixel pixel;
  pixel.sum = imageLoad(cm_sum, texel);
  pixel.volume = vec4(0.0);
#if CM_AOVS
  pixel.volume = imageLoad(cm_volume_sum, texel);
#endif
  pixel.background = imageLoad(cm_background, texel).rgb;
  pixel.square = imageLoad(cm_moments, texel).x;
  pixel.samples = counts.x;
  pixel.steps = counts.y;
  pixel.unsound = 0u;
  return pixel;
}

void cm_store_pixel(CmPixel pixel, uvec2 at) {
  ivec2 texel = ivec2(at);
#ifdef CM_PATH_STORE_GLSL
  if (pixel.unsound != 0u) atomicAdd(cm_total.w, pixel.unsound);
#endif
  imageStore(cm_sum, texel, pixel.sum);
#if CM_AOVS
  imageStore(cm_volume_sum, texel, pixel.volume);
#endif
  imageStore(cm_background, texel, vec4(pixel.background, 0.0));
  imageStore(cm_moments, texel, vec4(pixel.square));
  imageStore(cm_counts, texel, uvec4(pixel.samples, pixel.steps, 0u, 0u));
#ifdef CM_PATH_STORE_GLSL
  cm_mark_row(at.y);
#endif
}

#endif
