// Simulates which order of cell records would suit a GPU's caches best, and how much coarse ancestors could save. Run
// by hand:
//
//     cumulet-bench-locality [--threshold T] [--optical-depth D] [--size PIXELS] [--samples N] FILE...
//
// Paths record the cells that they traverse (recording.hpp). Waves of 8 x 8 pixels run in lockstep, 16 of them in turn
// on each of four compute units. Each unit has a first-level cache, and all share a second-level cache. Both are 16-way
// LRU caches. Orders are permutations of the same records.
#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <filesystem>
#include <headless.hpp>
#include <numeric>
#include <random>
#include <string>
#include <unordered_map>
#include <vector>

#include "recording.hpp"

namespace {

using namespace cumulet;
using Order = std::vector<std::uint32_t>;  // position of each cell

constexpr std::uint32_t wave_side = 8;
constexpr std::size_t units = 4;
constexpr std::size_t waves_a_unit = 16;
constexpr std::size_t ways = 16;

using Options = bench::RecordingOptions;

/// The cells of one pixel's paths, in order.
using Visits = std::vector<std::uint32_t>;

class Cache {
 public:
  Cache(std::size_t bytes, std::size_t line) : sets_(std::max<std::size_t>(1, bytes / line / ways)) {}
  /// Returns whether the line was cached.
  bool touch(std::uint64_t line) {
    std::vector<std::uint64_t>& set = sets_[line % sets_.size()];
    const auto found = std::ranges::find(set, line);
    const bool hit = found != set.end();
    if (hit) set.erase(found);
    set.insert(set.begin(), line);
    if (set.size() > ways) set.pop_back();
    return hit;
  }

 private:
  std::vector<std::vector<std::uint64_t>> sets_;  // the newest first
};

struct Traffic {
  double lines = 0.0, first_misses = 0.0, second_misses = 0.0;  // per step of a path
};

/// A wave in progress.
struct Wave {
  const std::vector<Visits>* lanes = nullptr;
  std::size_t step = 0;
};

Traffic simulate(const std::vector<std::vector<Visits>>& waves, const Order& order, std::size_t line,
                 std::size_t record_bytes, std::size_t first_bytes, std::size_t second_bytes) {
  std::vector<Cache> first(units, Cache(first_bytes, line));
  Cache second(second_bytes, line);
  std::array<std::deque<std::size_t>, units> waiting;
  for (std::size_t i = 0; i < waves.size(); ++i) waiting[i % units].push_back(i);
  std::array<std::vector<Wave>, units> resident;
  Traffic traffic;
  double steps = 0.0;
  std::vector<std::uint64_t> lines;
  for (bool busy = true; busy;) {
    busy = false;
    for (std::size_t unit = 0; unit < units; ++unit) {
      auto& here = resident[unit];
      std::erase_if(here, [](const Wave& wave) {
        return std::ranges::all_of(*wave.lanes, [&](const Visits& lane) { return lane.size() <= wave.step; });
      });
      while (here.size() < waves_a_unit && !waiting[unit].empty()) {
        here.push_back({&waves[waiting[unit].front()]});
        waiting[unit].pop_front();
      }
      busy = busy || !here.empty();
      for (Wave& wave : here) {
        lines.clear();
        for (const Visits& lane : *wave.lanes) {
          if (lane.size() <= wave.step) continue;
          lines.push_back(order[lane[wave.step]] * record_bytes / line);
          steps += 1.0;
        }
        ++wave.step;
        std::ranges::sort(lines);
        lines.erase(std::unique(lines.begin(), lines.end()), lines.end());
        for (const std::uint64_t at : lines) {
          traffic.lines += 1.0;
          if (first[unit].touch(at)) continue;
          traffic.first_misses += 1.0;
          if (!second.touch(at)) traffic.second_misses += 1.0;
        }
      }
    }
  }
  traffic.lines /= steps;
  traffic.first_misses /= steps;
  traffic.second_misses /= steps;
  return traffic;
}

Order by_key(const std::vector<std::uint64_t>& keys) {
  std::vector<std::uint32_t> cells(keys.size());
  std::iota(cells.begin(), cells.end(), 0U);
  std::ranges::stable_sort(cells, {}, [&](std::uint32_t cell) { return keys[cell]; });
  Order order(keys.size());
  for (std::uint32_t position = 0; position < cells.size(); ++position) order[cells[position]] = position;
  return order;
}

std::array<glm::vec3, 4> vertices_of(const grid::CellRecord& record) {
  const glm::vec3 v0 = core::cm_record_v0(record.data);
  const std::uint32_t shape = core::cm_record_shape(record.data);
  return {v0, core::cm_cell_vertex(v0, shape, 1), core::cm_cell_vertex(v0, shape, 2),
          core::cm_cell_vertex(v0, shape, 3)};
}

std::uint64_t spread_bits(std::uint64_t x) {
  std::uint64_t spread = 0;
  for (unsigned i = 0; i < 21; ++i) spread |= (x >> i & 1U) << (3U * i);
  return spread;
}

/// In eighths of a voxel.
glm::uvec3 middle_of(const grid::CellRecord& record) {
  const auto v = vertices_of(record);
  return glm::uvec3(8.0F * 0.25F * (v[0] + v[1] + v[2] + v[3]));
}

/// Interleaves bits, those of x first.
std::uint64_t interleaved(const glm::uvec3& p) {
  return spread_bits(p.x) << 2U | spread_bits(p.y) << 1U | spread_bits(p.z);
}

Order morton(const grid::TetGrid& grid) {
  std::vector<std::uint64_t> keys;
  for (const grid::CellRecord& record : grid.cells) keys.push_back(interleaved(middle_of(record)));
  return by_key(keys);
}

/// Hilbert's curve: Skilling, "Programming the Hilbert curve", 2004.
Order hilbert(const grid::TetGrid& grid) {
  const std::uint32_t top = 1U << static_cast<unsigned>(grid.cube.log2_size + 2);
  std::vector<std::uint64_t> keys;
  for (const grid::CellRecord& record : grid.cells) {
    glm::uvec3 x = middle_of(record);
    for (std::uint32_t bit = top; bit > 1; bit >>= 1U) {
      for (int i = 0; i < 3; ++i) {
        const std::uint32_t turned = (x[0] ^ x[i]) & (bit - 1);
        if ((x[i] & bit) != 0) {
          x[0] ^= bit - 1;
        } else {
          x[0] ^= turned;
          x[i] ^= turned;
        }
      }
    }
    for (int i = 1; i < 3; ++i) x[i] ^= x[i - 1];
    std::uint32_t rest = 0;
    for (std::uint32_t bit = top; bit > 1; bit >>= 1U) {
      if ((x[2] & bit) != 0) rest ^= bit - 1;
    }
    keys.push_back(interleaved(x ^ rest));
  }
  return by_key(keys);
}

/// Depth first along a Sierpinski curve: first the child at the end of the split edge where the curve enters. In a cell
/// traversed backwards it is the other child. Of two children, the second is traversed backwards. So the curve leaves
/// the first child where it enters the second, if their own edges meet there.
class ThereAndBack {
 public:
  explicit ThereAndBack(const grid::TetGrid& grid) : order(grid.cells.size()), grid_(grid) {
    for (std::size_t root = 0; root < 24; ++root) {
      const grid::RootEntry& entry = grid.roots[root];
      visit(entry.first_leaf, entry.first_internal, grid.roots[root + 1].first_internal - entry.first_internal, false);
    }
  }
  Order order;

 private:
  void visit(std::uint32_t leaf, std::uint32_t node, std::uint32_t inside, bool back) {
    if (inside == 0) {
      order[leaf] = next_++;
      return;
    }
    const std::uint32_t left = grid_.tree[node];
    for (const bool second : {false, true}) {
      if (second == back)
        visit(leaf, node + 1, left, second);
      else
        visit(leaf + left + 1, node + left + 1, inside - left - 1, second);
    }
  }
  const grid::TetGrid& grid_;
  std::uint32_t next_ = 0;
};

/// Sorted by level; inside a level in the current order.
Order by_level(const grid::TetGrid& grid) {
  std::vector<std::uint64_t> keys;
  for (const grid::CellRecord& record : grid.cells) {
    const auto v = vertices_of(record);
    const double volume =
        std::abs(glm::dot(glm::cross(glm::dvec3(v[1] - v[0]), glm::dvec3(v[2] - v[0])), glm::dvec3(v[3] - v[0])));
    keys.push_back(static_cast<std::uint64_t>(64.0 - std::log2(volume)));
  }
  return by_key(keys);
}

Order shuffled(std::size_t count) {
  Order order(count);
  std::iota(order.begin(), order.end(), 0U);
  std::mt19937 random(1);
  std::ranges::shuffle(order, random);
  return order;
}

/// Groups cells into lines by how often these paths visit them in succession. This needs the paths in advance, so it is
/// a bound that no order reaches.
Order foreseen(const std::vector<std::vector<Visits>>& waves, std::size_t count, std::size_t in_line) {
  std::unordered_map<std::uint64_t, std::uint32_t> often;
  for (const auto& wave : waves) {
    for (const Visits& lane : wave) {
      for (std::size_t i = 1; i < lane.size(); ++i) {
        const auto [a, b] = std::minmax(lane[i - 1], lane[i]);
        if (a != b) ++often[std::uint64_t{a} << 32U | b];
      }
    }
  }
  std::vector<std::pair<std::uint64_t, std::uint32_t>> pairs(often.begin(), often.end());
  std::ranges::sort(pairs, [](const auto& a, const auto& b) {
    return a.second != b.second ? a.second > b.second : a.first < b.first;
  });
  std::vector<std::uint32_t> group(count);
  std::iota(group.begin(), group.end(), 0U);
  std::vector<std::vector<std::uint32_t>> members(count);
  for (std::uint32_t cell = 0; cell < count; ++cell) members[cell] = {cell};
  for (const auto& [pair, times] : pairs) {
    std::uint32_t a = group[pair >> 32U];
    std::uint32_t b = group[pair & 0xffffffffU];
    if (a == b || members[a].size() + members[b].size() > in_line) continue;
    if (a > b) std::swap(a, b);
    for (const std::uint32_t cell : members[b]) group[cell] = a;
    members[a].insert(members[a].end(), members[b].begin(), members[b].end());
    members[b].clear();
  }
  // Full groups first, so that lines contain no parts of others.
  std::vector<std::uint64_t> keys(count);
  for (std::uint32_t cell = 0; cell < count; ++cell) {
    const std::uint64_t missing = in_line - members[group[cell]].size();
    keys[cell] = missing << 40U | group[cell];
  }
  return by_key(keys);
}

/// The largest ancestors inside which density varies by at most a fraction of the volume's maximum.
class Ancestors {
 public:
  Ancestors(const core::Recording& recording, float most) : grid_(*recording.grid), most_(most) {
    region.resize(grid_.cells.size());
    for (std::uint32_t cell = 0; cell < grid_.cells.size(); ++cell) {
      Range range;
      for (const glm::vec3& vertex : vertices_of(grid_.cells[cell])) {
        const float density = std::max(0.0F, recording.density_at(cell, vertex));
        range.low = std::min(range.low, density);
        range.high = std::max(range.high, density);
      }
      ranges_.push_back(range);
    }
    for (std::size_t root = 0; root < 24; ++root) {
      const grid::RootEntry& entry = grid_.roots[root];
      visit(entry.first_leaf, entry.first_internal, grid_.roots[root + 1].first_internal - entry.first_internal);
    }
  }
  std::vector<std::uint32_t> region;  ///< of each cell: the first cell of the ancestor

 private:
  struct Range {
    float low = 1e30F, high = -1e30F;
  };
  Range visit(std::uint32_t leaf, std::uint32_t node, std::uint32_t inside) {
    if (inside == 0) {
      region[leaf] = leaf;
      return ranges_[leaf];
    }
    const std::uint32_t left = grid_.tree[node];
    const Range a = visit(leaf, node + 1, left);
    const Range b = visit(leaf + left + 1, node + left + 1, inside - left - 1);
    const Range all{std::min(a.low, b.low), std::max(a.high, b.high)};
    if (all.high - all.low <= most_) std::fill_n(region.begin() + leaf, inside + 1, leaf);
    return all;
  }
  const grid::TetGrid& grid_;
  float most_;
  std::vector<Range> ranges_;
};

void print_ancestors(const core::Recording& recording, const std::vector<std::vector<Visits>>& waves) {
  for (const float most : {0.0F, 1e-3F, 1e-2F}) {
    const Ancestors ancestors(recording, most);
    double steps = 0.0;
    double merged = 0.0;
    double dark = 0.0;
    for (const auto& wave : waves) {
      for (const Visits& lane : wave) {
        for (std::size_t i = 0; i < lane.size(); ++i) {
          steps += 1.0;
          if (i == 0 || ancestors.region[lane[i]] != ancestors.region[lane[i - 1]]) merged += 1.0;
          const glm::uvec4 data = recording.grid->cells[lane[i]].data;
          if (data.z == 0U) dark += 1.0;
        }
      }
    }
    std::printf(
        "Density alike within %g of the maximum: %.1f %% of the steps are within the ancestor of the one "
        "before; %.1f %% are in empty cells\n",
        double{most}, 100.0 * (1.0 - merged / steps), 100.0 * dark / steps);
  }
}

std::vector<std::vector<Visits>> record(core::Recording& recording, const Options& options) {
  std::vector<std::vector<Visits>> waves;
  for (std::uint32_t y = 0; y < options.size; y += wave_side) {
    for (std::uint32_t x = 0; x < options.size; x += wave_side) {
      auto& wave = waves.emplace_back();
      for (std::uint32_t i = 0; i < wave_side * wave_side; ++i) {
        recording.march = [&visits = wave.emplace_back()](std::uint32_t cell) { visits.push_back(cell); };
        recording.traced({x + i % wave_side, y + i / wave_side});
      }
    }
  }
  return waves;
}

void measure(core::Recording& recording, const std::filesystem::path& file, const Options& options) {
  const grid::TetGrid& grid = *recording.grid;
  const auto waves = record(recording, options);
  double steps = 0.0;
  for (const auto& wave : waves) {
    for (const Visits& lane : wave) steps += static_cast<double>(lane.size());
  }
  std::printf("\n%s: %zu cells, %.1f steps a path\n\n", file.filename().c_str(), grid.cells.size(),
              steps / options.size / options.size / options.samples);
  print_ancestors(recording, waves);

  Order today(grid.cells.size());
  std::iota(today.begin(), today.end(), 0U);
  std::printf(
      "\n| Order | Line | Lines | Misses of 16 KB | of 128 KB | of 512 KB behind 16 | of 4 MB behind 128 |\n"
      "|---|--:|--:|--:|--:|--:|--:|\n");
  for (const std::size_t line : {std::size_t{64}, std::size_t{128}}) {
    struct Row {
      const char* name;
      Order order;
      std::size_t record_bytes = sizeof(grid::CellRecord);
    };
    const std::array<Row, 9> rows{{{"today: depth first", today},
                                   {"Morton", morton(grid)},
                                   {"Hilbert", hilbert(grid)},
                                   {"depth first, there and back", ThereAndBack(grid).order},
                                   {"level by level", by_level(grid)},
                                   {"shuffled", shuffled(grid.cells.size())},
                                   {"foreseen", foreseen(waves, grid.cells.size(), line / sizeof(grid::CellRecord))},
                                   {"today, 16 bytes a record", today, 16},
                                   {"Hilbert, 16 bytes a record", hilbert(grid), 16}}};
    for (const Row& row : rows) {
      const Traffic small = simulate(waves, row.order, line, row.record_bytes, 16 << 10, 512 << 10);
      const Traffic large = simulate(waves, row.order, line, row.record_bytes, 128 << 10, 4 << 20);
      std::printf("| %s | %zu | %.3f | %.3f | %.3f | %.4f | %.4f |\n", row.name, line, small.lines, small.first_misses,
                  large.first_misses, small.second_misses, large.second_misses);
      std::fflush(stdout);
    }
  }
}

}  // namespace

int main(int argc, char** argv) { return bench::record_files(argc, argv, "cumulet-bench-locality", measure); }
