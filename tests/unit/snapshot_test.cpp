#include "scene/snapshot.hpp"

#include <gtest/gtest.h>

namespace {

using namespace cumulet::scene;

TEST(Snapshot, PartsChangeOnlyWithTheirValues) {
  Snapshot draft;
  const Snapshot before = draft;
  cumulet::light::DistantLights lights = *draft.lights;
  draft.lights.set(lights);  // equal value: no new version
  EXPECT_EQ(draft, before);
  lights.sky_radiance = glm::vec3(1.0F);
  draft.lights.set(lights);
  EXPECT_FALSE(draft.lights == before.lights);
  EXPECT_TRUE(draft.view == before.view);
  EXPECT_FALSE(draft == before);
  const Snapshot after = draft;
  EXPECT_EQ(after, draft);
  draft.lights.set(*before.lights);  // a new version, although with an earlier value
  EXPECT_FALSE(draft.lights == before.lights);
}

TEST(Snapshot, DoesNotChangeWithTheDraft) {
  Snapshot draft;
  draft.volumes.emplace_back().source = std::make_shared<const MarchSource>();
  const SnapshotPtr taken = std::make_shared<const Snapshot>(draft);
  Medium medium;
  medium.density_scale = 7.0;
  draft.volumes[0].medium.set(medium);
  EXPECT_EQ(taken->volumes[0].medium->density_scale, 1.0);
  EXPECT_EQ(taken->volumes[0].source, draft.volumes[0].source);
  EXPECT_FALSE(taken->volumes[0] == draft.volumes[0]);
}

}  // namespace
