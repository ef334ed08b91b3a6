// Instances that play sequences, through the C API.

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "support/c_sequence.hpp"

namespace {

using cumulet::test::CSequence;
using cumulet::test::difference;
using cumulet::test::InstanceRef;
using cumulet::test::make_desc;
using cumulet::test::make_sequence;
using cumulet::test::SequenceRef;
using cumulet::test::ViewerPtr;
using cumulet::test::VolumeRef;
using Picture = std::vector<std::uint8_t>;

InstanceRef make_instance(cumulet_sequence* sequence, double x = 0.0, double density_scale = 0.0) {
  auto medium = make_desc<cumulet_medium_desc>();
  medium.density_scale = density_scale;
  auto desc = make_desc<cumulet_instance_desc>();
  desc.sequence = sequence;
  desc.medium = &medium;
  for (int i = 0; i < 16; i += 5) desc.to_world[i] = 1.0;
  desc.to_world[12] = x;
  return cumulet::test::make_instance(desc);
}

class PlayedInstances : public CSequence {
 protected:
  // The image of instances of this file's volume.
  Picture still(int frame, const std::vector<double>& positions) {
    auto file = make_desc<cumulet_volume_file_desc>();
    file.path = clip_.path(frame).c_str();
    cumulet_volume* volume = nullptr;
    EXPECT_EQ(cumulet_volume_open_file(&file, &volume, nullptr, 0), CUMULET_OK);
    const VolumeRef owner(volume);
    const ViewerPtr viewer = make();
    std::vector<InstanceRef> instances;
    for (const double x : positions) {
      auto desc = make_desc<cumulet_instance_desc>();
      desc.volume = volume;
      for (int i = 0; i < 16; i += 5) desc.to_world[i] = 1.0;
      desc.to_world[12] = x;
      instances.push_back(cumulet::test::make_instance(desc));
      EXPECT_EQ(cumulet_add_instance(viewer.get(), instances.back().get()), CUMULET_OK);
    }
    see_all(viewer.get());
    return picture(viewer.get());
  }
  // Sees all instances for any frame's size.
  static void see_all(cumulet_viewer* viewer) {
    auto desc = make_desc<cumulet_camera_desc>();
    desc.eye[0] = 10.0;
    desc.eye[2] = 90.0;
    desc.target[0] = 10.0;
    cumulet::test::look(viewer, desc);
  }
  static cumulet_sequence_info instance_info(cumulet_viewer* viewer, cumulet_instance* instance) {
    auto info = make_desc<cumulet_sequence_info>();
    EXPECT_EQ(cumulet_get_instance_sequence_info(viewer, instance, &info, nullptr, 0), CUMULET_OK)
        << cumulet_last_error(viewer);
    return info;
  }
};

TEST_F(PlayedInstances, FrameMatchesThatOfASingleVolume) {
  const SequenceRef sequence = make_sequence(clip_.paths());
  const ViewerPtr viewer = make();
  see_all(viewer.get());
  const InstanceRef first = make_instance(sequence.get());
  const InstanceRef second = make_instance(sequence.get(), 25.0);
  ASSERT_EQ(cumulet_add_instance(viewer.get(), first.get()), CUMULET_OK);
  ASSERT_EQ(cumulet_add_instance(viewer.get(), second.get()), CUMULET_OK);
  for (const int frame : {3, 0, 6, 2}) {
    ASSERT_EQ(cumulet_sequence_set_time(sequence.get(), frame / 24.0), CUMULET_OK);
    EXPECT_EQ(difference(picture(viewer.get()), still(frame, {0.0, 25.0})), "") << frame;
    const cumulet_sequence_info info = instance_info(viewer.get(), second.get());
    EXPECT_EQ(info.displayed_frame, std::uint32_t(frame));
    EXPECT_EQ(info.is_displayed, 1);
  }
  // Both instances share one grid. Separate grids would have twice the cells.
  auto stats = make_desc<cumulet_stats>();
  ASSERT_EQ(cumulet_get_stats(viewer.get(), &stats), CUMULET_OK);
  const std::uint64_t shared = stats.cells;
  ASSERT_EQ(cumulet_remove_instance(viewer.get(), second.get()), CUMULET_OK);
  EXPECT_EQ(difference(picture(viewer.get()), still(2, {0.0})), "");
  ASSERT_EQ(cumulet_get_stats(viewer.get(), &stats), CUMULET_OK);
  EXPECT_EQ(stats.cells, shared);
}

TEST_F(PlayedInstances, InstancesPlayIndependently) {
  const SequenceRef early = make_sequence(clip_.paths());
  const SequenceRef late = make_sequence(clip_.paths());
  ASSERT_EQ(cumulet_sequence_set_frame(early.get(), 1.0), CUMULET_OK);
  ASSERT_EQ(cumulet_sequence_set_frame(late.get(), 5.0), CUMULET_OK);
  const ViewerPtr viewer = make();
  see_all(viewer.get());
  const InstanceRef instance = make_instance(late.get(), 25.0);
  ASSERT_EQ(cumulet_set_sequence(viewer.get(), early.get()), CUMULET_OK);
  ASSERT_EQ(cumulet_add_instance(viewer.get(), instance.get()), CUMULET_OK);
  const Picture both = picture(viewer.get());
  EXPECT_EQ(info_of(viewer.get()).displayed_frame, 1U);
  EXPECT_EQ(instance_info(viewer.get(), instance.get()).displayed_frame, 5U);
  EXPECT_NE(difference(both, still(1, {0.0})), "");
  // Hidden instances do not follow their sequence and have no state.
  auto desc = make_desc<cumulet_instance_desc>();
  desc.sequence = late.get();
  desc.hidden = 1;
  ASSERT_EQ(cumulet_instance_set(instance.get(), &desc), CUMULET_OK);
  EXPECT_NE(difference(picture(viewer.get()), both), "");
  auto info = make_desc<cumulet_sequence_info>();
  EXPECT_EQ(cumulet_get_instance_sequence_info(viewer.get(), instance.get(), &info, nullptr, 0),
            CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_STREQ(cumulet_last_error(viewer.get()), "the instance shows no sequence");
}

TEST_F(PlayedInstances, MissingFramesAreReportedAndSkipped) {
  clip_.remove(2);
  clip_.corrupt(3);
  const SequenceRef sequence = make_sequence(clip_.paths());
  const ViewerPtr viewer = make();
  see_all(viewer.get());
  const InstanceRef instance = make_instance(sequence.get());
  ASSERT_EQ(cumulet_add_instance(viewer.get(), instance.get()), CUMULET_OK);
  const Picture before = still(1, {0.0});
  for (const int frame : {1, 2, 3}) {
    ASSERT_EQ(cumulet_sequence_set_frame(sequence.get(), frame), CUMULET_OK);
    EXPECT_EQ(difference(picture(viewer.get()), before), "") << frame;
    EXPECT_EQ(instance_info(viewer.get(), instance.get()).displayed_frame, 1U);
  }
  std::array<char, 512> cause{};
  ASSERT_EQ(cumulet_get_instance_sequence_frame(viewer.get(), instance.get(), 3, cause.data(), cause.size()),
            CUMULET_OK);
  EXPECT_EQ(std::string(cause.data()).rfind(clip_.path(3) + ": ", 0), 0U) << cause.data();
  EXPECT_EQ(cumulet_get_instance_sequence_frame(viewer.get(), instance.get(), count, cause.data(), cause.size()),
            CUMULET_ERROR_INVALID_ARGUMENT);
  // If no frame can be displayed, the load fails.
  const SequenceRef none = make_sequence({"not-there.1.vdb"});
  const InstanceRef lost = make_instance(none.get());
  ASSERT_EQ(cumulet_add_instance(viewer.get(), lost.get()), CUMULET_OK);
  EXPECT_EQ(cumulet_wait(viewer.get(), -1.0), CUMULET_ERROR_FILE);
  EXPECT_EQ(std::string(cumulet_last_error(viewer.get())).rfind("not-there.1.vdb: ", 0), 0U);
  ASSERT_EQ(cumulet_remove_instance(viewer.get(), lost.get()), CUMULET_OK);
  EXPECT_EQ(difference(picture(viewer.get()), before), "");
}

TEST_F(PlayedInstances, VolumeAndSequenceTogetherAreRejected) {
  const SequenceRef sequence = make_sequence(clip_.paths());
  const VolumeRef ball = cumulet::test::make_ball(8, 1.0F);
  auto desc = make_desc<cumulet_instance_desc>();
  desc.sequence = sequence.get();
  desc.volume = ball.get();
  cumulet_instance* out = nullptr;
  std::array<char, 256> error{};
  EXPECT_EQ(cumulet_instance_create(&desc, &out, error.data(), error.size()), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_STREQ(error.data(), "cumulet_instance_desc has more than one of volume, sequence and dynamic_volume");
  // From volume to sequence and back, and to neither.
  const ViewerPtr viewer = make();
  see_all(viewer.get());
  const InstanceRef instance = make_instance(sequence.get());
  ASSERT_EQ(cumulet_add_instance(viewer.get(), instance.get()), CUMULET_OK);
  const Picture plays = picture(viewer.get());
  desc.sequence = nullptr;
  ASSERT_EQ(cumulet_instance_set(instance.get(), &desc), CUMULET_OK);
  EXPECT_NE(difference(picture(viewer.get()), plays), "");
  desc.volume = nullptr;
  desc.sequence = sequence.get();
  ASSERT_EQ(cumulet_instance_set(instance.get(), &desc), CUMULET_OK);
  EXPECT_EQ(difference(picture(viewer.get()), plays), "");
  desc.sequence = nullptr;
  ASSERT_EQ(cumulet_instance_set(instance.get(), &desc), CUMULET_OK);
  auto info = make_desc<cumulet_sequence_info>();
  EXPECT_EQ(cumulet_get_instance_sequence_info(viewer.get(), instance.get(), &info, nullptr, 0),
            CUMULET_ERROR_INVALID_ARGUMENT);
}

}  // namespace
