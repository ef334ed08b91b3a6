#pragma once

// A viewer of the C API in a context without a window.

#include <gtest/gtest.h>

#include <string>

#include "support/c_host.hpp"

namespace cumulet::test {

class CApi : public testing::Test {
 protected:
  void SetUp() override {
    auto desc = make_desc<cumulet_create_desc>();
    desc.get_proc = headless::Context::get_proc;
    desc.get_proc_user = &context_;
    ASSERT_EQ(cumulet_create(&desc, &viewer_, nullptr, 0), CUMULET_OK);
  }
  void TearDown() override { cumulet_destroy(viewer_); }

  [[nodiscard]] std::string error() const { return cumulet_last_error(viewer_); }

  headless::Context context_ = headless::Context::create(headless::Backend::automatic);
  cumulet_viewer* viewer_ = nullptr;
};

}  // namespace cumulet::test
