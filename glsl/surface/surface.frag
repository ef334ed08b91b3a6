#version 450
// Shades a surface without shadows: by the sun, the scene's lights and the sky. The result is linear and premultiplied.
// CM_ALPHA: 0 opaque, 1 mask, 2 blend, which also draws transmission. CM_USED: a bit per existing map. CM_COATED: 1
// with a coat. Features that a material lacks are not compiled, because not every driver skips code that a uniform
// disables.
// variants: CM_ALPHA=0,1,2 CM_USED=0..1023 CM_COATED=0,1
#include "common/bindings.glsl"
#include "common/shared.glsl"
#include "surface/surface_parameters.glsl"
#include "surface/ggx.glsl"
#include "light/prefiltered.glsl"
#include "common/luminance.glsl"
#include "light/punctual.glsl"

layout(binding = CM_UNIT_GGX_ALBEDO) uniform sampler2D cm_albedo_table;  // of surface/ggx_albedo.hpp

vec2 cm_ggx_albedo(float roughness, float cosine) {
  vec2 position = cm_ggx_albedo_position(roughness, cosine);
  return textureLod(cm_albedo_table, (position + 0.5) / vec2(textureSize(cm_albedo_table, 0)), 0.0).xy;
}

vec2 cm_ggx_albedo_average(float roughness) {
  vec2 position = vec2(float(CM_GGX_ALBEDO_SIZE), cm_ggx_albedo_position(roughness, 0.0).y);
  return textureLod(cm_albedo_table, (position + 0.5) / vec2(textureSize(cm_albedo_table, 0)), 0.0).xy;
}

#include "surface/bsdf.glsl"

layout(location = 0) in vec3 cm_from_eye;  // world axes
layout(location = 1) in vec3 cm_shading_normal;
layout(location = 2) in vec4 cm_shading_tangent;
layout(location = 3) in vec4 cm_texture_uv;
layout(location = 4) in vec4 cm_vertex_color;
layout(location = 5) in float cm_z;

layout(binding = CM_UNIT_PREFILTERED) uniform sampler2DArray cm_prefiltered;  // of light/prefiltered_environment.hpp
layout(binding = CM_UNIT_MAPS) uniform sampler2D cm_maps[CM_MAPS];
// Relative to the eye.
layout(std430, binding = CM_STORAGE_ANALYTIC_LIGHTS) readonly buffer CmAnalyticLightRecords { CmAnalyticLight cm_analytic_lights[]; };

layout(location = 0) out vec4 cm_color;
layout(location = 1) out float cm_depth_z;

bool cm_has(int map) { return (CM_USED >> map & 1) != 0; }

vec2 cm_uv_of(int map) {
  vec3 uv = vec3((cm_material.flags.y >> uint(map) & 1u) != 0u ? cm_texture_uv.zw : cm_texture_uv.xy, 1.0);
  return vec2(dot(cm_material.uv_rows[2 * map].xyz, uv), dot(cm_material.uv_rows[2 * map + 1].xyz, uv));
}

#define CM_SAMPLE(map) texture(cm_maps[map], cm_uv_of(map))

// Shading normal, unit, on the viewer's side; back faces flip it. matte_normal: before bending; smooth_normal: also
// without normal map.
vec3 cm_normal_here(vec3 wo, out vec3 matte_normal, out vec3 smooth_normal) {
  vec3 dx = dFdx(cm_from_eye);
  vec3 dy = dFdy(cm_from_eye);
  float side = gl_FrontFacing ? 1.0 : -1.0;
  vec3 n = cm_shading_normal;
  if (dot(n, n) > 1e-12) {
    n = normalize(n);
  } else {
    n = cross(dx, dy);
    n = dot(n, n) > 0.0 ? normalize(n) : wo;
    if (dot(n, wo) * side < 0.0) n = -n;
  }
  smooth_normal = n * side;
  if (cm_has(CM_MAP_NORMAL)) {
    vec3 t = cm_shading_tangent.xyz;
    float turn = cm_shading_tangent.w;
    if (turn == 0.0) {
      // Tangent along increasing u. v runs down a texture, a normal map's y runs up.
      vec2 uv = cm_uv_of(CM_MAP_NORMAL);
      vec2 ux = dFdx(uv);
      vec2 uy = dFdy(uv);
      float area = ux.x * uy.y - uy.x * ux.y < 0.0 ? -1.0 : 1.0;
      t = (dx * uy.y - dy * ux.y) * area;
      turn = dot(cross(n, t), (dy * ux.x - dx * uy.x) * area) > 0.0 ? -1.0 : 1.0;
    }
    t -= n * dot(n, t);
    float length2 = dot(t, t);
    if (length2 > 0.0) {
      t *= inversesqrt(length2);
      vec3 m = CM_SAMPLE(CM_MAP_NORMAL).xyz * 2.0 - 1.0;
      m.xy *= cm_material.reflection.z;
      vec3 mapped = t * m.x + cross(n, t) * (turn * m.y) + n * m.z;
      if (dot(mapped, mapped) > 1e-12) n = normalize(mapped);
    }
  }
  vec3 g = cross(dx, dy);
  g = dot(g, g) > 0.0 ? normalize(g) : wo;
  if (dot(g, wo) < 0.0) g = -g;
  matte_normal = n * side;
  return cm_bend_normal(matte_normal, g, wo);
}

// Light of the sky beyond its mean, as the lobes receive it.
vec3 cm_matte_beyond(vec3 normal) {
  vec3 seen = cm_harmonics(cm_view.sky, cm_turned(normal, cm_view.sky_turn.xy), CM_MATTE_ORDERS);
  return max(seen, -cm_view.sky_radiance.rgb);
}

vec3 cm_prefiltered_beyond(CmSurface s, vec3 wo, float roughness) {
  vec2 position =
      cm_prefiltered_position(cm_turned(cm_prefiltered_middle(s.normal, wo, roughness), cm_view.sky_turn.xy));
  float level = cm_prefiltered_level(roughness);
  float low = floor(level);
  vec3 smoother = textureLod(cm_prefiltered, vec3(position, low), 0.0).rgb;
  vec3 rougher = textureLod(cm_prefiltered, vec3(position, low + 1.0), 0.0).rgb;
  return cm_view.sky_turn.z * mix(smoother, rougher, level - low);
}

void main() {
  vec4 base = cm_material.base_color * cm_vertex_color;
  if (cm_has(CM_MAP_BASE_COLOR)) base *= CM_SAMPLE(CM_MAP_BASE_COLOR);
  vec3 color = base.rgb;
  float alpha = CM_ALPHA == 2 ? clamp(base.a, 0.0, 1.0) : 1.0;
  if (cm_material.flags.z == 0u) {
    vec3 wo = cm_view.counts.z != 0u ? -cm_view.forward.xyz : -normalize(cm_from_eye);
    vec4 reflection = cm_material.reflection;
    if (cm_has(CM_MAP_METALLIC_ROUGHNESS)) reflection.xy *= CM_SAMPLE(CM_MAP_METALLIC_ROUGHNESS).zy;
    vec4 specular = cm_material.specular;
    if (cm_has(CM_MAP_SPECULAR)) specular.w *= CM_SAMPLE(CM_MAP_SPECULAR).a;
    if (cm_has(CM_MAP_SPECULAR_COLOR)) specular.rgb *= CM_SAMPLE(CM_MAP_SPECULAR_COLOR).rgb;
    vec4 coat = cm_material.coat;
    if (cm_has(CM_MAP_CLEARCOAT)) coat.x *= CM_SAMPLE(CM_MAP_CLEARCOAT).r;
    if (cm_has(CM_MAP_CLEARCOAT_ROUGHNESS)) coat.y *= CM_SAMPLE(CM_MAP_CLEARCOAT_ROUGHNESS).g;
    if (cm_has(CM_MAP_TRANSMISSION)) coat.z *= CM_SAMPLE(CM_MAP_TRANSMISSION).r;
#if CM_COATED == 0
    coat.x = 0.0;
#endif

    CmSurface s;
    s.base_color = clamp(base.rgb, 0.0, 1.0);
    s.metallic = reflection.x;
    s.roughness = reflection.y;
    s.normal = cm_normal_here(wo, s.matte_normal, s.smooth_normal);
    s.f0 = min(specular.rgb, vec3(1.0)) * specular.w;
    s.specular = specular.w;
    s.clearcoat = coat.x;
    s.clearcoat_roughness = coat.y;
#if CM_ALPHA == 2
    float cosine = clamp(dot(s.normal, wo), 0.0, 1.0);
    // Transmitted light is not scattered back. An approximation: thin, without refraction, and of one color.
    float through = coat.z * (1.0 - s.metallic);
    alpha *= 1.0 - through * (1.0 - cm_interface_fresnel(s, cosine)) * cm_luminance(s.base_color);
    s.base_color *= 1.0 - through;
    float covered = clamp(base.a, 0.0, 1.0);
#else
    const float covered = 1.0;
#endif
    float occlusion = 1.0;
    if (cm_has(CM_MAP_OCCLUSION)) occlusion += reflection.w * (CM_SAMPLE(CM_MAP_OCCLUSION).r - 1.0);
    CmAlbedos albedos = cm_bsdf_albedos(s, wo);
    color = cm_view.sky_radiance.rgb * occlusion * cm_albedo_of(albedos);
    if (cm_view.counts.y > 0u) {
      vec3 beyond = albedos.matte * cm_matte_beyond(s.matte_normal);
      beyond += albedos.base * cm_prefiltered_beyond(s, wo, s.roughness);
#if CM_COATED
      beyond += albedos.coat * cm_prefiltered_beyond(s, wo, s.clearcoat_roughness);
#endif
      color += occlusion * beyond;
    }
    color += cm_view.sun_irradiance.rgb * cm_bsdf_eval(s, wo, cm_view.sun_direction.xyz);
    for (uint i = 0u; i < cm_view.counts.x; ++i) {
      vec3 wi;
      float reach;
      vec3 irradiance = cm_analytic_light_irradiance(cm_analytic_lights[i], vec3(0.0), cm_from_eye, wi, reach);
      if (cm_max3(irradiance) > 0.0) color += irradiance * cm_bsdf_eval(s, wo, wi);
    }
    vec3 emission = cm_material.emission.rgb;
    if (cm_has(CM_MAP_EMISSION)) emission *= CM_SAMPLE(CM_MAP_EMISSION).rgb;
    color = (color + emission) * covered;
  } else {
    color *= alpha;
  }
#if CM_ALPHA == 1
  if (base.a < cm_material.emission.w) discard;  // after the last use of derivatives
#endif
  cm_color = vec4(clamp(color, 0.0, 65000.0), alpha);
  // Nearly invisible fragments get infinite depth.
  cm_depth_z = CM_ALPHA != 2 || alpha > 0.002 ? cm_z : uintBitsToFloat(0x7f800000u);
}
