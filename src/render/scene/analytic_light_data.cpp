#include "render/scene/analytic_light_data.hpp"

#include <string>

#include "base/error.hpp"
#include "gl/bindings.hpp"

namespace cumulet::render {

AnalyticLightData AnalyticLightData::make(const gl::FunctionsPtr& gl, const gl::Limits& limits,
                                          const light::AnalyticLights& of_host,
                                          std::span<const surface::PunctualLight> of_scene,
                                          std::span<const std::uint32_t> groups, std::span<const light::Lit> lit) {
  std::vector<core::CmAnalyticLight> records = light::analytic_light_records(of_host, of_scene, glm::dvec3(0.0));
  for (std::size_t i = 0; i < groups.size(); ++i) records[of_host.size() + i].group = groups[i];
  AnalyticLightData data;
  data.arrives_ = light::share_looks(records, lit);
  if (!lit.empty()) data.nearest_ = light::nearest_analytic_light(records, lit.front());
  data.count_ = static_cast<std::uint32_t>(records.size());
  // Kernels need a buffer to be bound, even if they read no light.
  if (records.empty()) records.emplace_back();
  const std::size_t bytes = records.size() * sizeof(core::CmAnalyticLight);
  if (static_cast<std::int64_t>(bytes) > limits.storage_block_bytes) {
    throw Error(ErrorCode::unsupported, std::to_string(records.size()) +
                                            " lights are more than this driver's GL_MAX_SHADER_STORAGE_BLOCK_SIZE, " +
                                            std::to_string(limits.storage_block_bytes) + ", holds");
  }
  data.records_ = gl::make_buffer(gl, bytes, records.data(), 0, "creating the lights");
  return data;
}

void AnalyticLightData::bind(const gl::Functions& gl) const {
  gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, core::CM_STORAGE_ANALYTIC_LIGHTS, records_.name());
}

}  // namespace cumulet::render
