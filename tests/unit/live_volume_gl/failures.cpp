// States in GL memory that are not valid, lost contexts and missing memory.

#include <gtest/gtest.h>

#include <cstring>
#include <functional>
#include <limits>
#include <string>
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
using test::LiveStatesFromGl;
using test::newest;
using test::odd;
using test::simulated;
using test::small;
using test::State;
using test::state_of;
using test::ViewerPtr;
using test::voxel_types;
using Picture = std::vector<std::uint8_t>;

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

}  // namespace
