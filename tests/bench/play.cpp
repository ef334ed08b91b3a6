// Measures whether a sequence plays at its rate: the fraction of frames that are drawn before the next one is
// requested, while frames are read and built and once they are ready; and durations of calls. The simulated clock is
// that of a host with sixty frames per second: each call advances it by a sixtieth, so that a busy machine does not
// change results. Run by hand:
//
//     cumulet-bench-play FRAMES_PER_SECOND BUDGET_MS SECONDS y|z FILE...
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "c_viewer.hpp"

namespace {

using cumulet::bench::must;
using cumulet::headless::Context;
using cumulet::test::make_desc;
using Clock = std::chrono::steady_clock;

constexpr double refresh = 1.0 / 60.0;

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

double at_part(std::vector<double> values, double part) {
  if (values.empty()) return 0.0;
  std::ranges::sort(values);
  return values[static_cast<std::size_t>(part * static_cast<double>(values.size() - 1))];
}

class Bench {
 public:
  Bench(double rate, double budget_ms, bool upright, const std::vector<const char*>& paths)
      : gl_(cumulet::test::load_gl(Context::get_proc, &context_)), target_(gl_, 640, 360), rate_(rate) {
    viewer_ = cumulet::bench::make_viewer(context_);
    auto file = make_desc<cumulet_volume_file_desc>();
    file.suggested_density_scale = 1;
    if (!upright) {
      constexpr double turned[16] = {1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1};
      std::ranges::copy(turned, file.to_world);
    }
    auto desc = make_desc<cumulet_sequence_desc>();
    desc.paths = paths.data();
    desc.count = paths.size();
    desc.file = &file;
    cumulet_sequence* made = nullptr;
    char error[256];
    if (cumulet_sequence_create(&desc, &made, error, sizeof error) != CUMULET_OK) throw std::runtime_error(error);
    sequence_.reset(made);
    auto playback = make_desc<cumulet_playback_desc>();
    playback.frames_per_second = rate;
    playback.repeat = CUMULET_REPEAT_LOOP;
    if (cumulet_sequence_set_playback(made, &playback) != CUMULET_OK) throw std::runtime_error("no such rate");
    must(viewer_.get(), cumulet_set_sequence(viewer_.get(), made));
    frame_ = target_.frame();
    frame_.budget_ms = budget_ms;
  }

  void warm_up() {
    must(viewer_.get(), cumulet_wait(viewer_.get(), -1.0));
    auto result = make_desc<cumulet_warm_up_result>();
    do must(viewer_.get(), cumulet_warm_up(viewer_.get(), &frame_, CUMULET_WARM_UP_SCENE, &result));
    while (result.incomplete != 0);
  }

  void wait_for_all() {
    while (info().ready_frames + info().failed_frames < info().frames)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    // Frames with other channels need other programs, which are compiled when the first of them is drawn.
    for (std::uint32_t frame = 0; frame < info().frames; ++frame) {
      cumulet_sequence_set_frame(sequence_.get(), frame);
      warm_up();
    }
  }

  void play(const char* name, double seconds) {
    std::vector<double> calls;
    std::vector<double> waited;  // calls from the request of a frame to its drawing
    int since = 0;
    std::int64_t asked = -1;
    std::int64_t hit = 0;
    bool drawn = true;
    const auto ticks = static_cast<int>(seconds / refresh);
    for (int tick = 0; tick < ticks; ++tick) {
      const auto number = static_cast<std::int64_t>(tick * refresh * rate_ + 1e-6);
      if (number != asked) drawn = false;
      since = number != asked ? 1 : since + 1;
      asked = number;
      cumulet_sequence_set_time(sequence_.get(), static_cast<double>(number) / rate_);
      const auto begun = Clock::now();
      must(viewer_.get(), cumulet_render(viewer_.get(), &frame_, nullptr));
      calls.push_back(1e3 * seconds_since(begun));
      const cumulet_sequence_info status = info();
      if (!drawn && status.is_displayed != 0 && status.displayed_frame == status.requested_frame) {
        drawn = true;
        ++hit;
        waited.push_back(since);
      }
      const double rest = refresh - seconds_since(begun);
      if (rest > 0.0) std::this_thread::sleep_for(std::chrono::duration<double>(rest));
    }
    const cumulet_sequence_info status = info();
    std::printf("| %s | %.3g | %lld | %lld | %.0f / %.0f | %.1f / %.1f / %.1f | %u of %u, %.0f MB |\n", name, rate_,
                static_cast<long long>(asked + 1), static_cast<long long>(hit), at_part(waited, 0.5),
                at_part(waited, 0.95), at_part(calls, 0.5), at_part(calls, 0.95), at_part(calls, 1.0),
                status.ready_frames, status.frames, static_cast<double>(status.bytes) / 1e6);
  }

 private:
  cumulet_sequence_info info() {
    auto info = make_desc<cumulet_sequence_info>();
    must(viewer_.get(), cumulet_get_sequence_info(viewer_.get(), &info, nullptr, 0));
    return info;
  }

  Context context_ = Context::create(cumulet::headless::Backend::automatic);
  GladGLContext gl_;
  cumulet::test::HostTarget target_;
  double rate_;
  cumulet_frame_desc frame_{};
  cumulet::test::ViewerPtr viewer_;
  cumulet::test::SequenceRef sequence_;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc < 6) {
    std::fprintf(stderr, "usage: cumulet-bench-play FRAMES_PER_SECOND BUDGET_MS SECONDS y|z FILE...\n");
    return 2;
  }
  try {
    Bench bench(std::atof(argv[1]), std::atof(argv[2]), std::string(argv[4]) == "y", {argv + 5, argv + argc});
    const double seconds = std::atof(argv[3]);
    std::printf(
        "| | frames/s | asked for | drawn | after calls: median / 95 %% | call, ms: median / 95 %% / most | ready |\n"
        "|---|--:|--:|--:|--:|--:|--:|\n");
    bench.warm_up();
    bench.play("while it is read and built", seconds);
    bench.wait_for_all();
    bench.play("ready", seconds);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "cumulet-bench-play: %s\n", error.what());
    return 1;
  }
}
