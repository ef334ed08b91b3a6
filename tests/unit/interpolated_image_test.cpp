// Images of volumes with linear interpolation between voxels, compared with closed forms, for every grid type.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "support/gl_viewer.hpp"
#include "support/interpolated.hpp"
#include "support/marches.hpp"
#include "support/osmesa_leaks.hpp"
#include "support/volumes.hpp"

namespace {

using namespace cumulet;
using glm::dvec3;
using glm::ivec3;
using glm::vec3;

class InterpolatedImage : public test::ViewerTest {};
CUMULET_ON_BACKENDS(InterpolatedImage);

viewer::GridSettings between(const test::MarchKind& kind) {
  viewer::GridSettings settings = test::settings_of(kind);
  settings.build.interpolation = grid::Interpolation::linear;
  return settings;
}

/// In which the finest cells have the interpolated field itself.
constexpr test::MarchKind trilinear{render::March::tet, grid::CellKind::trilinear};

/// A camera that looks along -z at a point of the plane z = 0, at so small an angle that its rays are alike.
viewer::CameraPose along_z(double x, double y) { return test::camera_at({x, y, 400.0}, {x, y, 0.0}, 0.001); }

// A slab of n voxels whose values rise along the ray has the optical depth of the sum of its voxels.
TEST_P(InterpolatedImage, OpacityMatchesTheOpticalDepth) {
  const auto viewer = make();
  viewer->set_volume(test::make_volume({64, 64, 7}, ivec3(0), [](const ivec3& p) { return 0.25F * float(1 + p.z); }));
  viewer->set_light({0.0F, 0.0F, vec3(0.0F), vec3(1.0F)});
  viewer->set_medium({0.2, vec3(0.0F), {}});
  const double through = std::exp(-0.2 * 0.25 * 28.0);
  for (const test::MarchKind& kind : {trilinear, test::march_kinds[0], test::march_kinds[2], test::march_kinds[3]}) {
    viewer->set_grid(between(kind));
    viewer->set_camera(along_z(30.3, 31.8));
    const test::Picture seen = test::render(*viewer, {8, 8, 1, 1, render::View::density});
    EXPECT_NEAR(seen.mean().w, 1.0 - through, 2e-3);
    const test::Picture picture = test::render(*viewer, {16, 16, 64, 1, render::View::shaded});
    EXPECT_NEAR(picture.mean().x, through, 4.0 * std::sqrt(through * (1.0 - through) / (256.0 * 64.0)));
  }
}

// A single voxel is a pyramid around its center: the integral along a ray through it is that of a tent.
TEST_P(InterpolatedImage, AVoxelFallsToZeroOverAVoxel) {
  const auto viewer = make();
  viewer->set_volume(test::make_volume({1, 1, 1}, ivec3(7, 8, 15), [](const ivec3&) { return 1.0F; }));
  viewer->set_medium({1.0, vec3(0.0F), {}});
  for (const test::MarchKind& kind : {trilinear, test::march_kinds[2], test::march_kinds[3]}) {
    viewer->set_grid(between(kind));
    for (const double x : {6.1, 6.5, 7.0, 7.75}) {
      for (const double y : {7.5, 8.0, 8.9}) {
        viewer->set_camera(along_z(x, y));
        const double depth = (1.0 - std::abs(x - 7.0)) * (1.0 - std::abs(y - 8.0));
        const test::Picture seen = test::render(*viewer, {4, 4, 1, 1, render::View::density});
        // Pixels beside the axis see less where the pyramid has its edges.
        EXPECT_NEAR(seen.mean().w, 1.0 - std::exp(-depth), 2e-3) << x << " " << y;
      }
    }
  }
}

TEST_P(InterpolatedImage, EmissionMatchesItsIntegral) {
  volume::VolumeFrame frame{.density = test::make_volume({8, 8, 8}, ivec3(0), [](const ivec3&) { return 0.0F; })};
  frame.flame = test::make_volume({9, 9, 9}, ivec3(0), [](const ivec3& p) { return 0.1F * float(p.x + p.y * p.z); });
  const volume::ScalarVolume flame = *frame.flame;
  const auto viewer = make();
  viewer->set_volume(std::move(frame));
  viewer->set_light({0.0F, 0.0F, vec3(0.0F), vec3(0.0F)});
  viewer::Medium medium;
  medium.field_emission.flame_strength = 1.0;
  medium.field_emission.flame_color = {1.0F, 0.5F, 0.0F};
  viewer->set_medium(medium);
  for (const dvec3& at : {dvec3(3.4, 4.9, 0.0), dvec3(-0.4, 7.2, 0.0), dvec3(8.5, 3.5, 0.0)}) {
    double expected = 0.0;
    for (int i = 0; i < 20000; ++i)
      expected += 11.0 / 20000.0 * test::value_between(flame, {at.x, at.y, -1.0 + 11.0 * (i + 0.5) / 20000.0});
    for (const test::MarchKind& kind : {test::march_kinds[2], test::march_kinds[3]}) {
      viewer->set_grid(between(kind));
      viewer->set_camera(along_z(at.x, at.y));
      const test::Picture picture = test::render(*viewer, {4, 4, 4, 1, render::View::shaded});
      EXPECT_NEAR(picture.mean().x, expected, 2e-3 * expected + 2e-3);
      EXPECT_NEAR(picture.mean().y, 0.5 * expected, 2e-3 * expected + 2e-3);
    }
  }
}

// Scattering is interpolated, and divided by the density: a border has the color of its voxels.
TEST_P(InterpolatedImage, ColorsAreWeightedByDensity) {
  const auto constant = [](float value) {
    return test::make_volume({64, 64, 8}, ivec3(0), [=](const ivec3&) { return value; });
  };
  volume::VolumeFrame frame{.density = constant(1.0F)};
  frame.color.emplace(std::array{constant(0.8F), constant(0.4F), constant(0.2F)});
  const auto viewer = make();
  viewer->set_volume(std::move(frame));
  viewer->set_light({0.0F, 0.0F, vec3(0.0F), vec3(1.0F)});
  viewer->set_camera(along_z(30.0, 31.0));
  viewer::Medium medium;
  medium.density_scale = 0.05;
  medium.max_bounces = 1;
  viewer->set_medium(medium);
  for (const test::MarchKind& kind : {trilinear, test::march_kinds[0], test::march_kinds[2], test::march_kinds[3]}) {
    viewer->set_grid(between(kind));
    const test::Picture picture = test::render(*viewer, {16, 16, 256, 1, render::View::shaded});
    const glm::dvec4 mean = picture.mean();
    const double through = std::exp(-0.05 * 8.0);
    // One event, and from there the sky in all directions that do not scatter again: proportional to the color.
    const double red = mean.x - through;
    EXPECT_NEAR((mean.y - through) / red, 0.5, 0.05);
    EXPECT_NEAR((mean.z - through) / red, 0.25, 0.05);
  }
}

// Linear fits differ at the faces of cells, the interpolated field does not: trilinear cells are as exact as bricks.
TEST_P(InterpolatedImage, TrilinearCellsShowWhatBricksShow) {
  const auto viewer = make();
  viewer->set_volume(test::noise_volume({20, 18, 22}, ivec3(0), 5));
  viewer->set_medium({0.03, vec3(0.0F), {}});  // the rays stay far from opaque
  viewer->set_camera(test::camera_at({10.3, 8.1, 60.0}, {10.3, 8.1, 10.0}, 5.0));
  const auto opacities = [&](const test::MarchKind& kind, viewer::BuildOn on) {
    viewer::GridSettings settings = between(kind);
    settings.build.on = on;
    viewer->set_grid(settings);
    return test::render(*viewer, {32, 32, 1, 1, render::View::density}).pixels;
  };
  const auto expected = opacities(test::march_kinds[3], viewer::BuildOn::cpu);
  const auto farthest = [&](const std::vector<glm::vec4>& pixels) {
    float most = 0.0F;
    for (std::size_t i = 0; i < pixels.size(); ++i) most = std::max(most, std::abs(pixels[i].w - expected[i].w));
    return most;
  };
  EXPECT_GT(farthest(opacities(test::march_kinds[0], viewer::BuildOn::cpu)), 1e-3F);
  EXPECT_LT(farthest(opacities(trilinear, viewer::BuildOn::cpu)), 1e-4F);
  EXPECT_LT(farthest(opacities(trilinear, viewer::BuildOn::gpu)), 1e-4F);
}

TEST_P(InterpolatedImage, ChangesWithTheSetting) {
  const auto viewer = make();
  viewer->set_volume(test::noise_volume({20, 18, 22}, ivec3(0), 5));
  viewer->set_light({40.0F, 25.0F, vec3(3.0F), vec3(0.3F)});
  viewer->set_camera(test::camera_at({60.0, 30.0, 70.0}, {9.5, 8.5, 10.5}, 14.0));
  for (const test::MarchKind& kind : test::march_kinds) {
    const test::Image image{24, 24, 4, 1, render::View::shaded};
    viewer->set_grid(test::settings_of(kind));
    const test::Picture nearest = test::render(*viewer, image);
    viewer->set_grid(between(kind));
    const test::Picture linear = test::render(*viewer, image);
    viewer->set_grid(test::settings_of(kind));
    EXPECT_EQ(test::render(*viewer, image).pixels, nearest.pixels);
    EXPECT_NE(linear.pixels, nearest.pixels);
  }
}

}  // namespace
