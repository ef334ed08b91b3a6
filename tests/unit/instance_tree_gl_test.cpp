// The traversal of volume instances on the GPU, and the layout of the table.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "gl/bindings.hpp"
#include "support/gl_compute.hpp"
#include "support/gl_state.hpp"
#include "support/instance_rays.hpp"

namespace {

using namespace cumulet;
using namespace cumulet::test::instances;

class GlInstanceTree : public test::GlTest {
 protected:
  static std::string head() {
    return "#version 450\n" + test::glsl_file("common/shared.glsl") + test::glsl_file("common/bindings.glsl") +
           test::glsl_file("common/parameters.glsl") + test::glsl_file("traversal/instance_table.glsl") +
           test::glsl_file("traversal/instance.glsl");
  }
};
CUMULET_ON_BACKENDS(GlInstanceTree);

constexpr std::size_t max_visits = 32;

// GPU division is accurate to two and a half units in the last place.
bool is_alike(const Visit& a, const Visit& b) {
  return a.instance == b.instance && std::abs(a.entry - b.entry) <= 4e-6F * std::max(1.0F, std::abs(b.entry));
}

TEST_P(GlInstanceTree, ShaderMatchesCpp) {
  const gl::Object program = test::compute_program(gl_, head() + R"(
layout(local_size_x = 64) in;
struct Ray { vec3 o; float t_end; vec3 d; uint flags; };
layout(std430, binding = 0) readonly buffer Rays { Ray rays[]; };
layout(std430, binding = 1) buffer Visits { uint visits[]; };
void main() {
  uint i = gl_GlobalInvocationID.x;
  if (i >= uint(rays.length())) return;
  float entry = -1.0;
  uint instance = CM_INSTANCE_NONE;
  uint count = 0u;
  while (count < 32u && cm_next_instance(rays[i].o, rays[i].d, rays[i].t_end, rays[i].flags, entry, instance)) {
    visits[64u * i + 2u * count] = floatBitsToUint(entry);
    visits[64u * i + 2u * count + 1u] = instance;
    ++count;
  }
}
)");
  for (const std::vector<Instance>& instances : {any_instances(200, 17), coincident(), flat(), tiles()}) {
    const InstanceTable table = scene::make_instances(instances, origin);
    const std::vector<Ray> rays = any_rays(2000, 18, table);
    std::vector<Visit> found(rays.size() * max_visits, Visit{-1.0F, CM_INSTANCE_NONE});
    const auto buffer = [&](const auto& values) {
      return gl::make_buffer(gl_, values.size() * sizeof(values[0]), values.data(), 0, "instances");
    };
    const std::array buffers{buffer(rays), buffer(found), buffer(table.records), buffer(table.nodes)};
    const std::array<GLuint, 4> bindings{0, 1, GLuint{core::CM_STORAGE_INSTANCES},
                                         GLuint{core::CM_STORAGE_INSTANCE_NODES}};
    gl_->UseProgram(program.name());
    for (std::size_t i = 0; i < 4; ++i) gl_->BindBufferBase(GL_SHADER_STORAGE_BUFFER, bindings[i], buffers[i].name());
    gl_->DispatchCompute(static_cast<GLuint>((rays.size() + 63) / 64), 1, 1);
    gl_->MemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
    gl_->GetNamedBufferSubData(buffers[1].name(), 0, static_cast<GLsizeiptr>(found.size() * sizeof(Visit)),
                               found.data());
    core::InstanceRays by_cpp = rays_of(table);
    std::size_t visits = 0;
    std::size_t others = 0;
    for (std::size_t r = 0; r < rays.size(); ++r) {
      Visits expected = visits_of(by_cpp, rays[r]);
      visits += expected.size();
      expected.resize(max_visits, Visit{-1.0F, CM_INSTANCE_NONE});
      for (std::size_t i = 0; i < max_visits; ++i) others += is_alike(found[r * max_visits + i], expected[i]) ? 0 : 1;
    }
    EXPECT_GT(visits, 1000U);
    EXPECT_EQ(others, 0U) << "of " << visits;
  }
}

struct Field {
  std::string name;
  std::size_t offset;
};
#define CM_RECORD(field) \
  Field { "cm_instances[0]." #field, offsetof(CmInstance, field) }
#define CM_NODE(field) \
  Field { "cm_instance_nodes[0]." #field, offsetof(CmInstanceNode, field) }

TEST_P(GlInstanceTree, RecordLayoutMatchesTheDriver) {
  const std::vector<Field> records{CM_RECORD(space.to_cube_x),
                                   CM_RECORD(space.to_cube_y),
                                   CM_RECORD(space.to_cube_z),
                                   CM_RECORD(space.from_cube_x),
                                   CM_RECORD(space.from_cube_y),
                                   CM_RECORD(space.from_cube_z),
                                   CM_RECORD(space.cube_origin),
                                   CM_RECORD(space.unit_volume),
                                   CM_RECORD(space.box_min),
                                   CM_RECORD(space.volumes),
                                   CM_RECORD(space.box_max),
                                   CM_RECORD(grid.box_min),
                                   CM_RECORD(grid.root_exponent),
                                   CM_RECORD(grid.box_max),
                                   CM_RECORD(grid.levels),
                                   CM_RECORD(grid.page_shift),
                                   CM_RECORD(grid.first_cell),
                                   CM_RECORD(grid.tree),
                                   CM_RECORD(grid.emission_unit),
                                   CM_RECORD(grid.first_records[0]),
                                   CM_RECORD(grid.first_glowing),
                                   CM_RECORD(grid.glowing),
                                   CM_RECORD(grid.moves),
                                   CM_RECORD(grid.first_change),
                                   CM_RECORD(grid.first_corners),
                                   CM_RECORD(emissive.density),
                                   CM_RECORD(emissive.extent),
                                   CM_RECORD(emissive.min_stretch),
                                   CM_RECORD(medium.albedo),
                                   CM_RECORD(medium.extinction),
                                   CM_RECORD(medium.source),
                                   CM_RECORD(medium.anisotropy),
                                   CM_RECORD(medium.second_anisotropy),
                                   CM_RECORD(medium.second_bend),
                                   CM_RECORD(medium.second_weight),
                                   CM_RECORD(medium.emits),
                                   CM_RECORD(medium.colored),
                                   CM_RECORD(medium.anisotropic),
                                   CM_RECORD(medium.group),
                                   CM_RECORD(medium.holdout),
                                   CM_RECORD(medium.changes),
                                   CM_RECORD(flags),
                                   CM_RECORD(alias),
                                   CM_RECORD(alias_other),
                                   CM_RECORD(clip)};
  const std::vector<Field> nodes{CM_NODE(low), CM_NODE(skip), CM_NODE(high), CM_NODE(instance)};
  const gl::Object program = test::compute_program(gl_, head() + R"(
layout(local_size_x = 1) in;
layout(std430, binding = 0) buffer Words { uint words[]; };
void main() { words[0] = cm_glowing_instance(cm_instance_nodes[1].instance, 0u); }
)");
  const auto of_block = [&](const char* block, GLenum what) {
    const GLuint index = gl_->GetProgramResourceIndex(program.name(), GL_SHADER_STORAGE_BLOCK, block);
    EXPECT_NE(index, GL_INVALID_INDEX) << block;
    GLint value = -1;
    gl_->GetProgramResourceiv(program.name(), GL_SHADER_STORAGE_BLOCK, index, 1, &what, 1, nullptr, &value);
    return value;
  };
  const auto of_field = [&](const std::string& name, GLenum what) {
    const GLuint index = gl_->GetProgramResourceIndex(program.name(), GL_BUFFER_VARIABLE, name.c_str());
    EXPECT_NE(index, GL_INVALID_INDEX) << name;
    GLint value = -1;
    gl_->GetProgramResourceiv(program.name(), GL_BUFFER_VARIABLE, index, 1, &what, 1, nullptr, &value);
    return value;
  };
  const auto expect = [&](const char* block, const std::vector<Field>& fields, std::size_t stride) {
    EXPECT_EQ(of_block(block, GL_NUM_ACTIVE_VARIABLES), static_cast<GLint>(fields.size())) << "the list is not whole";
    for (const Field& field : fields) {
      EXPECT_EQ(of_field(field.name, GL_OFFSET), static_cast<GLint>(field.offset)) << field.name;
      EXPECT_EQ(of_field(field.name, GL_TOP_LEVEL_ARRAY_STRIDE), static_cast<GLint>(stride)) << field.name;
    }
  };
  expect("CmInstances", records, sizeof(CmInstance));
  expect("CmInstanceNodes", nodes, sizeof(CmInstanceNode));
  EXPECT_EQ(of_block("CmInstances", GL_BUFFER_BINDING), core::CM_STORAGE_INSTANCES);
  EXPECT_EQ(of_block("CmInstanceNodes", GL_BUFFER_BINDING), core::CM_STORAGE_INSTANCE_NODES);
}

}  // namespace
