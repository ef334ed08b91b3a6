#pragma once

#include <cstdint>

namespace cumulet::gpu_cost {

/// Resources that a kernel's machine code uses on a GPU. For two-stage programs, those of the fragment shader.
struct Cost {
  std::uint32_t registers = 0;        // vector registers per lane
  std::uint32_t spilled = 0;          // vector registers spilled to memory
  std::uint32_t spilled_scalars = 0;  // scalar registers spilled to vector registers
  std::uint32_t scratch_bytes = 0;    // per wave
  std::uint32_t shared_bytes = 0;     // per work group
  std::uint32_t waves = 0;            // concurrent waves per SIMD
  std::uint32_t code_bytes = 0;
};

}  // namespace cumulet::gpu_cost
