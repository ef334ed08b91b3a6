// cumulet-bench: compares the tetrahedral grid with other grid types in one run, as ratios.

#include <cstdio>
#include <exception>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include "costs.hpp"
#include "defaults.hpp"
#include "denoise.hpp"
#include "judged.hpp"
#include "measure.hpp"
#include "peers.hpp"
#include "report.hpp"
#include "sampling.hpp"

namespace {

using namespace cumulet;

std::string cpu_name() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);) {
    const std::size_t colon = line.find(": ");
    if (line.rfind("model name", 0) == 0 && colon != std::string::npos) return line.substr(colon + 2);
  }
  return "unknown";
}

bench::Machine machine_of(headless::Context& context) {
  const viewer::GlStrings gl = test::Still(context).viewer().stats().strings;
  return {gl.renderer, gl.version, context.name(), cpu_name(), std::thread::hardware_concurrency()};
}

void run(const bench::Options& options) {
  // Checks paths before minutes of measurements.
  if (!options.readme.empty() && !std::ifstream(options.readme)) {
    throw std::runtime_error(options.readme.string() + ": cannot be read");
  }
  const bool all = !(options.surfaces_threshold > 0.0) && !options.defaults && !options.costs && !options.equal_error &&
                   !options.peers && !options.adaptive && !options.techniques;
  if (all) std::filesystem::create_directories(options.out);
  headless::Context context = headless::Context::create(options.backend);
  const bench::Machine machine = machine_of(context);
  bench::progress(machine.gl_renderer);
  if (options.adaptive) bench::measure_adaptive(context, options);
  if (options.techniques) bench::measure_techniques(context, options);
  if (options.adaptive || options.techniques) return;
  if (options.denoise || options.settle) {
    std::filesystem::create_directories(options.out);
    if (options.denoise) bench::measure_denoise(context, options);
    if (options.settle) bench::measure_settle(context, options);
    return;
  }
  std::vector<bench::AssetResult> results;
  std::vector<std::string> skipped;
  if (options.defaults) std::printf("%s", bench::defaults_head().c_str());
  for (const bench::Input& input : options.inputs) {
    if (input.optional && !std::filesystem::exists(input.file)) {
      skipped.push_back(input.name + ", there is no " + input.file.string());
      bench::progress("skipped: " + skipped.back());
      continue;
    }
    bench::progress(input.name);
    if (options.defaults) {
      std::printf("%s", bench::measure_defaults(context, bench::load_asset(input, true), options).c_str());
      continue;
    }
    if (options.costs) {
      bench::measure_costs(context, input, options);
      continue;
    }
    if (options.equal_error) {
      bench::measure_equal_error(context, input, options);
      continue;
    }
    if (options.peers) {
      bench::measure_peers(context, bench::load_asset(input), options);
      continue;
    }
    if (!all) {
      bench::measure_surfaces_alone(context, bench::load_asset(input), options);
      continue;
    }
    results.push_back(bench::measure(context, bench::load_asset(input), options));
    bench::write_report(machine, options, results, {}, skipped);  // writes completed results in case of a later failure
  }
  if (!all) return;
  bench::progress("triangle trees");
  bench::write_report(machine, options, results, bench::measure_trees(options), skipped);
  bench::progress("written: " + (options.out / "report.md").string());
}

}  // namespace

int main(int argc, char** argv) {
  const bench::ParseResult parsed = bench::parse(argc, argv, bench::judged_names());
  if (parsed.status >= 0) return parsed.status;
  try {
    run(parsed.options);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "cumulet-bench: %s\n", error.what());
    return 1;
  }
  return 0;
}
