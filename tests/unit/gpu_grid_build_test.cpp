// Grids built on the GPU equal those built on the CPU: cells, links, order and tree bit by bit, coefficients except for
// rounding. Tested with all kinds of volumes and cameras.

#include "render/grid_build.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "base/error.hpp"
#include "base/luminance.hpp"
#include "gl/state_guard.hpp"
#include "grid/clear_cones.hpp"
#include "grid/grid_builder.hpp"
#include "render/grid_builds.hpp"
#include "support/fake_gl.hpp"
#include "support/gl_state.hpp"
#include "support/grid_reference.hpp"
#include "support/view_cameras.hpp"
#include "support/volumes.hpp"
#include "support/wide_volumes.hpp"

namespace {

using namespace cumulet;
using glm::uvec4;
using render::Deadline;
using test::GridReference;

struct Read {
  std::vector<grid::CellRecord> cells;
  std::vector<std::uint32_t> tree;  // roots first
};

class GpuGridBuilds : public test::GlTest {
 protected:
  void SetUp() override {
    GlTest::SetUp();
    if (IsSkipped()) return;
    limits_ = gl::query_limits(*gl_);
    gl::find_out_dispatches(gl_, *programs_);
  }

  [[nodiscard]] render::LatticeDataPtr upload(const grid::LatticePtr& lattice,
                                              const std::shared_ptr<const grid::Statistics>& statistics,
                                              const grid::Channels& channels = {}) const {
    render::LatticeUpload work(gl_, programs_, limits_, lattice, statistics, channels);
    while (!work.advance(Deadline::max())) {
    }
    return work.take();
  }
  // between: called after each call that the deadline stopped.
  render::BuiltGrid build(const render::LatticeDataPtr& data, const grid::RefineSettings& settings,
                          const std::function<void()>& between = {}) const {
    const grid::Lattice& lattice = data->lattice();
    // Links the programs first, so that no step waits for them.
    for (const gl::ProgramKey& key : gl::all_programs()) {
      if (key.name.starts_with("grid_")) programs_->get(key);
    }
    render::GridBuild work(gl_, programs_, limits_, data, lattice.own.levels(grid::ViewLevels(lattice.cube, settings)),
                           settings.max_cells);
    while (!work.advance(between ? Deadline::min() : Deadline::max())) {
      if (between) between();
    }
    return work.take();
  }
  [[nodiscard]] Read read(const render::BuiltGrid& grid) const {
    Read read;
    read.cells.resize(grid.count);
    read.tree.resize(52 + grid.count - 24);
    gl_->GetNamedBufferSubData(grid.cells.name(), 0, static_cast<GLsizeiptr>(read.cells.size() * 32),
                               read.cells.data());
    gl_->GetNamedBufferSubData(grid.tree.name(), 0, static_cast<GLsizeiptr>(read.tree.size() * 4), read.tree.data());
    return read;
  }
  template <class T>
  [[nodiscard]] std::vector<T> records(const render::BuiltGrid& grid, grid::Channel channel) const {
    std::vector<T> read(grid.count);
    gl_->GetNamedBufferSubData(grid.channels[static_cast<std::size_t>(channel)].name(), 0,
                               static_cast<GLsizeiptr>(read.size() * sizeof(T)), read.data());
    return read;
  }

  gl::Limits limits_;
};
CUMULET_ON_BACKENDS(GpuGridBuilds);

struct Rounding {
  std::size_t coefficients = 0;
  std::size_t others = 0;
};

float ulp_of(float value) { return std::exp2(std::floor(std::log2(std::max(std::abs(value), 6.2e-5F))) - 10.0F); }

// Both are the same number rounded to half precision. The tolerance covers the float cancellation in the CPU's sums,
// which are relative to a brick's mean.
void expect_within_a_rounding(float a, float b, bool gradient, Rounding& rounding) {
  const float ulp = ulp_of(std::max(std::abs(a), std::abs(b)));
  ASSERT_LE(std::abs(a - b), ulp + (gradient ? 6e-5F : 1e-6F));
  ++rounding.coefficients;
  if (a != b) ++rounding.others;
}
void expect_within_a_rounding(const glm::uvec4& a, const glm::uvec4& b, Rounding& rounding) {
  const glm::vec4 one = core::cm_record_fit(a);
  const glm::vec4 other = core::cm_record_fit(b);
  for (int k = 0; k < 4; ++k) ASSERT_NO_FATAL_FAILURE(expect_within_a_rounding(one[k], other[k], k > 0, rounding)) << k;
}

// Compares with the clear cones that the CPU finds in the same cells. Comparing across builders would fail, because
// nearly empty cells may be empty in only one of them.
void expect_clear_cones(const render::BuiltGrid& built, const Read& read, const grid::Cube& cube) {
  grid::TetGrid grid;
  grid.cube = cube;
  grid.cells = read.cells;
  grid.content_min = built.content_min;
  grid.content_max = built.content_max;
  grid = test::without_clear_cones(std::move(grid));
  grid::find_clear_cones(grid);
  std::size_t wrong = 0;
  for (std::size_t i = 0; i < grid.cells.size(); ++i) wrong += grid.cells[i].data == read.cells[i].data ? 0 : 1;
  EXPECT_EQ(wrong, 0U);
}

void expect_same(const grid::TetGrid& expected, const render::BuiltGrid& built, const Read& read, Rounding& rounding) {
  ASSERT_EQ(built.count, expected.cells.size());
  EXPECT_EQ(built.levels, expected.levels);
  EXPECT_EQ(built.limited, expected.limited);
  EXPECT_EQ(built.content_min, expected.content_min);
  EXPECT_EQ(built.content_max, expected.content_max);
  EXPECT_EQ(std::memcmp(read.tree.data(), expected.roots.data(), sizeof expected.roots), 0);
  EXPECT_TRUE(std::equal(expected.tree.begin(), expected.tree.end(), read.tree.begin() + 52, read.tree.end()));
  std::size_t links = 0;
  std::size_t v0_shapes = 0;
  for (std::size_t i = 0; i < expected.cells.size(); ++i) {
    const grid::CellRecord& a = expected.cells[i];
    const grid::CellRecord& b = read.cells[i];
    if (a.links != b.links) ++links;
    if (a.data.x != b.data.x || a.data.y != b.data.y) ++v0_shapes;
    ASSERT_NO_FATAL_FAILURE(expect_within_a_rounding(a.data, b.data, rounding)) << i;
  }
  expect_clear_cones(built, read, expected.cube);
  EXPECT_EQ(links, 0U);
  EXPECT_EQ(v0_shapes, 0U);
}

TEST_P(GpuGridBuilds, MatchTheCpuForEveryVolumeAndTwoHundredCameras) {
  const gl::StateGuard guard(*gl_);
  test::Cameras cameras(7);
  Rounding rounding;
  std::size_t seen = 0;
  std::size_t limited = 0;
  const std::vector<test::SmallVolume> volumes = test::small_volumes();
  for (const test::SmallVolume& small : volumes) {
    const GridReference reference(small.volume);
    const auto data = upload(reference.lattice(small.settings), reference.statistics);
    for (std::size_t i = 0; i <= 200 / volumes.size() + 1; ++i) {
      grid::RefineSettings settings = small.settings;
      if (i > 0) settings.camera = cameras.about(reference.statistics->cube());
      if (i % 4 == 1) settings.max_cells = 24 + 350 * i;
      const grid::TetGrid expected = reference.grid(settings);
      const render::BuiltGrid built = build(data, settings);
      ASSERT_NO_FATAL_FAILURE(expect_same(expected, built, read(built), rounding)) << small.name << ", camera " << i;
      if (settings.camera) ++seen;
      if (expected.limited) ++limited;
    }
  }
  EXPECT_GE(seen, 200U);
  EXPECT_GE(limited, 10U) << "budgets that end the refinement";
  // Both round the same number, mostly to the same value. For gradients near 0, the float error exceeds a unit in the
  // last place.
  EXPECT_LT(static_cast<double>(rounding.others), 0.03 * static_cast<double>(rounding.coefficients));
  RecordProperty("rounded_otherwise", std::to_string(rounding.others));
  RecordProperty("coefficients", std::to_string(rounding.coefficients));
}

// In cubes so wide that cells use another record layout, too.
TEST_P(GpuGridBuilds, MatchTheCpuForLargeVolumes) {
  const gl::StateGuard guard(*gl_);
  test::Cameras cameras(3);
  Rounding rounding;
  const auto cloud = test::noise_volume({40, 36, 33}, glm::ivec3(0), 6);
  for (const glm::ivec3& by : {glm::ivec3(60'000, 800, 0), glm::ivec3(72, 262'000, 100'000)}) {
    const GridReference reference(test::clouds_apart(cloud, by));
    grid::RefineSettings settings;
    settings.threshold = 0.05;
    const auto data = upload(reference.lattice(settings), reference.statistics);
    for (int i = 0; i < 4; ++i) {
      if (i == 1) settings.max_cells = 5000;
      if (i > 1) settings.camera = cameras.about(reference.statistics->cube());
      const grid::TetGrid expected = reference.grid(settings);
      ASSERT_TRUE(expected.cube.wide());
      const render::BuiltGrid built = build(data, settings);
      ASSERT_NO_FATAL_FAILURE(expect_same(expected, built, read(built), rounding)) << by.x << ", camera " << i;
      if (i == 0) {
        EXPECT_GT(built.count, 20'000U);
      }
    }
  }
  EXPECT_LT(static_cast<double>(rounding.others), 0.03 * static_cast<double>(rounding.coefficients));
}

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

// Density, and channels that are functions of the voxel position.
struct Carrying {
  static constexpr float fastest = 30.0F;
  volume::ScalarVolume density;
  std::shared_ptr<const grid::Statistics> statistics;
  grid::Channels channels;

  static glm::vec3 emission(const glm::ivec3& p) {
    const glm::vec3 x(p);
    const float hot = std::max(
        0.0F, 1.0F - glm::length((x - glm::vec3(30.0F, 50.0F, 20.0F)) / 24.0F) + 0.3F * glm::simplex(0.13F * x));
    return 200.0F * glm::vec3(hot, hot * hot, std::pow(hot, 6.0F));
  }
  static glm::vec3 color(const glm::ivec3& p) {
    return glm::clamp(
        0.5F + 0.6F * glm::vec3(glm::simplex(0.05F * glm::vec3(p)), glm::simplex(0.21F * glm::vec3(p)), 0.3F),
        glm::vec3(0.0F), glm::vec3(1.0F));
  }
  static float cosine(const glm::ivec3& p) { return glm::simplex(0.09F * glm::vec3(p)); }
  // As fractions of `fastest`.
  static glm::vec3 velocity(const glm::ivec3& p) {
    const glm::vec3 x(p);
    return glm::clamp(glm::vec3(0.01F * (x.y - 30.0F), 0.8F * std::sin(0.1F * x.x), 1e-4F), -1.0F, 1.0F);
  }

  explicit Carrying(bool dense, grid::Interpolation interpolation = grid::Interpolation::nearest) {
    constexpr glm::ivec3 size(60, 70, 50);
    if (dense) density = test::noise_volume({60, 45, 50}, glm::ivec3(0), 1);
    const grid::Cube cube = grid::fit_cube(density, glm::ivec3(0), size - 1, interpolation);
    statistics = std::make_shared<const grid::Statistics>(density, cube);
    const auto colors = [&](const auto& function) {
      const auto component = [&](int i) {
        return test::make_volume(size, glm::ivec3(0), [&](const glm::ivec3& p) { return function(p)[i]; });
      };
      return grid::RgbField::Components{component(0), component(1), component(2)};
    };
    channels.emission = std::make_shared<const grid::RgbField>(colors(emission), cube);
    if (!dense) return;
    const auto there = [&](const glm::ivec3& p) { return test::value_at(density, p); };
    channels.scattering =
        std::make_shared<const grid::RgbField>(colors([&](const glm::ivec3& p) { return there(p) * color(p); }), cube);
    channels.forward = std::make_shared<const grid::ScalarField>(
        test::make_volume(
            size, glm::ivec3(0),
            [&](const glm::ivec3& p) { return luminance(there(p) * color(p)) * (0.5F + 0.5F * cosine(p)); }),
        cube);
    channels.momentum = std::make_shared<const grid::MomentumField>(
        grid::MomentumField::Values{colors([&](const glm::ivec3& p) { return there(p) * (0.5F + 0.5F * velocity(p)); }),
                                    fastest},
        cube);
  }
  [[nodiscard]] grid::TetGrid grid(const grid::RefineSettings& settings) const {
    const grid::DiamondSet diamonds(*statistics, channels, settings);
    grid::GridBuilder builder(*statistics, diamonds);
    builder.bisect();
    return builder.records(settings.cells, density.max_value, channels);
  }
  [[nodiscard]] grid::LatticePtr lattice(const grid::RefineSettings& settings) const {
    return std::make_shared<const grid::Lattice>(*statistics, channels, settings, density.max_value);
  }
};

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
    const Read read = this->read(built);
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
    // The same emissive cells in the same order.
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

// The CPU's sums are relative to a brick's mean and lose small values, so thin cells are not compared.
TEST_P(GpuGridBuilds, InterpolatedVolumesMatchTheCpu) {
  const gl::StateGuard guard(*gl_);
  const Carrying of(true, grid::Interpolation::linear);
  grid::RefineSettings settings;
  const auto data = upload(of.lattice(settings), of.statistics, of.channels);
  test::Cameras cameras(6);
  Rounding rounding;
  std::size_t compared = 0;
  for (int i = 0; i < 2; ++i) {
    if (i > 0) settings.camera = cameras.about(of.statistics->cube());
    const grid::TetGrid expected = of.grid(settings);
    const render::BuiltGrid built = build(data, settings);
    const Read read = this->read(built);
    ASSERT_NO_FATAL_FAILURE(expect_same(expected, built, read, rounding)) << i;
    const auto emission = records<grid::EmissionRecord>(built, grid::Channel::emission);
    const auto color = records<std::uint32_t>(built, grid::Channel::color);
    const auto anisotropy = records<std::int16_t>(built, grid::Channel::anisotropy);
    const auto velocity = records<glm::uvec2>(built, grid::Channel::velocity);
    for (std::size_t c = 0; c < built.count; ++c) {
      for (int k = 0; k < 3; ++k)
        ASSERT_NEAR(emission[c].mean[k], expected.channels.emission[c].mean[k], 1e-5F * emission[c].mean[k] + 2e-4F)
            << c;
      if (core::cm_record_fit(read.cells[c].data).x < 0.05F) continue;
      const glm::vec3 colors = core::cm_cell_color(color[c]) - core::cm_cell_color(expected.channels.color[c]);
      ASSERT_LT(glm::length(colors), 2.0F / 1023.0F) << c;
      ASSERT_NEAR(anisotropy[c], expected.channels.anisotropy[c], 8) << c;
      const glm::vec3 speed = core::cm_cell_velocity(velocity[c]);
      const glm::vec3 wanted = core::cm_cell_velocity(expected.channels.velocity[c]);
      for (int k = 0; k < 3; ++k) ASSERT_NEAR(speed[k], wanted[k], ulp_of(wanted[k]) + 4e-6F * Carrying::fastest) << c;
      ++compared;
    }
  }
  EXPECT_GT(compared, 1000U);
}

// A fire without any density emits light too.
TEST_P(GpuGridBuilds, FireWithoutDensityEmits) {
  const gl::StateGuard guard(*gl_);
  const Carrying of(false);
  const grid::RefineSettings settings;
  const auto data = upload(of.lattice(settings), of.statistics, of.channels);
  const grid::TetGrid expected = of.grid(settings);
  const render::BuiltGrid built = build(data, settings);
  Rounding rounding;
  expect_same(expected, built, read(built), rounding);
  EXPECT_GT(built.count, 1000U);
  EXPECT_EQ(built.emissive.cells.size(), expected.cells.size() - static_cast<std::size_t>(std::ranges::count_if(
                                                                     expected.channels.emission, [](const auto& e) {
                                                                       return e.mean == glm::vec3(0.0F);
                                                                     })));
  EXPECT_FALSE(built.channels[static_cast<std::size_t>(grid::Channel::color)]);
}

// Tolerance: half a unit in the last place of a half float, plus the float error.
TEST_P(GpuGridBuilds, CoefficientsMatchTheLinearFitWithinHalfAnUlp) {
  const gl::StateGuard guard(*gl_);
  const GridReference reference(test::noise_volume({60, 45, 50}, {-3, 2, 5}, 1));
  grid::RefineSettings settings;
  settings.threshold = 0.01;
  const auto data = upload(reference.lattice(settings), reference.statistics);
  const Read grid = read(build(data, settings));
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

TEST_P(GpuGridBuilds, ConstantCellsHaveNoGradient) {
  const gl::StateGuard guard(*gl_);
  const GridReference reference(test::noise_volume({60, 45, 50}, glm::ivec3(0), 1));
  grid::RefineSettings settings;
  settings.cells = grid::CellKind::constant;
  const auto data = upload(reference.lattice(settings), reference.statistics);
  const render::BuiltGrid built = build(data, settings);
  Rounding rounding;
  const Read cells = read(built);
  expect_same(reference.grid(settings), built, cells, rounding);
  for (const grid::CellRecord& cell : cells.cells) {
    const glm::vec4 fit = core::cm_record_fit(cell.data);
    ASSERT_EQ(fit, glm::vec4(fit.x, 0.0F, 0.0F, 0.0F));
  }
}

// Values that are halves in a file are used as exactly those halves.
TEST_P(GpuGridBuilds, HalfFloatsOfAFileAreUsedExactly) {
  const gl::StateGuard guard(*gl_);
  volume::ScalarVolume volume = test::noise_volume({60, 45, 50}, glm::ivec3(0), 1);
  std::vector<std::uint16_t> halves;
  volume.max_value = 0.0F;
  for (std::size_t i = 0; i < volume.brick_values.size(); ++i) {
    halves.push_back(glm::packHalf1x16(volume.brick_values[i]));
    volume.max_value = std::max(volume.max_value, volume::value_of(halves.back()));
  }
  volume.brick_values = volume::BrickValues(std::move(halves));
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

// A frame may stop after any dispatch. Another build may begin on the same lattice after an unfinished one.
TEST_P(GpuGridBuilds, CanBeStoppedAfterEveryStepAndRestarted) {
  const gl::StateGuard guard(*gl_);
  const GridReference reference(test::noise_volume({60, 45, 50}, glm::ivec3(0), 1));
  grid::RefineSettings settings;
  const auto data = upload(reference.lattice(settings), reference.statistics);
  test::Cameras cameras(11);
  settings.camera = cameras.about(reference.statistics->cube());
  settings.camera->tan_half_x = settings.camera->tan_half_y = 2.0;
  settings.camera->pixels_per_radian = 1000.0;
  const grid::TetGrid expected = reference.grid(settings);
  std::size_t steps = 0;
  Rounding rounding;
  const render::BuiltGrid slow = build(data, settings, [&] { ++steps; });
  ASSERT_NO_FATAL_FAILURE(expect_same(expected, slow, read(slow), rounding));
  EXPECT_GT(steps, 60U);
  const grid::RefineSettings other;
  for (std::size_t stop = 0; stop < steps; ++stop) {
    {
      render::GridBuild left(gl_, programs_, limits_, data,
                             data->lattice().own.levels(grid::ViewLevels(data->lattice().cube, other)), 1000);
      for (std::size_t i = 0; i < stop && !left.advance(Deadline::min()); ++i) {
      }
    }
    if (stop % 7 != 0) continue;
    const render::BuiltGrid anew = build(data, settings);
    ASSERT_NO_FATAL_FAILURE(expect_same(expected, anew, read(anew), rounding)) << stop;
  }
}

// A planned source for these settings, as viewers make it.
scene::MarchSourcePtr planned(const GridReference& reference, const grid::LatticePtr& lattice,
                              const grid::RefineSettings& settings) {
  scene::GridPlan plan{lattice, lattice->own.levels(grid::ViewLevels(lattice->cube, settings)), settings.max_cells};
  return std::make_shared<const scene::MarchSource>(
      scene::make_planned_source(std::move(plan), reference.volume, reference.statistics, {}));
}

// A volume's plan, and the grid that the CPU builds.
struct Planned {
  explicit Planned(volume::ScalarVolume v) : reference(std::move(v)) {}
  GridReference reference;
  grid::RefineSettings settings;
  grid::LatticePtr lattice = reference.lattice(settings);
  scene::MarchSourcePtr source = planned(reference, lattice, settings);
  grid::TetGrid expected = reference.grid(settings);
};

constexpr std::uint64_t no_limit = std::numeric_limits<std::uint64_t>::max();

void wait_for(render::GridBuilds& builds, const scene::MarchSourcePtr& source, std::uint64_t max_bytes = no_limit) {
  while (!builds.advance({source}, {source}, max_bytes, Deadline::max()))
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

void expect_of_the_cpu(const render::BuiltGrid& built, const grid::TetGrid& expected, const std::string& why) {
  ASSERT_TRUE(built.grid) << why;
  EXPECT_NE(built.why_not.find(why), std::string::npos) << built.why_not;
  ASSERT_EQ(built.grid->cells.size(), expected.cells.size());
  EXPECT_EQ(
      std::memcmp(built.grid->cells.data(), expected.cells.data(), expected.cells.size() * sizeof(grid::CellRecord)),
      0);
  EXPECT_EQ(built.bytes(), 0U) << "none of GL's";
}

TEST_P(GpuGridBuilds, CpuBuildsGridsThatDoNotFitGpuMemory) {
  const gl::StateGuard guard(*gl_);
  const Planned plan(test::noise_volume({60, 45, 50}, glm::ivec3(0), 1));
  const std::uint64_t held = upload(plan.lattice, plan.reference.statistics)->bytes();
  struct Case {
    std::int64_t block;
    std::uint64_t most;
    const char* why;
  };
  const auto cells = static_cast<std::int64_t>(plan.expected.cells.size());
  const std::array<Case, 4> cases{
      {{4096, no_limit, "GL_MAX_SHADER_STORAGE_BLOCK_SIZE is 4096"},
       {24 * cells, no_limit, "GL_MAX_SHADER_STORAGE_BLOCK_SIZE"},
       {limits_.storage_block_bytes, held / 2, "the lattice needs"},
       {limits_.storage_block_bytes, held + 40 * plan.expected.cells.size(), "building the grid needs"}}};
  for (const Case& c : cases) {
    SCOPED_TRACE(c.why);
    gl::Limits limits = limits_;
    limits.storage_block_bytes = c.block;
    render::GridBuilds builds(gl_, programs_, limits, nullptr);
    wait_for(builds, plan.source, c.most);
    ASSERT_NO_FATAL_FAILURE(expect_of_the_cpu(builds.built().at(plan.source), plan.expected, c.why));
    EXPECT_LE(builds.bytes(), held) << "nothing but a lattice is left";
    // A build that is cleared before it is done ends without waiting.
    builds.clear();
    builds.advance({plan.source}, {plan.source}, c.most, Deadline::max());
  }
  render::GridBuilds builds(gl_, programs_, limits_, nullptr);
  wait_for(builds, plan.source);
  EXPECT_FALSE(builds.built().at(plan.source).grid);
}

// After any failed allocation, all objects are freed and the CPU builds the grid.
TEST_P(GpuGridBuilds, FailedAllocationsAreHandledInEveryPass) {
  const gl::StateGuard guard(*gl_);
  const Planned plan(test::noise_volume({16, 16, 12}, glm::ivec3(0), 1));
  test::FakeGl fake(headless::Context::get_proc, context_.get());
  const gl::FunctionsPtr functions = gl::load_functions(test::FakeGl::get_proc, &fake);
  const auto before = fake.alive();
  std::int64_t failed = 0;
  for (std::int64_t n = 0; n < 1000; ++n) {
    SCOPED_TRACE(n);
    {
      render::GridBuilds builds(functions, programs_, limits_, nullptr);
      fake.fail_allocation(n);
      wait_for(builds, plan.source);
      fake.fail_allocation(-1);
      const render::BuiltGrid& built = builds.built().at(plan.source);
      if (!built.grid) break;
      ++failed;
      ASSERT_NO_FATAL_FAILURE(expect_of_the_cpu(built, plan.expected, ""));
      // The next build runs on the GPU again.
      builds.clear();
      wait_for(builds, plan.source);
      ASSERT_FALSE(builds.built().at(plan.source).grid);
    }
    ASSERT_EQ(fake.alive(), before);
  }
  EXPECT_GT(failed, 20) << "buffers, and storage for each";
}

// Refits for a moving camera: each grid frees its memory. CUMULET_REFITS: number of refits (default: 100).
TEST_P(GpuGridBuilds, RefitsDoNotGrow) {
  const gl::StateGuard guard(*gl_);
  const GridReference reference(test::noise_volume({40, 35, 30}, glm::ivec3(0), 1));
  grid::RefineSettings settings;
  const grid::LatticePtr lattice = reference.lattice(settings);
  test::FakeGl fake(headless::Context::get_proc, context_.get());
  const gl::FunctionsPtr functions = gl::load_functions(test::FakeGl::get_proc, &fake);
  const char* wanted = std::getenv("CUMULET_REFITS");
  const int refits = wanted == nullptr ? 100 : std::atoi(wanted);
  test::Cameras cameras(17);
  render::GridBuilds builds(functions, programs_, limits_, nullptr);
  std::map<std::string, std::size_t> alive;
  std::uint64_t bytes = 0;
  for (int i = 0; i < refits; ++i) {
    settings.camera = cameras.about(lattice->cube);
    const scene::MarchSourcePtr source = planned(reference, lattice, settings);
    wait_for(builds, source);
    const std::uint64_t built = builds.built().at(source).bytes();
    ASSERT_GT(built, 0U) << i;
    if (i == 0) bytes = builds.bytes() - built;
    ASSERT_EQ(builds.bytes(), bytes + built) << i;
    builds.clear_built();
    if (i == 0) alive = fake.alive();
    ASSERT_EQ(fake.alive(), alive) << i;
  }
}

TEST_P(GpuGridBuilds, ErrorsNameTheExceededLimit) {
  const gl::StateGuard guard(*gl_);
  const GridReference reference(test::noise_volume({60, 45, 50}, glm::ivec3(0), 1));
  const grid::RefineSettings settings;
  const grid::LatticePtr lattice = reference.lattice(settings);
  gl::Limits small = limits_;
  small.storage_block_bytes = 4096;
  try {
    const render::LatticeUpload work(gl_, programs_, small, lattice, reference.statistics);
    FAIL() << "uploaded";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::unsupported);
    EXPECT_NE(std::string(error.what()).find("GL_MAX_SHADER_STORAGE_BLOCK_SIZE is 4096"), std::string::npos)
        << error.what();
  }
}

}  // namespace
