// Simulates SIMD utilization: how many lanes of a vector are active, depending on how paths are assigned to lanes. Run
// by hand:
//
//     cumulet-bench-lanes [--threshold T] [--optical-depth D] [--size PIXELS] [--samples N] FILE...
//
// Paths record their stages and steps (recording.hpp). A vector of lanes runs trace.comp's rounds: work of any lane
// costs all lanes its instructions. Instruction counts are from RDNA 2 code; that of events is fitted to the slowdown
// of an NVIDIA H200 with other round lengths. As many vectors as the device can hold run at once at equal speed. The
// next one starts when one ends.
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <queue>
#include <string>
#include <vector>

#include "recording.hpp"

namespace {

using namespace cumulet;

enum class Work : std::uint8_t { camera, aim, event, step, finish };

// Instructions.
constexpr std::array<double, 5> cost{300.0, 200.0, 600.0, 145.0, 120.0};
constexpr double turn_cost = 15.0;
double cost_of(Work work) { return cost.at(static_cast<std::size_t>(work)); }

using Paths = std::vector<Work>;  // of a pixel, one after another

Paths record(core::Recording& recording, glm::uvec2 at, std::uint32_t samples) {
  using namespace core;
  Paths paths;
  recording.march = [&](std::uint32_t) { paths.push_back(Work::step); };
  recording.cm.dispatch.samples = samples;
  core::Recording::CmPath p{};
  core::Recording::CmPixel pixel{};
  while (p.stage != CM_STAGE_DONE) {
    if (p.stage == CM_STAGE_CAMERA) {
      paths.push_back(Work::camera);
      recording.cm_camera(p, pixel.samples, at);
      paths.push_back(Work::aim);
      recording.cm_aim(p);
      if (p.cell.x == CM_NONE) p.stage = CM_STAGE_FINISH;
    }
    if (p.stage == CM_STAGE_EVENT) {
      paths.push_back(Work::event);
      recording.cm_handle(p, recording.cm_in_medium());
    }
    if (p.stage == CM_STAGE_FLY) {
      p.event = recording.cm_fly(p);
      if (p.event != CM_EVENT_NONE) p.stage = CM_STAGE_EVENT;
    }
    if (p.stage == CM_STAGE_FINISH) {
      paths.push_back(Work::finish);
      recording.cm_finish(p, pixel);
    }
  }
  return paths;
}

struct Lane {
  const Paths* paths = nullptr;
  std::size_t at = 0;
  [[nodiscard]] bool done() const { return paths == nullptr || at == paths->size(); }
  [[nodiscard]] bool is_at(Work work) const { return !done() && (*paths)[at] == work; }
};

struct Sums {
  double instructions = 0.0;
  double steps = 0.0;          // of lanes
  double vectors_steps = 0.0;  // of vectors
  double events = 0.0;
  double vectors_events = 0.0;
};

class Vector {
 public:
  explicit Vector(std::size_t lanes) : lanes_(lanes) {}
  double time = 0.0;  // instructions

  [[nodiscard]] bool done() const {
    return std::ranges::all_of(lanes_, [](const Lane& lane) { return lane.done(); });
  }
  /// Lanes that are done fetch the next pixel.
  void fill(const std::vector<const Paths*>& pixels, std::size_t& next) {
    for (Lane& lane : lanes_) {
      if (lane.done() && next < pixels.size()) lane = {pixels[next++]};
    }
  }
  /// As in glsl/run.glsl.
  void round(int chunk, int events, Sums& sums) {
    const double before = time;
    time += turn_cost;
    work(Work::camera);
    work(Work::aim);
    for (int i = 0; i < events && marches(); ++i) {
      time += turn_cost;
      if (const double count = work(Work::event); count > 0.0) {
        sums.events += count;
        sums.vectors_events += 1.0;
      }
      stays_.assign(lanes_.size(), false);
      for (int k = 0; k < chunk; ++k) {
        double count = 0.0;
        for (std::size_t lane = 0; lane < lanes_.size(); ++lane) {
          if (stays_[lane] || !lanes_[lane].is_at(Work::step)) continue;
          ++lanes_[lane].at;
          stays_[lane] = !lanes_[lane].is_at(Work::step);
          count += 1.0;
        }
        if (count == 0.0) break;
        time += cost_of(Work::step);
        sums.steps += count;
        sums.vectors_steps += 1.0;
      }
    }
    work(Work::finish);
    sums.instructions += time - before;
  }

 private:
  [[nodiscard]] bool marches() const {
    return std::ranges::any_of(lanes_,
                               [](const Lane& lane) { return lane.is_at(Work::event) || lane.is_at(Work::step); });
  }
  // Returns the number of active lanes.
  double work(Work work) {
    double count = 0.0;
    for (Lane& lane : lanes_) {
      if (!lane.is_at(work)) continue;
      ++lane.at;
      count += 1.0;
    }
    if (count > 0.0) time += cost_of(work);
    return count;
  }
  std::vector<Lane> lanes_;
  std::vector<bool> stays_;
};

struct Policy {
  std::size_t lanes = 32;
  bool takes_next = true;  // per lane, once its pixel is done; else per vector, once all its lanes are
  int chunk = 8;
  int events = 8;
};

void simulate(const std::vector<const Paths*>& pixels, const Policy& policy, double vectors_per_slot) {
  Sums sums;
  const auto later = [](const Vector* a, const Vector* b) { return a->time > b->time; };
  std::priority_queue<Vector*, std::vector<Vector*>, decltype(later)> running(later);
  const double vectors = static_cast<double>(pixels.size()) / static_cast<double>(policy.lanes);
  std::vector<Vector> slots(static_cast<std::size_t>(std::max(1.0, vectors / vectors_per_slot)), Vector(policy.lanes));
  std::size_t next = 0;
  for (Vector& slot : slots) running.push(&slot);
  double end = 0.0;
  while (!running.empty()) {
    Vector& vector = *running.top();
    running.pop();
    if (policy.takes_next || vector.done()) vector.fill(pixels, next);
    if (vector.done()) {
      end = std::max(end, vector.time);
      continue;
    }
    vector.round(policy.chunk, policy.events, sums);
    running.push(&vector);
  }
  const double whole = end * static_cast<double>(slots.size());
  std::printf("| %zu | %.1f | %s | %d | %d | %.1f | %.1f | %.1f | %.0f | %.2f |\n", policy.lanes, vectors_per_slot,
              policy.takes_next ? "next pixel" : "-", policy.chunk, policy.events, sums.steps / sums.vectors_steps,
              sums.events / sums.vectors_events, sums.instructions / sums.steps, 100.0 * sums.instructions / whole,
              whole / sums.steps);
}

void measure(core::Recording& recording, const std::filesystem::path& file, const bench::RecordingOptions& options) {
  constexpr std::uint32_t square = 8;
  const std::uint32_t size = options.size / square * square;
  std::vector<Paths> recorded;
  recorded.reserve(std::size_t{size} * size);
  std::vector<const Paths*> pixels;
  double steps = 0.0;
  for (std::uint32_t i = 0; i < size * size; ++i) {
    const std::uint32_t number = i / (square * square);
    const std::uint32_t within = i % (square * square);
    const glm::uvec2 corner(number % (size / square), number / (size / square));
    pixels.push_back(&recorded.emplace_back(
        record(recording, square * corner + glm::uvec2(within % square, within / square), options.samples)));
    steps += static_cast<double>(std::ranges::count(recorded.back(), Work::step));
  }
  std::printf(
      "\n%s: %.1f steps a path\n\n| Lanes | Vectors a place | Takes | Cells | Events | Lanes a step | an event | "
      "Instructions a lane's step | Places filled, %% | A place's instructions "
      "|\n|--:|--:|---|--:|--:|--:|--:|--:|--:|--:|\n",
      file.filename().c_str(), steps / static_cast<double>(pixels.size()) / options.samples);
  for (const std::size_t lanes : {std::size_t{32}, std::size_t{8}}) {
    for (const double vectors_per_slot : {2.6, 10.0}) {
      for (const bool takes_next : {false, true}) simulate(pixels, {lanes, takes_next}, vectors_per_slot);
    }
  }
  for (const int chunk : {4, 32}) simulate(pixels, {32, false, chunk}, 10.0);
  for (const int events : {2, 32}) simulate(pixels, {32, false, 8, events}, 10.0);
}

}  // namespace

int main(int argc, char** argv) { return bench::record_files(argc, argv, "cumulet-bench-lanes", measure); }
