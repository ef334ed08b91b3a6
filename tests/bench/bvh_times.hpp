#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "statistics.hpp"
#include "support/meshes.hpp"

namespace cumulet::bench {

/// Our time and Embree's, measured in turn. Without Embree only ours.
struct Duel {
  Spread ours;
  std::optional<Spread> theirs;
  std::optional<Spread> ratio;  ///< ours over theirs, repeat by repeat
};

/// Seconds per unit of `amount`, or for a rate, `amount` per second.
Duel duel(int repeats, double amount, bool rate, const std::function<void()>& ours,
          const std::function<void()>& theirs);

/// A mesh for measuring BVHs.
struct TreeMesh {
  std::string name;
  test::Mesh mesh;
  [[nodiscard]] double millions() const { return static_cast<double>(mesh.indices.size()) / 3e6; }
};

/// A terrain, a sphere and a soup of about this many triangles each.
std::vector<TreeMesh> tree_meshes(std::size_t triangles);

/// Times of the BVH (src/surface/bvh.hpp) in seconds per million triangles.
struct TreeTimes {
  std::string name;
  double millions = 0.0;
  Duel build;
  Duel refit;
};
TreeTimes time_tree(const TreeMesh& mesh, int repeats);

}  // namespace cumulet::bench
