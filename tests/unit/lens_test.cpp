// Depth of field, compared with closed forms of a thin lens.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "support/c_host.hpp"
#include "support/fake_gl.hpp"

namespace {

using cumulet::headless::Backend;
using cumulet::headless::Context;
using cumulet::test::CameraRef;
using cumulet::test::converge;
using cumulet::test::FakeGl;
using cumulet::test::HostTarget;
using cumulet::test::make_desc;
using cumulet::test::make_viewer;
using cumulet::test::SurfacesRef;
using cumulet::test::ViewerPtr;
using cumulet::test::VolumeRef;

constexpr int side = 64;

/// An emissive square centered on the axis at z, with this half edge.
SurfacesRef make_glowing(float z, float half) {
  const std::array<float, 18> positions{-half, -half, z, half, -half, z, half,  half, z,
                                        -half, -half, z, half, half,  z, -half, half, z};
  auto mesh = make_desc<cumulet_mesh_desc>();
  mesh.positions = positions.data();
  mesh.vertex_count = 6;
  mesh.double_sided = 1;
  for (float& value : mesh.emission) value = 1.0F;
  const std::array<float, 4> black{1e-6F, 1e-6F, 1e-6F, 1.0F};
  std::ranges::copy(black, mesh.base_color);
  return cumulet::test::make_surfaces({&mesh, 1});
}

/// A single dense voxel with this edge length on the axis at z.
VolumeRef make_speck(double z, double edge) {
  const std::array<float, 1> value{1.0F};
  auto desc = make_desc<cumulet_dense_desc>();
  desc.values = value.data();
  desc.value_count = 1;
  for (int& extent : desc.size) extent = 1;
  for (int i = 0; i < 3; ++i) desc.index_to_world[i * 5] = edge;
  desc.index_to_world[15] = 1.0;
  desc.index_to_world[14] = z;
  return cumulet::test::make_dense(desc);
}

class Lens : public testing::Test {
 protected:
  Lens() {
    viewer_ = make_viewer({.get_proc = FakeGl::get_proc, .user = &fake_});
    auto light = make_desc<cumulet_sun_sky_desc>();
    light.sky = CUMULET_SKY_CONSTANT;
    EXPECT_EQ(cumulet_set_sun_sky(viewer_.get(), &light), CUMULET_OK);
    auto sampling = make_desc<cumulet_sampling_desc>();
    sampling.samples = 256;
    sampling.preview = CUMULET_PREVIEW_OFF;
    EXPECT_EQ(cumulet_set_sampling(viewer_.get(), &sampling), CUMULET_OK);
    cumulet_camera* camera = nullptr;
    EXPECT_EQ(cumulet_get_camera(viewer_.get(), &camera), CUMULET_OK);
    camera_.reset(camera);
    desc_.eye[2] = 10.0;  // looks along -z, in focus at the origin
    desc_.fovy_degrees = 2.0 * std::atan(0.4) * 180.0 / std::numbers::pi;
  }
  std::vector<float> picture() {
    EXPECT_EQ(cumulet_camera_set(camera_.get(), &desc_), CUMULET_OK);
    auto frame = target_.frame();
    frame.target = CUMULET_TARGET_NONE;
    converge(viewer_.get(), frame);
    std::vector<float> rgba(std::size_t{side} * side * 4);
    EXPECT_EQ(cumulet_read_linear(viewer_.get(), rgba.data(), rgba.size()), CUMULET_OK);
    return rgba;
  }
  struct Spot {
    double sum = 0.0;
    double radius = 0.0;  // of a uniform disc with this second moment, in the focal plane
    double highest = 0.0;
  };
  /// channel: 0 red, 3 alpha.
  [[nodiscard]] Spot spot(const std::vector<float>& rgba, std::size_t channel, double z_sharp) const {
    Spot spot;
    double moment = 0.0;
    for (int y = 0; y < side; ++y) {
      for (int x = 0; x < side; ++x) {
        const double value = rgba[(static_cast<std::size_t>(y) * side + static_cast<std::size_t>(x)) * 4 + channel];
        const double width = desc_.orthographic_height > 0.0 ? desc_.orthographic_height : 0.8 * z_sharp;
        const double u = (x + 0.5 - side / 2.0) / side * width;
        const double v = (y + 0.5 - side / 2.0) / side * width;
        spot.sum += value;
        moment += value * (u * u + v * v);
        spot.highest = std::max(spot.highest, value);
      }
    }
    spot.radius = std::sqrt(2.0 * moment / spot.sum);
    return spot;
  }

  Context context_ = Context::create(Backend::automatic);
  FakeGl fake_{Context::get_proc, &context_};
  HostTarget target_{fake_.real(), side, side};
  ViewerPtr viewer_;
  CameraRef camera_;
  cumulet_camera_desc desc_ = make_desc<cumulet_camera_desc>();
};

// A point at z becomes a disc of radius R |z - f| / z in the focal plane, with the same total brightness.
TEST_F(Lens, BlursSurfacesLikeAThinLens) {
  for (const float z : {-8.0F, 4.0F}) {
    SCOPED_TRACE(z);
    const SurfacesRef glowing = make_glowing(z, 0.15F);
    ASSERT_EQ(cumulet_set_surfaces(viewer_.get(), glowing.get()), CUMULET_OK);
    desc_.lens_radius = 0.0;
    const Spot sharp = spot(picture(), 0, 10.0);
    desc_.lens_radius = 1.2;
    const std::vector<float> blurred_picture = picture();
    const Spot blurred = spot(blurred_picture, 0, 10.0);
    const double distance = 10.0 - z;
    const double expected = 1.2 * std::abs(distance - 10.0) / distance;
    EXPECT_NEAR(std::sqrt(blurred.radius * blurred.radius - sharp.radius * sharp.radius), expected, 0.02 * expected);
    EXPECT_NEAR(blurred.sum, sharp.sum, 0.03 * sharp.sum);
    EXPECT_LT(blurred.highest, 0.5 * sharp.highest);
  }
}

TEST_F(Lens, ObjectsInFocusAreSharp) {
  const SurfacesRef glowing = make_glowing(-3.0F, 0.8F);
  ASSERT_EQ(cumulet_set_surfaces(viewer_.get(), glowing.get()), CUMULET_OK);
  const Spot sharp = spot(picture(), 0, 13.0);
  desc_.lens_radius = 1.2;
  EXPECT_GT(spot(picture(), 0, 13.0).radius, 1.02 * sharp.radius) << "the target is in focus";
  desc_.focus_distance = 13.0;
  const Spot focused = spot(picture(), 0, 13.0);
  EXPECT_NEAR(focused.radius, sharp.radius, 0.003 * sharp.radius);
  EXPECT_NEAR(focused.sum, sharp.sum, 0.003 * sharp.sum);
  // The same offset in diopters, farther and nearer, gives the same blur.
  desc_.focus_distance = 1.0 / (1.0 / 13.0 + 0.01);
  const double nearer = spot(picture(), 0, 13.0).radius;
  desc_.focus_distance = 1.0 / (1.0 / 13.0 - 0.01);
  EXPECT_NEAR(spot(picture(), 0, 13.0).radius, nearer, 0.01 * nearer);
}

TEST_F(Lens, BlursVolumesForEveryGridType) {
  const VolumeRef speck = make_speck(-5.0, 0.3);
  auto medium = make_desc<cumulet_medium_desc>();
  medium.density_scale = 1000.0;  // opaque
  ASSERT_EQ(cumulet_set_medium(viewer_.get(), &medium), CUMULET_OK);
  ASSERT_EQ(cumulet_set_volume(viewer_.get(), speck.get()), CUMULET_OK);
  for (const cumulet_grid_type march : {CUMULET_GRID_TETRAHEDRAL, CUMULET_GRID_DENSE, CUMULET_GRID_BRICKS}) {
    SCOPED_TRACE(march);
    auto grid = make_desc<cumulet_grid_desc>();
    grid.type = march;
    grid.interpolation = CUMULET_INTERPOLATION_NEAREST;
    ASSERT_EQ(cumulet_set_grid(viewer_.get(), &grid), CUMULET_OK);
    desc_.lens_radius = 0.0;
    const Spot sharp = spot(picture(), 3, 10.0);
    desc_.lens_radius = 1.5;
    const Spot blurred = spot(picture(), 3, 10.0);
    EXPECT_NEAR(std::sqrt(blurred.radius * blurred.radius - sharp.radius * sharp.radius), 0.5, 0.02);
    EXPECT_NEAR(blurred.sum, sharp.sum, 0.05 * sharp.sum);
    // AOVs use the same lens as images.
    std::vector<float> clear(std::size_t{side} * side);
    ASSERT_EQ(cumulet_read_aov(viewer_.get(), CUMULET_AOV_TRANSMITTANCE, clear.data(), clear.size()), CUMULET_OK);
    std::vector<float> opacity(clear.size() * 4);
    for (std::size_t i = 0; i < clear.size(); ++i) opacity[4 * i + 3] = 1.0F - clear[i];
    const Spot known = spot(opacity, 3, 10.0);
    EXPECT_NEAR(known.radius, blurred.radius, 0.05 * blurred.radius);
    EXPECT_NEAR(known.sum, blurred.sum, 0.1 * blurred.sum);
  }
}

TEST_F(Lens, OrthographicBlurIsProportionalToFocusDistance) {
  const SurfacesRef glowing = make_glowing(-4.0F, 0.15F);
  ASSERT_EQ(cumulet_set_surfaces(viewer_.get(), glowing.get()), CUMULET_OK);
  desc_.orthographic_height = 8.0;
  const Spot sharp = spot(picture(), 0, 10.0);
  desc_.lens_radius = 2.0;
  const Spot blurred = spot(picture(), 0, 10.0);
  EXPECT_NEAR(std::sqrt(blurred.radius * blurred.radius - sharp.radius * sharp.radius), 2.0 * 4.0 / 10.0, 0.02);
  desc_.near_plane = 3.0;  // moves the ray origins; the focal plane stays
  const Spot later = spot(picture(), 0, 10.0);
  EXPECT_NEAR(std::sqrt(later.radius * later.radius - sharp.radius * sharp.radius), 2.0 * 4.0 / 7.0, 0.02);
}

TEST_F(Lens, SurvivesHostMatrices) {
  const SurfacesRef glowing = make_glowing(-8.0F, 0.15F);
  ASSERT_EQ(cumulet_set_surfaces(viewer_.get(), glowing.get()), CUMULET_OK);
  desc_.lens_radius = 1.2;
  desc_.focus_distance = 10.0;
  const Spot own = spot(picture(), 0, 10.0);
  std::array<double, 16> view{};
  std::array<double, 16> projection{};
  constexpr cumulet_clip_space clip = CUMULET_CLIP_NEGATIVE_ONE_TO_ONE;
  ASSERT_EQ(cumulet_camera_get_matrices(camera_.get(), 1.0, clip, view.data(), projection.data()), CUMULET_OK);
  ASSERT_EQ(cumulet_camera_set_matrices(camera_.get(), view.data(), projection.data(), clip), CUMULET_OK);
  auto read = make_desc<cumulet_camera_desc>();
  ASSERT_EQ(cumulet_camera_get(camera_.get(), &read), CUMULET_OK);
  EXPECT_EQ(read.lens_radius, 1.2);
  EXPECT_EQ(read.focus_distance, 10.0);
  auto frame = target_.frame();
  frame.target = CUMULET_TARGET_NONE;
  converge(viewer_.get(), frame);
  std::vector<float> rgba(std::size_t{side} * side * 4);
  ASSERT_EQ(cumulet_read_linear(viewer_.get(), rgba.data(), rgba.size()), CUMULET_OK);
  EXPECT_NEAR(spot(rgba, 0, 10.0).radius, own.radius, 0.01 * own.radius);
}

TEST_F(Lens, InvalidInputGivesAOneLineError) {
  for (const double wrong : {-1.0, 1e31, std::nan("")}) {
    for (double cumulet_camera_desc::*field :
         {&cumulet_camera_desc::lens_radius, &cumulet_camera_desc::focus_distance}) {
      cumulet_camera_desc desc = desc_;
      desc.*field = wrong;
      EXPECT_EQ(cumulet_camera_set(camera_.get(), &desc), CUMULET_ERROR_INVALID_ARGUMENT);
    }
  }
}

}  // namespace
