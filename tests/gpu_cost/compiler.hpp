#pragma once

#include <string>

#include "cost.hpp"
#include "kernels.hpp"

namespace cumulet::gpu_cost {

/// A compiler for a family of GPUs. No GPU need be present.
class Compiler {
 public:
  Compiler() = default;
  Compiler(const Compiler&) = delete;
  Compiler& operator=(const Compiler&) = delete;
  virtual ~Compiler() = default;
  /// Throws std::runtime_error if the kernel cannot be compiled.
  virtual Cost cost(const Kernel& kernel) = 0;
  /// "Mesa 22.3.6". Other versions generate other code.
  [[nodiscard]] virtual const std::string& version() const = 0;
};

}  // namespace cumulet::gpu_cost
