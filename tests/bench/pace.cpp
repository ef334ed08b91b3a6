// Measures how well cumulet_render keeps its budget: durations of calls with budgets of 5, 10 and 16 ms, at rest and
// while the sun is dragged, without other load and beside a host that queues GPU work. As a control: a call that only
// polls the clock until its budget is over, on two cores like the tracer of a software driver. Also the loop of
// README's host until it converges. Run by hand:
//
//     cumulet-bench-pace VOLUME [FRAMES] [MILLISECONDS OF THE HOST'S WORK] [BUDGET]
//
// BUDGET: only this budget in milliseconds, without the control and the loop.
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <future>
#include <stdexcept>
#include <vector>

#include "c_viewer.hpp"
#include "support/busy_host.hpp"

namespace {

using cumulet::bench::must;
using cumulet::headless::Context;
using Clock = std::chrono::steady_clock;

double ms_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

struct Scenario {
  const char* name;
  cumulet_preview preview;
  bool drags;
  bool busy;
};

/// Keeps two cores busy for this time.
void control(double budget_ms) {
  const auto until = Clock::now() + std::chrono::duration<double, std::milli>(budget_ms);
  const auto spin = [until] {
    while (Clock::now() < until) {
    }
  };
  const auto other = std::async(std::launch::async, spin);
  spin();
  other.wait();
}

class Bench {
 public:
  Bench(const char* volume, int frames, double host_ms)
      : context_(Context::create(cumulet::headless::Backend::automatic)),
        gl_(cumulet::test::load_gl(Context::get_proc, &context_)),
        target_(gl_, 1280, 720),
        host_(gl_, host_ms),
        volume_(volume),
        frames_(frames) {
    std::printf("%s; host's own work %.0f ms\n", reinterpret_cast<const char*>(gl_.GetString(GL_RENDERER)), host_ms);
  }

  cumulet::test::ViewerPtr open(std::uint32_t samples, cumulet_preview preview) {
    auto viewer = cumulet::test::make_viewer({.get_proc = Context::get_proc,
                                              .user = &context_,
                                              .samples = samples,
                                              .interpolation = CUMULET_INTERPOLATION_NEAREST});  // as in older results
    auto sampling = cumulet::test::make_desc<cumulet_sampling_desc>();
    sampling.samples = samples;
    sampling.preview = preview;
    must(viewer.get(), cumulet_set_sampling(viewer.get(), &sampling));
    must(viewer.get(), cumulet_load_volume(viewer.get(), volume_, nullptr));
    must(viewer.get(), cumulet_wait(viewer.get(), -1.0));
    must(viewer.get(), cumulet_frame_all(viewer.get()));
    return viewer;
  }
  cumulet_frame_result frame(cumulet_viewer* viewer, double budget_ms) {
    cumulet_frame_desc desc = target_.frame();
    desc.budget_ms = budget_ms;
    auto result = cumulet::test::make_desc<cumulet_frame_result>();
    must(viewer, cumulet_render(viewer, &desc, &result));
    return result;
  }

  void pace(const Scenario& scenario, double budget_ms) {
    const auto viewer = open(4096, scenario.preview);
    cumulet_sun_sky_desc light = cumulet::bench::daylight();
    const std::vector<double> taken = times(scenario.busy, [&](int i) {
      if (scenario.drags) {
        light.sun_azimuth_degrees = static_cast<float>(i);
        must(viewer.get(), cumulet_set_sun_sky(viewer.get(), &light));
      }
      return [&] { frame(viewer.get(), budget_ms); };
    });
    auto stats = cumulet::test::make_desc<cumulet_stats>();
    must(viewer.get(), cumulet_get_stats(viewer.get(), &stats));
    print(scenario.name, budget_ms, taken, stats.samples);
  }

  void pace_of_control(const char* name, bool busy, double budget_ms) {
    const auto call = [&](int) { return [&] { control(budget_ms); }; };
    print(name, budget_ms, times(busy, call), 0);
  }

  void readme_loop() {
    const auto viewer = open(1, CUMULET_PREVIEW_OFF);
    const auto start = Clock::now();
    cumulet_frame_result result{};
    int frames = 0;
    do {
      result = frame(viewer.get(), 10.0);
      ++frames;
    } while ((result.flags & CUMULET_RENDER_INCOMPLETE) != 0 && frames < 3000 && ms_since(start) < 30e3);
    std::printf("README's loop, 1280x720, 1 sample, 10 ms: %s after %d frames, %.1f s, progress %.3f\n",
                (result.flags & CUMULET_RENDER_CONVERGED) != 0 ? "converged" : "NOT converged", frames,
                1e-3 * ms_since(start), result.progress);
  }

 private:
  // Durations of calls, one per frame, sorted; prepare(frame) returns the call.
  template <class Prepare>
  std::vector<double> times(bool busy, Prepare&& prepare) {
    std::vector<double> taken;
    for (int i = -frames_ / 4; i < frames_; ++i) {
      const auto call = prepare(i);
      if (busy) host_.queue();
      const auto start = Clock::now();
      call();
      if (i >= 0) taken.push_back(ms_since(start));
      gl_.Finish();  // as a buffer swap might
    }
    std::ranges::sort(taken);
    return taken;
  }
  static void print(const char* name, double budget_ms, const std::vector<double>& taken, std::uint64_t samples) {
    const auto at = [&](double part) { return taken[static_cast<std::size_t>(part * double(taken.size() - 1))]; };
    std::printf("| %-22s | %4.0f | %6.2f | %6.2f | %7.2f | %9llu |\n", name, budget_ms, at(0.5), at(0.95), taken.back(),
                static_cast<unsigned long long>(samples));
    std::fflush(stdout);
  }

  Context context_;
  GladGLContext gl_;
  cumulet::test::HostTarget target_;
  cumulet::test::BusyHost host_;
  const char* volume_;
  int frames_;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: cumulet-bench-pace VOLUME [FRAMES] [MILLISECONDS OF THE HOST'S WORK] [BUDGET]\n");
    return 2;
  }
  try {
    Bench bench(argv[1], argc > 2 ? std::max(std::atoi(argv[2]), 8) : 100, argc > 3 ? std::atof(argv[3]) : 120.0);
    std::vector<double> budgets{5.0, 10.0, 16.0};
    if (argc > 4) budgets = {std::atof(argv[4])};
    std::printf("| %-22s | ms   | p50    | p95    | max     | samples   |\n|---|--:|--:|--:|--:|--:|\n", "scenario");
    for (const Scenario& scenario : {Scenario{"rest, preview off", CUMULET_PREVIEW_OFF, false, false},
                                     Scenario{"rest, preview", CUMULET_PREVIEW_AUTO, false, false},
                                     Scenario{"drag, preview", CUMULET_PREVIEW_AUTO, true, false},
                                     Scenario{"rest off, busy host", CUMULET_PREVIEW_OFF, false, true},
                                     Scenario{"drag, busy host", CUMULET_PREVIEW_AUTO, true, true}}) {
      for (const double budget_ms : budgets) bench.pace(scenario, budget_ms);
    }
    if (argc > 4) return 0;
    for (const bool busy : {false, true}) {
      for (const double budget_ms : budgets)
        bench.pace_of_control(busy ? "control, busy host" : "control", busy, budget_ms);
    }
    bench.readme_loop();
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "cumulet-bench-pace: %s\n", error.what());
    return 1;
  }
}
