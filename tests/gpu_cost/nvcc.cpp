#include "nvcc.hpp"

#include <elf.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <sstream>
#include <stdexcept>

namespace cumulet::gpu_cost {

namespace {

namespace fs = std::filesystem;

constexpr std::size_t instruction_bytes = 16;
constexpr std::array<const char*, 5> parts{"trace", "step", "event", "camera", "two_paths"};

struct Output {
  int status;
  std::string text;
};

Output run(const std::string& command) {
  Output output{-1, {}};
  FILE* pipe = popen((command + " 2>&1").c_str(), "r");
  if (pipe == nullptr) return output;
  std::array<char, 4096> buffer{};
  while (std::fgets(buffer.data(), buffer.size(), pipe) != nullptr) output.text += buffer.data();
  output.status = pclose(pipe);
  return output;
}

std::string quoted(const std::string& text) { return "'" + text + "'"; }

// Two 64-bit halves of an instruction of sm_70 and later.
struct Instruction {
  std::uint64_t low;
  std::uint64_t high;

  [[nodiscard]] bool is_branch() const { return (low & 0x1ffU) == 0x147U; }
  // Distance of a branch's target from the next instruction. sm_90 has eight more bits than the generations before.
  [[nodiscard]] std::int64_t distance(bool has_more_bits) const {
    constexpr std::int64_t sign = std::int64_t{1} << 47;
    auto words = static_cast<std::int64_t>((low >> 34U) | ((high & 0x3ffffU) << 30U));
    if (words >= sign) words -= 2 * sign;
    if (has_more_bits) words = words * 256 + static_cast<std::int64_t>((low >> 16U) & 0xffU);
    return words / 4;
  }
};

std::vector<Instruction> instructions_of(const std::vector<unsigned char>& code) {
  std::vector<Instruction> all(code.size() / instruction_bytes);
  if (!all.empty()) std::memcpy(all.data(), code.data(), all.size() * instruction_bytes);
  return all;
}

// Warps that a scheduler holds at once: a quarter of a multiprocessor's 65536 registers, in units of 256, and of its
// shared memory. Groups with shared memory have one warp.
std::uint32_t warps_of(const Cost& cost, const std::string& family) {
  const bool is_small = family == "sm_86" || family == "sm_89";
  const std::uint32_t most = is_small ? 12 : 16;
  const std::uint32_t per_warp = (std::max(cost.registers, 1U) * 32 + 255) / 256 * 256;
  const std::uint32_t warps = std::min(most, 16384 / per_warp);
  if (cost.shared_bytes == 0) return warps;
  constexpr std::uint32_t reserved = 1024;  // per group
  return std::min(warps, (is_small ? 100U : 228U) * 1024 / 4 / (cost.shared_bytes + reserved));
}

std::vector<unsigned char> bytes_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

// "Cuda compilation tools, release 13.0, V13.0.88" gives "nvcc 13.0.88".
std::string version_of(const std::string& text) {
  const std::size_t at = text.find(", V");
  return at == std::string::npos ? "" : "nvcc " + text.substr(at + 3, text.find_first_of("\n ", at + 3) - at - 3);
}

std::map<std::string, Cost> compile(const std::string& family, const std::string& glsl, int linear) {
  const fs::path cubin =
      fs::temp_directory_path() / ("cumulet_gpu_cost_" + std::to_string(getpid()) + family + ".cubin");
  const Output output =
      run(std::string(CUMULET_NVCC) + " -w -std=c++20 -use_fast_math -cubin -Xptxas -v -arch=" + family +
          " -DCM_LINEAR=" + std::to_string(linear) + " -I" + quoted(glsl) + " -o " + quoted(cubin.string()) + " " +
          quoted(std::string(CUMULET_CUDA_DIR) + "/kernels.cu"));
  if (output.status != 0) throw std::runtime_error("nvcc: " + output.text);
  const auto functions = functions_of(bytes_of(cubin));
  fs::remove(cubin);
  std::map<std::string, Cost> costs;
  for (const auto& [name, code] : functions) costs[name].code_bytes = static_cast<std::uint32_t>(code.size());
  read_report(output.text, costs);
  costs["cm_cost_step"].code_bytes =
      static_cast<std::uint32_t>(instruction_bytes * longest_loop(functions.at("cm_cost_step")));
  return costs;
}

}  // namespace

std::vector<Kernel> cuda_kernels() {
  std::vector<Kernel> kernels;
  for (const char* part : parts) {
    for (const char* linear : {" LINEAR=0", " LINEAR=1"}) kernels.push_back({std::string(part) + linear, {}, {}, {}});
  }
  return kernels;
}

std::map<std::string, std::vector<unsigned char>> functions_of(const std::vector<unsigned char>& cubin) {
  const auto read = [&](auto& value, std::uint64_t at) {
    if (at + sizeof value > cubin.size()) throw std::runtime_error("the cubin is cut off");
    std::memcpy(&value, &cubin[at], sizeof value);
  };
  Elf64_Ehdr header{};
  read(header, 0);
  std::vector<Elf64_Shdr> sections(header.e_shnum);
  for (std::size_t i = 0; i < sections.size(); ++i) read(sections[i], header.e_shoff + i * sizeof(Elf64_Shdr));
  const std::uint64_t names = sections.at(header.e_shstrndx).sh_offset;
  const std::string prefix = ".text.";
  std::map<std::string, std::vector<unsigned char>> functions;
  for (const Elf64_Shdr& section : sections) {
    std::string name;
    for (std::uint64_t at = names + section.sh_name; at < cubin.size() && cubin[at] != 0; ++at)
      name += static_cast<char>(cubin[at]);
    if (!name.starts_with(prefix)) continue;
    if (section.sh_offset + section.sh_size > cubin.size()) throw std::runtime_error("the cubin is cut off");
    const auto begin = cubin.begin() + static_cast<std::ptrdiff_t>(section.sh_offset);
    functions[name.substr(prefix.size())].assign(begin, begin + static_cast<std::ptrdiff_t>(section.sh_size));
  }
  return functions;
}

std::size_t longest_loop(const std::vector<unsigned char>& code) {
  const std::vector<Instruction> all = instructions_of(code);
  // A function ends with a branch to itself, in front of padding. It shows how distances are encoded.
  const auto last = std::ranges::find_if(all.rbegin(), all.rend(), &Instruction::is_branch);
  if (last == all.rend()) return 0;
  const bool has_more_bits = last->distance(true) == -1;
  std::size_t longest = 0;
  const auto count = static_cast<std::int64_t>(all.rend() - last) - 1;
  for (std::int64_t i = 0; i < count; ++i) {
    const Instruction& instruction = all[static_cast<std::size_t>(i)];
    if (!instruction.is_branch()) continue;
    const std::int64_t target = i + 1 + instruction.distance(has_more_bits);
    if (target >= 0 && target <= i) longest = std::max(longest, static_cast<std::size_t>(i - target + 1));
  }
  return longest;
}

void read_report(const std::string& report, std::map<std::string, Cost>& costs) {
  std::istringstream lines(report);
  std::string function;
  for (std::string line; std::getline(lines, line);) {
    if (const std::size_t at = line.find("entry function '"); at != std::string::npos) {
      function = line.substr(at + 16, line.find('\'', at + 16) - at - 16);
      continue;
    }
    unsigned frame = 0;
    unsigned stores = 0;
    unsigned registers = 0;
    if (std::sscanf(line.c_str(), " %u bytes stack frame, %u bytes spill stores", &frame, &stores) == 2) {
      costs[function].scratch_bytes = frame * 32;  // per warp
      costs[function].spilled = stores / 4;
    }
    if (const std::size_t at = line.find("Used "); at != std::string::npos) {
      if (std::sscanf(&line[at], "Used %u registers", &registers) == 1) costs[function].registers = registers;
    }
    if (const std::size_t at = line.find(" bytes smem"); at != std::string::npos) {
      unsigned shared = 0;
      if (std::sscanf(&line[line.rfind(' ', at - 1)], " %u bytes smem", &shared) == 1)
        costs[function].shared_bytes = shared;
    }
  }
}

std::unique_ptr<Nvcc> Nvcc::open(const std::string& family, const std::string& glsl) {
  const std::string program = CUMULET_NVCC;
  if (program.empty()) return nullptr;
  std::unique_ptr<Nvcc> nvcc(new Nvcc);
  nvcc->version_ = version_of(run(program + " --version").text);
  if (nvcc->version_.empty()) return nullptr;
  for (const int linear : {0, 1}) {
    for (auto& [name, cost] : compile(family, glsl.empty() ? CUMULET_GLSL_DIR : glsl, linear)) {
      cost.waves = warps_of(cost, family);
      constexpr std::size_t prefix = std::string_view("cm_cost_").size();
      nvcc->costs_[name.substr(std::min(prefix, name.size())) + " LINEAR=" + std::to_string(linear)] = cost;
    }
  }
  return nvcc;
}

Cost Nvcc::cost(const Kernel& kernel) {
  const auto found = costs_.find(kernel.name);
  if (found == costs_.end()) throw std::runtime_error("kernels.cu has no such kernel");
  return found->second;
}

}  // namespace cumulet::gpu_cost
