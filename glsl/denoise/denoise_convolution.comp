#version 450
// A 3x3 convolution over all channels of two sources, with zero padding, a bias and ReLU. The first source may have
// half the size; its texels are then doubled. A work group computes 16x16 pixels and 16 channels of the result, a lane
// 2x2 of these pixels. Storage is in halves, accumulation in floats. CM_RESULT 0: channels; 1: 2x2 max pooling; 2: the
// image, three channels decoded.
// variants: CM_RESULT=0,1,2
layout(local_size_x = 8, local_size_y = 8) in;
#include "common/bindings.glsl"
#include "denoise/denoise.glsl"

// Groups of four channels of the result.
#if CM_RESULT == 2
#define CM_QUADS 1
#else
#define CM_QUADS 4
#endif
#define CM_SIDE 18  // side of the pixel block that a work group reads

layout(std430, binding = CM_STORAGE_DENOISE_CHANNELS) buffer CmChannels { uvec4 cm_channels[]; };
// Per group of channels: the biases; then per block of eight source channels, per channel and per tap of 3x3 (by rows),
// a weight. Each entry is four halves.
layout(std430, binding = CM_STORAGE_DENOISE_WEIGHTS) readonly buffer CmWeights { uvec2 cm_weights[]; };
layout(location = 0) uniform uint cm_first;  // index of the first work group: by channels, then x, then y
layout(location = 1) uniform uint cm_width;  // size of the input; even if the result is pooled
layout(location = 2) uniform uint cm_height;
layout(location = 3) uniform uint cm_groups;    // groups of the result's channels
layout(location = 4) uniform uint cm_weights_at;
layout(location = 5) uniform uint cm_to;        // first block of the result
layout(location = 6) uniform uint cm_from_0;    // first block of the first source
layout(location = 7) uniform uint cm_blocks_0;
layout(location = 8) uniform uint cm_shift_0;   // 1: the first source has half the size
layout(location = 9) uniform uint cm_from_1;
layout(location = 10) uniform uint cm_blocks_1;
#if CM_RESULT == 2
layout(std430, binding = CM_STORAGE_DENOISE_BINS) readonly buffer CmBins { float cm_exposure; };
layout(binding = CM_UNIT_DENOISE_COLOR) uniform sampler2D cm_color;
layout(rgba32f, binding = CM_IMAGE_DENOISED) uniform writeonly image2D cm_denoised;
layout(location = 11) uniform ivec2 cm_begin;       // corner of the tile in the image
layout(location = 12) uniform ivec2 cm_keep_begin;  // pixels for which the tile is valid
layout(location = 13) uniform ivec2 cm_keep_end;
#endif

shared uint cm_pixels[4][CM_SIDE * CM_SIDE];  // two channels each
shared vec4 cm_taps[8 * 9 * CM_QUADS];

vec4 cm_unpack(uvec2 halves) { return vec4(unpackHalf2x16(halves.x), unpackHalf2x16(halves.y)); }

uvec4 cm_source(uint block, ivec2 p) {
  if (any(lessThan(p, ivec2(0))) || p.x >= int(cm_width) || p.y >= int(cm_height)) return uvec4(0u);
  bool first = block < cm_blocks_0;
  uint shift = first ? cm_shift_0 : 0u;
  uint b = first ? block : block - cm_blocks_0;
  uvec2 at = uvec2(p) >> shift;
  return cm_channels[(first ? cm_from_0 : cm_from_1) + (b * (cm_height >> shift) + at.y) * (cm_width >> shift) + at.x];
}

// Packs eight channels, with ReLU.
uvec4 cm_block(vec4 lower, vec4 upper) {
  lower = max(lower, vec4(0.0));
  upper = max(upper, vec4(0.0));
  return uvec4(cm_pack(lower.xy), cm_pack(lower.zw), cm_pack(upper.xy), cm_pack(upper.zw));
}

#if CM_RESULT == 2
// Writes a pixel. If the input or the result is not finite, the input is kept.
void cm_keep(uvec2 p, vec3 encoded) {
  ivec2 texel = cm_begin + ivec2(p);
  if (any(lessThan(texel, cm_keep_begin)) || any(greaterThanEqual(texel, cm_keep_end))) return;
  vec4 before = texelFetch(cm_color, texel, 0);
  vec3 after = vec3(cm_pu_inverse(encoded.r), cm_pu_inverse(encoded.g), cm_pu_inverse(encoded.b)) / cm_exposure;
  bool better = cm_is_finite(before.rgb) && cm_is_finite(after);
  imageStore(cm_denoised, texel, better ? vec4(after, before.a) : before);
}
#endif

void main() {
  uint group = cm_first + gl_WorkGroupID.x;
  uint channels = group % cm_groups;
  uint groups_x = (cm_width + 15u) / 16u;
  uint tile = group / cm_groups;
  ivec2 corner = ivec2(tile % groups_x, tile / groups_x) * 16;
  ivec2 lane = ivec2(gl_LocalInvocationID.xy);
  uint blocks = cm_blocks_0 + cm_blocks_1;
  uint weights_at = cm_weights_at + channels * uint(CM_QUADS) * (1u + blocks * 72u);

  vec4 sums[4][CM_QUADS];
  for (int q = 0; q < CM_QUADS; ++q) {
    vec4 bias = cm_unpack(cm_weights[weights_at + uint(q)]);
    for (int i = 0; i < 4; ++i) sums[i][q] = bias;
  }
  weights_at += uint(CM_QUADS);

  for (uint block = 0u; block < blocks; ++block) {
    barrier();
    for (int i = int(gl_LocalInvocationIndex); i < CM_SIDE * CM_SIDE; i += 64) {
      uvec4 pixel = cm_source(block, corner + ivec2(i % CM_SIDE, i / CM_SIDE) - 1);
      for (int k = 0; k < 4; ++k) cm_pixels[k][i] = pixel[k];
    }
    for (int i = int(gl_LocalInvocationIndex); i < 72 * CM_QUADS; i += 64) {
      cm_taps[i] = cm_unpack(cm_weights[weights_at + uint(i)]);
    }
    weights_at += 72u * uint(CM_QUADS);
    barrier();
    for (int pair = 0; pair < 4; ++pair) {
      vec2 near[16];  // two channels of 4x4 pixels
      for (int y = 0; y < 4; ++y) {
        for (int x = 0; x < 4; ++x) {
          near[4 * y + x] = unpackHalf2x16(cm_pixels[pair][(2 * lane.y + y) * CM_SIDE + 2 * lane.x + x]);
        }
      }
      int tap = pair * 18 * CM_QUADS;
      for (int c = 0; c < 2; ++c) {
        for (int y = 0; y < 3; ++y) {
          for (int x = 0; x < 3; ++x) {
            for (int q = 0; q < CM_QUADS; ++q) {
              vec4 weight = cm_taps[tap + ((c * 3 + y) * 3 + x) * CM_QUADS + q];
              for (int i = 0; i < 4; ++i) sums[i][q] += near[4 * (y + i / 2) + x + i % 2][c] * weight;
            }
          }
        }
      }
    }
  }

  uvec2 p = uvec2(corner) + 2u * uvec2(lane);
  if (p.x >= cm_width || p.y >= cm_height) return;
#if CM_RESULT == 2
  for (uint i = 0u; i < 4u; ++i) cm_keep(p + uvec2(i % 2u, i / 2u), max(sums[i][0].rgb, vec3(0.0)));
#else
  for (uint b = 0u; b < 2u; ++b) {
    uint block = channels * 2u + b;
#if CM_RESULT == 1
    vec4 lower = max(max(sums[0][2u * b], sums[1][2u * b]), max(sums[2][2u * b], sums[3][2u * b]));
    vec4 upper = max(max(sums[0][2u * b + 1u], sums[1][2u * b + 1u]), max(sums[2][2u * b + 1u], sums[3][2u * b + 1u]));
    cm_channels[cm_to + (block * (cm_height / 2u) + p.y / 2u) * (cm_width / 2u) + p.x / 2u] = cm_block(lower, upper);
#else
    for (uint i = 0u; i < 4u; ++i) {
      uvec2 q = p + uvec2(i % 2u, i / 2u);
      if (q.x >= cm_width || q.y >= cm_height) continue;
      cm_channels[cm_to + (block * cm_height + q.y) * cm_width + q.x] = cm_block(sums[i][2u * b], sums[i][2u * b + 1u]);
    }
#endif
  }
#endif
}
