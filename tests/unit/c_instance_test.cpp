// Volume instances in the C API: rejected arguments, sharing between viewers, and calls from any thread.

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <cmath>
#include <thread>
#include <vector>

#include "support/c_host.hpp"
#include "support/fake_gl.hpp"

namespace {

using cumulet::headless::Backend;
using cumulet::headless::Context;
using cumulet::test::at;
using cumulet::test::converge;
using cumulet::test::difference;
using cumulet::test::FakeGl;
using cumulet::test::HostTarget;
using cumulet::test::InstanceRef;
using cumulet::test::make_ball;
using cumulet::test::make_desc;
using cumulet::test::make_viewer;
using cumulet::test::ViewerPtr;
using cumulet::test::VolumeRef;
using Picture = std::vector<std::uint8_t>;

InstanceRef make_instance(cumulet_volume* volume, const std::array<double, 16>& transform = {}) {
  auto desc = make_desc<cumulet_instance_desc>();
  desc.volume = volume;
  std::ranges::copy(transform, desc.to_world);
  return cumulet::test::make_instance(desc);
}

class CVolumeInstance : public testing::Test {
 protected:
  [[nodiscard]] ViewerPtr make() { return make_viewer({.get_proc = FakeGl::get_proc, .user = &fake_, .samples = 1}); }
  Picture picture(cumulet_viewer* of) {
    EXPECT_EQ(cumulet_wait(of, -1.0), CUMULET_OK) << cumulet_last_error(of);
    converge(of, target_.frame());
    return target_.pixels();
  }

  Context context_ = Context::create(Backend::automatic);
  FakeGl fake_{Context::get_proc, &context_};
  HostTarget target_{fake_.real(), 32, 32};
  VolumeRef ball_ = make_ball(16, 2.0F);
  VolumeRef small_ = make_ball(10, 4.0F);
};

TEST_F(CVolumeInstance, InvalidInputGivesAOneLineError) {
  const auto refused = [&](const auto& change, const char* cause) {
    auto desc = make_desc<cumulet_instance_desc>();
    desc.volume = ball_.get();
    change(desc);
    cumulet_instance* out = nullptr;
    std::array<char, 256> error{};
    EXPECT_EQ(cumulet_instance_create(&desc, &out, error.data(), error.size()), CUMULET_ERROR_INVALID_ARGUMENT);
    EXPECT_EQ(out, nullptr);
    EXPECT_STREQ(error.data(), cause);
    const InstanceRef one = make_instance(ball_.get());
    EXPECT_EQ(cumulet_instance_set(one.get(), &desc), CUMULET_ERROR_INVALID_ARGUMENT);
  };
  auto medium = make_desc<cumulet_medium_desc>();
  medium.density_scale = -1.0;
  refused([](auto& d) { d.to_world[0] = NAN; }, "cumulet_instance_desc.to_world is not finite");
  refused([](auto& d) { d.to_world[0] = d.to_world[15] = 1.0; }, "cumulet_instance_desc.to_world is singular");
  refused([](auto& d) { d.close_to_world[0] = NAN; }, "cumulet_instance_desc.close_to_world is not finite");
  // Rotated by 180 degrees: the interpolated transform is singular.
  refused(
      [](auto& d) {
        d.close_to_world[0] = d.close_to_world[5] = -1.0;
        d.close_to_world[10] = d.close_to_world[15] = 1.0;
      },
      "cumulet_instance_desc.open_to_world and close_to_world have a singular interpolation");
  refused([](auto& d) { d.hidden = 2; }, "cumulet_instance_desc.hidden is not 0 or 1");
  refused([&](auto& d) { d.medium = &medium; }, "cumulet_medium_desc.density_scale is not from 0 to 1e60");
  const InstanceRef one = make_instance(ball_.get());
  std::array<double, 16> flat{};
  flat[15] = 1.0;
  EXPECT_EQ(cumulet_instance_set_to_world(one.get(), flat.data()), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(cumulet_instance_set_to_world(one.get(), nullptr), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(cumulet_instance_set_to_world(nullptr, flat.data()), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(cumulet_instance_set_ramp(one.get(), CUMULET_RAMP_FLAME, nullptr, 2), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(cumulet_instance_set_color_ramp(one.get(), CUMULET_RAMP_FLAME, nullptr, 2), CUMULET_ERROR_INVALID_ARGUMENT);
  const ViewerPtr shows = make();
  EXPECT_EQ(cumulet_add_instance(shows.get(), nullptr), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(cumulet_remove_instance(shows.get(), one.get()), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_STREQ(cumulet_last_error(shows.get()), "the instance is not in the viewer");
  EXPECT_EQ(cumulet_add_instance(shows.get(), one.get()), CUMULET_OK);
  EXPECT_EQ(cumulet_add_instance(shows.get(), one.get()), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_STREQ(cumulet_last_error(shows.get()), "the instance is already in the viewer");
}

TEST_F(CVolumeInstance, ChangesAppearInAllItsViewers) {
  const ViewerPtr first = make();
  const ViewerPtr second = make();
  ASSERT_EQ(cumulet_set_volume(first.get(), ball_.get()), CUMULET_OK);
  const Picture alone = picture(first.get());
  InstanceRef one = make_instance(small_.get(), at(6.0, 0.0, 0.0));
  ASSERT_EQ(cumulet_add_instance(first.get(), one.get()), CUMULET_OK);
  ASSERT_EQ(cumulet_add_instance(second.get(), one.get()), CUMULET_OK);
  const Picture here = picture(first.get());
  EXPECT_NE(here, alone);
  const Picture small_alone = picture(second.get());
  EXPECT_NE(small_alone, here);
  const auto there = at(-6.0, 0.0, 0.0);
  ASSERT_EQ(cumulet_instance_set_to_world(one.get(), there.data()), CUMULET_OK);
  EXPECT_NE(picture(first.get()), here);
  EXPECT_NE(picture(second.get()), small_alone);
  const auto back = at(6.0, 0.0, 0.0);
  ASSERT_EQ(cumulet_instance_set_to_world(one.get(), back.data()), CUMULET_OK);
  EXPECT_EQ(difference(picture(second.get()), small_alone), "");
  // The viewer keeps a reference.
  cumulet_instance* const name = one.get();
  cumulet_instance_retain(name);
  one.reset();
  EXPECT_EQ(difference(picture(second.get()), small_alone), "");
  ASSERT_EQ(cumulet_remove_instance(first.get(), name), CUMULET_OK);
  cumulet_instance_release(name);
  EXPECT_EQ(difference(picture(first.get()), alone), "");
  EXPECT_EQ(difference(picture(second.get()), small_alone), "");
}

// With several volumes only the instance table is uploaded again.
TEST_F(CVolumeInstance, MovingDoesNotRebuildTheGrid) {
  const ViewerPtr shows = make();
  ASSERT_EQ(cumulet_set_volume(shows.get(), ball_.get()), CUMULET_OK);
  const InstanceRef one = make_instance(small_.get(), at(6.0, 0.0, 0.0));
  ASSERT_EQ(cumulet_add_instance(shows.get(), one.get()), CUMULET_OK);
  picture(shows.get());
  auto stats = make_desc<cumulet_stats>();
  ASSERT_EQ(cumulet_get_stats(shows.get(), &stats), CUMULET_OK);
  const auto uploads = [&] {
    const std::uint64_t before = fake_.uploaded();
    picture(shows.get());
    return fake_.uploaded() - before;
  };
  auto medium = make_desc<cumulet_medium_desc>();
  medium.density_scale = 1.1;
  ASSERT_EQ(cumulet_set_medium(shows.get(), &medium), CUMULET_OK);
  const std::uint64_t of_a_medium = uploads();
  const auto there = at(-6.0, 1.0, 0.0);
  ASSERT_EQ(cumulet_instance_set_to_world(one.get(), there.data()), CUMULET_OK);
  EXPECT_LT(uploads(), of_a_medium + 4096);
  EXPECT_GT(stats.cell_bytes, 100'000U);
}

TEST_F(CVolumeInstance, MotionBlurEndsWithTheMotion) {
  const ViewerPtr shows = make();
  const InstanceRef one = make_instance(ball_.get());
  ASSERT_EQ(cumulet_add_instance(shows.get(), one.get()), CUMULET_OK);
  auto sampling = make_desc<cumulet_sampling_desc>();
  sampling.samples = 4;
  sampling.preview = CUMULET_PREVIEW_OFF;
  ASSERT_EQ(cumulet_set_sampling(shows.get(), &sampling), CUMULET_OK);
  const Picture sharp = picture(shows.get());
  sampling.shutter_seconds = 0.04F;
  ASSERT_EQ(cumulet_set_sampling(shows.get(), &sampling), CUMULET_OK);
  EXPECT_EQ(difference(picture(shows.get()), sharp), "") << "nothing moves";
  auto desc = make_desc<cumulet_instance_desc>();
  desc.volume = ball_.get();
  std::ranges::copy(at(3.0, 0.0, 0.0), desc.close_to_world);
  ASSERT_EQ(cumulet_instance_set(one.get(), &desc), CUMULET_OK);
  EXPECT_NE(picture(shows.get()), sharp);
  const auto here = at(0.0, 0.0, 0.0);
  ASSERT_EQ(cumulet_instance_set_to_world(one.get(), here.data()), CUMULET_OK);
  EXPECT_EQ(difference(picture(shows.get()), sharp), "");
}

TEST_F(CVolumeInstance, VolumeTransformsMoveUntilSetAgain) {
  const ViewerPtr shows = make();
  ASSERT_EQ(cumulet_set_volume(shows.get(), ball_.get()), CUMULET_OK);
  auto sampling = make_desc<cumulet_sampling_desc>();
  sampling.samples = 4;
  sampling.preview = CUMULET_PREVIEW_OFF;
  sampling.shutter_seconds = 1.0F;
  ASSERT_EQ(cumulet_set_sampling(shows.get(), &sampling), CUMULET_OK);
  const Picture sharp = picture(shows.get());
  const auto there = at(0.0, 2.0, 0.0);
  ASSERT_EQ(cumulet_set_volume_shutter_transforms(shows.get(), nullptr, there.data(), 1), CUMULET_OK);
  EXPECT_NE(picture(shows.get()), sharp);
  EXPECT_EQ(cumulet_set_volume_shutter_transforms(shows.get(), nullptr, there.data(), 2),
            CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_STREQ(cumulet_last_error(shows.get()),
               "the number of shutter transforms differs from the number of volume transforms");
  ASSERT_EQ(cumulet_set_volume_transforms(shows.get(), nullptr, 0), CUMULET_OK);
  EXPECT_EQ(difference(picture(shows.get()), sharp), "");
}

// Images are bit-identical: nothing remains of earlier transforms.
TEST_F(CVolumeInstance, ImageDoesNotDependOnEarlierTransforms) {
  const InstanceRef one = make_instance(small_.get());
  const InstanceRef other = make_instance(ball_.get());
  const auto make_with_both = [&] {
    ViewerPtr viewer = make();
    EXPECT_EQ(cumulet_add_instance(viewer.get(), one.get()), CUMULET_OK);
    EXPECT_EQ(cumulet_add_instance(viewer.get(), other.get()), CUMULET_OK);
    return viewer;
  };
  const ViewerPtr moved = make_with_both();
  for (const double x : {900.0, 1.1, -300.0, 0.9}) {
    ASSERT_EQ(cumulet_instance_set_to_world(one.get(), at(x, 0.3, 0.1).data()), CUMULET_OK);
    ASSERT_EQ(cumulet_instance_set_to_world(other.get(), at(x - 1.0, 0.0, 0.0).data()), CUMULET_OK);
    const Picture found = picture(moved.get());
    EXPECT_EQ(difference(found, picture(make_with_both().get())), "") << x;
  }
}

TEST_F(CVolumeInstance, MayBeChangedFromAnyThread) {
  const ViewerPtr shows = make();
  ASSERT_EQ(cumulet_set_volume(shows.get(), ball_.get()), CUMULET_OK);
  std::vector<InstanceRef> instances;
  for (int i = 0; i < 4; ++i) {
    instances.push_back(make_instance(small_.get()));
    ASSERT_EQ(cumulet_add_instance(shows.get(), instances.back().get()), CUMULET_OK);
  }
  std::atomic<bool> ends = false;
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i) {
    threads.emplace_back([&, i, instance = instances[static_cast<std::size_t>(i)].get()] {
      for (int k = 0; !ends; ++k) {
        const auto transform = at(0.1 * (k % 50) - 2.0, i, 0.0);
        EXPECT_EQ(cumulet_instance_set_to_world(instance, transform.data()), CUMULET_OK);
        auto desc = make_desc<cumulet_instance_desc>();
        desc.volume = k % 3 == 0 ? ball_.get() : small_.get();
        desc.hidden = k % 5 == 0 ? 1 : 0;
        EXPECT_EQ(cumulet_instance_set(instance, &desc), CUMULET_OK);
      }
    });
  }
  auto frame = target_.frame();
  frame.budget_ms = 2.0;
  for (int i = 0; i < 60; ++i) {
    EXPECT_EQ(cumulet_render(shows.get(), &frame, nullptr), CUMULET_OK) << cumulet_last_error(shows.get());
    if (i % 7 != 0) continue;
    const InstanceRef more = make_instance(small_.get(), at(0.0, 0.0, 3.0));
    ASSERT_EQ(cumulet_add_instance(shows.get(), more.get()), CUMULET_OK);
    ASSERT_EQ(cumulet_remove_instance(shows.get(), instances.front().get()), CUMULET_OK);
    ASSERT_EQ(cumulet_add_instance(shows.get(), instances.front().get()), CUMULET_OK);
    ASSERT_EQ(cumulet_remove_instance(shows.get(), more.get()), CUMULET_OK);
  }
  ends = true;
  for (std::thread& thread : threads) thread.join();
  // In the end the state is the one that the threads set last.
  for (std::size_t i = 0; i < 4; ++i) {
    auto desc = make_desc<cumulet_instance_desc>();
    desc.volume = small_.get();
    std::ranges::copy(at(4.0 * double(i) - 6.0, 0.0, 0.0), desc.to_world);
    ASSERT_EQ(cumulet_instance_set(instances[i].get(), &desc), CUMULET_OK);
  }
  const Picture found = picture(shows.get());
  const ViewerPtr fresh = make();
  ASSERT_EQ(cumulet_set_volume(fresh.get(), ball_.get()), CUMULET_OK);
  for (const std::size_t i : {1U, 2U, 3U, 0U})
    ASSERT_EQ(cumulet_add_instance(fresh.get(), instances[i].get()), CUMULET_OK);
  EXPECT_EQ(difference(found, picture(fresh.get())), "");
}

}  // namespace
