// cumulet_last_error(NULL): why a call without a viewer failed.

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <thread>

#include "support/c_host.hpp"

namespace {

using namespace cumulet::test;

std::string line() { return cumulet_last_error(nullptr); }

template <class Call>
void expect_line(const std::string& expected, Call&& call) {
  EXPECT_EQ(call(), CUMULET_ERROR_INVALID_ARGUMENT) << expected;
  EXPECT_EQ(line(), expected);
}

TEST(ThreadLine, NamesTheCauseForEveryKindOfHandle) {
  const InstanceRef instance = make_instance(make_desc<cumulet_instance_desc>());
  auto clip = make_desc<cumulet_clip_desc>();
  clip.box = 2;
  expect_line("cumulet_clip_desc.box is not 0 or 1", [&] { return cumulet_instance_set_clip(instance.get(), &clip); });
  const float stops[] = {0, 1, 1, 1, 0, 1, 1, 1};
  expect_line("the color ramp of flame has a point 0:1/1/1 whose input is not above that of 0:1/1/1",
              [&] { return cumulet_instance_set_color_ramp(instance.get(), CUMULET_RAMP_FLAME, stops, 2); });
  expect_line("the instance is NULL", [] { return cumulet_instance_set_to_world(nullptr, nullptr); });
  const auto model = made_by<ModelRef>(cumulet_model_create, make_desc<cumulet_model_desc>());
  const double flat[16] = {1};
  EXPECT_EQ(cumulet_model_set_to_world(model.get(), flat), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_NE(line().find("to_world"), std::string::npos) << line();
  auto stand = make_desc<cumulet_camera_desc>();
  stand.fovy_degrees = NAN;
  cumulet_camera* camera = nullptr;
  EXPECT_EQ(cumulet_camera_create(&stand, &camera), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_NE(line().find("fovy_degrees"), std::string::npos) << line();
  EXPECT_EQ(cumulet_sequence_set_time(nullptr, 0.0), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_NE(line().find("is NULL"), std::string::npos) << line();
  auto histogram = make_desc<cumulet_histogram_info>();
  EXPECT_EQ(cumulet_volume_get_histogram(nullptr, CUMULET_RAMP_DENSITY, &histogram), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_NE(line().find("is NULL"), std::string::npos) << line();
}

TEST(ThreadLine, IsThatOfTheLastCallOfTheThread) {
  const InstanceRef instance = make_instance(make_desc<cumulet_instance_desc>());
  const ViewerPtr viewer = make_viewer({});
  auto clip = make_desc<cumulet_clip_desc>();
  clip.box = 2;
  ASSERT_EQ(cumulet_instance_set_clip(instance.get(), &clip), CUMULET_ERROR_INVALID_ARGUMENT);
  const std::string cause = line();
  EXPECT_NE(cause, "");
  EXPECT_EQ(cumulet_set_clip(viewer.get(), nullptr), CUMULET_OK);
  EXPECT_EQ(line(), cause) << "a call with a viewer has its own line";
  std::thread([&] { EXPECT_EQ(line(), "") << "of another thread"; }).join();
  EXPECT_EQ(line(), cause);
  EXPECT_EQ(cumulet_instance_set_clip(instance.get(), nullptr), CUMULET_OK);
  EXPECT_EQ(line(), "");
  EXPECT_EQ(cumulet_set_grid(nullptr, nullptr), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(line(), "viewer is NULL");
}

// The caller's buffer may be smaller.
TEST(ThreadLine, HasTheLineOfFunctionsWithABuffer) {
  auto desc = make_desc<cumulet_instance_desc>();
  desc.hidden = 2;
  cumulet_instance* out = nullptr;
  char error[8];
  expect_line("cumulet_instance_desc.hidden is not 0 or 1",
              [&] { return cumulet_instance_create(&desc, &out, error, sizeof error); });
  EXPECT_STREQ(error, "cumulet");
}

}  // namespace
