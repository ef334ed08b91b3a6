// Positions, rotations about three axes and scales of objects.

#include "transform_rows.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "clip_rows.hpp"

namespace {

using namespace cumulet::demo;

void expect_equal(const ObjectMatrix& a, const ObjectMatrix& b) {
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_NEAR(a[i], b[i], 1e-9) << i;
}

TEST(TransformRows, AnglesOfAMatrixAreFound) {
  for (const std::array<double, 3>& degrees : {std::array{0.0, 0.0, 0.0}, std::array{10.0, -20.0, 30.0},
                                               std::array{-170.0, 80.0, 100.0}, std::array{0.0, 45.0, 0.0}}) {
    const Stand stand{{1.0, 2.0, 3.0}, degrees, {2.0, 0.5, 3.0}};
    const auto found = stand_of(matrix_of(stand));
    ASSERT_TRUE(found);
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_NEAR(found->degrees[i], degrees[i], 1e-9);
      EXPECT_NEAR(found->scale[i], stand.scale[i], 1e-12);
      EXPECT_EQ(found->position[i], stand.position[i]);
    }
  }
}

TEST(TransformRows, RotationsAreAppliedAboutXThenYThenZ) {
  const ObjectMatrix matrix = matrix_of({{}, {90.0, 0.0, 90.0}, {1.0, 1.0, 1.0}});
  // X turns Y to Z, which Z leaves in place; Z turns X to Y.
  expect_equal(matrix, {0, 1, 0, 0, 0, 0, 1, 0, 1, 0, 0, 0, 0, 0, 0, 1});
}

TEST(TransformRows, UprightViewsOfTheYAxisKeepTheMatrix) {
  for (const double y : {90.0, -90.0}) {
    const ObjectMatrix matrix = matrix_of({{}, {20.0, y, 50.0}, {1.0, 1.0, 1.0}});
    const auto found = stand_of(matrix);
    ASSERT_TRUE(found) << "X and Z turn about one axis there";
    expect_equal(matrix_of(*found), matrix);
  }
}

TEST(TransformRows, OtherMatricesHaveNoAngles) {
  EXPECT_FALSE(stand_of({1, 0, 0, 0, 0.5, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1})) << "shear";
  EXPECT_FALSE(stand_of({-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1})) << "a mirror";
  EXPECT_FALSE(stand_of({1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1})) << "flat";
}

TEST(ClipTurns, WithTheUpAxis) {
  cumulet::settings::Clip clip;
  clip.box = {-1.0, -2.0, -3.0, 4.0, 5.0, 6.0};
  clip.planes = {{0.0, 1.0, 0.0, 2.0}, {1.0, 2.0, 3.0, 4.0}};
  const auto upright = turned(clip, UpAxis::z);
  EXPECT_EQ(*upright.box, (cumulet::settings::ClipBox{-1.0, -3.0, -5.0, 4.0, 6.0, 2.0}));
  EXPECT_EQ(upright.planes[0], (cumulet::settings::ClipPlane{0.0, 0.0, -1.0, 2.0}));
  EXPECT_EQ(upright.planes[1], (cumulet::settings::ClipPlane{1.0, 3.0, -2.0, 4.0}));
  EXPECT_EQ(turned(upright, UpAxis::y), clip);
}

}  // namespace
