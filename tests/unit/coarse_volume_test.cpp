// Suggested density scales and visible bounds: the optical depth of a volume seen from outside.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <vector>

#include "volume/memory.hpp"
#include "volume/optical_depth.hpp"
#include "volume/volume.hpp"

namespace {

using cumulet::volume::ScalarVolume;

/// A cube of voxels with a density function of the position, from -1 to 1.
template <class Density>
ScalarVolume made_of(int side, const Density& density, const glm::dmat4& index_to_world = glm::dmat4(1.0)) {
  std::vector<float> values;
  for (int z = 0; z < side; ++z) {
    for (int y = 0; y < side; ++y) {
      for (int x = 0; x < side; ++x)
        values.push_back(density((glm::vec3(x, y, z) + 0.5F) * (2.0F / static_cast<float>(side)) - 1.0F));
    }
  }
  return cumulet::volume::import_dense({values, glm::ivec3(side), index_to_world}, "made", {});
}

float ball(glm::vec3 p) { return glm::length(p) < 0.9F ? 1.0F : 0.0F; }

double suggested(const ScalarVolume& volume) {
  return cumulet::volume::CoarseVolume(volume).suggest_density_scale().value_or(-1.0);
}

TEST(DensityScale, GivesABallAnOpticalDepthOfEight) {
  // The mean chord of a ball is 4/3 of its radius. That of a cube is 2/3 of its edge, more without grazing chords.
  EXPECT_NEAR(suggested(made_of(64, ball)), 8.0 / (4.0 / 3.0 * 0.9 * 32), 0.03 * 0.21);
  EXPECT_NEAR(suggested(made_of(60, [](glm::vec3) { return 0.25F; })), 8.0 / (0.25 * 40.0), 0.05 * 0.8);
  EXPECT_FALSE(
      cumulet::volume::CoarseVolume(made_of(8, [](glm::vec3) { return 0.0F; })).suggest_density_scale().has_value());
}

TEST(DensityScale, FollowsValuesAndSizesButNotRotation) {
  const double plain = suggested(made_of(64, ball));
  EXPECT_NEAR(suggested(made_of(64, [](glm::vec3 p) { return 1e-6F * ball(p); })), 1e6 * plain, 1e4 * plain);
  EXPECT_NEAR(suggested(made_of(64, [](glm::vec3 p) { return 1e20F * ball(p); })), 1e-20 * plain, 1e-22 * plain);
  EXPECT_NEAR(suggested(made_of(64, ball, glm::scale(glm::dmat4(1.0), glm::dvec3(0.01)))), 100 * plain, plain);
  EXPECT_NEAR(suggested(made_of(128, ball)), 0.5 * plain, 0.01 * plain);  // more voxels of the same edge length
  const auto slab = [](glm::vec3 p) { return std::abs(p.x) < 0.2F && glm::length(p) < 0.9F ? 1.0F : 0.0F; };
  const double straight = suggested(made_of(64, slab));
  for (const glm::dvec3 axis : {glm::dvec3(1, 2, 3), glm::dvec3(0, 0, 1), glm::dvec3(-1, 1, 0)}) {
    const auto turned = glm::rotate(glm::dmat4(1.0), 0.7, glm::normalize(axis));
    EXPECT_NEAR(suggested(made_of(64, slab, turned)), straight, 0.06 * straight);
  }
}

TEST(DensityScale, IgnoresHazeAndSpecks) {
  // A ball that fills a seventh of the projection of its bounds.
  const auto body = [](glm::vec3 p) { return glm::length(p) < 0.4F ? 1.0F : 0.0F; };
  const double plain = suggested(made_of(64, body));
  const auto haze = [&](glm::vec3 p) { return std::max(0.004F, body(p)); };
  EXPECT_NEAR(suggested(made_of(64, haze)), plain, 0.05 * plain);
  int n = 0;
  const auto specks = [&](glm::vec3 p) { return body(p) > 0.0F && ++n % 10000 == 0 ? 1e6F : body(p); };
  EXPECT_NEAR(suggested(made_of(64, specks)), plain, 0.05 * plain);
}

/// Bounding box in world space of the part that is visible along this direction.
std::array<glm::dvec3, 2> seen(const ScalarVolume& volume, const glm::dvec3& direction, double scale) {
  std::array<glm::dvec3, 2> box{glm::dvec3(1e30), glm::dvec3(-1e30)};
  for (const auto& p : cumulet::volume::CoarseVolume(volume).visible(direction, scale))
    box = {glm::min(box[0], p), glm::max(box[1], p)};
  return box;
}

TEST(VisibleBounds, ExcludeHazeAroundOpaqueContent) {
  const auto haze = [](glm::vec3 p) { return glm::length(p - glm::vec3(0.3F, 0, 0)) < 0.5F ? 1.0F : 1e-5F; };
  const auto turn = glm::rotate(glm::dmat4(1.0), 0.7, glm::normalize(glm::dvec3(1, 2, 3)));
  for (const glm::dmat4& to_world : {glm::dmat4(1.0), turn, glm::scale(turn, glm::dvec3(0.5))}) {
    const auto volume = made_of(64, haze, to_world);
    // Voxel i is centered on i: the ball extends from 25.1 to 57.1 in x, and from 15.5 to 47.5 in y and z.
    const glm::dvec3 centre(to_world * glm::dvec4(41.1, 31.5, 31.5, 1.0));
    const double voxel = glm::length(glm::dvec3(to_world[0]));
    for (const glm::dvec3& direction : {glm::dvec3(0, 0, 1), glm::dvec3(-1, 0, 0), glm::normalize(glm::dvec3(1, 1, 1)),
                                        glm::normalize(glm::dvec3(-0.3, 0.8, 0.1))}) {
      const auto points = cumulet::volume::CoarseVolume(volume).visible(direction, 1.0 / voxel);
      ASSERT_FALSE(points.empty());
      // Across and along the view direction, the extent is that of the ball within one voxel.
      const glm::dvec3 u = glm::normalize(glm::cross(direction, glm::dvec3(0.1, 0.2, 0.7)));
      for (const glm::dvec3& n : {u, -u, glm::cross(u, direction), direction, -direction}) {
        double reach = -1e30;
        for (const auto& p : points) reach = std::max(reach, glm::dot(p - centre, n));
        EXPECT_NEAR(reach, 16.0 * voxel, 1.3 * voxel);
      }
    }
  }
}

TEST(VisibleBounds, DependOnDensityScaleAndViewDirection) {
  const auto haze = [](glm::vec3 p) { return glm::length(p) < 0.5F ? 1.0F : 1e-5F; };
  const auto volume = made_of(64, haze);
  // With an opaque haze, everything is visible. In a very thin medium, nothing is.
  const auto [low, high] = seen(volume, {0, 0, 1}, 1e4);
  EXPECT_NEAR(low.x, -0.5, 1e-6);
  EXPECT_NEAR(high.y, 63.5, 1e-6);
  EXPECT_NEAR(low.z, -0.5, 1.0);
  const auto nothing = cumulet::volume::CoarseVolume(volume).visible({0, 0, 1}, 1e-9);
  EXPECT_TRUE(nothing.empty());
  EXPECT_TRUE(cumulet::volume::CoarseVolume(made_of(8, [](glm::vec3) { return 0.0F; })).visible({1, 0, 0}, 1).empty());
  // A thin sheet across x with a ball at its center. The sheet is opaque only seen edge-on.
  const auto sheet = [](glm::vec3 p) { return glm::length(p) < 0.3F ? 1.0F : (std::abs(p.x) < 0.05F ? 0.01F : 0.0F); };
  const auto flat = made_of(64, sheet);
  EXPECT_NEAR(seen(flat, {1, 0, 0}, 1.0)[1].y, 31.5 + 0.3 * 32, 1.5);
  EXPECT_NEAR(seen(flat, {0, 0, 1}, 1.0)[1].y, 63.5, 1.0);
}

TEST(CoarseVolume, ConservesTheMassOfBricksTilesAndBackground) {
  // Suggested scale (8 over the mean depth) for a mixture of brick, tile and background, compared with the same voxels.
  cumulet::volume::SparseVoxels voxels;
  const std::vector<std::int32_t> origins = {0, 0, 0};
  std::vector<float> values(512, 1.0F);
  values[0] = 3.0F;
  voxels.brick_origins = origins;
  voxels.brick_values = values;
  voxels.background = 1.0F;
  voxels.tiles = {{{{8, 0, 0}, {199, 199, 199}, 1.0F}, true}};
  const auto mixed = cumulet::volume::import_sparse(voxels, "mixed", {});
  const double all_one = 8.0 / (200.0 * 2.0 / 3.0);  // a cube of one value
  EXPECT_NEAR(suggested(mixed), all_one, 0.05 * all_one);
}

}  // namespace
