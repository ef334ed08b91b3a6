#pragma once

#include "support/gl_viewer.hpp"
#include "support/volumes.hpp"

namespace cumulet::test {

/// A viewer that shows a small cloud with a grid refined down to its voxels.
class StillCloudTest : public StillTest {
 protected:
  void SetUp() override {
    StillTest::SetUp();
    if (IsSkipped()) return;
    still_->set_volume(noise_volume({24, 20, 22}, glm::ivec3(-3, 2, 5), 3));
    viewer().set_medium({0.3, glm::vec3(0.95F), {0.4F}, 0});
    still_->set_camera(camera_at({8.0, 12.0, 90.0}, {8.0, 12.0, 15.0}, 24.0));
  }
};

}  // namespace cumulet::test
