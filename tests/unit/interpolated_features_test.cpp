// Picks and AOVs of volumes with each interpolation between voxels, compared with quadrature of the field's definition,
// for every grid type.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "support/c_viewer.hpp"

namespace {

using namespace cumulet::test;
using cumulet::headless::Backend;
using cumulet::headless::Context;

constexpr std::uint32_t side = 8;
constexpr double eye_z = 20.0;

// Layers of voxels, at z = 0 to 5.
constexpr std::array<float, 6> densities{0.2F, 0.9F, 0.4F, 1.3F, 0.6F, 0.8F};
constexpr std::array<float, 6> speeds{2.0F, -2.0F, 1.0F, 8.0F, -8.0F, 8.0F};  // along x

VolumeRef make_layers() {
  constexpr std::int32_t width = 24;
  const auto layers = [](const auto& value) {
    std::vector<float> values;
    for (std::size_t z = 0; z < densities.size(); ++z)
      values.insert(values.end(), std::size_t{width} * width, value(z));
    return values;
  };
  const std::array<std::vector<float>, 4> values{
      layers([](std::size_t z) { return densities.at(z); }), layers([](std::size_t z) { return speeds.at(z); }),
      layers([](std::size_t) { return 0.0F; }), layers([](std::size_t) { return 0.5F; })};
  constexpr std::array channels{CUMULET_CHANNEL_DENSITY, CUMULET_CHANNEL_VELOCITY_X, CUMULET_CHANNEL_VELOCITY_Y,
                                CUMULET_CHANNEL_VELOCITY_Z};
  std::array<cumulet_dense_desc, 4> descs{};
  std::array<cumulet_field, 4> fields{};
  for (std::size_t i = 0; i < 4; ++i) {
    descs.at(i) = make_desc<cumulet_dense_desc>();
    descs.at(i).values = values.at(i).data();
    descs.at(i).value_count = values.at(i).size();
    descs.at(i).size[0] = descs.at(i).size[1] = width;
    descs.at(i).size[2] = static_cast<std::int32_t>(densities.size());
    for (int axis = 0; axis < 4; ++axis) descs.at(i).index_to_world[5 * axis] = 1.0;
    descs.at(i).index_to_world[12] = descs.at(i).index_to_world[13] = 0.5 * (1 - width);
    fields.at(i) = make_desc<cumulet_field>();
    fields.at(i).channel = channels.at(i);
    fields.at(i).dense = &descs.at(i);
  }
  auto desc = make_desc<cumulet_volume_fields_desc>();
  desc.fields = fields.data();
  desc.field_count = fields.size();
  return made_by<VolumeRef>(cumulet_volume_from_fields, desc);
}

// A square across the view.
SurfacesRef make_wall(float z) {
  const std::array<float, 18> corners{-20, -20, z, 20, -20, z, 20, 20, z, -20, -20, z, 20, 20, z, -20, 20, z};
  auto mesh = make_desc<cumulet_mesh_desc>();
  mesh.positions = corners.data();
  mesh.vertex_count = 6;
  mesh.double_sided = 1;
  return make_surfaces({&mesh, 1});
}

// The features that rays down z see, by quadrature.
class Layers {
 public:
  Layers(double scale, cumulet_interpolation interpolation) : scale_(scale), interpolation_(interpolation) {}
  [[nodiscard]] double transmittance_to(double z) const {
    double depth = 0.0;
    down_to(z, [&](double at) { depth += step * density(at); });
    return std::exp(-scale_ * depth);
  }
  [[nodiscard]] double half_opacity() const {
    double z = top;
    for (double depth = 0.0; scale_ * depth < std::log(2.0); z -= step) depth += step * density(z - 0.5 * step);
    return z;
  }
  // Mean along x at the first scattering above z.
  [[nodiscard]] double velocity_to(double z) const {
    double depth = 0.0;
    double sum = 0.0;
    down_to(z, [&](double at) {
      sum += step * scale_ * std::exp(-scale_ * depth) *
             value(at, [](std::size_t layer) { return double{densities.at(layer)} * double{speeds.at(layer)}; });
      depth += step * density(at);
    });
    return sum / (1.0 - std::exp(-scale_ * depth));
  }

 private:
  static constexpr double top = 6.0;
  static constexpr double step = 1e-4;
  static void down_to(double z, const std::function<void(double)>& visit) {
    for (double at = top - 0.5 * step; at > z; at -= step) visit(at);
  }
  template <class Of>
  [[nodiscard]] double value(double z, const Of& of) const {
    const auto layer = [&](double index) {
      return index >= 0.0 && index < 6.0 ? of(static_cast<std::size_t>(index)) : 0.0;
    };
    if (interpolation_ == CUMULET_INTERPOLATION_NEAREST) return layer(std::floor(z + 0.5));
    const double low = std::floor(z);
    return (low + 1.0 - z) * layer(low) + (z - low) * layer(low + 1.0);
  }
  [[nodiscard]] double density(double z) const {
    return value(z, [](std::size_t layer) { return double{densities.at(layer)}; });
  }

  double scale_;
  cumulet_interpolation interpolation_;
};

class InterpolatedFeatures : public CViewerTest {
 protected:
  InterpolatedFeatures() : CViewerTest(side, side, 1) {}
  void SetUp() override {
    CViewerTest::SetUp();
    if (IsSkipped()) return;
    auto stand = make_desc<cumulet_camera_desc>();
    stand.eye[2] = eye_z;
    stand.orthographic_height = side;
    look(v_, stand);
    ASSERT_EQ(cumulet_set_volume(v_, layers_.get()), CUMULET_OK);
  }
  struct Kind {
    cumulet_grid_type type;
    cumulet_build_device device = CUMULET_BUILD_CPU;
    cumulet_cell_density cells = CUMULET_CELLS_LINEAR;
  };
  void show(double scale, const Kind& kind, cumulet_interpolation interpolation) {
    auto medium = make_desc<cumulet_medium_desc>();
    medium.density_scale = scale;
    ASSERT_EQ(cumulet_set_medium(v_, &medium), CUMULET_OK);
    auto grid = make_desc<cumulet_grid_desc>();
    grid.type = kind.type;
    grid.cells = kind.cells;
    grid.threshold = -1.0;
    grid.interpolation = interpolation;
    grid.build_device = kind.device;
    ASSERT_EQ(cumulet_set_grid(v_, &grid), CUMULET_OK);
    make();
  }
  // Calls visit for every grid type, interpolation and density scale, with the expected values. part: the error of
  // cells, whose velocity is constant.
  void for_each(const std::function<void(const Layers& expected, double part)>& visit) {
    for (const Kind& kind : {Kind{CUMULET_GRID_TETRAHEDRAL}, Kind{CUMULET_GRID_TETRAHEDRAL, CUMULET_BUILD_GPU},
                             Kind{CUMULET_GRID_TETRAHEDRAL, CUMULET_BUILD_CPU, CUMULET_CELLS_TRILINEAR},
                             Kind{CUMULET_GRID_TETRAHEDRAL, CUMULET_BUILD_GPU, CUMULET_CELLS_TRILINEAR},
                             Kind{CUMULET_GRID_DENSE}, Kind{CUMULET_GRID_BRICKS}}) {
      for (const cumulet_interpolation interpolation : {CUMULET_INTERPOLATION_NEAREST, CUMULET_INTERPOLATION_LINEAR}) {
        for (const double scale : {1.2, 8.0}) {
          SCOPED_TRACE(std::to_string(kind.type) + " built by " + std::to_string(kind.device) + ", cells " +
                       std::to_string(kind.cells) + ", interpolation " + std::to_string(interpolation) +
                       ", density scale " + std::to_string(scale));
          show(scale, kind, interpolation);
          visit({scale, interpolation}, kind.type == CUMULET_GRID_TETRAHEDRAL ? 0.8 : 0.0);
        }
      }
    }
  }

  VolumeRef layers_ = make_layers();
};
CUMULET_ON_BACKENDS(InterpolatedFeatures);

// With the larger density scale and linear interpolation the ray reaches it outside the voxels' box.
TEST_P(InterpolatedFeatures, PicksAndVolumeDepthFindHalfOpacity) {
  for_each([&](const Layers& expected, double) {
    const double z = expected.half_opacity();
    auto pick = make_desc<cumulet_pick>();
    ASSERT_EQ(cumulet_pick_at(v_, 3.3, 4.6, &pick), CUMULET_OK) << cumulet_last_error(v_);
    ASSERT_EQ(pick.hit_volume, 1);
    EXPECT_NEAR(pick.position[2], z, 5e-3);
    EXPECT_NEAR(pick.distance, eye_z - z, 5e-3);
    for (const float depth : aov(CUMULET_AOV_VOLUME_DEPTH, 1)) ASSERT_NEAR(depth, eye_z - z, 5e-3);
  });
  EXPECT_GT(Layers(8.0, CUMULET_INTERPOLATION_LINEAR).half_opacity(), 5.51);
  EXPECT_LT(Layers(8.0, CUMULET_INTERPOLATION_NEAREST).half_opacity(), 5.49);
}

TEST_P(InterpolatedFeatures, TransmittanceEndsAtSurfaces) {
  constexpr double at = 5.25;
  const SurfacesRef wall = make_wall(static_cast<float>(at));
  ASSERT_EQ(cumulet_set_surfaces(v_, wall.get()), CUMULET_OK);
  for_each([&](const Layers& expected, double) {
    for (const float transmittance : aov(CUMULET_AOV_TRANSMITTANCE, 1))
      ASSERT_NEAR(transmittance, expected.transmittance_to(at), 2e-3);
  });
  EXPECT_GT(std::abs(Layers(8.0, CUMULET_INTERPOLATION_LINEAR).transmittance_to(at) -
                     Layers(8.0, CUMULET_INTERPOLATION_NEAREST).transmittance_to(at)),
            0.02);
}

// Only the highest layer is above the surface, so its velocity is the only one without interpolation.
TEST_P(InterpolatedFeatures, VelocityIsThatOfTheFirstScattering) {
  constexpr double at = 4.55;
  const SurfacesRef wall = make_wall(static_cast<float>(at));
  ASSERT_EQ(cumulet_set_surfaces(v_, wall.get()), CUMULET_OK);
  for_each([&](const Layers& expected, double part) {
    const std::vector<float> velocity = aov(CUMULET_AOV_VELOCITY, 3);
    double mean = 0.0;
    for (std::size_t i = 0; i < velocity.size(); i += 3) {
      mean += 3.0 * double{velocity[i]} / static_cast<double>(velocity.size());
      ASSERT_NEAR(velocity[i + 1], 0.0, 5e-3);
      ASSERT_NEAR(velocity[i + 2], 0.5, 5e-3);
    }
    EXPECT_NEAR(mean, expected.velocity_to(at), 0.1 + part);
  });
  EXPECT_NEAR(Layers(1.2, CUMULET_INTERPOLATION_NEAREST).velocity_to(at), 8.0, 1e-2);
  EXPECT_LT(Layers(1.2, CUMULET_INTERPOLATION_LINEAR).velocity_to(at), 7.2);
}

}  // namespace
