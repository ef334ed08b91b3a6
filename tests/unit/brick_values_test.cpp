// Values that a file stores as half floats stay half floats in memory: half the memory and bit-identical images.

#include "volume/brick_values.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <glm/gtc/packing.hpp>
#include <limits>

#include "support/gl_viewer.hpp"
#include "support/marches.hpp"
#include "support/osmesa_leaks.hpp"
#include "support/volumes.hpp"
#include "volume/frame_import.hpp"
#include "volume/memory.hpp"

namespace {

using namespace cumulet;
using volume::BrickValues;

TEST(BrickValues, EveryHalfFloatRoundTrips) {
  for (std::uint32_t bits = 0; bits < 0x7c00U; ++bits) {
    const auto half = static_cast<std::uint16_t>(bits);
    const float value = glm::unpackHalf1x16(half);
    ASSERT_EQ(volume::value_of(half), value) << bits;
    ASSERT_EQ(volume::exact_half(value), half) << bits;
    // The neighboring float is not a half.
    if (bits > 0) {
      ASSERT_FALSE(volume::exact_half(std::nextafter(value, 0.0F))) << bits;
    }
    ASSERT_FALSE(volume::exact_half(std::nextafter(value, 1e30F))) << bits;
  }
  for (const float value : {65536.0F, 0.1F, 1e-9F, std::numeric_limits<float>::max(),
                            std::numeric_limits<float>::denorm_min(), std::numeric_limits<float>::min()})
    EXPECT_FALSE(volume::exact_half(value)) << value;
}

volume::ScalarVolume imported(std::vector<float> values) {
  const std::vector<std::int32_t> origins{0, 0, 0, 8, 0, 0};
  volume::SparseVoxels voxels;
  voxels.brick_origins = origins;
  voxels.brick_values = values;
  voxels.index_to_world = glm::dmat4(1.0);
  return volume::import_sparse(voxels, "made", {});
}

TEST(BrickValues, AreStoredAsHalfFloatsIfAllFit) {
  std::vector<float> values(1024);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<float>(i) / 1024.0F;
  values[3] = -1.0F;  // counts as 0
  const volume::ScalarVolume halves = imported(values);
  EXPECT_TRUE(halves.brick_values.are_halves());
  EXPECT_EQ(halves.brick_values.bytes(), 2048U);
  values[3] = 0.0F;
  EXPECT_EQ(halves.brick_values, BrickValues(values));

  values[700] = 0.1F;
  const volume::ScalarVolume floats = imported(values);
  EXPECT_FALSE(floats.brick_values.are_halves());
  EXPECT_EQ(floats.brick_values.bytes(), 4096U);
  EXPECT_EQ(floats.brick_values, BrickValues(values));
  EXPECT_NE(floats.brick_values, halves.brick_values);

  BrickValues changed = halves.brick_values;
  changed.as_floats()[5] = 0.1F;
  EXPECT_EQ(changed[5], 0.1F);
  EXPECT_EQ(changed[6], 6.0F / 1024.0F);
  EXPECT_EQ(changed.bytes(), 4096U);
}

TEST(BrickValues, HalfFloatFileUsesHalfTheMemory) {
  const auto file = std::filesystem::path(CUMULET_SHARED_DATA) / "vdb" / "embergen_fire_a" / "embergen_fire_a_0060.vdb";
  if (!std::filesystem::exists(file)) GTEST_SKIP() << file;
  const volume::VolumeFrame frame = volume::import_frame(file, {}, {});
  for (const volume::ScalarVolume& field : {*frame.flame, *frame.temperature}) {
    EXPECT_TRUE(field.brick_values.are_halves()) << field.name;
    EXPECT_EQ(field.brick_values.bytes(), field.brick_origins.size() * 1024) << field.name;
    EXPECT_GT(field.brick_origins.size(), 100U);
  }
}

class HalfFloatImages : public test::StillTest {};
CUMULET_ON_BACKENDS(HalfFloatImages);

TEST_P(HalfFloatImages, AreBitIdenticalToFloatImages) {
  volume::ScalarVolume floats = test::noise_volume({40, 30, 35}, glm::ivec3(-3, 0, 5), 4);
  std::vector<std::uint16_t> halves;
  for (float& value : floats.brick_values.as_floats()) {
    halves.push_back(glm::packHalf1x16(value));
    value = glm::unpackHalf1x16(halves.back());
  }
  volume::ScalarVolume same = floats;
  same.brick_values = halves;
  const auto frame_of = [](const volume::ScalarVolume& field) {
    volume::VolumeFrame frame{.density = field};
    frame.temperature = field;
    frame.flame = field;
    frame.color = {field, field, field};
    return std::make_shared<const viewer::VolumeAsset>(std::move(frame));
  };
  viewer::Medium medium;
  medium.density_scale = 0.3;
  medium.field_emission.blackbody = 1.0;
  for (const test::MarchKind& kind : test::march_kinds) {
    const auto picture = [&](const volume::ScalarVolume& field) {
      const auto still = make();
      const viewer::VolumeAssetPtr asset = frame_of(field);
      still->viewer().camera()->frame(asset->bounds(), 1.0);
      still->set_volume(asset);
      still->set_medium(medium);
      still->set_grid(test::settings_of(kind, 0.1));
      return test::render(*still, {24, 24, 4, 1, render::View::shaded}).pixels;
    };
    const auto a = picture(floats);
    const auto b = picture(same);
    ASSERT_EQ(a.size(), b.size());
    EXPECT_EQ(std::memcmp(a.data(), b.data(), a.size() * sizeof a[0]), 0);
    EXPECT_NE(a.front(), a[12 * 24 + 12]) << "it shows the volume";
  }
}

}  // namespace
