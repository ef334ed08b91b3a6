#pragma once

// Makes volumes from dynamic volumes and from states.

#include <gtest/gtest.h>

#include <array>

#include "support/c_host.hpp"
#include "support/simulated.hpp"

namespace cumulet::test {

/// Makes a volume from one state, without a dynamic volume.
inline VolumeRef alone(const State& state) {
  std::array<char, 256> error{};
  cumulet_volume* out = nullptr;
  const cumulet_volume_fields_desc desc = state.desc();
  EXPECT_EQ(cumulet_volume_from_fields(&desc, &out, error.data(), error.size()), CUMULET_OK) << error.data();
  return VolumeRef(out);
}

/// Returns the volume of the newest state.
inline VolumeRef newest(const LiveRef& live) {
  std::array<char, 256> error{};
  cumulet_volume* out = nullptr;
  EXPECT_EQ(cumulet_dynamic_volume_get_volume(live.get(), &out, error.data(), error.size()), CUMULET_OK)
      << error.data();
  return VolumeRef(out);
}

}  // namespace cumulet::test
