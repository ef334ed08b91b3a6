#include "queues.hpp"

#include <limits>
#include <span>
#include <string>
#include <utility>

namespace cumulet::bench {

namespace {

constexpr std::size_t warp_lanes = 32;
constexpr double path_latency = 600.0;  // of a path in memory

/// A path in flight, which belongs to a pixel.
struct Flight {
  const Pixel* pixel = nullptr;
  std::size_t sample = 0;
  std::size_t last = 0;
  std::size_t at = 0;
  [[nodiscard]] bool done() const { return sample == last; }
  [[nodiscard]] const Item& item() const { return (*pixel)[sample][at]; }
  [[nodiscard]] bool marches() const { return !done() && item().work == Work::step; }
  [[nodiscard]] bool needs_camera() const {
    return done() || item().work == Work::camera || item().work == Work::finish;
  }
  void advance() {
    if (++at < (*pixel)[sample].size()) return;
    at = 0;
    ++sample;
  }
};

/// The pixels of a pass, which lanes take one after another.
class Places {
 public:
  Places(const std::vector<Pixel>& pixels, std::size_t first, std::size_t last)
      : pixels_(pixels), first_(first), last_(last) {}
  [[nodiscard]] bool left() const { return next_ < pixels_.size(); }
  Flight take() { return {&pixels_[next_++], first_, last_, 0}; }

 private:
  const std::vector<Pixel>& pixels_;
  std::size_t first_;
  std::size_t last_;
  std::size_t next_ = 0;
};

/// Instructions besides steps and tree levels, by nvcc for sm_90 on a prototype of the three kernels. Each visit loads
/// a path, stores it and appends it to a queue.
struct VisitCosts {
  double march = 150.0;
  double event = 737.0;
  double camera = 876.0;
};

/// Finishes the sample of a path and starts the next. Returns the levels of its point location.
int start(Flight& flight, Places& places) {
  if (!flight.done() && flight.item().work == Work::finish) flight.advance();
  if (flight.done() && places.left()) flight = places.take();
  if (flight.done()) return 0;
  const int levels = flight.item().kept ? 0 : flight.item().levels;
  flight.advance();
  return levels;
}

struct QueuePolicy {
  std::string name;
  std::size_t lanes = 0;                       // paths in flight per scheduler
  int cells = 0;                               // of a visit, at most
  double between = 0.0;                        // seconds between two kernels, which wait for each other
  double bandwidth = 0.0;                      // bytes/s of the GPU's memory, or of L2 if all paths fit into it
  static constexpr std::size_t resident = 10;  // warps per scheduler, with 48 registers
  static constexpr double march_bytes = 72.0;  // of a visit; with the place in the queues
  static constexpr double event_bytes = 264.0;
  static constexpr double camera_bytes = 360.0;  // with the pixel
  static constexpr double step_bytes = 22.0;     // of a record; L1 has the rest
};

/// Kernels over queues in memory.
class Queues {
 public:
  Queues(const QueuePolicy& policy, Places places, Sums& sums) : policy_(policy), places_(places), sums_(sums) {}
  double run() {
    while (flights_.size() < policy_.lanes && places_.left()) {
      cameras_.push_back(flights_.size());
      flights_.push_back(places_.take());
    }
    double cycles = 0.0;
    while (!cameras_.empty() || !marches_.empty() || !events_.empty()) {
      cycles += kernel(cameras_, [this](std::span<const std::size_t> lanes) { return cameras(lanes); });
      cycles += march();
      cycles += kernel(events_, [this](std::span<const std::size_t> lanes) { return events(lanes); });
    }
    return cycles;
  }

 private:
  // Cycles of a kernel that issues for this long and moves its bytes.
  double finish(double cycles) {
    const double moving = std::exchange(bytes_, 0.0) / policy_.bandwidth * Gpu::clock * Gpu::schedulers;
    const double between = policy_.between * Gpu::clock;
    sums_.waiting += between;
    sums_.kernels += 1.0;
    return std::max(cycles, moving) + between;
  }
  void move(double bytes) {
    bytes_ += bytes;
    sums_.bytes += bytes;
  }
  void send(std::size_t lane) {
    const Flight& flight = flights_[lane];
    if (flight.done() && !places_.left()) return;
    (flight.needs_camera() ? cameras_ : flight.marches() ? marches_ : events_).push_back(lane);
  }
  // Runs warps whose lanes do the same.
  template <class Work>
  double kernel(std::vector<std::size_t>& queue, Work&& work) {
    const std::vector<std::size_t> lanes = std::exchange(queue, {});
    const std::size_t count = (lanes.size() + warp_lanes - 1) / warp_lanes;
    std::vector<bool> begun(count);
    return finish(run_warps(count, QueuePolicy::resident, [&](std::size_t warp, Segment& segment) {
      if (begun[warp]) return false;
      begun[warp] = true;
      const std::size_t first = warp * warp_lanes;
      segment = work(std::span(lanes).subspan(first, std::min(warp_lanes, lanes.size() - first)));
      sums_.instructions += segment.instructions;
      return true;
    }));
  }
  Segment cameras(std::span<const std::size_t> lanes) {
    int levels = 0;
    for (const std::size_t lane : lanes) {
      levels = std::max(levels, start(flights_[lane], places_));
      move(QueuePolicy::camera_bytes);
      send(lane);
    }
    sums_.count(Work::camera, lanes.size());
    return {VisitCosts{}.camera + levels * Costs::level, 2.0 * path_latency + Costs::film + levels * Costs::fetch};
  }
  Segment events(std::span<const std::size_t> lanes) {
    bool all_end = true;
    for (const std::size_t lane : lanes) {
      all_end = all_end && flights_[lane].item().work == Work::end;
      flights_[lane].advance();
      move(QueuePolicy::event_bytes);
      send(lane);
    }
    sums_.count(Work::event, lanes.size());
    return {all_end ? Costs::end : VisitCosts{}.event, 2.0 * path_latency};
  }
  double march() {
    struct Warp {
      std::vector<std::size_t> lanes;
      int cells = -1;  // so far; -1: the lanes have not loaded their paths
    };
    const std::vector<std::size_t> queue = std::exchange(marches_, {});
    std::vector<Warp> warps((queue.size() + warp_lanes - 1) / warp_lanes);
    for (std::size_t i = 0; i < queue.size(); ++i) warps[i / warp_lanes].lanes.push_back(queue[i]);
    return finish(run_warps(warps.size(), QueuePolicy::resident, [&](std::size_t index, Segment& segment) {
      Warp& warp = warps[index];
      if (warp.lanes.empty()) return false;
      if (warp.cells++ < 0) {
        segment = {VisitCosts{}.march, 2.0 * path_latency};
        move(QueuePolicy::march_bytes * static_cast<double>(warp.lanes.size()));
      } else {
        sums_.count(Work::step, warp.lanes.size());
        move(QueuePolicy::step_bytes * static_cast<double>(warp.lanes.size()));
        for (const std::size_t lane : warp.lanes) flights_[lane].advance();
        std::erase_if(warp.lanes, [&](std::size_t lane) {
          if (flights_[lane].marches() && warp.cells < policy_.cells) return false;
          send(lane);
          return true;
        });
        segment = {Costs{}.step, Costs::fetch};
      }
      sums_.instructions += segment.instructions;
      return true;
    }));
  }

  const QueuePolicy& policy_;
  Places places_;
  Sums& sums_;
  std::vector<Flight> flights_;
  std::vector<std::size_t> cameras_;
  std::vector<std::size_t> marches_;
  std::vector<std::size_t> events_;
  double bytes_ = 0.0;
};

struct GroupPolicy {
  std::string name;
  std::size_t resident = 7;                  // groups per scheduler: of 72 registers
  static constexpr std::size_t paths = 64;   // of a group
  static constexpr std::size_t enough = 28;  // rays to march, for which nothing else is done first
  static constexpr int cells = 4;            // of a turn
  static constexpr double turn = 80.0;       // instructions to count the paths and to choose
  static constexpr double load = 75.0;       // of a path to march, with its end
  static constexpr double latency = 100.0;
};

/// Groups of a warp with twice as many paths, whose rays are in shared memory. Each turn the warp does the work for
/// which most of them wait (two_paths/path/two_paths.glsl).
class Groups {
 public:
  Groups(const GroupPolicy& policy, Places places, Sums& sums)
      : policy_(policy), places_(places), sums_(sums), groups_(policy.resident) {}
  double run() {
    for (std::vector<Flight>& group : groups_) {
      while (group.size() < GroupPolicy::paths && places_.left()) group.push_back(places_.take());
    }
    return run_warps(groups_.size(), policy_.resident, [this](std::size_t group, Segment& segment) {
      segment = {GroupPolicy::turn, GroupPolicy::latency};
      if (!turn(groups_[group], segment)) return false;
      sums_.instructions += segment.instructions;
      return true;
    });
  }

 private:
  using Flights = std::vector<Flight*>;

  bool turn(std::vector<Flight>& group, Segment& segment) {
    Flights cameras;
    Flights marching;
    Flights events;
    for (Flight& flight : group) {
      if (flight.done()) continue;
      (flight.needs_camera() ? cameras : flight.marches() ? marching : events).push_back(&flight);
    }
    const bool most = marching.size() >= std::max(events.size(), cameras.size());
    const bool marches = !marching.empty() && (most || marching.size() >= GroupPolicy::enough);
    const bool handles = !events.empty() && events.size() >= cameras.size();
    Flights& chosen = marches ? marching : handles ? events : cameras;
    if (chosen.empty()) return false;
    chosen.resize(std::min(chosen.size(), warp_lanes));
    if (marches)
      march(chosen, segment);
    else if (handles)
      handle(chosen, segment);
    else
      begin(chosen, segment);
    return true;
  }
  void march(Flights& chosen, Segment& segment) {
    segment.instructions += GroupPolicy::load;
    for (int i = 0; i < GroupPolicy::cells && !chosen.empty(); ++i) {
      sums_.count(Work::step, chosen.size());
      for (Flight* flight : chosen) flight->advance();
      std::erase_if(chosen, [](const Flight* flight) { return !flight->marches(); });
      segment.instructions += Costs{}.step;
      segment.latency += Costs::fetch;
    }
  }
  void handle(const Flights& chosen, Segment& segment) {
    sums_.count(Work::event, chosen.size());
    bool all_end = true;
    for (Flight* flight : chosen) {
      all_end = all_end && flight->item().work == Work::end;
      flight->advance();
    }
    segment.instructions += all_end ? Costs::end : VisitCosts{}.event;
    segment.latency += path_latency;
  }
  void begin(const Flights& chosen, Segment& segment) {
    sums_.count(Work::camera, chosen.size());
    int levels = 0;
    for (Flight* flight : chosen) levels = std::max(levels, start(*flight, places_));
    segment.instructions += VisitCosts{}.camera + levels * Costs::level;
    segment.latency += path_latency + Costs::film + levels * Costs::fetch;
  }

  const GroupPolicy& policy_;
  Places places_;
  Sums& sums_;
  std::vector<std::vector<Flight>> groups_;
};

template <class Kernels, class Policy>
void simulate(const std::vector<Pixel>& pixels, const std::vector<std::uint32_t>& passes, const Policy& policy,
              double first) {
  Sums sums;
  std::uint32_t done = 0;
  for (const std::uint32_t samples : passes) {
    sums.cycles += Kernels(policy, Places(pixels, done, done + samples), sums).run();
    sums.paths += static_cast<double>(pixels.size()) * samples;
    done += samples;
  }
  print_row(policy.name, sums, first);
}

}  // namespace

void simulate_kernels(const std::vector<Pixel>& pixels, const std::vector<std::uint32_t>& passes, double first) {
  constexpr double cache = 5.5e12;
  constexpr double memory = 4.2e12;
  constexpr double no_limit = std::numeric_limits<double>::infinity();
  constexpr double between = 2e-6;
  constexpr std::size_t in_cache = 496;  // 262,144 paths of 128 bytes
  constexpr std::size_t many = 1984;     // 1,048,576 paths
  const std::vector<QueuePolicy> queues{
      {"queues, free memory and launches, 8 cells a visit, a million paths", many, 8, 0.0, no_limit},
      {"queues, the same, 4 cells", many, 4, 0.0, no_limit},
      {"queues, 4 cells, a million paths", many, 4, between, memory},
      {"queues, 8 cells, a million paths", many, 8, between, memory},
      {"queues, 16 cells, a million paths", many, 16, between, memory},
      {"queues, 8 cells, 262,144 paths in L2", in_cache, 8, between, cache},
      {"queues, 16 cells, 262,144 paths in L2", in_cache, 16, between, cache},
      {"queues, 8 cells, a million paths, 5 us between kernels", many, 8, 5e-6, memory},
  };
  const std::vector<GroupPolicy> groups{{.name = "two paths a lane"},
                                        {.name = "the same, room for 4 groups (Ada)", .resident = 4}};
  print_header();
  for (const QueuePolicy& policy : queues) simulate<Queues>(pixels, passes, policy, first);
  for (const GroupPolicy& policy : groups) simulate<Groups>(pixels, passes, policy, first);
}

}  // namespace cumulet::bench
