// Dynamic volumes from a host's textures and buffers: bit-identical to the same values from main memory.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstring>
#include <glm/gtc/packing.hpp>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "support/c_playback.hpp"
#include "support/fake_gl.hpp"
#include "support/live_gl_states.hpp"
#include "support/live_volumes.hpp"
#include "support/simulated.hpp"

namespace {

using namespace cumulet;
using test::alone;
using test::Array;
using test::at;
using test::dense;
using test::difference;
using test::expect_same_fields;
using test::in_buffer;
using test::in_texture;
using test::LiveRef;
using test::LiveStatesFromGl;
using test::make_desc;
using test::make_live;
using test::newest;
using test::odd;
using test::Sides;
using test::simulated;
using test::small;
using test::State;
using test::state_of;
using test::ViewerPtr;
using test::VolumeRef;
using test::voxel_types;
using test::VoxelType;

TEST_F(LiveStatesFromGl, EveryFormatMatchesUploadFromMemory) {
  int step = 0;
  for (const VoxelType& type : voxel_types) {
    for (const Sides& size : {odd, small}) {
      SCOPED_TRACE(type.format);
      const Array array(type.format, simulated(CUMULET_CHANNEL_DENSITY, size, ++step));
      const VolumeRef expected = alone(dense(size, array.values));
      hand_over({in_texture(CUMULET_CHANNEL_DENSITY, size, objects_.texture(size, type, array))});
      EXPECT_EQ(arrive(), 1U);
      expect_same_fields(newest(live_), expected);
      hand_over({in_buffer(CUMULET_CHANNEL_DENSITY, size, objects_.buffer(array.bytes), type.format)});
      EXPECT_EQ(arrive(), 1U);
      expect_same_fields(newest(live_), expected);
      if (size == odd && type.format == CUMULET_VOXEL_FORMAT_R16F) {
        EXPECT_EQ(difference(picture(), test::picture_of(make().get(), expected.get(), target_)), "");
      }
    }
  }
  // A format without a CPU reference is compared with GL's own read-back.
  const auto values = simulated(CUMULET_CHANNEL_DENSITY, odd, 3);
  const GLuint signs = objects_.texture(odd, GL_R16_SNORM, GL_RED, GL_FLOAT, values.data());
  std::vector<float> read(values.size());
  gl_.GetTextureImage(signs, 0, GL_RED, GL_FLOAT, static_cast<GLsizei>(4 * read.size()), read.data());
  hand_over({in_texture(CUMULET_CHANNEL_DENSITY, odd, signs)});
  EXPECT_EQ(arrive(), 1U);
  expect_same_fields(newest(live_), alone(dense(odd, read)));
}

// Values that are far from 1 are scaled in main memory, even if the volume is resident in GL.
TEST_F(LiveStatesFromGl, ValuesFarFromOneArrive) {
  for (const bool resident : {false, true}) {
    auto settings = make_desc<cumulet_dynamic_volume_desc>();
    settings.gpu_resident = resident ? 1 : 0;
    const LiveRef live = make_live(settings);
    ASSERT_EQ(cumulet_set_dynamic_volume(v_, live.get()), CUMULET_OK);
    for (const float scale : {1e-30F, 1e25F, 1.0F}) {
      SCOPED_TRACE(std::to_string(scale) + (resident ? " resident" : ""));
      auto values = simulated(CUMULET_CHANNEL_DENSITY, odd, 1);
      for (float& value : values) value *= scale;
      const Array array(CUMULET_VOXEL_FORMAT_R32F, values);
      const auto fields =
          std::vector{in_texture(CUMULET_CHANNEL_DENSITY, odd, objects_.texture(odd, voxel_types[0], array))};
      const cumulet_gl_volume_desc desc = state_of(fields);
      ASSERT_EQ(cumulet_dynamic_volume_set_gl(v_, live.get(), &desc), CUMULET_OK) << cumulet_last_error(v_);
      if (resident) {
        // The state arrives once in GL, and again when its voxels are in main memory.
        EXPECT_GE(arrive(), 1U);
        wait_for_voxels(live);
      } else {
        EXPECT_EQ(arrive(), 1U);
      }
      expect_same_fields(newest(live), alone(dense(odd, array.values)));
    }
  }
}

// All finite halves, including negative ones, denormals and zeros of both signs; and floats that flushing denormals
// would change.
TEST_F(LiveStatesFromGl, ValuesKeepTheirBits) {
  constexpr Sides size = {64, 32, 31};
  std::vector<float> halves;
  std::vector<std::uint16_t> bits;
  for (std::uint32_t h = 0; h < 65536 && halves.size() < std::size_t{64} * 32 * 31; ++h) {
    const bool finite = (h & 0x7c00U) != 0x7c00U;
    bits.push_back(static_cast<std::uint16_t>(finite ? h : 0x3c00U));
    halves.push_back(glm::unpackHalf1x16(bits.back()));
  }
  std::vector<float> floats;
  for (std::size_t i = 0; i < halves.size(); ++i) {
    const auto word = static_cast<std::uint32_t>(i * 2654435761U);
    float value = 0.0F;
    std::memcpy(&value, &word, sizeof value);
    // Velocities may be negative.
    floats.push_back(i % 5 != 0 ? std::numeric_limits<float>::denorm_min() * static_cast<float>(i % 7)
                                : (std::abs(value) < 1e15F ? value : 1.0F));
  }
  const auto ones = std::vector<float>(halves.size(), 1.0F);
  State state = dense(size, ones);
  state.dense(CUMULET_CHANNEL_VELOCITY_X, size, halves);
  state.dense(CUMULET_CHANNEL_VELOCITY_Y, size, floats);
  state.dense(CUMULET_CHANNEL_VELOCITY_Z, size, halves);
  const VolumeRef expected = alone(state);
  std::vector<std::byte> raw(bits.size() * 2);
  std::memcpy(raw.data(), bits.data(), raw.size());
  std::vector<std::byte> raw_floats(floats.size() * 4);
  std::memcpy(raw_floats.data(), floats.data(), raw_floats.size());
  const Array one(CUMULET_VOXEL_FORMAT_R8, ones);
  hand_over({in_texture(CUMULET_CHANNEL_DENSITY, size, objects_.texture(size, voxel_types[3], one)),
             in_texture(CUMULET_CHANNEL_VELOCITY_X, size,
                        objects_.texture(size, GL_R16F, GL_RED, GL_HALF_FLOAT, bits.data())),
             in_buffer(CUMULET_CHANNEL_VELOCITY_Y, size, objects_.buffer(raw_floats), CUMULET_VOXEL_FORMAT_R32F),
             in_buffer(CUMULET_CHANNEL_VELOCITY_Z, size, objects_.buffer(raw), CUMULET_VOXEL_FORMAT_R16F)});
  EXPECT_EQ(arrive(), 1U);
  expect_same_fields(newest(live_), expected);
}

// All channels; the three colors and the three velocities each share one texture.
TEST_F(LiveStatesFromGl, TextureComponentsAreSeparateChannels) {
  State state = dense(odd, simulated(CUMULET_CHANNEL_DENSITY, odd, 1));
  const Array density(CUMULET_VOXEL_FORMAT_R32F, simulated(CUMULET_CHANNEL_DENSITY, odd, 1));
  std::vector<cumulet_gl_field> fields{
      in_texture(CUMULET_CHANNEL_DENSITY, odd, objects_.texture(odd, voxel_types[0], density))};
  for (const cumulet_channel first : {CUMULET_CHANNEL_RED, CUMULET_CHANNEL_VELOCITY_X}) {
    std::vector<float> texels(4 * density.values.size(), 0.25F);
    for (int c = 0; c < 3; ++c) {
      const auto channel = static_cast<cumulet_channel>(first + c);
      auto values = simulated(channel, odd, 1);
      for (std::size_t i = 0; i < values.size(); ++i) texels[4 * i + static_cast<std::size_t>(c)] = values[i];
      state.dense(channel, odd, std::move(values));
    }
    const GLuint name = objects_.texture(odd, GL_RGBA32F, GL_RGBA, GL_FLOAT, texels.data());
    for (std::uint32_t c = 0; c < 3; ++c)
      fields.push_back(in_texture(static_cast<cumulet_channel>(first + int(c)), odd, name, c));
  }
  hand_over(fields);
  EXPECT_EQ(arrive(), 1U);
  expect_same_fields(newest(live_), alone(state));
}

// z fastest, with gaps and an offset, and voxels of three numbers each.
TEST_F(LiveStatesFromGl, BufferStridesAreSupported) {
  for (const VoxelType& type : voxel_types) {
    SCOPED_TRACE(type.format);
    const Array array(type.format, simulated(CUMULET_CHANNEL_DENSITY, odd, 2));
    const std::size_t number = array.bytes.size() / array.values.size();
    const std::array<std::uint64_t, 3> strides{number * 3 * 19 * 31, number * 3 * 19, number * 3};
    constexpr std::uint64_t offset = 268;
    std::vector<std::byte> bytes(offset + strides[0] * 23 + 8, std::byte{0x3c});
    for (std::uint64_t i = 0; i < array.values.size(); ++i) {
      const std::uint64_t to = offset + strides[0] * (i % 23) + strides[1] * (i / 23 % 31) + strides[2] * (i / 23 / 31);
      std::memcpy(&bytes[to], &array.bytes[i * number], number);
    }
    cumulet_gl_field field = in_buffer(CUMULET_CHANNEL_DENSITY, odd, objects_.buffer(bytes), type.format);
    field.offset = offset;
    std::copy(strides.begin(), strides.end(), field.strides);
    hand_over({field});
    EXPECT_EQ(arrive(), 1U);
    expect_same_fields(newest(live_), alone(dense(odd, array.values)));
  }
}

// Partial updates by boxes, with and without a read between them, on states from GL and from memory. Some boxes are too
// large, overlap or are outside.
TEST_F(LiveStatesFromGl, PartialUpdatesEqualAFullState) {
  for (const bool from_memory : {false, true}) {
    for (const bool read : {false, true}) {
      const VoxelType& type = voxel_types[read ? 1 : 0];
      Array before(type.format, simulated(CUMULET_CHANNEL_DENSITY, odd, 0));
      std::uint64_t on_their_way = 0;
      const GLuint name = objects_.texture(odd, type, before);
      const std::vector<cumulet_gl_field> fields{in_texture(CUMULET_CHANNEL_DENSITY, odd, name)};
      if (from_memory) {
        const State whole = dense(odd, before.values);
        const cumulet_volume_fields_desc desc = whole.desc();
        ASSERT_EQ(cumulet_dynamic_volume_set(live_.get(), &desc, nullptr, 0), CUMULET_OK);
      } else {
        hand_over(fields);  // boxes follow while the state is in transfer
        ++on_their_way;
      }
      for (int step = 1; step < 5; ++step) {
        if (read) {
          if (on_their_way > 0) {
            EXPECT_EQ(arrive(std::exchange(on_their_way, 0)), 1U);
          }
          newest(live_);
        }
        const Array now(type.format, simulated(CUMULET_CHANNEL_DENSITY, odd, step));
        objects_.put(name, odd, GL_RED, type.type, now.bytes.data());
        std::vector<cumulet_voxel_box> boxes{{{-9, 40, 0}, {-2, 99, 16}}, {{5, 5, 5}, {4, 9, 9}}};
        for (const Sides& b : State::bricks(odd, now.values, before.values)) {
          boxes.push_back({{b[0], b[1], b[2]}, {b[0] + 7, b[1] + 7, b[2] + 7}});
          // A box of one voxel updates its whole brick.
          if (b[0] % 16 == 0) boxes.back() = {{b[0] + 3, b[1], b[2]}, {b[0] + 3, b[1], b[2]}};
          if (b[1] % 16 == 0) boxes.push_back({{b[0] - 100, b[1] + 1, b[2]}, {b[0], b[1] + 1, b[2] + 1}});
        }
        hand_over(fields, boxes);
        ++on_their_way;
        before = now;
      }
      EXPECT_EQ(arrive(on_their_way), on_their_way);
      expect_same_fields(newest(live_), alone(dense(odd, before.values)));
      // An update without any voxel is a state too.
      const std::uint64_t number = handed();
      hand_over(fields, {{{99, 99, 99}, {120, 120, 120}}});
      EXPECT_EQ(arrive(), 1U);
      EXPECT_EQ(handed(), number + 1);
      expect_same_fields(newest(live_), alone(dense(odd, before.values)));
    }
  }
}

// Updates a state from GL with bricks from main memory.
TEST_F(LiveStatesFromGl, BricksMayComeFromMemory) {
  const Array before(CUMULET_VOXEL_FORMAT_R32F, simulated(CUMULET_CHANNEL_DENSITY, odd, 0));
  const auto now = simulated(CUMULET_CHANNEL_DENSITY, odd, 1);
  hand_over({in_texture(CUMULET_CHANNEL_DENSITY, odd, objects_.texture(odd, voxel_types[0], before))});
  arrive();
  State changes;
  changes.sparse(CUMULET_CHANNEL_DENSITY, odd, now, State::bricks(odd, now, before.values));
  changes.last_sparse().brick_active = nullptr;
  const cumulet_volume_fields_desc desc = changes.desc();
  ASSERT_EQ(cumulet_dynamic_volume_update(live_.get(), &desc, nullptr, 0), CUMULET_OK);
  expect_same_fields(newest(live_), alone(dense(odd, now)));
}

// The host may change or delete its texture after the call.
TEST_F(LiveStatesFromGl, SubmittedDataIsCopiedImmediately) {
  const Array array(CUMULET_VOXEL_FORMAT_R16F, simulated(CUMULET_CHANNEL_DENSITY, odd, 1));
  const Array other(CUMULET_VOXEL_FORMAT_R16F, simulated(CUMULET_CHANNEL_DENSITY, odd, 2));
  GLuint name = 0;
  gl_.CreateTextures(GL_TEXTURE_3D, 1, &name);
  gl_.TextureStorage3D(name, 1, GL_R16F, odd[0], odd[1], odd[2]);
  objects_.put(name, odd, GL_RED, GL_HALF_FLOAT, array.bytes.data());
  hand_over({in_texture(CUMULET_CHANNEL_DENSITY, odd, name)});
  objects_.put(name, odd, GL_RED, GL_HALF_FLOAT, other.bytes.data());
  gl_.DeleteTextures(1, &name);
  EXPECT_EQ(arrive(), 1U);
  expect_same_fields(newest(live_), alone(dense(odd, array.values)));
}

// If states are submitted faster than they arrive, the oldest one in transfer and the newest one arrive.
TEST_F(LiveStatesFromGl, NewestStateIsShownAndNoneStarves) {
  std::vector<Array> arrays;
  std::vector<GLuint> names;
  for (int step = 0; step < 6; ++step) {
    arrays.emplace_back(CUMULET_VOXEL_FORMAT_R32F,
                        simulated(CUMULET_CHANNEL_DENSITY, step % 2 == 0 ? odd : small, step));
    names.push_back(objects_.texture(step % 2 == 0 ? odd : small, voxel_types[0], arrays.back()));
  }
  const LiveRef other = make_live();  // this dynamic volume's state must not be lost
  const auto fields = std::vector{in_texture(CUMULET_CHANNEL_DENSITY, odd, names[2])};
  const cumulet_gl_volume_desc desc = state_of(fields);
  ASSERT_EQ(cumulet_dynamic_volume_set_gl(v_, other.get(), &desc), CUMULET_OK);
  std::vector<std::uint64_t> bytes;
  for (int round = 0; round < 6; ++round) {
    for (std::size_t step = 0; step < 6; ++step)
      hand_over({in_texture(CUMULET_CHANNEL_DENSITY, step % 2 == 0 ? odd : small, names[step])});
    auto stats = make_desc<cumulet_stats>();
    ASSERT_EQ(cumulet_get_stats(v_, &stats), CUMULET_OK);
    bytes.push_back(stats.gl_bytes);
    EXPECT_EQ(arrive(2), 2U);
    expect_same_fields(newest(live_), alone(dense(small, arrays[5].values)));
    picture();  // makes the other GL memory equal in each round
  }
  expect_same_fields(newest(other), alone(dense(odd, arrays[2].values)));
  // Other GL memory differs by a few uploads. A leaked state per round would be more than this.
  EXPECT_LT(bytes[5], bytes[3] + 100'000) << "memory grows with states";
  // While states are submitted between all frames, images are still drawn.
  cumulet_frame_desc frame = target_.frame();
  auto info = make_desc<cumulet_dynamic_volume_info>();
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(30);
  for (int i = 0; info.displayed_count < 3 && std::chrono::steady_clock::now() < until; ++i) {
    hand_over({in_texture(CUMULET_CHANNEL_DENSITY, odd, names[2 * (std::size_t(i) % 3)])});
    ASSERT_EQ(cumulet_render(v_, &frame, nullptr), CUMULET_OK);
    ASSERT_EQ(cumulet_get_dynamic_volume_info(v_, &info), CUMULET_OK);
  }
  EXPECT_GE(info.displayed_count, 3U);
}

TEST_F(LiveStatesFromGl, CallsNeverBlockOnTheGpu) {
  const auto waits = [&] {
    std::uint64_t sum = 0;
    for (const char* name : {"Finish", "GetNamedBufferSubData", "GetBufferSubData", "ReadPixels", "GetTextureImage",
                             "GetTexImage", "GetTextureSubImage", "MapBuffer", "MapNamedBuffer"})
      sum += fake_.calls(name);
    return sum;
  };
  const std::uint64_t before = waits();
  const Array array(CUMULET_VOXEL_FORMAT_R16F, simulated(CUMULET_CHANNEL_DENSITY, odd, 0));
  const std::vector fields{in_texture(CUMULET_CHANNEL_DENSITY, odd, objects_.texture(odd, voxel_types[1], array))};
  for (int i = 0; i < 3; ++i) {
    hand_over(fields);
    arrive();
    hand_over(fields, {{{0, 0, 0}, {9, 9, 9}}});
    arrive();
  }
  EXPECT_EQ(waits(), before);
  EXPECT_EQ(fake_.uploaded() > 0, true);
}

// Only occupied bricks of a sparse plume are copied back.
TEST_F(LiveStatesFromGl, ReadsBackOnlyOccupiedBricks) {
  constexpr Sides wide = {96, 96, 96};
  std::vector<float> values(96 * 96 * 96);
  values[State::at({50, 40, 30}, wide)] = 1.0F;
  const Array array(CUMULET_VOXEL_FORMAT_R32F, values);
  const std::vector fields{in_texture(CUMULET_CHANNEL_DENSITY, wide, objects_.texture(wide, voxel_types[0], array))};
  auto stats = make_desc<cumulet_stats>();
  ASSERT_EQ(cumulet_get_stats(v_, &stats), CUMULET_OK);
  const std::uint64_t before = stats.gl_bytes;
  hand_over(fields);
  ASSERT_EQ(cumulet_get_stats(v_, &stats), CUMULET_OK);
  const std::uint64_t copy = stats.gl_bytes - before;
  EXPECT_GE(copy, std::uint64_t{4} * 96 * 96 * 96);
  EXPECT_LT(copy, std::uint64_t{4} * 96 * 96 * 96 + 32768);
  EXPECT_EQ(arrive(), 1U);
  expect_same_fields(newest(live_), alone(dense(wide, values)));
}

// GPU-built grids of states from GL.
TEST_F(LiveStatesFromGl, GpuBuiltGridsMatch) {
  viewer_ = make(CUMULET_BUILD_GPU);
  v_ = viewer_.get();
  ASSERT_EQ(cumulet_set_dynamic_volume(v_, live_.get()), CUMULET_OK);
  const Array array(CUMULET_VOXEL_FORMAT_R16F, simulated(CUMULET_CHANNEL_DENSITY, odd, 0));
  hand_over({in_texture(CUMULET_CHANNEL_DENSITY, odd, objects_.texture(odd, voxel_types[1], array))});
  EXPECT_EQ(arrive(), 1U);
  const ViewerPtr single = make(CUMULET_BUILD_GPU);
  EXPECT_EQ(difference(picture(), test::picture_of(single.get(), alone(dense(odd, array.values)).get(), target_)), "");
}

}  // namespace
