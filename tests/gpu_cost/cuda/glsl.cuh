// GLSL's types and functions for CUDA, so that nvcc compiles the shaders' shared files (glsl/common/shared.glsl). Types are
// GLM's. The functions here are one instruction in GLSL, and several in GLM.
#pragma once

#define GLM_FORCE_CUDA
#define GLM_FORCE_PURE
#include <cuda.h>
#include <cuda_fp16.h>

#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>
#include <glm/gtc/packing.hpp>

#define CM_FN __device__ __forceinline__
#define CM_INOUT(T) T&
#define CM_OUT(T) T&
#define CM_PRECISE

namespace cumulet::core {
using namespace glm;

CM_FN float min(float a, float b) { return fminf(a, b); }
CM_FN float max(float a, float b) { return fmaxf(a, b); }
CM_FN int min(int a, int b) { return ::min(a, b); }
CM_FN int max(int a, int b) { return ::max(a, b); }
CM_FN uint min(uint a, uint b) { return ::min(a, b); }
CM_FN uint max(uint a, uint b) { return ::max(a, b); }
CM_FN float clamp(float x, float low, float high) { return fminf(fmaxf(x, low), high); }
CM_FN vec3 min(vec3 a, vec3 b) { return vec3(fminf(a.x, b.x), fminf(a.y, b.y), fminf(a.z, b.z)); }
CM_FN vec3 max(vec3 a, vec3 b) { return vec3(fmaxf(a.x, b.x), fmaxf(a.y, b.y), fmaxf(a.z, b.z)); }
CM_FN vec3 clamp(vec3 x, vec3 low, vec3 high) { return min(max(x, low), high); }
CM_FN vec3 clamp(vec3 x, float low, float high) { return clamp(x, vec3(low), vec3(high)); }
CM_FN float sqrt(float x) { return sqrtf(x); }
CM_FN float inversesqrt(float x) { return rsqrtf(x); }
CM_FN float exp(float x) { return __expf(x); }
CM_FN float log(float x) { return __logf(x); }
CM_FN float sin(float x) { return __sinf(x); }
CM_FN float cos(float x) { return __cosf(x); }
CM_FN float abs(float x) { return fabsf(x); }
CM_FN vec3 abs(vec3 v) { return vec3(fabsf(v.x), fabsf(v.y), fabsf(v.z)); }
CM_FN float dot(vec3 a, vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
CM_FN vec3 normalize(vec3 v) { return v * rsqrtf(dot(v, v)); }
CM_FN float length(vec3 v) { return sqrtf(dot(v, v)); }
CM_FN uint floatBitsToUint(float x) { return __float_as_uint(x); }
CM_FN float uintBitsToFloat(uint x) { return __uint_as_float(x); }
CM_FN uvec2 floatBitsToUint(vec2 v) { return uvec2(floatBitsToUint(v.x), floatBitsToUint(v.y)); }
CM_FN uvec3 floatBitsToUint(vec3 v) { return uvec3(floatBitsToUint(v.x), floatBitsToUint(v.y), floatBitsToUint(v.z)); }
CM_FN vec3 uintBitsToFloat(uvec3 v) { return vec3(uintBitsToFloat(v.x), uintBitsToFloat(v.y), uintBitsToFloat(v.z)); }
CM_FN uint bitfieldReverse(uint x) { return __brev(x); }
CM_FN uint bitfieldExtract(uint value, int offset, int bits) { return (value >> offset) & ((1u << bits) - 1u); }
CM_FN void umulExtended(uint a, uint b, uint& high, uint& low) {
  high = __umulhi(a, b);
  low = a * b;
}
CM_FN vec2 unpackHalf2x16(uint word) {
  const float2 pair = __half22float2(*reinterpret_cast<__half2*>(&word));
  return vec2(pair.x, pair.y);
}

#include "common/numbers.glsl"
}  // namespace cumulet::core
