// glsl/common/parameters.glsl is one source for GLSL and C++. Tests that drivers lay it out as C++ does.

#include "render/scene/parameters.hpp"

#include <gtest/gtest.h>

#include <array>
#include <numeric>
#include <sstream>
#include <string>
#include <vector>

#include "gl/bindings.hpp"
#include "support/gl_compute.hpp"
#include "support/gl_state.hpp"

namespace {

using cumulet::core::CmParameters;
namespace gl = cumulet::gl;
namespace test = cumulet::test;

struct Field {
  const char* name;
  std::size_t offset;
  std::size_t words;
};
#define CM_FIELD(part, field) \
  Field { #part "." #field, offsetof(CmParameters, part.field), sizeof(CmParameters::part.field) / 4 }
const std::array fields{
    CM_FIELD(view, eye),
    CM_FIELD(view, orthographic),
    CM_FIELD(view, forward),
    CM_FIELD(view, right),
    CM_FIELD(view, up),
    CM_FIELD(view, inverse_focus),
    CM_FIELD(view, lens_right),
    CM_FIELD(view, lens_up),
    CM_FIELD(view, size),
    CM_FIELD(space, to_cube_x),
    CM_FIELD(space, to_cube_y),
    CM_FIELD(space, to_cube_z),
    CM_FIELD(space, from_cube_x),
    CM_FIELD(space, from_cube_y),
    CM_FIELD(space, from_cube_z),
    CM_FIELD(space, cube_origin),
    CM_FIELD(space, unit_volume),
    CM_FIELD(space, box_min),
    CM_FIELD(space, volumes),
    CM_FIELD(space, box_max),
    CM_FIELD(grid, box_min),
    CM_FIELD(grid, root_exponent),
    CM_FIELD(grid, box_max),
    CM_FIELD(grid, levels),
    CM_FIELD(grid, page_shift),
    CM_FIELD(grid, first_cell),
    CM_FIELD(grid, tree),
    CM_FIELD(grid, emission_unit),
    CM_FIELD(grid, first_records[0]),
    CM_FIELD(grid, first_glowing),
    CM_FIELD(grid, glowing),
    CM_FIELD(grid, moves),
    CM_FIELD(grid, first_change),
    CM_FIELD(grid, first_corners),
    CM_FIELD(emissive, density),
    CM_FIELD(emissive, extent),
    CM_FIELD(emissive, min_stretch),
    CM_FIELD(medium, albedo),
    CM_FIELD(medium, extinction),
    CM_FIELD(medium, source),
    CM_FIELD(medium, anisotropy),
    CM_FIELD(medium, second_anisotropy),
    CM_FIELD(medium, second_bend),
    CM_FIELD(medium, second_weight),
    CM_FIELD(medium, emits),
    CM_FIELD(medium, colored),
    CM_FIELD(medium, anisotropic),
    CM_FIELD(medium, group),
    CM_FIELD(medium, holdout),
    CM_FIELD(medium, changes),
    CM_FIELD(lights, sun_direction),
    CM_FIELD(lights, any),
    CM_FIELD(lights, sky_probability),
    CM_FIELD(lights, sun_irradiance),
    CM_FIELD(lights, sky_radiance),
    CM_FIELD(lights, triangle_probability),
    CM_FIELD(lights, analytic_light_probability),
    CM_FIELD(lights, emissive_probability),
    CM_FIELD(lights, cell_probability),
    CM_FIELD(lights, environment_probability),
    CM_FIELD(lights, environment_strength),
    CM_FIELD(lights, environment_turn),
    CM_FIELD(lights, sun_radiance),
    CM_FIELD(lights, sun_spread),
    CM_FIELD(surfaces, low),
    CM_FIELD(surfaces, models),
    CM_FIELD(surfaces, high),
    CM_FIELD(surfaces, ggx_albedo),
    CM_FIELD(surfaces, ggx_albedo_averages),
    CM_FIELD(surfaces, sheen_albedo),
    CM_FIELD(surfaces, extended_bsdf),
    CM_FIELD(analytic_lights, count),
    CM_FIELD(environment, size),
    CM_FIELD(environment, words),
    CM_FIELD(environment, density),
    CM_FIELD(ground, albedo),
    CM_FIELD(ground, height),
    CM_FIELD(ground, reach),
    CM_FIELD(ground, catches),
    CM_FIELD(layers, count),
    CM_FIELD(layers, blended),
    CM_FIELD(layers, size),
    CM_FIELD(layers, colored),
    CM_FIELD(host_depth, size),
    CM_FIELD(host_depth, layers),
    CM_FIELD(integrator, seed),
    CM_FIELD(integrator, max_bounces),
    CM_FIELD(integrator, blurred_roughness),
    CM_FIELD(integrator, light_among_surfaces),
    CM_FIELD(integrator, first_sample),
    CM_FIELD(integrator, groups),
    CM_FIELD(integrator, sun_group),
    CM_FIELD(integrator, sky_group),
    CM_FIELD(dispatch, tile_corner),
    CM_FIELD(dispatch, tile_size),
    CM_FIELD(dispatch, rounds),
    CM_FIELD(dispatch, samples),
    CM_FIELD(dispatch, view),
    CM_FIELD(dispatch, picks),
    CM_FIELD(dispatch, rows),
    CM_FIELD(dispatch, lanes),
    CM_FIELD(dispatch, slots),
    CM_FIELD(dispatch, rays_before),
    CM_FIELD(dispatch, rays_least),
    CM_FIELD(shutter, open.eye),
    CM_FIELD(shutter, open.orthographic),
    CM_FIELD(shutter, open.forward),
    CM_FIELD(shutter, open.right),
    CM_FIELD(shutter, open.up),
    CM_FIELD(shutter, open.inverse_focus),
    CM_FIELD(shutter, open.lens_right),
    CM_FIELD(shutter, open.lens_up),
    CM_FIELD(shutter, open.size),
    CM_FIELD(shutter, close.eye),
    CM_FIELD(shutter, close.orthographic),
    CM_FIELD(shutter, close.forward),
    CM_FIELD(shutter, close.right),
    CM_FIELD(shutter, close.up),
    CM_FIELD(shutter, close.inverse_focus),
    CM_FIELD(shutter, close.lens_right),
    CM_FIELD(shutter, close.lens_up),
    CM_FIELD(shutter, close.size),
    CM_FIELD(shutter, axis),
    CM_FIELD(shutter, angle),
    CM_FIELD(shutter, lasts),
};

class ShaderParameters : public test::GlTest {};
CUMULET_ON_BACKENDS(ShaderParameters);

// A uint or float, or one component of a vector of them, as one word.
std::string word_of(const Field& field, std::size_t i) {
  std::ostringstream text;
  text << "word(cm." << field.name;
  if (field.words > 1) text << '[' << i << ']';
  text << ')';
  return text.str();
}

// The shader's source up to the block.
std::string head() {
  return "#version 450\nlayout(local_size_x = 1) in;\n" + test::glsl_file("common/bindings.glsl") +
         test::glsl_file("common/parameters.glsl");
}

TEST_P(ShaderParameters, FieldOffsetsMatchBetweenCppAndGlsl) {
  std::string text = head() + R"(
layout(std430, binding = 0) buffer Words { uint words[]; };
uint word(uint value) { return value; }
uint word(float value) { return floatBitsToUint(value); }
void main() {
)";
  std::vector<std::uint32_t> expected;
  std::vector<std::uint32_t> block(sizeof(CmParameters) / 4);
  std::iota(block.begin(), block.end(), 0x3f800000U);  // distinct floats from 1 upwards
  for (const Field& field : fields) {
    for (std::size_t i = 0; i < field.words; ++i) {
      text += "  words[" + std::to_string(expected.size()) + "] = " + word_of(field, i) + ";\n";
      expected.push_back(block[field.offset / 4 + i]);
    }
  }
  const gl::Object program = test::compute_program(gl_, text + "}\n");
  const gl::Object uniforms = gl::make_buffer(gl_, sizeof(CmParameters), block.data(), 0, "uniforms");
  const std::vector<std::uint32_t> zeros(expected.size());
  const gl::Object out = gl::make_buffer(gl_, 4 * zeros.size(), zeros.data(), 0, "words");
  gl_->UseProgram(program.name());
  gl_->BindBufferBase(GL_UNIFORM_BUFFER, cumulet::core::CM_UNIFORM_PARAMETERS, uniforms.name());
  gl_->BindBufferBase(GL_SHADER_STORAGE_BUFFER, 0, out.name());
  gl_->DispatchCompute(1, 1, 1);
  gl_->MemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
  std::vector<std::uint32_t> words(expected.size());
  gl_->GetNamedBufferSubData(out.name(), 0, static_cast<GLsizeiptr>(4 * words.size()), words.data());
  EXPECT_EQ(words, expected);
}

TEST_P(ShaderParameters, DriverReportsNoOtherFields) {
  const gl::Object program =
      test::compute_program(gl_, head() +
                                     "layout(std430, binding = 0) buffer Words { uint words[]; };\n"
                                     "void main() { words[0] = cm.dispatch.rounds; }\n");
  const GLuint index = gl_->GetProgramResourceIndex(program.name(), GL_UNIFORM_BLOCK, "CmParameters");
  ASSERT_NE(index, GL_INVALID_INDEX);
  const GLenum what = GL_NUM_ACTIVE_VARIABLES;
  GLint count = 0;
  gl_->GetProgramResourceiv(program.name(), GL_UNIFORM_BLOCK, index, 1, &what, 1, nullptr, &count);
  EXPECT_EQ(static_cast<std::size_t>(count), fields.size()) << "this test's list is not whole";
  for (const Field& field : fields) {
    const std::string name = std::string("CmParameters.") + field.name;
    const GLuint uniform = gl_->GetProgramResourceIndex(program.name(), GL_UNIFORM, name.c_str());
    ASSERT_NE(uniform, GL_INVALID_INDEX) << name;
    const GLenum offset = GL_OFFSET;
    GLint member_offset = -1;
    gl_->GetProgramResourceiv(program.name(), GL_UNIFORM, uniform, 1, &offset, 1, nullptr, &member_offset);
    EXPECT_EQ(static_cast<std::size_t>(member_offset), field.offset) << name;
  }
}

}  // namespace
