// Dynamic volumes from a host's textures and buffers: bit-identical to the same values from main memory.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstring>
#include <functional>
#include <glm/gtc/packing.hpp>
#include <limits>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "gl/state_guard.hpp"
#include "render/voxel_transfers.hpp"
#include "support/c_playback.hpp"
#include "support/fake_gl.hpp"
#include "support/gl_state.hpp"
#include "support/live_volumes.hpp"
#include "support/simulated.hpp"
#include "support/volumes.hpp"
#include "viewer/c_handles.hpp"

namespace {

using namespace cumulet;
using test::alone;
using test::at;
using test::difference;
using test::LiveRef;
using test::make_desc;
using test::make_live;
using test::newest;
using test::Sides;
using test::simulated;
using test::State;
using test::ViewerPtr;
using test::VolumeRef;
using Picture = std::vector<std::uint8_t>;

constexpr Sides small = {24, 24, 24};
constexpr Sides odd = {23, 31, 17};

/// A number as a format stores it: its bits and its value.
struct Kept {
  std::vector<std::byte> bits;
  float value = 0.0F;
};
template <class Number>
Kept kept(Number number, float value) {
  Kept k{std::vector<std::byte>(sizeof number), value};
  std::memcpy(k.bits.data(), &number, sizeof number);
  return k;
}
Kept keep(cumulet_voxel_format format, float v) {
  const float unit = std::clamp(v, 0.0F, 1.0F);
  switch (format) {
    case CUMULET_VOXEL_FORMAT_R16F: {
      const std::uint16_t half = glm::packHalf1x16(v);
      return kept(half, glm::unpackHalf1x16(half));
    }
    case CUMULET_VOXEL_FORMAT_R16: {
      const auto code = static_cast<std::uint16_t>(std::lround(unit * 65535.0F));
      return kept(code, static_cast<float>(code / 65535.0));
    }
    case CUMULET_VOXEL_FORMAT_R8: {
      const auto code = static_cast<std::uint8_t>(std::lround(unit * 255.0F));
      return kept(code, static_cast<float>(code / 255.0));
    }
    default:
      return kept(v, v);
  }
}

/// An array in a format, and its values.
struct Array {
  std::vector<std::byte> bytes;
  std::vector<float> values;
  Array(cumulet_voxel_format format, const std::vector<float>& from) {
    for (const float v : from) {
      const Kept k = keep(format, v);
      bytes.insert(bytes.end(), k.bits.begin(), k.bits.end());
      values.push_back(k.value);
    }
  }
};

struct Type {
  cumulet_voxel_format format;
  GLenum internal;
  GLenum type;
};
constexpr auto types = std::to_array<Type>({{CUMULET_VOXEL_FORMAT_R32F, GL_R32F, GL_FLOAT},
                                            {CUMULET_VOXEL_FORMAT_R16F, GL_R16F, GL_HALF_FLOAT},
                                            {CUMULET_VOXEL_FORMAT_R16, GL_R16, GL_UNSIGNED_SHORT},
                                            {CUMULET_VOXEL_FORMAT_R8, GL_R8, GL_UNSIGNED_BYTE}});

/// Textures and buffers of a host.
class Objects {
 public:
  explicit Objects(const GladGLContext& gl) : gl_(gl) {}
  Objects(const Objects&) = delete;
  Objects& operator=(const Objects&) = delete;
  ~Objects() {
    for (const GLuint name : textures_) gl_.DeleteTextures(1, &name);
    for (const GLuint name : buffers_) gl_.DeleteBuffers(1, &name);
  }
  GLuint texture(const Sides& size, GLenum internal, GLenum format, GLenum type, const void* pixels) {
    GLuint name = 0;
    gl_.CreateTextures(GL_TEXTURE_3D, 1, &name);
    textures_.push_back(name);
    gl_.TextureStorage3D(name, 1, internal, size[0], size[1], size[2]);
    put(name, size, format, type, pixels);
    return name;
  }
  GLuint texture(const Sides& size, const Type& type, const Array& array) {
    return texture(size, type.internal, GL_RED, type.type, array.bytes.data());
  }
  void put(GLuint name, const Sides& size, GLenum format, GLenum type, const void* pixels) const {
    GLint alignment = 0;
    gl_.GetIntegerv(GL_UNPACK_ALIGNMENT, &alignment);
    gl_.PixelStorei(GL_UNPACK_ALIGNMENT, 1);
    gl_.TextureSubImage3D(name, 0, 0, 0, 0, size[0], size[1], size[2], format, type, pixels);
    gl_.PixelStorei(GL_UNPACK_ALIGNMENT, alignment);
  }
  GLuint buffer(const std::vector<std::byte>& bytes) {
    GLuint name = 0;
    gl_.CreateBuffers(1, &name);
    buffers_.push_back(name);
    gl_.NamedBufferData(name, static_cast<GLsizeiptr>((bytes.size() + 3) / 4 * 4), nullptr, GL_DYNAMIC_COPY);
    gl_.NamedBufferSubData(name, 0, static_cast<GLsizeiptr>(bytes.size()), bytes.data());
    return name;
  }

 private:
  const GladGLContext& gl_;
  std::vector<GLuint> textures_, buffers_;
};

cumulet_gl_field field_at(cumulet_channel channel, const Sides& size) {
  auto field = make_desc<cumulet_gl_field>();
  field.channel = channel;
  const auto transform = test::simulated_transform(size);
  std::copy(transform.begin(), transform.end(), field.index_to_world);
  return field;
}
cumulet_gl_field in_texture(cumulet_channel channel, const Sides& size, GLuint name, std::uint32_t component = 0) {
  cumulet_gl_field field = field_at(channel, size);
  field.texture = name;
  field.component = component;
  return field;
}
cumulet_gl_field in_buffer(cumulet_channel channel, const Sides& size, GLuint name, cumulet_voxel_format format) {
  cumulet_gl_field field = field_at(channel, size);
  field.buffer = name;
  field.format = format;
  std::copy(size.begin(), size.end(), field.size);
  return field;
}

cumulet_gl_volume_desc state_of(const std::vector<cumulet_gl_field>& fields) {
  auto desc = make_desc<cumulet_gl_volume_desc>();
  desc.fields = fields.data();
  desc.field_count = fields.size();
  desc.name = "smoke";
  return desc;
}

void expect_same(const VolumeRef& a, const VolumeRef& b) {
  ASSERT_NE(a, nullptr);
  ASSERT_NE(b, nullptr);
  const auto& left = a->asset->frame();
  const auto& right = b->asset->frame();
  test::expect_same_voxels(left.density, right.density);
  const auto others = left.beside_density();
  ASSERT_EQ(others.size(), right.beside_density().size());
  for (std::size_t i = 0; i < others.size(); ++i) {
    SCOPED_TRACE(others[i]->name);
    test::expect_same_voxels(*others[i], *right.beside_density()[i]);
    EXPECT_EQ(others[i]->index_to_world, right.beside_density()[i]->index_to_world);
  }
}

State dense(const Sides& size, const std::vector<float>& values) {
  return std::move(State().dense(CUMULET_CHANNEL_DENSITY, size, values));
}

/// A host whose viewer uses a FakeGl and shows a dynamic volume without a state.
class LiveStatesFromGl : public testing::Test {
 protected:
  ViewerPtr make(cumulet_build_device build = CUMULET_BUILD_CPU) {
    return test::make_viewer({.get_proc = test::FakeGl::get_proc, .user = &fake_, .samples = 2, .build = build});
  }
  void hand_over(const std::vector<cumulet_gl_field>& fields) {
    const cumulet_gl_volume_desc desc = state_of(fields);
    ASSERT_EQ(cumulet_dynamic_volume_set_gl(v_, live_.get(), &desc), CUMULET_OK) << cumulet_last_error(v_);
  }
  void hand_over(const std::vector<cumulet_gl_field>& fields, const std::vector<cumulet_voxel_box>& changed) {
    cumulet_gl_volume_desc desc = state_of(fields);
    desc.changed = changed.data();
    desc.changed_count = changed.size();
    ASSERT_EQ(cumulet_dynamic_volume_set_gl(v_, live_.get(), &desc), CUMULET_OK) << cumulet_last_error(v_);
  }
  std::string refusal(const cumulet_gl_volume_desc& desc, cumulet_status status) {
    EXPECT_EQ(cumulet_dynamic_volume_set_gl(v_, live_.get(), &desc), status);
    return cumulet_last_error(v_);
  }
  std::uint64_t handed() {
    auto info = make_desc<cumulet_dynamic_volume_info>();
    EXPECT_EQ(cumulet_get_dynamic_volume_info(v_, &info), CUMULET_OK) << cumulet_last_error(v_);
    return info.submitted_update;
  }
  // Renders frames that draw nothing until `done` returns true, at most 30 s.
  void render_until(const std::function<bool()>& done) {
    cumulet_frame_desc frame = target_.frame();
    frame.target = CUMULET_TARGET_NONE;
    frame.budget_ms = 5.0;
    const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    while (!done() && std::chrono::steady_clock::now() < until)
      EXPECT_EQ(cumulet_render(v_, &frame, nullptr), CUMULET_OK) << cumulet_last_error(v_);
  }
  // Renders until `count` states have arrived, and some more frames. Returns the number of arrived states.
  std::uint64_t arrive(std::uint64_t count = 1) {
    const std::uint64_t before = handed();
    int more = 0;
    render_until([&] {
      if (handed() >= before + count) ++more;
      return more == 3;
    });
    return handed() - before;
  }
  // Renders until main memory has the voxels of the newest state.
  void wait_for_voxels(const LiveRef& live) {
    cumulet_volume* volume = nullptr;
    render_until([&] { return cumulet_dynamic_volume_get_volume(live.get(), &volume, nullptr, 0) == CUMULET_OK; });
    cumulet_volume_release(volume);
  }
  Picture picture() { return test::drawn_once(v_, target_); }
  // Returns the first failing frame's status. The target holds that frame's image.
  cumulet_status frames_until_failure() {
    const cumulet_frame_desc frame = target_.frame();
    cumulet_status status = CUMULET_OK;
    for (int i = 0; i < 100 && status == CUMULET_OK; ++i) {
      target_.clear({0.0F, 0.0F, 0.0F, 0.0F});
      status = cumulet_render(v_, &frame, nullptr);
    }
    return status;
  }

  headless::Context context_ = headless::Context::create(headless::Backend::automatic);
  test::FakeGl fake_{headless::Context::get_proc, &context_};
  const GladGLContext& gl_ = fake_.real();
  test::HostTarget target_{gl_, 32, 32};
  Objects objects_{gl_};
  LiveRef live_ = make_live();
  ViewerPtr viewer_ = make();
  cumulet_viewer* v_ = viewer_.get();

  void SetUp() override { ASSERT_EQ(cumulet_set_dynamic_volume(v_, live_.get()), CUMULET_OK); }
};

TEST_F(LiveStatesFromGl, EveryFormatMatchesUploadFromMemory) {
  int step = 0;
  for (const Type& type : types) {
    for (const Sides& size : {odd, small}) {
      SCOPED_TRACE(type.format);
      const Array array(type.format, simulated(CUMULET_CHANNEL_DENSITY, size, ++step));
      const VolumeRef expected = alone(dense(size, array.values));
      hand_over({in_texture(CUMULET_CHANNEL_DENSITY, size, objects_.texture(size, type, array))});
      EXPECT_EQ(arrive(), 1U);
      expect_same(newest(live_), expected);
      hand_over({in_buffer(CUMULET_CHANNEL_DENSITY, size, objects_.buffer(array.bytes), type.format)});
      EXPECT_EQ(arrive(), 1U);
      expect_same(newest(live_), expected);
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
  expect_same(newest(live_), alone(dense(odd, read)));
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
      const auto fields = std::vector{in_texture(CUMULET_CHANNEL_DENSITY, odd, objects_.texture(odd, types[0], array))};
      const cumulet_gl_volume_desc desc = state_of(fields);
      ASSERT_EQ(cumulet_dynamic_volume_set_gl(v_, live.get(), &desc), CUMULET_OK) << cumulet_last_error(v_);
      if (resident) {
        // The state arrives once in GL, and again when its voxels are in main memory.
        EXPECT_GE(arrive(), 1U);
        wait_for_voxels(live);
      } else {
        EXPECT_EQ(arrive(), 1U);
      }
      expect_same(newest(live), alone(dense(odd, array.values)));
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
  hand_over({in_texture(CUMULET_CHANNEL_DENSITY, size, objects_.texture(size, types[3], one)),
             in_texture(CUMULET_CHANNEL_VELOCITY_X, size,
                        objects_.texture(size, GL_R16F, GL_RED, GL_HALF_FLOAT, bits.data())),
             in_buffer(CUMULET_CHANNEL_VELOCITY_Y, size, objects_.buffer(raw_floats), CUMULET_VOXEL_FORMAT_R32F),
             in_buffer(CUMULET_CHANNEL_VELOCITY_Z, size, objects_.buffer(raw), CUMULET_VOXEL_FORMAT_R16F)});
  EXPECT_EQ(arrive(), 1U);
  expect_same(newest(live_), expected);
}

// All channels; the three colors and the three velocities each share one texture.
TEST_F(LiveStatesFromGl, TextureComponentsAreSeparateChannels) {
  State state = dense(odd, simulated(CUMULET_CHANNEL_DENSITY, odd, 1));
  const Array density(CUMULET_VOXEL_FORMAT_R32F, simulated(CUMULET_CHANNEL_DENSITY, odd, 1));
  std::vector<cumulet_gl_field> fields{
      in_texture(CUMULET_CHANNEL_DENSITY, odd, objects_.texture(odd, types[0], density))};
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
  expect_same(newest(live_), alone(state));
}

// z fastest, with gaps and an offset, and voxels of three numbers each.
TEST_F(LiveStatesFromGl, BufferStridesAreSupported) {
  for (const Type& type : types) {
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
    expect_same(newest(live_), alone(dense(odd, array.values)));
  }
}

// Partial updates by boxes, with and without a read between them, on states from GL and from memory. Some boxes are too
// large, overlap or are outside.
TEST_F(LiveStatesFromGl, PartialUpdatesEqualAFullState) {
  for (const bool from_memory : {false, true}) {
    for (const bool read : {false, true}) {
      const Type& type = types[read ? 1 : 0];
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
      expect_same(newest(live_), alone(dense(odd, before.values)));
      // An update without any voxel is a state too.
      const std::uint64_t number = handed();
      hand_over(fields, {{{99, 99, 99}, {120, 120, 120}}});
      EXPECT_EQ(arrive(), 1U);
      EXPECT_EQ(handed(), number + 1);
      expect_same(newest(live_), alone(dense(odd, before.values)));
    }
  }
}

// Updates a state from GL with bricks from main memory.
TEST_F(LiveStatesFromGl, BricksMayComeFromMemory) {
  const Array before(CUMULET_VOXEL_FORMAT_R32F, simulated(CUMULET_CHANNEL_DENSITY, odd, 0));
  const auto now = simulated(CUMULET_CHANNEL_DENSITY, odd, 1);
  hand_over({in_texture(CUMULET_CHANNEL_DENSITY, odd, objects_.texture(odd, types[0], before))});
  arrive();
  State changes;
  changes.sparse(CUMULET_CHANNEL_DENSITY, odd, now, State::bricks(odd, now, before.values));
  changes.last_sparse().brick_active = nullptr;
  const cumulet_volume_fields_desc desc = changes.desc();
  ASSERT_EQ(cumulet_dynamic_volume_update(live_.get(), &desc, nullptr, 0), CUMULET_OK);
  expect_same(newest(live_), alone(dense(odd, now)));
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
  expect_same(newest(live_), alone(dense(odd, array.values)));
}

// If states are submitted faster than they arrive, the oldest one in transfer and the newest one arrive.
TEST_F(LiveStatesFromGl, NewestStateIsShownAndNoneStarves) {
  std::vector<Array> arrays;
  std::vector<GLuint> names;
  for (int step = 0; step < 6; ++step) {
    arrays.emplace_back(CUMULET_VOXEL_FORMAT_R32F,
                        simulated(CUMULET_CHANNEL_DENSITY, step % 2 == 0 ? odd : small, step));
    names.push_back(objects_.texture(step % 2 == 0 ? odd : small, types[0], arrays.back()));
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
    expect_same(newest(live_), alone(dense(small, arrays[5].values)));
    picture();  // makes the other GL memory equal in each round
  }
  expect_same(newest(other), alone(dense(odd, arrays[2].values)));
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
  const GLuint good = objects_.texture(odd, types[3], array);
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
  const std::vector good_fields{in_texture(CUMULET_CHANNEL_DENSITY, odd, objects_.texture(odd, types[0], good))};
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
        const Array array(types.at(type).format, values);
        const std::vector fields{
            in_texture(CUMULET_CHANNEL_DENSITY, odd, objects_.texture(odd, types.at(type), array))};
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
        EXPECT_EQ(cumulet_render(v_, &frame, nullptr), CUMULET_OK) << "told once";
        EXPECT_EQ(handed(), states);
      }
    }
  }
  const Array next(CUMULET_VOXEL_FORMAT_R32F, simulated(CUMULET_CHANNEL_DENSITY, odd, 1));
  hand_over({in_texture(CUMULET_CHANNEL_DENSITY, odd, objects_.texture(odd, types[0], next))});
  EXPECT_EQ(arrive(), 1U);
  expect_same(newest(live_), alone(dense(odd, next.values)));
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
  hand_over({in_texture(CUMULET_CHANNEL_DENSITY, odd, objects_.texture(odd, types[0], bad))});
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
    return in_texture(CUMULET_CHANNEL_DENSITY, odd, objects_.texture(odd, types[0], array));
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
  expect_same(newest(live_), alone(dense(odd, good.values)));
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
  expect_same(newest(live_), alone(dense(odd, next.values)));
}

// A state in transfer is lost with the context. The previous state stays, and the next one arrives in the new context.
TEST_F(LiveStatesFromGl, IsReleasedWithItsContext) {
  const Array first(CUMULET_VOXEL_FORMAT_R16F, simulated(CUMULET_CHANNEL_DENSITY, odd, 0));
  const Array second(CUMULET_VOXEL_FORMAT_R16F, simulated(CUMULET_CHANNEL_DENSITY, odd, 1));
  const std::vector fields{in_texture(CUMULET_CHANNEL_DENSITY, odd, objects_.texture(odd, types[1], first))};
  const std::vector others{in_texture(CUMULET_CHANNEL_DENSITY, odd, objects_.texture(odd, types[1], second))};
  hand_over(fields);
  arrive();
  const auto alive = fake_.alive();
  hand_over(others);
  ASSERT_EQ(cumulet_detach(v_), CUMULET_OK);
  EXPECT_EQ(fake_.alive().count("Sync"), 0U);
  EXPECT_EQ(handed(), 1U);
  expect_same(newest(live_), alone(dense(odd, first.values)));
  ASSERT_EQ(cumulet_attach(v_, test::FakeGl::get_proc, &fake_), CUMULET_OK);
  hand_over(others);
  EXPECT_EQ(arrive(), 1U);
  expect_same(newest(live_), alone(dense(odd, second.values)));
  hand_over(fields);
  ASSERT_EQ(cumulet_context_lost(v_), CUMULET_OK);
  EXPECT_EQ(handed(), 2U);
  expect_same(newest(live_), alone(dense(odd, second.values)));
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
  const GLuint name = objects_.texture(odd, types[1], array);
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
  const std::vector fields{in_texture(CUMULET_CHANNEL_DENSITY, odd, objects_.texture(odd, types[1], array))};
  hand_over(fields);
  const Array large(CUMULET_VOXEL_FORMAT_R32F, std::vector<float>(96 * 96 * 96, 1.0F));
  const std::vector larger{
      in_texture(CUMULET_CHANNEL_DENSITY, {96, 96, 96}, objects_.texture({96, 96, 96}, types[0], large))};
  const cumulet_gl_volume_desc desc = state_of(larger);
  fake_.fail_storage(true);
  EXPECT_EQ(refusal(desc, CUMULET_ERROR_OUT_OF_MEMORY).rfind("the GL driver is out of memory: creating ", 0), 0U)
      << cumulet_last_error(v_);
  fake_.fail_storage(false);
  EXPECT_EQ(arrive(), 1U);
  expect_same(newest(live_), alone(dense(odd, array.values)));
  // A failed allocation when the frame processes the state.
  hand_over(larger);
  fake_.fail_storage(true);
  cumulet_frame_desc frame = target_.frame();
  frame.target = CUMULET_TARGET_NONE;
  EXPECT_EQ(cumulet_render(v_, &frame, nullptr), CUMULET_ERROR_OUT_OF_MEMORY);
  fake_.fail_storage(false);
  hand_over(larger);
  EXPECT_EQ(arrive(), 1U);
  expect_same(newest(live_), alone(dense({96, 96, 96}, large.values)));
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
  const std::vector fields{in_texture(CUMULET_CHANNEL_DENSITY, odd, objects_.texture(odd, types[1], array))};
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
  const std::vector fields{in_texture(CUMULET_CHANNEL_DENSITY, wide, objects_.texture(wide, types[0], array))};
  auto stats = make_desc<cumulet_stats>();
  ASSERT_EQ(cumulet_get_stats(v_, &stats), CUMULET_OK);
  const std::uint64_t before = stats.gl_bytes;
  hand_over(fields);
  ASSERT_EQ(cumulet_get_stats(v_, &stats), CUMULET_OK);
  const std::uint64_t copy = stats.gl_bytes - before;
  EXPECT_GE(copy, std::uint64_t{4} * 96 * 96 * 96);
  EXPECT_LT(copy, std::uint64_t{4} * 96 * 96 * 96 + 32768);
  EXPECT_EQ(arrive(), 1U);
  expect_same(newest(live_), alone(dense(wide, values)));
}

// GPU-built grids of states from GL.
TEST_F(LiveStatesFromGl, GpuBuiltGridsMatch) {
  viewer_ = make(CUMULET_BUILD_GPU);
  v_ = viewer_.get();
  ASSERT_EQ(cumulet_set_dynamic_volume(v_, live_.get()), CUMULET_OK);
  const Array array(CUMULET_VOXEL_FORMAT_R16F, simulated(CUMULET_CHANNEL_DENSITY, odd, 0));
  hand_over({in_texture(CUMULET_CHANNEL_DENSITY, odd, objects_.texture(odd, types[1], array))});
  EXPECT_EQ(arrive(), 1U);
  const ViewerPtr single = make(CUMULET_BUILD_GPU);
  EXPECT_EQ(difference(picture(), test::picture_of(single.get(), alone(dense(odd, array.values)).get(), target_)), "");
}

/// A GPU-resident dynamic volume and a viewer that builds grids on the GPU.
class LiveStatesOnGpu : public LiveStatesFromGl {
 protected:
  void SetUp() override {
    auto desc = make_desc<cumulet_dynamic_volume_desc>();
    desc.gpu_resident = 1;
    live_ = make_live(desc);
    viewer_ = make(CUMULET_BUILD_GPU);
    v_ = viewer_.get();
    ASSERT_EQ(cumulet_set_dynamic_volume(v_, live_.get()), CUMULET_OK);
  }
  // The image of the same values from main memory, made by another viewer.
  Picture reference(const std::vector<float>& values) {
    const ViewerPtr other = make(CUMULET_BUILD_GPU);
    return test::picture_of(other.get(), alone(dense(odd, values)).get(), target_);
  }
  void hand_over_density(const Array& array, const Type& type) {
    hand_over({in_texture(CUMULET_CHANNEL_DENSITY, odd, objects_.texture(odd, type, array))});
  }
  std::string get_volume(cumulet_status status) {
    std::array<char, 256> error{};
    cumulet_volume* volume = nullptr;
    EXPECT_EQ(cumulet_dynamic_volume_get_volume(live_.get(), &volume, error.data(), error.size()), status);
    EXPECT_EQ(volume, nullptr);
    return error.data();
  }
  [[nodiscard]] bool shows_voxels() const {
    cumulet_volume* volume = nullptr;
    EXPECT_EQ(cumulet_get_volume(v_, &volume), CUMULET_OK);
    const VolumeRef kept(volume);
    return volume != nullptr;
  }
};

// Scaling by a power of two changes no mantissa, so it changes no sample.
TEST_F(LiveStatesOnGpu, ExtremeValuesAreDrawnLikeOrdinaryOnes) {
  const std::vector<float> plain = simulated(CUMULET_CHANNEL_DENSITY, odd, 0);
  auto medium = make_desc<cumulet_medium_desc>();
  medium.density_scale = 0.5;
  const ViewerPtr other = make(CUMULET_BUILD_GPU);
  ASSERT_EQ(cumulet_set_medium(other.get(), &medium), CUMULET_OK);
  const Picture expected = test::picture_of(other.get(), alone(dense(odd, plain)).get(), target_);
  for (const int exponent : {-100, 90}) {
    SCOPED_TRACE(exponent);
    std::vector<float> values = plain;
    for (float& value : values) value = std::ldexp(value, exponent);
    medium.density_scale = std::ldexp(0.5, -exponent);
    ASSERT_EQ(cumulet_set_medium(v_, &medium), CUMULET_OK) << cumulet_last_error(v_);
    hand_over_density(Array(CUMULET_VOXEL_FORMAT_R32F, values), types[0]);
    EXPECT_EQ(difference(picture(), expected), "");
    EXPECT_TRUE(shows_voxels()) << "in main memory";
  }
}

TEST_F(LiveStatesOnGpu, FillValuesCountAsZero) {
  std::vector<float> values = simulated(CUMULET_CHANNEL_DENSITY, odd, 0);
  std::vector<float> without = values;
  for (std::size_t i = 0; i < values.size(); i += 97) {
    values[i] = i % 2 == 0 ? 9.97e36F : -std::numeric_limits<float>::max();
    without[i] = 0.0F;
  }
  hand_over_density(Array(CUMULET_VOXEL_FORMAT_R32F, values), types[0]);
  EXPECT_EQ(arrive(), 1U);
  EXPECT_EQ(difference(picture(), reference(without)), "");
}

TEST_F(LiveStatesOnGpu, EveryFormatGivesTheSameImage) {
  int step = 0;
  for (const Type& type : types) {
    SCOPED_TRACE(type.format);
    const Array array(type.format, simulated(CUMULET_CHANNEL_DENSITY, odd, ++step));
    hand_over_density(array, type);
    EXPECT_EQ(arrive(), 1U);
    const Picture expected = reference(array.values);
    EXPECT_EQ(difference(picture(), expected), "");
    EXPECT_FALSE(shows_voxels());
    hand_over({in_buffer(CUMULET_CHANNEL_DENSITY, odd, objects_.buffer(array.bytes), type.format)});
    EXPECT_EQ(arrive(), 1U);
    EXPECT_EQ(difference(picture(), expected), "");
    EXPECT_FALSE(shows_voxels());
  }
}

// Partial updates, some of which empty bricks, with and without a build between them. Replaced bricks are freed.
TEST_F(LiveStatesOnGpu, PartialUpdatesEqualAFullState) {
  const auto memory = [&] {
    auto stats = make_desc<cumulet_stats>();
    EXPECT_EQ(cumulet_get_stats(v_, &stats), CUMULET_OK);
    return stats.gl_bytes;
  };
  const Type& type = types[1];
  Array before(type.format, simulated(CUMULET_CHANNEL_DENSITY, odd, 0));
  const GLuint name = objects_.texture(odd, type, before);
  const std::vector<cumulet_gl_field> fields{in_texture(CUMULET_CHANNEL_DENSITY, odd, name)};
  hand_over(fields);
  // The transform of partial updates is ignored; the state keeps its own.
  std::vector<cumulet_gl_field> parts = fields;
  for (double& x : parts[0].index_to_world) x = 0.0;
  std::uint64_t on_their_way = 1;
  std::uint64_t most = 0;
  for (int step = 1; step <= 60; ++step) {
    const Array now(type.format, simulated(CUMULET_CHANNEL_DENSITY, odd, step));
    objects_.put(name, odd, GL_RED, type.type, now.bytes.data());
    std::vector<cumulet_voxel_box> boxes;
    for (const Sides& b : State::bricks(odd, now.values, before.values))
      boxes.push_back({{b[0] + 3, b[1], b[2]}, {b[0] + 3, b[1], b[2]}});
    hand_over(parts, boxes);
    before = now;
    ++on_their_way;
    if (step % 4 != 0) continue;
    EXPECT_EQ(arrive(on_their_way), on_their_way);
    on_their_way = 0;
    if (step % 20 == 0) {
      EXPECT_EQ(difference(picture(), reference(now.values)), "");
    }
    if (step == 20) most = memory();
  }
  EXPECT_FALSE(shows_voxels());
  EXPECT_LE(memory(), most + most / 4);
}

// If something needs the voxels in main memory, the current state and all later ones are read back.
TEST_F(LiveStatesOnGpu, IsReadBackWhenNeededInMemory) {
  const Array array(CUMULET_VOXEL_FORMAT_R16F, simulated(CUMULET_CHANNEL_DENSITY, odd, 1));
  const Picture expected = reference(array.values);
  struct Need {
    const char* name;
    std::function<void()> make;
  };
  const std::vector<Need> needs{
      {"its voxels", [&] { get_volume(CUMULET_ERROR_UNSUPPORTED); }},
      {"a build of the processor's",
       [&] {
         auto grid = make_desc<cumulet_grid_desc>();
         grid.build_device = CUMULET_BUILD_CPU;
         EXPECT_EQ(cumulet_set_grid(v_, &grid), CUMULET_OK);
       }},
  };
  for (const Need& need : needs) {
    SCOPED_TRACE(need.name);
    SetUp();
    hand_over_density(array, types[1]);
    EXPECT_EQ(arrive(), 1U);
    picture();
    EXPECT_FALSE(shows_voxels());
    need.make();
    EXPECT_EQ(arrive(), 1U);  // the same state again, now in main memory
    expect_same(newest(live_), alone(dense(odd, array.values)));
    EXPECT_EQ(difference(picture(), expected), "");
    EXPECT_TRUE(shows_voxels());
    const Array next(CUMULET_VOXEL_FORMAT_R8, simulated(CUMULET_CHANNEL_DENSITY, odd, 2));
    hand_over_density(next, types[3]);
    EXPECT_EQ(arrive(), 1U);
    expect_same(newest(live_), alone(dense(odd, next.values)));
  }
}

// Rejected states leave the current one.
TEST_F(LiveStatesOnGpu, RejectedStateKeepsTheLastValidState) {
  const Array good(CUMULET_VOXEL_FORMAT_R16F, simulated(CUMULET_CHANNEL_DENSITY, odd, 0));
  hand_over_density(good, types[1]);
  arrive();
  const Picture before = picture();
  auto values = good.values;
  values[State::at({3, 20, 11}, odd)] = std::numeric_limits<float>::infinity();
  for (const std::size_t type : {0, 1}) {
    hand_over_density(Array(types.at(type).format, values), types.at(type));
    EXPECT_EQ(frames_until_failure(), CUMULET_ERROR_FILE);
    EXPECT_STREQ(cumulet_last_error(v_), "smoke: density: non-finite value in the 8x8x8 brick at (0, 16, 8)");
    EXPECT_EQ(difference(target_.pixels(), before), "");
    EXPECT_EQ(handed(), 1U);
    // Boxes after a rejected state have no state to update.
    const std::vector fields{in_texture(CUMULET_CHANNEL_DENSITY, odd, objects_.texture(odd, types[1], good))};
    cumulet_gl_volume_desc boxes = state_of(fields);
    const cumulet_voxel_box box{{0, 0, 0}, {9, 9, 9}};
    boxes.changed = &box;
    boxes.changed_count = 1;
    EXPECT_EQ(refusal(boxes, CUMULET_ERROR_INVALID_ARGUMENT), "smoke: there is no state to update");
  }
  hand_over_density(good, types[1]);
  EXPECT_EQ(arrive(), 1U);
  State changes;
  changes.sparse(CUMULET_CHANNEL_DENSITY, odd, good.values, {{0, 0, 0}});
  const cumulet_volume_fields_desc desc = changes.desc();
  std::array<char, 256> error{};
  EXPECT_EQ(cumulet_dynamic_volume_update(live_.get(), &desc, error.data(), error.size()),
            CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_STREQ(error.data(), "smoke: density is on the GPU and can only be updated from GL");
  EXPECT_EQ(difference(picture(), before), "");
}

// An empty state; fields with different transforms, which are read back to main memory; and states from main memory.
TEST_F(LiveStatesOnGpu, MixesWithStatesFromMemory) {
  const Array array(CUMULET_VOXEL_FORMAT_R16F, simulated(CUMULET_CHANNEL_DENSITY, odd, 0));
  const Array nothing(CUMULET_VOXEL_FORMAT_R16F, std::vector<float>(array.values.size(), 0.0F));
  const Array ahead(CUMULET_VOXEL_FORMAT_R16F, simulated(CUMULET_CHANNEL_ANISOTROPY, odd, 0));
  const Picture expected = reference(array.values);
  hand_over_density(array, types[1]);
  EXPECT_EQ(arrive(), 1U);
  EXPECT_EQ(difference(picture(), expected), "");
  hand_over_density(nothing, types[1]);
  EXPECT_EQ(arrive(), 1U);
  EXPECT_NE(difference(picture(), expected), "");
  cumulet_gl_field apart = in_texture(CUMULET_CHANNEL_ANISOTROPY, odd, objects_.texture(odd, types[1], ahead));
  apart.index_to_world[12] += 8.0 * apart.index_to_world[0];
  hand_over({in_texture(CUMULET_CHANNEL_DENSITY, odd, objects_.texture(odd, types[1], array)), apart});
  EXPECT_EQ(arrive(), 1U);
  State both = dense(odd, array.values);
  both.dense(CUMULET_CHANNEL_ANISOTROPY, odd, ahead.values).last_dense().index_to_world[12] = apart.index_to_world[12];
  expect_same(newest(live_), alone(both));
  hand_over_density(array, types[1]);
  EXPECT_EQ(arrive(), 1U);
  EXPECT_EQ(difference(picture(), expected), "");
  EXPECT_FALSE(shows_voxels());
  const State whole = dense(odd, array.values);
  const cumulet_volume_fields_desc desc = whole.desc();
  ASSERT_EQ(cumulet_dynamic_volume_set(live_.get(), &desc, nullptr, 0), CUMULET_OK);
  EXPECT_EQ(difference(picture(), expected), "");
  EXPECT_TRUE(shows_voxels());
}

const std::vector<cumulet_channel> of_fire{CUMULET_CHANNEL_DENSITY, CUMULET_CHANNEL_TEMPERATURE, CUMULET_CHANNEL_FLAME};

// Density, temperature and flame of a step, as halves; or other channels.
class LiveFireOnGpu : public LiveStatesOnGpu {
 protected:
  explicit LiveFireOnGpu(const std::vector<cumulet_channel>& channels = of_fire) : channels_(channels) {}
  struct Fire {
    std::vector<Array> arrays;
    std::vector<GLuint> textures;
    std::vector<cumulet_gl_field> fields;
  };
  Fire fire(int step) {
    Fire made;
    for (const cumulet_channel channel : channels_) {
      made.arrays.emplace_back(types[1].format, simulated(channel, odd, step));
      made.textures.push_back(objects_.texture(odd, types[1], made.arrays.back()));
      made.fields.push_back(in_texture(channel, odd, made.textures.back()));
    }
    return made;
  }
  // Returns the fire with one non-finite voxel in a channel.
  Fire spoilt(Fire fire, std::size_t channel) {
    auto values = fire.arrays[channel].values;
    values[State::at({3, 20, 11}, odd)] = std::numeric_limits<float>::infinity();
    const Array array(types[1].format, values);
    objects_.put(fire.textures[channel], odd, GL_RED, types[1].type, array.bytes.data());
    return fire;
  }
  [[nodiscard]] State in_memory(const Fire& fire) const {
    State state;
    for (std::size_t i = 0; i < channels_.size(); ++i) state.dense(channels_[i], odd, fire.arrays[i].values);
    return state;
  }
  static void burn(cumulet_viewer* viewer, float strength, float blackbody = 0.0F) {
    auto medium = make_desc<cumulet_medium_desc>();
    medium.flame_strength = strength;
    medium.blackbody = blackbody;
    ASSERT_EQ(cumulet_set_medium(viewer, &medium), CUMULET_OK) << cumulet_last_error(viewer);
  }
  // The image of the same fields from main memory, made by another viewer.
  Picture by_memory(const Fire& fire, float strength, float blackbody = 0.0F) {
    const ViewerPtr other = make(CUMULET_BUILD_GPU);
    burn(other.get(), strength, blackbody);
    return test::picture_of(other.get(), alone(in_memory(fire)).get(), target_);
  }
  // The image of the same GPU-resident fields, made by another viewer.
  Picture by_gl(const Fire& fire, float strength, float blackbody = 0.0F) {
    auto desc = make_desc<cumulet_dynamic_volume_desc>();
    desc.gpu_resident = 1;
    const LiveRef live = make_live(desc);
    const ViewerPtr other = make(CUMULET_BUILD_GPU);
    burn(other.get(), strength, blackbody);
    const cumulet_gl_volume_desc state = state_of(fire.fields);
    EXPECT_EQ(cumulet_set_dynamic_volume(other.get(), live.get()), CUMULET_OK);
    EXPECT_EQ(cumulet_dynamic_volume_set_gl(other.get(), live.get(), &state), CUMULET_OK);
    return settled(other.get());
  }
  // Renders until nothing changes any more.
  Picture settled(cumulet_viewer* viewer) {
    cumulet_frame_desc frame = target_.frame();
    frame.target = CUMULET_TARGET_NONE;
    for (int quiet = 0; quiet < 5;) {
      auto result = make_desc<cumulet_frame_result>();
      cumulet_wait(viewer, 10.0);  // may time out; the loop continues
      if (cumulet_render(viewer, &frame, &result) != CUMULET_OK) {
        ADD_FAILURE() << cumulet_last_error(viewer);
        break;
      }
      quiet = (result.flags & CUMULET_RENDER_CONVERGED) != 0 ? quiet + 1 : 0;
    }
    return test::drawn_once(viewer, target_);
  }
  // Colors are computed in floats instead of doubles, so a few paths differ.
  static void expect_alike(const Picture& a, const Picture& b) {
    ASSERT_EQ(a.size(), b.size());
    std::size_t others = 0;
    for (std::size_t i = 0; i < a.size(); ++i) others += std::abs(int{a[i]} - int{b[i]}) > 1 ? 1U : 0U;
    EXPECT_LE(others, a.size() / 100);
  }

  std::vector<cumulet_channel> channels_;
};

// Fire channels, and all channels that a state may have.
class LiveChannelsOnGpu : public LiveFireOnGpu, public testing::WithParamInterface<std::vector<cumulet_channel>> {
 protected:
  LiveChannelsOnGpu() : LiveFireOnGpu(GetParam()) {}
};
const std::vector<cumulet_channel> all_channels = [] {
  std::vector<cumulet_channel> all;
  for (int channel = CUMULET_CHANNEL_DENSITY; channel <= CUMULET_CHANNEL_VELOCITY_Z; ++channel)
    all.push_back(static_cast<cumulet_channel>(channel));
  return all;
}();
INSTANTIATE_TEST_SUITE_P(Channels, LiveChannelsOnGpu, testing::Values(of_fire, all_channels),
                         [](const auto& channels) { return channels.param.size() == of_fire.size() ? "fire" : "all"; });

TEST_P(LiveChannelsOnGpu, ImageMatchesStatesFromMemory) {
  burn(v_, 2.0F, 0.5F);
  for (const int step : {0, 3}) {
    const Fire burning = fire(step);
    hand_over(burning.fields);
    const Picture found = settled(v_);
    EXPECT_FALSE(shows_voxels());
    expect_alike(found, by_memory(burning, 2.0F, 0.5F));
    EXPECT_EQ(difference(found, by_gl(burning, 2.0F, 0.5F)), "");
  }
}

// The emission is recomputed from the GPU-resident voxels.
TEST_F(LiveFireOnGpu, EmissionFollowsTheMedium) {
  const Fire burning = fire(1);
  hand_over(burning.fields);
  Picture before = settled(v_);
  EXPECT_EQ(difference(before, by_gl(burning, 1.0F)), "");
  for (const auto& [strength, blackbody] : {std::pair(5.0F, 0.0F), std::pair(0.5F, 1.0F), std::pair(1.0F, 0.0F)}) {
    burn(v_, strength, blackbody);
    const Picture now = settled(v_);
    EXPECT_NE(difference(now, before), "");
    EXPECT_EQ(difference(now, by_gl(burning, strength, blackbody)), "");
    EXPECT_FALSE(shows_voxels());
    before = now;
  }
  // The next state arrives with it.
  const std::uint64_t states = handed();
  hand_over(fire(2).fields);
  settled(v_);
  EXPECT_EQ(handed(), states + 1);
}

TEST_P(LiveChannelsOnGpu, PartialUpdatesEqualAFullState) {
  Fire burning = fire(1);
  burn(v_, 2.0F, 0.5F);
  hand_over(burning.fields);
  settled(v_);
  for (int step = 2; step < 5; ++step) {
    Fire next = fire(step);
    std::vector<cumulet_voxel_box> boxes;
    for (std::size_t i = 0; i < channels_.size(); ++i) {
      objects_.put(burning.textures[i], odd, GL_RED, types[1].type, next.arrays[i].bytes.data());
      for (const Sides& b : State::bricks(odd, next.arrays[i].values, burning.arrays[i].values))
        boxes.push_back({{b[0], b[1], b[2]}, {b[0] + 7, b[1] + 7, b[2] + 7}});
      burning.arrays[i] = next.arrays[i];
    }
    hand_over(burning.fields, boxes);
    const Picture found = settled(v_);
    EXPECT_FALSE(shows_voxels());
    EXPECT_EQ(difference(found, by_gl(next, 2.0F, 0.5F)), "");
  }
}

TEST_P(LiveChannelsOnGpu, IsReadBackWhenNeededInMemory) {
  const Fire burning = fire(2);
  burn(v_, 2.0F);
  hand_over(burning.fields);
  settled(v_);
  get_volume(CUMULET_ERROR_UNSUPPORTED);
  const Picture found = settled(v_);
  EXPECT_TRUE(shows_voxels());
  expect_same(newest(live_), alone(in_memory(burning)));
  EXPECT_EQ(difference(found, by_memory(burning, 2.0F)), "");
}

// Viewers that share a dynamic volume each compute the emission for their own medium.
TEST_F(LiveFireOnGpu, EachViewerUsesItsOwnMedium) {
  cumulet_shader_cache* programs = nullptr;
  const auto programs_desc = make_desc<cumulet_shader_cache_desc>();
  ASSERT_EQ(cumulet_shader_cache_create(&programs_desc, &programs, nullptr, 0), CUMULET_OK);
  const test::ProgramsRef kept(programs);
  std::array<ViewerPtr, 2> viewers;
  for (std::size_t i = 0; i < viewers.size(); ++i) {
    viewers[i] = test::make_viewer({.get_proc = test::FakeGl::get_proc,
                                    .user = &fake_,
                                    .samples = 2,
                                    .programs = programs,
                                    .build = CUMULET_BUILD_GPU});
    burn(viewers[i].get(), i == 0 ? 1.0F : 4.0F);
    ASSERT_EQ(cumulet_set_dynamic_volume(viewers[i].get(), live_.get()), CUMULET_OK);
  }
  for (const int step : {1, 2}) {
    const Fire burning = fire(step);
    const cumulet_gl_volume_desc state = state_of(burning.fields);
    ASSERT_EQ(cumulet_dynamic_volume_set_gl(viewers[0].get(), live_.get(), &state), CUMULET_OK);
    settled(viewers[0].get());
    settled(viewers[1].get());
    EXPECT_EQ(difference(settled(viewers[0].get()), by_gl(burning, 1.0F)), "");
    EXPECT_EQ(difference(settled(viewers[1].get()), by_gl(burning, 4.0F)), "");
  }
}

// If GL memory does not suffice for computing the emission, the fields are read back to main memory.
TEST_F(LiveFireOnGpu, FallsBackToMainMemoryWithoutGpuMemory) {
  const Fire burning = fire(2);
  burn(v_, 2.0F);
  hand_over(burning.fields);
  settled(v_);
  burn(v_, 3.0F);
  cumulet_frame_desc frame = target_.frame();
  frame.target = CUMULET_TARGET_NONE;
  fake_.fail_storage(true);
  cumulet_status status = CUMULET_OK;
  for (int i = 0; i < 100 && status == CUMULET_OK; ++i) {
    cumulet_wait(v_, 10.0);
    status = cumulet_render(v_, &frame, nullptr);
  }
  EXPECT_EQ(status, CUMULET_ERROR_OUT_OF_MEMORY);
  fake_.fail_storage(false);
  const Picture found = settled(v_);
  EXPECT_TRUE(shows_voxels());
  EXPECT_EQ(difference(found, by_memory(burning, 3.0F)), "");
}

// Each allocation fails once. The error is returned, and the next state is displayed.
TEST_F(LiveFireOnGpu, AnyFailedAllocationKeepsTheState) {
  const Fire first = fire(1);
  const Fire second = fire(2);
  const Picture in_gl = by_gl(second, 2.0F);
  const Picture in_memory = by_memory(second, 2.0F);
  cumulet_frame_desc frame = target_.frame();
  frame.target = CUMULET_TARGET_NONE;
  int failures = 0;
  int in_main_memory = 0;
  int successes = 0;  // since the last failure; other allocations of a frame are among them
  for (int allocation = 0; successes < 8 && !HasFailure(); ++allocation) {
    SCOPED_TRACE(allocation);
    auto desc = make_desc<cumulet_dynamic_volume_desc>();
    desc.gpu_resident = 1;
    live_ = make_live(desc);
    viewer_ = make(CUMULET_BUILD_GPU);
    v_ = viewer_.get();
    burn(v_, 2.0F);
    ASSERT_EQ(cumulet_set_dynamic_volume(v_, live_.get()), CUMULET_OK);
    hand_over(first.fields);
    settled(v_);
    const std::uint64_t before = handed();
    const cumulet_gl_volume_desc state = state_of(second.fields);
    fake_.fail_allocation(allocation);
    cumulet_status status = cumulet_dynamic_volume_set_gl(v_, live_.get(), &state);
    for (int i = 0; i < 1000 && status == CUMULET_OK && handed() == before; ++i)
      status = cumulet_render(v_, &frame, nullptr);
    fake_.fail_allocation(-1);
    const bool failed = status != CUMULET_OK;
    failures += failed ? 1 : 0;
    successes = failed ? 0 : successes + 1;
    if (failed) {
      EXPECT_EQ(status, CUMULET_ERROR_OUT_OF_MEMORY) << cumulet_last_error(v_);
      hand_over(second.fields);
    }
    const Picture found = settled(v_);
    in_main_memory += shows_voxels() ? 1 : 0;
    EXPECT_EQ(difference(found, shows_voxels() ? in_memory : in_gl), "");
  }
  EXPECT_GT(failures, 10);
  EXPECT_GT(in_main_memory, 3) << "what it gives off was not found";
}

// Boxes after a rejected state are rejected, even after the previous state's emission is recomputed.
TEST_F(LiveFireOnGpu, PartialUpdatesAfterARejectedStateAreRejected) {
  hand_over(fire(0).fields);
  settled(v_);
  const Fire bad = spoilt(fire(1), 0);
  hand_over(bad.fields);
  EXPECT_EQ(frames_until_failure(), CUMULET_ERROR_FILE);
  burn(v_, 4.0F);
  EXPECT_EQ(difference(settled(v_), by_gl(fire(0), 4.0F)), "");
  cumulet_gl_volume_desc boxes = state_of(bad.fields);
  const cumulet_voxel_box box{{0, 0, 0}, {9, 9, 9}};
  boxes.changed = &box;
  boxes.changed_count = 1;
  EXPECT_EQ(refusal(boxes, CUMULET_ERROR_INVALID_ARGUMENT), "smoke: there is no state to update");
}

// Hosts may call cumulet_cancel in any callback.
TEST_F(LiveFireOnGpu, CanBeCancelledFromCallbacks) {
  struct Host {
    std::atomic<cumulet_viewer*> viewer = nullptr;
    std::atomic<int> calls = 0;
  } host;
  viewer_ = test::make_viewer({.get_proc = test::FakeGl::get_proc,
                               .user = &fake_,
                               .update =
                                   [](void* user) {
                                     auto& of = *static_cast<Host*>(user);
                                     // Lets some of the work continue.
                                     if (of.viewer != nullptr && ++of.calls % 3 == 0) cumulet_cancel(of.viewer);
                                   },
                               .update_user = &host,
                               .samples = 2,
                               .build = CUMULET_BUILD_GPU});
  v_ = viewer_.get();
  ASSERT_EQ(cumulet_set_dynamic_volume(v_, live_.get()), CUMULET_OK);
  host.viewer = v_;
  cumulet_frame_desc frame = target_.frame();
  frame.target = CUMULET_TARGET_NONE;
  for (int step = 0; step < 6; ++step) {
    burn(v_, 1.0F + static_cast<float>(step));
    hand_over(fire(step).fields);
    for (int i = 0; i < 20; ++i) {
      ASSERT_EQ(cumulet_render(v_, &frame, nullptr), CUMULET_OK) << cumulet_last_error(v_);
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }
  host.viewer = nullptr;
  EXPECT_GT(host.calls, 6);
  const Fire last = fire(6);
  hand_over(last.fields);
  EXPECT_EQ(difference(settled(v_), by_gl(last, 6.0F)), "");
}

TEST_F(LiveFireOnGpu, NonFiniteValuesAreRejected) {
  const Fire good = fire(0);
  hand_over(good.fields);
  const Picture before = settled(v_);
  const Fire bad = spoilt(fire(0), 1);
  hand_over(bad.fields);
  EXPECT_EQ(frames_until_failure(), CUMULET_ERROR_FILE);
  EXPECT_STREQ(cumulet_last_error(v_), "smoke: temperature: non-finite value in the 8x8x8 brick at (0, 16, 8)");
  EXPECT_EQ(difference(settled(v_), before), "");
}

// Another context cannot access the voxels. It gets them through main memory.
TEST_F(LiveStatesOnGpu, IsShownInOtherContexts) {
  const Array array(CUMULET_VOXEL_FORMAT_R16F, simulated(CUMULET_CHANNEL_DENSITY, odd, 0));
  const Picture expected = reference(array.values);
  hand_over_density(array, types[1]);
  EXPECT_EQ(arrive(), 1U);
  EXPECT_EQ(difference(picture(), expected), "");
  headless::Context other = headless::Context::create(headless::Backend::automatic);
  const GladGLContext gl = test::load_gl(headless::Context::get_proc, &other);
  ViewerPtr viewer = test::make_viewer(
      {.get_proc = headless::Context::get_proc, .user = &other, .samples = 2, .build = CUMULET_BUILD_GPU});
  std::optional<test::HostTarget> target(std::in_place, gl, 32, 32);
  ASSERT_EQ(cumulet_set_dynamic_volume(viewer.get(), live_.get()), CUMULET_OK);
  const cumulet_frame_desc frame = target->frame();
  for (int i = 0; i < 100; ++i) {
    ASSERT_EQ(cumulet_wait(viewer.get(), 10.0), CUMULET_OK);
    ASSERT_EQ(cumulet_render(viewer.get(), &frame, nullptr), CUMULET_OK);
  }
  EXPECT_NE(difference(target->pixels(), expected), "");
  context_.make_current();
  EXPECT_EQ(arrive(), 1U);
  EXPECT_EQ(difference(picture(), expected), "");
  other.make_current();
  EXPECT_EQ(difference(test::drawn_once(viewer.get(), *target), expected), "");
  viewer.reset();
  target.reset();
  context_.make_current();
}

// Partial updates that follow after voxels were requested and before a frame has read them back.
TEST_F(LiveStatesOnGpu, PartialUpdatesApplyToAPendingReadBack) {
  const Type& type = types[1];
  const Array before(type.format, simulated(CUMULET_CHANNEL_DENSITY, odd, 0));
  const Array now(type.format, simulated(CUMULET_CHANNEL_DENSITY, odd, 1));
  std::vector<cumulet_voxel_box> boxes;
  for (const Sides& b : State::bricks(odd, now.values, before.values))
    boxes.push_back({{b[0], b[1], b[2]}, {b[0] + 7, b[1] + 7, b[2] + 7}});
  const GLuint name = objects_.texture(odd, type, before);
  const std::vector<cumulet_gl_field> fields{in_texture(CUMULET_CHANNEL_DENSITY, odd, name)};
  hand_over(fields);
  EXPECT_EQ(arrive(), 1U);
  hand_over(fields, {{{0, 0, 0}, {9, 9, 9}}});  // in transfer to GL
  get_volume(CUMULET_ERROR_UNSUPPORTED);
  objects_.put(name, odd, GL_RED, type.type, now.bytes.data());
  hand_over(fields, boxes);
  EXPECT_EQ(arrive(3), 3U);
  expect_same(newest(live_), alone(dense(odd, now.values)));
  EXPECT_EQ(difference(picture(), reference(now.values)), "");
}

// Partial updates through another viewer are rejected, and that viewer has no effect on the state.
TEST_F(LiveStatesOnGpu, PartialUpdatesThroughAnotherViewerAreRejected) {
  const Array array(CUMULET_VOXEL_FORMAT_R16F, simulated(CUMULET_CHANNEL_DENSITY, odd, 0));
  const std::vector fields{in_texture(CUMULET_CHANNEL_DENSITY, odd, objects_.texture(odd, types[1], array))};
  const Picture expected = reference(array.values);
  const ViewerPtr other = make(CUMULET_BUILD_GPU);
  const auto render = [&](cumulet_viewer* viewer) {
    cumulet_frame_desc frame = target_.frame();
    frame.target = CUMULET_TARGET_NONE;
    EXPECT_EQ(cumulet_render(viewer, &frame, nullptr), CUMULET_OK) << cumulet_last_error(viewer);
  };
  const cumulet_gl_volume_desc whole = state_of(fields);
  ASSERT_EQ(cumulet_set_dynamic_volume(v_, nullptr), CUMULET_OK);
  for (cumulet_viewer* viewer : {other.get(), v_}) {
    ASSERT_EQ(cumulet_dynamic_volume_set_gl(viewer, live_.get(), &whole), CUMULET_OK);
    for (int i = 0; i < 10; ++i) render(viewer);
  }
  ASSERT_EQ(cumulet_set_dynamic_volume(v_, live_.get()), CUMULET_OK);
  EXPECT_EQ(handed(), 2U);
  const cumulet_voxel_box box{{0, 0, 0}, {9, 9, 9}};
  cumulet_gl_volume_desc boxes = state_of(fields);
  boxes.changed = &box;
  boxes.changed_count = 1;
  EXPECT_EQ(cumulet_dynamic_volume_set_gl(other.get(), live_.get(), &boxes), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_STREQ(cumulet_last_error(other.get()), "smoke: other fields of it belong to another viewer's context");
  render(other.get());
  EXPECT_EQ(difference(picture(), expected), "");
  hand_over(fields, {box});
  EXPECT_EQ(arrive(), 1U);
  EXPECT_EQ(difference(picture(), expected), "");
  EXPECT_FALSE(shows_voxels());
}

// Viewers that share programs share the GPU-resident state, and each of them can read voxels back.
TEST_F(LiveStatesOnGpu, IsSharedByViewersWithSharedPrograms) {
  const Type& type = types[1];
  const Array before(type.format, simulated(CUMULET_CHANNEL_DENSITY, odd, 0));
  const Array now(type.format, simulated(CUMULET_CHANNEL_DENSITY, odd, 1));
  cumulet_shader_cache* programs = nullptr;
  const auto programs_desc = make_desc<cumulet_shader_cache_desc>();
  ASSERT_EQ(cumulet_shader_cache_create(&programs_desc, &programs, nullptr, 0), CUMULET_OK);
  const test::ProgramsRef kept(programs);
  const auto sharing = [&] {
    ViewerPtr viewer = test::make_viewer({.get_proc = test::FakeGl::get_proc,
                                          .user = &fake_,
                                          .samples = 2,
                                          .programs = programs,
                                          .build = CUMULET_BUILD_GPU});
    EXPECT_EQ(cumulet_set_dynamic_volume(viewer.get(), live_.get()), CUMULET_OK);
    return viewer;
  };
  viewer_ = sharing();
  v_ = viewer_.get();
  ViewerPtr other = sharing();
  const GLuint name = objects_.texture(odd, type, before);
  const std::vector<cumulet_gl_field> fields{in_texture(CUMULET_CHANNEL_DENSITY, odd, name)};
  hand_over(fields);
  EXPECT_EQ(arrive(), 1U);
  EXPECT_EQ(difference(picture(), reference(before.values)), "");
  EXPECT_EQ(difference(test::drawn_once(other.get(), target_), reference(before.values)), "");
  // Partial updates work through either viewer.
  objects_.put(name, odd, GL_RED, type.type, now.bytes.data());
  std::vector<cumulet_voxel_box> boxes;
  for (const Sides& b : State::bricks(odd, now.values, before.values))
    boxes.push_back({{b[0], b[1], b[2]}, {b[0] + 7, b[1] + 7, b[2] + 7}});
  std::swap(viewer_, other);
  v_ = viewer_.get();
  hand_over(fields, boxes);
  EXPECT_EQ(arrive(), 1U);
  EXPECT_EQ(difference(picture(), reference(now.values)), "");
  EXPECT_EQ(difference(test::drawn_once(other.get(), target_), reference(now.values)), "");
  EXPECT_EQ(handed(), 2U) << "nobody asked for voxels";
  // The state survives the viewer that submitted it. Another viewer can read it back.
  other.reset();
  EXPECT_EQ(difference(picture(), reference(now.values)), "");
  EXPECT_FALSE(shows_voxels());
  get_volume(CUMULET_ERROR_UNSUPPORTED);
  EXPECT_EQ(arrive(), 1U);
  expect_same(newest(live_), alone(dense(odd, now.values)));
  EXPECT_EQ(difference(picture(), reference(now.values)), "");
  // The last viewer frees it.
  ASSERT_EQ(cumulet_context_lost(v_), CUMULET_OK);
  EXPECT_EQ(test::FakeGl::strays(), 0U);
}

// One viewer has partial updates in transfer while another reads the rest back. The updates go to main memory too.
TEST_F(LiveStatesOnGpu, PartialUpdatesApplyToAnotherViewersReadBack) {
  const Type& type = types[1];
  const Array before(type.format, simulated(CUMULET_CHANNEL_DENSITY, odd, 0));
  Array now(type.format, simulated(CUMULET_CHANNEL_DENSITY, odd, 1));
  std::fill_n(now.values.begin(), now.values.size() / 2, 0.0F);  // empties bricks, too
  now = Array(type.format, now.values);
  cumulet_shader_cache* programs = nullptr;
  const auto programs_desc = make_desc<cumulet_shader_cache_desc>();
  ASSERT_EQ(cumulet_shader_cache_create(&programs_desc, &programs, nullptr, 0), CUMULET_OK);
  const test::ProgramsRef kept(programs);
  std::array<ViewerPtr, 2> viewers;
  for (ViewerPtr& viewer : viewers) {
    viewer = test::make_viewer({.get_proc = test::FakeGl::get_proc,
                                .user = &fake_,
                                .samples = 2,
                                .programs = programs,
                                .build = CUMULET_BUILD_GPU});
    ASSERT_EQ(cumulet_set_dynamic_volume(viewer.get(), live_.get()), CUMULET_OK);
  }
  const GLuint name = objects_.texture(odd, type, before);
  const std::vector<cumulet_gl_field> fields{in_texture(CUMULET_CHANNEL_DENSITY, odd, name)};
  viewer_ = std::move(viewers[0]);
  v_ = viewer_.get();
  hand_over(fields);
  EXPECT_EQ(arrive(), 1U);
  std::vector<cumulet_voxel_box> boxes;
  for (const Sides& b : State::bricks(odd, now.values, before.values))
    boxes.push_back({{b[0], b[1], b[2]}, {b[0] + 7, b[1] + 7, b[2] + 7}});
  objects_.put(name, odd, GL_RED, type.type, now.bytes.data());
  hand_over(fields, boxes);
  get_volume(CUMULET_ERROR_UNSUPPORTED);
  std::swap(viewer_, viewers[1]);
  v_ = viewer_.get();
  EXPECT_EQ(arrive(), 1U);
  expect_same(newest(live_), alone(dense(odd, before.values)));
  std::swap(viewer_, viewers[1]);
  v_ = viewer_.get();
  EXPECT_EQ(arrive(), 1U);
  expect_same(newest(live_), alone(dense(odd, now.values)));
  EXPECT_EQ(difference(picture(), reference(now.values)), "");
}

TEST_F(LiveStatesOnGpu, IsReleasedWithItsContext) {
  const Array first(CUMULET_VOXEL_FORMAT_R16F, simulated(CUMULET_CHANNEL_DENSITY, odd, 0));
  const Array second(CUMULET_VOXEL_FORMAT_R16F, simulated(CUMULET_CHANNEL_DENSITY, odd, 1));
  for (const bool lost : {false, true}) {
    SCOPED_TRACE(lost);
    hand_over_density(first, types[1]);
    EXPECT_EQ(arrive(), 1U);
    const Picture before = picture();
    ASSERT_EQ(lost ? cumulet_context_lost(v_) : cumulet_detach(v_), CUMULET_OK);
    ASSERT_EQ(cumulet_attach(v_, test::FakeGl::get_proc, &fake_), CUMULET_OK);
    // The state is lost with the context; the rest continues.
    EXPECT_NE(difference(picture(), before), "");
    EXPECT_EQ(get_volume(CUMULET_ERROR_UNSUPPORTED),
              "the volume's voxels were lost with their OpenGL context; set a new state");
    hand_over_density(second, types[1]);
    EXPECT_EQ(arrive(), 1U);
    EXPECT_EQ(difference(picture(), reference(second.values)), "");
    EXPECT_FALSE(shows_voxels());
  }
  EXPECT_EQ(test::FakeGl::strays(), 0U);
}

TEST_F(LiveStatesOnGpu, OutOfMemoryKeepsTheLastState) {
  const Array array(CUMULET_VOXEL_FORMAT_R16F, simulated(CUMULET_CHANNEL_DENSITY, odd, 0));
  const Picture expected = reference(array.values);
  hand_over_density(array, types[1]);
  fake_.fail_storage(true);
  cumulet_frame_desc frame = target_.frame();
  frame.target = CUMULET_TARGET_NONE;
  EXPECT_EQ(cumulet_render(v_, &frame, nullptr), CUMULET_ERROR_OUT_OF_MEMORY);
  fake_.fail_storage(false);
  hand_over_density(array, types[1]);
  EXPECT_EQ(arrive(), 1U);
  EXPECT_EQ(difference(picture(), expected), "");
}

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
      voxels.source = render::VoxelTexture{objects.texture(size, types[1], array), 0};
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
  const GLuint texture = objects.texture(odd, types[1], array);
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
  expect_same(newest(live), alone(dense(odd, array.values)));
}

CUMULET_ON_BACKENDS(GpuTransfers);

}  // namespace
