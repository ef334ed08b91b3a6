#pragma once

// The fixture of tests of dynamic volumes through the C API.

#include <cumulet/cumulet.h>
#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "support/c_playback.hpp"
#include "support/live_volumes.hpp"
#include "support/simulated.hpp"

namespace cumulet::test {

/// A function that passes a state.
using HandOver = cumulet_status (*)(cumulet_dynamic_volume*, const cumulet_volume_fields_desc*, char*, std::size_t);

/// Passes a state.
inline void hand_over(const LiveRef& live, const State& state, HandOver how = cumulet_dynamic_volume_set) {
  std::array<char, 256> error{};
  const cumulet_volume_fields_desc desc = state.desc();
  ASSERT_EQ(how(live.get(), &desc, error.data(), error.size()), CUMULET_OK) << error.data();
}

/// Passes a state that must be rejected. Returns the error.
inline std::string refusal(const LiveRef& live, const cumulet_volume_fields_desc& desc, cumulet_status status,
                           HandOver how = cumulet_dynamic_volume_set) {
  std::array<char, 256> error{};
  EXPECT_EQ(how(live.get(), &desc, error.data(), error.size()), status);
  return error.data();
}

/// A state with all channels.
inline State fire(const Sides& size, int step) {
  State state;
  for (const auto channel :
       {CUMULET_CHANNEL_DENSITY, CUMULET_CHANNEL_TEMPERATURE, CUMULET_CHANNEL_FLAME, CUMULET_CHANNEL_RED,
        CUMULET_CHANNEL_GREEN, CUMULET_CHANNEL_BLUE, CUMULET_CHANNEL_ANISOTROPY, CUMULET_CHANNEL_VELOCITY_X,
        CUMULET_CHANNEL_VELOCITY_Y, CUMULET_CHANNEL_VELOCITY_Z})
    state.dense(channel, size, step);
  return state;
}

/// A state with density.
inline State smoke(const Sides& size, int step) {
  return std::move(State().dense(CUMULET_CHANNEL_DENSITY, size, step));
}

/// A host that shows dynamic volumes.
class CLiveVolume : public CPlaybackTest {
 protected:
  // The image of a new viewer that shows only this state.
  std::vector<std::uint8_t> picture_alone(const State& state) {
    const ViewerPtr viewer = make();
    return picture_of(viewer.get(), alone(state).get(), target_);
  }
  static cumulet_dynamic_volume_info info_of(const ViewerPtr& viewer) {
    auto info = make_desc<cumulet_dynamic_volume_info>();
    EXPECT_EQ(cumulet_get_dynamic_volume_info(viewer.get(), &info), CUMULET_OK) << cumulet_last_error(viewer.get());
    return info;
  }
  // Renders until this state is displayed. Returns the displayed states in order.
  std::vector<std::uint64_t> show(const ViewerPtr& viewer, std::uint64_t state) {
    const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    const auto frame = target_.frame();
    std::vector<std::uint64_t> seen;
    while (info_of(viewer).displayed_update != state) {
      EXPECT_EQ(cumulet_render(viewer.get(), &frame, nullptr), CUMULET_OK) << cumulet_last_error(viewer.get());
      const std::uint64_t drawn = info_of(viewer).displayed_update;
      if (seen.empty() || seen.back() != drawn) seen.push_back(drawn);
      if (std::chrono::steady_clock::now() > until) {
        ADD_FAILURE() << "state " << state << " is never seen";
        break;
      }
    }
    return seen;
  }
};

}  // namespace cumulet::test
