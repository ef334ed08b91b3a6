#pragma once

// Suites that run in a context of each headless backend.

#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "headless.hpp"

namespace cumulet::test {

/// A context of its own; skipped where the backend has none.
class BackendTest : public testing::TestWithParam<headless::Backend> {
 protected:
  void SetUp() override {
    try {
      context_ = std::make_unique<headless::Context>(headless::Context::create(GetParam()));
    } catch (const std::exception& error) {
      GTEST_SKIP() << error.what();
    }
  }

  std::unique_ptr<headless::Context> context_;
};

inline std::string backend_name(const testing::TestParamInfo<headless::Backend>& info) {
  return info.param == headless::Backend::egl ? "egl" : "osmesa";
}

}  // namespace cumulet::test

/// Runs a suite of BackendTest on both.
#define CUMULET_ON_BACKENDS(suite)                                                                               \
  INSTANTIATE_TEST_SUITE_P(Gl, suite,                                                                            \
                           testing::Values(cumulet::headless::Backend::egl, cumulet::headless::Backend::osmesa), \
                           cumulet::test::backend_name)
