// The table of shader variants from which programs are made: cmake/embed_glsl.py.

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "base/error.hpp"
#include "gl/programs.hpp"
#include "gl/shader_sources.hpp"
#include "support/gl_state.hpp"

namespace {

using cumulet::Error;
using cumulet::ErrorCode;
namespace gl = cumulet::gl;
using Defines = std::vector<std::string>;

bool has(const char* shader, const Defines& defines) {
  const gl::Shader* found = gl::find_shader(shader);
  return found != nullptr && found->has_variant(defines);
}

TEST(Shaders, ListTheirVariants) {
  EXPECT_TRUE(has("trace.comp", {"CM_MARCH 0", "CM_LINEAR 1", "CM_PAGES 6"}));
  EXPECT_TRUE(has("trace.comp", {"CM_AOVS 1", "CM_MARCH 2", "CM_LINEAR 0", "CM_LAYERS 1", "CM_PAGES 1"}));
  EXPECT_TRUE(has("trace_travel.comp", {"CM_MARCH 2", "CM_LINEAR 0", "CM_SURFACES 2", "CM_PAGES 1"}));
  EXPECT_TRUE(has("sign.comp", {}));
  EXPECT_FALSE(has("trace.comp", {})) << "it needs its march";
  EXPECT_TRUE(has("trace.comp", {"CM_MARCH 1", "CM_LINEAR 1", "CM_PAGES 1"})) << "voxels with interpolation";
  EXPECT_FALSE(has("trace.comp", {"CM_MARCH 0", "CM_LINEAR 1", "CM_PAGES 7"}));
  EXPECT_FALSE(has("trace.comp", {"CM_MARCH 0", "CM_LINEAR 1", "CM_PAGES 1", "CM_LAYERS 2"}));
  EXPECT_FALSE(has("trace.comp", {"CM_MARCH 0", "CM_LINEAR 1", "CM_PAGES 1", "CM_CHUNK 4"}));
  EXPECT_FALSE(has("trace.comp", {"CM_MARCH 0", "CM_LINEAR 1", "CM_LINEAR 1"})) << "CM_PAGES is missing";
  EXPECT_FALSE(has("sign.comp", {"CM_MARCH 0"}));
  EXPECT_EQ(gl::find_shader("nothing.comp"), nullptr);
}

TEST(Shaders, DefineTheirMacrosAfterTheVersion) {
  const gl::Shader* shader = gl::find_shader("host_depth.comp");
  ASSERT_NE(shader, nullptr);
  const std::string text = shader->with(Defines{"CM_MULTISAMPLE 1"});
  EXPECT_EQ(text.substr(0, text.find("\n//")), "#version 450\n#define CM_MULTISAMPLE 1");
}

class Programs : public cumulet::test::GlTest {};
CUMULET_ON_BACKENDS(Programs);

TEST_P(Programs, ExistOnlyForListedVariants) {
  gl::Programs programs(*gl_, nullptr);
  EXPECT_NE(programs.get({"host_depth.comp", {"CM_MULTISAMPLE 1"}}).name(), 0U);
  try {
    programs.get({"host_depth.comp", {"CM_MULTISAMPLE 1", "CM_NEW 1"}});
    FAIL() << "a variant that nobody validated";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::internal);
    EXPECT_STREQ(error.what(), "host_depth.comp has no variant with [CM_MULTISAMPLE 1, CM_NEW 1]");
  }
}

}  // namespace
