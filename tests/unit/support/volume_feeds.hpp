#pragma once

// Settings and context of feeds of volumes.

#include <gtest/gtest.h>

#include <atomic>
#include <cstdint>

#include "stage/volume_feed.hpp"
#include "support/clip.hpp"

namespace cumulet::test {

inline constexpr std::uint64_t plenty = std::uint64_t{1} << 32U;

inline viewer::BuildSettings settings_of_scale(double density_scale) {
  viewer::BuildSettings settings;
  settings.refine.density_scale = density_scale;
  return settings;
}

class Feeds : public testing::Test {
 protected:
  [[nodiscard]] viewer::FeedContext context() {
    return {++last_feed_, last_taken_, [this] { ++notified_; }};
  }

  std::atomic<int> notified_ = 0;
  std::uint64_t last_feed_ = 0;
  std::uint64_t last_taken_ = 0;
};

}  // namespace cumulet::test
