// Reading and writing kernel bounds, and their check by the program.

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <initializer_list>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "bounds.hpp"
#include "nvcc.hpp"

namespace {

using cumulet::gpu_cost::Bounds;
using cumulet::gpu_cost::Cost;
using cumulet::gpu_cost::Kernel;

constexpr Cost cost{
    .registers = 96,
    .spilled = 100,
    .spilled_scalars = 9,
    .scratch_bytes = 6144,
    .shared_bytes = 256,
    .waves = 5,
    .code_bytes = 40000,
};

std::string temporary(const std::string& name) { return testing::TempDir() + name + std::to_string(getpid()); }

Bounds one_bound() {
  Bounds bounds;
  bounds.set("navi21", "trace.comp PAGES=1", cost);
  return bounds;
}

std::string complaint(const Cost& of) { return one_bound().complaint("navi21", "trace.comp PAGES=1", of); }

TEST(CostBounds, AllowASmallExcess) {
  EXPECT_EQ(complaint(cost), "");
  Cost more = cost;
  more.registers += 4;
  more.code_bytes += 2000;
  more.spilled += 5;
  EXPECT_EQ(complaint(more), "");
  Cost less{};
  less.waves = 16;
  EXPECT_EQ(complaint(less), "");
}

TEST(CostBounds, ReportEachExceededNumber) {
  const auto with = [](std::uint32_t Cost::*number, std::uint32_t value) {
    Cost changed = cost;
    changed.*number = value;
    return complaint(changed);
  };
  EXPECT_EQ(with(&Cost::registers, 104), "104 registers (at most 100)");
  EXPECT_EQ(with(&Cost::spilled, 106), "106 spilled (at most 105)");
  EXPECT_EQ(with(&Cost::spilled_scalars, 14), "14 spilled scalars (at most 13)");
  EXPECT_EQ(with(&Cost::scratch_bytes, 7168), "7168 bytes of scratch (at most 6451)");
  EXPECT_EQ(with(&Cost::shared_bytes, 257), "257 bytes shared (at most 256)");
  EXPECT_EQ(with(&Cost::waves, 4), "4 waves (at least 5)");
  EXPECT_EQ(with(&Cost::code_bytes, 42001), "42001 bytes of code (at most 42000)");
  Cost two = cost;
  two.registers = 128;
  two.waves = 4;
  EXPECT_EQ(complaint(two), "128 registers (at most 100), 4 waves (at least 5)");
}

TEST(CostBounds, NewRegisterSpillingFails) {
  Cost none = cost;
  none.spilled = none.spilled_scalars = none.scratch_bytes = 0;
  Bounds bounds;
  bounds.set("navi21", "k", none);
  none.spilled = 1;
  EXPECT_EQ(bounds.complaint("navi21", "k", none), "1 spilled (at most 0)");
}

TEST(CostBounds, ApplyToOneFamilyAndOneKernel) {
  EXPECT_EQ(one_bound().complaint("gfx1100", "trace.comp PAGES=1", cost), "has no bound");
  EXPECT_EQ(one_bound().complaint("navi21", "trace.comp PAGES=8", cost), "has no bound");
  EXPECT_EQ(one_bound().stale("navi21", {Kernel{"trace.comp PAGES=8", {}, {}, {}}}),
            std::vector<std::string>{"trace.comp PAGES=1"});
  EXPECT_TRUE(one_bound().stale("navi21", {Kernel{"trace.comp PAGES=1", {}, {}, {}}}).empty());
  EXPECT_TRUE(one_bound().stale("gfx1100", {}).empty());
}

TEST(CostBounds, RoundTrip) {
  const std::string path = temporary("bounds");
  Bounds bounds = one_bound();
  bounds.driver = "Mesa 1.2.3";
  bounds.write(path);
  const Bounds back = Bounds::read(path);
  EXPECT_EQ(back.driver, "Mesa 1.2.3");
  EXPECT_EQ(back.complaint("navi21", "trace.comp PAGES=1", cost), "");
  Cost more = cost;
  more.code_bytes = 42001;
  EXPECT_EQ(back.complaint("navi21", "trace.comp PAGES=1", more), "42001 bytes of code (at most 42000)");
  // Numbers of any width.
  constexpr Cost wide{.registers = 1234567,
                      .spilled = 1234567,
                      .spilled_scalars = 1234567,
                      .scratch_bytes = 1234567,
                      .shared_bytes = 1234567,
                      .waves = 1234567,
                      .code_bytes = 12345678};
  bounds.set("a_family_of_gpus", "k", wide);
  bounds.write(path);
  EXPECT_EQ(Bounds::read(path).complaint("a_family_of_gpus", "k", wide), "");
  std::ofstream(path) << "navi21 1 2 three\n";
  EXPECT_THROW(Bounds::read(path), std::runtime_error);
  std::remove(path.c_str());
}

TEST(NvidiaCost, ReportIsRead) {
  std::map<std::string, Cost> costs;
  cumulet::gpu_cost::read_report(
      "ptxas info    : Compiling entry function 'a' for 'sm_90'\n"
      "    16 bytes stack frame, 8 bytes spill stores, 12 bytes spill loads\n"
      "ptxas info    : Used 93 registers, used 0 barriers\n"
      "ptxas info    : Compiling entry function 'b' for 'sm_90'\n"
      "    0 bytes stack frame, 0 bytes spill stores, 0 bytes spill loads\n"
      "ptxas info    : Used 80 registers, used 1 barriers, 9248 bytes smem\n",
      costs);
  EXPECT_EQ(costs.at("a").registers, 93U);
  EXPECT_EQ(costs.at("a").spilled, 2U);
  EXPECT_EQ(costs.at("a").scratch_bytes, 512U);
  EXPECT_EQ(costs.at("a").shared_bytes, 0U);
  EXPECT_EQ(costs.at("b").registers, 80U);
  EXPECT_EQ(costs.at("b").shared_bytes, 9248U);
}

TEST(NvidiaCost, LongestLoopIsFound) {
  // Branches are 0x947 with the distance in words of four bytes from bit 34 on.
  const auto code = [](std::initializer_list<int> distances) {
    std::vector<unsigned char> bytes;
    for (const int distance : distances) {
      const auto words = static_cast<std::uint64_t>(static_cast<std::int64_t>(distance) * 4);
      const std::uint64_t low = distance == 0 ? 0x224U : 0x947U | words << 34U;
      const std::uint64_t high = distance == 0 ? 0U : words >> 30U & 0x3ffffU;
      for (const std::uint64_t half : {low, high})
        for (unsigned i = 0; i < 8; ++i) bytes.push_back(static_cast<unsigned char>(half >> 8U * i));
    }
    return bytes;
  };
  EXPECT_EQ(cumulet::gpu_cost::longest_loop(code({0, 0, -2, 0, -4, 0, -1})), 4U);
  EXPECT_EQ(cumulet::gpu_cost::longest_loop(code({0, 2, 0, 0, -1})), 0U);
  EXPECT_EQ(cumulet::gpu_cost::longest_loop({}), 0U);
  EXPECT_THROW(cumulet::gpu_cost::functions_of({1, 2, 3}), std::runtime_error);
}

// Result of the program for the smallest kernel, run as by the tests gpu_cost.*.
struct Outcome {
  int status;
  std::string text;
};
Outcome run(const Bounds& bounds) {
  const std::string path = temporary("run");
  bounds.write(path);
  const std::string command =
      std::string("'") + CUMULET_GPU_COST + "' --family navi21 --only sign.comp --bounds '" + path + "' 2>&1";
  Outcome outcome{-1, {}};
  FILE* pipe = popen(command.c_str(), "r");
  if (pipe == nullptr) return outcome;
  char buffer[256];
  while (std::fgets(buffer, sizeof(buffer), pipe) != nullptr) outcome.text += buffer;
  outcome.status = WEXITSTATUS(pclose(pipe));
  std::remove(path.c_str());
  return outcome;
}

TEST(GpuCost, FailsAboveOrWithoutABound) {
  Bounds bounds;
  bounds.set("navi21", "sign.comp", {.registers = 256, .waves = 1, .code_bytes = 1000000});
  const Outcome within = run(bounds);
  if (within.text.find("SKIPPED:") != std::string::npos) GTEST_SKIP() << within.text;
  EXPECT_EQ(within.status, 0) << within.text;

  bounds.set("navi21", "sign.comp", {.registers = 256, .waves = 1, .code_bytes = 1});
  const Outcome above = run(bounds);
  EXPECT_EQ(above.status, 1) << above.text;
  EXPECT_NE(above.text.find("OVER: navi21, sign.comp: "), std::string::npos) << above.text;
  EXPECT_NE(above.text.find("bytes of code (at most 1)"), std::string::npos) << above.text;

  const Outcome without = run(Bounds());
  EXPECT_EQ(without.status, 1) << without.text;
  EXPECT_NE(without.text.find("has no bound"), std::string::npos) << without.text;

  bounds.driver = "Mesa 0.0";
  const Outcome other = run(bounds);
  EXPECT_EQ(other.status, 0);
  EXPECT_NE(other.text.find("SKIPPED:"), std::string::npos) << other.text;
}

}  // namespace
