// Volumes clipped by a box and by planes, compared with closed forms and with volumes that end there.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "settings/clip.hpp"
#include "support/c_viewer.hpp"

namespace {

using namespace cumulet::test;
using cumulet::headless::Backend;
using cumulet::headless::Context;
using cumulet::settings::Clip;
using cumulet::settings::clip_desc_of;

constexpr std::uint32_t side = 8;
constexpr std::size_t count = std::size_t{side} * side;
constexpr double far = 1e6;
constexpr int width = 24;  // of volumes across the view, centered on the origin

using Size = std::array<int, 3>;
using Value = std::function<float(int x, int y, int z)>;

// Voxels around the origin in x and y; on the z axis from voxel 0.
cumulet_dense_desc dense_desc(const Size& size, std::vector<float>& values, const Value& value) {
  for (int z = 0; z < size[2]; ++z) {
    for (int y = 0; y < size[1]; ++y) {
      for (int x = 0; x < size[0]; ++x) values.push_back(value(x, y, z));
    }
  }
  auto desc = make_desc<cumulet_dense_desc>();
  desc.values = values.data();
  desc.value_count = values.size();
  for (std::size_t axis = 0; axis < 3; ++axis) desc.size[axis] = size.at(axis);
  for (int i = 0; i < 4; ++i) desc.index_to_world[5 * i] = 1.0;
  for (std::size_t axis = 0; axis < 2; ++axis) desc.index_to_world[12 + axis] = 0.5 * (1 - size.at(axis));
  return desc;
}

// A slab of density 1 from z = -0.5 to 5.5.
VolumeRef make_slab() {
  std::vector<float> values;
  return make_dense(dense_desc({width, width, 6}, values, [](int, int, int) { return 1.0F; }));
}

// A volume with a different value in each voxel below layer `end`; glows: with a flame.
VolumeRef make_lumps(int end, bool glows) {
  const auto lump = [end](double phase) {
    return [=](int x, int y, int z) {
      return z < end ? static_cast<float>(1.0 + 0.9 * std::sin(1.7 * x + phase) * std::cos(1.1 * y + 0.6 * z)) : 0.0F;
    };
  };
  const Size size{12, 12, 8};
  std::array<std::vector<float>, 2> values;
  std::array<cumulet_dense_desc, 2> descs{dense_desc(size, values[0], lump(0.0)),
                                          dense_desc(size, values[1], lump(2.0))};
  std::array<cumulet_field, 2> fields{};
  for (std::size_t i = 0; i < 2; ++i) {
    fields.at(i) = make_desc<cumulet_field>();
    fields.at(i).channel = i == 0 ? CUMULET_CHANNEL_DENSITY : CUMULET_CHANNEL_FLAME;
    fields.at(i).dense = &descs.at(i);
  }
  auto desc = make_desc<cumulet_volume_fields_desc>();
  desc.fields = fields.data();
  desc.field_count = glows ? 2 : 1;
  return made_by<VolumeRef>(cumulet_volume_from_fields, desc);
}

SurfacesRef make_wall(float z, float emission, float color = 0.8F) {
  const float w = 40.0F;
  auto mesh = make_desc<cumulet_mesh_desc>();
  for (float& value : mesh.emission) value = emission;
  for (float& value : mesh.base_color) value = color;
  mesh.base_color[3] = 1.0F;
  return make_quad({-w, -w, z, w, -w, z, w, w, z, -w, w, z}, mesh);
}

Clip layers(double low, double high) { return {{{-far, -far, low, far, far, high}}, {}}; }

class ClipPlanes : public CViewerTest {
 protected:
  ClipPlanes() : CViewerTest(side, side, 1) {}
  void SetUp() override {
    CViewerTest::SetUp();
    if (IsSkipped()) return;
    look_down(20.0);
    set_light(0.0F, 0.0F);
  }
  void look_down(double eye_z) {
    auto stand = make_desc<cumulet_camera_desc>();
    stand.eye[2] = eye_z;
    stand.target[2] = eye_z - 10.0;
    stand.orthographic_height = side;
    look(v_, stand);
  }
  void set_light(float sun, float sky) {
    auto light = make_desc<cumulet_sun_sky_desc>();
    light.sun_elevation_degrees = 90.0F;
    for (float& value : light.sun_irradiance) value = sun;
    for (float& value : light.sky_radiance) value = sky;
    ASSERT_EQ(cumulet_set_sun_sky(v_, &light), CUMULET_OK);
  }
  void set_medium(double scale, float coalbedo, float emission = 0.0F) {
    auto medium = make_desc<cumulet_medium_desc>();
    medium.density_scale = scale;
    for (float& value : medium.coalbedo) value = coalbedo;
    for (float& value : medium.emission) value = emission;
    ASSERT_EQ(cumulet_set_medium(v_, &medium), CUMULET_OK);
  }
  void set_samples(std::uint32_t samples, float shutter_seconds = 0.0F) {
    auto sampling = make_desc<cumulet_sampling_desc>();
    sampling.samples = samples;
    sampling.preview = CUMULET_PREVIEW_OFF;
    sampling.shutter_seconds = shutter_seconds;
    ASSERT_EQ(cumulet_set_sampling(v_, &sampling), CUMULET_OK);
  }
  void clip(const Clip& clip) {
    const cumulet_clip_desc desc = clip_desc_of(clip);
    ASSERT_EQ(cumulet_set_clip(v_, &desc), CUMULET_OK) << cumulet_last_error(v_);
  }
  void show(cumulet_volume* volume) { ASSERT_EQ(cumulet_set_volume(v_, volume), CUMULET_OK); }
  void set_grid(cumulet_grid_type type, cumulet_interpolation interpolation = CUMULET_INTERPOLATION_NEAREST,
                cumulet_cell_density cells = CUMULET_CELLS_LINEAR) {
    auto grid = make_desc<cumulet_grid_desc>();
    grid.type = type;
    grid.cells = cells;
    grid.threshold = -1.0;
    grid.interpolation = interpolation;
    ASSERT_EQ(cumulet_set_grid(v_, &grid), CUMULET_OK);
  }
  void for_each_type(const std::function<void(cumulet_grid_type)>& visit) {
    for (const cumulet_grid_type type : {CUMULET_GRID_TETRAHEDRAL, CUMULET_GRID_DENSE, CUMULET_GRID_BRICKS}) {
      SCOPED_TRACE("grid type " + std::to_string(type));
      set_grid(type);
      visit(type);
    }
  }
  // Calls visit for each combination of grid type, interpolation and kind of cells that has kernels of its own.
  void for_each_grid(const std::function<void()>& visit) {
    const auto show_with = [&](cumulet_grid_type type, cumulet_interpolation interpolation,
                               cumulet_cell_density cells) {
      SCOPED_TRACE("grid type " + std::to_string(type) + ", cells " + std::to_string(cells) + ", interpolation " +
                   std::to_string(interpolation));
      set_grid(type, interpolation, cells);
      visit();
    };
    for (const cumulet_grid_type type : {CUMULET_GRID_TETRAHEDRAL, CUMULET_GRID_DENSE, CUMULET_GRID_BRICKS}) {
      show_with(type, CUMULET_INTERPOLATION_NEAREST, CUMULET_CELLS_LINEAR);
      show_with(type, CUMULET_INTERPOLATION_LINEAR, CUMULET_CELLS_LINEAR);
    }
    show_with(CUMULET_GRID_TETRAHEDRAL, CUMULET_INTERPOLATION_LINEAR, CUMULET_CELLS_TRILINEAR);
  }
  void expect_transmittance(double expected, double tolerance = 1e-4) {
    make();
    for (const float transmittance : aov(CUMULET_AOV_TRANSMITTANCE, 1)) ASSERT_NEAR(transmittance, expected, tolerance);
  }
  // Mean of red over some pixels.
  double mean(const std::function<bool(std::size_t column)>& counts = [](std::size_t) { return true; }) {
    make();
    const std::vector<float> rgba = linear();
    double sum = 0.0;
    int pixels = 0;
    for (std::size_t i = 0; i < count; ++i) {
      if (!counts(i % side)) continue;
      sum += double{rgba[4 * i]};
      ++pixels;
    }
    return sum / pixels;
  }
};
CUMULET_ON_BACKENDS(ClipPlanes);

TEST_P(ClipPlanes, FeaturesOfASlabHaveClosedForms) {
  const VolumeRef slab = make_slab();
  show(slab.get());
  constexpr double scale = 1.2;
  set_medium(scale, 0.0F);
  const double depth = 20.0 - 4.1 + std::numbers::ln2 / scale;
  for_each_grid([&] {
    clip({});
    make();
    const std::vector<float> whole = aov(CUMULET_AOV_TRANSMITTANCE, 1);
    for (const Clip& cut : {layers(1.3, 4.1), Clip{{}, {{0.0, 0.0, 2.0, -2.6}, {0.0, 0.0, -0.5, 2.05}}}}) {
      clip(cut);
      expect_transmittance(std::exp(-scale * 2.8));
      for (const float z : aov(CUMULET_AOV_VOLUME_DEPTH, 1)) ASSERT_NEAR(z, depth, 1e-3);
      auto pick = make_desc<cumulet_pick>();
      ASSERT_EQ(cumulet_pick_at(v_, 3.3, 4.6, &pick), CUMULET_OK) << cumulet_last_error(v_);
      EXPECT_EQ(pick.hit_volume, 1);
      EXPECT_NEAR(pick.distance, depth, 1e-3);
    }
    clip(layers(7.0, 8.0));
    expect_transmittance(1.0, 0.0);
    ASSERT_EQ(cumulet_set_clip(v_, nullptr), CUMULET_OK);
    make();
    EXPECT_EQ(aov(CUMULET_AOV_TRANSMITTANCE, 1), whole) << "the clip leaves nothing behind";
  });
}

// With a plane across the view, pixels see different lengths of the slab.
TEST_P(ClipPlanes, AnObliquePlaneCutsCells) {
  const VolumeRef slab = make_slab();
  show(slab.get());
  constexpr double scale = 0.4;
  set_medium(scale, 0.0F);
  for_each_grid([&] {
    clip({{}, {{1.0, 0.0, 1.0, -2.0}}});
    make();
    const std::vector<float> transmittance = aov(CUMULET_AOV_TRANSMITTANCE, 1);
    for (std::size_t i = 0; i < count; ++i) {
      const double x = static_cast<double>(i % side) - 3.5;
      // Between the voxels' centers density is constant.
      const double low = 2.0 - x;
      if (low < 0.5 || low > 4.5) continue;
      // The fixed feature rays are not exactly centered in the pixel, but are the same in each.
      const double depth = -std::log(double{transmittance[i]});
      ASSERT_NEAR(depth, scale * (5.5 - low), 0.06) << i;
      if (low > 3.5) continue;
      ASSERT_NEAR(depth + std::log(double{transmittance[i - 1]}), scale, 1e-3) << i;
    }
  });
}

TEST_P(ClipPlanes, ARayMayBeginInThePartThatIsCutOff) {
  const VolumeRef slab = make_slab();
  show(slab.get());
  set_medium(0.7, 0.0F);
  look_down(3.6);
  for_each_type([&](cumulet_grid_type) {
    clip(layers(-3.0, 2.25));
    expect_transmittance(std::exp(-0.7 * 2.75));
    clip(layers(3.9, 9.0));
    expect_transmittance(1.0, 0.0);
  });
}

// The transform moves the clip with the volume; an instance has its own.
TEST_P(ClipPlanes, TransformsApplyToTheClip) {
  const VolumeRef slab = make_slab();
  show(slab.get());
  set_medium(0.3, 0.0F);
  // x becomes y, y becomes -x, and z becomes 2 z.
  const std::array<double, 16> turn{0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 2, 0, 0, 0, -4, 1};
  ASSERT_EQ(cumulet_set_volume_transforms(v_, turn.data(), 1), CUMULET_OK);
  auto medium = make_desc<cumulet_medium_desc>();
  medium.density_scale = 0.3;
  auto desc = make_desc<cumulet_instance_desc>();
  desc.volume = slab.get();
  desc.medium = &medium;
  const InstanceRef other = cumulet::test::make_instance(desc);
  for_each_type([&](cumulet_grid_type) {
    clip({{{0.0, -far, 1.0, far, far, 2.5}}, {}});
    make();
    std::vector<float> transmittance = aov(CUMULET_AOV_TRANSMITTANCE, 1);
    for (std::size_t i = 0; i < count; ++i)  // rows begin at the top
      ASSERT_NEAR(transmittance[i], i < count / 2 ? std::exp(-0.3 * 3.0) : 1.0, 1e-4) << i;
    ASSERT_EQ(cumulet_add_instance(v_, other.get()), CUMULET_OK);
    const Clip of_instance{{{-far, -far, 0.0, 1.0, far, 2.0}}, {}};
    const cumulet_clip_desc cut = clip_desc_of(of_instance);
    ASSERT_EQ(cumulet_instance_set_clip(other.get(), &cut), CUMULET_OK);
    ASSERT_EQ(cumulet_instance_set(other.get(), &desc), CUMULET_OK) << "which keeps the clip";
    make();
    transmittance = aov(CUMULET_AOV_TRANSMITTANCE, 1);
    for (std::size_t i = 0; i < count; ++i) {
      const double depth = (i < count / 2 ? 0.3 * 3.0 : 0.0) + (i % side < 5 ? 0.3 * 2.0 : 0.0);
      ASSERT_NEAR(transmittance[i], std::exp(-depth), 1e-4) << i;
    }
    ASSERT_EQ(cumulet_instance_set_clip(other.get(), nullptr), CUMULET_OK);
    clip({});
    expect_transmittance(std::exp(-0.3 * (12.0 + 6.0)));
    ASSERT_EQ(cumulet_remove_instance(v_, other.get()), CUMULET_OK);
  });
}

// Emission of an absorbing slab, and of a wall behind it.
TEST_P(ClipPlanes, PathsCollectTheEmissionOfThePartThatIsShown) {
  const VolumeRef slab = make_slab();
  const SurfacesRef wall = make_wall(-6.0F, 3.0F, 1e-4F);
  show(slab.get());
  set_medium(0.4, 1.0F, 2.0F);
  clip(layers(1.25, 3.5));
  const double through = std::exp(-0.4 * 2.25);
  const std::array<double, 16> low = at(0.0, 0.0, -1.0);
  const std::array<double, 16> high = at(0.0, 0.0, 1.0);
  for (const float shutter : {0.0F, 0.5F}) {
    SCOPED_TRACE(shutter);
    set_samples(256, shutter);
    ASSERT_EQ(cumulet_set_volume_shutter_transforms(v_, low.data(), high.data(), 1), CUMULET_OK);
    for_each_type([&](cumulet_grid_type) {
      EXPECT_NEAR(mean(), 2.0 * (1.0 - through), 0.04);
      ASSERT_EQ(cumulet_set_surfaces(v_, wall.get()), CUMULET_OK);
      EXPECT_NEAR(mean(), 2.0 * (1.0 - through) + 3.0 * through, 0.08);
      ASSERT_EQ(cumulet_set_surfaces(v_, nullptr), CUMULET_OK);
    });
  }
}

// The sun is above the camera's ray, so that light passes the slab twice. Where the slab is cut off the ground is lit
// without noise.
TEST_P(ClipPlanes, ThePartThatIsCutOffCastsNoShadow) {
  const VolumeRef slab = make_slab();
  show(slab.get());
  // The slab's z becomes y.
  const std::array<double, 16> turn{1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1};
  ASSERT_EQ(cumulet_set_volume_transforms(v_, turn.data(), 1), CUMULET_OK);
  auto stand = make_desc<cumulet_camera_desc>();
  stand.eye[1] = 20.0;
  stand.up[1] = 0.0;
  stand.up[2] = -1.0;
  stand.orthographic_height = side;
  look(v_, stand);
  auto ground = make_desc<cumulet_ground_desc>();
  ground.mode = CUMULET_GROUND_AT_HEIGHT;
  ground.height = -4.0;
  for (float& value : ground.albedo) value = 0.5F;
  ASSERT_EQ(cumulet_set_ground(v_, &ground), CUMULET_OK);
  set_light(3.0F, 0.0F);
  set_medium(0.2, 1.0F);
  set_samples(256);
  clip({{{0.0, -far, 1.25, far, far, 3.25}}, {}});
  const double lit = 3.0 * 0.5 / std::numbers::pi;
  for_each_type([&](cumulet_grid_type) {
    EXPECT_NEAR(mean([](std::size_t column) { return column < side / 2; }), lit, 1e-4);
    EXPECT_NEAR(mean([](std::size_t column) { return column >= side / 2; }), lit * std::exp(-2.0 * 0.2 * 2.0), 0.01);
  });
}

// Multiple scattering, and light of a flame that next-event estimation and scattered rays find: a clip between two
// layers of voxels gives the image of the volume that ends there.
TEST_P(ClipPlanes, LooksLikeAVolumeThatEndsThere) {
  auto ground = make_desc<cumulet_ground_desc>();
  const SurfacesRef wall = make_wall(-2.0F, 0.0F);
  for (const bool glows : {false, true}) {
    SCOPED_TRACE(glows ? "glowing" : "scattering");
    const VolumeRef whole = make_lumps(8, glows);
    const VolumeRef part = make_lumps(4, glows);
    set_medium(0.3, 0.1F);
    set_light(glows ? 0.0F : 2.0F, glows ? 0.0F : 1.0F);
    set_samples(512);
    ASSERT_EQ(cumulet_set_ground(v_, &ground), CUMULET_OK);
    for (cumulet_surfaces* surfaces : {static_cast<cumulet_surfaces*>(nullptr), wall.get()}) {
      SCOPED_TRACE(surfaces != nullptr ? "with a wall" : "alone");
      ASSERT_EQ(cumulet_set_surfaces(v_, surfaces), CUMULET_OK);
      for_each_type([&](cumulet_grid_type) {
        show(whole.get());
        clip({});
        const double all = mean();
        clip(layers(-far, 3.5));
        const double clipped = mean();
        show(part.get());
        clip({});
        const double expected = mean();
        EXPECT_NEAR(clipped / expected, 1.0, 0.03);
        // The wall is lit more evenly.
        if (surfaces == nullptr || glows) {
          EXPECT_GT(std::abs(all / expected - 1.0), 0.05) << "the rest matters";
        }
      });
    }
  }
}

TEST_P(ClipPlanes, AChangeBuildsNoGrid) {
  const VolumeRef slab = make_slab();
  show(slab.get());
  make();
  auto before = make_desc<cumulet_stats>();
  ASSERT_EQ(cumulet_get_stats(v_, &before), CUMULET_OK);
  for (const double high : {2.0, 3.0}) {
    clip(layers(0.0, high));
    auto progress = make_desc<cumulet_progress>();
    ASSERT_EQ(cumulet_get_progress(v_, &progress), CUMULET_OK);
    EXPECT_EQ(progress.stage, CUMULET_STAGE_IDLE);
    auto result = make_desc<cumulet_frame_result>();
    const cumulet_frame_desc frame = undrawn();
    ASSERT_EQ(cumulet_render(v_, &frame, &result), CUMULET_OK);
    EXPECT_EQ(result.flags & CUMULET_RENDER_LOADING, 0U);
    make();
    auto after = make_desc<cumulet_stats>();
    ASSERT_EQ(cumulet_get_stats(v_, &after), CUMULET_OK);
    EXPECT_EQ(after.build_seconds_total, before.build_seconds_total);
    EXPECT_EQ(after.build_seconds_upload, before.build_seconds_upload);
    EXPECT_EQ(after.cells, before.cells);
  }
}

TEST_P(ClipPlanes, RefusesBadArguments) {
  auto made = make_desc<cumulet_instance_desc>();
  const InstanceRef instance = cumulet::test::make_instance(made);
  const auto refused = [&](const cumulet_clip_desc& desc, const std::string& why) {
    EXPECT_EQ(cumulet_set_clip(v_, &desc), CUMULET_ERROR_INVALID_ARGUMENT) << why;
    EXPECT_EQ(cumulet_last_error(v_), why);
    EXPECT_EQ(cumulet_instance_set_clip(instance.get(), &desc), CUMULET_ERROR_INVALID_ARGUMENT) << why;
  };
  const double nan = std::nan("");
  refused(
      clip_desc_of({{{0, 0, 1, 1, 1, 1}}, {}}),
      "cumulet_clip_desc's box is empty: each number of its lowest corner must be below that of its highest corner");
  refused(clip_desc_of({{{0, 0, 0, 1, nan, 1}}, {}}),
          "cumulet_clip_desc's box has a number that is not from -1e30 to 1e30");
  const Clip flat{{}, {{1, 0, 0, 0}, {0, 0, 0, 1}}};
  refused(clip_desc_of(flat), "cumulet_clip_desc: plane 1 has no direction: its first three numbers are 0");
  const Clip endless{{}, {{1, 0, 0, HUGE_VAL}}};
  refused(clip_desc_of(endless), "cumulet_clip_desc: plane 0 has a number that is not from -1e30 to 1e30");
  const Clip many{{}, std::vector<cumulet::settings::ClipPlane>(CUMULET_CLIP_PLANES + 1, {1, 0, 0, 0})};
  refused(clip_desc_of(many), "cumulet_clip_desc has 7 planes; it must have at most 6");
  auto desc = make_desc<cumulet_clip_desc>();
  desc.box = 2;
  refused(desc, "cumulet_clip_desc.box is not 0 or 1");
  desc.box = 0;
  desc.plane_count = 1;
  refused(desc, "cumulet_clip_desc.planes are NULL");
  desc.plane_count = 0;
  desc.struct_size = 3;
  refused(desc, "cumulet_clip_desc.struct_size is 3, not sizeof(cumulet_clip_desc)");
}

}  // namespace
