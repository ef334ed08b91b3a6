// Dynamic volumes from a host's textures and buffers: bit-identical to the same values from main memory.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstring>
#include <functional>
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
using Picture = std::vector<std::uint8_t>;

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

TEST_F(LiveStatesFromGl, InvalidInputGivesAOneLineError) {
  const Array array(CUMULET_VOXEL_FORMAT_R8, simulated(CUMULET_CHANNEL_DENSITY, odd, 0));
  const GLuint good = objects_.texture(odd, voxel_types[3], array);
  const GLuint bytes = objects_.buffer(array.bytes);
  const auto refused = [&](cumulet_gl_field field, const std::string& cause,
                           cumulet_status status = CUMULET_ERROR_INVALID_ARGUMENT) {
    const std::vector<cumulet_gl_field> fields{field};
    EXPECT_EQ(refusal(state_of(fields), status), cause);
  };
  const auto named = [](const char* kind, GLuint name) { return "smoke: density: " + (kind + std::to_string(name)); };
  const cumulet_gl_field texture = in_texture(CUMULET_CHANNEL_DENSITY, odd, good);
  const cumulet_gl_field buffer = in_buffer(CUMULET_CHANNEL_DENSITY, odd, bytes, CUMULET_VOXEL_FORMAT_R8);
  const auto changed = [](cumulet_gl_field field, const auto& change) {
    change(field);
    return field;
  };

  refused(changed(texture, [](auto& f) { f.texture = 0; }),
          "smoke: field 0: exactly one of texture and buffer must be set");
  refused(changed(texture, [](auto& f) { f.buffer = 7; }),
          "smoke: field 0: exactly one of texture and buffer must be set");
  refused(changed(texture, [](auto& f) { f.component = 4; }), "smoke: field 0: its component is not from 0 to 3");
  refused(changed(texture, [](auto& f) { f.component = 1; }), named("texture ", good) + ", has no component 1");
  refused(changed(texture, [](auto& f) { f.index_to_world[3] = 1.0; }), "smoke: density: its transform is not affine",
          CUMULET_ERROR_FILE);
  const int none_such = 77;
  refused(changed(texture, [&](auto& f) { std::memcpy(&f.channel, &none_such, sizeof none_such); }),
          "smoke: field 0: its channel is unknown");
  refused(changed(buffer, [&](auto& f) { std::memcpy(&f.format, &none_such, sizeof none_such); }),
          "smoke: field 0: its format is unknown");
  refused(changed(texture, [](auto& f) { f.channel = CUMULET_CHANNEL_RED; }),
          "smoke: has only some of red, green and blue");
  refused(changed(texture, [](auto& f) { f.texture = 4711; }),
          named("texture ", 4711) + ", is not a GL_TEXTURE_3D of this context's share group");

  const auto odd_texture = [&](GLenum target, const std::string& cause, const std::function<void(GLuint)>& fill) {
    GLuint name = 0;
    gl_.CreateTextures(target, 1, &name);
    fill(name);
    refused(in_texture(CUMULET_CHANNEL_DENSITY, odd, name), named("texture ", name) + ", " + cause);
    gl_.DeleteTextures(1, &name);
  };
  odd_texture(GL_TEXTURE_2D, "is not a GL_TEXTURE_3D of this context's share group",
              [&](GLuint name) { gl_.TextureStorage2D(name, 1, GL_R32F, 8, 8); });
  odd_texture(GL_TEXTURE_3D, "has no level 0", [](GLuint) {});
  odd_texture(GL_TEXTURE_3D, "has an integer format",
              [&](GLuint name) { gl_.TextureStorage3D(name, 1, GL_R16UI, 8, 8, 8); });
  odd_texture(GL_TEXTURE_3D, "has a base level that is not 0", [&](GLuint name) {
    gl_.TextureStorage3D(name, 2, GL_R16F, 8, 8, 8);
    gl_.TextureParameteri(name, GL_TEXTURE_BASE_LEVEL, 1);
  });

  refused(changed(buffer, [](auto& f) { f.buffer = 4711; }),
          named("buffer ", 4711) + ", is not a buffer of this context's share group");
  refused(changed(buffer, [](auto& f) { f.size[1] = 0; }), named("buffer ", bytes) + ", has voxels of size 23x0x17");
  refused(changed(buffer, [](auto& f) { f.size[1] = 1 << 30; }),
          named("buffer ", bytes) + ", has voxels of size 23x1073741824x17");
  const std::string too_small = named("buffer ", bytes) + ", has 12124 bytes, which is too small for its voxels";
  refused(changed(buffer, [](auto& f) { f.size[2] = 18; }), too_small);
  refused(changed(buffer, [](auto& f) { f.offset = 4; }), too_small);
  refused(changed(buffer, [](auto& f) { f.offset = ~std::uint64_t{0} - 3; }), too_small);
  refused(changed(buffer, [](auto& f) { f.strides[2] = ~std::uint64_t{0} - 3; }), too_small);
  refused(changed(buffer,
                  [](auto& f) {
                    f.format = CUMULET_VOXEL_FORMAT_R16;
                    f.size[2] = 8;
                    f.offset = 1;
                  }),
          named("buffer ", bytes) + ", has an offset or strides that are not multiples of the component size, 2 bytes");
  ASSERT_NE(gl_.MapNamedBuffer(bytes, GL_READ_ONLY), nullptr);
  refused(buffer, named("buffer ", bytes) + ", is mapped");
  gl_.UnmapNamedBuffer(bytes);

  const std::vector<cumulet_gl_field> twice{texture, buffer};
  EXPECT_EQ(refusal(state_of(twice), CUMULET_ERROR_INVALID_ARGUMENT), "smoke: has density twice");
  const std::vector<cumulet_gl_field> fine{texture};
  cumulet_gl_volume_desc desc = state_of(fine);
  int word = 0;
  desc.wait = &word;
  EXPECT_EQ(refusal(desc, CUMULET_ERROR_INVALID_ARGUMENT), "smoke: `wait` is not a valid GLsync");
  desc.wait = nullptr;
  const cumulet_voxel_box box{{0, 0, 0}, {7, 7, 7}};
  desc.changed = &box;
  desc.changed_count = 1;
  EXPECT_EQ(refusal(desc, CUMULET_ERROR_INVALID_ARGUMENT), "smoke: there is no state to update");
  desc.changed = nullptr;
  EXPECT_EQ(refusal(desc, CUMULET_ERROR_INVALID_ARGUMENT), "smoke: changed boxes are NULL");
  EXPECT_EQ(cumulet_dynamic_volume_set_gl(v_, nullptr, &desc), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(cumulet_dynamic_volume_set_gl(v_, live_.get(), nullptr), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(handed(), 0U);

  // Errors do not affect later valid states. A partial update may only have channels of the state.
  hand_over(fine);
  std::vector<cumulet_gl_field> flame{texture};
  flame[0].channel = CUMULET_CHANNEL_FLAME;
  cumulet_gl_volume_desc update = state_of(flame);
  update.changed = &box;
  update.changed_count = 1;
  EXPECT_EQ(refusal(update, CUMULET_ERROR_INVALID_ARGUMENT), "smoke: no flame to update");
  EXPECT_EQ(arrive(), 1U);
  EXPECT_EQ(refusal(update, CUMULET_ERROR_INVALID_ARGUMENT), "smoke: no flame to update");
  // The GPU waits for the fence, not the CPU.
  desc = state_of(fine);
  const GLsync fence = gl_.FenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0);
  desc.wait = fence;
  ASSERT_EQ(cumulet_dynamic_volume_set_gl(v_, live_.get(), &desc), CUMULET_OK) << cumulet_last_error(v_);
  EXPECT_EQ(fake_.calls("WaitSync"), 1U);
  gl_.DeleteSync(fence);
  EXPECT_EQ(arrive(), 1U);
  // While detached.
  ASSERT_EQ(cumulet_detach(v_), CUMULET_OK);
  EXPECT_EQ(cumulet_dynamic_volume_set_gl(v_, live_.get(), &desc), CUMULET_ERROR_DETACHED);
}

TEST_F(LiveStatesFromGl, NonFiniteValuesKeepTheLastValidState) {
  const Array good(CUMULET_VOXEL_FORMAT_R32F, simulated(CUMULET_CHANNEL_DENSITY, odd, 0));
  const std::vector good_fields{in_texture(CUMULET_CHANNEL_DENSITY, odd, objects_.texture(odd, voxel_types[0], good))};
  hand_over(good_fields);
  arrive();
  std::uint64_t states = 1;
  const Picture before = picture();
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(),
                          -std::numeric_limits<float>::infinity()}) {
    for (const std::size_t type : {0, 1}) {
      for (const bool boxes : {false, true}) {
        auto values = good.values;
        values[State::at({3, 20, 11}, odd)] = bad;
        const Array array(voxel_types.at(type).format, values);
        const std::vector fields{
            in_texture(CUMULET_CHANNEL_DENSITY, odd, objects_.texture(odd, voxel_types.at(type), array))};
        if (boxes) {
          hand_over(good_fields);
          states += arrive();
          picture();  // with all samples, because the failing frame draws this image again
          hand_over(fields, {{{0, 16, 8}, {7, 23, 15}}});
        } else {
          hand_over(fields);
        }
        EXPECT_EQ(frames_until_failure(), CUMULET_ERROR_FILE);
        EXPECT_STREQ(cumulet_last_error(v_), "smoke: density: its voxel (3, 20, 11) is not finite");
        EXPECT_EQ(difference(target_.pixels(), before), "");
        const cumulet_frame_desc frame = target_.frame();
        EXPECT_EQ(cumulet_render(v_, &frame, nullptr), CUMULET_OK) << "reported once";
        EXPECT_EQ(handed(), states);
      }
    }
  }
  const Array next(CUMULET_VOXEL_FORMAT_R32F, simulated(CUMULET_CHANNEL_DENSITY, odd, 1));
  hand_over({in_texture(CUMULET_CHANNEL_DENSITY, odd, objects_.texture(odd, voxel_types[0], next))});
  EXPECT_EQ(arrive(), 1U);
  expect_same_fields(newest(live_), alone(dense(odd, next.values)));
}

TEST_F(LiveStatesFromGl, SecondFailureInAFrameIsLogged) {
  std::vector<std::string> warnings;
  viewer_ = test::make_viewer({.get_proc = test::FakeGl::get_proc,
                               .user = &fake_,
                               .log =
                                   [](void* all, cumulet_log_level level, const char* text) {
                                     if (level == CUMULET_LOG_WARNING)
                                       static_cast<std::vector<std::string>*>(all)->emplace_back(text);
                                   },
                               .log_user = &warnings,
                               .samples = 2});
  v_ = viewer_.get();
  ASSERT_EQ(cumulet_set_dynamic_volume(v_, live_.get()), CUMULET_OK);
  auto values = simulated(CUMULET_CHANNEL_DENSITY, odd, 0);
  values[State::at({3, 20, 11}, odd)] = std::numeric_limits<float>::quiet_NaN();
  const Array bad(CUMULET_VOXEL_FORMAT_R32F, values);
  hand_over({in_texture(CUMULET_CHANNEL_DENSITY, odd, objects_.texture(odd, voxel_types[0], bad))});
  cumulet_frame_desc frame = target_.frame();
  frame.framebuffer = 4711;
  const std::string no_framebuffer = "the target, 4711, is not a framebuffer of the current context";
  cumulet_status status = CUMULET_ERROR_GL;
  for (int i = 0; i < 100 && status != CUMULET_ERROR_FILE; ++i) status = cumulet_render(v_, &frame, nullptr);
  EXPECT_STREQ(cumulet_last_error(v_), "smoke: density: its voxel (3, 20, 11) is not finite");
  EXPECT_EQ(warnings, std::vector{no_framebuffer});
  viewer_.reset();
}

// Boxes submitted after a rejected state are discarded with it, and not applied to the previous state.
TEST_F(LiveStatesFromGl, PartialUpdatesOfARejectedStateAreDiscarded) {
  const Array good(CUMULET_VOXEL_FORMAT_R32F, simulated(CUMULET_CHANNEL_DENSITY, odd, 0));
  const Array next(CUMULET_VOXEL_FORMAT_R32F, simulated(CUMULET_CHANNEL_DENSITY, odd, 1));
  auto values = next.values;
  values[State::at({3, 20, 11}, odd)] = std::numeric_limits<float>::quiet_NaN();
  const Array bad(CUMULET_VOXEL_FORMAT_R32F, values);
  const auto field = [&](const Array& array) {
    return in_texture(CUMULET_CHANNEL_DENSITY, odd, objects_.texture(odd, voxel_types[0], array));
  };
  hand_over({field(good)});
  arrive();
  hand_over({field(bad)});
  hand_over({field(next)}, {{{0, 0, 0}, {7, 7, 7}}});
  const cumulet_frame_desc frame = target_.frame();
  cumulet_status status = CUMULET_OK;
  for (int i = 0; i < 100 && status == CUMULET_OK; ++i) status = cumulet_render(v_, &frame, nullptr);
  EXPECT_EQ(status, CUMULET_ERROR_FILE);
  for (int i = 0; i < 5; ++i) EXPECT_EQ(cumulet_render(v_, &frame, nullptr), CUMULET_OK) << cumulet_last_error(v_);
  EXPECT_EQ(handed(), 1U);
  expect_same_fields(newest(live_), alone(dense(odd, good.values)));
  const std::vector fields{field(next)};
  const cumulet_voxel_box box{{0, 0, 0}, {7, 7, 7}};
  cumulet_gl_volume_desc update = state_of(fields);
  update.changed = &box;
  update.changed_count = 1;
  EXPECT_EQ(refusal(update, CUMULET_ERROR_INVALID_ARGUMENT), "smoke: there is no state to update");
  hand_over(fields);
  hand_over(fields, {box});
  arrive();
  EXPECT_EQ(handed(), 3U);
  expect_same_fields(newest(live_), alone(dense(odd, next.values)));
}

// A state in transfer is lost with the context. The previous state stays, and the next one arrives in the new context.
TEST_F(LiveStatesFromGl, IsReleasedWithItsContext) {
  const Array first(CUMULET_VOXEL_FORMAT_R16F, simulated(CUMULET_CHANNEL_DENSITY, odd, 0));
  const Array second(CUMULET_VOXEL_FORMAT_R16F, simulated(CUMULET_CHANNEL_DENSITY, odd, 1));
  const std::vector fields{in_texture(CUMULET_CHANNEL_DENSITY, odd, objects_.texture(odd, voxel_types[1], first))};
  const std::vector others{in_texture(CUMULET_CHANNEL_DENSITY, odd, objects_.texture(odd, voxel_types[1], second))};
  hand_over(fields);
  arrive();
  const auto alive = fake_.alive();
  hand_over(others);
  ASSERT_EQ(cumulet_detach(v_), CUMULET_OK);
  EXPECT_EQ(fake_.alive().count("Sync"), 0U);
  EXPECT_EQ(handed(), 1U);
  expect_same_fields(newest(live_), alone(dense(odd, first.values)));
  ASSERT_EQ(cumulet_attach(v_, test::FakeGl::get_proc, &fake_), CUMULET_OK);
  hand_over(others);
  EXPECT_EQ(arrive(), 1U);
  expect_same_fields(newest(live_), alone(dense(odd, second.values)));
  hand_over(fields);
  ASSERT_EQ(cumulet_context_lost(v_), CUMULET_OK);
  EXPECT_EQ(handed(), 2U);
  expect_same_fields(newest(live_), alone(dense(odd, second.values)));
  ASSERT_EQ(cumulet_attach(v_, test::FakeGl::get_proc, &fake_), CUMULET_OK);
  hand_over(fields);
  EXPECT_EQ(arrive(), 1U);
  EXPECT_EQ(difference(picture(), test::picture_of(make().get(), alone(dense(odd, first.values)).get(), target_)), "");
  EXPECT_EQ(test::FakeGl::strays(), 0U);
  EXPECT_FALSE(alive.empty());
}

// The context is lost at various GL calls inside cumulet_dynamic_volume_set_gl.
TEST_F(LiveStatesFromGl, ContextLossDuringACallIsReported) {
  const Array array(CUMULET_VOXEL_FORMAT_R16F, simulated(CUMULET_CHANNEL_DENSITY, odd, 0));
  const GLuint name = objects_.texture(odd, voxel_types[1], array);
  for (const std::int64_t call : {1, 4, 9, 17, 26, 37, 48}) {
    test::FakeGl fake(headless::Context::get_proc, &context_);
    const ViewerPtr viewer = test::make_viewer({.get_proc = test::FakeGl::get_proc, .user = &fake, .samples = 2});
    const std::vector fields{in_texture(CUMULET_CHANNEL_DENSITY, odd, name)};
    const cumulet_gl_volume_desc desc = state_of(fields);
    ASSERT_EQ(cumulet_dynamic_volume_set_gl(viewer.get(), live_.get(), &desc), CUMULET_OK)
        << cumulet_last_error(viewer.get());
    fake.lose_context(call);
    cumulet_status status = cumulet_dynamic_volume_set_gl(viewer.get(), live_.get(), &desc);
    if (!fake.lost()) continue;
    if (status == CUMULET_OK) status = cumulet_dynamic_volume_set_gl(viewer.get(), live_.get(), &desc);
    EXPECT_TRUE(status == CUMULET_ERROR_CONTEXT_LOST || status == CUMULET_ERROR_DETACHED ||
                status == CUMULET_ERROR_INVALID_ARGUMENT)
        << call << ": " << cumulet_last_error(viewer.get());
  }
  fake_.make_current();
}

TEST_F(LiveStatesFromGl, OutOfMemoryKeepsTheLastState) {
  const Array array(CUMULET_VOXEL_FORMAT_R16F, simulated(CUMULET_CHANNEL_DENSITY, odd, 0));
  const std::vector fields{in_texture(CUMULET_CHANNEL_DENSITY, odd, objects_.texture(odd, voxel_types[1], array))};
  hand_over(fields);
  const Array large(CUMULET_VOXEL_FORMAT_R32F, std::vector<float>(96 * 96 * 96, 1.0F));
  const std::vector larger{
      in_texture(CUMULET_CHANNEL_DENSITY, {96, 96, 96}, objects_.texture({96, 96, 96}, voxel_types[0], large))};
  const cumulet_gl_volume_desc desc = state_of(larger);
  fake_.fail_storage(true);
  EXPECT_EQ(refusal(desc, CUMULET_ERROR_OUT_OF_MEMORY).rfind("the GL driver is out of memory: creating ", 0), 0U)
      << cumulet_last_error(v_);
  fake_.fail_storage(false);
  EXPECT_EQ(arrive(), 1U);
  expect_same_fields(newest(live_), alone(dense(odd, array.values)));
  // A failed allocation when the frame processes the state.
  hand_over(larger);
  fake_.fail_storage(true);
  cumulet_frame_desc frame = target_.frame();
  frame.target = CUMULET_TARGET_NONE;
  EXPECT_EQ(cumulet_render(v_, &frame, nullptr), CUMULET_ERROR_OUT_OF_MEMORY);
  fake_.fail_storage(false);
  hand_over(larger);
  EXPECT_EQ(arrive(), 1U);
  expect_same_fields(newest(live_), alone(dense({96, 96, 96}, large.values)));
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
