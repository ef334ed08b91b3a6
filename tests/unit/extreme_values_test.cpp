// Volumes whose values are far from 1 and media of extreme optical depth: cells, images and log messages.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "assets/volume_asset.hpp"
#include "jobs/build_grid.hpp"
#include "scene/space.hpp"
#include "support/gl_viewer.hpp"
#include "support/vdb_files.hpp"
#include "support/volumes.hpp"
#include "volume/memory.hpp"
#include "volume/value_unit.hpp"

namespace {

using namespace cumulet;
using test::Messages;
using volume::DenseVoxels;
using volume::MemoryField;
using volume::ScalarVolume;

// ---- Units

TEST(ValueUnit, IsOneForOrdinaryValues) {
  for (const float value : {0.0F, 1e-9F, 1.0F, 65504.0F, 4e9F}) EXPECT_EQ(volume::value_unit(value), 1.0) << value;
}

TEST(ValueUnit, IsThePowerOfTwoBelow) {
  for (const float value : {1e-45F, 1e-38F, 1e-25F, 1e22F, 1e30F}) {
    const double unit = volume::value_unit(value);
    EXPECT_GE(value / unit, 1.0);
    EXPECT_LT(value / unit, 2.0);
    EXPECT_EQ(std::exp2(std::ilogb(value)), unit);
  }
}

// ---- Cells

ScalarVolume times(ScalarVolume volume, double factor) {
  for (float& value : volume.brick_values.as_floats()) value = static_cast<float>(value * factor);
  for (volume::Tile& tile : volume.tiles) tile.value = static_cast<float>(tile.value * factor);
  volume.background = static_cast<float>(volume.background * factor);
  volume.max_value = static_cast<float>(volume.max_value * factor);
  return volume;
}

// Noise multiplied by `factor`. colored: with moving colors and an anisotropy field.
viewer::VolumeAssetPtr noise_times(double factor, bool colored) {
  const glm::ivec3 size(40);
  volume::VolumeFrame frame{.density = times(test::noise_volume(size, glm::ivec3(0), 3), factor)};
  if (colored) {
    const auto field = [&](float scale) {
      return test::make_volume(size, glm::ivec3(0),
                               [=](const glm::ivec3& p) { return scale * static_cast<float>(p.x + 2 * p.y + 1); });
    };
    const ScalarVolume none = field(0.0F);
    frame.color = {field(0.005F), field(0.004F), field(0.008F)};
    frame.anisotropy = {field(0.005F), none};
    frame.velocity.emplace(volume::Velocity{{field(1.0F), none, field(2.0F), none, none, field(0.5F)}});
  }
  return std::make_shared<const viewer::VolumeAsset>(std::move(frame));
}

viewer::BuildSettings settings_for(double factor, viewer::BuildOn on = viewer::BuildOn::cpu) {
  viewer::BuildSettings settings;
  settings.on = on;
  settings.refine.criterion = grid::Criterion::transmittance;
  settings.refine.threshold = 0.05;
  settings.refine.density_scale = 0.5 / factor;
  return settings;
}

template <class T>
bool same_bits(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

void expect_same_grid(const grid::TetGrid& a, const grid::TetGrid& b) {
  EXPECT_TRUE(same_bits(a.cells, b.cells)) << a.cells.size() << " and " << b.cells.size();
  EXPECT_TRUE(same_bits(a.channels.color, b.channels.color));
  EXPECT_TRUE(same_bits(a.channels.anisotropy, b.channels.anisotropy));
  EXPECT_TRUE(same_bits(a.channels.velocity, b.channels.velocity));
}

// A factor that is a power of two changes no mantissa, so it changes no cell.
TEST(ExtremeValues, GiveTheSameCellsAsOrdinaryOnes) {
  Progress progress;
  for (const bool colored : {false, true}) {
    const auto plain = viewer::build_grid({}, noise_times(1.0, colored), settings_for(1.0), progress).source;
    ASSERT_GT(plain->grid->cells.size(), 2000U);
    EXPECT_EQ(plain->value_unit, 1.0);
    for (const int exponent : {95, 60, -80, -100}) {
      SCOPED_TRACE(exponent);
      const double factor = std::exp2(exponent);
      const auto asset = noise_times(factor, colored);
      const auto found = viewer::build_grid({}, asset, settings_for(factor), progress).source;
      expect_same_grid(*found->grid, *plain->grid);
      EXPECT_NEAR(found->value_unit * found->max_value, factor * plain->max_value, 1e-6 * factor);
      EXPECT_NEAR(found->optical_depth / plain->optical_depth / factor, 1.0, 1e-12);
    }
  }
}

TEST(ExtremeValues, GiveTheSameGpuBuiltCellsAsOrdinaryOnes) {
  Progress progress;
  const auto lattice = [&](double factor) {
    const auto settings = settings_for(factor, viewer::BuildOn::gpu);
    return viewer::build_grid({}, noise_times(factor, true), settings, progress).source->plan->lattice;
  };
  const auto plain = lattice(1.0);
  for (const int exponent : {95, -100}) {
    const auto found = lattice(std::exp2(exponent));
    EXPECT_TRUE(same_bits(found->own.values, plain->own.values));
    EXPECT_TRUE(same_bits(found->own.nodes, plain->own.nodes));
  }
}

// Values in the denormal range are refined too.
TEST(ExtremeValues, AreRefinedWithDenormalFloats) {
  Progress progress;
  const auto cells = [&](double factor) {
    return viewer::build_grid({}, noise_times(factor, false), settings_for(factor), progress)
        .source->grid->cells.size();
  };
  EXPECT_NEAR(static_cast<double>(cells(1e-41)) / static_cast<double>(cells(1.0)), 1.0, 0.02);
}

TEST(ExtremeValues, MayResultFromARamp) {
  Progress progress;
  const auto asset = noise_times(1.0, true);
  const auto built = [&](float most) {
    viewer::BuildSettings settings = settings_for(most);
    settings.density_ramp = volume::Ramp({{0.0F, 0.0F}, {2.0F, 2.0F * most}});
    return viewer::build_grid({}, asset, settings, progress).source;
  };
  expect_same_grid(*built(0x1p90F)->grid, *built(1.0F)->grid);
  expect_same_grid(*built(0x1p-90F)->grid, *built(1.0F)->grid);
}

TEST(ExtremeValues, GiveASuitableDensityScale) {
  const auto scale = [](double factor) { return *noise_times(factor, false)->coarse().suggest_density_scale(); };
  for (const double factor : {1e29, 1e22, 1e-25, 1e-38, 1e-43})
    EXPECT_NEAR(scale(factor) * factor / scale(1.0), 1.0, 0.02) << factor;
}

// A larger density scale would not change the image, so refinement does not become coarser for it.
TEST(ExtremeValues, WorkWithAnyDensityScale) {
  Progress progress;
  const auto asset = noise_times(1.0, false);
  viewer::BuildSettings settings = settings_for(1.0);
  for (const double scale : {1e10, 1e30, 1e60}) {
    settings.refine.density_scale = scale;
    EXPECT_GT(viewer::build_grid({}, asset, settings, progress).source->grid->cells.size(), 2000U) << scale;
  }
}

// ---- Values that count as 0

struct Filled {
  glm::ivec3 size{20, 16, 16};
  std::vector<float> values = std::vector<float>(20 * 16 * 16, 0.5F);
  Filled() {
    for (std::size_t i = 0; i < values.size(); ++i) values[i] += 0.01F * static_cast<float>(i % 7);
  }
  [[nodiscard]] MemoryField as(volume::Channel channel) const { return {channel, DenseVoxels{values, size}}; }
};

constexpr float largest_float = std::numeric_limits<float>::max();

TEST(ExtremeValues, FillValuesCountAsZeroAndAreCounted) {
  for (const float fill : {9.97e36F, 1.1e30F, largest_float, -9.97e36F, -largest_float}) {
    SCOPED_TRACE(fill);
    Filled field;
    // In a whole brick, and in one that extends beyond the bounds.
    for (const std::size_t i : {0U, 1U, 2U, 19U, 4000U, 5119U}) field.values[i] = fill;
    Messages messages;
    const ScalarVolume volume = volume::import_dense({field.values, field.size}, "sea", messages.log);
    EXPECT_EQ(volume.huge_voxels, 6U);
    EXPECT_EQ(volume.negative_voxels + volume.non_finite_voxels, 0U);
    EXPECT_FLOAT_EQ(volume.max_value, 0.56F);
    EXPECT_EQ(test::value_at(volume, {1, 0, 0}), 0.0F);
    EXPECT_EQ(messages.warnings, std::vector<std::string>{"sea: 6 voxels above 1e30 (fill values) read as 0"});
  }
}

TEST(ExtremeValues, LargestFiniteValuesAreKept) {
  Filled field;
  field.values[7] = 1e30F;
  Messages messages;
  const ScalarVolume volume = volume::import_dense({field.values, field.size}, "sea", messages.log);
  EXPECT_EQ(volume.max_value, 1e30F);
  EXPECT_TRUE(messages.warnings.empty());
}

TEST(ExtremeValues, FillValuesOfTilesAndBackgroundsCountAsZero) {
  volume::SparseVoxels voxels;
  const std::array<std::int32_t, 3> origin{0, 0, 0};
  const std::vector<float> values(512, 1.0F);
  voxels.brick_origins = origin;
  voxels.brick_values = values;
  voxels.tiles = {{{{8, 0, 0}, {15, 7, 7}, 1e31F}, true}, {{{24, 0, 0}, {31, 7, 7}, 2.0F}, true}};
  voxels.background = 9.97e36F;
  Messages messages;
  const ScalarVolume volume = volume::import_sparse(voxels, "sea", messages.log);
  EXPECT_EQ(volume.huge_voxels, 1024U);
  EXPECT_EQ(volume.max_value, 2.0F);
  EXPECT_EQ(volume.background, 0.0F);
  EXPECT_EQ(messages.warnings.size(), 1U);
}

TEST(ExtremeValues, FillValuesOfEachFieldCountAsZero) {
  using volume::Channel;
  Filled field;
  field.values[100] = 9.97e36F;
  field.values[101] = -9.97e36F;
  std::vector<MemoryField> fields;
  for (const Channel channel :
       {Channel::density, Channel::temperature, Channel::flame, Channel::red, Channel::green, Channel::blue,
        Channel::anisotropy, Channel::velocity_x, Channel::velocity_y, Channel::velocity_z})
    fields.push_back(field.as(channel));
  Messages messages;
  const volume::VolumeFrame frame = volume::import_fields(fields, "sea", messages.log);
  for (const ScalarVolume* part : frame.fields()) EXPECT_LE(part->max_value, 0.6F) << part->name;
  ASSERT_EQ(messages.warnings.size(), fields.size());
  for (const std::string& warning : messages.warnings) {
    EXPECT_HAS(warning, ": 2 voxels above 1e30");
  }
}

// ---- Kelvin

viewer::VolumeAssetPtr with_temperature(float most, std::optional<double> of_sequence = {}) {
  volume::VolumeFrame frame{.density = test::noise_volume(glm::ivec3(16), glm::ivec3(0), 3)};
  frame.temperature = times(frame.density, double{most} / frame.density.max_value);
  frame.temperature_scale = of_sequence;
  return std::make_shared<const viewer::VolumeAsset>(std::move(frame));
}

TEST(KelvinTemperatures, AreDetectedByTheirValues) {
  for (const float relative : {0.5F, 1.0F, 3.0F, 20.0F})
    EXPECT_EQ(with_temperature(relative)->temperature_scale(), 1500.0);
  for (const float kelvin : {293.0F, 3000.0F, 1e5F}) EXPECT_EQ(with_temperature(kelvin)->temperature_scale(), 1.0);
  EXPECT_EQ(with_temperature(5.0F, 1.0)->temperature_scale(), 1.0) << "as the sequence has it";
}

TEST(KelvinTemperatures, ExplicitScaleOverridesDetection) {
  const auto hot = with_temperature(2000.0F);
  EXPECT_EQ(hot->emission_by({.blackbody = 1.0}).temperature_scale, 1.0);
  EXPECT_EQ(hot->emission_by({.temperature_scale = 700.0, .blackbody = 1.0}).temperature_scale, 700.0);
  // With a ramp, values are not detected as kelvin.
  const volume::Ramp to_relative({{0.0F, 0.0F}, {2000.0F, 1.3F}});
  EXPECT_EQ(hot->emission_by({.blackbody = 1.0, .temperature_ramp = to_relative}).temperature_scale, 1500.0);
}

TEST(KelvinTemperatures, EmitLikeRelativeTemperatures) {
  Progress progress;
  const auto light = [&](float most) {
    const auto channels = with_temperature(most)->channels({}, {.blackbody = 1.0}, false, progress);
    return channels.emission->max_value();
  };
  EXPECT_NEAR(light(1800.0F) / light(1.2F), 1.0, 1e-4);
  // At room temperature the emission is negligible.
  EXPECT_LT(light(293.0F), 2e-3F * light(1800.0F));
}

// ---- Images

class ExtremeValueRendering : public test::ViewerTest {
 protected:
  // White furnace test: a white medium under a white sky is invisible at any density.
  static test::Picture furnace(test::Still& still, double density_scale) {
    still.set_light({0.0F, 0.0F, glm::vec3(0.0F), glm::vec3(1.0F)});
    still.set_medium({density_scale, glm::vec3(1.0F), {}, 0});
    still.set_camera(test::camera_at({20.0, 20.0, 140.0}, {20.0, 20.0, 20.0}, 16.0));
    return test::render(still, {16, 16, 16, 3, render::View::shaded});
  }
};
CUMULET_ON_BACKENDS(ExtremeValueRendering);

TEST_P(ExtremeValueRendering, OpaqueWhiteMediaConvergeAndConserveEnergy) {
  const auto still = make();
  still->set_volume(test::noise_volume(glm::ivec3(40), glm::ivec3(0), 3));
  for (const auto march : {scene::March::tet, scene::March::dense, scene::March::brick}) {
    viewer::GridSettings grid;
    grid.build.march = march;
    still->set_grid(grid);
    for (const double scale : {1e5, 1e30, 1e60}) {
      SCOPED_TRACE(testing::Message() << static_cast<int>(march) << ", " << scale);
      EXPECT_NEAR(furnace(*still, scale).mean().x, 1.0, 0.03);
    }
  }
}

TEST_P(ExtremeValueRendering, TetrahedralGridsMatchVoxelGrids) {
  for (const double factor : {1e29, 1e-25, 1e-41}) {
    SCOPED_TRACE(factor);
    std::vector<test::Picture> pictures;
    for (const bool voxels : {false, true}) {
      const auto still = make();
      still->set_volume(noise_times(factor, false));
      viewer::GridSettings grid;
      grid.build.march = voxels ? scene::March::dense : scene::March::tet;
      still->set_grid(grid);
      still->set_light({30.0F, 30.0F, glm::vec3(3.0F), glm::vec3(0.3F)});
      still->set_medium({0.4 / factor, glm::vec3(0.9F), {}, 0});
      still->set_camera(test::camera_at({20.0, 20.0, 140.0}, {20.0, 20.0, 20.0}, 25.0));
      pictures.push_back(test::render(*still, {16, 16, 64, 3, render::View::shaded}));
    }
    EXPECT_NEAR(pictures[0].mean().x / pictures[1].mean().x, 1.0, 0.03);
    EXPECT_NEAR(pictures[0].mean().w / pictures[1].mean().w, 1.0, 0.03);
    EXPECT_GT(pictures[1].mean().w, 0.3);
  }
}

}  // namespace
