// Transmittance maps of the C ABI. cumulet.h documents the calls.

#include <algorithm>

#include "viewer/c_viewer.hpp"

namespace {

using namespace cumulet::c_abi;
namespace core = cumulet::viewer;

constexpr std::uint32_t max_slots = 16;
constexpr std::uint64_t max_texels = std::uint64_t{1} << 27U;

core::MapRequest request_of(const cumulet_transmittance_map_desc* desc) {
  const cumulet_transmittance_map_desc d = read_desc(desc, "cumulet_transmittance_map_desc");
  require(d.slot < max_slots, "cumulet_transmittance_map_desc.slot is not from 0 to 15");
  require(number(d.light) <= CUMULET_MAP_LIGHT_POINT, "cumulet_transmittance_map_desc.light is unknown");
  require(d.size == 0 || in_range(d.size, 16, 4096), "cumulet_transmittance_map_desc.size is not from 16 to 4096");
  require(d.slices == 0 || in_range(d.slices, 2, 256), "cumulet_transmittance_map_desc.slices is not from 2 to 256");
  require(in_range(d.budget_ms, 0.0, 1e9), "cumulet_transmittance_map_desc.budget_ms is not from 0 to 1e9");
  core::MapRequest request;
  request.slot = d.slot;
  request.light = static_cast<core::MapLight>(number(d.light));
  if (request.light == core::MapLight::direction) {
    request.towards = to_dvec3(d.direction);
    const double length = glm::length(request.towards);
    require(in_range(length, 1e-100, 1e100), "cumulet_transmittance_map_desc.direction is zero, or not finite");
    request.towards /= length;
  }
  if (request.light == core::MapLight::point) {
    request.position = to_dvec3(d.position);
    require(std::ranges::all_of(d.position, [](double x) { return in_range(x, -1e30, 1e30); }),
            "cumulet_transmittance_map_desc.position is not finite");
  }
  if (d.size != 0) request.size = d.size;
  if (d.slices != 0) request.slices = d.slices;
  require(std::uint64_t{request.size} * request.size * request.slices <= max_texels,
          "cumulet_transmittance_map_desc.size and slices give more than 2^27 texels");
  if (d.budget_ms > 0.0) request.budget_ms = d.budget_ms;
  return request;
}

}  // namespace

cumulet_status cumulet_update_transmittance_map(cumulet_viewer* viewer, const cumulet_transmittance_map_desc* desc,
                                                cumulet_transmittance_map* map) {
  return guarded(viewer, [&](core::Viewer& v) {
    const core::MapRequest request = request_of(desc);
    read_desc(map, "cumulet_transmittance_map");
    const core::MapResult made = v.update_map(request);
    cumulet_transmittance_map out{};
    out.texture = made.texture;
    out.size = made.size;
    out.slices = made.slices;
    out.incomplete = made.more ? 1 : 0;
    for (int i = 0; i < 16; ++i) out.to_map[i] = made.to_map[i / 4][i % 4];
    out.near_distance = made.range.x;
    out.far_distance = made.range.y;
    write_desc(map, out, "cumulet_transmittance_map");
  });
}

cumulet_status cumulet_destroy_transmittance_map(cumulet_viewer* viewer, uint32_t slot) {
  return guarded(viewer, [&](core::Viewer& v) {
    require(slot < max_slots, "the slot is not from 0 to 15");
    v.drop_map(slot);
  });
}

// GLSL lookup for a point. Directions are mapped as in glsl/features/transmittance.comp: texels lie on the folds of the
// octahedron, and the first and last distances are at the centers of slices.
const char* cumulet_transmittance_map_glsl(void) {
  return R"(float cumulet_transmittance(sampler3D map, mat4 to_map, vec2 range, vec3 world) {
  vec3 at = (to_map * vec4(world, 1.0)).xyz;
  if (range.y > 0.0) {
    vec3 texels = vec3(textureSize(map, 0));
    float distance = length(at);
    vec3 d = at / max(abs(at.x) + abs(at.y) + abs(at.z), 1e-30);
    vec2 place = d.xy;
    if (d.z < 0.0) place = (1.0 - abs(d.yx)) * vec2(d.x < 0.0 ? -1.0 : 1.0, d.y < 0.0 ? -1.0 : 1.0);
    at = vec3(0.5 * place + 0.5, clamp((distance - range.x) / (range.y - range.x), 0.0, 1.0));
    at = (at * (texels - 1.0) + 0.5) / texels;
  }
  return texture(map, at).r;
}
)";
}
