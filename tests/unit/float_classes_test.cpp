// Classification of floats by their bits, for every kind of float, in C++ and as drivers compile it.

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "base/shared_code.hpp"
#include "support/gl_compute.hpp"
#include "support/gl_state.hpp"
#include "support/osmesa_leaks.hpp"

namespace {

using namespace cumulet;

struct Sort {
  std::uint32_t bits;
  bool nan, finite, small, positive;  // small: within 2
};
constexpr auto sorts = std::to_array<Sort>({
    {.bits = 0x00000000, .nan = false, .finite = true, .small = true, .positive = false},
    {.bits = 0x80000000, .nan = false, .finite = true, .small = true, .positive = false},
    {.bits = 0x00000001, .nan = false, .finite = true, .small = true, .positive = false},  // denormals
    {.bits = 0x007fffff, .nan = false, .finite = true, .small = true, .positive = false},
    {.bits = 0x807fffff, .nan = false, .finite = true, .small = true, .positive = false},
    {.bits = 0x00800000, .nan = false, .finite = true, .small = true, .positive = true},  // smallest normal number
    {.bits = 0x80800000, .nan = false, .finite = true, .small = true, .positive = false},
    {.bits = 0x3f800000, .nan = false, .finite = true, .small = true, .positive = true},  // 1
    {.bits = 0xbf800000, .nan = false, .finite = true, .small = true, .positive = false},
    {.bits = 0x40000000, .nan = false, .finite = true, .small = true, .positive = true},  // 2
    {.bits = 0xc0000000, .nan = false, .finite = true, .small = true, .positive = false},
    {.bits = 0x40000001, .nan = false, .finite = true, .small = false, .positive = true},
    {.bits = 0x7f7fffff, .nan = false, .finite = true, .small = false, .positive = true},  // the largest
    {.bits = 0xff7fffff, .nan = false, .finite = true, .small = false, .positive = false},
    {.bits = 0x7f800000, .nan = false, .finite = false, .small = false, .positive = true},  // infinity
    {.bits = 0xff800000, .nan = false, .finite = false, .small = false, .positive = false},
    {.bits = 0x7f800001, .nan = true, .finite = false, .small = false, .positive = false},  // signaling
    {.bits = 0xff800001, .nan = true, .finite = false, .small = false, .positive = false},
    {.bits = 0x7fc00000, .nan = true, .finite = false, .small = false, .positive = false},  // quiet
    {.bits = 0xffffffff, .nan = true, .finite = false, .small = false, .positive = false},
});

std::uint32_t expected(const Sort& sort) {
  return (sort.nan ? 1U : 0U) | (sort.finite ? 2U : 0U) | (sort.small ? 4U : 0U) | (sort.positive ? 8U : 0U);
}

// Tests each component of a vector.
template <typename Test>
bool in_any_component(Test test, float x) {
  const glm::vec3 vectors[] = {{x, 1.0F, 1.0F}, {1.0F, x, 1.0F}, {1.0F, 1.0F, x}};
  EXPECT_EQ(test(vectors[0]), test(vectors[1]));
  EXPECT_EQ(test(vectors[0]), test(vectors[2]));
  return test(vectors[0]);
}

TEST(FloatClasses, CppClassifiesEveryKindOfFloat) {
  for (const Sort& sort : sorts) {
    const float x = glm::uintBitsToFloat(sort.bits);
    const std::string at = std::to_string(sort.bits);
    EXPECT_EQ(core::cm_is_nan(x), sort.nan) << at;
    EXPECT_EQ(core::cm_is_finite(x), sort.finite) << at;
    EXPECT_EQ(core::cm_is_within(x, 2.0F), sort.small) << at;
    EXPECT_EQ(core::cm_is_positive(x), sort.positive) << at;
    EXPECT_EQ(in_any_component([](const glm::vec3& v) { return core::cm_is_finite(v); }, x), sort.finite) << at;
    EXPECT_EQ(in_any_component([](const glm::vec3& v) { return core::cm_is_within(v, 2.0F); }, x), sort.small) << at;
  }
}

class FloatClassesShader : public test::GlTest {};
CUMULET_ON_BACKENDS(FloatClassesShader);

TEST_P(FloatClassesShader, ShaderClassifiesEveryKindOfFloat) {
  const std::string text = "#version 450\nlayout(local_size_x = 1) in;\n" + test::glsl_file("common/numbers.glsl") + R"(
layout(std430, binding = 0) buffer Floats { float floats[]; };
layout(std430, binding = 1) buffer Words { uint words[]; };
uint bit(bool value, int index) { return value ? 1u << index : 0u; }
void main() {
  uint i = gl_GlobalInvocationID.x;
  float x = floats[i];
  words[i] = bit(cm_is_nan(x), 0) | bit(cm_is_finite(x), 1) | bit(cm_is_within(x, 2.0), 2) | bit(cm_is_positive(x), 3) |
             bit(cm_is_finite(vec3(1.0, x, 1.0)), 4) | bit(cm_is_within(vec3(1.0, 1.0, x), 2.0), 5);
}
)";
  const gl::Object program = test::compute_program(gl_, text);
  std::vector<std::uint32_t> bits;
  for (const Sort& sort : sorts) bits.push_back(sort.bits);
  const gl::Object floats = gl::make_buffer(gl_, 4 * bits.size(), bits.data(), 0, "floats");
  const gl::Object out = gl::make_buffer(gl_, 4 * bits.size(), bits.data(), 0, "words");
  gl_->UseProgram(program.name());
  gl_->BindBufferBase(GL_SHADER_STORAGE_BUFFER, 0, floats.name());
  gl_->BindBufferBase(GL_SHADER_STORAGE_BUFFER, 1, out.name());
  gl_->DispatchCompute(static_cast<GLuint>(bits.size()), 1, 1);
  gl_->MemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
  std::vector<std::uint32_t> words(bits.size());
  gl_->GetNamedBufferSubData(out.name(), 0, static_cast<GLsizeiptr>(4 * words.size()), words.data());
  for (std::size_t i = 0; i < words.size(); ++i) {
    const std::uint32_t in_vectors = (sorts[i].finite ? 16U : 0U) | (sorts[i].small ? 32U : 0U);
    EXPECT_EQ(words[i], expected(sorts[i]) | in_vectors) << sorts[i].bits;
  }
}

}  // namespace
