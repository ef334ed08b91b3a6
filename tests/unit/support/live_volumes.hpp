#pragma once

// Volumes of live ones.

#include <gtest/gtest.h>

#include <array>

#include "support/c_host.hpp"
#include "support/simulated.hpp"

namespace cumulet::test {

/// Of a state by itself.
inline VolumeRef alone(const State& state) {
  std::array<char, 256> error{};
  cumulet_volume* out = nullptr;
  const cumulet_state_desc desc = state.desc();
  EXPECT_EQ(cumulet_volume_from_state(&desc, &out, error.data(), error.size()), CUMULET_OK) << error.data();
  return VolumeRef(out);
}

/// Of the newest state.
inline VolumeRef newest(const LiveRef& live) {
  std::array<char, 256> error{};
  cumulet_volume* out = nullptr;
  EXPECT_EQ(cumulet_live_get_volume(live.get(), &out, error.data(), error.size()), CUMULET_OK) << error.data();
  return VolumeRef(out);
}

}  // namespace cumulet::test
