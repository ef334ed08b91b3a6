#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>
#include <utility>

#include "grid/cell.hpp"
#include "grid/clear_cones.hpp"
#include "support/grid_reference.hpp"
#include "support/volumes.hpp"
#include "support/wide_volumes.hpp"

namespace {

using namespace cumulet;
using glm::ivec3;
using glm::vec3;

grid::TetGrid grid_of(volume::ScalarVolume volume, const grid::RefineSettings& settings) {
  return test::GridReference(std::move(volume)).grid(settings);
}

class Rays {
 public:
  explicit Rays(const grid::TetGrid& grid) : grid_(grid), wide_(grid.cube.wide()) {}
  [[nodiscard]] vec3 within(std::uint32_t cell) {
    const glm::uvec4& data = grid_.cells[cell].data;
    const vec3 v0 = core::cm_record_v0(data, wide_);
    const std::uint32_t shape = core::cm_record_shape(data, wide_);
    std::array<float, 4> share{};
    float sum = 0.0F;
    for (float& s : share) sum += s = -std::log(1.0F - 0.999F * uniform());
    vec3 p(0.0F);
    for (std::uint32_t i = 0; i < 4; ++i) p += share[i] / sum * core::cm_cell_vertex(v0, shape, i);
    return p;
  }
  /// A random direction in the cone; sometimes on its edges.
  [[nodiscard]] vec3 within_cone(std::uint32_t cone) {
    vec3 d;
    const auto longest = static_cast<int>(cone / 8);
    const auto some = [&] { return random_() % 8 == 0 ? static_cast<float>(random_() % 2) : uniform(); };
    for (int axis = 0; axis < 3; ++axis)
      d[axis] = (core::cm_clear_up(cone, static_cast<std::uint32_t>(axis)) ? 1.0F : -1.0F) *
                (axis == longest ? 1.0F : some());
    return d;
  }
  /// Whether a ray reaches a cell that has density (at any time of the shutter interval) or emits light.
  [[nodiscard]] bool hits(std::uint32_t cell, const vec3& o, const vec3& d) const {
    while (cell != CM_NONE) {
      const glm::uvec4& data = grid_.cells[cell].data;
      if (!core::cm_record_is_empty(data)) return true;
      if (!grid_.change.empty() && grid_.change[cell] != glm::uvec2(0U)) return true;
      const std::uint32_t shape = core::cm_record_shape(data, wide_);
      const glm::vec4 faces =
          core::cm_face_distances(core::cm_cell_frame(core::cm_record_v0(data, wide_), shape, o, d), shape);
      cell = core::cm_link_at(grid_.cells[cell].links, faces, core::cm_nearest_face(faces));
    }
    return false;
  }

 private:
  float uniform() { return std::uniform_real_distribution<float>()(random_); }
  const grid::TetGrid& grid_;
  bool wide_;
  test::Random random_{3};
};

struct Found {
  std::size_t cones = 0;  // of empty cells
  std::size_t clear = 0;
  std::size_t wrong = 0;  // rays
};

Found look(const grid::TetGrid& grid) {
  Rays rays(grid);
  Found found;
  for (std::uint32_t cell = 0; cell < grid.cells.size(); ++cell) {
    const glm::uvec4& data = grid.cells[cell].data;
    if (data.z != 0) continue;
    for (std::uint32_t cone = 0; cone < CM_CLEAR_CONES; ++cone) {
      ++found.cones;
      if (!core::cm_record_is_clear(data, 1U << cone)) continue;
      ++found.clear;
      if (rays.hits(cell, rays.within(cell), rays.within_cone(cone))) ++found.wrong;
    }
  }
  return found;
}

TEST(ClearCones, RaysInThemHitNothing) {
  for (const ivec3& size : {ivec3(60, 45, 50), ivec3(130, 90, 200), ivec3(9, 40, 7)}) {
    const volume::ScalarVolume volume = test::puffs(size, {-5, 3, 11});
    for (const auto cells : {grid::CellKind::linear, grid::CellKind::constant}) {
      for (const double threshold : {0.3, 0.02}) {
        grid::RefineSettings settings;
        settings.cells = cells;
        settings.threshold = threshold;
        const Found found = look(grid_of(volume, settings));
        EXPECT_EQ(found.wrong, 0U) << size.x << ' ' << threshold;
        if (threshold < 0.1) {
          EXPECT_GT(found.clear, found.cones / 5) << size.x << ": of " << found.cones;
        }
      }
    }
  }
}

TEST(ClearCones, RaysInThemHitNothingInLargeVolumes) {
  grid::RefineSettings settings;
  settings.threshold = 0.1;
  const grid::TetGrid grid =
      grid_of(test::clouds_apart(test::noise_volume({40, 36, 30}, ivec3(0), 2), {100'000, 800, 0}), settings);
  ASSERT_TRUE(grid.cube.wide());
  const Found found = look(grid);
  EXPECT_EQ(found.wrong, 0U);
  EXPECT_GT(found.clear, 0U);
}

// From a cell outside of a ball, no ray that goes away from the ball's center reaches it.
TEST(ClearCones, SurroundABall) {
  const float radius = 40.0F;
  const vec3 middle(50.0F);
  const volume::ScalarVolume volume = test::make_volume(ivec3(100), ivec3(0), [&](const ivec3& p) {
    return glm::distance(vec3(p) + 0.5F, middle) < radius ? 1.0F : 0.0F;
  });
  grid::RefineSettings settings;
  settings.threshold = 0.05;
  const grid::TetGrid grid = grid_of(volume, settings);
  Rays rays(grid);
  std::size_t cells = 0;
  std::size_t clear = 0;
  const vec3 in_cube = middle - vec3(grid.cube.origin);
  for (std::uint32_t cell = 0; cell < grid.cells.size(); ++cell) {
    const glm::uvec4& data = grid.cells[cell].data;
    const vec3 out = rays.within(cell) - in_cube;
    if (data.z != 0 || glm::length(out) < radius + 4.0F || glm::any(glm::greaterThan(glm::abs(out), vec3(radius))))
      continue;
    ++cells;
    if (core::cm_record_is_clear(data, core::cm_clear_cone(out))) ++clear;
  }
  EXPECT_GT(cells, 1000U);
  EXPECT_GT(clear, cells * 8 / 10) << "of " << cells;
}

// Cells without density may emit light. Cells without density at mid-shutter may have some before or after.
TEST(ClearCones, ExcludeEmissionAndMovingContent) {
  const volume::ScalarVolume volume = test::puffs({60, 45, 50}, ivec3(0));
  grid::RefineSettings settings;
  settings.threshold = 0.05;
  const grid::TetGrid before = grid_of(volume, settings);
  // At the start the center is still empty.
  const std::uint32_t middle =
      grid::locate(before, 0.5F * (before.content_min + before.content_max) + vec3(0.0F, 9.0F, 0.0F));
  ASSERT_EQ(before.cells[middle].data.z, 0U);
  for (const bool glows : {true, false}) {
    grid::TetGrid grid = before;
    grid.cells[middle].data.w = 0;
    if (glows) {
      grid.cells[middle].data.y |= CM_RECORD_EMITS;
    } else {
      grid.change.resize(grid.cells.size());
      grid.change[middle] = grid::pack_fit(glm::vec4(1.0F, 0.0F, 0.0F, 0.0F));
    }
    EXPECT_GT(look(grid).wrong, 0U) << "as it was";
    grid::find_clear_cones(grid);
    EXPECT_EQ(grid.cells[middle].data.w, 0U);
    EXPECT_EQ(look(grid).wrong, 0U);
  }
}

TEST(ClearCones, ExistOnlyForEmptyCells) {
  const grid::TetGrid full = grid_of(test::make_volume(ivec3(64), ivec3(0), [](const ivec3&) { return 1.0F; }), {});
  EXPECT_EQ(look(full).cones, 0U);
  EXPECT_GT(full.cells.size(), 0U);
}

}  // namespace
