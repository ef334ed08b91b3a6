// The camera fit sees emission where it is visible with the settings of the medium.

#include "scene/emission_extent.hpp"

#include <gtest/gtest.h>

#include <array>
#include <glm/glm.hpp>
#include <vector>

#include "support/c_viewer.hpp"
#include "support/c_volumes.hpp"

namespace {

using cumulet::test::CViewerTest;
using cumulet::test::made_by;
using cumulet::test::make_desc;
using cumulet::test::VolumeRef;

constexpr int wide = 64;
constexpr int high = 32;

float ball(const glm::vec3& p, const glm::vec3& center, float radius) {
  return glm::distance(p, center) < radius ? 1.0F : 0.0F;
}

std::vector<float> values_of(float (*value)(const glm::vec3&)) {
  std::vector<float> values;
  for (int z = 0; z < high; ++z) {
    for (int y = 0; y < high; ++y) {
      for (int x = 0; x < wide; ++x) values.push_back(value({x, y, z}));
    }
  }
  return values;
}

// Smoke around x = 8, and haze. Air of 300 K fills the box, and is hot around x = 32. burns: there are flames around x
// = 48, and faint ones at x = 60.
VolumeRef make_volume(bool burns) {
  const std::array values{values_of([](const glm::vec3& p) {
                            return 1e-5F + ball(p, {8, 16, 16}, 5.0F);
                          }),
                          values_of([](const glm::vec3& p) {
                            return 0.2F + 0.8F * ball(p, {32, 16, 16}, 3.0F);
                          }),
                          values_of([](const glm::vec3& p) {
                            return ball(p, {48, 16, 16}, 3.0F) + 0.005F * ball(p, {60, 16, 16}, 3.0F);
                          })};
  std::array<cumulet_dense_desc, 3> descs{};
  std::array<cumulet_field, 3> fields{};
  for (std::size_t i = 0; i < values.size(); ++i) {
    descs.at(i) = make_desc<cumulet_dense_desc>();
    descs.at(i).values = values.at(i).data();
    descs.at(i).value_count = values.at(i).size();
    descs.at(i).size[0] = wide;
    descs.at(i).size[1] = descs.at(i).size[2] = high;
    for (int axis = 0; axis < 4; ++axis) descs.at(i).index_to_world[5 * axis] = 1.0;
    fields.at(i) = make_desc<cumulet_field>();
    fields.at(i).channel =
        std::array{CUMULET_CHANNEL_DENSITY, CUMULET_CHANNEL_TEMPERATURE, CUMULET_CHANNEL_FLAME}.at(i);
    fields.at(i).dense = &descs.at(i);
  }
  auto desc = make_desc<cumulet_volume_fields_desc>();
  desc.fields = fields.data();
  desc.field_count = burns ? 3 : 2;
  return made_by<VolumeRef>(cumulet_volume_from_fields, desc);
}

class CameraFit : public CViewerTest {
 protected:
  CameraFit() : CViewerTest(64, 64, 1) {}
  void SetUp() override {
    CViewerTest::SetUp();
    if (IsSkipped()) return;
    show(false);
  }
  void show(bool burns) {
    volume_ = make_volume(burns);
    ASSERT_EQ(cumulet_set_volume(v_, volume_.get()), CUMULET_OK);
  }
  // Returns the middle of the view along x, and its height. It is orthographic and looks along -Z.
  glm::dvec2 fitted(double density_scale, double blackbody) {
    auto medium = make_desc<cumulet_medium_desc>();
    medium.density_scale = density_scale;
    medium.blackbody = static_cast<float>(blackbody);
    EXPECT_EQ(cumulet_set_medium(v_, &medium), CUMULET_OK);
    cumulet_camera* camera = nullptr;
    EXPECT_EQ(cumulet_get_camera(v_, &camera), CUMULET_OK);
    auto pose = make_desc<cumulet_camera_desc>();
    pose.eye[2] = 100.0;
    pose.orthographic_height = 10.0;
    EXPECT_EQ(cumulet_camera_set(camera, &pose), CUMULET_OK);
    EXPECT_EQ(cumulet_frame_all(v_), CUMULET_OK) << cumulet_last_error(v_);
    EXPECT_EQ(cumulet_camera_get(camera, &pose), CUMULET_OK);
    cumulet_camera_release(camera);
    return {pose.target[0], pose.orthographic_height};
  }

  VolumeRef volume_;
};

TEST_P(CameraFit, SeesDensityAlone) {
  const glm::dvec2 smoke = fitted(3.0, 0.0);
  EXPECT_NEAR(smoke.x, 8.0, 0.5);
  EXPECT_NEAR(smoke.y, 11.0, 2.0) << "the temperature does not emit";
}

TEST_P(CameraFit, SeesWhatIsHotAndNotTheColdAirAroundIt) {
  const glm::dvec2 hot = fitted(3.0, 1.0);
  EXPECT_NEAR(hot.x, 0.5 * (3.0 + 35.0), 0.7);
  EXPECT_NEAR(hot.y, 35.0 - 3.0, 4.0);
}

TEST_P(CameraFit, SeesFlamesExceptFaintOnes) {
  show(true);
  EXPECT_NEAR(fitted(3.0, 0.0).x, 0.5 * (3.0 + 51.0), 0.7);
  // The density need not be visible.
  const glm::dvec2 alone = fitted(1e-9, 0.0);
  EXPECT_NEAR(alone.x, 48.0, 0.5);
  EXPECT_NEAR(alone.y, 6.0, 2.0);
}

TEST_P(CameraFit, TakesTheBoundsIfNothingIsVisible) {
  const glm::dvec2 bounds = fitted(1e-9, 0.0);
  EXPECT_NEAR(bounds.x, 31.5, 0.5) << "of the haze";
}

CUMULET_ON_BACKENDS(CameraFit);

TEST(EmittingPoints, OfNothing) {
  const cumulet::volume::CoarseVolume none;
  EXPECT_TRUE(cumulet::scene::emitting_points(none, none, {.blackbody = 1.0}).empty());
}

}  // namespace
