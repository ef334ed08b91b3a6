#version 450
// An accumulation's means; a pixel whose first path is still under way takes after those around it.
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 0) uniform sampler2D cm_sum;
layout(binding = 1) uniform usampler2D cm_counts;
layout(rgba32f, binding = 0) uniform writeonly image2D cm_mean;

void main() {
  ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
  ivec2 last = textureSize(cm_sum, 0) - 1;
  if (texel.x > last.x || texel.y > last.y) return;
  vec4 own = vec4(0.0);
  vec4 around = vec4(0.0);
  float own_count = 0.0;
  float count = 0.0;
  for (int y = -1; y <= 1; ++y) {
    for (int x = -1; x <= 1; ++x) {
      ivec2 near = clamp(texel + ivec2(x, y), ivec2(0), last);
      float samples = float(texelFetch(cm_counts, near, 0).x);
      vec4 mean = texelFetch(cm_sum, near, 0) / max(samples, 1.0);
      float has = min(samples, 1.0);
      around += has * mean;
      count += has;
      if (x == 0 && y == 0) {
        own = mean;
        own_count = has;
      }
    }
  }
  imageStore(cm_mean, texel, own_count > 0.0 ? own : around / max(count, 1.0));
}
