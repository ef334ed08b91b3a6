#pragma once

// The BSDF that shaders and C++ share, with tables of the albedo from main memory. CM_EXTENDED_BSDF selects its variant
// for extended materials.

#include "base/shared_code.hpp"
#include "surface/ggx_albedo.hpp"
#ifdef CM_EXTENDED_BSDF
#include "surface/sheen_albedo.hpp"
#endif

namespace cumulet::core {
inline vec2 cm_ggx_albedo(float roughness, float cosine) {
  return surface::GgxAlbedo::table().towards(roughness, cosine);
}
inline vec2 cm_ggx_albedo_average(float roughness) { return surface::GgxAlbedo::table().average(roughness); }
#ifdef CM_EXTENDED_BSDF
inline float cm_sheen_albedo(float roughness, float cosine) {
  return surface::SheenAlbedo::table().towards(roughness, cosine);
}
inline float cm_sheen_albedo_average(float roughness) { return surface::SheenAlbedo::table().average(roughness); }
#endif
#include "surface/bsdf.glsl"
#ifdef CM_EXTENDED_BSDF
#include "path/dispersion.glsl"
#endif
}  // namespace cumulet::core
