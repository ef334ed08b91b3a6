// Frame interpolation: blended, and advected along the velocities. Compared with sums and with frames of a simulation.

#include "volume/between.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <set>
#include <string>
#include <vector>

#include "support/volumes.hpp"
#include "volume/advection.hpp"
#include "volume/bricks.hpp"
#include "volume/frame_import.hpp"

namespace {

using namespace cumulet;
using glm::ivec3;
using test::value_at;
using volume::between;
using volume::blend;
using volume::ScalarVolume;
using volume::VolumeFrame;

template <class Call>
void for_each_voxel(const ivec3& from, const ivec3& to, Call call) {
  for (ivec3 p = from; p.x <= to.x; ++p.x) {
    for (p.y = from.y; p.y <= to.y; ++p.y) {
      for (p.z = from.z; p.z <= to.z; ++p.z) call(p);
    }
  }
}

TEST(FrameInterpolation, DensityIsLinearAndOtherFieldsAreDensityWeighted) {
  VolumeFrame a{.density = test::noise_volume({20, 17, 12}, {-3, 2, 1}, 1)};
  VolumeFrame b{.density = test::noise_volume({14, 20, 20}, {4, -2, 0}, 2)};
  a.flame = test::noise_volume({9, 9, 9}, {0, 3, 2}, 3);
  const auto colored = [](const ScalarVolume& density, float value) {
    return test::make_volume(density.bounds_max - density.bounds_min + 1, density.bounds_min,
                             [=](const ivec3& /*p*/) { return value; });
  };
  a.color = std::array{colored(a.density, 0.8F), colored(a.density, 0.2F), colored(a.density, 0.5F)};
  b.color = std::array{colored(b.density, 0.1F), colored(b.density, 0.6F), colored(b.density, 0.5F)};
  const double part = 0.3;
  const VolumeFrame mixed = blend(a, b, part);
  for_each_voxel(ivec3(-5), ivec3(26), [&](const ivec3& p) {
    const double first = (1.0 - part) * value_at(a.density, p);
    const double second = part * value_at(b.density, p);
    ASSERT_EQ(value_at(mixed.density, p), static_cast<float>(first + second));
    ASSERT_EQ(value_at(*mixed.flame, p), static_cast<float>((1.0 - part) * value_at(*a.flame, p)));
    if (first + second == 0.0) return;
    ASSERT_NEAR(value_at((*mixed.color)[0], p), (first * 0.8 + second * 0.1) / (first + second), 1e-6);
    ASSERT_NEAR(value_at((*mixed.color)[2], p), 0.5, 1e-6);
  });
  test::expect_identical(blend(a, b, 0.0).density, a.density);
  test::expect_identical(blend(a, b, 1.0).density, b.density);
  // Blending a frame with itself returns the frame.
  const VolumeFrame same = blend(a, a, part);
  for_each_voxel(a.density.bounds_min, a.density.bounds_max,
                 [&](const ivec3& p) { ASSERT_EQ(value_at(same.density, p), value_at(a.density, p)); });
}

TEST(FrameInterpolation, FramesOfDifferentResolutionAreResampled) {
  VolumeFrame a{.density = test::noise_volume({12, 12, 12}, {0, 0, 0}, 1)};
  VolumeFrame b{.density = test::noise_volume({12, 12, 12}, {0, 0, 0}, 2)};
  b.density.index_to_world[3] = glm::dvec4(3.0, -2.0, 5.0, 1.0);  // offset by whole voxels: exact
  const VolumeFrame mixed = blend(a, b, 0.5);
  EXPECT_EQ(mixed.density.index_to_world, a.density.index_to_world);
  for_each_voxel(ivec3(-4), ivec3(20), [&](const ivec3& p) {
    ASSERT_EQ(value_at(mixed.density, p),
              static_cast<float>(0.5 * value_at(a.density, p) + 0.5 * value_at(b.density, p - ivec3(3, -2, 5))));
  });
}

TEST(FrameInterpolation, UniformMotionIsExact) {
  // A blob that moves 6 voxels in a quarter of a second.
  const auto frame_at = [](double x) {
    VolumeFrame frame{.density = test::make_volume({40, 20, 20}, {0, 0, 0}, [=](const ivec3& p) {
                        const glm::dvec3 r = glm::dvec3(p) - glm::dvec3(x, 10.0, 10.0);
                        return static_cast<float>(std::exp(-glm::dot(r, r) / 18.0));
                      })};
    frame.velocity.emplace();
    frame.velocity->parts[0] = test::make_volume({40, 20, 20}, {0, 0, 0}, [](const ivec3& /*p*/) { return 24.0F; });
    return frame;
  };
  const VolumeFrame a = frame_at(14.0);
  const VolumeFrame b = frame_at(20.0);
  const VolumeFrame wanted = frame_at(17.0);
  double most = 0.0;
  double max_blended = 0.0;
  const VolumeFrame found = between(a, b, 0.5, 0.25);
  const VolumeFrame blended = blend(a, b, 0.5);
  for_each_voxel(ivec3(4, 0, 0), ivec3(35, 19, 19), [&](const ivec3& p) {
    most = std::max(most, std::abs(double{value_at(found.density, p)} - value_at(wanted.density, p)));
    max_blended = std::max(max_blended, std::abs(double{value_at(blended.density, p)} - value_at(wanted.density, p)));
  });
  EXPECT_LT(most, 1e-5);
  EXPECT_GT(max_blended, 0.3);
  // Without a velocity, the frames are blended.
  VolumeFrame still = b;
  still.velocity.reset();
  test::expect_identical(between(a, still, 0.5, 0.25).density, blend(a, still, 0.5).density);
}

/// Relative squared error of a field, over the bricks that either field has.
class Deviation {
 public:
  void add(const ScalarVolume& wanted, const ScalarVolume& found) {
    std::set<std::array<int, 3>> bricks;
    for (const ScalarVolume* field : {&wanted, &found}) {
      for (const ivec3& origin : field->brick_origins) bricks.insert({origin.x, origin.y, origin.z});
    }
    volume::BrickValues::Brick room{};
    for (const auto& [x, y, z] : bricks) {
      const ivec3 origin(x, y, z);
      volume::BrickValues::Brick a{};
      volume::BrickValues::Brick b{};
      for (auto [field, out] : {std::pair{&wanted, &a}, std::pair{&found, &b}}) {
        if (const float* values = volume::find_brick(*field, origin, room))
          std::copy(values, values + volume::brick_voxels, out->begin());
      }
      for (std::size_t i = 0; i < a.size(); ++i) {
        off_ += (double{a[i]} - b[i]) * (double{a[i]} - b[i]);
        all_ += double{a[i]} * a[i];
      }
    }
  }
  [[nodiscard]] double relative() const { return off_ / all_; }

 private:
  double off_ = 0.0;
  double all_ = 0.0;
};

// Interpolates every second frame of a simulation from its neighbors. Blender's Mantaflow writes voxels per second
// where units per second are expected. Of voxel sizes from 0.005 to 0.05 units, 0.0222 gives one of the smallest
// errors.
TEST(FrameInterpolation, AdvectionIsMoreAccurateThanBlending) {
  const std::filesystem::path folder = std::filesystem::path(CUMULET_SHARED_DATA) / "vdb/mantaflow_fire";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << folder << " is not there";
  const auto read = [&](int frame) {
    return volume::import_frame(folder / ("fluid_data_00" + std::to_string(frame) + ".vdb"), {}, {});
  };
  constexpr double voxel = 1.0 / 45.0;
  constexpr double seconds = voxel * 2.0 / 24.0;
  struct Way {
    const char* name;
    std::function<VolumeFrame(const VolumeFrame&, const VolumeFrame&)> make;
    Deviation deviation = {};
  };
  std::vector<Way> ways = {
      {"held", [](const VolumeFrame& a, const VolumeFrame& /*b*/) { return a; }},
      {"blended", [](const VolumeFrame& a, const VolumeFrame& b) { return blend(a, b, 0.5); }},
      {"on", [](const VolumeFrame& a, const VolumeFrame& /*b*/) { return advect(a, 0.5 * seconds); }},
      {"back", [](const VolumeFrame& /*a*/, const VolumeFrame& b) { return advect(b, -0.5 * seconds); }},
      {"both", [](const VolumeFrame& a, const VolumeFrame& b) { return between(a, b, 0.5, seconds); }}};
  VolumeFrame before = read(14);
  for (int frame = 15; frame <= 17; frame += 2) {
    const VolumeFrame wanted = read(frame);
    VolumeFrame after = read(frame + 1);
    for (Way& way : ways) way.deviation.add(wanted.density, way.make(before, after).density);
    before = std::move(after);
  }
  for (const Way& way : ways) RecordProperty(way.name, std::to_string(way.deviation.relative()));
  for (const Way& way : ways) std::printf("%s: relMSE %.5f\n", way.name, way.deviation.relative());
  EXPECT_LT(ways[1].deviation.relative(), ways[0].deviation.relative());
  EXPECT_LT(ways[4].deviation.relative(), 0.7 * ways[1].deviation.relative());
  EXPECT_LT(ways[4].deviation.relative(), ways[2].deviation.relative());
  EXPECT_LT(ways[4].deviation.relative(), ways[3].deviation.relative());
}

}  // namespace
