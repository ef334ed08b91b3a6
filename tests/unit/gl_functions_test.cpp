// The functions that a host's get_proc lacks are refused by name when a viewer is attached.
#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cstdint>
#include <string>

#include "base/error.hpp"
#include "gl/api.hpp"
#include "support/backends.hpp"

namespace {

using cumulet::Error;
using cumulet::ErrorCode;
using cumulet::headless::Context;
namespace gl = cumulet::gl;

/// A get_proc that lacks one function.
struct Incomplete {
  Context* context;
  std::string lacks;
  std::intptr_t answer = 0;

  static void* get_proc(void* user, const char* name) {
    const auto& self = *static_cast<const Incomplete*>(user);
    return name == self.lacks ? std::bit_cast<void*>(self.answer) : Context::get_proc(self.context, name);
  }
};

// Windows drivers return these instead of a function.
constexpr std::array<std::intptr_t, 5> no_addresses = {0, 1, 2, 3, -1};

class GlFunctions : public cumulet::test::BackendTest {
 protected:
  void expect_refused(Incomplete incomplete, const std::string& text) {
    SCOPED_TRACE(incomplete.lacks);
    try {
      (void)gl::load_functions(Incomplete::get_proc, &incomplete);
      FAIL() << incomplete.answer << " was accepted";
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::unsupported);
      EXPECT_NE(std::string(error.what()).find(text), std::string::npos) << error.what();
    }
  }
};
CUMULET_ON_PROFILES(GlFunctions);

TEST_P(GlFunctions, EachFunctionThatTheLibraryCallsIsNeeded) {
  constexpr std::array names = {
#define CUMULET_GL_FUNCTION(NAME) "gl" #NAME,
#include "gl_functions.inc"
#undef CUMULET_GL_FUNCTION
  };
  EXPECT_GT(names.size(), 100U);
  for (const std::string name : names) {
    for (const std::intptr_t answer : no_addresses) {
      // The version is read first, and without it the context is unknown.
      expect_refused({context_.get(), name, answer}, name == "glGetString" ? "no OpenGL: get_proc" : name);
    }
  }
}

TEST_P(GlFunctions, LegacyFunctionsAreNeededInCompatibilityContexts) {
  if (GetParam().profile == cumulet::headless::Profile::core) GTEST_SKIP() << "a core context has none";
  for (const std::string name : {"glPixelTransferf", "glTexEnvf", "glGetTexEnvfv"}) {
    for (const std::intptr_t answer : no_addresses) expect_refused({context_.get(), name, answer}, name);
  }
}

TEST_P(GlFunctions, OtherFunctionsAreOptional) {
  Incomplete incomplete{context_.get(), "glMultiDrawArraysIndirect"};
  EXPECT_NE(gl::load_functions(Incomplete::get_proc, &incomplete), nullptr);
  for (const std::intptr_t answer : no_addresses) {
    incomplete = {context_.get(), "eglGetCurrentContext", answer};
    EXPECT_NE(gl::load_functions(Incomplete::get_proc, &incomplete), nullptr);
  }
}

}  // namespace
