// A scene that several viewers show is posed once for all of them.
#include <gtest/gtest.h>

#include <atomic>

#include "assets/surface_asset.hpp"
#include "support/surfaces.hpp"

namespace {

using namespace cumulet;
using glm::vec3;
using viewer::SurfaceAsset;

/// Counts the calls of pose(). The time is the scene's height.
class CountedScene final : public test::StillScene {
 public:
  CountedScene() {
    add_quad({{{0, 0, 1}, {1, 0, 1}, {1, 0, 0}, {0, 0, 0}}}, add(test::diffuse(vec3(0.5F))));
    rest.cameras.emplace_back();
    rest.lights.resize(2);
  }
  [[nodiscard]] surface::Pose pose(double time, std::size_t animation,
                                   const cumulet::Progress* /*progress*/ = nullptr) const override {
    ++poses;
    surface::Pose posed = StillScene::pose(time, animation);
    if (animation != 0) return posed;
    for (surface::PosedVertex& v : posed.vertices) v.position.y = static_cast<float>(time);
    posed.low.y = posed.high.y = time;
    return posed;
  }
  mutable std::atomic<int> poses = 0;
};

TEST(SurfaceAsset, ViewersAtOneTimeShareThePose) {
  const auto scene = std::make_shared<const CountedScene>();
  const SurfaceAsset asset(scene, "counted");
  Progress progress;
  scene::ModelSourcePtr first = asset.posed({1.0, 0}, progress);
  EXPECT_EQ(first->pose.high.y, 1.0);
  EXPECT_EQ(asset.posed({1.0, 0}, progress), first);
  EXPECT_EQ(scene->poses, 1);
  const scene::ModelSourcePtr second = asset.posed({2.0, 0}, progress);
  EXPECT_NE(second, first);
  EXPECT_EQ(second->pose.high.y, 2.0);
  EXPECT_EQ(first->pose.high.y, 1.0);
  EXPECT_EQ(second->meshes.at(0).built_cost, first->meshes.at(0).built_cost);  // a refit
  EXPECT_EQ(scene->poses, 2);
}

TEST(SurfaceAsset, UnusedPosesAreFreed) {
  const auto scene = std::make_shared<const CountedScene>();
  const SurfaceAsset asset(scene, "counted");
  Progress progress;
  std::weak_ptr<const scene::ModelSource> watched = asset.posed({1.0, 0}, progress);
  EXPECT_TRUE(watched.expired());
  EXPECT_EQ(asset.posed({1.0, 0}, progress)->pose.high.y, 1.0);
  EXPECT_EQ(scene->poses, 2);
}

TEST(SurfaceAsset, ReportsTheRestPosesContents) {
  const auto scene = std::make_shared<const CountedScene>();
  const SurfaceAsset asset(scene, "counted");
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(asset.rest().lights, 2U);
    EXPECT_EQ(asset.rest().cameras, 1U);
    EXPECT_EQ(asset.rest().bounds.max, glm::dvec3(1, 0, 1));
  }
  EXPECT_EQ(scene->poses, 1);
}

TEST(SurfaceAsset, CancelledCallerMakesNoPose) {
  const auto scene = std::make_shared<const CountedScene>();
  const SurfaceAsset asset(scene, "counted");
  Progress progress;
  progress.cancel();
  EXPECT_THROW((void)asset.posed({1.0, 0}, progress), Error);
  EXPECT_EQ(scene->poses, 0);
}

}  // namespace
