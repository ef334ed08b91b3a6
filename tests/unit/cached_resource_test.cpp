#include "base/slot.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <stdexcept>
#include <string>

namespace {

using cumulet::Slot;
using Thing = std::unique_ptr<int>;

TEST(CachedResource, IsRebuiltWhenItsKeyChanges) {
  Slot<Thing, std::string> slot;
  EXPECT_FALSE(slot);
  EXPECT_EQ(slot.get(), nullptr);
  EXPECT_TRUE(slot.empty());
  EXPECT_TRUE(slot.wants("a", 1));
  slot.make("a", 1, [] { return std::make_unique<int>(7); });
  ASSERT_TRUE(slot);
  EXPECT_EQ(**slot, 7);
  EXPECT_EQ(slot.of(), "a");
  EXPECT_FALSE(slot.wants("a", 1));
  EXPECT_FALSE(slot.wants("a", 2));  // other settings alone do not cause a rebuild
  EXPECT_TRUE(slot.wants("b", 1));
}

TEST(CachedResource, FailureIsRetriedAfterAChange) {
  Slot<Thing, std::string> slot;
  slot.put("a", std::make_unique<int>(7));
  const auto fail = []() -> Thing { throw std::runtime_error("no memory"); };
  EXPECT_THROW(slot.make("b", 1, fail), std::runtime_error);
  EXPECT_EQ(slot.of(), "a");  // the previous value stays available
  EXPECT_FALSE(slot.wants("b", 1));
  EXPECT_TRUE(slot.wants("b", 2));
  EXPECT_TRUE(slot.wants("c", 1));
  EXPECT_FALSE(slot.wants("a", 1));
  slot.put("c", std::make_unique<int>(8));
  EXPECT_TRUE(slot.wants("b", 1));  // a new value clears the failure
}

TEST(CachedResource, TakeEmptiesAndClearForgetsFailures) {
  Slot<Thing, std::string> slot;
  EXPECT_FALSE(slot.take());
  slot.put("a", std::make_unique<int>(7));
  const auto taken = slot.take();
  ASSERT_TRUE(taken);
  EXPECT_EQ(**taken, 7);
  EXPECT_FALSE(slot);
  EXPECT_TRUE(slot.wants("a", 1));
  slot.fail("a", 1);
  EXPECT_FALSE(slot.empty());
  EXPECT_FALSE(slot.wants("a", 1));
  slot.clear();
  EXPECT_TRUE(slot.empty());
  EXPECT_TRUE(slot.wants("a", 1));
}

}  // namespace
