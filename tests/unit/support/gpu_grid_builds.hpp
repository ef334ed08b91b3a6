#pragma once

// Grids built on the GPU, compared with those of the CPU.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

#include "base/luminance.hpp"
#include "gl/state_guard.hpp"
#include "grid/clear_cones.hpp"
#include "grid/grid_builder.hpp"
#include "render/grid/grid_build.hpp"
#include "render/grid/grid_builds.hpp"
#include "support/fake_gl.hpp"
#include "support/gl_state.hpp"
#include "support/grid_reference.hpp"
#include "support/view_cameras.hpp"
#include "support/volumes.hpp"
#include "support/wide_volumes.hpp"

namespace cumulet::test {

struct ReadGrid {
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
    while (!work.advance(render::Deadline::max())) {
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
    while (!work.advance(between ? render::Deadline::min() : render::Deadline::max())) {
      if (between) between();
    }
    return work.take();
  }
  [[nodiscard]] ReadGrid read(const render::BuiltGrid& grid) const {
    ReadGrid read;
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

struct Rounding {
  std::size_t coefficients = 0;
  std::size_t others = 0;
};

inline float ulp_of(float value) {
  return std::exp2(std::floor(std::log2(std::max(std::abs(value), 6.2e-5F))) - 10.0F);
}

// Both are the same number rounded to half precision. The tolerance covers the float cancellation in the CPU's sums,
// which are relative to a brick's mean.
inline void expect_within_a_rounding(float a, float b, bool gradient, Rounding& rounding) {
  const float ulp = ulp_of(std::max(std::abs(a), std::abs(b)));
  ASSERT_LE(std::abs(a - b), ulp + (gradient ? 6e-5F : 1e-6F));
  ++rounding.coefficients;
  if (a != b) ++rounding.others;
}
inline void expect_within_a_rounding(const glm::uvec4& a, const glm::uvec4& b, Rounding& rounding) {
  const glm::vec4 one = core::cm_record_fit(a);
  const glm::vec4 other = core::cm_record_fit(b);
  for (int k = 0; k < 4; ++k) ASSERT_NO_FATAL_FAILURE(expect_within_a_rounding(one[k], other[k], k > 0, rounding)) << k;
}

// Compares with the clear cones that the CPU finds in the same cells. Comparing across builders would fail, because
// nearly empty cells may be empty in only one of them.
inline void expect_clear_cones(const render::BuiltGrid& built, const ReadGrid& read, const grid::Cube& cube) {
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

inline void expect_same(const grid::TetGrid& expected, const render::BuiltGrid& built, const ReadGrid& read,
                        Rounding& rounding) {
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

}  // namespace cumulet::test
