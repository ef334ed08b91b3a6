// Transfers of voxels from GL objects, without a viewer.

#include <gtest/gtest.h>

#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "gl/state_guard.hpp"
#include "render/dynamic/voxel_transfers.hpp"
#include "support/fake_gl.hpp"
#include "support/gl_state.hpp"
#include "support/live_gl_states.hpp"
#include "support/live_volumes.hpp"
#include "support/scrambling_host.hpp"
#include "support/simulated.hpp"

namespace {

using namespace cumulet;
using test::alone;
using test::Array;
using test::dense;
using test::expect_same_fields;
using test::in_buffer;
using test::in_texture;
using test::LiveRef;
using test::make_live;
using test::newest;
using test::Objects;
using test::odd;
using test::Sides;
using test::simulated;
using test::state_of;
using test::ViewerPtr;
using test::voxel_types;

/// Tests that need no viewer.
class GpuTransfers : public test::GlTest {
 protected:
  void SetUp() override {
    GlTest::SetUp();
    if (IsSkipped()) return;
    gl::find_out_dispatches(gl_, *programs_);
  }
  std::vector<volume::FieldCopy> transfer(render::VoxelTransfers& transfers, const render::GlState& state) {
    std::optional<std::vector<volume::FieldCopy>> found;
    const gl::StateGuard guard(*gl_);
    transfers.begin(
        state, this, [&](std::vector<volume::FieldCopy> fields) { found = std::move(fields); }, [] {});
    for (int i = 0; !found && i < 100000; ++i) transfers.follow(render::Deadline::max());
    return std::move(found).value();
  }
};

// With small storage blocks, transfers run in layers: from textures and buffers, whole states and boxes.
TEST_P(GpuTransfers, WorkWithSmallStorageBlocks) {
  constexpr Sides size = {20, 17, 61};
  const auto values = simulated(CUMULET_CHANNEL_DENSITY, size, 1);
  const Array array(CUMULET_VOXEL_FORMAT_R16F, values);
  Objects objects(*gl_);
  gl::Limits limits = gl::query_limits(*gl_);
  const auto memories = std::make_shared<render::DeviceMemories>(gl_, programs_, limits.storage_block_bytes);
  const auto voxels_of = [&](bool texture) {
    render::GlVoxels voxels{volume::Channel::density, {}, glm::dmat4(1.0)};
    if (texture) {
      voxels.source = render::VoxelTexture{objects.texture(size, voxel_types[1], array), 0};
    } else {
      voxels.source = render::VoxelBuffer{.name = objects.buffer(array.bytes),
                                          .format = render::VoxelFormat::halves,
                                          .size = {size[0], size[1], size[2]}};
    }
    return voxels;
  };
  for (const bool texture : {true, false}) {
    for (const bool boxes : {true, false}) {
      render::GlState state{"smoke", {voxels_of(texture)}, std::nullopt, nullptr};
      if (boxes) state.changed = {{{0, 0, 0}, {19, 16, 60}}};
      limits.storage_block_bytes = std::int64_t{1} << 27U;
      render::VoxelTransfers at_once(gl_, programs_, limits, memories);
      // Three layers of 3x3 bricks: 27 kB.
      limits.storage_block_bytes = 28000;
      render::VoxelTransfers in_pieces(gl_, programs_, limits, memories);
      const volume::MemoryField whole{volume::Channel::density, volume::DenseVoxels{array.values, {20, 17, 61}}};
      const auto expected = volume::import_fields(std::vector{whole}, "smoke", {});
      for (render::VoxelTransfers* transfers : {&at_once, &in_pieces}) {
        const auto fields = transfer(*transfers, state);
        ASSERT_EQ(fields.size(), 1U);
        const auto found = volume::import_fields(std::vector{fields[0].view()}, "smoke", {});
        test::expect_same_voxels(found.density, expected.density);
        EXPECT_GT(transfers->bytes(), 0U);
      }
      // Too small for one layer.
      limits.storage_block_bytes = 4096;
      render::VoxelTransfers refusing(gl_, programs_, limits, memories);
      const gl::StateGuard guard(*gl_);
      EXPECT_THROW(refusing.begin(state, this, render::VoxelTransfers::Arrive(), nullptr), Error);
      EXPECT_FALSE(refusing.busy());
    }
  }
}

TEST_P(GpuTransfers, RestoreTheHostsGlState) {
  const Array array(CUMULET_VOXEL_FORMAT_R16F, simulated(CUMULET_CHANNEL_DENSITY, odd, 1));
  Objects objects(*gl_);
  const GLuint texture = objects.texture(odd, voxel_types[1], array);
  const GLuint buffer = objects.buffer(array.bytes);
  const ViewerPtr viewer = test::make_viewer({.get_proc = headless::Context::get_proc, .user = context_.get()});
  const LiveRef live = make_live();
  test::ScramblingHost host(gl_);
  const test::HostTarget target(*gl_, 16, 16);
  cumulet_frame_desc frame = target.frame();
  frame.target = CUMULET_TARGET_NONE;
  const cumulet_voxel_box box{{0, 0, 0}, {9, 9, 9}};
  const auto kept = [&](std::uint32_t seed, const std::function<cumulet_status()>& call) {
    host.scramble(seed);
    const auto before = test::read_gl_state(*gl_);
    EXPECT_EQ(call(), CUMULET_OK) << cumulet_last_error(viewer.get());
    EXPECT_EQ(gl_->GetError(), GLenum{GL_NO_ERROR});
    EXPECT_EQ(test::state_differences(before, test::read_gl_state(*gl_)), "") << seed;
  };
  for (std::uint32_t seed = 0; seed < 12; ++seed) {
    const std::vector fields{seed % 2 == 0
                                 ? in_texture(CUMULET_CHANNEL_DENSITY, odd, texture)
                                 : in_buffer(CUMULET_CHANNEL_DENSITY, odd, buffer, CUMULET_VOXEL_FORMAT_R16F)};
    cumulet_gl_volume_desc desc = state_of(fields);
    if (seed % 4 > 1) {
      desc.changed = &box;
      desc.changed_count = 1;
    }
    kept(2 * seed, [&] { return cumulet_dynamic_volume_set_gl(viewer.get(), live.get(), &desc); });
    kept(2 * seed + 1, [&] { return cumulet_render(viewer.get(), &frame, nullptr); });
  }
  expect_same_fields(newest(live), alone(dense(odd, array.values)));
}

CUMULET_ON_BACKENDS(GpuTransfers);

}  // namespace
