// The GPU path tracer compared with the same source on the CPU.

#include "support/cpu_tracer.hpp"
#include "support/grid_reference.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "support/gl_viewer.hpp"
#include "support/osmesa_leaks.hpp"
#include "support/surfaces.hpp"
#include "support/volumes.hpp"

namespace {

using namespace cumulet;
using glm::ivec3;
using glm::vec3;
using render::March;
using surface::Material;
using test::StillScene;

class CpuTracer : public test::ViewerTest {};
CUMULET_ON_BACKENDS(CpuTracer);

viewer::GridSettings settings_of(March march, double threshold = 0.02) {
  viewer::GridSettings s;
  s.build.march = march;
  s.build.refine.threshold = threshold;
  return s;
}

grid::TetGrid grid_of(const volume::ScalarVolume& volume, const viewer::GridSettings& settings) {
  return test::GridReference(volume).grid(settings.build.refine);
}

core::CpuTet twin_of(test::Still& shown, const grid::TetGrid& grid, std::uint32_t samples) {
  core::CpuTet twin;
  twin.cm = shown.viewer().trace_parameters();
  twin.cm.dispatch.samples = samples;
  twin.grid = &grid;
  return twin;
}

void show(test::Still& in, const volume::ScalarVolume& volume, double density_scale) {
  in.set_volume(volume);
  in.set_medium({density_scale, vec3(0.9F), {0.4F}, 0});
  in.set_light({30.0F, 30.0F, vec3(3.0F), vec3(0.3F)});
}

/// The fraction of pixels that equal the CPU tracer's.
template <class Twin>
double same_pixels(Twin& twin, const test::Picture& gpu) {
  std::size_t same = 0;
  for (std::uint32_t i = 0; i < gpu.pixels.size(); ++i) {
    const typename Twin::CmPixel pixel = twin.traced({i % gpu.width, i / gpu.width});
    const glm::vec4 mean = pixel.sum / static_cast<float>(pixel.samples) + glm::vec4(pixel.background, 0.0F);
    const float size = std::max(1.0F, glm::length(gpu.pixels[i]));
    same += glm::distance(mean, gpu.pixels[i]) < 2e-3F * size ? 1 : 0;
  }
  return double(same) / double(gpu.pixels.size());
}

TEST_P(CpuTracer, VolumePathsMatchTheGpu) {
  const auto volume = test::noise_volume({40, 36, 30}, ivec3(0), 2);
  const auto viewer = make();
  show(*viewer, volume, 0.3);
  const test::Image image{24, 24, 1, 5, render::View::shaded};

  // If a logarithm or cosine rounds differently, a path may diverge from its CPU counterpart.
  viewer->set_grid(settings_of(March::tet));
  const test::Picture tet = test::render(*viewer, image);
  const grid::TetGrid grid = grid_of(volume, settings_of(March::tet));
  core::CpuTet cpu_tet = twin_of(*viewer, grid, image.samples);
  EXPECT_GT(same_pixels(cpu_tet, tet), 0.99);

  viewer->set_grid(settings_of(March::dense));
  const test::Picture dense = test::render(*viewer, image);
  core::CpuDense cpu_dense;
  cpu_dense.cm = viewer->viewer().trace_parameters();
  cpu_dense.cm.dispatch.samples = image.samples;
  cpu_dense.volume = &volume;
  cpu_dense.origin = grid::fit_cube(volume).origin;
  EXPECT_GT(same_pixels(cpu_dense, dense), 0.99);
}

// Clear cones of empty cells end paths early. The result is bit-identical with fewer steps.
TEST_P(CpuTracer, ClearConesEndPathsWithBitIdenticalImages) {
  const auto volume = test::puffs({40, 36, 30}, ivec3(0));
  const auto viewer = make();
  show(*viewer, volume, 9.0);
  const test::Image image{24, 24, 4, 5, render::View::shaded};
  viewer->set_grid(settings_of(March::tet));
  test::render(*viewer, image);
  const grid::TetGrid with = grid_of(volume, settings_of(March::tet));
  const grid::TetGrid without = test::without_clear_cones(with);
  const auto trace = [&](const grid::TetGrid& grid) {
    std::vector<glm::vec4> sums;
    core::CpuTet twin = twin_of(*viewer, grid, image.samples);
    std::size_t steps = 0;
    for (std::uint32_t i = 0; i < image.width * image.height; ++i) {
      const core::CpuTet::CmPixel pixel = twin.traced({i % image.width, i / image.width});
      sums.push_back(pixel.sum);
      steps += pixel.steps;
    }
    return std::pair(sums, steps);
  };
  const auto [sums, steps] = trace(with);
  const auto [wanted, max_steps] = trace(without);
  EXPECT_EQ(sums, wanted);
  EXPECT_LT(static_cast<double>(steps), 0.9 * static_cast<double>(max_steps));
}

/// A room around a volume: a textured floor, a coated ball, a semi-transparent pane, and a light from the scene.
std::shared_ptr<StillScene> room() {
  auto scene = std::make_shared<StillScene>();
  std::mt19937 random(3);
  std::uniform_int_distribution<int> byte(60, 255);
  std::vector<std::uint8_t> texels;
  for (int i = 0; i < 4 * 8 * 8; ++i) texels.push_back(static_cast<std::uint8_t>(byte(random)));
  Material floor = test::diffuse(vec3(0.8F));
  floor.base_color_texture.texture = scene->add_texture(8, 8, texels);
  floor.base_color_texture.transform = glm::mat3x2(3.0F, 0.0F, 0.0F, 3.0F, 0.25F, 0.0F);
  scene->add_quad({{{-40, -8, 70}, {80, -8, 70}, {80, -8, -40}, {-40, -8, -40}}}, scene->add(floor));
  Material ball;
  ball.base_color = {0.7F, 0.4F, 0.2F, 1.0F};
  ball.metallic = 0.3F;
  ball.roughness = 0.4F;
  ball.clearcoat = 0.5F;
  ball.clearcoat_roughness = 0.2F;
  scene->add_sphere({6.0F, 2.0F, 34.0F}, 9.0F, scene->add(ball), 12);
  Material veil = test::diffuse(vec3(0.9F, 0.9F, 0.3F));
  veil.base_color.a = 0.5F;
  veil.alpha_mode = surface::AlphaMode::blend;
  veil.double_sided = true;
  scene->add_quad({{{22, -8, 44}, {40, -8, 40}, {40, 14, 40}, {22, 14, 44}}}, scene->add(veil));
  surface::PunctualLight analytic_light;
  analytic_light.intensity = vec3(900.0F, 700.0F, 400.0F);
  analytic_light.position = {44.0F, 30.0F, 30.0F};
  scene->rest.lights = {analytic_light};
  return scene;
}

/// The room with an emissive triangle mesh in the air.
std::shared_ptr<StillScene> room_with_emitters() {
  auto scene = room();
  Material emissive = test::diffuse(vec3(0.2F));
  emissive.emission = {6.0F, 2.0F, 1.0F};
  scene->add_sphere({-4.0F, 16.0F, 12.0F}, 4.0F, scene->add(emissive), 8);
  return scene;
}

// About one ray in thirty million touched the bounds this way (a light in smoke), and its pixel became NaN.
// A kept cell replaces point location only where it is the result of it. Points on faces and points that differ from
// them by rounding are in question.
TEST(KeptEntryCell, IsTheCellThatPointLocationFinds) {
  const auto cloud = test::noise_volume({30, 28, 25}, ivec3(0), 1);
  const grid::TetGrid grid = grid_of(cloud, settings_of(March::tet, 0.2));
  core::CpuTet tracer;
  tracer.grid = &grid;
  tracer.cm.grid.root_exponent = static_cast<std::uint32_t>(grid.cube.log2_size - 1);
  test::Random random(3);
  std::uniform_real_distribution<float> uniform(0.0F, 1.0F);
  int kept = 0;
  constexpr int points = 20000;
  for (int i = 0; i < points; ++i) {
    vec3 p = grid.content_min +
             (grid.content_max - grid.content_min) * vec3(uniform(random), uniform(random), uniform(random));
    for (int axis = 0; axis < 3 && i % 2 == 1; ++axis) {
      if (random() % 2 == 0) p[axis] = std::round(p[axis]);
      if (random() % 4 == 0) p[axis] = std::nextafter(p[axis], 100.0F * static_cast<float>(random() % 2));
    }
    const std::uint32_t cell = tracer.cm_march_enter(p).x;
    if (i % 2 == 0 && tracer.cm_march_contains(cell, p)) ++kept;
    for (int face = 0; face < 4; ++face) {
      const std::uint32_t beside = grid.cells[cell].links[face];
      ASSERT_TRUE(beside == CM_NONE || !tracer.cm_march_contains(beside, p)) << p.x << ' ' << p.y << ' ' << p.z;
    }
  }
  EXPECT_GT(kept, 0.99 * points / 2);
}

TEST(LightPassingRay, RayThatOnlyTouchesTheBoxHasAFiniteWeight) {
  core::CpuTetPassing twin;
  twin.cm.space.to_cube_x = {1.0F, 0.0F, 0.0F};
  twin.cm.space.to_cube_y = {0.0F, 1.0F, 0.0F};
  twin.cm.space.to_cube_z = {0.0F, 0.0F, 1.0F};
  twin.cm.space.box_max = vec3(8.0F);
  twin.cm.lights.analytic_light_probability = 0.5F;
  const vec3 along_an_edge = glm::normalize(vec3(1.0F, -1.0F, 0.0F));
  const float density = twin.cm_equiangular_pdf({8.0F, 8.0F, 4.0F}, along_an_edge, {0.0F, 0.0F, 1.0F}, 2.0F);
  EXPECT_EQ(twin.cm_equiangular_weight(density, 3.0F), 1.0F);
}

// The pdf must be finite: a probability of 0 times an infinite or NaN pdf would be NaN.
TEST(EmissiveBoxSampling, PdfIsDefinedFromAnywhere) {
  core::CpuTetSurfaces twin;
  core::CmSpace& space = twin.cm.space;
  space.to_cube_x = space.from_cube_x = vec3(1.0F, 0.0F, 0.0F);
  space.to_cube_y = space.from_cube_y = vec3(0.0F, 1.0F, 0.0F);
  space.to_cube_z = space.from_cube_z = vec3(0.0F, 0.0F, 1.0F);
  space.unit_volume = 1.0F;
  space.box_max = vec3(8.0F);
  const auto density = [&](const vec3& o, const vec3& w) {
    return twin.cm_emissive_pdf(twin.cm_light_hit(CM_LIGHT_EMISSIVE, o, w, 1.0F));
  };
  const vec3 up(0.0F, 1.0F, 0.0F);
  EXPECT_GT(density(vec3(4.0F, -5.0F, 4.0F), up), 0.0F);
  EXPECT_EQ(density(vec3(9.0F, -5.0F, 4.0F), up), 0.0F) << "beside it";
  EXPECT_EQ(density(vec3(4.0F, 9.0F, 4.0F), up), 0.0F) << "behind";
  for (const float x : {-1e30F, 1e30F}) {
    EXPECT_TRUE(std::isfinite(density(vec3(x, 4.0F, 4.0F), vec3(1.0F, 0.0F, 0.0F)))) << x;
    EXPECT_TRUE(std::isfinite(density(vec3(9.0F, x, 4.0F), glm::normalize(vec3(-1e-30F, 1.0F, 0.0F))))) << x;
  }
}

class CpuTracerSurfaces : public CpuTracer {
 protected:
  void SetUp() override {
    CpuTracer::SetUp();
    if (IsSkipped()) return;
    still_ = make();
    still_->set_volume(volume_);
    viewer::Medium medium{0.2, vec3(0.9F), {.anisotropy = 0.4F}, 0};
    still_->set_medium(medium);
    still_->set_light({40.0F, 30.0F, vec3(1.0F), vec3(0.2F, 0.3F, 0.5F)});
    still_->set_camera(test::camera_at({50.0, 34.0, 90.0}, {17.0, 6.0, 18.0}, 40.0));
  }
  template <class Twin>
  double same(Twin& twin, const std::shared_ptr<StillScene>& scene, const viewer::GridSettings& settings,
              const test::Image& image) {
    const auto model = test::source_of(scene);
    still_->viewer().show_surfaces(model);
    still_->set_grid(settings);
    const test::Picture picture = test::render(*still_, image);
    twin.cm = still_->viewer().trace_parameters();
    twin.cm.surfaces = twin.show(std::vector<scene::Model>{{0, model}});
    twin.cm.dispatch.samples = image.samples;
    return same_pixels(twin, picture);
  }
  /// Compares images of one sample per pixel.
  template <class Twin>
  void expect_same(Twin& twin, const std::shared_ptr<StillScene>& scene, const viewer::GridSettings& settings) {
    for (const std::uint32_t seed : {1U, 2U}) {
      EXPECT_GT(same(twin, scene, settings, {32, 32, 1, seed, render::View::shaded}), 0.99);
    }
  }

  const volume::ScalarVolume volume_ = test::noise_volume({34, 30, 32}, ivec3(0), 2);
  std::unique_ptr<test::Still> still_;
};
CUMULET_ON_BACKENDS(CpuTracerSurfaces);

TEST_P(CpuTracerSurfaces, TrianglePathsMatchTheGpu) {
  const viewer::GridSettings settings = settings_of(March::tet);
  const grid::TetGrid grid = grid_of(volume_, settings);
  core::CpuTetSurfaces twin;
  twin.grid = &grid;
  expect_same(twin, room(), settings);
}

TEST_P(CpuTracerSurfaces, EmitterPathsMatchTheGpu) {
  const viewer::GridSettings tet = settings_of(March::tet);
  const grid::TetGrid grid = grid_of(volume_, tet);
  core::CpuTetEmitters twin;
  twin.grid = &grid;
  expect_same(twin, room_with_emitters(), tet);
  // With several samples per pixel, all samples must be equal.
  EXPECT_GT(same(twin, room_with_emitters(), tet, {32, 32, 4, 3, render::View::shaded}), 0.98);

  core::CpuDenseEmitters dense;
  dense.volume = &volume_;
  dense.origin = grid::fit_cube(volume_).origin;
  EXPECT_GT(same(dense, room_with_emitters(), settings_of(March::dense), {32, 32, 1, 1, render::View::shaded}), 0.99);
}

}  // namespace
