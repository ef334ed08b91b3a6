#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace cumulet::gpu_cost {

/// One program of the library, as gl::shaders() names it.
struct Kernel {
  std::string name;      // of its last stage, and the macros: "trace.comp MARCH=0 ..."
  std::string fragment;  // source; or
  std::string vertex;
  std::string compute;
};

/// Selects variants of each shader such that each pair of values of two macros that can occur together is covered.
/// Ranges are covered by their ends. New macros and values are included automatically. folder: reads the sources there;
/// empty: the library's own. Throws Error(file).
std::vector<Kernel> kernels(const std::filesystem::path& folder = {});

}  // namespace cumulet::gpu_cost
