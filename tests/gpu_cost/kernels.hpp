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

/// Of each shader so many variants that each two values of two macros that occur together do so in one of these, ranges
/// by their ends. A new macro or value is thus among them by itself. folder: their sources are read there; empty: as
/// the library has them. Throws Error(file).
std::vector<Kernel> kernels(const std::filesystem::path& folder = {});

}  // namespace cumulet::gpu_cost
