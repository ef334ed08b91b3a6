#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "gl/objects.hpp"
#include "headless.hpp"
#include "support/gl_compute.hpp"
#include "surface/bvh.hpp"

namespace cumulet::test {

struct GlRay {
  glm::vec3 o;
  float t_min = 0.0F;
  glm::vec3 d;
  float t_max = 0.0F;
};
struct GlHit {
  float t = 0.0F;
  std::uint32_t triangle = 0;
  glm::vec2 barycentrics{0.0F};
  std::uint32_t record = 0;
  std::uint32_t flags = 0;
  std::uint32_t front = 0;
  std::uint32_t occluded = 0;
};
static_assert(sizeof(GlRay) == 32 && sizeof(GlHit) == 32);

/// Runs glsl/surface/bvh.glsl in a compute shader. Throws after GL errors.
class GlRays {
 public:
  /// accept: the body of cm_hit_accept, "" for none. The context is current.
  GlRays(headless::Context& context, const std::string& accept)
      : gl_(gl::load_functions(headless::Context::get_proc, &context)) {
    std::string text = "#version 450\nlayout(local_size_x = 64) in;\n" + glsl_file("common/shared.glsl") + R"(
layout(binding = 0) uniform usamplerBuffer nodes;
layout(binding = 1) uniform usamplerBuffer triangles;
struct Ray { vec4 from; vec4 along; };
layout(std430, binding = 0) readonly buffer Rays { Ray rays[]; };
layout(std430, binding = 1) buffer Hits { uint hits[]; };
layout(location = 0) uniform uint any;
uvec4 cm_bvh_node(uint texel) { return texelFetch(nodes, int(texel)); }
uvec4 cm_bvh_triangle(uint texel) { return texelFetch(triangles, int(texel)); }
)";
    if (!accept.empty()) {
      text += "#define CM_HIT_ACCEPT\nbool cm_hit_accept(uint triangle, vec2 barycentrics) { " + accept + " }\n";
    }
    text += glsl_file("surface/bvh.glsl") + R"(
void main() {
  uint i = gl_GlobalInvocationID.x;
  if (i >= rays.length()) return;
  vec3 o = rays[i].from.xyz;
  vec3 d = rays[i].along.xyz;
  if (any != 0u) {
    hits[8u * i + 7u] = uint(cm_bvh_occluded(o, d, rays[i].from.w, rays[i].along.w));
    return;
  }
  CmHit hit;
  cm_bvh_closest(o, d, rays[i].from.w, rays[i].along.w, hit);
  hits[8u * i] = floatBitsToUint(hit.t);
  hits[8u * i + 1u] = hit.triangle;
  hits[8u * i + 2u] = floatBitsToUint(hit.barycentrics.x);
  hits[8u * i + 3u] = floatBitsToUint(hit.barycentrics.y);
  hits[8u * i + 4u] = hit.record;
  hits[8u * i + 5u] = hit.flags;
  hits[8u * i + 6u] = uint(hit.front);
}
)";
    program_ = compute_program(gl_, text);
  }

  /// Input and output buffers of run().
  struct Scene {
    std::array<gl::Object, 6> objects;  // nodes, records, their textures, rays, hits
    std::size_t rays = 0;
  };
  [[nodiscard]] Scene upload(const surface::Bvh& bvh, std::span<const GlRay> rays) const {
    const auto buffer = [&](const void* data, std::size_t bytes) {
      return gl::make_buffer(gl_, std::max<std::size_t>(bytes, 16), bytes == 0 ? nullptr : data, 0, "rays");
    };
    Scene scene;
    auto& o = scene.objects;
    o[0] = buffer(bvh.nodes().data(), bvh.nodes().size_bytes());
    o[1] = buffer(bvh.records().data(), bvh.records().size_bytes());
    o[2] = gl::make_texture_buffer(gl_, GL_RGBA32UI, o[0], "nodes");
    o[3] = gl::make_texture_buffer(gl_, GL_RGBA32UI, o[1], "records");
    o[4] = buffer(rays.data(), rays.size_bytes());
    const std::vector<GlHit> hits(rays.size());
    o[5] = buffer(hits.data(), hits.size() * sizeof(GlHit));
    scene.rays = rays.size();
    return scene;
  }
  /// any: true finds any hit and sets only `occluded`; false finds the nearest hit and sets the other members. Waits
  /// for completion.
  void run(const Scene& scene, bool any) const {
    gl_->UseProgram(program_.name());
    gl_->ProgramUniform1ui(program_.name(), 0, any ? 1 : 0);
    gl_->BindTextureUnit(0, scene.objects[2].name());
    gl_->BindTextureUnit(1, scene.objects[3].name());
    gl_->BindBufferBase(GL_SHADER_STORAGE_BUFFER, 0, scene.objects[4].name());
    gl_->BindBufferBase(GL_SHADER_STORAGE_BUFFER, 1, scene.objects[5].name());
    gl_->DispatchCompute(static_cast<GLuint>((scene.rays + 63) / 64), 1, 1);
    gl_->MemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT | GL_SHADER_STORAGE_BARRIER_BIT);
    gl_->Finish();
  }
  /// Finds the nearest hit and any hit of each ray.
  [[nodiscard]] std::vector<GlHit> trace(const surface::Bvh& bvh, std::span<const GlRay> rays) const {
    const Scene scene = upload(bvh, rays);
    run(scene, false);
    run(scene, true);
    std::vector<GlHit> hits(rays.size());
    gl_->GetNamedBufferSubData(scene.objects[5].name(), 0, static_cast<GLsizeiptr>(hits.size() * sizeof(GlHit)),
                               hits.data());
    gl::check(*gl_, "tracing rays");
    return hits;
  }
  [[nodiscard]] std::string renderer() const { return gl::string_of(*gl_, GL_RENDERER); }

 private:
  gl::FunctionsPtr gl_;
  gl::Object program_;
};

}  // namespace cumulet::test
