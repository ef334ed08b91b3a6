// Measures the cost of saving and restoring GL state per frame: CUMULET_GL_STATE_RESTORE against HOST_RESETS in frames
// that only draw, interleaved. Also counts the GL queries (glGet*, glIs*) of a frame that draws and one that traces.
// Run by hand:
//
//     cumulet-state-cost [FRAMES]
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <vector>

#include "support/c_host.hpp"
#include "support/fake_gl.hpp"

namespace {

using cumulet::headless::Context;

double median(std::vector<double>& values) {
  std::ranges::sort(values);
  return values[values.size() / 2];
}

void measure(int frames, int side) {
  Context context = Context::create(cumulet::headless::Backend::automatic);
  const GladGLContext gl = cumulet::test::load_gl(Context::get_proc, &context);
  const cumulet::test::HostTarget target(gl, side, side);
  const auto volume = cumulet::test::make_ball(16);
  const auto viewer = [&](cumulet_gl_state_policy state) {
    auto made = cumulet::test::make_viewer({.get_proc = Context::get_proc, .user = &context, .gl_state = state});
    cumulet::test::picture_of(made.get(), volume.get(), target);
    return made;
  };
  const auto restoring = viewer(CUMULET_GL_STATE_RESTORE);
  const auto resetting = viewer(CUMULET_GL_STATE_HOST_RESETS);
  cumulet_frame_desc frame = target.frame();
  frame.budget_ms = -1.0;  // draws the current image
  const auto once = [&](cumulet_viewer* v) {
    const auto begin = std::chrono::steady_clock::now();
    if (cumulet_render(v, &frame, nullptr) != CUMULET_OK) throw std::runtime_error(cumulet_last_error(v));
    const auto submitted = std::chrono::steady_clock::now();
    gl.Finish();
    return std::chrono::duration<double, std::micro>(submitted - begin).count();
  };
  std::vector<double> with, without, difference;
  for (int i = 0; i < frames + 20; ++i) {
    // The two take turns in being first.
    const double first = once(i % 2 == 0 ? restoring.get() : resetting.get());
    const double second = once(i % 2 == 0 ? resetting.get() : restoring.get());
    if (i < 20) continue;
    with.push_back(i % 2 == 0 ? first : second);
    without.push_back(i % 2 == 0 ? second : first);
    difference.push_back(with.back() - without.back());
  }
  const double a = median(with);
  const double b = median(without);
  std::printf("%4d x %-4d  restore %7.1f us  host resets %7.1f us  ratio %.2f  difference %6.1f us (medians of %d)\n",
              side, side, a, b, a / b, median(difference), frames);
}

void count() {
  Context context = Context::create(cumulet::headless::Backend::automatic);
  cumulet::test::FakeGl fake(Context::get_proc, &context);
  const cumulet::test::HostTarget target(fake.real(), 64, 64);
  const auto volume = cumulet::test::make_ball(16);
  const auto viewer = cumulet::test::make_viewer({.get_proc = cumulet::test::FakeGl::get_proc, .user = &fake});
  const auto asked = [&](const cumulet_frame_desc& frame) {
    const std::uint64_t before = fake.questions();
    if (cumulet_render(viewer.get(), &frame, nullptr) != CUMULET_OK)
      throw std::runtime_error(cumulet_last_error(viewer.get()));
    return static_cast<unsigned long long>(fake.questions() - before);
  };
  if (cumulet_set_volume(viewer.get(), volume.get()) != CUMULET_OK || cumulet_wait(viewer.get(), -1.0) != CUMULET_OK)
    throw std::runtime_error(cumulet_last_error(viewer.get()));
  cumulet_frame_desc frame = target.frame();
  frame.budget_ms = 0.1;
  asked(frame);  // uploads
  asked(frame);
  const auto traced = asked(frame);
  frame.budget_ms = -1.0;
  std::printf("questions a frame: %llu traced and drawn, %llu drawn\n", traced, asked(frame));
}

}  // namespace

int main(int argc, char** argv) {
  try {
    count();
    for (const int side : {1, 64, 512}) measure(argc > 1 ? std::max(std::atoi(argv[1]), 1) : 2000, side);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "cumulet-state-cost: %s\n", error.what());
    return 1;
  }
}
