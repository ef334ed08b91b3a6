#pragma once

#include <cstdint>

namespace cumulet::gpu_cost {

/// What a kernel's machine code takes of a GPU. Of programs of two stages: the fragment shader's.
struct Cost {
  std::uint32_t registers = 0;        // vector ones a lane
  std::uint32_t spilled = 0;          // of them, kept in memory
  std::uint32_t spilled_scalars = 0;  // kept in vector registers
  std::uint32_t scratch_bytes = 0;    // a wave's
  std::uint32_t shared_bytes = 0;     // a work group's
  std::uint32_t waves = 0;            // at once on a SIMD
  std::uint32_t code_bytes = 0;
};

}  // namespace cumulet::gpu_cost
