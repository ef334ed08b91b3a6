#include "grid/priorities.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <memory>
#include <tuple>

#include "base/error.hpp"
#include "base/progress_part.hpp"
#include "grid/evaluation.hpp"

namespace cumulet::grid {

namespace {

using glm::ivec3;

// Level, within a brick, of the cells that split at a point of its 9^3. Returns brick_levels for its corners, at which
// no cell splits.
unsigned level_in_brick(const ivec3& point) {
  const std::uint32_t octave = point == ivec3(0) ? 3 : core::cm_octave(point);
  return octave >= 3 ? brick_levels : core::cm_split_level(point, octave, 4) - 1;
}

unsigned index_of(const ivec3& point) { return static_cast<unsigned>((point.x * 9 + point.y) * 9 + point.z); }

struct Points {
  BrickPoints points;
  BrickPointIndices index{};  // indexed by index_of()
  Points() {
    unsigned count = 0;
    for (unsigned level = 0; level < brick_levels; ++level) {
      for (int i = 0; i < 729; ++i) {
        const ivec3 point(i / 81, i / 9 % 9, i % 9);
        if (level_in_brick(point) != level) continue;
        index[index_of(point)] = static_cast<std::uint16_t>(count);
        points[count++] = glm::u8vec3(point);
      }
    }
  }
};

const Points& points() {
  static const Points all;
  return all;
}

// Priorities of one cube, indexed as brick_points().
using Found = std::array<std::uint16_t, points_of_levels.back()>;

unsigned levels_of(const Found& found) {
  unsigned levels = brick_levels;
  while (levels > 0 && std::all_of(found.begin() + points_of_levels[levels - 1],
                                   found.begin() + points_of_levels[levels], [](auto p) { return p == 0; }))
    --levels;
  return levels;
}

// Cubes in which any of the fields varies, without duplicates.
struct CubeKey {
  int log2_size;
  ivec3 corner;
  [[nodiscard]] auto key() const { return std::tie(log2_size, corner.x, corner.y, corner.z); }
};
std::vector<CubeKey> cubes_of(const Evaluations& evaluations, int log2_size, const Progress* progress) {
  std::vector<CubeKey> cubes;
  std::size_t fields = 0;
  for (const Evaluation& evaluation : evaluations) {
    ++fields;
    for (int size = 3; size <= log2_size; ++size) {
      check(progress);
      for (const std::uint32_t n : evaluation.statistics().nodes_of_size(size))
        cubes.push_back({size, evaluation.statistics().nodes()[n].corner});
    }
  }
  if (fields == 1) return cubes;
  std::ranges::sort(cubes, {}, [](const CubeKey& cube) { return cube.key(); });
  const auto same = [](const CubeKey& a, const CubeKey& b) { return a.key() == b.key(); };
  cubes.erase(std::unique(cubes.begin(), cubes.end(), same), cubes.end());
  return cubes;
}

void find(const Evaluations& evaluations, const CubeKey& cube, int log2_size, float floor, BrickSums& sums,
          Found& found) {
  const Points& all = points();
  found.fill(0);
  for (const Evaluation& evaluation : evaluations) {
    const Statistics::Node& node = evaluation.statistics().node_at(cube.corner, cube.log2_size);
    if (node.log2_size != cube.log2_size || node.is_uniform()) continue;
    evaluation.node(node, splitting_levels(log2_size), sums, floor, [&](const ivec3& vertex, float squared) {
      const ivec3 point = (vertex - cube.corner) >> (cube.log2_size - 3);
      std::uint16_t& most = found[all.index[index_of(point)]];
      most = std::max(most, quantize(squared));
    });
  }
}

constexpr std::uint64_t max_values = std::uint64_t{1} << 32U;
[[noreturn]] void refuse_values(std::size_t bricks) {
  throw Error(ErrorCode::unsupported, "refinement criteria for " + std::to_string(bricks) +
                                          " bricks: the limit is 2^32 values; raise the threshold");
}

}  // namespace

const BrickPoints& brick_points() { return points().points; }

const BrickPointIndices& brick_point_indices() { return points().index; }

OwnPriorities::OwnPriorities(const Statistics& statistics, const Channels& channels, const RefineSettings& settings,
                             Progress* progress)
    : log2_size(statistics.cube().log2_size) {
  const Evaluations evaluations(statistics, channels, settings, progress);
  const double threshold = std::max(settings.threshold, 0.0);
  const auto floor = static_cast<float>(threshold * threshold);
  const bool on_device = statistics.on_device() != nullptr;
  const std::vector<CubeKey> cubes = cubes_of(evaluations, log2_size, progress);
  // Threads fill separate pieces, which are then concatenated.
  constexpr std::size_t piece = 64;
  struct Piece {
    std::vector<Node> nodes;
    std::vector<std::uint16_t> values;
  };
  std::vector<Piece> pieces((cubes.size() + piece - 1) / piece);
  ProgressPart part(progress, 0.02, 0.5, cubes.size());
  tbb::parallel_for(std::size_t{0}, pieces.size(), [&](std::size_t p) {
    const auto sums = std::make_unique<BrickSums>();
    const auto found = std::make_unique<Found>();
    const std::size_t end = std::min(cubes.size(), (p + 1) * piece);
    for (std::size_t i = p * piece; i < end; ++i) {
      const CubeKey& cube = cubes[i];
      if (on_device && cube.log2_size == 3) continue;
      find(evaluations, cube, log2_size, floor, *sums, *found);
      const unsigned levels = levels_of(*found);
      if (levels == 0) continue;
      pieces[p].nodes.emplace_back(core::cm_node_words(cube.corner, static_cast<std::uint32_t>(cube.log2_size), levels),
                                   static_cast<std::uint32_t>(pieces[p].values.size()));
      pieces[p].values.insert(pieces[p].values.end(), found->begin(), found->begin() + points_of_levels[levels]);
    }
    part.add(end - p * piece);
  });
  std::size_t all_nodes = 0;
  std::size_t all_values = 0;
  for (const Piece& p : pieces) {
    all_nodes += p.nodes.size();
    all_values += p.values.size();
  }
  if (all_values >= max_values) refuse_values(all_nodes);
  if (on_device) values.reserve(all_values + 1);
  nodes.reserve(all_nodes);
  values.reserve(all_values);
  for (Piece& p : pieces) {
    check(progress);
    for (const Node& node : p.nodes) nodes.emplace_back(node.x, node.y, node.z + std::uint32_t(values.size()));
    values.insert(values.end(), p.values.begin(), p.values.end());
    p = {};
  }
  if (!on_device) return;
  std::vector<ivec3> bricks;
  for (const CubeKey& cube : cubes) {
    if (cube.log2_size == 3) bricks.push_back(cube.corner);
  }
  plan_to_rate(evaluations, bricks, floor);
}

void OwnPriorities::plan_to_rate(const Evaluations& evaluations, const std::vector<ivec3>& bricks, float floor) {
  // The GPU writes two values per word, so nodes must not share a word.
  if (values.size() % 2 != 0) values.push_back(0);
  to_rate.first_node = nodes.size();
  to_rate.edges_squared = brick_edges(evaluations.begin()->statistics().cube().to_world);
  for (const Evaluation& evaluation : evaluations) to_rate.fields.push_back({evaluation.measure(floor), {}});
  for (const ivec3& corner : bricks) {
    const auto number = static_cast<std::uint32_t>(nodes.size() - to_rate.first_node);
    unsigned max_levels = 0;
    auto field = to_rate.fields.begin();
    for (const Evaluation& evaluation : evaluations) {
      BricksToRate::Field& of = *field++;
      const Statistics::Node& brick = evaluation.statistics().node_at(corner, 3);
      if (brick.log2_size != 3 || brick.is_uniform()) continue;
      const unsigned levels = evaluation.levels_at_most(brick, floor);
      if (levels == 0) continue;
      of.nodes.push_back(number);
      max_levels = std::max(max_levels, levels);
    }
    if (max_levels == 0) continue;
    const std::size_t first = all_values();
    if (first >= max_values) refuse_values(nodes.size());
    nodes.emplace_back(core::cm_node_words(corner, 3, max_levels), static_cast<std::uint32_t>(first));
    to_rate.values += (points_of_levels[max_levels] + 1) / 2 * 2;
    const Transmittance* transmittance = evaluations.transmittance();
    if (transmittance == nullptr) continue;
    if (const float* lit = transmittance->blocks(corner)) {
      to_rate.lit.insert(to_rate.lit.end(), lit, lit + Transmittance::blocks_per_brick);
    } else {
      to_rate.lit.resize(to_rate.lit.size() + Transmittance::blocks_per_brick, 1.0F);
    }
  }
}

std::vector<std::uint8_t> OwnPriorities::levels(const Cube& cube, const RefineSettings& settings,
                                                std::span<const std::uint8_t> before, const Progress* progress) const {
  std::vector<std::uint8_t> wanted = levels(ViewLevels(cube, settings), progress);
  const std::vector<std::uint8_t> most = levels(ViewLevels(cube, with_slack(settings)), progress);
  for (std::size_t i = 0; i < wanted.size(); ++i) wanted[i] = std::max(wanted[i], std::min(before[i], most[i]));
  return wanted;
}

std::vector<std::uint8_t> OwnPriorities::levels(const ViewLevels& view, const Progress* progress) const {
  std::vector<std::uint8_t> levels;
  resize(levels, nodes.size(), progress);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, nodes.size(), 1024), [&](const auto& range) {
    check(progress);
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      const int size = static_cast<int>(core::cm_node_size(nodes[i]));
      const int allowed = static_cast<int>(view.in(core::cm_node_corner(nodes[i]), size)) - kuhn_level(log2_size, size);
      levels[i] = static_cast<std::uint8_t>(std::clamp(allowed, 0, static_cast<int>(core::cm_node_levels(nodes[i]))));
    }
  });
  return levels;
}

}  // namespace cumulet::grid
