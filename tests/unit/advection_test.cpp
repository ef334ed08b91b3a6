// Advection of frames along their velocity, compared with closed forms.

#include "volume/advection.hpp"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <glm/gtc/type_ptr.hpp>
#include <numbers>
#include <numeric>

#include "base/error.hpp"
#include "support/folder.hpp"
#include "support/vdb_files.hpp"
#include "support/volumes.hpp"
#include "volume/bricks.hpp"
#include "volume/frame_import.hpp"

namespace {

using namespace cumulet;
using glm::dvec3;
using glm::ivec3;
using test::value_at;
using volume::advect;
using volume::ScalarVolume;
using volume::VolumeFrame;

constexpr ivec3 size(40, 36, 33);
constexpr ivec3 low(-7, 3, 5);
const dvec3 centre = dvec3(low) + 0.5 * dvec3(size - 1);

/// Velocity in voxels per second.
template <class Function>
volume::Velocity velocity(const ivec3& within, const ivec3& from, Function of) {
  volume::Velocity made;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double sign : {1.0, -1.0}) {
      made.parts[2 * static_cast<std::size_t>(axis) + (sign > 0.0 ? 0 : 1)] = test::make_volume(
          within, from, [=](const ivec3& p) { return static_cast<float>(std::max(sign * of(dvec3(p))[axis], 0.0)); });
    }
  }
  return made;
}

double gauss(const dvec3& p, const dvec3& middle, double width) {
  return std::exp(-glm::dot(p - middle, p - middle) / (2.0 * width * width));
}

template <class Function>
ScalarVolume filled(Function of, const ivec3& within = size, const ivec3& from = low) {
  return test::make_volume(within, from, [=](const ivec3& p) { return static_cast<float>(of(dvec3(p))); });
}

double mass(const ScalarVolume& field) {
  double sum = 0.0;
  for (std::size_t i = 0; i < field.brick_values.size(); ++i) sum += field.brick_values[i];
  for (const volume::Tile& tile : field.tiles) sum += double{tile.value} * static_cast<double>(volume::voxels_of(tile));
  return sum;
}

/// Largest deviation of the field from a function within a box.
template <class Function>
double farthest_off(const ScalarVolume& field, const ivec3& from, const ivec3& to, Function of) {
  double most = 0.0;
  for (ivec3 p = from; p.x <= to.x; ++p.x) {
    for (p.y = from.y; p.y <= to.y; ++p.y) {
      for (p.z = from.z; p.z <= to.z; ++p.z) most = std::max(most, std::abs(value_at(field, p) - of(dvec3(p))));
    }
  }
  return most;
}

TEST(Advection, WholeVoxelShiftsAreExactAndLeaveTheBox) {
  VolumeFrame frame{.density = test::noise_volume({24, 20, 17}, low, 3)};
  frame.temperature = test::noise_volume({9, 20, 17}, low + 4, 4);
  frame.velocity = velocity(size, low, [](const dvec3& /*p*/) { return dvec3(12.0, -44.0, 8.0); });
  const VolumeFrame after = advect(frame, 0.25);
  const ivec3 by(3, -11, 2);
  const auto expect_moved = [&](const ScalarVolume& was, const ScalarVolume& is) {
    for (ivec3 p = was.bounds_min - 2; p.x <= was.bounds_max.x + 2; ++p.x) {
      for (p.y = was.bounds_min.y - 2; p.y <= was.bounds_max.y + 2; ++p.y) {
        for (p.z = was.bounds_min.z - 2; p.z <= was.bounds_max.z + 2; ++p.z)
          ASSERT_EQ(value_at(is, p + by), value_at(was, p)) << p.x << ' ' << p.y << ' ' << p.z;
      }
    }
    EXPECT_EQ(is.max_value, was.max_value);
    EXPECT_EQ(is.name, was.name);
  };
  expect_moved(frame.density, after.density);
  expect_moved(*frame.temperature, *after.temperature);
  ASSERT_TRUE(after.velocity);
}

TEST(Advection, SubvoxelShiftsAreTrilinear) {
  // Linear, so that interpolation is exact.
  const auto linear = [](const dvec3& p) { return 100.0 + 2.0 * p.x - p.y + 0.5 * p.z; };
  VolumeFrame frame{.density = filled(linear)};
  frame.velocity = velocity(size, low, [](const dvec3& /*p*/) { return dvec3(-3.0, 1.0, 5.0); });
  for (const double seconds : {0.1, -0.37}) {
    const VolumeFrame after = advect(frame, seconds);
    const double off = farthest_off(after.density, low + 4, low + size - 5,
                                    [&](const dvec3& p) { return linear(p - seconds * dvec3(-3.0, 1.0, 5.0)); });
    EXPECT_LT(off, 2e-3) << seconds;  // a position within 1e-4 voxels of a center counts as the center
  }
}

TEST(Advection, BlobRotatesRigidly) {
  const double turns_a_second = 0.25;
  const double omega = 2.0 * std::numbers::pi * turns_a_second;
  const dvec3 middle = centre + dvec3(8.0, 0.0, 0.0);
  const double width = 3.0;
  VolumeFrame frame{.density = filled([&](const dvec3& p) { return gauss(p, middle, width); })};
  frame.velocity = velocity(size, low, [&](const dvec3& p) {
    const dvec3 r = p - centre;
    return omega * dvec3(-r.y, r.x, 0.0);
  });
  // A quarter turn in one call: second-order steps of two voxels.
  const VolumeFrame after = advect(frame, 1.0);
  const dvec3 there = centre + dvec3(0.0, 8.0, 0.0);
  // Interpolation alone lowers the peak by 3 h^2 / (8 width^2).
  EXPECT_LT(farthest_off(after.density, low, low + size - 1, [&](const dvec3& p) { return gauss(p, there, width); }),
            0.06);
  EXPECT_NEAR(mass(after.density) / mass(frame.density), 1.0, 0.005);
  // Advects back with the original velocity, because the advected velocity points elsewhere.
  const VolumeFrame turned{.density = after.density, .velocity = frame.velocity};
  const VolumeFrame back = advect(turned, -1.0);
  EXPECT_LT(farthest_off(back.density, low, low + size - 1, [&](const dvec3& p) { return gauss(p, middle, width); }),
            0.12);
}

TEST(Advection, DivergenceFreeFlowConservesMass) {
  // Eddies that vanish at the sides.
  const auto phase = [](const dvec3& p) { return std::numbers::pi * (p - dvec3(low)) / dvec3(size - 1); };
  VolumeFrame frame{.density = filled([&](const dvec3& p) { return gauss(p, centre + 5.0, 4.0); })};
  frame.velocity = velocity(size, low, [&](const dvec3& p) {
    const dvec3 a = phase(p);
    return 30.0 * dvec3(std::sin(a.x) * std::cos(a.y) / size.y, -std::cos(a.x) * std::sin(a.y) / size.x, 0.0) *
           double(size.x);
  });
  double before = mass(frame.density);
  for (int step = 0; step < 4; ++step) {
    // Keeps the original velocity, because an advected velocity has divergence.
    frame.density = advect(frame, 1.0 / 24.0).density;
    EXPECT_NEAR(mass(frame.density) / before, 1.0, 0.01) << step;
  }
}

TEST(Advection, StaggeredAndCenteredVelocitiesAgree) {
  openvdb::initialize();
  const double grows = 0.5;  // per second; matter at x moves to x e^(grows t)
  const double width = 4.0;
  const test::Folder folder;
  for (const bool staggered : {false, true}) {
    SCOPED_TRACE(staggered ? "staggered" : "centred");
    auto density = test::fog("density");
    auto flow = openvdb::Vec3SGrid::create();
    flow->setName("vel");
    if (staggered) flow->setGridClass(openvdb::GRID_STAGGERED);
    for (int i = 0; i < 40 * 40 * 40; ++i) {
      const ivec3 p = ivec3(i / 1600, i / 40 % 40, i % 40) - 20;
      const openvdb::Coord at(p.x, p.y, p.z);
      density->tree().setValue(at, static_cast<float>(gauss(dvec3(p), dvec3(5.0, -3.0, 0.0), width)));
      const dvec3 where = dvec3(p) - (staggered ? 0.5 : 0.0);
      flow->tree().setValue(at, openvdb::Vec3s(glm::value_ptr(glm::vec3(0.1 * grows * where))));  // world units
    }
    density->setTransform(openvdb::math::Transform::createLinearTransform(0.1));
    flow->setTransform(density->transformPtr()->copy());
    const auto path = folder / "frame.vdb";
    openvdb::io::File(path.string()).write({density, flow});
    const VolumeFrame frame = volume::import_frame(path, {}, {});
    const double seconds = 0.4;
    const VolumeFrame after = advect(frame, seconds);
    const double off = farthest_off(after.density, ivec3(-18), ivec3(18), [&](const dvec3& p) {
      return gauss(p * std::exp(-grows * seconds), dvec3(5.0, -3.0, 0.0), width);
    });
    EXPECT_LT(off, 0.03);
  }
}

TEST(Advection, ColorKeepsItsValueAtTheEdgeOfTheSmoke) {
  // Red wherever there is smoke, 0 elsewhere.
  VolumeFrame frame{.density =
                        filled([](const dvec3& p) { return std::max(0.0, 1.0 - glm::length(p - centre) / 9.0); })};
  const auto where_smoke_is = [](double value) {
    return filled([=](const dvec3& p) { return glm::length(p - centre) < 9.0 ? value : 0.0; });
  };
  frame.color = std::array{where_smoke_is(0.75), where_smoke_is(0.25), where_smoke_is(0.5)};
  frame.velocity = velocity(size, low, [](const dvec3& /*p*/) { return dvec3(6.5, 3.25, -1.5); });
  const VolumeFrame after = advect(frame, 1.0);
  int seen = 0;
  for (ivec3 p = after.density.bounds_min; p.x <= after.density.bounds_max.x; ++p.x) {
    for (p.y = after.density.bounds_min.y; p.y <= after.density.bounds_max.y; ++p.y) {
      for (p.z = after.density.bounds_min.z; p.z <= after.density.bounds_max.z; ++p.z) {
        if (value_at(after.density, p) <= 0.0F) continue;
        ++seen;
        ASSERT_NEAR(value_at((*after.color)[0], p), 0.75F, 1e-6F);
        ASSERT_NEAR(value_at((*after.color)[1], p), 0.25F, 1e-6F);
      }
    }
  }
  EXPECT_GT(seen, 2000);
}

TEST(Advection, ZeroVelocityChangesNothing) {
  VolumeFrame frame{.density = test::noise_volume(size, low, 5)};
  test::expect_identical(advect(frame, 1.0).density, frame.density);
  frame.velocity = velocity(size, low, [](const dvec3& p) { return p.x < 10.0 ? dvec3(0.0) : dvec3(0.0, 2.0, 0.0); });
  test::expect_identical(advect(frame, 0.0).density, frame.density);
  const VolumeFrame after = advect(frame, 0.7);
  for (ivec3 p = low; p.x < 8; ++p.x) {
    for (p.y = low.y; p.y < low.y + size.y; ++p.y) {
      for (p.z = low.z; p.z < low.z + size.z; ++p.z) ASSERT_EQ(value_at(after.density, p), value_at(frame.density, p));
    }
  }
}

TEST(Advection, TilesAreNotResampled) {
  ScalarVolume density;
  density.name = "density";
  density.bounds_min = ivec3(0);
  density.bounds_max = ivec3(511);
  density.active_voxels = std::uint64_t{512} * 512 * 512;
  density.max_value = 0.5F;
  density.tiles = {{ivec3(0), ivec3(511), 0.5F}};
  VolumeFrame frame{.density = density};
  frame.velocity.emplace();
  for (std::size_t i = 0; i < 6; ++i) {
    frame.velocity->parts[i] = density;
    frame.velocity->parts[i].max_value = frame.velocity->parts[i].tiles[0].value = i == 0 ? 2.5F : 0.0F;
  }
  const VolumeFrame after = advect(frame, 1.0);
  // Only its surface: 6 x 64 x 64 bricks, counted at most twice.
  EXPECT_LT(after.density.brick_origins.size(), std::size_t{50'000});
  EXPECT_EQ(value_at(after.density, {256, 256, 256}), 0.5F);
  EXPECT_EQ(value_at(after.density, {2, 256, 256}), 0.25F);
  EXPECT_EQ(value_at(after.density, {1, 256, 256}), 0.0F);
  EXPECT_EQ(value_at(after.density, {514, 256, 256}), 0.25F);
  EXPECT_NEAR(mass(after.density) / mass(density), 1.0, 1e-9);
}

TEST(Advection, DisplacementIsLimitedTo64Voxels) {
  VolumeFrame frame{.density = filled([](const dvec3& /*p*/) { return 1.0; }, ivec3(8), ivec3(0))};
  frame.velocity = velocity(ivec3(8), ivec3(0), [](const dvec3& /*p*/) { return dvec3(1e4, 0.0, 0.0); });
  const VolumeFrame after = advect(frame, 1.0);
  EXPECT_EQ(after.density.bounds_min, ivec3(64, 0, 0));
  EXPECT_EQ(after.density.bounds_max, ivec3(71, 7, 7));
}

TEST(Advection, IsIdenticalOnOneThreadAndCancellable) {
  VolumeFrame frame{.density = test::noise_volume(size, low, 6)};
  frame.flame = test::noise_volume(size - 9, low + 6, 7);
  frame.velocity = velocity(size, low, [](const dvec3& p) { return 0.3 * dvec3(p.y, -p.z, p.x); });
  const VolumeFrame many = advect(frame, 0.8);
  {
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    const VolumeFrame alone = advect(frame, 0.8);
    test::expect_identical(alone.density, many.density);
    test::expect_identical(*alone.flame, *many.flame);
    for (std::size_t i = 0; i < 6; ++i) test::expect_identical(alone.velocity->parts[i], many.velocity->parts[i]);
  }
  Progress progress;
  progress.cancel();
  try {
    static_cast<void>(advect(frame, 0.8, &progress));
    FAIL() << "it went on";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::cancelled);
  }
}

}  // namespace
