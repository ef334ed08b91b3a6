#version 450
// Temporal reprojection: finds each pixel's position in the view of an earlier image, and that image's history there.
// Surfaces are reprojected by their depth, the medium by its mean scattering depth. Pixels that show both use both,
// weighted by the transmittance. On disocclusion there is no history.
layout(local_size_x = 8, local_size_y = 8) in;
#include "common/bindings.glsl"
#define CM_WAVELET_READS
#include "denoise/wavelet_history.glsl"
layout(binding = CM_UNIT_HISTORY_LIGHT) uniform usampler2D cm_history_light;
layout(binding = CM_UNIT_HISTORY_GUIDES) uniform usampler2D cm_history_guides;
layout(location = 3) uniform mat3 cm_to_before;      // maps points of the current view to the earlier view; their form:
layout(location = 4) uniform vec3 cm_moved;          // (x z, y z, z), orthographic (x, y, z); x and y as in clip space
layout(location = 5) uniform ivec2 cm_orthographic;  // of the current and of the earlier view
layout(location = 6) uniform vec2 cm_footprint_before;
layout(location = 7) uniform float cm_surfaces;
layout(location = 8) uniform float cm_most;  // maximum number of samples
layout(rgba32ui, binding = CM_IMAGE_HISTORY_LIGHT) uniform writeonly uimage2D cm_light_out;

// Relative depth tolerance for surfaces.
#define CM_SAME 0.003
// Relative depth tolerance in the medium, whose mean depth is not the origin of all its light.
#define CM_SAME_MEDIUM 0.02

// Position in the earlier image, in texels, and depth there. w: 0 if that is behind the eye.
vec4 cm_before(vec2 at, float z) {
  bool far = z > CM_NOTHING_Z;
  vec3 here = cm_orthographic.x != 0 ? vec3(at, far ? 0.0 : z) : (far ? vec3(at, 1.0) : z * vec3(at, 1.0));
  vec3 there = cm_to_before * here + (far ? vec3(0.0) : cm_moved);
  float seen = cm_orthographic.y != 0 || there.z > 0.0 ? 1.0 : 0.0;
  vec2 clip = cm_orthographic.y != 0 ? there.xy : there.xy / max(there.z, 1e-30);
  vec2 share = 0.5 + vec2(0.5, -0.5) * clip;
  return vec4(share * vec2(textureSize(cm_history_light, 0)) - 0.5, far ? 2.0 * CM_NOTHING_Z : there.z, seen);
}

// Tolerances from the differences between a pixel and its neighbors, on the smaller side. Positions between pixels may
// differ as much.
struct CmRoom {
  float solid_z;
  float scattered_z;
  float normal;  // squared length
};

CmRoom cm_room(ivec2 texel, CmGeometry here) {
  ivec2 last = textureSize(cm_guides, 0) - 1;
  CmRoom room = CmRoom(0.0, 0.0, 0.05);
  for (int axis = 0; axis < 2; ++axis) {
    ivec2 by = ivec2(1 - axis, axis);
    CmGeometry to = cm_geometry_at(min(texel + by, last));
    CmGeometry from = cm_geometry_at(max(texel - by, ivec2(0)));
    float solid = abs(cm_smaller(here.solid_z - from.solid_z, to.solid_z - here.solid_z));
    float scattered = abs(cm_smaller(here.scattered_z - from.scattered_z, to.scattered_z - here.scattered_z));
    if (solid < 0.1 * CM_NOTHING_Z) room.solid_z += solid;
    if (scattered < 0.1 * CM_NOTHING_Z) room.scattered_z += scattered;
    vec3 bend_from = here.normal - from.normal;
    vec3 bend_to = here.normal - to.normal;
    room.normal += min(dot(bend_from, bend_from), dot(bend_to, bend_to));
  }
  return room;
}

// Adds the history at a reprojected position, weighted by its similarity. solid: compare depths of surfaces, else of
// the medium. share: weight.
void cm_recall(inout CmLit sum, CmGeometry here, float cover, vec4 before, bool solid, CmRoom room, float share) {
  ivec2 size = textureSize(cm_history_light, 0);
  if (before.w == 0.0 || any(lessThan(before.xy, vec2(-1.0))) || any(greaterThan(before.xy, vec2(size)))) return;
  vec2 low = floor(before.xy);
  vec2 part = before.xy - low;
  float footprint = cm_footprint_before.x + cm_footprint_before.y * min(before.z, CM_NOTHING_Z);
  float apart = solid ? room.solid_z + CM_SAME * abs(before.z) : room.scattered_z + CM_SAME_MEDIUM * abs(before.z);
  apart += 2.0 * footprint;
  for (int i = 0; i < 4; ++i) {
    ivec2 offset = ivec2(i & 1, i >> 1);
    ivec2 at = ivec2(low) + offset;
    if (any(lessThan(at, ivec2(0))) || any(greaterThanEqual(at, size))) continue;
    CmLit lit = cm_unpacked_light(texelFetch(cm_history_light, at, 0));
    if (!cm_is_positive(lit.samples)) continue;
    CmGeometry there = cm_unpacked_geometry(texelFetch(cm_history_guides, at, 0));
    float z = solid ? there.solid_z : there.scattered_z;
    bool none = before.z > CM_NOTHING_Z;
    float off = none != (z > CM_NOTHING_Z) ? 10.0 : (none ? 0.0 : min(10.0, abs(z - before.z) / apart));
    vec3 bend = there.normal - here.normal;
    float differs = off * off + dot(bend, bend) / room.normal + 4.0 * abs(there.transmittance - here.transmittance);
    vec2 near = mix(1.0 - part, part, vec2(offset));
    float weight = share * near.x * near.y * exp(-differs) * lit.samples;
    float ratio = cover / cm_cover(there.open);
    sum.front += weight * cm_scaled_cover(lit.front, ratio);
    sum.moment += weight * ratio * ratio * lit.moment;
    sum.samples += weight;
  }
}

void main() {
  ivec2 texel = ivec2(gl_GlobalInvocationID.xy) + ivec2(0, cm_rows.x);
  ivec2 size = textureSize(cm_guides, 0);
  if (texel.x >= size.x || texel.y >= cm_rows.y) return;
  CmLit sum = CmLit(vec4(0.0), 0.0, 0.0);
  if (cm_guides_at(texel).finite) {
    CmGeometry here = cm_geometry_at(texel);
    CmRoom room = cm_room(texel, here);
    vec2 at = vec2(2.0, -2.0) * ((vec2(texel) + 0.5) / vec2(size) - 0.5);
    float cover = cm_cover(here.open);
    bool medium = here.scattered_z < CM_NOTHING_Z;
    bool solid = cm_surfaces != 0.0 && here.solid_z < CM_NOTHING_Z;
    float through = solid ? (medium ? here.transmittance : 1.0) : (medium ? 0.0 : 1.0);
    if (through > 0.0) {
      float z = solid ? here.solid_z : 2.0 * CM_NOTHING_Z;
      cm_recall(sum, here, cover, cm_before(at, z), true, room, through);
    }
    if (through < 1.0) {
      cm_recall(sum, here, cover, cm_before(at, here.scattered_z), false, room, 1.0 - through);
    }
  }
  if (sum.samples > 0.0) {
    sum.front /= sum.samples;
    sum.moment /= sum.samples;
    float most = max(1.0, 1.0 - sum.front.a);
    sum.front = cm_within_cover(sum.front);
    sum.moment /= most * most;
    // A sample of a lower-resolution image counts for several pixels.
    vec2 coarser = vec2(textureSize(cm_history_light, 0)) / vec2(size);
    sum.samples = min(cm_most, sum.samples * min(1.0, coarser.x * coarser.y));
  }
  imageStore(cm_light_out, texel, cm_packed_light(sum));
}
