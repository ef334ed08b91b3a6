#include "bounds.hpp"

#include <algorithm>
#include <fstream>
#include <iomanip>
#include <sstream>
#include <stdexcept>

namespace cumulet::gpu_cost {

namespace {

constexpr std::uint32_t register_room = 4;
constexpr std::uint32_t share_of_room = 20;  // room for code, spills and scratch memory: one part in this number

std::uint32_t with_room(std::uint32_t value) { return value + value / share_of_room; }

}  // namespace

Bounds Bounds::read(const std::string& path) {
  Bounds bounds;
  std::ifstream file(path);
  std::string line;
  while (std::getline(file, line)) {
    if (line.empty() || line[0] == '#') continue;
    std::istringstream numbers(line);
    if (line.starts_with("driver ")) {
      bounds.driver = line.substr(7);
      continue;
    }
    std::string family;
    Cost cost;
    numbers >> family >> cost.registers >> cost.spilled >> cost.spilled_scalars >> cost.scratch_bytes >>
        cost.shared_bytes >> cost.waves >> cost.code_bytes >> std::ws;
    std::string kernel;
    if (!numbers || !std::getline(numbers, kernel)) {
      throw std::runtime_error(std::string(path).append(": cannot read '").append(line).append("'"));
    }
    bounds.bounds_[{family, kernel}] = cost;
  }
  return bounds;
}

void Bounds::write(const std::string& path) const {
  std::ofstream file(path);
  file << "# Limits of the cost of each kernel on a family of GPUs: maxima, of waves minima. README.md has the command "
          "that writes this file.\n";
  if (!driver.empty()) file << "driver " << driver << '\n';
  file << "# family  registers  spilled  spilled scalars  scratch  shared  waves  code  kernel\n";
  for (const auto& [key, cost] : bounds_) {
    file << std::left << std::setw(7) << key.first << std::right << ' ' << std::setw(3) << cost.registers << ' '
         << std::setw(4) << cost.spilled << ' ' << std::setw(4) << cost.spilled_scalars << ' ' << std::setw(5)
         << cost.scratch_bytes << ' ' << std::setw(5) << cost.shared_bytes << ' ' << std::setw(3) << cost.waves << ' '
         << std::setw(6) << cost.code_bytes << "  " << key.second << '\n';
  }
  if (!file) throw std::runtime_error(path + ": cannot be written");
}

void Bounds::set(const std::string& family, const std::string& kernel, const Cost& cost) {
  Cost& bound = bounds_[{family, kernel}];
  bound = cost;
  bound.registers += register_room;
  bound.spilled = with_room(cost.spilled);
  bound.spilled_scalars = cost.spilled_scalars + (cost.spilled_scalars > 0 ? register_room : 0);
  bound.scratch_bytes = with_room(cost.scratch_bytes);
  bound.code_bytes = with_room(cost.code_bytes);
}

void Bounds::erase(const std::string& family) {
  std::erase_if(bounds_, [&](const auto& entry) { return entry.first.first == family; });
}

std::string Bounds::complaint(const std::string& family, const std::string& kernel, const Cost& cost) const {
  const auto found = bounds_.find({family, kernel});
  if (found == bounds_.end()) return "has no bound";
  const Cost& bound = found->second;
  std::string text;
  const auto compare = [&](const char* what, std::uint32_t value, std::uint32_t limit, bool at_least) {
    if (at_least ? value >= limit : value <= limit) return;
    text += (text.empty() ? "" : ", ") + std::to_string(value) + " " + what + " (" +
            (at_least ? "at least " : "at most ") + std::to_string(limit) + ")";
  };
  compare("registers", cost.registers, bound.registers, false);
  compare("spilled", cost.spilled, bound.spilled, false);
  compare("spilled scalars", cost.spilled_scalars, bound.spilled_scalars, false);
  compare("bytes of scratch", cost.scratch_bytes, bound.scratch_bytes, false);
  compare("bytes shared", cost.shared_bytes, bound.shared_bytes, false);
  compare("waves", cost.waves, bound.waves, true);
  compare("bytes of code", cost.code_bytes, bound.code_bytes, false);
  return text;
}

std::vector<std::string> Bounds::stale(const std::string& family, const std::vector<Kernel>& kernels) const {
  std::vector<std::string> names;
  for (const auto& [key, cost] : bounds_) {
    const bool known = std::ranges::find(kernels, key.second, &Kernel::name) != kernels.end();
    if (key.first == family && !known) names.push_back(key.second);
  }
  return names;
}

}  // namespace cumulet::gpu_cost
