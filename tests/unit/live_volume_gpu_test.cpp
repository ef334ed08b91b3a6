// GPU-resident dynamic volumes from a host's textures and buffers.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
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
using test::LiveStatesOnGpu;
using test::make_desc;
using test::newest;
using test::odd;
using test::Sides;
using test::simulated;
using test::State;
using test::state_of;
using test::ViewerPtr;
using test::voxel_types;
using test::VoxelType;
using Picture = std::vector<std::uint8_t>;

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
    hand_over_density(Array(CUMULET_VOXEL_FORMAT_R32F, values), voxel_types[0]);
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
  hand_over_density(Array(CUMULET_VOXEL_FORMAT_R32F, values), voxel_types[0]);
  EXPECT_EQ(arrive(), 1U);
  EXPECT_EQ(difference(picture(), reference(without)), "");
}

TEST_F(LiveStatesOnGpu, EveryFormatGivesTheSameImage) {
  int step = 0;
  for (const VoxelType& type : voxel_types) {
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
  const VoxelType& type = voxel_types[1];
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
    Picture expected;
    std::function<void()> make;
  };
  const Picture interpolated = reference(array.values, CUMULET_INTERPOLATION_LINEAR);
  const std::vector<Need> needs{
      {"its voxels", expected, [&] { get_volume(CUMULET_ERROR_UNSUPPORTED); }},
      {"linear interpolation", interpolated, [&] { interpolate(v_, CUMULET_INTERPOLATION_LINEAR); }},
      {"a build of the processor's", expected,
       [&] {
         auto grid = make_desc<cumulet_grid_desc>();
         grid.build_device = CUMULET_BUILD_CPU;
         grid.interpolation = CUMULET_INTERPOLATION_NEAREST;
         EXPECT_EQ(cumulet_set_grid(v_, &grid), CUMULET_OK);
       }},
  };
  for (const Need& need : needs) {
    SCOPED_TRACE(need.name);
    SetUp();
    hand_over_density(array, voxel_types[1]);
    EXPECT_EQ(arrive(), 1U);
    picture();
    EXPECT_FALSE(shows_voxels());
    need.make();
    EXPECT_EQ(arrive(), 1U);  // the same state again, now in main memory
    expect_same_fields(newest(live_), alone(dense(odd, array.values)));
    EXPECT_EQ(difference(picture(), need.expected), "");
    EXPECT_TRUE(shows_voxels());
    const Array next(CUMULET_VOXEL_FORMAT_R8, simulated(CUMULET_CHANNEL_DENSITY, odd, 2));
    hand_over_density(next, voxel_types[3]);
    EXPECT_EQ(arrive(), 1U);
    expect_same_fields(newest(live_), alone(dense(odd, next.values)));
  }
}

cumulet_interpolation interpolation_in_use(cumulet_viewer* viewer) {
  cumulet_interpolation found{};
  EXPECT_EQ(cumulet_get_interpolation(viewer, &found), CUMULET_OK) << cumulet_last_error(viewer);
  return found;
}

void count_notes(void* user, cumulet_log_level level, const char* line) {
  if (level == CUMULET_LOG_INFO && std::string_view(line).find("interpolation") != std::string_view::npos)
    ++*static_cast<std::atomic<int>*>(user);
}

// The default is linear interpolation, except where it alone would bring voxels to main memory.
TEST_F(LiveStatesOnGpu, DefaultInterpolationLeavesVoxelsOnTheGpu) {
  static std::atomic<int> notes;
  notes = 0;
  const Array array(CUMULET_VOXEL_FORMAT_R16F, simulated(CUMULET_CHANNEL_DENSITY, odd, 1));
  viewer_ = test::make_viewer({.get_proc = test::FakeGl::get_proc,
                               .user = &fake_,
                               .log = count_notes,
                               .log_user = &notes,
                               .samples = 2,
                               .build = CUMULET_BUILD_GPU});
  v_ = viewer_.get();
  EXPECT_EQ(interpolation_in_use(v_), CUMULET_INTERPOLATION_AUTO) << "there is no grid";
  EXPECT_EQ(notes, 0);
  ASSERT_EQ(cumulet_set_dynamic_volume(v_, live_.get()), CUMULET_OK);
  hand_over_density(array, voxel_types[1]);
  EXPECT_EQ(arrive(), 1U);
  EXPECT_EQ(difference(picture(), reference(array.values)), "");
  EXPECT_EQ(interpolation_in_use(v_), CUMULET_INTERPOLATION_NEAREST);
  EXPECT_FALSE(shows_voxels());
  // Other volumes in the same viewer are interpolated.
  test::picture_of(v_, alone(dense(odd, array.values)).get(), target_);
  EXPECT_EQ(interpolation_in_use(v_), CUMULET_INTERPOLATION_LINEAR);
  // So is this one in grids that need its voxels in main memory.
  ASSERT_EQ(cumulet_set_dynamic_volume(v_, live_.get()), CUMULET_OK);
  auto bricks = make_desc<cumulet_grid_desc>();
  bricks.build_device = CUMULET_BUILD_GPU;
  bricks.type = CUMULET_GRID_BRICKS;
  ASSERT_EQ(cumulet_set_grid(v_, &bricks), CUMULET_OK);
  EXPECT_EQ(arrive(), 1U);
  const ViewerPtr other = make();
  ASSERT_EQ(cumulet_set_grid(other.get(), &bricks), CUMULET_OK);
  EXPECT_EQ(difference(picture(), test::picture_of(other.get(), alone(dense(odd, array.values)).get(), target_)), "");
  EXPECT_EQ(interpolation_in_use(v_), CUMULET_INTERPOLATION_LINEAR);
  EXPECT_TRUE(shows_voxels());
  // The settings decide, not where the voxels are now.
  interpolate(v_, CUMULET_INTERPOLATION_AUTO);
  EXPECT_EQ(difference(picture(), reference(array.values)), "");
  EXPECT_EQ(interpolation_in_use(v_), CUMULET_INTERPOLATION_NEAREST);
  EXPECT_EQ(notes, 1);
}

// Trilinear cells need interpolation, and all cells of a scene are of one kind.
TEST_F(LiveStatesOnGpu, TrilinearCellsShowItBesideAnotherVolume) {
  const Array array(CUMULET_VOXEL_FORMAT_R16F, simulated(CUMULET_CHANNEL_DENSITY, odd, 1));
  const test::VolumeRef own = alone(dense(odd, array.values));
  const test::VolumeRef second = alone(dense(odd, simulated(CUMULET_CHANNEL_DENSITY, odd, 5)));
  auto beside = make_desc<cumulet_instance_desc>();
  beside.volume = second.get();
  for (const int i : {0, 5, 10, 15}) beside.to_world[i] = 1.0;
  beside.to_world[12] = 4.0;
  const test::InstanceRef instance = test::make_instance(beside);
  auto grid = make_desc<cumulet_grid_desc>();
  grid.build_device = CUMULET_BUILD_GPU;
  grid.cells = CUMULET_CELLS_TRILINEAR;
  const auto prepare = [&](cumulet_viewer* viewer) {
    EXPECT_EQ(cumulet_set_grid(viewer, &grid), CUMULET_OK);
    EXPECT_EQ(cumulet_add_instance(viewer, instance.get()), CUMULET_OK);
  };
  const ViewerPtr other = make(CUMULET_BUILD_GPU);
  prepare(other.get());
  const Picture expected = test::picture_of(other.get(), own.get(), target_);
  prepare(v_);
  hand_over_density(array, voxel_types[1]);
  arrive();
  EXPECT_EQ(difference(picture(), expected), "");
  EXPECT_EQ(interpolation_in_use(v_), CUMULET_INTERPOLATION_LINEAR);
}

TEST_F(LiveStatesOnGpu, DefaultInterpolationOfAnInstanceLeavesVoxelsOnTheGpu) {
  const Array array(CUMULET_VOXEL_FORMAT_R16F, simulated(CUMULET_CHANNEL_DENSITY, odd, 1));
  ASSERT_EQ(cumulet_set_dynamic_volume(v_, nullptr), CUMULET_OK);
  interpolate(v_, CUMULET_INTERPOLATION_AUTO);
  auto desc = make_desc<cumulet_instance_desc>();
  desc.dynamic_volume = live_.get();
  const test::InstanceRef instance = test::make_instance(desc);
  ASSERT_EQ(cumulet_add_instance(v_, instance.get()), CUMULET_OK);
  hand_over_density(array, voxel_types[1]);
  auto info = make_desc<cumulet_dynamic_volume_info>();
  render_until([&] {
    cumulet_get_instance_dynamic_volume_info(v_, instance.get(), &info);
    return info.ready_update == 1;
  });
  ASSERT_EQ(info.ready_update, 1U);
  EXPECT_EQ(interpolation_in_use(v_), CUMULET_INTERPOLATION_NEAREST);
  const test::VolumeRef own = alone(dense(odd, array.values));
  test::picture_of(v_, own.get(), target_);
  EXPECT_EQ(interpolation_in_use(v_), CUMULET_INTERPOLATION_LINEAR) << "of the viewer's own volume";
  EXPECT_NE(get_volume(CUMULET_ERROR_UNSUPPORTED).find("on the GPU"), std::string::npos) << "the instance's is there";
}

// Rejected states leave the current one.
TEST_F(LiveStatesOnGpu, RejectedStateKeepsTheLastValidState) {
  const Array good(CUMULET_VOXEL_FORMAT_R16F, simulated(CUMULET_CHANNEL_DENSITY, odd, 0));
  hand_over_density(good, voxel_types[1]);
  arrive();
  const Picture before = picture();
  auto values = good.values;
  values[State::at({3, 20, 11}, odd)] = std::numeric_limits<float>::infinity();
  for (const std::size_t type : {0, 1}) {
    hand_over_density(Array(voxel_types.at(type).format, values), voxel_types.at(type));
    EXPECT_EQ(frames_until_failure(), CUMULET_ERROR_FILE);
    EXPECT_STREQ(cumulet_last_error(v_), "smoke: density: non-finite value in the 8x8x8 brick at (0, 16, 8)");
    EXPECT_EQ(difference(target_.pixels(), before), "");
    EXPECT_EQ(handed(), 1U);
    // Boxes after a rejected state have no state to update.
    const std::vector fields{in_texture(CUMULET_CHANNEL_DENSITY, odd, objects_.texture(odd, voxel_types[1], good))};
    cumulet_gl_volume_desc boxes = state_of(fields);
    const cumulet_voxel_box box{{0, 0, 0}, {9, 9, 9}};
    boxes.changed = &box;
    boxes.changed_count = 1;
    EXPECT_EQ(refusal(boxes, CUMULET_ERROR_INVALID_ARGUMENT), "smoke: there is no state to update");
  }
  hand_over_density(good, voxel_types[1]);
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
  hand_over_density(array, voxel_types[1]);
  EXPECT_EQ(arrive(), 1U);
  EXPECT_EQ(difference(picture(), expected), "");
  hand_over_density(nothing, voxel_types[1]);
  EXPECT_EQ(arrive(), 1U);
  EXPECT_NE(difference(picture(), expected), "");
  cumulet_gl_field apart = in_texture(CUMULET_CHANNEL_ANISOTROPY, odd, objects_.texture(odd, voxel_types[1], ahead));
  apart.index_to_world[12] += 8.0 * apart.index_to_world[0];
  hand_over({in_texture(CUMULET_CHANNEL_DENSITY, odd, objects_.texture(odd, voxel_types[1], array)), apart});
  EXPECT_EQ(arrive(), 1U);
  State both = dense(odd, array.values);
  both.dense(CUMULET_CHANNEL_ANISOTROPY, odd, ahead.values).last_dense().index_to_world[12] = apart.index_to_world[12];
  expect_same_fields(newest(live_), alone(both));
  hand_over_density(array, voxel_types[1]);
  EXPECT_EQ(arrive(), 1U);
  EXPECT_EQ(difference(picture(), expected), "");
  EXPECT_FALSE(shows_voxels());
  const State whole = dense(odd, array.values);
  const cumulet_volume_fields_desc desc = whole.desc();
  ASSERT_EQ(cumulet_dynamic_volume_set(live_.get(), &desc, nullptr, 0), CUMULET_OK);
  EXPECT_EQ(difference(picture(), expected), "");
  EXPECT_TRUE(shows_voxels());
}

// Another context cannot access the voxels. It gets them through main memory.
TEST_F(LiveStatesOnGpu, IsShownInOtherContexts) {
  const Array array(CUMULET_VOXEL_FORMAT_R16F, simulated(CUMULET_CHANNEL_DENSITY, odd, 0));
  const Picture expected = reference(array.values);
  hand_over_density(array, voxel_types[1]);
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
  const VoxelType& type = voxel_types[1];
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
  expect_same_fields(newest(live_), alone(dense(odd, now.values)));
  EXPECT_EQ(difference(picture(), reference(now.values)), "");
}

// Partial updates through another viewer are rejected, and that viewer has no effect on the state.
TEST_F(LiveStatesOnGpu, PartialUpdatesThroughAnotherViewerAreRejected) {
  const Array array(CUMULET_VOXEL_FORMAT_R16F, simulated(CUMULET_CHANNEL_DENSITY, odd, 0));
  const std::vector fields{in_texture(CUMULET_CHANNEL_DENSITY, odd, objects_.texture(odd, voxel_types[1], array))};
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
  const VoxelType& type = voxel_types[1];
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
  expect_same_fields(newest(live_), alone(dense(odd, now.values)));
  EXPECT_EQ(difference(picture(), reference(now.values)), "");
  // The last viewer frees it.
  ASSERT_EQ(cumulet_context_lost(v_), CUMULET_OK);
  EXPECT_EQ(test::FakeGl::strays(), 0U);
}

// One viewer has partial updates in transfer while another reads the rest back. The updates go to main memory too.
TEST_F(LiveStatesOnGpu, PartialUpdatesApplyToAnotherViewersReadBack) {
  const VoxelType& type = voxel_types[1];
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
  expect_same_fields(newest(live_), alone(dense(odd, before.values)));
  std::swap(viewer_, viewers[1]);
  v_ = viewer_.get();
  EXPECT_EQ(arrive(), 1U);
  expect_same_fields(newest(live_), alone(dense(odd, now.values)));
  EXPECT_EQ(difference(picture(), reference(now.values)), "");
}

TEST_F(LiveStatesOnGpu, IsReleasedWithItsContext) {
  const Array first(CUMULET_VOXEL_FORMAT_R16F, simulated(CUMULET_CHANNEL_DENSITY, odd, 0));
  const Array second(CUMULET_VOXEL_FORMAT_R16F, simulated(CUMULET_CHANNEL_DENSITY, odd, 1));
  for (const bool lost : {false, true}) {
    SCOPED_TRACE(lost);
    hand_over_density(first, voxel_types[1]);
    EXPECT_EQ(arrive(), 1U);
    const Picture before = picture();
    ASSERT_EQ(lost ? cumulet_context_lost(v_) : cumulet_detach(v_), CUMULET_OK);
    ASSERT_EQ(cumulet_attach(v_, test::FakeGl::get_proc, &fake_), CUMULET_OK);
    // The state is lost with the context; the rest continues.
    EXPECT_NE(difference(picture(), before), "");
    EXPECT_EQ(get_volume(CUMULET_ERROR_UNSUPPORTED),
              "the volume's voxels were lost with their OpenGL context; set a new state");
    hand_over_density(second, voxel_types[1]);
    EXPECT_EQ(arrive(), 1U);
    EXPECT_EQ(difference(picture(), reference(second.values)), "");
    EXPECT_FALSE(shows_voxels());
  }
  EXPECT_EQ(test::FakeGl::strays(), 0U);
}

TEST_F(LiveStatesOnGpu, OutOfMemoryKeepsTheLastState) {
  const Array array(CUMULET_VOXEL_FORMAT_R16F, simulated(CUMULET_CHANNEL_DENSITY, odd, 0));
  const Picture expected = reference(array.values);
  hand_over_density(array, voxel_types[1]);
  fake_.fail_storage(true);
  cumulet_frame_desc frame = target_.frame();
  frame.target = CUMULET_TARGET_NONE;
  EXPECT_EQ(cumulet_render(v_, &frame, nullptr), CUMULET_ERROR_OUT_OF_MEMORY);
  fake_.fail_storage(false);
  hand_over_density(array, voxel_types[1]);
  EXPECT_EQ(arrive(), 1U);
  EXPECT_EQ(difference(picture(), expected), "");
}

}  // namespace
