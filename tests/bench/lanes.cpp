// Simulates the warps of an NVIDIA GPU: how long pictures take, depending on how paths are assigned to lanes. Run by
// hand:
//
//     cumulet-bench-lanes [--threshold T] [--optical-depth D] [--size PIXELS] [--samples N] FILE...
//
// Paths of some 8x8 squares record their stages, cells and tree levels (recording.hpp). One scheduler of a
// multiprocessor runs them as trace.comp does: work of any lane costs its whole warp the instructions, and warps share
// issue slots. Instructions are from code of sm_90 (cumulet-gpu-cost), latencies were fitted to an NVIDIA H200. The
// model reproduces its ratios with other round lengths to 0.02-0.05. It ignores queues of texture units and misses of
// the instruction cache.
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <deque>
#include <string>
#include <vector>

#include "queues.hpp"
#include "recording.hpp"
#include "warps.hpp"

namespace {

using namespace cumulet;
using namespace cumulet::bench;

Pixel record(core::Recording& recording, glm::uvec2 at, std::uint32_t samples) {
  using namespace core;
  Pixel pixel;
  recording.march = [&](std::uint32_t) { pixel.back().push_back({Work::step}); };
  recording.cm.dispatch.samples = samples;
  core::Recording::CmPath p{};
  core::Recording::CmPixel sums{};
  std::uint32_t entry = CM_NONE;
  while (p.stage != CM_STAGE_DONE) {
    if (p.stage == CM_STAGE_CAMERA) {
      pixel.emplace_back();
      recording.cm_camera(p, sums.samples, at);
      recording.levels = 0;
      recording.cm_aim(p);
      pixel.back().push_back(
          {Work::camera, static_cast<std::uint8_t>(recording.levels), p.cell.x != CM_NONE && p.cell.x == entry});
      if (p.cell.x == CM_NONE) {
        p.stage = CM_STAGE_FINISH;
      } else {
        entry = p.cell.x;
      }
    }
    if (p.stage == CM_STAGE_EVENT) {
      const bool shadow = p.ray == CM_RAY_TO_LIGHT;
      recording.cm_handle(p, recording.cm_in_medium());
      pixel.back().push_back({p.stage == CM_STAGE_FINISH ? Work::end : shadow ? Work::shadow : Work::event});
    }
    if (p.stage == CM_STAGE_FLY) {
      p.event = recording.cm_fly(p);
      if (p.event != CM_EVENT_NONE) p.stage = CM_STAGE_EVENT;
    }
    if (p.stage == CM_STAGE_FINISH) {
      pixel.back().push_back({Work::finish});
      recording.cm_finish(p, sums);
    }
  }
  return pixel;
}

struct Policy {
  std::string name;
  std::vector<std::uint32_t> passes;  // samples
  std::uint32_t run = 0;              // samples of a place after the first; 0: all of the pass
  std::size_t warps = 5;              // per scheduler, over all waves
  int misses = 0;                     // further camera rays in a round, if rays miss
  bool keeps_entry = false;
  int chunk = 8;
  int events = 8;
  Costs costs = {};
  bool is_built = false;  // the library's kernel
  double shadow = 0.0;    // instructions of the end of a shadow ray, if it is no event
  static constexpr std::size_t resident = 5;
  static constexpr int rounds = 256;
};

/// Samples of a pixel.
struct Place {
  const Pixel* pixel = nullptr;
  std::size_t first = 0;
  std::size_t last = 0;
};

struct Lane {
  Place place;
  std::size_t at = 0;
  [[nodiscard]] bool done() const { return place.first == place.last; }
  [[nodiscard]] const Item& item() const { return (*place.pixel)[place.first][at]; }
  [[nodiscard]] bool is_at(Work work) const { return !done() && item().work == work; }
  /// Returns true if a sample ended.
  bool advance() {
    if (++at < (*place.pixel)[place.first].size()) return false;
    at = 0;
    ++place.first;
    return true;
  }
};

class Warp {
 public:
  double rest = 0.0;     // instructions of the current work
  double latency = 0.0;  // after them
  double wake = 0.0;     // end of the latency
  int rounds = 0;        // left of the dispatch

  [[nodiscard]] bool done() const {
    return std::ranges::all_of(lanes_, [](const Lane& lane) { return lane.done(); });
  }
  void fill(std::deque<Place>& places) {
    for (Lane& lane : lanes_) take(lane, places);
  }
  /// Begins the next work, in the order of glsl/path/run.glsl. Returns false when the rounds are over.
  bool begin(const Policy& policy, std::deque<Place>& places, Sums& sums) {
    rest = latency = 0.0;
    while (!done()) {
      if (phase_ == Phase::cameras) {
        if (rounds-- == 0) return false;
        cameras(policy, places, sums);
        event_ = 0;
        phase_ = Phase::events;
      } else if (phase_ == Phase::events) {
        const bool more = event_++ < policy.events && std::ranges::any_of(lanes_, travels);
        rest += Costs::turn;
        if (more) events(policy, sums);
        step_ = 0;
        stays_.assign(lanes_.size(), false);
        phase_ = more ? Phase::steps : Phase::finish;
      } else if (phase_ == Phase::steps) {
        if (step_++ == policy.chunk || !steps(policy, sums)) phase_ = Phase::events;
      } else {
        finish(places, sums);
        phase_ = Phase::cameras;
      }
      if (rest > Costs::turn) {
        sums.instructions += rest;
        return true;
      }
    }
    return false;
  }

 private:
  enum class Phase : std::uint8_t { cameras, events, steps, finish };

  static bool is_at_event(const Lane& lane) {
    return lane.is_at(Work::event) || lane.is_at(Work::shadow) || lane.is_at(Work::end);
  }
  static bool travels(const Lane& lane) { return lane.is_at(Work::step) || is_at_event(lane); }
  static void take(Lane& lane, std::deque<Place>& places) {
    if (!lane.done() || places.empty()) return;
    lane.place = places.front();
    places.pop_front();
  }
  // Returns true if a ray missed.
  bool camera(const Policy& policy, Sums& sums) {
    std::size_t lanes = 0;
    int levels = 0;
    bool tests = false;
    bool misses = false;
    for (Lane& lane : lanes_) {
      if (!lane.is_at(Work::camera)) continue;
      ++lanes;
      const bool kept = policy.keeps_entry && lane.item().kept;
      tests = tests || policy.keeps_entry;
      if (!kept) levels = std::max(levels, int{lane.item().levels});
      lane.advance();
      misses = misses || lane.is_at(Work::finish);
    }
    if (lanes == 0) return false;
    sums.count(Work::camera, lanes);
    rest += Costs::camera + levels * Costs::level + (tests ? Costs::kept : 0.0);
    latency += levels * Costs::fetch + (tests ? Costs::fetch : 0.0);
    return misses;
  }
  void cameras(const Policy& policy, std::deque<Place>& places, Sums& sums) {
    rest += Costs::turn;
    for (int i = 0; camera(policy, sums) && i < policy.misses; ++i) finish(places, sums);
  }
  void events(const Policy& policy, Sums& sums) {
    std::size_t lanes = 0;
    bool all_end = true;
    bool any = false;
    bool shadow = false;
    for (Lane& lane : lanes_) {
      if (!is_at_event(lane)) continue;
      ++lanes;
      any = any || lane.is_at(Work::event);
      shadow = shadow || lane.is_at(Work::shadow);
      all_end = all_end && lane.is_at(Work::end);
      lane.advance();
    }
    if (lanes == 0) return;
    sums.count(Work::event, lanes);
    if (policy.shadow == 0.0)
      rest += all_end ? Costs::end : policy.costs.event;
    else
      rest += (any ? policy.costs.event : all_end ? Costs::end : 0.0) + (shadow ? policy.shadow : 0.0);
  }
  bool steps(const Policy& policy, Sums& sums) {
    std::size_t lanes = 0;
    for (std::size_t i = 0; i < lanes_.size(); ++i) {
      Lane& lane = lanes_[i];
      if (stays_[i] || !lane.is_at(Work::step)) continue;
      ++lanes;
      lane.advance();
      stays_[i] = !lane.is_at(Work::step);
    }
    if (lanes == 0) return false;
    sums.count(Work::step, lanes);
    rest += policy.costs.step;
    latency += Costs::fetch;
    return true;
  }
  void finish(std::deque<Place>& places, Sums& sums) {
    std::size_t lanes = 0;
    bool takes = false;
    for (Lane& lane : lanes_) {
      if (!lane.is_at(Work::finish)) continue;
      ++lanes;
      lane.advance();
      if (!lane.done()) continue;
      take(lane, places);
      takes = true;
    }
    if (lanes == 0) return;
    sums.count(Work::finish, lanes);
    rest += Costs::finish + (takes ? Costs::take : 0.0);
    latency += Costs::film + (takes ? Costs::film : 0.0);
  }

  std::vector<Lane> lanes_ = std::vector<Lane>(32);
  std::vector<bool> stays_;
  Phase phase_ = Phase::cameras;
  int event_ = 0;
  int step_ = 0;
};

/// Runs the places on one scheduler. Returns the time in cycles.
class Scheduler {
 public:
  Scheduler(const Policy& policy, std::deque<Place> places, Sums& sums)
      : policy_(policy), places_(std::move(places)), warps_(policy.warps), sums_(sums) {
    for (Warp& warp : warps_) warp.fill(places_);
  }
  double run() {
    while (std::ranges::any_of(warps_, [](const Warp& warp) { return !warp.done(); })) dispatch();
    return time_;
  }

 private:
  void dispatch() {
    time_ += Costs::dispatch;
    std::deque<Warp*> waiting;
    for (Warp& warp : warps_) {
      warp.rounds = Policy::rounds;
      if (!warp.done()) waiting.push_back(&warp);
    }
    std::vector<Warp*> running;
    for (;;) {
      while (running.size() < Policy::resident && !waiting.empty()) {
        if (waiting.front()->begin(policy_, places_, sums_)) running.push_back(waiting.front());
        waiting.pop_front();
      }
      if (running.empty()) return;
      advance(running);
      std::erase_if(running, [&](Warp* warp) {
        if (warp->rest > 0.0 || warp->wake > time_) return false;
        return !warp->begin(policy_, places_, sums_);
      });
    }
  }
  // Advances to the next time at which a warp has done its work or its latency ends. Warps share the issue slots.
  void advance(const std::vector<Warp*>& running) {
    const auto issues = [](const Warp* warp) { return warp->rest > 0.0; };
    const auto count = static_cast<double>(std::ranges::count_if(running, issues));
    const double rate = std::min(1.0 / Costs::cycles_alone, 1.0 / std::max(1.0, count));
    double until = 1e300;
    for (const Warp* warp : running) until = std::min(until, issues(warp) ? time_ + warp->rest / rate : warp->wake);
    const double passed = until - time_;
    time_ = until;
    for (Warp* warp : running) {
      if (!issues(warp)) continue;
      warp->rest -= passed * rate;
      if (warp->rest > 1e-6) continue;
      warp->rest = 0.0;
      warp->wake = time_ + warp->latency;
    }
  }

  const Policy& policy_;
  std::deque<Place> places_;
  std::vector<Warp> warps_;
  Sums& sums_;
  double time_ = 0.0;
};

std::deque<Place> places_of(const std::vector<Pixel>& pixels, std::size_t first, std::size_t last, std::size_t run) {
  std::deque<Place> places;
  while (first < last) {
    const std::size_t next = run == 0 ? last : std::min(last, first == 0 ? 1 : (first / run + 1) * run);
    for (const Pixel& pixel : pixels) places.push_back({&pixel, first, next});
    first = next;
  }
  return places;
}

Sums simulate(const std::vector<Pixel>& pixels, const Policy& policy) {
  Sums all;
  std::uint32_t first = 0;
  for (const std::uint32_t samples : policy.passes) {
    Scheduler scheduler(policy, places_of(pixels, first, first + samples, policy.run), all);
    all.cycles += scheduler.run();
    all.paths += static_cast<double>(pixels.size()) * samples;
    first += samples;
  }
  return all;
}

std::vector<std::uint32_t> doubling_passes(std::uint32_t samples) {
  std::vector<std::uint32_t> passes;
  for (std::uint32_t done = 0; done < samples; done += passes.back())
    passes.push_back(std::min(std::max(done, 1U), samples - done));
  return passes;
}

// Rows of the changes one after another, each with the ratio of its time to the first row's.
std::vector<Policy> policies_of(std::uint32_t samples) {
  const std::vector<std::uint32_t> one{samples};
  const std::vector<std::uint32_t> two{1, samples - 1};
  const Costs variants{.event = Costs{}.event - 184.0};
  // A prototype of the step had this many instructions.
  const Costs table{.event = variants.event, .step = 135.0};
  // An event also draws the next direction and its free path, which take this many.
  const Costs both{.event = variants.event + 200.0};
  return {
      {.name = "passes of 1, 1, 2, 4...; 8 warps for 5 places", .passes = doubling_passes(samples), .warps = 8},
      {.name = "5 warps", .passes = doubling_passes(samples)},
      {.name = "5 warps, one pass", .passes = one},
      {.name = "5 warps, one pass, runs of 4", .passes = one, .run = 4},
      {.name = "5 warps, one pass, runs of 16", .passes = one, .run = 16},
      {.name = "5 warps, passes of 1 and the rest", .passes = two},
      {.name = "the same, 1 miss at once", .passes = two, .misses = 1},
      {.name = "the same, 3 misses at once", .passes = two, .misses = 3},
      {.name = "the same, entry cell kept", .passes = two, .keeps_entry = true},
      {.name = "the same, entry cell kept, 3 misses", .passes = two, .misses = 3, .keeps_entry = true},
      {.name = "entry cell kept, rounds of 4 cells", .passes = two, .keeps_entry = true, .chunk = 4, .events = 16},
      {.name = "entry cell kept, variants of ground and sun",
       .passes = two,
       .keeps_entry = true,
       .costs = variants,
       .is_built = true},
      {.name = "the same, a table of face normals", .passes = two, .keeps_entry = true, .costs = table},
      {.name = "the same, light sample and next flight in one event",
       .passes = two,
       .keeps_entry = true,
       .costs = both,
       .shadow = 130.0},
  };
}

void measure(core::Recording& recording, const std::filesystem::path& file, const bench::RecordingOptions& options) {
  // One scheduler's share of a picture of 1024x1024 pixels on an H200.
  constexpr std::uint32_t most_squares = 31;
  constexpr std::uint32_t edge = 8;
  const std::uint32_t across = options.size / edge;
  const std::uint32_t all = across * across;
  const std::uint32_t squares = std::min(all, most_squares);
  std::vector<Pixel> pixels;
  double steps = 0.0;
  double cameras = 0.0;
  double enters = 0.0;
  double kept = 0.0;
  for (std::uint32_t i = 0; i < squares * edge * edge; ++i) {
    const auto square = static_cast<std::uint32_t>((std::uint64_t{i / (edge * edge)} * all + all / 2) / squares);
    const std::uint32_t within = i % (edge * edge);
    const glm::uvec2 at =
        edge * glm::uvec2(square % across, square / across) + glm::uvec2(within % edge, within / edge);
    pixels.push_back(record(recording, at, options.samples));
    for (const Path& path : pixels.back()) {
      steps += static_cast<double>(std::ranges::count(path, Work::step, &Item::work));
      cameras += 1.0;
      enters += path.size() > 2 ? 1.0 : 0.0;
      kept += path.front().kept ? 1.0 : 0.0;
    }
  }
  std::printf("\n%s: %.1f steps a path; %.0f %% of camera rays enter, %.0f %% of these the pixel's last cell\n",
              file.filename().c_str(), steps / cameras, 100.0 * enters / cameras, 100.0 * kept / std::max(1.0, enters));
  print_header();
  const std::vector<Policy> policies = policies_of(options.samples);
  double first = 0.0;
  for (const Policy& policy : policies) {
    const Sums sums = simulate(pixels, policy);
    print_row(policy.name, sums, first);
    if (first == 0.0) first = sums.cycles / sums.paths;
  }
  const auto& best = *std::ranges::find(policies, true, &Policy::is_built);
  std::printf("\nThis picture, with other kernels:\n");
  simulate_kernels(pixels, best.passes, first);
  std::printf("\nA picture of eight times the pixels:\n");
  std::vector<Pixel> more;
  for (int i = 0; i < 8; ++i) more.insert(more.end(), pixels.begin(), pixels.end());
  print_header();
  print_row(best.name, simulate(more, best), first);
  simulate_kernels(more, best.passes, first);
}

}  // namespace

int main(int argc, char** argv) { return bench::record_files(argc, argv, "cumulet-bench-lanes", measure); }
