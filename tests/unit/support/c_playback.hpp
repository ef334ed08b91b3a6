#pragma once

// A host whose volumes change with time.

#include <gtest/gtest.h>

#include <cstdint>
#include <mutex>
#include <string>
#include <vector>

#include "support/c_host.hpp"

namespace cumulet::test {

/// Collects the warnings that any thread logs.
struct Warnings {
  std::mutex mutex;
  std::vector<std::string> lines;
  static void add(void* user, cumulet_log_level level, const char* message) {
    auto& warnings = *static_cast<Warnings*>(user);
    const std::scoped_lock lock(warnings.mutex);
    if (level == CUMULET_LOG_WARNING) warnings.lines.emplace_back(message);
  }
};

/// Makes any number of viewers of one context, with two samples per pixel, and draws them into one target.
class CPlaybackTest : public testing::Test {
 protected:
  [[nodiscard]] ViewerPtr make(cumulet_build_device build = CUMULET_BUILD_CPU) {
    return make_viewer({.get_proc = headless::Context::get_proc,
                        .user = &context_,
                        .log = Warnings::add,
                        .log_user = &warnings_,
                        .samples = 2,
                        .build = build});
  }
  std::vector<std::uint8_t> picture(cumulet_viewer* of) { return drawn_once(of, target_); }

  Warnings warnings_;
  headless::Context context_ = headless::Context::create(headless::Backend::automatic);
  GladGLContext gl_ = load_gl(headless::Context::get_proc, &context_);
  HostTarget target_{gl_, 32, 32};
};

}  // namespace cumulet::test
