// The velocity of a file, from grids of every form.

#define NANOVDB_USE_ZIP
#define NANOVDB_USE_BLOSC

#include "volume/frame_import.hpp"

#include <gtest/gtest.h>
#include <nanovdb/util/IO.h>
#include <nanovdb/util/OpenToNanoVDB.h>

#include <random>

#include "support/frame_import.hpp"
#include "support/vdb_files.hpp"
#include "support/volumes.hpp"

namespace {

namespace fs = std::filesystem;
using cumulet::test::box;
using cumulet::test::fog;
using cumulet::test::Messages;
using cumulet::test::naming;
using cumulet::test::plane;
using cumulet::test::scaled;
using cumulet::test::two_voxels;
using cumulet::test::value_at;
using cumulet::test::VolumeFrameImport;
using cumulet::volume::GridNames;
using cumulet::volume::import_frame;
using cumulet::volume::ScalarVolume;
using cumulet::volume::VolumeFrame;
using openvdb::Coord;
using openvdb::Vec3d;

// Velocity along the file's axes, for a lattice with this voxel size.
glm::dvec3 velocity_at(const VolumeFrame& frame, const glm::ivec3& p, double voxel = 1.0) {
  const auto& parts = frame.velocity->parts;
  glm::dvec3 given(0.0);
  for (int axis = 0; axis < 3; ++axis) {
    const std::size_t first = 2 * static_cast<std::size_t>(axis);
    given[axis] = double{value_at(parts[first], p)} - double{value_at(parts[first + 1], p)};
  }
  return voxel * (frame.velocity->to_index * given);
}

openvdb::Vec3SGrid::Ptr vectors(const std::string& name) {
  auto grid = openvdb::Vec3SGrid::create(openvdb::Vec3f(0.0F));
  grid->setName(name);
  for (int i = 0; i < 100; ++i) {
    const auto value = static_cast<float>(i - 50);
    grid->tree().setValue(Coord(i % 11, i % 7, i % 5), openvdb::Vec3f(value, -0.5F * value, 7.25F));
  }
  grid->tree().addTile(1, Coord(16, 0, 0), openvdb::Vec3f(0.0F, -3.0F, 1.0F), true);
  return grid;
}

void expect_vectors(const VolumeFrame& frame, const openvdb::Vec3SGrid& grid) {
  ASSERT_TRUE(frame.velocity);
  for (auto it = grid.cbeginValueOn(); it; ++it) {
    const Coord c = it.getCoord();
    const openvdb::Vec3f v = *it;
    ASSERT_EQ(velocity_at(frame, {c.x(), c.y(), c.z()}), glm::dvec3(v.x(), v.y(), v.z())) << c;
  }
  EXPECT_EQ(velocity_at(frame, glm::ivec3(-3)), glm::dvec3(0.0));
}

TEST_F(VolumeFrameImport, VelocityFromAVectorGrid) {
  const auto density = box("density", scaled(1.0), 24, [](const Vec3d&) { return 1.0F; });
  for (const std::string name : {"velocity", "Vel", "v"}) {
    for (const bool half : {false, true}) {
      const auto grid = vectors(name);
      grid->setSaveFloatAsHalf(half);
      const auto file = write({density, grid});
      Messages messages;
      VolumeFrame frame = import_frame(file, {}, messages.log);
      expect_vectors(frame, *grid);
      EXPECT_TRUE(messages.warnings.empty());
      EXPECT_TRUE(frame.velocity->parts[0].brick_values.are_halves()) << "they are so in either file";
      EXPECT_EQ(frame.beside_density().size(), 6U);
      EXPECT_FALSE(import_frame(file, naming({{&GridNames::velocity, "none"}}), {}).velocity);
      expect_vectors(import_frame(file, naming({{&GridNames::velocity, name}}), {}), *grid);
      EXPECT_HAS(refusal(file, naming({{&GridNames::velocity, "nope"}})),
                 "has no vector grid \"nope\", and not all of \"nopex\", \"nopey\" and \"nopez\"; it has "
                 "\"density\"");
      EXPECT_HAS(refusal(file, naming({{&GridNames::velocity, "density"}})),
                 "grid \"density\" has type float, not a vector type");
      EXPECT_FALSE(import_frame(file, naming({{&GridNames::color, name}}), {}).velocity) << "it is the colour";
    }
  }
  // If there are several, a priority order of names decides. Any other grid can be named.
  const auto vel = vectors("vel");
  const auto wind = vectors("wind");
  auto velocity = vectors("velocity");
  velocity->tree().clear();
  velocity->tree().setValue(Coord(1, 2, 3), openvdb::Vec3f(1.0F, 2.0F, 3.0F));
  write({density, vel, velocity, wind});
  expect_vectors(import_frame(path(), {}, {}), *velocity);
  expect_vectors(import_frame(path(), naming({{&GridNames::velocity, "wind"}}), {}), *wind);
  EXPECT_EQ(cumulet::volume::channels_by_name(cumulet::volume::list_grids(path())),
            (std::vector<std::string>{"density", "", "velocity", ""}));
}

TEST_F(VolumeFrameImport, VelocityFromNanoVdb) {
  const auto density = two_voxels("density", 1.0F);
  for (const bool staggered : {false, true}) {
    const auto grid = vectors("vel");
    if (staggered) grid->setGridClass(openvdb::GRID_STAGGERED);
    const VolumeFrame truth = import_frame(write({density, grid}), {}, {});
    std::vector<nanovdb::GridHandle<>> handles;
    handles.push_back(nanovdb::openToNanoVDB(*density));
    handles.push_back(nanovdb::openToNanoVDB(*grid));
    const fs::path nano = folder_ / "frame.nvdb";
    nanovdb::io::writeGrids<nanovdb::HostBuffer, std::vector>(nano.string(), handles);
    const VolumeFrame frame = import_frame(nano, {}, {});
    ASSERT_TRUE(frame.velocity);
    for (std::size_t i = 0; i < 6; ++i)
      cumulet::test::expect_same_voxels(frame.velocity->parts[i], truth.velocity->parts[i]);
  }
}

// A staggered component is on the voxel's lower face along its axis, so the value at the center is the mean of two.
TEST_F(VolumeFrameImport, VelocityFromAStaggeredGrid) {
  std::mt19937 random(11);
  const auto noise = [&] { return static_cast<float>(random() % 2000) / 100.0F - 10.0F; };
  auto grid = openvdb::Vec3SGrid::create(openvdb::Vec3f(0.0F));
  grid->setName("motion");
  grid->setGridClass(openvdb::GRID_STAGGERED);
  grid->setTransform(openvdb::math::Transform::createLinearTransform(scaled(0.5)));
  constexpr int size = 12;
  for (int i = 0; i < size * size * size; ++i) {
    const Coord c(i / (size * size), i / size % size, i % size);
    grid->tree().setValue(c, openvdb::Vec3f(noise(), noise(), noise()));
  }
  const auto density = box("density", scaled(0.5), size, [](const Vec3d&) { return 1.0F; });
  const VolumeFrame frame = import_frame(write({density, grid}), {}, {});
  ASSERT_TRUE(frame.velocity);
  for (int i = 0; i < size * size * size; ++i) {
    const Coord c(i / (size * size), i / size % size, i % size);
    const glm::dvec3 found = velocity_at(frame, {c.x(), c.y(), c.z()}, 0.5);
    for (int axis = 0; axis < 3; ++axis) {
      Coord next = c;
      ++next[axis];
      const double mean = 0.5 * (double{grid->tree().getValue(c)[axis]} + double{grid->tree().getValue(next)[axis]});
      ASSERT_NEAR(found[axis], mean, 1e-5) << c << ", axis " << axis;
    }
  }
}

// Three scalar grids, each with a lattice of its own, as some simulations write face velocities.
TEST_F(VolumeFrameImport, VelocityFromThreeGrids) {
  const auto density = box("density", scaled(1.0), 10, [](const Vec3d&) { return 1.0F; });
  const auto along = [](int axis) {
    return [axis](const Vec3d& p) { return static_cast<float>(axis + 1) * (plane(p) - 2.5F); };
  };
  for (const std::string stem : {"velocity", "vel_", "v."}) {
    openvdb::GridPtrVec grids{density};
    for (int axis = 0; axis < 3; ++axis) {
      Vec3d first(-2.0);
      first[axis] -= 0.25;
      grids.push_back(box(stem + "xyz"[axis], scaled(1.0, first), 16, along(axis)));
    }
    const VolumeFrame frame = import_frame(write(grids), {}, {});
    ASSERT_TRUE(frame.velocity) << stem;
    for (const glm::ivec3& p : {glm::ivec3(0), glm::ivec3(9), glm::ivec3(2, 7, 4)}) {
      const glm::dvec3 found = velocity_at(frame, p);
      for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(found[axis], along(axis)(Vec3d(p.x, p.y, p.z)), 1e-4) << stem;
    }
    const std::string named = stem == "velocity" ? stem : stem.substr(0, stem.size() - 1);
    EXPECT_TRUE(import_frame(path(), naming({{&GridNames::velocity, named}}), {}).velocity);
    EXPECT_FALSE(import_frame(path(), naming({{&GridNames::temperature, stem + "y"}}), {}).velocity);
  }
  // Grids named as velocity are not used otherwise. With other names they are not found.
  const openvdb::GridPtrVec winds{two_voxels("windx", 1.0F), two_voxels("windy", 2.0F), two_voxels("windz", 3.0F),
                                  two_voxels("cloud", 1.0F)};
  EXPECT_EQ(import_frame(write(winds), {}, {}).density.name, "windx");
  const VolumeFrame frame = import_frame(path(), naming({{&GridNames::velocity, "wind"}}), {});
  EXPECT_EQ(frame.density.name, "cloud");
  EXPECT_EQ(velocity_at(frame, {1, 2, 3}), glm::dvec3(1.0, 2.0, 3.0));
}

// Vectors are in world space, unless their metadata declare local space. Then they follow the transform.
TEST_F(VolumeFrameImport, VelocityInLocalSpace) {
  openvdb::math::Mat4d turned = scaled(2.0);
  turned.postRotate(openvdb::math::Z_AXIS, 0.5 * M_PI);  // row vectors: x to y, y to -x
  auto density = box("density", turned, 10, [](const Vec3d&) { return 1.0F; });
  auto grid = openvdb::Vec3SGrid::create(openvdb::Vec3f(1.0F, 2.0F, 3.0F));
  grid->setName("v");
  grid->setTransform(density->transform().copy());
  grid->tree().addTile(1, Coord(0), openvdb::Vec3f(1.0F, 2.0F, 3.0F), true);
  const auto world = [&] {
    const VolumeFrame frame = import_frame(write({density, grid}), {}, {});
    return glm::dmat3(frame.density.index_to_world) * velocity_at(frame, {1, 2, 3});
  };
  const auto expect = [](const glm::dvec3& found, const glm::dvec3& wanted) {
    EXPECT_LT(glm::distance(found, wanted), 1e-6) << found.x << " " << found.y << " " << found.z;
  };
  const Vec3d x = density->indexToWorld(Vec3d(1, 0, 0)) - density->indexToWorld(Vec3d(0.0));
  const Vec3d y = density->indexToWorld(Vec3d(0, 1, 0)) - density->indexToWorld(Vec3d(0.0));
  const Vec3d turned_vector = x + 2.0 * y + Vec3d(0.0, 0.0, 6.0);
  expect(world(), {1.0, 2.0, 3.0});
  grid->setVectorType(openvdb::VEC_CONTRAVARIANT_RELATIVE);
  expect(world(), {1.0, 2.0, 3.0});
  grid->setIsInWorldSpace(false);
  expect(world(), {turned_vector.x(), turned_vector.y(), turned_vector.z()});
  grid->setVectorType(openvdb::VEC_CONTRAVARIANT_ABSOLUTE);
  expect(world(), {turned_vector.x(), turned_vector.y(), turned_vector.z()});
  grid->setVectorType(openvdb::VEC_INVARIANT);
  expect(world(), {1.0, 2.0, 3.0});
}

TEST_F(VolumeFrameImport, InvalidAndTooLargeVelocitiesAreReported) {
  const float infinite = std::numeric_limits<float>::infinity();
  auto grid = openvdb::Vec3SGrid::create(openvdb::Vec3f(0.0F));
  grid->setName("vel");
  grid->setTransform(openvdb::math::Transform::createLinearTransform(scaled(0.5)));
  grid->tree().setValue(Coord(0, 0, 0), openvdb::Vec3f(1e30F, -40000.0F, 1.0F));
  grid->tree().setValue(Coord(0, 0, 1), openvdb::Vec3f(std::numeric_limits<float>::quiet_NaN(), -infinite, 2.0F));
  grid->tree().setValue(Coord(0, 0, 2), openvdb::Vec3f(infinite, 3.0F, -30000.0F));
  const auto density = box("density", scaled(0.5), 4, [](const Vec3d&) { return 1.0F; });
  Messages messages;
  const VolumeFrame frame = import_frame(write({density, grid}), {}, messages.log);
  EXPECT_EQ(velocity_at(frame, {0, 0, 0}), glm::dvec3(65504.0, -65504.0, 2.0)) << "voxels a second";
  EXPECT_EQ(velocity_at(frame, {0, 0, 1}), glm::dvec3(0.0, 0.0, 4.0));
  EXPECT_EQ(velocity_at(frame, {0, 0, 2}), glm::dvec3(0.0, 6.0, -60000.0));
  ASSERT_EQ(messages.warnings.size(), 3U);
  EXPECT_HAS(messages.warnings[0], "grid \"vel\", x: 2 non-finite voxels read as 0");
  EXPECT_HAS(messages.warnings[1], "grid \"vel\", y: 1 non-finite voxel read as 0");
  EXPECT_HAS(messages.warnings[2], "grid \"vel\": 2 components above 65504 voxels per second clamped");
  // An empty grid also gives a warning.
  grid->tree().clear();
  messages.warnings.clear();
  EXPECT_TRUE(import_frame(write({density, grid}), {}, messages.log).velocity);
  ASSERT_EQ(messages.warnings.size(), 1U);
  EXPECT_HAS(messages.warnings[0], "is empty");
}

// A velocity that was not named is left out with a warning. A named one causes an error.
TEST_F(VolumeFrameImport, FailedVelocityIsDroppedUnlessRequestedByName) {
  const auto density = box("density", scaled(1.0), 10, [](const Vec3d&) { return 1.0F; });
  const auto expect = [&](const openvdb::GridPtrVec& grids, const std::string& name, const std::string& cause) {
    const auto file = write(grids);
    Messages messages;
    const VolumeFrame frame = import_frame(file, {}, messages.log);
    EXPECT_FALSE(frame.velocity);
    EXPECT_EQ(frame.density.active_voxels, 1000U);
    ASSERT_EQ(messages.warnings.size(), 1U);
    EXPECT_HAS(messages.warnings[0], file.string() + ": grid \"" + name);
    EXPECT_HAS(messages.warnings[0], cause);
    EXPECT_HAS(messages.warnings[0], ": the velocity is ignored");
    EXPECT_HAS(refusal(file, naming({{&GridNames::velocity, name}})), cause);
    EXPECT_FALSE(import_frame(file, naming({{&GridNames::velocity, "none"}}), {}).velocity);
  };
  const auto fine = vectors("motion");
  fine->setGridClass(openvdb::GRID_STAGGERED);
  fine->setTransform(openvdb::math::Transform::createLinearTransform(scaled(1e-3)));
  expect({density, fine}, "motion", "has voxels that are too small");
  auto wide = vectors("vel");
  wide->tree().setValue(Coord(1 << 22, 0, 0), openvdb::Vec3f(1.0F));
  expect({density, wide}, "vel", "voxels span");
  const auto wide_x = fog("vx");
  wide_x->tree().setValue(Coord(0), 1.0F);
  wide_x->tree().setValue(Coord(1 << 22, 0, 0), 2.0F);
  write({density, wide_x, two_voxels("vy", 1.0F), two_voxels("vz", 1.0F)});
  Messages messages;
  EXPECT_FALSE(import_frame(path(), {}, messages.log).velocity);
  ASSERT_EQ(messages.warnings.size(), 1U);
  EXPECT_HAS(messages.warnings[0], "grid \"vx\": its active voxels span");
  EXPECT_HAS(refusal(path(), naming({{&GridNames::velocity, "v"}})), "voxels span");
}

// Velocities are kept only in the bounds of the density, for any size and resolution of their grid.
TEST_F(VolumeFrameImport, VelocityIsKeptOnlyInTheDensitysBounds) {
  const auto ones = [](const Vec3d&) { return 1.0F; };
  std::mt19937 random(3);
  const auto component = [&] { return static_cast<float>(random() % 2000) / 100.0F - 10.0F; };
  for (const bool staggered : {false, true}) {
    const auto grid = openvdb::Vec3SGrid::create(openvdb::Vec3f(0.0F));
    grid->setName("vel");
    if (staggered) grid->setGridClass(openvdb::GRID_STAGGERED);
    constexpr int size = 48;
    for (int i = 0; i < size * size * size; ++i) {
      const Coord c(i / (size * size) - 16, i / size % size - 16, i % size - 16);
      grid->tree().setValue(c, openvdb::Vec3f(component(), component(), component()));
    }
    // Without a density, all velocities are kept.
    const VolumeFrame all = import_frame(write({box("flame", scaled(1.0), 10, ones), grid}), {}, {});
    const VolumeFrame frame = import_frame(write({box("density", scaled(1.0), 10, ones), grid}), {}, {});
    ASSERT_TRUE(all.velocity && frame.velocity);
    for (const ScalarVolume& part : frame.velocity->parts) {
      EXPECT_LE(part.brick_origins.size(), 27U) << "10 voxels and one on either side";
      EXPECT_TRUE(glm::all(glm::greaterThanEqual(part.bounds_min, glm::ivec3(-8))));
      EXPECT_TRUE(glm::all(glm::lessThan(part.bounds_max, glm::ivec3(16))));
    }
    EXPECT_GE(all.velocity->parts[0].brick_origins.size(), 216U);
    for (int i = 0; i < 12 * 12 * 12; ++i) {
      const glm::ivec3 p(i / 144 - 1, i / 12 % 12 - 1, i % 12 - 1);
      ASSERT_EQ(velocity_at(frame, p), velocity_at(all, p)) << p.x << " " << p.y << " " << p.z;
    }
  }
  // The whole velocity grid would exceed the brick limit.
  const auto coarse = vectors("vel");
  coarse->setTransform(openvdb::math::Transform::createLinearTransform(scaled(200.0)));
  Messages messages;
  EXPECT_TRUE(import_frame(write({box("density", scaled(1.0), 10, ones), coarse}), {}, messages.log).velocity);
  EXPECT_TRUE(messages.warnings.empty());
}

}  // namespace
