// GPU-resident volumes: their statistics, the channels derived on the GPU, and the grids built from them.

#include <gtest/gtest.h>

#include <chrono>
#include <cstring>
#include <functional>
#include <numeric>
#include <optional>

#include "base/error.hpp"
#include "gl/state_guard.hpp"
#include "grid/tet_grid.hpp"
#include "grid/transmittance.hpp"
#include "render/grid_build.hpp"
#include "render/voxel_transfers.hpp"
#include "support/gl_state.hpp"
#include "support/grid_reference.hpp"
#include "support/simulated.hpp"
#include "support/view_cameras.hpp"
#include "volume/bricks.hpp"
#include "volume/frame_import.hpp"
#include "volume/optical_depth.hpp"

namespace {

using namespace cumulet;
using render::Deadline;
using test::GridReference;
using test::Sides;
using test::simulated;

constexpr Sides odd = {52, 44, 37};

struct Cells {
  std::vector<grid::CellRecord> cells;
  bool limited = false;
  // Empty if there is no such channel.
  std::vector<grid::EmissionRecord> emission;
  std::vector<std::uint32_t> color;
  std::vector<std::int16_t> anisotropy;
  std::vector<glm::uvec2> velocity;
};

class GpuResidentStates : public test::GlTest {
 protected:
  void SetUp() override {
    GlTest::SetUp();
    if (IsSkipped()) return;
    gl::find_out_dispatches(gl_, *programs_);
    limits_ = gl::query_limits(*gl_);
    memories_ = std::make_shared<render::DeviceMemories>(gl_, programs_, limits_.storage_block_bytes);
    transfers_ = std::make_unique<render::VoxelTransfers>(gl_, programs_, limits_, memories_);
  }
  void TearDown() override {
    for (const GLuint name : buffers_) gl_->DeleteBuffers(1, &name);
    transfers_.reset();
    memories_.reset();
    GlTest::TearDown();
  }
  GLuint buffer(const std::vector<float>& values) {
    GLuint name = 0;
    gl_->CreateBuffers(1, &name);
    buffers_.push_back(name);
    gl_->NamedBufferData(name, static_cast<GLsizeiptr>(values.size() * 4), values.data(), GL_DYNAMIC_COPY);
    return name;
  }
  // Float values; if `halves`, passed as half floats.
  struct Values {
    volume::Channel channel;
    std::vector<float> values;
    bool halves = false;
  };
  // Transfers fields to the GPU and waits. before: the state that `changed` updates; null: a whole state. wanted:
  // emission settings for which radiance is computed.
  scene::StateInGl bring(const std::vector<Values>& fields, const Sides& size, const glm::dmat4& to_world,
                         const std::vector<scene::Emission>& wanted,
                         std::optional<std::vector<render::VoxelBox>> changed = {},
                         const scene::StateInGl* before = nullptr) {
    render::GlState state{"smoke", {}, std::move(changed), nullptr};
    for (const Values& field : fields) {
      std::vector<float> words = field.values;
      if (field.halves) {
        words.resize((field.values.size() + 1) / 2);
        for (std::size_t i = 0; i < field.values.size(); ++i) {
          const std::uint16_t half = glm::packHalf1x16(field.values[i]);
          std::memcpy(reinterpret_cast<char*>(words.data()) + 2 * i, &half, 2);
        }
      }
      const auto format = field.halves ? render::VoxelFormat::halves : render::VoxelFormat::floats;
      const render::VoxelBuffer source{.name = buffer(words), .format = format, .size = {size[0], size[1], size[2]}};
      state.fields.push_back({field.channel, source, to_world});
    }
    std::optional<scene::StateInGl> found;
    const gl::StateGuard guard(*gl_);
    render::VoxelTransfers::StayInGl stay;
    stay.join = [&](auto arrived) {
      if (before == nullptr)
        return scene::StateInGl{.name = "smoke", .fields = arrived, .index_to_world = to_world, .products = {}};
      scene::StateInGl joined = *before;
      for (std::size_t i = 0; i < joined.fields.size(); ++i)
        joined.fields[i].bricks =
            std::make_shared<const volume::DeviceBricks>(joined.fields[i].bricks->with(*arrived[i].bricks));
      return joined;
    };
    stay.wanted = [&] { return wanted; };
    stay.arrive = [&](scene::StateInGl arrived) {
      found = std::move(arrived);
      return true;
    };
    transfers_->begin(state, this, std::move(stay), [] {});
    // The GPU works asynchronously.
    const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (!found && std::chrono::steady_clock::now() < until) transfers_->follow(Deadline::max());
    return std::move(found).value();
  }
  volume::DeviceBricks bring(const std::vector<float>& values, const Sides& size, const glm::dmat4& to_world,
                             bool halves = false, std::optional<std::vector<render::VoxelBox>> changed = {}) {
    return *bring({{volume::Channel::density, values, halves}}, size, to_world, {}, std::move(changed))
                .fields[0]
                .bricks;
  }
  static GridReference field_of(volume::DeviceBricks bricks, const glm::dmat4& to_world) {
    bricks.tidy();
    return GridReference(
        volume::volume_on_device(std::make_shared<const volume::DeviceBricks>(std::move(bricks)), "smoke", to_world));
  }
  // A reference in main memory, in the same cube as in_gl.
  static GridReference in_memory(const std::vector<float>& values, const Sides& size, const glm::dmat4& to_world,
                                 const GridReference& in_gl) {
    const volume::MemoryField field{volume::Channel::density,
                                    volume::DenseVoxels{values, {size[0], size[1], size[2]}, to_world}};
    return GridReference(volume::import_fields(std::vector{field}, "smoke", {}).density, in_gl.statistics->cube());
  }
  // between: called after each step of the upload.
  Cells build(const GridReference& field, const grid::RefineSettings& settings,
              const std::function<void()>& between = {}) {
    const gl::StateGuard guard(*gl_);
    const grid::LatticePtr lattice = field.lattice(settings);
    render::LatticeUpload upload(gl_, programs_, limits_, lattice, field.statistics, field.channels, memories_);
    while (!upload.advance(between ? Deadline::min() : Deadline::max())) {
      if (between) between();
    }
    render::GridBuild work(gl_, programs_, limits_, upload.take(),
                           lattice->own.levels(grid::ViewLevels(lattice->cube, settings)), settings.max_cells);
    while (!work.advance(Deadline::max())) {
    }
    const render::BuiltGrid built = work.take();
    Cells read;
    read.limited = built.limited;
    const auto get = [&](const gl::Object& from, auto& to) {
      if (!from) return;
      to.resize(built.count);
      gl_->GetNamedBufferSubData(from.name(), 0, static_cast<GLsizeiptr>(to.size() * sizeof to[0]), to.data());
    };
    const auto channel = [&](grid::Channel c) -> const gl::Object& {
      return built.channels[static_cast<std::size_t>(c)];
    };
    get(built.cells, read.cells);
    get(channel(grid::Channel::emission), read.emission);
    get(channel(grid::Channel::color), read.color);
    get(channel(grid::Channel::anisotropy), read.anisotropy);
    get(channel(grid::Channel::velocity), read.velocity);
    return read;
  }
  // Reads the volume back to main memory.
  volume::ScalarVolume copied(const volume::ScalarVolume& in_gl) {
    const volume::DeviceBricks& bricks = *in_gl.on_device;
    std::vector<float> values;
    for (const volume::DeviceBricks::Location& location : bricks.locations) {
      const std::size_t first = values.size();
      values.resize(first + volume::brick_voxels);
      const volume::DeviceMemory& memory = *bricks.memories[location.memory];
      EXPECT_FALSE(memory.halves);
      gl_->GetNamedBufferSubData(memories_->find(memory)->name(), GLintptr{location.brick} * 2048, 2048,
                                 &values[first]);
    }
    volume::ScalarVolume volume = in_gl;
    volume.on_device = nullptr;
    volume.brick_values = std::move(values);
    return volume;
  }

  gl::Limits limits_;
  render::DeviceMemoriesPtr memories_;
  std::unique_ptr<render::VoxelTransfers> transfers_;
  std::vector<GLuint> buffers_;
};
CUMULET_ON_BACKENDS(GpuResidentStates);

std::vector<float> as_halves(std::vector<float> values) {
  for (float& value : values) value = glm::unpackHalf1x16(glm::packHalf1x16(value));
  return values;
}

// Anisotropic and rotated.
glm::dmat4 transform() {
  glm::dmat4 m(1.0);
  m[0] = {0.5, 0.1, 0.0, 0.0};
  m[1] = {-0.1, 0.4, 0.05, 0.0};
  m[2] = {0.0, 0.02, 0.7, 0.0};
  m[3] = {3.0, -2.0, 1.0, 1.0};
  return m;
}

// scale: magnitude of the summands.
void expect_near(double a, double b, double scale) { EXPECT_NEAR(a, b, 1e-6 * scale); }

// Statistics computed on the GPU equal those computed in main memory.
TEST_P(GpuResidentStates, StatisticsMatchTheVoxels) {
  for (const bool halves : {false, true}) {
    auto values = simulated(CUMULET_CHANNEL_DENSITY, odd, 1);
    if (halves) values = as_halves(values);
    const GridReference known = field_of(bring(values, odd, transform(), halves), transform());
    const GridReference reference = in_memory(values, odd, transform(), known);
    EXPECT_EQ(known.volume->brick_origins, reference.volume->brick_origins);
    EXPECT_EQ(known.volume->active_voxels, reference.volume->active_voxels);
    EXPECT_EQ(known.volume->bounds_min, reference.volume->bounds_min);
    EXPECT_EQ(known.volume->bounds_max, reference.volume->bounds_max);
    EXPECT_EQ(known.volume->max_value, reference.volume->max_value);
    EXPECT_EQ(known.statistics->values_are_halves(), halves);
    const double depth = reference.statistics->mean_optical_depth();
    EXPECT_NEAR(known.statistics->mean_optical_depth(), depth, 1e-6 * depth);
    ASSERT_EQ(known.statistics->cube().log2_size, reference.statistics->cube().log2_size);
    ASSERT_EQ(known.statistics->nodes().size(), reference.statistics->nodes().size());
    for (std::size_t i = 0; i < known.statistics->nodes().size(); ++i) {
      const auto& a = known.statistics->nodes()[i];
      const auto& b = reference.statistics->nodes()[i];
      ASSERT_EQ(a.corner, b.corner);
      ASSERT_EQ(a.is_uniform(), b.is_uniform());
      if (a.is_uniform()) continue;
      for (std::uint32_t permutation = 0; permutation < 6; ++permutation) {
        const grid::Moments& x = known.statistics->kuhn(a, permutation);
        const grid::Moments& y = reference.statistics->kuhn(b, permutation);
        EXPECT_EQ(x.min, y.min);
        EXPECT_EQ(x.max, y.max);
        const double whole = y.volume * y.max;
        expect_near(x.mass, y.mass, whole);
        expect_near(x.square, y.square, whole);
        for (int axis = 0; axis < 3; ++axis) expect_near(x.first[axis], y.first[axis], whole);
      }
    }
    const grid::Transmittance ours(*known.statistics, 0.7);
    const grid::Transmittance theirs(*reference.statistics, 0.7);
    for (const std::uint32_t n : known.statistics->nodes_of_size(3)) {
      const glm::ivec3 corner = known.statistics->nodes()[n].corner;
      for (int i = 0; i < grid::Transmittance::blocks_per_brick; ++i)
        ASSERT_NEAR(ours.blocks(corner)[i], theirs.blocks(corner)[i], 1e-6);
    }
    const auto scale = volume::CoarseVolume(*known.volume).suggest_density_scale();
    const auto expected = volume::CoarseVolume(*reference.volume).suggest_density_scale();
    ASSERT_TRUE(scale && expected);
    EXPECT_NEAR(*scale, *expected, 0.05 * *expected);
  }
}

void expect_same_cells(const Cells& found, const grid::TetGrid& expected) {
  EXPECT_EQ(found.limited, expected.limited);
  ASSERT_EQ(found.cells.size(), expected.cells.size());
  std::size_t others = 0;
  for (std::size_t i = 0; i < found.cells.size(); ++i) {
    if (found.cells[i].links != expected.cells[i].links || found.cells[i].data.x != expected.cells[i].data.x ||
        found.cells[i].data.y != expected.cells[i].data.y)
      ++others;
    ASSERT_NEAR(glm::unpackHalf2x16(found.cells[i].data.z).x, glm::unpackHalf2x16(expected.cells[i].data.z).x, 1e-3);
  }
  EXPECT_EQ(others, 0U);
}

TEST_P(GpuResidentStates, GridsMatchTheVoxels) {
  test::Cameras cameras(3);
  std::size_t brick_cells = 0;
  for (const bool halves : {false, true}) {
    auto values = simulated(CUMULET_CHANNEL_DENSITY, odd, 2);
    if (halves) values = as_halves(values);
    const GridReference known = field_of(bring(values, odd, transform(), halves), transform());
    const GridReference reference = in_memory(values, odd, transform(), known);
    for (const auto criterion :
         {grid::Criterion::transmittance, grid::Criterion::deviation, grid::Criterion::range_mean}) {
      for (const auto cells : {grid::CellKind::linear, grid::CellKind::constant}) {
        SCOPED_TRACE(testing::Message() << halves << " " << static_cast<int>(criterion) << " "
                                        << static_cast<int>(cells));
        grid::RefineSettings settings;
        settings.criterion = criterion;
        settings.cells = cells;
        settings.density_scale = 3.0;
        settings.threshold = criterion == grid::Criterion::range_mean ? 0.8 : 0.02;
        expect_same_cells(build(known, settings), reference.grid(settings));
        settings.camera = cameras.about(reference.statistics->cube());
        expect_same_cells(build(known, settings), reference.grid(settings));
        settings.camera.reset();
        for (const std::uint64_t most : {1000U, 3000U, 7000U}) {
          settings.max_cells = most;
          const Cells limited = build(known, settings);
          EXPECT_TRUE(limited.limited);
          expect_same_cells(limited, reference.grid(settings));
        }
        brick_cells += known.lattice(settings)->own.to_rate.fields[0].nodes.size();
      }
    }
  }
  EXPECT_GT(brick_cells, 100U);
}

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

// Other states are transferred and freed during the upload.
TEST_P(GpuResidentStates, AnUploadTakesManyFrames) {
  const auto values = simulated(CUMULET_CHANNEL_DENSITY, odd, 1);
  const auto others = simulated(CUMULET_CHANNEL_DENSITY, odd, 2);
  std::optional<volume::DeviceBricks> before = bring(others, odd, transform());
  const GridReference known = field_of(bring(values, odd, transform()), transform());
  grid::RefineSettings settings;
  settings.threshold = 0.05;
  int steps = 0;
  const Cells found = build(known, settings, [&] {
    ++steps;
    before = bring(others, odd, transform());
  });
  EXPECT_GT(steps, 10);
  expect_same_cells(found, in_memory(values, odd, transform(), known).grid(settings));
  const std::uint64_t bytes = memories_->bytes();
  before.reset();
  transfers_->follow(Deadline::max());
  EXPECT_LT(memories_->bytes(), bytes);
}

// Bricks in several buffers are gathered into one. The grid is the same.
TEST_P(GpuResidentStates, ScatteredBricksAreCompacted) {
  const auto old = simulated(CUMULET_CHANNEL_DENSITY, odd, 1);
  auto values = as_halves(old);
  volume::DeviceBricks all = bring(values, odd, transform(), true);
  all.tidy();
  for (int step = 2; step < 6; ++step) {
    const auto next = simulated(CUMULET_CHANNEL_DENSITY, odd, step);
    const render::VoxelBox box{{8 * step, 0, 0}, {8 * step + 7, odd[1], odd[2]}};
    for (int z = 0; z < odd[2]; ++z) {
      for (int y = 0; y < odd[1]; ++y) {
        for (int x = box.min.x; x <= box.max.x; ++x)
          values[test::State::at({x, y, z}, odd)] = next[test::State::at({x, y, z}, odd)];
      }
    }
    all = all.with(bring(values, odd, transform(), false, std::vector{box}));
  }
  EXPECT_EQ(all.memories.size(), 5U);
  EXPECT_FALSE(all.are_halves());
  const gl::StateGuard guard(*gl_);
  volume::DeviceBricksPtr gathered;
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (gathered == nullptr && std::chrono::steady_clock::now() < until) gathered = memories_->gather(gl_, all);
  ASSERT_NE(gathered, nullptr);
  EXPECT_EQ(gathered->memories.size(), 1U);
  EXPECT_EQ(gathered->origins, all.origins);
  grid::RefineSettings settings;
  settings.threshold = 0.05;
  const GridReference known = field_of(*gathered, transform());
  const grid::TetGrid expected = in_memory(values, odd, transform(), known).grid(settings);
  expect_same_cells(build(known, settings), expected);
  expect_same_cells(build(field_of(all, transform()), settings), expected);
  render::DeviceMemories small(gl_, programs_, 1000);
  EXPECT_EQ(small.gather(gl_, all), nullptr) << "larger than a storage block";
}

}  // namespace
