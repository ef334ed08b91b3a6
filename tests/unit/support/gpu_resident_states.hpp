#pragma once

// States of volumes in GPU memory, and their grids.

#include <gtest/gtest.h>

#include <chrono>
#include <cstring>
#include <functional>
#include <optional>

#include "gl/state_guard.hpp"
#include "grid/tet_grid.hpp"
#include "render/dynamic/voxel_transfers.hpp"
#include "render/grid/grid_build.hpp"
#include "support/gl_state.hpp"
#include "support/grid_reference.hpp"
#include "support/simulated.hpp"
#include "support/view_cameras.hpp"
#include "volume/bricks.hpp"
#include "volume/frame_import.hpp"

namespace cumulet::test {

inline constexpr Sides odd = {52, 44, 37};

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
    while (!found && std::chrono::steady_clock::now() < until) transfers_->follow(render::Deadline::max());
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
    while (!upload.advance(between ? render::Deadline::min() : render::Deadline::max())) {
      if (between) between();
    }
    render::GridBuild work(gl_, programs_, limits_, upload.take(),
                           lattice->own.levels(grid::ViewLevels(lattice->cube, settings)), settings.max_cells);
    while (!work.advance(render::Deadline::max())) {
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

inline std::vector<float> as_halves(std::vector<float> values) {
  for (float& value : values) value = glm::unpackHalf1x16(glm::packHalf1x16(value));
  return values;
}

// Anisotropic and rotated.
inline glm::dmat4 transform() {
  glm::dmat4 m(1.0);
  m[0] = {0.5, 0.1, 0.0, 0.0};
  m[1] = {-0.1, 0.4, 0.05, 0.0};
  m[2] = {0.0, 0.02, 0.7, 0.0};
  m[3] = {3.0, -2.0, 1.0, 1.0};
  return m;
}

// scale: magnitude of the summands.
inline void expect_near(double a, double b, double scale) { EXPECT_NEAR(a, b, 1e-6 * scale); }

inline void expect_same_cells(const Cells& found, const grid::TetGrid& expected) {
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

}  // namespace cumulet::test
