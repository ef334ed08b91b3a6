#pragma once

#include <glm/glm.hpp>
#include <optional>
#include <utility>

#include "support/gl_viewer.hpp"

namespace cumulet::test {

/// Images of a medium whose scattering differs per color channel, or of a medium that only absorbs.
class CloudTest : public StillTest {
 protected:
  void SetUp() override {
    StillTest::SetUp();
    if (IsSkipped()) return;
    medium_.density_scale = 0.15;
    medium_.albedo = {0.95F, 0.8F, 0.5F};
    medium_.phase.anisotropy = 0.4F;
    still_->set_medium(medium_);
  }
  void show(volume::ScalarVolume density, std::optional<volume::ScalarVolume> flame = {}) {
    volume::VolumeFrame frame{.density = std::move(density)};
    frame.flame = std::move(flame);
    still_->set_volume(std::move(frame));
  }
  /// Uses an absorbing medium under a sky of radiance 1, so that images show the transmittance.
  void only_absorb(double density_scale) {
    medium_ = {};
    medium_.albedo = glm::vec3(0.0F);
    medium_.density_scale = density_scale;
    still_->set_medium(medium_);
    still_->set_light({0.0F, 0.0F, glm::vec3(0.0F), glm::vec3(1.0F)});
  }

  viewer::Medium medium_;
};

}  // namespace cumulet::test
