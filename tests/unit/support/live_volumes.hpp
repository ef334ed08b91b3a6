#pragma once

// Makes volumes from dynamic volumes and from states, and compares them.

#include <gtest/gtest.h>

#include <array>

#include "support/c_host.hpp"
#include "support/simulated.hpp"
#include "support/volumes.hpp"
#include "viewer/c_handles.hpp"

namespace cumulet::test {

constexpr Sides small = {24, 24, 24};
constexpr Sides odd = {23, 31, 17};

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

/// Expects equal voxels of all fields, and equal transforms.
inline void expect_same_fields(const VolumeRef& a, const VolumeRef& b) {
  ASSERT_NE(a, nullptr);
  ASSERT_NE(b, nullptr);
  const auto& left = a->asset->frame();
  const auto& right = b->asset->frame();
  expect_same_voxels(left.density, right.density);
  const auto others = left.beside_density();
  ASSERT_EQ(others.size(), right.beside_density().size());
  for (std::size_t i = 0; i < others.size(); ++i) {
    SCOPED_TRACE(others[i]->name);
    expect_same_voxels(*others[i], *right.beside_density()[i]);
    EXPECT_EQ(others[i]->index_to_world, right.beside_density()[i]->index_to_world);
  }
}

}  // namespace cumulet::test
