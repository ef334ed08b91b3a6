#pragma once

// Recorded paths, costs and a scheduler, for simulations of an NVIDIA GPU (lanes.cpp, queues.cpp).

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace cumulet::bench {

enum class Work : std::uint8_t { camera, step, event, shadow, end, finish };  // shadow: the end of a shadow ray
constexpr std::size_t works = 6;

struct Item {
  Work work;
  std::uint8_t levels = 0;  // camera: levels of the point-location tree; 0: the ray misses the bounds
  bool kept = false;        // camera: the ray enters the same cell as the pixel's last one
};
using Path = std::vector<Item>;
using Pixel = std::vector<Path>;  // its samples

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

/// An H200.
struct Gpu {
  static constexpr double schedulers = 528.0;
  static constexpr double clock = 1.755e9;
};

/// Work of a picture's paths on one scheduler.
struct Sums {
  double paths = 0.0;
  double cycles = 0.0;
  double instructions = 0.0;
  std::array<double, works> lanes{};
  std::array<double, works> warps{};
  double bytes = 0.0;    // of paths and cells in memory beyond L1, where they are counted
  double waiting = 0.0;  // cycles between kernels
  double kernels = 0.0;
  void count(Work work, std::size_t active) {
    lanes.at(static_cast<std::size_t>(work)) += static_cast<double>(active);
    warps.at(static_cast<std::size_t>(work)) += 1.0;
  }
  [[nodiscard]] double lanes_of(Work work) const {
    const auto i = static_cast<std::size_t>(work);
    return lanes.at(i) / std::max(1.0, warps.at(i));
  }
};

/// Prints the header of a table of rows.
void print_header();
/// Prints a row: its speed is relative to a variant that takes `first` cycles per path; 0: this one.
void print_row(const std::string& name, const Sums& sums, double first);

/// Work that a warp does next.
struct Segment {
  double instructions = 0.0;
  double latency = 0.0;  // after them
};

/// Runs warps on one scheduler. At most `resident` are there at once, and they share its issue slots. next(warp,
/// segment) sets the next segment of a warp, or returns false at its end. Returns the time in cycles.
template <class Next>
double run_warps(std::size_t count, std::size_t resident, Next&& next) {
  struct Running {
    std::size_t warp;
    Segment left;
    double wake;
  };
  std::vector<Running> running;
  std::size_t begun = 0;
  double time = 0.0;
  for (;;) {
    while (running.size() < resident && begun < count) {
      Segment first;
      if (next(begun, first)) running.push_back({begun, first, 0.0});
      ++begun;
    }
    if (running.empty()) return time;
    const auto issues = [](const Running& one) { return one.left.instructions > 0.0; };
    const auto issuing = static_cast<double>(std::ranges::count_if(running, issues));
    const double rate = std::min(1.0 / Costs::cycles_alone, 1.0 / std::max(1.0, issuing));
    double until = 1e300;
    for (const Running& one : running)
      until = std::min(until, issues(one) ? time + one.left.instructions / rate : one.wake);
    const double passed = until - time;
    time = until;
    std::erase_if(running, [&](Running& one) {
      if (issues(one)) {
        one.left.instructions -= passed * rate;
        if (one.left.instructions > 1e-6) return false;
        one.left.instructions = 0.0;
        one.wake = time + one.left.latency;
      }
      return one.wake <= time && !next(one.warp, one.left);
    });
  }
}

}  // namespace cumulet::bench
