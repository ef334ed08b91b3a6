// Sequences in the C API: rejected arguments, handling of broken frames, and frames that are identical however they are
// reached.

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <thread>
#include <vector>

#include "support/c_sequence.hpp"

namespace {

using cumulet::test::CameraRef;
using cumulet::test::CSequence;
using cumulet::test::difference;
using cumulet::test::HostTarget;
using cumulet::test::make_desc;
using cumulet::test::make_sequence;
using cumulet::test::SequenceRef;
using cumulet::test::ViewerPtr;
using cumulet::test::VolumeRef;
using Picture = std::vector<std::uint8_t>;

TEST_F(CSequence, InvalidInputGivesAOneLineError) {
  std::array<char, 256> error{};
  cumulet_sequence* out = nullptr;
  std::array<const char*, 2> paths{"a.vdb", nullptr};
  auto desc = make_desc<cumulet_sequence_desc>();
  const auto refused = [&](const char* cause) {
    EXPECT_EQ(cumulet_sequence_create(&desc, &out, error.data(), error.size()), CUMULET_ERROR_INVALID_ARGUMENT);
    EXPECT_STREQ(error.data(), cause);
    EXPECT_EQ(out, nullptr);
  };
  refused("cumulet_sequence_desc.count is not from 1 to 1000000");
  desc.count = 2;
  refused("paths are NULL");
  desc.paths = paths.data();
  refused("cumulet_sequence_desc.paths[1] is NULL or empty");
  desc.count = 1;
  auto file = make_desc<cumulet_volume_file_desc>();
  file.to_world[0] = 1.0;
  desc.file = &file;
  refused("to_world is not affine");

  const SequenceRef sequence = make_sequence(clip_.paths());
  auto playback = make_desc<cumulet_playback_desc>();
  const auto unplayable = [&] {
    return cumulet_sequence_set_playback(sequence.get(), &playback) == CUMULET_ERROR_INVALID_ARGUMENT;
  };
  EXPECT_FALSE(unplayable());
  playback.first_frame = count;
  EXPECT_TRUE(unplayable());
  playback.first_frame = 3;
  playback.frame_count = 5;
  EXPECT_TRUE(unplayable());
  playback.frame_count = 4;
  EXPECT_FALSE(unplayable());
  playback.frames_per_second = -1.0;
  EXPECT_TRUE(unplayable());
  playback.frames_per_second = 10.0;
  playback.offset_seconds = NAN;
  EXPECT_TRUE(unplayable());
  EXPECT_EQ(cumulet_sequence_set_playback(nullptr, &playback), CUMULET_ERROR_INVALID_ARGUMENT);
  for (const double bad : {-0.5, count - 0.5, double(NAN)})
    EXPECT_EQ(cumulet_sequence_set_frame(sequence.get(), bad), CUMULET_ERROR_INVALID_ARGUMENT) << bad;
  for (const double bad : {2e9, double(NAN), std::numeric_limits<double>::infinity()})
    EXPECT_EQ(cumulet_sequence_set_time(sequence.get(), bad), CUMULET_ERROR_INVALID_ARGUMENT) << bad;
  std::uint32_t frame = 99;
  double seconds = 99.0;
  EXPECT_EQ(cumulet_sequence_get_frame_at(sequence.get(), 0.0, nullptr), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(cumulet_sequence_get_time_of(sequence.get(), count, &seconds), CUMULET_ERROR_INVALID_ARGUMENT);
  // Rejected calls changed nothing: frames 3 to 6 at 24 per second.
  EXPECT_EQ(cumulet_sequence_get_frame_at(sequence.get(), 2.0 / 24.0, &frame), CUMULET_OK);
  EXPECT_EQ(frame, 5U);
  EXPECT_EQ(cumulet_sequence_get_time_of(sequence.get(), 5, &seconds), CUMULET_OK);
  EXPECT_DOUBLE_EQ(seconds, 2.0 / 24.0);

  const ViewerPtr viewer = make();
  auto info = make_desc<cumulet_sequence_info>();
  EXPECT_EQ(cumulet_get_sequence_info(viewer.get(), &info, nullptr, 0), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_STREQ(cumulet_last_error(viewer.get()), "the viewer shows no sequence");
  ASSERT_EQ(cumulet_set_sequence(viewer.get(), sequence.get()), CUMULET_OK);
  std::array<std::uint8_t, count> states{};
  EXPECT_EQ(cumulet_get_sequence_info(viewer.get(), &info, states.data(), count - 1), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_STREQ(cumulet_last_error(viewer.get()), "the sequence has 7 frames");
  EXPECT_EQ(cumulet_get_sequence_frame(viewer.get(), count, error.data(), error.size()),
            CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(cumulet_get_sequence_frame(viewer.get(), 0, nullptr, 0), CUMULET_ERROR_INVALID_ARGUMENT);
}

TEST_F(CSequence, PlaybackSettingsControlInterpolation) {
  const SequenceRef sequence = make_sequence(clip_.paths());
  auto playback = make_desc<cumulet_playback_desc>();
  const auto refused = [&](const char* what) {
    EXPECT_EQ(cumulet_sequence_set_playback(sequence.get(), &playback), CUMULET_ERROR_INVALID_ARGUMENT) << what;
  };
  constexpr int none_of_them = 7;
  std::memcpy(&playback.interpolation, &none_of_them, sizeof playback.interpolation);
  refused("an unknown way");
  playback.interpolation = CUMULET_FRAME_INTERPOLATION_BLEND;
  playback.subframes = 1001;
  refused("too many");
  playback.subframes = 4;
  playback.velocity_scale = NAN;
  refused("no number");
  playback.velocity_scale = 0.0;
  ASSERT_EQ(cumulet_sequence_set_playback(sequence.get(), &playback), CUMULET_OK);
  // The default of subframes fits the longest sequence, too.
  const SequenceRef longest = make_sequence(std::vector<std::string>(300'000, clip_.paths().front()));
  playback.subframes = 0;
  EXPECT_EQ(cumulet_sequence_set_playback(longest.get(), &playback), CUMULET_OK);
  playback.subframes = 4;
  EXPECT_EQ(cumulet_sequence_set_playback(longest.get(), &playback), CUMULET_ERROR_INVALID_ARGUMENT);

  const ViewerPtr viewer = make();
  ASSERT_EQ(cumulet_set_sequence(viewer.get(), sequence.get()), CUMULET_OK);
  const auto at = [&](double position) {
    EXPECT_EQ(cumulet_sequence_set_frame(sequence.get(), position), CUMULET_OK);
    return picture(viewer.get());
  };
  const Picture second = at(2.0);
  EXPECT_EQ(difference(second, alone(2)), "");
  const Picture half = at(2.5);
  EXPECT_NE(difference(half, second), "");
  cumulet_sequence_info info = info_of(viewer.get());
  EXPECT_EQ(info.requested_frame, 2U);
  EXPECT_EQ(info.requested_position, 2.5);
  EXPECT_EQ(info.displayed_frame, 2U);
  EXPECT_EQ(info.displayed_position, 2.5);
  // The image stays until the next step. It is the same when played, scrubbed to or rebuilt.
  EXPECT_EQ(difference(at(2.7), half), "");
  EXPECT_EQ(info_of(viewer.get()).requested_position, 2.5);
  EXPECT_NE(difference(at(2.75), half), "");
  ASSERT_EQ(cumulet_sequence_set_time(sequence.get(), 2.5 / 24.0), CUMULET_OK);
  EXPECT_EQ(difference(picture(viewer.get()), half), "");
  ASSERT_EQ(cumulet_rebuild(viewer.get()), CUMULET_OK);
  EXPECT_EQ(difference(picture(viewer.get()), half), "");
  // Whole frames are not interpolated.
  for (const int frame : {0, 3, 6}) EXPECT_EQ(difference(at(frame), alone(frame)), "") << frame;
  playback.interpolation = CUMULET_FRAME_INTERPOLATION_NONE;
  ASSERT_EQ(cumulet_sequence_set_playback(sequence.get(), &playback), CUMULET_OK);
  EXPECT_EQ(difference(at(2.5), second), "");
  EXPECT_EQ(info_of(viewer.get()).requested_position, 2.0);
}

// Played, scrubbed to, or loaded separately: bit-identical.
TEST_F(CSequence, FrameIsBitIdenticalHoweverItWasReached) {
  clip_.empty(1);
  clip_.with_flame(4);
  const SequenceRef sequence = make_sequence(clip_.paths());
  const ViewerPtr viewer = make();
  ASSERT_EQ(cumulet_set_sequence(viewer.get(), sequence.get()), CUMULET_OK);
  for (const int frame : {5, 0, 1, 2, 3, 4, 5, 6, 3, 1}) {
    ASSERT_EQ(cumulet_sequence_set_time(sequence.get(), frame / 24.0), CUMULET_OK);
    const Picture found = picture(viewer.get());
    EXPECT_EQ(difference(found, alone(frame)), "") << frame;
    const cumulet_sequence_info info = info_of(viewer.get());
    EXPECT_EQ(info.requested_frame, std::uint32_t(frame));
    EXPECT_EQ(info.is_displayed, 1);
    EXPECT_EQ(info.displayed_frame, std::uint32_t(frame));
  }
  EXPECT_TRUE(is_cached(viewer.get()));
  EXPECT_EQ(info_of(viewer.get()).ready_frames, std::uint32_t(count));
  EXPECT_GT(info_of(viewer.get()).bytes, 10'000U);
}

// GPU-built grids of frames, one after another, each with its own lattice.
TEST_F(CSequence, FramesMatchWithGpuBuiltGrids) {
  clip_.with_flame(2);
  const SequenceRef sequence = make_sequence(clip_.paths());
  const ViewerPtr viewer = make(CUMULET_BUILD_GPU);
  ASSERT_EQ(cumulet_set_sequence(viewer.get(), sequence.get()), CUMULET_OK);
  Picture before;
  for (const int frame : {3, 1, 2, 3}) {
    ASSERT_EQ(cumulet_sequence_set_time(sequence.get(), frame / 24.0), CUMULET_OK);
    const Picture found = picture(viewer.get());
    const ViewerPtr single = make(CUMULET_BUILD_GPU);
    ASSERT_EQ(cumulet_load_volume(single.get(), clip_.path(frame).c_str(), nullptr), CUMULET_OK);
    EXPECT_EQ(difference(found, picture(single.get())), "") << frame;
    EXPECT_NE(found, std::exchange(before, found)) << frame;
    auto stats = make_desc<cumulet_stats>();
    ASSERT_EQ(cumulet_get_stats(viewer.get(), &stats), CUMULET_OK);
    EXPECT_GT(stats.cells, 100U) << frame;
  }
}

TEST_F(CSequence, ReportsSkippedFrames) {
  clip_.remove(2);
  clip_.corrupt(3);
  const SequenceRef sequence = make_sequence(clip_.paths());
  const ViewerPtr viewer = make();
  ASSERT_EQ(cumulet_set_sequence(viewer.get(), sequence.get()), CUMULET_OK);
  const Picture before = alone(1);
  for (const int frame : {1, 2, 3}) {
    ASSERT_EQ(cumulet_sequence_set_frame(sequence.get(), frame), CUMULET_OK);
    EXPECT_EQ(difference(picture(viewer.get()), before), "") << frame;
    EXPECT_EQ(info_of(viewer.get()).displayed_frame, 1U);
    EXPECT_EQ(info_of(viewer.get()).requested_frame, std::uint32_t(frame));
  }
  ASSERT_TRUE(is_cached(viewer.get()));
  std::array<std::uint8_t, count> states{};
  auto info = make_desc<cumulet_sequence_info>();
  ASSERT_EQ(cumulet_get_sequence_info(viewer.get(), &info, states.data(), states.size()), CUMULET_OK);
  EXPECT_EQ(info.failed_frames, 2U);
  constexpr std::uint8_t ready = CUMULET_FRAME_READY;
  constexpr std::uint8_t failed = CUMULET_FRAME_FAILED;
  EXPECT_EQ(states, (std::array<std::uint8_t, count>{ready, ready, failed, failed, ready, ready, ready}));
  std::array<char, 512> cause{};
  ASSERT_EQ(cumulet_get_sequence_frame(viewer.get(), 3, cause.data(), cause.size()), CUMULET_OK);
  EXPECT_EQ(std::string(cause.data()).rfind(clip_.path(3) + ": ", 0), 0U) << cause.data();
  ASSERT_EQ(cumulet_get_sequence_frame(viewer.get(), 4, cause.data(), cause.size()), CUMULET_OK);
  EXPECT_STREQ(cause.data(), "");
  EXPECT_EQ(warnings_.lines.size(), 2U);
}

TEST_F(CSequence, SequenceWithoutReadableFramesKeepsTheOldVolume) {
  const ViewerPtr viewer = make();
  ASSERT_EQ(cumulet_load_volume(viewer.get(), clip_.path(0).c_str(), nullptr), CUMULET_OK);
  const Picture before = picture(viewer.get());
  const SequenceRef none = make_sequence({"not-there.1.vdb", "not-there.2.vdb"});
  ASSERT_EQ(cumulet_set_sequence(viewer.get(), none.get()), CUMULET_OK);
  EXPECT_EQ(cumulet_wait(viewer.get(), -1.0), CUMULET_ERROR_FILE);
  EXPECT_EQ(std::string(cumulet_last_error(viewer.get())).rfind("not-there.1.vdb: ", 0), 0U);
  auto progress = make_desc<cumulet_progress>();
  ASSERT_EQ(cumulet_get_progress(viewer.get(), &progress), CUMULET_OK);
  EXPECT_EQ(progress.volume_status, CUMULET_ERROR_FILE);
  auto result = make_desc<cumulet_frame_result>();
  const auto frame = target_.frame();
  target_.clear({0.0F, 0.0F, 0.0F, 0.0F});
  ASSERT_EQ(cumulet_render(viewer.get(), &frame, &result), CUMULET_OK);
  EXPECT_NE(result.flags & CUMULET_RENDER_FAILED, 0U);
  EXPECT_EQ(difference(target_.pixels(), before), "");
  EXPECT_EQ(info_of(viewer.get()).is_displayed, 0);
  // The next request clears the failure.
  ASSERT_EQ(cumulet_load_volume(viewer.get(), clip_.path(0).c_str(), nullptr), CUMULET_OK);
  EXPECT_EQ(difference(picture(viewer.get()), before), "");
}

// One density scale, one camera and one ground plane for all frames, derived from the largest one.
TEST_F(CSequence, ScaleCameraAndGroundAreTheSameForAllFrames) {
  std::vector<std::uintmax_t> sizes;
  for (const std::string& path : clip_.paths()) sizes.push_back(std::filesystem::file_size(path));
  const auto largest = static_cast<std::uint32_t>(std::ranges::max_element(sizes) - sizes.begin());
  auto file = make_desc<cumulet_volume_file_desc>();
  file.suggested_density_scale = 1;
  const SequenceRef sequence = make_sequence(clip_.paths(), &file);
  const auto camera_of = [](cumulet_viewer* viewer) {
    cumulet_camera* camera = nullptr;
    EXPECT_EQ(cumulet_get_camera(viewer, &camera), CUMULET_OK);
    const CameraRef owner(camera);
    auto desc = make_desc<cumulet_camera_desc>();
    EXPECT_EQ(cumulet_camera_get(camera, &desc), CUMULET_OK);
    return std::array{desc.eye[0], desc.eye[1], desc.eye[2], desc.target[0], desc.target[1], desc.target[2]};
  };
  const auto prepare = [&](cumulet_viewer* viewer) {
    cumulet_camera* fits = nullptr;
    const auto desc = make_desc<cumulet_camera_desc>();
    EXPECT_EQ(cumulet_camera_create(&desc, &fits), CUMULET_OK);
    const CameraRef owner(fits);
    EXPECT_EQ(cumulet_set_camera(viewer, fits), CUMULET_OK);
    auto ground = make_desc<cumulet_ground_desc>();
    ground.mode = CUMULET_GROUND_BELOW;
    EXPECT_EQ(cumulet_set_ground(viewer, &ground), CUMULET_OK);
  };
  const ViewerPtr single = make();
  prepare(single.get());
  file.path = clip_.path(static_cast<int>(largest)).c_str();
  ASSERT_EQ(cumulet_load_volume_file(single.get(), &file), CUMULET_OK);
  const Picture largest_alone = picture(single.get());

  const ViewerPtr viewer = make();
  prepare(viewer.get());
  ASSERT_EQ(cumulet_set_sequence(viewer.get(), sequence.get()), CUMULET_OK);
  for (const std::uint32_t frame : {0U, 6U, 3U, largest}) {
    ASSERT_EQ(cumulet_sequence_set_frame(sequence.get(), frame), CUMULET_OK);
    const Picture found = picture(viewer.get());
    EXPECT_EQ(camera_of(viewer.get()), camera_of(single.get())) << frame;
    if (frame == largest) {
      EXPECT_EQ(difference(found, largest_alone), "");
    }
  }
  cumulet_volume* volume = nullptr;
  ASSERT_EQ(cumulet_get_volume(single.get(), &volume), CUMULET_OK);
  const VolumeRef owner(volume);
  double scale = 0.0;
  ASSERT_EQ(cumulet_volume_suggest_density_scale(volume, &scale), CUMULET_OK);
  EXPECT_EQ(info_of(viewer.get()).suggested_density_scale, scale);
  auto stats = make_desc<cumulet_stats>();
  auto wanted = make_desc<cumulet_stats>();
  ASSERT_EQ(cumulet_get_stats(viewer.get(), &stats), CUMULET_OK);
  ASSERT_EQ(cumulet_get_stats(single.get(), &wanted), CUMULET_OK);
  EXPECT_TRUE(std::ranges::equal(stats.bounds_max, wanted.bounds_max));
}

TEST_F(CSequence, VolumeAndSequenceReplaceEachOther) {
  const ViewerPtr viewer = make();
  const Picture first = alone(0);
  const Picture third = alone(2);
  SequenceRef sequence = make_sequence(clip_.paths());
  ASSERT_EQ(cumulet_set_sequence(viewer.get(), sequence.get()), CUMULET_OK);
  EXPECT_EQ(difference(picture(viewer.get()), first), "");
  cumulet_volume* volume = nullptr;
  ASSERT_EQ(cumulet_get_volume(viewer.get(), &volume), CUMULET_OK);
  ASSERT_NE(volume, nullptr);
  const VolumeRef owner(volume);
  ASSERT_EQ(cumulet_load_volume(viewer.get(), clip_.path(2).c_str(), nullptr), CUMULET_OK);
  EXPECT_EQ(difference(picture(viewer.get()), third), "");
  auto info = make_desc<cumulet_sequence_info>();
  EXPECT_EQ(cumulet_get_sequence_info(viewer.get(), &info, nullptr, 0), CUMULET_ERROR_INVALID_ARGUMENT);
  ASSERT_EQ(cumulet_set_sequence(viewer.get(), nullptr), CUMULET_OK);  // no sequence
  EXPECT_EQ(difference(picture(viewer.get()), third), "");
  ASSERT_EQ(cumulet_set_sequence(viewer.get(), sequence.get()), CUMULET_OK);
  EXPECT_EQ(difference(picture(viewer.get()), first), "");
  ASSERT_EQ(cumulet_set_volume(viewer.get(), volume), CUMULET_OK);
  EXPECT_EQ(difference(picture(viewer.get()), first), "");
  ASSERT_EQ(cumulet_set_sequence(viewer.get(), sequence.get()), CUMULET_OK);
  EXPECT_EQ(cumulet_wait(viewer.get(), -1.0), CUMULET_OK);
  sequence.reset();  // the viewer keeps a reference
  EXPECT_EQ(difference(picture(viewer.get()), first), "");
  ASSERT_EQ(cumulet_set_sequence(viewer.get(), nullptr), CUMULET_OK);
  double box[6];
  EXPECT_EQ(cumulet_get_bounds(viewer.get(), box, box + 3), CUMULET_ERROR_INVALID_ARGUMENT);
}

TEST_F(CSequence, ContinuesAfterAnUnreadableVolume) {
  const SequenceRef sequence = make_sequence(clip_.paths());
  const ViewerPtr viewer = make();
  ASSERT_EQ(cumulet_set_sequence(viewer.get(), sequence.get()), CUMULET_OK);
  picture(viewer.get());
  ASSERT_EQ(cumulet_load_volume(viewer.get(), "missing.vdb", nullptr), CUMULET_OK);
  EXPECT_EQ(cumulet_wait(viewer.get(), -1.0), CUMULET_ERROR_FILE);
  EXPECT_EQ(std::string(cumulet_last_error(viewer.get())).rfind("missing.vdb: ", 0), 0U);
  EXPECT_EQ(info_of(viewer.get()).frames, std::uint32_t(count));
  ASSERT_EQ(cumulet_sequence_set_frame(sequence.get(), 4.0), CUMULET_OK);
  auto frame = target_.frame();
  int calls = 0;
  while (info_of(viewer.get()).displayed_frame != 4U && ++calls < 2000)
    ASSERT_EQ(cumulet_render(viewer.get(), &frame, nullptr), CUMULET_OK);
  EXPECT_LT(calls, 2000);
  // A changed setting applies to all frames and clears the failure.
  auto grid = make_desc<cumulet_grid_desc>();
  grid.threshold = 0.02;
  grid.cells = CUMULET_CELLS_CONSTANT;
  ASSERT_EQ(cumulet_set_grid(viewer.get(), &grid), CUMULET_OK);
  const Picture found = picture(viewer.get());
  EXPECT_EQ(cumulet_wait(viewer.get(), -1.0), CUMULET_OK);
  const ViewerPtr single = make();
  ASSERT_EQ(cumulet_set_grid(single.get(), &grid), CUMULET_OK);
  ASSERT_EQ(cumulet_load_volume(single.get(), clip_.path(4).c_str(), nullptr), CUMULET_OK);
  EXPECT_EQ(difference(found, picture(single.get())), "");
  // Settings changed during the load apply to the sequence too.
  ASSERT_EQ(cumulet_load_volume(viewer.get(), "missing.vdb", nullptr), CUMULET_OK);
  grid.threshold = 0.05;
  ASSERT_EQ(cumulet_set_grid(viewer.get(), &grid), CUMULET_OK);
  ASSERT_EQ(cumulet_set_grid(single.get(), &grid), CUMULET_OK);
  ASSERT_TRUE(is_cached(viewer.get()));
  ASSERT_EQ(cumulet_sequence_set_frame(sequence.get(), 2.0), CUMULET_OK);
  ASSERT_EQ(cumulet_load_volume(single.get(), clip_.path(2).c_str(), nullptr), CUMULET_OK);
  calls = 0;
  while (info_of(viewer.get()).displayed_frame != 2U && ++calls < 2000)
    ASSERT_EQ(cumulet_render(viewer.get(), &frame, nullptr), CUMULET_OK);
  auto stats = make_desc<cumulet_stats>();
  auto wanted = make_desc<cumulet_stats>();
  ASSERT_EQ(cumulet_wait(single.get(), -1.0), CUMULET_OK);
  ASSERT_EQ(cumulet_get_stats(viewer.get(), &stats), CUMULET_OK);
  ASSERT_EQ(cumulet_get_stats(single.get(), &wanted), CUMULET_OK);
  EXPECT_EQ(stats.cells, wanted.cells);
}

TEST_F(CSequence, ChangedSettingsApplyToAllFrames) {
  const SequenceRef sequence = make_sequence(clip_.paths());
  const ViewerPtr viewer = make();
  ASSERT_EQ(cumulet_set_sequence(viewer.get(), sequence.get()), CUMULET_OK);
  picture(viewer.get());
  ASSERT_TRUE(is_cached(viewer.get()));
  auto grid = make_desc<cumulet_grid_desc>();
  grid.threshold = 0.02;
  grid.cells = CUMULET_CELLS_CONSTANT;
  ASSERT_EQ(cumulet_set_grid(viewer.get(), &grid), CUMULET_OK);
  for (const int frame : {0, 4}) {
    ASSERT_EQ(cumulet_sequence_set_frame(sequence.get(), frame), CUMULET_OK);
    const Picture found = picture(viewer.get());
    const ViewerPtr single = make();
    ASSERT_EQ(cumulet_set_grid(single.get(), &grid), CUMULET_OK);
    ASSERT_EQ(cumulet_load_volume(single.get(), clip_.path(frame).c_str(), nullptr), CUMULET_OK);
    EXPECT_EQ(difference(found, picture(single.get())), "") << frame;
  }
  // Camera-adaptive grids need a camera.
  grid.camera_adaptive = 1;
  ASSERT_EQ(cumulet_set_grid(viewer.get(), &grid), CUMULET_OK);
  ASSERT_EQ(cumulet_sequence_set_frame(sequence.get(), 2.0), CUMULET_OK);
  const Picture found = picture(viewer.get());
  const ViewerPtr single = make();
  ASSERT_EQ(cumulet_set_grid(single.get(), &grid), CUMULET_OK);
  ASSERT_EQ(cumulet_load_volume(single.get(), clip_.path(2).c_str(), nullptr), CUMULET_OK);
  EXPECT_EQ(difference(found, picture(single.get())), "");
}

// Once all frames are cached, each requested frame is drawn if it is requested long enough, with previews and a budget.
TEST_F(CSequence, PlaysEachFrameOnceItIsCached) {
  const SequenceRef sequence = make_sequence(clip_.paths());
  const ViewerPtr viewer = make();
  auto sampling = make_desc<cumulet_sampling_desc>();
  ASSERT_EQ(cumulet_set_sampling(viewer.get(), &sampling), CUMULET_OK);
  auto playback = make_desc<cumulet_playback_desc>();
  playback.repeat = CUMULET_REPEAT_LOOP;
  ASSERT_EQ(cumulet_sequence_set_playback(sequence.get(), &playback), CUMULET_OK);
  ASSERT_EQ(cumulet_set_sequence(viewer.get(), sequence.get()), CUMULET_OK);
  auto frame = target_.frame();
  frame.budget_ms = 5.0;
  ASSERT_EQ(cumulet_render(viewer.get(), &frame, nullptr), CUMULET_OK);
  ASSERT_TRUE(is_cached(viewer.get()));
  for (int i = 0; i < 3 * count; ++i) {
    ASSERT_EQ(cumulet_sequence_set_time(sequence.get(), i / 24.0), CUMULET_OK);
    // The test counts rendered frames instead of seconds, because a busy machine is slow.
    int calls = 0;
    do {
      ASSERT_EQ(cumulet_render(viewer.get(), &frame, nullptr), CUMULET_OK) << cumulet_last_error(viewer.get());
    } while (info_of(viewer.get()).displayed_frame != std::uint32_t(i % count) && ++calls < 200);
    EXPECT_LT(calls, 200) << i;
  }
}

// Simulates a device so slow that no image is complete before the next request.
TEST_F(CSequence, PlaysWhileTheCameraMoves) {
  const SequenceRef sequence = make_sequence(clip_.paths());
  const ViewerPtr viewer = make();
  auto sampling = make_desc<cumulet_sampling_desc>();
  ASSERT_EQ(cumulet_set_sampling(viewer.get(), &sampling), CUMULET_OK);
  auto navigation = make_desc<cumulet_navigation_desc>();
  navigation.turntable_degrees_per_second = 90.0;
  ASSERT_EQ(cumulet_set_navigation(viewer.get(), &navigation), CUMULET_OK);
  auto playback = make_desc<cumulet_playback_desc>();
  playback.repeat = CUMULET_REPEAT_LOOP;
  ASSERT_EQ(cumulet_sequence_set_playback(sequence.get(), &playback), CUMULET_OK);
  ASSERT_EQ(cumulet_set_sequence(viewer.get(), sequence.get()), CUMULET_OK);
  const HostTarget large(gl_, 1536, 1536);
  auto frame = large.frame();
  frame.target = CUMULET_TARGET_NONE;
  frame.budget_ms = 0.0;
  ASSERT_EQ(cumulet_render(viewer.get(), &frame, nullptr), CUMULET_OK);
  ASSERT_TRUE(is_cached(viewer.get()));
  for (int i = 0; i < 2 * count; ++i) {
    ASSERT_EQ(cumulet_sequence_set_time(sequence.get(), i / 24.0), CUMULET_OK);
    int calls = 0;
    do {
      ASSERT_EQ(cumulet_render(viewer.get(), &frame, nullptr), CUMULET_OK) << cumulet_last_error(viewer.get());
    } while (info_of(viewer.get()).displayed_frame != std::uint32_t(i % count) && ++calls < 2000);
    ASSERT_LT(calls, 2000) << i;
  }
}

TEST_F(CSequence, DrawnFrameIgnoresOtherSequences) {
  const ViewerPtr viewer = make();
  const SequenceRef all = make_sequence(clip_.paths());
  ASSERT_EQ(cumulet_set_sequence(viewer.get(), all.get()), CUMULET_OK);
  ASSERT_EQ(cumulet_sequence_set_frame(all.get(), 5.0), CUMULET_OK);
  picture(viewer.get());
  ASSERT_EQ(info_of(viewer.get()).displayed_frame, 5U);
  const SequenceRef two = make_sequence({clip_.path(1), clip_.path(2)});
  ASSERT_EQ(cumulet_set_sequence(viewer.get(), two.get()), CUMULET_OK);
  EXPECT_EQ(info_of(viewer.get()).is_displayed, 0);
  picture(viewer.get());
  EXPECT_EQ(info_of(viewer.get()).is_displayed, 1);
  EXPECT_EQ(info_of(viewer.get()).displayed_frame, 0U);
}

TEST_F(CSequence, TimeMayBeSetFromAnyThread) {
  clip_.corrupt(5);
  const SequenceRef sequence = make_sequence(clip_.paths());
  const ViewerPtr viewer = make();
  const ViewerPtr other = make();
  ASSERT_EQ(cumulet_set_sequence(viewer.get(), sequence.get()), CUMULET_OK);
  ASSERT_EQ(cumulet_set_sequence(other.get(), sequence.get()), CUMULET_OK);
  std::atomic<bool> ends = false;
  std::vector<std::thread> threads;
  for (int t = 0; t < 3; ++t) {
    threads.emplace_back([&, t] {
      for (int i = 0; !ends; ++i) {
        EXPECT_EQ(cumulet_sequence_set_time(sequence.get(), 0.01 * ((t * 7 + i) % 60)), CUMULET_OK);
        auto playback = make_desc<cumulet_playback_desc>();
        playback.repeat = static_cast<cumulet_repeat>(i % 3);
        playback.first_frame = static_cast<std::uint32_t>(t);
        EXPECT_EQ(cumulet_sequence_set_playback(sequence.get(), &playback), CUMULET_OK);
        EXPECT_EQ(cumulet_sequence_set_frame(sequence.get(), i % count), CUMULET_OK);
        std::this_thread::yield();
      }
    });
  }
  auto frame = target_.frame();
  frame.budget_ms = 2.0;
  for (int i = 0; i < 40; ++i) {
    for (const auto* shows : {&viewer, &other})
      EXPECT_EQ(cumulet_render(shows->get(), &frame, nullptr), CUMULET_OK) << cumulet_last_error(shows->get());
    if (i % 9 == 4) {
      ASSERT_EQ(cumulet_rebuild(viewer.get()), CUMULET_OK);
    }
    if (i % 9 == 7) cumulet_cancel(other.get());
  }
  ends = true;
  for (std::thread& thread : threads) thread.join();
  ASSERT_EQ(cumulet_sequence_set_frame(sequence.get(), 4.0), CUMULET_OK);
  ASSERT_EQ(cumulet_rebuild(other.get()), CUMULET_OK);  // after a cancel, the viewer is idle until another request
  const Picture found = picture(viewer.get());
  EXPECT_EQ(difference(found, alone(4)), "");
  EXPECT_EQ(difference(picture(other.get()), found), "");
}

}  // namespace
