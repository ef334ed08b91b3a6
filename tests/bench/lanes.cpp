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

#include "recording.hpp"

namespace {

using namespace cumulet;

enum class Work : std::uint8_t { camera, step, event, end, finish };
constexpr std::size_t works = 5;

struct Item {
  Work work;
  std::uint8_t levels = 0;  // camera: levels of the point-location tree; 0: the ray misses the bounds
  bool kept = false;        // camera: the ray enters the same cell as the pixel's last one
};
using Path = std::vector<Item>;
using Pixel = std::vector<Path>;  // its samples

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
      recording.cm_handle(p, recording.cm_in_medium());
      pixel.back().push_back({p.stage == CM_STAGE_FINISH ? Work::end : Work::event});
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

/// Instructions and latencies, in cycles of a scheduler.
struct Costs {
  double event = 836.0;  // a light sample and a scattered ray
  double step = 166.0;
  static constexpr double end = 300.0;
  static constexpr double camera = 445.0 + 254.0;  // with the clip to the bounds
  static constexpr double level = 146.0;
  static constexpr double kept = 95.0;  // test whether the ray enters the pixel's last cell
  static constexpr double finish = 150.0;
  static constexpr double take = 60.0;  // of a place
  static constexpr double turn = 15.0;
  static constexpr double fetch = 320.0;  // latency of a cell or a tree level
  static constexpr double film = 1200.0;  // latency of a pixel's sums, and of a place
  static constexpr double dispatch = 5e-6 * 1.755e9;
  static constexpr double cycles_alone = 2.0;  // per instruction of one warp
};

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

struct Sums {
  double instructions = 0.0;
  std::array<double, works> lanes{};
  std::array<double, works> warps{};
  [[nodiscard]] double lanes_of(Work work) const {
    const auto i = static_cast<std::size_t>(work);
    return lanes.at(i) / std::max(1.0, warps.at(i));
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

  static bool travels(const Lane& lane) {
    return lane.is_at(Work::step) || lane.is_at(Work::event) || lane.is_at(Work::end);
  }
  static void take(Lane& lane, std::deque<Place>& places) {
    if (!lane.done() || places.empty()) return;
    lane.place = places.front();
    places.pop_front();
  }
  static void count(Sums& sums, Work work, double lanes) {
    sums.lanes.at(static_cast<std::size_t>(work)) += lanes;
    sums.warps.at(static_cast<std::size_t>(work)) += 1.0;
  }

  // Returns true if a ray missed.
  bool camera(const Policy& policy, Sums& sums) {
    int lanes = 0;
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
    count(sums, Work::camera, lanes);
    rest += Costs::camera + levels * Costs::level + (tests ? Costs::kept : 0.0);
    latency += levels * Costs::fetch + (tests ? Costs::fetch : 0.0);
    return misses;
  }
  void cameras(const Policy& policy, std::deque<Place>& places, Sums& sums) {
    rest += Costs::turn;
    for (int i = 0; camera(policy, sums) && i < policy.misses; ++i) finish(places, sums);
  }
  void events(const Policy& policy, Sums& sums) {
    int lanes = 0;
    bool all_end = true;
    for (Lane& lane : lanes_) {
      if (!lane.is_at(Work::event) && !lane.is_at(Work::end)) continue;
      ++lanes;
      all_end = all_end && lane.is_at(Work::end);
      lane.advance();
    }
    if (lanes == 0) return;
    count(sums, Work::event, lanes);
    rest += all_end ? Costs::end : policy.costs.event;
  }
  bool steps(const Policy& policy, Sums& sums) {
    int lanes = 0;
    for (std::size_t i = 0; i < lanes_.size(); ++i) {
      Lane& lane = lanes_[i];
      if (stays_[i] || !lane.is_at(Work::step)) continue;
      ++lanes;
      lane.advance();
      stays_[i] = !lane.is_at(Work::step);
    }
    if (lanes == 0) return false;
    count(sums, Work::step, lanes);
    rest += policy.costs.step;
    latency += Costs::fetch;
    return true;
  }
  void finish(std::deque<Place>& places, Sums& sums) {
    int lanes = 0;
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
    count(sums, Work::finish, lanes);
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
  Scheduler(const Policy& policy, std::deque<Place> places)
      : policy_(policy), places_(std::move(places)), warps_(policy.warps) {
    for (Warp& warp : warps_) warp.fill(places_);
  }
  double run() {
    while (std::ranges::any_of(warps_, [](const Warp& warp) { return !warp.done(); })) dispatch();
    return time_;
  }
  [[nodiscard]] const Sums& sums() const { return sums_; }

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
  Sums sums_;
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

double simulate(const std::vector<Pixel>& pixels, const Policy& policy, double before) {
  constexpr double schedulers = 528.0;  // of an H200
  constexpr double clock = 1.755e9;
  double time = 0.0;
  double paths = 0.0;
  Sums sums;
  std::uint32_t first = 0;
  for (const std::uint32_t samples : policy.passes) {
    Scheduler scheduler(policy, places_of(pixels, first, first + samples, policy.run));
    time += scheduler.run();
    paths += static_cast<double>(pixels.size()) * samples;
    sums.instructions += scheduler.sums().instructions;
    for (std::size_t i = 0; i < works; ++i) {
      sums.lanes.at(i) += scheduler.sums().lanes.at(i);
      sums.warps.at(i) += scheduler.sums().warps.at(i);
    }
    first += samples;
  }
  std::printf("| %s | %.0f | %.2f | %.0f | %.0f | %.1f | %.1f | %.1f |\n", policy.name.c_str(),
              1e-6 * paths / time * clock * schedulers, before > 0.0 ? before / time : 1.0, sums.instructions / paths,
              100.0 * sums.instructions / time, sums.lanes_of(Work::step), sums.lanes_of(Work::event),
              sums.lanes_of(Work::camera));
  std::fflush(stdout);
  return time;
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
      {.name = "entry cell kept, variants of ground and sun", .passes = two, .keeps_entry = true, .costs = variants},
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
  std::printf(
      "\n%s: %.1f steps a path; %.0f %% of camera rays enter, %.0f %% of these the pixel's last cell\n\n| Variant | "
      "Million paths/s of an H200 | x | Instructions a path | Issue slots filled, %% | Lanes a step | an event | a "
      "camera ray |\n|---|--:|--:|--:|--:|--:|--:|--:|\n",
      file.filename().c_str(), steps / cameras, 100.0 * enters / cameras, 100.0 * kept / std::max(1.0, enters));
  double first = 0.0;
  for (const Policy& policy : policies_of(options.samples)) {
    const double time = simulate(pixels, policy, first);
    if (first == 0.0) first = time;
  }
}

}  // namespace

int main(int argc, char** argv) { return bench::record_files(argc, argv, "cumulet-bench-lanes", measure); }
