#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "cost.hpp"
#include "kernels.hpp"

namespace cumulet::gpu_cost {

/// What kernels may cost at most (of waves: at least), by family and kernel.
class Bounds {
 public:
  /// The compiler that they hold for; empty: any.
  std::string driver;

  Bounds() = default;
  /// Throws std::runtime_error that names the line that cannot be read. No file: no bounds.
  static Bounds read(const std::string& path);
  void write(const std::string& path) const;
  /// Today's cost, with a little room.
  void set(const std::string& family, const std::string& kernel, const Cost& cost);
  void erase(const std::string& family);
  /// One line for all in which the kernel is over its bound; empty if nothing. A kernel without a bound is over it.
  [[nodiscard]] std::string complaint(const std::string& family, const std::string& kernel, const Cost& cost) const;
  /// Of this family, bounds of kernels that are not among these.
  [[nodiscard]] std::vector<std::string> stale(const std::string& family, const std::vector<Kernel>& kernels) const;

 private:
  std::map<std::pair<std::string, std::string>, Cost> bounds_;
};

}  // namespace cumulet::gpu_cost
