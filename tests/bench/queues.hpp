#pragma once

#include <cstdint>
#include <vector>

#include "warps.hpp"

namespace cumulet::bench {

/// Simulates a picture whose paths wait for work of their kind, and prints a row per variant. Either kernels run over
/// queues in memory (wavefront), or a warp chooses among its paths in shared memory. passes: numbers of samples. first:
/// cycles per path of the table's first row.
void simulate_kernels(const std::vector<Pixel>& pixels, const std::vector<std::uint32_t>& passes, double first);

}  // namespace cumulet::bench
