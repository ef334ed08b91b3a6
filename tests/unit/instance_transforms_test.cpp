// The instance transform of a volume: images, grids and bounds equal those of a volume with that index_to_world.

#include <gtest/gtest.h>

#include <glm/gtc/matrix_transform.hpp>

#include "scene/space.hpp"
#include "support/gl_viewer.hpp"
#include "support/marches.hpp"
#include "support/osmesa_leaks.hpp"
#include "support/volumes.hpp"

namespace {

using namespace cumulet;
using glm::dmat4;
using glm::dvec3;
using glm::ivec3;
using glm::vec3;

// A smoke with a fire in it.
volume::VolumeFrame burning(const dmat4& transform = dmat4(1.0)) {
  volume::VolumeFrame frame{.density = test::noise_volume({40, 36, 30}, ivec3(0), 2)};
  frame.flame = test::make_volume(ivec3(8), {16, 8, 8}, [](const ivec3& p) { return p.x == 20 ? 4.0F : 0.5F; });
  frame.density.index_to_world = transform * frame.density.index_to_world;
  frame.flame->index_to_world = transform * frame.flame->index_to_world;
  return frame;
}

dvec3 moved(const dmat4& transform, const dvec3& p) { return dvec3(transform * glm::dvec4(p, 1.0)); }

viewer::GridSettings transmittance(double threshold) {
  viewer::GridSettings settings;
  settings.build.refine.criterion = grid::Criterion::transmittance;
  settings.build.refine.threshold = threshold;
  return settings;
}

// Powers of two and whole voxels cause no rounding.
const dmat4& exact_transform() {
  static const dmat4 transform(glm::dvec4(0, 2, 0, 0), glm::dvec4(0, 0, -2, 0), glm::dvec4(2, 0, 0, 0),
                               glm::dvec4(-16, 64, 8, 1));
  return transform;
}
const dmat4& sheared_transform() {
  static const dmat4 transform(glm::dvec4(0.7, 0.2, -0.4, 0), glm::dvec4(0.3, 1.4, 0.1, 0),
                               glm::dvec4(0.2, -0.5, 1.1, 0), glm::dvec4(3.0, -20.0, 11.0, 1));
  return transform;
}

class VolumeTransforms : public test::ViewerTest {
 protected:
  void SetUp() override {
    ViewerTest::SetUp();
    if (IsSkipped()) return;
    transformed_ = make();
    made_there_ = make();
  }
  // Shows the same scene in both viewers: one with the instance transform, one with the transform in the volume.
  void show_both(const dmat4& transform, const viewer::GridSettings& grid) {
    viewer::Medium medium;
    medium.density_scale = 0.2;
    medium.albedo = vec3(0.9F);
    for (test::Still* still : {transformed_.get(), made_there_.get()}) {
      still->set_light({30.0F, 30.0F, vec3(3.0F), vec3(0.3F)});
      still->set_medium(medium);
      still->set_grid(grid);
      still->set_camera(
          test::camera_at(moved(transform, {90.0, 60.0, 80.0}), moved(transform, {20.0, 18.0, 15.0}), 40.0));
    }
    transformed_->set_volume(burning());
    transformed_->viewer().set_transforms({{transform}});
    made_there_->set_volume(burning(transform));
  }

  std::unique_ptr<test::Still> transformed_;
  std::unique_ptr<test::Still> made_there_;
};
CUMULET_ON_BACKENDS(VolumeTransforms);

const test::Image small{24, 24, 4, 5, render::View::shaded};

TEST_P(VolumeTransforms, ImagesMatchAVolumeBuiltInPlace) {
  for (const test::MarchKind& kind : test::march_kinds) {
    show_both(exact_transform(), test::settings_of(kind, 0.02));
    const test::Picture transformed = test::render(*transformed_, small);
    EXPECT_GT(transformed.mean().x, 0.05);
    EXPECT_EQ(transformed.pixels, test::render(*made_there_, small).pixels);
  }
}

TEST_P(VolumeTransforms, ShearIsSupported) {
  show_both(sheared_transform(), test::settings_of(test::march_kinds[0]));
  const test::Image image{24, 24, 64, 5, render::View::shaded};
  const test::Picture transformed = test::render(*transformed_, image);
  const test::Picture made_there = test::render(*made_there_, image);
  std::size_t same = 0;
  for (std::size_t i = 0; i < transformed.pixels.size(); ++i)
    same += glm::distance(transformed.pixels[i], made_there.pixels[i]) < 1e-3F ? 1 : 0;
  EXPECT_GT(same, transformed.pixels.size() * 9 / 10)
      << "the same random numbers take the same ways, but where these round";
  for (int i = 0; i < 4; ++i)
    EXPECT_NEAR(transformed.mean()[i], made_there.mean()[i], 2e-3 * made_there.mean()[i]) << i;
}

// Changing the transform uploads no data and builds no grid, even if it rotates or mirrors. The image changes.
TEST_P(VolumeTransforms, MovingDoesNotRebuildTheGrid) {
  show_both(dmat4(1.0), transmittance(0.02));
  const test::Picture before = test::render(*transformed_, small);
  const viewer::Stats stats = transformed_->viewer().stats();
  const dmat4 turn = glm::scale(glm::rotate(dmat4(1.0), 1.0, dvec3(0.2, 0.9, 0.1)), dvec3(-1.3, 1.0, 1.0));
  transformed_->viewer().set_transforms({{turn}});
  EXPECT_EQ(transformed_->viewer().status().stage, Progress::Stage::idle);
  EXPECT_NE(test::render(*transformed_, small).pixels, before.pixels);
  const viewer::Stats after = transformed_->viewer().stats();
  EXPECT_EQ(after.build_seconds.upload, stats.build_seconds.upload) << "no two uploads take the same time";
  EXPECT_EQ(after.build_seconds.refine, stats.build_seconds.refine);
  transformed_->viewer().set_transforms({{}});
  EXPECT_EQ(test::render(*transformed_, small).pixels, before.pixels);
}

TEST_P(VolumeTransforms, ScalingWithTransmittanceCriterionRebuildsTheGrid) {
  show_both(dmat4(1.0), transmittance(0.02));
  test::render(*transformed_, small);
  const std::uint64_t cells = transformed_->viewer().stats().cells;
  const dmat4 large = glm::scale(dmat4(1.0), dvec3(8.0));
  show_both(large, transmittance(0.02));
  test::render(*transformed_, small);
  test::render(*made_there_, small);
  EXPECT_NE(transformed_->viewer().stats().cells, cells);
  EXPECT_EQ(transformed_->viewer().stats().cells, made_there_->viewer().stats().cells);
}

TEST_P(VolumeTransforms, ViewAdaptiveGridFollowsTheTransform) {
  viewer::GridSettings settings = test::settings_of(test::march_kinds[0], 0.001);
  settings.camera_adaptive = true;
  settings.build.refine.pixel_size = 3.0;
  show_both(exact_transform(), settings);
  test::render(*transformed_, small);
  test::render(*made_there_, small);
  const std::uint64_t cells = transformed_->viewer().stats().cells;
  EXPECT_EQ(cells, made_there_->viewer().stats().cells);
  transformed_->viewer().set_transforms({{glm::translate(dmat4(1.0), dvec3(0.0, 0.0, -600.0)) * exact_transform()}});
  test::render(*transformed_, small);
  EXPECT_LT(transformed_->viewer().stats().cells, cells) << "far away";
}

TEST_P(VolumeTransforms, BoundsAreTransformed) {
  show_both(sheared_transform(), test::settings_of(test::march_kinds[0], 0.1));
  test::render(*transformed_, small);
  test::render(*made_there_, small);
  const viewer::Bounds a = transformed_->viewer().bounds();
  const viewer::Bounds b = made_there_->viewer().bounds();
  EXPECT_LT(glm::distance(a.min, b.min) + glm::distance(a.max, b.max), 1e-9);
  transformed_->viewer().frame_all();
  made_there_->viewer().frame_all();
  const dvec3 eye = made_there_->viewer().camera()->pose().eye;
  // The rays that find the visible extent are placed in the space of each file, so the fits differ by half a percent.
  EXPECT_LT(glm::distance(transformed_->viewer().camera()->pose().eye, eye), 1e-2 * glm::length(eye));
}

TEST(TransformedEmission, PowerScalesWithVolume) {
  scene::EmissiveTable table;
  table.cells.resize(1);
  table.power = 3.0;
  table.length = 2.0;
  const scene::InstanceEmissive twice = scene::emissive_of(table, dmat4(1.0), glm::scale(dmat4(1.0), dvec3(2.0)));
  EXPECT_DOUBLE_EQ(twice.power, 24.0);
  EXPECT_DOUBLE_EQ(twice.length, 4.0);
  EXPECT_FLOAT_EQ(twice.looks.density, 1.0F / 24.0F);
  EXPECT_LE(twice.looks.min_stretch, 2.0F);
  EXPECT_GT(twice.looks.min_stretch, 1.9F);
}

}  // namespace
