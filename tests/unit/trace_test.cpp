// The path tracer compared with analytic results, with an independent path tracer, and with itself.

#include <gtest/gtest.h>

#include <cstring>

#include <chrono>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <numbers>
#include <random>

#include "base/error.hpp"
#include "support/delta_tracker.hpp"
#include "support/gl_viewer.hpp"
#include "support/marches.hpp"
#include "support/osmesa_leaks.hpp"
#include "support/volumes.hpp"

namespace {

using namespace cumulet;
using glm::dvec3;
using glm::ivec3;
using glm::vec3;
using render::March;

class Trace : public test::ViewerTest {};
CUMULET_ON_BACKENDS(Trace);

volume::ScalarVolume box_volume(const ivec3& size, float value = 1.0F) {
  return test::make_volume(size, ivec3(0), [=](const ivec3& /*p*/) { return value; });
}

TEST_P(Trace, SlabFollowsBeerLambertForEveryGridType) {
  const auto viewer = make();
  viewer->set_volume(box_volume({64, 64, 8}));
  viewer::Light light;
  light.sky_radiance = vec3(2.0F);
  viewer->set_light(light);
  for (const test::MarchKind& kind : test::march_kinds) {
    viewer->set_grid(test::settings_of(kind));
    for (const double sigma : {0.02, 0.1, 0.4}) {
      viewer::Medium medium;
      medium.density_scale = sigma;
      medium.albedo = vec3(0.0F);
      viewer->set_medium(medium);
      // Straight through 8 voxels; then from the slab's center plane through 4.
      for (const double from : {500.0, 3.5}) {
        viewer->set_camera(test::camera_at({31.5, 31.5, from}, {31.5, 31.5, from - 1.0}, 0.5));
        const test::Picture picture = test::render(*viewer, {16, 16, 64, 1, render::View::shaded});
        const double through = std::exp(-sigma * (from > 100.0 ? 8.0 : 4.0));
        const double error = 4.0 * std::sqrt(through * (1.0 - through) / (256.0 * 64.0));
        EXPECT_NEAR(picture.mean().x / 2.0, through, error);
        EXPECT_NEAR(picture.mean().w, 0.0 + 1.0 - through, error);
      }
    }
  }
}

TEST_P(Trace, WhiteFurnaceIsOneEverywhere) {
  const auto viewer = make();
  viewer->set_volume(test::noise_volume({24, 20, 22}, ivec3(-3, 2, 5), 3));
  viewer::Light light;
  light.sky_radiance = vec3(1.0F);
  viewer->set_light(light);
  for (const float g : {0.0F, 0.8F, -0.5F}) {
    viewer::Medium medium;
    medium.density_scale = 0.5;
    medium.phase.anisotropy = g;
    viewer->set_medium(medium);
    for (const test::MarchKind& kind : {test::march_kinds[0], test::march_kinds[3]}) {
      viewer->set_grid(test::settings_of(kind, 0.02));
      const test::Picture picture = test::render(*viewer, {24, 24, 128, 7, render::View::shaded});
      double square = 0.0;
      for (const glm::vec4& p : picture.pixels) square += (p.x - 1.0) * (p.x - 1.0);
      const double mean = picture.mean().x;
      const double error = std::sqrt(square / 576.0 / 576.0);
      EXPECT_NEAR(mean, 1.0, 4.0 * error + 1e-5) << "g " << g;
      EXPECT_LT(error, 0.004);
      EXPECT_GT(picture.mean().w, 0.2);
    }
  }
}

// S (1 - e^-tau) of a slab that emits and does not scatter, in front of a sky.
TEST_P(Trace, EmissiveSlabMatchesForEveryGridType) {
  const auto viewer = make();
  viewer->set_volume(box_volume({64, 64, 8}));
  viewer->set_light({0.0F, 0.0F, vec3(0.0F), vec3(0.0F, 0.5F, 3.0F)});
  viewer->set_camera(test::camera_at({31.5, 31.5, 500.0}, {31.5, 31.5, 0.0}, 0.5));
  for (const test::MarchKind& kind : test::march_kinds) {
    viewer->set_grid(test::settings_of(kind));
    for (const double sigma : {0.02, 0.1, 2.0}) {
      viewer->set_medium({sigma, vec3(0.0F), {0.0F}, 0, {4.0F, 2.0F, 0.0F}});
      const test::Picture picture = test::render(*viewer, {16, 16, 64, 1, render::View::shaded});
      const double through = std::exp(-sigma * 8.0);
      const double error = 4.0 * std::sqrt((through + 1.0 / 3.0) * (1.0 - through) / (256.0 * 64.0));
      EXPECT_NEAR(picture.mean().x, 4.0 * (1.0 - through), 4.0 * error);
      EXPECT_NEAR(picture.mean().y, 2.0 * (1.0 - through) + 0.5 * through, 2.0 * error);
      EXPECT_NEAR(picture.mean().z, 3.0 * through, 3.0 * error);
    }
  }
}

// A medium in thermal balance with its environment is invisible, whatever it absorbs and scatters.
TEST_P(Trace, MediumInThermalBalanceIsInvisible) {
  const auto viewer = make();
  viewer->set_volume(test::noise_volume({24, 20, 22}, ivec3(-3, 2, 5), 3));
  viewer->set_light({0.0F, 0.0F, vec3(0.0F), vec3(2.0F, 1.0F, 0.5F)});
  const vec3 albedo(0.2F, 0.7F, 0.99F);
  viewer->set_medium({1.0, albedo, {0.5F}, 0, (1.0F - albedo) * vec3(2.0F, 1.0F, 0.5F)});
  for (const test::MarchKind& kind : {test::march_kinds[0], test::march_kinds[3]}) {
    viewer->set_grid(test::settings_of(kind, 0.02));
    const test::Picture picture = test::render(*viewer, {24, 24, 128, 7, render::View::shaded});
    for (int c = 0; c < 3; ++c) {
      const double expected = 2.0 / double(1 << c);
      double square = 0.0;
      for (const glm::vec4& p : picture.pixels) square += (p[c] - expected) * (p[c] - expected);
      const double error = std::sqrt(square / 576.0 / 576.0);
      EXPECT_NEAR(picture.mean()[c], expected, 4.0 * error + 1e-5) << c;
      EXPECT_LT(error, 0.005 * expected) << c;
    }
    EXPECT_GT(picture.mean().w, 0.2);
  }
}

TEST_P(Trace, MultipleScatteringAgreesWithAnIndependentPathTracer) {
  const auto volume = test::noise_volume({20, 18, 22}, ivec3(0), 5);
  const dvec3 eye(60.0, 30.0, 70.0);
  const dvec3 target(9.5, 8.5, 10.5);
  const double fovy = 14.0;
  const test::TrackedMedium medium;
  const auto viewer = make();
  viewer->set_volume(volume);
  viewer->set_medium(
      {medium.scale, vec3(medium.albedo), {static_cast<float>(medium.anisotropy)}, 0, vec3(medium.emission)});
  viewer->set_light({40.0F, 25.0F, vec3(medium.irradiance), vec3(medium.sky)});
  viewer->set_camera(test::camera_at(eye, target, fovy));
  for (const auto interpolation : {grid::Interpolation::nearest, grid::Interpolation::linear}) {
    test::DeltaTracker reference(volume, interpolation, medium);
    const test::TrackedMean expected =
        reference.view(eye, target, fovy, interpolation == grid::Interpolation::linear ? 100000 : 400000);
    for (const test::MarchKind& kind : test::march_kinds) {
      const bool interpolates = interpolation == grid::Interpolation::linear;
      const bool is_constant = kind.march == March::tet && kind.cells == grid::CellKind::constant;
      if (interpolates && is_constant) continue;  // sixths of cells of constant density are another field
      viewer::GridSettings settings = test::settings_of(kind);
      settings.build.interpolation = interpolation;
      viewer->set_grid(settings);
      const test::Picture a = test::render(*viewer, {32, 32, 96, 3, render::View::shaded});
      const test::Picture b = test::render(*viewer, {32, 32, 96, 4, render::View::shaded});
      for (int c = 0; c < 3; ++c) {
        // The difference of the two renders gives the noise of their mean.
        double difference = 0.0;
        for (std::size_t i = 0; i < a.pixels.size(); ++i) difference += std::pow(a.pixels[i][c] - b.pixels[i][c], 2.0);
        const double error = 0.5 * std::sqrt(difference) / double(a.pixels.size());
        const double got = 0.5 * (a.mean()[c] + b.mean()[c]);
        EXPECT_NEAR(got, expected.radiance[c], 4.0 * std::hypot(error, expected.error[c])) << "channel " << c;
        EXPECT_LT(error, 0.01 * expected.radiance[c]);
      }
    }
  }
}

TEST_P(Trace, SingleScatteringMatchesQuadrature) {
  // A homogeneous box, the sun straight above, a horizontal camera ray through the center: every scattering point has
  // the same distance to the surface. L = albedo phase E e^{-s h} (1 - e^{-s L}).
  const auto viewer = make();
  viewer->set_volume(box_volume({400, 16, 16}));
  const double sigma = 0.15;
  const auto lobe = [](double g) { return (1.0 - g * g) / (4.0 * std::numbers::pi * std::pow(1.0 + g * g, 1.5)); };
  const scene::Phase droplets = scene::mie_phase(8.0F);
  for (const scene::Phase& medium :
       {scene::Phase{0.0F}, scene::Phase{0.6F}, scene::Phase{0.8F, -0.3F, 0.0F, 0.4F}, droplets}) {
    viewer->set_medium({sigma, vec3(0.9F, 0.5F, 0.2F), medium, 1});
    viewer->set_light({0.0F, 90.0F, {5.0F, 5.0F, 5.0F}, {0.0F, 0.0F, 0.0F}});
    viewer->set_camera(test::camera_at({199.5, 7.5, 900.0}, {199.5, 7.5, 0.0}, 0.01));
    const double g = medium.second_anisotropy;
    const double second = lobe(g) / (1.0 + medium.second_bend * (1.0 + 2.0 * g * g) / 3.0);
    const double phase = (1.0 - medium.second_weight) * lobe(medium.anisotropy) + medium.second_weight * second;
    const double expected = phase * 5.0 * std::exp(-sigma * 8.0) * (1.0 - std::exp(-sigma * 16.0));
    for (const test::MarchKind& kind : {test::march_kinds[0], test::march_kinds[2]}) {
      viewer->set_grid(test::settings_of(kind, 0.02));
      const test::Picture picture = test::render(*viewer, {16, 16, 64, 1, render::View::shaded});
      EXPECT_NEAR(picture.mean().x, 0.9 * expected, 0.02 * expected);
      EXPECT_NEAR(picture.mean().y, 0.5 * expected, 0.02 * expected);
      EXPECT_NEAR(picture.mean().z, 0.2 * expected, 0.02 * expected);
    }
  }
}

TEST_P(Trace, GridTypesAgreeOnConstantCellsAtVoxelResolution) {
  const auto viewer = make();
  viewer->set_volume(test::noise_volume({40, 36, 30}, ivec3(7, -3, 0), 2));
  viewer->set_medium({0.4, vec3(0.98F), {0.5F}, 0});
  viewer->set_light({30.0F, 30.0F, vec3(3.0F), vec3(0.3F)});
  std::array<test::Picture, 4> pictures;
  for (std::size_t i = 0; i < test::march_kinds.size(); ++i) {
    viewer->set_grid(test::settings_of(test::march_kinds[i], i == 0 ? 0.01 : -1.0));
    pictures[i] = test::render(*viewer, {32, 32, 16, 1, render::View::shaded});
  }
  // The same seed gives the same path, except for rounding.
  for (const std::size_t other : {1U, 3U}) {
    std::size_t same = 0;
    for (std::size_t i = 0; i < 1024; ++i) {
      same += glm::distance(pictures[2].pixels[i], pictures[other].pixels[i]) < 1e-3F ? 1 : 0;
    }
    EXPECT_GT(same, 900U);
    EXPECT_NEAR(pictures[2].mean().x, pictures[other].mean().x, 2e-3 * pictures[2].mean().x);
  }
  EXPECT_NEAR(pictures[2].mean().x, pictures[0].mean().x, 0.02 * pictures[2].mean().x);
}

TEST_P(Trace, ImageDoesNotDependOnThePageSize) {
  const auto viewer = make();
  viewer->set_medium({0.4, vec3(1.0F), {0.0F}, 0});
  viewer->set_light({30.0F, 30.0F, vec3(3.0F), vec3(0.3F)});
  viewer->set_grid(test::settings_of(test::march_kinds[0], 0.01));
  // A volume keeps its grids, so that each upload needs another volume.
  const auto show = [&] { viewer->set_volume(test::noise_volume({40, 36, 30}, ivec3(0), 2)); };
  show();
  const test::Image image{24, 24, 8, 1, render::View::shaded};
  const test::Picture whole = test::render(*viewer, image);
  const auto cells = static_cast<std::int64_t>(viewer->viewer().stats().cells);
  for (const std::int64_t parts : {2, 3}) {
    viewer->viewer().set_page_texels(2 * (cells / parts + 1));
    show();
    const test::Picture paged = test::render(*viewer, image);
    EXPECT_EQ(whole.pixels, paged.pixels);
  }
  viewer->viewer().set_page_texels(64);
  show();
  try {
    viewer->build();
    FAIL() << "6 pages of 32 cells cannot hold " << cells;
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::unsupported);
    EXPECT_NE(std::string(error.what()).find("GL_MAX_TEXTURE_BUFFER_SIZE"), std::string::npos) << error.what();
  }
  // The error is returned once; the old cells stay in use.
  while (!viewer->render(10.0)) {
  }
  viewer->viewer().set_page_texels(0);
  show();
  EXPECT_EQ(whole.pixels, test::render(*viewer, image).pixels);
}

TEST_P(Trace, ImageDependsOnlyOnSeedAndSamples) {
  const auto viewer = make();
  viewer->set_volume(test::noise_volume({30, 30, 30}, ivec3(0), 2));
  viewer->set_medium({0.4, vec3(1.0F), {0.3F}, 0});
  viewer->set_light({30.0F, 30.0F, vec3(3.0F), vec3(0.3F)});
  // Wider than a tile, so that several tiles are used.
  const test::Image image{600, 10, 5, 9, render::View::shaded};
  const test::Picture one = test::render(*viewer, image);
  EXPECT_EQ(one.pixels, test::render(*viewer, image, 0.5).pixels);
  const auto other = make();
  other->set_volume(test::noise_volume({30, 30, 30}, ivec3(0), 2));
  other->set_medium({0.4, vec3(1.0F), {0.3F}, 0});
  other->set_light({30.0F, 30.0F, vec3(3.0F), vec3(0.3F)});
  EXPECT_EQ(one.pixels, test::render(*other, image).pixels);
  test::Image reseeded = image;
  reseeded.seed = 10;
  EXPECT_NE(one.pixels, test::render(*viewer, reseeded).pixels);
}

TEST_P(Trace, CameraMayBeInsideOrOnFacesEdgesAndVertices) {
  const auto viewer = make();
  viewer->set_volume(test::noise_volume({32, 32, 32}, ivec3(0), 1));
  viewer->set_medium({0.2, vec3(0.9F), {0.0F}, 0});
  viewer->set_light({30.0F, 30.0F, vec3(2.0F), vec3(0.5F)});
  // Cube space is index space plus a half: halves are faces, edges and vertices of cells.
  const std::array<dvec3, 6> eyes{{{15.5, 15.5, 15.5},
                                   {16.0, 16.0, 16.0},
                                   {7.5, 15.5, 11.0},
                                   {15.5, 3.5, 20.3},
                                   {-0.5, -0.5, -0.5},
                                   {15.5, 15.5, 31.5}}};
  for (const dvec3& eye : eyes) {
    for (const dvec3& direction : {dvec3(0, 0, -1), dvec3(1, 1, 1), dvec3(0.3, -0.2, 0.9)}) {
      viewer->set_camera(test::camera_at(eye, eye + direction, 60.0));
      const test::Image image{16, 16, 32, 2, render::View::shaded};
      viewer->set_grid(test::settings_of(test::march_kinds[1]));
      const test::Picture tet = test::render(*viewer, image);
      viewer->set_grid(test::settings_of(test::march_kinds[2]));
      const test::Picture dense = test::render(*viewer, image);
      EXPECT_TRUE(std::isfinite(tet.mean().x));
      EXPECT_NEAR(tet.mean().x, dense.mean().x, 0.02 * dense.mean().x);
    }
  }
}

TEST_P(Trace, AnyAffineTransformKeepsWorldDistances) {
  // A sheared, rotated, stretched and translated slab. The camera looks along the world image of its short axis.
  // Through the center, the path length is the distance between its two faces.
  auto volume = box_volume({64, 64, 8});
  glm::dmat4 m = glm::translate(glm::dmat4(1.0), dvec3(1000.0, -40.0, 7.0));
  m = glm::rotate(m, 0.7, glm::normalize(dvec3(1.0, 2.0, 0.5)));
  m = m * glm::dmat4({0.5, 0, 0, 0}, {0.1, 0.4, 0, 0}, {0.2, -0.1, 2.0, 0}, {0, 0, 0, 1});
  volume.index_to_world = m;
  const dvec3 axis = dvec3(m[2]);
  const dvec3 centre(m * glm::dvec4(31.5, 31.5, 3.5, 1.0));
  const double sigma = 0.08;
  const double through = std::exp(-sigma * 8.0 * glm::length(axis));
  const auto viewer = make();
  viewer->set_volume(volume);
  viewer->set_medium({sigma, vec3(0.0F), {0.0F}, 0});
  viewer->set_light({0.0F, 0.0F, vec3(0.0F), vec3(1.0F)});
  viewer->set_camera(test::camera_at(centre + 20.0 * axis, centre, 0.2));
  for (const test::MarchKind& kind : test::march_kinds) {
    viewer->set_grid(test::settings_of(kind));
    const test::Picture picture = test::render(*viewer, {16, 16, 64, 1, render::View::shaded});
    EXPECT_NEAR(picture.mean().x, through, 4.0 * std::sqrt(through * (1.0 - through) / (256.0 * 64.0)));
  }
}

TEST_P(Trace, RotatingVolumeAndCameraGivesTheSameImage) {
  const auto volume = test::noise_volume({30, 26, 34}, ivec3(0), 6);
  auto turned = volume;
  const glm::dmat4 rotation =
      glm::rotate(glm::translate(glm::dmat4(1.0), dvec3(5, 6, 7)), 1.1, glm::normalize(dvec3(1, 1, 0)));
  turned.index_to_world = rotation;
  const auto viewer = make();
  viewer->set_medium({0.5, vec3(0.9F), {0.5F}, 0});
  viewer->set_light({0.0F, 0.0F, vec3(0.0F), vec3(1.0F)});
  const test::Image image{32, 32, 8, 1, render::View::shaded};
  viewer->set_grid(test::settings_of(test::march_kinds[0], 0.02));
  viewer->set_volume(volume);
  viewer->set_camera(test::camera_at({60, 40, 80}, {15, 13, 17}));
  const test::Picture straight = test::render(*viewer, image);
  viewer->set_volume(turned);
  viewer::CameraPose camera =
      test::camera_at(dvec3(rotation * glm::dvec4(60, 40, 80, 1)), dvec3(rotation * glm::dvec4(15, 13, 17, 1)));
  camera.up = dvec3(rotation * glm::dvec4(0, 1, 0, 0));
  viewer->set_camera(camera);
  const test::Picture rotated = test::render(*viewer, image);
  // Scattered directions are sampled around other axes, so pixels agree only in the mean.
  EXPECT_NEAR(straight.mean().x, rotated.mean().x, 0.01 * straight.mean().x);
  EXPECT_NEAR(straight.mean().w, rotated.mean().w, 0.002);
}

TEST_P(Trace, VolumesOfAFewVoxelsRender) {
  const auto viewer = make();
  viewer->set_medium({1.0, vec3(0.0F), {0.0F}, 0});
  for (const int size : {1, 3, 8, 9}) {
    viewer->set_volume(box_volume(ivec3(size)));
    viewer->set_camera(
        test::camera_at(dvec3(0.5 * size - 0.5) + dvec3(0, 0, 100.0 + size), dvec3(0.5 * size - 0.5), 0.1));
    for (const test::MarchKind& kind : test::march_kinds) {
      viewer->set_grid(test::settings_of(kind, 0.02));
      const test::Picture picture = test::render(*viewer, {4, 4, 1, 1, render::View::density});
      for (const glm::vec4& p : picture.pixels) EXPECT_NEAR(p.w, 1.0 - std::exp(-size), 1e-3);
    }
  }
}

TEST_P(Trace, DensityViewShowsOpacity) {
  const auto viewer = make();
  viewer->set_volume(box_volume({64, 64, 8}));
  viewer->set_medium({0.1, vec3(1.0F), {0.0F}, 0});
  viewer->set_camera(test::camera_at({31.5, 31.5, 500.0}, {31.5, 31.5, 0.0}, 0.5));
  for (const test::MarchKind& kind : test::march_kinds) {
    viewer->set_grid(test::settings_of(kind, 0.02));
    const test::Picture picture = test::render(*viewer, {8, 8, 1, 1, render::View::density});
    for (const glm::vec4& p : picture.pixels) EXPECT_NEAR(p.w, 1.0 - std::exp(-0.8), 1e-4);
    for (const auto view : {render::View::cells, render::View::steps}) {
      const test::Picture other = test::render(*viewer, {8, 8, 1, 1, view});
      for (const glm::vec4& p : other.pixels) EXPECT_TRUE(std::isfinite(p.x + p.y + p.z));
      EXPECT_GT(other.mean().x + other.mean().y + other.mean().z, 0.05);
    }
  }
}

TEST_P(Trace, GridAdaptsToTheCamera) {
  const auto viewer = make();
  viewer->set_volume(test::noise_volume({96, 96, 96}, ivec3(0), 1));
  viewer->set_image({64, 64, 1, 0, render::View::shaded});
  viewer->set_camera(test::camera_at({48, 48, 6000}, {48, 48, 48}, 5.0));
  viewer::GridSettings settings = test::settings_of(test::march_kinds[0], 0.005);
  viewer->set_grid(settings);
  viewer->build();
  const std::uint64_t everywhere = viewer->viewer().stats().cells;
  settings.camera_adaptive = true;
  viewer->set_grid(settings);
  viewer->build();
  EXPECT_LT(viewer->viewer().stats().cells, everywhere / 2);  // a pixel is 8 voxels wide
}

TEST_P(Trace, InvalidSettingsAreRejectedAndKeepTheOldOnes) {
  const auto viewer = make();
  EXPECT_FALSE(viewer->render(1.0));
  EXPECT_THROW(viewer->read(), Error);
  EXPECT_THROW(viewer->viewer().bounds(), Error);
  viewer->set_volume(test::noise_volume({16, 16, 16}, ivec3(0), 1));
  const test::Image image{8, 8, 2, 1, render::View::shaded};
  viewer->set_light({0.0F, 0.0F, vec3(0.0F), vec3(1.0F)});
  const test::Picture before = test::render(*viewer, image);
  viewer->viewer().load_volume({"no such file.vdb", ""});
  EXPECT_THROW(viewer->build(), Error);
  auto flat = test::noise_volume({16, 16, 16}, ivec3(0), 1);
  flat.index_to_world[2] = flat.index_to_world[1];
  EXPECT_THROW(viewer->set_volume(flat), Error);
  while (!viewer->render(10.0)) {
  }
  std::vector<float> after = viewer->read();
  EXPECT_EQ(std::memcmp(after.data(), before.pixels.data(), after.size() * sizeof(float)), 0);
  // An empty medium shows only the sky: without rounding errors after many samples, and without noise.
  auto empty = test::noise_volume({16, 16, 16}, ivec3(0), 1);
  empty.brick_origins.clear();
  empty.brick_values = {};
  empty.max_value = 0.0F;
  viewer->set_volume(empty);
  for (const test::MarchKind& kind : test::march_kinds) {
    viewer->set_grid(test::settings_of(kind, 0.05));
    EXPECT_EQ(test::render(*viewer, image).mean().x, 1.0);
  }
  viewer->set_light({0.0F, 0.0F, vec3(0.0F), vec3(0.3F, 0.7F, 1e-3F)});
  const test::Picture sky = test::render(*viewer, {8, 8, 3000, 1, render::View::shaded});
  for (const glm::vec4& pixel : sky.pixels) EXPECT_EQ(pixel, glm::vec4(0.3F, 0.7F, 1e-3F, 0.0F));
  EXPECT_LT(viewer->viewer().measure_noise().value(), 1e-4);
}

}  // namespace
