#pragma once

#include "bvh_times.hpp"
#include "options.hpp"
#include "results.hpp"

namespace cumulet::bench {

struct Machine {
  std::string gl_renderer;
  std::string gl_version;
  std::string context;
  std::string cpu;
  unsigned threads = 0;
};

/// Writes report.md, results.csv and the plots into options.out, and the README's part if requested. Throws
/// std::runtime_error that names the file.
void write_report(const Machine& machine, const Options& options, const std::vector<AssetResult>& assets,
                  const std::vector<TreeTimes>& trees, const std::vector<std::string>& skipped);

}  // namespace cumulet::bench
