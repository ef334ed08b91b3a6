// A volume with several instance transforms: images equal those of one volume with the sum of the densities.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>

#include "assets/instance.hpp"
#include "base/error.hpp"
#include "support/blocks.hpp"
#include "support/cloud_test.hpp"
#include "support/gl_viewer.hpp"
#include "support/marches.hpp"
#include "support/osmesa_leaks.hpp"
#include "support/surfaces.hpp"
#include "support/volumes.hpp"

namespace {

using namespace cumulet;
using glm::dmat4;
using glm::dvec3;
using glm::dvec4;
using glm::ivec3;
using glm::vec3;

using Offsets = std::vector<ivec3>;

volume::ScalarVolume cloud() { return test::noise_volume({24, 20, 22}, ivec3(0), 2); }
volume::ScalarVolume flames() {
  return test::make_volume({12, 10, 12}, {5, 4, 5}, [](const ivec3& p) { return p.x < 8 ? 1.5F : 0.25F; });
}

// One volume with the sum of all translated copies.
volume::ScalarVolume merged(const volume::ScalarVolume& one, const Offsets& offsets) {
  ivec3 low(1 << 20);
  ivec3 high(-(1 << 20));
  for (const ivec3& offset : offsets) {
    low = glm::min(low, one.bounds_min + offset);
    high = glm::max(high, one.bounds_max + offset);
  }
  return test::make_volume(high - low + 1, low, [&](const ivec3& p) {
    float sum = 0.0F;
    for (const ivec3& offset : offsets) sum += test::value_at(one, p - offset);
    return sum;
  });
}

std::vector<scene::InstanceTransform> transforms_of(const Offsets& offsets) {
  std::vector<scene::InstanceTransform> transforms;
  for (const ivec3& offset : offsets) transforms.push_back({glm::translate(dmat4(1.0), dvec3(offset))});
  return transforms;
}

class OverlappingVolumes : public test::CloudTest {
 protected:
  static constexpr std::uint32_t edge = 16;

  void SetUp() override {
    test::CloudTest::SetUp();
    if (IsSkipped()) return;
    look_from({60.0, 50.0, 70.0}, {14.0, 10.0, 14.0});
  }
  void look_from(const dvec3& eye, const dvec3& at) { still_->set_camera(test::camera_at(eye, at, 32.0)); }
  void show(volume::ScalarVolume density, std::optional<volume::ScalarVolume> flame, const Offsets& offsets) {
    CloudTest::show(std::move(density), std::move(flame));
    viewer().set_transforms(transforms_of(offsets));
  }
  test::Blocks blocks(std::uint32_t samples = 64, unsigned pictures = 6) {
    return test::blocks_of(pictures, [&](unsigned k) {
      return test::render(*still_, {edge, edge, samples, 100 + k, render::View::shaded});
    });
  }
  // Compares the instances with the merged volume.
  void expect_same_as_merged(const Offsets& offsets, bool burns = false) {
    const auto flame = burns ? std::optional(flames()) : std::nullopt;
    show(cloud(), flame, offsets);
    const test::Blocks several = blocks();
    show(merged(cloud(), offsets), burns ? std::optional(merged(*flame, offsets)) : std::nullopt, {ivec3(0)});
    test::expect_alike(several, blocks());
  }
};
CUMULET_ON_BACKENDS(OverlappingVolumes);

const Offsets apart{{0, 0, 0}, {30, 0, 0}, {0, 0, 28}};
const Offsets overlapping{{0, 0, 0}, {9, 3, 0}, {4, -5, 10}, {9, 3, 0}};

// Transmittance of `count` slabs, in closed form.
TEST_P(OverlappingVolumes, ExtinctionsAddUpAlongARay) {
  only_absorb(0.05);
  const auto slab = test::make_volume({64, 64, 8}, ivec3(0), [](const ivec3&) { return 1.0F; });
  still_->set_camera(test::camera_at({31.5, 31.5, 300.0}, {31.5, 31.5, 0.0}, 0.5));
  for (const test::MarchKind& kind : test::march_kinds) {
    still_->set_grid(test::settings_of(kind));
    for (const int count : {2, 3, 5}) {
      Offsets offsets;
      for (int i = 0; i < count; ++i) offsets.push_back({0, 0, 3 * i + (i > 2 ? 20 : 0)});
      show(slab, std::nullopt, offsets);
      const double transmittance = test::render(*still_, {16, 16, 256, 1, render::View::shaded}).mean().x;
      const double expected = std::exp(-0.05 * 8.0 * count);
      EXPECT_NEAR(transmittance, expected, 4.5 * std::sqrt(expected * (1.0 - expected) / 65536.0)) << count;
    }
  }
}

TEST_P(OverlappingVolumes, SeparateVolumesMatchOneMergedVolume) { expect_same_as_merged(apart); }
TEST_P(OverlappingVolumes, TwoMatchOneMergedVolume) { expect_same_as_merged(overlapping); }

TEST_P(OverlappingVolumes, TenMatchOneMergedVolume) {
  Offsets ten = overlapping;
  ten.insert(ten.end(), {{-6, 2, 5}, {12, -4, 8}, {2, 7, 3}, {15, 1, -4}, {6, 5, 13}, {-3, -6, 1}});
  expect_same_as_merged(ten);
}

TEST_P(OverlappingVolumes, VoxelGridsMatchOneMergedVolume) {
  for (const render::March march : {render::March::dense, render::March::brick}) {
    still_->set_grid(test::settings_of({march, grid::CellKind::constant}));
    expect_same_as_merged(overlapping);
  }
}

TEST_P(OverlappingVolumes, CameraMayBeInside) {
  look_from({13.0, 10.0, 12.0}, {20.0, 12.0, 20.0});
  expect_same_as_merged(overlapping);
}

TEST_P(OverlappingVolumes, FiresAreVisibleAndEmitLight) {
  medium_.field_emission.flame_strength = 0.5;
  still_->set_medium(medium_);
  expect_same_as_merged(apart, true);
  expect_same_as_merged(overlapping, true);
}

TEST_P(OverlappingVolumes, MediumEmissionIsVisible) {
  medium_.emission = {0.5F, 0.2F, 0.1F};
  still_->set_medium(medium_);
  expect_same_as_merged(overlapping);
}

TEST_P(OverlappingVolumes, RenderAmongSurfaces) {
  auto scene = std::make_shared<test::StillScene>();
  surface::Material emissive = test::diffuse(vec3(0.3F));
  emissive.emission = {3.0F, 2.0F, 1.0F};
  scene->add_sphere({16.0F, 24.0F, 14.0F}, 4.0F, scene->add(emissive), 8);
  scene->add_quad({{{-60, -8, 70}, {80, -8, 70}, {80, -8, -40}, {-60, -8, -40}}},
                  scene->add(test::diffuse(vec3(0.6F))));
  viewer().show_surfaces(test::source_of(scene));
  expect_same_as_merged(overlapping);
  medium_.field_emission.flame_strength = 0.5;
  still_->set_medium(medium_);
  expect_same_as_merged(overlapping, true);
}

// Two instances at half the density equal one, with a rotated, stretched and sheared transform.
TEST_P(OverlappingVolumes, TwoAtHalfDensityMatchOne) {
  const dmat4 transform(dvec4(0.7, 0.2, -0.4, 0), dvec4(0.3, 1.4, 0.1, 0), dvec4(0.2, -0.5, 1.1, 0),
                        dvec4(3.0, -2.0, 11.0, 1));
  show(cloud(), std::nullopt, {ivec3(0)});
  viewer().set_transforms({{transform}});
  const test::Blocks once = blocks();
  medium_.density_scale *= 0.5;
  still_->set_medium(medium_);
  viewer().set_transforms({{transform}, {transform}});
  test::expect_alike(once, blocks());
}

TEST_P(OverlappingVolumes, ImageDoesNotDependOnTiming) {
  show(cloud(), std::nullopt, overlapping);
  const test::Image image{edge, edge, 8, 3, render::View::shaded};
  const test::Picture whole = test::render(*still_, image);
  still_->set_camera(test::camera_at({61.0, 50.0, 70.0}, {14.0, 10.0, 14.0}, 32.0));
  test::render(*still_, image);
  look_from({60.0, 50.0, 70.0}, {14.0, 10.0, 14.0});
  EXPECT_EQ(test::render(*still_, image, 0.5).pixels, whole.pixels) << "in bounded steps";
}

// A thousand instances: each one is visible at any position.
TEST_P(OverlappingVolumes, ThousandVolumesRender) {
  only_absorb(3.0);
  Offsets offsets;
  for (int i = 0; i < 1024; ++i) offsets.push_back({20 * (i % 32), 20 * (i / 32), (i * 37) % 400});
  show(test::make_volume(ivec3(8), ivec3(0), [](const ivec3&) { return 1.0F; }), std::nullopt, offsets);
  viewer::CameraPose pose = test::camera_at({313.5, 313.5, 5000.0}, {313.5, 313.5, 0.0}, 30.0);
  pose.orthographic_height = 640.0;
  still_->set_camera(pose);
  const test::Picture picture = test::render(*still_, {64, 64, 64, 1, render::View::shaded});
  // 8 x 8 of 20 x 20 are dark.
  EXPECT_NEAR(picture.mean().x, 1.0 - 64.0 / 400.0, 2e-3);
  EXPECT_EQ(viewer().bounds().max.z, 406.5);
}

// AOVs and debug views have no noise. They are equal for instances and for one volume with the same voxels.
TEST_P(OverlappingVolumes, AovsAndDebugViewsMatchOneMergedVolume) {
  const Offsets many{{0, 0, 0}, {9, 3, 0}, {4, -5, 10}, {9, 3, 0}, {30, 0, 0}};
  const test::Image image{edge, edge, 1, 1, render::View::shaded};
  constexpr std::size_t pixels = std::size_t{edge} * edge;
  for (const test::MarchKind& kind : {test::march_kinds[1], test::march_kinds[3]}) {
    still_->set_grid(test::settings_of(kind));
    struct Outputs {
      std::vector<float> transmittance = std::vector<float>(pixels);
      std::vector<float> z = std::vector<float>(pixels);
      test::Picture view;
      viewer::Pick pick;
    };
    const auto find = [&] {
      Outputs outputs;
      test::render(*still_, image);
      viewer().read_aov(viewer::Aov::transmittance, outputs.transmittance.data(), pixels);
      viewer().read_aov(viewer::Aov::volume_depth, outputs.z.data(), pixels);
      outputs.pick = viewer().pick(0.5 * edge, 0.5 * edge);
      outputs.view = test::render(*still_, {edge, edge, 1, 1, render::View::density});
      return outputs;
    };
    show(cloud(), std::nullopt, many);
    const Outputs several = find();
    show(merged(cloud(), many), std::nullopt, {ivec3(0)});
    const Outputs one = find();
    std::size_t opaque = 0;
    for (std::size_t i = 0; i < pixels; ++i) {
      EXPECT_NEAR(several.transmittance[i], one.transmittance[i], 2e-3) << i;
      EXPECT_NEAR(several.view.pixels[i].w, one.view.pixels[i].w, 2e-3) << i;
      if (std::isinf(one.z[i])) continue;
      ++opaque;
      EXPECT_NEAR(several.z[i], one.z[i], 0.1F) << i;
    }
    EXPECT_GT(opaque, pixels / 20);
    EXPECT_TRUE(one.pick.hit);
    EXPECT_TRUE(several.pick.hit);
    EXPECT_EQ(one.pick.transform_index, 0U);
    EXPECT_TRUE(several.pick.transform_index);
    EXPECT_LT(glm::distance(several.pick.position, one.pick.position), 0.1);
  }
}

TEST_P(OverlappingVolumes, PicksReturnTheVolume) {
  const std::array<dvec3, 3> middles{dvec3(11.5, 9.5, 10.5), dvec3(41.5, 9.5, 10.5), dvec3(11.5, 9.5, 38.5)};
  medium_.density_scale = 3.0;
  still_->set_medium(medium_);
  show(cloud(), std::nullopt, apart);
  const auto pick_at = [&](const dvec3& middle) {
    look_from(middle + dvec3(0.0, 80.0, 1.0), middle);
    test::render(*still_, {edge, edge, 1, 1, render::View::shaded});
    return viewer().pick(0.5 * edge, 0.5 * edge);
  };
  for (std::uint32_t i = 0; i < middles.size(); ++i) EXPECT_EQ(pick_at(middles[i]).transform_index, i);
  auto scene = std::make_shared<test::StillScene>();
  scene->add_sphere({41.5F, 60.0F, 10.5F}, 4.0F, scene->add(test::diffuse(vec3(0.5F))), 8);
  viewer().show_surfaces(test::source_of(scene));
  const viewer::Pick surface = pick_at(middles[1]);
  EXPECT_TRUE(surface.hit);
  EXPECT_FALSE(surface.transform_index);
}

// Overlap deeper than the list of active volumes that kernels keep. Later volumes are processed afterwards, and paths
// lose none.
TEST_P(OverlappingVolumes, MayOverlapManyTimes) {
  medium_ = {};
  medium_.albedo = vec3(0.0F);
  medium_.density_scale = 0.01;
  still_->set_medium(medium_);
  still_->set_light({0.0F, 0.0F, vec3(0.0F), vec3(1.0F)});
  still_->set_camera(test::camera_at({31.5, 31.5, 300.0}, {31.5, 31.5, 0.0}, 0.5));
  show(test::make_volume({64, 64, 8}, ivec3(0), [](const ivec3&) { return 1.0F; }), std::nullopt,
       Offsets(20, ivec3(0)));
  const double transmittance = test::render(*still_, {16, 16, 256, 1, render::View::shaded}).mean().x;
  const double expected = std::exp(-0.01 * 8.0 * 20);
  EXPECT_NEAR(transmittance, expected, 4.5 * std::sqrt(expected * (1.0 - expected) / 65536.0));
}

// A transform too far away for the instance tree is rejected. The previous state stays and can be restored.
TEST_P(OverlappingVolumes, RejectedVolumeKeepsTheOthers) {
  const test::Image image{edge, edge, 4, 3, render::View::shaded};
  const auto picture = [&] {
    test::render(*still_, image);
    return still_->read();
  };
  // The error is returned once per setting.
  const auto picture_after_refusal = [&] {
    EXPECT_THROW(test::render(*still_, image), Error);
    while (!still_->render(1e9)) {
    }
    return still_->read();
  };
  show(cloud(), std::nullopt, apart);
  const std::vector<float> before = picture();
  std::vector<scene::InstanceTransform> far = transforms_of(apart);
  far.push_back({glm::translate(dmat4(1.0), dvec3(1e13, 0.0, 0.0))});
  viewer().set_transforms(far);
  EXPECT_EQ(picture_after_refusal(), before) << "as it was";
  // Another volume has no instance table at that time, so it is displayed once, with the first transform.
  still_->set_volume(merged(cloud(), overlapping));
  const std::vector<float> once = picture_after_refusal();
  viewer().set_transforms({{}});
  EXPECT_EQ(picture(), once);
  show(cloud(), std::nullopt, apart);
  EXPECT_EQ(picture(), before);
}

TEST_P(OverlappingVolumes, CanBeAddedAndRemoved) {
  show(cloud(), std::nullopt, {ivec3(0)});
  const test::Image image{edge, edge, 4, 3, render::View::shaded};
  const test::Picture one = test::render(*still_, image);
  viewer().set_transforms(transforms_of(overlapping));
  const test::Picture several = test::render(*still_, image);
  EXPECT_NE(several.pixels, one.pixels);
  viewer().set_transforms(transforms_of(apart));
  EXPECT_NE(test::render(*still_, image).pixels, several.pixels);
  viewer().set_transforms(transforms_of(overlapping));
  EXPECT_EQ(test::render(*still_, image).pixels, several.pixels);
  viewer().set_transforms({{}});
  EXPECT_EQ(test::render(*still_, image).pixels, one.pixels);
}

// ---- Several volumes ----------------------------------------------------------------------------------------------

volume::ScalarVolume other_cloud() { return test::noise_volume({18, 26, 20}, ivec3(0), 3); }

viewer::VolumeAssetPtr asset_of(volume::ScalarVolume density) {
  return std::make_shared<const viewer::VolumeAsset>(std::move(density));
}

dmat4 at(const dvec3& offset) { return glm::translate(dmat4(1.0), offset); }

volume::ScalarVolume sum_of(const volume::ScalarVolume& a, const ivec3& at_a, const volume::ScalarVolume& b,
                            const ivec3& at_b) {
  const ivec3 low = glm::min(a.bounds_min + at_a, b.bounds_min + at_b);
  const ivec3 high = glm::max(a.bounds_max + at_a, b.bounds_max + at_b);
  return test::make_volume(high - low + 1, low,
                           [&](const ivec3& p) { return test::value_at(a, p - at_a) + test::value_at(b, p - at_b); });
}

class VolumeInstances : public OverlappingVolumes {
 protected:
  std::shared_ptr<viewer::Instance> add(viewer::VolumeAssetPtr volume, const dvec3& offset, std::uint64_t tag = 0) {
    auto instance = std::make_shared<viewer::Instance>(
        viewer::InstanceSettings{.volume = std::move(volume), .to_world = at(offset), .medium = medium_, .tag = tag});
    viewer().add_instance(instance);
    still_->build();
    return instance;
  }
  double transmittance(std::uint32_t samples = 256) {
    still_->build();
    return test::render(*still_, {16, 16, samples, 1, render::View::shaded}).mean().x;
  }
  void look_along_z() { still_->set_camera(test::camera_at({31.5, 31.5, 300.0}, {31.5, 31.5, 0.0}, 0.5)); }
  static viewer::VolumeAssetPtr slab() {
    return asset_of(test::make_volume({64, 64, 8}, ivec3(0), [](const ivec3&) { return 1.0F; }));
  }
  static void expect_transmittance(double found, double depth, std::uint32_t samples = 256) {
    const double expected = std::exp(-depth);
    EXPECT_NEAR(found, expected, 4.5 * std::sqrt(expected * (1.0 - expected) / (256.0 * samples)));
  }
};
CUMULET_ON_BACKENDS(VolumeInstances);

// Volumes with other index_to_world matrices and transforms, with the viewer's own volume and without it.
TEST_P(VolumeInstances, OfOtherVolumesMatchTheirSum) {
  const ivec3 aside(9, 3, 4);
  show(sum_of(cloud(), ivec3(0), other_cloud(), aside), std::nullopt, {ivec3(0)});
  const test::Blocks one = blocks();
  show(cloud(), std::nullopt, {ivec3(0)});
  const auto other = add(asset_of(other_cloud()), dvec3(aside));
  test::expect_alike(blocks(), one);
  still_->set_volume(nullptr);
  const auto first = add(asset_of(cloud()), dvec3(0.0));
  test::expect_alike(blocks(), one);
}

// Only one volume has flames. Missing channels are not read.
TEST_P(VolumeInstances, MayEmitOrNot) {
  medium_.field_emission.flame_strength = 0.5;
  still_->set_medium(medium_);
  const ivec3 aside(9, 3, 4);
  show(sum_of(cloud(), aside, other_cloud(), ivec3(0)), merged(flames(), {aside}), {ivec3(0)});
  const test::Blocks one = blocks();
  still_->set_volume(asset_of(other_cloud()));
  volume::VolumeFrame fire{.density = cloud()};
  fire.flame = flames();
  const auto burning = add(std::make_shared<const viewer::VolumeAsset>(std::move(fire)), dvec3(aside));
  test::expect_alike(blocks(), one);
}

TEST_P(VolumeInstances, HaveSeparateMedia) {
  only_absorb(0.05);
  look_along_z();
  still_->set_volume(slab());
  medium_.density_scale = 0.02;
  const auto thin = add(slab(), {0.0, 0.0, 4.0});
  medium_.density_scale = 0.03;
  const auto aside =
      add(asset_of(test::make_volume({64, 64, 4}, ivec3(0), [](const ivec3&) { return 2.0F; })), {0.0, 0.0, 40.0});
  expect_transmittance(transmittance(), 0.05 * 8.0 + 0.02 * 8.0 + 0.03 * 2.0 * 4.0);
  aside->edit([](viewer::InstanceSettings& settings) { settings.hidden = true; });
  expect_transmittance(transmittance(), 0.05 * 8.0 + 0.02 * 8.0);
  aside->edit([](viewer::InstanceSettings& settings) { settings.hidden = false; });
  thin->edit([](viewer::InstanceSettings& settings) { settings.medium.density_scale = 0.1; });
  expect_transmittance(transmittance(), 0.05 * 8.0 + 0.1 * 8.0 + 0.03 * 2.0 * 4.0);
  viewer().remove_instance(*thin);
  expect_transmittance(transmittance(), 0.05 * 8.0 + 0.03 * 2.0 * 4.0);
  EXPECT_THROW(viewer().remove_instance(*thin), Error);
  EXPECT_THROW(viewer().add_instance(aside), Error);
  still_->set_volume(nullptr);
  expect_transmittance(transmittance(), 0.03 * 2.0 * 4.0);
  viewer().remove_instance(*aside);
  viewer().render({});
  EXPECT_THROW(viewer().bounds(), Error) << "nothing is left";
}

// Each instance has its own ramp, applied to voxels before cells are built.
TEST_P(VolumeInstances, HaveSeparateRamps) {
  only_absorb(0.05);
  look_along_z();
  const auto volume = slab();
  still_->set_volume(volume);
  const auto doubled = add(volume, {0.0, 0.0, 20.0});
  doubled->edit([](viewer::InstanceSettings& settings) {
    settings.ramps.density = volume::Ramp({{0.0F, 0.0F}, {1.0F, 2.0F}});
  });
  expect_transmittance(transmittance(), 0.05 * 8.0 + 0.1 * 8.0);
}

TEST_P(VolumeInstances, OfOneVolumeShareItsGrid) {
  still_->set_volume(asset_of(cloud()));
  const test::Blocks at_offsets = [&] {
    viewer().set_transforms(transforms_of(overlapping));
    return blocks();
  }();
  viewer().set_transforms(transforms_of({ivec3(0)}));
  static_cast<void>(transmittance(1));
  const viewer::Stats alone = viewer().stats();
  std::vector<std::shared_ptr<viewer::Instance>> held;
  for (std::size_t i = 1; i < overlapping.size(); ++i) held.push_back(add(viewer().volume(), dvec3(overlapping[i])));
  test::expect_alike(blocks(), at_offsets);
  EXPECT_EQ(viewer().stats().cells, alone.cells);
  EXPECT_EQ(viewer().stats().cell_bytes, alone.cell_bytes);
  // When the viewer's volume changes, the instances keep their grid.
  still_->set_volume(nullptr);
  static_cast<void>(transmittance(1));
  EXPECT_EQ(viewer().stats().cell_bytes, alone.cell_bytes);
  EXPECT_EQ(viewer().bounds().min, dvec3(3.5, -5.5, -0.5));
}

TEST_P(VolumeInstances, PicksReturnTheirTag) {
  medium_.density_scale = 3.0;
  still_->set_medium(medium_);
  show(cloud(), std::nullopt, {{0, 0, 0}, {30, 0, 0}});
  const auto third = add(asset_of(other_cloud()), {0.0, 0.0, 28.0}, 77);
  const auto pick_at = [&](const dvec3& middle) {
    look_from(middle + dvec3(0.0, 80.0, 1.0), middle);
    test::render(*still_, {edge, edge, 1, 1, render::View::shaded});
    return viewer().pick(0.5 * edge, 0.5 * edge);
  };
  const viewer::Pick own = pick_at({41.5, 9.5, 10.5});
  EXPECT_EQ(own.transform_index, 1U);
  EXPECT_EQ(own.tag, 0U);
  const viewer::Pick other = pick_at({8.5, 12.5, 37.5});
  EXPECT_EQ(other.transform_index, 0U);
  EXPECT_EQ(other.tag, 77U);
}

// Voxel grids cannot show different volumes together. The error is returned, and the previous image stays.
TEST_P(VolumeInstances, OfVoxelGridsShareOneGrid) {
  still_->set_grid(test::settings_of({render::March::brick, grid::CellKind::constant}));
  const auto volume = asset_of(cloud());
  still_->set_volume(volume);
  const auto same = add(volume, {30.0, 0.0, 0.0});
  static_cast<void>(transmittance(1));
  const auto other = std::make_shared<viewer::Instance>(viewer::InstanceSettings{.volume = asset_of(other_cloud())});
  viewer().add_instance(other);
  EXPECT_THROW(still_->build(), Error);
  EXPECT_GT(viewer().stats().samples, 0U) << "what was shown stays";
  viewer().remove_instance(*other);
  EXPECT_GT(transmittance(1), 0.0);
}

// Changed settings of the viewer's own volume do not affect an instance of the same volume.
TEST_P(VolumeInstances, DoNotDependOnTheViewersOwnSettings) {
  only_absorb(0.05);
  look_along_z();
  const auto volume = slab();
  still_->set_volume(volume);
  static_cast<void>(transmittance(1));
  medium_.field_emission.flame_strength = 2.0;  // it has no flames
  still_->set_medium(medium_);
  const auto again = add(volume, {0.0, 0.0, 20.0});
  expect_transmittance(transmittance(), 2.0 * 0.05 * 8.0);
  viewer().load_volume({"/nowhere.vdb", {}});
  EXPECT_THROW(still_->build(), Error);
  const auto third = std::make_shared<viewer::Instance>(
      viewer::InstanceSettings{.volume = volume, .to_world = at({0.0, 0.0, 40.0}), .medium = medium_});
  viewer().add_instance(third);
  viewer().set_volume(volume);
  expect_transmittance(transmittance(), 3.0 * 0.05 * 8.0);
}

// An instance that was hidden shows its own grid again, without a rebuild.
TEST_P(VolumeInstances, ReappearWithoutARebuild) {
  only_absorb(0.05);
  look_along_z();
  const auto hide = [](viewer::Instance& instance, bool hidden) {
    instance.edit([&](viewer::InstanceSettings& settings) { settings.hidden = hidden; });
  };
  const auto thick = add(slab(), {0.0, 0.0, 0.0});
  hide(*thick, true);
  const auto thin =
      add(asset_of(test::make_volume({64, 64, 2}, ivec3(0), [](const ivec3&) { return 1.0F; })), {0.0, 0.0, 40.0});
  expect_transmittance(transmittance(), 0.05 * 2.0);
  hide(*thick, false);
  const test::Picture at_once = test::render(*still_, {16, 16, 256, 1, render::View::shaded});
  expect_transmittance(at_once.mean().x, 0.05 * 10.0);
  // The only visible instance is removed and another added, with a fixed camera.
  viewer().remove_instance(*thin);
  hide(*thick, true);
  viewer().render(frame(16, 16));
  const auto later = add(asset_of(test::make_volume({64, 64, 4}, ivec3(0), [](const ivec3&) { return 1.0F; })), {});
  expect_transmittance(transmittance(), 0.05 * 4.0);
}

// When the grid type changes, the old image stays until all volumes are built.
TEST_P(VolumeInstances, ChangeTheirGridTypeTogether) {
  only_absorb(0.05);
  look_along_z();
  still_->set_volume(slab());
  const auto other =
      add(asset_of(test::make_volume({64, 64, 4}, ivec3(0), [](const ivec3&) { return 1.0F; })), {0.0, 0.0, 20.0});
  for (const int kind : {0, 1, 0}) {
    still_->set_grid(test::settings_of(test::march_kinds[static_cast<std::size_t>(kind)]));
    expect_transmittance(transmittance(), 0.05 * 12.0);
  }
  viewer().rebuild();
  expect_transmittance(transmittance(), 0.05 * 12.0);
}

// A camera-adaptive grid is as fine as its nearest instance needs.
TEST_P(VolumeInstances, AreRefinedForTheCamera) {
  viewer::GridSettings adaptive = test::settings_of(test::march_kinds[1]);
  adaptive.camera_adaptive = true;
  adaptive.build.refine.pixel_size = 2.0;
  still_->set_grid(adaptive);
  const auto volume = asset_of(test::noise_volume(ivec3(48), ivec3(0), 2));
  look_from({60.0, 50.0, 70.0}, {14.0, 10.0, 14.0});
  const auto far = add(volume, {-2000.0, -2000.0, -4000.0});
  const auto cells = [&] {
    for (int i = 0; i < 3; ++i) static_cast<void>(transmittance(1));
    return viewer().stats().cells;
  };
  const std::uint64_t coarse = cells();
  const auto near = add(volume, {0.0, 0.0, 0.0});
  EXPECT_GT(cells(), 2 * coarse);
}

}  // namespace
