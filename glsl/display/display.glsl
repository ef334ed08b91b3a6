// Conversion of linear radiance to displayed color. Shared by GLSL and C++.
#ifndef CM_DISPLAY_GLSL
#define CM_DISPLAY_GLSL
#include "common/numbers.glsl"

#define CM_TONE_MAP_NEUTRAL 0u
#define CM_TONE_MAP_FILMIC 1u
#define CM_TONE_MAP_CLIP 2u
#define CM_TONE_MAP_NONE 3u

// Makes a value non-negative, finite and not NaN.
CM_FN float cm_displayable(float x) { return cm_is_positive(x) ? min(x, 1e30f) : 0.0f; }

// Khronos PBR Neutral: https://github.com/KhronosGroup/ToneMapping. Result in [0, 1].
CM_FN vec3 cm_tone_map_neutral(vec3 c) {
  float start = 0.8f - 0.04f;
  float room = 1.0f - start;
  float least = min(c.x, min(c.y, c.z));
  c -= least < 0.08f ? least - 6.25f * least * least : 0.04f;
  float peak = max(c.x, max(c.y, c.z));
  if (peak < start) return c;
  float new_peak = 1.0f - room * room / (peak + room - start);
  float keep = 1.0f / (0.15f * (peak - new_peak) + 1.0f);
  return new_peak + (c * (new_peak / peak) - new_peak) * keep;
}

// Narkowicz, "ACES Filmic Tone Mapping Curve", 2015: (x (a x + b)) / (x (c x + d) + e), result in [0, 1].
CM_FN vec3 cm_tone_map_filmic(vec3 c) {
  c = min(c, vec3(1e6f));  // the curve is flat long before the square overflows
  return clamp((c * (2.51f * c + 0.03f)) / (c * (2.43f * c + 0.59f) + 0.14f), vec3(0.0f), vec3(1.0f));
}

CM_FN float cm_srgb_encode(float x) {
  return x <= 0.0031308f ? 12.92f * x : 1.055f * pow(x, 1.0f / 2.4f) - 0.055f;
}

CM_FN float cm_srgb_decode(float x) {
  return x <= 0.04045f ? x / 12.92f : pow((x + 0.055f) / 1.055f, 2.4f);
}

CM_FN vec3 cm_srgb_decode_each(vec3 c) { return vec3(cm_srgb_decode(c.x), cm_srgb_decode(c.y), cm_srgb_decode(c.z)); }

CM_FN vec3 cm_srgb_encode_each(vec3 c) { return vec3(cm_srgb_encode(c.x), cm_srgb_encode(c.y), cm_srgb_encode(c.z)); }

CM_FN vec3 cm_exposed(vec3 radiance, float exposure) {
  vec3 c = radiance * exposure;
  return vec3(cm_displayable(c.x), cm_displayable(c.y), cm_displayable(c.z));
}

// Applies exposure and tone mapping, without encoding.
CM_FN vec3 cm_tone_mapped(vec3 radiance, float exposure, uint tone_map) {
  vec3 c = cm_exposed(radiance, exposure);
  if (tone_map == CM_TONE_MAP_NEUTRAL) c = cm_tone_map_neutral(c);
  if (tone_map == CM_TONE_MAP_FILMIC) c = cm_tone_map_filmic(c);
  if (tone_map != CM_TONE_MAP_NONE) c = min(c, vec3(1.0f));
  return c;
}

// Converts radiance to color; with encode by the sRGB curve.
CM_FN vec3 cm_display(vec3 radiance, float exposure, uint tone_map, bool encode) {
  vec3 c = cm_tone_mapped(radiance, exposure, tone_map);
  return encode ? cm_srgb_encode_each(c) : c;
}

// Returns the values that a linear target blends as color + (1 - alpha) x target, for a displayed linear color.
// Radiance without alpha is additive: nothing is divided by alpha. The color is that of the same radiance before black.
CM_FN vec4 cm_linear_over(vec3 c, float coverage) { return vec4(c, min(cm_displayable(coverage), 1.0f)); }

// Returns the values that an encoded target blends, for a displayed linear color and the same color encoded. Encoded
// values do not add like light, so alpha is chosen such that the blend is exact over black and over white, and close in
// between. All channels use the minimum of their three alphas, so that light darkens no channel.
CM_FN vec4 cm_encoded_over(vec3 c, vec3 encoded, float coverage) {
  float alpha = min(cm_displayable(coverage), 1.0f);
  float least = min(c.x, min(c.y, c.z));
  float white = cm_srgb_encode(min(least + (1.0f - alpha), 1.0f));
  float kept = white - min(encoded.x, min(encoded.y, encoded.z));
  return vec4(encoded, alpha < 1.0f ? clamp(1.0f - kept, 0.0f, 1.0f) : 1.0f);
}

// Converts premultiplied radiance and alpha to displayed values.
CM_FN vec4 cm_display_over(vec4 value, float exposure, uint tone_map, bool encode) {
  vec3 c = cm_tone_mapped(vec3(value.x, value.y, value.z), exposure, tone_map);
  return encode ? cm_encoded_over(c, cm_srgb_encode_each(c), value.w) : cm_linear_over(c, value.w);
}

#endif
