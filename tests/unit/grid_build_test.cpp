// Grids that GL builds are those that the processor builds: cells, links, order and tree bit for bit, coefficients but
// for a rounding, for volumes of every kind and whoever looks at them.

#include "render/grid_build.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <optional>
#include <vector>

#include "base/error.hpp"
#include "gl/state_guard.hpp"
#include "grid/tet_grid.hpp"
#include "support/gl_state.hpp"
#include "support/view_cameras.hpp"
#include "support/volumes.hpp"

namespace {

using namespace cumulet;
using glm::uvec4;
using render::Deadline;

struct Read {
  std::vector<grid::CellRecord> cells;
  std::vector<std::uint32_t> tree;  // roots first
};

class GridBuilds : public test::GlTest {
 protected:
  void SetUp() override {
    GlTest::SetUp();
    if (IsSkipped()) return;
    limits_ = gl::query_limits(*gl_);
    gl::find_out_dispatches(gl_, *programs_);
  }

  [[nodiscard]] render::LatticeDataPtr upload(const grid::LatticePtr& lattice,
                                              const std::shared_ptr<const grid::Statistics>& statistics) const {
    render::LatticeUpload work(gl_, limits_, lattice, statistics);
    while (!work.advance(Deadline::max())) {
    }
    return work.take();
  }
  // between: after each call that the deadline stopped.
  render::BuiltGrid build(const render::LatticeDataPtr& data, const grid::RefineSettings& settings,
                          const std::function<void()>& between = {}) const {
    const grid::Lattice& lattice = data->lattice();
    // Linked, so that no step waits for it.
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

  gl::Limits limits_;
};
CUMULET_ON_BACKENDS(GridBuilds);

struct Reference {
  std::shared_ptr<const volume::ScalarVolume> volume;
  std::shared_ptr<const grid::Statistics> statistics;

  explicit Reference(volume::ScalarVolume v)
      : volume(std::make_shared<const volume::ScalarVolume>(std::move(v))),
        statistics(std::make_shared<const grid::Statistics>(*volume, grid::fit_cube(*volume))) {}
  [[nodiscard]] grid::TetGrid grid(const grid::RefineSettings& settings) const {
    const grid::DiamondSet diamonds(*statistics, settings);
    grid::GridBuilder builder(*statistics, diamonds);
    builder.bisect();
    return builder.records(settings.cells, volume->max_value);
  }
  [[nodiscard]] grid::LatticePtr lattice(const grid::RefineSettings& settings) const {
    return std::make_shared<const grid::Lattice>(*statistics, grid::Channels{}, settings, volume->max_value);
  }
};

struct Rounding {
  std::size_t coefficients = 0;
  std::size_t others = 0;
};

float ulp_of(float value) { return std::exp2(std::floor(std::log2(std::max(std::abs(value), 6.2e-5F))) - 10.0F); }

// Of the same number rounded to halves. What is next to nothing beside density 1 is what the processor's
// sums about a brick's mean lose in floats.
void expect_within_a_rounding(float a, float b, bool gradient, Rounding& rounding) {
  const float ulp = ulp_of(std::max(std::abs(a), std::abs(b)));
  ASSERT_LE(std::abs(a - b), ulp + (gradient ? 6e-5F : 1e-6F));
  ++rounding.coefficients;
  if (a != b) ++rounding.others;
}
void expect_within_a_rounding(const glm::uvec4& a, const glm::uvec4& b, Rounding& rounding) {
  const auto expect = [&](std::uint32_t one, std::uint32_t other, bool first_is_mean) {
    const glm::vec2 x = glm::unpackHalf2x16(one);
    const glm::vec2 y = glm::unpackHalf2x16(other);
    ASSERT_NO_FATAL_FAILURE(expect_within_a_rounding(x.x, y.x, !first_is_mean, rounding));
    ASSERT_NO_FATAL_FAILURE(expect_within_a_rounding(x.y, y.y, true, rounding));
  };
  ASSERT_NO_FATAL_FAILURE(expect(a.z, b.z, true));
  ASSERT_NO_FATAL_FAILURE(expect(a.w, b.w, false));
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
  std::size_t places = 0;
  for (std::size_t i = 0; i < expected.cells.size(); ++i) {
    const grid::CellRecord& a = expected.cells[i];
    const grid::CellRecord& b = read.cells[i];
    if (a.links != b.links) ++links;
    if (a.data.x != b.data.x || a.data.y != b.data.y) ++places;
    ASSERT_NO_FATAL_FAILURE(expect_within_a_rounding(a.data, b.data, rounding)) << i;
  }
  EXPECT_EQ(links, 0U);
  EXPECT_EQ(places, 0U);
}

TEST_P(GridBuilds, AreTheProcessorsForEveryVolumeAndTwoHundredCameras) {
  const gl::StateGuard guard(*gl_);
  test::Cameras cameras(7);
  Rounding rounding;
  std::size_t seen = 0;
  std::size_t limited = 0;
  const std::vector<test::SmallVolume> volumes = test::small_volumes();
  for (const test::SmallVolume& small : volumes) {
    const Reference reference(small.volume);
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
  // Both round the same number, most often alike; of gradients next to nothing what floats lose is more than a unit.
  EXPECT_LT(static_cast<double>(rounding.others), 0.03 * static_cast<double>(rounding.coefficients));
  RecordProperty("rounded_otherwise", std::to_string(rounding.others));
  RecordProperty("coefficients", std::to_string(rounding.coefficients));
}

// The least-squares fit of a cell's sixths of voxels in double precision, nowhere negative: mean, then gradient.
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

// Half a unit in the last place of a half float, and what floats lose in between.
TEST_P(GridBuilds, CoefficientsAreLeastSquaresWithinHalfAUnitInTheLastPlace) {
  const gl::StateGuard guard(*gl_);
  const Reference reference(test::noise_volume({60, 45, 50}, {-3, 2, 5}, 1));
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
    const glm::vec2 low = glm::unpackHalf2x16(words.z);
    const glm::vec2 high = glm::unpackHalf2x16(words.w);
    const double unit = reference.volume->max_value;
    const std::array<double, 4> expected{fit.mean / unit, fit.gradient.x / unit, fit.gradient.y / unit,
                                         fit.gradient.z / unit};
    const std::array<float, 4> is{low.x, low.y, high.x, high.y};
    for (std::size_t k = 0; k < 4; ++k)
      ASSERT_NEAR(is[k], expected[k], 0.5 * ulp_of(static_cast<float>(expected[k])) + 4e-6) << i << ' ' << k;
    if (fit.gradient != glm::dvec3(0.0)) ++fitted;
  }
  EXPECT_GT(fitted, 1000U);
}

TEST_P(GridBuilds, ConstantCellsHaveNoGradient) {
  const gl::StateGuard guard(*gl_);
  const Reference reference(test::noise_volume({60, 45, 50}, glm::ivec3(0), 1));
  grid::RefineSettings settings;
  settings.cells = grid::CellKind::constant;
  const auto data = upload(reference.lattice(settings), reference.statistics);
  const render::BuiltGrid built = build(data, settings);
  Rounding rounding;
  const Read cells = read(built);
  expect_same(reference.grid(settings), built, cells, rounding);
  for (const grid::CellRecord& cell : cells.cells) ASSERT_EQ(cell.data.w | (cell.data.z >> 16U), 0U);
}

// What a file has as halves is halves here, and no other numbers.
TEST_P(GridBuilds, HalvesOfAFileAreTakenAsTheyAre) {
  const gl::StateGuard guard(*gl_);
  volume::ScalarVolume volume = test::noise_volume({60, 45, 50}, glm::ivec3(0), 1);
  std::vector<std::uint16_t> halves;
  volume.max_value = 0.0F;
  for (std::size_t i = 0; i < volume.brick_values.size(); ++i) {
    halves.push_back(glm::packHalf1x16(volume.brick_values[i]));
    volume.max_value = std::max(volume.max_value, volume::value_of(halves.back()));
  }
  volume.brick_values = volume::BrickValues(std::move(halves));
  const Reference reference(std::move(volume));
  const grid::RefineSettings settings;
  const grid::LatticePtr lattice = reference.lattice(settings);
  EXPECT_TRUE(lattice->halves);
  const auto data = upload(lattice, reference.statistics);
  const render::BuiltGrid built = build(data, settings);
  Rounding rounding;
  expect_same(reference.grid(settings), built, read(built), rounding);
}

// A frame may stop after every dispatch, and another build begin on the same lattice after one that nobody ended.
TEST_P(GridBuilds, StopAfterEveryStepAndBeginAnew) {
  const gl::StateGuard guard(*gl_);
  const Reference reference(test::noise_volume({60, 45, 50}, glm::ivec3(0), 1));
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

TEST_P(GridBuilds, SayWhichLimitDoesNotSuffice) {
  const gl::StateGuard guard(*gl_);
  const Reference reference(test::noise_volume({60, 45, 50}, glm::ivec3(0), 1));
  const grid::RefineSettings settings;
  const grid::LatticePtr lattice = reference.lattice(settings);
  gl::Limits small = limits_;
  small.storage_block_bytes = 4096;
  try {
    const render::LatticeUpload work(gl_, small, lattice, reference.statistics);
    FAIL() << "uploaded";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::unsupported);
    EXPECT_NE(std::string(error.what()).find("GL_MAX_SHADER_STORAGE_BLOCK_SIZE is 4096"), std::string::npos)
        << error.what();
  }
}

}  // namespace
