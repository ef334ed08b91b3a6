// Velocities of volumes: cell data compared with sums over voxels, and AOVs compared with closed forms.

#include <gtest/gtest.h>

#include <cmath>
#include <glm/gtc/matrix_transform.hpp>

#include "assets/instance.hpp"
#include "grid/cell.hpp"
#include "grid/grid_builder.hpp"
#include "jobs/builder.hpp"
#include "scene/channels.hpp"
#include "support/folder.hpp"
#include "support/gl_viewer.hpp"
#include "support/marches.hpp"
#include "support/osmesa_leaks.hpp"
#include "support/surfaces.hpp"
#include "support/vdb_files.hpp"
#include "support/volumes.hpp"

namespace {

using namespace cumulet;
using glm::dmat3;
using glm::dmat4;
using glm::dvec3;
using glm::ivec3;
using glm::vec2;
using glm::vec3;
using volume::ScalarVolume;
using volume::VolumeFrame;

// Velocities from a function, along the file's axes.
template <class Function>
volume::Velocity velocity(const ivec3& size, const ivec3& low, Function of) {
  volume::Velocity made;
  for (int axis = 0; axis < 3; ++axis) {
    for (const float sign : {1.0F, -1.0F}) {
      made.parts[2 * static_cast<std::size_t>(axis) + (sign > 0.0F ? 0 : 1)] =
          test::make_volume(size, low, [=](const ivec3& p) { return std::max(sign * of(p)[axis], 0.0F); });
    }
  }
  return made;
}

grid::TetGrid cells_of(const VolumeFrame& frame, const grid::Cube& cube, const volume::Ramp& ramp = {}) {
  const ScalarVolume density = ramp.empty() ? frame.density : volume::apply(ramp, frame.density, nullptr);
  const grid::Statistics statistics(density, cube);
  grid::Channels channels;
  if (auto momentum = scene::momentum_of(frame, ramp))
    channels.momentum = std::make_shared<const grid::MomentumField>(*std::move(momentum), cube);
  grid::RefineSettings settings;
  settings.threshold = 0.3;
  const grid::DiamondSet diamonds(statistics, channels, settings);
  grid::GridBuilder builder(statistics, diamonds);
  builder.bisect();
  return builder.records(settings.cells, density.max_value, channels);
}

// Compared with sums over the sixths of voxels that make up a cell.
TEST(Velocity, CellVelocityIsTheDensityWeightedMean) {
  constexpr int size = 16;
  // A part of it has a density that is tiny beside the rest.
  const ScalarVolume noise = test::noise_volume(ivec3(size), ivec3(0), 5);
  VolumeFrame frame{.density = test::make_volume(ivec3(size), ivec3(0), [&](const ivec3& p) {
                      return (p.x % 3 == 0 ? 1e-6F : 1.0F) * test::value_at(noise, p);
                    })};
  const grid::Cube cube = grid::fit_cube(frame.density);
  EXPECT_FALSE(scene::momentum_of(frame));
  EXPECT_TRUE(cells_of(frame, cube).channels.velocity.empty());
  const auto of = [](const ivec3& p) {
    return vec3(p.x < 5 ? -900.0F : 3.0F, static_cast<float>(p.y - p.z), p.z < 9 ? 20.0F : 0.0F);
  };
  frame.velocity = velocity(ivec3(size), ivec3(0), of);
  frame.velocity->to_index = dmat3(0.0, 2.0, 0.0, 0.5, 0.0, 0.25, 0.0, 0.0, -1.0);
  const volume::Ramp ramp({{0.0F, 0.0F}, {0.5F, 0.1F}, {1.0F, 1.0F}});
  for (const bool ramped : {false, true}) {
    const grid::TetGrid made = cells_of(frame, cube, ramped ? ramp : volume::Ramp());
    ASSERT_EQ(made.channels.velocity.size(), made.cells.size());
    EXPECT_GT(made.cells.size(), 100U);
    std::vector<double> mass(made.cells.size());
    std::vector<dvec3> momentum(made.cells.size());
    test::for_each_sixth(size, [&](const ivec3& p, const vec3& middle) {
      const float value = test::value_at(frame.density, p + cube.origin);
      const double density = ramped ? ramp(value) : value;
      const std::uint32_t cell = grid::locate(made, middle);
      mass[cell] += density;
      momentum[cell] += density * (frame.velocity->to_index * dvec3(of(p + cube.origin)));
    });
    for (std::size_t cell = 0; cell < made.cells.size(); ++cell) {
      const dvec3 mean = mass[cell] > 0.0 ? momentum[cell] / mass[cell] : dvec3(0.0);
      const dvec3 stored(core::cm_cell_velocity(made.channels.velocity[cell]));
      // Precision of half floats, and the float error of the largest value, 1800.
      for (int i = 0; i < 3; ++i)
        ASSERT_NEAR(stored[i], mean[i], 5e-4 * std::abs(mean[i]) + 5e-4) << cell << " axis " << i;
    }
  }
}

TEST(Velocity, ZeroAndTooLargeVelocitiesAreHandled) {
  VolumeFrame frame{.density = test::slab()};
  const ivec3 size(64, 8, 64);
  frame.velocity = velocity(size, ivec3(0), [](const ivec3& /*p*/) { return vec3(0.0F); });
  EXPECT_FALSE(scene::momentum_of(frame)) << "nothing moves";
  frame.velocity = velocity(size, ivec3(0), [](const ivec3& /*p*/) { return vec3(60000.0F, -60000.0F, 1.0F); });
  frame.velocity->to_index = dmat3(3.0);
  const grid::TetGrid made = cells_of(frame, grid::fit_cube(frame.density));
  int moving = 0;
  for (const glm::uvec2& stored : made.channels.velocity) {
    const vec3 v = core::cm_cell_velocity(stored);
    if (v.x == 0.0F) continue;
    ++moving;
    EXPECT_EQ(vec2(v), vec2(65504.0F, -65504.0F));
    EXPECT_NEAR(v.z, 3.0F, 0.02F) << "single precision beside it";
  }
  EXPECT_GT(moving, 0);
  frame.density.bounds_min = frame.density.bounds_max = ivec3(0);
  frame.density.active_voxels = 0;
  EXPECT_FALSE(scene::momentum_of(frame)) << "nothing scatters";
}

TEST(Velocity, TooManyVelocityCellsAreDroppedWithAWarning) {
  VolumeFrame frame{.density = test::slab()};
  const ivec3 size(64, 8, 64);
  frame.velocity = velocity(size, ivec3(0), [](const ivec3& /*p*/) { return vec3(1.0F); });
  frame.density.brick_origins.clear();
  frame.density.brick_values = {};
  frame.density.bounds_max = ivec3(1023, 1023, 1031);
  frame.density.tiles = {{ivec3(0), frame.density.bounds_max, 1.0F}};
  std::vector<std::string> heard;
  const Log log([&](LogLevel level, const char* text) {
    EXPECT_EQ(level, LogLevel::warning);
    heard.emplace_back(text);
  });
  EXPECT_FALSE(scene::momentum_of(frame, {}, nullptr, log));
  ASSERT_EQ(heard.size(), 1U);
  EXPECT_NE(heard[0].find("the velocity is ignored: density with constant values covers more than 262144 bricks"),
            std::string::npos);
}

// A change of the emission does not change velocities.
TEST(Velocity, IsReusedWhenEmissionChanges) {
  VolumeFrame frame{.density = test::slab(), .flame = test::slab(0.5F)};
  const ivec3 size(64, 8, 64);
  frame.velocity = velocity(size, ivec3(0), [](const ivec3& /*p*/) { return vec3(1.0F); });
  frame.color = {test::slab(), test::slab(0.5F), test::slab(0.25F)};
  const viewer::VolumeAsset asset(std::move(frame));
  Progress progress;
  const volume::Ramp ramp({{0.0F, 0.0F}, {1.0F, 0.5F}});
  const grid::Channels first = asset.channels({}, {}, false, progress);
  const grid::Channels other = asset.channels({}, {.flame_strength = 2.0}, false, progress);
  const grid::Channels ramped = asset.channels(ramp, {.flame_strength = 2.0}, false, progress);
  ASSERT_TRUE(first.momentum && first.scattering && first.emission);
  EXPECT_EQ(first.momentum, other.momentum);
  EXPECT_EQ(first.scattering, other.scattering);
  EXPECT_NE(first.emission, other.emission);
  EXPECT_NE(other.momentum, ramped.momentum);
  EXPECT_NE(other.scattering, ramped.scattering);
  EXPECT_EQ(other.emission, ramped.emission);
}

// ---- Images

class VelocityAov : public test::ViewerTest {
 protected:
  static constexpr std::uint32_t edge = 8;

  static void show(test::Still& viewer, VolumeFrame frame) { viewer.set_volume(std::move(frame)); }
  static std::vector<vec3> look(test::Still& viewer, const dvec3& eye = {31.5, 31.5, 500.0},
                                const dvec3& at = {31.5, 31.5, 0.0}) {
    viewer.set_camera(test::camera_at(eye, at, 0.5));
    test::render(viewer, {edge, edge, 1, 1, render::View::shaded});
    std::vector<vec3> pixels(edge * edge);
    viewer.viewer().read_aov(viewer::Aov::velocity, &pixels[0].x, 3 * pixels.size());
    return pixels;
  }
  static void expect_all(const std::vector<vec3>& pixels, const dvec3& wanted, const std::string& what) {
    for (const vec3& pixel : pixels)
      for (int i = 0; i < 3; ++i)
        ASSERT_NEAR(pixel[i], wanted[i], 1e-3 * std::abs(wanted[i]) + 1e-4) << what << ", axis " << i;
  }
  static viewer::Medium thick(double density_scale) {
    viewer::Medium medium;
    medium.density_scale = density_scale;
    return medium;
  }
  static VolumeFrame slab_of(const ivec3& size, const vec3& v) {
    VolumeFrame frame{.density = test::make_volume(size, ivec3(0), [](const ivec3& /*p*/) { return 1.0F; })};
    frame.velocity = velocity(size, ivec3(0), [=](const ivec3& /*p*/) { return v; });
    return frame;
  }
};
CUMULET_ON_BACKENDS(VelocityAov);

std::string name_of(const test::MarchKind& kind) {
  return "march " + std::to_string(static_cast<int>(kind.march)) +
         (kind.cells == grid::CellKind::linear ? " linear" : "");
}

// The velocity is a mean, not a sum, so it does not depend on the optical depth.
TEST_P(VelocityAov, SlabHasItsVelocity) {
  const auto viewer = make();
  const vec3 v(3.0F, -40.0F, 0.125F);
  for (const test::MarchKind& kind : test::march_kinds) {
    viewer->set_grid(test::settings_of(kind, 0.1));
    for (const double sigma : {1e-3, 0.1, 20.0}) {
      show(*viewer, slab_of({64, 64, 8}, v));
      viewer->set_medium(thick(sigma));
      expect_all(look(*viewer), v, name_of(kind));
      expect_all(look(*viewer, {500.0, 500.0, 500.0}, {500.0, 500.0, 0.0}), dvec3(0.0), "beside it");
      VolumeFrame still = slab_of({64, 64, 8}, v);
      still.velocity.reset();
      show(*viewer, std::move(still));
      expect_all(look(*viewer), dvec3(0.0), "without velocities");
    }
  }
}

// One slab in front of the other: velocities are weighted by single scattering towards the camera.
TEST_P(VelocityAov, TwoSlabsFollowTheClosedForm) {
  const auto viewer = make();
  const vec3 near(3.0F, -40.0F, 0.125F);
  const vec3 far(-7.0F, 10.0F, 25.0F);
  const auto is_near = [](const ivec3& p) { return p.z >= 8; };
  VolumeFrame frame{
      .density = test::make_volume({64, 64, 16}, ivec3(0), [=](const ivec3& p) { return is_near(p) ? 0.5F : 1.0F; })};
  frame.velocity = velocity({64, 64, 16}, ivec3(0), [=](const ivec3& p) { return is_near(p) ? near : far; });
  show(*viewer, std::move(frame));
  for (const test::MarchKind& kind : test::march_kinds) {
    viewer->set_grid(test::settings_of(kind));
    for (const double sigma : {1e-3, 0.1, 1.0}) {
      viewer->set_medium(thick(sigma));
      const double first = 1.0 - std::exp(-0.5 * sigma * 8.0);
      const double then = std::exp(-0.5 * sigma * 8.0) * (1.0 - std::exp(-sigma * 8.0));
      const dvec3 mean = (first * dvec3(near) + then * dvec3(far)) / (first + then);
      expect_all(look(*viewer), mean, name_of(kind) + ", " + std::to_string(sigma));
    }
  }
  // With a surface between them, only the first counts.
  viewer->set_medium(thick(0.1));
  test::StillScene wall;
  wall.add_quad({vec3(-100, -100, 7.5), vec3(100, -100, 7.5), vec3(100, 100, 7.5), vec3(-100, 100, 7.5)},
                wall.add(test::diffuse(vec3(0.5F))));
  viewer->viewer().show_surfaces(test::source_of(std::make_shared<test::StillScene>(wall)));
  for (const test::MarchKind& kind : test::march_kinds) {
    viewer->set_grid(test::settings_of(kind));
    expect_all(look(*viewer), near, name_of(kind) + ", with a surface");
  }
}

// If the denoiser has already requested feature buffers, the velocity AOV recomputes them, and they stay the same.
TEST_P(VelocityAov, MayBeRequestedAfterOtherFeatureBuffers) {
  const auto viewer = make();
  const vec3 v(1.0F, 2.0F, 3.0F);
  show(*viewer, slab_of({64, 64, 8}, v));
  viewer->set_medium(thick(0.1));
  viewer->set_camera(test::camera_at({31.5, 31.5, 500.0}, {31.5, 31.5, 0.0}, 0.5));
  test::render(*viewer, {edge, edge, 1, 1, render::View::shaded});
  const auto read = [&](viewer::Aov aov, std::size_t channels) {
    std::vector<float> values(channels * edge * edge);
    viewer->viewer().read_aov(aov, values.data(), values.size());
    return values;
  };
  const std::vector<float> transmittance = read(viewer::Aov::transmittance, 1);
  EXPECT_NEAR(transmittance[0], std::exp(-0.8F), 1e-3F);
  EXPECT_NEAR(read(viewer::Aov::velocity, 3)[1], 2.0F, 1e-3F);
  EXPECT_EQ(read(viewer::Aov::transmittance, 1), transmittance);
}

// A rotated and scaled file has rotated and scaled velocities.
TEST_P(VelocityAov, VelocityFollowsTheFilesTransform) {
  openvdb::initialize();
  const test::Folder folder;
  auto density = test::fog("density");
  density->fill({{0, 0, 0}, {63, 63, 63}}, 1.0F);
  auto grid = openvdb::Vec3SGrid::create(openvdb::Vec3f(0.0F));
  grid->setName("vel");
  grid->fill({{-8, -8, -8}, {71, 71, 71}}, openvdb::Vec3f(1.0F, 2.0F, 3.0F));
  for (const openvdb::GridBase::Ptr& one : openvdb::GridPtrVec{density, grid})
    one->setTransform(openvdb::math::Transform::createLinearTransform(0.25));
  const auto path = folder / "moves.vdb";
  openvdb::io::File(path.string()).write({density, grid});
  // Z up, three times as large: (x, y, z) to 3 (x, z, -y).
  const dmat4 upright(dmat3(3, 0, 0, 0, 0, -3, 0, 3, 0));
  const auto viewer = make();
  viewer->set_medium(thick(0.05));
  const viewer::VolumeFile file{.path = path.string(), .grids = {}, .to_world = upright};
  const viewer::VolumeAssetPtr asset = file.read({}, nullptr);
  const dvec3 middle(0.75 * 32.0, 0.75 * 32.0, -0.75 * 32.0);
  for (const test::MarchKind& kind : test::march_kinds) {
    viewer->set_grid(test::settings_of(kind, 0.1));
    viewer->set_volume(asset);
    expect_all(look(*viewer, middle + dvec3(0.0, 0.0, 500.0), middle), dvec3(3.0, 9.0, -6.0), name_of(kind));
    // Two instance transforms. The second is rotated by a quarter turn about y, and only it is in view: (x, y, z) to
    // (z, y, -x).
    const dmat4 turned = glm::rotate(glm::translate(dmat4(1.0), dvec3(200.0, 0.0, 0.0)), 0.5 * M_PI, dvec3(0, 1, 0));
    viewer->viewer().set_transforms({{dmat4(1.0)}, {turned}});
    expect_all(look(*viewer, middle + dvec3(0.0, 0.0, 500.0), middle), dvec3(3.0, 9.0, -6.0), name_of(kind));
    const dvec3 there(turned * glm::dvec4(middle, 1.0));
    expect_all(look(*viewer, there + dvec3(0.0, 0.0, 500.0), there), dvec3(-6.0, 9.0, -3.0),
               name_of(kind) + ", turned");
    viewer->viewer().set_transforms({{dmat4(1.0)}});
  }
}

// Where instances overlap, velocities are weighted by extinction.
TEST_P(VelocityAov, OverlappingInstancesGiveTheMeanVelocity) {
  const auto viewer = make();
  viewer->set_medium(thick(0.1));
  show(*viewer, slab_of({64, 64, 8}, vec3(1.0F, 2.0F, 3.0F)));
  // Rotated by a half turn about the slab's own z axis: (x, y, z) to (-x, -y, z).
  const dmat4 turned = glm::translate(dmat4(1.0), dvec3(31.5, 31.5, 0.0)) *
                       glm::rotate(dmat4(1.0), M_PI, dvec3(0, 0, 1)) *
                       glm::translate(dmat4(1.0), dvec3(-31.5, -31.5, 0.0));
  for (const test::MarchKind& kind : test::march_kinds) {
    viewer->set_grid(test::settings_of(kind, 0.1));
    viewer->viewer().set_transforms({{dmat4(1.0)}, {turned}});
    expect_all(look(*viewer), dvec3(0.0, 0.0, 3.0), name_of(kind));
  }
}

}  // namespace
