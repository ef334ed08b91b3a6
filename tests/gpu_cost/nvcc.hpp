#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "compiler.hpp"

namespace cumulet::gpu_cost {

/// Names of the kernels of cuda/kernels.cu: the whole path tracer ("trace"), the loop of the traversal ("step"), an
/// event and a camera ray, each for constant and for linear cells.
std::vector<Kernel> cuda_kernels();

/// NVIDIA's CUDA compiler. GL's compiler may need other registers and instructions, by 10 to 20 %.
/// In a Cost, waves are warps of 32 lanes per scheduler. An instruction has 16 bytes of code.
class Nvcc final : public Compiler {
 public:
  /// Compiles all kernels. family: "sm_90". glsl: folder of the shaders; empty: the library's. Returns null if nvcc is
  /// not installed. Throws std::runtime_error with its messages.
  static std::unique_ptr<Nvcc> open(const std::string& family, const std::string& glsl);
  Cost cost(const Kernel& kernel) override;
  [[nodiscard]] const std::string& version() const override { return version_; }

 private:
  Nvcc() = default;

  std::map<std::string, Cost> costs_;  // by kernel
  std::string version_;
};

/// Code of the functions in a cubin (ELF), by name. Throws std::runtime_error if it is not one.
std::map<std::string, std::vector<unsigned char>> functions_of(const std::vector<unsigned char>& cubin);
/// Number of instructions in the longest loop; 0 if there is none.
std::size_t longest_loop(const std::vector<unsigned char>& code);
/// Adds registers and spills from ptxas' report (-Xptxas -v), by function.
void read_report(const std::string& report, std::map<std::string, Cost>& costs);

}  // namespace cumulet::gpu_cost
