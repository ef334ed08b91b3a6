// The memory of a host's states of a dynamic volume is released once, and without a lock.

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <limits>
#include <mutex>
#include <thread>

#include "support/c_live_volume.hpp"

namespace {

using cumulet::test::alone;
using cumulet::test::CLiveVolume;
using cumulet::test::expect_same_fields;
using cumulet::test::fire;
using cumulet::test::LiveRef;
using cumulet::test::make_live;
using cumulet::test::newest;
using cumulet::test::odd;
using cumulet::test::refusal;
using cumulet::test::simulated;
using cumulet::test::small;
using cumulet::test::smoke;
using cumulet::test::State;

struct Releases {
  std::atomic<int> count = 0;
  static void add(void* user) {
    // Calls from inside the callback are rejected.
    EXPECT_EQ(cumulet_dynamic_volume_set(nullptr, nullptr, nullptr, 0), CUMULET_ERROR_INVALID_ARGUMENT);
    ++static_cast<Releases*>(user)->count;
  }
};

TEST_F(CLiveVolume, HostMemoryIsReleasedOnce) {
  const LiveRef live = make_live();
  Releases releases;
  const auto held = [&](const State& state) {
    auto desc = state.desc();
    desc.release = Releases::add;
    desc.release_user = &releases;
    return desc;
  };
  std::array<char, 256> error{};
  const State first = fire(odd, 0);
  const State second = fire(odd, 1);
  const cumulet_volume_fields_desc one = held(first);
  ASSERT_EQ(cumulet_dynamic_volume_set(live.get(), &one, error.data(), error.size()), CUMULET_OK) << error.data();
  EXPECT_EQ(releases.count, 0);
  const cumulet_volume_fields_desc two = held(second);
  ASSERT_EQ(cumulet_dynamic_volume_set(live.get(), &two, error.data(), error.size()), CUMULET_OK) << error.data();
  EXPECT_EQ(releases.count, 1);  // the first state was not read yet
  expect_same_fields(newest(live), alone(second));
  EXPECT_EQ(releases.count, 2);
  // Rejected in the call: the host keeps the memory.
  const State nothing;
  EXPECT_EQ(refusal(live, held(nothing), CUMULET_ERROR_INVALID_ARGUMENT),
            "smoke: has no density, temperature or flame");
  EXPECT_EQ(releases.count, 2);
  // Rejected when it is read: the last good state stays, and the memory is released.
  auto values = simulated(CUMULET_CHANNEL_DENSITY, odd, 2);
  values[State::at({22, 30, 16}, odd)] = std::numeric_limits<float>::quiet_NaN();
  State bad;
  bad.dense(CUMULET_CHANNEL_DENSITY, odd, values);
  const cumulet_volume_fields_desc three = held(bad);
  ASSERT_EQ(cumulet_dynamic_volume_set(live.get(), &three, error.data(), error.size()), CUMULET_OK);
  cumulet_volume* out = nullptr;
  EXPECT_EQ(cumulet_dynamic_volume_get_volume(live.get(), &out, error.data(), error.size()), CUMULET_ERROR_FILE);
  EXPECT_STREQ(error.data(), "smoke: density: its voxel (22, 30, 16) is not finite");
  EXPECT_EQ(releases.count, 3);
  expect_same_fields(newest(live), alone(second));
  // The library keeps no voxels of it.
  ASSERT_EQ(cumulet_dynamic_volume_set(live.get(), &two, error.data(), error.size()), CUMULET_OK);
  State bricks;
  bricks.sparse(CUMULET_CHANNEL_DENSITY, odd, simulated(CUMULET_CHANNEL_DENSITY, odd, 3), {{8, 8, 8}});
  EXPECT_EQ(refusal(live, bricks.desc(), CUMULET_ERROR_INVALID_ARGUMENT, cumulet_dynamic_volume_update),
            "smoke: density does not accept bricks: it was set with tiles or with a release function");
  EXPECT_EQ(releases.count, 3);
  cumulet_dynamic_volume_release(cumulet_dynamic_volume_retain(live.get()));
  EXPECT_EQ(releases.count, 3);
}

TEST_F(CLiveVolume, HostMemoryIsReleasedWithTheHandle) {
  Releases releases;
  const State state = smoke(small, 0);
  auto desc = state.desc();
  desc.release = Releases::add;
  desc.release_user = &releases;
  ASSERT_EQ(cumulet_dynamic_volume_set(make_live().get(), &desc, nullptr, 0), CUMULET_OK);
  EXPECT_EQ(releases.count, 1);
}

// The release callback is called without a lock of the library. The host holds a lock of its own in it, and while it
// asks for the newest state.
TEST_F(CLiveVolume, HostMemoryIsReleasedWithoutALock) {
  static std::recursive_mutex pool;
  const LiveRef live = make_live();
  const State state = smoke(small, 0);
  auto desc = state.desc();
  desc.release = [](void*) { const std::scoped_lock lock(pool); };
  std::atomic<bool> stop = false;
  const auto reads = [&](bool locks) {
    while (!stop) {
      std::unique_lock lock(pool, std::defer_lock);
      if (locks) lock.lock();
      cumulet_volume* out = nullptr;
      EXPECT_EQ(cumulet_dynamic_volume_get_volume(live.get(), &out, nullptr, 0), CUMULET_OK);
      cumulet_volume_release(out);
    }
  };
  std::thread first(reads, true);
  std::thread second(reads, false);
  for (int i = 0; i < 50; ++i) EXPECT_EQ(cumulet_dynamic_volume_set(live.get(), &desc, nullptr, 0), CUMULET_OK);
  stop = true;
  first.join();
  second.join();
}

}  // namespace
