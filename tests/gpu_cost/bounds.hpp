#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "cost.hpp"
#include "kernels.hpp"

namespace cumulet::gpu_cost {

/// Maximum cost of kernels (for waves: the minimum), by family and kernel.
class Bounds {
 public:
  /// The compiler version that they apply to; empty: any.
  std::string driver;

  Bounds() = default;
  /// Throws std::runtime_error that names the invalid line. A missing file gives no bounds.
  static Bounds read(const std::string& path);
  void write(const std::string& path) const;
  /// Sets bounds to the current cost with a small margin.
  void set(const std::string& family, const std::string& kernel, const Cost& cost);
  void erase(const std::string& family);
  /// A line with all bounds that the kernel exceeds; empty if there are none. A kernel without a bound exceeds it.
  [[nodiscard]] std::string complaint(const std::string& family, const std::string& kernel, const Cost& cost) const;
  /// Names of kernels of this family that have bounds but are not in the list.
  [[nodiscard]] std::vector<std::string> stale(const std::string& family, const std::vector<Kernel>& kernels) const;

 private:
  std::map<std::pair<std::string, std::string>, Cost> bounds_;
};

}  // namespace cumulet::gpu_cost
