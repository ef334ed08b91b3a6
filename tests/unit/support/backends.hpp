#pragma once

// Base class for suites that run in a context of each headless backend.

#include <gtest/gtest.h>

#include <memory>
#include <ostream>
#include <string>

#include "headless.hpp"

namespace cumulet::test {

/// A backend and the profile of its context.
struct Door {
  headless::Backend backend = headless::Backend::automatic;
  headless::Profile profile = headless::Profile::core;

  friend bool operator==(const Door& door, headless::Backend other) { return door.backend == other; }
};

inline std::string name_of(const Door& door) {
  return std::string(door.backend == headless::Backend::egl ? "egl" : "osmesa") +
         (door.profile == headless::Profile::core ? "" : "_compatibility");
}

inline void PrintTo(const Door& door, std::ostream* out) { *out << name_of(door); }

/// Creates one context per test. The test is skipped if the backend is not available.
class BackendTest : public testing::TestWithParam<Door> {
 protected:
  void SetUp() override {
    try {
      context_ =
          std::make_unique<headless::Context>(headless::Context::create(GetParam().backend, false, GetParam().profile));
    } catch (const std::exception& error) {
      GTEST_SKIP() << error.what();
    }
  }

  std::unique_ptr<headless::Context> context_;
};

inline std::string backend_name(const testing::TestParamInfo<Door>& info) { return name_of(info.param); }

}  // namespace cumulet::test

/// Runs a suite of BackendTest on EGL and OSMesa.
#define CUMULET_ON_BACKENDS(suite)                                                                   \
  INSTANTIATE_TEST_SUITE_P(Gl, suite,                                                                \
                           testing::Values(cumulet::test::Door{cumulet::headless::Backend::egl},     \
                                           cumulet::test::Door{cumulet::headless::Backend::osmesa}), \
                           cumulet::test::backend_name)
/// Runs the suite in a core and in a compatibility profile context of each backend.
#define CUMULET_ON_PROFILES(suite)                                                                             \
  CUMULET_ON_BACKENDS(suite);                                                                                  \
  INSTANTIATE_TEST_SUITE_P(                                                                                    \
      GlCompatibility, suite,                                                                                  \
      testing::Values(                                                                                         \
          cumulet::test::Door{cumulet::headless::Backend::egl, cumulet::headless::Profile::compatibility},     \
          cumulet::test::Door{cumulet::headless::Backend::osmesa, cumulet::headless::Profile::compatibility}), \
      cumulet::test::backend_name)
