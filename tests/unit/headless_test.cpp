#include "headless.hpp"
#include "support/osmesa_leaks.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>

namespace {

using cumulet::headless::Backend;
using cumulet::headless::Context;
using cumulet::headless::Profile;

constexpr unsigned gl_version_enum = 0x1F02;
constexpr unsigned gl_major_version_enum = 0x821B;
constexpr unsigned gl_minor_version_enum = 0x821C;
constexpr unsigned gl_static_copy = 0x88E6;

template <class Function>
Function get(Context& context, const char* name) {
  return reinterpret_cast<Function>(Context::get_proc(&context, name));
}

/// Checks the reported version and that the driver computes: writes a buffer and reads it back.
void expect_works(Context& context) {
  const auto get_integer = get<void (*)(unsigned, int*)>(context, "glGetIntegerv");
  const auto get_string = get<const unsigned char* (*)(unsigned)>(context, "glGetString");
  const auto create_buffers = get<void (*)(int, unsigned*)>(context, "glCreateBuffers");
  const auto buffer_data = get<void (*)(unsigned, std::ptrdiff_t, const void*, unsigned)>(context, "glNamedBufferData");
  const auto get_sub_data =
      get<void (*)(unsigned, std::ptrdiff_t, std::ptrdiff_t, void*)>(context, "glGetNamedBufferSubData");
  const auto get_error = get<unsigned (*)()>(context, "glGetError");
  ASSERT_TRUE(get_integer && get_string && create_buffers && buffer_data && get_sub_data && get_error);
  EXPECT_NE(Context::get_proc(&context, "glDispatchCompute"), nullptr);
  EXPECT_NE(Context::get_proc(&context, "glBindImageTexture"), nullptr);

  int major = 0;
  int minor = 0;
  get_integer(gl_major_version_enum, &major);
  get_integer(gl_minor_version_enum, &minor);
  EXPECT_GE(10 * major + minor, 45);
  EXPECT_NE(get_string(gl_version_enum), nullptr);

  const int sent = 4711;
  int received = 0;
  unsigned buffer = 0;
  create_buffers(1, &buffer);
  buffer_data(buffer, sizeof sent, &sent, gl_static_copy);
  get_sub_data(buffer, 0, sizeof received, &received);
  EXPECT_EQ(received, sent);
  EXPECT_EQ(get_error(), 0u);
}

std::string creation_error(Backend backend) {
  try {
    const Context context = Context::create(backend);
    return "";
  } catch (const std::exception& error) {
    return error.what();
  }
}

TEST(Headless, EglGivesGl45) {
  Context context = Context::create(Backend::egl);
  EXPECT_EQ(std::string(context.name()).rfind("egl-", 0), 0u) << context.name();
  expect_works(context);
}

TEST(Headless, EglDebugContext) {
  Context context = Context::create(Backend::egl, true);
  expect_works(context);
}

TEST(Headless, EachBackendGivesACompatibilityContext) {
  constexpr unsigned profile_mask = 0x9126;
  for (const Backend backend : {Backend::egl, Backend::osmesa}) {
    for (const Profile profile : {Profile::core, Profile::compatibility}) {
      Context context = Context::create(backend, false, profile);
      const auto get_integer = reinterpret_cast<void (*)(unsigned, int*)>(Context::get_proc(&context, "glGetIntegerv"));
      ASSERT_NE(get_integer, nullptr);
      int mask = 0;
      get_integer(profile_mask, &mask);
      EXPECT_EQ(mask, profile == Profile::core ? 1 : 2) << context.name();
      expect_works(context);
    }
  }
}

TEST(Headless, OsMesaGivesGl45) {
  Context context = Context::create(Backend::osmesa);
  EXPECT_STREQ(context.name(), "osmesa");
  expect_works(context);
}

TEST(Headless, AutomaticPrefersEgl) {
  Context context = Context::create(Backend::automatic);
  EXPECT_EQ(std::string(context.name()).rfind("egl-", 0), 0u) << context.name();
}

TEST(Headless, BackendsInOneProcessOneAfterAnother) {
  for (const Backend backend : {Backend::egl, Backend::osmesa, Backend::egl, Backend::osmesa}) {
    Context context = Context::create(backend);
    expect_works(context);
  }
}

TEST(Headless, TwoContextsOfOneBackendAtOnce) {
  for (const Backend backend : {Backend::egl, Backend::osmesa}) {
    Context first = Context::create(backend);
    {
      Context second = Context::create(backend);
      expect_works(second);
      first.make_current();
      expect_works(first);
      second.make_current();
      expect_works(second);
    }
    // Destroying the second must not terminate the display of the first.
    first.make_current();
    expect_works(first);
  }
}

TEST(Headless, BothBackendsAtOnce) {
  Context egl = Context::create(Backend::egl);
  Context osmesa = Context::create(Backend::osmesa);
  expect_works(osmesa);
  egl.make_current();
  expect_works(egl);
  osmesa.make_current();
  expect_works(osmesa);
}

TEST(Headless, MovesKeepTheContext) {
  Context first = Context::create(Backend::egl);
  Context second = std::move(first);
  expect_works(second);
  EXPECT_EQ(Context::get_proc(&first, "glGetError"), nullptr);  // NOLINT: a moved-from context answers null
  second = Context::create(Backend::egl);
  second.make_current();
  expect_works(second);
}

TEST(Headless, AnotherThread) {
  std::thread([] {
    Context context = Context::create(Backend::egl);
    expect_works(context);
  }).join();
}

TEST(Headless, GetProcHandlesUnknownNames) {
  Context context = Context::create(Backend::egl);
  EXPECT_EQ(Context::get_proc(nullptr, "glGetError"), nullptr);
  EXPECT_EQ(Context::get_proc(&context, nullptr), nullptr);
}

// Each case runs in a process of its own, because Mesa reads its environment variables when a driver starts. The
// processes end with _Exit: at a normal exit a leak checker would report the driver's own leaks.
TEST(HeadlessDeathTest, MissingEglIsOneLine) {
  ::testing::FLAGS_gtest_death_test_style = "threadsafe";
  EXPECT_EXIT(
      {
        setenv("__EGL_VENDOR_LIBRARY_FILENAMES", "/nowhere.json", 1);  // glvnd: no drivers at all
        const std::string error = creation_error(Backend::egl);
        const bool good = error.find("EGL (") != std::string::npos && error.find('\n') == std::string::npos;
        if (!good) std::fprintf(stderr, "error: %s\n", error.c_str());
        std::_Exit(good ? 0 : 1);
      },
      ::testing::ExitedWithCode(0), "");
}

TEST(HeadlessDeathTest, AutomaticFallsBackToOsMesa) {
  ::testing::FLAGS_gtest_death_test_style = "threadsafe";
  EXPECT_EXIT(
      {
        setenv("__EGL_VENDOR_LIBRARY_FILENAMES", "/nowhere.json", 1);
        Context context = Context::create(Backend::automatic);
        expect_works(context);
        std::_Exit(std::string(context.name()) == "osmesa" && !::testing::Test::HasFailure() ? 0 : 1);
      },
      ::testing::ExitedWithCode(0), "");
}

TEST(HeadlessDeathTest, BothFailingNamesBoth) {
  ::testing::FLAGS_gtest_death_test_style = "threadsafe";
  EXPECT_EXIT(
      {
        setenv("__EGL_VENDOR_LIBRARY_FILENAMES", "/nowhere.json", 1);
        setenv("MESA_GL_VERSION_OVERRIDE", "3.3", 1);  // OSMesa then offers no 4.5
        const std::string error = creation_error(Backend::automatic);
        std::fprintf(stderr, "error: %s\n", error.c_str());
        const bool good = error.find("EGL (") != std::string::npos && error.find("OSMesa (") != std::string::npos &&
                          error.find('\n') == std::string::npos;
        std::_Exit(good ? 0 : 1);
      },
      ::testing::ExitedWithCode(0), "");
}

}  // namespace
