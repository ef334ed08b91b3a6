// Clips of dynamic volumes, in main memory and on the GPU, compared with closed forms.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "settings/clip.hpp"
#include "support/c_viewer.hpp"
#include "support/simulated.hpp"

namespace {

using namespace cumulet::test;
using cumulet::settings::Clip;
using cumulet::settings::clip_desc_of;

constexpr std::uint32_t side = 4;
constexpr double far = 1e6;
constexpr double scale = 0.7;

class ClippedDynamicVolume : public CViewerTest {
 protected:
  ClippedDynamicVolume() : CViewerTest(side, side, 1) {}
  void SetUp() override {
    CViewerTest::SetUp();
    if (IsSkipped()) return;
    auto stand = make_desc<cumulet_camera_desc>();
    stand.eye[2] = 20.0;
    stand.orthographic_height = side;
    look(v_, stand);
    medium_.density_scale = scale;
    ASSERT_EQ(cumulet_set_medium(v_, &medium_), CUMULET_OK);
  }
  static LiveRef make_live(bool on_gpu) {
    auto desc = make_desc<cumulet_dynamic_volume_desc>();
    desc.gpu_resident = on_gpu ? 1 : 0;
    return cumulet::test::make_live(desc);
  }
  // A slab of constant density from z = -0.5 to 5.5, wider than the view.
  static void set_slab(const LiveRef& live, float density) {
    constexpr std::array<int, 3> size{8, 8, 6};
    std::vector<float> values(std::size_t{8} * 8 * 6, density);
    auto dense = make_desc<cumulet_dense_desc>();
    dense.values = values.data();
    dense.value_count = values.size();
    for (std::size_t axis = 0; axis < 3; ++axis) dense.size[axis] = size.at(axis);
    for (int i = 0; i < 4; ++i) dense.index_to_world[5 * i] = 1.0;
    dense.index_to_world[12] = dense.index_to_world[13] = -3.5;
    auto field = make_desc<cumulet_field>();
    field.channel = CUMULET_CHANNEL_DENSITY;
    field.dense = &dense;
    auto desc = make_desc<cumulet_volume_fields_desc>();
    desc.fields = &field;
    desc.field_count = 1;
    ASSERT_EQ(cumulet_dynamic_volume_set(live.get(), &desc, nullptr, 0), CUMULET_OK) << cumulet_last_error(nullptr);
  }
  void set_grid(cumulet_build_device device, cumulet_cell_density cells, cumulet_interpolation interpolation) {
    auto grid = make_desc<cumulet_grid_desc>();
    grid.threshold = -1.0;
    grid.build_device = device;
    grid.cells = cells;
    grid.interpolation = interpolation;
    ASSERT_EQ(cumulet_set_grid(v_, &grid), CUMULET_OK);
  }
  void expect_depth(double depth) {
    make();
    for (const float transmittance : aov(CUMULET_AOV_TRANSMITTANCE, 1))
      ASSERT_NEAR(-std::log(double{transmittance}), scale * depth, 1e-3);
  }

  cumulet_medium_desc medium_ = make_desc<cumulet_medium_desc>();
};
CUMULET_ON_BACKENDS(ClippedDynamicVolume);

Clip layers(double low, double high) { return {{{-far, -far, low, far, far, high}}, {}}; }

TEST_P(ClippedDynamicVolume, IsCutInEveryState) {
  for (const bool on_gpu : {true, false}) {
    for (const cumulet_build_device device : {CUMULET_BUILD_GPU, CUMULET_BUILD_CPU}) {
      for (const cumulet_cell_density cells : {CUMULET_CELLS_LINEAR, CUMULET_CELLS_TRILINEAR}) {
        SCOPED_TRACE((on_gpu ? "on the GPU, device " : "in main memory, device ") + std::to_string(device) +
                     ", cells " + std::to_string(cells));
        const LiveRef live = make_live(on_gpu);
        set_grid(device, cells, CUMULET_INTERPOLATION_AUTO);
        ASSERT_EQ(cumulet_set_dynamic_volume(v_, live.get()), CUMULET_OK);
        const cumulet_clip_desc cut = clip_desc_of(layers(1.3, 4.1));
        ASSERT_EQ(cumulet_set_clip(v_, &cut), CUMULET_OK);
        for (const float density : {1.0F, 2.5F}) {
          set_slab(live, density);
          expect_depth(density * 2.8);
        }
        cumulet_interpolation used{};
        ASSERT_EQ(cumulet_get_interpolation(v_, &used), CUMULET_OK);
        const bool stays_on_gpu = on_gpu && device == CUMULET_BUILD_GPU && cells == CUMULET_CELLS_LINEAR;
        EXPECT_EQ(used, stays_on_gpu ? CUMULET_INTERPOLATION_NEAREST : CUMULET_INTERPOLATION_LINEAR);
        ASSERT_EQ(cumulet_set_clip(v_, nullptr), CUMULET_OK);
        expect_depth(2.5 * 6.0);
      }
    }
  }
}

TEST_P(ClippedDynamicVolume, AnInstanceHasItsOwnClip) {
  const LiveRef live = make_live(true);
  set_grid(CUMULET_BUILD_GPU, CUMULET_CELLS_LINEAR, CUMULET_INTERPOLATION_NEAREST);
  auto desc = make_desc<cumulet_instance_desc>();
  desc.dynamic_volume = live.get();
  desc.medium = &medium_;
  const InstanceRef instance = make_instance(desc);
  ASSERT_EQ(cumulet_set_dynamic_volume(v_, live.get()), CUMULET_OK);
  ASSERT_EQ(cumulet_add_instance(v_, instance.get()), CUMULET_OK);
  const Clip planes{{}, {{0.0, 0.0, 1.0, -3.25}}};
  const cumulet_clip_desc of_instance = clip_desc_of(planes);
  ASSERT_EQ(cumulet_instance_set_clip(instance.get(), &of_instance), CUMULET_OK);
  const cumulet_clip_desc own = clip_desc_of(layers(-far, 2.25));
  ASSERT_EQ(cumulet_set_clip(v_, &own), CUMULET_OK);
  set_slab(live, 1.0F);
  expect_depth(2.75 + 2.25);
  set_slab(live, 0.5F);
  expect_depth(0.5 * (2.75 + 2.25));
}

}  // namespace
