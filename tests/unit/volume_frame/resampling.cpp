// Fields of a file on one lattice: coarser, finer and rotated grids.

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <random>

#include "support/frame_import.hpp"
#include "support/vdb_files.hpp"
#include "support/volumes.hpp"
#include "volume/frame_import.hpp"

namespace {

using cumulet::test::box;
using cumulet::test::fog;
using cumulet::test::plane;
using cumulet::test::scaled;
using cumulet::test::two_voxels;
using cumulet::test::value_at;
using cumulet::test::VolumeFrameImport;
using cumulet::volume::import_frame;
using cumulet::volume::import_volume;
using cumulet::volume::ScalarVolume;
using cumulet::volume::VolumeFrame;
using openvdb::Coord;
using openvdb::Vec3d;

/// Compares all voxels whose world position is in the box [low, high].
template <class Function>
void expect_values(const ScalarVolume& v, const Vec3d& low, const Vec3d& high, Function function, double tolerance) {
  int compared = 0;
  for (glm::ivec3 p = v.bounds_min; p.x <= v.bounds_max.x; ++p.x) {
    for (p.y = v.bounds_min.y; p.y <= v.bounds_max.y; ++p.y) {
      for (p.z = v.bounds_min.z; p.z <= v.bounds_max.z; ++p.z) {
        const glm::dvec4 w = v.index_to_world * glm::dvec4(p, 1.0);
        const Vec3d world(w.x, w.y, w.z);
        if (world.x() < low.x() || world.y() < low.y() || world.z() < low.z()) continue;
        if (world.x() > high.x() || world.y() > high.y() || world.z() > high.z()) continue;
        ASSERT_NEAR(value_at(v, p), function(world), tolerance) << world;
        ++compared;
      }
    }
  }
  EXPECT_GT(compared, 100);
}

/// The integral of a field over space.
double integral(const ScalarVolume& v) {
  double sum = 0.0;
  for (glm::ivec3 p = v.bounds_min; p.x <= v.bounds_max.x; ++p.x) {
    for (p.y = v.bounds_min.y; p.y <= v.bounds_max.y; ++p.y) {
      for (p.z = v.bounds_min.z; p.z <= v.bounds_max.z; ++p.z) sum += value_at(v, p);
    }
  }
  return sum * std::abs(glm::determinant(glm::dmat3(v.index_to_world)));
}

TEST_F(VolumeFrameImport, CoarserFieldsAreInterpolated) {
  // Trilinear interpolation reproduces a linear function.
  const auto density = box("density", scaled(0.5), 40, [](const Vec3d&) { return 1.0F; });
  const auto heat = box("heat", scaled(1.75, Vec3d(1.0, 2.0, 3.0)), 8, plane);
  const VolumeFrame frame = import_frame(write({density, heat}), {}, {});
  ASSERT_TRUE(frame.temperature);
  const ScalarVolume& v = *frame.temperature;
  EXPECT_EQ(v.index_to_world, frame.density.index_to_world);
  EXPECT_EQ(v.name, "heat");
  // Exact from the first voxel center to the last. Beyond, it falls to 0 at the next center of the field's lattice.
  expect_values(v, Vec3d(1.0, 2.0, 3.0), Vec3d(1.0, 2.0, 3.0) + 7.0 * 1.75, plane, 1e-5);
  EXPECT_EQ(v.bounds_min, glm::ivec3(-1, 1, 3));
  EXPECT_EQ(v.bounds_max, glm::ivec3(29, 31, 33));
  const ScalarVolume alone = import_volume(path(), "heat", {});
  EXPECT_NEAR(integral(v), integral(alone), 1e-2 * integral(alone));
}

TEST_F(VolumeFrameImport, RotatedAndShearedGridsAreInterpolated) {
  openvdb::math::Mat4d turned = scaled(0.8, Vec3d(4.0, 5.0, 6.0));
  turned.preRotate(openvdb::math::Z_AXIS, 0.7);
  turned.preRotate(openvdb::math::X_AXIS, -0.4);
  turned.preShear(openvdb::math::X_AXIS, openvdb::math::Y_AXIS, 0.3);
  const auto density = box("density", scaled(1.0), 20, [](const Vec3d&) { return 1.0F; });
  const auto flame = box("flame", turned, 20, plane);
  const VolumeFrame frame = import_frame(write({density, flame}), {}, {});
  ASSERT_TRUE(frame.flame);
  const Vec3d centre = flame->indexToWorld(Vec3d(9.5));
  expect_values(*frame.flame, centre - 3.0, centre + 3.0, plane, 1e-5);
  const ScalarVolume alone = import_volume(path(), "flame", {});
  EXPECT_NEAR(integral(*frame.flame), integral(alone), 2e-3 * integral(alone));
}

TEST_F(VolumeFrameImport, FinerFieldsAreAveraged) {
  // Each voxel of the lattice covers 2, 3 or 4 whole voxels of the field per axis, so the mean of noise is kept voxel
  // by voxel.
  std::mt19937 random(5);
  for (const int ratio : {2, 3, 4}) {
    const auto density = box("density", scaled(ratio), 16, [](const Vec3d&) { return 1.0F; });
    const Vec3d first(-0.5 * (ratio - 1));
    const auto noise = [&](const Vec3d&) { return static_cast<float>(random() % 1000) / 1000.0F; };
    const auto heat = box("temperature", scaled(1.0, first), 16 * ratio, noise);
    const VolumeFrame frame = import_frame(write({density, heat}), {}, {});
    ASSERT_TRUE(frame.temperature);
    const auto mean = [&](const Vec3d& world) {
      double sum = 0.0;
      const Coord low = Coord::round(heat->worldToIndex(world + first));
      for (int i = 0; i < ratio * ratio * ratio; ++i) {
        sum += heat->tree().getValue(low.offsetBy(i % ratio, i / ratio % ratio, i / ratio / ratio));
      }
      return sum / (ratio * ratio * ratio);
    };
    expect_values(*frame.temperature, Vec3d(-1.0), Vec3d(16.0 * ratio), mean, 1e-5);
    EXPECT_EQ(frame.temperature->bounds_min, glm::ivec3(0));
    EXPECT_EQ(frame.temperature->bounds_max, glm::ivec3(15));
  }
}

TEST_F(VolumeFrameImport, AnOffsetOfWholeVoxelsMovesValuesExactly) {
  std::mt19937 random(6);
  const auto noise = [&](const Vec3d&) { return static_cast<float>(random()); };
  const auto density = box("density", scaled(0.1), 4, noise);
  // An offset computed in floats, which is not exactly 3 voxels.
  const auto flame = box("flame", scaled(0.1, Vec3d(static_cast<double>(0.3F))), 20, noise);
  const VolumeFrame frame = import_frame(write({density, flame}), {}, {});
  ASSERT_TRUE(frame.flame);
  EXPECT_EQ(frame.flame->bounds_min, glm::ivec3(3));
  EXPECT_EQ(frame.flame->bounds_max, glm::ivec3(22));
  EXPECT_EQ(frame.flame->active_voxels, 8000U);
  for (auto it = flame->cbeginValueOn(); it; ++it) {
    const Coord c = it.getCoord();
    ASSERT_EQ(value_at(*frame.flame, glm::ivec3(c.x(), c.y(), c.z()) + 3), *it) << c;
  }
}

TEST_F(VolumeFrameImport, TilesAndBackgroundsStaySparse) {
  const auto density = two_voxels("density", 1.0F);
  auto heat = fog("temperature", 0.25F);
  heat->setTransform(openvdb::math::Transform::createLinearTransform(scaled(2.0, Vec3d(0.3, 0.6, 0.9))));
  heat->tree().addTile(2, Coord(0), 0.5F, true);
  heat->tree().addTile(1, Coord(256, 256, 256), 0.75F, true);
  const VolumeFrame frame = import_frame(write({density, heat}), {}, {});
  ASSERT_TRUE(frame.temperature);
  const ScalarVolume& v = *frame.temperature;
  EXPECT_EQ(v.bounds_min, glm::ivec3(-1));
  EXPECT_EQ(v.bounds_max, glm::ivec3(528));
  EXPECT_EQ(value_at(v, glm::ivec3(100)), 0.5F);
  EXPECT_EQ(value_at(v, glm::ivec3(400)), 0.25F);
  EXPECT_EQ(value_at(v, glm::ivec3(520)), 0.75F);
  EXPECT_LT(v.brick_origins.size(), 40000U);
  EXPECT_LT(v.tiles.size(), 40000U);
}

TEST_F(VolumeFrameImport, TooFineGridsAreRejectedImmediately) {
  std::mt19937 random(9);
  const auto coarse = box("flame", scaled(1.0), 60, [&](const Vec3d&) { return static_cast<float>(random() % 1000); });
  auto density = two_voxels("density", 1.0F);
  density->setTransform(openvdb::math::Transform::createLinearTransform(scaled(0.01)));
  EXPECT_HAS(refusal(write({density, coarse}), {}), "grid \"flame\": has voxels that are too large");
}

TEST_F(VolumeFrameImport, ResamplingAMuchFinerFieldSkipsEmptySpace) {
  // 500 dots in separate bricks, 40 times finer than the lattice.
  auto dots = fog("flame");
  std::mt19937 random(10);
  const auto pick = [&] { return static_cast<int>(random() % 20000); };
  for (int i = 0; i < 500; ++i) dots->tree().setValue(Coord(pick(), pick(), pick()), 1.0F);
  auto density = two_voxels("density", 1.0F);
  density->setTransform(openvdb::math::Transform::createLinearTransform(scaled(40.0)));
  // Iterating over all voxels of the finer lattice would take longer than the test's time limit.
  const VolumeFrame frame = import_frame(write({density, dots}), {}, {});
  EXPECT_LE(frame.flame->brick_origins.size(), 1000U);
}

TEST_F(VolumeFrameImport, ResamplingIsIdenticalForAnyThreadCountAndCancellable) {
  std::mt19937 random(8);
  const auto noise = [&](const Vec3d&) { return static_cast<float>(random() % 1000); };
  write({box("density", scaled(1.0), 10, noise), box("flame", scaled(0.7, Vec3d(0.2)), 60, noise)});
  const auto read = [&](int threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads));
    return import_frame(path(), {}, {});
  };
  const VolumeFrame one = read(1);
  cumulet::test::expect_same_voxels(*one.flame, *read(4).flame);

  cumulet::Progress progress;
  progress.cancel();
  try {
    (void)import_frame(path(), {}, {}, &progress);
    ADD_FAILURE() << "was not cancelled";
  } catch (const cumulet::Error& e) {
    EXPECT_EQ(e.code(), cumulet::ErrorCode::cancelled);
  }
  cumulet::Progress whole;
  (void)import_frame(path(), {}, {}, &whole);
  EXPECT_NEAR(whole.fraction(), 1.0, 1e-9);
}

}  // namespace
