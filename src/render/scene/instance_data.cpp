#include "render/scene/instance_data.hpp"

#include <algorithm>
#include <glm/gtc/matrix_transform.hpp>
#include <string>

#include "base/error.hpp"
#include "gl/bindings.hpp"
#include "scene/space.hpp"

namespace cumulet::render {

InstanceData InstanceData::make(const gl::FunctionsPtr& gl, const gl::Limits& limits,
                                std::span<const scene::Instance> instances, const glm::dvec3& origin) {
  scene::InstanceTable table = scene::make_instances(instances, origin);
  table.records.insert(table.records.end(), table.ends.begin(), table.ends.end());
  const std::size_t record_bytes = table.records.size() * sizeof(core::CmInstance);
  const std::size_t node_bytes = table.nodes.size() * sizeof(core::CmInstanceNode);
  if (static_cast<std::int64_t>(std::max(record_bytes, node_bytes)) > limits.storage_block_bytes) {
    throw Error(ErrorCode::unsupported, std::to_string(instances.size()) +
                                            " volumes are more than this driver's GL_MAX_SHADER_STORAGE_BLOCK_SIZE, " +
                                            std::to_string(limits.storage_block_bytes) + ", holds");
  }
  InstanceData data;
  data.origin_ = origin;
  data.records_ = gl::make_buffer(gl, record_bytes, table.records.data(), 0, "creating the volume table");
  data.nodes_ = gl::make_buffer(gl, node_bytes, table.nodes.data(), 0, "creating the volume BVH");
  const core::CmInstanceNode& all = table.nodes.front();
  data.space_ = scene::space_of(glm::translate(glm::dmat4(1.0), origin), all.low, all.high);
  data.space_.volumes = static_cast<std::uint32_t>(instances.size());
  data.medium_ = instances.front().medium;
  for (const scene::Instance& instance : instances) {
    data.medium_.source = glm::max(data.medium_.source, instance.medium.source);
    data.medium_.second_weight = std::max(data.medium_.second_weight, instance.medium.second_weight);
    data.medium_.emits |= instance.medium.emits;
    data.medium_.colored |= instance.medium.colored;
    data.medium_.anisotropic |= instance.medium.anisotropic;
    data.medium_.changes |= instance.medium.changes;
  }
  data.clips_ = std::ranges::any_of(table.records, [](const core::CmInstance& record) { return record.clip != 0; });
  data.moves_ = !table.ends.empty() || data.medium_.changes != 0;
  data.emissive_power_ = table.emissive_power;
  data.emissive_length_ = table.emissive_length;
  data.bytes_ = record_bytes + node_bytes;
  return data;
}

void InstanceData::bind(const gl::Functions& gl) const {
  gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, core::CM_STORAGE_INSTANCES, records_.name());
  gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, core::CM_STORAGE_INSTANCE_NODES, nodes_.name());
}

}  // namespace cumulet::render
