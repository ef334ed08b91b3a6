#include "warps.hpp"

#include <cstdio>

namespace cumulet::bench {

void print_header() {
  std::printf(
      "\n| Variant | Million paths/s of an H200 | x | Instructions a path | Issue slots filled, %% | Lanes a step | an "
      "event | a camera ray | Bytes a path | Kernels | Between kernels, %% |\n"
      "|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n");
}

void print_row(const std::string& name, const Sums& sums, double first) {
  const double cycles = sums.cycles / sums.paths;
  std::printf("| %s | %.0f | %.2f | %.0f | %.0f | %.1f | %.1f | %.1f |", name.c_str(),
              1e-6 * Gpu::clock * Gpu::schedulers / cycles, first > 0.0 ? first / cycles : 1.0,
              sums.instructions / sums.paths, 100.0 * sums.instructions / sums.cycles, sums.lanes_of(Work::step),
              sums.lanes_of(Work::event), sums.lanes_of(Work::camera));
  if (sums.kernels > 0.0)
    std::printf(" %.0f | %.0f | %.0f |\n", sums.bytes / sums.paths, sums.kernels, 100.0 * sums.waiting / sums.cycles);
  else
    std::printf(" | | |\n");
  std::fflush(stdout);
}

}  // namespace cumulet::bench
