// Reports the cost of each kernel of the library on AMD GPUs, by Mesa's compiler, and that of the path tracer on
// NVIDIA's, by nvcc: see README.md.

#include <algorithm>
#include <cstdio>
#include <exception>
#include <fstream>
#include <iterator>
#include <map>
#include <memory>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "bounds.hpp"
#include "kernels.hpp"
#include "null_device.hpp"
#include "nvcc.hpp"

namespace {

using cumulet::gpu_cost::Bounds;
using cumulet::gpu_cost::Compiler;
using cumulet::gpu_cost::Cost;
using cumulet::gpu_cost::Kernel;
using cumulet::gpu_cost::NullDevice;
using cumulet::gpu_cost::Nvcc;

constexpr const char* usage =
    "usage: cumulet-gpu-cost [--family NAME]... [--only TEXT] [--glsl FOLDER] [--bounds FILE [--update]] "
    "[--update-readme FILE]\n"
    "  --family         one of RADV_FORCE_FAMILY's: navi21, gfx1100, vega10 (default: these three); or only NVIDIA's:\n"
    "                   sm_89, sm_90\n"
    "  --only           kernels whose name has this text\n"
    "  --glsl           shaders of a folder like glsl/ instead of the library's: what a change would cost\n"
    "  --bounds         exit status 1 if a kernel costs more than this file allows\n"
    "  --update         the file's bounds of these families become today's costs, with a little room\n"
    "  --update-readme  the table between <!-- gpu_cost:begin --> and <!-- gpu_cost:end -->, for NVIDIA's families\n"
    "                   nvidia_cost\n";

bool is_nvidia(const std::string& family) { return family.starts_with("sm_"); }

struct Options {
  std::vector<std::string> families;
  std::string only;
  std::string glsl;
  std::string bounds;
  std::string readme;
  bool update = false;
};

Options parse(int argc, char** argv) {
  Options options;
  for (int i = 1; i < argc; ++i) {
    const std::string flag = argv[i];
    const auto value = [&]() -> std::string {
      if (i + 1 >= argc) throw std::invalid_argument(flag + " needs a value");
      return argv[++i];
    };
    if (flag == "--family")
      options.families.push_back(value());
    else if (flag == "--only")
      options.only = value();
    else if (flag == "--glsl")
      options.glsl = value();
    else if (flag == "--bounds")
      options.bounds = value();
    else if (flag == "--update")
      options.update = true;
    else if (flag == "--update-readme")
      options.readme = value();
    else
      throw std::invalid_argument("unknown argument '" + flag + "'");
  }
  if (options.families.empty()) options.families = {"navi21", "gfx1100", "vega10"};
  const auto nvidia = std::ranges::count_if(options.families, is_nvidia);
  if (nvidia != 0 && nvidia != std::ssize(options.families))
    throw std::invalid_argument("families of NVIDIA and of AMD cannot be combined");
  if (options.update && (options.bounds.empty() || !options.only.empty()))
    throw std::invalid_argument("--update needs --bounds, and all kernels");
  return options;
}

struct Row {
  std::string kernel;
  std::map<std::string, Cost> costs;  // by family
};

void print(const std::string& family, const std::vector<Row>& rows) {
  std::printf("%s\n%-68s %5s %6s %6s %7s %6s %5s %6s\n", family.c_str(), "kernel", "VGPRs", "spillV", "spillS",
              "scratch", "shared", "waves", "code");
  for (const Row& row : rows) {
    const Cost& c = row.costs.at(family);
    std::printf("%-68s %5u %6u %6u %7u %6u %5u %6u\n", row.kernel.c_str(), c.registers, c.spilled, c.spilled_scalars,
                c.scratch_bytes, c.shared_bytes, c.waves, c.code_bytes);
  }
}

std::string title(const std::string& family) {
  if (family == "navi21") return "RDNA 2 (" + family + ")";
  if (family == "gfx1100") return "RDNA 3 (" + family + ")";
  if (family == "sm_89") return "Ada (" + family + ")";
  if (family == "sm_90") return "Hopper (" + family + ")";
  return family == "vega10" ? "GCN 5 (" + family + ")" : family;
}

std::string markdown(const std::vector<std::string>& families, const std::vector<Row>& rows) {
  std::string text = "| Kernel |";
  std::string line = "|---|";
  for (const std::string& family : families) text.append(" ").append(title(family)).append(" |"), line += "---|";
  text += "\n" + line + "\n";
  for (const Row& row : rows) {
    text.append("| `").append(row.kernel).append("` |");
    for (const std::string& family : families) {
      const Cost& c = row.costs.at(family);
      char cell[160];
      if (is_nvidia(family))
        std::snprintf(cell, sizeof(cell), " %u / %u / %u", c.registers, c.waves, c.code_bytes / 16);
      else
        std::snprintf(cell, sizeof(cell), " %u / %u / %.1f KB", c.registers, c.waves, c.code_bytes / 1024.0);
      text += cell;
      if (c.spilled > 0) text.append(", ").append(std::to_string(c.spilled)).append(" spilled");
      if (c.scratch_bytes > 0) text.append(", ").append(std::to_string(c.scratch_bytes)).append(" B scratch");
      text += " |";
    }
    text += "\n";
  }
  return text;
}

void update_readme(const std::string& path, const std::string& name, const std::string& table) {
  std::ostringstream stream;
  stream << std::ifstream(path).rdbuf();
  std::string text = stream.str();
  const std::string begin = "<!-- " + name + ":begin -->\n";
  const std::size_t from = text.find(begin);
  const std::size_t to = text.find("<!-- " + name + ":end -->");
  if (from == std::string::npos || to == std::string::npos || to < from)
    throw std::runtime_error(path + " has no markers of " + name);
  text.replace(from + begin.size(), to - from - begin.size(), table);
  std::ofstream(path) << text;
}

std::unique_ptr<Compiler> compiler_of(const std::string& family, const std::string& glsl) {
  if (is_nvidia(family)) return Nvcc::open(family, glsl);
  return NullDevice::open(family);
}

int run(const Options& options) {
  const bool nvidia = is_nvidia(options.families.front());
  std::vector<Kernel> kernels;
  for (Kernel& kernel : nvidia ? cumulet::gpu_cost::cuda_kernels() : cumulet::gpu_cost::kernels(options.glsl)) {
    if (kernel.name.find(options.only) != std::string::npos) kernels.push_back(std::move(kernel));
  }
  std::vector<Row> rows;
  for (const Kernel& kernel : kernels) rows.push_back({kernel.name, {}});
  Bounds bounds = options.bounds.empty() ? Bounds() : Bounds::read(options.bounds);
  int over = 0;
  for (const std::string& family : options.families) {
    const auto device = compiler_of(family, options.glsl);
    if (!device) {
      std::printf("SKIPPED: no %s here\n", nvidia ? "nvcc" : "RADV null device (Debian: mesa-vulkan-drivers)");
      return 0;
    }
    if (options.update) bounds.driver = device->version();
    if (!bounds.driver.empty() && bounds.driver != device->version()) {
      std::printf("SKIPPED: %s is for %s, here is %s\n", options.bounds.c_str(), bounds.driver.c_str(),
                  device->version().c_str());
      return 0;
    }
    for (std::size_t i = 0; i < kernels.size(); ++i) {
      try {
        rows[i].costs[family] = device->cost(kernels[i]);
      } catch (const std::exception& error) {
        throw std::runtime_error(kernels[i].name + ": " + error.what());
      }
    }
    print(family, rows);
    if (options.update) bounds.erase(family);
    for (const Row& row : rows) {
      if (options.update) bounds.set(family, row.kernel, row.costs.at(family));
      if (options.bounds.empty()) continue;
      const std::string complaint = bounds.complaint(family, row.kernel, row.costs.at(family));
      if (complaint.empty()) continue;
      std::printf("OVER: %s, %s: %s\n", family.c_str(), row.kernel.c_str(), complaint.c_str());
      ++over;
    }
    if (options.only.empty()) {
      for (const std::string& stale : bounds.stale(family, kernels)) {
        std::printf("STALE: %s, %s: a bound, but no such kernel\n", family.c_str(), stale.c_str());
        ++over;
      }
    }
  }
  if (over > 0)
    std::printf("%d kernels are not within %s; if they shall be so: --update\n", over, options.bounds.c_str());
  if (options.update) bounds.write(options.bounds);
  if (!options.readme.empty())
    update_readme(options.readme, nvidia ? "nvidia_cost" : "gpu_cost", markdown(options.families, rows));
  return over > 0 ? 1 : 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(parse(argc, argv));
  } catch (const std::invalid_argument& error) {
    std::fprintf(stderr, "cumulet-gpu-cost: %s\n%s", error.what(), usage);
    return 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "cumulet-gpu-cost: %s\n", error.what());
    return 1;
  }
}
