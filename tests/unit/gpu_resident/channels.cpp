// Channels derived on the GPU: emission, scattering, velocity.

#include <gtest/gtest.h>

#include <optional>

#include "gl/state_guard.hpp"
#include "grid/tet_grid.hpp"
#include "render/dynamic/voxel_transfers.hpp"
#include "render/grid/grid_build.hpp"
#include "support/gl_state.hpp"
#include "support/gpu_resident_states.hpp"
#include "support/grid_reference.hpp"
#include "support/simulated.hpp"
#include "support/view_cameras.hpp"
#include "volume/bricks.hpp"
#include "volume/frame_import.hpp"
#include "volume/optical_depth.hpp"

namespace {

using namespace cumulet;
using test::as_halves;
using test::Cells;
using test::expect_near;
using test::expect_same_cells;
using test::GpuResidentStates;
using test::GridReference;
using test::odd;
using test::Sides;
using test::simulated;
using test::transform;

// Emission settings: flame and temperature with and without ramps, only one of them, and values close to 0.
std::vector<scene::Emission> emissions() {
  scene::Emission plain{.flame_strength = 3.0, .flame_color = {1.0F, 0.5F, 0.1F}, .blackbody = 1.0};
  scene::Emission curved{.flame_strength = 0.5,
                         .temperature_scale = 700.0,
                         .temperature_offset = 300.0,
                         .blackbody = 0.25,
                         .blackbody_tint = {0.2F, 1.0F, 0.7F},
                         .temperature_ramp = volume::Ramp({{0.1F, 0.0F}, {0.5F, 2.0F}, {1.2F, 3.0F}}),
                         .flame_ramp = volume::Ramp({{0.2F, 0.1F}, {0.4F, 0.0F}})};
  scene::Emission flame_alone{.flame_strength = 1.0, .flame_color = {0.0F, 1.0F, 0.0F}};
  scene::Emission heat_alone{.flame_strength = 0.0, .temperature_scale = 4000.0, .blackbody = 1.0};
  return {plain, curved, flame_alone, heat_alone};
}

volume::VolumeFrame frame_of(const std::vector<std::pair<volume::Channel, std::vector<float>>>& fields,
                             const Sides& size) {
  std::vector<volume::MemoryField> views;
  for (const auto& [channel, values] : fields)
    views.push_back({channel, volume::DenseVoxels{values, {size[0], size[1], size[2]}, transform()}});
  return volume::import_fields(views, "smoke", {});
}

// Compares all except the values. The maximum may differ by the fraction `apart`.
void expect_same_bricks(const volume::ScalarVolume& found, const volume::ScalarVolume& expected, float apart) {
  ASSERT_EQ(found.brick_origins, expected.brick_origins);
  EXPECT_EQ(found.bounds_min, expected.bounds_min);
  EXPECT_EQ(found.bounds_max, expected.bounds_max);
  EXPECT_EQ(found.active_voxels, expected.active_voxels);
  EXPECT_NEAR(found.max_value, expected.max_value, apart * expected.max_value);
  ASSERT_EQ(found.brick_values.size(), expected.brick_values.size());
}

void expect_near(const grid::RgbField::Components& found, const grid::RgbField::Components& expected) {
  for (std::size_t c = 0; c < 3; ++c) ASSERT_NO_FATAL_FAILURE(expect_same_bricks(found[c], expected[c], 1e-5F));
  for (std::size_t i = 0; i < expected[0].brick_values.size(); ++i) {
    const auto at = [i](const grid::RgbField::Components& of) {
      return glm::vec3(of[0].brick_values[i], of[1].brick_values[i], of[2].brick_values[i]);
    };
    ASSERT_LE(glm::length(at(found) - at(expected)), 1e-5F * glm::length(at(expected))) << i;
  }
}

void expect_same_light(const Cells& found, const grid::TetGrid& expected) {
  ASSERT_EQ(found.emission.size(), expected.channels.emission.size());
  for (std::size_t i = 0; i < expected.channels.emission.size(); ++i) {
    const glm::vec3 a = found.emission[i].mean;
    const glm::vec3 b = expected.channels.emission[i].mean;
    ASSERT_LE(glm::length(a - b), 1e-4F * glm::length(b) + 1e-6F) << i;
  }
}

TEST_P(GpuResidentStates, EmissionChannelsMatchTheVoxels) {
  test::Cameras cameras(4);
  auto density = simulated(CUMULET_CHANNEL_DENSITY, odd, 1);
  // Sizes and positions differ from the density's.
  const auto flame = as_halves(simulated(CUMULET_CHANNEL_FLAME, odd, 4));
  const auto temperature = simulated(CUMULET_CHANNEL_TEMPERATURE, odd, 2);
  const std::vector<scene::Emission> wanted = emissions();
  const scene::StateInGl state = bring({{volume::Channel::density, density},
                                        {volume::Channel::temperature, temperature},
                                        {volume::Channel::flame, flame, true}},
                                       odd, transform(), wanted);
  ASSERT_EQ(state.products.size(), wanted.size());
  const volume::VolumeFrame in_memory = frame_of({{volume::Channel::density, density},
                                                  {volume::Channel::temperature, temperature},
                                                  {volume::Channel::flame, flame}},
                                                 odd);
  const volume::VolumeFrame in_gl = state.frame();
  EXPECT_EQ(in_gl.flame->bounds_min, in_memory.flame->bounds_min);
  EXPECT_EQ(in_gl.flame->bounds_max, in_memory.flame->bounds_max);
  EXPECT_EQ(in_gl.temperature->active_voxels, in_memory.temperature->active_voxels);
  EXPECT_EQ(in_gl.temperature->max_value, in_memory.temperature->max_value);
  glm::ivec3 low = in_memory.density.bounds_min;
  glm::ivec3 high = in_memory.density.bounds_max;
  for (const auto& field : {in_memory.flame, in_memory.temperature}) {
    low = glm::min(low, field->bounds_min);
    high = glm::max(high, field->bounds_max);
  }
  const grid::Cube cube = grid::fit_cube(in_gl.density, low, high);
  for (const scene::Emission& settings : wanted) {
    const auto found = state.emission(settings);
    const auto expected = scene::emission_of(in_memory, settings);
    ASSERT_TRUE(found && expected);
    grid::RgbField::Components read;
    for (std::size_t c = 0; c < 3; ++c) read[c] = copied((*found)[c]);
    ASSERT_NO_FATAL_FAILURE(expect_near(read, *expected));
    grid::Channels known_channels;
    known_channels.emission = std::make_shared<const grid::RgbField>(*found, cube);
    grid::Channels channels;
    channels.emission = std::make_shared<const grid::RgbField>(read, cube);
    const GridReference known(in_gl.density, cube, known_channels);
    const GridReference reference(in_memory.density, cube, channels);
    for (const auto cells : {grid::CellKind::linear, grid::CellKind::constant}) {
      grid::RefineSettings refine;
      refine.cells = cells;
      refine.density_scale = 3.0;
      refine.threshold = 0.05;
      const auto compare = [&] {
        const Cells made = build(known, refine);
        const grid::TetGrid same = reference.grid(refine);
        ASSERT_NO_FATAL_FAILURE(expect_same_cells(made, same));
        ASSERT_NO_FATAL_FAILURE(expect_same_light(made, same));
      };
      ASSERT_NO_FATAL_FAILURE(compare());
      refine.max_cells = 5000;
      ASSERT_NO_FATAL_FAILURE(compare());
      refine.camera = cameras.about(cube);
      ASSERT_NO_FATAL_FAILURE(compare());
    }
  }
}

// Colors and anisotropies beyond their valid range, and velocities of both signs. colored: with colors.
std::vector<std::pair<volume::Channel, std::vector<float>>> scattering_fields(bool colored, int step) {
  using volume::Channel;
  std::vector<std::pair<Channel, std::vector<float>>> fields;
  for (std::size_t i = 0; i < volume::channel_count; ++i) {
    const auto channel = static_cast<Channel>(i);
    const bool color = channel == Channel::red || channel == Channel::green || channel == Channel::blue;
    if (channel == Channel::temperature || channel == Channel::flame || (color && !colored)) continue;
    // At other positions than the density.
    auto values = simulated(static_cast<cumulet_channel>(i), odd, channel == Channel::density ? step : step + 1);
    for (std::size_t v = 0; v < values.size(); ++v) {
      if (color) values[v] *= v % 7 == 0 ? -1.0F : 2.5F;
      if (channel == Channel::anisotropy) values[v] *= 4.0F;
      if (channel == Channel::velocity_y) values[v] *= v % 5 == 0 ? 1e6F : 30.0F;
    }
    if (channel == Channel::green) values = as_halves(values);
    fields.emplace_back(channel, values);
  }
  return fields;
}

void expect_near(const volume::ScalarVolume& found, const volume::ScalarVolume& expected) {
  ASSERT_NO_FATAL_FAILURE(expect_same_bricks(found, expected, 1e-6F));
  for (std::size_t i = 0; i < expected.brick_values.size(); ++i)
    ASSERT_NEAR(found.brick_values[i], expected.brick_values[i], 1e-6F * expected.max_value) << i;
}

glm::ivec3 color_of(std::uint32_t packed) { return {packed & 0x7ffU, (packed >> 11U) & 0x7ffU, packed >> 22U}; }
glm::vec3 velocity_of(const glm::uvec2& packed) {
  return {glm::unpackHalf2x16(packed.x), glm::unpackHalf2x16(packed.y).x};
}

void expect_same_channels(const Cells& found, const grid::TetGrid& expected, float fastest) {
  ASSERT_EQ(found.color.size(), expected.channels.color.size());
  ASSERT_EQ(found.anisotropy.size(), expected.channels.anisotropy.size());
  ASSERT_EQ(found.velocity.size(), expected.channels.velocity.size());
  for (std::size_t i = 0; i < expected.channels.color.size(); ++i) {
    const glm::ivec3 apart = glm::abs(color_of(found.color[i]) - color_of(expected.channels.color[i]));
    ASSERT_LE(std::max({apart.x, apart.y, apart.z}), 1) << i;
  }
  for (std::size_t i = 0; i < expected.channels.anisotropy.size(); ++i) {
    // For very low scattering the tolerance is larger, because sums over bricks are floats.
    float scatters = glm::unpackHalf2x16(expected.cells[i].data.z).x;
    if (!expected.channels.color.empty())
      scatters *= static_cast<float>(color_of(expected.channels.color[i]).y) / 2047.0F;
    ASSERT_NEAR(found.anisotropy[i], expected.channels.anisotropy[i], scatters > 0.01F ? 4 : 1000) << i;
  }
  for (std::size_t i = 0; i < expected.channels.velocity.size(); ++i) {
    const glm::vec3 apart = glm::abs(velocity_of(found.velocity[i]) - velocity_of(expected.channels.velocity[i]));
    ASSERT_LE(std::max({apart.x, apart.y, apart.z}), 1e-3F * fastest) << i;
  }
}

TEST_P(GpuResidentStates, ScatteringChannelsMatchTheVoxels) {
  for (const bool colored : {true, false}) {
    SCOPED_TRACE(colored);
    const auto fields = scattering_fields(colored, 1);
    std::vector<Values> handed;
    for (const auto& [channel, values] : fields) handed.push_back({channel, values, channel == volume::Channel::green});
    // With flames in addition.
    handed.push_back({volume::Channel::flame, simulated(CUMULET_CHANNEL_FLAME, odd, 3)});
    const scene::Emission burning = emissions()[2];
    const scene::StateInGl state = bring(handed, odd, transform(), {burning});
    EXPECT_EQ(state.products.size(), colored ? 4U : 3U);
    const volume::VolumeFrame in_memory = frame_of(fields, odd);
    const volume::VolumeFrame in_gl = state.frame();
    EXPECT_EQ(in_gl.color.has_value(), colored);
    ASSERT_TRUE(in_gl.anisotropy && in_gl.velocity);
    EXPECT_GE(scene::fastest_of(in_gl), scene::fastest_of(in_memory));
    const auto scattering = state.scattering();
    const auto forward = state.forward();
    const auto momentum = state.momentum();
    ASSERT_TRUE(scattering.has_value() == colored && forward && momentum);
    EXPECT_GE(momentum->fastest, scene::fastest_of(in_memory));
    grid::RgbField::Components read_scattering;
    if (colored) {
      const auto expected = scene::scattering_of(in_memory);
      for (std::size_t c = 0; c < 3; ++c) {
        read_scattering[c] = copied((*scattering)[c]);
        ASSERT_NO_FATAL_FAILURE(expect_near(read_scattering[c], (*expected)[c]));
      }
    }
    const volume::ScalarVolume read_forward = copied(*forward);
    ASSERT_NO_FATAL_FAILURE(expect_near(read_forward, *scene::forward_of(in_memory)));
    const auto expected = scene::momentum_of(in_memory, {}, nullptr, {}, momentum->fastest);
    grid::MomentumField::Values read_momentum{{}, momentum->fastest};
    for (std::size_t c = 0; c < 3; ++c) {
      read_momentum.components[c] = copied(momentum->components[c]);
      ASSERT_NO_FATAL_FAILURE(expect_near(read_momentum.components[c], expected->components[c]));
    }

    const auto light = state.emission(burning);
    ASSERT_TRUE(light);
    grid::RgbField::Components read_light;
    for (std::size_t c = 0; c < 3; ++c) read_light[c] = copied((*light)[c]);

    const grid::Cube cube = grid::fit_cube(in_gl.density, glm::min(in_gl.density.bounds_min, in_gl.flame->bounds_min),
                                           glm::max(in_gl.density.bounds_max, in_gl.flame->bounds_max));
    grid::Channels known_channels;
    grid::Channels channels;
    known_channels.emission = std::make_shared<const grid::RgbField>(*light, cube);
    channels.emission = std::make_shared<const grid::RgbField>(read_light, cube);
    if (colored) {
      known_channels.scattering = std::make_shared<const grid::RgbField>(*scattering, cube);
      channels.scattering = std::make_shared<const grid::RgbField>(read_scattering, cube);
    }
    known_channels.forward = std::make_shared<const grid::ScalarField>(*forward, cube);
    channels.forward = std::make_shared<const grid::ScalarField>(read_forward, cube);
    known_channels.momentum = std::make_shared<const grid::MomentumField>(*momentum, cube);
    channels.momentum = std::make_shared<const grid::MomentumField>(read_momentum, cube);
    const GridReference known(in_gl.density, cube, known_channels);
    const GridReference reference(in_memory.density, cube, channels);
    for (const auto cells : {grid::CellKind::linear, grid::CellKind::constant}) {
      grid::RefineSettings refine;
      refine.cells = cells;
      refine.criterion = grid::Criterion::deviation;  // which uses only data that is equal bit by bit
      for (const double threshold : {0.03, 0.2}) {
        refine.threshold = threshold;
        const Cells made = build(known, refine);
        const grid::TetGrid same = reference.grid(refine);
        ASSERT_NO_FATAL_FAILURE(expect_same_cells(made, same));
        ASSERT_NO_FATAL_FAILURE(expect_same_light(made, same));
        ASSERT_NO_FATAL_FAILURE(expect_same_channels(made, same, momentum->fastest));
      }
    }
  }
}

// Smoke with color 0 is black. Without smoke there are no channels at all.
TEST_P(GpuResidentStates, ZeroColorIsBlackAndEmptyStatesHaveNoChannels) {
  using volume::Channel;
  auto density = simulated(CUMULET_CHANNEL_DENSITY, odd, 1);
  const std::vector<float> nothing(density.size(), 0.0F);
  std::vector<Values> fields{{Channel::density, density}};
  for (const Channel channel : {Channel::red, Channel::green, Channel::blue, Channel::velocity_x, Channel::velocity_y,
                                Channel::velocity_z, Channel::anisotropy})
    fields.push_back({channel, nothing});
  const scene::StateInGl black = bring(fields, odd, transform(), {});
  ASSERT_TRUE(black.scattering() && black.forward());
  EXPECT_TRUE((*black.scattering())[1].empty());
  EXPECT_TRUE(black.forward()->empty());
  EXPECT_FALSE(black.momentum()) << "nothing moves";
  EXPECT_TRUE(black.has_wanted({}));
  fields[0].values = nothing;
  const scene::StateInGl none = bring(fields, odd, transform(), {});
  EXPECT_TRUE(none.products.empty());
  EXPECT_TRUE(none.has_wanted({}));
}

// Partial updates, some of which empty bricks, give the same channels as a whole state.
TEST_P(GpuResidentStates, PartialUpdatesEqualAFullState) {
  const std::vector<scene::Emission> wanted = emissions();
  const auto fields_at = [&](int step) {
    std::vector<Values> fields;
    for (const auto& [channel, values] : scattering_fields(true, step)) fields.push_back({channel, values});
    for (const volume::Channel channel : {volume::Channel::temperature, volume::Channel::flame})
      fields.push_back({channel, simulated(static_cast<cumulet_channel>(channel), odd, step)});
    return fields;
  };
  std::vector<Values> fields = fields_at(1);
  std::optional<scene::StateInGl> state = bring(fields, odd, transform(), {wanted[0], wanted[1]});
  for (int step = 2; step < 5; ++step) {
    const std::vector<Values> next = fields_at(step);
    const render::VoxelBox box{{8 * step, 0, 0}, {8 * step + 15, odd[1], odd[2]}};
    for (std::size_t f = 0; f < fields.size(); ++f) {
      for (int z = 0; z < odd[2]; ++z) {
        for (int y = 0; y < odd[1]; ++y) {
          for (int x = box.min.x; x <= std::min(box.max.x, odd[0] - 1); ++x) {
            const std::size_t at = test::State::at({x, y, z}, odd);
            fields[f].values[at] = step == 3 ? 0.0F : next[f].values[at];
          }
        }
      }
    }
    // Other emission settings are requested from the second state on.
    state = bring(fields, odd, transform(), {wanted[0], wanted[2]}, std::vector{box}, &*state);
    const scene::StateInGl whole = bring(fields, odd, transform(), {wanted[0], wanted[2]});
    ASSERT_EQ(state->products.size(), 5U);
    ASSERT_EQ(whole.products.size(), 5U);
    for (const scene::ProductInGl& expected : whole.products) {
      SCOPED_TRACE(expected.what.index());
      const scene::ProductInGl* found = state->product(expected.what);
      ASSERT_NE(found, nullptr);
      ASSERT_EQ(found->components.size(), expected.components.size());
      for (std::size_t c = 0; c < expected.components.size(); ++c) {
        const volume::ScalarVolume a = copied(volume::volume_on_device(found->components[c], "", transform()));
        const volume::ScalarVolume b = copied(volume::volume_on_device(expected.components[c], "", transform()));
        EXPECT_EQ(a.brick_origins, b.brick_origins);
        ASSERT_EQ(a.brick_values.size(), b.brick_values.size());
        for (std::size_t i = 0; i < b.brick_values.size(); ++i) ASSERT_EQ(a.brick_values[i], b.brick_values[i]);
      }
    }
  }
}

}  // namespace
