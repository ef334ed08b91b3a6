// Coefficients and channels of cells.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "base/luminance.hpp"
#include "gl/state_guard.hpp"
#include "grid/grid_builder.hpp"
#include "render/grid/grid_build.hpp"
#include "render/grid/grid_builds.hpp"
#include "support/fake_gl.hpp"
#include "support/gl_state.hpp"
#include "support/gpu_grid_builds.hpp"
#include "support/grid_reference.hpp"
#include "support/view_cameras.hpp"
#include "support/volumes.hpp"
#include "support/wide_volumes.hpp"

namespace {

using namespace cumulet;
using glm::uvec4;
using test::Carrying;
using test::expect_same;
using test::GpuGridBuilds;
using test::GridReference;
using test::ReadGrid;
using test::Rounding;
using test::ulp_of;

// The least-squares fit to a cell's sixths of voxels in double precision, nowhere negative: mean, then gradient.
struct Fit {
  double mean = 0.0;
  glm::dvec3 gradient{0.0};
};
struct Sixth {
  glm::dvec3 middle;
  double value;
};
void collect(const volume::ScalarVolume& volume, const grid::Cube& cube, const glm::vec3& v0, std::uint32_t shape,
             std::vector<Sixth>& sixths) {
  if (core::cm_shape_class(shape) == 1 && core::cm_shape_exponent(shape) == 0) {
    const glm::vec3 middle = v0 + core::cm_from_frame(glm::vec3(0.75F, 0.5F, 0.25F), shape);
    sixths.push_back({middle, test::value_at(volume, glm::ivec3(middle) + cube.origin)});
    return;
  }
  collect(volume, cube, v0, core::cm_child_shape(shape, 0), sixths);
  collect(volume, cube, core::cm_cell_vertex(v0, shape, 1), core::cm_child_shape(shape, 1), sixths);
}
Fit fit_of(const volume::ScalarVolume& volume, const grid::Cube& cube, const glm::vec3& v0, std::uint32_t shape) {
  std::vector<Sixth> sixths;
  collect(volume, cube, v0, shape, sixths);
  std::array<glm::dvec3, 4> vertices;
  glm::dvec3 centroid(0.0);
  for (std::uint32_t i = 0; i < 4; ++i) {
    vertices[i] = core::cm_cell_vertex(v0, shape, i);
    centroid += 0.25 * vertices[i];
  }
  Fit fit;
  for (const Sixth& sixth : sixths) fit.mean += sixth.value / static_cast<double>(sixths.size());
  glm::dvec3 covariance(0.0);
  for (const Sixth& sixth : sixths)
    covariance += (sixth.value - fit.mean) * (sixth.middle - centroid) / static_cast<double>(sixths.size());
  glm::dmat3 of_position(0.0);
  for (const glm::dvec3& v : vertices) of_position += glm::outerProduct(v - centroid, v - centroid) / 20.0;
  const glm::dvec3 gradient = glm::inverse(of_position) * covariance;
  double lowest = 0.0;
  for (const glm::dvec3& v : vertices) lowest = std::min(lowest, glm::dot(gradient, v - centroid));
  const double scale = lowest < 0.0 && fit.mean < -lowest ? fit.mean / -lowest : 1.0;
  fit.gradient = scale * double(core::cm_shape_unit(shape)) * glm::dvec3(core::cm_to_frame(glm::vec3(gradient), shape));
  return fit;
}

std::vector<glm::ivec3> sixths_of(const glm::vec3& v0, std::uint32_t shape) {
  static const volume::ScalarVolume nothing;
  std::vector<Sixth> sixths;
  collect(nothing, {}, v0, shape, sixths);
  std::vector<glm::ivec3> voxels;
  for (const Sixth& sixth : sixths) voxels.emplace_back(glm::floor(sixth.middle));
  return voxels;
}

// Compares each channel's record with the mean over these voxels in double precision.
void expect_means(const Carrying& of, const glm::vec3& v0, std::uint32_t shape, const glm::vec3& emission,
                  std::uint32_t color, std::int16_t anisotropy, const glm::uvec2& velocity) {
  glm::dvec3 light(0.0);
  glm::dvec3 scattering(0.0);
  glm::dvec3 momentum(0.0);
  double mass = 0.0;
  double scattered = 0.0;
  double forward = 0.0;
  const std::vector<glm::ivec3> voxels = sixths_of(v0, shape);
  for (const glm::ivec3& p : voxels) {
    if (glm::any(glm::greaterThanEqual(p, glm::ivec3(60, 70, 50)))) continue;
    light += glm::dvec3(Carrying::emission(p));
    const double density = test::value_at(of.density, p);
    const glm::dvec3 colored = density * glm::dvec3(Carrying::color(p));
    scattering += colored;
    scattered += luminance(colored);
    forward += luminance(colored) * double(Carrying::cosine(p));
    momentum += density * glm::dvec3(Carrying::velocity(p));
    mass += density;
  }
  light /= static_cast<double>(voxels.size());
  for (int i = 0; i < 3; ++i) ASSERT_NEAR(emission[i], light[i], 1e-4 * light[i] + 1e-35) << i;
  const glm::vec3 shown = core::cm_cell_color(color);
  const glm::vec3 moves = core::cm_cell_velocity(velocity);
  constexpr std::array<double, 3> steps{1.0 / 2047.0, 1.0 / 2047.0, 1.0 / 1023.0};
  for (int i = 0; i < 3; ++i) {
    ASSERT_NEAR(shown[i], mass > 0.0 ? scattering[i] / mass : 0.0, 0.51 * steps[static_cast<std::size_t>(i)]) << i;
    const double expected = mass > 0.0 ? double{Carrying::fastest} * momentum[i] / mass : 0.0;
    ASSERT_NEAR(moves[i], expected, 0.5 * ulp_of(static_cast<float>(expected)) + 2e-6 * Carrying::fastest) << i;
  }
  const double cosine = scattered > 0.0 ? std::clamp(forward / scattered, -0.999, 0.999) : 0.0;
  ASSERT_NEAR(anisotropy / 32767.0, cosine, 0.6 / 32767.0);
}

TEST_P(GpuGridBuilds, ChannelsMatchTheVoxels) {
  const gl::StateGuard guard(*gl_);
  const Carrying of(true);
  const grid::RefineSettings any;
  const auto data = upload(of.lattice(any), of.statistics, of.channels);
  test::Cameras cameras(5);
  Rounding rounding;
  std::size_t glowing = 0;
  std::size_t others = 0;
  for (int i = 0; i < 3; ++i) {
    grid::RefineSettings settings = any;
    if (i > 0) settings.camera = cameras.about(of.statistics->cube());
    if (i == 2) settings.max_cells = 3000;
    const grid::TetGrid expected = of.grid(settings);
    const render::BuiltGrid built = build(data, settings);
    const ReadGrid read = this->read(built);
    ASSERT_NO_FATAL_FAILURE(expect_same(expected, built, read, rounding)) << i;
    const auto emission = records<grid::EmissionRecord>(built, grid::Channel::emission);
    const auto color = records<std::uint32_t>(built, grid::Channel::color);
    const auto anisotropy = records<std::int16_t>(built, grid::Channel::anisotropy);
    const auto velocity = records<glm::uvec2>(built, grid::Channel::velocity);
    for (std::size_t c = 0; c < built.count; ++c) {
      const glm::uvec4& words = read.cells[c].data;
      // The CPU's sums, relative to a brick's mean, lose small values beside the brightest, which is 200.
      for (int k = 0; k < 3; ++k)
        ASSERT_NEAR(emission[c].mean[k], expected.channels.emission[c].mean[k], 1e-5F * emission[c].mean[k] + 2e-4F)
            << c;
      if (emission[c].mean.x > 1.0F) {
        ++glowing;
        if (emission[c].gradient != expected.channels.emission[c].gradient || color[c] != expected.channels.color[c] ||
            velocity[c] != expected.channels.velocity[c] || anisotropy[c] != expected.channels.anisotropy[c])
          ++others;
        const glm::uvec4 light(glm::floatBitsToUint(emission[c].mean), emission[c].gradient);
        const glm::uvec4 wanted(glm::floatBitsToUint(expected.channels.emission[c].mean),
                                expected.channels.emission[c].gradient);
        ASSERT_LT(glm::length(core::cm_emission_gradient(light) - core::cm_emission_gradient(wanted)), 0.015F) << c;
      }
      // Cells larger than a brick are averaged on the CPU.
      const std::uint32_t shape = core::cm_record_shape(words);
      const std::uint32_t size = core::cm_shape_cube_size(shape);
      if (size > 3 || c % 7 != 0) continue;
      ASSERT_NO_FATAL_FAILURE(
          expect_means(of, core::cm_record_v0(words), shape, emission[c].mean, color[c], anisotropy[c], velocity[c]))
          << i << ' ' << c;
    }
    // The emissive cells are equal, and in the same order.
    const scene::EmissiveTable wanted = scene::emissive_table(expected);
    ASSERT_EQ(built.emissive.cells.size(), wanted.cells.size()) << i;
    EXPECT_NEAR(built.emissive.power, wanted.power, 1e-5 * wanted.power);
    EXPECT_NEAR(built.emissive.length, wanted.length, 1e-5 * wanted.length);
    for (std::size_t c = 0; c < wanted.cells.size(); ++c)
      ASSERT_EQ(built.emissive.cells[c].v0_shape, wanted.cells[c].v0_shape) << c;
  }
  EXPECT_GT(glowing, 1000U);
  EXPECT_LT(static_cast<double>(others), 0.02 * static_cast<double>(glowing));
  RecordProperty("other_records", std::to_string(others));
  RecordProperty("records", std::to_string(glowing));
}

// Tolerance: half a unit in the last place of a half float, plus the float error.
TEST_P(GpuGridBuilds, CoefficientsMatchTheLinearFitWithinHalfAnUlp) {
  const gl::StateGuard guard(*gl_);
  const GridReference reference(test::noise_volume({60, 45, 50}, {-3, 2, 5}, 1));
  grid::RefineSettings settings;
  settings.threshold = 0.01;
  const auto data = upload(reference.lattice(settings), reference.statistics);
  const ReadGrid grid = read(build(data, settings));
  const grid::Cube& cube = reference.statistics->cube();
  std::size_t fitted = 0;
  for (std::size_t i = 0; i < grid.cells.size(); i += 3) {
    const glm::uvec4& words = grid.cells[i].data;
    const std::uint32_t shape = core::cm_record_shape(words);
    const Fit fit = fit_of(*reference.volume, cube, core::cm_record_v0(words), shape);
    const glm::vec4 is = core::cm_record_fit(words);
    const double unit = reference.volume->max_value;
    const std::array<double, 4> expected{fit.mean / unit, fit.gradient.x / unit, fit.gradient.y / unit,
                                         fit.gradient.z / unit};
    for (int k = 0; k < 4; ++k)
      ASSERT_NEAR(is[k], expected[k], 0.5 * ulp_of(static_cast<float>(expected[k])) + 4e-6) << i << ' ' << k;
    if (fit.gradient != glm::dvec3(0.0)) ++fitted;
  }
  EXPECT_GT(fitted, 1000U);
}

// The volume with its bricks as half floats.
volume::ScalarVolume as_halves(volume::ScalarVolume volume) {
  std::vector<std::uint16_t> halves;
  volume.max_value = 0.0F;
  for (std::size_t i = 0; i < volume.brick_values.size(); ++i) {
    halves.push_back(glm::packHalf1x16(volume.brick_values[i]));
    volume.max_value = std::max(volume.max_value, volume::value_of(halves.back()));
  }
  volume.brick_values = volume::BrickValues(std::move(halves));
  return volume;
}

// Corners are the voxels, relative to the maximum and rounded, so both builders have the same. The uniform region is in
// bricks that are stored once.
TEST_P(GpuGridBuilds, CornersMatchThoseOfTheCpu) {
  const gl::StateGuard guard(*gl_);
  volume::ScalarVolume volume = test::noise_volume({60, 45, 50}, {-3, 2, 5}, 1);
  volume.bounds_max.x += 24;
  volume.tiles = {{{64, 8, 8}, {79, 39, 39}, 0.5F}};
  for (const volume::ScalarVolume& values : {volume, as_halves(volume)}) {
    const GridReference reference(values, grid::fit_cube(volume, grid::Interpolation::linear));
    grid::RefineSettings settings;
    settings.threshold = 0.01;
    settings.cells = grid::CellKind::trilinear;
    const grid::LatticePtr lattice = reference.lattice(settings);
    ASSERT_TRUE(lattice->has_corners());
    const render::BuiltGrid built = build(upload(lattice, reference.statistics), settings);
    const grid::TetGrid expected = reference.grid(settings);
    Rounding rounding;
    const ReadGrid cells = read(built);
    ASSERT_NO_FATAL_FAILURE(expect_same(expected, built, cells, rounding));
    EXPECT_EQ(built.bytes(), std::uint64_t{built.count} * (32 + 4 + 16) + 28 * 4);
    std::vector<uvec4> corners(built.count);
    gl_->GetNamedBufferSubData(built.corners.name(), 0, static_cast<GLsizeiptr>(corners.size() * sizeof(uvec4)),
                               corners.data());
    std::size_t sixths = 0;
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const std::uint32_t shape = core::cm_record_shape(cells.cells[i].data);
      if (core::cm_shape_class(shape) != 1 || core::cm_shape_exponent(shape) != 0) continue;
      ASSERT_EQ(corners[i], expected.corners[i]) << i;
      ++sixths;
    }
    EXPECT_GT(sixths, 1000U);
    EXPECT_LT(sixths, corners.size());
  }
}

TEST_P(GpuGridBuilds, ConstantCellsHaveNoGradient) {
  const gl::StateGuard guard(*gl_);
  const GridReference reference(test::noise_volume({60, 45, 50}, glm::ivec3(0), 1));
  grid::RefineSettings settings;
  settings.cells = grid::CellKind::constant;
  const auto data = upload(reference.lattice(settings), reference.statistics);
  const render::BuiltGrid built = build(data, settings);
  Rounding rounding;
  const ReadGrid cells = read(built);
  expect_same(reference.grid(settings), built, cells, rounding);
  for (const grid::CellRecord& cell : cells.cells) {
    const glm::vec4 fit = core::cm_record_fit(cell.data);
    ASSERT_EQ(fit, glm::vec4(fit.x, 0.0F, 0.0F, 0.0F));
  }
}

// Values that are halves in a file are used as exactly those halves.
TEST_P(GpuGridBuilds, HalfFloatsOfAFileAreUsedExactly) {
  const gl::StateGuard guard(*gl_);
  const volume::ScalarVolume volume = as_halves(test::noise_volume({60, 45, 50}, glm::ivec3(0), 1));
  for (const auto interpolation : {grid::Interpolation::nearest, grid::Interpolation::linear}) {
    const GridReference reference(volume, grid::fit_cube(volume, interpolation));
    const grid::RefineSettings settings;
    const grid::LatticePtr lattice = reference.lattice(settings);
    EXPECT_TRUE(lattice->halves);
    const auto data = upload(lattice, reference.statistics);
    const render::BuiltGrid built = build(data, settings);
    Rounding rounding;
    expect_same(reference.grid(settings), built, read(built), rounding);
  }
}

}  // namespace
