// Triangles and materials of the path tracer: evaluates the tables of surface_tables.glsl at a point. Includes bvh.glsl
// and bsdf.glsl. Shared by GLSL and C++; the includer provides
//   uvec4 cm_words(uint word)       word of the tables
//   CmModel cm_models[], CmInstanceNode cm_model_nodes[]   and uint cm_model: model.glsl
//   vec4 cm_atlas_value(ivec3 at)   texel of the texture atlas layers: straight alpha, each channel from 0 to 1
#ifndef CM_SURFACE_GLSL
#define CM_SURFACE_GLSL
#include "surface/ggx.glsl"
#include "common/luminance.glsl"
#include "common/octahedron.glsl"
#include "surface/surface_tables.glsl"
#include "surface/model_space.glsl"

CM_FN vec4 cm_floats(uint word) { return uintBitsToFloat(cm_words(word)); }

#if CM_MOTION
// Interpolates a BVH texel between both ends of the shutter interval. Both trees have the same links and the same
// triangles in the same order.
CM_FN uvec4 cm_tree_between(uint open, uint close) {
  uvec4 first = cm_words(open);
  return uvec4(floatBitsToUint(cm_straight(uintBitsToFloat(uvec3(first)), vec3(cm_floats(close)))), first.w);
}
#endif

CM_FN uvec4 cm_bvh_node(uint texel) {
#if CM_MOTION
  if (cm_model_deforms(cm_model)) {
    return cm_tree_between(cm_models[cm_model_open(cm_model)].nodes + texel,
                           cm_models[cm_model_close(cm_model)].nodes + texel);
  }
#endif
  return cm_words(cm_models[cm_model].nodes + texel);
}
CM_FN uvec4 cm_bvh_triangle(uint texel) {
#if CM_MOTION
  if (cm_model_deforms(cm_model)) {
    return cm_tree_between(cm_models[cm_model_open(cm_model)].records + texel,
                           cm_models[cm_model_close(cm_model)].records + texel);
  }
#endif
  return cm_words(cm_models[cm_model].records + texel);
}

// Properties of the current ray, for cm_hit_accept.
uint cm_hit_seed = 0u;
bool cm_hit_camera = false;
#if CM_CLEAR_SURFACES
vec3 cm_hit_direction = vec3(0.0f);  // world, unit
vec3 cm_hit_passed = vec3(1.0f);     // transmittance over pass probability of the clear surfaces passed so far
#endif

CM_FN vec2 cm_ggx_albedo(float roughness, float cosine) {
  vec2 position = cm_ggx_albedo_position(roughness, cosine);
  ivec2 cell = min(ivec2(position), CM_GGX_ALBEDO_SIZE - 2);
  vec2 f = position - vec2(cell);
  uvec4 corners = cm_words(cm.surfaces.ggx_albedo + uint(cell.y * (CM_GGX_ALBEDO_SIZE - 1) + cell.x));
  vec2 low = mix(unpackHalf2x16(corners.x), unpackHalf2x16(corners.y), f.x);
  vec2 high = mix(unpackHalf2x16(corners.z), unpackHalf2x16(corners.w), f.x);
  return mix(low, high, f.y);
}

CM_FN vec2 cm_ggx_albedo_average(float roughness) {
  float position = cm_ggx_albedo_position(roughness, 0.0f).y;
  int row = min(int(position), CM_GGX_ALBEDO_SIZE - 2);
  uvec4 ends = cm_words(cm.surfaces.ggx_albedo_averages + uint(row));
  return mix(unpackHalf2x16(ends.x), unpackHalf2x16(ends.y), position - float(row));
}

#if CM_EXTENDED_BSDF

CM_FN float cm_sheen_albedo(float roughness, float cosine) {
  vec2 position = cm_ggx_albedo_position(roughness, cosine);
  ivec2 cell = min(ivec2(position), CM_GGX_ALBEDO_SIZE - 2);
  vec2 f = position - vec2(cell);
  vec4 corners = cm_floats(cm.surfaces.sheen_albedo + uint(cell.y * (CM_GGX_ALBEDO_SIZE - 1) + cell.x));
  vec2 ends = mix(vec2(corners.x, corners.z), vec2(corners.y, corners.w), f.x);
  return mix(ends.x, ends.y, f.y);
}

CM_FN float cm_sheen_albedo_average(float roughness) {
  float position = cm_ggx_albedo_position(roughness, 0.0f).y;
  int row = min(int(position), CM_GGX_ALBEDO_SIZE - 2);
  int first = (CM_GGX_ALBEDO_SIZE - 1) * (CM_GGX_ALBEDO_SIZE - 1);
  vec4 ends = cm_floats(cm.surfaces.sheen_albedo + uint(first + row));
  return mix(ends.x, ends.y, position - float(row));
}

#endif

#include "surface/bsdf.glsl"

// Unpacks a unit vector from two signed 16-bit octahedral coordinates.
CM_FN vec3 cm_octahedral(uint word) { return cm_from_octahedron(unpackSnorm2x16(word)); }

struct CmVertexMix {
  uint model;
  uvec3 corner;   // first words of the three vertices
  uint material;  // first word
  vec3 weight;
  vec2 uv_0;
  vec2 uv_1;
  vec4 color;
};

// Interpolates the vertices of a model's triangle. triangle: its number in the mesh.
CM_FN CmVertexMix cm_vertex_mix(uint model, uint triangle, vec2 weights) {
  CmVertexMix m;
  m.model = model;
  uvec4 words = cm_words(cm_models[model].triangles + triangle);
  m.corner = uvec3(cm_models[model].vertices) + CM_VERTEX_WORDS * uvec3(words);
  m.material = cm_models[model].materials + CM_MATERIAL_WORDS * words.w;
  m.weight = vec3(1.0f - weights.x - weights.y, weights);
  vec4 uv = vec4(0.0f);
  m.color = vec4(0.0f);
  for (int i = 0; i < 3; ++i) {
    uv += m.weight[i] * cm_floats(m.corner[i] + CM_VERTEX_UV);
    uvec4 last = cm_words(m.corner[i] + CM_VERTEX_REST);
    m.color += m.weight[i] * vec4(unpackUnorm2x16(last.z), unpackUnorm2x16(last.w));
  }
  m.uv_0 = vec2(uv.x, uv.y);
  m.uv_1 = vec2(uv.z, uv.w);
  return m;
}

CM_FN int cm_wrap(int i, int size, uint mode) {
  if (mode == CM_WRAP_CLAMP) return clamp(i, 0, size - 1);
  int period = mode == CM_WRAP_MIRRORED ? 2 * size : size;
  i = i % period;
  if (i < 0) i += period;
  return i < size ? i : period - 1 - i;
}

CM_FN vec4 cm_atlas_texel(uvec4 texture_words, ivec2 at) {
  ivec2 size = ivec2(texture_words.y & 0xffffu, texture_words.y >> 16);
  ivec2 corner = ivec2(texture_words.x & 0xffffu, texture_words.x >> 16);
  at = ivec2(cm_wrap(at.x, size.x, texture_words.w & CM_WRAP_MASK),
             cm_wrap(at.y, size.y, (texture_words.w >> CM_WRAP_T_SHIFT) & CM_WRAP_MASK));
  return cm_atlas_value(ivec3(corner + at, int(texture_words.z)));
}

CM_FN vec3 cm_from_srgb(vec3 v) {
  return mix(v / 12.92f, pow((v + 0.055f) / 1.055f, vec3(2.4f)), greaterThan(v, vec3(0.04045f)));
}

// Samples a material's texture, filtered bilinearly; white if there is none. Samples are spread over the pixel, which
// acts as the minification filter.
CM_FN vec4 cm_texture(CmVertexMix m, uint use, bool srgb) {
  uint word = m.material + use;
  uvec4 head = cm_words(word);
  if (head.x == 0u) return vec4(1.0f);
  vec4 tail = cm_floats(word + 1u);
  vec3 rest = uintBitsToFloat(uvec3(head.y, head.z, head.w));
  vec2 uv = (head.x & CM_USE_SECOND_UV) != 0u ? m.uv_1 : m.uv_0;
  uv = vec2(rest.x * uv.x + rest.z * uv.y, rest.y * uv.x + tail.x * uv.y) + vec2(tail.y, tail.z);
  uvec4 t = cm_words(cm_models[m.model].textures + (head.x & ~CM_USE_SECOND_UV) - 1u);
  vec2 size = vec2(t.y & 0xffffu, t.y >> 16);
  // Far from 0, whole periods would cost the fraction's precision. Each wrap mode repeats after two.
  bvec2 clamped = bvec2((t.w & CM_WRAP_MASK) == CM_WRAP_CLAMP, ((t.w >> CM_WRAP_T_SHIFT) & CM_WRAP_MASK) == CM_WRAP_CLAMP);
  vec2 at = uv - 2.0f * floor(0.5f * uv) * vec2(clamped.x ? 0.0f : 1.0f, clamped.y ? 0.0f : 1.0f);
  at = clamp(at, vec2(-4.0f), vec2(4.0f)) * size;
  bool nearest = (t.w & CM_TEXTURE_NEAREST) != 0u;
  vec2 low = floor(nearest ? at : at - 0.5f);
  vec2 f = nearest ? vec2(0.0f) : at - 0.5f - low;
  vec4 sum = vec4(0.0f);
  for (int i = 0; i < (nearest ? 1 : 4); ++i) {
    ivec2 offset = ivec2(i & 1, i >> 1);
    vec4 value = cm_atlas_texel(t, ivec2(low) + offset);
    if (srgb) value = vec4(cm_from_srgb(vec3(value)), value.a);
    sum += value * (offset.x == 1 ? f.x : 1.0f - f.x) * (offset.y == 1 ? f.y : 1.0f - f.y);
  }
  return sum;
}

// Probability that a ray hits the triangle at this point. Coverage (BLEND) is stochastic, so that surfaces and volume
// need not be sorted.
CM_FN float cm_coverage(CmVertexMix m) {
  uint word = m.material;
  uint flags = cm_words(word + CM_MATERIAL_FLAGS).x;
  vec4 base = cm_floats(word + CM_MATERIAL_BASE_COLOR) * cm_texture(m, CM_USE_BASE_COLOR, true) * m.color;
  if ((flags & CM_ALPHA_MASK) != 0u && base.a < cm_floats(word + CM_MATERIAL_EMISSION).w) return 0.0f;
  return (flags & CM_ALPHA_BLEND) != 0u ? clamp(base.a, 0.0f, 1.0f) : 1.0f;
}

struct CmSurfacePoint {
  CmSurface material;
  vec3 position;   // world
  vec3 geometric;  // unit normal of the triangle, on the path's side
  bool behind;     // the path came from the side where the vertices are clockwise
  bool lifted;     // rays that leave at grazing angles start above the triangle: see cm_lift
  vec3 emission;   // emission to that side
  bool unlit;
#if CM_EXTENDED_BSDF
  float kept;      // 1 / (1 - probability that a path passes through here)
#endif
};

// The fields of a vertex that may move, in the mesh's own space.
struct CmCorner {
  vec3 position;
  vec3 normal;
  vec4 tangent;  // w: handedness; 0: no tangent
};

CM_FN CmCorner cm_corner_at(uint first) {
  uvec4 position_normal = cm_words(first + CM_VERTEX_POSITION);
  uvec4 rest = cm_words(first + CM_VERTEX_REST);
  return CmCorner(uintBitsToFloat(uvec3(position_normal)), cm_octahedral(position_normal.w),
                  vec4(cm_octahedral(rest.x), uintBitsToFloat(rest.y)));
}

CM_FN CmCorner cm_corner(CmVertexMix m, int i) {
#if CM_MOTION
  if (cm_model_deforms(m.model)) {
    uint vertex = m.corner[i] - cm_models[m.model].vertices;
    CmCorner open = cm_corner_at(cm_models[cm_model_open(m.model)].vertices + vertex);
    CmCorner close = cm_corner_at(cm_models[cm_model_close(m.model)].vertices + vertex);
    vec3 tangent = cm_straight(vec3(open.tangent), vec3(close.tangent));
    return CmCorner(cm_straight(open.position, close.position), cm_straight(open.normal, close.normal),
                    vec4(tangent, open.tangent.w));
  }
#endif
  return cm_corner_at(m.corner[i]);
}

#if CM_MOTION
// Area of a triangle of a deforming mesh at the frame time, divided by its area at cm_now, in the mesh's own space.
CM_FN float cm_area_share(CmVertexMix m) {
  vec3 now = cm_corner(m, 0).position;
  now = cross(cm_corner(m, 1).position - now, cm_corner(m, 2).position - now);
  vec3 then = cm_corner_at(m.corner[0]).position;
  then = cross(cm_corner_at(m.corner[1]).position - then, cm_corner_at(m.corner[2]).position - then);
  return min(length(then) / max(length(now), 1e-30f), 1e12f);
}
#endif

// The corners of a triangle in world space.
struct CmCorners {
  vec3 position[3];
  vec3 normal[3];
};

CM_FN CmCorners cm_corners(CmVertexMix m) {
  CmCorners corners;
  for (int i = 0; i < 3; ++i) {
    CmCorner corner = cm_corner(m, i);
    corners.position[i] = cm_out_of_model_point(m.model, corner.position);
    corners.normal[i] = cm_model_normal(m.model, corner.normal);
  }
  return corners;
}

CM_FN bool cm_mirrors(uint model) {
#if CM_MOTION
  if (cm_model_moves(model)) return cm_transform_determinant(cm_model_transform(model)) < 0.0f;
#endif
  return (cm_models[model].flags & CM_MODEL_MIRRORS) != 0u;
}

// Unit normal on the side from which a triangle's vertices are counter-clockwise in world space.
CM_FN vec3 cm_turning_normal(vec3 a, vec3 b, vec3 c) {
  vec3 g = cross(b - a, c - a);
  // Scaled first, because the cross product of a tiny triangle underflows in fp32.
  return normalize(g / max(max(abs(g.x), max(abs(g.y), abs(g.z))), 1e-38f));
}

// Offset from a point of a triangle to the smooth surface implied by the vertex normals, where that bulges towards
// `geometric`. It is the weighted mean of the point's offsets to the vertices' tangent planes (Hanika, "Hacking the
// Shadow Terminator", Ray Tracing Gems II, chapter 4, 2021). 0 on flat surfaces, within the precision of 16-bit
// normals.
CM_FN vec3 cm_lift(vec3 p, vec3 weight, CmCorners corners, vec3 geometric) {
  vec3 lift = vec3(0.0f);
  for (int i = 0; i < 3; ++i) {
    vec3 n = dot(corners.normal[i], geometric) < 0.0f ? -corners.normal[i] : corners.normal[i];
    vec3 from = p - corners.position[i];
    float below = -dot(from, n) - 1e-4f * (abs(from.x) + abs(from.y) + abs(from.z));
    lift += weight[i] * max(0.0f, below) * n;
  }
  return lift;
}

// Fraction of the lift for a ray at `cosine` to the triangle's normal: 1 along the triangle and below it. So the flat
// triangles do not block light that the smooth normals face, and no light is lost at their edges. Shadow rays and
// scattered rays start alike.
const float CM_GRAZING = 0.1f;
CM_FN float cm_lift_share(float cosine) { return clamp(1.0f - cosine / CM_GRAZING, 0.0f, 1.0f); }

// Values of a material's textures at a point.
struct CmMaps {
  vec4 base_color;
  vec4 metallic_roughness;
  vec4 normal;
  vec4 emission;
  vec4 specular;
  vec4 specular_color;
  vec4 clearcoat;
  vec4 clearcoat_roughness;
#if CM_EXTENDED_BSDF
  vec4 transmission;
  vec4 sheen_color;
  vec4 sheen_roughness;
  vec4 anisotropy;
  vec4 iridescence;
  vec4 film_thickness;
#endif
};

#if CM_EXTENDED_BSDF
const uint CM_LAST_USE = CM_USE_FILM_THICKNESS;
#else
const uint CM_LAST_USE = CM_USE_CLEARCOAT_ROUGHNESS;
#endif

// A loop, because the unrolled code would be most of a kernel.
CM_FN CmMaps cm_maps(CmVertexMix m) {
  CmMaps maps;
  for (uint use = CM_USE_BASE_COLOR; use <= CM_LAST_USE; use += 2u) {
    bool srgb = use == CM_USE_BASE_COLOR || use == CM_USE_EMISSION || use == CM_USE_SPECULAR_COLOR;
#if CM_EXTENDED_BSDF
    srgb = srgb || use == CM_USE_SHEEN_COLOR;
#endif
    vec4 value = cm_texture(m, use, srgb);
    if (use == CM_USE_BASE_COLOR) maps.base_color = value;
    if (use == CM_USE_METALLIC_ROUGHNESS) maps.metallic_roughness = value;
    if (use == CM_USE_NORMAL) maps.normal = value;
    if (use == CM_USE_EMISSION) maps.emission = value;
    if (use == CM_USE_SPECULAR) maps.specular = value;
    if (use == CM_USE_SPECULAR_COLOR) maps.specular_color = value;
    if (use == CM_USE_CLEARCOAT) maps.clearcoat = value;
    if (use == CM_USE_CLEARCOAT_ROUGHNESS) maps.clearcoat_roughness = value;
#if CM_EXTENDED_BSDF
    if (use == CM_USE_TRANSMISSION) maps.transmission = value;
    if (use == CM_USE_SHEEN_COLOR) maps.sheen_color = value;
    if (use == CM_USE_SHEEN_ROUGHNESS) maps.sheen_roughness = value;
    if (use == CM_USE_ANISOTROPY) maps.anisotropy = value;
    if (use == CM_USE_IRIDESCENCE) maps.iridescence = value;
    if (use == CM_USE_FILM_THICKNESS) maps.film_thickness = value;
#endif
  }
  return maps;
}

// Emission of a material, seen from the front.
CM_FN vec3 cm_emission(CmVertexMix m) {
  return vec3(cm_floats(m.material + CM_MATERIAL_EMISSION)) * vec3(cm_texture(m, CM_USE_EMISSION, true));
}

#if CM_EXTENDED_BSDF

// Projects a tangent onto the plane of the normal. Returns an arbitrary tangent if there is none.
CM_FN vec3 cm_across(vec3 normal, vec3 tangent) {
  vec3 across = tangent - dot(tangent, normal) * normal;
  float length2 = dot(across, across);
  if (length2 > 1e-12f) return across * inversesqrt(length2);
  vec3 u;
  vec3 v;
  cm_frame(normal, u, v);
  return u;
}

// Moves a relative index of refraction away from 1, where refraction has no half vector.
CM_FN float cm_apart(float eta) { return abs(eta - 1.0f) < 1e-3f ? (eta < 1.0f ? 0.999f : 1.001f) : eta; }

// Sets the fields of the material extensions. tangent: along increasing u, w its handedness; shading: the normal they
// refer to.
CM_FN void cm_enrich(CM_INOUT(CmSurface) s, uint word, CmMaps maps, vec4 tangent, vec3 shading, vec3 geometric, bool from_back) {
  vec4 sheen = cm_floats(word + CM_MATERIAL_SHEEN);
  vec4 film = cm_floats(word + CM_MATERIAL_FILM);
  vec4 turn = cm_floats(word + CM_MATERIAL_ANISOTROPY);
  float volume_ior = cm_floats(word + CM_MATERIAL_VOLUME).w;
  s.geometric = geometric;
  s.sheen = min(vec3(sheen) * vec3(maps.sheen_color), vec3(1.0f));
  s.sheen_roughness = clamp(sheen.w * maps.sheen_roughness.a, 0.0f, 1.0f);
  s.transmission = clamp(cm_floats(word + CM_MATERIAL_COAT).y * maps.transmission.r, 0.0f, 1.0f);
  s.eta = volume_ior > 0.0f ? cm_apart(from_back ? 1.0f / volume_ior : volume_ior) : 0.0f;
  // A volume's coat and sheen are only on its outside.
  if (volume_ior > 0.0f && from_back) {
    s.clearcoat = 0.0f;
    s.sheen = vec3(0.0f);
  }
  s.film.weight = clamp(film.x * maps.iridescence.r, 0.0f, 1.0f);
  s.film.ior = film.y;
  s.film.thickness = mix(film.z, film.w, maps.film_thickness.g);
  s.film.outside = 1.0f + 0.5f * s.clearcoat;

  vec2 along = vec2(1.0f, 0.0f);
  float strength = turn.x;
  if (cm_words(word + CM_USE_ANISOTROPY).x != 0u) {
    along = vec2(maps.anisotropy) * 2.0f - 1.0f;
    along = dot(along, along) > 1e-12f ? normalize(along) : vec2(1.0f, 0.0f);
    strength *= maps.anisotropy.b;
  }
  along = vec2(turn.y * along.x - turn.z * along.y, turn.z * along.x + turn.y * along.y);
  vec3 t = vec3(0.0f);
  float alpha = cm_alpha(s.roughness);
  s.alpha = vec2(alpha);
  if (strength > 0.0f && tangent.w != 0.0f) {
    vec3 u = cm_across(shading, vec3(tangent));
    t = u * along.x + cross(shading, u) * ((tangent.w < 0.0f ? -1.0f : 1.0f) * along.y);
    s.alpha.x = mix(alpha, 1.0f, min(strength * strength, 1.0f));
    s.roughness = sqrt(sqrt(s.alpha.x * s.alpha.y));
  }
  s.tangent = cm_across(s.normal, t);
  s.film_average = cm_film_average(s);
}

#endif

// Shading data of the point of a triangle that a path along w (world) has hit, on its back or front. With
// CM_EXTENDED_BSDF a volume boundary is assumed to be in air; cm_bound (path_vertex.glsl) corrects that.
CM_FN CmSurfacePoint cm_surface_point(uint triangle, vec2 weights, vec3 w, bool from_back) {
  CmSurfacePoint point;
  uint model = cm_model_of(triangle);
  CmVertexMix m = cm_vertex_mix(model, triangle - cm_models[model].first, weights);
  uint word = m.material;
  CmCorners corners = cm_corners(m);
  vec3 normal = vec3(0.0f);
  vec4 tangent = vec4(0.0f);
  for (int i = 0; i < 3; ++i) {
    normal += m.weight[i] * corners.normal[i];
    vec4 along = cm_corner(m, i).tangent;
    if (along.w != 0.0f) tangent += m.weight[i] * vec4(cm_model_direction(model, vec3(along)), along.w);
  }
  if (cm_mirrors(model)) tangent.w = -tangent.w;
  point.position = m.weight.x * corners.position[0] + m.weight.y * corners.position[1] +
                   m.weight.z * corners.position[2];
  vec3 g = cm_turning_normal(corners.position[0], corners.position[1], corners.position[2]);
  point.behind = dot(g, w) > 0.0f;
  point.geometric = point.behind ? -g : g;
  point.lifted = cm_lift(point.position, m.weight, corners, point.geometric) != vec3(0.0f);
  float normal_length = length(normal);
  normal = normal_length > 1e-6f ? normal / normal_length : g;
  bool back = dot(normal, point.geometric) < 0.0f;
  point.material.smooth_normal = back ? -normal : normal;

  CmMaps maps = cm_maps(m);
  vec4 base = cm_floats(word + CM_MATERIAL_BASE_COLOR) * maps.base_color * m.color;
  vec4 a = cm_floats(word + CM_MATERIAL_REFLECTION);
  vec4 b = cm_floats(word + CM_MATERIAL_SPECULAR_COLOR);
  vec4 c = cm_floats(word + CM_MATERIAL_COAT);
  uint flags = cm_words(word + CM_MATERIAL_FLAGS).x;
  vec4 rough = maps.metallic_roughness;

  if (cm_words(word + CM_USE_NORMAL).x != 0u) {
    vec3 t = vec3(tangent) - dot(vec3(tangent), normal) * normal;
    float hand = tangent.w < 0.0f ? -1.0f : 1.0f;
    if (dot(t, t) > 1e-12f) {
      vec3 n = (vec3(maps.normal) * 2.0f - 1.0f) * vec3(c.z, c.z, 1.0f);
      t = normalize(t);
      vec3 bumped = n.x * t + n.y * hand * cross(normal, t) + n.z * normal;
      if (dot(bumped, bumped) > 1e-12f) normal = normalize(bumped);
    }
  }
#if CM_EXTENDED_BSDF
  vec3 shading = normal;  // shading normal of the front side
#endif
  if (back) normal = -normal;
  point.material.matte_normal = normal;
  normal = cm_bend_normal(normal, point.geometric, -w);

  vec3 emission = vec3(cm_floats(word + CM_MATERIAL_EMISSION)) * vec3(maps.emission);
  point.unlit = (flags & CM_UNLIT) != 0u;
  point.emission = from_back && (flags & CM_ONE_SIDED) != 0u ? vec3(0.0f) : emission;
  if (point.unlit) point.emission = vec3(base);
  point.material.base_color = vec3(base);
  point.material.metallic = clamp(a.x * rough.b, 0.0f, 1.0f);
  point.material.roughness = clamp(a.y * rough.g, 0.0f, 1.0f);
  point.material.normal = normal;
  float specular = a.w * maps.specular.a;
  point.material.f0 = min(a.z * vec3(b) * vec3(maps.specular_color), vec3(1.0f)) * specular;
  point.material.specular = specular;
  point.material.clearcoat = b.w * maps.clearcoat.r;
  point.material.clearcoat_roughness = c.x * maps.clearcoat_roughness.g;
#if CM_EXTENDED_BSDF
  cm_enrich(point.material, word, maps, tangent, shading, point.geometric, from_back);
  if (point.unlit) point.material.transmission = 0.0f;
  // Rays that pass through are not shaded here, so the shaded ones are weighted by 1 / (1 - pass probability).
  vec3 passes = cm_bsdf_passes(point.material, -w);
  point.kept = 1.0f / max(1.0f - cm_max3(passes), 1e-6f);
  point.emission *= point.kept;
#endif
  return point;
}

// Called by the BVH: returns true if the ray ends at this triangle. Clear surfaces let rays pass with the transmittance
// of their most transparent channel.
CM_FN bool cm_hit_accept(uint triangle, vec2 weights) {
  float solid = cm_coverage(cm_vertex_mix(cm_model, triangle, weights));
  uint number = cm_models[cm_model].first + triangle;
#if CM_CLEAR_SURFACES
  float u = cm_unit_float(cm_hash3(uvec3(cm_hit_seed, number, 0x68bc21ebu)).x);
  if (u >= solid) return false;
  CmSurfacePoint point = cm_surface_point(number, weights, cm_hit_direction, false);
  vec3 passes = cm_bsdf_passes(point.material, -cm_hit_direction);
  float most = cm_max3(passes);
  if (u >= solid * most) return true;
  cm_hit_passed *= passes / most;
  return false;
#else
  return solid >= 1.0f || cm_unit_float(cm_hash3(uvec3(cm_hit_seed, number, 0x68bc21ebu)).x) < solid;
#endif
}

// Camera rays pass the backs of single-sided materials; other rays do not.
#define CM_HIT_ACCEPT
#define CM_BVH_CULLS cm_hit_camera
#define CM_BVH_LOW cm.surfaces.low
#define CM_BVH_HIGH cm.surfaces.high
#define CM_BVH_NUMBER(triangle) (cm_models[cm_model].first + (triangle))
#include "surface/bvh.glsl"
#include "surface/model.glsl"

// BSDF times cosine for light from wi (world, unit) scattered to where the path came from. It is not 0 below the
// triangle: light found there from the ray's origin counts, often that of the surface itself.
CM_FN vec3 cm_surface_eval(CmSurfacePoint point, vec3 w, vec3 wi) {
  vec3 share = cm_bsdf_eval(point.material, -w, wi);
#if CM_EXTENDED_BSDF
  share *= point.kept;
#endif
  return share;
}

// Solid-angle pdf of cm_surface_sample.
CM_FN float cm_surface_pdf(CmSurfacePoint point, vec3 w, vec3 wi) { return cm_bsdf_pdf(point.material, -w, wi); }

// Samples a direction for the scattered ray.
CM_FN vec3 cm_surface_sample(CmSurfacePoint point, vec3 w, float u_0, float u_1, float u_2) {
  return cm_bsdf_sample(point.material, -w, u_0, u_1, u_2);
}

// Origin of a ray along d (world, unit) that starts at a point of a triangle, in world space. behind: the origin is on
// the side where the vertices are clockwise. lifts: apply cm_lift. shift: offset from the point itself, without the
// rounding margin.
CM_FN vec3 cm_surface_origin(uint triangle, vec2 weights, bool behind, bool lifts, vec3 d, CM_OUT(vec3) shift) {
  uint model = cm_model_of(triangle);
  CmVertexMix m = cm_vertex_mix(model, triangle - cm_models[model].first, weights);
  CmCorners corners = cm_corners(m);
  vec3 g = cm_turning_normal(corners.position[0], corners.position[1], corners.position[2]);
  if (behind) g = -g;
  vec3 p = m.weight.x * corners.position[0] + m.weight.y * corners.position[1] + m.weight.z * corners.position[2];
  shift = lifts ? cm_lift_share(dot(g, d)) * cm_lift(p, m.weight, corners, g) : vec3(0.0f);
  return cm_offset_origin(p + shift, g) + cm_model_room(model, p) * g;
}

#endif
