// Views of the camera from frame to frame, and notifications of its changes, without GL.

#include "stage/camera_stage.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <optional>

#include "support/camera_poses.hpp"
#include "viewer/update_callback.hpp"

namespace {

using namespace cumulet;
using test::pose_at;
using viewer::Camera;
using viewer::CameraStage;
using viewer::Live;
using viewer::StageHost;
using viewer::UpdateCallback;

class CountingHost : public StageHost {
 public:
  void sync() override {}
  void touch() override { ++changes; }
  void notify() override { ++notified; }
  [[nodiscard]] bool is_displayed(const scene::SequenceFrame& /*frame*/, bool /*is_rendered*/) const override {
    return true;
  }
  void track(const std::shared_ptr<Live>& /*live*/) override {}

  int changes = 0;
  int notified = 0;
};

class CameraStageTest : public testing::Test {
 protected:
  CameraStageTest() { stage_.set_camera(camera_); }
  void frame(bool traces = true) {
    stage_.begin_frame({400, 200});
    stage_.set_view(std::nullopt);
    stage_.set_previous_view(std::nullopt);
    if (traces) stage_.note_traced();
  }

  CountingHost host_;
  std::shared_ptr<Camera> camera_ = std::make_shared<Camera>(pose_at({0, 0, 10}));
  CameraStage stage_{host_};
};

TEST_F(CameraStageTest, AFrameHasNoViewAtFirst) {
  EXPECT_FALSE(stage_.view());
  frame();
  ASSERT_TRUE(stage_.view());
  EXPECT_EQ(stage_.view()->eye, glm::dvec3(0, 0, 10));
  EXPECT_EQ(stage_.eye(), glm::dvec3(0, 0, 10));
  stage_.begin_frame({0, 0});
  EXPECT_FALSE(stage_.view());
  EXPECT_FALSE(stage_.eye());
}

TEST_F(CameraStageTest, RestsOnceTwoTracedFramesHaveTheSameView) {
  frame();
  EXPECT_FALSE(stage_.rests());
  frame();
  EXPECT_TRUE(stage_.rests());
  camera_->set(pose_at({0, 0, 5}));
  frame();
  EXPECT_FALSE(stage_.rests());
  frame(false);
  EXPECT_FALSE(stage_.rests());
  frame();
  EXPECT_TRUE(stage_.rests());
}

TEST_F(CameraStageTest, ThePreviousCameraHasAViewOfItsOwn) {
  frame();
  EXPECT_FALSE(stage_.previous_view());
  stage_.set_previous_camera(std::make_shared<Camera>(pose_at({0, 0, 20})), 0.5);
  frame();
  ASSERT_TRUE(stage_.previous_view());
  EXPECT_EQ(stage_.previous_view()->eye, glm::dvec3(0, 0, 20));
  EXPECT_EQ(stage_.previous_seconds(), 0.5);
  stage_.set_previous_camera(nullptr, 0.0);
  frame();
  EXPECT_FALSE(stage_.previous_view());
}

TEST_F(CameraStageTest, MovesOnlyWhileTheShutterIsOpen) {
  camera_->set_shutter(pose_at({-1, 0, 10}), pose_at({1, 0, 10}));
  frame();
  EXPECT_FALSE(stage_.view_ends());
  stage_.set_shutter(0.02);
  ASSERT_TRUE(stage_.view_ends());
  EXPECT_EQ(stage_.view_ends()->open.eye, glm::dvec3(-1, 0, 10));
  EXPECT_EQ(stage_.view_ends()->close.eye, glm::dvec3(1, 0, 10));
}

TEST_F(CameraStageTest, NotifiesOfTheCamerasThatItUses) {
  EXPECT_EQ(host_.changes, 1);
  camera_->set(pose_at({0, 0, 5}));
  EXPECT_EQ(host_.notified, 1);
  stage_.set_camera(std::make_shared<Camera>(pose_at({0, 0, 7})));
  EXPECT_EQ(host_.changes, 2);
  camera_->set(pose_at({0, 0, 6}));
  EXPECT_EQ(host_.notified, 1);
}

TEST(UpdateCallbackTest, CallsOnceUntilItIsReset) {
  int calls = 0;
  UpdateCallback callback([&] { ++calls; });
  callback.call();
  callback.call();
  EXPECT_EQ(calls, 1);
  callback.reset();
  callback.call();
  EXPECT_EQ(calls, 2);
}

TEST(UpdateCallbackTest, AHostMayHaveNone) {
  UpdateCallback callback(nullptr);
  callback.call();
  callback.reset();
  callback.call();
}

}  // namespace
