// Emission, color and anisotropy of the medium: fields converted to channels, and the cells' values.

#include "scene/channels.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "base/error.hpp"
#include "base/luminance.hpp"
#include "grid/cell.hpp"
#include "grid/grid_builder.hpp"
#include "light/black_body.hpp"
#include "support/fields.hpp"
#include "support/volumes.hpp"

namespace {

using namespace cumulet;
using cumulet::test::anisotropy;
using cumulet::test::colors;
using cumulet::test::field;
using cumulet::test::nothing;
using glm::ivec3;
using glm::vec3;
using volume::ScalarVolume;
using volume::VolumeFrame;

// ---- Fields converted to radiance

float radiance_at(const grid::RgbField::Components& radiance, int component, const ivec3& p) {
  return test::value_at(radiance[static_cast<std::size_t>(component)], p);
}

TEST(Emission, IsZeroWithoutEmissiveFields) {
  VolumeFrame frame{.density = field(ivec3(8), ivec3(0), 1.0F)};
  EXPECT_FALSE(scene::emission_of(frame, {.blackbody = 1.0}));
  frame.temperature = field(ivec3(8), ivec3(0), 1.0F);
  EXPECT_FALSE(scene::emission_of(frame, {})) << "temperature alone does not shine at intensity 0";
  EXPECT_FALSE(scene::emission_of(frame, {.temperature_scale = 99.0, .blackbody = 1.0})) << "dark below 100 K";
  EXPECT_TRUE(scene::emission_of(frame, {.blackbody = 1.0}));
  frame.flame = field(ivec3(8), ivec3(0), 1.0F);
  EXPECT_TRUE(scene::emission_of(frame, {}));
  EXPECT_FALSE(scene::emission_of(frame, {.flame_strength = 0.0}));
}

TEST(Emission, IsTheSumOfFlameAndBlackBody) {
  VolumeFrame frame{.density = nothing()};
  frame.flame = field({8, 8, 8}, ivec3(0), 2.0F);
  frame.temperature = field({12, 8, 8}, {4, 0, 0}, 1.5F);
  const scene::Emission emission{.flame_strength = 3.0,
                                 .flame_color = {1.0F, 0.5F, 0.25F},
                                 .temperature_scale = 1200.0,
                                 .temperature_offset = 200.0,
                                 .blackbody = 0.5,
                                 .blackbody_tint = {1.0F, 2.0F, 1.0F}};
  const auto radiance = scene::emission_of(frame, emission);
  ASSERT_TRUE(radiance);
  const vec3 hot = vec3(light::black_body_color(2000.0) * light::black_body_radiance(2000.0, 0.5)) * vec3(1, 2, 1);
  for (int i = 0; i < 3; ++i) {
    const float flame = 6.0F * emission.flame_color[i];
    EXPECT_FLOAT_EQ(radiance_at(*radiance, i, {1, 1, 1}), flame);
    EXPECT_NEAR(radiance_at(*radiance, i, {5, 1, 1}), flame + hot[i], 2e-3F * hot[i] + 1e-6F);
    EXPECT_NEAR(radiance_at(*radiance, i, {12, 7, 7}), hot[i], 2e-3F * hot[i] + 1e-12F);
  }
}

TEST(Emission, IsFiniteForAnyInput) {
  VolumeFrame frame{.density = nothing()};
  frame.flame = field(ivec3(8), ivec3(0), 1e30F);
  frame.temperature = field(ivec3(8), ivec3(0), 1e30F);
  const scene::Emission emission{.flame_strength = 1e30,
                                 .flame_color = vec3(1e30F, 0.0F, 1.0F),
                                 .temperature_scale = 1e30,
                                 .blackbody = 1e30,
                                 .blackbody_tint = vec3(1e30F, 0.0F, 1.0F)};
  const auto radiance = scene::emission_of(frame, emission);
  ASSERT_TRUE(radiance);
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(std::isfinite(radiance_at(*radiance, i, {1, 1, 1})));
  EXPECT_EQ(radiance_at(*radiance, 1, {1, 1, 1}), 0.0F);
  EXPECT_GT(radiance_at(*radiance, 0, {1, 1, 1}), 1e11F);
}

TEST(Emission, TilesAndBackgroundsEmit) {
  VolumeFrame frame{.density = nothing()};
  ScalarVolume& flame = frame.flame.emplace(field({8, 8, 8}, ivec3(0), 1.0F));
  flame.bounds_max = {39, 7, 7};
  flame.tiles.push_back({{16, 0, 0}, {23, 7, 7}, 2.0F});
  flame.background = 0.5F;
  const auto radiance = scene::emission_of(frame, {});
  ASSERT_TRUE(radiance);
  EXPECT_EQ(radiance_at(*radiance, 0, {3, 3, 3}), 1.0F);
  EXPECT_EQ(radiance_at(*radiance, 1, {20, 3, 3}), 2.0F);
  EXPECT_EQ(radiance_at(*radiance, 2, {30, 3, 3}), 0.5F);
  EXPECT_EQ((*radiance)[0].bounds_max.x, 39);
  flame.bounds_max = ivec3(1023);
  EXPECT_THROW(scene::emission_of(frame, {}), Error) << "more bricks than anything without detail is worth";
}

// ---- Colors

// Constant colors and densities have no bricks, only tiles and backgrounds, and may be large.
TEST(ColorField, MayBeConstantOverALargeBox) {
  VolumeFrame frame{.density = field(ivec3(16), ivec3(0), 1.0F)};
  frame.color = colors(ivec3(8), ivec3(0), [](const ivec3& /*p*/) { return vec3(2.0F, 0.5F, 0.0F); });
  for (ScalarVolume& component : *frame.color) {
    component.bounds_max = ivec3(1023);
    component.background = component.max_value;
  }
  const auto scattering = scene::scattering_of(frame);
  ASSERT_TRUE(scattering);
  EXPECT_EQ(radiance_at(*scattering, 0, {12, 12, 12}), 1.0F) << "no more than all scatters";
  EXPECT_EQ(radiance_at(*scattering, 1, {12, 12, 12}), 0.5F);
}

TEST(ColorField, CellColorIsTheDensityWeightedMean) {
  VolumeFrame frame{.density =
                        test::make_volume(ivec3(16), ivec3(0), [](const ivec3& p) { return p.x < 5 ? 3.0F : 0.5F; })};
  EXPECT_FALSE(scene::scattering_of(frame));
  frame.color = colors(ivec3(16), ivec3(0),
                       [](const ivec3& p) { return vec3(p.x < 5 ? 1.0F : 0.25F, p.y < 9 ? 0.5F : 0.0F, 0.125F); });
  const grid::Cube cube = grid::fit_cube(frame.density);
  const grid::Statistics statistics(frame.density, cube);
  grid::Channels channels;
  channels.scattering = std::make_shared<const grid::RgbField>(*scene::scattering_of(frame), cube);
  grid::RefineSettings coarse;
  coarse.threshold = 1e9;
  const grid::DiamondSet few(statistics, coarse);
  grid::GridBuilder builder(statistics, few);
  builder.bisect();
  const grid::TetGrid grid = builder.records(grid::CellKind::constant, 1.0F, channels);
  ASSERT_EQ(grid.channels.color.size(), grid.cells.size());
  // Density-weighted color of all cells.
  glm::dvec3 sum(0.0);
  for (std::size_t i = 0; i < grid.cells.size(); ++i) {
    const double volume = 16.0 * 16.0 * 16.0 / 24.0;
    ASSERT_EQ(grid.cells.size(), 24U);
    sum +=
        volume * glm::unpackHalf2x16(grid.cells[i].data.z).x * glm::dvec3(core::cm_cell_color(grid.channels.color[i]));
  }
  const double left = 5.0 * 256.0 * 3.0;
  const double right = 11.0 * 256.0 * 0.5;
  EXPECT_NEAR(sum.x, left + 0.25 * right, 2e-3 * left);
  EXPECT_NEAR(sum.y, 0.5 * 9.0 / 16.0 * (left + right), 2e-3 * left);
  EXPECT_NEAR(sum.z, 0.125 * (left + right), 2e-3 * left);
}

// ---- Anisotropy

struct Cells {
  explicit Cells(const VolumeFrame& frame, const grid::RefineSettings& settings)
      : cube(grid::fit_cube(frame.density)), statistics(frame.density, cube) {
    grid::Channels channels;
    if (auto scattering = scene::scattering_of(frame))
      channels.scattering = std::make_shared<const grid::RgbField>(*std::move(scattering), cube);
    if (auto forward = scene::forward_of(frame))
      channels.forward = std::make_shared<const grid::ScalarField>(*std::move(forward), cube);
    const grid::DiamondSet diamonds(statistics, channels, settings);
    grid::GridBuilder builder(statistics, diamonds);
    builder.bisect();
    made = builder.records(settings.cells, frame.density.max_value, channels);
  }

  grid::Cube cube;
  grid::Statistics statistics;
  grid::TetGrid made;
};

float stored_anisotropy(const grid::TetGrid& grid, std::size_t cell) {
  const auto word = [&](std::size_t i) {
    return i < grid.channels.anisotropy.size() ? std::uint32_t{static_cast<std::uint16_t>(grid.channels.anisotropy[i])}
                                               : 0U;
  };
  const std::size_t even = cell & ~std::size_t{1};
  return core::cm_cell_anisotropy(word(even) | (word(even + 1) << 16U), static_cast<std::uint32_t>(cell));
}

// Compared with sums over the sixths of voxels that make up a cell.
TEST(AnisotropyField, CellAnisotropyIsTheScatteringWeightedMean) {
  constexpr int size = 16;
  VolumeFrame frame{.density = test::noise_volume(ivec3(size), ivec3(0), 5)};
  EXPECT_FALSE(scene::forward_of(frame));
  const auto g = [](const ivec3& p) { return p.x < 5 ? 0.875F : (p.y < 9 ? -0.5F : 0.25F); };
  frame.anisotropy = anisotropy(ivec3(size), ivec3(0), g);
  grid::RefineSettings settings;
  settings.threshold = 0.3;
  for (const bool colored : {false, true}) {
    if (colored) {
      frame.color = colors(ivec3(size), ivec3(0),
                           [](const ivec3& p) { return vec3(p.z < 7 ? 1.0F : 0.25F, 0.5F, p.x < 3 ? 0.0F : 1.0F); });
    }
    const Cells cells(frame, settings);
    const grid::TetGrid& made = cells.made;
    ASSERT_EQ(made.channels.anisotropy.size(), made.cells.size());
    EXPECT_GT(made.cells.size(), 100U);
    std::vector<double> scattering(made.cells.size());
    std::vector<double> forward(made.cells.size());
    test::for_each_sixth(size, [&](const ivec3& p, const vec3& middle) {
      double scatters = test::value_at(frame.density, p + cells.cube.origin);
      if (colored) {
        vec3 color;
        for (int c = 0; c < 3; ++c)
          color[c] = test::value_at((*frame.color)[static_cast<std::size_t>(c)], p + cells.cube.origin);
        scatters *= luminance(color);
      }
      const std::uint32_t cell = grid::locate(made, middle);
      scattering[cell] += scatters;
      forward[cell] += scatters * g(p + cells.cube.origin);
    });
    for (std::size_t cell = 0; cell < made.cells.size(); ++cell) {
      const double mean = scattering[cell] > 0.0 ? forward[cell] / scattering[cell] : 0.0;
      ASSERT_NEAR(stored_anisotropy(made, cell), mean, 1e-4) << cell;
    }
  }
}

TEST(AnisotropyField, IsClampedBelowOne) {
  for (const float all : {-1.0F, 1.0F}) {
    VolumeFrame frame{.density = field(ivec3(8), ivec3(0), 1.0F)};
    frame.anisotropy = anisotropy(ivec3(8), ivec3(0), [=](const ivec3& /*p*/) { return all; });
    const Cells cells(frame, {});
    EXPECT_NEAR(stored_anisotropy(cells.made, 0), 0.999F * all, 1e-4F);
  }
}

TEST(AnisotropyField, CellsAreRefinedWhereItVaries) {
  VolumeFrame frame{.density = field(ivec3(64), ivec3(0), 1.0F)};
  const auto count = [&](grid::Criterion criterion) {
    grid::RefineSettings settings;
    settings.criterion = criterion;
    settings.threshold = 0.1;
    settings.density_scale = 0.05;
    return Cells(frame, settings).made.cells.size();
  };
  for (const auto criterion : {grid::Criterion::deviation, grid::Criterion::transmittance}) {
    frame.anisotropy.reset();
    const std::size_t of_density = count(criterion);
    frame.anisotropy = anisotropy(ivec3(64), ivec3(0), [](const ivec3& /*p*/) { return 0.5F; });
    EXPECT_EQ(count(criterion), of_density);
    frame.anisotropy = anisotropy(ivec3(64), ivec3(0), [](const ivec3& p) { return p.x < 21 ? 0.9F : -0.5F; });
    EXPECT_GT(count(criterion), 4 * of_density);
  }
}

}  // namespace
